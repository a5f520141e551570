//! Avatars.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use dynaskin_body::{Figure, Figures, Pose, Region, Trait};
use dynaskin_decoding::{BodyTexels, DecoderMatrix, DecodingError, Tables};
use dynaskin_runtime::{
    Avatar, Controls, Decoding, Detail, LinearDecoder, Model, PoseSource, Settled, Skinning,
    StepReport,
};
use js_sys::{Array, Float32Array, Uint32Array};
use wasm_bindgen::prelude::*;

use crate::controls;
use crate::error::{Thrown, no_region};
use crate::motion::{self, CoreMotion, animation_choice, read_options};
use crate::pose;
use crate::puppet::CorePuppet;

/// By number.
const SOURCES: [PoseSource; 4] = [
    PoseSource::Display,
    PoseSource::Tracker,
    PoseSource::Network,
    PoseSource::AsGiven,
];

fn refused(error: DecodingError) -> Thrown {
    Thrown::argument(error.to_string())
}

fn source_number(source: PoseSource) -> u8 {
    match source {
        PoseSource::Display => 0,
        PoseSource::Tracker => 1,
        PoseSource::Network => 2,
        PoseSource::AsGiven => 3,
    }
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    pub(crate) fn now_ms() -> f64;
}

/// One body, stepped by its host.
#[wasm_bindgen]
pub struct CoreAvatar {
    pub(crate) avatar: Rc<RefCell<Avatar>>,
    report: Option<StepReport>,
    enabled: bool,
    traits: Arc<[Trait]>,
}

impl CoreAvatar {
    pub(crate) fn new(
        model: &Arc<Model>,
        traits: &Arc<[Trait]>,
        shape: &[f32],
    ) -> Result<Self, JsValue> {
        let avatar = Avatar::new(Arc::clone(model), shape).map_err(Thrown::from)?;
        Ok(Self {
            enabled: avatar.model().bundle().is_some(),
            avatar: Rc::new(RefCell::new(avatar)),
            report: None,
            traits: Arc::clone(traits),
        })
    }

    fn of_decoder<T>(&self, list: impl FnOnce(&LinearDecoder) -> Vec<T>) -> Vec<T> {
        let avatar = self.avatar.borrow();
        avatar.model().linear_decoder().map_or(Vec::new(), list)
    }

    /// Moves on by `dt_seconds` to a pose.
    pub(crate) fn step_to(&mut self, pose: &Pose, dt_seconds: f64) -> Result<(), Thrown> {
        let report = self
            .avatar
            .borrow_mut()
            .step_timed(pose, dt_seconds, &mut || 1e-3 * now_ms())?;
        self.report = Some(report);
        Ok(())
    }
}

#[wasm_bindgen]
impl CoreAvatar {
    /// Moves on by `dt_seconds` to a pose of 99 numbers.
    ///
    /// # Errors
    /// Throws `argument`, `pose`.
    pub fn step(&mut self, pose: &[f64], dt_seconds: f64) -> Result<(), JsValue> {
        Ok(self.step_to(&pose::from_numbers(pose)?, dt_seconds)?)
    }

    /// Skins positions and normals on the CPU.
    pub fn skin(&mut self) {
        self.avatar.borrow_mut().skin();
    }

    /// Of the last step: ticks, then milliseconds for features, predict, decode and apply; then
    /// why the tissue was settled anew: 0 it was not, 1 first pose, 2 stall, 3 cut,
    /// 4 woken. A step of a crowd does not count.
    pub fn timings(&self) -> Vec<f64> {
        self.report.map_or_else(
            || vec![0.0; 6],
            |report| {
                let seconds = report.seconds;
                vec![
                    report.ticks as f64,
                    1e3 * seconds.features,
                    1e3 * seconds.predict,
                    1e3 * seconds.decode,
                    1e3 * seconds.apply,
                    match report.settled {
                        None => 0.0,
                        Some(Settled::FirstPose) => 1.0,
                        Some(Settled::Stall) => 2.0,
                        Some(Settled::Cut) => 3.0,
                        Some(Settled::Woken) => 4.0,
                    },
                ]
            },
        )
    }

