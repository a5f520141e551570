//! Retargeting of made-up skeletons.

mod common;

use common::{MIXAMO, Names, female_joints_m, source_bvh};
use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_motion::{Bvh, Clip, JointReport, LengthUnit, MotionError, SourceMotion, retarget};
use glam::{DQuat, DVec3};

fn run(text: &str) -> (Bvh, Clip, JointReport) {
    let bvh = Bvh::parse(text.as_bytes()).expect("the test's file is right");
    let (clip, report) = retarget(&bvh, &female_joints_m()).expect("a person");
    (bvh, clip, report)
}

/// Frames with the same angles of every joint, slowly and differently changing.
fn lively(count: usize) -> Vec<Vec<f64>> {
    (0..count)
        .map(|frame| {
            let angle = |idx: usize| 40.0 * (0.21 * frame as f64 + 1.7 * idx as f64).sin();
            (0..69).map(angle).collect()
        })
        .collect()
}

/// Skeletons of other tools and makers.
const OTHERS: [Names; 8] = [
    // CMU in the BVH conversion by B. Hahne (cgspeed), its file for MotionBuilder.
    Names {
        sides: ["Left", "Right"],
        pelvis: "Hips",
        spine: &["LowerBack", "Spine", "Spine1"],
        neck: "Neck",
        head: "Head",
        arm: ["{}Shoulder", "{}Arm", "{}ForeArm", "{}Hand"],
        leg: ["{}UpLeg", "{}Leg", "{}Foot", "{}ToeBase"],
    },
    // The same conversion for Daz and Poser.
    Names {
        sides: ["l", "r"],
        pelvis: "hip",
        spine: &["abdomen", "chest"],
        neck: "neck",
        head: "head",
        arm: ["{}Collar", "{}Shldr", "{}ForeArm", "{}Hand"],
        leg: ["{}Thigh", "{}Shin", "{}Foot", "{}Toe"],
    },
    // Rokoko Studio.
    Names {
        sides: ["Left", "Right"],
        pelvis: "Hips",
        spine: &["Spine", "Spine2", "Spine3", "Spine4"],
        neck: "Neck",
        head: "Head",
        arm: ["{}Shoulder", "{}Arm", "{}ForeArm", "{}Hand"],
        leg: ["{}Thigh", "{}Shin", "{}Foot", "{}Toe"],
    },
    // Blender's rigs.
    Names {
        sides: ["L", "R"],
        pelvis: "hips",
        spine: &["spine", "chest", "upper_chest"],
        neck: "neck",
        head: "head",
        arm: ["shoulder.{}", "upper_arm.{}", "forearm.{}", "hand.{}"],
        leg: ["thigh.{}", "shin.{}", "foot.{}", "toe.{}"],
    },
    // SMPL.
    Names {
        sides: ["L", "R"],
        pelvis: "m_avg_Pelvis",
        spine: &["m_avg_Spine1", "m_avg_Spine2", "m_avg_Spine3"],
        neck: "m_avg_Neck",
        head: "m_avg_Head",
        arm: [
            "m_avg_{}_Collar",
            "m_avg_{}_Shoulder",
            "m_avg_{}_Elbow",
            "m_avg_{}_Wrist",
        ],
        leg: [
            "m_avg_{}_Hip",
            "m_avg_{}_Knee",
            "m_avg_{}_Ankle",
            "m_avg_{}_Foot",
        ],
    },
    // 3ds Max Biped.
    Names {
        sides: ["L", "R"],
        pelvis: "Bip01 Pelvis",
        spine: &["Bip01 Spine"],
        neck: "Bip01 Neck",
        head: "Bip01 Head",
        arm: [
            "Bip01 {} Clavicle",
            "Bip01 {} UpperArm",
            "Bip01 {} Forearm",
            "Bip01 {} Hand",
        ],
        leg: [
            "Bip01 {} Thigh",
            "Bip01 {} Calf",
            "Bip01 {} Foot",
            "Bip01 {} Toe0",
        ],
    },
    // Unreal's mannequin.
    Names {
        sides: ["l", "r"],
        pelvis: "pelvis",
        spine: &["spine_01", "spine_02", "spine_03", "spine_04", "spine_05"],
        neck: "neck_01",
        head: "head",
        arm: ["clavicle_{}", "upperarm_{}", "lowerarm_{}", "hand_{}"],
        leg: ["thigh_{}", "calf_{}", "foot_{}", "ball_{}"],
    },
    // Motion capture of the 1990s, as in the format's first files; shouted.
    Names {
        sides: ["LEFT", "RIGHT"],
        pelvis: "HIPS",
        spine: &["CHEST", "CHEST2"],
        neck: "NECK",
        head: "HEAD",
        arm: ["{}COLLAR", "{}SHOULDER", "{}ELBOW", "{}WRIST"],
        leg: ["{}HIP", "{}KNEE", "{}ANKLE", "{}TOE"],
    },
];

