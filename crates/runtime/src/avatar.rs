//! One body: poses and time steps in, a surface that moves out.

mod decoding;
mod member;
mod memory;
mod settings;

use std::sync::Arc;

use dynaskin_body::{
    JOINT_COUNT, MAX_SHAPE_COEFFICIENT, Pose, SHAPE_COUNT, SkinMatrices, Skinning, skin_surface,
};
use glam::{Mat4, Vec3};

use crate::RuntimeError;
use crate::controls::Controls;
use crate::model::Model;
use crate::pipeline::{Pipeline, StageSeconds, Stopwatch};
use crate::shapes::ShapedModel;
use crate::surface::{PosedRest, RestSurface, Surface, VertexControls, skinning};
use crate::timeline::{Settled, Timeline};
use crate::tissue::Tissue;
pub use decoding::Decoding;
pub(crate) use member::step_all;

/// Smallest scale of an avatar.
pub const MIN_SCALE: f64 = 0.1;

/// Largest scale of an avatar.
pub const MAX_SCALE: f64 = 10.0;

/// What one step did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct StepReport {
    /// Ticks of the model that the step ran.
    pub ticks: usize,
    /// Why the step settled the tissue, if it did.
    pub settled: Option<Settled>,
    /// Time of each stage; zeros unless the step was given a stopwatch.
    pub seconds: StageSeconds,
}

/// One body, stepped by its host.
///
/// After an error the avatar can still be used: the host may continue with the next pose.
#[derive(Debug)]
pub struct Avatar {
    model: Arc<Model>,
    shaped: Arc<ShapedModel>,
    timeline: Timeline,
    /// None without networks: the avatar is then plainly skinned.
    soft: Option<Soft>,
    surface: Surface,
    /// None for a body without pose correctives.
    posed: Option<PosedRest>,
    revision: u32,
    decoding: Decoding,
    /// Whether `surface` is older than what the tissue shows.
    is_behind: bool,
    surface_revision: u32,
    controls_revision: u32,
    controls: Controls,
    /// See [`Avatar::set_max_strain`].
    max_strain: Option<f32>,
    skinning: Skinning,
    skin: SkinMatrices,
    skin_matrices: [Mat4; JOINT_COUNT],
    /// Both empty until they are asked for: hosts that skin on a graphics card never do.
    skinned_positions_m: Vec<Vec3>,
    skinned_normals: Vec<Vec3>,
}

/// What an avatar has where its model has networks.
#[derive(Debug)]
struct Soft {
    tissue: Tissue,
    /// Of each soft vertex.
    vertex_controls: VertexControls,
    /// Runs the networks where the avatar is stepped by itself; made with the first such step.
    pipeline: Option<Box<Pipeline>>,
}

impl Avatar {
    /// An avatar of `model` with the shape coefficients `shape` (β, in standard deviations).
    ///
    /// # Errors
    /// [`RuntimeError::InvalidShape`]; [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]
    /// from running the networks at rest.
    pub fn new(model: Arc<Model>, shape: &[f32]) -> Result<Self, RuntimeError> {
        let shaped = model.shaped(checked_shape(shape)?)?;
        let soft = model.soft().zip(shaped.tissue.as_ref());
        let soft = soft.map(|(soft, rest)| Soft {
            tissue: Tissue::new(soft.feature_kind(), rest),
            vertex_controls: VertexControls::none(model.soft_vertices().len()),
            pipeline: None,
        });
        let skin = SkinMatrices::new(&Pose::REST, &shaped.joints_rest_m);
        let mut avatar = Self {
            surface: Surface::new(&shaped.surface),
            posed: model
                .pose_correctives()
                .map(|correctives| PosedRest::new(correctives, &shaped.surface)),
            shaped,
            timeline: Timeline::default(),
            soft,
            revision: 0,
            decoding: Decoding::InStep,
            is_behind: false,
            surface_revision: 0,
            controls_revision: 0,
            max_strain: None,
            skinning: Skinning::default(),
            controls: Controls::default(),
            skin_matrices: skinning::matrices(&skin),
            skin,
            skinned_positions_m: Vec::new(),
            skinned_normals: Vec::new(),
            model,
        };
        avatar.update_vertex_controls();
        Ok(avatar)
    }

