//! The nodes of a scene file: what they are called, which hangs below which, which triangle belongs to which.
//!
//! A part of a scene is known to its user by the name of a node; it is everything that hangs at that node or below.
//! Four bytes a triangle and the names are all that is kept of the hierarchy once transforms are baked in.

use crate::error::listed;
use crate::math::DMat4;

/// A node of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its number in the file.
    pub index: usize,
    /// Its name, where it has one; nothing forbids two nodes of one name.
    pub name: Option<String>,
    /// The node that it hangs at, as a place in [`Nodes::list`] before its own.
    pub parent: Option<u32>,
    /// From its coordinates to those of the world.
    pub world: DMat4,
}

/// All nodes, and the node of each triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nodes {
    /// Parents before children.
    pub list: Vec<Node>,
    /// Of each triangle its node, a place in `list`; empty for a model that knows no nodes.
    pub of_triangle: Vec<u32>,
    /// The first surface that is a replacement of a node's mesh, and the nodes of all of them.
    pub of_replacements: (u32, Vec<u32>),
}

impl Nodes {
    /// Places of the nodes called `name`.
    pub fn called(&self, name: &str) -> Vec<usize> {
        let called = |node: &Node| node.name.as_deref() == Some(name);
        (0..self.list.len()).filter(|&place| called(&self.list[place])).collect()
    }

    /// The place of the one node called `name`; else what is allowed: `what`, and names that are known.
    pub fn only(&self, name: &str, (what, known): (&str, &[&str])) -> Result<usize, String> {
        match self.called(name)[..] {
            [place] => Ok(place),
            [first, second, ..] => {
                let [a, b] = [first, second].map(|place| self.list[place].index);
                Err(format!("the name of one node: nodes[{a}] and nodes[{b}] of the scene both have it"))
            }
            [] => Err(format!("{what}: {}", listed(name, known.iter().copied()))),
        }
    }

    /// The place of the one node called `name`, which shall show something; else what is allowed.
    pub fn only_with_surface(&self, name: &str) -> Result<usize, String> {
        self.only(name, ("a node of the scene with a surface", &self.names_with_surface()))
    }

    /// The node of the surface `primitive`; `None` for what comes from no scene file.
    pub fn of(&self, primitive: u32) -> Option<usize> {
        let (first, replacements) = &self.of_replacements;
        let replacement = || replacements.get(primitive.checked_sub(*first)? as usize);
        self.of_triangle.get(primitive as usize).or_else(replacement).map(|&place| place as usize)
    }

    /// Of each node whether it is the one at `place` or hangs below it.
    pub fn at_or_below(&self, place: usize) -> Vec<bool> {
        let mut below = vec![false; self.list.len()];
        for (i, node) in self.list.iter().enumerate() {
            below[i] = i == place || node.parent.is_some_and(|parent| below[parent as usize]);
        }
        below
    }

    /// Names of the nodes at which, or below which, there are triangles.
    pub fn names_with_surface(&self) -> Vec<&str> {
        let mut shown = vec![false; self.list.len()];
        let places = self.of_triangle.iter().chain(&self.of_replacements.1);
        places.for_each(|&place| shown[place as usize] = true);
        for (i, node) in self.list.iter().enumerate().rev() {
            if let (true, Some(parent)) = (shown[i], node.parent) {
                shown[parent as usize] = true;
            }
        }
        let named = self.list.iter().zip(shown).filter(|(_, shown)| *shown);
        named.filter_map(|(node, _)| node.name.as_deref()).collect()
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> u64 {
        let names: usize = self.list.iter().map(|n| size_of::<Node>() + n.name.as_ref().map_or(0, String::len)).sum();
        (names + 4 * self.of_triangle.len()) as u64
    }
}
