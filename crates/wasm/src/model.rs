//! Bodies and models.

use std::sync::Arc;

use dynaskin_body::{BodyModel, REGION_COUNT, Trait};
use dynaskin_runtime::{Bundle, BundleFile, Model};
use wasm_bindgen::prelude::*;

use crate::avatar::CoreAvatar;
use crate::error::{Thrown, no_region};

/// A body without networks.
#[wasm_bindgen]
pub struct CoreBody {
    pub(crate) body: Arc<BodyModel>,
    model: Arc<Model>,
    traits: Arc<[Trait]>,
}

#[wasm_bindgen]
impl CoreBody {
    /// Reads `bundle.json` and the body file it names.
    ///
    /// # Errors
    /// Throws for a bundle or a body that cannot be used, and for a body that is not the bundle's.
    #[wasm_bindgen(constructor)]
    pub fn new(bundle_json: &[u8], body_glb: &[u8]) -> Result<CoreBody, JsValue> {
        Ok(Self::read(bundle_json, body_glb)?)
    }

    fn read(bundle_json: &[u8], body_glb: &[u8]) -> Result<Self, Thrown> {
        let bundle = Bundle::from_json(bundle_json)?;
        bundle.body.verify(body_glb)?;
        let body = Arc::new(BodyModel::from_glb(body_glb)?);
        Ok(Self {
            model: Arc::new(Model::body_only(Arc::clone(&body))),
            body,
            traits: bundle.traits.into(),
        })
    }

    /// Reads a body file that no bundle names.
    ///
    /// # Errors
    /// Throws for a body that cannot be used.
    #[wasm_bindgen(js_name = fromFile)]
    pub fn from_file(body_glb: &[u8]) -> Result<CoreBody, JsValue> {
        let body = BodyModel::from_glb(body_glb).map_err(Thrown::from)?;
        let body = Arc::new(body);
        Ok(Self {
            model: Arc::new(Model::body_only(Arc::clone(&body))),
            body,
            traits: Arc::from([]),
        })
    }

    /// SHA-256 of a body's file in hexadecimal, as bundles name it.
    #[wasm_bindgen(js_name = hashOf)]
    pub fn hash_of(body_glb: &[u8]) -> String {
        BundleFile::of("body.glb", body_glb).sha256
    }

    /// Number of vertices.
    #[wasm_bindgen(getter, js_name = vertexCount)]
    pub fn vertex_count(&self) -> usize {
        self.body.vertex_count()
    }

    /// Triangles, `[face][3]`.
    pub fn faces(&self) -> Vec<u32> {
        self.body.faces.iter().flatten().copied().collect()
    }

    /// Joints of each vertex, `[vertex][4]`.
    #[wasm_bindgen(js_name = skinJoints)]
    pub fn skin_joints(&self) -> Vec<u8> {
        self.body.skin.iter().flat_map(|s| s.joints).collect()
    }

    /// Weights of those joints, `[vertex][4]`.
    #[wasm_bindgen(js_name = skinWeights)]
    pub fn skin_weights(&self) -> Vec<f32> {
        self.body.skin.iter().flat_map(|s| s.weights).collect()
    }

    /// sRGB and opacity, `[vertex][4]`; empty where the body has no colours.
    pub fn colors(&self) -> Vec<u8> {
        self.body.colors_srgba.iter().flatten().copied().collect()
    }

    /// Membership of each vertex in the region number `region`, 0..=1; zeros where the body knows
    /// no regions.
    ///
    /// # Errors
    /// Throws `argument` for a number that is no region.
    #[wasm_bindgen(js_name = regionWeights)]
    pub fn region_weights(&self, region: usize) -> Result<Vec<f32>, JsValue> {
        if region >= REGION_COUNT {
            return Err(no_region(region).into());
        }
        let weights = self.body.region_weights.get(region).cloned();
        Ok(weights.unwrap_or_else(|| vec![0.0; self.body.vertex_count()]))
    }

    /// An avatar that is plainly skinned.
    ///
    /// # Errors
    /// Throws `shape`.
    #[wasm_bindgen(js_name = createAvatar)]
    pub fn create_avatar(&self, shape: &[f32]) -> Result<CoreAvatar, JsValue> {
        CoreAvatar::new(&self.model, &self.traits, shape)
    }
}

/// A body with its networks.
#[wasm_bindgen]
pub struct CoreModel {
    pub(crate) model: Arc<Model>,
    traits: Arc<[Trait]>,
}

#[wasm_bindgen]
impl CoreModel {
    /// Puts the networks of a bundle together with its body.
    ///
    /// # Errors
    /// Throws for networks that are not the bundle's, not ONNX, or break the contract.
    #[wasm_bindgen(constructor)]
    pub fn new(
        bundle_json: &[u8],
        body: &CoreBody,
        predictor_onnx: &[u8],
        decoder_onnx: &[u8],
    ) -> Result<CoreModel, JsValue> {
        let load = || -> Result<Model, Thrown> {
            let bundle = Bundle::from_json(bundle_json)?;
            let body = Arc::clone(&body.body);
            Ok(Model::from_parts(
                bundle,
                body,
                predictor_onnx,
                decoder_onnx,
            )?)
        };
        Ok(Self {
            model: Arc::new(load()?),
            traits: Arc::clone(&body.traits),
        })
    }

    /// Vertices that the networks move, ascending.
    #[wasm_bindgen(js_name = softVertices)]
    pub fn soft_vertices(&self) -> Vec<u32> {
        self.model.soft_vertices().to_vec()
    }

    /// An avatar whose tissue moves.
    ///
    /// # Errors
    /// Throws `shape`, and what the networks throw when run at rest.
    #[wasm_bindgen(js_name = createAvatar)]
    pub fn create_avatar(&self, shape: &[f32]) -> Result<CoreAvatar, JsValue> {
        CoreAvatar::new(&self.model, &self.traits, shape)
    }
}
