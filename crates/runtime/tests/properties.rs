//! What holds for every sequence of calls: finite numbers within their limits, the same bits with and
//! without saving in between, and the same motion alone and in crowds.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::{Arc, OnceLock};

use dynaskin_body::{Pose, Region};
use dynaskin_runtime::{
    Avatar, Controls, Crowd, Detail, MAX_STEP_SECONDS, Model, OFFSET_LIMIT_M, PoseSource, Settled,
    StepReport,
};
use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;
use support::pose_at;

/// How far the offsets of a crowd may be from those of its avatars alone, in metres: networks of several
/// rows round otherwise.
const ROUNDING_M: f32 = 2e-6;

/// Something that a host does.
#[derive(Clone, Debug)]
enum Call {
    /// Moves on in the motion for as long as the step takes, in seconds.
    Step(f64),
    /// Steps in the pose of the last step.
    Hold(f64),
    /// Stands still for longer than a step may take.
    Stall(f64),
    /// Stands elsewhere, in metres, with the next step.
    Teleport(f64, f64),
    /// Faces another way, in radians, with the next step.
    Turn(f64),
    /// Goes to another moment of the motion, in seconds.
    Cut(f64),
    Reset,
    Sleep(Detail),
    See(bool),
    Enable(bool),
    Source(PoseSource),
    Control(usize, f32),
    Resize(f64),
    Reshape(usize),
    /// Goes on with another avatar that is restored from this one.
    Restore,
    /// A call that is refused.
    Odd(usize),
}

impl Call {
    /// Whether it changes nothing that a saved state does not hold.
    fn is_saved(&self) -> bool {
        !matches!(self, Self::Sleep(_) | Self::See(_) | Self::Source(_))
    }
}

fn calls(most: usize) -> impl Strategy<Value = Vec<Call>> {
    let dt = prop_oneof![
        4 => Just(1.0 / 60.0),
        1 => Just(1.0 / 144.0),
        1 => Just(1.0 / 30.0),
        1 => Just(0.0),
        2 => 0.0..MAX_STEP_SECONDS,
    ];
    let detail = prop::sample::select(vec![Detail::Asleep, Detail::Half, Detail::Full]);
    let source = prop::sample::select(vec![
        PoseSource::Display,
        PoseSource::Tracker,
        PoseSource::Network,
        PoseSource::AsGiven,
    ]);
    let call = prop_oneof![
        12 => dt.clone().prop_map(Call::Step),
        2 => dt.prop_map(Call::Hold),
        1 => (MAX_STEP_SECONDS..86_400.0).prop_map(Call::Stall),
        1 => (-1e5..1e5, -1e5..1e5).prop_map(|(x, z)| Call::Teleport(x, z)),
        1 => (-3.0..3.0).prop_map(Call::Turn),
        1 => (0.0..1000.0).prop_map(Call::Cut),
        1 => Just(Call::Reset),
        1 => detail.prop_map(Call::Sleep),
        1 => any::<bool>().prop_map(Call::See),
        1 => any::<bool>().prop_map(Call::Enable),
        1 => source.prop_map(Call::Source),
        2 => (0_usize..9, 0.0_f32..1.0).prop_map(|(which, share)| Call::Control(which, share)),
        1 => (0.1..10.0).prop_map(Call::Resize),
        1 => (0_usize..4).prop_map(Call::Reshape),
        2 => Just(Call::Restore),
        1 => (0_usize..5).prop_map(Call::Odd),
    ];
    prop::collection::vec(call, 1..most)
}

fn model() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(support::model)
}

fn avatar() -> Avatar {
    Avatar::new(Arc::clone(model()), &[0.0; 10]).unwrap()
}

/// What a host hands over next.
#[derive(Clone, Debug)]
struct Place {
    seconds: f64,
    shift_m: DVec3,
    turn: DQuat,
}

impl Place {
    const START: Self = Self {
        seconds: 0.0,
        shift_m: DVec3::ZERO,
        turn: DQuat::IDENTITY,
    };

    fn pose(&self) -> Pose {
        let mut pose = pose_at(self.seconds);
        // A cut may lead to anywhere in the motion, which walks away; the shift is what teleports.
        pose.root_translation_m.z %= 10.0;
        pose.root_translation_m += self.shift_m;
        pose.parent_from_joint[0] = (self.turn * pose.parent_from_joint[0]).normalize();
        pose
    }

    /// The next pose and step, if the call is one.
    fn step(&mut self, call: &Call) -> Option<(Pose, f64)> {
        match call {
            Call::Step(dt) => {
                self.seconds += dt;
                Some((self.pose(), *dt))
            }
            Call::Hold(dt) | Call::Stall(dt) => Some((self.pose(), *dt)),
            Call::Teleport(x, z) => {
                self.shift_m = DVec3::new(*x, 0.0, *z);
                None
            }
            Call::Turn(radians) => {
                self.turn = DQuat::from_rotation_y(*radians);
                None
            }
            Call::Cut(seconds) => {
                self.seconds = *seconds;
                None
            }
            _ => None,
        }
    }
}

