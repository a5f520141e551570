//! Animations of binary glTF files: models with a motion (`.glb`), VRM models (`.vrm`) and VRM
//! animations (`.vrma`).
//!
//! glTF knows nodes, not people. Who is who is taken, in this order, from the humanoid of the VRM
//! extensions (`VRMC_vrm_animation`, `VRMC_vrm`, `VRM`), from the names of the joints of the file's
//! skins, or from the names of all nodes.

mod humanoid;
mod nodes;
mod track;

use dynaskin_glb::{Document, GlbError};
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::animation::Property;
use gltf::json::validation::Checked;

use crate::{MAX_CLIP_FRAMES, MODEL_RATE_HZ, MotionError, SourceMotion};
use nodes::{Local, Node};
use track::Track;

/// An animation of a binary glTF file, sampled at 60 Hz.
#[derive(Clone, Debug)]
pub struct GltfMotion {
    /// The animation's name; empty where it has none.
    pub animation_name: String,
    joints: Vec<AnimatedJoint>,
    start_seconds: f64,
    frame_count: usize,
}

/// A node of the skeleton and what moves it.
#[derive(Clone, Debug)]
struct AnimatedJoint {
    name: String,
    parent: Option<usize>,
    rest: Local,
    /// Rotation and position at rest: of the skin, or of the nodes where there is none.
    rest_from_world: DQuat,
    rest_position: DVec3,
    rotation: Option<Track>,
    translation: Option<Track>,
    scale: Option<Track>,
}

impl GltfMotion {
    /// Reads the animation that turns the most joints; among equals the first.
    ///
    /// # Errors
    /// [`MotionError::Glb`] for what is no binary glTF 2.0 file or holds no animation of a skeleton,
    /// and for data outside the file, sparse or compressed; [`MotionError::TooLong`].
    pub fn parse(bytes: &[u8]) -> Result<Self, MotionError> {
        let file = Document::parse(bytes)?;
        let nodes = nodes::skeleton(&file)?;
        // Where each node of the file stands among the skeleton's joints.
        let mut joint_of = vec![None; file.root.nodes.len()];
        for (joint, node) in nodes.iter().enumerate() {
            joint_of[node.index] = Some(joint);
        }
        let animation = animation_of_most_joints(&file, &nodes, &joint_of)?;
        let mut joints = at_rest(nodes);
        let place = format!("animation {animation}");
        let animation = &file.root.animations[animation];
        for channel in &animation.channels {
            let Some(joint) = joint_of.get(channel.target.node.value()).copied().flatten() else {
                continue;
            };
            let sampler = animation
                .samplers
                .get(channel.sampler.value())
                .ok_or_else(|| GlbError::new(place.as_str(), "a sampler for every channel"))?;
            let joint = &mut joints[joint];
            match channel.target.path {
                Checked::Valid(Property::Rotation) => {
                    joint.rotation = Some(Track::rotations(&file, sampler)?);
                }
                Checked::Valid(Property::Translation) => {
                    joint.translation = Some(Track::vectors(&file, sampler)?);
                }
                Checked::Valid(Property::Scale) => {
                    joint.scale = Some(Track::vectors(&file, sampler)?);
                }
                _ => {}
            }
        }
        let tracks = || {
            joints.iter().flat_map(|joint| {
                [&joint.rotation, &joint.translation, &joint.scale]
                    .into_iter()
                    .flatten()
            })
        };
        let start_seconds = tracks().map(Track::start_seconds).fold(f64::MAX, f64::min);
        let end_seconds = tracks().map(Track::end_seconds).fold(f64::MIN, f64::max);
        let frames = (end_seconds - start_seconds) * MODEL_RATE_HZ + 1.0;
        if frames > MAX_CLIP_FRAMES as f64 {
            return Err(MotionError::TooLong {
                frames,
                limit: MAX_CLIP_FRAMES,
            });
        }
        Ok(Self {
            animation_name: animation.name.clone().unwrap_or_default(),
            // A last frame that rounding puts a hair before its sample belongs to it.
            frame_count: (frames + 1e-3).floor().max(1.0) as usize,
            start_seconds,
            joints,
        })
    }
}