    /// Advances by `dt_seconds` to `pose`, whose translation is in metres of the world.
    ///
    /// The first pose, and the pose after a stall or a cut, is treated as if the body had stood in it
    /// for a long time; after a stall or a cut, the previous offsets fade into this over
    /// [`crate::FADE_SECONDS`]. A step of 0 s (a pause) changes only the skin matrices. For slow
    /// motion, scale the time steps with the poses.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: the avatar stays
    /// unchanged. [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: the surface stays
    /// unchanged, and the next pose counts as the first.
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
        let pipeline = match (&mut self.soft, self.model.soft()) {
            (Some(own), Some(soft)) => Some(match own.pipeline.take() {
                Some(pipeline) => pipeline,
                None => Box::new(Pipeline::new(&soft.networks)?),
            }),
            _ => None,
        };
        let mut pipeline = pipeline;
        let stepped = step_all(pipeline.as_deref_mut(), &mut [self], stopwatch);
        if let Some(soft) = &mut self.soft {
            soft.pipeline = pipeline;
        }
        Ok(StepReport {
            seconds: stepped?,
            ..self.report()
        })
    }

    /// Changes the body's shape; the motion continues. The surface follows at once.
    ///
    /// # Errors
    /// As [`Self::new`]; the avatar keeps its shape.
    pub fn set_shape(&mut self, shape: &[f32]) -> Result<(), RuntimeError> {
        let shaped = self.model.shaped(checked_shape(shape)?)?;
        if let (Some(soft), Some(rest)) = (&mut self.soft, &shaped.tissue) {
            soft.tissue.set_rest(rest);
        }
        self.shaped = shaped;
        self.revision = self.revision.wrapping_add(1);
        if let Some(posed) = &mut self.posed {
            posed.change_shape();
            self.correct();
        } else {
            self.surface
                .set_rest(self.model.topology(), &self.shaped.surface);
            self.apply();
        }
        Ok(())
    }

    /// Changes with every [`Self::set_shape`] and [`Self::restore`], so that code that depends on the shape
    /// need not compare coefficients.
    pub fn revision(&self) -> u32 {
        self.revision
    }

    /// Shows offsets of the host, such as recorded ones, on an avatar without networks; they
    /// stay until the next call. Positions and normals follow; the shape must not change meanwhile.
    ///
    /// `offsets_rest_m` has three numbers for each vertex of the body, in metres, in the rest pose.
    /// Controls do not change them: they apply to predicted offsets only.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidOffsets`] for another count, numbers that are not finite, and on an
    /// avatar with networks; the surface then stays unchanged.
    pub fn show_offsets(&mut self, offsets_rest_m: &[f32]) -> Result<(), RuntimeError> {
        let invalid = |problem: String| RuntimeError::InvalidOffsets { problem };
        if self.soft.is_some() {
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
        self.surface.show(
            self.model.topology(),
            without_offsets(&self.shaped, &self.posed),
            offsets_rest_m,
        );
        self.surface_revision = self.surface_revision.wrapping_add(1);
        Ok(())
    }

    /// The next pose counts as the first.
    pub fn reset(&mut self) {
        self.timeline.reset();
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Shape coefficients β in standard deviations.
    pub fn shape(&self) -> &[f32; SHAPE_COUNT] {
        &self.shaped.shape
    }

    /// Rest joint positions of the shape, in metres.
    pub fn joints_rest_m(&self) -> &[Vec3; JOINT_COUNT] {
        &self.shaped.joints_rest_m
    }

    /// Offsets of all vertices in the rest pose, in metres, after gains and limits. These and the next two may
    /// be those of an earlier step with [`Decoding::OnDemand`].
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

    /// `world_from_rest` of each joint at the last pose: maps a rest position in metres to a world
    /// position in metres.
    pub fn skin_matrices(&self) -> &[Mat4; JOINT_COUNT] {
        &self.skin_matrices
    }

    /// Skins positions and normals to the last pose, as [`Self::set_skinning`] says. Hosts that skin on
    /// a GPU do not need it.
    pub fn skin(&mut self) -> (&[Vec3], &[Vec3]) {
        self.update_surface();
        // No longer than the first time: hosts keep the arrays' addresses.
        let count = self.surface.positions_m.len();
        self.skinned_positions_m.resize(count, Vec3::ZERO);
        self.skinned_normals.resize(count, Vec3::ZERO);
        skin_surface(
            self.skinning,
            &self.model.body().skin,
            &self.skin,
            (&self.surface.positions_m, &self.surface.normals),
            (&mut self.skinned_positions_m, &mut self.skinned_normals),
        );
        (&self.skinned_positions_m, &self.skinned_normals)
    }

    /// World positions (metres) and unit normals as [`Self::skin`] last computed them; empty before its first
    /// call.
    pub fn skinned(&self) -> (&[Vec3], &[Vec3]) {
        (&self.skinned_positions_m, &self.skinned_normals)
    }

    /// Brings the surface to what the tissue shows, unless that is left to whoever asks for it; whether there
    /// is any tissue that does.
    fn apply(&mut self) -> bool {
        self.surface_revision = self.surface_revision.wrapping_add(1);
        let Some(soft) = self.soft.as_ref().filter(|_| self.timeline.enabled()) else {
            return false;
        };
        let Some(shown_m) = soft.tissue.shown_m() else {
            self.is_behind = true;
            return true;
        };
        self.is_behind = false;
        let rest = without_offsets(&self.shaped, &self.posed);
        self.surface
            .apply(self.model.topology(), rest, shown_m, &soft.vertex_controls);
        if let Some(max_strain) = self.max_strain {
            self.surface
                .hold_together(self.model.topology(), self.model.guard(), rest, max_strain);
        }
        true
    }

    /// Corrects the surface as the pose says, and shows the tissue on it.
    fn correct(&mut self) {
        let Some(posed) = &mut self.posed else {
            return;
        };
        posed.update(&self.shaped.surface);
        self.surface.set_positions(posed.surface());
        if !self.apply() {
            let rest = without_offsets(&self.shaped, &self.posed);
            self.surface.update_normals(self.model.topology(), rest);
        }
    }
}

/// The surface that offsets are added to.
fn without_offsets<'a>(shaped: &'a ShapedModel, posed: &'a Option<PosedRest>) -> &'a RestSurface {
    posed
        .as_ref()
        .map_or(&shaped.surface, |posed| posed.surface())
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
