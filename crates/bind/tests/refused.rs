//! What is refused, a sentence each, and nothing of which panics.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::HashMap;

use common::{body, shared_avatar};
use dynaskin_avatars::{RECIPES, make};
use dynaskin_bind::{
    Avatar, BindError, BindOptions, Binding, BindingError, EngineMesh, Influences, MAX_VERTICES,
    SkinnedMesh, bind,
};
use dynaskin_body::{BodyModel, Region};
use glam::{DAffine3, DQuat, Vec3};

fn file(name: &str) -> Vec<u8> {
    let recipe = RECIPES.iter().find(|recipe| recipe.name == name).unwrap();
    make(&body("female"), recipe).bytes
}

/// An adult in metres, one mesh, bones without axes of their own.
fn adult() -> Avatar {
    Avatar::from_glb(&file("unreal-a-garment")).unwrap()
}

fn refused(avatar: &Avatar) -> BindError {
    bind(avatar, &body("female"), &BindOptions::adult()).unwrap_err()
}

/// The avatar with a head `factor` times as tall.
fn with_head(factor: f32) -> Avatar {
    let mut avatar = adult();
    let neck = avatar
        .nodes
        .iter()
        .find(|node| node.name == "neck_01")
        .unwrap();
    let neck_y = neck.world_from_node.translation.y as f32;
    let head = avatar
        .nodes
        .iter()
        .position(|node| node.name == "head")
        .unwrap();
    for mesh in &mut avatar.meshes {
        let slot = mesh.joints.iter().position(|node| *node == head).unwrap();
        for (position, influences) in mesh.positions.iter_mut().zip(&mesh.influences) {
            let weights = influences.joints.iter().zip(influences.weights);
            let own: f32 = weights
                .filter(|(joint, _)| usize::from(**joint) == slot)
                .map(|(_, weight)| weight)
                .sum();
            position.y += own * (factor - 1.0) * (position.y - neck_y);
        }
    }
    avatar
}

#[test]
fn adults_are_declared() {
    for depicts in [None, Some("child".to_owned()), Some("Adult ".to_owned())] {
        let options = BindOptions {
            depicts: depicts.clone(),
            ..BindOptions::default()
        };
        let error = bind(&adult(), &body("female"), &options).unwrap_err();
        assert_eq!(error, BindError::Undeclared { declared: depicts });
        assert!(error.to_string().contains("depicts: \"adult\""));
    }
}

#[test]
fn proportions_of_no_adult_are_refused() {
    let error = refused(&with_head(1.6));
    let BindError::NotAdult(found) = error else {
        panic!("{error}");
    };
    assert!(found.crown_to_shoulder >= 0.22, "{found:?}");
    assert!(error.to_string().contains("crown to shoulder"), "{error}");

    let mut small = adult();
    for node in &mut small.nodes {
        node.world_from_node = DAffine3::from_scale(glam::DVec3::splat(0.8)) * node.world_from_node;
    }
    let error = refused(&small);
    assert!(matches!(error, BindError::NotAdult(_)), "{error}");
    assert!(error.to_string().contains("m tall"), "{error}");
}

#[test]
fn between_adults_and_others_chest_and_buttocks_stay_still() {
    let body = body("female");
    let bound = [1.1, 1.12, 1.14, 1.16].into_iter().find_map(|factor| {
        let bound = bind(&with_head(factor), &body, &BindOptions::adult()).ok()?;
        let ratio = bound.binding.report.proportions.crown_to_shoulder;
        (0.212..0.22).contains(&ratio).then_some(bound)
    });
    let binding = bound.unwrap().binding;
    let off: Vec<&str> = binding
        .report
        .regions_off
        .iter()
        .map(|off| off.region.as_str())
        .collect();
    assert_eq!(off, ["chest", "buttocks"]);
    // Nothing is taken from vertices that are of these regions alone.
    let is_alone = |vertex: u16| {
        let own = |region: Region| body.region_weights[region as usize][usize::from(vertex)];
        let guarded = own(Region::Chest) + own(Region::Buttocks);
        guarded > 0.0 && guarded >= 0.999 * body.softness(usize::from(vertex))
    };
    assert!(!binding.rows.vertices.iter().any(|vertex| is_alone(*vertex)));
    let whole = bind(&adult(), &body, &BindOptions::adult())
        .unwrap()
        .binding;
    assert!(whole.report.regions_off.is_empty());
    assert!(whole.rows.vertices.iter().any(|vertex| is_alone(*vertex)));
}

