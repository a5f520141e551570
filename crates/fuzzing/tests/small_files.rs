//! Model files of a megabyte that ask for as much as they can are read within 300 MB, or refused.

// An allocator cannot be written without `unsafe`; a failed step of a test is a failed test.
#![allow(clippy::unwrap_used, clippy::print_stdout, unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write as _;
use std::sync::Arc;
use std::time::Instant;

use dynaskin_body::BodyModel;
use dynaskin_fuzzing::Target;
use dynaskin_onnx::{Graph, Precision, WriteError};
use dynaskin_runtime::{Decoder, DecoderSession, Predictor, PredictorSession};

const MOST_BYTES: isize = 300_000_000;
const FILE_BYTES: usize = 1_300_000;

thread_local! {
    static HELD_BYTES: Cell<isize> = const { Cell::new(0) };
    static MOST_HELD_BYTES: Cell<isize> = const { Cell::new(0) };
}

/// The system's allocator, counting per thread.
struct Counting;

fn count(bytes: isize) {
    // While a thread ends its counters may be gone; nothing is measured then.
    let _ = HELD_BYTES.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = MOST_HELD_BYTES.try_with(|most| most.set(most.get().max(held.get())));
    });
}

// SAFETY: every call is handed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Reads `file` and says whether it was accepted, and what that took.
fn try_small(name: &str, file: &[u8], read: impl FnOnce(&[u8]) -> bool) {
    assert!(file.len() < FILE_BYTES, "{name}: {} bytes", file.len());
    let held = HELD_BYTES.get();
    MOST_HELD_BYTES.set(held);
    let began = Instant::now();
    let outcome = if read(file) { "read" } else { "refused" };
    let seconds = began.elapsed().as_secs_f64();
    let most = MOST_HELD_BYTES.get() - held;
    let megabytes = most as f64 / 1e6;
    println!(
        "{name}, {} bytes: {outcome}, {seconds:.2} s, {megabytes:.0} MB",
        file.len()
    );
    assert!(most < MOST_BYTES, "{name}: {megabytes:.0} MB");
}

/// Loads a decoder and runs it once.
fn decode(file: &[u8]) -> bool {
    let Ok(decoder) = Decoder::load(file) else {
        return false;
    };
    let Ok(mut session) = DecoderSession::new(&decoder) else {
        return false;
    };
    let mut offsets_m = vec![0.0; 3 * decoder.vertex_count()];
    session
        .decode(&vec![0.5; decoder.latent_count()], &mut offsets_m)
        .is_ok()
}

/// Loads a predictor and runs it once.
fn predict(file: &[u8]) -> bool {
    let Ok(predictor) = Predictor::load(file) else {
        return false;
    };
    let (features, latents) = (predictor.feature_count(), predictor.latent_count());
    let Ok(mut session) = PredictorSession::new(Arc::new(predictor)) else {
        return false;
    };
    let mut state = session.predictor().zero_state();
    session
        .step(&vec![0.5; features], &mut state, &mut vec![0.0; latents])
        .is_ok()
}

/// A decoder whose latents are repeated until there are `numbers`, on which `work` is done.
fn wide(
    numbers: usize,
    work: impl FnOnce(&mut Graph, dynaskin_onnx::Value) -> Result<dynaskin_onnx::Value, WriteError>,
) -> Vec<u8> {
    let mut graph = Graph::new("decoder");
    let build = || {
        let mut wide = graph.input("latent", &[1, 2])?;
        while wide.shape()[1] < numbers {
            wide = graph.concat(&[&wide, &wide], 1)?;
        }
        let worked = work(&mut graph, wide)?;
        let flat = graph.gather(&worked, 1, &[0, 1, 2, 3, 4, 5])?;
        let offsets = graph.reshape(&flat, &[1, 2, 3])?;
        graph.output("offsets", &offsets)
    };
    build().unwrap();
    graph.into_bytes()
}

#[test]
fn decoders() {
    let tables = wide(1 << 19, |graph, mut wide| {
        for _ in 0..5 {
            wide = graph.tanh(&wide);
        }
        Ok(wide)
    });
    try_small("six tables of half a million numbers", &tables, decode);
    let half = 1 << 10;
    let product = wide(half * half, |graph, wide| {
        let square = graph.reshape(&wide, &[half, half])?;
        let product = graph.matmul(&square, &square)?;
        graph.reshape(&product, &[1, half * half])
    });
    try_small("a billion multiplications", &product, decode);
    let nodes = wide(1 << 9, |graph, mut wide| {
        for _ in 0..4050 {
            wide = graph.tanh(&wide);
        }
        Ok(wide)
    });
    try_small("four thousand nodes", &nodes, decode);
    let both = wide(1 << 17, |graph, wide| {
        let other = graph.exp(&wide);
        let mut parts = vec![wide, other];
        for k in 0..8 {
            let next = graph.add(&parts[k], &parts[k + 1])?;
            parts.push(next);
        }
        let mut sum = parts.remove(0);
        for part in &parts {
            sum = graph.mul(&sum, part)?;
        }
        Ok(sum)
    });
    try_small("tables that are all needed at the end", &both, decode);
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, 8]).unwrap();
    let weights = graph
        .weights(
            "weights",
            &[8, 75_000],
            &vec![0.5; 600_000],
            Precision::Half,
        )
        .unwrap();
    let flat = graph.matmul(&latent, &weights).unwrap();
    let offsets = graph.reshape(&flat, &[1, 25_000, 3]).unwrap();
    graph.output("offsets", &offsets).unwrap();
    try_small("all weights", &graph.into_bytes(), decode);
}

