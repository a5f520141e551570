//! Files that are damaged in the ways protobuf can be: a typed error each, and little memory.

use dynaskin_onnx::messages::{FLOAT, Model};
use dynaskin_onnx::{Graph, Precision, ReadError, Steps, WriteError, read};

/// A tag of protobuf: a field's number and wire type 2, then the value's length and the value.
fn field(number: u8, value: &[u8]) -> Vec<u8> {
    let mut bytes = vec![number << 3 | 2];
    let mut length = value.len();
    while length >= 0x80 {
        bytes.push(length as u8 | 0x80);
        length >>= 7;
    }
    bytes.push(length as u8);
    bytes.extend_from_slice(value);
    bytes
}

/// A file whose graph is `graph`.
fn file(graph: &[u8]) -> Vec<u8> {
    field(7, graph)
}

fn small() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("small");
    let x = graph.input("x", &[1, 2])?;
    let w = graph.weights("w", &[2, 3], &[0.5; 6], Precision::Half)?;
    let y = graph.matmul(&x, &w)?;
    let parts = graph.split(&y, 1, &[1, 2])?;
    graph.output("y", &parts[1])?;
    Ok(graph.into_bytes())
}

fn not_onnx(bytes: &[u8]) -> String {
    match read(bytes, 1) {
        Err(ReadError::NotOnnx { reason }) => reason,
        other => panic!("{bytes:?}: {other:?}"),
    }
}

