//! The operators of DSNet's decoder: against tract's own ONNX front end, and what is refused.

#![cfg(feature = "guests")]

mod support;

use dynaskin_onnx::messages::{Attribute, Model, NodeMessage};
use dynaskin_onnx::{Graph, Precision, Steps, Value, WriteError};
use dynaskin_runtime::{Decoder, DecoderSession, RuntimeError};
use support::numbers;
use tract_onnx::prelude::*;

const LATENTS: usize = 4;
const CHANNELS: usize = 3;
const CELLS: usize = 6;

/// A kernel and its steps; whether it goes up or down.
#[derive(Clone, Copy, Debug)]
struct Case {
    kernel: usize,
    steps: Steps,
    transposed: bool,
}

fn case(
    transposed: bool,
    kernel: usize,
    (stride, padding, output_padding): (usize, usize, usize),
) -> Case {
    Case {
        kernel,
        transposed,
        steps: Steps {
            stride,
            padding,
            output_padding,
        },
    }
}

fn decoder_onnx(case: Case) -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("decoder");
    let weights = |graph: &mut Graph, name: &str, shape: &[usize]| -> Result<Value, WriteError> {
        let count = shape.iter().product();
        graph.weights(name, shape, &numbers(name.len(), count), Precision::Single)
    };
    let latent = graph.input("latent", &[1, LATENTS])?;
    let dense = weights(&mut graph, "dense", &[LATENTS, CHANNELS * CELLS])?;
    let bias = weights(&mut graph, "bias", &[3])?;
    let x = graph.matmul(&latent, &dense)?;
    let x = graph.reshape(&x, &[1, CHANNELS, CELLS])?;
    let x = if case.transposed {
        let kernel = weights(&mut graph, "kernel", &[CHANNELS, 3, case.kernel])?;
        graph.conv_transpose1d(&x, &kernel, &bias, case.steps)?
    } else {
        let kernel = weights(&mut graph, "kernel", &[3, CHANNELS, case.kernel])?;
        graph.conv1d(&x, &kernel, &bias, case.steps)?
    };
    let x = graph.exp(&x);
    let offsets = graph.transpose(&x, &[0, 2, 1])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

fn plain_tract(onnx_bytes: &[u8], latent: &[f32]) -> TractResult<Vec<f32>> {
    let model = tract_onnx::onnx().model_for_read(&mut &onnx_bytes[..])?;
    let model = model.into_typed()?.into_runnable()?;
    let row = Tensor::from_shape(&[1, latent.len()], latent)?;
    let offsets = model.run(tvec!(row.into_tvalue()))?;
    Ok(offsets[0]
        .to_plain_array_view::<f32>()?
        .iter()
        .copied()
        .collect())
}

#[test]
fn convolutions_give_the_numbers_of_plain_tract() {
    let cases = [
        case(false, 1, (1, 0, 0)),
        case(false, 3, (1, 1, 0)),
        case(false, 5, (2, 2, 0)),
        case(false, 4, (3, 0, 0)),
        case(true, 1, (1, 0, 0)),
        case(true, 3, (1, 1, 0)),
        case(true, 5, (2, 2, 0)),
        case(true, 5, (2, 2, 1)),
        case(true, 2, (2, 0, 0)),
        case(true, 4, (3, 1, 2)),
    ];
    for case in cases {
        let onnx_bytes = decoder_onnx(case).expect("a graph");
        let decoder = Decoder::load(&onnx_bytes).expect("a decoder");
        let mut session = DecoderSession::new(&decoder).expect("a session");
        let latent = numbers(9, LATENTS);
        let expected = plain_tract(&onnx_bytes, &latent).expect("plain tract runs it");
        let mut got = vec![0.0; 3 * decoder.vertex_count()];
        assert_eq!(got.len(), expected.len(), "{case:?}");
        session.decode(&latent, &mut got).expect("offsets");
        for (got, expected) in got.iter().zip(&expected) {
            assert!(
                (got - expected).abs() <= 1e-5 * expected.abs(),
                "{case:?}: {got} {expected}"
            );
        }
    }
}

#[test]
fn the_equations_hold() {
    // One latent, one channel: 1, 2, 3 go up by two with the kernel 1, 10, 100.
    let build = || -> Result<Vec<u8>, WriteError> {
        let mut graph = Graph::new("decoder");
        let latent = graph.input("latent", &[1, 1])?;
        let dense = graph.weights("dense", &[1, 3], &[1.0, 2.0, 3.0], Precision::Single)?;
        let kernel = graph.weights("kernel", &[1, 1, 3], &[1.0, 10.0, 100.0], Precision::Single)?;
        let bias = graph.weights("bias", &[1], &[0.5], Precision::Single)?;
        let x = graph.matmul(&latent, &dense)?;
        let x = graph.reshape(&x, &[1, 1, 3])?;
        let steps = Steps {
            stride: 2,
            padding: 1,
            output_padding: 1,
        };
        let x = graph.conv_transpose1d(&x, &kernel, &bias, steps)?;
        let offsets = graph.reshape(&x, &[1, 2, 3])?;
        graph.output("offsets", &offsets)?;
        Ok(graph.into_bytes())
    };
    let decoder = Decoder::load(&build().expect("a graph")).expect("a decoder");
    let mut offsets = [0.0; 6];
    let mut session = DecoderSession::new(&decoder).expect("a session");
    session.decode(&[1.0], &mut offsets).expect("offsets");
    // Laid down at 0, 2 and 4: 1 10 (100 + 2) 20 (200 + 3) 30 300; the first cell is cut.
    assert_eq!(offsets, [10.5, 102.5, 20.5, 203.5, 30.5, 300.5]);
}

