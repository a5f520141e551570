//! Area-weighted vertex normals.

use glam::Vec3;

/// Unit normals per vertex, the sum of the adjacent faces' area vectors; +Y where a vertex has no
/// area around it.
///
/// # Panics
/// When a face names a vertex that does not exist.
pub fn vertex_normals(positions_m: &[Vec3], faces: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions_m.len()];
    accumulate(positions_m, faces, &mut normals);
    normals
}

/// As [`vertex_normals`], into `normals` (one per vertex), without allocating.
///
/// # Panics
/// When a face names a vertex that does not exist, or `normals` is too short.
pub fn vertex_normals_into(positions_m: &[Vec3], faces: &[[u32; 3]], normals: &mut [Vec3]) {
    normals.fill(Vec3::ZERO);
    accumulate(positions_m, faces, normals);
}

fn accumulate(positions_m: &[Vec3], faces: &[[u32; 3]], normals: &mut [Vec3]) {
    for face in faces {
        let [a, b, c] = face.map(|v| v as usize);
        let area = (positions_m[b] - positions_m[a]).cross(positions_m[c] - positions_m[a]);
        normals[a] += area;
        normals[b] += area;
        normals[c] += area;
    }
    for normal in normals {
        *normal = normal.normalize_or(Vec3::Y);
    }
}