    /// Shape coefficients in standard deviations.
    pub fn shape(&self) -> Vec<f32> {
        self.avatar.borrow().shape().to_vec()
    }

    /// Changes the shape.
    ///
    /// # Errors
    /// Throws `shape`.
    #[wasm_bindgen(js_name = setShape)]
    pub fn set_shape(&mut self, shape: &[f32]) -> Result<(), JsValue> {
        Ok(self
            .avatar
            .borrow_mut()
            .set_shape(shape)
            .map_err(Thrown::from)?)
    }

    /// The likeliest shape of these measures: stature in metres, weight in kilograms, chest in centimetres,
    /// muscle from 0 to 1, age in years; not a number for those that are left out.
    ///
    /// # Errors
    /// Throws `argument` for another count, `shape` for measures of no adult and where the bundle tells none.
    #[wasm_bindgen(js_name = shapeOf)]
    pub fn shape_of(&self, figure: &[f64]) -> Result<Vec<f32>, JsValue> {
        let &[stature, weight, chest, muscle, age] = figure else {
            let message = format!("a figure has 5 measures, got {}", figure.len());
            return Err(Thrown::argument(message).into());
        };
        let told = |value: f64| (!value.is_nan()).then_some(value);
        let wanted = Figure {
            stature_m: told(stature),
            weight_kg: told(weight),
            chest_cm: told(chest),
            muscle: told(muscle),
            age_years: told(age),
        };
        let avatar = self.avatar.borrow();
        let shape = Figures::new(avatar.model().body(), &self.traits)
            .and_then(|figures| figures.shape_of(&wanted))
            .map_err(Thrown::from)?;
        Ok(shape.to_vec())
    }

    /// The measures of the present shape, in the order of [`Self::shape_of`]; empty where the bundle tells none.
    pub fn figure(&self) -> Vec<f64> {
        let avatar = self.avatar.borrow();
        let Ok(figures) = Figures::new(avatar.model().body(), &self.traits) else {
            return Vec::new();
        };
        let measured = figures.measure(avatar.shape()).values();
        measured.map(|value| value.unwrap_or(f64::NAN)).to_vec()
    }

    /// Another number after every shape that was set or restored.
    #[wasm_bindgen(getter)]
    pub fn revision(&self) -> u32 {
        self.avatar.borrow().revision()
    }

    /// Whether the networks run; never for a body without them.
    #[wasm_bindgen(getter)]
    pub fn dynamics(&self) -> bool {
        self.enabled
    }

    /// Switches the networks on or off.
    #[wasm_bindgen(setter)]
    pub fn set_dynamics(&mut self, on: bool) {
        self.enabled = on && self.avatar.borrow().model().bundle().is_some();
        self.avatar.borrow_mut().set_enabled(on);
    }

    /// Factor on all offsets.
    #[wasm_bindgen(getter)]
    pub fn strength(&self) -> f32 {
        self.avatar.borrow().controls().strength
    }

    /// Sets the factor on all offsets.
    ///
    /// # Errors
    /// Throws `argument`.
    #[wasm_bindgen(setter)]
    pub fn set_strength(&mut self, strength: f32) -> Result<(), JsValue> {
        Ok(self
            .avatar
            .borrow_mut()
            .set_strength(strength)
            .map_err(Thrown::from)?)
    }

    /// The largest strain between neighbouring vertices; undefined without a limit.
    #[wasm_bindgen(getter, js_name = maxStrain)]
    pub fn max_strain(&self) -> Option<f32> {
        self.avatar.borrow().max_strain()
    }

    /// Limits the strain between neighbouring vertices; undefined: not at all.
    ///
    /// # Errors
    /// Throws `argument`.
    #[wasm_bindgen(setter, js_name = maxStrain)]
    pub fn set_max_strain(&mut self, max_strain: Option<f32>) -> Result<(), JsValue> {
        Ok(self
            .avatar
            .borrow_mut()
            .set_max_strain(max_strain)
            .map_err(Thrown::from)?)
    }

