//! Avatars of other people, bound unattended; skipped by name where they are not there.

// It prints what it measures.
#![allow(clippy::print_stdout)]
// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::{body, shared_avatar};
use dynaskin_bind::{Avatar, BindOptions, Binding, bind};

/// Name, the body it is bound to, and the share of its skin within 2 cm that it reaches at least.
const AVATARS: [(&str, &str, f32); 10] = [
    ("valid-black-f-1-medi.glb", "female", 0.93),
    ("valid-black-f-2-casual.glb", "female", 0.93),
    ("valid-hispanic-f-2-busi.glb", "female", 0.93),
    ("valid-white-m-2-casual.glb", "male", 0.93),
    ("valid-white-m-3-busi.glb", "male", 0.93),
    ("mesh2motion-human-female.glb", "female", 0.93),
    ("mesh2motion-human-male.glb", "male", 0.93),
    ("plain-a-pose.glb", "female", 0.93),
    ("vrm0-t-pose.vrm", "female", 0.93),
    ("vrm1-t-pose.vrm", "female", 0.93),
];

/// What a stored binding may have.
const MOST_BYTES: usize = 200_000;

#[test]
fn realistic_people_are_bound() {
    all_are_bound(&AVATARS[..5]);
}

#[test]
fn game_figures_and_vrm_are_bound() {
    all_are_bound(&AVATARS[5..]);
}

fn all_are_bound(avatars: &[(&str, &str, f32)]) {
    let bodies = ["female", "male"].map(|name| (name, body(name)));
    let mut missed: Vec<(&str, f32)> = Vec::new();
    for (name, of_body, least) in avatars {
        let Some(bytes) = shared_avatar(name) else {
            continue;
        };
        let (_, body) = bodies.iter().find(|(name, _)| name == of_body).unwrap();
        let avatar = Avatar::from_glb(&bytes).unwrap();
        let binding = bind(&avatar, body, &BindOptions::adult()).unwrap().binding;
        let report = &binding.report;
        println!(
            "{name}: within 2 cm {:.3} ({:.3} bare), median {:.1} mm, {:?}",
            report.share_close,
            report.share_close_bare,
            1e3 * report.median_m,
            report.regions_off,
        );
        missed.extend((report.share_close < *least).then_some((*name, report.share_close)));
        let stored = binding.to_bytes();
        assert!(stored.len() <= MOST_BYTES, "{name}: {} bytes", stored.len());
        let again = Binding::from_bytes(&stored, body).unwrap();
        assert_eq!(avatar.check_binding(&again, body), Ok(()));
        if name.starts_with("vrm") || name.starts_with("plain") {
            assert!(
                report.double_motion.iter().any(|bone| bone == "breast_l"),
                "{name}"
            );
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
