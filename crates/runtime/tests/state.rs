//! Saved states: the same bits afterwards, and bytes that are refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod support;

use dynaskin_body::Region;
use dynaskin_runtime::{Avatar, Controls, RuntimeError};
use sha2::{Digest as _, Sha256};
use support::{kind, model_of, pose_at};

const SHAPE: [f32; 10] = [0.5, -1.0, 0.2, 0.0, 0.3, 0.0, 0.0, -0.4, 0.0, 1.0];

fn avatar() -> Avatar {
    Avatar::new(support::model(), &SHAPE).unwrap()
}

/// A step of its own length for each frame.
fn dt(frame: usize) -> f64 {
    [0.004, 1.0 / 60.0, 0.03, 0.011][frame % 4]
}

/// Steps on from `first` for `count` frames.
fn step(avatar: &mut Avatar, first: usize, count: usize) {
    for frame in first..first + count {
        let time: f64 = (0..=frame).map(dt).sum();
        avatar.step(&pose_at(time), dt(frame)).unwrap();
    }
}

fn assert_same_bits(a: &Avatar, b: &Avatar) {
    let bits = |avatar: &Avatar| -> Vec<u32> {
        let surface = [
            avatar.offsets_rest_m(),
            avatar.positions_rest_m(),
            avatar.normals_rest(),
        ];
        let vectors = surface.into_iter().flatten().flat_map(|v| v.to_array());
        let matrices = avatar.skin_matrices().iter();
        let matrices = matrices.flat_map(|m| m.to_cols_array());
        vectors.chain(matrices).map(f32::to_bits).collect()
    };
    assert_eq!(bits(a), bits(b));
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let (mut one, mut other) = (avatar(), avatar());
    step(&mut one, 0, 200);
    step(&mut other, 0, 200);
    assert_same_bits(&one, &other);
}

#[test]
fn the_revision_is_another_after_every_shape_that_was_taken() {
    let mut avatar = avatar();
    let state = avatar.save();
    let mut seen = vec![avatar.revision()];
    step(&mut avatar, 0, 3);
    avatar.set_scale(2.0).unwrap();
    assert_eq!(avatar.revision(), seen[0]);
    avatar.set_shape(&[9.0; 10]).unwrap_err();
    avatar.restore(&state[..9]).unwrap_err();
    assert_eq!(avatar.revision(), seen[0]);
    avatar.set_shape(&[0.0; 10]).unwrap();
    seen.push(avatar.revision());
    avatar.restore(&state).unwrap();
    seen.push(avatar.revision());
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 3);
}

#[test]
fn a_restored_avatar_goes_on_bit_by_bit() {
    let calm = Controls::calm_clothes();
    for controls in [Controls::default(), calm] {
        let mut saved = avatar();
        saved.set_controls(&controls).unwrap();
        saved.set_scale(2.0).unwrap();
        step(&mut saved, 0, 50);
        let bytes = saved.save();
        // Onto an avatar that is of another shape and in another motion.
        let mut restored = Avatar::new(support::model(), &[0.0; 10]).unwrap();
        step(&mut restored, 70, 20);
        restored.restore(&bytes).unwrap();
        assert_same_bits(&saved, &restored);
        assert_eq!(restored.save(), bytes);
        step(&mut saved, 50, 100);
        step(&mut restored, 50, 100);
        assert_same_bits(&saved, &restored);
    }
}

#[test]
fn a_state_from_before_the_first_step_stands_in_the_rest_pose() {
    let state = avatar().save();
    let mut moved = avatar();
    step(&mut moved, 0, 20);
    moved.restore(&state).unwrap();
    assert_same_bits(&moved, &avatar());
}

#[test]
fn tissue_switched_off_and_on_shows_nothing_of_before_until_the_next_step() {
    let mut switched = avatar();
    step(&mut switched, 0, 20);
    switched.set_enabled(false);
    switched.set_enabled(true);
    switched.set_strength(2.0).unwrap();
    let is_flat = |avatar: &Avatar| avatar.offsets_rest_m().iter().all(|o| o.length() == 0.0);
    assert!(is_flat(&switched));
    let mut restored = avatar();
    restored.restore(&switched.save()).unwrap();
    assert!(is_flat(&restored));
    step(&mut switched, 20, 1);
    assert!(!is_flat(&switched));
}

#[test]
fn poses_on_their_way_are_not_saved_and_the_next_one_settles() {
    use dynaskin_runtime::{PoseSource, Settled};
    const TICK: f64 = 1.0 / 60.0;
    let mut one = avatar();
    // Held over two frames.
    for frame in 0..120 {
        one.step(&pose_at(f64::from(frame / 2) / 30.0), TICK)
            .unwrap();
    }
    assert!(one.source_diagnosis().repeats);
    let mut other = avatar();
    other.set_pose_source(PoseSource::Network);
    other.restore(&one.save()).unwrap();
    assert_eq!(other.pose_source(), PoseSource::Network);
    let report = other.step(&pose_at(2.0), TICK).unwrap();
    assert_eq!(report.settled, Some(Settled::FirstPose));
}

