//! Files -> plan and scene: a job file beside its inputs becomes a plan with every input known by content, and a
//! planned folder becomes the scene again, from the copies it keeps.

mod lengths;
mod openings;

use super::degree;
use super::folder::Folder;
use super::pilot::bounds;
use super::plan::{Input, Plan, SceneSummary};
use super::receivers::ReceiverSet;
use super::regions::Regions;
use crate::error::{Error, Result};
use crate::geometry::Build;
use crate::geometry::harmonic::MAX_DEGREE;
use crate::geometry::harmonic::file::File;
use crate::job::{Degree, Job};
use crate::scene::photometric_web::Photometry;
use crate::scene::{Model, Scene, Tabulated, gltf};
use std::collections::HashMap;
use std::fs;
use std::io::Read as _;
use std::path::{Component, Path};

/// Longest text that somebody types or a laboratory writes \[bytes\].
pub const MOST_TEXT: u64 = 1 << 24;
/// Longest scene, and longest of its parts \[bytes\]: what the header of a .glb can say.
const MOST_DATA: u64 = 1 << 32;

/// A plan and the content of the files it was made from.
#[derive(Debug)]
pub struct Prepared {
    /// The plan.
    pub plan: Plan,
    /// The job file and every input with its bytes.
    pub files: Vec<(Input, Vec<u8>)>,
}

/// Reads the job file at `path` with its scene, and plans it.
///
/// # Errors
/// [`Error::Input`] for whatever the job or the scene gets wrong.
pub fn prepare(path: &Path) -> Result<Prepared> {
    let Read { job, scene, file, text, mut files } = read(path)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let job_file = Input::of(&file_name(path), text.as_bytes());
    let inputs = files.iter().map(|(input, _): &(Input, Vec<u8>)| input.clone()).collect();
    let mut summary = summary(&scene);
    summary.warnings.extend(lengths::warnings(&job, &scene));
    summary.warnings.extend(openings::warnings(&scene));
    summary.warnings.extend(ReceiverSet::check(&job, &scene, &file)?);
    Regions::check(&job, &scene, &file)?;
    let plan = Plan::new(&name, job, job_file.clone(), inputs, summary)?;
    let bounds = bounds(&plan.job, &scene);
    let plan = plan.bounded(bounds);
    files.push((job_file, text.into_bytes()));
    Ok(Prepared { plan, files })
}

/// A job with its scene, and the files both were read from.
struct Read {
    job: Job,
    scene: Scene,
    /// Name of the job file in errors, and its text.
    file: String,
    text: String,
    /// Every input with its bytes, those of the scene first.
    files: Vec<(Input, Vec<u8>)>,
}

/// The scene of the job file at `path`, nothing planned.
///
/// # Errors
/// [`Error::Input`] for whatever the job or the scene gets wrong.
pub fn read_scene(path: &Path) -> Result<Scene> {
    Ok(read(path)?.scene)
}

fn read(path: &Path) -> Result<Read> {
    let file = path.display().to_string();
    let bytes = read_at_most(path, MOST_TEXT)
        .map_err(|e| Error::input("command line", "JOB", &file, format!("a job file ({e})")))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| Error::input(&file, "(encoding)", "not UTF-8", "a job, which is a text in UTF-8"))?;
    let mut job = Job::parse(&text, &file)?;
    let mut files = Vec::new();
    let model = match &job.scene {
        Some(name) => read_model(path, name, &mut files)?,
        None => Model::default(),
    };
    let series = job.replacements.iter().enumerate().map(|(i, r)| read_series(path, i, &r.harmonic, &mut files));
    let series: Vec<File> = series.collect::<Result<_>>()?;
    let webs: Vec<Photometry> =
        job.luminaire_files().into_iter().map(|name| read_web(path, &job, name, &mut files)).collect::<Result<_>>()?;
    let tables: Vec<Tabulated> =
        job.tables().map(|(i, name)| read_table(path, i, name, &mut files)).collect::<Result<_>>()?;
    let kept = degree::is_open(&job).then(|| model.clone());
    // Planning asks few rays (one a pixel where a region names a node), and each worker builds the scene again.
    let built = |model, job: &Job| {
        let model = furnished(model, job, &file, (&series, &webs, &tables))?;
        Scene::built(model, job, Build::Quick).map_err(|error| error.in_file(&file))
    };
    let mut scene = built(model, &job)?;
    if let Some(model) = kept {
        degree::fix(&mut job, &scene);
        scene = built(model, &job)?;
    }
    Ok(Read { job, scene, file, text, files })
}

