//! Sources of every kind, made of procedural motions.

#![allow(clippy::print_stdout)] // The measured numbers are for people to read.

use dynaskin_conditioning::{Conditioner, PoseSource};
use dynaskin_motion::{Bvh, Clip, Procedural, ProceduralKind, retarget};
use dynaskin_skeleton::{JOINT_COUNT, Joint, Pose};
use glam::{DQuat, DVec3, Vec3};

const TICK: f64 = 1.0 / 60.0;

/// Captures that a test plays, at most.
const MOST_CAPTURES: usize = 200;

/// Joints of a stick figure of usual size.
fn joints() -> [Vec3; JOINT_COUNT] {
    let mut joints = [Vec3::ZERO; JOINT_COUNT];
    for joint in Joint::ALL {
        let parent = joint
            .parent()
            .map_or(Vec3::ZERO, |parent| joints[parent as usize]);
        let name = joint.name();
        let side = if name.contains("right") { -1.0 } else { 1.0 };
        joints[joint as usize] = parent
            + match name {
                "pelvis" => Vec3::ZERO,
                n if n.contains("hip") => Vec3::new(0.07 * side, -0.08, 0.0),
                n if n.contains("knee") => Vec3::new(0.03 * side, -0.38, 0.0),
                n if n.contains("ankle") => Vec3::new(0.0, -0.4, -0.04),
                n if n.contains("foot") => Vec3::new(0.03 * side, -0.06, 0.12),
                n if n.contains("collar") => Vec3::new(0.07 * side, 0.1, 0.0),
                n if n.contains("shoulder") => Vec3::new(0.11 * side, 0.04, 0.0),
                n if n.contains("elbow") => Vec3::new(0.26 * side, 0.0, 0.0),
                n if n.contains("wrist") || n.contains("hand") => Vec3::new(0.2 * side, 0.0, 0.0),
                _ => Vec3::new(0.0, 0.13, 0.0),
            };
    }
    joints
}

fn motion(kind: ProceduralKind) -> Clip {
    let mut motion = Procedural::new(kind);
    motion.duration_seconds = 6.0;
    let clip = motion.clip(&joints()).expect("a usual motion");
    assert_eq!(clip.rate_hz, 60.0);
    clip
}

/// Random numbers, evenly in -1..1.
struct Dice(u32);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        2.0 * f64::from(self.0 >> 8) / f64::from(1_u32 << 24) - 1.0
    }

    fn noise(&mut self) -> f64 {
        (0..6).map(|_| self.roll()).sum::<f64>() / 2.0_f64.sqrt()
    }
}