    /// Whether poses correct the skin; never for a body without pose correctives.
    #[wasm_bindgen(getter, js_name = poseCorrectives)]
    pub fn pose_correctives(&self) -> bool {
        self.avatar.borrow().pose_correctives()
    }

    /// Switches that.
    #[wasm_bindgen(setter, js_name = poseCorrectives)]
    pub fn set_pose_correctives(&mut self, on: bool) {
        self.avatar.borrow_mut().set_pose_correctives(on);
    }

    /// Whether [`Self::skin`] blends dual quaternions instead of matrices.
    #[wasm_bindgen(getter, js_name = dualQuaternions)]
    pub fn dual_quaternions(&self) -> bool {
        self.avatar.borrow().skinning() == Skinning::DualQuaternion
    }

    /// Switches that.
    #[wasm_bindgen(setter, js_name = dualQuaternions)]
    pub fn set_dual_quaternions(&mut self, on: bool) {
        let skinning = if on {
            Skinning::DualQuaternion
        } else {
            Skinning::Linear
        };
        self.avatar.borrow_mut().set_skinning(skinning);
    }

    /// Sets the factor on the offsets of the region number `region`.
    ///
    /// # Errors
    /// Throws `argument`, also for a number that is no region.
    #[wasm_bindgen(js_name = setRegionGain)]
    pub fn set_region_gain(&mut self, region: usize, gain: f32) -> Result<(), JsValue> {
        let region = *Region::ALL.get(region).ok_or_else(|| no_region(region))?;
        let set = self.avatar.borrow_mut().set_region_gain(region, gain);
        Ok(set.map_err(Thrown::from)?)
    }

    /// Strength, root inertia, then gain, stiffness, damping and limit (metres) of each region.
    pub fn controls(&self) -> Vec<f32> {
        controls::to_numbers(self.avatar.borrow().controls())
    }

    /// Sets all controls, in the order of [`Self::controls`].
    ///
    /// # Errors
    /// Throws `argument`; the avatar then keeps its controls.
    #[wasm_bindgen(js_name = setControls)]
    pub fn set_controls(&mut self, numbers: &[f32]) -> Result<(), JsValue> {
        let controls = controls::from_numbers(numbers)?;
        Ok(self
            .avatar
            .borrow_mut()
            .set_controls(&controls)
            .map_err(Thrown::from)?)
    }

    /// The controls called `name`: `as-predicted`, `calm-clothes` or `sportswear`.
    ///
    /// # Errors
    /// Throws `argument` for another name.
    #[wasm_bindgen(js_name = controlPreset)]
    pub fn control_preset(name: &str) -> Result<Vec<f32>, JsValue> {
        match name {
            "as-predicted" => Ok(controls::to_numbers(&Controls::default())),
            "calm-clothes" => Ok(controls::to_numbers(&Controls::calm_clothes())),
            "sportswear" => Ok(controls::to_numbers(&Controls::sportswear())),
            _ => Err(Thrown::argument(format!(
                "There is no preset `{name}`; there are `as-predicted`, `calm-clothes` and \
                 `sportswear`."
            ))
            .into()),
        }
    }

    /// Metres of the world in a metre of the body.
    #[wasm_bindgen(getter)]
    pub fn scale(&self) -> f64 {
        self.avatar.borrow().scale()
    }

    /// Sets the scale.
    ///
    /// # Errors
    /// Throws `argument`.
    #[wasm_bindgen(setter)]
    pub fn set_scale(&mut self, scale: f64) -> Result<(), JsValue> {
        Ok(self
            .avatar
            .borrow_mut()
            .set_scale(scale)
            .map_err(Thrown::from)?)
    }

    /// How much work the tissue is worth: 0 none, 1 half, 2 full.
    #[wasm_bindgen(getter)]
    pub fn detail(&self) -> u8 {
        self.avatar.borrow().detail() as u8
    }