#[test]
fn common_names_are_recognised_and_move_alike() {
    let frames = lively(12);
    for names in &OTHERS {
        let (_, _, report) = run(&source_bvh(names, 1.0, &frames));
        assert_eq!(report.unmapped, [] as [&str; 0], "{}", names.leg[0]);
        // Hands end at the wrist in these skeletons.
        assert_eq!(
            report.missing,
            [Joint::LeftHand, Joint::RightHand],
            "{}",
            names.leg[0]
        );
        let of = |joint: Joint| {
            let found = report.mapped.iter().find(|(mapped, _)| *mapped == joint);
            found.map(|(_, source)| source.as_str())
        };
        assert_eq!(of(Joint::Pelvis), Some(names.pelvis));
        let limbs = [
            (
                [
                    Joint::LeftCollar,
                    Joint::LeftShoulder,
                    Joint::LeftElbow,
                    Joint::LeftWrist,
                ],
                names.arm,
            ),
            (
                [
                    Joint::LeftHip,
                    Joint::LeftKnee,
                    Joint::LeftAnkle,
                    Joint::LeftFoot,
                ],
                names.leg,
            ),
        ];
        for (joint, name) in limbs
            .iter()
            .flat_map(|(joints, names)| joints.iter().zip(names))
        {
            assert_eq!(
                of(*joint),
                Some(name.replace("{}", names.sides[0]).as_str())
            );
            assert_eq!(
                of(joint.mirrored()),
                Some(name.replace("{}", names.sides[1]).as_str())
            );
        }
    }
}

#[test]
fn limbs_point_where_the_source_limbs_point() {
    let frames = lively(40);
    let (bvh, clip, report) = run(&source_bvh(&MIXAMO, 1.0, &frames));
    let rest_m = female_joints_m();
    let source_of = |joint: Joint| {
        let (_, name) = report
            .mapped
            .iter()
            .find(|(mapped, _)| *mapped == joint)
            .unwrap();
        bvh.joints
            .iter()
            .position(|source| source.name == *name)
            .unwrap()
    };
    let bones = [
        (Joint::LeftHip, Joint::LeftKnee),
        (Joint::LeftKnee, Joint::LeftAnkle),
        (Joint::LeftShoulder, Joint::LeftElbow),
        (Joint::LeftElbow, Joint::LeftWrist),
    ];
    for (frame, pose) in clip.frames.iter().enumerate() {
        let target = pose.world_joints(&rest_m).position_m;
        let source = bvh.world_joints(frame);
        for (from, to) in bones
            .into_iter()
            .flat_map(|(a, b)| [(a, b), (a.mirrored(), b.mirrored())])
        {
            let source_bone = source[source_of(to)].1 - source[source_of(from)].1;
            let target_bone = target[to as usize] - target[from as usize];
            let degrees = source_bone.angle_between(target_bone).to_degrees();
            assert!(degrees < 0.1, "frame {frame}, {}: {degrees}", from.name());
        }
        // Trunk and head turn as the source's do: both rest poses stand upright.
        for joint in [
            Joint::Pelvis,
            Joint::Spine1,
            Joint::Spine3,
            Joint::Neck,
            Joint::Head,
        ] {
            let target_rotation = pose.world_joints(&rest_m).rotation[joint as usize];
            let angle = target_rotation.angle_between(source[source_of(joint)].0);
            assert!(angle.to_degrees() < 0.1, "frame {frame}, {}", joint.name());
        }
    }
}

#[test]
fn a_standing_source_stands_on_flat_soles() {
    let frames = vec![Vec::new(); 30];
    let (_, clip, _) = run(&source_bvh(&MIXAMO, 1.0, &frames));
    let rest_m = female_joints_m();
    for pose in &clip.frames {
        let world = pose.world_joints(&rest_m);
        for ankle in [Joint::LeftAnkle, Joint::RightAnkle] {
            let up = world.rotation[ankle as usize] * DVec3::Y;
            assert!(up.y > 0.999, "{up}");
            let above_m = world.position_m[ankle as usize].y - f64::from(rest_m[ankle as usize].y);
            assert!(above_m.abs() < 2e-3, "{above_m}");
        }
    }
}

