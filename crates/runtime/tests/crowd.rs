//! Many avatars: one call for all, level of detail, sleep, and pauses off the screen.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "support/shipped.rs"]
mod shipped;

use std::sync::Arc;

use dynaskin_body::{Pose, Region};
use dynaskin_motion::{Clip, ProceduralKind};
use dynaskin_runtime::{
    Avatar, Controls, Crowd, Detail, FADE_SECONDS, LevelOfDetail, Model, RuntimeError, Settled,
};
use glam::{DVec3, Vec3};
use shipped::{distance, largest};

const DT: f64 = 1.0 / 60.0;
const KINDS: [ProceduralKind; 3] = [
    ProceduralKind::Hop,
    ProceduralKind::RunInPlace,
    ProceduralKind::Twist,
];

/// Avatars of different shapes, some with other controls.
fn different(model: &Arc<Model>, count: usize) -> Vec<Avatar> {
    let make = |idx: usize| {
        let mut shape = [0.0; 10];
        shape[1] = idx as f32 % 5.0 - 2.0;
        let mut avatar = Avatar::new(Arc::clone(model), &shape).unwrap();
        if idx % 4 == 1 {
            let mut controls = Controls::default();
            controls.regions[Region::Belly as usize].stiffness = 2.0;
            avatar.set_controls(&controls).unwrap();
        }
        avatar
    };
    (0..count).map(make).collect()
}

/// Each in its own place of its own motion.
fn poses(clips: &[Clip], count: usize, time: f64) -> Vec<Pose> {
    let pose = |idx: usize| {
        let mut pose = clips[idx % clips.len()].pose_at(time + 0.1 * idx as f64);
        pose.root_translation_m.x += idx as f64;
        pose
    };
    (0..count).map(pose).collect()
}

fn clips(model: &Arc<Model>) -> Vec<Clip> {
    let avatar = shipped::avatar(model);
    KINDS.map(|kind| shipped::clip(kind, &avatar)).to_vec()
}

fn all(avatars: &mut [Avatar]) -> Vec<&mut Avatar> {
    avatars.iter_mut().collect()
}

fn still() -> f64 {
    0.0
}

/// Batches of eight, with rows left over; every fifth step covers two ticks, every seventh none.
#[test]
fn a_crowd_shows_what_its_avatars_show_alone() {
    for name in ["female", "male"] {
        let model = shipped::model(name);
        let clips = clips(&model);
        for count in [1, 2, 3, 8, 13] {
            let mut together = different(&model, count);
            let mut alone = different(&model, count);
            let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
            let (mut time, mut worst_m, mut moved_m) = (0.5, 0.0_f32, 0.0_f32);
            for step in 0..90 {
                let dt = match step {
                    _ if step % 5 == 4 => 2.0 * DT,
                    _ if step % 7 == 6 => 0.25 * DT,
                    _ => DT,
                };
                time += dt;
                let poses = poses(&clips, count, time);
                crowd
                    .step_all(&mut all(&mut together), &poses, dt, &mut still)
                    .unwrap();
                for (idx, (one, other)) in alone.iter_mut().zip(&together).enumerate() {
                    one.step(&poses[idx], dt).unwrap();
                    assert_eq!(one.skin_matrices(), other.skin_matrices());
                    worst_m = worst_m.max(distance(one.offsets_rest_m(), other.offsets_rest_m()));
                    moved_m = moved_m.max(largest(one.offsets_rest_m()));
                }
            }
            println!("{name}, {count}: offsets to {moved_m} m, at most {worst_m} m off");
            assert!(moved_m > 1e-3 && worst_m < 2e-6, "{worst_m} of {moved_m}");
        }
    }
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let model = shipped::model("female");
    let clips = clips(&model);
    let play = || {
        let mut avatars = different(&model, 9);
        let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
        for step in 0..60 {
            let poses = poses(&clips, 9, f64::from(step) * DT);
            crowd
                .step_all(&mut all(&mut avatars), &poses, DT, &mut still)
                .unwrap();
        }
        let offsets = avatars.iter().flat_map(|a| a.offsets_rest_m().to_vec());
        offsets.collect::<Vec<Vec3>>()
    };
    assert_eq!(play(), play());
}

