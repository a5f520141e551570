//! What avatars of one body shape share: made once, kept while it is likely to be needed again.

use std::sync::{Arc, Mutex, PoisonError};

use dynaskin_body::{JOINT_COUNT, Pose, SHAPE_COUNT};
use glam::Vec3;

use crate::RuntimeError;
use crate::engine::Engine;
use crate::features::MotionFeatures;
use crate::model::Model;
use crate::onnx::PredictorState;
use crate::tissue::settled;

/// Most shapes that a model remembers beyond those that avatars use.
const REMEMBERED: usize = 16;

/// A body of one shape, standing in the rest pose for good.
#[derive(Debug)]
pub(crate) struct Figure {
    /// Coefficients β in standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    pub joints_rest_m: [Vec3; JOINT_COUNT],
    /// Positions without offsets, in metres.
    pub positions_m: Vec<Vec3>,
    /// Sums over the faces that no soft vertex moves of area-weighted normals, per vertex.
    pub still_normals: Vec<Vec3>,
    /// Unit normals without offsets.
    pub normals: Vec<Vec3>,
    /// The tissue; none without networks.
    pub rest: Option<RestTissue>,
}

/// Tissue that has come to rest.
#[derive(Debug)]
pub(crate) struct RestTissue {
    pub state: PredictorState,
    pub latent: Vec<f32>,
    /// What the networks put out. The surface there is the plainly skinned one by definition, so
    /// this is their error, and is taken away. Three numbers a soft vertex, in metres.
    pub offsets_m: Vec<f32>,
}

impl Figure {
    fn new(model: &Model, shape: [f32; SHAPE_COUNT]) -> Result<Self, RuntimeError> {
        let shaped = model.body().shaped(&shape);
        let rest = match model.networks() {
            Some(networks) => {
                let mut engine = Engine::new(networks)?;
                let mut features =
                    MotionFeatures::new(model.feature_kind(), &shaped.joints_m, &shape);
                let standing = features.push(&Pose::REST);
                let mut latent = vec![0.0; networks.bundle.latent_count];
                let state = settled(&mut engine.predictor, standing, &mut latent)?;
                let mut offsets_m = vec![0.0; 3 * networks.bundle.vertices.len()];
                engine.decoder.decode(&latent, &mut offsets_m)?;
                Some(RestTissue {
                    state,
                    latent,
                    offsets_m,
                })
            }
            None => None,
        };
        let (still_normals, normals) = model.topology().still_normals(&shaped.positions_m);
        Ok(Self {
            shape,
            joints_rest_m: shaped.joints_m,
            positions_m: shaped.positions_m,
            still_normals,
            normals,
            rest,
        })
    }
}

/// The figures of a model that were used last, the newest at the end.
#[derive(Debug, Default)]
pub(crate) struct Figures(Mutex<Vec<Arc<Figure>>>);

impl Figures {
    /// The figure of `shape`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`] from running the networks at rest.
    pub fn get(
        &self,
        model: &Model,
        shape: [f32; SHAPE_COUNT],
    ) -> Result<Arc<Figure>, RuntimeError> {
        // A panic elsewhere cannot have left the list half changed.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = {
            let mut figures = lock();
            let position = figures.iter().position(|figure| figure.shape == shape);
            position.map(|position| figures.remove(position))
        };
        let figure = match found {
            Some(figure) => figure,
            None => Arc::new(Figure::new(model, shape)?),
        };
        let mut figures = lock();
        figures.push(Arc::clone(&figure));
        if figures.len() > REMEMBERED {
            figures.remove(0);
        }
        Ok(figure)
    }
}
