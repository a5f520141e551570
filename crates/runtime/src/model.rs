//! What avatars of one body share: the body, its networks and what follows from its topology.

use std::sync::{Arc, OnceLock};

use dynaskin_body::{BodyModel, Materials, PoseCorrectives, REGION_COUNT, SHAPE_COUNT};
use dynaskin_skeleton::{JOINT_COUNT, Pose};
use glam::Vec3;
use sha2::{Digest, Sha256};

use crate::bundle::{Bundle, BundleFile, Learned, field, hex};
use crate::controls::Shares;
use crate::features::{FeatureKind, MotionFeatures};
use crate::measure;
use crate::networks::{
    Decoder, LinearDecoder, Networks, Predictor, Sessions, is_lowered, onnx_sha256,
};
use crate::shapes::{ShapedModel, Shapes};
use crate::state::Fingerprint;
use crate::surface::{Guard, RestSurface, Topology};
use crate::tissue::{Filters, Mode, RestTissue};
use crate::{Network, RuntimeError};

/// A body and, once loaded, the networks that move its soft tissue. Immutable; avatars share it
/// through an [`Arc`].
#[derive(Debug)]
pub struct Model {
    body: Arc<BodyModel>,
    /// None where the body is plainly skinned.
    soft: Option<SoftModel>,
    topology: Topology,
    /// Made with the first avatar that asks for it.
    guard: OnceLock<Guard>,
    /// Made with the first avatar; none where the body has none.
    pose_correctives: OnceLock<Option<Arc<PoseCorrectives>>>,
    shapes: Shapes,
}

/// What moves the soft tissue of a model.
#[derive(Debug)]
pub(crate) struct SoftModel {
    pub networks: Networks,
    /// How the regions swing by themselves when they are made of the usual tissue; measured when
    /// first needed.
    modes: OnceLock<[Mode; REGION_COUNT]>,
}

