//! JavaScript bindings of body, motion and runtime: no algorithm, only conversions.
//!
//! Arrays that change every frame stay in WebAssembly memory, where JavaScript reads them through
//! the pointers that the `...Ptr` methods give; the pointers stay good for as long as their avatar
//! lives. Errors are thrown as an `Error` with a `code`. The SDK (`web/sdk`) wraps these classes
//! and is what applications use.

mod avatar;
mod error;
mod model;
mod motion;
mod pose;

pub use avatar::CoreAvatar;
pub use model::{CoreBody, CoreModel};
pub use motion::CoreMotion;