/// The clip at any time, smooth between its frames.
fn smooth(clip: &Clip, time: f64) -> Pose {
    let position = time.max(0.0) * clip.rate_hz;
    let frame = (position + 1e-9).floor();
    let u = position - frame;
    let at = |offset: f64| clip.pose_at(((frame + offset) / clip.rate_hz).max(0.0));
    let poses = [at(-1.0), at(0.0), at(1.0), at(2.0)];
    let weights = [
        -u * (u - 1.0) * (u - 2.0) / 6.0,
        (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
        -(u + 1.0) * u * (u - 2.0) / 2.0,
        (u + 1.0) * u * (u - 1.0) / 6.0,
    ];
    let mut pose = poses[1].clone();
    pose.root_translation_m = poses
        .iter()
        .zip(weights)
        .map(|(p, w)| p.root_translation_m * w)
        .sum();
    for joint in 0..JOINT_COUNT {
        let here = poses[1].parent_from_joint[joint];
        let turn: DVec3 = poses
            .iter()
            .zip(weights)
            .map(|(p, w)| (here.conjugate() * p.parent_from_joint[joint]).to_scaled_axis() * w)
            .sum();
        pose.parent_from_joint[joint] = (here * DQuat::from_scaled_axis(turn)).normalize();
    }
    pose
}

fn noisy(pose: &Pose, degrees: f64, metres: f64, dice: &mut Dice) -> Pose {
    let mut noise = |size: f64| size * DVec3::new(dice.noise(), dice.noise(), dice.noise());
    let mut pose = pose.clone();
    pose.root_translation_m += noise(metres);
    for rotation in &mut pose.parent_from_joint {
        *rotation = (*rotation * DQuat::from_scaled_axis(noise(degrees.to_radians()))).normalize();
    }
    pose
}

/// What a tracker at `rate` (arrivals off by up to `jitter` seconds) gives at `time`.
struct Tracker {
    poses: Vec<(f64, Pose)>,
}

impl Tracker {
    fn new(clip: &Clip, rate: f64, jitter: f64, noise: (f64, f64)) -> Self {
        let mut dice = Dice(7);
        let count = (clip.duration_seconds() * rate) as usize;
        let mut poses: Vec<(f64, Pose)> = Vec::new();
        for index in 0..count {
            let time = index as f64 / rate;
            let mut arrival = time + jitter * dice.roll();
            if let Some((last, _)) = poses.last() {
                arrival = arrival.max(last + 1e-6);
            }
            poses.push((
                arrival,
                noisy(&smooth(clip, time), noise.0, noise.1, &mut dice),
            ));
        }
        Self { poses }
    }

    fn newest(&self, time: f64) -> &Pose {
        let after = self
            .poses
            .partition_point(|(arrival, _)| *arrival <= time + 1e-9);
        &self.poses[after.saturating_sub(1)].1
    }
}

struct Played {
    /// At every tick of the playhead: the host's time and the pose.
    ticks: Vec<(f64, Pose)>,
    cuts: usize,
    latency: f64,
}

fn played(
    source: PoseSource,
    display: f64,
    seconds: f64,
    mut pose_at: impl FnMut(f64) -> Pose,
) -> Played {
    let mut conditioner = Conditioner::default();
    conditioner.set_source(source);
    let (mut ticks, mut cuts, mut phase) = (Vec::new(), 0, 0.0);
    let mut latency = 0.0;
    for frame in 0..(seconds * display) as usize {
        let now = frame as f64 / display;
        let pose = pose_at(now);
        let dt = if frame == 0 { 0.0 } else { 1.0 / display };
        let given = conditioner.push(&pose, dt);
        cuts += usize::from(given.cut);
        let mut left = given.dt_seconds;
        while phase + left >= TICK - 1e-9 {
            left -= TICK - phase;
            phase = 0.0;
            let position = 1.0 - left / given.dt_seconds;
            let pose = conditioner
                .pose_at(position)
                .unwrap_or_else(|| given.pose.clone());
            ticks.push((now - left, pose));
        }
        phase += left;
        if now < 4.0 {
            latency = conditioner.diagnosis().latency_seconds;
        }
    }
    Played {
        ticks,
        cuts,
        latency,
    }
}

/// Accelerations of the root and two joints that carry tissue, from ticks.
fn accelerations(poses: &[Pose]) -> Vec<[DVec3; 3]> {
    let bend = |a: &Pose, b: &Pose, c: &Pose| {
        let turn = |joint: usize| {
            let (a, b, c) = (
                a.parent_from_joint[joint],
                b.parent_from_joint[joint],
                c.parent_from_joint[joint],
            );
            ((b.conjugate() * c).to_scaled_axis() + (b.conjugate() * a).to_scaled_axis())
                / (TICK * TICK)
        };
        let root = a.root_translation_m + c.root_translation_m - 2.0 * b.root_translation_m;
        [
            root / (TICK * TICK),
            0.1 * turn(Joint::LeftHip as usize),
            0.1 * turn(3),
        ]
    };
    poses
        .windows(3)
        .map(|w| bend(&w[0], &w[1], &w[2]))
        .collect()
}

/// Error of the accelerations over their size, at the best alignment, and that alignment.
fn error(clip: &Clip, played: &Played) -> (f64, f64) {
    error_from(60, clip, played)
}

/// As [`error`], from the tick `skip` on.
fn error_from(skip: usize, clip: &Clip, played: &Played) -> (f64, f64) {
    let got: Vec<Pose> = played.ticks.iter().map(|(_, pose)| pose.clone()).collect();
    let got = accelerations(&got);
    let mut best = (f64::INFINITY, 0.0);
    for delay_ms in (0..120).step_by(2) {
        let delay = 1e-3 * f64::from(delay_ms);
        let (mut off, mut size) = (0.0, 0.0);
        for (idx, got) in got.iter().enumerate().skip(skip) {
            let time = played.ticks[idx + 1].0 - delay;
            let around = [time - TICK, time, time + TICK].map(|t| smooth(clip, t));
            for (got, true_one) in got.iter().zip(accelerations(&around)[0]) {
                off += (*got - true_one).length_squared();
                size += true_one.length_squared();
            }
        }
        let error = (off / size).sqrt();
        if error < best.0 {
            best = (error, delay);
        }
    }
    best
}

#[track_caller]
fn check(
    kind: ProceduralKind,
    source: PoseSource,
    (rate, jitter, noise): (f64, f64, (f64, f64)),
    display: f64,
    (most, latency): (f64, f64),
) {
    let clip = motion(kind);
    let tracker = Tracker::new(&clip, rate, jitter, noise);
    let played = played(source, display, 5.5, |time| tracker.newest(time).clone());
    let (off, delay) = error(&clip, &played);
    println!(
        "{} {source:?}: {rate} Hz ±{jitter} s, noise {noise:?}, on {display} Hz: {off:.3} at {:.0} ms \
         (says {:.0}), {} cuts",
        kind.name(),
        1e3 * delay,
        1e3 * played.latency,
        played.cuts
    );
    assert_eq!(played.cuts, 0);
    assert!(off <= most, "{off}");
    assert!(played.latency <= latency, "{}", played.latency);
}

#[test]
fn sixty_hertz_and_more_on_any_display() {
    for kind in [ProceduralKind::Hop, ProceduralKind::ShakeHips] {
        for (rate, display) in [(60.0, 72.0), (72.0, 90.0), (60.0, 144.0), (60.0, 120.0)] {
            let source = (rate, 0.0, (0.0, 0.0));
            check(
                kind,
                PoseSource::Display,
                source,
                display,
                (0.1, 1.0 / rate),
            );
        }
    }
}

/// Every pose is new, and every frame skips another number of them. It takes half a second of motion
/// until that is sure, so the second second is not measured.
#[test]
fn more_poses_than_the_page_shows() {
    for kind in [ProceduralKind::Hop, ProceduralKind::ShakeHips] {
        let clip = motion(kind);
        for (rate, display) in [
            (72.0, 60.0),
            (90.0, 60.0),
            (144.0, 60.0),
            (100.0, 60.0),
            (90.0, 72.0),
        ] {
            let tracker = Tracker::new(&clip, rate, 0.0, (0.0, 0.0));
            let given = |source| played(source, display, 5.5, |time| tracker.newest(time).clone());
            let (as_given, _) = error_from(120, &clip, &given(PoseSource::AsGiven));
            let conditioned = given(PoseSource::Display);
            let (off, delay) = error_from(120, &clip, &conditioned);
            println!(
                "{}: {rate} Hz on {display} Hz: {as_given:.3}, conditioned {off:.3} at {:.0} ms (says {:.0})",
                kind.name(),
                1e3 * delay,
                1e3 * conditioned.latency
            );
            assert!(off <= 0.1 && off < 0.5 * as_given, "{off}, {as_given}");
            assert!(
                conditioned.latency <= 1.0 / rate + 1e-3,
                "{}",
                conditioned.latency
            );
            assert_eq!(conditioned.cuts, 0);
        }
    }
}

/// Captures of people at their own 60 Hz are no source that was skipped.
#[test]
fn captures_in_every_frame_are_passed_on() {
    let folder =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/mocap/train");
    let Ok(files) = std::fs::read_dir(&folder) else {
        println!("skipped: captures_in_every_frame_are_passed_on needs ../shared/mocap/train");
        return;
    };
    let mut paths: Vec<_> = files.flatten().map(|file| file.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "bvh"));
    paths.sort();
    let mut changed = Vec::new();
    for path in paths.iter().step_by(paths.len().div_ceil(MOST_CAPTURES)) {
        let motion = Bvh::parse(&std::fs::read(path).expect("a file")).expect("a motion");
        let (clip, _) = retarget(&motion, &joints()).expect("a person");
        for degrees in [0.0, 0.1, 0.5] {
            let mut conditioner = Conditioner::default();
            let mut dice = Dice(3);
            for (frame, pose) in clip.frames.iter().enumerate() {
                let pose = noisy(pose, degrees, 4e-3 * degrees, &mut dice);
                conditioner.push(&pose, if frame == 0 { 0.0 } else { TICK });
                if conditioner.engaged() {
                    changed.push(format!("{} ±{degrees}° at {frame}", path.display()));
                    break;
                }
            }
        }
    }
    println!("{} captures", paths.len());
    assert_eq!(changed, [] as [&str; 0]);
}

