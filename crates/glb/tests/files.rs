//! Binary glTF files made by hand: sound ones read back, and one file for each kind of mistake.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use dynaskin_glb::{Document, GlbError, f32_at, i16_at};
use gltf::json::accessor::{ComponentType, Type};

const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// A container of these chunks; its header gives the true length.
fn container(chunks: &[(u32, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, data) in chunks {
        body.extend(u32::try_from(data.len()).unwrap().to_le_bytes());
        body.extend(kind.to_le_bytes());
        body.extend(*data);
    }
    let mut file = b"glTF".to_vec();
    file.extend(2u32.to_le_bytes());
    file.extend(u32::try_from(12 + body.len()).unwrap().to_le_bytes());
    file.extend(body);
    file
}

/// A chunk's text ends on a multiple of four bytes.
fn padded(text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), b' ');
    bytes
}

/// A file of one buffer view and one accessor, each given as the inside of its JSON object.
fn file(view: &str, accessor: &str, binary: &[u8]) -> Vec<u8> {
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}}}],"bufferViews":[{{{view}}}],"accessors":[{{{accessor}}}]}}"#,
        binary.len()
    );
    container(&[(JSON, &padded(&json)), (BIN, binary)])
}

/// 0, 1, 2 ... as 32-bit floats.
fn floats(count: u8) -> Vec<u8> {
    (0..count)
        .flat_map(|n| f32::from(n).to_le_bytes())
        .collect()
}

const VIEW: &str = r#""buffer":0,"byteLength":24"#;
const TWO_VECTORS: &str = r#""bufferView":0,"componentType":5126,"count":2,"type":"VEC3""#;

/// What reading accessor 0 as vectors of floats says about a file whose container is sound.
fn refused(view: &str, accessor: &str) -> GlbError {
    let bytes = file(view, accessor, &floats(6));
    let document = Document::parse(&bytes).unwrap();
    document
        .elements(0, ComponentType::F32, Type::Vec3)
        .unwrap_err()
}

fn container_error(bytes: &[u8]) -> String {
    Document::parse(bytes).unwrap_err().place
}

