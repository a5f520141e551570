//! Writes a motion that is known exactly as BVH files, for `scripts/exporters.mjs`.
//!
//! ```sh
//! cargo run -p dynaskin-motion --example known_motion -- BODY.glb OUT.bvh RATE_HZ t-pose|a-pose
//! ```
//!
//! Centimetres, +Y up. Every joint's zero rotation is the body's rest pose (`a-pose`), or the same with the
//! arms straight out to the sides and the legs straight down (`t-pose`).

use std::error::Error;
use std::fmt::Write as _;

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, SHAPE_COUNT};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use glam::{DQuat, DVec3, EulerRot, Vec3};

const CM_PER_M: f64 = 100.0;
const SECONDS: f64 = 4.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [body, out, rate_hz, zero] = &arguments[..] else {
        return Err("usage: known_motion BODY.glb OUT.bvh RATE_HZ t-pose|a-pose".into());
    };
    let body = BodyModel::from_glb(&std::fs::read(body)?)?;
    let rest_m = body.shaped(&[0.0; SHAPE_COUNT]).joints_m;
    let zero = match zero.as_str() {
        "a-pose" => [DQuat::IDENTITY; JOINT_COUNT],
        "t-pose" => limbs_straight(&rest_m),
        other => return Err(format!("`{other}` is neither t-pose nor a-pose").into()),
    };
    let clip = known(&rest_m, rate_hz.parse()?)?;
    std::fs::write(out, bvh(&clip, &rest_m, &zero)?)?;
    Ok(())
}

/// Running on the spot with a trunk, collars and a neck that turn.
fn known(rest_m: &[Vec3; JOINT_COUNT], rate_hz: f64) -> Result<Clip, Box<dyn Error>> {
    let run = Procedural::new(ProceduralKind::RunInPlace);
    let mut clip = run.clip(rest_m)?.resampled(rate_hz)?;
    clip.frames
        .truncate((SECONDS * rate_hz).round() as usize + 1);
    for (frame, pose) in clip.frames.iter_mut().enumerate() {
        let phase = (4.2 * frame as f64 / rate_hz).sin();
        for (joint, axis, angle) in [
            (Joint::Spine1, DVec3::X, 0.15 * phase),
            (Joint::Spine2, DVec3::Y, 0.2 * phase),
            (Joint::LeftCollar, DVec3::Z, 0.1 * phase),
            (Joint::RightCollar, DVec3::Z, 0.1 * phase),
            (Joint::Neck, DVec3::Y, 0.3 * phase),
        ] {
            let turn = &mut pose.parent_from_joint[joint as usize];
            *turn = (*turn * DQuat::from_axis_angle(axis, angle)).normalize();
        }
    }
    Ok(clip)
}

/// World rotations that take the rest pose to one with arms along x and legs along y. The feet stay flat.
fn limbs_straight(rest_m: &[Vec3; JOINT_COUNT]) -> [DQuat; JOINT_COUNT] {
    use Joint::{LeftAnkle, LeftElbow, LeftHand, LeftHip, LeftKnee, LeftShoulder, LeftWrist};
    let down = -DVec3::Y;
    let mut zero = [DQuat::IDENTITY; JOINT_COUNT];
    for (joint, from, to, along) in [
        (LeftShoulder, LeftShoulder, LeftElbow, DVec3::X),
        (LeftElbow, LeftElbow, LeftWrist, DVec3::X),
        (LeftWrist, LeftWrist, LeftHand, DVec3::X),
        (LeftHand, LeftWrist, LeftHand, DVec3::X),
        (LeftHip, LeftHip, LeftKnee, down),
        (LeftKnee, LeftKnee, LeftAnkle, down),
    ] {
        let mirror = DVec3::new(-1.0, 1.0, 1.0);
        for (joint, from, to, along) in [
            (joint, from, to, along),
            (
                joint.mirrored(),
                from.mirrored(),
                to.mirrored(),
                along * mirror,
            ),
        ] {
            let bone = (rest_m[to as usize] - rest_m[from as usize]).as_dvec3();
            zero[joint as usize] = DQuat::from_rotation_arc(bone.normalize(), along);
        }
    }
    zero
}

struct Skeleton {
    offset_cm: [DVec3; JOINT_COUNT],
    zero: [DQuat; JOINT_COUNT],
}

fn bvh(
    clip: &Clip,
    rest_m: &[Vec3; JOINT_COUNT],
    zero: &[DQuat; JOINT_COUNT],
) -> Result<String, std::fmt::Error> {
    let skeleton = Skeleton {
        offset_cm: Joint::ALL.map(|joint| {
            let own = rest_m[joint as usize].as_dvec3();
            CM_PER_M
                * joint.parent().map_or(own, |parent| {
                    zero[parent as usize] * (own - rest_m[parent as usize].as_dvec3())
                })
        }),
        zero: *zero,
    };
    let mut text = String::from("HIERARCHY\n");
    let mut order = Vec::new();
    skeleton.write_joint(Joint::Pelvis, &mut text, &mut order)?;
    let frames = clip.frames.len();
    let seconds = 1.0 / clip.rate_hz;
    writeln!(text, "MOTION\nFrames: {frames}\nFrame Time: {seconds:.10}")?;
    for pose in &clip.frames {
        skeleton.write_frame(pose, &order, &mut text)?;
    }
    Ok(text)
}

impl Skeleton {
    fn write_joint(
        &self,
        joint: Joint,
        text: &mut String,
        order: &mut Vec<Joint>,
    ) -> std::fmt::Result {
        order.push(joint);
        let DVec3 { x, y, z } = self.offset_cm[joint as usize];
        let (kind, channels) = match joint.parent() {
            None => ("ROOT", "6 Xposition Yposition Zposition"),
            Some(_) => ("JOINT", "3"),
        };
        writeln!(text, "{kind} {}\n{{", joint.name())?;
        writeln!(text, "OFFSET {x:.6} {y:.6} {z:.6}")?;
        writeln!(text, "CHANNELS {channels} Zrotation Yrotation Xrotation")?;
        let children: Vec<Joint> = Joint::ALL
            .into_iter()
            .filter(|child| child.parent() == Some(joint))
            .collect();
        for child in &children {
            self.write_joint(*child, text, order)?;
        }
        if children.is_empty() {
            // The bone goes on as it came, by half its length.
            let DVec3 { x, y, z } = 0.5 * self.offset_cm[joint as usize];
            writeln!(text, "End Site\n{{\nOFFSET {x:.6} {y:.6} {z:.6}\n}}")?;
        }
        writeln!(text, "}}")
    }

    fn write_frame(&self, pose: &Pose, order: &[Joint], text: &mut String) -> std::fmt::Result {
        let root_cm = self.offset_cm[Joint::Pelvis as usize] + CM_PER_M * pose.root_translation_m;
        write!(text, "{:.6} {:.6} {:.6}", root_cm.x, root_cm.y, root_cm.z)?;
        for joint in order {
            let before = joint
                .parent()
                .map_or(DQuat::IDENTITY, |parent| self.zero[parent as usize]);
            let own = before
                * pose.parent_from_joint[*joint as usize]
                * self.zero[*joint as usize].inverse();
            let (z, y, x) = own.to_euler(EulerRot::ZYX);
            let [z, y, x] = [z, y, x].map(f64::to_degrees);
            write!(text, " {z:.6} {y:.6} {x:.6}")?;
        }
        writeln!(text)
    }
}
