//! The nodes of a file: their tree, their places, and which of them may be parts of a person.

use glam::{DMat4, DQuat, DVec3, Mat4, Quat, Vec3};

use crate::humanoid::humanoid_bones;
use crate::{Document, GlbError};

/// More nodes than any character has.
pub const MAX_NODES: usize = 8_192;

/// Where a node is in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// In the parent's unit.
    pub translation: DVec3,
    /// A unit quaternion.
    pub rotation: DQuat,
    /// Along the node's own axes.
    pub scale: DVec3,
}

/// The parent of each node.
///
/// # Errors
/// [`GlbError`] for more than [`MAX_NODES`] nodes, children that the file lacks, a second parent, and
/// circles.
pub fn node_parents(file: &Document<'_>) -> Result<Vec<Option<usize>>, GlbError> {
    let nodes = &file.root.nodes;
    if nodes.len() > MAX_NODES {
        let expected = format!("at most {MAX_NODES}, got {}", nodes.len());
        return Err(GlbError::new("nodes", expected));
    }
    let mut parents = vec![None; nodes.len()];
    for (idx, node) in nodes.iter().enumerate() {
        for child in node.children.as_deref().unwrap_or_default() {
            let parent = parents.get_mut(child.value()).ok_or_else(|| {
                GlbError::new(format!("node {idx}"), "children that the file has")
            })?;
            if parent.replace(idx).is_some() {
                let place = format!("node {}", child.value());
                return Err(GlbError::new(place, "one parent at most"));
            }
        }
    }
    // Every node has one parent at most: what no root leads down to goes in circles.
    let mut is_reached = vec![false; nodes.len()];
    let mut open: Vec<usize> = (0..nodes.len())
        .filter(|idx| parents[*idx].is_none())
        .collect();
    while let Some(idx) = open.pop() {
        is_reached[idx] = true;
        let children = nodes[idx].children.as_deref().unwrap_or_default();
        open.extend(children.iter().map(|child| child.value()));
    }
    match is_reached.iter().position(|is_reached| !is_reached) {
        None => Ok(parents),
        Some(idx) => Err(GlbError::new(
            format!("node {idx}"),
            "a hierarchy without circles",
        )),
    }
}

/// The names of the nodes that may be parts of a person; empty for all others.
pub fn part_names(file: &Document<'_>) -> Vec<String> {
    let count = file.root.nodes.len();
    let mut bones = humanoid_bones(file);
    if !bones.is_empty() {
        return (0..count)
            .map(|idx| bones.remove(&idx).unwrap_or_default())
            .collect();
    }
    let mut is_joint = vec![file.root.skins.is_empty(); count];
    for joint in file.root.skins.iter().flat_map(|skin| &skin.joints) {
        if let Some(is_joint) = is_joint.get_mut(joint.value()) {
            *is_joint = true;
        }
    }
    let nodes = file.root.nodes.iter().zip(is_joint);
    nodes
        .map(|(node, is_joint)| {
            let name = node.name.as_ref().filter(|_| is_joint);
            name.map(|name| name.trim().to_owned()).unwrap_or_default()
        })
        .collect()
}

/// Where node `idx` is in its parent.
///
/// # Errors
/// [`GlbError`] where there is no such node, and for numbers that are no place.
pub fn local_transform(file: &Document<'_>, idx: usize) -> Result<Local, GlbError> {
    let place = || format!("node {idx}");
    let node = file
        .root
        .nodes
        .get(idx)
        .ok_or_else(|| GlbError::new(place(), "a node"))?;
    let (scale, rotation, translation) = match node.matrix {
        Some(matrix) => {
            let matrix: DMat4 = Mat4::from_cols_array(&matrix).as_dmat4();
            matrix.to_scale_rotation_translation()
        }
        None => (
            Vec3::from_array(node.scale.unwrap_or([1.0; 3])).as_dvec3(),
            node.rotation.map_or(DQuat::IDENTITY, |rotation| {
                Quat::from_array(rotation.0).as_dquat()
            }),
            Vec3::from_array(node.translation.unwrap_or_default()).as_dvec3(),
        ),
    };
    let rest = Local {
        translation,
        rotation: rotation.normalize(),
        scale,
    };
    if rest.translation.is_finite() && rest.rotation.is_finite() && rest.scale.is_finite() {
        Ok(rest)
    } else {
        let expected = "a finite translation and scale and a rotation that is none of zeros";
        Err(GlbError::new(place(), expected))
    }
}
