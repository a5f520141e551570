//! The camera.

use glam::{
    Mat4, Vec3,
    camera::rh::{proj::directx, view},
};

use crate::RenderError;

/// A perspective camera in the world (metres, +Y up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the camera is.
    pub eye_world_m: Vec3,
    /// What it looks at.
    pub target_world_m: Vec3,
    /// Vertical field of view in radians, between 0.05 and 2.8.
    pub fov_y_radians: f32,
}

impl Default for Camera {
    /// In front of an adult who stands at the origin facing +Z.
    fn default() -> Self {
        Self {
            eye_world_m: Vec3::new(0.9, 1.35, 3.6),
            target_world_m: Vec3::new(0.0, 0.92, 0.0),
            fov_y_radians: 0.60,
        }
    }
}

/// Nearest and farthest drawn distance in metres. The far end covers the whole floor disc.
const NEAR_M: f32 = 0.05;
const FAR_M: f32 = 60.0;

impl Camera {
    /// All numbers finite, the field of view in range, eye and target at least 1 mm apart.
    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        let eye = self.eye_world_m.to_array();
        let target = self.target_world_m.to_array();
        crate::check::finite("the camera's eye", &eye)?;
        crate::check::finite("the camera's target", &target)?;
        crate::check::finite("the camera's field of view", &[self.fov_y_radians])?;
        let refuse = |what, value, expected: &str| {
            Err(RenderError::OutOfRange {
                what,
                index: 0,
                value: f64::from(value),
                expected: expected.into(),
            })
        };
        if !(0.05..=2.8).contains(&self.fov_y_radians) {
            return refuse(
                "the camera's field of view",
                self.fov_y_radians,
                "0.05 to 2.8 radians",
            );
        }
        let distance_m = self.eye_world_m.distance(self.target_world_m);
        if !(1e-3..1e6).contains(&distance_m) {
            return refuse(
                "the distance from eye to target",
                distance_m,
                "1 mm or more",
            );
        }
        Ok(())
    }

    /// Unit vector from the eye to the target.
    pub(crate) fn forward(&self) -> Vec3 {
        (self.target_world_m - self.eye_world_m).normalize()
    }

    /// Unit vector to the picture's right, level with the floor.
    pub(crate) fn right(&self) -> Vec3 {
        self.forward()
            .cross(Vec3::Y)
            .try_normalize()
            .unwrap_or(Vec3::X)
    }

    /// World to clip space (depth 0..1) for a picture of this width over height.
    pub(crate) fn clip_from_world(&self, aspect: f32) -> Mat4 {
        let up = self.right().cross(self.forward());
        let view = view::look_at_mat4(self.eye_world_m, self.target_world_m, up);
        directx::perspective(self.fov_y_radians, aspect, NEAR_M, FAR_M) * view
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_target_is_in_the_middle_also_from_straight_above() {
        for eye_world_m in [Vec3::new(0.0, 1.0, 3.0), Vec3::new(0.0, 5.0, 0.0)] {
            let camera = Camera {
                eye_world_m,
                ..Camera::default()
            };
            let clip = camera.clip_from_world(1.6) * camera.target_world_m.extend(1.0);
            assert!(
                clip.truncate().truncate().length() < 1e-4 * clip.w,
                "{clip}"
            );
            assert!(clip.z > 0.0 && clip.z < clip.w);
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let good = Camera::default();
        good.validate().unwrap();
        let same = Camera {
            eye_world_m: good.target_world_m,
            ..good
        };
        assert!(same.validate().is_err());
        assert!(
            Camera {
                fov_y_radians: 0.0,
                ..good
            }
            .validate()
            .is_err()
        );
        assert!(
            Camera {
                fov_y_radians: f32::NAN,
                ..good
            }
            .validate()
            .is_err()
        );
        assert!(
            Camera {
                eye_world_m: Vec3::INFINITY,
                ..good
            }
            .validate()
            .is_err()
        );
    }
}
