//! The nodes of a file that are a skeleton.

use std::collections::HashMap;

use dynaskin_glb::{
    Document, GlbError, Local, f32_at, humanoid_bones, local_transform, node_parents, part_names,
};
use glam::{DAffine3, DMat4};
use gltf::json::accessor::{ComponentType, Type};

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
    let parents = node_parents(file)?;
    let names = part_names(file);
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
            rest: local_transform(file, idx)?,
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

/// Rest transforms of the joints of the skin that has the most, by node. What cannot be read or turned
/// round is left out: then the nodes tell.
fn binds(file: &Document<'_>) -> HashMap<usize, DAffine3> {
    let mut binds = HashMap::new();
    if !humanoid_bones(file).is_empty() {
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