impl Model {
    /// Loads a bundle: `bundle_json` and, through `read`, the files it names. `read` takes the bare file
    /// name and returns the contents, or the reason of a failure in words. Without the feature `tract`, the
    /// networks are the lowered ones.
    ///
    /// # Errors
    /// Those of [`Bundle::from_json`]; [`RuntimeError::NoLowered`]; [`RuntimeError::ReadFile`], [`RuntimeError::HashMismatch`],
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
        let [predictor, decoder] = network_files(&bundle)?;
        let body_glb = contents(&bundle.body.file)?;
        let predictor = contents(&predictor.file)?;
        let decoder = contents(&decoder.file)?;
        bundle.body.verify(&body_glb)?;
        let body = BodyModel::from_glb(&body_glb)?;
        Self::from_parts(bundle, Arc::new(body), &predictor, &decoder)
    }

    /// Builds a model from a bundle, the body it was made for (already read and verified) and the
    /// bytes of its networks, each as an ONNX or a lowered file.
    ///
    /// # Errors
    /// [`RuntimeError::HashMismatch`] for the networks; [`RuntimeError::NotOnnx`],
    /// [`RuntimeError::UnknownOperator`], [`RuntimeError::InvalidGraph`],
    /// [`RuntimeError::BrokenContract`], [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]
    /// for what is wrong with them; [`RuntimeError::NotLowered`], [`RuntimeError::NoLowered`] for
    /// lowered files that are broken or that the bundle does not name;
    /// [`RuntimeError::NeedsLowered`] for ONNX without the feature `tract`; [`RuntimeError::LeftOut`] for a convolution in a build without
    /// the feature `guests`; [`RuntimeError::BundleField`] where counts do not agree.
    pub fn from_parts(
        bundle: Bundle,
        body: Arc<BodyModel>,
        predictor: &[u8],
        decoder: &[u8],
    ) -> Result<Self, RuntimeError> {
        bundle.check()?;
        verify_network(&bundle, Network::Predictor, predictor)?;
        verify_network(&bundle, Network::Decoder, decoder)?;
        let vertex_count = body.vertex_count();
        if let Some(&last) = bundle.vertices.last()
            && last as usize >= vertex_count
        {
            let expected = format!("indices below the body's {vertex_count} vertices");
            return Err(field("vertices", expected, last));
        }
        let conditions = bundle.feature_kind.condition_count();
        let predictor = Predictor::load_conditioned(predictor, conditions)?;
        let decoder = Decoder::load(decoder)?;
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
        Ok(Self {
            topology: Topology::new(&body, &bundle.vertices),
            guard: OnceLock::new(),
            pose_correctives: OnceLock::new(),
            body,
            soft: Some(SoftModel {
                networks: Networks {
                    bundle,
                    predictor: Arc::new(predictor),
                    decoder,
                },
                modes: OnceLock::new(),
            }),
            shapes: Shapes::default(),
        })
    }

    /// A body without networks: its avatars use plain skinning.
    pub fn body_only(body: Arc<BodyModel>) -> Self {
        Self {
            topology: Topology::new(&body, &[]),
            guard: OnceLock::new(),
            pose_correctives: OnceLock::new(),
            body,
            soft: None,
            shapes: Shapes::default(),
        }
    }

    /// The body.
    pub fn body(&self) -> &BodyModel {
        &self.body
    }

    /// The bundle, if there are networks.
    pub fn bundle(&self) -> Option<&Bundle> {
        self.soft.as_ref().map(|soft| &soft.networks.bundle)
    }

    /// Indices of the vertices that the networks move, ascending; empty without networks.
    pub fn soft_vertices(&self) -> &[u32] {
        self.bundle().map_or(&[], |bundle| &bundle.vertices)
    }

    /// The decoder as one matrix over [`Self::soft_vertices`], for those who decode by themselves
    /// ([`crate::Decoding::OnDemand`]). None without networks, for a decoder that is anything else than a product
    /// with a matrix, and for a body with pose correctives, whose surface the pose changes as well.
    pub fn linear_decoder(&self) -> Option<&LinearDecoder> {
        let corrects = !self.body.pose_dirs_m.is_empty();
        let soft = self.soft.as_ref().filter(|_| !corrects)?;
        soft.networks.decoder.linear()
    }

    /// What moves the soft tissue; none where the body is plainly skinned.
    pub(crate) fn soft(&self) -> Option<&SoftModel> {
        self.soft.as_ref()
    }

    /// The edges of its soft skin.
    pub(crate) fn guard(&self) -> &Guard {
        self.guard.get_or_init(|| {
            let mut soft = vec![false; self.body.vertex_count()];
            for &vertex in self.soft_vertices() {
                soft[vertex as usize] = true;
            }
            Guard::new(&self.body.faces, &soft)
        })
    }

    /// The body's pose correctives as avatars add them; none where it has none.
    pub(crate) fn pose_correctives(&self) -> Option<&Arc<PoseCorrectives>> {
        self.pose_correctives
            .get_or_init(|| PoseCorrectives::new(&self.body).map(Arc::new))
            .as_ref()
    }

    pub(crate) fn topology(&self) -> &Topology {
        &self.topology
    }

    /// What tells models apart: the hashes of their files; without networks, the body's size.
    pub(crate) fn fingerprint(&self) -> Fingerprint {
        let mut hash = Sha256::new();
        if let Some(bundle) = self.bundle() {
            for file in [&bundle.body, &bundle.predictor, &bundle.decoder] {
                hash.update(file.sha256.as_bytes());
            }
        } else {
            hash.update((self.body.vertex_count() as u64).to_le_bytes());
        }
        hash.finalize().into()
    }

    /// What avatars of the shape `shape` share.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`] from running the networks at rest.
    pub(crate) fn shaped(
        &self,
        shape: [f32; SHAPE_COUNT],
    ) -> Result<Arc<ShapedModel>, RuntimeError> {
        self.shapes.get(shape, || {
            let shaped = self.body.shaped(&shape);
            let joints_rest_m = shaped.joints_m;
            let tissue = match &self.soft {
                Some(soft) => Some(Arc::new(soft.at_rest(joints_rest_m, shape)?)),
                None => None,
            };
            Ok(ShapedModel {
                shape,
                joints_rest_m,
                surface: RestSurface::new(&self.topology, shaped.positions_m),
                tissue,
            })
        })
    }
}

