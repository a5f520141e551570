//! Broken BVH files end in a value or an error, never in a panic or a hang.

use dynaskin_body::JOINT_COUNT;
use dynaskin_motion::{Bvh, Clip, SourceMotion, retarget};
use glam::Vec3;
use proptest::prelude::*;

mod common;

/// A small person in the names of common skeletons.
fn person() -> String {
    common::source_bvh(
        &common::MIXAMO,
        1.0,
        &[vec![0.0; 69], vec![15.0; 69], vec![-40.0; 69]],
    )
}

/// Edits of a text that exporters, editors and broken downloads make.
#[derive(Clone, Debug)]
enum Edit {
    Set(u8),
    Insert(&'static str),
    Remove(usize),
    Repeat(usize),
    Truncate,
}

fn edits() -> impl Strategy<Value = Vec<(f64, Edit)>> {
    let word = prop::sample::select(vec![
        "{",
        "}",
        "JOINT x",
        "ROOT",
        "End Site",
        "OFFSET",
        "CHANNELS 3",
        "MOTION",
        "Frames:",
        "nan",
        "-1e400",
        "1e8",
        "99999999999999999999",
        "\n",
        "\r",
        "\0",
        "\u{feff}",
    ]);
    let edit = prop_oneof![
        any::<u8>().prop_map(Edit::Set),
        word.prop_map(Edit::Insert),
        (1_usize..200).prop_map(Edit::Remove),
        (1_usize..400).prop_map(Edit::Repeat),
        Just(Edit::Truncate),
    ];
    prop::collection::vec((0.0..1.0, edit), 1..6)
}

fn apply(bytes: &mut Vec<u8>, at: f64, edit: &Edit) {
    let at = (at * bytes.len() as f64) as usize;
    let until = |count: usize| (at + count).min(bytes.len());
    match edit {
        Edit::Set(byte) => {
            if let Some(place) = bytes.get_mut(at) {
                *place = *byte;
            }
        }
        Edit::Insert(word) => {
            bytes.splice(at..at, word.bytes());
        }
        Edit::Remove(count) => {
            bytes.drain(at..until(*count));
        }
        Edit::Repeat(count) => {
            let part = bytes[at..until(*count)].to_vec();
            bytes.splice(at..at, part);
        }
        Edit::Truncate => bytes.truncate(at),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn edited_files_never_panic(edits in edits()) {
        let mut bytes = person().into_bytes();
        for (at, edit) in &edits {
            apply(&mut bytes, *at, edit);
        }
        if let Ok(bvh) = Bvh::parse(&bytes) {
            prop_assert!(bvh.frame_count() > 0);
            let retargeted = retarget(&bvh, &target());
            if let Ok((clip, _)) = retargeted {
                prop_assert!(clip.frames.iter().all(dynaskin_body::Pose::is_valid));
                let _: Result<Clip, _> = clip.resampled(60.0);
            }
        }
    }

    #[test]
    fn rubbish_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(Bvh::parse(&bytes).is_err());
    }
}

fn target() -> [Vec3; JOINT_COUNT] {
    static JOINTS: std::sync::OnceLock<[Vec3; JOINT_COUNT]> = std::sync::OnceLock::new();
    *JOINTS.get_or_init(common::female_joints_m)
}
