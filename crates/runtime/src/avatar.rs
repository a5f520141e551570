//! One body on the stage: poses and time steps in, a surface that moves out.

use std::sync::Arc;

use dynaskin_body::{JOINT_COUNT, Pose, Region, SHAPE_COUNT, SkinMatrices};
use glam::{Mat4, Vec3};

use crate::RuntimeError;
use crate::clock::{Advance, Settled, TickClock};
use crate::controls::{Controls, in_range};
use crate::model::Model;
use crate::pose;
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
    model: Arc<Model>,
    shape: [f32; SHAPE_COUNT],
    joints_rest_m: [Vec3; JOINT_COUNT],
    surface: Surface,
    clock: TickClock,
    tissue: Option<Tissue>,
    /// Whether the tissue must be settled before it can be ticked.
    unsettled: bool,
    enabled: bool,
    /// Metres of the world in a metre of the body.
    scale: f64,
    controls: Controls,
    vertex_controls: Vec<VertexControls>,
    skin: SkinMatrices,
    skin_matrices: [Mat4; JOINT_COUNT],
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
        let shape = checked_shape(shape)?;
        let shaped = model.body().shaped(&shape);
        let vertex_count = model.body().vertex_count();
        let tissue = match model.networks() {
            Some(networks) => Some(Tissue::new(networks, &shaped.joints_m, &shape)?),
            None => None,
        };
        let skin = SkinMatrices::new(&Pose::REST, &shaped.joints_m);
        let mut avatar = Self {
            surface: Surface::new(model.topology(), shaped.positions_m),
            joints_rest_m: shaped.joints_m,
            shape,
            clock: TickClock::default(),
            tissue,
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
        let mut pose = pose::checked(pose)?;
        pose.root_translation_m /= self.scale;
        let pose = &pose;
        TickClock::check(dt_seconds)?;
        let mut seconds = StageSeconds::default();
        let mut advance = self.clock.plan(pose, dt_seconds);
        if self.unsettled && !matches!(advance, Advance::Settle(_)) {
            advance = Advance::Settle(Settled::FirstPose);
        }
        if self.enabled {
            let moved = self.advance_tissue(pose, dt_seconds, advance, &mut seconds, stopwatch);
            if let Err(error) = moved {
                // The state may be halfway between two ticks: start anew with the next pose.
                self.reset();
                return Err(error);
            }
        }
        self.clock.commit(pose, dt_seconds, advance);
        self.unsettled = !self.enabled;
        let start = stopwatch();
        self.skin = skin::scaled(pose, &self.joints_rest_m, self.scale);
        self.skin_matrices = skin::matrices(&self.skin);
        seconds.skin = stopwatch() - start;
        let (ticks, settled) = match advance {
            Advance::Settle(reason) => (0, Some(reason)),
            Advance::Tick(ticks) => (ticks.count, None),
        };
        Ok(StepReport {
            ticks,
            settled,
            seconds,
        })
    }

    /// Changes the body's shape; the motion goes on. What is shown follows at once.
    ///
    /// # Errors
    /// As [`Self::new`]; the avatar keeps its shape.
    pub fn set_shape(&mut self, shape: &[f32]) -> Result<(), RuntimeError> {
        let shape = checked_shape(shape)?;
        let shaped = self.model.body().shaped(&shape);
        if let Some(tissue) = &mut self.tissue {
            tissue.set_shape(&shaped.joints_m, &shape)?;
        }
        self.shape = shape;
        self.joints_rest_m = shaped.joints_m;
        self.surface
            .set_still(self.model.topology(), shaped.positions_m);
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

    /// Switches the tissue off, which saves its cost, or on, after which it starts settled.
    /// [`Self::set_strength`] compares with and without tissue in mid-motion.
    pub fn set_enabled(&mut self, enabled: bool) {
        if self.enabled && !enabled {
            self.surface.clear(self.model.topology());
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
        self.unsettled = true;
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Shape coefficients β in standard deviations.
    pub fn shape(&self) -> &[f32; SHAPE_COUNT] {
        &self.shape
    }

    /// Rest joint positions of the shape, in metres.
    pub fn joints_rest_m(&self) -> &[Vec3; JOINT_COUNT] {
        &self.joints_rest_m
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
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where the network's state cannot be read.
    pub fn save(&self) -> Result<Vec<u8>, RuntimeError> {
        let mut writer = Writer::new(&self.model);
        writer.floats(&self.shape);
        writer.double(self.scale);
        self.controls.write(&mut writer);
        writer.flag(self.enabled);
        writer.flag(self.unsettled);
        self.clock.write(&mut writer);
        if let Some(tissue) = &self.tissue {
            tissue.write(&mut writer)?;
        }
        Ok(writer.finish())
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
        let memory = match &self.tissue {
            Some(tissue) => {
                let joints_rest_m = self.model.body().shaped(&shape).joints_m;
                let responds = !controls.responds_as_predicted();
                Some(tissue.read(&mut reader, &joints_rest_m, responds)?)
            }
            None => None,
        };
        reader.finish()?;

        self.set_shape(&shape)?;
        self.set_controls(&controls)?;
        self.scale = scale;
        self.clock = clock;
        self.set_enabled(enabled);
        self.unsettled = unsettled;
        if let (Some(tissue), Some(memory)) = (&mut self.tissue, memory) {
            tissue.remember(memory);
        }
        self.apply();
        if let Some(pose) = self.clock.pose() {
            self.skin = skin::scaled(pose, &self.joints_rest_m, self.scale);
            self.skin_matrices = skin::matrices(&self.skin);
        }
        Ok(())
    }

    /// Ticks or settles the tissue and shows it.
    fn advance_tissue(
        &mut self,
        pose: &Pose,
        dt_seconds: f64,
        advance: Advance,
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        let Some(tissue) = &mut self.tissue else {
            return Ok(());
        };
        match advance {
            Advance::Settle(reason) => tissue.settle(pose, reason != Settled::FirstPose)?,
            Advance::Tick(_) if dt_seconds == 0.0 => return Ok(()),
            Advance::Tick(ticks) => tissue.tick(&self.clock, pose, ticks, seconds, stopwatch)?,
        }
        let start = stopwatch();
        if let Advance::Tick(_) = advance {
            let phase = self.clock.phase_after(dt_seconds, advance);
            tissue.show(phase, dt_seconds)?;
        }
        let decoded = stopwatch();
        self.apply();
        seconds.decode += decoded - start;
        seconds.apply = stopwatch() - decoded;
        Ok(())
    }

    fn apply(&mut self) {
        if !self.enabled {
            return;
        }
        if let Some(tissue) = &self.tissue {
            self.surface.apply(
                self.model.topology(),
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
