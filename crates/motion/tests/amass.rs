//! AMASS-like files, made here: widths, rates, axes, and what is refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::path::{Path, PathBuf};

use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_motion::{Amass, MODEL_RATE_HZ, MotionError, UpAxis};
use dynaskin_npz::Writer;
use glam::{DQuat, DVec3, Vec3};

/// A standing skeleton: hips, knees and feet matter here.
fn joints_rest_m() -> [Vec3; JOINT_COUNT] {
    let mut joints = [Vec3::new(0.0, 1.2, 0.0); JOINT_COUNT];
    let mut set = |joint: Joint, x, y, z| joints[joint as usize] = Vec3::new(x, y, z);
    set(Joint::Pelvis, 0.0, 0.95, 0.0);
    set(Joint::LeftHip, 0.1, 0.9, 0.0);
    set(Joint::RightHip, -0.1, 0.9, 0.0);
    set(Joint::LeftKnee, 0.1, 0.5, 0.0);
    set(Joint::RightKnee, -0.1, 0.5, 0.0);
    set(Joint::LeftAnkle, 0.1, 0.08, 0.0);
    set(Joint::RightAnkle, -0.1, 0.08, 0.0);
    set(Joint::LeftFoot, 0.1, 0.0, 0.12);
    set(Joint::RightFoot, -0.1, 0.0, 0.12);
    joints
}

/// What one test file holds.
struct Motion {
    width: usize,
    rate_key: &'static str,
    rate_hz: f64,
    frames: usize,
    poses: Vec<f64>,
    trans: Vec<f64>,
}

/// A body standing in a z-up world turns about the vertical at 1 rad/s while it drifts along the
/// world's x at 0.3 m/s; the left knee bends at 0.5 rad/s.
fn standing(width: usize, rate_hz: f64, frames: usize) -> Motion {
    let upright = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let (mut poses, mut trans) = (vec![0.0; frames * width], Vec::new());
    for frame in 0..frames {
        let seconds = frame as f64 / rate_hz;
        let root = DQuat::from_rotation_z(seconds) * upright;
        let row = &mut poses[frame * width..(frame + 1) * width];
        row[..3].copy_from_slice(&root.to_scaled_axis().to_array());
        row[3 * Joint::LeftKnee as usize] = 0.5 * seconds;
        // SMPL's hand, SMPL-H's and SMPL-X's finger or jaw.
        row[66] = 0.7;
        trans.extend([5.0 + 0.3 * seconds, 2.0, 0.2]);
    }
    Motion {
        width,
        rate_key: "mocap_framerate",
        rate_hz,
        frames,
        poses,
        trans,
    }
}

impl Motion {
    fn write(&self, folder: &Path) -> PathBuf {
        let path = folder.join("motion_poses.npz");
        let mut writer = Writer::create(&path).unwrap();
        let frames = self.frames;
        let width = self.poses.len() / frames.max(1);
        let shape = [frames, if frames == 0 { self.width } else { width }];
        writer.array("poses", &shape, &self.poses).unwrap();
        writer
            .array("trans", &[self.trans.len() / 3, 3], &self.trans)
            .unwrap();
        writer.array("betas", &[16], &[0.5; 16]).unwrap();
        writer
            .array("dmpls", &[frames, 8], &vec![0.0; 8 * frames])
            .unwrap();
        writer.array(self.rate_key, &[], &[self.rate_hz]).unwrap();
        writer.finish().unwrap();
        path
    }
}

fn read(motion: &Motion) -> Result<Amass, MotionError> {
    let folder = tempfile::tempdir().unwrap();
    let path = motion.write(folder.path());
    Amass::read(File::open(path).unwrap())
}