#[test]
fn predictors() {
    let predictor = |numbers: usize, repeats: usize| {
        let mut graph = Graph::new("predictor");
        let features = graph.input("features", &[1, 2]).unwrap();
        let state = graph.input("state_s", &[1, 2]).unwrap();
        let mut wide = graph.concat(&[&features, &state], 1).unwrap();
        while wide.shape()[1] < numbers {
            wide = graph.concat(&[&wide, &wide], 1).unwrap();
        }
        for _ in 0..repeats {
            wide = graph.sigmoid(&wide);
        }
        let few = graph.gather(&wide, 1, &[0, 1, 2, 3]).unwrap();
        let parts = graph.split(&few, 1, &[2, 2]).unwrap();
        graph.output("latent", &parts[0]).unwrap();
        graph.output("state_s_out", &parts[1]).unwrap();
        graph.into_bytes()
    };
    try_small(
        "tables of half a million numbers",
        &predictor(1 << 19, 6),
        predict,
    );
    try_small("four thousand nodes", &predictor(1 << 9, 4060), predict);
}

fn npy(kind: &str, shape: &str, bytes: usize, fill: u8) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    let padded = format!("{header:<117}\n");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((padded.len() as u16).to_le_bytes());
    file.extend(padded.as_bytes());
    file.resize(file.len() + bytes, fill);
    file
}

#[test]
fn bodies() {
    let options = zip::write::SimpleFileOptions::default();
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let vertices = 30_000;
    for (name, kind, shape, bytes) in [
        ("v_template", "<f8", format!("{vertices}, 3"), 24 * vertices),
        (
            "shapedirs",
            "<f8",
            format!("{vertices}, 3, 300"),
            7200 * vertices,
        ),
        (
            "posedirs",
            "<f8",
            format!("{vertices}, 3, 207"),
            4968 * vertices,
        ),
        (
            "J_regressor",
            "<f8",
            format!("24, {vertices}"),
            192 * vertices,
        ),
        ("weights", "<f8", format!("{vertices}, 24"), 192 * vertices),
        ("f", "<u4", format!("{}, 3", 2 * vertices), 24 * vertices),
    ] {
        archive.start_file(format!("{name}.npy"), options).unwrap();
        archive.write_all(&npy(kind, &shape, bytes, 0)).unwrap();
    }
    archive.start_file("kintree_table.npy", options).unwrap();
    let seed = &Target::NpzBody.seeds()[0];
    let mut seeds = zip::ZipArchive::new(std::io::Cursor::new(seed)).unwrap();
    let mut tree = seeds.by_name("kintree_table.npy").unwrap();
    std::io::copy(&mut tree, &mut archive).unwrap();
    let file = archive.finish().unwrap().into_inner();
    try_small("SMPL of zeros", &file, |file| {
        BodyModel::from_smpl_npz(file).is_ok()
    });

    let mut body = BodyModel::from_glb(&Target::GlbBody.seeds()[1]).unwrap();
    let times = 5_000 / body.vertex_count();
    let repeated = |numbers: &[glam::Vec3]| numbers.repeat(times);
    body.template_m = repeated(&body.template_m);
    body.shape_dirs_m = body
        .shape_dirs_m
        .iter()
        .map(|dirs| repeated(dirs))
        .collect();
    body.skin = body.skin.repeat(times);
    body.faces = body.faces.repeat(times);
    body.thickness_template_m = body.thickness_template_m.repeat(times);
    body.thickness_shape_dirs_m = body
        .thickness_shape_dirs_m
        .iter()
        .map(|dirs| dirs.repeat(times))
        .collect();
    body.region_weights = body
        .region_weights
        .iter()
        .map(|weights| weights.repeat(times))
        .collect();
    body.colors_srgba = body.colors_srgba.repeat(times);
    let file = body.to_glb().unwrap();
    try_small("a body of five thousand vertices", &file, |file| {
        BodyModel::from_glb(file).is_ok()
    });
}
