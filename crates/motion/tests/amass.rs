//! AMASS-like files, made here: widths, rates, axes, and what is refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::path::{Path, PathBuf};

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use dynaskin_motion::{
    Amass, AnimationChoice, MODEL_RATE_HZ, MotionError, MotionFile, ReadOptions, UpAxis,
};
use dynaskin_npz::Writer;
use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;

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
    read_with(motion, &ReadOptions::default())
}

fn read_with(motion: &Motion, options: &ReadOptions) -> Result<Amass, MotionError> {
    let folder = tempfile::tempdir().unwrap();
    let path = motion.write(folder.path());
    Amass::read_with(File::open(path).unwrap(), options)
}

/// A file of these arrays.
fn archive(arrays: &[(&str, &[usize], &[f64])]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.npz");
    let mut writer = Writer::create(&path).unwrap();
    for (name, shape, values) in arrays {
        writer.array(name, shape, values).unwrap();
    }
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}

/// Frames of the same motion, as far as the first 22 joints go.
#[track_caller]
fn check_alike(bytes: &[u8], options: &ReadOptions, expected: &Amass) {
    let file = Amass::read_with(std::io::Cursor::new(bytes), options).unwrap();
    assert_eq!((file.rate_hz, file.up), (expected.rate_hz, expected.up));
    let joints = joints_rest_m();
    let [clip, expected] = [&file, expected].map(|file| file.clip(&joints));
    assert_eq!(clip.frames.len(), expected.frames.len());
    for (pose, expected) in clip.frames.iter().zip(&expected.frames) {
        assert_eq!(pose.root_translation_m, expected.root_translation_m);
        assert_eq!(
            pose.parent_from_joint[..22],
            expected.parent_from_joint[..22]
        );
    }
}

#[test]
fn spellings_of_keys_and_split_arrays_give_the_same_motion() {
    let motion = standing(156, 50.0, 20);
    let expected = read(&motion).unwrap();
    let usual = ReadOptions::default();
    let rate = [motion.rate_hz];
    let cut = |from: usize, to: usize| -> Vec<f64> {
        let rows = motion.poses.chunks_exact(156);
        rows.flat_map(|row| row[from..to].to_vec()).collect()
    };
    for key in [
        "mocap_framerate",
        "mocap_frame_rate",
        "fps",
        "frame_rate",
        "framerate",
    ] {
        let bytes = archive(&[
            ("poses", &[20, 156], &motion.poses),
            ("trans", &[20, 3], &motion.trans),
            (key, &[1], &rate),
        ]);
        check_alike(&bytes, &usual, &expected);
    }
    for width in [66, 72, 75, 135, 156] {
        let bytes = archive(&[
            ("poses", &[20, width], &cut(0, width)),
            ("trans", &[20, 3], &motion.trans),
            ("fps", &[], &rate),
        ]);
        check_alike(&bytes, &usual, &expected);
        let by_joints = archive(&[
            ("pose", &[20, width / 3, 3], &cut(0, width)),
            ("transl", &[20, 3], &motion.trans),
            ("fps", &[], &rate),
        ]);
        check_alike(&by_joints, &usual, &expected);
    }
    for [root, body, trans] in [
        ["root_orient", "pose_body", "trans"],
        ["global_orient", "body_pose", "transl"],
    ] {
        for width in [63, 69] {
            let bytes = archive(&[
                (root, &[20, 3], &cut(0, 3)),
                (body, &[20, width], &cut(3, 3 + width)),
                (trans, &[20, 3], &motion.trans),
                ("mocap_frame_rate", &[], &rate),
            ]);
            check_alike(&bytes, &usual, &expected);
            let by_joints = archive(&[
                (root, &[20, 1, 3], &cut(0, 3)),
                (body, &[20, width / 3, 3], &cut(3, 3 + width)),
                (trans, &[20, 3], &motion.trans),
                ("mocap_frame_rate", &[], &rate),
            ]);
            check_alike(&by_joints, &usual, &expected);
        }
    }
    let without_rate = archive(&[
        ("poses", &[20, 156], &motion.poses),
        ("trans", &[20, 3], &motion.trans),
    ]);
    let options = ReadOptions {
        rate_hz: Some(50.0),
        ..ReadOptions::default()
    };
    check_alike(&without_rate, &options, &expected);
}