fn invalid(bytes: &[u8]) -> (String, String) {
    match read(bytes, 1) {
        Err(ReadError::InvalidGraph { place, problem }) => (place, problem),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_was_written_is_read() {
    let onnx_bytes = small().expect("a graph");
    let graph = read(&onnx_bytes, 1).expect("a valid file");
    assert_eq!(graph.inputs.len(), 1);
    assert_eq!(graph.inputs[0].name, "x");
    assert_eq!(graph.outputs[0].shape, [1, 2]);
    let eight = read(&onnx_bytes, 8).expect("a valid file");
    assert_eq!(eight.inputs[0].shape, [8, 2]);
    assert_eq!(eight.outputs[0].shape, [8, 2]);
}

/// Casas & Otaduy's decoder of the published size has a layer of 3,000 by 3 numbers a vertex.
#[test]
fn weights_of_published_networks_are_read() {
    let (inputs, outputs) = (3000, 3 * 2519);
    let mut graph = Graph::new("large");
    let mut build = || -> Result<(), WriteError> {
        let x = graph.input("x", &[1, inputs])?;
        let numbers = vec![0.5; inputs * outputs];
        let w = graph.weights("w", &[inputs, outputs], &numbers, Precision::Half)?;
        let y = graph.matmul(&x, &w)?;
        graph.output("y", &y)
    };
    build().expect("a graph");
    let graph = read(&graph.into_bytes(), 1).expect("a valid file");
    assert_eq!(graph.outputs[0].shape, [1, outputs]);
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let onnx_bytes = small().expect("a graph");
    for cut in 0..onnx_bytes.len() {
        // Before the last field, the operator set, the rest is a whole message without it.
        match read(&onnx_bytes[..cut], 1) {
            Err(ReadError::NotOnnx { .. } | ReadError::InvalidGraph { .. }) => {}
            other => panic!("cut at {cut}: {other:?}"),
        }
    }
}

#[test]
fn lengths_beyond_the_file_are_refused() {
    for bytes in [
        // A graph of 100 bytes; one of 2^35; a node of 100 bytes in a graph of 2.
        &[0x3a, 100][..],
        &[0x3a, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01],
        &[0x3a, 2, 0x0a, 100],
        // An unknown field (100) of 2^63 bytes.
        &[
            0xa2, 0x06, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01,
        ],
    ] {
        let reason = not_onnx(bytes);
        assert!(
            reason.contains("buffer underflow") || reason.contains("length"),
            "{reason}"
        );
    }
    let reason = not_onnx(&[
        0x3a, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f,
    ]);
    assert!(reason.contains("varint"), "{reason}");
}

#[test]
fn wrong_wire_types_are_refused_with_the_field() {
    for (bytes, named) in [
        // The graph as a number; a node as a number; a node's name as four bytes.
        (vec![0x38, 1], "Model.graph"),
        (file(&[0x08, 1]), "GraphMessage.node"),
        (file(&field(1, &[0x1d, 0, 0, 0, 0])), "NodeMessage.name"),
    ] {
        let reason = not_onnx(&bytes);
        assert!(reason.contains(named), "{reason}");
        assert!(reason.contains("wire type"), "{reason}");
    }
    // Wire types 6 and 7 do not exist.
    for key in [0x3e, 0x3f] {
        assert!(not_onnx(&[key, 0]).contains("wire type"));
    }
    assert!(not_onnx(&[0x00, 0x00]).contains("tag value"));
    // Names are UTF-8.
    let reason = not_onnx(&file(&field(1, &field(3, &[0xff, 0xfe]))));
    assert!(reason.contains("UTF-8"), "{reason}");
}

#[test]
fn deep_nesting_is_refused_and_never_overflows_the_stack() {
    // Groups in groups, as an unknown field holds them.
    let deep = vec![0xa3; 1 << 20];
    let deep: Vec<u8> = deep.into_iter().flat_map(|byte| [byte, 0x06]).collect();
    let reason = not_onnx(&deep);
    assert!(reason.contains("recursion"), "{reason}");
    // Graphs in attributes, which the contract does not have: skipped whole.
    let mut graph = Vec::new();
    for _ in 0..2000 {
        graph = field(1, &field(5, &field(6, &graph)));
    }
    let (place, _) = invalid(&file(&graph));
    assert_eq!(place, "opset_import");
}

#[test]
fn many_empty_entries_are_refused_before_they_are_decoded() {
    let empty = |number: u8, count: usize| [number << 3 | 2, 0].repeat(count);
    // 8 MB of nodes would be 600 MB in memory, initialisers more.
    for number in [1, 5] {
        let (place, problem) = invalid(&file(&empty(number, 4 << 20)));
        assert_eq!(place, "graph");
        assert_eq!(problem, "more than 4096 nodes or initialisers");
    }
    let many = 1 << 20;
    let dims = field(2, &field(1, &field(2, &empty(1, many))));
    for bytes in [
        // Inputs, outputs, operator sets.
        file(&empty(11, many)),
        file(&empty(12, many)),
        empty(8, many),
        // Names and attributes of a node, numbers of an attribute and of a shape.
        file(&field(1, &empty(1, many))),
        file(&field(1, &empty(2, many))),
        file(&field(1, &empty(5, many))),
        file(&field(1, &field(5, &field(8, &vec![0; many])))),
        file(&field(5, &field(1, &vec![1; many]))),
        // Axes of an input.
        file(&field(11, &dims)),
        // Spread over several graphs, which protobuf joins.
        file(&empty(11, 1 << 12)).repeat(1 << 8),
    ] {
        let (place, problem) = invalid(&bytes);
        assert_eq!(place, "graph");
        assert!(problem.starts_with("more than 262144 names"), "{problem}");
    }
}

#[test]
fn as_many_nodes_as_are_allowed_are_read() {
    let build = || -> Result<Vec<u8>, WriteError> {
        let mut graph = Graph::new("long");
        let x = graph.input("x", &[1, 1])?;
        let mut y = x.clone();
        for _ in 0..4095 {
            y = graph.tanh(&y);
        }
        graph.output("y", &y)?;
        Ok(graph.into_bytes())
    };
    let onnx_bytes = build().expect("a graph");
    let graph = read(&onnx_bytes, 1).expect("4096 nodes");
    assert_eq!(graph.outputs[0].shape, [1, 1]);
}

#[test]
fn numbers_of_an_initialiser_may_stand_in_its_own_fields() {
    let mut model = Model::from_bytes(&small().expect("a graph")).expect("a file");
    let graph = model.graph.as_mut().expect("a graph");
    let weights = &mut graph.initializer[0];
    weights.raw_data.clear();
    weights.int32_data = vec![0x3800; 6];
    read(&model.to_bytes(), 1).expect("half precision in int32_data");
    let graph = model.graph.as_mut().expect("a graph");
    let weights = &mut graph.initializer[0];
    weights.int32_data.clear();
    weights.float_data = vec![0.5; 5];
    weights.data_type = FLOAT;
    let (place, problem) = invalid(&model.to_bytes());
    assert_eq!(place, "w");
    assert!(problem.contains("asks for 6 numbers"), "{problem}");
}

/// A file with a convolution.
fn convolution() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("convolution");
    let x = graph.input("x", &[1, 1, 4])?;
    let kernel = graph.weights("kernel", &[1, 1, 3], &[1.0; 3], Precision::Single)?;
    let bias = graph.weights("bias", &[1], &[0.0], Precision::Single)?;
    let steps = Steps {
        stride: 1,
        padding: 0,
        output_padding: 0,
    };
    let y = graph.conv1d(&x, &kernel, &bias, steps)?;
    graph.output("y", &y)?;
    Ok(graph.into_bytes())
}

#[test]
fn convolutions_are_read_where_they_are_built_in() {
    let got = read(&convolution().expect("a graph"), 1);
    if cfg!(feature = "convolutions") {
        assert_eq!(got.expect("a valid file").outputs[0].shape, [1, 1, 2]);
        return;
    }
    let Err(ReadError::LeftOut { operator, .. }) = got else {
        panic!("{got:?}");
    };
    assert_eq!(operator, "Conv");
}