/// Index of the animation that turns the most joints.
fn animation_of_most_joints(
    file: &Document<'_>,
    nodes: &[Node],
    joint_of: &[Option<usize>],
) -> Result<usize, GlbError> {
    let mut best = None;
    for (idx, animation) in file.root.animations.iter().enumerate() {
        let turned = animation
            .channels
            .iter()
            .filter(|channel| channel.target.path == Checked::Valid(Property::Rotation))
            .filter_map(|channel| joint_of.get(channel.target.node.value()).copied().flatten())
            .filter(|joint| !nodes[*joint].name.is_empty())
            .count();
        if turned > 0 && best.is_none_or(|(_, most)| turned > most) {
            best = Some((idx, turned));
        }
    }
    best.map(|(idx, _)| idx).ok_or_else(|| {
        let expected = match file.root.animations.len() {
            0 => "at least one; this file holds a model at rest".to_owned(),
            count => format!("one that turns the joints of a person; none of the {count} does"),
        };
        GlbError::new("animations", expected)
    })
}

fn at_rest(nodes: Vec<Node>) -> Vec<AnimatedJoint> {
    let binds: Vec<Option<DAffine3>> = nodes.iter().map(|node| node.bind).collect();
    let mut joints: Vec<AnimatedJoint> = nodes
        .into_iter()
        .map(|node| AnimatedJoint {
            name: node.name,
            parent: node.parent,
            rest: node.rest,
            rest_from_world: DQuat::IDENTITY,
            rest_position: DVec3::ZERO,
            rotation: None,
            translation: None,
            scale: None,
        })
        .collect();
    let by_nodes = world(&joints, |joint| joint.rest);
    let rest = bound(&joints, &by_nodes, &binds).unwrap_or(by_nodes);
    for (joint, (rotation, position)) in joints.iter_mut().zip(rest) {
        joint.rest_from_world = rotation.inverse();
        joint.rest_position = position;
    }
    joints
}

/// Below these, nodes and inverse bind matrices say the same: radians, and parts of a bone.
const SAME_TURN: f64 = 0.01;
const SAME_PLACE: f64 = 0.01;

/// World rotations and positions of the joints as a skin was bound, in the size and with the axes that
/// the nodes have; none where no skin says otherwise than the nodes.
fn bound(
    joints: &[AnimatedJoint],
    by_nodes: &[(DQuat, DVec3)],
    binds: &[Option<DAffine3>],
) -> Option<Vec<(DQuat, DVec3)>> {
    let binds: Vec<Option<(DQuat, DVec3)>> = binds
        .iter()
        .map(|bind| {
            bind.map(|bind| {
                let (_, rotation, position) = bind.to_scale_rotation_translation();
                (rotation.normalize(), position)
            })
        })
        .collect();
    let first = binds.iter().position(Option::is_some)?;
    let bones = || {
        joints.iter().enumerate().filter_map(|(idx, joint)| {
            let parent = joint.parent?;
            let bone = binds[idx]?.1 - binds[parent]?.1;
            Some((bone.length(), by_nodes[idx].1.distance(by_nodes[parent].1)))
        })
    };
    let bind_length: f64 = bones().map(|(bind, _)| bind).sum();
    let node_length: f64 = bones().map(|(_, node)| node).sum();
    let scale = node_length / bind_length;
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let to_world = axes_between(by_nodes, &binds);
    let origin = by_nodes[first].1 - scale * (to_world * binds[first]?.1);
    let mut differs = false;
    let mean_bone = node_length / bones().count().max(1) as f64;
    let mut rest: Vec<(DQuat, DVec3)> = Vec::with_capacity(joints.len());
    for (idx, joint) in joints.iter().enumerate() {
        let node = by_nodes[idx];
        rest.push(match (binds[idx], joint.parent) {
            (Some((rotation, position)), _) => {
                let bind = (
                    (to_world * rotation).normalize(),
                    origin + scale * (to_world * position),
                );
                let turn = 2.0 * bind.0.dot(node.0).abs().min(1.0).acos();
                differs |= turn > SAME_TURN || bind.1.distance(node.1) > SAME_PLACE * mean_bone;
                bind
            }
            (None, Some(parent)) => {
                let turn = rest[parent].0 * by_nodes[parent].0.inverse();
                let from_parent = node.1 - by_nodes[parent].1;
                (
                    (turn * node.0).normalize(),
                    rest[parent].1 + turn * from_parent,
                )
            }
            (None, None) => node,
        });
    }
    differs.then_some(rest)
}