#[test]
fn what_the_caller_says_goes_before_what_the_file_says() {
    let mut options = ReadOptions {
        rate_hz: Some(25.0),
        up: Some(UpAxis::Y),
        ..ReadOptions::default()
    };
    let file = read_with(&standing(72, 100.0, 5), &options).unwrap();
    assert_eq!((file.rate_hz, file.up), (25.0, UpAxis::Y));
    options.rate_hz = Some(0.2);
    let error = read_with(&standing(72, 100.0, 5), &options)
        .map(|_| ())
        .unwrap_err();
    assert!(error.to_string().contains("0.2"), "{error}");
    options.rate_hz = None;
    options.animation = Some(AnimationChoice::Index(0));
    let error = read_with(&standing(72, 100.0, 5), &options)
        .map(|_| ())
        .unwrap_err();
    assert!(
        matches!(
            error,
            MotionError::OptionNotForFile {
                option: "animation",
                ..
            }
        ),
        "{error}"
    );
}

/// Root rotation vectors of somebody upright, lying or in a camera's world, and what is made of it.
#[test]
fn up_is_along_the_body_where_the_file_does_not_say_it() {
    use std::f64::consts::{FRAC_PI_2, PI};
    for (root, height_m, up, note) in [
        ([FRAC_PI_2, 0.0, 0.0], [0.0, 0.0, 0.9], UpAxis::Z, ""),
        (
            [0.0, 0.3, 0.0],
            [0.0, 0.9, 0.0],
            UpAxis::Y,
            "stands along y",
        ),
        (
            [PI, 0.0, 0.0],
            [0.0, -0.2, 3.0],
            UpAxis::MinusY,
            "stands along -y",
        ),
        // On the back in AMASS's world: the trunk along y, the pelvis a hand above z = 0.
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.1], UpAxis::Z, "hardly stands"),
    ] {
        let (mut poses, mut trans) = (vec![0.0; 10 * 66], Vec::new());
        for row in poses.chunks_exact_mut(66) {
            row[..3].copy_from_slice(&root);
            trans.extend(height_m);
        }
        let bytes = archive(&[
            ("poses", &[10, 66], &poses),
            ("trans", &[10, 3], &trans),
            ("fps", &[], &[30.0]),
        ]);
        let file = Amass::read(std::io::Cursor::new(bytes)).unwrap();
        assert_eq!(file.up, up, "{root:?}");
        let notes = file.notes().join("; ");
        assert!(
            notes.contains(note) && notes.is_empty() == note.is_empty(),
            "{notes}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_read_or_refused(
        changes in proptest::collection::vec((0.0..1.0_f64, any::<u8>()), 1..6),
        end in 0.2..1.0_f64,
    ) {
        static FILE: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
        let mut bytes = FILE
            .get_or_init(|| {
                let motion = standing(72, 30.0, 4);
                archive(&[
                    ("poses", &[4, 72], &motion.poses),
                    ("trans", &[4, 3], &motion.trans),
                    ("fps", &[], &[30.0]),
                    ("betas", &[10], &[0.1; 10]),
                ])
            })
            .clone();
        for (place, byte) in changes {
            let place = (place * bytes.len() as f64) as usize;
            bytes[place] = byte;
        }
        // Half of them are cut, too.
        if end < 0.6 {
            bytes.truncate((end * bytes.len() as f64) as usize);
        }
        if let Ok(file) = MotionFile::parse(&bytes) {
            let clip = file.clip(&joints_rest_m()).expect("what is read can be used").clip;
            prop_assert!(clip.frames.iter().all(Pose::is_valid));
        }
    }
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
        let text = read(&motion).map(|_| ()).unwrap_err().to_string();
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
            rate_key: "speed",
            ..usual()
        },
        &["`mocap_framerate`", "`fps`", "option `rate`", "none"],
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