#[test]
fn thirty_hertz_on_sixty() {
    for kind in [ProceduralKind::Hop, ProceduralKind::ShakeHips] {
        check(
            kind,
            PoseSource::Display,
            (30.0, 0.0, (0.0, 0.0)),
            60.0,
            (0.2, 0.034),
        );
    }
}

#[test]
fn thirty_hertz_with_jitter() {
    for source in [PoseSource::Display, PoseSource::Network] {
        check(
            ProceduralKind::ShakeHips,
            source,
            (30.0, 0.015, (0.0, 0.0)),
            60.0,
            (0.3, 0.075),
        );
    }
}

#[test]
fn a_new_pose_in_every_frame_is_passed_on_to_the_bit() {
    let clip = motion(ProceduralKind::RunInPlace);
    let mut conditioner = Conditioner::default();
    let mut dice = Dice(3);
    let mut time = 0.0;
    for _ in 0..300 {
        let dt = 0.018 + 0.015 * dice.roll();
        time += dt;
        // A breath keeps the figure from standing still to the bit.
        let mut pose = smooth(&clip, time);
        pose.root_translation_m.y += 1e-3 * time;
        let given = conditioner.push(&pose, dt);
        assert_eq!(
            (&given.pose, given.dt_seconds, given.cut),
            (&pose, dt, false)
        );
        assert!(conditioner.pose_at(0.5).is_none());
    }
    assert!(!conditioner.diagnosis().repeats);
}