#[test]
fn who_does_not_stand_upright() {
    let mut avatar = adult();
    let lying = DAffine3::from_quat(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    for node in &mut avatar.nodes {
        node.world_from_node = lying * node.world_from_node;
    }
    let error = refused(&avatar);
    assert!(matches!(error, BindError::NotUpright { .. }), "{error}");
}

#[test]
fn a_skeleton_of_no_person() {
    let mut avatar = adult();
    for (idx, node) in avatar.nodes.iter_mut().enumerate() {
        node.name = format!("x{idx}");
        node.part_name = node.name.clone();
        node.world_from_node.translation = glam::DVec3::new(0.0, 0.1 * idx as f64, 0.0);
    }
    let error = refused(&avatar);
    assert!(matches!(error, BindError::NoHumanoid(_)), "{error}");
    assert!(
        error.to_string().contains("`bones` of an avatar"),
        "{error}"
    );
}

#[test]
fn numbers_that_are_none() {
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut avatar = adult();
        avatar.meshes[0].positions[17].y = bad;
        let error = refused(&avatar);
        assert!(error.to_string().contains("vertex 17"), "{error}");
    }
    let mut avatar = adult();
    avatar.meshes[0].influences[3].weights[0] = f32::NAN;
    assert!(matches!(refused(&avatar), BindError::NotFinite { .. }));
}

#[test]
fn a_skin_without_surface() {
    let mut avatar = adult();
    for mesh in &mut avatar.meshes {
        mesh.faces = vec![[5, 5, 6], [7, 8, 7]];
    }
    assert!(matches!(refused(&avatar), BindError::NoSurface { .. }));
    // Single triangles without area are left out.
    let mut avatar = adult();
    avatar.meshes[0].faces.extend([[5, 5, 6], [7, 8, 7]]);
    let bound = bind(&avatar, &body("female"), &BindOptions::adult()).unwrap();
    assert!(bound.binding.report.share_close > 0.9);
}

#[test]
fn a_million_vertices() {
    let mut avatar = adult();
    avatar.meshes[0].positions.resize(1_000_000, Vec3::ZERO);
    let error = refused(&avatar);
    let BindError::TooManyVertices { vertices, limit } = error else {
        panic!("{error}");
    };
    assert!(vertices >= 1_000_000 && limit == MAX_VERTICES);
}

#[test]
fn indices_of_what_is_not_there() {
    let mut avatar = adult();
    let count = avatar.meshes[0].positions.len() as u32;
    avatar.meshes[0].faces[0][1] = count;
    assert!(matches!(refused(&avatar), BindError::Glb(_)));
    let mut avatar = adult();
    avatar.meshes[0].influences[0].joints[0] = 999;
    assert!(matches!(refused(&avatar), BindError::Glb(_)));
    let mut avatar = adult();
    avatar.nodes[0].parent = Some(1);
    assert!(matches!(refused(&avatar), BindError::Glb(_)));
    assert!(matches!(
        refused(&Avatar {
            nodes: Vec::new(),
            meshes: Vec::new()
        }),
        BindError::Unskinned { .. }
    ));
    let said = |meshes| BindError::Unskinned { meshes }.to_string();
    assert!(said(0).starts_with("the file has no mesh:"), "{}", said(0));
    assert!(said(1).contains("one mesh, and it is not skinned"));
    assert!(said(3).contains("3 meshes and none of them is skinned"));
}

#[test]
fn cut_and_changed_files() {
    let bytes = file("quantised-seams");
    for length in [0, 3, 11, 12, 19, 200, bytes.len() / 2, bytes.len() - 1] {
        let error = Avatar::from_glb(&bytes[..length]).unwrap_err();
        assert!(matches!(error, BindError::Glb(_)), "{length}: {error}");
    }
    // Whatever byte of the document is another, reading ends with an avatar or a sentence.
    let json = 20..u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize + 20;
    for at in json.step_by(29) {
        let mut changed = bytes.clone();
        changed[at] = if changed[at] == b'9' { b'1' } else { b'9' };
        if let Err(error) = Avatar::from_glb(&changed) {
            assert!(!error.to_string().is_empty());
        }
    }
}

#[test]
fn bindings_of_other_files() {
    let [female, male] = ["female", "male"].map(body);
    let avatar = adult();
    let binding = bind(&avatar, &female, &BindOptions::adult())
        .unwrap()
        .binding;
    let bytes = binding.to_bytes();
    let again = Binding::from_bytes(&bytes, &female).unwrap();
    assert_eq!(avatar.check_binding(&again, &female), Ok(()));
    let other = |what| BindingError::AnotherFile { what };
    assert_eq!(
        with_head(1.01).check_binding(&again, &female),
        Err(other("avatar").into())
    );
    assert_eq!(Binding::from_bytes(&bytes, &male), Err(other("body")));
    let invalid = |bytes: &[u8]| {
        let error = Binding::from_bytes(bytes, &female).unwrap_err();
        assert!(matches!(error, BindingError::Invalid { .. }), "{error}");
    };
    for length in [0, 7, 11, 40, bytes.len() - 1] {
        invalid(&bytes[..length]);
    }
    for at in (0..bytes.len()).step_by(997) {
        let mut changed = bytes.clone();
        changed[at] ^= 4;
        invalid(&changed);
    }
    invalid(b"DYNSKINS and more bytes than a checksum has, which is thirty-two");
}

