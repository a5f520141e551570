//! Rust errors as JavaScript errors.

use dynaskin_body::{BodyError, FigureError, REGION_COUNT};
use dynaskin_motion::MotionError;
use dynaskin_runtime::RuntimeError;
use js_sys::{Error, Reflect};
use wasm_bindgen::JsValue;

/// A JavaScript `Error` with a `code`, on its way to be thrown.
pub(crate) struct Thrown {
    code: &'static str,
    message: String,
}

impl Thrown {
    /// An error with a code of its own.
    pub fn new(code: &'static str, message: String) -> Self {
        Self { code, message }
    }

    /// An argument that the caller got wrong.
    pub fn argument(message: String) -> Self {
        Self {
            code: "argument",
            message,
        }
    }

    /// A motion that cannot be used.
    pub fn motion(message: String) -> Self {
        Self {
            code: "motion",
            message,
        }
    }
}

impl From<Thrown> for JsValue {
    fn from(thrown: Thrown) -> Self {
        let error = Error::new(&thrown.message);
        // Setting a property of a fresh object cannot fail; if it did, the message still says it.
        let _ = Reflect::set(&error, &"code".into(), &thrown.code.into());
        error.into()
    }
}

impl From<RuntimeError> for Thrown {
    fn from(error: RuntimeError) -> Self {
        Self {
            code: error.code(),
            message: error.to_string(),
        }
    }
}

impl From<BodyError> for Thrown {
    fn from(error: BodyError) -> Self {
        RuntimeError::from(error).into()
    }
}

impl From<FigureError> for Thrown {
    fn from(error: FigureError) -> Self {
        Self {
            code: "shape",
            message: error.to_string(),
        }
    }
}

impl From<MotionError> for Thrown {
    fn from(error: MotionError) -> Self {
        Self {
            code: "motion",
            message: error.to_string(),
        }
    }
}

/// The error for a region that does not exist.
pub(crate) fn no_region(region: usize) -> Thrown {
    Thrown::argument(format!(
        "There is no region {region}; they are numbered 0 to {}.",
        REGION_COUNT - 1
    ))
}
