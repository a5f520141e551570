//! The people that VRM's extensions describe: which node is which bone.

use std::collections::{BTreeMap, HashMap};

use serde::Deserialize;

use crate::Document;

#[derive(Default, Deserialize)]
struct Extended {
    #[serde(default)]
    extensions: Extensions,
}

#[derive(Default, Deserialize)]
struct Extensions {
    #[serde(rename = "VRMC_vrm_animation")]
    animation: Option<Human<BTreeMap<String, Bone>>>,
    #[serde(rename = "VRMC_vrm")]
    model: Option<Human<BTreeMap<String, Bone>>>,
    /// VRM before version 1.
    #[serde(rename = "VRM")]
    model_0: Option<Human<Vec<NamedBone>>>,
}

#[derive(Deserialize)]
struct Human<B> {
    humanoid: Humanoid<B>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Humanoid<B> {
    human_bones: B,
}

#[derive(Deserialize)]
struct Bone {
    node: usize,
}

#[derive(Deserialize)]
struct NamedBone {
    bone: String,
    node: usize,
}

/// VRM's names (`leftUpperLeg`) of the nodes that are bones of a person; empty for files without
/// such an extension or with a broken one.
pub fn humanoid_bones(file: &Document<'_>) -> HashMap<usize, String> {
    let extended: Extended = serde_json::from_slice(file.json()).unwrap_or_default();
    let Extensions {
        animation,
        model,
        model_0,
    } = extended.extensions;
    if let Some(human) = animation.or(model) {
        let bones = human.humanoid.human_bones.into_iter();
        return bones.map(|(name, bone)| (bone.node, name)).collect();
    }
    let bones = model_0.map(|human| human.humanoid.human_bones);
    bones
        .into_iter()
        .flatten()
        .map(|bone| (bone.node, bone.bone))
        .collect()
}
