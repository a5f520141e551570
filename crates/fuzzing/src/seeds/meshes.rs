//! Meshes of the made-up body, and arrays as captures come in.

use std::fmt::Write as _;

use crate::stage;

/// With faces, and with points alone.
pub fn obj() -> Vec<Vec<u8>> {
    let body = stage::body();
    let mut points = "# made up\no body\n".to_owned();
    for place in &body.template_m {
        let _ = writeln!(points, "v {} {} {}", place.x, place.y, place.z);
    }
    let mut faces = points.clone();
    faces.push_str("vn 0 1 0\nvt 0 0\ng skin\n");
    for [a, b, c] in &body.faces {
        let _ = writeln!(faces, "f {}/1/1 {}//1 {}", a + 1, b + 1, c + 1);
    }
    vec![faces.into_bytes(), points.into_bytes()]
}

/// As text and in both byte orders.
pub fn ply() -> Vec<Vec<u8>> {
    vec![ascii(), binary(true), binary(false)]
}

/// In the versions of the format that h5py writes: packed, in both byte orders, in groups.
pub fn hdf5() -> Vec<Vec<u8>> {
    vec![
        include_bytes!("../../../hdf5/tests/files/made.hdf5").to_vec(),
        include_bytes!("../../../hdf5/tests/files/latest.hdf5").to_vec(),
    ]
}

fn header(format: &str) -> String {
    let body = stage::body();
    format!(
        "ply\nformat {format} 1.0\ncomment made up\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nproperty uchar red\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        body.vertex_count(),
        body.faces.len()
    )
}

fn ascii() -> Vec<u8> {
    let body = stage::body();
    let mut text = header("ascii");
    for place in &body.template_m {
        let _ = writeln!(text, "{} {} {} 200", place.x, place.y, place.z);
    }
    for [a, b, c] in &body.faces {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    text.into_bytes()
}

fn binary(is_little: bool) -> Vec<u8> {
    let body = stage::body();
    let mut file = header(if is_little {
        "binary_little_endian"
    } else {
        "binary_big_endian"
    })
    .into_bytes();
    let ordered = |number: u32| {
        if is_little {
            number.to_le_bytes()
        } else {
            number.to_be_bytes()
        }
    };
    for place in &body.template_m {
        file.extend(
            place
                .to_array()
                .map(f32::to_bits)
                .into_iter()
                .flat_map(ordered),
        );
        file.push(200);
    }
    for face in &body.faces {
        file.push(3);
        file.extend(face.iter().copied().flat_map(ordered));
    }
    file
}
