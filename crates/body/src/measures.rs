//! Stature, volume and chest circumference of a rest surface.

use glam::Vec3;

use crate::{Joint, SkinWeights};

/// Mean density of an adult body in kg/m³: between fat (900) and lean mass (1100).
pub const DENSITY_KG_PER_M3: f64 = 1_010.0;

/// From the lowest to the highest vertex, in metres.
pub fn stature_m(positions_m: &[Vec3]) -> f64 {
    let heights = || positions_m.iter().map(|position| position.y);
    f64::from(heights().fold(f32::MIN, f32::max) - heights().fold(f32::MAX, f32::min))
}

/// Volume inside a closed surface in m³: signed tetrahedra from the origin.
pub fn volume_m3(positions_m: &[Vec3], faces: &[[u32; 3]]) -> f64 {
    let at = |vertex: u32| positions_m[vertex as usize].as_dvec3();
    let six_fold: f64 = faces
        .iter()
        .map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))))
        .sum();
    six_fold / 6.0
}

/// Length in metres of a tape around the trunk at the height of the middle of the chest's tissue.
pub fn chest_girth_m(
    positions_m: &[Vec3],
    faces: &[[u32; 3]],
    skin: &[SkinWeights],
    chest_weights: &[f32],
) -> f64 {
    let total: f32 = chest_weights.iter().sum();
    let weighted = positions_m.iter().zip(chest_weights);
    let height_m = weighted.map(|(p, weight)| p.y * weight).sum::<f32>() / total;
    let is_below = |vertex: u32| positions_m[vertex as usize].y < height_m;
    let mut cut_m: Vec<[f64; 2]> = Vec::new();
    for face in faces {
        let below = face.map(is_below);
        // Most faces are not cut; to look whose they are takes longer.
        if below.iter().all(|b| *b) || below.iter().all(|b| !b) {
            continue;
        }
        if face.iter().any(|vertex| is_arm(&skin[*vertex as usize])) {
            continue;
        }
        for edge in [[0, 1], [1, 2], [2, 0]] {
            let [a, b] = edge.map(|corner| positions_m[face[corner] as usize]);
            if (a.y < height_m) != (b.y < height_m) {
                let at = a.lerp(b, (height_m - a.y) / (b.y - a.y));
                cut_m.push([f64::from(at.x), f64::from(at.z)]);
            }
        }
    }
    hull_perimeter(cut_m)
}

/// Whether more than half of a vertex moves with an arm.
fn is_arm(skin: &SkinWeights) -> bool {
    let arm = [
        Joint::LeftShoulder,
        Joint::LeftElbow,
        Joint::LeftWrist,
        Joint::LeftHand,
    ];
    let weight: f32 = skin
        .joints
        .iter()
        .zip(skin.weights)
        .filter(|(joint, _)| {
            arm.iter()
                .any(|arm| [*arm as u8, arm.mirrored() as u8].contains(joint))
        })
        .map(|(_, weight)| weight)
        .sum();
    weight > 0.5
}

/// Perimeter of the convex hull of points in a plane (monotone chain).
fn hull_perimeter(mut points: Vec<[f64; 2]>) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b[0] - a[0]) * (point[1] - a[1]) <= (b[1] - a[1]) * (point[0] - a[0])
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain
            .windows(2)
            .map(|edge| f64::hypot(edge[1][0] - edge[0][0], edge[1][1] - edge[0][1]))
            .sum::<f64>()
    };
    half(&mut points.iter().copied()) + half(&mut points.iter().rev().copied())
}