#[test]
fn vectors_are_read_in_order() {
    let bytes = file(VIEW, TWO_VECTORS, &floats(6));
    let document = Document::parse(&bytes).unwrap();
    assert_eq!(document.component_type(0).unwrap(), ComponentType::F32);
    let elements = document
        .elements(0, ComponentType::F32, Type::Vec3)
        .unwrap();
    assert_eq!(elements.count(), 2);
    let read: Vec<f32> = elements
        .iter()
        .flat_map(|element| [0, 1, 2].map(|idx| f32_at(element, idx)))
        .collect();
    assert_eq!(read, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
}

#[test]
fn offsets_and_strides_skip_what_lies_between() {
    let view = r#""buffer":0,"byteOffset":4,"byteLength":20,"byteStride":8"#;
    let accessor =
        r#""bufferView":0,"byteOffset":4,"componentType":5126,"count":2,"type":"SCALAR""#;
    let bytes = file(view, accessor, &floats(6));
    let document = Document::parse(&bytes).unwrap();
    let elements = document
        .elements(0, ComponentType::F32, Type::Scalar)
        .unwrap();
    let read: Vec<f32> = elements.iter().map(|element| f32_at(element, 0)).collect();
    assert_eq!(read, [2.0, 4.0]);
    assert!(elements.iter().all(|element| element.len() == 4));
}

#[test]
fn the_last_element_needs_no_full_stride() {
    // Two floats eight bytes apart end after twelve bytes.
    let accessor = r#""bufferView":0,"componentType":5126,"count":2,"type":"SCALAR""#;
    let read = |length: usize| {
        let view = format!(r#""buffer":0,"byteLength":{length},"byteStride":8"#);
        let bytes = file(&view, accessor, &floats(6));
        let document = Document::parse(&bytes).unwrap();
        document
            .elements(0, ComponentType::F32, Type::Scalar)
            .is_ok()
    };
    assert!(read(12));
    assert!(!read(11));
}

#[test]
fn whole_numbers_of_sixteen_bits_keep_their_sign() {
    let binary: Vec<u8> = [-2i16, i16::MAX, i16::MIN, 0]
        .into_iter()
        .flat_map(i16::to_le_bytes)
        .collect();
    let bytes = file(
        r#""buffer":0,"byteLength":8"#,
        r#""bufferView":0,"componentType":5122,"count":2,"type":"VEC2""#,
        &binary,
    );
    let document = Document::parse(&bytes).unwrap();
    let elements = document
        .elements(0, ComponentType::I16, Type::Vec2)
        .unwrap();
    let read: Vec<i16> = elements
        .iter()
        .flat_map(|element| [i16_at(element, 0), i16_at(element, 1)])
        .collect();
    assert_eq!(read, [-2, i16::MAX, i16::MIN, 0]);
}

#[test]
fn no_elements_need_no_bytes() {
    let none = r#""bufferView":0,"componentType":5126,"count":0,"type":"VEC3""#;
    let bytes = file(r#""buffer":0,"byteLength":0"#, none, &floats(6));
    let document = Document::parse(&bytes).unwrap();
    let elements = document
        .elements(0, ComponentType::F32, Type::Vec3)
        .unwrap();
    assert_eq!((elements.count(), elements.iter().count()), (0, 0));
}

#[test]
fn the_text_of_the_document_is_kept() {
    let json = padded(r#"{"asset":{"version":"2.0"},"extras":{"of":"ours"}}"#);
    let bytes = container(&[(JSON, &json), (BIN, &[])]);
    assert_eq!(Document::parse(&bytes).unwrap().json(), json);
}

#[test]
fn a_wrong_count_names_the_part_and_both_numbers() {
    let bytes = file(VIEW, TWO_VECTORS, &floats(6));
    let document = Document::parse(&bytes).unwrap();
    let elements = document
        .elements(0, ComponentType::F32, Type::Vec3)
        .unwrap();
    assert!(elements.exactly(2, "positions").is_ok());
    let error = elements.exactly(3, "positions").unwrap_err();
    assert_eq!(error.to_string(), "positions: expected 3 elements, got 2");
}

#[test]
fn every_cut_off_file_is_refused() {
    let bytes = file(VIEW, TWO_VECTORS, &floats(6));
    for length in 0..bytes.len() {
        assert!(Document::parse(&bytes[..length]).is_err(), "{length} bytes");
    }
}

#[test]
fn containers_that_are_none_are_refused() {
    let sound = file(VIEW, TWO_VECTORS, &floats(6));
    let changed = |at: usize, bytes: [u8; 4]| {
        let mut file = sound.clone();
        file[at..at + 4].copy_from_slice(&bytes);
        file
    };
    assert_eq!(container_error(b"not a glTF file at all"), "container");
    assert_eq!(container_error(&changed(0, *b"glTG")), "container");
    assert_eq!(
        container_error(&changed(4, 1u32.to_le_bytes())),
        "container"
    );
    // The length in the header: less than the header itself, and more than the file.
    for length in [0, 11, u32::try_from(sound.len()).unwrap() + 1, u32::MAX] {
        let file = changed(8, length.to_le_bytes());
        assert_eq!(container_error(&file), "container", "length {length}");
    }
    // The length of the first chunk, and its kind.
    assert_eq!(container_error(&changed(12, [0xFF; 4])), "container");
    assert_eq!(container_error(&changed(16, *b"BORK")), "container");
}

#[test]
fn documents_that_are_none_are_refused() {
    for text in ["", "{", "[]", r#"{"asset":5}"#, r#"{"accessors":{}}"#] {
        let bytes = container(&[(JSON, &padded(text)), (BIN, &[])]);
        assert_eq!(container_error(&bytes), "JSON chunk", "{text:?}");
    }
    let no_text = container(&[(JSON, &[0xFF, 0xFE, 0xFD, 0xFC]), (BIN, &[])]);
    assert_eq!(container_error(&no_text), "JSON chunk");
}

/// Two letters of the file each, and hundreds of bytes of memory if they were made.
#[test]
fn a_document_of_many_empty_entries_is_refused_before_they_are_made() {
    for list in ["nodes", "materials", "textures", "bufferViews"] {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"{list}":[{}{{}}]}}"#,
            "{},".repeat(65_536)
        );
        let bytes = container(&[(JSON, &padded(&json)), (BIN, &[0; 4])]);
        let error = Document::parse(&bytes).unwrap_err().to_string();
        for word in [list, "at most 65536", "65537"] {
            assert!(error.contains(word), "`{word}` is missing in: {error}");
        }
    }
}

#[test]
fn a_file_without_a_binary_chunk_is_refused() {
    let json = padded(r#"{"asset":{"version":"2.0"}}"#);
    assert_eq!(container_error(&container(&[(JSON, &json)])), "BIN chunk");
}

#[test]
fn accessors_that_are_not_there_are_refused() {
    let bytes = file(VIEW, TWO_VECTORS, &floats(6));
    let document = Document::parse(&bytes).unwrap();
    for index in [1, usize::MAX] {
        let error = document
            .elements(index, ComponentType::F32, Type::Vec3)
            .unwrap_err();
        assert_eq!(
            error,
            GlbError::new(format!("accessor {index}"), "an accessor")
        );
        assert_eq!(document.component_type(index).unwrap_err(), error);
    }
}

#[test]
fn other_types_than_asked_for_are_refused() {
    for accessor in [
        r#""bufferView":0,"componentType":5125,"count":2,"type":"VEC3""#,
        r#""bufferView":0,"componentType":5126,"count":2,"type":"VEC2""#,
        r#""bufferView":0,"componentType":5126,"count":2,"type":"VEC9""#,
    ] {
        assert_eq!(
            refused(VIEW, accessor).expected,
            "Vec3 of F32",
            "{accessor}"
        );
    }
    let unknown = r#""bufferView":0,"componentType":9999,"count":2,"type":"VEC3""#;
    assert_eq!(refused(VIEW, unknown).expected, "a known component type");
}

#[test]
fn sparse_accessors_are_refused() {
    let sparse = format!(
        r#"{TWO_VECTORS},"sparse":{{"count":1,"indices":{{"bufferView":0,"componentType":5125}},"values":{{"bufferView":0}}}}"#
    );
    assert_eq!(refused(VIEW, &sparse).expected, "no sparse storage");
}

#[test]
fn buffer_views_that_are_missing_or_elsewhere_are_refused() {
    let none = r#""componentType":5126,"count":2,"type":"VEC3""#;
    assert_eq!(refused(VIEW, none).expected, "a buffer view");
    let beyond = r#""bufferView":1,"componentType":5126,"count":2,"type":"VEC3""#;
    assert_eq!(refused(VIEW, beyond).expected, "a buffer view");
    let other_buffer = r#""buffer":1,"byteLength":24"#;
    let error = refused(other_buffer, TWO_VECTORS);
    assert!(error.expected.contains("own buffer"), "{error}");
}

#[test]
fn numbers_that_lead_out_of_the_buffer_are_refused() {
    const HUGE: u64 = u64::MAX;
    let views = [
        // Longer than the chunk, beyond its end, and sums that wrap around.
        r#""buffer":0,"byteLength":25"#.to_owned(),
        r#""buffer":0,"byteOffset":1,"byteLength":24"#.to_owned(),
        format!(r#""buffer":0,"byteLength":{HUGE}"#),
        format!(r#""buffer":0,"byteOffset":{HUGE},"byteLength":24"#),
        format!(r#""buffer":0,"byteOffset":{},"byteLength":24"#, HUGE - 23),
        // Too short for two vectors, and strides that overlap or leave the view.
        r#""buffer":0,"byteLength":23"#.to_owned(),
        r#""buffer":0,"byteLength":24,"byteStride":0"#.to_owned(),
        r#""buffer":0,"byteLength":24,"byteStride":11"#.to_owned(),
        r#""buffer":0,"byteLength":24,"byteStride":13"#.to_owned(),
        format!(r#""buffer":0,"byteLength":24,"byteStride":{HUGE}"#),
    ];
    for view in views {
        let error = refused(&view, TWO_VECTORS);
        assert_eq!(error.expected, "data inside the BIN chunk", "{view}");
    }
    let accessors = [
        format!(r#""bufferView":0,"componentType":5126,"count":{HUGE},"type":"VEC3""#),
        r#""bufferView":0,"componentType":5126,"count":3,"type":"VEC3""#.to_owned(),
        format!(r#"{TWO_VECTORS},"byteOffset":1"#),
        format!(r#"{TWO_VECTORS},"byteOffset":25"#),
        format!(r#"{TWO_VECTORS},"byteOffset":{HUGE}"#),
    ];
    for accessor in accessors {
        let error = refused(VIEW, &accessor);
        assert_eq!(error.expected, "data inside the BIN chunk", "{accessor}");
    }
}