#[test]
fn standing_still_costs_no_delay_and_is_left_cleanly() {
    let clip = motion(ProceduralKind::ShakeHips);
    let tracker = Tracker::new(&clip, 30.0, 0.0, (0.0, 0.0));
    // Moves for 3 s, stands for 10, moves on.
    let at = |time: f64| match time {
        t if t < 3.0 => t,
        t if t < 13.0 => 3.0,
        t => t - 10.0,
    };
    let mut conditioner = Conditioner::default();
    let mut worst = 0.0_f64;
    for frame in 0..900 {
        let dt = if frame == 0 { 0.0 } else { TICK };
        let given = conditioner.push(tracker.newest(at(f64::from(frame) * TICK)), dt);
        assert!(!given.cut, "frame {frame}");
        worst = worst.max(conditioner.diagnosis().latency_seconds);
    }
    assert!(worst < 0.15, "{worst}");
    let latency = conditioner.diagnosis().latency_seconds;
    assert!(latency < 0.045, "{latency}");
}

#[test]
fn noise_is_taken_off_and_named() {
    let clip = motion(ProceduralKind::ShakeHips);
    let tracker = Tracker::new(&clip, 30.0, 0.0, (0.25, 0.001));
    let mut conditioner = Conditioner::default();
    for frame in 0..300 {
        conditioner.push(tracker.newest(f64::from(frame) * TICK), TICK);
    }
    let found = conditioner.diagnosis();
    assert_eq!(found.advice, Some(PoseSource::Tracker));
    assert!((0.1..0.5).contains(&found.noise_degrees), "{found:?}");
    // Accelerations of ticks have more of the noise than tissue follows.
    for noise in [(0.25, 0.001), (0.5, 0.002)] {
        let tracker = Tracker::new(&clip, 30.0, 0.0, noise);
        let [noisy, smoothed] = [PoseSource::Display, PoseSource::Tracker].map(|source| {
            let played = played(source, 60.0, 5.5, |time| tracker.newest(time).clone());
            assert_eq!(played.cuts, 0);
            error(&clip, &played).0
        });
        println!("noise {noise:?}: {noisy:.2}, smoothed {smoothed:.2}");
        assert!(smoothed < 0.6 * noisy);
    }
}

#[test]
fn nothing_a_host_can_feed_panics() {
    let odd = [
        0.0,
        1e-12,
        1e-3,
        0.2,
        0.3,
        1e9,
        -1.0,
        f64::NAN,
        f64::INFINITY,
    ];
    for source in [
        PoseSource::Display,
        PoseSource::Tracker,
        PoseSource::Network,
    ] {
        let mut conditioner = Conditioner::default();
        conditioner.set_source(source);
        let mut dice = Dice(5);
        for step in 0..4000 {
            let mut pose = Pose::REST;
            if step % 3 > 0 {
                pose.root_translation_m = DVec3::splat(1e5 * dice.roll());
                pose.parent_from_joint[4] =
                    DQuat::from_scaled_axis(DVec3::splat(3.0 * dice.roll()));
            }
            let dt = odd[((dice.roll() + 1.0) * 4.49) as usize];
            let given = conditioner.push(&pose, dt);
            assert!(given.pose.root_translation_m.is_finite());
            let _ = (conditioner.pose_at(dice.roll()), conditioner.diagnosis());
        }
    }
}

