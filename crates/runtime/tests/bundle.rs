//! Bundles that are broken in every way we could think of: a typed error each, never a panic.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use dynaskin_onnx::messages::{GraphMessage, Model as File};
use dynaskin_onnx::{Graph, Precision};
use dynaskin_runtime::features::FeatureKind;
use dynaskin_runtime::{Bundle, Decoder, DecoderSession, Model, Network, RuntimeError};
use support::{bundle, decoder_onnx, kind, predictor_onnx};

/// Loads the made-up bundle with other networks, their hashes made to fit.
fn load(predictor: &[u8], decoder: &[u8]) -> Result<Model, RuntimeError> {
    Model::from_parts(
        bundle(predictor, decoder),
        Arc::new(support::body()),
        predictor,
        decoder,
    )
}

fn load_error(predictor: &[u8], decoder: &[u8]) -> RuntimeError {
    load(predictor, decoder).expect_err("the bundle is broken")
}

/// `onnx_bytes` with its messages changed.
fn edited(onnx_bytes: &[u8], edit: impl FnOnce(&mut GraphMessage)) -> Vec<u8> {
    let mut proto = File::from_bytes(onnx_bytes).unwrap();
    edit(proto.graph.as_mut().unwrap());
    proto.to_bytes()
}

#[test]
fn a_good_bundle_round_trips_and_loads() {
    let bundle = bundle(&predictor_onnx(), &decoder_onnx());
    let json = bundle.to_json().unwrap();
    assert_eq!(Bundle::from_json(json.as_bytes()).unwrap(), bundle);
    let model = load(&predictor_onnx(), &decoder_onnx()).unwrap();
    assert_eq!(model.soft_vertices(), support::vertices());
    assert_eq!(model.bundle().unwrap().name, "tube");
}

