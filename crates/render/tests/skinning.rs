//! Skinned positions read back from the GPU equal linear-blend skinning on the CPU.

mod common;

use common::{TestBody, bent_pose, renderer};
use dynaskin_render::{BodyMesh, OffsetSizes, RenderError, SkinningPath};
use glam::{DMat4, DVec3, Mat4};

/// Numbers in 0..1 from a linear congruential generator: the same on every machine.
fn noise(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// A cloud the size of an avatar with four random joints and weights a vertex.
fn cloud(n_vertices: usize) -> TestBody {
    let mut next = noise(7);
    let mut body = TestBody::default();
    for _ in 0..n_vertices {
        body.positions_m
            .extend([next() - 0.5, 2.0 * next(), next() - 0.5]);
        body.normals.extend([0.0, 1.0, 0.0]);
        body.joints
            .extend([next(), next(), next(), next()].map(|x| (x * 24.0) as u8));
        let raw = [next() + 0.5, next(), next(), next()];
        let sum: f32 = raw.iter().sum();
        body.weights.extend(raw.map(|weight| weight / sum));
    }
    body.faces.extend([0, 1, 2]);
    body
}

/// Linear-blend skinning in double precision.
fn skinned_on_cpu(body: &TestBody, world_from_rest: &[Mat4; 24]) -> Vec<DVec3> {
    let matrices = world_from_rest.map(|matrix| matrix.as_dmat4());
    let positions = body.positions_m.as_chunks::<3>().0;
    let joints = body.joints.as_chunks::<4>().0;
    let weights = body.weights.as_chunks::<4>().0;
    let vertices = positions.iter().zip(joints).zip(weights);
    vertices
        .map(|((position, joints), weights)| {
            let blended = joints
                .iter()
                .zip(weights)
                .fold(DMat4::ZERO, |sum, (&joint, &weight)| {
                    sum + matrices[usize::from(joint)] * f64::from(weight)
                });
            blended.transform_point3(DVec3::from(position.map(f64::from)))
        })
        .collect()
}

#[test]
fn gpu_skinning_equals_cpu_skinning() {
    let Some(mut renderer) = renderer("gpu_skinning_equals_cpu_skinning", SkinningPath::Compute)
    else {
        return;
    };
    // Not a multiple of the workgroup size.
    let body = cloud(6_890);
    let id = body.add_to(&mut renderer, OffsetSizes::Zero);
    for strength in [0.0, 0.4, 1.5] {
        let world_from_rest = bent_pose(strength);
        renderer.set_skin_matrices(id, &world_from_rest).unwrap();
        let reading = renderer.read_skinned_positions(id).unwrap();
        let on_gpu = pollster::block_on(reading).unwrap();
        let on_cpu = skinned_on_cpu(&body, &world_from_rest);
        assert_eq!(on_gpu.len(), 3 * on_cpu.len());
        let pairs = on_gpu.as_chunks::<3>().0.iter().zip(&on_cpu);
        let worst_m = pairs
            .map(|(gpu, cpu)| DVec3::from(gpu.map(f64::from)).distance(*cpu))
            .fold(0.0, f64::max);
        println!("bent by {strength}: largest difference {worst_m:.2e} m");
        assert!(worst_m <= 1e-5, "{worst_m}");
    }
}

#[test]
fn reading_back_tells_when_it_cannot() {
    let test = "reading_back_tells_when_it_cannot";
    let Some(mut renderer) = renderer(test, SkinningPath::VertexStage) else {
        return;
    };
    let id = TestBody::standing().add_to(&mut renderer, OffsetSizes::Zero);
    let refused = renderer.read_skinned_positions(id).err();
    assert_eq!(refused, Some(RenderError::ReadBackUnsupported));
}

#[test]
fn bad_input_is_refused_and_changes_nothing() {
    let test = "bad_input_is_refused_and_changes_nothing";
    let Some(mut renderer) = renderer(test, SkinningPath::Compute) else {
        return;
    };
    let body = TestBody::standing();
    let id = body.add_to(&mut renderer, OffsetSizes::Zero);
    let before = common::picture(&mut renderer);

    let n_vertices = body.vertex_count();
    let mut nan = body.positions_m.clone();
    nan[5] = f32::NAN;
    let refused = renderer.set_surface(id, &nan, &body.normals, OffsetSizes::Zero);
    assert!(
        matches!(refused, Err(RenderError::NonFinite { index: 5, .. })),
        "{refused:?}"
    );
    let short = renderer.set_surface(id, &body.positions_m[3..], &body.normals, OffsetSizes::Zero);
    assert!(
        matches!(short, Err(RenderError::WrongLength { .. })),
        "{short:?}"
    );
    let sizes = vec![0.0; n_vertices - 1];
    let short = renderer.set_surface(
        id,
        &body.positions_m,
        &body.normals,
        OffsetSizes::Sizes(&sizes),
    );
    assert!(
        matches!(short, Err(RenderError::WrongLength { .. })),
        "{short:?}"
    );
    let mut pose = bent_pose(1.0);
    pose[23].w_axis.x = f32::INFINITY;
    let refused = renderer.set_skin_matrices(id, &pose);
    assert!(
        matches!(refused, Err(RenderError::NonFinite { .. })),
        "{refused:?}"
    );
    for range_mm in [0.0, -1.0, f32::NAN] {
        assert!(renderer.set_heat_map(Some(range_mm)).is_err());
    }
    let mesh = BodyMesh {
        skin_joints: &[24, 0, 0, 0],
        ..body.mesh()
    };
    assert!(renderer.add_body(&mesh).is_err());

    let after = common::picture(&mut renderer);
    assert_eq!(common::mean_difference(&before, &after), 0.0);

    renderer.remove_body(id).unwrap();
    assert_eq!(
        renderer.remove_body(id),
        Err(RenderError::UnknownBody { id: id.index() })
    );
    assert!(renderer.set_body_visible(id, true).is_err());
}

#[test]
fn a_lost_device_is_reported() {
    let Some(mut renderer) = renderer("a_lost_device_is_reported", SkinningPath::Compute) else {
        return;
    };
    let lost = renderer.device_lost();
    renderer.gpu().device().destroy();
    // Callbacks run when the device is polled.
    let _ = renderer
        .gpu()
        .device()
        .poll(dynaskin_render::wgpu::PollType::Poll);
    assert!(!pollster::block_on(lost).by_dropping);
    let refused = renderer.render();
    assert!(
        matches!(refused, Err(RenderError::DeviceLost { .. })),
        "{refused:?}"
    );
}

#[test]
fn dropping_the_renderer_is_no_loss() {
    let Some(renderer) = renderer("dropping_the_renderer_is_no_loss", SkinningPath::Compute) else {
        return;
    };
    let lost = renderer.device_lost();
    drop(renderer);
    assert!(pollster::block_on(lost).by_dropping);
}
