//! Saved states of an avatar.

use dynaskin_body::{Pose, SHAPE_COUNT, SkinMatrices};
use serde::{Deserialize, Serialize};

use super::settings::check_scale;
use super::{Avatar, checked_shape};
use crate::RuntimeError;
use crate::controls::Controls;
use crate::state;
use crate::surface::skinning;
use crate::timeline::TimelineMemory;
use crate::tissue::Memory;

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
    /// The avatar's state: shape, scale, controls, clock and tissue. The same poses and
    /// time steps after [`Self::restore`] give the same numbers, bit for bit.
    /// It does not include level of detail, visibility and pose source, which belong to the host, nor poses that
    /// have not reached the tissue: if poses repeat, or come from a tracker or a
    /// network, the first pose after [`Self::restore`] is treated as if the body had stood in it for a long
    /// time.
    pub fn save(&self) -> Vec<u8> {
        let saved = Saved {
            shape: self.shaped.shape,
            controls: self.controls,
            timeline: self.timeline.memory(),
            tissue: self.soft.as_ref().map(|soft| {
                let undecoded = soft.tissue.shown_latents();
                let decoder = undecoded.and_then(|_| self.model.linear_decoder());
                soft.tissue.memory(decoder)
            }),
        };
        state::to_bytes(&self.model.fingerprint(), &saved)
    }

    /// Continues from where [`Self::save`] was called, on this avatar or another of the same model.
    /// The skin matrices are those of the last step that took time, or of the rest pose if there was none
    /// since the avatar was made or reset.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidState`] for bytes that were changed, truncated, or saved by another version
    /// or with another model; [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidShape`],
    /// [`RuntimeError::InvalidControl`] for unusable values in them. The avatar stays unchanged.
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
}
