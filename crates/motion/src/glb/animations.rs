//! The animations of a file: which there are, which one is meant, at what rate its keyframes stand.

use dynaskin_glb::{Document, GlbError};
use gltf::json::animation::Property;
use gltf::json::validation::Checked;

use super::nodes::Node;
use super::track::Track;
use crate::error::shortened;
use crate::options::AnimationChoice;
use crate::{MODEL_RATE_HZ, MotionError};

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
    pub(super) turned_joints: usize,
}

/// Turns of at least this many radians count as movement: half a degree.
const MOVING_RAD: f64 = 0.0087;

/// Numbers of keys that files may ask for: as many as they have bytes, within these limits. Channels
/// may share their keys, and a small file may name the same ones thousands of times.
const MIN_SHARED_KEYS: usize = 4_000_000;
const MAX_KEYS: usize = 20_000_000;

/// Refuses animations whose channels ask for more keys than the file can hold, before any is read.
///
/// # Errors
/// [`GlbError`] with the numbers.
pub fn check_keys(file: &Document<'_>, file_bytes: usize) -> Result<(), GlbError> {
    let limit = file_bytes.clamp(MIN_SHARED_KEYS, MAX_KEYS);
    let count = |accessor: usize| {
        let accessor = file.root.accessors.get(accessor);
        let count = accessor.map_or(0, |accessor| accessor.count.0);
        // What cannot lie in the file is refused where it is read, with its place.
        if count > file_bytes as u64 { 0 } else { count }
    };
    let mut keys = 0_u64;
    for animation in &file.root.animations {
        for channel in &animation.channels {
            if let Some(sampler) = animation.samplers.get(channel.sampler.value()) {
                let both = count(sampler.input.value()).max(count(sampler.output.value()));
                keys = keys.saturating_add(both);
            }
        }
    }
    if keys > limit as u64 {
        let expected = format!("at most {limit} keys in all their channels, got {keys}");
        return Err(GlbError::new("animations", expected));
    }
    Ok(())
}

/// The animations, in the file's order.
pub fn animations(
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
pub fn moving(animations: &[AnimationInfo]) -> Result<usize, GlbError> {
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

/// What is to be said where an animation was chosen among several, or where none moves.
pub fn what_was_chosen(animations: &[AnimationInfo], taken: usize) -> Option<String> {
    let taken_info = animations.get(taken)?;
    let others: Vec<String> = animations
        .iter()
        .enumerate()
        .filter(|(idx, other)| *idx != taken && other.turned_joints > 0)
        .map(|(idx, other)| format!("{idx}: `{}`", other.name))
        .collect();
    let name = &taken_info.name;
    match (others.is_empty(), taken_info.moving_joints) {
        (true, 0) => Some(format!("the only animation, `{name}`, moves no joint")),
        (true, _) => None,
        (false, 0) => Some(format!(
            "no animation moves a joint: `{name}` plays; the option `animation` takes another of {}",
            shortened(&others)
        )),
        (false, moving) => Some(format!(
            "of {} animations, `{name}` plays, which moves the most joints ({moving}); the option \
             `animation` takes another: {}",
            others.len() + 1,
            shortened(&others)
        )),
    }
}

/// Index of the animation that the caller means.
pub fn chosen(
    animations: &[AnimationInfo],
    choice: &AnimationChoice,
) -> Result<usize, MotionError> {
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
/// between them is for [`crate::Clip`] to say. None for splines, which say it themselves, for keyframes
/// at any times, and for those that come once a tick or more often.
pub fn key_rate_hz<'a>(tracks: impl Iterator<Item = &'a Track>) -> Option<f64> {
    const SLOWEST_HZ: f64 = 1.0;
    let mut times: Vec<f64> = Vec::new();
    for track in tracks {
        if track.is_spline() {
            return None;
        }
        times.extend(track.times());
    }
    times.sort_by(f64::total_cmp);
    let (first, last) = (*times.first()?, *times.last()?);
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let shortest = steps().filter(|step| *step > 1e-3).fold(f64::MAX, f64::min);
    // Single precision blurs a step; the whole time, divided by the number of steps, is not blurred.
    let count: f64 = steps().map(|step| (step / shortest).round()).sum();
    if count < 1.0 {
        return None;
    }
    let step = (last - first) / count;
    let is_grid = times.iter().all(|time| {
        let place = (time - first) / step;
        (place - place.round()).abs() < 0.05
    });
    let rate_hz = 1.0 / step;
    (is_grid && (SLOWEST_HZ..(1.0 - 1e-4) * MODEL_RATE_HZ).contains(&rate_hz)).then_some(rate_hz)
}
