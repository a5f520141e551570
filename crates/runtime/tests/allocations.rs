//! What a step asks of the allocator after warm-up: nothing, where the networks run as one operator.

// A failed step of a test is a failed test; an allocator cannot be written without `unsafe`.
#![allow(clippy::unwrap_used, unsafe_code)]

#[path = "support/shipped.rs"]
mod shipped;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use dynaskin_body::Pose;
use dynaskin_motion::ProceduralKind;
use dynaskin_runtime::{Avatar, Crowd, Detail};

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

#[test]
fn a_step_allocates_nothing() {
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
    assert_eq!(measured(|| play(&mut avatar)), (0, 0));

    avatar.set_detail(Detail::Asleep);
    play(&mut avatar);
    assert_eq!(measured(|| play(&mut avatar)), (0, 0), "asleep");
}

#[test]
fn a_crowd_allocates_nothing() {
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
    assert_eq!(measured(&mut play), (0, 0));
}
