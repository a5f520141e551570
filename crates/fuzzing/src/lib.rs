//! Seeds, mutations and checks for fuzzing every reader of untrusted files.
//!
//! A [`Target`] is one reader with three things: seeds made by code, a mutation that keeps the file's
//! structure (it corrects lengths, checksums and syntax, so that the code behind these checks is tested),
//! and a check that panics if an accepted file breaks a guarantee. The fuzzers in `fuzz/`, outside the
//! workspace because they are compiled with coverage counters, find inputs; those worth keeping are packed
//! into `corpus/` and run as a test of this crate.

mod check;
mod container;
mod corpus;
#[path = "../../runtime/tests/support/mod.rs"]
mod made_up;
mod mutate;
mod seeds;
mod stage;

pub use corpus::{pack, save_smallest, saved, unpack, write};

/// A reader and what is tried on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// BVH motions.
    Bvh,
    /// Motions in binary glTF.
    Gltf,
    /// SMPL poses in `.npz`.
    NpzPoses,
    /// SMPL-family bodies in `.npz`.
    NpzBody,
    /// Bodies in binary glTF.
    GlbBody,
    /// `bundle.json`.
    Bundle,
    /// `predictor.onnx` and `predictor.lowered`.
    Predictor,
    /// `decoder.onnx` and `decoder.lowered`.
    Decoder,
    /// Saved states of avatars.
    State,
    /// Clips of the simulator's data set.
    Clip,
    /// Meshes in OBJ.
    Obj,
    /// Meshes in PLY.
    Ply,
    /// Arrays in HDF5.
    Hdf5,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Bvh,
        Self::Gltf,
        Self::NpzPoses,
        Self::NpzBody,
        Self::GlbBody,
        Self::Bundle,
        Self::Predictor,
        Self::Decoder,
        Self::State,
        Self::Clip,
        Self::Obj,
        Self::Ply,
        Self::Hdf5,
    ];

    /// The name of its fuzzer, such as `npz_poses`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Gltf => "gltf",
            Self::NpzPoses => "npz_poses",
            Self::NpzBody => "npz_body",
            Self::GlbBody => "glb_body",
            Self::Bundle => "bundle",
            Self::Predictor => "predictor",
            Self::Decoder => "decoder",
            Self::State => "state",
            Self::Clip => "clip",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Hdf5 => "hdf5",
        }
    }

    /// The target of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.name() == name)
    }

    /// Whole files to begin with, all of which are accepted.
    pub fn seeds(self) -> Vec<Vec<u8>> {
        match self {
            Self::Bvh => seeds::motions::bvh(),
            Self::Gltf => seeds::motions::gltf(),
            Self::NpzPoses => seeds::motions::npz(),
            Self::NpzBody => seeds::bodies::npz(),
            Self::GlbBody => seeds::bodies::glb(),
            Self::Bundle => seeds::bundles::json(),
            Self::Predictor => seeds::networks::predictors(),
            Self::Decoder => seeds::networks::decoders(),
            Self::State => stage::states(),
            Self::Clip => seeds::clips::clips(),
            Self::Obj => seeds::meshes::obj(),
            Self::Ply => seeds::meshes::ply(),
            Self::Hdf5 => seeds::meshes::hdf5(),
        }
    }

    /// Another file made of `file`, the same for the same `seed`. `raw` changes bytes without structure;
    /// a fuzzer gives its own, which knows what was compared with what. The result may be longer than
    /// the fuzzer's limit, which then cuts it.
    pub fn mutated(self, file: &[u8], seed: u64, raw: &mut dyn FnMut(&mut Vec<u8>)) -> Vec<u8> {
        let mut mutator = mutate::Mutator::new(seed, raw);
        match self {
            Self::Bvh | Self::Obj => mutator.text_file(file),
            Self::Ply => mutator.ply(file),
            Self::Gltf | Self::GlbBody => mutator.glb(file),
            Self::NpzPoses | Self::NpzBody => mutator.npz(file),
            Self::Bundle => mutator.json_file(file),
            Self::Predictor | Self::Decoder => mutator.network(file),
            Self::State => mutator.sealed(file, container::STATE_HEADER),
            Self::Clip => mutator.safetensors(file),
            Self::Hdf5 => mutator.numbers(file),
        }
    }

    /// Reads a file as a user's program does. Whether it was accepted.
    ///
    /// # Panics
    /// Where the reader panics, and where an accepted file breaks a promise: a pose that is not valid, a
    /// number that is not finite, an avatar that cannot be stepped.
    pub fn check(self, file: &[u8]) -> bool {
        match self {
            Self::Bvh | Self::Gltf | Self::NpzPoses => check::motion(file),
            Self::NpzBody => check::npz_body(file),
            Self::GlbBody => check::glb_body(file),
            Self::Bundle => check::bundle(file),
            Self::Predictor => check::predictor(file),
            Self::Decoder => check::decoder(file),
            Self::State => check::state(file),
            Self::Clip => check::clip(file),
            Self::Obj => check::mesh(dynaskin_fit::MeshKind::Obj, file),
            Self::Ply => check::mesh(dynaskin_fit::MeshKind::Ply, file),
            Self::Hdf5 => check::hdf5(file),
        }
    }
}

/// Whether a file is one of the share, one in `share`, on which what is slow is tried. It depends on the
/// file alone, so that what was found is found again.
fn is_in_share(file: &[u8], share: u64) -> bool {
    use std::hash::Hasher as _;
    let mut hasher = rustc_hash::FxHasher::default();
    hasher.write(file);
    // The low bits of this hash see little of the file.
    (hasher.finish() >> 40).is_multiple_of(share)
}
