//! Animations of binary glTF files: models with a motion (`.glb`), VRM models (`.vrm`) and VRM
//! animations (`.vrma`).
//!
//! glTF knows nodes, not people. Who is who is taken, in this order, from the humanoid of the VRM
//! extensions (`VRMC_vrm_animation`, `VRMC_vrm`, `VRM`), from the names of the joints of the file's
//! skins, or from the names of all nodes.

mod animations;
mod humanoid;
mod nodes;
mod rest;
mod track;
mod unit;

use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_glb::{Document, GlbError};
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::animation::Property;
use gltf::json::validation::Checked;

use crate::options::{ReadOptions, find_named};
use crate::{MAX_CLIP_FRAMES, MODEL_RATE_HZ, MotionError, SourceMotion, World};
pub use animations::AnimationInfo;
use animations::{animations, check_keys, chosen, key_rate_hz, moving, what_was_chosen};
use nodes::{Local, Node};
use rest::bound;
use track::Track;
use unit::unit_note;

/// An animation of a binary glTF file, sampled at the rate of its keyframes where they stand at equal
/// steps longer than a tick, else at 60 Hz.
#[derive(Clone, Debug)]
pub struct GltfMotion {
    /// The animation's name; empty where it has none.
    pub animation_name: String,
    joints: Vec<AnimatedJoint>,
    start_seconds: f64,
    frame_count: usize,
    rate_hz: f64,
    /// The joints that the caller named.
    named: [Option<usize>; JOINT_COUNT],
    notes: Vec<String>,
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
    /// The animations of a file, in its order.
    ///
    /// # Errors
    /// [`MotionError::Glb`] for what is no binary glTF 2.0 file.
    pub fn animations(bytes: &[u8]) -> Result<Vec<AnimationInfo>, MotionError> {
        let file = Document::parse(bytes)?;
        check_keys(&file, bytes.len())?;
        let nodes = nodes::skeleton(&file)?;
        Ok(animations(&file, &nodes, &joint_of(&file, &nodes)))
    }

    /// Reads the animation that moves the most joints; among equals the first.
    ///
    /// # Errors
    /// As [`Self::parse_with`].
    pub fn parse(bytes: &[u8]) -> Result<Self, MotionError> {
        Self::parse_with(bytes, &ReadOptions::default())
    }

    /// Reads the animation that the caller chooses.
    ///
    /// # Errors
    /// [`MotionError::UnknownAnimation`], [`MotionError::NamedJoint`],
    /// [`MotionError::OptionNotForFile`]; [`MotionError::Glb`] for what is no binary glTF 2.0 file or
    /// holds no animation of a skeleton, and for data outside the file, sparse or compressed;
    /// [`MotionError::TooLong`].
    pub fn parse_with(bytes: &[u8], options: &ReadOptions) -> Result<Self, MotionError> {
        options.check_unused(
            "glTF, whose keyframes have times and whose up is +Y",
            &["rate", "up axis"],
        )?;
        let file = Document::parse(bytes)?;
        check_keys(&file, bytes.len())?;
        let nodes = nodes::skeleton(&file)?;
        let joint_of = joint_of(&file, &nodes);
        let all = animations(&file, &nodes, &joint_of);
        let mut notes = Vec::new();
        let animation = match &options.animation {
            Some(choice) => chosen(&all, choice)?,
            None => {
                let animation = moving(&all)?;
                notes.extend(what_was_chosen(&all, animation));
                animation
            }
        };
        let names: Vec<&str> = nodes.iter().map(|node| node.name.as_str()).collect();
        let named = find_named(&options.joints, &names)?;
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
        notes.extend(unit_note(&joints));
        let tracks = || {
            joints.iter().flat_map(|joint| {
                [&joint.rotation, &joint.translation, &joint.scale]
                    .into_iter()
                    .flatten()
            })
        };
        let start_seconds = tracks().map(Track::start_seconds).fold(f64::MAX, f64::min);
        let end_seconds = tracks().map(Track::end_seconds).fold(f64::MIN, f64::max);
        if start_seconds > end_seconds {
            return Err(GlbError::new(place, "one that turns the joints of a person").into());
        }
        let rate_hz = key_rate_hz(tracks()).unwrap_or(MODEL_RATE_HZ);
        let frames = (end_seconds - start_seconds) * rate_hz + 1.0;
        if frames > MAX_CLIP_FRAMES as f64 {
            return Err(MotionError::TooLong {
                frames,
                limit: MAX_CLIP_FRAMES,
            });
        }
        // A last frame that rounding puts a hair before its sample belongs to it.
        let frame_count = (frames + 1e-2).floor().max(1.0) as usize;
        Ok(Self {
            animation_name: animation.name.clone().unwrap_or_default(),
            frame_count,
            rate_hz,
            named,
            start_seconds,
            joints,
            notes,
        })
    }

    /// What was chosen among several, and what else is to be said of the file.
    pub fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}

/// Where each node of the file stands among the skeleton's joints.
fn joint_of(file: &Document<'_>, nodes: &[Node]) -> Vec<Option<usize>> {
    let mut joint_of = vec![None; file.root.nodes.len()];
    for (joint, node) in nodes.iter().enumerate() {
        joint_of[node.index] = Some(joint);
    }
    joint_of
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
    let all: Vec<usize> = (0..joints.len()).collect();
    let mut by_nodes = World::default();
    world(&joints, &all, &mut by_nodes, |joint| joint.rest);
    let by_nodes = by_nodes.joints;
    let rest = bound(&joints, &by_nodes, &binds).unwrap_or(by_nodes);
    for (joint, (rotation, position)) in joints.iter_mut().zip(rest) {
        joint.rest_from_world = rotation.inverse();
        joint.rest_position = position;
    }
    joints
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

/// World rotation and position of the joints `wanted`, which are ascending, each with its ancestors.
/// Rotations leave scale aside, which the affine maps of a scaled parent would shear.
fn world(
    joints: &[AnimatedJoint],
    wanted: &[usize],
    world: &mut World,
    local: impl Fn(&AnimatedJoint) -> Local,
) {
    let World {
        joints: world,
        affine,
    } = world;
    world.resize(joints.len(), (DQuat::IDENTITY, DVec3::ZERO));
    affine.resize(joints.len(), DAffine3::IDENTITY);
    for &idx in wanted {
        let joint = &joints[idx];
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
        world[idx] = (rotation, own.translation);
        affine[idx] = own;
    }
}

impl SourceMotion for GltfMotion {
    fn joint_count(&self) -> usize {
        self.joints.len()
    }

    fn name(&self, joint: usize) -> &str {
        &self.joints[joint].name
    }

    fn named_by_caller(&self, joint: Joint) -> Option<usize> {
        self.named[joint as usize]
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
        1.0 / self.rate_hz
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let all: Vec<usize> = (0..self.joints.len()).collect();
        let mut world = World::default();
        self.world_of(frame, &all, &mut world);
        world.joints
    }

    fn world_of(&self, frame: usize, joints: &[usize], posed: &mut World) {
        let seconds = self.start_seconds + frame as f64 / self.rate_hz;
        world(&self.joints, joints, posed, |joint| joint.local(seconds));
        for &idx in joints {
            posed.joints[idx].0 *= self.joints[idx].rest_from_world;
        }
    }
}
