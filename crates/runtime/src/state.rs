//! Saved states: what serde makes of them, in postcard's format, behind a header and with a checksum at
//! the end.
//!
//! ```text
//! "DYNSKINS"  8 bytes
//! version     u32, little-endian
//! model       32 bytes: SHA-256 over the hashes of the bundle's three files
//! payload     postcard (https://postcard.jamesmunns.com/wire-format)
//! checksum    32 bytes: SHA-256 of all before
//! ```

use dynaskin_skeleton::Pose;
use glam::DVec3;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::{RuntimeError, pose};

const MAGIC: &[u8; 8] = b"DYNSKINS";
const HASH: usize = 32;

/// What tells models apart.
pub(crate) type Fingerprint = [u8; HASH];

/// The version that is written and read.
pub const STATE_VERSION: u32 = 3;

/// `state` of an avatar of `model` as bytes.
pub(crate) fn to_bytes(model: &Fingerprint, state: &impl Serialize) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(STATE_VERSION.to_le_bytes());
    bytes.extend(model);
    let mut bytes = match postcard::to_extend(state, bytes) {
        Ok(bytes) => bytes,
        Err(error) => unreachable!("numbers and lists of them can be written to memory: {error}"),
    };
    let checksum = Sha256::digest(&bytes);
    bytes.extend(checksum);
    bytes
}

/// The state in `bytes`, whose numbers are not checked yet.
///
/// # Errors
/// [`RuntimeError::InvalidState`] for bytes that were changed, cut, or saved by another version or
/// with another model.
pub(crate) fn from_bytes<T: DeserializeOwned>(
    model: &Fingerprint,
    bytes: &[u8],
) -> Result<T, RuntimeError> {
    let Some((rest, checksum)) = bytes.split_last_chunk::<HASH>() else {
        return Err(invalid(format!("it has {} bytes", bytes.len())));
    };
    let (magic, rest_after_magic) = chunk(rest)?;
    if magic != MAGIC {
        return Err(invalid("it does not begin as a saved state does"));
    }
    let (version, rest_after_version) = chunk(rest_after_magic)?;
    let version = u32::from_le_bytes(*version);
    if version != STATE_VERSION {
        return Err(invalid(format!(
            "it is of version {version}, not {STATE_VERSION}"
        )));
    }
    if Sha256::digest(rest)[..] != checksum[..] {
        return Err(invalid("its checksum is wrong, so it was changed or cut"));
    }
    let (saved_with, payload) = chunk(rest_after_version)?;
    if saved_with != model {
        return Err(invalid("it was saved with another model"));
    }
    match postcard::take_from_bytes(payload) {
        Ok((state, [])) => Ok(state),
        Ok(_) => Err(invalid("it is longer than it should be")),
        Err(error) => Err(invalid(format!("its contents are not a state: {error}"))),
    }
}

fn chunk<const N: usize>(bytes: &[u8]) -> Result<(&[u8; N], &[u8]), RuntimeError> {
    let split = bytes.split_first_chunk();
    split.ok_or_else(|| invalid("it ends too early"))
}

/// Refuses a number that is not finite.
///
/// # Errors
/// [`RuntimeError::InvalidState`].
pub(crate) fn check_numbers(numbers: impl IntoIterator<Item = f64>) -> Result<(), RuntimeError> {
    if numbers.into_iter().all(f64::is_finite) {
        Ok(())
    } else {
        Err(invalid("a number is not finite"))
    }
}

/// As [`check_numbers`], for vectors.
///
/// # Errors
/// [`RuntimeError::InvalidState`].
pub(crate) fn check_vectors<'a>(
    vectors: impl IntoIterator<Item = &'a DVec3>,
) -> Result<(), RuntimeError> {
    check_numbers(vectors.into_iter().flat_map(|vector| vector.to_array()))
}

/// Largest number of a list: networks give up to 3.4e9, of which fades and responses make a thousand times as
/// much, and the length of three numbers of 1e19 overflows.
const MAX_NUMBER: f32 = 1e15;

/// Refuses a list of another length than `count`, and numbers that are not finite or too large.
///
/// # Errors
/// [`RuntimeError::InvalidState`].
pub(crate) fn check_list(list: &[f32], count: usize) -> Result<(), RuntimeError> {
    if list.len() != count {
        let got = list.len();
        return Err(invalid(format!("a list has {got} numbers, not {count}")));
    }
    // NaN is not below either.
    if list.iter().all(|number| number.abs() <= MAX_NUMBER) {
        Ok(())
    } else {
        Err(invalid(format!("a number is not below {MAX_NUMBER:e}")))
    }
}

/// Refuses poses that cannot be used.
///
/// # Errors
/// [`RuntimeError::InvalidPose`].
pub(crate) fn check_poses<'a>(
    poses: impl IntoIterator<Item = &'a Pose>,
) -> Result<(), RuntimeError> {
    poses.into_iter().try_for_each(pose::check)
}

/// The error for a state that cannot be used.
pub(crate) fn invalid(problem: impl Into<String>) -> RuntimeError {
    RuntimeError::InvalidState {
        problem: problem.into(),
    }
}