/// The body's own skeleton as a file, in centimetres, with SMPL's names.
fn own_skeleton(angles: &dyn Fn(usize, Joint) -> [f64; 3], frames: usize) -> String {
    fn block(text: &mut String, joint: Joint, rest: &[glam::Vec3; JOINT_COUNT]) {
        let parent = joint
            .parent()
            .map_or(glam::Vec3::ZERO, |parent| rest[parent as usize]);
        let offset = 100.0 * (rest[joint as usize] - parent);
        let kind = if joint == Joint::Pelvis {
            "ROOT"
        } else {
            "JOINT"
        };
        let channels = "CHANNELS 3 Xrotation Yrotation Zrotation";
        *text += &format!(
            "{kind} {}\n{{\nOFFSET {} {} {}\n{channels}\n",
            joint.name(),
            offset.x,
            offset.y,
            offset.z
        );
        for child in Joint::ALL
            .into_iter()
            .filter(|child| child.parent() == Some(joint))
        {
            block(text, child, rest);
        }
        *text += "}\n";
    }
    fn order(joint: Joint) -> Vec<Joint> {
        let children = Joint::ALL
            .into_iter()
            .filter(|child| child.parent() == Some(joint));
        [joint]
            .into_iter()
            .chain(children.flat_map(order))
            .collect()
    }
    let mut text = "HIERARCHY\n".to_owned();
    block(&mut text, Joint::Pelvis, &female_joints_m());
    text += &format!("MOTION\nFrames: {frames}\nFrame Time: 0.0166667\n");
    for frame in 0..frames {
        for joint in order(Joint::Pelvis) {
            for angle in angles(frame, joint) {
                text += &format!("{angle} ");
            }
        }
        text += "\n";
    }
    text
}

#[test]
fn the_bodys_own_skeleton_comes_back_unchanged() {
    // The feet stay on the floor, all else moves.
    let angles = |frame: usize, joint: Joint| {
        let name = joint.name();
        if ["pelvis", "hip", "knee", "ankle", "foot"]
            .iter()
            .any(|leg| name.ends_with(leg))
        {
            return [0.0; 3];
        }
        [0.0, 1.0, 2.0].map(|k| 50.0 * (0.3 * frame as f64 + 2.0 * k + joint as usize as f64).sin())
    };
    let (bvh, clip, report) = run(&own_skeleton(&angles, 20));
    assert_eq!(report.mapped.len(), JOINT_COUNT);
    assert!((report.metres_per_unit - 0.01).abs() < 1e-6);
    assert_eq!(report.unit, LengthUnit::Centimetre);
    for (frame, pose) in clip.frames.iter().enumerate() {
        assert!(
            pose.root_translation_m.length() < 1e-5,
            "{}",
            pose.root_translation_m
        );
        for joint in Joint::ALL {
            let source = bvh
                .joints
                .iter()
                .position(|source| source.name == joint.name())
                .unwrap();
            let expected = bvh.parent_from_joint(frame, source);
            let angle = pose.parent_from_joint[joint as usize].angle_between(expected);
            assert!(angle < 1e-5, "frame {frame}, {}: {angle}", joint.name());
        }
    }
}

/// Largest distance in metres between the same joints of two clips.
fn difference_m(a: &Clip, b: &Clip) -> f64 {
    assert_eq!(a.frames.len(), b.frames.len());
    let rest_m = female_joints_m();
    let frames = a.frames.iter().zip(&b.frames);
    let distances = frames.flat_map(|(a, b)| {
        let (a, b) = (a.world_joints(&rest_m), b.world_joints(&rest_m));
        Joint::ALL.map(|joint| a.position_m[joint as usize].distance(b.position_m[joint as usize]))
    });
    distances.fold(0.0, f64::max)
}

#[test]
fn the_unit_of_the_file_does_not_matter() {
    let frames = lively(10).into_iter().map(|mut frame| {
        frame[..3].fill(0.0);
        frame
    });
    let frames: Vec<_> = frames.collect();
    let (_, centimetres, report) = run(&source_bvh(&MIXAMO, 1.0, &frames));
    assert_eq!(report.unit, LengthUnit::Centimetre);
    for (scale, unit) in [
        (0.01, LengthUnit::Metre),
        (1.0 / 2.54, LengthUnit::Inch),
        (10.0, LengthUnit::Millimetre),
        (0.05, LengthUnit::Other),
    ] {
        let (_, clip, report) = run(&source_bvh(&MIXAMO, scale, &frames));
        assert_eq!(report.unit, unit);
        assert!(difference_m(&clip, &centimetres) < 1e-6, "{}", unit.name());
    }
}

