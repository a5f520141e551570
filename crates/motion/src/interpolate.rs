//! Interpolation between the frames of a clip.
//!
//! Frames are samples of a smooth motion. Linear interpolation has corners, and accelerations
//! move tissue. So a curve of the fifth degree connects the frames; its speed and
//! acceleration at each frame come from the two frames before and after it. They are the same
//! from both sides: the motion has no corners and no jumps of the acceleration.

use std::ops::{Add, Mul, Sub};

use dynaskin_body::{JOINT_COUNT, Pose};
use glam::{DQuat, DVec3, DVec4};

/// Angle in radians by which a joint turns from a frame to the next in a jump, up to steps of 1/30 s;
/// longer steps give bodies time. A jump is held and then made in one step of 60 Hz, in which the
/// runtime takes 1 rad for a cut: what is less would be shown as a movement without being one.
const JUMP_RAD: f64 = 1.05;
const JUMP_SECONDS: f64 = 1.0 / 30.0;
/// Speed of the root in m/s, over a tick at least, that makes a jump; the runtime takes 8 for a cut.
const JUMP_M_S: f64 = 8.4;
const TICK_SECONDS: f64 = 1.0 / 60.0;
/// How many times as far as in the steps beside it a body goes in a jump. Fast movements begin and
/// end more gently.
const JUMP_RATIO: f64 = 4.0;
/// The same at a beginning or an end, with a step on one side only: a file may begin in mid-throw.
const JUMP_RATIO_AT_ENDS: f64 = 8.0;

/// Frames of a curve: two before the step, its two, and two after it.
const WINDOW: usize = 6;
/// Place of the step's first frame among them.
const FIRST: usize = 2;

/// The pose at `position`, counted in frames; it lies within the clip.
pub fn pose_at(frames: &[Pose], frame_seconds: f64, position: f64) -> Pose {
    let last = frames.len() - 1;
    let before = (position.floor() as usize).min(last);
    let fraction = position - before as f64;
    if before == last || fraction < 1e-9 {
        return frames[before].clone();
    }
    if fraction > 1.0 - 1e-6 {
        return frames[before + 1].clone();
    }
    if is_jump(frames, frame_seconds, before) {
        // Held until the other side is there: whoever plays this sees the jump in one step.
        return frames[before].clone();
    }
    let mut low = before;
    while low > 0 && before - low < FIRST && !is_jump(frames, frame_seconds, low - 1) {
        low -= 1;
    }
    let mut high = before + 1;
    while high < last && high - before < WINDOW - 1 - FIRST && !is_jump(frames, frame_seconds, high)
    {
        high += 1;
    }
    let around = &frames[low..=high];
    let at = before - low;
    let mut pose = Pose::REST;
    let roots = Window::new(around, at, |pose| pose.root_translation_m);
    pose.root_translation_m = roots.value(fraction);
    for joint in 0..JOINT_COUNT {
        let here = frames[before].parent_from_joint[joint];
        if around
            .iter()
            .all(|pose| pose.parent_from_joint[joint] == here)
        {
            pose.parent_from_joint[joint] = here;
            continue;
        }
        // A rotation has two signs; the curve needs the same all along.
        let near = |pose: &Pose| {
            let rotation = pose.parent_from_joint[joint];
            let value = DVec4::from(rotation);
            if rotation.dot(here) < 0.0 {
                -value
            } else {
                value
            }
        };
        let value = Window::new(around, at, near).value(fraction);
        pose.parent_from_joint[joint] = if value.length_squared() > 1e-6 {
            DQuat::from_vec4(value.normalize())
        } else {
            here.slerp(frames[before + 1].parent_from_joint[joint], fraction)
        };
    }
    pose
}