#[test]
fn bundle_json_is_checked_field_by_field() {
    let good = bundle(&predictor_onnx(), &decoder_onnx())
        .to_json()
        .unwrap();
    for cut in 0..good.len() {
        if !good.is_char_boundary(cut) {
            continue;
        }
        let error = Bundle::from_json(&good.as_bytes()[..cut]).unwrap_err();
        assert_eq!(kind(&error), "BundleJson", "cut at {cut}");
    }
    for (other, words) in [
        ("\n<!doctype html>", "it is a web page"),
        (" \n", "it is empty"),
        ("glTF", "it is another kind of file"),
        ("{\"format\": 3}", "line 1 column"),
    ] {
        let told = Bundle::from_json(other.as_bytes()).unwrap_err().to_string();
        assert!(told.contains(words), "{told}");
    }
    for (from, to, code) in [
        ("\"version\": 2", "\"version\": 3", "BundleVersion"),
        ("\"version\": 2", "\"version\": 0", "BundleVersion"),
        ("\"learned\"", "\"taught\"", "BundleJson"),
        ("\"stiffness\"", "\"softness\"", "BundleJson"),
        ("dynaskin-bundle", "another-bundle", "BundleVersion"),
        ("\"rate_hz\": 60.0", "\"rate_hz\": 30.0", "BundleField"),
        (
            "\"feature_count\": 166",
            "\"feature_count\": 10",
            "BundleField",
        ),
        ("\"inertial\"", "\"telepathic\"", "BundleJson"),
        ("body.glb", "../body.glb", "BundleField"),
        ("predictor.onnx", "/etc/passwd", "BundleField"),
        ("decoder.onnx", "c:decoder.onnx", "BundleField"),
        ("24,", "99,", "BundleField"),
    ] {
        assert!(good.contains(from), "{from}");
        let error = Bundle::from_json(good.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert_eq!(kind(&error), code, "{to}: {error}");
    }
}

/// The made-up bundle, its networks said to take materials, in version 2.
fn with_materials() -> Bundle {
    let mut bundle = bundle(&predictor_onnx(), &decoder_onnx());
    bundle.feature_kind = FeatureKind::InertialMaterials;
    bundle.feature_count = bundle.feature_kind.count();
    bundle
}

#[test]
fn version_1_reads_as_what_its_networks_learned_from() {
    for (bundle, stiffness, damping) in [
        (with_materials(), [0.5, 2.0], [0.625, 1.6]),
        (
            bundle(&predictor_onnx(), &decoder_onnx()),
            [1.0, 1.0],
            [1.0, 1.0],
        ),
    ] {
        let mut json: serde_json::Value = serde_json::from_str(&bundle.to_json().unwrap()).unwrap();
        json["version"] = 1.into();
        json.as_object_mut().unwrap().remove("learned");
        let read = Bundle::from_json(json.to_string().as_bytes()).unwrap();
        assert_eq!(read.learned.stiffness, stiffness);
        assert_eq!(read.learned.damping, damping);
        assert_eq!(read.learned.shape, None);
        // Written again, it says so.
        assert_eq!(read.version, dynaskin_runtime::BUNDLE_VERSION);
        let again = Bundle::from_json(read.to_json().unwrap().as_bytes()).unwrap();
        assert_eq!(again, read);
    }
}

#[test]
fn what_networks_learned_from_is_read_and_checked() {
    let mut bundle = with_materials();
    bundle.learned.stiffness = [0.25, 3.0];
    bundle.learned.shape = Some([[-1.5, 2.0]; 10]);
    let json = bundle.to_json().unwrap();
    assert_eq!(Bundle::from_json(json.as_bytes()).unwrap(), bundle);
    let refused = |edit: &dyn Fn(&mut Bundle)| {
        let mut bundle = bundle.clone();
        edit(&mut bundle);
        let error = Bundle::from_json(bundle.to_json().unwrap().as_bytes()).unwrap_err();
        assert!(
            matches!(&error, RuntimeError::BundleField { field, .. } if field.starts_with("learned")),
            "{error}"
        );
    };
    refused(&|b| b.learned.stiffness = [3.0, 0.25]);
    refused(&|b| b.learned.damping = [0.0, 1.0]);
    refused(&|b| b.learned.damping = [-1.0, 1.0]);
    refused(&|b| b.learned.shape = Some([[1.0, -1.0]; 10]));
    // Networks without materials among their features cannot have learned other tissue.
    refused(&|b| {
        b.feature_kind = FeatureKind::Inertial;
        b.feature_count = b.feature_kind.count();
    });
}

#[cfg(not(feature = "guests"))]
#[test]
fn a_compared_methods_bundle_says_that_this_build_is_without_it() {
    let json = bundle(&predictor_onnx(), &decoder_onnx())
        .to_json()
        .unwrap();
    for kind in ["pose-shape", "pose-window"] {
        let json = json.replace("\"inertial\"", &format!("\"{kind}\""));
        let error = Bundle::from_json(json.as_bytes()).unwrap_err();
        assert!(matches!(error, RuntimeError::LeftOut { .. }), "{error}");
        assert!(error.to_string().contains("`guests`"), "{error}");
    }
}

#[test]
fn wrong_hashes_and_counts_are_named() {
    let (predictor, decoder) = (predictor_onnx(), decoder_onnx());
    let refused = |edit: &dyn Fn(&mut Bundle)| {
        let mut bundle = bundle(&predictor, &decoder);
        edit(&mut bundle);
        Model::from_parts(bundle, Arc::new(support::body()), &predictor, &decoder).unwrap_err()
    };
    let error = refused(&|b| b.decoder.sha256.replace_range(0..1, "x"));
    assert!(matches!(&error, RuntimeError::HashMismatch { file, .. } if file == "decoder.onnx"));
    assert!(error.to_string().contains("fetch the file again"));
    let error = refused(&|b| b.latent_count = 5);
    assert!(matches!(
        error,
        RuntimeError::BundleField {
            field: "latent_count",
            ..
        }
    ));
    let error = refused(&|b| b.vertices.truncate(3));
    assert!(matches!(
        error,
        RuntimeError::BundleField {
            field: "vertices",
            ..
        }
    ));
    let error = refused(&|b| *b.vertices.last_mut().unwrap() = 100_000);
    assert!(error.to_string().contains("100000"), "{error}");
}

#[test]
fn what_is_not_onnx_is_said_to_be_not_onnx() {
    for bytes in [
        &b""[..],
        b"PK\x03\x04",
        b"<!DOCTYPE html><html>404</html>",
        &[0xff; 100],
    ] {
        let error = load_error(bytes, &decoder_onnx());
        assert!(
            matches!(
                error,
                RuntimeError::NotOnnx {
                    network: Network::Predictor,
                    ..
                }
            ),
            "{error}"
        );
    }
}

#[test]
fn an_unknown_operator_is_named_with_those_there_are() {
    let predictor = edited(&predictor_onnx(), |graph| {
        graph.node[0].op_type = "Softmax".to_owned();
    });
    let error = load_error(&predictor, &decoder_onnx());
    assert_eq!(kind(&error), "UnknownOperator");
    assert!(error.to_string().contains("Softmax"), "{error}");
    assert!(error.to_string().contains("Sigmoid"), "{error}");
    let decoder = edited(&decoder_onnx(), |graph| {
        graph.node[0].domain = "com.example".to_owned();
    });
    let error = load_error(&predictor_onnx(), &decoder);
    assert!(error.to_string().contains("com.example.Cast"), "{error}");
}

#[test]
fn graphs_that_break_the_contract_are_refused_with_the_reason() {
    let rename = |from: &'static str, to: &'static str| {
        edited(&predictor_onnx(), |graph| {
            let ports = graph.input.iter_mut().chain(&mut graph.output);
            for port in ports.filter(|port| port.name == from) {
                port.name = to.to_owned();
            }
            for node in &mut graph.node {
                for name in node.input.iter_mut().chain(&mut node.output) {
                    if name == from {
                        *name = to.to_owned();
                    }
                }
            }
        })
    };
    for (from, to) in [
        ("features", "input"),
        ("latent", "output"),
        ("state_h", "memory"),
        ("state_c_out", "state_d_out"),
    ] {
        let error = load_error(&rename(from, to), &decoder_onnx());
        assert_eq!(kind(&error), "BrokenContract", "{from}: {error}");
    }
    let without_output = edited(&predictor_onnx(), |graph| {
        graph.output.retain(|port| port.name != "state_c_out");
    });
    assert_eq!(
        kind(&load_error(&without_output, &decoder_onnx())),
        "BrokenContract"
    );
    let error = load_error(&predictor_onnx(), &predictor_onnx());
    assert!(matches!(
        error,
        RuntimeError::BrokenContract {
            network: Network::Decoder,
            ..
        }
    ));

    let mut graph = Graph::new("flat decoder");
    let latent = graph.input("latent", &[1, support::SMALL.latents]).unwrap();
    graph.output("offsets", &latent).unwrap();
    let error = load_error(&predictor_onnx(), &graph.into_bytes());
    assert!(error.to_string().contains("[1, V, 3]"), "{error}");
}

#[test]
fn graphs_that_contradict_themselves_are_refused() {
    type Edit = (&'static str, fn(&mut GraphMessage));
    let edits: [Edit; 9] = [
        ("dangling input", |g| {
            g.node[0].input[0] = "nowhere".to_owned()
        }),
        ("missing node", |g| {
            g.node.remove(3);
        }),
        ("no inputs", |g| g.node[0].input.clear()),
        ("no outputs", |g| g.node[0].output.clear()),
        ("duplicate name", |g| {
            let again = g.initializer[0].clone();
            g.initializer.push(again);
        }),
        ("negative shape", |g| g.initializer[0].dims[0] = -4),
        ("huge shape", |g| {
            g.initializer[0].dims = vec![i64::MAX, i64::MAX]
        }),
        ("short data", |g| g.initializer[0].raw_data.truncate(6)),
        ("external data", |g| g.initializer[0].data_location = 1),
    ];
    for (name, edit) in edits {
        let predictor = edited(&predictor_onnx(), edit);
        let error = load_error(&predictor, &decoder_onnx());
        assert_eq!(kind(&error), "InvalidGraph", "{name}: {error}");
        let decoder = edited(&decoder_onnx(), edit);
        assert!(load(&predictor_onnx(), &decoder).is_err(), "{name}");
    }
    let nan = edited(&decoder_onnx(), |graph| {
        let mean = graph
            .initializer
            .iter_mut()
            .find(|t| t.name == "mean")
            .unwrap();
        mean.raw_data[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert!(
        load_error(&predictor_onnx(), &nan)
            .to_string()
            .contains("NaN")
    );
}

#[test]
fn a_decoder_may_put_its_vertices_into_another_order() {
    let decoder = |edit: &dyn Fn(&mut GraphMessage)| {
        let mut graph = Graph::new("decoder");
        let latent = graph.input("latent", &[1, 2]).unwrap();
        let numbers: Vec<f32> = (0..18u8).map(f32::from).collect();
        let basis = graph
            .weights("basis", &[2, 9], &numbers, Precision::Single)
            .unwrap();
        let flat = graph.matmul(&latent, &basis).unwrap();
        let in_blocks = graph.reshape(&flat, &[1, 3, 3]).unwrap();
        let offsets = graph.gather(&in_blocks, 1, &[2, 0, 1]).unwrap();
        graph.output("offsets", &offsets).unwrap();
        edited(&graph.into_bytes(), edit)
    };
    let onnx_bytes = decoder(&|_| {});
    let loaded = Decoder::load(&onnx_bytes).unwrap();
    let mut offsets = [0.0; 9];
    let mut session = DecoderSession::new(&loaded).unwrap();
    session.decode(&[1.0, 10.0], &mut offsets).unwrap();
    let in_order = |k: usize| (k + 10 * (9 + k)) as f32;
    let expected = [6, 7, 8, 0, 1, 2, 3, 4, 5].map(in_order);
    assert_eq!(offsets, expected);

    let outside = decoder(&|graph| {
        let indices = graph.initializer.last_mut().unwrap();
        indices.raw_data = [3_i64, 0, 1].map(i64::to_le_bytes).concat();
    });
    let error = Decoder::load(&outside).unwrap_err();
    assert!(error.to_string().contains("index 3 is outside"), "{error}");
    let of_rows = decoder(&|graph| {
        let gather = graph.node.iter_mut().find(|n| n.op_type == "Gather");
        gather.unwrap().attribute[0].i = 0;
    });
    let error = Decoder::load(&of_rows).unwrap_err();
    assert!(
        error.to_string().contains("must not be the first"),
        "{error}"
    );
}

#[test]
fn a_graph_that_would_hang_the_page_is_refused() {
    let mut graph = Graph::new("heavy");
    let latent = graph.input("latent", &[1, support::SMALL.latents]).unwrap();
    let tall = vec![0.0; 1024];
    let wide = graph
        .weights("wide", &[1, 1024], &tall, Precision::Single)
        .unwrap();
    let tall = graph
        .weights("tall", &[1024, 1], &tall, Precision::Single)
        .unwrap();
    let mut square = graph.matmul(&tall, &wide).unwrap();
    for _ in 0..4 {
        square = graph.matmul(&square, &square).unwrap();
    }
    graph.output("offsets", &latent).unwrap();
    let error = load_error(&predictor_onnx(), &graph.into_bytes());
    assert!(error.to_string().contains("multiplications"), "{error}");
}

#[test]
fn a_graph_that_would_fill_the_memory_is_refused() {
    let mut graph = Graph::new("wide");
    let latent = graph.input("latent", &[1, support::SMALL.latents]).unwrap();
    let zeros = vec![0.0; 4096];
    let wide = graph
        .weights("wide", &[1, 4096], &zeros, Precision::Single)
        .unwrap();
    let tall = graph
        .weights("tall", &[4096, 1], &zeros, Precision::Single)
        .unwrap();
    // 16 million numbers each, with few multiplications.
    for _ in 0..10 {
        graph.matmul(&tall, &wide).unwrap();
    }
    graph.output("offsets", &latent).unwrap();
    let error = load_error(&predictor_onnx(), &graph.into_bytes());
    assert!(error.to_string().contains("numbers a run"), "{error}");
}

#[test]
fn truncated_networks_never_panic() {
    let (predictor, decoder) = (predictor_onnx(), decoder_onnx());
    for cut in (0..predictor.len()).step_by(97) {
        assert!(load(&predictor[..cut], &decoder).is_err(), "cut at {cut}");
    }
    for cut in (0..decoder.len()).step_by(23) {
        assert!(load(&predictor, &decoder[..cut]).is_err(), "cut at {cut}");
    }
}

#[test]
fn mutated_networks_never_panic() {
    let mut seed = 7_u32;
    let mut random = move |below: usize| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as usize % below
    };
    let good = [predictor_onnx(), decoder_onnx()];
    let mut refused = 0;
    for _ in 0..600 {
        let mut networks = good.clone();
        let which = random(2);
        // Most bytes are weights; the structure stands at both ends.
        let length = networks[which].len();
        for _ in 0..1 + random(3) {
            let near = random(700.min(length));
            let at = match random(3) {
                0 => near,
                1 => length - 1 - near,
                _ => random(length),
            };
            networks[which][at] = random(256) as u8;
        }
        refused += usize::from(load(&networks[0], &networks[1]).is_err());
    }
    println!("{refused} of 600 mutated bundles refused");
    assert!(refused > 100);
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let json = bundle(&predictor_onnx(), &decoder_onnx())
        .to_json()
        .unwrap();
    let error = Model::load(json.as_bytes(), &mut |file| {
        Err(format!("{file} is missing"))
    });
    let error = error.unwrap_err();
    assert_eq!(kind(&error), "ReadFile");
    assert!(error.to_string().contains("body.glb"), "{error}");
    let error = Model::load(json.as_bytes(), &mut |_| Ok(b"something else".to_vec()));
    assert_eq!(kind(&error.unwrap_err()), "HashMismatch");
}