/// The error for a decoder whose nodes are changed by `edit`.
fn refused(transposed: bool, edit: impl Fn(&mut NodeMessage)) -> RuntimeError {
    let onnx_bytes = decoder_onnx(case(transposed, 3, (2, 1, 0))).expect("a graph");
    let mut model = Model::from_bytes(&onnx_bytes).expect("a file");
    let graph = model.graph.as_mut().expect("a graph");
    for node in &mut graph.node {
        edit(node);
    }
    Decoder::load(&model.to_bytes()).expect_err("a damaged decoder")
}

fn set(node: &mut NodeMessage, name: &str, numbers: &[i64]) {
    node.attribute.retain(|attribute| attribute.name != name);
    node.attribute.push(Attribute {
        name: name.to_owned(),
        ints: numbers.to_vec(),
        i: numbers.first().copied().unwrap_or_default(),
        ..Default::default()
    });
}

#[test]
fn attributes_that_are_not_implemented_or_make_no_sense_are_refused() {
    let cases: [(&str, &[i64], &str); 12] = [
        ("group", &[3], "group"),
        ("auto_pad", &[1], "auto_pad"),
        ("kernel_shape", &[4], "3 taps"),
        ("kernel_shape", &[], "kernel_shape"),
        ("strides", &[0], "strides"),
        ("strides", &[2, 2], "strides"),
        ("strides", &[i64::MAX], "strides"),
        ("dilations", &[-1], "dilations"),
        ("pads", &[1], "pads"),
        ("pads", &[-1, 0], "pads"),
        ("pads", &[i64::MAX, i64::MAX], "pads"),
        ("dilations", &[1000], "cells"),
    ];
    for (name, numbers, expected) in cases {
        for transposed in [false, true] {
            if transposed && expected == "cells" {
                continue; // A long kernel is only too long for a convolution.
            }
            let error = refused(transposed, |node| {
                if node.op_type.starts_with("Conv") {
                    set(node, name, numbers);
                }
            });
            assert!(
                matches!(error, RuntimeError::InvalidGraph { .. }),
                "{error}"
            );
            assert!(error.to_string().contains(expected), "{name}: {error}");
        }
    }
    let transposed: [(&str, &[i64], &str); 3] = [
        ("output_padding", &[2], "output_padding"),
        ("pads", &[20, 20], "cut"),
        ("output_shape", &[11], "output_shape"),
    ];
    for (name, numbers, expected) in transposed {
        let error = refused(true, |node| {
            if node.op_type == "ConvTranspose" {
                set(node, name, numbers);
            }
        });
        assert!(error.to_string().contains(expected), "{name}: {error}");
    }
}

#[test]
fn wrong_shapes_and_orders_are_refused() {
    for transposed in [false, true] {
        // The input in the place of the weights, or of the biases.
        for (from, to) in [(0, 1), (0, 2)] {
            let error = refused(transposed, |node| {
                if node.op_type.starts_with("Conv") {
                    node.input[to] = node.input[from].clone();
                }
            });
            assert!(
                matches!(error, RuntimeError::InvalidGraph { .. }),
                "{error}"
            );
        }
    }
    for order in [&[0, 1][..], &[1, 0, 2], &[0, 1, 1], &[0, 1, 3], &[]] {
        let error = refused(false, |node| {
            if node.op_type == "Transpose" {
                set(node, "perm", order);
            }
        });
        assert!(error.to_string().contains("perm"), "{order:?}: {error}");
    }
}

#[test]
fn a_convolution_that_would_hang_the_page_is_refused() {
    let build = |transposed: bool| -> Result<Vec<u8>, WriteError> {
        let (channels, cells, outputs) = (64, 4096, 1024);
        let mut graph = Graph::new("decoder");
        let zeros = |graph: &mut Graph, name: &str, shape: &[usize]| {
            let count = shape.iter().product();
            graph.weights(name, shape, &vec![0.0; count], Precision::Half)
        };
        let latent = graph.input("latent", &[1, 1])?;
        let dense = zeros(&mut graph, "dense", &[1, channels * cells])?;
        let bias = zeros(&mut graph, "bias", &[outputs])?;
        let x = graph.matmul(&latent, &dense)?;
        let x = graph.reshape(&x, &[1, channels, cells])?;
        let steps = case(transposed, 5, (1, 2, 0)).steps;
        let x = if transposed {
            let kernel = zeros(&mut graph, "kernel", &[channels, outputs, 5])?;
            graph.conv_transpose1d(&x, &kernel, &bias, steps)?
        } else {
            let kernel = zeros(&mut graph, "kernel", &[outputs, channels, 5])?;
            graph.conv1d(&x, &kernel, &bias, steps)?
        };
        graph.output("offsets", &x)?;
        Ok(graph.into_bytes())
    };
    for transposed in [false, true] {
        let error = Decoder::load(&build(transposed).expect("a graph")).expect_err("heavy");
        assert!(error.to_string().contains("multiplications"), "{error}");
    }
}