#[test]
fn a_refused_call_changes_nothing() {
    let model = shipped::model("female");
    let clips = clips(&model);
    let (mut disturbed, mut calm) = (different(&model, 4), different(&model, 4));
    let mut stranger = shipped::avatar(&shipped::model("male"));
    let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
    for step in 0..40 {
        let good = poses(&clips, 4, f64::from(step) * DT);
        let mut bad = good.clone();
        bad[2].root_translation_m.y = f64::NAN;
        let step_all = |crowd: &mut Crowd, avatars: &mut [&mut Avatar], poses: &[Pose], dt| {
            crowd.step_all(avatars, poses, dt, &mut still)
        };
        let error = step_all(&mut crowd, &mut all(&mut disturbed), &bad, DT).unwrap_err();
        assert!(matches!(error, RuntimeError::InvalidPose { .. }));
        assert!(error.to_string().contains("avatar 2"), "{error}");
        for dt in [-1.0, f64::NAN, 1e9] {
            let error = step_all(&mut crowd, &mut all(&mut disturbed), &good, dt).unwrap_err();
            assert!(matches!(error, RuntimeError::InvalidTimeStep { .. }));
        }
        let error = step_all(&mut crowd, &mut all(&mut disturbed), &good[1..], DT).unwrap_err();
        assert!(matches!(error, RuntimeError::InvalidCrowd { .. }));
        let error = step_all(&mut crowd, &mut [&mut stranger], &good[..1], DT).unwrap_err();
        assert!(matches!(error, RuntimeError::InvalidCrowd { .. }));
        step_all(&mut crowd, &mut all(&mut disturbed), &good, DT).unwrap();
        step_all(&mut crowd, &mut all(&mut calm), &good, DT).unwrap();
        for (a, b) in disturbed.iter().zip(&calm) {
            assert_eq!(a.offsets_rest_m(), b.offsets_rest_m());
        }
    }
}

/// Half detail holds every surface for two ticks and forgets nothing: what it shows is what full
/// detail shows, or showed one tick before.
#[test]
fn half_detail_is_one_tick_late_at_most() {
    let model = shipped::model("female");
    for kind in KINDS {
        let clip = shipped::clip(kind, &shipped::avatar(&model));
        let (mut half, mut full) = (shipped::avatar(&model), shipped::avatar(&model));
        half.set_detail(Detail::Half);
        let mut before = Vec::new();
        let (mut held, mut worst_m, mut squares, mut size_m) = (0, 0.0_f32, 0.0_f64, 0.0_f32);
        for step in 0..240 {
            let pose = clip.pose_at(f64::from(step) * DT);
            half.step(&pose, DT).unwrap();
            full.step(&pose, DT).unwrap();
            if half.offsets_rest_m() != full.offsets_rest_m() {
                assert_eq!(half.offsets_rest_m(), before, "step {step}");
                held += 1;
            }
            let off = distance(half.offsets_rest_m(), full.offsets_rest_m());
            (worst_m, squares) = (worst_m.max(off), squares + f64::from(off * off));
            size_m = size_m.max(largest(full.offsets_rest_m()));
            before = full.offsets_rest_m().to_vec();
        }
        println!(
            "{}: offsets to {:.1} mm; half detail off by {:.1} mm at most, {:.1} mm RMS of frames",
            kind.name(),
            1e3 * size_m,
            1e3 * worst_m,
            1e3 * (squares / 240.0).sqrt()
        );
        assert!((100..=120).contains(&held), "{held}");
        // Full again, it is at once what it would have been.
        half.set_detail(Detail::Full);
        let pose = clip.pose_at(4.0);
        half.step(&pose, DT).unwrap();
        full.step(&pose, DT).unwrap();
        assert_eq!(half.offsets_rest_m(), full.offsets_rest_m());
    }
}

/// Largest change of the surface from one step to the next.
struct Steps {
    before: Vec<Vec3>,
    largest_m: f32,
}

impl Steps {
    fn of(avatar: &Avatar) -> Self {
        Self {
            before: avatar.offsets_rest_m().to_vec(),
            largest_m: 0.0,
        }
    }

    fn see(&mut self, avatar: &Avatar) {
        let step_m = distance(&self.before, avatar.offsets_rest_m());
        self.largest_m = self.largest_m.max(step_m);
        self.before = avatar.offsets_rest_m().to_vec();
    }
}