/// The same person and motion in a file with z up: y becomes z, z becomes -y.
fn z_up(names: &Names, frames: &[Vec<f64>]) -> String {
    // The third position and the first angle of each joint are along and about z: now -y.
    let mut turned = frames.to_vec();
    for frame in &mut turned {
        frame[2] *= -1.0;
        for angles in frame[3..].chunks_mut(3) {
            angles[0] *= -1.0;
        }
    }
    let mut text = source_bvh(names, 1.0, &turned);
    let bvh = Bvh::parse(text.as_bytes()).expect("the test's file is right");
    for joint in &bvh.joints {
        for offset in [Some(joint.offset), joint.end_site].into_iter().flatten() {
            let old = format!("OFFSET {} {} {}\n", offset.x, offset.y, offset.z);
            // The blank keeps it from being replaced again.
            let new = format!("OFFSET {} {} {} \n", offset.x, -offset.z, offset.y);
            text = text.replace(&old, &new);
        }
    }
    text = text.replace(
        "Zrotation Yrotation Xrotation",
        "Yrotation Zrotation Xrotation",
    );
    text.replace(
        "Xposition Yposition Zposition",
        "Xposition Zposition Yposition",
    )
}

#[test]
fn a_file_with_z_up_gives_the_same_clip() {
    let frames: Vec<Vec<f64>> = lively(10)
        .into_iter()
        .map(|frame| frame.into_iter().map(|value| 0.4 * value).collect())
        .collect();
    let (_, y_up, _) = run(&source_bvh(&MIXAMO, 1.0, &frames));
    let (_, from_z_up, _) = run(&z_up(&MIXAMO, &frames));
    assert!(difference_m(&y_up, &from_z_up) < 1e-6);
}

#[test]
fn a_file_without_a_person_is_refused_by_the_names_it_lacks() {
    let robot = "HIERARCHY\nROOT base\n{\nOFFSET 0 0 0\nCHANNELS 1 Yrotation\nJOINT boom\n{\n\
                 OFFSET 0 1 0\nCHANNELS 1 Xrotation\n}\n}\nMOTION\nFrames: 1\nFrame Time: 1\n0 0\n";
    let bvh = Bvh::parse(robot.as_bytes()).unwrap();
    let Err(MotionError::MissingJoints { missing, total, .. }) = retarget(&bvh, &female_joints_m())
    else {
        panic!("a robot arm was taken for a person");
    };
    assert_eq!(total, 2);
    assert!(missing.contains(&Joint::LeftKnee));

    let one_leg = source_bvh(&MIXAMO, 1.0, &[Vec::new()]).replace("RightLeg", "Crank");
    let bvh = Bvh::parse(one_leg.as_bytes()).unwrap();
    let error = retarget(&bvh, &female_joints_m()).expect_err("a knee is missing");
    assert!(error.to_string().contains("right_knee"), "{error}");
}

#[test]
fn a_body_that_leaves_for_the_moon_is_refused() {
    let mut frames = lively(5);
    frames[3][1] = 9e8;
    let bvh = Bvh::parse(source_bvh(&MIXAMO, 1.0, &frames).as_bytes()).unwrap();
    let result = retarget(&bvh, &female_joints_m());
    assert!(
        matches!(result, Err(MotionError::TooFar { frame: 4, .. })),
        "{result:?}"
    );
}

#[test]
fn bones_without_length_are_refused_or_tolerated() {
    // Zero offsets of neck and collars are common and harmless.
    let text = source_bvh(&MIXAMO, 1.0, &lively(5)).replace("OFFSET 3 8 0", "OFFSET 0 0 0");
    assert_ne!(text, source_bvh(&MIXAMO, 1.0, &lively(5)));
    let (_, clip, _) = run(&text);
    assert!(clip.frames.iter().all(dynaskin_body::Pose::is_valid));
    let flat = source_bvh(&MIXAMO, 0.0, &[Vec::new()]);
    let bvh = Bvh::parse(flat.as_bytes()).unwrap();
    let result = retarget(&bvh, &female_joints_m());
    assert!(
        matches!(result, Err(MotionError::Degenerate { .. })),
        "{result:?}"
    );
}

#[test]
fn a_short_spine_bends_in_between() {
    // One spine joint turned by 60 degrees: the body's three share the turn.
    let mut frame = vec![0.0; 69];
    frame[8] = 60.0;
    let text = source_bvh(&OTHERS[5], 1.0, &[frame]);
    let (_, clip, _) = run(&text);
    for joint in [Joint::Spine1, Joint::Spine2, Joint::Spine3] {
        let degrees = clip.frames[0].parent_from_joint[joint as usize]
            .angle_between(DQuat::IDENTITY)
            .to_degrees();
        assert!((degrees - 20.0).abs() < 1e-3, "{}: {degrees}", joint.name());
    }
}