fn shape(which: usize) -> [f32; 10] {
    let mut shape = [0.0; 10];
    shape[which % 10] = 1.5;
    shape
}

fn controls(which: usize, share: f32) -> Controls {
    let mut controls = Controls::default();
    let region = Region::ALL[which % Region::ALL.len()] as usize;
    let settings = &mut controls.regions[region];
    match which {
        0 => return Controls::calm_clothes(),
        1 => return Controls::sportswear(),
        2 => controls.strength = 4.0 * share,
        3 => controls.root_inertia = 4.0 * share,
        4 => settings.gain = 4.0 * share,
        5 => settings.limit_m = OFFSET_LIMIT_M * share,
        6 => settings.stiffness = 0.1 + 9.9 * share,
        7 => settings.damping = 0.1 + 9.9 * share,
        _ => {}
    }
    controls
}

/// Does what no pose and no time belong to.
fn turn(avatar: &mut Avatar, call: &Call) {
    match call {
        Call::Reset => avatar.reset(),
        Call::Sleep(detail) => avatar.set_detail(*detail),
        Call::See(visible) => avatar.set_visible(*visible),
        Call::Enable(enabled) => avatar.set_enabled(*enabled),
        Call::Source(source) => avatar.set_pose_source(*source),
        Call::Control(which, share) => avatar.set_controls(&controls(*which, *share)).unwrap(),
        Call::Resize(scale) => avatar.set_scale(*scale).unwrap(),
        Call::Reshape(which) => avatar.set_shape(&shape(*which)).unwrap(),
        Call::Odd(which) => odd(avatar, *which),
        _ => {}
    }
}

fn odd(avatar: &mut Avatar, which: usize) {
    let mut broken = Pose::REST;
    broken.parent_from_joint[7] = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0);
    let refused = match which {
        0 => avatar.step(&broken, 0.0).is_err(),
        1 => avatar.step(&Pose::REST, -1.0).is_err(),
        2 => avatar.set_shape(&[f32::NAN; 10]).is_err(),
        3 => avatar.restore(&[0; 60]).is_err(),
        _ => avatar.set_scale(0.0).is_err(),
    };
    assert!(refused);
}

fn step(avatar: &mut Avatar, pose: &Pose, dt: f64) -> StepReport {
    avatar.step(pose, dt).unwrap()
}

/// Fails where something that is shown is not finite, or longer than an offset may be.
fn check_shown(avatar: &mut Avatar) -> Result<(), TestCaseError> {
    let finite = |vectors: &[Vec3]| vectors.iter().all(|v| v.is_finite());
    prop_assert!(finite(avatar.offsets_rest_m()));
    prop_assert!(finite(avatar.positions_rest_m()));
    let longest = largest(avatar.offsets_rest_m());
    prop_assert!(longest <= OFFSET_LIMIT_M * 1.0001, "{longest} m");
    prop_assert!(avatar.skin_matrices().iter().all(|m| m.is_finite()));
    let (positions, normals) = avatar.skin();
    prop_assert!(finite(positions) && finite(normals));
    Ok(())
}

fn largest(offsets_m: &[Vec3]) -> f32 {
    offsets_m.iter().map(|o| o.length()).fold(0.0, f32::max)
}