/// Falls asleep in mid-hop, sleeps, wakes in mid-hop elsewhere: nothing pops, and soon it is as if
/// it had never slept.
#[test]
fn sleep_and_waking() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Hop, &shipped::avatar(&model));
    let (mut sleeper, mut awake) = (shipped::avatar(&model), shipped::avatar(&model));
    let pose = |step: usize| clip.pose_at((step % 240) as f64 * DT);
    let fade = (FADE_SECONDS / DT).ceil() as usize;
    let (mut steps, mut usual) = (Steps::of(&sleeper), Steps::of(&awake));
    for step in 0..240 {
        // Asleep from 1.25 s to 2.5 s.
        if step == 75 {
            sleeper.set_detail(Detail::Asleep);
        }
        let mut there = pose(step);
        if step >= 100 {
            there.root_translation_m += DVec3::new(7.0, 0.0, 0.0);
        }
        if step == 150 {
            assert_eq!(largest(sleeper.offsets_rest_m()), 0.0);
            sleeper.set_detail(Detail::Full);
        }
        let report = sleeper.step(&there, DT).unwrap();
        awake.step(&pose(step), DT).unwrap();
        steps.see(&sleeper);
        usual.see(&awake);
        match step {
            0 => assert_eq!(report.settled, Some(Settled::FirstPose)),
            150 => assert_eq!(report.settled, Some(Settled::Woken)),
            75..150 => assert_eq!((report.ticks, report.settled), (0, None)),
            _ => assert_eq!((report.ticks, report.settled), (1, None), "step {step}"),
        }
        if (75 + fade..150).contains(&step) {
            assert_eq!(
                sleeper.positions_rest_m(),
                shipped::avatar(&model).positions_rest_m()
            );
        }
    }
    let left = distance(sleeper.offsets_rest_m(), awake.offsets_rest_m());
    println!(
        "largest step {} m with sleep, {} m without; {left} m off 1.5 s after waking",
        steps.largest_m, usual.largest_m
    );
    // Fading adds little to what a hop does anyway.
    assert!(steps.largest_m <= 1.05 * usual.largest_m);
    assert!(left <= 1e-3, "{left}");
}

/// Three seconds off the screen, not stepped at all or stepped on; the avatar comes back in
/// mid-hop, elsewhere.
#[test]
fn off_screen_pause() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Hop, &shipped::avatar(&model));
    for stepped_meanwhile in [true, false] {
        let (mut paused, mut other) = (shipped::avatar(&model), shipped::avatar(&model));
        let pose = |step: usize| clip.pose_at((step % 240) as f64 * DT);
        for step in 0..75 {
            paused.step(&pose(step), DT).unwrap();
            other.step(&pose(step), DT).unwrap();
        }
        let before = paused.offsets_rest_m().to_vec();
        assert!(largest(&before) > 1e-3);
        paused.set_visible(false);
        for step in 75..315 {
            other.step(&pose(step), DT).unwrap();
            if stepped_meanwhile {
                let report = paused.step(&pose(step), DT).unwrap();
                assert_eq!((report.ticks, report.settled), (0, None));
                assert_eq!(paused.skin_matrices(), other.skin_matrices());
            }
        }
        assert_eq!(paused.offsets_rest_m(), before);

        paused.set_visible(true);
        let shift = DVec3::new(-3.0, 0.0, 8.0);
        let mut there = pose(315);
        there.root_translation_m += shift;
        let report = paused.step(&there, DT).unwrap();
        assert_eq!(report.settled, Some(Settled::Woken));
        // At once what the pose settles to, as if nothing had been before.
        let mut fresh = shipped::avatar(&model);
        fresh.step(&there, 0.0).unwrap();
        let resumed = distance(paused.offsets_rest_m(), fresh.offsets_rest_m());
        assert!(resumed < 1e-6, "{resumed}");
        let (mut steps, mut usual) = (Steps::of(&paused), Steps::of(&other));
        for step in 316..405 {
            let mut there = pose(step);
            there.root_translation_m += shift;
            let report = paused.step(&there, DT).unwrap();
            assert_eq!((report.ticks, report.settled), (1, None));
            other.step(&pose(step), DT).unwrap();
            steps.see(&paused);
            usual.see(&other);
        }
        let left = distance(paused.offsets_rest_m(), other.offsets_rest_m());
        println!(
            "largest step {} m, of one never paused {} m; {left} m off after 1.5 s",
            steps.largest_m, usual.largest_m
        );
        assert!(steps.largest_m <= 1.2 * usual.largest_m);
        assert!(left <= 1e-3, "{left}");
    }
}

