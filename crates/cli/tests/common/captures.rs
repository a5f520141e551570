//! Captures made of a body, in the layout of Dyna and D-FAUST.

use std::fs;
use std::path::Path;

use dynaskin_body::{BodyModel, Joint, Pose, SHAPE_COUNT, SkinMatrices, skin_linear};
use glam::{DQuat, Vec3};
use hdf5_writer::{DatasetBuilder, Hdf5Builder, WriteOptions};

/// Joints that are turned where nobody is at rest.
const LIMBS: [Joint; 10] = [
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftAnkle,
    Joint::RightAnkle,
    Joint::LeftShoulder,
    Joint::RightShoulder,
    Joint::LeftElbow,
    Joint::RightElbow,
];

/// Turns the limbs by 52 degrees.
#[allow(dead_code, reason = "not all tests need it")]
pub fn leave_rest(pose: &mut Pose) {
    for joint in LIMBS {
        pose.parent_from_joint[joint as usize] *= DQuat::from_rotation_x(0.9);
    }
}

/// The vertices in the world of a person whose first shape coefficient is `beta`; `offset_m` is what the
/// tissue of a vertex adds in the rest pose.
pub fn scan_m(
    body: &BodyModel,
    beta: f32,
    pose: &Pose,
    offset_m: impl Fn(usize) -> Vec3,
) -> Vec<Vec3> {
    let mut shape = [0.0; SHAPE_COUNT];
    shape[0] = beta;
    let shaped = body.shaped(&shape);
    let mut rest_m = shaped.positions_m;
    body.add_pose_correctives(pose, &mut rest_m);
    for (vertex, rest) in rest_m.iter_mut().enumerate() {
        *rest += offset_m(vertex);
    }
    let matrices = SkinMatrices::new(pose, &shaped.joints_m);
    let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
    skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
    world_m
}

/// Writes sequences of frames by their names, [vertices, 3, frames], in metres.
pub fn write(path: &Path, sequences: &[(String, Vec<Vec<Vec3>>)]) {
    let mut builder = Hdf5Builder::new();
    for (name, frames) in sequences {
        let vertices = frames[0].len();
        let numbers: Vec<f32> = (0..3 * vertices)
            .flat_map(|at| frames.iter().map(move |frame| frame[at / 3][at % 3]))
            .collect();
        let shape = [vertices as u64, 3, frames.len() as u64];
        builder = builder.dataset(DatasetBuilder::typed_data(name, shape, &numbers).unwrap());
    }
    let plan = builder.into_plan().unwrap();
    fs::write(path, plan.encode(WriteOptions::default()).unwrap()).unwrap();
}