#[test]
fn a_state_in_the_middle_of_a_fade_goes_on() {
    let mut saved = avatar();
    step(&mut saved, 0, 50);
    let mut far = pose_at(1.0);
    far.root_translation_m.x += 9.0;
    assert!(saved.step(&far, 1.0 / 60.0).unwrap().settled.is_some());
    saved.step(&far, 1.0 / 60.0).unwrap();
    let mut restored = avatar();
    restored.restore(&saved.save()).unwrap();
    for _ in 0..30 {
        saved.step(&far, 1.0 / 60.0).unwrap();
        restored.step(&far, 1.0 / 60.0).unwrap();
        assert_same_bits(&saved, &restored);
    }
}

#[test]
fn bytes_that_were_changed_or_belong_elsewhere_are_refused() {
    let mut avatar = avatar();
    step(&mut avatar, 0, 50);
    let bytes = avatar.save();
    let mut other = Avatar::new(
        model_of(support::Size {
            latents: 5,
            ..support::SMALL
        }),
        &SHAPE,
    )
    .unwrap();
    let error = other.restore(&bytes).unwrap_err();
    assert!(error.to_string().contains("another model"), "{error}");

    let mut calm = Avatar::new(support::model(), &SHAPE).unwrap();
    step(&mut calm, 0, 50);
    let check = |avatar: &mut Avatar, bytes: &[u8]| {
        let error = avatar.restore(bytes).unwrap_err();
        assert_eq!(kind(&error), "InvalidState", "{error}");
        assert_eq!(error.code(), "state");
    };
    for length in (0..bytes.len()).step_by(97) {
        check(&mut avatar, &bytes[..length]);
    }
    for place in (0..bytes.len()).step_by(53) {
        let mut changed = bytes.clone();
        changed[place] ^= 0x10;
        check(&mut avatar, &changed);
    }
    let longer = [&bytes[..], &[0]].concat();
    check(&mut avatar, &longer);
    // It runs on as if nothing had been.
    step(&mut avatar, 50, 50);
    step(&mut calm, 50, 50);
    assert_same_bits(&avatar, &calm);
}

#[test]
fn controls_come_back_with_the_state() {
    let mut saved = avatar();
    let mut controls = Controls::default();
    controls.regions[Region::Calves as usize].gain = 0.25;
    saved.set_controls(&controls).unwrap();
    let mut restored = avatar();
    restored.restore(&saved.save()).unwrap();
    assert_eq!(restored.controls(), &controls);
    assert!(matches!(
        restored.restore(b"short"),
        Err(RuntimeError::InvalidState { .. })
    ));
}

/// `bytes` with the right checksum.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let payload = bytes.len() - 32;
    let checksum = Sha256::digest(&bytes[..payload]);
    bytes[payload..].copy_from_slice(&checksum);
    bytes
}

#[test]
fn garbage_behind_a_right_checksum_is_refused_or_taken_and_never_panics() {
    let mut saved = avatar();
    let mut controls = Controls::calm_clothes();
    controls.strength = 2.0;
    saved.set_controls(&controls).unwrap();
    step(&mut saved, 0, 50);
    let good = saved.save();
    assert_eq!(sealed(good.clone()), good);
    const HEADER: usize = 8 + 4 + 32;
    let mut other = avatar();
    let mut refused = 0;
    let mut check = |bytes: Vec<u8>| {
        if let Err(error) = other.restore(&sealed(bytes)) {
            assert!(["state", "pose", "shape", "argument"].contains(&error.code()));
            refused += 1;
        }
        // Whatever was taken can be gone on from.
        other.step(&pose_at(0.3), 1.0 / 60.0).unwrap();
    };
    for place in (HEADER..good.len() - 32).step_by(29) {
        for byte in [0x00, 0x7f, 0xff] {
            let mut changed = good.clone();
            changed[place] = byte;
            check(changed);
        }
    }
    for length in (HEADER + 32..good.len()).step_by(61) {
        check(good[..length].to_vec());
    }
    check([&good[..], &[0; 5]].concat());
    // Lists that claim to be longer than memory.
    check([&good[..HEADER], &[0xff; 200]].concat());
    assert!(refused > 50, "{refused}");
    other.restore(&good).unwrap();
    assert_eq!(other.save(), good);
}

/// Numbers that are finite, and whose squares are not.
#[test]
fn a_state_with_huge_offsets_is_refused_or_shows_finite_ones() {
    let mut saved = avatar();
    step(&mut saved, 0, 50);
    let good = saved.save();
    const HEADER: usize = 8 + 4 + 32;
    let (mut other, mut refused) = (avatar(), 0);
    for place in (HEADER + 1500..good.len() - 36).step_by(7) {
        let mut changed = good.clone();
        changed[place..place + 4].copy_from_slice(&3e38_f32.to_le_bytes());
        refused += usize::from(other.restore(&sealed(changed)).is_err());
        // The networks may overflow, which is an error of its own.
        let _ = other.step(&pose_at(0.3), 1.0 / 60.0);
        assert!(
            other
                .offsets_rest_m()
                .iter()
                .all(|offset| offset.is_finite())
        );
    }
    assert!(refused > 50, "{refused}");
}

#[test]
fn a_state_of_version_2_is_refused_for_its_version() {
    let mut bytes = avatar().save();
    bytes[8..12].copy_from_slice(&2_u32.to_le_bytes());
    let error = avatar().restore(&sealed(bytes)).unwrap_err();
    assert!(error.to_string().contains("version 2, not 3"), "{error}");
    assert_eq!(kind(&error), "InvalidState");
}