#[test]
fn any_width_rate_and_key_gives_the_same_upright_motion() {
    let joints = joints_rest_m();
    for (width, rate_hz, rate_key) in [
        (72, 100.0, "mocap_framerate"),
        (156, 120.0, "mocap_framerate"),
        (165, 59.94, "mocap_frame_rate"),
    ] {
        let motion = Motion {
            rate_key,
            ..standing(width, rate_hz, 1 + rate_hz as usize)
        };
        let file = read(&motion).unwrap();
        assert_eq!(
            (file.up, file.betas.len(), file.dmpl_count),
            (UpAxis::Z, 16, 8)
        );
        assert_eq!(file.rate_hz, rate_hz);
        let clip = file.clip(&joints).resampled(MODEL_RATE_HZ).unwrap();
        let expected_frames = (rate_hz.floor() / rate_hz * 60.0 + 1e-6).floor() as usize + 1;
        assert_eq!(clip.frames.len(), expected_frames);
        for (frame, pose) in clip.frames.iter().enumerate() {
            let seconds = frame as f64 / 60.0;
            // It stands, turned about +Y, and drifts along x, which both worlds share.
            let world = pose.world_joints(&joints);
            let turned = DQuat::from_rotation_y(seconds);
            assert!(pose.parent_from_joint[0].dot(turned).abs() > 1.0 - 1e-9);
            assert!((pose.root_translation_m.x - 0.3 * seconds).abs() < 1e-9);
            let right_ankle = world.position_m[Joint::RightAnkle as usize];
            assert!((right_ankle.y - 0.08).abs() < 0.02, "{right_ankle}");
            let knee = pose.parent_from_joint[Joint::LeftKnee as usize];
            assert!(knee.dot(DQuat::from_rotation_x(0.5 * seconds)).abs() > 1.0 - 1e-9);
            let hand = pose.parent_from_joint[Joint::LeftHand as usize].to_scaled_axis();
            let expected = if width == 72 { 0.7 } else { 0.0 };
            assert!((hand - DVec3::X * expected).length() < 1e-9, "{hand}");
        }
    }
}

#[test]
fn what_is_no_motion_is_refused_with_its_place() {
    let usual = || standing(156, 120.0, 12);
    #[track_caller]
    fn check(motion: Motion, words: &[&str]) {
        let text = read(&motion).unwrap_err().to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` is missing in: {text}");
        }
    }
    check(
        Motion {
            rate_hz: 0.0,
            ..usual()
        },
        &["mocap_framerate is 0"],
    );
    check(
        Motion {
            rate_hz: f64::NAN,
            ..usual()
        },
        &["mocap_framerate is NaN"],
    );
    check(
        Motion {
            rate_key: "fps",
            ..usual()
        },
        &["`mocap_framerate`", "none in the file"],
    );
    check(standing(63 + 6, 60.0, 4), &["`poses`", "SMPL-H", "got 69"]);
    check(
        Motion {
            frames: 0,
            poses: vec![],
            trans: vec![],
            ..usual()
        },
        &["no frames"],
    );
    let mut short = usual();
    short.trans.truncate(30);
    check(short, &["`trans`", "shape [12, 3]", "[10, 3]"]);
    let mut holed = usual();
    holed.poses[500] = f64::NAN;
    check(holed, &["`poses`", "finite", "NaN"]);
    let mut wild = usual();
    wild.poses[156 * 3 + 7] = 1e300;
    check(wild, &["`poses`", "frame 4"]);
    let mut far = usual();
    far.trans[3] = 1e9;
    check(far, &["frame 2", "m from where"]);
}

#[test]
fn a_file_of_something_else_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shape.npz");
    let mut writer = Writer::create(&path).unwrap();
    writer.array("betas", &[16], &[0.0; 16]).unwrap();
    writer.finish().unwrap();
    let error = Amass::read(File::open(&path).unwrap()).unwrap_err();
    assert!(error.to_string().contains("`poses`"), "{error}");
    let error = Amass::read(std::io::Cursor::new(b"HIERARCHY".to_vec())).unwrap_err();
    assert!(error.to_string().contains("numpy.savez"), "{error}");
}
