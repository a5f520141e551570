//! Procedural motions against physics.

mod common;

use common::{female_joints_m, joints_m};
use dynaskin_body::{JOINT_COUNT, Joint, SHAPE_COUNT};
use dynaskin_motion::{Clip, MODEL_RATE_HZ, MotionError, Procedural, ProceduralKind};
use glam::{DVec3, Vec3};

fn clip(kind: ProceduralKind) -> Clip {
    Procedural::new(kind)
        .clip(&female_joints_m())
        .expect("usual parameters are accepted")
}

fn positions_m(clip: &Clip, joint: Joint) -> Vec<DVec3> {
    let rest_m = female_joints_m();
    clip.frames
        .iter()
        .map(|pose| pose.world_joints(&rest_m).position_m[joint as usize])
        .collect()
}

fn accelerations(positions_m: &[DVec3]) -> Vec<DVec3> {
    positions_m
        .windows(3)
        .map(|x| (x[2] - 2.0 * x[1] + x[0]) * MODEL_RATE_HZ * MODEL_RATE_HZ)
        .collect()
}

#[test]
fn a_jump_flies_freely() {
    let clip = clip(ProceduralKind::Jump);
    let pelvis = accelerations(&positions_m(&clip, Joint::Pelvis));
    // The default flight lasts 2 sqrt(2 h / g) = 0.478 s, that is 28 frames, 26 second differences.
    let longest = pelvis
        .chunk_by(|a, b| (a.y + 9.81).abs() < 1e-6 && (b.y + 9.81).abs() < 1e-6)
        .map(<[DVec3]>::len)
        .max();
    assert!((25..=27).contains(&longest.unwrap()), "{longest:?}");
}

#[test]
fn every_motion_stands_still_at_both_ends() {
    for kind in ProceduralKind::ALL {
        let clip = clip(kind);
        assert_eq!(clip.frames.len(), 481);
        assert!(
            clip.frames.iter().all(dynaskin_body::Pose::is_valid),
            "{}",
            kind.name()
        );
        let count = clip.frames.len();
        for frame in (1..30).chain(count - 40..count) {
            assert_eq!(
                clip.frames[frame],
                clip.frames[frame - 1],
                "{} {frame}",
                kind.name()
            );
        }
        let moves = clip.frames.iter().any(|pose| *pose != clip.frames[0]);
        assert!(moves, "{}", kind.name());
    }
}

/// Every motion at its usual, a slow and a quick tempo, on both bodies.
fn many() -> Vec<(String, Clip, [Vec3; JOINT_COUNT])> {
    let mut clips = Vec::new();
    for body in ["female", "male"] {
        let rest_m = joints_m(body, &[0.0; SHAPE_COUNT]);
        for kind in ProceduralKind::ALL {
            for factor in [0.8, 1.0, 1.15] {
                let usual = Procedural::new(kind);
                let motion = Procedural {
                    tempo_hz: factor * usual.tempo_hz,
                    ..usual
                };
                let clip = motion.clip(&rest_m).expect("a usual tempo is accepted");
                clips.push((format!("{body} {} x {factor}", kind.name()), clip, rest_m));
            }
        }
    }
    clips
}

#[test]
fn no_joint_is_torn_about() {
    for (name, clip, rest_m) in many() {
        for joint in Joint::ALL {
            let positions_m: Vec<DVec3> = clip
                .frames
                .iter()
                .map(|pose| pose.world_joints(&rest_m).position_m[joint as usize])
                .collect();
            let largest = accelerations(&positions_m)
                .iter()
                .map(|a| a.length())
                .fold(0.0, f64::max);
            // Knees and hands of athletes reach more; trunk and hips carry the tissue.
            let limit = match joint {
                Joint::Pelvis | Joint::LeftHip | Joint::RightHip | Joint::Spine1 => 45.0,
                _ => 95.0,
            };
            assert!(
                largest < limit,
                "{name}, {}: {largest:.1} m/s²",
                joint.name()
            );
        }
    }
}

#[test]
fn soles_keep_to_the_floor_and_planted_ones_do_not_slide() {
    for (name, clip, rest_m) in many() {
        for (ankle, ball) in [
            (Joint::LeftAnkle, Joint::LeftFoot),
            (Joint::RightAnkle, Joint::RightFoot),
        ] {
            let rest_y = |joint: Joint| f64::from(rest_m[joint as usize].y);
            let mut planted: Option<DVec3> = None;
            let mut planted_frames = 0;
            for (frame, pose) in clip.frames.iter().enumerate() {
                let world = pose.world_joints(&rest_m);
                let ball_m = world.position_m[ball as usize];
                let ankle_m = world.position_m[ankle as usize];
                assert!(ball_m.y > rest_y(ball) - 1e-3, "{name} {frame}: {ball_m}");
                assert!(
                    ankle_m.y > rest_y(ankle) - 5e-3,
                    "{name} {frame}: {ankle_m}"
                );
                if ball_m.y > rest_y(ball) + 1e-6 {
                    planted = None;
                    continue;
                }
                planted_frames += 1;
                let place_m = *planted.get_or_insert(ball_m);
                assert!(
                    ball_m.distance(place_m) < 2e-3,
                    "{name} {frame}: {ball_m} {place_m}"
                );
            }
            assert!(planted_frames > 60, "{name}: {planted_frames}");
        }
    }
}

