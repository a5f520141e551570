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

/// Adds each face's normal, times twice its area, to the sums of its corners.
///
/// # Panics
/// When a face names a vertex that does not exist.
pub fn add_face_normals(faces: &[[u32; 3]], positions_m: &[Vec3], sums: &mut [Vec3]) {
    for face in faces {
        let [a, b, c] = face.map(|v| v as usize);
        let origin_m = positions_m[a];
        let area = (positions_m[b] - origin_m).cross(positions_m[c] - origin_m);
        sums[a] += area;
        sums[b] += area;
        sums[c] += area;
    }
}

fn accumulate(positions_m: &[Vec3], faces: &[[u32; 3]], normals: &mut [Vec3]) {
    add_face_normals(faces, positions_m, normals);
    for normal in normals {
        *normal = normal.normalize_or(Vec3::Y);
    }
}
