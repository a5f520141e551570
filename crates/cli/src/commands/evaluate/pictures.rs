//! Bodies as pictures: skinned with offsets, coloured by numbers of their vertices.

use dynaskin_body::{BodyModel, SkinMatrices, skin_linear};
use dynaskin_report::{Picture, Triangle, heat_colour};
use dynaskin_train::study::Snapshot;
use glam::Vec3;

/// Pixels, twice what the page shows, for dense displays.
const SIZE: (u32, u32) = (352, 720);
/// Colour of skin that has no soft tissue.
const STIFF: [u8; 3] = [190, 190, 196];

/// The body of a snapshot moved by `offsets_m` (`[slot][xyz]`), the soft vertices coloured by
/// `values_mm` (one a slot) between 0 and `most_mm`; from the front.
pub fn heat(
    body: &BodyModel,
    vertices: &[u32],
    snapshot: &Snapshot,
    offsets_m: &[f32],
    values_mm: &[f64],
    most_mm: f64,
) -> Picture {
    let world_m = skinned(body, vertices, snapshot, offsets_m);
    let mut shares = vec![None; world_m.len()];
    for (vertex, value) in vertices.iter().zip(values_mm) {
        shares[*vertex as usize] = Some(value / most_mm.max(f64::MIN_POSITIVE));
    }
    let triangles = body.faces.iter().map(|face| {
        let corners = face.map(|vertex| world_m[vertex as usize].to_array());
        let known: Vec<f64> = face.iter().filter_map(|v| shares[*v as usize]).collect();
        // A triangle at the rim of the tissue has corners that never move.
        let colour = match known.is_empty() {
            true => STIFF,
            false => heat_colour(known.iter().sum::<f64>() / 3.0),
        };
        Triangle { corners, colour }
    });
    Picture {
        size: SIZE,
        triangles: triangles.collect(),
    }
}

/// Lengths of offsets, or of their differences from others, in millimetres, one a slot.
pub fn lengths_mm(offsets_m: &[f32], from_m: Option<&[f32]>) -> Vec<f64> {
    let at = |field: &[f32], slot: usize| {
        Vec3::new(field[3 * slot], field[3 * slot + 1], field[3 * slot + 2])
    };
    (0..offsets_m.len() / 3)
        .map(|slot| {
            let from = from_m.map_or(Vec3::ZERO, |field| at(field, slot));
            1000.0 * f64::from((at(offsets_m, slot) - from).length())
        })
        .collect()
}

/// Vertices in the world, turned so that the pelvis faces the viewer.
fn skinned(
    body: &BodyModel,
    vertices: &[u32],
    snapshot: &Snapshot,
    offsets_m: &[f32],
) -> Vec<Vec3> {
    let shaped = body.shaped(&snapshot.shape);
    let mut rest_m = shaped.positions_m;
    body.add_pose_correctives(&snapshot.pose, &mut rest_m);
    for (vertex, offset) in vertices.iter().zip(offsets_m.chunks_exact(3)) {
        rest_m[*vertex as usize] += Vec3::new(offset[0], offset[1], offset[2]);
    }
    let mut pose = snapshot.pose.clone();
    let forward = pose.parent_from_joint[0] * glam::DVec3::Z;
    let back = glam::DQuat::from_rotation_y(-forward.x.atan2(forward.z));
    pose.parent_from_joint[0] = back * pose.parent_from_joint[0];
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    let mut world_m = vec![Vec3::ZERO; rest_m.len()];
    skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
    world_m
}