#[test]
fn knees_and_elbows_bend_the_right_way() {
    for (name, clip, rest_m) in many() {
        for pose in &clip.frames {
            let world = pose.world_joints(&rest_m);
            for (hip, knee, ankle) in [
                (Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle),
                (Joint::RightHip, Joint::RightKnee, Joint::RightAnkle),
            ] {
                let [hip_m, knee_m, ankle_m] =
                    [hip, knee, ankle].map(|joint| world.position_m[joint as usize]);
                let thigh = knee_m - hip_m;
                let shin = ankle_m - knee_m;
                let degrees = thigh.angle_between(shin).to_degrees();
                assert!((4.0..150.0).contains(&degrees), "{name}: knee {degrees}");
                // The knee is in front of the line from hip to ankle.
                let ahead = world.rotation[Joint::Pelvis as usize] * DVec3::Z;
                assert!(
                    thigh.reject_from(ankle_m - hip_m).dot(ahead) > 0.0,
                    "{name}"
                );
            }
            for (shoulder, elbow, wrist) in [
                (Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist),
                (Joint::RightShoulder, Joint::RightElbow, Joint::RightWrist),
            ] {
                let [shoulder_m, elbow_m, wrist_m] =
                    [shoulder, elbow, wrist].map(|joint| world.position_m[joint as usize]);
                let bend = (elbow_m - shoulder_m)
                    .angle_between(wrist_m - elbow_m)
                    .to_degrees();
                assert!((5.0..150.0).contains(&bend), "{name}: elbow {bend}");
                // Hands stay clear of the trunk.
                let chest_m = world.position_m[Joint::Spine2 as usize];
                assert!(wrist_m.distance(chest_m) > 0.2, "{name}");
            }
        }
    }
}

#[test]
fn walking_gets_ahead_and_the_others_stay() {
    for kind in ProceduralKind::ALL {
        let pelvis_m = positions_m(&clip(kind), Joint::Pelvis);
        let way_m = pelvis_m[pelvis_m.len() - 1] - pelvis_m[0];
        assert!(
            way_m.x.abs() < 1e-9 && way_m.y.abs() < 1e-9,
            "{} {way_m}",
            kind.name()
        );
        if kind == ProceduralKind::Walk {
            assert!((2.0..8.0).contains(&way_m.z), "{way_m}");
        } else {
            assert!(way_m.z.abs() < 1e-9, "{} {way_m}", kind.name());
        }
    }
}

#[test]
fn the_height_of_a_jump_is_the_rise_of_the_pelvis() {
    for height_m in [0.1, 0.3, 0.5] {
        let motion = Procedural {
            height_m,
            ..Procedural::new(ProceduralKind::Jump)
        };
        let clip = motion.clip(&female_joints_m()).expect("fits");
        let pelvis = positions_m(&clip, Joint::Pelvis);
        let top_m = pelvis.iter().map(|position| position.y).fold(0.0, f64::max);
        let flying = accelerations(&pelvis)
            .iter()
            .position(|a| (a.y + 9.81).abs() < 1e-6);
        // The first of the three samples lies in flight, at most a frame after take-off.
        let takeoff_m = pelvis[flying.expect("flies")].y;
        let within_a_frame_m = (2.0 * 9.81 * height_m).sqrt() / MODEL_RATE_HZ;
        let rise_m = top_m - takeoff_m;
        assert!(rise_m < height_m + 1e-6 && rise_m > height_m - within_a_frame_m - 1e-3);
    }
}

#[test]
fn names_lead_back_to_their_motions() {
    for kind in ProceduralKind::ALL {
        assert_eq!(ProceduralKind::from_name(kind.name()), Some(kind));
    }
    assert_eq!(ProceduralKind::from_name("swim"), None);
}

#[test]
fn short_ones_are_whole_or_refused() {
    let rest_m = female_joints_m();
    let mut made = 0;
    for kind in ProceduralKind::ALL {
        for quarters in 1..=24 {
            let mut motion = Procedural::new(kind);
            motion.duration_seconds = 0.25 * f64::from(quarters);
            let Ok(clip) = motion.clip(&rest_m) else {
                continue;
            };
            made += 1;
            let whole = clip.frames.iter().all(dynaskin_body::Pose::is_valid);
            assert!(whole, "{kind:?} of {} s", motion.duration_seconds);
        }
    }
    assert!(made > 60, "{made}");
}

#[test]
fn nonsense_is_refused() {
    let rest_m = female_joints_m();
    for kind in ProceduralKind::ALL {
        let usual = Procedural::new(kind);
        for bad in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e9] {
            let tempo = Procedural {
                tempo_hz: bad,
                ..usual
            };
            assert!(matches!(
                tempo.clip(&rest_m),
                Err(MotionError::Parameter { .. })
            ));
            let duration = Procedural {
                duration_seconds: bad,
                ..usual
            };
            assert!(matches!(
                duration.clip(&rest_m),
                Err(MotionError::Parameter { .. })
            ));
        }
        let height = Procedural {
            height_m: f64::NAN,
            ..usual
        };
        assert!(matches!(
            height.clip(&rest_m),
            Err(MotionError::Parameter { .. })
        ));
    }
    let quick = Procedural {
        tempo_hz: 4.0,
        height_m: 0.3,
        ..Procedural::new(ProceduralKind::Hop)
    };
    let Err(MotionError::FlightDoesNotFit { max_height_m, .. }) = quick.clip(&rest_m) else {
        panic!("a flight of half a second at 4 Hz was accepted");
    };
    let lower = Procedural {
        height_m: 0.99 * max_height_m,
        ..quick
    };
    assert!(lower.clip(&rest_m).is_ok());
    let flat = [glam::Vec3::ZERO; 24];
    assert!(matches!(
        quick.clip(&flat),
        Err(MotionError::Degenerate { .. })
    ));
}
