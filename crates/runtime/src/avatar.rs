//! One body on the stage: poses and time steps in, a surface that moves out.

use std::sync::Arc;

use dynaskin_body::{JOINT_COUNT, Pose, Region, SHAPE_COUNT, SkinMatrices};
use dynaskin_conditioning::{Conditioner, Diagnosis, PoseSource};
use glam::{Mat4, Vec3};

use crate::RuntimeError;
use crate::clock::{Settled, TickClock};
use crate::controls::{Controls, in_range};
use crate::engine::{self, Engine};
use crate::figure::Figure;
use crate::model::Model;
use crate::presence::{Planned, Presence};
use crate::skin;
use crate::state::{Reader, Writer};
use crate::surface::{Surface, VertexControls};
use crate::tissue::Tissue;

/// Smallest scale of an avatar.
pub const MIN_SCALE: f64 = 0.1;

/// Largest scale of an avatar.
pub const MAX_SCALE: f64 = 10.0;

/// Largest shape coefficient, in standard deviations either way.
pub const MAX_SHAPE_COEFFICIENT: f32 = 5.0;

/// What one step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Ticks of the model that the step ran.
    pub ticks: usize,
    /// Why the tissue was settled anew, if it was.
    pub settled: Option<Settled>,
    /// Where the time went; zeros unless the step was given a stopwatch.
    pub seconds: StageSeconds,
}

/// Time spent per stage of a step, in the stopwatch's seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Kinematics and features of all ticks.
    pub features: f64,
    /// The predictor, all ticks.
    pub predict: f64,
    /// The decoder, once.
    pub decode: f64,
    /// Gains, scattering, rest positions and normals.
    pub apply: f64,
    /// Forward kinematics and skin matrices; positions and normals where [`Avatar::skin`] was
    /// called.
    pub skin: f64,
}

/// A stopwatch of the host: seconds since any fixed instant.
pub type Stopwatch<'a> = &'a mut dyn FnMut() -> f64;

/// One body, stepped by its host.
///
/// After an error the avatar is still good: the host can go on with the next pose.
#[derive(Debug)]
pub struct Avatar {
    pub(crate) model: Arc<Model>,
    pub(crate) figure: Arc<Figure>,
    pub(crate) surface: Surface,
    pub(crate) clock: TickClock,
    /// Puts poses on their source's clock before they reach the tissue's.
    pub(crate) conditioner: Conditioner,
    pub(crate) tissue: Option<Tissue>,
    /// Runs the networks where the avatar is stepped by itself; made with the first such step.
    engine: Option<Box<Engine>>,
    /// The step at hand.
    pub(crate) planned: Planned,
    pub(crate) presence: Presence,
    /// Whether the tissue must be settled before it can be ticked.
    pub(crate) unsettled: bool,
    pub(crate) enabled: bool,
    /// Metres of the world in a metre of the body.
    pub(crate) scale: f64,
    controls: Controls,
    vertex_controls: Vec<VertexControls>,
    pub(crate) skin: SkinMatrices,
    pub(crate) skin_matrices: [Mat4; JOINT_COUNT],
    skinned_positions_m: Vec<Vec3>,
    skinned_normals: Vec<Vec3>,
}

impl Avatar {
    /// An avatar of `model` with the shape coefficients `shape` (β, in standard deviations).
    ///
    /// # Errors
    /// [`RuntimeError::InvalidShape`]; [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]
    /// from running the networks at rest.
    pub fn new(model: Arc<Model>, shape: &[f32]) -> Result<Self, RuntimeError> {
        let figure = model.figure(checked_shape(shape)?)?;
        let vertex_count = model.body().vertex_count();
        let tissue = figure.rest.as_ref();
        let tissue = tissue.map(|rest| Tissue::new(model.feature_kind(), &figure, rest));
        let skin = SkinMatrices::new(&Pose::REST, &figure.joints_rest_m);
        let mut avatar = Self {
            surface: Surface::new(&figure),
            figure,
            clock: TickClock::default(),
            conditioner: Conditioner::default(),
            tissue,
            engine: None,
            planned: Planned::default(),
            presence: Presence::default(),
            unsettled: true,
            enabled: true,
            scale: 1.0,
            controls: Controls::default(),
            vertex_controls: vec![VertexControls::NONE; model.soft_vertices().len()],
            skin_matrices: skin::matrices(&skin),
            skin,
            skinned_positions_m: vec![Vec3::ZERO; vertex_count],
            skinned_normals: vec![Vec3::ZERO; vertex_count],
            model,
        };
        avatar.update_vertex_controls();
        Ok(avatar)
    }

