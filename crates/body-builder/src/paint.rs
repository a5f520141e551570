//! Vertex colours: a neutral mannequin in painted sportswear.

use glam::Vec3;

use dynaskin_body::{Joint, Sex, SkinWeights};

const SKIN_SRGB: Vec3 = Vec3::new(206.0, 176.0, 155.0);
const CLOTH_SRGB: Vec3 = Vec3::new(38.0, 66.0, 84.0);
/// Half the width in metres over which cloth fades into skin: about the distance of two vertices.
/// Narrower, and the border would follow the triangles; as it is, the line where the mixture is
/// even runs straight through them.
const FADE_M: f32 = 0.02;

/// sRGB colour and opacity per vertex.
pub(super) fn colors_srgba(
    sex: Sex,
    positions_m: &[Vec3],
    joints_m: &[Vec3; 24],
    skin: &[SkinWeights],
) -> Vec<[u8; 4]> {
    let joint = |j: Joint| joints_m[j as usize];
    let hip = joint(Joint::LeftHip);
    let knee = joint(Joint::LeftKnee);
    let chest_top_y = joint(Joint::LeftCollar).y - 0.02;
    let chest_low_y = joint(Joint::Spine3).y - if sex == Sex::Female { 0.10 } else { 0.60 };
    positions_m
        .iter()
        .zip(skin)
        .map(|(&position, skin)| {
            let weight = |wanted: &[Joint]| -> f32 {
                skin.joints
                    .iter()
                    .zip(&skin.weights)
                    .filter(|(joint, _)| wanted.iter().any(|j| *j as u8 == **joint))
                    .map(|(_, weight)| weight)
                    .sum()
            };
            let mirrored = Vec3::new(position.x.abs(), position.y, position.z);
            let down_thigh = (mirrored - hip).dot(knee - hip) / (knee - hip).length_squared();
            let lower = weight(&[
                Joint::Pelvis,
                Joint::LeftHip,
                Joint::RightHip,
                Joint::Spine1,
            ]);
            let thigh_m = hip.distance(knee);
            let shorts = least([
                step(lower, 0.5, 0.2),
                inside_m((0.42 - down_thigh) * thigh_m),
                inside_m(joint(Joint::Pelvis).y + 0.05 - position.y),
            ]);
            // Straps over the shoulders, open at the neck.
            let neckline = chest_top_y + 0.12
                - 1.3 * (0.085 - mirrored.x.min(0.085))
                - if position.z < joint(Joint::Spine3).z {
                    -0.03
                } else {
                    0.02
                };
            let strap = inside_m(0.135 - mirrored.x)
                .max(inside_m(joint(Joint::LeftShoulder).y - 0.045 - position.y));
            let torso = 1.0
                - weight(&[
                    Joint::LeftShoulder,
                    Joint::RightShoulder,
                    Joint::LeftElbow,
                    Joint::RightElbow,
                    Joint::LeftWrist,
                    Joint::RightWrist,
                    Joint::LeftHand,
                    Joint::RightHand,
                    Joint::Head,
                ]);
            let top = least([
                step(torso, 0.55, 0.2),
                strap,
                inside_m(neckline - position.y),
                inside_m(position.y - chest_low_y),
                inside_m(position.y - (hip.y - 0.05)),
            ]);
            let color = SKIN_SRGB.lerp(CLOTH_SRGB, shorts.max(top));
            [
                color.x.round() as u8,
                color.y.round() as u8,
                color.z.round() as u8,
                255,
            ]
        })
        .collect()
}

/// How much cloth lies at `distance_m` inside its border.
fn inside_m(distance_m: f32) -> f32 {
    step(distance_m, 0.0, FADE_M)
}

fn least<const N: usize>(shares: [f32; N]) -> f32 {
    shares.into_iter().fold(1.0, f32::min)
}

/// 0 below `edge - width`, 1 above `edge + width`.
fn step(x: f32, edge: f32, width: f32) -> f32 {
    ((x - edge) / (2.0 * width) + 0.5).clamp(0.0, 1.0)
}
