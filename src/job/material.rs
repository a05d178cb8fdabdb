//! What a job says of materials: laws of reflection in the place of those of the scene file.

use super::Job;
use super::check::Checker;
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// Largest exponent of a Phong lobe.
const MOST_EXPONENT: f64 = 1e6;
/// Largest refractive index.
const MOST_INDEX: f64 = 10.0;
/// Rounding that sums of reflectances may show.
const NIL: f64 = 1e-12;

/// `[[material]]`: a law in the place of that of a material of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, tag = "kind", rename_all = "snake_case")]
pub enum Material {
    /// The same luminance in all directions.
    Lambert {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// Reflectance.
        reflectance: Share,
    },
    /// A mirror, of the same reflectance at every angle.
    Mirror {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// Reflectance.
        reflectance: Share,
    },
    /// A cosine lobe about the mirrored direction over a Lambert part.
    Phong {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// Reflectance of the Lambert part.
        diffuse: Share,
        /// Reflectance of the lobe at normal incidence.
        specular: Share,
        /// The power of the cosine.
        exponent: f64,
    },
    /// Lambert reflection and Lambert transmission, the same from both sides.
    Opal {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// Reflectance.
        reflectance: Share,
        /// Transmittance.
        transmittance: Share,
    },
    /// A thin pane of polished glass.
    Pane {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// Refractive index.
        #[serde(default = "index_of_glass")]
        ior: f64,
        /// What is let through along the normal, all reflections counted; left out: as clear glass.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        transmittance: Option<Share>,
    },
    /// The surface of a body of polished glass, its front outside.
    Glass {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// Refractive index.
        #[serde(default = "index_of_glass")]
        ior: f64,
        /// What is left of light after a metre inside; left out: all.
        #[serde(default = "all")]
        transmittance_per_metre: Share,
    },
    /// A law measured pair by pair.
    Tabulated {
        /// Name of a material of the scene, or else of a node.
        name: String,
        /// The table, relative to the job file.
        file: String,
    },
}

/// A share of light: of all channels, or of red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, or [red, green, blue]")]
pub enum Share {
    /// Of all channels.
    Grey(f64),
    /// Of linear Rec.709 red, green and blue.
    Rgb([f64; 3]),
}

impl Share {
    /// Channel by channel.
    pub fn channels(self) -> [f64; 3] {
        match self {
            Share::Grey(share) => [share; 3],
            Share::Rgb(channels) => channels,
        }
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&shown(self.channels()))
    }
}

/// Shares as they are typed.
fn shown(channels: [f64; 3]) -> String {
    match channels.map(f64::to_bits) {
        [r, g, b] if r == g && g == b => channels[0].to_string(),
        _ => format!("{channels:?}"),
    }
}

fn index_of_glass() -> f64 {
    1.5
}

fn all() -> Share {
    Share::Grey(1.0)
}

impl Material {
    /// Name of what it replaces.
    pub fn name(&self) -> &str {
        match self {
            Material::Lambert { name, .. }
            | Material::Mirror { name, .. }
            | Material::Phong { name, .. }
            | Material::Opal { name, .. }
            | Material::Pane { name, .. }
            | Material::Glass { name, .. }
            | Material::Tabulated { name, .. } => name,
        }
    }
}

impl Job {
    /// Numbers and files of the materials that have one, in the order of the job.
    pub fn tables(&self) -> impl Iterator<Item = (usize, &str)> {
        self.materials.iter().enumerate().filter_map(|(i, material)| match material {
            Material::Tabulated { file, .. } => Some((i, file.as_str())),
            _ => None,
        })
    }
}

/// Refuses materials out of range.
pub(super) fn check(c: &Checker, job: &Job) -> Result<()> {
    for (i, material) in job.materials.iter().enumerate() {
        let (at, name) = (format!("material[{i}]"), material.name());
        c.that(&format!("{at}.name"), name, job.scene.is_some(), "a material only with a scene")?;
        if let Some(first) = job.materials[..i].iter().position(|other| other.name() == name) {
            c.that(&format!("{at}.name"), name, false, &format!("each material once: material[{first}] has it"))?;
        }
        check_law(c, &at, material)?;
    }
    Ok(())
}

fn check_law(c: &Checker, at: &str, material: &Material) -> Result<()> {
    let share = |field: &str, share: &Share| {
        let fits = share.channels().iter().all(|x| (0.0..=1.0).contains(x));
        c.that(&format!("{at}.{field}"), share, fits, "0 .. 1")
    };
    let together = |field: &str, a: &Share, b: &Share, other: &str| {
        let sum: [f64; 3] = std::array::from_fn(|k| a.channels()[k] + b.channels()[k]);
        let fits = sum.iter().all(|&x| x <= 1.0 + NIL);
        let allowed = format!("at most 1 with {other}: no surface reflects and transmits more than it receives");
        c.that(&format!("{at}.{field}"), format!("{} in all", shown(sum)), fits, &allowed)
    };
    let index = |ior: f64| c.that(&format!("{at}.ior"), ior, (1.0..=MOST_INDEX).contains(&ior), "1 .. 10");
    match material {
        Material::Lambert { reflectance, .. } | Material::Mirror { reflectance, .. } => {
            share("reflectance", reflectance)
        }
        Material::Phong { diffuse, specular, exponent, .. } => {
            share("diffuse", diffuse)?;
            share("specular", specular)?;
            c.that(&format!("{at}.exponent"), exponent, (0.0..=MOST_EXPONENT).contains(exponent), "0 .. 1e6")?;
            together("specular", diffuse, specular, "diffuse")
        }
        Material::Opal { reflectance, transmittance, .. } => {
            share("reflectance", reflectance)?;
            share("transmittance", transmittance)?;
            together("transmittance", reflectance, transmittance, "reflectance")
        }
        Material::Pane { ior, transmittance, .. } => {
            index(*ior)?;
            transmittance.iter().try_for_each(|t| share("transmittance", t))
        }
        Material::Glass { ior, transmittance_per_metre, .. } => {
            index(*ior)?;
            share("transmittance_per_metre", transmittance_per_metre)?;
            let clear = transmittance_per_metre.channels();
            let fits = clear.iter().all(|&t| t > 0.0);
            c.that(&format!("{at}.transmittance_per_metre"), shown(clear), fits, "above 0, at most 1")
        }
        Material::Tabulated { .. } => Ok(()),
    }
}
