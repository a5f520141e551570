//! The committed bodies, posed: positions skinned on the GPU and read back equal the body crate's
//! skinning, linear and with dual quaternions.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::Path;

use common::renderer;
use dynaskin_body::{
    BodyModel, JOINT_COUNT, Pose, SHAPE_COUNT, SkinMatrices, skin_dual_quaternion, skin_linear,
    vertex_normals,
};
use dynaskin_render::{BodyMesh, OffsetSizes, Skinning, SkinningPath};
use glam::{Affine3A, DQuat, DVec3, Mat4, Vec3};

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

fn worst_m(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
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

        for (phase, scale) in [(0.0, 1.0), (1.3, 1.0), (2.1, 2.5)] {
            let mut matrices = SkinMatrices::new(&far_pose(phase), &shaped.joints_m);
            let larger = Affine3A::from_scale(Vec3::splat(scale));
            matrices.world_from_rest = matrices.world_from_rest.map(|matrix| larger * matrix);
            let columns: [Mat4; JOINT_COUNT] = matrices.world_from_rest.map(Mat4::from);
            renderer.set_skin_matrices(id, &columns).unwrap();
            let mut linear = vec![Vec3::ZERO; rest_m.len()];
            let mut dual = linear.clone();
            skin_linear(&rest_m, &model.skin, &matrices, &mut linear);
            skin_dual_quaternion(&rest_m, &model.skin, &matrices, &mut dual);
            let cases = [
                (Skinning::Linear, &linear),
                (Skinning::DualQuaternion, &dual),
                (Skinning::Linear, &linear),
            ];
            for (skinning, on_cpu) in cases {
                // The matrices stay: the way of blending alone changes.
                renderer.set_skinning(id, skinning).unwrap();
                let reading = renderer.read_skinned_positions(id).unwrap();
                let on_gpu = pollster::block_on(reading).unwrap();
                let on_gpu: Vec<Vec3> = on_gpu
                    .as_chunks::<3>()
                    .0
                    .iter()
                    .map(|&at| Vec3::from(at))
                    .collect();
                let worst_m = worst_m(&on_gpu, on_cpu);
                println!("{name}, {skinning:?}: largest difference {worst_m:.2e} m");
                assert!(worst_m <= TOLERANCE_M, "{name}, {skinning:?}: {worst_m}");
            }
            // A difference of nothing from nothing would prove nothing.
            assert!(linear[0].length() > 1.0);
            assert!(self::worst_m(&linear, &dual) > 0.003);
        }
        renderer.remove_body(id).unwrap();
    }
}
