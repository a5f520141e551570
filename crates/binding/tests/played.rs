//! What a frame plays is what the binding says; and the numbers that pages compare their frames with.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use dynaskin_binding::{Binding, BindingError, Player, SOURCES_PER_LINE, VERTEX_NUMBERS};
use dynaskin_body::BodyModel;
use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3, Vec3A};
use serde_json::{Value, json};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(name)
}

fn body() -> BodyModel {
    BodyModel::from_glb(&std::fs::read(file("models/female/body.glb")).unwrap()).unwrap()
}

/// The binding of an avatar of two meshes in centimetres: `web/sdk/tests/played.test.ts` says which.
fn bound() -> (BodyModel, Binding) {
    let body = body();
    let bytes = std::fs::read(file("tests/golden/played.binding")).unwrap();
    let binding = Binding::from_bytes(&bytes, &body).unwrap();
    (body, binding)
}

/// Rough offsets: they cannot be right by chance.
fn rough_m(body: &BodyModel) -> Vec<Vec3> {
    let wave = |vertex: usize| {
        let vertex = vertex as f64;
        let wave = DVec3::new(
            (0.37 * vertex).sin(),
            (0.73 * vertex + 1.0).cos(),
            (0.11 * vertex + 2.0).sin(),
        );
        (0.02 * wave).as_vec3()
    };
    (0..body.vertex_count()).map(wave).collect()
}

/// A player with every mesh at zero, its normals up.
fn player(body: &BodyModel, binding: &Binding, shares: &[f32]) -> Player {
    let still = vec![Vec3::Y; body.vertex_count()];
    let mut player = Player::new(binding.clone(), body, &still);
    for (idx, mesh) in binding.meshes.iter().enumerate() {
        let count = mesh.vertex_count as usize;
        let normals: Vec<f32> = [0.0, 1.0, 0.0].repeat(count);
        player
            .add_surface(idx, &vec![0.0; 3 * count], &normals, shares)
            .unwrap();
    }
    player
}

#[test]
fn tangents_keep_to_the_plane_of_the_normals() {
    let (body, binding) = bound();
    let mut player = player(&body, &binding, &[]);
    let count = binding.meshes[0].vertex_count as usize;
    let still: Vec<f32> = [1.0, 0.0, 0.0, -1.0].repeat(count);
    player.set_tangents(0, &still).unwrap();
    // Normals of the body that lean by some degrees.
    let lean = Vec3::new(0.3, 1.0, 0.2).normalize();
    player.update(&rough_m(&body), &vec![lean; body.vertex_count()]);
    let surface = &player.surfaces()[0];
    assert_eq!(surface.tangents().len(), 4 * count);
    let mut turned = 0;
    for vertex in &binding.meshes[0].vertices {
        let vertex = *vertex as usize;
        let tangent = &surface.tangents()[4 * vertex..4 * vertex + 4];
        let normal = Vec3::from_slice(&surface.normals()[3 * vertex..]);
        let along = Vec3::from_slice(tangent);
        assert!(along.dot(normal).abs() < 1e-6 && (along.length() - 1.0).abs() < 1e-6);
        assert!(along.x > 0.5 && tangent[3] == -1.0);
        turned += usize::from(along.angle_between(Vec3::X) > 0.05);
    }
    assert!(turned > 100, "{turned}");
    let refused = player.set_tangents(0, &still[4..]).unwrap_err();
    assert!(matches!(refused, BindingError::Surface { .. }), "{refused}");
    assert!(player.set_tangents(99, &still).is_err());
    assert!(player.surfaces()[1].tangents().is_empty());
}

#[test]
fn a_frame_is_what_the_binding_says() {
    let (body, mut binding) = bound();
    let offsets_m = rough_m(&body);
    // One mesh as it is, one whose joints were bound in different poses.
    let turned = binding.meshes[1].vertices.iter();
    let turn = |vertex: &u32| Quat::from_rotation_x(0.01 * *vertex as f32);
    binding.meshes[1].turns = turned.map(turn).collect();
    let mut player = player(&body, &binding, &[]);
    player.update(&offsets_m, &vec![Vec3::Y; body.vertex_count()]);
    let of_rows = binding.row_offsets_m(&offsets_m);
    for (mesh, surface) in binding.meshes.iter().zip(player.surfaces()) {
        let mut wanted = vec![Vec3::ZERO; mesh.vertex_count as usize];
        for (vertex, offset) in mesh.vertices.iter().zip(mesh.offsets(&of_rows)) {
            wanted[*vertex as usize] = offset;
        }
        // A metre in the mesh's own unit.
        let unit = mesh.mesh_from_root.determinant().abs().cbrt();
        let found = surface.positions().as_chunks::<3>().0;
        for (found, wanted) in found.iter().zip(&wanted) {
            let error_m = Vec3::from_array(*found).distance(*wanted) / unit;
            assert!(error_m < 1e-6, "{}: {error_m} m", mesh.name);
        }
        assert!(wanted.iter().any(|offset| offset.length() > 0.005 * unit));
        assert_eq!(surface.moving_count(), mesh.vertices.len());
        // The body's normals have not changed.
        let normals = surface.normals().as_chunks::<3>().0;
        assert!(normals.iter().all(|normal| *normal == [0.0, 1.0, 0.0]));
    }
}