/// The turn by multiples of 90 degrees that takes the axes of the skin's vertices to the world's: the
/// one that most joints agree on.
fn axes_between(by_nodes: &[(DQuat, DVec3)], binds: &[Option<(DQuat, DVec3)>]) -> DQuat {
    let quarter = std::f64::consts::FRAC_PI_2;
    let tops = [
        DQuat::IDENTITY,
        DQuat::from_rotation_x(quarter),
        DQuat::from_rotation_x(-quarter),
        DQuat::from_rotation_x(2.0 * quarter),
        DQuat::from_rotation_z(quarter),
        DQuat::from_rotation_z(-quarter),
    ];
    let agreement = |turn: DQuat| -> f64 {
        let joints = by_nodes.iter().zip(binds);
        joints
            .filter_map(|(node, bind)| Some((turn * (*bind)?.0).dot(node.0).powi(2)))
            .sum()
    };
    let mut best = (f64::MIN, DQuat::IDENTITY);
    for top in tops {
        for about in 0..4 {
            let turn = DQuat::from_rotation_y(f64::from(about) * quarter) * top;
            let agreed = agreement(turn);
            if agreed > best.0 + 1e-6 {
                best = (agreed, turn);
            }
        }
    }
    best.1
}

impl AnimatedJoint {
    fn local(&self, seconds: f64) -> Local {
        let vector = |track: &Option<Track>, rest| {
            track
                .as_ref()
                .map_or(rest, |track| track.vector_at(seconds))
        };
        Local {
            translation: vector(&self.translation, self.rest.translation),
            rotation: self
                .rotation
                .as_ref()
                .map_or(self.rest.rotation, |track| track.rotation_at(seconds)),
            scale: vector(&self.scale, self.rest.scale),
        }
    }
}

/// World rotation and position of every joint. Rotations leave scale aside, which the affine maps of
/// a scaled parent would shear.
fn world(joints: &[AnimatedJoint], local: impl Fn(&AnimatedJoint) -> Local) -> Vec<(DQuat, DVec3)> {
    let mut affine: Vec<DAffine3> = Vec::with_capacity(joints.len());
    let mut world: Vec<(DQuat, DVec3)> = Vec::with_capacity(joints.len());
    for joint in joints {
        let local = local(joint);
        let own = DAffine3::from_scale_rotation_translation(
            local.scale,
            local.rotation,
            local.translation,
        );
        let (rotation, own) = match joint.parent {
            None => (local.rotation, own),
            Some(parent) => (
                (world[parent].0 * local.rotation).normalize(),
                affine[parent] * own,
            ),
        };
        world.push((rotation, own.translation));
        affine.push(own);
    }
    world
}

impl SourceMotion for GltfMotion {
    fn joint_count(&self) -> usize {
        self.joints.len()
    }

    fn name(&self, joint: usize) -> &str {
        &self.joints[joint].name
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        self.joints[joint].parent
    }

    /// glTF bones end where their children begin.
    fn bone_end(&self, _joint: usize) -> Option<DVec3> {
        None
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        self.joints
            .iter()
            .map(|joint| joint.rest_position)
            .collect()
    }

    fn frame_count(&self) -> usize {
        self.frame_count
    }

    fn frame_seconds(&self) -> f64 {
        1.0 / MODEL_RATE_HZ
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let seconds = self.start_seconds + frame as f64 / MODEL_RATE_HZ;
        let mut world = world(&self.joints, |joint| joint.local(seconds));
        for ((rotation, _), joint) in world.iter_mut().zip(&self.joints) {
            *rotation *= joint.rest_from_world;
        }
        world
    }
}