/// The files of a bundle's networks that this build plays.
fn network_files(bundle: &Bundle) -> Result<[&BundleFile; 2], RuntimeError> {
    if cfg!(feature = "tract") {
        return Ok([&bundle.predictor, &bundle.decoder]);
    }
    let lowered = bundle.lowered.as_ref().ok_or(RuntimeError::NoLowered)?;
    Ok([&lowered.predictor, &lowered.decoder])
}

/// Whether `contents` are the bundle's file of `network`, in either form.
fn verify_network(bundle: &Bundle, network: Network, contents: &[u8]) -> Result<(), RuntimeError> {
    let of = |predictor, decoder| match network {
        Network::Predictor => predictor,
        Network::Decoder => decoder,
    };
    let onnx: &BundleFile = of(&bundle.predictor, &bundle.decoder);
    if !is_lowered(contents) {
        return onnx.verify(contents);
    }
    let lowered = bundle.lowered.as_ref().ok_or(RuntimeError::NoLowered)?;
    of(&lowered.predictor, &lowered.decoder).verify(contents)?;
    match onnx_sha256(contents) {
        Some(hash) if hex(hash) == onnx.sha256 => Ok(()),
        _ => Err(RuntimeError::NotLowered {
            network,
            reason: format!("it was made from another `{}`", onnx.file),
        }),
    }
}

impl SoftModel {
    /// What the networks take as input.
    pub fn feature_kind(&self) -> FeatureKind {
        self.networks.bundle.feature_kind
    }

    /// What the networks learned from.
    pub fn learned(&self) -> &Learned {
        &self.networks.bundle.learned
    }

    fn at_rest(
        &self,
        joints_rest_m: [Vec3; JOINT_COUNT],
        shape: [f32; SHAPE_COUNT],
    ) -> Result<RestTissue, RuntimeError> {
        let mut features = MotionFeatures::new(self.feature_kind(), &joints_rest_m, &shape);
        let rest = Sessions::new(&self.networks)?.at_rest(features.push(&Pose::REST))?;
        Ok(RestTissue {
            shape,
            joints_rest_m,
            state: rest.state.into_numbers(),
            latent: rest.latent,
            offsets_m: rest.offsets_m,
        })
    }

    /// The filters after the networks that do what `shares` leaves to them, on `body`; none where
    /// nothing is left.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`] from measuring how regions swing.
    pub fn filters(
        &self,
        body: &BodyModel,
        shares: &Shares,
    ) -> Result<Option<Filters>, RuntimeError> {
        if shares.are_predicted() {
            return Ok(None);
        }
        let modes = self.modes_of(body, &shares.materials)?;
        Ok(Some(Filters::new(
            &self.networks.bundle.vertices,
            &body.region_weights,
            &modes,
            &shares.left,
        )))
    }

    /// How the regions swing by themselves when they are made of `materials`.
    fn modes_of(
        &self,
        body: &BodyModel,
        materials: &Materials,
    ) -> Result<[Mode; REGION_COUNT], RuntimeError> {
        let usual = match self.modes.get() {
            Some(modes) => modes,
            None => {
                let modes = measure::modes(body, &self.networks)?;
                self.modes.get_or_init(|| modes)
            }
        };
        Ok(std::array::from_fn(|region| {
            usual[region].of_material(materials.stiffness[region], materials.damping[region])
        }))
    }
}