/// The scene of `plan` from the copies in `folder`.
///
/// # Errors
/// [`Error::Refused`] for a copy that is damaged; [`Error::Input`] for a scene that asks for a file not planned.
pub fn load_scene(folder: &Folder, plan: &Plan) -> Result<Scene> {
    let Parts { of_scene, of_series, of_webs, of_tables } = parts(plan)?;
    let model = match of_scene.split_first() {
        Some((first, others)) => {
            let mut fetch = |uri: &str| match others.iter().find(|i| i.name == uri) {
                Some(input) => folder.read_input(input),
                None => Err(Error::input(&first.name, "uri", uri, "a file known to the plan")),
            };
            gltf::load(&first.name, &folder.read_input(first)?, &mut fetch)?
        }
        None => Model::default(),
    };
    let series = of_series.iter().map(|input| File::parse(&input.name, &folder.read_input(input)?));
    let series: Vec<File> = series.collect::<Result<_>>()?;
    let webs = of_webs.iter().map(|input| Photometry::parse(&input.name, &folder.read_input(input)?));
    let webs: Vec<Photometry> = webs.collect::<Result<_>>()?;
    let tables = of_tables.iter().map(|input| Tabulated::parse(&input.name, &folder.read_input(input)?));
    let tables: Vec<Tabulated> = tables.collect::<Result<_>>()?;
    let model = furnished(model, &plan.job, "plan", (&series, &webs, &tables))?;
    Scene::new(model, &plan.job).map_err(|error| error.in_file("plan"))
}

/// The inputs of a plan by what they are for.
struct Parts<'a> {
    of_scene: &'a [Input],
    /// One for each `[[replace]]`.
    of_series: &'a [Input],
    /// Each file of a `[[luminaire]]` once.
    of_webs: &'a [Input],
    /// One for each tabulated `[[material]]`.
    of_tables: &'a [Input],
}

fn parts(plan: &Plan) -> Result<Parts<'_>> {
    let (series, webs) = (plan.job.replacements.len(), plan.job.luminaire_files().len());
    let tables = plan.job.tables().count();
    let Some(of_scene) = plan.inputs.len().checked_sub(series + webs + tables) else {
        let allowed = "a file for each [[replace]] and tabulated [[material]], and those of each [[luminaire]]";
        return Err(Error::input("plan", "inputs", plan.inputs.len(), allowed));
    };
    let (of_scene, others) = plan.inputs.split_at(of_scene);
    let (of_series, others) = others.split_at(series);
    let (of_webs, of_tables) = others.split_at(webs);
    Ok(Parts { of_scene, of_series, of_webs, of_tables })
}

/// `model` with the series of `job` in the place of the meshes that it names, its luminaires with their webs, and its materials.
fn furnished(
    mut model: Model,
    job: &Job,
    file: &str,
    (series, webs, tables): (&[File], &[Photometry], &[Tabulated]),
) -> Result<Model> {
    for (i, (replacement, whole)) in job.replacements.iter().zip(series).enumerate() {
        let degree = match replacement.degree {
            Some(Degree::Number(degree)) => degree as usize,
            Some(Degree::Word(_)) | None => MAX_DEGREE,
        };
        let truncated = File { series: whole.series.truncated(degree), ..whole.clone() };
        model.replace((file, &format!("replace[{i}]")), &replacement.node, truncated)?;
    }
    let table_of: HashMap<usize, &Tabulated> = job.tables().map(|(i, _)| i).zip(tables).collect();
    for (i, material) in job.materials.iter().enumerate() {
        model.paint((file, &format!("material[{i}]")), material, table_of.get(&i).copied())?;
    }
    let web_of: HashMap<&str, &Photometry> = job.luminaire_files().into_iter().zip(webs).collect();
    for (i, luminaire) in job.luminaires.iter().enumerate() {
        model.hang((file, &format!("luminaire[{i}]")), luminaire, web_of[luminaire.file.as_str()])?;
    }
    Ok(model)
}

