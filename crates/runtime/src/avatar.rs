//! One body on the stage: poses and time steps in, a surface that moves out.

use std::sync::Arc;

use dynaskin_body::{
    JOINT_COUNT, MAX_SHAPE_COEFFICIENT, Pose, Region, SHAPE_COUNT, SkinMatrices, skin_surface,
};
use dynaskin_conditioning::{Diagnosis, PoseSource};
use glam::{Mat4, Vec3};
use serde::{Deserialize, Serialize};

use crate::RuntimeError;
use crate::controls::{Controls, in_range};
use crate::model::Model;
use crate::pipeline::{Member, Pipeline, StageSeconds, Stopwatch};
use crate::shapes::ShapedModel;
use crate::state;
use crate::surface::{PosedRest, RestSurface, Surface, VertexControls, skinning, vertex_controls};
use crate::timeline::{Change, Detail, Settled, Showing, Shown, Timeline, TimelineMemory};
use crate::tissue::{Memory, Tissue};

/// Smallest scale of an avatar.
pub const MIN_SCALE: f64 = 0.1;

/// Largest scale of an avatar.
pub const MAX_SCALE: f64 = 10.0;

/// Smallest and largest limit of how far neighbouring vertices move against each other.
const MIN_STRAIN: f32 = 0.05;
const MAX_STRAIN: f32 = 4.0;

/// What one step did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct StepReport {
    /// Ticks of the model that the step ran.
    pub ticks: usize,
    /// Why the tissue was settled anew, if it was.
    pub settled: Option<Settled>,
    /// Where the time went; zeros unless the step was given a stopwatch.
    pub seconds: StageSeconds,
}

/// One body, stepped by its host.
///
/// After an error the avatar is still good: the host can go on with the next pose.
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
    controls: Controls,
    /// See [`Avatar::set_max_strain`].
    max_strain: Option<f32>,
    skin: SkinMatrices,
    skin_matrices: [Mat4; JOINT_COUNT],
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

/// All that a saved state holds.
#[derive(Debug, Serialize, Deserialize)]
struct Saved {
    shape: [f32; SHAPE_COUNT],
    controls: Controls,
    timeline: TimelineMemory,
    /// None without networks.
    tissue: Option<Memory>,
}