#[test]
fn a_vertex_stage_makes_the_same_surface() {
    let (body, mut binding) = bound();
    let offsets_m = rough_m(&body);
    let turned = binding.meshes[1].vertices.iter();
    let turn = |vertex: &u32| Quat::from_rotation_x(0.01 * *vertex as f32);
    binding.meshes[1].turns = turned.map(turn).collect();
    let share = |vertex: usize| [1.0, 0.5, 0.0][vertex % 3];
    let normals: Vec<Vec3> = offsets_m
        .iter()
        .map(|offset| (Vec3::Y + 10.0 * *offset).normalize())
        .collect();
    for surface in 0..binding.meshes.len() {
        let vertex_count = binding.meshes[surface].vertex_count as usize;
        let shares: Vec<f32> = (0..vertex_count).map(share).collect();
        let mut alone = Player::new(binding.clone(), &body, &vec![Vec3::Y; body.vertex_count()]);
        let up: Vec<f32> = [0.0, 1.0, 0.0].repeat(vertex_count);
        alone
            .add_surface(surface, &vec![0.0; 3 * vertex_count], &up, &shares)
            .unwrap();
        alone.update(&offsets_m, &normals);
        let wanted = alone.surfaces()[0].clone();
        let rows = alone.vertex_rows(0).unwrap();
        let [of_offsets, of_normals] = alone.mesh_from_row(0).unwrap();
        let unit = of_offsets.determinant().abs().cbrt();
        let range = wanted.moving();
        assert_eq!(rows.len(), VERTEX_NUMBERS * range.len());
        for (numbers, vertex) in rows.as_chunks::<VERTEX_NUMBERS>().0.iter().zip(range) {
            let (mut offset, mut normal) = (Vec3A::ZERO, Vec3A::ZERO);
            for [place, weight] in numbers[..16].as_chunks::<2>().0 {
                let change = &alone.changes()[*place as usize];
                offset += change.offset_m * *weight;
                normal += change.normal * *weight;
            }
            let row = Quat::from_slice(&numbers[16..]);
            let own = Quat::from_slice(&numbers[20..]);
            offset = own * (of_offsets * (row * offset));
            normal = own * (of_normals * (row * normal));
            let at = 3 * vertex as usize;
            let shown = Vec3A::from_slice(&wanted.positions()[at..]);
            assert!(shown.distance(offset) < 1e-6 * unit, "{vertex}");
            let shown = Vec3A::from_slice(&wanted.normals()[at..]);
            assert!(
                shown.distance((Vec3A::Y + normal).normalize()) < 1e-5,
                "{vertex}"
            );
        }
        // A surface that is left to a vertex stage stays as it is; the changes go on.
        alone.leave_surfaces();
        alone.update(&vec![Vec3::ZERO; offsets_m.len()], &normals);
        assert_eq!(alone.surfaces()[0].positions(), wanted.positions());
        assert!(
            alone
                .changes()
                .iter()
                .all(|change| change.offset_m == Vec3A::ZERO)
        );
        assert_eq!(alone.changes().len() % SOURCES_PER_LINE, 0);
        assert!(alone.vertex_rows(1).is_err());
    }
}

