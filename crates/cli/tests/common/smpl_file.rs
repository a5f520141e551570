//! Files of SMPL's layouts made from a default body: nothing of a licensed file is here.

use std::path::Path;

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint};
use dynaskin_npz::Writer;
use glam::Vec3;

/// What a made file holds.
pub struct Made {
    pub template_m: Vec<Vec3>,
    pub joints_m: [Vec3; JOINT_COUNT],
    pub parents: Vec<i64>,
    pub has_pose_dirs: bool,
    pub smooth_pose_dirs: bool,
}

impl Made {
    pub fn of(body: &BodyModel) -> Self {
        let parent = |joint: &Joint| joint.parent().map_or(-1, |parent| parent as i64);
        Self {
            template_m: body.template_m.clone(),
            joints_m: body.joint_template_m,
            parents: Joint::ALL.iter().map(parent).collect(),
            has_pose_dirs: true,
            smooth_pose_dirs: false,
        }
    }

    /// Pose correctives that vary smoothly over the skin around each joint, as those of real bodies do, instead of
    /// from vertex to vertex.
    #[allow(dead_code, reason = "not all tests need it")]
    pub fn with_smooth_pose_dirs(mut self) -> Self {
        self.smooth_pose_dirs = true;
        self
    }

    /// What the rotation matrix entry `field` of all joints but the root moves a coordinate by, in metres.
    fn pose_dir_m(&self, vertex: usize, axis: usize, field: usize, fields: usize) -> f32 {
        if !self.smooth_pose_dirs {
            let at = (3 * vertex + axis) * fields + field;
            return 0.004 * (at as f32 * 0.618_034).sin();
        }
        let joint_m = self.joints_m[(field / 9 + 1).min(JOINT_COUNT - 1)];
        let distance_m = self.template_m[vertex].distance(joint_m);
        let direction = (field as f32 * 2.4 + axis as f32).sin();
        0.006 * (-(distance_m / 0.1).powi(2)).exp() * direction
    }

    /// As many joints as SMPL-H has: fifteen on each wrist instead of a hand.
    #[allow(dead_code, reason = "not all tests need it")]
    pub fn with_fingers(mut self) -> Self {
        self.parents.truncate(22);
        for wrist in [20, 21] {
            for _ in 0..5 {
                let first = self.parents.len() as i64;
                self.parents.extend([wrist, first, first + 1]);
            }
        }
        self
    }

    /// Writes it; fingers lie where the hand is.
    pub fn write(&self, body: &BodyModel, path: &Path) {
        let (n, joints) = (self.template_m.len(), self.parents.len());
        let source = |joint: usize| match joint {
            0..22 => joint,
            _ if joints == JOINT_COUNT => joint,
            _ if joint < 37 => Joint::LeftHand as usize,
            _ => Joint::RightHand as usize,
        };
        let mut writer = Writer::create(path).unwrap();
        let flat = |points: &[Vec3]| {
            points
                .iter()
                .flat_map(|p| p.to_array())
                .collect::<Vec<f32>>()
        };
        writer
            .array("v_template", &[n, 3], &flat(&self.template_m))
            .unwrap();
        let shapes: Vec<f32> = (0..n)
            .flat_map(|vertex| (0..3).map(move |axis| (vertex, axis)))
            .flat_map(|(vertex, axis)| {
                (0..12).map(move |k| match body.shape_dirs_m.get(k) {
                    Some(dirs) => dirs[vertex][axis],
                    None => 0.001,
                })
            })
            .collect();
        writer.array("shapedirs", &[n, 3, 12], &shapes).unwrap();
        if self.has_pose_dirs {
            let fields = 9 * (joints - 1);
            let poses: Vec<f32> = (0..n * 3 * fields)
                .map(|at| self.pose_dir_m(at / fields / 3, at / fields % 3, at % fields, fields))
                .collect();
            writer.array("posedirs", &[n, 3, fields], &poses).unwrap();
        }
        // Two vertices on either side, so that joints lie inside: shares that may be negative.
        let mut regressor = vec![0.0_f64; joints * n];
        for joint in 0..joints {
            for (vertex, share) in shares(&self.template_m, self.joints_m[source(joint)]) {
                regressor[joint * n + vertex] += share;
            }
        }
        writer
            .array("J_regressor", &[joints, n], &regressor)
            .unwrap();
        let mut weights = vec![0.0_f32; n * joints];
        for (vertex, skin) in body.skin.iter().take(n).enumerate() {
            for (joint, weight) in skin.joints.iter().zip(skin.weights) {
                let own = (0..joints).find(|own| source(*own) == usize::from(*joint));
                weights[vertex * joints + own.unwrap()] += weight;
            }
        }
        writer.array("weights", &[n, joints], &weights).unwrap();
        let own = 0..joints as i64;
        let tree: Vec<i64> = self.parents.iter().copied().chain(own).collect();
        writer.array("kintree_table", &[2, joints], &tree).unwrap();
        let faces: Vec<u32> = body.faces.iter().flatten().copied().collect();
        writer.array("f", &[body.faces.len(), 3], &faces).unwrap();
        writer.finish().unwrap();
    }
}

/// Vertices and shares that sum to 1 and whose mean is `place_m`.
fn shares(template_m: &[Vec3], place_m: Vec3) -> Vec<(usize, f64)> {
    // Four vertices far apart span space.
    let extreme = |along: Vec3| {
        let reach = |vertex: &usize| template_m[*vertex].dot(along);
        let all = 0..template_m.len();
        all.max_by(|a, b| reach(a).total_cmp(&reach(b))).unwrap()
    };
    let corners = [
        Vec3::new(1.0, -0.5, -0.3),
        Vec3::new(-1.0, -0.4, 0.2),
        Vec3::new(0.1, 1.0, 0.1),
        Vec3::new(0.0, -0.3, 1.0),
    ]
    .map(extreme);
    let at = |corner: usize| template_m[corners[corner]].as_dvec3();
    let edges = glam::DMat3::from_cols(at(1) - at(0), at(2) - at(0), at(3) - at(0));
    let along = edges.inverse() * (place_m.as_dvec3() - at(0));
    let first = 1.0 - along.x - along.y - along.z;
    corners
        .into_iter()
        .zip([first, along.x, along.y, along.z])
        .collect()
}