/// Walks away and comes back: each level sets in at its distance and goes 10 % nearer.
#[test]
fn detail_by_distance_has_hysteresis() {
    let model = shipped::model("female");
    let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
    let mut level_of_detail = LevelOfDetail::default();
    level_of_detail.half_beyond_m = 10.0;
    level_of_detail.asleep_beyond_m = 20.0;
    crowd.set_level_of_detail(Some(level_of_detail)).unwrap();
    let mut avatar = shipped::avatar(&model);
    let mut detail_at = |distance_m: f64| {
        avatar.set_distance_m(distance_m).unwrap();
        crowd
            .step_all(&mut [&mut avatar], &[Pose::REST], DT, &mut still)
            .unwrap();
        avatar.detail()
    };
    let expected = [
        (9.9, Detail::Full),
        (10.0, Detail::Half),
        (9.1, Detail::Half),
        (10.5, Detail::Half),
        (8.9, Detail::Full),
        (9.5, Detail::Full),
        (30.0, Detail::Asleep),
        (18.1, Detail::Asleep),
        (17.9, Detail::Half),
        (19.9, Detail::Half),
        (20.0, Detail::Asleep),
        (0.0, Detail::Full),
    ];
    for (distance_m, detail) in expected {
        assert_eq!(detail_at(distance_m), detail, "{distance_m} m");
    }
}

/// Nine visible avatars at 0.4 ms each do not fit into 1 ms; the farthest give way, and nothing
/// flickers.
#[test]
fn a_budget_takes_detail_from_the_farthest() {
    let model = shipped::model("female");
    let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
    let mut avatars = different(&model, 10);
    for (idx, avatar) in avatars.iter_mut().enumerate() {
        avatar.set_distance_m(10.0 - idx as f64).unwrap();
    }
    avatars[9].set_visible(false);
    let mut budget = |milliseconds: f64, steps: usize, avatars: &mut [Avatar]| {
        let mut level_of_detail = LevelOfDetail::default();
        level_of_detail.half_beyond_m = 100.0;
        level_of_detail.asleep_beyond_m = 200.0;
        level_of_detail.budget_seconds = Some(1e-3 * milliseconds);
        crowd.set_level_of_detail(Some(level_of_detail)).unwrap();
        let (mut changes, mut report) = (0, None);
        let poses = vec![Pose::REST; avatars.len()];
        for _ in 0..steps {
            let details: Vec<Detail> = avatars.iter().map(Avatar::detail).collect();
            let awake = details[..9].iter().filter(|&&d| d > Detail::Asleep).count();
            // Every look at the watch is a tenth of a millisecond later for each that is awake: a
            // step costs what it costs, whatever the machine.
            let mut now = 0.0;
            let mut stopwatch = || {
                now += 1e-4 * awake as f64;
                now
            };
            report = crowd
                .step_all(&mut all(avatars), &poses, DT, &mut stopwatch)
                .ok();
            changes +=
                usize::from(details != avatars.iter().map(Avatar::detail).collect::<Vec<_>>());
        }
        (changes, report.unwrap())
    };
    let (_, generous) = budget(1000.0, 100, &mut avatars);
    assert_eq!((generous.full, generous.half, generous.asleep), (9, 0, 1));
    let (changes, tight) = budget(1.0, 400, &mut avatars);
    println!("{tight:?} after {changes} changes");
    assert!(tight.asleep > 1 && tight.full < 9, "{tight:?}");
    assert!(changes <= 6, "{changes} changes");
    // The nearest visible has the most, the farthest the least.
    let details: Vec<Detail> = avatars[..9].iter().map(Avatar::detail).collect();
    assert!(details.is_sorted(), "{details:?}");
    let (_, again) = budget(1000.0, 100, &mut avatars);
    assert_eq!((again.full, again.half, again.asleep), (9, 0, 1));
}

#[test]
fn contradictory_levels_and_distances_are_refused() {
    let model = shipped::model("female");
    let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
    let good = LevelOfDetail::default();
    crowd.set_level_of_detail(Some(good)).unwrap();
    let edits: [fn(&mut LevelOfDetail); 3] = [
        |level| level.half_beyond_m = f64::NAN,
        |level| level.asleep_beyond_m = 1.0,
        |level| level.budget_seconds = Some(0.0),
    ];
    for edit in edits {
        let mut bad = good;
        edit(&mut bad);
        let error = crowd.set_level_of_detail(Some(bad)).unwrap_err();
        assert_eq!(error.code(), "argument");
        assert_eq!(crowd.level_of_detail(), Some(&good));
    }
    let mut avatar = shipped::avatar(&model);
    for bad in [-1.0, f64::NAN] {
        assert_eq!(avatar.set_distance_m(bad).unwrap_err().code(), "argument");
    }
    assert_eq!(avatar.distance_m(), 0.0);
}
