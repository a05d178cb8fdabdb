//! The node hierarchy: which nodes are in the scene, and where each stands in the world.
//!
//! glTF demands a forest: every node has at most one parent and no node is its own ancestor. This is proved for the
//! whole file before the walk, which is a loop with its own stack, so that no depth of nesting exhausts ours.

use super::document::{Document, Node};
use super::problem::File;
use crate::error::Result;
use crate::math::{DMat4, DQuat, DVec3};
use crate::scene;

/// How far a rotation may be from a unit quaternion: exporters write `f32`, some of them few digits.
const QUATERNION_TOLERANCE: f64 = 1e-2;

/// Largest world coordinate \[m\]: its cube is still finite in `f32`, in which geometry computes.
const FARTHEST: f64 = 1e12;

/// A node of the scene.
pub struct Placed<'a> {
    /// Its index in `nodes`.
    pub index: usize,
    /// What the file says of it.
    pub node: &'a Node,
    /// Its place in the walk.
    pub place: u32,
    /// The place of its parent.
    pub parent: Option<u32>,
    /// From its coordinates to those of the world; every entry is finite.
    pub world: DMat4,
}

impl<'a> Placed<'a> {
    /// The same node standing at `world`.
    pub fn at(&self, world: DMat4) -> Placed<'a> {
        Placed { world, ..*self }
    }
}

impl Placed<'_> {
    /// What to call the node in a message.
    pub fn label(&self) -> String {
        match &self.node.name {
            Some(name) => format!("node `{name}`"),
            None => format!("nodes[{}]", self.index),
        }
    }

    /// What the scene remembers of the node.
    pub fn entry(&self) -> scene::Node {
        scene::Node { index: self.index, name: self.node.name.clone(), parent: self.parent, world: self.world }
    }

    /// Position of the node's origin \[m\].
    pub fn position(&self) -> DVec3 {
        self.world.w_axis.truncate()
    }

    /// Unit vector along the image of `axis`, or an error where scale 0 leaves no direction.
    pub fn direction(&self, file: File, axis: DVec3) -> Result<DVec3> {
        self.world.transform_vector3(axis).try_normalize().ok_or_else(|| self.flattened(file))
    }

    /// The error that the scale of this node or of one above leaves no direction.
    pub fn flattened(&self, file: File) -> crate::error::Error {
        file.bad(
            format_args!("nodes[{}].scale", self.index),
            "0 (its own or inherited)",
            "a scale that keeps directions",
        )
    }
}

/// The world position of `local`, or `None` where it is too far away to compute with.
pub fn to_world(world: &DMat4, local: DVec3) -> Option<DVec3> {
    let position = world.transform_point3(local);
    // Written so that NaN fails.
    (position.abs().max_element() <= FARTHEST && position.is_finite()).then_some(position)
}

/// All nodes of the scene, parents before children, in the order of the file.
pub fn walk<'a>(file: File, document: &'a Document) -> Result<Vec<Placed<'a>>> {
    let parents = parents(file, document)?;
    refuse_cycles(file, document, &parents)?;
    let mut placed = Vec::new();
    let mut stack: Vec<(usize, Option<u32>, DMat4)> = Vec::new();
    for root in roots(file, document, &parents)? {
        stack.push((root, None, DMat4::IDENTITY));
        while let Some((index, parent, above)) = stack.pop() {
            let node = &document.nodes[index];
            let place = placed.len() as u32;
            let world = above * local(file, node, index)?;
            if !world.is_finite() || to_world(&world, DVec3::ZERO).is_none() {
                let allowed = format!("positions within {FARTHEST:e} m");
                return Err(file.bad(format_args!("nodes[{index}]"), "a transform beyond all bounds", allowed));
            }
            stack.extend(node.children.iter().rev().map(|&child| (child, Some(place), world)));
            placed.push(Placed { index, node, place, parent, world });
        }
    }
    Ok(placed)
}

/// The parent of each node; a node with two is refused.
fn parents(file: File, document: &Document) -> Result<Vec<Option<usize>>> {
    let mut parents = vec![None; document.nodes.len()];
    for (i, node) in document.nodes.iter().enumerate() {
        for (j, &child) in node.children.iter().enumerate() {
            let field = format_args!("nodes[{i}].children[{j}]");
            file.item(&document.nodes, "nodes", child, field)?;
            if let Some(other) = parents[child] {
                let allowed = format!("a node without another parent (nodes[{other}] has it too)");
                return Err(file.bad(field, child, allowed));
            }
            parents[child] = Some(i);
        }
    }
    Ok(parents)
}

/// Refuses a node that is its own ancestor: where each node has one parent, such a node is reached from no root.
fn refuse_cycles(file: File, document: &Document, parents: &[Option<usize>]) -> Result<()> {
    let mut reached = vec![false; parents.len()];
    let mut stack: Vec<usize> = (0..parents.len()).filter(|&i| parents[i].is_none()).collect();
    while let Some(index) = stack.pop() {
        reached[index] = true;
        stack.extend(&document.nodes[index].children);
    }
    match reached.iter().position(|&seen| !seen) {
        None => Ok(()),
        Some(index) => {
            let children = format!("{:?}", document.nodes[index].children);
            Err(file.bad(format_args!("nodes[{index}].children"), children, "no cycle of nodes"))
        }
    }
}

/// The roots of the default scene, else of the first one, else of the whole file.
fn roots(file: File, document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>> {
    let all = || (0..parents.len()).filter(|&i| parents[i].is_none()).collect();
    let chosen = match document.scene {
        None if document.scenes.is_empty() => return Ok(all()),
        None => 0,
        Some(index) => index,
    };
    let scene = file.item(&document.scenes, "scenes", chosen, "scene")?;
    let mut listed = vec![false; parents.len()];
    for (i, &root) in scene.nodes.iter().enumerate() {
        let field = format_args!("scenes[{chosen}].nodes[{i}]");
        file.item(&document.nodes, "nodes", root, field)?;
        if parents[root].is_some() || std::mem::replace(&mut listed[root], true) {
            return Err(file.bad(field, root, "a node without parent, listed once"));
        }
    }
    Ok(scene.nodes.clone())
}

/// From the coordinates of `node` to those of its parent.
fn local(file: File, node: &Node, index: usize) -> Result<DMat4> {
    let Some(matrix) = &node.matrix else {
        let translation = DVec3::from_array(node.translation.unwrap_or([0.0; 3]));
        let scale = DVec3::from_array(node.scale.unwrap_or([1.0; 3]));
        let rotation = rotation(file, node, index)?;
        return Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation));
    };
    let field = format_args!("nodes[{index}].matrix");
    if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
        return Err(file.bad(field, "beside translation, rotation or scale", "one or the other"));
    }
    if [matrix[3], matrix[7], matrix[11], matrix[15]] != [0.0, 0.0, 0.0, 1.0] {
        return Err(file.bad(field, format!("{matrix:?}"), "a last row of 0, 0, 0, 1"));
    }
    Ok(DMat4::from_cols_array(matrix))
}

/// The rotation of `node`, of unit length.
fn rotation(file: File, node: &Node, index: usize) -> Result<DQuat> {
    let Some(written) = node.rotation else { return Ok(DQuat::IDENTITY) };
    let rotation = DQuat::from_array(written);
    // Written so that NaN fails.
    if (rotation.length() - 1.0).abs() <= QUATERNION_TOLERANCE {
        return Ok(rotation.normalize());
    }
    Err(file.bad(format_args!("nodes[{index}].rotation"), format!("{written:?}"), "a quaternion of length 1"))
}
