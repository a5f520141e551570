//! What can go wrong while drawing.

use dynaskin_decoding::DecodingError;
use thiserror::Error;

/// Why a call of this library was refused or failed.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RenderError {
    /// No graphics adapter answered.
    #[error(
        "no usable graphics adapter: {reason}; update the graphics driver or turn on hardware acceleration"
    )]
    NoAdapter {
        /// What the system said.
        reason: String,
    },
    /// The adapter refused a device.
    #[error("the graphics adapter {adapter:?} gave no device: {reason}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What the system said.
        reason: String,
    },
    /// The canvas or window cannot be drawn to with this adapter.
    #[error("cannot draw to this canvas or window: {reason}")]
    Surface {
        /// What does not fit.
        reason: String,
    },
    /// The canvas or window went away; make a new renderer.
    #[error("the canvas or window was lost; make a new renderer for it")]
    SurfaceLost,
    /// The graphics device went away; make a new renderer.
    #[error("the graphics device was lost ({reason}); make a new renderer")]
    DeviceLost {
        /// What the system said.
        reason: String,
    },
    /// The graphics device refused an operation.
    #[error("the graphics device reported an error: {message}")]
    Device {
        /// The device's message.
        message: String,
    },
    /// An array has the wrong length.
    #[error("{what} has {got} values, expected {expected}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its required number of values.
        expected: usize,
        /// Its number of values.
        got: usize,
    },
    /// An array holds NaN or an infinity.
    #[error("{what} holds {value} at index {index}; every number must be finite")]
    NonFinite {
        /// Which array.
        what: &'static str,
        /// Index of the first such value.
        index: usize,
        /// The value.
        value: f32,
    },
    /// A value lies outside its range.
    #[error("{what} is {value} at index {index}, expected {expected}")]
    OutOfRange {
        /// Which setting or array.
        what: &'static str,
        /// Index in the array; 0 for a single setting.
        index: usize,
        /// The value.
        value: f64,
        /// The range in words.
        expected: String,
    },
    /// A body has more vertices or faces than the device's buffers take.
    #[error("the body's {what} needs {needed_bytes} bytes, the device takes {limit_bytes} at most")]
    TooLarge {
        /// Which buffer.
        what: &'static str,
        /// Its size.
        needed_bytes: u64,
        /// The device's limit.
        limit_bytes: u64,
    },
    /// No body has this id (it was removed, or belongs to another renderer).
    #[error("no body has the id {id}; use the id that add_body returned")]
    UnknownBody {
        /// The id asked for.
        id: u32,
    },
    /// No decoder has this id, or it belongs to another renderer.
    #[error("no decoder has the id {id}; use the id that add_decoder returned")]
    UnknownDecoder {
        /// The id asked for.
        id: u32,
    },
    /// The card cannot write to textures of 32-bit floats (WebGL2 without `EXT_color_buffer_float`).
    #[error("this graphics card cannot decode; decode on the CPU instead")]
    DecodingUnsupported,
    /// The body is not decoded on the card.
    #[error("the body {id} is not decoded on the card; call decode_body first")]
    NotDecoded {
        /// Its id.
        id: u32,
    },
    /// Clothes that span hollows are made from positions on the CPU.
    #[error("the body {id} is draped, for which its surface is needed; use set_surface")]
    DrapedDecoding {
        /// Its id.
        id: u32,
    },
    /// Reading skinned positions back needs compute shaders, which WebGL2 lacks.
    #[error(
        "skinned positions can only be read back where the GPU has compute shaders (WebGPU); skin on the CPU instead"
    )]
    ReadBackUnsupported,
    /// Pixels can only be read from an offscreen renderer.
    #[error("pixels can only be read from an offscreen renderer")]
    NotOffscreen,
}

impl RenderError {
    /// What was refused before it came to the card. No `From`: closures would no longer know their error.
    pub(crate) fn refused(error: DecodingError) -> Self {
        match error {
            DecodingError::WrongLength {
                what,
                expected,
                got,
            } => Self::WrongLength {
                what,
                expected,
                got,
            },
            DecodingError::NonFinite { what, index, value } => {
                Self::NonFinite { what, index, value }
            }
            DecodingError::OutOfRange {
                what,
                index,
                value,
                expected,
            } => Self::OutOfRange {
                what,
                index,
                value: value.into(),
                expected,
            },
        }
    }
}
