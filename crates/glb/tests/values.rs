//! Vertex data of every storage: normalised, strided, sparse, compressed; and what is refused of it.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use dynaskin_glb::{Document, GlbError};
use gltf::json::accessor::Type;

/// A file with these buffer views and accessors over one buffer.
fn file(views: &str, accessors: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}}}],"bufferViews":[{views}],"accessors":[{accessors}]}}"#,
        binary.len()
    )
    .into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2u32.to_le_bytes());
    bytes.extend(
        u32::try_from(28 + json.len() + binary.len())
            .unwrap()
            .to_le_bytes(),
    );
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &binary)] {
        bytes.extend(u32::try_from(chunk.len()).unwrap().to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn vectors(bytes: &[u8]) -> Result<Vec<[f32; 3]>, GlbError> {
    Document::parse(bytes)?.floats::<3>(0, Type::Vec3)
}

#[test]
fn normalised_integers_with_a_stride() {
    let mut binary = Vec::new();
    for row in [[32_767_i16, 0, -32_767, 9], [-32_768, 16_384, 1, 9]] {
        binary.extend(row.iter().flat_map(|x| x.to_le_bytes()));
    }
    let bytes = file(
        r#"{"buffer":0,"byteLength":16,"byteStride":8}"#,
        r#"{"bufferView":0,"componentType":5122,"normalized":true,"count":2,"type":"VEC3"}"#,
        &binary,
    );
    let found = vectors(&bytes).unwrap();
    assert_eq!(found[0], [1.0, 0.0, -1.0]);
    // The lowest integer is -1, too.
    assert_eq!(found[1][0], -1.0);
    assert!((found[1][1] - 0.500_015_3).abs() < 1e-6);
}

#[test]
fn sparse_elements_replace_zeros() {
    let mut binary = vec![2, 0, 0, 0];
    binary.extend([1.0_f32, 2.0, 3.0].iter().flat_map(|x| x.to_le_bytes()));
    let sparse = |index_view: &str, count: u32| {
        format!(
            r#"{{"componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":{count},"indices":{{"bufferView":{index_view},"componentType":5121}},"values":{{"bufferView":1}}}}}}"#
        )
    };
    let views = r#"{"buffer":0,"byteLength":4},{"buffer":0,"byteOffset":4,"byteLength":12}"#;
    let found = vectors(&file(views, &sparse("0", 1), &binary)).unwrap();
    assert_eq!(found, [[0.0; 3], [0.0; 3], [1.0, 2.0, 3.0], [0.0; 3]]);
    assert!(vectors(&file(views, &sparse("0", 2), &binary)).is_err());
    assert!(vectors(&file(views, &sparse("7", 1), &binary)).is_err());
    let outside = [vec![4, 0, 0, 0], binary[4..].to_vec()].concat();
    assert!(vectors(&file(views, &sparse("0", 1), &outside)).is_err());
}

#[test]
fn what_lies_outside_or_is_of_another_kind() {
    let view = r#"{"buffer":0,"byteLength":12}"#;
    let accessor = |count: u64| {
        format!(r#"{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}}"#)
    };
    let binary = [0; 12];
    assert!(vectors(&file(view, &accessor(1), &binary)).is_ok());
    for count in [2, u64::from(u32::MAX), u64::MAX / 2] {
        assert!(vectors(&file(view, &accessor(count), &binary)).is_err());
    }
    let bytes = file(view, &accessor(1), &binary);
    let document = Document::parse(&bytes).unwrap();
    assert!(document.floats::<4>(0, Type::Vec4).is_err());
    assert!(document.floats::<2>(0, Type::Vec3).is_err());
    assert!(document.integers::<3>(0, Type::Vec3).is_err());
    assert!(document.floats::<3>(1, Type::Vec3).is_err());
}

#[cfg(feature = "meshopt")]
#[test]
fn compressed_vertices_and_triangles() {
    let vertices: Vec<[f32; 3]> = (0..40).map(|n| [n as f32, 0.5, -2.0 * n as f32]).collect();
    let triangles: Vec<u32> = (0..38).flat_map(|n| [n, n + 1, n + 2]).collect();
    let encoded = meshopt::encode_vertex_buffer(&vertices).unwrap();
    let indices = meshopt::encode_index_buffer(&triangles, vertices.len()).unwrap();
    let start = encoded.len().next_multiple_of(4);
    let mut binary = encoded.clone();
    binary.resize(start, 0);
    binary.extend(&indices);
    let view = |offset: usize, length: usize, stride: usize, count: usize, mode: &str| {
        format!(
            r#"{{"buffer":0,"byteLength":{},"extensions":{{"EXT_meshopt_compression":{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"byteStride":{stride},"count":{count},"mode":"{mode}"}}}}}}"#,
            stride * count
        )
    };
    let of_indices = view(start, indices.len(), 2, triangles.len(), "TRIANGLES");
    let accessors = r#"{"bufferView":0,"componentType":5126,"count":40,"type":"VEC3"},{"bufferView":1,"componentType":5123,"count":114,"type":"SCALAR"}"#;
    let read = |of_vertices: &str| {
        let bytes = file(&format!("{of_vertices},{of_indices}"), accessors, &binary);
        let document = Document::parse(&bytes).unwrap();
        let triangles = document.integers::<1>(1, Type::Scalar).unwrap();
        (document.floats::<3>(0, Type::Vec3), triangles)
    };
    let (found, corners) = read(&view(0, encoded.len(), 12, 40, "ATTRIBUTES"));
    assert_eq!(found.unwrap(), vertices);
    // Triangles may come with another corner first.
    let from_least = |corners: &[u32]| -> Vec<[u32; 3]> {
        let triangle = |corners: &[u32]| {
            let least = (0..3).min_by_key(|corner| corners[*corner]).unwrap();
            [0, 1, 2].map(|corner| corners[(least + corner) % 3])
        };
        corners.chunks_exact(3).map(triangle).collect()
    };
    let corners: Vec<u32> = corners.into_iter().flatten().collect();
    assert_eq!(from_least(&corners), from_least(&triangles));
    // Cut, of another mode or size, or larger than any mesh: refused.
    for wrong in [
        view(0, encoded.len() - 20, 12, 40, "ATTRIBUTES"),
        view(0, encoded.len(), 12, 40, "POINTS"),
        view(0, encoded.len(), 10, 40, "ATTRIBUTES"),
        view(0, encoded.len(), 12, usize::MAX / 64, "ATTRIBUTES"),
        view(usize::MAX / 2, encoded.len(), 12, 40, "ATTRIBUTES"),
    ] {
        assert!(read(&wrong).0.is_err(), "{wrong}");
    }
}
