//! Inputs that fuzzers found to reach code that others do not reach, and some mutations of the seeds, on
//! every reader.

#![allow(clippy::print_stdout)] // The numbers are for people to read.

use dynaskin_fuzzing::{Target, pack, saved, unpack};

/// Mutations of the seeds that are tried on each reader, beside the saved inputs.
const MUTATIONS: u64 = 400;

fn try_saved(target: Target) {
    let files = saved(target).expect("the saved inputs of every target are in the repository");
    let accepted = files.iter().filter(|file| target.check(file)).count();
    println!("{}: {accepted} of {} accepted", target.name(), files.len());
    // What is accepted, the seeds and their mutations show: of bodies, which fuzzers cut short, no
    // saved input is whole.
    assert!(accepted < files.len());
}

fn try_mutations(target: Target) {
    let seeds = target.seeds();
    let mut accepted = 0;
    for seed in 0..MUTATIONS {
        // Without a fuzzer: a byte is turned.
        let mut turn = |bytes: &mut Vec<u8>| {
            let at = seed as usize * 7919 % bytes.len().max(1);
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << (seed % 8);
            }
        };
        let file = &seeds[seed as usize % seeds.len()];
        let once = target.mutated(file, seed, &mut turn);
        let twice = target.mutated(&once, !seed, &mut turn);
        accepted += usize::from(target.check(&once)) + usize::from(target.check(&twice));
    }
    // Structure is kept: some mutated files are whole ones.
    println!(
        "{}: {accepted} of {} accepted",
        target.name(),
        2 * MUTATIONS
    );
    assert!(accepted > 0);
}

macro_rules! targets {
    ($($name:ident: $target:ident;)*) => {$(
        #[test]
        fn $name() {
            let target = Target::$target;
            for seed in target.seeds() {
                assert!(target.check(&seed), "a seed of {} is accepted", target.name());
            }
            try_saved(target);
            try_mutations(target);
        }
    )*};
}

targets! {
    bvh_motions_are_valid_or_refused: Bvh;
    gltf_motions_are_valid_or_refused: Gltf;
    npz_poses_are_valid_or_refused: NpzPoses;
    npz_bodies_are_finite_or_refused: NpzBody;
    glb_bodies_are_finite_or_refused: GlbBody;
    bundles_are_whole_or_refused: Bundle;
    predictors_run_or_are_refused: Predictor;
    decoders_run_or_are_refused: Decoder;
    states_are_gone_on_from_or_refused: State;
    clips_are_whole_or_refused: Clip;
    obj_meshes_are_finite_or_refused: Obj;
    ply_meshes_are_finite_or_refused: Ply;
    hdf5_arrays_are_whole_or_refused: Hdf5;
}

#[test]
fn packed_inputs_come_back_as_they_were() {
    let files = vec![vec![1, 2, 3], Vec::new(), vec![9; 1000]];
    let packed = pack(&files).expect("memory takes them");
    assert_eq!(unpack(&packed).expect("they are whole"), files);
    assert!(unpack(&packed[..packed.len() / 2]).is_err());
}

#[test]
fn every_target_is_found_by_its_name() {
    for target in Target::ALL {
        assert_eq!(Target::from_name(target.name()), Some(target));
    }
    assert_eq!(Target::from_name("nothing"), None);
}
