//! Meshes, baked into world coordinates once for each node that shows them.
//!
//! A vertex is transformed once per node and accessor: corners that coincide in the file coincide bit for bit.

use std::collections::HashMap;

use super::buffers::Buffers;
use super::document::{Document, Primitive};
use super::instances;
use super::materials::{Materials, texcoord};
use super::nodes::{Placed, to_world};
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::DVec3;
use crate::scene::Model;
use crate::scene::textures::{Charts, Textures};

/// Most vertices and most triangles of a scene: many nodes may show one mesh, so a small file may describe any number.
const MOST: usize = 1 << 26;

/// Collects the triangles of the scene.
pub struct Baker<'a> {
    file: File<'a>,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    materials: Materials<'a>,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    surface_of: Vec<u32>,
    /// Node of each triangle.
    node_of: Vec<u32>,
    /// Where textures lie.
    charts: Charts,
    /// Triangles without area, which were dropped.
    dropped: usize,
    /// How many nodes show each mesh; 0 once room is claimed for all of them.
    unclaimed: Vec<usize>,
    /// Vertices of the meshes met so far, counting every node that will show them.
    vertices_claimed: usize,
    /// Their triangles, with those to be dropped: they cost time too.
    triangles_claimed: usize,
}

/// How the vertices of a primitive make triangles.
#[derive(Clone, Copy)]
enum Mode {
    List,
    Strip,
    Fan,
}

impl<'a> Baker<'a> {
    /// Nothing yet of the meshes that `nodes` show.
    pub fn new(
        file: File<'a>,
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        materials: Materials<'a>,
        nodes: &[Placed],
    ) -> Self {
        let mut unclaimed = vec![0; document.meshes.len()];
        for node in nodes.iter().map(|placed| placed.node) {
            // A mesh that does not exist is refused when its node is reached.
            let times = node.mesh.and_then(|mesh| unclaimed.get_mut(mesh));
            let more = instances::count(document, node.extensions.instancing.as_ref());
            times.into_iter().for_each(|times: &mut usize| *times = times.saturating_add(more));
        }
        Baker {
            file,
            document,
            buffers,
            materials,
            positions: Vec::new(),
            triangles: Vec::new(),
            surface_of: Vec::new(),
            node_of: Vec::new(),
            charts: Charts::default(),
            dropped: 0,
            unclaimed,
            vertices_claimed: 0,
            triangles_claimed: 0,
        }
    }

    /// Adds mesh `index` as node `placed` shows it.
    pub fn add(&mut self, placed: &Placed, index: usize, warnings: &mut Warnings) -> Result<()> {
        // The first place of a mesh claims room for all, so what is listed here is bounded by what may be shown.
        for place in instances::places(self.file, self.buffers, placed, warnings)? {
            self.add_one(&place, index, warnings)?;
        }
        Ok(())
    }