/// Whether the body jumps between a frame and the next: much farther than bodies move in that time
/// and than it moves in the steps before and after. What it moves in the step before comes off: a cut
/// is a change of speed.
pub fn is_jump(frames: &[Pose], frame_seconds: f64, frame: usize) -> bool {
    let Some([from, to]) = frames.get(frame..frame + 2) else {
        return false;
    };
    let beside = [
        frame.checked_sub(1).map(|before| [&frames[before], from]),
        frames.get(frame + 2).map(|after| [to, after]),
    ];
    if beside.iter().all(Option::is_none) {
        return false;
    }
    let ratio = if beside.iter().all(Option::is_some) {
        JUMP_RATIO
    } else {
        JUMP_RATIO_AT_ENDS
    };
    let far = |distance: &dyn Fn(&Pose, &Pose) -> f64, limit: f64| {
        let own = distance(from, to);
        let before = || beside[0].map_or(0.0, |[a, b]| distance(a, b));
        own > limit
            && own - before() > limit
            && beside
                .iter()
                .flatten()
                .all(|[a, b]| own > ratio * distance(a, b))
    };
    let root = |a: &Pose, b: &Pose| a.root_translation_m.distance(b.root_translation_m);
    let limit_m = JUMP_M_S * frame_seconds.max(TICK_SECONDS);
    let limit_rad = JUMP_RAD * (frame_seconds / JUMP_SECONDS).max(1.0);
    far(&root, limit_m)
        || (0..JOINT_COUNT).any(|joint| {
            let turn = |a: &Pose, b: &Pose| {
                let dot = a.parent_from_joint[joint].dot(b.parent_from_joint[joint]);
                2.0 * dot.abs().min(1.0).acos()
            };
            far(&turn, limit_rad)
        })
}

/// Values that a curve is laid through.
trait Value: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {}
impl Value for DVec3 {}
impl Value for DVec4 {}

/// Six values at equal steps.
struct Window<T>([T; WINDOW]);

impl<T: Value> Window<T> {
    /// The values of the frames around a step that begins at frame `at`. Where there are none, before
    /// a beginning and after an end, those there are go on as a cubic.
    fn new(around: &[Pose], at: usize, value: impl Fn(&Pose) -> T) -> Self {
        let first = value(&around[0]);
        let mut values = [first; WINDOW];
        let begin = FIRST - at;
        let end = begin + around.len();
        for (slot, pose) in values[begin..end].iter_mut().zip(around) {
            *slot = value(pose);
        }
        let on = |a: T, b: T, c: T, d: T| match around.len() {
            2 => a * 2.0 - b,
            3 => a * 3.0 - b * 3.0 + c,
            _ => a * 4.0 - b * 6.0 + c * 4.0 - d,
        };
        let get = |values: &[T; WINDOW], idx: usize| values[idx.min(WINDOW - 1)];
        for idx in (0..begin).rev() {
            let [a, b, c, d] = [1, 2, 3, 4].map(|ahead| get(&values, idx + ahead));
            values[idx] = on(a, b, c, d);
        }
        for idx in end..WINDOW {
            let [a, b, c, d] = [1, 2, 3, 4].map(|back: usize| values[idx.saturating_sub(back)]);
            values[idx] = on(a, b, c, d);
        }
        Self(values)
    }

    /// The value at a fraction of the step.
    fn value(&self, t: f64) -> T {
        let v = &self.0;
        let speed = |k: usize| (v[k - 2] - v[k + 2] + (v[k + 1] - v[k - 1]) * 8.0) * (1.0 / 12.0);
        let acceleration = |k: usize| {
            ((v[k - 1] + v[k + 1]) * 16.0 - v[k] * 30.0 - v[k - 2] - v[k + 2]) * (1.0 / 12.0)
        };
        let (a, b) = (FIRST, FIRST + 1);
        let (t2, t3) = (t * t, t * t * t);
        let (t4, t5) = (t3 * t, t3 * t2);
        let rise = 10.0 * t3 - 15.0 * t4 + 6.0 * t5;
        v[a] * (1.0 - rise)
            + v[b] * rise
            + speed(a) * (t - 6.0 * t3 + 8.0 * t4 - 3.0 * t5)
            + speed(b) * (-4.0 * t3 + 7.0 * t4 - 3.0 * t5)
            + acceleration(a) * (0.5 * t2 - 1.5 * t3 + 1.5 * t4 - 0.5 * t5)
            + acceleration(b) * (0.5 * t3 - t4 + 0.5 * t5)
    }
}
