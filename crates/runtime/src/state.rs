//! Saved states: little-endian numbers behind a header, with a checksum at the end.
//!
//! ```text
//! "DYNSKINS"  8 bytes
//! version     u32
//! model       32 bytes: SHA-256 over the hashes of the bundle's three files
//! payload     see the `write` functions
//! checksum    32 bytes: SHA-256 of all before
//! ```

use dynaskin_body::Pose;
use glam::{DQuat, DVec3};
use sha2::{Digest, Sha256};

use crate::{RuntimeError, pose};

const MAGIC: &[u8; 8] = b"DYNSKINS";
const HASH: usize = 32;

/// What tells models apart.
pub(crate) type Fingerprint = [u8; HASH];

/// The version that is written and read.
pub const STATE_VERSION: u32 = 2;

/// Collects a state.
#[derive(Debug)]
pub(crate) struct Writer(Vec<u8>);

impl Writer {
    pub fn new(model: &Fingerprint) -> Self {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(STATE_VERSION.to_le_bytes());
        bytes.extend(model);
        Self(bytes)
    }

    pub fn flag(&mut self, flag: bool) {
        self.0.push(flag.into());
    }

    pub fn double(&mut self, number: f64) {
        self.0.extend(number.to_le_bytes());
    }

    pub fn vector(&mut self, vector: DVec3) {
        for number in vector.to_array() {
            self.double(number);
        }
    }

    pub fn floats(&mut self, numbers: &[f32]) {
        self.0.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
    }

    pub fn pose(&mut self, pose: &Pose) {
        self.vector(pose.root_translation_m);
        for rotation in &pose.parent_from_joint {
            for number in rotation.to_array() {
                self.double(number);
            }
        }
    }

    pub fn finish(mut self) -> Vec<u8> {
        let checksum = Sha256::digest(&self.0);
        self.0.extend(checksum);
        self.0
    }
}

/// Reads a state whose checksum is right.
#[derive(Debug)]
pub(crate) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    pub fn new(model: &Fingerprint, bytes: &'a [u8]) -> Result<Self, RuntimeError> {
        let refused = |problem: String| Err(RuntimeError::InvalidState { problem });
        let Some((payload, checksum)) = bytes.split_last_chunk::<HASH>() else {
            return refused(format!("it has {} bytes", bytes.len()));
        };
        let mut reader = Self(payload);
        if reader.take(MAGIC.len())? != MAGIC {
            return refused("it does not begin as a saved state does".to_owned());
        }
        let version = u32::from_le_bytes(reader.chunk()?);
        if version != STATE_VERSION {
            return refused(format!("it is of version {version}, not {STATE_VERSION}"));
        }
        if Sha256::digest(payload)[..] != checksum[..] {
            return refused("its checksum is wrong, so it was changed or cut".to_owned());
        }
        if reader.take(HASH)? != model {
            return refused("it was saved with another model".to_owned());
        }
        Ok(reader)
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], RuntimeError> {
        let Some((taken, rest)) = self.0.split_at_checked(count) else {
            return Err(invalid("it ends too early"));
        };
        self.0 = rest;
        Ok(taken)
    }

    fn chunk<const N: usize>(&mut self) -> Result<[u8; N], RuntimeError> {
        let taken = self.take(N)?;
        taken.try_into().map_err(|_| invalid("it ends too early"))
    }

    pub fn flag(&mut self) -> Result<bool, RuntimeError> {
        match self.take(1)? {
            [0] => Ok(false),
            [1] => Ok(true),
            _ => Err(invalid("a flag is neither 0 nor 1")),
        }
    }

    pub fn double(&mut self) -> Result<f64, RuntimeError> {
        let number = f64::from_le_bytes(self.chunk()?);
        if number.is_finite() {
            Ok(number)
        } else {
            Err(invalid("a number is not finite"))
        }
    }

    pub fn vector(&mut self) -> Result<DVec3, RuntimeError> {
        Ok(DVec3::new(self.double()?, self.double()?, self.double()?))
    }

    pub fn floats(&mut self, count: usize) -> Result<Vec<f32>, RuntimeError> {
        let bytes = self.take(4 * count)?;
        let numbers = bytes.as_chunks::<4>().0.iter();
        let numbers: Vec<f32> = numbers.map(|bytes| f32::from_le_bytes(*bytes)).collect();
        if numbers.iter().all(|number| number.is_finite()) {
            Ok(numbers)
        } else {
            Err(invalid("a number is not finite"))
        }
    }

    pub fn pose(&mut self) -> Result<Pose, RuntimeError> {
        let mut pose = Pose::REST;
        pose.root_translation_m = self.vector()?;
        for rotation in &mut pose.parent_from_joint {
            *rotation = DQuat::from_xyzw(
                self.double()?,
                self.double()?,
                self.double()?,
                self.double()?,
            );
        }
        pose::check(&pose)?;
        Ok(pose)
    }

    pub fn finish(self) -> Result<(), RuntimeError> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err(invalid("it is longer than it should be"))
        }
    }
}

fn invalid(problem: &str) -> RuntimeError {
    RuntimeError::InvalidState {
        problem: problem.to_owned(),
    }
}
