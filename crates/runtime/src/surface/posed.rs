//! The surface without offsets where pose correctives move it.

use std::sync::Arc;

use dynaskin_body::{Pose, PoseCorrectives};

use super::RestSurface;

/// Of one avatar whose body has pose correctives.
#[derive(Debug)]
pub(crate) struct PosedRest {
    correctives: Arc<PoseCorrectives>,
    /// The pose that was shown last.
    pose: Pose,
    /// Whether that pose corrects the surface.
    is_on: bool,
    /// Whether the surface is that of the pose, the switch and the avatar's shape.
    is_current: bool,
    /// Whether the tissue has moved since the last [`Self::update`].
    tissue_moved: bool,
    surface: RestSurface,
}

impl PosedRest {
    /// In the rest pose, where nothing is corrected.
    pub fn new(correctives: &Arc<PoseCorrectives>, rest: &RestSurface) -> Self {
        Self {
            correctives: Arc::clone(correctives),
            pose: Pose::REST,
            is_on: true,
            is_current: true,
            tissue_moved: false,
            surface: rest.clone(),
        }
    }

    /// Whether poses correct the surface.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Switches that; the surface follows with [`Self::update`].
    pub fn switch(&mut self, on: bool) {
        self.is_on = on;
        self.is_current = false;
    }

    /// Takes over a pose; the surface follows with [`Self::update`].
    pub fn take_pose(&mut self, pose: &Pose) {
        // Where the body is corrects nothing.
        self.is_current &= self.pose.parent_from_joint == pose.parent_from_joint;
        self.pose.clone_from(pose);
    }

    /// The avatar has another shape; the surface follows with [`Self::update`].
    pub fn change_shape(&mut self) {
        self.is_current = false;
    }

    /// The tissue that is shown on the surface has moved.
    pub fn move_tissue(&mut self) {
        self.tissue_moved = true;
    }

    /// Whether what is shown is another surface than at the last [`Self::update`].
    pub fn is_due(&self) -> bool {
        !self.is_current || self.tissue_moved
    }

    /// Corrects `rest`, the surface of the avatar's shape, as the pose says.
    pub fn update(&mut self, rest: &RestSurface) {
        self.tissue_moved = false;
        if self.is_current {
            return;
        }
        let positions_m = &mut self.surface.positions_m;
        positions_m.copy_from_slice(&rest.positions_m);
        if self.is_on {
            self.correctives.add(&self.pose, positions_m);
        }
        self.is_current = true;
    }

    /// The corrected surface. Its own normals are those of the shape.
    pub fn surface(&self) -> &RestSurface {
        &self.surface
    }
}
