//! What avatars of one body shape share: made once, kept while it is likely to be needed again.

use std::sync::{Arc, Mutex, PoisonError};

use dynaskin_body::SHAPE_COUNT;
use dynaskin_skeleton::JOINT_COUNT;
use glam::Vec3;

use crate::RuntimeError;
use crate::surface::RestSurface;
use crate::tissue::RestTissue;

/// Most shapes that a model remembers beyond those that avatars use.
const REMEMBERED: usize = 16;

/// A model of one shape, standing in the rest pose for good.
#[derive(Debug)]
pub(crate) struct ShapedModel {
    /// Coefficients β in standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    pub joints_rest_m: [Vec3; JOINT_COUNT],
    pub surface: RestSurface,
    /// The tissue; none without networks.
    pub tissue: Option<Arc<RestTissue>>,
}

/// The shapes of a model that were used last, the newest at the end.
#[derive(Debug, Default)]
pub(crate) struct Shapes(Mutex<Vec<Arc<ShapedModel>>>);

impl Shapes {
    /// The model of the shape `shape`, which `make` makes where it is not remembered.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn get(
        &self,
        shape: [f32; SHAPE_COUNT],
        make: impl FnOnce() -> Result<ShapedModel, RuntimeError>,
    ) -> Result<Arc<ShapedModel>, RuntimeError> {
        // A panic elsewhere cannot have left the list half changed.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = {
            let mut shapes = lock();
            let position = shapes.iter().position(|shaped| shaped.shape == shape);
            position.map(|position| shapes.remove(position))
        };
        let shaped = match found {
            Some(shaped) => shaped,
            None => Arc::new(make()?),
        };
        let mut shapes = lock();
        shapes.push(Arc::clone(&shaped));
        if shapes.len() > REMEMBERED {
            shapes.remove(0);
        }
        Ok(shaped)
    }
}
