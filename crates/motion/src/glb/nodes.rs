//! The nodes of a file that are a skeleton.

use std::collections::HashMap;

use dynaskin_glb::{Document, GlbError, f32_at};
use glam::{DAffine3, DMat4, DQuat, DVec3, Mat4, Quat, Vec3};
use gltf::json::accessor::{ComponentType, Type};

use super::humanoid;

/// More nodes than any character has.
const MAX_NODES: usize = 8_192;

/// Where a node is in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
}

/// A node of the skeleton.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its index in the file.
    pub index: usize,
    /// Its part of a person, as the file names it; empty for what only stands between.
    pub name: String,
    /// Index of the parent among the skeleton's nodes, which comes before it.
    pub parent: Option<usize>,
    pub rest: Local,
    /// Where the skin's inverse bind matrices say that the joint rests, in the space of the skin's
    /// vertices; none for what is no joint of the skin, and in VRM files, whose nodes are the rest pose.
    pub bind: Option<DAffine3>,
}

/// The skeleton's nodes, parents first: those that name a part of a person, and their ancestors.
pub fn skeleton(file: &Document<'_>) -> Result<Vec<Node>, GlbError> {
    let nodes = &file.root.nodes;
    if nodes.len() > MAX_NODES {
        let expected = format!("at most {MAX_NODES}, got {}", nodes.len());
        return Err(GlbError::new("nodes", expected));
    }
    let parents = parents(file)?;
    let names = names(file);
    let mut is_kept = vec![false; nodes.len()];
    for idx in (0..nodes.len()).filter(|idx| !names[*idx].is_empty()) {
        let mut above = Some(idx);
        while let Some(node) = above.filter(|node| !is_kept[*node]) {
            is_kept[node] = true;
            above = parents[node];
        }
    }
    let mut binds = binds(file);
    let mut skeleton: Vec<Node> = Vec::new();
    // Nodes still to be taken, each with its parent's place in the skeleton.
    let mut open: Vec<(usize, Option<usize>)> = (0..nodes.len())
        .rev()
        .filter(|idx| parents[*idx].is_none() && is_kept[*idx])
        .map(|root| (root, None))
        .collect();
    while let Some((idx, parent)) = open.pop() {
        let own = skeleton.len();
        skeleton.push(Node {
            index: idx,
            name: names[idx].clone(),
            parent,
            rest: rest(file, idx)?,
            bind: binds.remove(&idx),
        });
        let children = nodes[idx].children.as_deref().unwrap_or_default();
        let kept = children.iter().map(|child| child.value()).rev();
        open.extend(
            kept.filter(|child| is_kept[*child])
                .map(|child| (child, Some(own))),
        );
    }
    Ok(skeleton)
}

/// The parent of each node.
fn parents(file: &Document<'_>) -> Result<Vec<Option<usize>>, GlbError> {
    let nodes = &file.root.nodes;
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
fn names(file: &Document<'_>) -> Vec<String> {
    let count = file.root.nodes.len();
    let mut bones = humanoid::bone_names(file);
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

/// Rest transforms of the joints of the skin that has the most, by node. What cannot be read or turned
/// round is left out: then the nodes tell.
fn binds(file: &Document<'_>) -> HashMap<usize, DAffine3> {
    let mut binds = HashMap::new();
    if !humanoid::bone_names(file).is_empty() {
        return binds;
    }
    let skins = file.root.skins.iter();
    let Some(skin) = skins
        .filter(|skin| skin.inverse_bind_matrices.is_some())
        .max_by_key(|skin| skin.joints.len())
    else {
        return binds;
    };
    let Some(matrices) = skin.inverse_bind_matrices.and_then(|index| {
        file.elements(index.value(), ComponentType::F32, Type::Mat4)
            .ok()
    }) else {
        return binds;
    };
    for (joint, element) in skin.joints.iter().zip(matrices.iter()) {
        let numbers: [f64; 16] = std::array::from_fn(|k| f64::from(f32_at(element, k)));
        let inverse = DMat4::from_cols_array(&numbers);
        let bind = DAffine3::from_mat4(inverse.inverse());
        if inverse.is_finite() && bind.is_finite() && bind.matrix3.determinant() > 0.0 {
            binds.insert(joint.value(), bind);
        }
    }
    binds
}

fn rest(file: &Document<'_>, idx: usize) -> Result<Local, GlbError> {
    let node = &file.root.nodes[idx];
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
        Err(GlbError::new(format!("node {idx}"), expected))
    }
}