#[test]
fn normals_turn_as_those_of_the_body() {
    let (body, binding) = bound();
    let mut player = player(&body, &binding, &[]);
    let zero = vec![Vec3::ZERO; body.vertex_count()];
    let tilted = Vec3::new(0.0, 1.0, 0.5).normalize();
    player.update(&zero, &vec![tilted; body.vertex_count()]);
    let surface = &player.surfaces()[0];
    assert!(surface.positions().iter().all(|number| *number == 0.0));
    let normals = surface.normals().as_chunks::<3>().0;
    let leans = |normal: &&[f32; 3]| normal[1] < 0.99;
    assert!(normals.iter().filter(leans).count() > 500);
    for normal in normals {
        assert!((Vec3::from_array(*normal).length() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn shares_and_hidden_surfaces() {
    let (body, binding) = bound();
    let (offsets_m, up) = (rough_m(&body), vec![Vec3::Y; body.vertex_count()]);
    let count = binding.meshes[0].vertex_count as usize;
    let played = |shares: &[f32], is_shown: bool| {
        let mut player = player(&body, &binding, shares);
        player.show(0, is_shown);
        player.update(&offsets_m, &up);
        player.surfaces()[0].positions().to_vec()
    };
    let whole = played(&[], true);
    let half = played(&vec![0.5; count], true);
    let is_half = |(whole, half): (&f32, &f32)| (whole * 0.5 - half).abs() < 1e-4;
    assert!(whole.iter().zip(&half).all(is_half));
    assert!(played(&vec![0.0; count], true).iter().all(|x| *x == 0.0));
    assert!(played(&[], false).iter().all(|x| *x == 0.0));
    assert!(whole.iter().any(|x| *x != 0.0));
}

#[test]
fn surfaces_of_another_size_are_refused() {
    let (body, binding) = bound();
    let mut player = Player::new(binding, &body, &vec![Vec3::Y; body.vertex_count()]);
    let refused = player.add_surface(0, &[0.0; 9], &[], &[]).unwrap_err();
    assert!(matches!(refused, BindingError::Surface { .. }), "{refused}");
    let refused = player.add_surface(7, &[], &[], &[]).unwrap_err();
    assert!(matches!(refused, BindingError::NoMesh { mesh: 7, .. }));
}

/// The bones of the body's own pose, as an engine has them: the avatar's root turned, moved and scaled.
#[test]
fn where_the_root_stands_and_how_large_it_is() {
    let (body, binding) = bound();
    let rig = &binding.rig;
    let size = f64::from(binding.size);
    let joints_m = body.shaped(&binding.shape).joints_m;
    let root = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.01),
        DQuat::from_rotation_y(0.7),
        DVec3::new(3.0, 0.5, -2.0),
    );
    // Bones as they were bound, in the file's centimetres.
    let bones: Vec<DAffine3> = rig
        .bones
        .iter()
        .map(|bone| DAffine3 {
            matrix3: DMat3::from_quat(bone.bind) * (bone.size_m / 0.01),
            translation: DVec3::new(0.0, 90.0, 0.0),
        })
        .collect();
    let placed = |root: DAffine3| {
        let bones: Vec<DAffine3> = bones.iter().map(|bone| root * *bone).collect();
        rig.pose_of_bones(&bones, size, &joints_m)
    };
    let pose = placed(root);
    let still = placed(DAffine3::from_scale(DVec3::splat(0.01)));
    let hips_m = |pose: &dynaskin_body::Pose| pose.root_translation_m;
    // A root of 0.01 makes metres of centimetres.
    let turned = root.transform_point3(DVec3::new(0.0, 90.0, 0.0)) - DVec3::new(0.0, 0.9, 0.0);
    let moved = hips_m(&pose) - hips_m(&still);
    assert!((moved.y * size - turned.y).abs() < 1e-3, "{moved} {turned}");
    let turn = pose.parent_from_joint[0] * still.parent_from_joint[0].inverse();
    assert!(turn.angle_between(DQuat::from_rotation_y(0.7)) < 1e-6);
    for joint in 1..24 {
        let angle = pose.parent_from_joint[joint].angle_between(still.parent_from_joint[joint]);
        assert!(angle < 1e-6, "joint {joint}");
    }
}

/// Offsets of every 25th vertex that moves, as the binding says they are.
fn sampled(binding: &Binding, body: &BodyModel) -> Value {
    let of_rows = binding.row_offsets_m(&rough_m(body));
    let meshes = binding.meshes.iter().map(|mesh| {
        let offsets = mesh.vertices.iter().zip(mesh.offsets(&of_rows)).step_by(25);
        let offsets = offsets.map(|(vertex, offset)| json!([vertex, offset.x, offset.y, offset.z]));
        json!({ "vertices": mesh.vertex_count, "offsets": offsets.collect::<Vec<_>>() })
    });
    Value::from_iter(meshes)
}

/// `DYNASKIN_WRITE_GOLDEN=1` writes the numbers anew, after the binding.
#[test]
fn what_pages_compare_their_frames_with() {
    let numbers = file("tests/golden/played.json");
    let (body, binding) = bound();
    if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
        std::fs::write(&numbers, format!("{}\n", sampled(&binding, &body))).unwrap();
    }
    let written: Value = serde_json::from_slice(&std::fs::read(numbers).unwrap()).unwrap();
    let flat = |value: &Value| -> Vec<f64> {
        let meshes = value.as_array().into_iter().flatten();
        let rows = meshes.flat_map(|mesh| mesh["offsets"].as_array().into_iter().flatten());
        rows.flat_map(|row| row.as_array().into_iter().flatten())
            .filter_map(Value::as_f64)
            .collect()
    };
    let (written, now) = (flat(&written), flat(&sampled(&binding, &body)));
    assert_eq!(written.len(), now.len());
    assert!(written.len() > 400);
    for (written, now) in written.iter().zip(&now) {
        // Centimetres.
        assert!((written - now).abs() < 1e-4, "{written} {now}");
    }
}
