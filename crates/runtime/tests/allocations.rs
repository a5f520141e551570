//! What a step asks of the allocator after warm-up. tract allocates the values of its graphs anew in
//! every run; dynaskin's own code must add nothing to that, and nothing may stay.

// A failed step of a test is a failed test; an allocator cannot be written without `unsafe`.
#![allow(clippy::unwrap_used, unsafe_code)]

#[path = "support/shipped.rs"]
mod shipped;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use dynaskin_body::Pose;
use dynaskin_motion::ProceduralKind;
use dynaskin_runtime::{
    Avatar, Crowd, Decoder, DecoderSession, Detail, Predictor, PredictorSession,
};

const DT: f64 = 1.0 / 60.0;

thread_local! {
    static CALLS: Cell<usize> = const { Cell::new(0) };
    static HELD_BYTES: Cell<isize> = const { Cell::new(0) };
}

/// The system's allocator, counting per thread.
struct Counting;

fn count(bytes: isize) {
    // While a thread ends its counters may be gone; nothing is measured then.
    let _ = HELD_BYTES.try_with(|held| held.set(held.get() + bytes));
    if bytes > 0 {
        let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
    }
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

/// Allocations of `work`, and the bytes it keeps.
fn measured(work: impl FnOnce()) -> (usize, isize) {
    let before = (CALLS.get(), HELD_BYTES.get());
    work();
    (CALLS.get() - before.0, HELD_BYTES.get() - before.1)
}

/// Allocations of one bare run of each network.
fn of_networks() -> (usize, usize) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/female");
    let read = |name: &str| std::fs::read(format!("{folder}/{name}.onnx")).unwrap();
    let predictor = Arc::new(Predictor::load(&read("predictor")).unwrap());
    let decoder = Decoder::load(&read("decoder")).unwrap();
    let features = vec![0.1; predictor.feature_count()];
    let mut state = predictor.zero_state();
    let mut latent = vec![0.0; predictor.latent_count()];
    let mut offsets_m = vec![0.0; 3 * decoder.vertex_count()];
    let mut predictor = PredictorSession::new(predictor).unwrap();
    let mut decoder = DecoderSession::new(&decoder).unwrap();
    let mut run = || {
        let (predict, _) = measured(|| predictor.step(&features, &mut state, &mut latent).unwrap());
        let (decode, _) = measured(|| decoder.decode(&latent, &mut offsets_m).unwrap());
        (predict, decode)
    };
    run();
    run()
}

#[test]
fn a_step_allocates_only_what_tract_does_and_keeps_nothing() {
    let model = shipped::model("female");
    let mut avatar = shipped::avatar(&model);
    let clip = shipped::clip(ProceduralKind::Hop, &avatar);
    let poses: Vec<Pose> = (0..240).map(|t| clip.pose_at(f64::from(t) * DT)).collect();
    let play = |avatar: &mut Avatar| {
        for pose in &poses {
            avatar.step(pose, DT).unwrap();
        }
    };
    play(&mut avatar);
    let (predict, decode) = of_networks();
    let (calls, kept) = measured(|| play(&mut avatar));
    println!(
        "240 steps: {calls} allocations, {kept} bytes kept; of tract {predict} + {decode} each"
    );
    assert_eq!(kept, 0);
    assert!(predict > 0 && decode > 0);
    assert_eq!(calls, 240 * (predict + decode));

    avatar.set_detail(Detail::Asleep);
    play(&mut avatar);
    assert_eq!(measured(|| play(&mut avatar)), (0, 0), "asleep");
}

#[test]
fn a_crowd_allocates_less_per_avatar_and_keeps_nothing() {
    const COUNT: usize = 16;
    let model = shipped::model("female");
    let mut avatars: Vec<Avatar> = (0..COUNT).map(|_| shipped::avatar(&model)).collect();
    let clip = shipped::clip(ProceduralKind::Hop, &avatars[0]);
    let poses: Vec<Vec<Pose>> = (0..120)
        .map(|t| vec![clip.pose_at(f64::from(t) * DT); COUNT])
        .collect();
    let mut crowd = Crowd::new(model).unwrap();
    let mut all: Vec<&mut Avatar> = avatars.iter_mut().collect();
    let mut play = || {
        for poses in &poses {
            crowd.step_all(&mut all, poses, DT, &mut || 0.0).unwrap();
        }
    };
    play();
    let (predict, decode) = of_networks();
    let (calls, kept) = measured(&mut play);
    let each = calls as f64 / (120 * COUNT) as f64;
    println!("{each:.1} allocations an avatar and step, {kept} bytes kept");
    assert_eq!(kept, 0);
    assert!(each < 0.5 * (predict + decode) as f64);
}