    /// Moves on by `dt_seconds` to `pose`, whose translation is in metres of the world.
    ///
    /// The first pose, and one after a stall or a cut, is taken as one in which the body has stood
    /// for long; after a stall or a cut, what was shown gives way to that over
    /// [`crate::FADE_SECONDS`]. A step of 0 s (a pause) changes the skin matrices alone. For slow
    /// motion, slow the time steps down with the poses.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: the avatar stays as it
    /// was. [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: the surface stays as it was,
    /// and the next pose counts as the first.
    pub fn step(&mut self, pose: &Pose, dt_seconds: f64) -> Result<StepReport, RuntimeError> {
        self.step_timed(pose, dt_seconds, &mut || 0.0)
    }

    /// As [`Self::step`], reading `stopwatch` between the stages.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_timed(
        &mut self,
        pose: &Pose,
        dt_seconds: f64,
        stopwatch: Stopwatch<'_>,
    ) -> Result<StepReport, RuntimeError> {
        self.plan(pose, dt_seconds)?;
        let mut engine = self.engine.take();
        if engine.is_none()
            && let Some(networks) = self.model.networks()
        {
            engine = Some(Box::new(Engine::new(networks)?));
        }
        let stepped = engine::step(engine.as_deref_mut(), &mut [self], stopwatch);
        self.engine = engine;
        Ok(StepReport {
            seconds: stepped?,
            ..self.report()
        })
    }

    /// Changes the body's shape; the motion goes on. What is shown follows at once.
    ///
    /// # Errors
    /// As [`Self::new`]; the avatar keeps its shape.
    pub fn set_shape(&mut self, shape: &[f32]) -> Result<(), RuntimeError> {
        let figure = self.model.figure(checked_shape(shape)?)?;
        if let Some(tissue) = &mut self.tissue {
            tissue.set_figure(&figure);
        }
        self.surface.set_figure(self.model.topology(), &figure);
        self.figure = figure;
        self.apply();
        Ok(())
    }

    /// Changes all controls; what is shown follows at once. The networks run on at a strength of 0,
    /// so the tissue moves as if it always had when the strength comes back.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`]; the first time that stiffness or damping is changed on a
    /// model, [`RuntimeError::Inference`], [`RuntimeError::NonFinite`] from measuring how its
    /// regions swing. The avatar keeps its controls.
    pub fn set_controls(&mut self, controls: &Controls) -> Result<(), RuntimeError> {
        controls.check()?;
        if let Some(tissue) = &mut self.tissue {
            tissue.set_controls(&self.model, controls)?;
        }
        self.controls = *controls;
        self.update_vertex_controls();
        self.apply();
        Ok(())
    }

    /// The controls.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// Changes [`Controls::strength`] alone.
    ///
    /// # Errors
    /// As [`Self::set_controls`].
    pub fn set_strength(&mut self, strength: f32) -> Result<(), RuntimeError> {
        self.set_controls(&Controls {
            strength,
            ..self.controls
        })
    }

    /// Changes the gain of one region alone.
    ///
    /// # Errors
    /// As [`Self::set_controls`].
    pub fn set_region_gain(&mut self, region: Region, gain: f32) -> Result<(), RuntimeError> {
        let mut controls = self.controls;
        controls.regions[region as usize].gain = gain;
        self.set_controls(&controls)
    }

    /// Makes the avatar `scale` times as large as its body; the world's metre stays. All that the
    /// tissue feels is in lengths of the body, so a doll and a giant whose poses are to scale move
    /// alike. The motion goes on; skin matrices follow with the next step.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`] outside [`MIN_SCALE`]..=[`MAX_SCALE`].
    pub fn set_scale(&mut self, scale: f64) -> Result<(), RuntimeError> {
        in_range(
            "the scale",
            scale as f32,
            MIN_SCALE as f32,
            MAX_SCALE as f32,
        )?;
        let ratio = self.scale / scale;
        self.clock.rescale(ratio);
        // The next poses are in another unit; held ones must not be mixed with them.
        self.conditioner.reset();
        if let Some(tissue) = &mut self.tissue {
            tissue.rescale(ratio);
        }
        self.scale = scale;
        Ok(())
    }

    /// Metres of the world in a metre of the body.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Shows offsets that the host knows, such as recorded ones, on an avatar without networks; they
    /// stay until the next call. Positions and normals follow; the shape must not change meanwhile.
    ///
    /// `offsets_rest_m` holds three numbers for each vertex of the body, metres, in the rest pose.
    /// They are shown as they are: controls are for what networks predict.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidOffsets`] for another count, numbers that are not finite, and on an
    /// avatar with networks; what was shown stays.
    pub fn show_offsets(&mut self, offsets_rest_m: &[f32]) -> Result<(), RuntimeError> {
        let invalid = |problem: String| RuntimeError::InvalidOffsets { problem };
        if self.model.networks().is_some() {
            return Err(invalid(
                "this avatar has networks that move its skin".into(),
            ));
        }
        let expected = 3 * self.surface.offsets_m.len();
        if offsets_rest_m.len() != expected {
            let got = offsets_rest_m.len();
            return Err(invalid(format!(
                "{got} numbers, where the body needs {expected}"
            )));
        }
        if let Some(idx) = offsets_rest_m.iter().position(|value| !value.is_finite()) {
            return Err(invalid(format!("number {idx} is {}", offsets_rest_m[idx])));
        }
        self.surface
            .show(self.model.topology(), &self.figure, offsets_rest_m);
        Ok(())
    }

    /// Switches the tissue off, which saves its cost, or on, after which it starts settled.
    /// [`Self::set_strength`] compares with and without tissue in mid-motion.
    pub fn set_enabled(&mut self, enabled: bool) {
        if self.enabled && !enabled {
            self.surface.clear(&self.figure);
        }
        self.unsettled |= self.enabled != enabled;
        self.enabled = enabled;
    }

    /// Whether the tissue is switched on.
    pub fn enabled(&self) -> bool {
        self.enabled
    }

    /// The next pose counts as the first.
    pub fn reset(&mut self) {
        self.clock.reset();
        self.conditioner.reset();
        self.unsettled = true;
    }

    /// Where poses come from, which decides how they are put on an even clock and whether noise is
    /// taken off. The next pose counts as the first.
    pub fn set_pose_source(&mut self, source: PoseSource) {
        self.conditioner.set_source(source);
        self.clock.reset();
        self.unsettled = true;
    }

    /// Where poses come from.
    pub fn pose_source(&self) -> PoseSource {
        self.conditioner.source()
    }

    /// What was found out about the source of poses, and how late the tissue is for it.
    pub fn source_diagnosis(&self) -> Diagnosis {
        self.conditioner.diagnosis()
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Shape coefficients β in standard deviations.
    pub fn shape(&self) -> &[f32; SHAPE_COUNT] {
        &self.figure.shape
    }

    /// Rest joint positions of the shape, in metres.
    pub fn joints_rest_m(&self) -> &[Vec3; JOINT_COUNT] {
        &self.figure.joints_rest_m
    }

    /// Offsets of all vertices in the rest pose, in metres, after gains and limits.
    pub fn offsets_rest_m(&self) -> &[Vec3] {
        &self.surface.offsets_m
    }

    /// Rest positions of all vertices with their offsets, in metres.
    pub fn positions_rest_m(&self) -> &[Vec3] {
        &self.surface.positions_m
    }

    /// Unit normals of all vertices in the rest pose, area-weighted.
    pub fn normals_rest(&self) -> &[Vec3] {
        &self.surface.normals
    }

    /// `world_from_rest` of each joint at the last pose: times a rest position in metres gives a
    /// world position.
    pub fn skin_matrices(&self) -> &[Mat4; JOINT_COUNT] {
        &self.skin_matrices
    }

    /// Skins positions and normals to the last pose with linear blend skinning. Hosts that skin on
    /// a GPU do not need it.
    pub fn skin(&mut self) -> (&[Vec3], &[Vec3]) {
        skin::blend(
            &self.model.body().skin,
            &self.skin,
            (&self.surface.positions_m, &self.surface.normals),
            (&mut self.skinned_positions_m, &mut self.skinned_normals),
        );
        (&self.skinned_positions_m, &self.skinned_normals)
    }

    /// World positions (metres) and unit normals as [`Self::skin`] last computed them.
    pub fn skinned(&self) -> (&[Vec3], &[Vec3]) {
        (&self.skinned_positions_m, &self.skinned_normals)
    }

    /// All that the avatar remembers: shape, scale, controls, clock and tissue. The same poses and
    /// time steps after [`Self::restore`] give the same numbers, bit by bit.
    /// The level of detail and visibility are the host's and not in it.
    pub fn save(&self) -> Vec<u8> {
        let mut writer = Writer::new(&self.model);
        writer.floats(&self.figure.shape);
        writer.double(self.scale);
        self.controls.write(&mut writer);
        writer.flag(self.enabled);
        writer.flag(self.unsettled);
        self.clock.write(&mut writer);
        if let Some(tissue) = &self.tissue {
            tissue.write(&mut writer);
        }
        writer.finish()
    }

    /// Goes on from where [`Self::save`] was called, on this avatar or another of the same model.
    /// The skin matrices are those of the last step that took time.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidState`] for bytes that were changed, cut, or saved by another version
    /// or with another model; [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidShape`],
    /// [`RuntimeError::InvalidControl`] for what cannot be used in them. The avatar stays as it was.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), RuntimeError> {
        let mut reader = Reader::new(&self.model, bytes)?;
        let shape = checked_shape(&reader.floats(SHAPE_COUNT)?)?;
        let scale = reader.double()?;
        check_scale(scale)?;
        let controls = Controls::read(&mut reader)?;
        controls.check()?;
        let (enabled, unsettled) = (reader.flag()?, reader.flag()?);
        let clock = TickClock::read(&mut reader)?;
        let memory = match (&self.tissue, self.model.networks()) {
            (Some(tissue), Some(networks)) => {
                let joints_rest_m = self.model.body().shaped(&shape).joints_m;
                let shares = controls.shares(self.model.feature_kind());
                let responds = !shares.are_predicted();
                let predictor = &networks.predictor;
                Some(tissue.read(predictor, &mut reader, &joints_rest_m, responds)?)
            }
            _ => None,
        };
        reader.finish()?;

        self.set_shape(&shape)?;
        self.set_controls(&controls)?;
        self.scale = scale;
        self.clock = clock;
        self.conditioner.reset();
        self.set_enabled(enabled);
        self.unsettled = unsettled;
        if let (Some(tissue), Some(memory)) = (&mut self.tissue, memory) {
            tissue.remember(memory);
        }
        self.apply();
        if let Some(pose) = self.clock.pose() {
            self.skin = skin::scaled(pose, &self.figure.joints_rest_m, self.scale);
            self.skin_matrices = skin::matrices(&self.skin);
        }
        Ok(())
    }

    pub(crate) fn apply(&mut self) {
        if !self.enabled {
            return;
        }
        if let Some(tissue) = &self.tissue {
            self.surface.apply(
                self.model.topology(),
                &self.figure,
                self.model.soft_vertices(),
                tissue.shown_m(),
                &self.vertex_controls,
            );
        }
    }

    fn update_vertex_controls(&mut self) {
        self.model
            .vertex_controls(&self.controls, &mut self.vertex_controls);
    }
}

fn checked_shape(shape: &[f32]) -> Result<[f32; SHAPE_COUNT], RuntimeError> {
    let invalid = |problem: String| RuntimeError::InvalidShape {
        expected: SHAPE_COUNT,
        problem,
    };
    let shape: [f32; SHAPE_COUNT] = shape
        .try_into()
        .map_err(|_| invalid(format!("{} coefficients", shape.len())))?;
    match shape
        .iter()
        .position(|beta| !beta.is_finite() || beta.abs() > MAX_SHAPE_COEFFICIENT)
    {
        None => Ok(shape),
        Some(idx) => Err(invalid(format!("{} as coefficient {idx}", shape[idx]))),
    }
}

fn check_scale(scale: f64) -> Result<(), RuntimeError> {
    in_range(
        "the scale",
        scale as f32,
        MIN_SCALE as f32,
        MAX_SCALE as f32,
    )
}