impl Avatar {
    /// An avatar of `model` with the shape coefficients `shape` (β, in standard deviations).
    ///
    /// # Errors
    /// [`RuntimeError::InvalidShape`]; [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]
    /// from running the networks at rest.
    pub fn new(model: Arc<Model>, shape: &[f32]) -> Result<Self, RuntimeError> {
        let shaped = model.shaped(checked_shape(shape)?)?;
        let vertex_count = model.body().vertex_count();
        let soft = model.soft().zip(shaped.tissue.as_ref());
        let soft = soft.map(|(soft, rest)| Soft {
            tissue: Tissue::new(soft.feature_kind(), rest),
            vertex_controls: VertexControls::none(model.soft_vertices().len()),
            pipeline: None,
        });
        let skin = SkinMatrices::new(&Pose::REST, &shaped.joints_rest_m);
        let mut avatar = Self {
            surface: Surface::new(&shaped.surface),
            posed: PosedRest::new(model.body(), &shaped.surface),
            shaped,
            timeline: Timeline::default(),
            soft,
            revision: 0,
            max_strain: None,
            controls: Controls::default(),
            skin_matrices: skinning::matrices(&skin),
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

    /// Changes the body's shape; the motion goes on. What is shown follows at once.
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
        if self.posed.is_some() {
            self.correct();
        } else {
            self.surface
                .set_rest(self.model.topology(), &self.shaped.surface);
            self.apply();
        }
        Ok(())
    }

    /// Counts the shapes that the avatar was given: another number after every [`Self::set_shape`] and
    /// [`Self::restore`], so that whoever depends on the shape need not compare it.
    pub fn revision(&self) -> u32 {
        self.revision
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
        if let (Some(own), Some(soft)) = (&mut self.soft, self.model.soft()) {
            let shares = controls.shares(soft.learned());
            let filters = soft.filters(self.model.body(), &shares)?;
            let root_inertia = controls.root_inertia.into();
            own.tissue
                .set_controls(&shares.materials, filters, root_inertia);
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

    /// Limits how far neighbouring vertices of soft skin move against each other, as a share of what lies
    /// between them; None, as at the start, for no limit. Below 1 no skin turns inside out along its
    /// edges, whatever controls and shape ask for, and what is within the limit stays exactly as it is. What
    /// is shown follows at once; no part of a saved state.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`] outside 0.05..=4.
    pub fn set_max_strain(&mut self, max_strain: Option<f32>) -> Result<(), RuntimeError> {
        if let Some(got) = max_strain {
            in_range("the largest strain", got, MIN_STRAIN, MAX_STRAIN)?;
        }
        self.max_strain = max_strain;
        self.apply();
        Ok(())
    }

    /// The limit of [`Self::set_max_strain`].
    pub fn max_strain(&self) -> Option<f32> {
        self.max_strain
    }

    /// Whether poses correct the skin as the body model says (SMPL's pose blend shapes); always false on a
    /// body without pose correctives.
    pub fn pose_correctives(&self) -> bool {
        self.posed.as_ref().is_some_and(PosedRest::is_on)
    }

    /// Switches that; it is on at the start where the body has pose correctives, and nothing changes where
    /// it has none. What is shown follows at once; no part of a saved state.
    ///
    /// They are added to the rest positions with every step, before skinning, so [`Self::positions_rest_m`]
    /// and [`Self::normals_rest`] hold them, and [`Self::offsets_rest_m`] do not.
    pub fn set_pose_correctives(&mut self, on: bool) {
        if let Some(posed) = &mut self.posed
            && posed.is_on() != on
        {
            posed.switch(on);
            self.correct();
        }
    }

    /// Makes the avatar `scale` times as large as its body; the world's metre stays. All
    /// inputs of the networks are in lengths of the body, so a doll and a giant whose poses are to scale move
    /// alike. The motion goes on; skin matrices follow with the next step.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`] outside [`MIN_SCALE`]..=[`MAX_SCALE`].
    pub fn set_scale(&mut self, scale: f64) -> Result<(), RuntimeError> {
        check_scale(scale)?;
        let ratio = self.timeline.set_scale(scale);
        if let Some(soft) = &mut self.soft {
            soft.tissue.rescale(ratio);
        }
        Ok(())
    }

    /// Metres of the world in a metre of the body.
    pub fn scale(&self) -> f64 {
        self.timeline.scale()
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
        Ok(())
    }

    /// Switches the tissue off, which saves its cost, or on, after which it starts settled.
    /// [`Self::set_strength`] compares with and without tissue in mid-motion.
    pub fn set_enabled(&mut self, enabled: bool) {
        if self.timeline.enabled() && !enabled {
            self.take_change(Some(Change::Clears));
        }
        self.timeline.set_enabled(enabled);
    }

    /// Whether the tissue is switched on.
    pub fn enabled(&self) -> bool {
        self.timeline.enabled()
    }

    /// The next pose counts as the first.
    pub fn reset(&mut self) {
        self.timeline.reset();
    }

    /// How much work the tissue is worth.
    pub fn detail(&self) -> Detail {
        self.timeline.visibility.detail
    }

    /// Changes that. A [`crate::Crowd`] with a level of detail does it by itself.
    pub fn set_detail(&mut self, detail: Detail) {
        let change = self.timeline.change_visibility(|seen| seen.detail = detail);
        self.take_change(change);
    }

    /// Whether anybody sees the avatar.
    pub fn visible(&self) -> bool {
        self.timeline.visibility.visible
    }

    /// Says whether anybody sees the avatar. Out of sight its tissue costs nothing and its surface
    /// stays as it is; steps go on moving the skeleton, but may also be left out. The first step
    /// back in sight shows, at once, tissue that has settled in that step's pose.
    pub fn set_visible(&mut self, visible: bool) {
        let change = self
            .timeline
            .change_visibility(|seen| seen.visible = visible);
        self.take_change(change);
    }

    /// Metres from the camera as the host last said, by which a [`crate::Crowd`] chooses the detail.
    pub fn distance_m(&self) -> f64 {
        self.timeline.visibility.distance_m
    }

    /// Says how far the avatar is from the camera, in metres.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidDistance`] for a negative number or NaN.
    pub fn set_distance_m(&mut self, distance_m: f64) -> Result<(), RuntimeError> {
        if distance_m >= 0.0 {
            self.timeline.visibility.distance_m = distance_m;
            Ok(())
        } else {
            Err(RuntimeError::InvalidDistance { got: distance_m })
        }
    }

    /// Shows the next surface of half detail at tick `ticks` from now.
    pub(crate) fn take_turn(&mut self, ticks: usize) {
        self.timeline.visibility.take_turn(ticks);
    }

    fn take_change(&mut self, change: Option<Change>) {
        match (change, &mut self.soft) {
            (Some(Change::FadesOut), Some(soft)) => soft.tissue.begin_fading_out(),
            (Some(Change::Clears), soft) => {
                if let Some(soft) = soft {
                    soft.tissue.clear();
                }
                self.surface.clear(&self.shaped.surface);
                self.correct();
            }
            _ => {}
        }
    }

    /// Checks a step to `pose` (in metres of the world) and decides what happens in it.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: nothing has changed.
    pub(crate) fn plan(&mut self, pose: &Pose, dt_seconds: f64) -> Result<(), RuntimeError> {
        self.timeline.plan(pose, dt_seconds)
    }

    /// What became of the last step.
    pub(crate) fn report(&self) -> StepReport {
        let (ticks, settled) = self.timeline.report();
        StepReport {
            ticks,
            settled,
            seconds: StageSeconds::default(),
        }
    }

    /// Whether the last step changed the surface.
    pub(crate) fn has_shown(&self) -> bool {
        self.timeline.has_shown()
    }

    /// Says where poses come from, which decides how they are put on an even clock and whether noise is
    /// taken off. The next pose counts as the first. The source is the host's: no saved state holds it.
    pub fn set_pose_source(&mut self, source: PoseSource) {
        self.timeline.set_source(source);
    }

    /// Where poses come from.
    pub fn pose_source(&self) -> PoseSource {
        self.timeline.source()
    }

    /// What was found out about the source of poses, and how late the tissue is for it.
    pub fn source_diagnosis(&self) -> Diagnosis {
        self.timeline.diagnosis()
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
        skin_surface(
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
    /// The level of detail, visibility and the source of poses are the host's and not in it. Poses that are
    /// on their way to the tissue are not in it either: where they repeat, or come from a tracker or a
    /// network, the first pose after [`Self::restore`] is taken as one in which the body has stood for
    /// long.
    pub fn save(&self) -> Vec<u8> {
        let saved = Saved {
            shape: self.shaped.shape,
            controls: self.controls,
            timeline: self.timeline.memory(),
            tissue: self.soft.as_ref().map(|soft| soft.tissue.memory()),
        };
        state::to_bytes(&self.model.fingerprint(), &saved)
    }

    /// Goes on from where [`Self::save`] was called, on this avatar or another of the same model.
    /// The skin matrices are those of the last step that took time, or of the rest pose where there was none
    /// since the avatar was made or reset.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidState`] for bytes that were changed, cut, or saved by another version
    /// or with another model; [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidShape`],
    /// [`RuntimeError::InvalidControl`] for what cannot be used in them. The avatar stays as it was.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), RuntimeError> {
        let saved: Saved = state::from_bytes(&self.model.fingerprint(), bytes)?;
        let Saved {
            shape,
            controls,
            timeline: time,
            tissue: memory,
        } = saved;
        checked_shape(&shape)?;
        check_scale(time.scale)?;
        controls.check()?;
        time.check()?;
        match (&self.soft, self.model.soft(), &memory) {
            (Some(own), Some(soft), Some(memory)) => {
                let responds = !controls.shares(soft.learned()).are_predicted();
                own.tissue.check(memory, responds)?;
            }
            (None, _, None) => {}
            _ => return Err(state::invalid("it does not have this model's tissue")),
        }

        self.set_shape(&shape)?;
        self.set_controls(&controls)?;
        self.set_enabled(time.enabled);
        self.timeline.remember(time);
        if let (Some(soft), Some(memory)) = (&mut self.soft, memory) {
            soft.tissue.remember(memory);
        }
        self.apply();
        let joints_rest_m = &self.shaped.joints_rest_m;
        self.skin = match self.timeline.pose() {
            Some(pose) => skinning::scaled(pose, joints_rest_m, self.timeline.scale()),
            None => SkinMatrices::new(&Pose::REST, joints_rest_m),
        };
        self.skin_matrices = skinning::matrices(&self.skin);
        if let Some(posed) = &mut self.posed {
            posed.take_pose(self.timeline.pose().unwrap_or(&Pose::REST));
            self.correct();
        }
        Ok(())
    }

    /// Brings the surface to what the tissue shows; whether there is any tissue that does.
    fn apply(&mut self) -> bool {
        let Some(soft) = self.soft.as_ref().filter(|_| self.timeline.enabled()) else {
            return false;
        };
        let rest = without_offsets(&self.shaped, &self.posed);
        self.surface.apply(
            self.model.topology(),
            rest,
            soft.tissue.shown_m(),
            &soft.vertex_controls,
        );
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
        posed.update(self.model.body(), &self.shaped.surface);
        self.surface.set_positions(posed.surface());
        if !self.apply() {
            let rest = without_offsets(&self.shaped, &self.posed);
            self.surface.update_normals(self.model.topology(), rest);
        }
    }

    fn update_vertex_controls(&mut self) {
        if let Some(soft) = &mut self.soft {
            vertex_controls(
                self.model.body(),
                self.model.soft_vertices(),
                &self.controls,
                &mut soft.vertex_controls,
            );
        }
    }

    /// Ends the step: the clock moves on and the skeleton with it.
    fn commit(&mut self) {
        let scale = self.timeline.scale();
        let pose = self.timeline.commit();
        self.skin = skinning::scaled(pose, &self.shaped.joints_rest_m, scale);
        self.skin_matrices = skinning::matrices(&self.skin);
        if let Some(posed) = &mut self.posed {
            posed.take_pose(pose);
            // Out of sight the surface stays as it is.
            if posed.is_on() && self.timeline.visibility.visible {
                self.correct();
            }
        }
    }
}

/// The surface that offsets are added to.
fn without_offsets<'a>(shaped: &'a ShapedModel, posed: &'a Option<PosedRest>) -> &'a RestSurface {
    posed
        .as_ref()
        .map_or(&shaped.surface, |posed| posed.surface())
}

impl Member for Avatar {
    fn begin_settling(&mut self) -> Option<&mut Tissue> {
        let tissue = &mut self.soft.as_mut()?.tissue;
        tissue.begin_settling(self.timeline.settling_pose()?);
        Some(tissue)
    }

    fn begin_tick(&mut self, index: usize) -> Option<&mut Tissue> {
        let tissue = &mut self.soft.as_mut()?.tissue;
        tissue.push_pose(&self.timeline.tick_pose(index)?);
        Some(tissue)
    }

    fn begin_showing(&mut self) -> Option<&mut Tissue> {
        let tissue = &mut self.soft.as_mut()?.tissue;
        let decodes = match self.timeline.begin_showing()? {
            Showing::Settled => {
                tissue.settle();
                true
            }
            Showing::Between(phase) => tissue.begin_showing(phase),
        };
        decodes.then_some(tissue)
    }

    fn show(&mut self) {
        let Some(soft) = &mut self.soft else {
            return;
        };
        let changed = match self.timeline.shown() {
            Some(Shown::FadesOut(dt_seconds)) => soft.tissue.fade_out(dt_seconds),
            Some(Shown::Settled { fades }) => {
                soft.tissue.show_settled(fades);
                true
            }
            Some(Shown::Moved(seconds)) => {
                soft.tissue.show(seconds);
                true
            }
            None => false,
        };
        // Where the pose corrects the surface, the end of the step shows both.
        if changed && !self.pose_correctives() {
            self.apply();
        }
    }
}

/// Moves `avatars` of one model on by the steps they have planned. Without networks there is no
/// `pipeline`.
///
/// # Errors
/// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: some surfaces may have moved on, and
/// for all avatars the next pose counts as the first.
pub(crate) fn step_all(
    pipeline: Option<&mut Pipeline>,
    avatars: &mut [&mut Avatar],
    stopwatch: Stopwatch<'_>,
) -> Result<StageSeconds, RuntimeError> {
    let mut seconds = StageSeconds::default();
    if let Some(pipeline) = pipeline
        && let Err(error) = pipeline.run(avatars, &mut seconds, stopwatch)
    {
        // The states may be halfway between two ticks.
        for avatar in avatars {
            avatar.reset();
        }
        return Err(error);
    }
    let start = stopwatch();
    for avatar in avatars.iter_mut() {
        avatar.commit();
    }
    seconds.skin = stopwatch() - start;
    Ok(seconds)
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