    /// Sets that.
    ///
    /// # Errors
    /// Throws `argument` for another number.
    #[wasm_bindgen(setter)]
    pub fn set_detail(&mut self, detail: u8) -> Result<(), JsValue> {
        let detail = match detail {
            0 => Detail::Asleep,
            1 => Detail::Half,
            2 => Detail::Full,
            _ => return Err(Thrown::argument(format!("There is no detail {detail}.")).into()),
        };
        self.avatar.borrow_mut().set_detail(detail);
        Ok(())
    }

    /// Where poses come from: 0 a display, 1 a tracker, 2 a network, 3 taken as given.
    #[wasm_bindgen(getter, js_name = poseSource)]
    pub fn pose_source(&self) -> u8 {
        let source = self.avatar.borrow().pose_source();
        source_number(source)
    }

    /// Sets that.
    ///
    /// # Errors
    /// Throws `argument` for another number.
    #[wasm_bindgen(setter, js_name = poseSource)]
    pub fn set_pose_source(&mut self, number: u8) -> Result<(), JsValue> {
        let Some(source) = SOURCES.get(usize::from(number)) else {
            return Err(Thrown::argument(format!("There is no source {number}.")).into());
        };
        self.avatar.borrow_mut().set_pose_source(*source);
        Ok(())
    }

    /// What was found out about the source: whether poses repeat, its interval (0 if unknown), jitter
    /// and latency in milliseconds, noise in degrees, and the number of the source that would help, or
    /// -1.
    #[wasm_bindgen(js_name = sourceDiagnosis)]
    pub fn source_diagnosis(&self) -> Vec<f64> {
        let found = self.avatar.borrow().source_diagnosis();
        vec![
            f64::from(u8::from(found.repeats)),
            1e3 * found.interval_seconds.unwrap_or(0.0),
            1e3 * found.jitter_seconds,
            1e3 * found.latency_seconds,
            found.noise_degrees,
            found
                .advice
                .map_or(-1.0, |source| f64::from(source_number(source))),
        ]
    }

    /// Whether anybody sees the avatar.
    #[wasm_bindgen(getter)]
    pub fn visible(&self) -> bool {
        self.avatar.borrow().visible()
    }

    /// Says whether anybody sees the avatar.
    #[wasm_bindgen(setter)]
    pub fn set_visible(&mut self, visible: bool) {
        self.avatar.borrow_mut().set_visible(visible);
    }

    /// Metres from the camera.
    #[wasm_bindgen(getter, js_name = distanceM)]
    pub fn distance_m(&self) -> f64 {
        self.avatar.borrow().distance_m()
    }

    /// Sets that.
    ///
    /// # Errors
    /// Throws `argument` for a negative number or NaN.
    #[wasm_bindgen(setter, js_name = distanceM)]
    pub fn set_distance_m(&mut self, distance_m: f64) -> Result<(), JsValue> {
        let set = self.avatar.borrow_mut().set_distance_m(distance_m);
        Ok(set.map_err(Thrown::from)?)
    }

    /// The next pose counts as the first.
    pub fn reset(&mut self) {
        self.avatar.borrow_mut().reset();
    }

    /// All that the avatar remembers, as bytes for [`Self::restore`].
    pub fn save(&self) -> Vec<u8> {
        self.avatar.borrow().save()
    }