    fn add_one(&mut self, placed: &Placed, index: usize, warnings: &mut Warnings) -> Result<()> {
        let field = format_args!("nodes[{}].mesh", placed.index);
        let mesh = self.file.item(&self.document.meshes, "meshes", index, field)?;
        let label = mesh.name.as_ref().map_or_else(|| format!("meshes[{index}]"), |name| format!("mesh `{name}`"));
        // The first node to show a mesh claims room for all of them, so that too much is refused at once.
        let times = std::mem::take(&mut self.unclaimed[index]);
        let mut first_of = HashMap::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let path = format!("meshes[{index}].primitives[{p}]");
            let Some(mode) = self.mode(primitive, &path, &label, warnings)? else { continue };
            note_ignored(primitive, &label, warnings);
            let surface = self.materials.surface(primitive, &path, &label, warnings)?;
            let vertices = self.vertices(primitive, &path, placed, times, &mut first_of)?;
            let corners = self.corners(primitive, &path, mode, vertices.1, times)?;
            let varying = self.varying(primitive, &path, surface, vertices.1)?;
            self.push(corners, vertices.0, placed, surface, varying.as_deref());
        }
        Ok(())
    }

    /// Writes what was collected into `model`.
    pub fn finish(self, model: &mut Model, warnings: &mut Warnings) {
        if self.dropped > 0 {
            warnings.add(format!("{} triangles without area were dropped", self.dropped));
        }
        model.positions = self.positions;
        model.triangles = self.triangles;
        model.surface_of = self.surface_of;
        model.nodes.of_triangle = self.node_of;
        let (surfaces, textured) = self.materials.into_surfaces();
        model.surfaces = surfaces;
        model.textures = Textures::new(textured, self.charts);
        model.drop_unused_vertices();
    }

    /// How `primitive` makes triangles; `None`, with a warning, for points and lines.
    fn mode(&self, primitive: &Primitive, path: &str, mesh: &str, warnings: &mut Warnings) -> Result<Option<Mode>> {
        match primitive.mode {
            0..=3 => {
                warnings.add(format!("{mesh}: points and lines are ignored: they have no surface"));
                Ok(None)
            }
            4 => Ok(Some(Mode::List)),
            5 => Ok(Some(Mode::Strip)),
            6 => Ok(Some(Mode::Fan)),
            other => Err(self.file.bad(format_args!("{path}.mode"), other, "0 .. 6")),
        }
    }

    /// Index of the first world vertex of `primitive`, and their number; `first_of` holds the accessors that this
    /// node has brought into the world already.
    fn vertices(
        &mut self,
        primitive: &Primitive,
        path: &str,
        placed: &Placed,
        times: usize,
        first_of: &mut HashMap<usize, (u32, usize)>,
    ) -> Result<(u32, usize)> {
        let field = format!("{path}.attributes.POSITION");
        let Some(&accessor) = primitive.attributes.get("POSITION") else {
            return Err(self.file.bad(field, "none", "an index into `accessors`"));
        };
        if let Some(&known) = first_of.get(&accessor) {
            return Ok(known);
        }
        let local = self.buffers.positions(accessor, &field)?;
        self.vertices_claimed = self.claim("vertices", self.vertices_claimed, local.len(), times, path)?;
        let first = self.positions.len() as u32;
        for (i, &position) in local.iter().enumerate() {
            let position = to_world(&placed.world, position).ok_or_else(|| {
                let field = format!("accessors[{accessor}], element {i}");
                self.file.bad(field, position, "a world position within 1e12 m of the origin")
            })?;
            self.positions.push(position);
        }
        first_of.insert(accessor, (first, local.len()));
        Ok((first, local.len()))
    }

    /// `now` and `more` vertices or triangles `times` over, refused beyond [`MOST`].
    fn claim(&self, what: &str, now: usize, more: usize, times: usize, path: &str) -> Result<usize> {
        match more.checked_mul(times).and_then(|all| all.checked_add(now)) {
            Some(total) if total <= MOST => Ok(total),
            _ => {
                let value = format!("{more} {what}, shown by {times} nodes, beside {now}");
                Err(self.file.bad(path, value, format!("at most {MOST} {what} in the scene")))
            }
        }
    }

    /// Corners of each triangle of `primitive`, numbered within its own `count` vertices.
    fn corners(
        &mut self,
        primitive: &Primitive,
        path: &str,
        mode: Mode,
        count: usize,
        times: usize,
    ) -> Result<Vec<[u32; 3]>> {
        let order = match primitive.indices {
            Some(accessor) => self.buffers.indices(accessor, &format!("{path}.indices"), count)?,
            None => (0..count as u32).collect(),
        };
        let triangles = order.len() / if matches!(mode, Mode::List) { 3 } else { 1 };
        self.triangles_claimed = self.claim("triangles", self.triangles_claimed, triangles, times, path)?;
        if order.len() < 3 || (matches!(mode, Mode::List) && order.len() % 3 != 0) {
            let allowed = if matches!(mode, Mode::List) { "a multiple of 3 vertices" } else { "3 vertices or more" };
            return Err(self.file.bad(path, order.len(), allowed));
        }
        Ok(match mode {
            Mode::List => order.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect(),
            Mode::Fan => order[1..].windows(2).map(|v| [v[0], v[1], order[0]]).collect(),
            Mode::Strip => {
                let alternate =
                    |(i, v): (usize, &[u32])| if i % 2 == 0 { [v[0], v[1], v[2]] } else { [v[0], v[2], v[1]] };
                order.windows(3).enumerate().map(alternate).collect()
            }
        })
    }

    /// For each of the `count` vertices of `primitive` its coordinates and colour, as far as `surface` wants them.
    fn varying(&self, primitive: &Primitive, path: &str, surface: u32, count: usize) -> Result<Option<Vec<Vec<f32>>>> {
        let Some((textured, sets)) = self.materials.textured(surface, primitive.material) else { return Ok(None) };
        let mut numbers = vec![Vec::with_capacity(textured.width()); count];
        let mut add = |attribute: &str, rows: Vec<&[f64]>| {
            if rows.len() != count {
                let allowed = format!("{count} elements, as POSITION has");
                return Err(self.file.bad(format_args!("{path}.attributes.{attribute}"), rows.len(), allowed));
            }
            numbers.iter_mut().zip(rows).for_each(|(own, row)| own.extend(row.iter().map(|&x| x as f32)));
            Ok(())
        };
        let accessor = |attribute: &str| (primitive.attributes[attribute], format!("{path}.attributes.{attribute}"));
        for attribute in sets.into_iter().map(texcoord) {
            let (index, field) = accessor(&attribute);
            let rows = self.buffers.rows::<2>(index, &field, &["VEC2"])?;
            add(&attribute, rows.iter().map(|row| &row[..]).collect())?;
        }
        if textured.coloured {
            let (index, field) = accessor("COLOR_0");
            let mut rows = self.buffers.colours(index, &field)?;
            rows.as_flattened_mut().iter_mut().for_each(|channel| *channel = channel.clamp(0.0, 1.0));
            add("COLOR_0", rows.iter().map(|row| &row[..]).collect())?;
        }
        Ok(Some(numbers))
    }

    /// Adds triangles of `surface` at the node `placed`, their vertices counted from `first`, with what stands at each vertex. A
    /// mirrored node turns their order round, so that the front stays the front.
    fn push(
        &mut self,
        corners: Vec<[u32; 3]>,
        first: u32,
        placed: &Placed,
        surface: u32,
        varying: Option<&[Vec<f32>]>,
    ) {
        let mirrored = placed.world.determinant() < 0.0;
        for [a, b, c] in corners {
            let own = if mirrored { [a, c, b] } else { [a, b, c] };
            let triangle = own.map(|corner| first + corner);
            let [p, q, r] = triangle.map(|corner| self.positions[corner as usize]);
            if (q - p).cross(r - p).length() > 0.0 {
                if let Some(numbers) = varying {
                    self.charts.push(self.triangles.len(), own.map(|corner| &numbers[corner as usize][..]));
                }
                self.triangles.push(triangle);
                self.surface_of.push(surface);
                self.node_of.push(placed.place);
            } else {
                self.dropped += 1;
            }
        }
    }
}

/// Lists what of `primitive` has no effect.
fn note_ignored(primitive: &Primitive, mesh: &str, warnings: &mut Warnings) {
    if !primitive.targets.is_empty() {
        warnings.add(format!("{mesh}: morph targets are ignored: the mesh keeps its basic shape"));
    }
    if primitive.attributes.keys().any(|name| name.starts_with("COLOR_") && name != "COLOR_0") {
        warnings.add(format!("{mesh}: vertex colours beyond COLOR_0 are ignored"));
    }
    if primitive.attributes.contains_key("NORMAL") {
        warnings.add("interpolated normals are not used: all cosines are those of the geometry");
    }
}
