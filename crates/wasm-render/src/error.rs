//! Errors as JavaScript sees them.

use dynaskin_render::RenderError;
use wasm_bindgen::JsValue;

/// An `Error` with the message and a `code`.
pub(crate) fn js_error(code: &str, message: &str) -> JsValue {
    let error = js_sys::Error::new(message);
    // Setting a property of a fresh, extensible object cannot fail.
    let _ = js_sys::Reflect::set(&error, &"code".into(), &code.into());
    error.into()
}

/// The library's error; its code says what a page can do about it.
pub(crate) fn from_render(error: RenderError) -> JsValue {
    let code = match &error {
        RenderError::NoAdapter { .. }
        | RenderError::NoDevice { .. }
        | RenderError::Surface { .. } => "no-adapter",
        RenderError::SurfaceLost | RenderError::DeviceLost { .. } => "lost",
        RenderError::ReadBackUnsupported | RenderError::NotDecoded { .. } => "no-read-back",
        RenderError::WrongLength { .. }
        | RenderError::NonFinite { .. }
        | RenderError::OutOfRange { .. }
        | RenderError::TooLarge { .. }
        | RenderError::UnknownBody { .. }
        | RenderError::UnknownDecoder { .. }
        | RenderError::DrapedDecoding { .. } => "argument",
        _ => "gpu",
    };
    js_error(code, &error.to_string())
}
