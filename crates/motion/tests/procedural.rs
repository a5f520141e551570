//! Procedural motions against physics.

mod common;

use common::a_pose_m;
use dynaskin_body::Joint;
use dynaskin_motion::{Clip, MODEL_RATE_HZ, MotionError, Procedural, ProceduralKind};
use glam::DVec3;

fn clip(kind: ProceduralKind) -> Clip {
    Procedural::new(kind)
        .clip(&a_pose_m())
        .expect("usual parameters are accepted")
}

fn positions_m(clip: &Clip, joint: Joint) -> Vec<DVec3> {
    let rest_m = a_pose_m();
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

#[test]
fn nonsense_is_refused() {
    let rest_m = a_pose_m();
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
