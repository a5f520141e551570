//! What a host sets on an avatar: controls, limits, scale, visibility and the source of its poses.

use dynaskin_body::{Region, Skinning};
use dynaskin_conditioning::{Diagnosis, PoseSource};

use super::{Avatar, MAX_SCALE, MIN_SCALE};
use crate::RuntimeError;
use crate::controls::{Controls, in_range};
use crate::surface::{PosedRest, vertex_controls};
use crate::timeline::{Change, Detail};

/// Smallest and largest limit of how far neighbouring vertices move against each other.
const MIN_STRAIN: f32 = 0.05;
const MAX_STRAIN: f32 = 4.0;

impl Avatar {
    /// Changes all controls; the surface follows at once. The networks also run at a strength of 0,
    /// so the motion of the tissue is correct at once when the strength is raised again.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`]; the first time that stiffness or damping is changed on a
    /// model, [`RuntimeError::Inference`], [`RuntimeError::NonFinite`] from measuring the natural
    /// frequencies of its regions. The avatar keeps its controls.
    pub fn set_controls(&mut self, controls: &Controls) -> Result<(), RuntimeError> {
        controls.check()?;
        if let (Some(own), Some(soft)) = (&mut self.soft, self.model.soft()) {
            let shares = controls.shares(soft.learned());
            let filters = soft.filters(self.model.body(), &shares)?;
            let root_inertia = controls.root_inertia.into();
            if filters.is_some() {
                own.tissue.decode(|| self.model.linear_decoder());
            }
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

    /// Changes only [`Controls::strength`].
    ///
    /// # Errors
    /// As [`Self::set_controls`].
    pub fn set_strength(&mut self, strength: f32) -> Result<(), RuntimeError> {
        self.set_controls(&Controls {
            strength,
            ..self.controls
        })
    }

    /// Changes only the gain of one region.
    ///
    /// # Errors
    /// As [`Self::set_controls`].
    pub fn set_region_gain(&mut self, region: Region, gain: f32) -> Result<(), RuntimeError> {
        let mut controls = self.controls;
        controls.regions[region as usize].gain = gain;
        self.set_controls(&controls)
    }

    /// Limits how far neighbouring vertices of soft skin move relative to each other, as a share of their
    /// distance; None, the default, for no limit. Below 1 no skin turns inside out along its
    /// edges for any controls and shape, and skin within the limit does not change. The surface
    /// follows at once; not part of a saved state.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`] outside 0.05..=4.
    pub fn set_max_strain(&mut self, max_strain: Option<f32>) -> Result<(), RuntimeError> {
        if let Some(got) = max_strain {
            in_range("the largest strain", got, MIN_STRAIN, MAX_STRAIN)?;
        }
        self.max_strain = max_strain;
        self.choose_form();
        self.apply();
        Ok(())
    }

    /// The limit of [`Self::set_max_strain`].
    pub fn max_strain(&self) -> Option<f32> {
        self.max_strain
    }

    /// Whether pose correctives (SMPL's pose blend shapes) are added; always false on a body without pose
    /// correctives.
    pub fn pose_correctives(&self) -> bool {
        self.posed.as_ref().is_some_and(PosedRest::is_on)
    }

    /// Switches pose correctives on or off; on by default if the body has them, without effect if it has
    /// none. The surface follows at once; not part of a saved state.
    ///
    /// They are added to the rest positions with every step, before skinning, so [`Self::positions_rest_m`]
    /// and [`Self::normals_rest`] include them, and [`Self::offsets_rest_m`] does not.
    pub fn set_pose_correctives(&mut self, on: bool) {
        if let Some(posed) = &mut self.posed
            && posed.is_on() != on
        {
            posed.switch(on);
            self.correct();
        }
    }

    /// How [`Self::skin`] blends the motions of the joints.
    pub fn skinning(&self) -> Skinning {
        self.skinning
    }

    /// Sets that; linear by default. [`Self::skin`] follows with its next call, the surface in the rest pose
    /// does not depend on it; not part of a saved state.
    pub fn set_skinning(&mut self, skinning: Skinning) {
        self.skinning = skinning;
    }

    /// Makes the avatar `scale` times as large as its body, in metres of the world per metre of the body. All
    /// inputs of the networks are in lengths of the body, so a doll and a giant with poses to scale move
    /// alike. The motion continues; skin matrices follow with the next step.
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

    /// Metres of the world per metre of the body.
    pub fn scale(&self) -> f64 {
        self.timeline.scale()
    }

    /// Switches the tissue off, which saves its cost, or on, after which it starts settled.
    /// Use [`Self::set_strength`] to compare with and without tissue in mid-motion.
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

    /// Level of detail of the tissue.
    pub fn detail(&self) -> Detail {
        self.timeline.visibility.detail
    }

    /// Changes the level of detail. A [`crate::Crowd`] with a [`crate::LevelOfDetail`] does so itself.
    pub fn set_detail(&mut self, detail: Detail) {
        let change = self.timeline.change_visibility(|seen| seen.detail = detail);
        self.take_change(change);
    }

    /// Whether the avatar is visible.
    pub fn visible(&self) -> bool {
        self.timeline.visibility.visible
    }

    /// Sets whether the avatar is visible. While it is not, its tissue costs nothing and its surface
    /// does not change; steps still move the skeleton, but may be left out. The first step
    /// after it is visible again shows tissue that is settled in that step's pose.
    pub fn set_visible(&mut self, visible: bool) {
        let change = self
            .timeline
            .change_visibility(|seen| seen.visible = visible);
        self.take_change(change);
    }

    /// Distance from the camera in metres as last set; a [`crate::Crowd`] chooses the detail by it.
    pub fn distance_m(&self) -> f64 {
        self.timeline.visibility.distance_m
    }

    /// Sets the distance from the camera, in metres.
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
                self.is_behind = false;
                self.surface_revision = self.surface_revision.wrapping_add(1);
                self.correct();
            }
            _ => {}
        }
    }

    /// Sets where poses come from, which decides how they are resampled to an even clock and whether noise is
    /// removed. The next pose counts as the first. Not part of a saved state.
    pub fn set_pose_source(&mut self, source: PoseSource) {
        self.timeline.set_source(source);
    }

    /// Where poses come from.
    pub fn pose_source(&self) -> PoseSource {
        self.timeline.source()
    }

    /// What was detected about the pose source, and the latency of the tissue.
    pub fn source_diagnosis(&self) -> Diagnosis {
        self.timeline.diagnosis()
    }

    pub(super) fn update_vertex_controls(&mut self) {
        self.controls_revision = self.controls_revision.wrapping_add(1);
        if let Some(soft) = &mut self.soft {
            vertex_controls(
                self.model.body(),
                self.model.soft_vertices(),
                &self.controls,
                &mut soft.vertex_controls,
            );
        }
    }
}

pub(super) fn check_scale(scale: f64) -> Result<(), RuntimeError> {
    in_range(
        "the scale",
        scale as f32,
        MIN_SCALE as f32,
        MAX_SCALE as f32,
    )
}