    /// Goes on from where [`Self::save`] was called.
    ///
    /// # Errors
    /// Throws `state` for bytes that cannot be used; the avatar then stays as it was.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), JsValue> {
        self.avatar
            .borrow_mut()
            .restore(bytes)
            .map_err(Thrown::from)?;
        self.enabled =
            self.avatar.borrow().enabled() && self.avatar.borrow().model().bundle().is_some();
        Ok(())
    }

    /// Shows offsets of all vertices, f32 `[vertex][3]`, metres, rest pose, on an avatar without
    /// networks.
    ///
    /// # Errors
    /// Throws `argument`.
    #[wasm_bindgen(js_name = showOffsets)]
    pub fn show_offsets(&mut self, offsets_rest_m: &[f32]) -> Result<(), JsValue> {
        let shown = self.avatar.borrow_mut().show_offsets(offsets_rest_m);
        Ok(shown.map_err(Thrown::from)?)
    }

    /// Reads a BVH file for this body. `joints` are pairs of the body's joint and the file's name of it.
    ///
    /// # Errors
    /// Throws `motion`, and `argument` for a joint that the body has not.
    #[wasm_bindgen(js_name = motionFromBvh)]
    pub fn motion_from_bvh(
        &self,
        bytes: &[u8],
        joints: Vec<String>,
        rate_hz: Option<f64>,
    ) -> Result<CoreMotion, JsValue> {
        let options = read_options(&joints, None, rate_hz, None)?;
        Ok(CoreMotion::from_bvh(
            bytes,
            &options,
            self.avatar.borrow().joints_rest_m(),
        )?)
    }

    /// Reads a BVH, binary glTF or AMASS-like file for this body. `joints` are pairs of the body's joint
    /// and the file's name of it, `animation` is a name or a place counted from 0, `up` an axis (`y`,
    /// `z`, `-y`).
    ///
    /// # Errors
    /// Throws `motion`, and `argument` for a joint that the body has not or an axis that there is not.
    #[wasm_bindgen(js_name = motionFromFile)]
    pub fn motion_from_file(
        &self,
        bytes: &[u8],
        joints: Vec<String>,
        animation: JsValue,
        rate_hz: Option<f64>,
        up: Option<String>,
    ) -> Result<CoreMotion, JsValue> {
        let options = read_options(
            &joints,
            animation_choice(&animation),
            rate_hz,
            up.as_deref(),
        )?;
        Ok(CoreMotion::from_file(
            bytes,
            &options,
            self.avatar.borrow().joints_rest_m(),
        )?)
    }

    /// The animations of a binary glTF file: objects with `name`, `seconds` and `movingJoints`.
    ///
    /// # Errors
    /// Throws `motion`.
    #[wasm_bindgen(js_name = animationsOf)]
    pub fn animations_of(&self, bytes: &[u8]) -> Result<JsValue, JsValue> {
        motion::animations(bytes)
    }

    /// A motion of poses of 99 numbers, one after the other, at `rate_hz`.
    ///
    /// # Errors
    /// Throws `argument` for what are no whole poses, `pose` for one that cannot be used, `motion` for
    /// a rate or a length out of range.
    #[wasm_bindgen(js_name = motionFromPoses)]
    pub fn motion_from_poses(
        &self,
        name: String,
        poses: &[f64],
        rate_hz: f64,
    ) -> Result<CoreMotion, JsValue> {
        Ok(CoreMotion::from_poses(name, poses, rate_hz)?)
    }

    /// Makes the test motion called `name` for this body.
    ///
    /// # Errors
    /// Throws `argument` for an unknown name, `motion` for parameters out of range.
    #[wasm_bindgen(js_name = motionProcedural)]
    pub fn motion_procedural(
        &self,
        name: &str,
        tempo_hz: Option<f64>,
        height_m: Option<f64>,
        duration_seconds: Option<f64>,
    ) -> Result<CoreMotion, JsValue> {
        let avatar = self.avatar.borrow();
        let joints_rest_m = avatar.joints_rest_m();
        let parameters = (tempo_hz, height_m, duration_seconds);
        Ok(CoreMotion::procedural(name, parameters, joints_rest_m)?)
    }

    /// A standing body that is moved by hand, for the avatar's present shape.
    ///
    /// # Errors
    /// Throws `motion` for a body that does not stand.
    pub fn puppet(&self) -> Result<CorePuppet, JsValue> {
        Ok(CorePuppet::new(self.avatar.borrow().joints_rest_m())?)
    }

    /// Rest joint positions in metres, `[joint][3]`.
    #[wasm_bindgen(js_name = jointsRest)]
    pub fn joints_rest(&self) -> Vec<f32> {
        let avatar = self.avatar.borrow();
        let joints = avatar.joints_rest_m().iter();
        joints.flat_map(|joint| joint.to_array()).collect()
    }

    /// Whether surfaces are decoded by [`Self::update_surface`] alone, where that can be.
    #[wasm_bindgen(getter, js_name = decodesOnDemand)]
    pub fn decodes_on_demand(&self) -> bool {
        self.avatar.borrow().decoding() == Decoding::OnDemand
    }

    /// Sets that.
    #[wasm_bindgen(setter, js_name = decodesOnDemand)]
    pub fn set_decodes_on_demand(&mut self, on: bool) {
        let decoding = if on {
            Decoding::OnDemand
        } else {
            Decoding::InStep
        };
        self.avatar.borrow_mut().set_decoding(decoding);
    }

    /// Decodes what was not decoded.
    #[wasm_bindgen(js_name = updateSurface)]
    pub fn update_surface(&mut self) {
        self.avatar.borrow_mut().update_surface();
    }

    /// Address of what is not decoded, f32 `[latent]`, until the avatar changes in any way; 0 where
    /// everything is decoded.
    #[wasm_bindgen(js_name = undecodedPtr)]
    pub fn undecoded_ptr(&self) -> usize {
        let avatar = self.avatar.borrow();
        let latents = avatar.undecoded_latents();
        latents.map_or(0, |latents| latents.as_ptr() as usize)
    }

    /// Another number after every change of the surface, decoded or not.
    #[wasm_bindgen(getter, js_name = surfaceRevision)]
    pub fn surface_revision(&self) -> u32 {
        self.avatar.borrow().surface_revision()
    }

    /// Another number after every change of [`Self::vertex_controls`].
    #[wasm_bindgen(getter, js_name = controlsRevision)]
    pub fn controls_revision(&self) -> u32 {
        self.avatar.borrow().controls_revision()
    }

    /// Gains of the soft vertices, then their limits in metres.
    #[wasm_bindgen(js_name = vertexControls)]
    pub fn vertex_controls(&self) -> Vec<f32> {
        let avatar = self.avatar.borrow();
        [avatar.vertex_gains(), avatar.vertex_limits_m()].concat()
    }

    /// Positions of the shape without offsets, `[vertex][3]`, metres.
    #[wasm_bindgen(js_name = stillPositions)]
    pub fn still_positions(&self) -> Vec<f32> {
        let avatar = self.avatar.borrow();
        let positions = avatar.still_positions_rest_m().iter();
        positions.flat_map(|position| position.to_array()).collect()
    }

    /// The decoder as a matrix: for each soft vertex where its weights begin, and the end; empty where
    /// there is no such matrix.
    #[wasm_bindgen(js_name = decoderStarts)]
    pub fn decoder_starts(&self) -> Vec<u32> {
        self.of_decoder(|decoder| decoder.starts().to_vec())
    }

    /// Of each of its weights, the latent that it is multiplied with.
    #[wasm_bindgen(js_name = decoderLatents)]
    pub fn decoder_latents(&self) -> Vec<u32> {
        self.of_decoder(|decoder| decoder.latents().to_vec())
    }

    /// Its weights, `[weight][3]`, metres.
    #[wasm_bindgen(js_name = decoderWeights)]
    pub fn decoder_weights(&self) -> Vec<f32> {
        self.of_decoder(|decoder| decoder.weights().as_flattened().to_vec())
    }

    /// The decoder as tables for a graphics card, in whole rows of texels, as `Tables` of the crate
    /// `dynaskin-decoding` has them: vertices u32 `[texel][4]`, weights f32 `[texel][4]`, corners u32 `[texel][2]`.
    ///
    /// # Errors
    /// Throws `argument` where the decoder is no matrix.
    #[wasm_bindgen(js_name = decoderTables)]
    pub fn decoder_tables(&self) -> Result<Array, JsValue> {
        let avatar = self.avatar.borrow();
        let model = avatar.model();
        let decoder = model
            .linear_decoder()
            .ok_or_else(|| Thrown::argument("This decoder is no matrix.".to_owned()))?;
        let matrix = DecoderMatrix {
            vertex_count: model.body().vertex_count(),
            faces: model.body().faces.as_flattened(),
            soft_vertices: model.soft_vertices(),
            starts: decoder.starts(),
            latents: decoder.latents(),
            weights_m: decoder.weights().as_flattened(),
            latent_count: decoder.latent_count(),
        };
        let tables = Tables::new(&matrix).map_err(refused)?;
        let (vertices, weights, corners) = (&tables.vertices, &tables.weights, &tables.corners);
        Ok(Array::of3(
            &Uint32Array::from(vertices.as_flattened()),
            &Float32Array::from(weights.as_flattened()),
            &Uint32Array::from(corners.as_flattened()),
        ))
    }

    /// What a graphics card decodes the avatar from besides its latents, likewise (`BodyTexels`): positions
    /// without offsets f32 `[texel][4]`, gains and limits f32 `[texel][2]`.
    ///
    /// # Errors
    /// Throws `argument` for numbers that are not finite.
    #[wasm_bindgen(js_name = bodyTexels)]
    pub fn body_texels(&self) -> Result<Array, JsValue> {
        let avatar = self.avatar.borrow();
        let still: &[f32] = bytemuck::cast_slice(avatar.still_positions_rest_m());
        let (gains, limits_m) = (avatar.vertex_gains(), avatar.vertex_limits_m());
        let body = BodyTexels::new(still, avatar.model().soft_vertices(), gains, limits_m)
            .map_err(refused)?;
        Ok(Array::of2(
            &Float32Array::from(body.still_positions.as_flattened()),
            &Float32Array::from(body.controls.as_flattened()),
        ))
    }

    /// How many latents it takes.
    #[wasm_bindgen(js_name = latentCount)]
    pub fn latent_count(&self) -> usize {
        let avatar = self.avatar.borrow();
        let decoder = avatar.model().linear_decoder();
        decoder.map_or(0, LinearDecoder::latent_count)
    }

    /// Vertices that the networks move, ascending.
    #[wasm_bindgen(js_name = softVertices)]
    pub fn soft_vertices(&self) -> Vec<u32> {
        self.avatar.borrow().model().soft_vertices().to_vec()
    }

    /// Address of the offsets, f32 `[vertex][3]`, metres, rest pose.
    #[wasm_bindgen(js_name = offsetsPtr)]
    pub fn offsets_ptr(&self) -> usize {
        self.avatar.borrow().offsets_rest_m().as_ptr() as usize
    }

    /// Address of the rest positions with offsets, f32 `[vertex][3]`, metres.
    #[wasm_bindgen(js_name = positionsPtr)]
    pub fn positions_ptr(&self) -> usize {
        self.avatar.borrow().positions_rest_m().as_ptr() as usize
    }

    /// Address of the rest normals, f32 `[vertex][3]`.
    #[wasm_bindgen(js_name = normalsPtr)]
    pub fn normals_ptr(&self) -> usize {
        self.avatar.borrow().normals_rest().as_ptr() as usize
    }

    /// Address of the skin matrices `world_from_rest`, f32 `[joint][16]`, column-major.
    #[wasm_bindgen(js_name = skinMatricesPtr)]
    pub fn skin_matrices_ptr(&self) -> usize {
        self.avatar.borrow().skin_matrices().as_ptr() as usize
    }

    /// Address of the skinned positions, f32 `[vertex][3]`, metres, world. There are none before the first `skin`.
    #[wasm_bindgen(js_name = skinnedPositionsPtr)]
    pub fn skinned_positions_ptr(&self) -> usize {
        self.avatar.borrow().skinned().0.as_ptr() as usize
    }

    /// Address of the skinned normals, f32 `[vertex][3]`, likewise.
    #[wasm_bindgen(js_name = skinnedNormalsPtr)]
    pub fn skinned_normals_ptr(&self) -> usize {
        self.avatar.borrow().skinned().1.as_ptr() as usize
    }
}
