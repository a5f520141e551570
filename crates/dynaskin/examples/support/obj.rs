//! A mesh sequence: one Wavefront OBJ a frame.

use std::fmt::Write;
use std::path::Path;

use dynaskin::glam::Vec3;

/// Writes `frame_00007.obj` into `folder`: world positions in metres, unit normals, and triangles over
/// both. OBJ counts from 1.
///
/// # Errors
/// Those of writing the file.
pub fn write_frame(
    folder: &Path,
    frame: usize,
    (positions_m, normals): (&[Vec3], &[Vec3]),
    faces: &[[u32; 3]],
) -> std::io::Result<()> {
    let mut text = String::new();
    for p in positions_m {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for n in normals {
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    for face in faces {
        let [a, b, c] = face.map(|corner| corner + 1);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    std::fs::write(folder.join(format!("frame_{frame:05}.obj")), text)
}