/// The clip's poses at `rate`, with what `change` does to the body at each; the frames of cuts.
fn cuts(clip: &Clip, rate: f64, change: impl Fn(usize, &mut Pose)) -> Vec<usize> {
    let mut conditioner = Conditioner::default();
    let frames = 0..(4.0 * rate) as usize;
    frames
        .filter(|&frame| {
            let mut pose = smooth(clip, 1.0 + frame as f64 / rate);
            change(frame, &mut pose);
            let dt = if frame == 0 { 0.0 } else { 1.0 / rate };
            conditioner.push(&pose, dt).cut
        })
        .collect()
}

#[test]
fn a_snap_turn_is_a_cut() {
    let clip = motion(ProceduralKind::ShakeHips);
    for rate in [60.0, 72.0, 90.0] {
        for degrees in [30.0_f64, 45.0] {
            let turned = |frame: usize, pose: &mut Pose| {
                if frame >= 90 {
                    let turn = DQuat::from_rotation_y(degrees.to_radians());
                    pose.root_translation_m = turn * pose.root_translation_m;
                    pose.parent_from_joint[0] = turn * pose.parent_from_joint[0];
                }
            };
            assert_eq!(cuts(&clip, rate, turned), [90], "{degrees}° at {rate} Hz");
        }
    }
    assert_eq!(cuts(&clip, 60.0, |_, _| {}), [0; 0]);
}

#[test]
fn a_first_pose_of_calibration_is_forgotten() {
    let clip = motion(ProceduralKind::ShakeHips);
    for rate in [24.0, 30.0, 40.0] {
        // Arms aside, as no motion has them a frame later.
        let calibrated = |frame: usize, pose: &mut Pose| {
            if frame == 0 {
                for joint in [Joint::LeftShoulder, Joint::RightShoulder] {
                    let rotation = &mut pose.parent_from_joint[joint as usize];
                    *rotation *= DQuat::from_rotation_z(1.3);
                }
            }
        };
        assert_eq!(cuts(&clip, rate, calibrated), [2], "{rate} Hz");
    }
}

/// Seconds given on for steps of 1/60 s that are measured `most` off; where the poses follow what was
/// measured, they are those of that time.
fn given_seconds(most: f64, follow: bool) -> Vec<(f64, f64)> {
    let clip = motion(ProceduralKind::ShakeHips);
    let mut conditioner = Conditioner::default();
    let mut dice = Dice(9);
    let (mut even, mut measured) = (0.0, 0.0);
    (0..300)
        .map(|_| {
            let dt = TICK + most * dice.roll();
            (even, measured) = (even + TICK, measured + dt);
            let time = if follow { measured } else { even };
            let mut pose = smooth(&clip, time);
            pose.root_translation_m.y += 1e-3 * time;
            (dt, conditioner.push(&pose, dt).dt_seconds)
        })
        .collect()
}

#[test]
fn steps_measured_by_a_coarse_clock_snap_to_the_display() {
    let steps = given_seconds(1e-3, false);
    for (dt, given) in &steps[200..] {
        assert!((given - TICK).abs() < 1e-9, "{dt} s became {given} s");
    }
    let (measured, given): (f64, f64) = steps
        .iter()
        .fold((0.0, 0.0), |sum, (dt, given)| (sum.0 + dt, sum.1 + given));
    assert!((measured - given).abs() < 1.1 * TICK);
}

#[test]
fn steps_that_poses_follow_are_left_as_they_are() {
    for (dt, given) in given_seconds(2e-3, true) {
        assert_eq!(dt, given);
    }
}

#[test]
fn poses_taken_as_given_are_never_changed() {
    let clip = motion(ProceduralKind::Hop);
    let tracker = Tracker::new(&clip, 30.0, 0.0, (0.0, 0.0));
    let mut conditioner = Conditioner::default();
    conditioner.set_source(PoseSource::AsGiven);
    for frame in 0..200 {
        let pose = tracker.newest(f64::from(frame) * TICK);
        let given = conditioner.push(pose, TICK);
        assert_eq!(
            (&given.pose, given.dt_seconds, given.cut),
            (pose, TICK, false)
        );
    }
    assert!(!conditioner.engaged());
}
