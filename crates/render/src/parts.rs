//! A body as a few boxes, one for each joint: enough to place its shadow.

use glam::{Mat4, Vec3, Vec4};

use crate::gpu_data::JOINT_COUNT;

/// The boxes of one body in the rest pose.
#[derive(Clone, Debug)]
pub(crate) struct RestParts {
    /// The joint that weighs most on each vertex.
    dominant_joints: Vec<u8>,
    /// Corners of the box around each joint's vertices in metres; empty boxes are inside out.
    boxes_m: [(Vec3, Vec3); JOINT_COUNT],
}

/// A box around a part of a body in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WorldPart {
    /// Lowest corner in metres.
    pub min_m: Vec3,
    /// Highest corner in metres.
    pub max_m: Vec3,
    /// Radius in metres of a sphere that stands for the part.
    pub radius_m: f32,
}

impl WorldPart {
    /// Centre and radius in metres of the sphere that stands for the part.
    pub fn sphere_m(&self) -> Vec4 {
        ((self.min_m + self.max_m) * 0.5).extend(self.radius_m)
    }
}

impl RestParts {
    /// Boxes of a body whose surface is not known yet.
    pub fn new(dominant_joints: Vec<u8>) -> Self {
        Self {
            dominant_joints,
            boxes_m: [(Vec3::INFINITY, Vec3::NEG_INFINITY); JOINT_COUNT],
        }
    }

    /// Boxes around the surface `positions_rest_m` (`[V][3]` flattened, metres).
    pub fn update(&mut self, positions_rest_m: &[f32]) {
        self.boxes_m = [(Vec3::INFINITY, Vec3::NEG_INFINITY); JOINT_COUNT];
        for (joint, position) in self
            .dominant_joints
            .iter()
            .zip(positions_rest_m.as_chunks::<3>().0)
        {
            let position = Vec3::from(*position);
            let (min, max) = &mut self.boxes_m[usize::from(*joint)];
            *min = min.min(position);
            *max = max.max(position);
        }
    }

    /// The boxes of joints that hold vertices, moved to the world.
    pub fn in_world<'a>(
        &'a self,
        world_from_rest: &'a [Mat4; JOINT_COUNT],
    ) -> impl Iterator<Item = WorldPart> + 'a {
        let boxes = self.boxes_m.iter().zip(world_from_rest);
        boxes
            .filter(|((min, max), _)| min.cmple(*max).all())
            .map(|(&(min, max), matrix)| {
                let half = (max - min) * 0.5;
                let center_m = matrix.transform_point3((min + max) * 0.5);
                // Half sizes of the axis-aligned box around the turned box.
                let reach = matrix.x_axis.truncate().abs() * half.x
                    + matrix.y_axis.truncate().abs() * half.y
                    + matrix.z_axis.truncate().abs() * half.z;
                // Limbs are long: the geometric mean says better how much sky they hide.
                let radius_m = (half.x * half.y * half.z).max(0.0).cbrt();
                WorldPart {
                    min_m: center_m - reach,
                    max_m: center_m + reach,
                    radius_m,
                }
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_part_is_boxed_where_it_went() {
        let mut parts = RestParts::new(vec![3, 3]);
        parts.update(&[0.0, 1.0, 0.0, 0.2, 2.0, 0.1]);
        let mut world_from_rest = [Mat4::IDENTITY; JOINT_COUNT];
        // A quarter turn about +Z takes (x, y) to (-y, x).
        world_from_rest[3] = Mat4::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let boxes: Vec<WorldPart> = parts.in_world(&world_from_rest).collect();
        assert_eq!(boxes.len(), 1);
        assert!((boxes[0].min_m - Vec3::new(-2.0, 0.0, 0.0)).length() < 1e-5);
        assert!((boxes[0].max_m - Vec3::new(-1.0, 0.2, 0.1)).length() < 1e-5);
    }
}
