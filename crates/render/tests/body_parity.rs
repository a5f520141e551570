//! The committed bodies, posed: positions skinned on the GPU and read back equal the body crate's
//! linear-blend skinning.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::Path;

use common::renderer;
use dynaskin_body::{
    BodyModel, JOINT_COUNT, Pose, SHAPE_COUNT, SkinMatrices, skin_linear, vertex_normals,
};
use dynaskin_render::{BodyMesh, OffsetSizes, SkinningPath};
use glam::{DQuat, DVec3, Mat4, Vec3};

/// The parity that is asked of the renderer, in metres.
const TOLERANCE_M: f32 = 1e-4;

fn body(name: &str) -> BodyModel {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let path = models.join(name).join("body.glb");
    BodyModel::from_glb(&std::fs::read(&path).unwrap()).unwrap()
}

/// All joints bent, the body turned and ten metres away.
fn far_pose(phase: f64) -> Pose {
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(8.0, 0.3, -6.0);
    pose.parent_from_joint = std::array::from_fn(|joint| {
        let at = joint as f64 + phase;
        let axis = DVec3::new(at.sin(), (2.0 * at).cos(), 0.4).normalize();
        DQuat::from_axis_angle(axis, 0.7 * (1.9 * at).sin())
    });
    pose
}

#[test]
fn committed_bodies_skin_the_same_on_the_gpu_and_the_cpu() {
    let test = "committed_bodies_skin_the_same_on_the_gpu_and_the_cpu";
    let Some(mut renderer) = renderer(test, SkinningPath::Compute) else {
        return;
    };
    for name in ["female", "male"] {
        let model = body(name);
        let shape: [f32; SHAPE_COUNT] = std::array::from_fn(|idx| 1.5 - 0.3 * idx as f32);
        let shaped = model.shaped(&shape);
        // Offsets of centimetres, as soft tissue has them.
        let offset_m = |at: Vec3| 0.02 * Vec3::new((9.0 * at.y).sin(), (7.0 * at.x).cos(), 0.5);
        let rest_m: Vec<Vec3> = shaped
            .positions_m
            .iter()
            .map(|&at| at + offset_m(at))
            .collect();
        let normals = vertex_normals(&rest_m, &model.faces);

        let joints: Vec<u8> = model.skin.iter().flat_map(|skin| skin.joints).collect();
        let weights: Vec<f32> = model.skin.iter().flat_map(|skin| skin.weights).collect();
        let mesh = BodyMesh {
            faces: model.faces.as_flattened(),
            skin_joints: &joints,
            skin_weights: &weights,
            colors_srgba: model.colors_srgba.as_flattened(),
        };
        let id = renderer.add_body(&mesh).unwrap();
        let flat = |vectors: &[Vec3]| {
            vectors
                .iter()
                .flat_map(Vec3::to_array)
                .collect::<Vec<f32>>()
        };
        renderer
            .set_surface(id, &flat(&rest_m), &flat(&normals), OffsetSizes::Zero)
            .unwrap();

        for phase in [0.0, 1.3] {
            let matrices = SkinMatrices::new(&far_pose(phase), &shaped.joints_m);
            let columns: [Mat4; JOINT_COUNT] = matrices.world_from_rest.map(Mat4::from);
            renderer.set_skin_matrices(id, &columns).unwrap();
            let reading = renderer.read_skinned_positions(id).unwrap();
            let on_gpu = pollster::block_on(reading).unwrap();
            let mut on_cpu = vec![Vec3::ZERO; rest_m.len()];
            skin_linear(&rest_m, &model.skin, &matrices, &mut on_cpu);
            let pairs = on_gpu.as_chunks::<3>().0.iter().zip(&on_cpu);
            let worst_m = pairs
                .map(|(&gpu, cpu)| Vec3::from(gpu).distance(*cpu))
                .fold(0.0, f32::max);
            println!("{name}: largest difference {worst_m:.2e} m");
            assert!(worst_m <= TOLERANCE_M, "{name}: {worst_m}");
            // A difference of nothing from nothing would prove nothing.
            assert!(on_cpu[0].length() > 1.0);
        }
        renderer.remove_body(id).unwrap();
    }
}
