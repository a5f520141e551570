//! JavaScript bindings of body, binding, motion and runtime: no algorithm, only conversions.
//!
//! Arrays that change every frame stay in WebAssembly memory, where JavaScript reads them through
//! the pointers that the `...Ptr` methods return; the pointers stay valid as long as their avatar
//! lives. Errors are thrown as an `Error` with a `code`. The SDK (`web/sdk`) wraps these classes;
//! applications use the SDK.

mod avatar;
mod controls;
mod crowd;
mod error;
mod model;
mod motion;
mod pose;
mod puppet;
mod tissue;

use wasm_bindgen::prelude::*;

pub use avatar::CoreAvatar;
pub use crowd::CoreCrowd;
pub use model::{CoreBody, CoreModel};
pub use motion::CoreMotion;
pub use puppet::CorePuppet;
pub use tissue::{CoreBinding, CoreTissue};

/// Version of these bindings, which the SDK compares with its own.
#[wasm_bindgen(js_name = coreVersion)]
pub fn core_version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
