//! Animations of binary glTF files: models with a motion (`.glb`), VRM models (`.vrm`) and VRM
//! animations (`.vrma`).
//!
//! glTF knows nodes, not people. Who is who is taken, in this order, from the humanoid of the VRM
//! extensions (`VRMC_vrm_animation`, `VRMC_vrm`, `VRM`), from the names of the joints of the file's
//! skins, or from the names of all nodes.

mod humanoid;
mod nodes;
mod track;

use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_glb::{Document, GlbError};
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::animation::Property;
use gltf::json::validation::Checked;

use crate::options::{AnimationChoice, ReadOptions, find_named};
use crate::{MAX_CLIP_FRAMES, MODEL_RATE_HZ, MotionError, SourceMotion};
use nodes::{Local, Node};
use track::Track;

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
}

/// An animation of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimationInfo {
    /// Its name; empty where it has none.
    pub name: String,
    /// Time from its first keyframe to its last, in seconds.
    pub seconds: f64,
    /// How many of the skeleton's joints it turns by half a degree and more; 0 for a pose held, for
    /// what moves no person and for what cannot be read.
    pub moving_joints: usize,
    /// How many of the skeleton's joints it has rotations of, whether they move or not.
    turned_joints: usize,
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
    /// [`MotionError::OptionNotForFile`]; [`MotionError::Glb`] for what is no binary glTF 2.0 file or holds no animation of a skeleton,
    /// and for data outside the file, sparse or compressed; [`MotionError::TooLong`].
    pub fn parse_with(bytes: &[u8], options: &ReadOptions) -> Result<Self, MotionError> {
        options.check_unused(
            "glTF, whose keyframes have times and whose up is +Y",
            &["rate", "up axis"],
        )?;
        let file = Document::parse(bytes)?;
        let nodes = nodes::skeleton(&file)?;
        let joint_of = joint_of(&file, &nodes);
        let all = animations(&file, &nodes, &joint_of);
        let animation = match &options.animation {
            Some(choice) => chosen(&all, choice)?,
            None => moving(&all)?,
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
        Ok(Self {
            animation_name: animation.name.clone().unwrap_or_default(),
            // A last frame that rounding puts a hair before its sample belongs to it.
            frame_count: (frames + 1e-2).floor().max(1.0) as usize,
            rate_hz,
            named,
            start_seconds,
            joints,
        })
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

/// Turns of at least this many radians count as movement: half a degree.
const MOVING_RAD: f64 = 0.0087;

fn animations(
    file: &Document<'_>,
    nodes: &[Node],
    joint_of: &[Option<usize>],
) -> Vec<AnimationInfo> {
    let animations = file.root.animations.iter();
    animations
        .map(|animation| {
            let (mut start, mut end) = (f64::MAX, f64::MIN);
            let (mut moving_joints, mut turned_joints) = (0, 0);
            for channel in &animation.channels {
                let joint = joint_of.get(channel.target.node.value()).copied().flatten();
                let is_turned = channel.target.path == Checked::Valid(Property::Rotation)
                    && joint.is_some_and(|joint| !nodes[joint].name.is_empty());
                if !is_turned {
                    continue;
                }
                turned_joints += 1;
                let sampler = animation.samplers.get(channel.sampler.value());
                let track = sampler.map(|sampler| Track::rotations(file, sampler));
                if let Some(Ok(track)) = track {
                    start = start.min(track.start_seconds());
                    end = end.max(track.end_seconds());
                    moving_joints += usize::from(track.largest_turn() > MOVING_RAD);
                }
            }
            AnimationInfo {
                name: animation.name.clone().unwrap_or_default(),
                seconds: (end - start).max(0.0),
                moving_joints,
                turned_joints,
            }
        })
        .collect()
}

/// Index of the animation that moves the most joints; where none moves any, that turns the most.
fn moving(animations: &[AnimationInfo]) -> Result<usize, GlbError> {
    let mut best: Option<(usize, (usize, usize))> = None;
    for (idx, animation) in animations.iter().enumerate() {
        let moves = (animation.moving_joints, animation.turned_joints);
        if moves > (0, 0) && best.is_none_or(|(_, most)| moves > most) {
            best = Some((idx, moves));
        }
    }
    best.map(|(idx, _)| idx).ok_or_else(|| {
        let expected = match animations.len() {
            0 => "at least one; this file holds a model at rest".to_owned(),
            count => format!("one that turns the joints of a person; none of the {count} does"),
        };
        GlbError::new("animations", expected)
    })
}

/// Index of the animation that the caller means.
fn chosen(animations: &[AnimationInfo], choice: &AnimationChoice) -> Result<usize, MotionError> {
    let only = |is_it: &dyn Fn(&str) -> bool| {
        let mut found = (0..animations.len()).filter(|idx| is_it(&animations[*idx].name));
        found.next().filter(|_| found.next().is_none())
    };
    let (found, asked) = match choice {
        AnimationChoice::Index(idx) => (
            Some(*idx).filter(|idx| *idx < animations.len()),
            format!("{idx}, counted from 0"),
        ),
        AnimationChoice::Name(name) => (
            only(&|known| known == name)
                .or_else(|| only(&|known| known.eq_ignore_ascii_case(name))),
            format!("`{name}` (or more than one)"),
        ),
    };
    found.ok_or_else(|| MotionError::UnknownAnimation {
        asked,
        available: animations
            .iter()
            .enumerate()
            .map(|(idx, animation)| format!("{idx}: `{}`", animation.name))
            .collect(),
    })
}

/// The rate of keyframes that stand at equal steps longer than a tick, some left out or not: what lies
/// between them is for [`crate::Clip`] to say. None for splines, which say it themselves, and for
/// keyframes at any times.
fn key_rate_hz<'a>(tracks: impl Iterator<Item = &'a Track>) -> Option<f64> {
    const SLOWEST_HZ: f64 = 1.0;
    let mut times: Vec<f64> = Vec::new();
    for track in tracks {
        if track.is_spline() {
            return None;
        }
        times.extend(track.times());
    }
    times.sort_by(f64::total_cmp);
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let shortest = steps.filter(|step| *step > 1e-3).fold(f64::MAX, f64::min);
    let (first, last) = (*times.first()?, *times.last()?);
    let count = ((last - first) / shortest).round();
    if count < 1.0 {
        return None;
    }
    // Single precision blurs a step; the whole time, divided, does not.
    let step = (last - first) / count;
    let is_grid = times.iter().all(|time| {
        let place = (time - first) / step;
        (place - place.round()).abs() < 0.05
    });
    let rate_hz = 1.0 / step;
    (is_grid && (SLOWEST_HZ..0.98 * MODEL_RATE_HZ).contains(&rate_hz)).then_some(rate_hz)
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
        let seconds = self.start_seconds + frame as f64 / self.rate_hz;
        let mut world = world(&self.joints, |joint| joint.local(seconds));
        for ((rotation, _), joint) in world.iter_mut().zip(&self.joints) {
            *rotation *= joint.rest_from_world;
        }
        world
    }
}