/// The bits of the surface.
fn bits(avatar: &Avatar) -> Vec<u32> {
    let surface = [
        avatar.offsets_rest_m(),
        avatar.positions_rest_m(),
        avatar.normals_rest(),
    ];
    let vectors = surface.into_iter().flatten().flat_map(|v| v.to_array());
    vectors.map(f32::to_bits).collect()
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 256,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn every_sequence_of_calls_shows_finite_numbers(calls in calls(60)) {
        let (mut avatar, mut place) = (avatar(), Place::START);
        for call in &calls {
            match (place.step(call), call) {
                (Some((pose, dt)), _) => {
                    let report = step(&mut avatar, &pose, dt);
                    let stalled = matches!(call, Call::Stall(_));
                    prop_assert!(!stalled || report.settled.is_some() || !awake(&avatar));
                }
                (None, Call::Restore) => {
                    let state = avatar.save();
                    avatar.restore(&state).unwrap();
                    prop_assert_eq!(avatar.save(), state);
                }
                (None, call) => turn(&mut avatar, call),
            }
            check_shown(&mut avatar)?;
        }
    }

    /// The states hold all that the poses and steps to come depend on, where poses are taken as given.
    #[test]
    fn the_same_bits_in_one_run_and_in_many(calls in calls(60)) {
        let start = || {
            let mut avatar = avatar();
            avatar.set_pose_source(PoseSource::AsGiven);
            avatar
        };
        let (mut whole, mut parts, mut place) = (start(), start(), Place::START);
        for call in calls.iter().filter(|call| call.is_saved()) {
            match (place.step(call), call) {
                (Some((pose, dt)), _) => {
                    let report = step(&mut whole, &pose, dt);
                    prop_assert_eq!(report, step(&mut parts, &pose, dt));
                    // A state does not hold the pose of a pause.
                    prop_assert_eq!(whole.skin_matrices(), parts.skin_matrices());
                }
                (None, Call::Restore) => {
                    let mut next = start();
                    // What it did before must not matter.
                    step(&mut next, &pose_at(3.0), 0.01);
                    next.restore(&parts.save()).unwrap();
                    parts = next;
                }
                (None, call) => {
                    turn(&mut whole, call);
                    turn(&mut parts, call);
                }
            }
            prop_assert!(bits(&whole) == bits(&parts), "after {call:?}");
        }
    }

    /// One crowd, two crowds of the same avatars, and every avatar alone.
    #[test]
    fn crowds_show_what_their_avatars_show_alone(
        first in calls(40), second in calls(40), third in calls(40),
    ) {
        let all_calls = [first, second, third];
        let three = || [avatar(), avatar(), avatar()];
        let (mut together, mut apart, mut alone) = (three(), three(), three());
        let mut crowds = [(); 3].map(|()| Crowd::new(Arc::clone(model())).unwrap());
        let mut places = [Place::START, Place::START, Place::START];
        for turn_of in 0..all_calls.iter().map(Vec::len).max().unwrap_or(0) {
            for (idx, calls) in all_calls.iter().enumerate() {
                let Some(call) = calls.get(turn_of) else { continue };
                // All are stepped below, by the same time.
                if places[idx].step(call).is_none() {
                    for avatars in [&mut together, &mut apart, &mut alone] {
                        turn(&mut avatars[idx], call);
                    }
                }
            }
            let dt = match all_calls[0].get(turn_of) {
                Some(Call::Step(dt) | Call::Hold(dt) | Call::Stall(dt)) => *dt,
                _ => 1.0 / 60.0,
            };
            let poses = places.each_ref().map(Place::pose);
            let mut still = || 0.0;
            let [one, two, three] = &mut crowds;
            let [a, b, c] = &mut together;
            one.step_all(&mut [a, b, c], &poses, dt, &mut still).unwrap();
            let [a, b, c] = &mut apart;
            two.step_all(&mut [c], &poses[2..], dt, &mut still).unwrap();
            three.step_all(&mut [a, b], &poses[..2], dt, &mut still).unwrap();
            for (idx, pose) in poses.iter().enumerate() {
                step(&mut alone[idx], pose, dt);
                for crowd in [&together[idx], &apart[idx]] {
                    prop_assert_eq!(crowd.skin_matrices(), alone[idx].skin_matrices());
                    let off = distance(crowd.offsets_rest_m(), alone[idx].offsets_rest_m());
                    prop_assert!(off <= ROUNDING_M, "{off} m");
                }
            }
        }
    }

    /// However long the calls before: a cut shows, once it has faded in, what a fresh avatar shows.
    #[test]
    fn a_stall_leaves_nothing_of_what_was_before(calls in calls(40), seconds in 0.0..100.0) {
        let (mut old, mut place) = (avatar(), Place::START);
        for call in calls.iter().filter(|call| call.is_saved()) {
            // The fresh one has the usual settings.
            let is_kept = matches!(
                call,
                Call::Control(..) | Call::Resize(_) | Call::Reshape(_) | Call::Enable(_)
            );
            match place.step(call) {
                Some((pose, dt)) => {
                    step(&mut old, &pose, dt);
                }
                None if !is_kept => turn(&mut old, call),
                None => {}
            }
        }
        let mut fresh = avatar();
        let there = Place { seconds, ..Place::START };
        let report = step(&mut old, &there.pose(), 2.0 * MAX_STEP_SECONDS);
        prop_assert!(report.settled.is_some());
        let report = step(&mut fresh, &there.pose(), 0.0);
        prop_assert_eq!(report.settled, Some(Settled::FirstPose));
        let mut time = there;
        for _ in 0..40 {
            time.seconds += 1.0 / 60.0;
            step(&mut old, &time.pose(), 1.0 / 60.0);
            step(&mut fresh, &time.pose(), 1.0 / 60.0);
        }
        let left = distance(old.offsets_rest_m(), fresh.offsets_rest_m());
        prop_assert!(left <= ROUNDING_M, "{left} m");
    }
}

fn awake(avatar: &Avatar) -> bool {
    avatar.enabled() && avatar.visible() && avatar.detail() != Detail::Asleep
}

fn distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}