#[test]
fn a_body_without_regions() {
    let mut bare: BodyModel = body("female");
    bare.region_weights.clear();
    let error = bind(&adult(), &bare, &BindOptions::adult()).unwrap_err();
    assert!(matches!(error, BindError::Body(_)));
}

#[test]
fn files_of_others() {
    let refusal = |name: &str| {
        let bytes = shared_avatar(name)?;
        let bound = Avatar::from_glb(&bytes)
            .and_then(|avatar| bind(&avatar, &body("female"), &BindOptions::adult()));
        Some(bound.map(|_| name.to_owned()).unwrap_err())
    };
    for name in [
        "kaykit-rogue.glb",
        "cryptovoxels.vrm",
        "mesh2motion-human-zombie.glb",
    ] {
        if let Some(error) = refusal(name) {
            assert!(matches!(error, BindError::NotAdult(_)), "{name}: {error}");
        }
    }
    if let Some(error) = refusal("mesh2motion-unskinned.glb") {
        assert!(matches!(error, BindError::Unskinned { .. }), "{error}");
    }
    if let Some(error) = refusal("kenney-female.glb") {
        assert!(error.to_string().contains("left_hip"), "{error}");
    }
}

/// The avatar as an engine's arrays.
fn by_arrays(avatar: &Avatar, change: impl Fn(&mut EngineArrays)) -> Result<Avatar, BindError> {
    let read = |mesh: &SkinnedMesh| {
        let mut arrays = EngineArrays::new(mesh);
        change(&mut arrays);
        arrays.read(mesh)
    };
    let mut again = Avatar {
        nodes: avatar.nodes.clone(),
        meshes: avatar.meshes.iter().map(read).collect::<Result<_, _>>()?,
    };
    again.name_parts(HashMap::new());
    again.check()?;
    Ok(again)
}

struct EngineArrays {
    positions: Vec<f32>,
    skin_joints: Vec<u16>,
    skin_weights: Vec<f32>,
    indices: Vec<u32>,
    joints: Vec<u32>,
    inverse_binds: Vec<f64>,
}

impl EngineArrays {
    fn new(mesh: &SkinnedMesh) -> Self {
        let four = |of: &Influences| (of.joints[..4].to_vec(), of.weights[..4].to_vec());
        let skins: Vec<_> = mesh.influences.iter().map(four).collect();
        let matrix = |matrix: &DAffine3| glam::DMat4::from(*matrix).to_cols_array();
        Self {
            positions: mesh.positions.iter().flat_map(Vec3::to_array).collect(),
            skin_joints: skins
                .iter()
                .flat_map(|(joints, _)| joints.clone())
                .collect(),
            skin_weights: skins
                .iter()
                .flat_map(|(_, weights)| weights.clone())
                .collect(),
            indices: mesh.faces.iter().flatten().copied().collect(),
            joints: mesh.joints.iter().map(|joint| *joint as u32).collect(),
            inverse_binds: mesh.inverse_binds.iter().flat_map(matrix).collect(),
        }
    }

    fn read(&self, mesh: &SkinnedMesh) -> Result<SkinnedMesh, BindError> {
        let engine = EngineMesh {
            name: &mesh.name,
            material: &mesh.material,
            positions: &self.positions,
            skin_joints: &self.skin_joints,
            skin_weights: &self.skin_weights,
            indices: &self.indices,
            joints: &self.joints,
            inverse_binds: &self.inverse_binds,
        };
        engine.read()
    }
}

#[test]
fn engines_give_the_avatar_that_the_file_has() {
    let avatar = adult();
    let again = by_arrays(&avatar, |_| {}).unwrap();
    for (mesh, wanted) in again.meshes.iter().zip(&avatar.meshes) {
        assert_eq!(mesh.positions, wanted.positions);
        assert_eq!(mesh.faces, wanted.faces);
    }
    for (node, wanted) in again.nodes.iter().zip(&avatar.nodes) {
        assert_eq!(node.part_name, wanted.part_name);
    }
}

#[test]
fn arrays_of_engines_that_do_not_belong_together() {
    let changes: [fn(&mut EngineArrays); 8] = [
        |arrays| arrays.positions.truncate(100),
        |arrays| arrays.skin_joints.truncate(101),
        |arrays| arrays.skin_weights.clear(),
        |arrays| arrays.inverse_binds.truncate(20),
        |arrays| arrays.inverse_binds.truncate(32),
        |arrays| arrays.indices[5] = u32::MAX,
        |arrays| arrays.joints[0] = 100_000,
        |arrays| arrays.skin_joints.fill(u16::MAX),
    ];
    for (idx, change) in changes.into_iter().enumerate() {
        let refused = by_arrays(&adult(), change);
        assert!(matches!(refused, Err(BindError::Glb(_))), "change {idx}");
    }
}
