//! What avatars of one body share: the body, its networks and what follows from its topology.

use std::sync::{Arc, OnceLock};

use dynaskin_body::{BodyModel, REGION_COUNT, SHAPE_COUNT};

use crate::RuntimeError;
use crate::bundle::{Bundle, field};
use crate::controls::Controls;
use crate::features::{FeatureKind, Materials};
use crate::figure::{Figure, Figures};
use crate::onnx::{Decoder, Predictor};
use crate::response::{self, Mode};
use crate::surface::{OFFSET_LIMIT_M, Topology, VertexControls};

/// A body and, once loaded, the networks that move its soft tissue. Immutable; avatars share it
/// through an [`Arc`].
#[derive(Debug)]
pub struct Model {
    body: Arc<BodyModel>,
    networks: Option<Networks>,
    topology: Topology,
    soft_vertices: Vec<u32>,
    /// Measured when first needed.
    modes: OnceLock<[Mode; REGION_COUNT]>,
    figures: Figures,
}

#[derive(Debug)]
pub(crate) struct Networks {
    pub bundle: Bundle,
    pub predictor: Arc<Predictor>,
    pub decoder: Decoder,
}

impl Model {
    /// Loads a bundle: `bundle_json` and, through `read`, the files it names (given the bare file
    /// name, it returns the contents or a sentence about why not).
    ///
    /// # Errors
    /// Those of [`Bundle::from_json`]; [`RuntimeError::ReadFile`], [`RuntimeError::HashMismatch`],
    /// [`RuntimeError::Body`]; those of [`Self::from_parts`].
    pub fn load(
        bundle_json: &[u8],
        read: &mut dyn FnMut(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Self, RuntimeError> {
        let bundle = Bundle::from_json(bundle_json)?;
        let mut contents = |file: &str| {
            read(file).map_err(|reason| RuntimeError::ReadFile {
                file: file.to_owned(),
                reason,
            })
        };
        let body_glb = contents(&bundle.body.file)?;
        let predictor_onnx = contents(&bundle.predictor.file)?;
        let decoder_onnx = contents(&bundle.decoder.file)?;
        bundle.body.verify(&body_glb)?;
        let body = BodyModel::from_glb(&body_glb)?;
        Self::from_parts(bundle, Arc::new(body), &predictor_onnx, &decoder_onnx)
    }

    /// Puts a bundle together with the body it was made for (already read and verified) and the
    /// bytes of its networks.
    ///
    /// # Errors
    /// [`RuntimeError::HashMismatch`] for the networks; [`RuntimeError::NotOnnx`],
    /// [`RuntimeError::UnknownOperator`], [`RuntimeError::InvalidGraph`],
    /// [`RuntimeError::BrokenContract`], [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]
    /// for what is wrong with them; [`RuntimeError::BundleField`] where counts do not agree.
    pub fn from_parts(
        bundle: Bundle,
        body: Arc<BodyModel>,
        predictor_onnx: &[u8],
        decoder_onnx: &[u8],
    ) -> Result<Self, RuntimeError> {
        bundle.predictor.verify(predictor_onnx)?;
        bundle.decoder.verify(decoder_onnx)?;
        let vertex_count = body.vertex_count();
        if let Some(&last) = bundle.vertices.last()
            && last as usize >= vertex_count
        {
            let expected = format!("indices below the body's {vertex_count} vertices");
            return Err(field("vertices", expected, last));
        }
        let predictor = Predictor::load(predictor_onnx)?;
        let decoder = Decoder::load(decoder_onnx)?;
        let counts = [
            (
                "feature_count",
                predictor.feature_count(),
                bundle.feature_count,
            ),
            (
                "latent_count",
                predictor.latent_count(),
                bundle.latent_count,
            ),
            ("latent_count", decoder.latent_count(), bundle.latent_count),
            ("vertices", decoder.vertex_count(), bundle.vertices.len()),
        ];
        for (name, expected, got) in counts {
            if expected != got {
                return Err(field(name, expected, got));
            }
        }
        let soft_vertices = bundle.vertices.clone();
        Ok(Self {
            topology: Topology::new(&body, &soft_vertices),
            body,
            networks: Some(Networks {
                bundle,
                predictor: Arc::new(predictor),
                decoder,
            }),
            soft_vertices,
            modes: OnceLock::new(),
            figures: Figures::default(),
        })
    }

    /// A body without networks: its avatars are plainly skinned.
    pub fn body_only(body: Arc<BodyModel>) -> Self {
        Self {
            topology: Topology::new(&body, &[]),
            body,
            networks: None,
            soft_vertices: Vec::new(),
            modes: OnceLock::new(),
            figures: Figures::default(),
        }
    }

    /// The body.
    pub fn body(&self) -> &BodyModel {
        &self.body
    }

    /// The bundle, where there are networks.
    pub fn bundle(&self) -> Option<&Bundle> {
        self.networks.as_ref().map(|networks| &networks.bundle)
    }

    /// Indices of the vertices that the networks move, ascending.
    pub fn soft_vertices(&self) -> &[u32] {
        &self.soft_vertices
    }

    pub(crate) fn networks(&self) -> Option<&Networks> {
        self.networks.as_ref()
    }

    pub(crate) fn topology(&self) -> &Topology {
        &self.topology
    }

    /// What avatars of the shape `shape` share.
    pub(crate) fn figure(&self, shape: [f32; SHAPE_COUNT]) -> Result<Arc<Figure>, RuntimeError> {
        self.figures.get(self, shape)
    }

    /// What the networks take as input; `inertial` where there are none.
    pub(crate) fn feature_kind(&self) -> FeatureKind {
        self.networks
            .as_ref()
            .map_or(FeatureKind::Inertial, |networks| {
                networks.bundle.feature_kind
            })
    }

    /// How the regions swing by themselves when they are made of `materials`.
    pub(crate) fn modes_of(
        &self,
        materials: &Materials,
    ) -> Result<[Mode; REGION_COUNT], RuntimeError> {
        let modes = self.modes()?;
        Ok(std::array::from_fn(|region| {
            modes[region].of_material(materials.stiffness[region], materials.damping[region])
        }))
    }

    /// How the regions swing by themselves when they are made of the usual tissue.
    fn modes(&self) -> Result<&[Mode; REGION_COUNT], RuntimeError> {
        if let Some(modes) = self.modes.get() {
            return Ok(modes);
        }
        let modes = response::modes(self)?;
        Ok(self.modes.get_or_init(|| modes))
    }

    /// Gain and limit of each soft vertex under `controls`: the regions' means weighted by the
    /// vertex's membership. A vertex outside all regions is bone-like and gets 0; where the body
    /// knows no regions, all get the strength alone.
    pub(crate) fn vertex_controls(&self, controls: &Controls, target: &mut [VertexControls]) {
        if self.body.region_weights.len() != REGION_COUNT {
            target.fill(VertexControls {
                gain: controls.strength,
                limit_m: OFFSET_LIMIT_M,
            });
            return;
        }
        for (target, &vertex) in target.iter_mut().zip(&self.soft_vertices) {
            let (mut sum, mut gain, mut limit_m) = (0.0, 0.0, 0.0);
            for (weights, region) in self.body.region_weights.iter().zip(&controls.regions) {
                let weight = weights[vertex as usize];
                sum += weight;
                gain += weight * region.gain * controls.strength;
                limit_m += weight * region.limit_m;
            }
            *target = if sum > 1e-6 {
                VertexControls {
                    gain: gain / sum,
                    limit_m: limit_m / sum,
                }
            } else {
                VertexControls::NONE
            };
        }
    }
}
