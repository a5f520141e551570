//! The surface without offsets where pose correctives move it.

use dynaskin_body::{BodyModel, Pose};

use super::RestSurface;

/// Of one avatar whose body has pose correctives.
#[derive(Debug)]
pub(crate) struct PosedRest {
    /// The pose that was shown last.
    pose: Pose,
    /// Whether that pose corrects the surface.
    is_on: bool,
    surface: RestSurface,
}

impl PosedRest {
    /// In the rest pose, where nothing is corrected; none for a body without pose correctives.
    pub fn new(body: &BodyModel, rest: &RestSurface) -> Option<Self> {
        (!body.pose_dirs_m.is_empty()).then(|| Self {
            pose: Pose::REST,
            is_on: true,
            surface: rest.clone(),
        })
    }

    /// Whether poses correct the surface.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Switches that; the surface follows with [`Self::update`].
    pub fn switch(&mut self, on: bool) {
        self.is_on = on;
    }

    /// Takes over a pose; the surface follows with [`Self::update`].
    pub fn take_pose(&mut self, pose: &Pose) {
        self.pose.clone_from(pose);
    }

    /// Corrects `rest`, the surface of the avatar's shape, as the pose says.
    pub fn update(&mut self, body: &BodyModel, rest: &RestSurface) {
        let positions_m = &mut self.surface.positions_m;
        positions_m.copy_from_slice(&rest.positions_m);
        if self.is_on {
            body.add_pose_correctives(&self.pose, positions_m);
        }
    }

    /// The corrected surface. Its own normals are those of the shape.
    pub fn surface(&self) -> &RestSurface {
        &self.surface
    }
}
