//! Lowered files: a fused network as it is run, so that a core without tract can play it.
//!
//! ```text
//! "dynaskin-lowered"  16 bytes
//! version             u32, little-endian
//! ONNX                32 bytes: SHA-256 of the file that it was made from
//! payload             postcard (https://postcard.jamesmunns.com/wire-format)
//! checksum            32 bytes: SHA-256 of all before
//! ```

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::fused::{Fused, FusedParts};
use crate::ports::Port;
use crate::{Network, RuntimeError};

const MAGIC: &[u8; 16] = b"dynaskin-lowered";
const HASH: usize = 32;

/// The version that is written and read. A program's steps are this build's own: another order or
/// another step is another version.
pub(crate) const LOWERED_VERSION: u32 = 1;

/// A network read from a lowered file.
#[derive(Debug)]
pub(super) struct LoweredFile {
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
    pub fused: Fused,
}

#[derive(Debug, Serialize, Deserialize)]
struct Payload {
    is_decoder: bool,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    fused: FusedParts,
}

/// Whether `bytes` begin as a lowered file does.
pub(crate) fn is_lowered(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// SHA-256 of the ONNX file that a lowered file was made from; none for other files.
pub(crate) fn onnx_sha256(bytes: &[u8]) -> Option<&[u8; HASH]> {
    let rest = bytes.strip_prefix(MAGIC)?;
    rest.get(size_of::<u32>()..)?.first_chunk()
}

/// `fused`, made from an ONNX file of this hash, as a file.
#[cfg(feature = "tract")]
pub(super) fn to_bytes(
    network: Network,
    onnx_sha256: [u8; HASH],
    ports: (Vec<Port>, Vec<Port>),
    fused: &Fused,
) -> Vec<u8> {
    let payload = Payload {
        is_decoder: network == Network::Decoder,
        inputs: ports.0,
        outputs: ports.1,
        fused: FusedParts::of(fused),
    };
    let mut bytes = MAGIC.to_vec();
    bytes.extend(LOWERED_VERSION.to_le_bytes());
    bytes.extend(onnx_sha256);
    let mut bytes = match postcard::to_extend(&payload, bytes) {
        Ok(bytes) => bytes,
        Err(error) => unreachable!("numbers and lists of them can be written to memory: {error}"),
    };
    let checksum = Sha256::digest(&bytes);
    bytes.extend(checksum);
    bytes
}

/// The network in `bytes`.
///
/// # Errors
/// [`RuntimeError::NotLowered`].
pub(super) fn from_bytes(network: Network, bytes: &[u8]) -> Result<LoweredFile, RuntimeError> {
    let refused = |reason: &str| RuntimeError::NotLowered {
        network,
        reason: reason.to_owned(),
    };
    let cut = || refused("it is cut");
    let (rest, checksum) = bytes.split_last_chunk::<HASH>().ok_or_else(cut)?;
    let after = rest.strip_prefix(MAGIC).ok_or_else(cut)?;
    let (version, after) = after.split_first_chunk().ok_or_else(cut)?;
    let version = u32::from_le_bytes(*version);
    if version != LOWERED_VERSION {
        let reason = format!("its version is {version}, this build reads {LOWERED_VERSION}");
        return Err(refused(&reason));
    }
    if Sha256::digest(rest).as_slice() != checksum {
        return Err(refused("it was changed or cut"));
    }
    let payload = after.get(HASH..).ok_or_else(cut)?;
    let read = postcard::take_from_bytes::<Payload>(payload);
    let (payload, []) = read.map_err(|error| refused(&error.to_string()))? else {
        return Err(refused("something follows its contents"));
    };
    if payload.is_decoder != (network == Network::Decoder) {
        return Err(refused("it is the bundle's other network"));
    }
    let widths = |ports: &[Port]| -> Option<Vec<usize>> {
        let width = |port: &Port| {
            let mut lengths = port.shape.iter();
            lengths.try_fold(1_usize, |width, length| width.checked_mul(*length))
        };
        ports.iter().map(width).collect()
    };
    let (Some(inputs), Some(outputs)) = (widths(&payload.inputs), widths(&payload.outputs)) else {
        return Err(refused("a port is too large"));
    };
    let fused = payload.fused.fused(&inputs, &outputs);
    Ok(LoweredFile {
        fused: fused.map_err(refused)?,
        inputs: payload.inputs,
        outputs: payload.outputs,
    })
}
