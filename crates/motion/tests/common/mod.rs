//! What several tests need; each uses a part of it.
#![allow(dead_code)]

pub mod conventions;
pub mod glb;
pub mod poses;
pub mod zero;

use std::path::PathBuf;

use dynaskin_body::{BodyModel, JOINT_COUNT, SHAPE_COUNT};
use glam::Vec3;

/// Rest joints in metres of the project's female body, in its A-pose.
pub fn female_joints_m() -> [Vec3; JOINT_COUNT] {
    joints_m("female", &[0.0; SHAPE_COUNT])
}

/// Rest joints in metres of a shape of one of the project's bodies.
pub fn joints_m(name: &str, shape: &[f32; SHAPE_COUNT]) -> [Vec3; JOINT_COUNT] {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../models")
        .join(name)
        .join("body.glb");
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let body = BodyModel::from_glb(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
    body.shaped(shape).joints_m
}

/// Joint names of a source skeleton: pelvis, spine, neck, head, then of the left side collar,
/// shoulder, elbow, wrist, hip, knee, ankle and toes; `{}` takes the place of the side.
pub struct Names {
    /// Names of the left and right side.
    pub sides: [&'static str; 2],
    pub pelvis: &'static str,
    pub spine: &'static [&'static str],
    pub neck: &'static str,
    pub head: &'static str,
    pub arm: [&'static str; 4],
    pub leg: [&'static str; 4],
}

/// The names that Adobe's Mixamo exports.
pub const MIXAMO: Names = Names {
    sides: ["Left", "Right"],
    pelvis: "mixamorig:Hips",
    spine: &["mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2"],
    neck: "mixamorig:Neck",
    head: "mixamorig:Head",
    arm: [
        "mixamorig:{}Shoulder",
        "mixamorig:{}Arm",
        "mixamorig:{}ForeArm",
        "mixamorig:{}Hand",
    ],
    leg: [
        "mixamorig:{}UpLeg",
        "mixamorig:{}Leg",
        "mixamorig:{}Foot",
        "mixamorig:{}ToeBase",
    ],
};

/// A BVH of a person of 1.8 m in a T-pose with legs spread by 20 degrees, in centimetres times
/// `scale`. `frames` hold a root position's and then each joint's Z, Y, X angles, in the order
/// pelvis, spine, neck, head, left arm, right arm, left leg, right leg; missing values are 0.
pub fn source_bvh(names: &Names, scale: f64, frames: &[Vec<f64>]) -> String {
    let chain =
        |side: usize, parts: &[&str; 4]| parts.map(|part| part.replace("{}", names.sides[side]));
    let mut text = format!("HIERARCHY\nROOT {}\n{{\n", names.pelvis);
    let offset = |offset: [f64; 3]| {
        let [x, y, z] = offset.map(|value| value * scale);
        format!("OFFSET {x} {y} {z}\n")
    };
    text += &offset([0.0, 95.0, 0.0]);
    text += "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n";
    let joint = |name: &str, place: [f64; 3]| {
        format!(
            "JOINT {name}\n{{\n{}CHANNELS 3 Zrotation Yrotation Xrotation\n",
            offset(place)
        )
    };
    let end = |place: [f64; 3]| format!("End Site\n{{\n{}}}\n", offset(place));
    let spine_step = 40.0 / names.spine.len() as f64;
    for name in names.spine {
        text += &joint(name, [0.0, spine_step, 0.0]);
    }
    text += &joint(names.neck, [0.0, 12.0, 0.0]);
    text += &joint(names.head, [0.0, 12.0, 2.0]);
    text += &end([0.0, 15.0, 0.0]);
    text += "}\n}\n";
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let places = [
            [3.0, 8.0, 0.0],
            [16.0, 3.0, -3.0],
            [29.0, 0.0, 0.0],
            [25.0, 0.0, 0.0],
        ];
        for (name, [x, y, z]) in chain(side, &names.arm).iter().zip(places) {
            text += &joint(name, [sign * x, y, z]);
        }
        text += &end([sign * 18.0, 0.0, 0.0]);
        text += "}\n}\n}\n}\n";
    }
    text += &"}\n".repeat(names.spine.len());
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        // 20 degrees outward: the sine is 0.342, the cosine 0.940.
        let places = [
            [9.0, -8.0, 2.0],
            [0.342 * 42.0, -0.940 * 42.0, 0.0],
            [0.342 * 41.0, -0.940 * 41.0, 0.0],
            [1.2, -3.3, 13.0],
        ];
        for (name, [x, y, z]) in chain(side, &names.leg).iter().zip(places) {
            text += &joint(name, [sign * x, y, z]);
        }
        text += &end([0.0, 0.0, 6.0]);
        text += "}\n}\n}\n}\n";
    }
    text += &format!(
        "}}\nMOTION\nFrames: {}\nFrame Time: 0.0333333\n",
        frames.len()
    );
    let count = 3 + 3 * (19 + names.spine.len());
    for frame in frames {
        let position = [0.0, 95.0 * scale, 0.0];
        let values: Vec<String> = (0..count)
            .map(|idx| frame.get(idx).copied().unwrap_or(0.0) + position.get(idx).unwrap_or(&0.0))
            .map(|value| value.to_string())
            .collect();
        text += &values.join(" ");
        text += "\n";
    }
    text
}