/// The bytes of the file at `path`, at most `most` of them: a device may have no end.
///
/// # Errors
/// Those of reading, and one for a longer file.
pub fn read_at_most(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 <= most {
        true => Ok(bytes),
        false => Err(std::io::Error::other(format!("it has more than {most} bytes"))),
    }
}

/// The file `name` beside the job at `job_path`, which names it in `field`; `what` says what it shall be: its path, for errors, and its
/// bytes, which are added to `files`.
fn read_named(
    job_path: &Path,
    field: &str,
    name: &str,
    what: &str,
    files: &mut Vec<(Input, Vec<u8>)>,
) -> Result<(String, Vec<u8>)> {
    let path = job_path.parent().unwrap_or(Path::new("")).join(name);
    let bytes = read_at_most(&path, MOST_DATA).map_err(|e| {
        Error::input(job_path.display(), field, name, format!("{what}, relative to the job file ({e})"))
    })?;
    files.push((Input::of(name, &bytes), bytes.clone()));
    Ok((path.display().to_string(), bytes))
}

/// Reads the file `name` of the series of `[[replace]]` number `i` of the job at `job_path`, and adds it to `files`.
fn read_series(job_path: &Path, i: usize, name: &str, files: &mut Vec<(Input, Vec<u8>)>) -> Result<File> {
    let (path, bytes) = read_named(job_path, &format!("replace[{i}].harmonic"), name, "a .harmonic file", files)?;
    File::parse(&path, &bytes)
}

/// Reads the table `name` of `[[material]]` number `i` of the job at `job_path`, and adds it to `files`.
fn read_table(job_path: &Path, i: usize, name: &str, files: &mut Vec<(Input, Vec<u8>)>) -> Result<Tabulated> {
    let what = "a table of docs/brdf-format.md";
    let (path, bytes) = read_named(job_path, &format!("material[{i}].file"), name, what, files)?;
    Tabulated::parse(&path, &bytes)
}

/// Reads the photometric file `name` of `job` at `job_path`, and adds it to `files`.
fn read_web(job_path: &Path, job: &Job, name: &str, files: &mut Vec<(Input, Vec<u8>)>) -> Result<Photometry> {
    let first = job.luminaires.iter().position(|l| l.file == name).unwrap_or(0);
    let what = "an IES or EULUMDAT file";
    let (path, bytes) = read_named(job_path, &format!("luminaire[{first}].file"), name, what, files)?;
    Photometry::parse(&path, &bytes)
}

/// Loads the scene file `name` of the job at `job_path`; every file read is added to `files`, the scene first.
fn read_model(job_path: &Path, name: &str, files: &mut Vec<(Input, Vec<u8>)>) -> Result<Model> {
    let (path, bytes) = read_named(job_path, "scene", name, "a .glb or .gltf file", files)?;
    let mut fetch = |uri: &str| {
        if let Some((_, known)) = files[1..].iter().find(|(input, _)| input.name == uri) {
            return Ok(known.clone());
        }
        let content = read_beside(Path::new(&path), uri)?;
        files.push((Input::of(uri, &content), content.clone()));
        Ok(content)
    };
    gltf::load(&path, &bytes, &mut fetch)
}

/// A file that the scene at `path` refers to: below its folder, nowhere else.
///
/// # Errors
/// [`Error::Input`] for a path that leaves the folder, or a file that cannot be read; the scene knows the field.
pub fn read_beside(path: &Path, uri: &str) -> Result<Vec<u8>> {
    let refused = |allowed: String| Error::input(path.display(), "uri", uri, allowed);
    let inside = Path::new(uri).components().all(|c| matches!(c, Component::Normal(_)));
    if uri.is_empty() || !inside {
        return Err(refused("a file in the folder of the scene or below".to_owned()));
    }
    let beside = path.parent().unwrap_or(Path::new("")).join(uri);
    read_at_most(&beside, MOST_DATA).map_err(|e| refused(format!("a file that can be read ({e})")))
}

fn summary(scene: &Scene) -> SceneSummary {
    SceneSummary {
        triangles: scene.triangles(),
        sources: scene.sources.len() as u64,
        flux_lm: scene.sources.flux(),
        bytes: scene.bytes(),
        narrowest_lobe: scene.narrowest_lobe(),
        warnings: scene.warnings.clone(),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
