//! SMPL-family files, on small ones made here with the published keys and shapes.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]
#![cfg(feature = "smpl")]

use std::io::{Cursor, Write};

use dynaskin_body::{BodyError, BodyModel, Joint, Pose, SHAPE_COUNT, SmplLayout};
use dynaskin_npz::NpzError;
use glam::{DQuat, Vec3};
use npyz::{AutoSerialize, Order, WriterBuilder};
use proptest::prelude::*;

const N_VERTICES: usize = 30;
const N_SHAPES: usize = 12;

/// An array and its length along each axis.
#[derive(Clone)]
struct Array<T> {
    shape: Vec<u64>,
    values: Vec<T>,
}

/// What one test file holds, in C order.
#[derive(Clone)]
struct File {
    template: Array<f64>,
    shapes: Array<f64>,
    poses: Option<Array<f64>>,
    regressor: Array<f64>,
    weights: Array<f64>,
    tree: Array<u32>,
    faces: Array<u32>,
}

/// A repeatable number in -1..1.
fn number(seed: usize) -> f64 {
    ((seed as f64 * 12.9898).sin() * 43_758.545_3).fract()
}

fn filled(shape: &[u64], seed: usize, scale: f64) -> Array<f64> {
    let count = shape.iter().product::<u64>() as usize;
    Array {
        shape: shape.to_vec(),
        values: (0..count).map(|i| scale * number(seed + i)).collect(),
    }
}

fn file() -> File {
    let parents = Joint::ALL.map(|joint| joint.parent().map_or(u32::MAX, |p| p as u32));
    file_of(&parents)
}

/// A file with as many joints as SMPL-H (52) or SMPL-X (55), which hang on each other as there.
fn file_with_fingers(joint_count: usize) -> File {
    let body = &Joint::ALL[..22];
    let mut parents: Vec<u32> = body
        .iter()
        .map(|joint| joint.parent().map_or(u32::MAX, |p| p as u32))
        .collect();
    parents.extend(vec![15; joint_count - 52]);
    for wrist in [20, 21] {
        for _ in 0..5 {
            let first = parents.len() as u32;
            parents.extend([wrist, first, first + 1]);
        }
    }
    file_of(&parents)
}

fn file_of(parents: &[u32]) -> File {
    let n = N_VERTICES as u64;
    let n_joints = parents.len();
    let mut regressor = filled(&[n_joints as u64, n], 5_000, 1.0);
    for row in regressor.values.chunks_exact_mut(N_VERTICES) {
        let sum: f64 = row.iter().map(|x| x.abs()).sum();
        row.iter_mut().for_each(|x| *x = x.abs() / sum);
    }
    let mut weights = filled(&[n, n_joints as u64], 9_000, 1.0);
    for row in weights.values.chunks_exact_mut(n_joints) {
        let sum: f64 = row.iter().map(|x| x.abs()).sum();
        row.iter_mut().for_each(|x| *x = x.abs() / sum);
    }
    File {
        template: filled(&[n, 3], 1, 0.9),
        shapes: filled(&[n, 3, N_SHAPES as u64], 2_000, 0.02),
        poses: Some(filled(&[n, 3, 9 * (n_joints as u64 - 1)], 20_000, 0.01)),
        regressor,
        weights,
        tree: Array {
            shape: vec![2, n_joints as u64],
            values: parents.iter().copied().chain(0..n_joints as u32).collect(),
        },
        faces: Array {
            shape: vec![N_VERTICES as u64 - 2, 3],
            values: (0..N_VERTICES as u32 - 2)
                .flat_map(|v| [v, v + 1, v + 2])
                .collect(),
        },
    }
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug)]
enum Storage {
    DoubleC,
    SingleFortran,
}

fn npy<T: AutoSerialize + Copy>(array: &Array<T>, order: Order) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&array.shape)
        .order(order)
        .writer(Cursor::new(&mut bytes))
        .begin_nd()
        .unwrap();
    let lengths: Vec<usize> = array.shape.iter().map(|&l| l as usize).collect();
    for position in 0..array.values.len() {
        // The index of the element that stands at this position of the file.
        let mut rest = position;
        let mut index = vec![0; lengths.len()];
        let mut axes: Vec<usize> = (0..lengths.len()).collect();
        if order == Order::C {
            axes.reverse();
        }
        for axis in axes {
            index[axis] = rest % lengths[axis];
            rest /= lengths[axis];
        }
        let flat = index
            .iter()
            .zip(&lengths)
            .fold(0, |flat, (i, l)| flat * l + i);
        writer.push(&array.values[flat]).unwrap();
    }
    writer.finish().unwrap();
    bytes
}

fn archive(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (key, bytes) in entries {
        let options = zip::write::SimpleFileOptions::default();
        zip.start_file(format!("{key}.npy"), options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn entries(file: &File, storage: Storage) -> Vec<(&'static str, Vec<u8>)> {
    let floats = |array: &Array<f64>| match storage {
        Storage::DoubleC => npy(array, Order::C),
        Storage::SingleFortran => {
            let values = array.values.iter().map(|&x| x as f32).collect();
            let shape = array.shape.clone();
            npy(&Array { shape, values }, Order::Fortran)
        }
    };
    let integers = |array: &Array<u32>| match storage {
        Storage::DoubleC => npy(array, Order::C),
        Storage::SingleFortran => {
            let signed = |&x: &u32| if x == u32::MAX { -1 } else { i64::from(x) };
            let values = array.values.iter().map(signed).collect();
            let shape = array.shape.clone();
            npy(&Array { shape, values }, Order::Fortran)
        }
    };
    let mut all = vec![
        ("v_template", floats(&file.template)),
        ("shapedirs", floats(&file.shapes)),
        ("J_regressor", floats(&file.regressor)),
        ("weights", floats(&file.weights)),
        ("kintree_table", integers(&file.tree)),
        ("f", integers(&file.faces)),
    ];
    if let Some(poses) = &file.poses {
        all.push(("posedirs", floats(poses)));
    }
    all
}

fn read(file: &File, storage: Storage) -> Result<BodyModel, BodyError> {
    BodyModel::from_smpl_npz(&archive(&entries(file, storage)))
}

#[test]
fn both_storages_give_the_same_body() {
    let file = file();
    let double = read(&file, Storage::DoubleC).unwrap();
    let single = read(&file, Storage::SingleFortran).unwrap();
    assert_eq!(double.faces, single.faces);
    assert_eq!(double.vertex_count(), N_VERTICES);
    for (a, b) in double.template_m.iter().zip(&single.template_m) {
        assert!(a.distance(*b) < 1e-6);
    }
    for (a, b) in double
        .pose_dirs_m
        .iter()
        .flatten()
        .zip(single.pose_dirs_m.iter().flatten())
    {
        assert!(a.distance(*b) < 1e-6);
    }
}

#[test]
fn arrays_end_up_where_the_equations_want_them() {
    let file = file();
    let body = read(&file, Storage::DoubleC).unwrap();
    let source = |vertex: usize| {
        Vec3::from_slice(&[0, 1, 2].map(|axis| file.template.values[3 * vertex + axis] as f32))
    };
    // Moved as a whole: differences stay.
    for vertex in 0..N_VERTICES {
        let expected = source(vertex) - source(0);
        assert!((body.template_m[vertex] - body.template_m[0]).distance(expected) < 1e-6);
        let direction = |v: usize, k: usize| {
            Vec3::from_slice(
                &[0, 1, 2].map(|axis| file.shapes.values[(3 * v + axis) * N_SHAPES + k] as f32),
            )
        };
        for (k, dirs) in body.shape_dirs_m.iter().enumerate() {
            let expected = direction(vertex, k) - direction(0, k);
            assert!((dirs[vertex] - dirs[0]).distance(expected) < 1e-6);
        }
        for row in [0, 8, 100, 206] {
            let expected = Vec3::from_slice(&[0, 1, 2].map(|axis| {
                let poses = file.poses.as_ref().unwrap();
                poses.values[(3 * vertex + axis) * 207 + row] as f32
            }));
            assert!(body.pose_dirs_m[row][vertex].distance(expected) < 1e-6);
        }
    }
    // Joints are regressed from the shaped surface.
    let shape: [f32; SHAPE_COUNT] = std::array::from_fn(|k| 0.3 * k as f32 - 1.0);
    let shaped = body.shaped(&shape);
    for joint in 0..24 {
        let row = &file.regressor.values[joint * N_VERTICES..(joint + 1) * N_VERTICES];
        let expected: Vec3 = shaped
            .positions_m
            .iter()
            .zip(row)
            .map(|(p, w)| *p * *w as f32)
            .sum();
        assert!(shaped.joints_m[joint].distance(expected) < 1e-5);
    }
    // The four largest weights, as many as a run-time vertex has.
    for (vertex, skin) in body.skin.iter().enumerate() {
        let row = &file.weights.values[24 * vertex..24 * (vertex + 1)];
        let mut sorted: Vec<f64> = row.to_vec();
        sorted.sort_by(|a, b| b.total_cmp(a));
        let sum: f64 = sorted[..4].iter().sum();
        for slot in 0..4 {
            assert!((f64::from(skin.weights[slot]) - sorted[slot] / sum).abs() < 1e-6);
            assert_eq!(row[usize::from(skin.joints[slot])], sorted[slot]);
        }
    }
}

#[test]
fn the_body_stands_on_the_floor_under_its_pelvis() {
    let body = read(&file(), Storage::DoubleC).unwrap();
    let lowest = body.template_m.iter().map(|p| p.y).fold(f32::MAX, f32::min);
    assert!(lowest.abs() < 1e-6);
    let shaped = body.shaped(&[1.5; SHAPE_COUNT]);
    assert!(shaped.joints_m[0].x.abs() < 1e-5 && shaped.joints_m[0].z.abs() < 1e-5);
}

#[test]
fn pose_correctives_follow_the_rotation_matrix() {
    let body = read(&file(), Storage::DoubleC).unwrap();
    let mut pose = Pose::REST;
    let mut rest_m = body.template_m.clone();
    body.add_pose_correctives(&pose, &mut rest_m);
    assert_eq!(rest_m, body.template_m, "the rest pose corrects nothing");
    // A quarter turn about +X: R - I has row 1 (0, -1, -1) and row 2 (0, 1, -1).
    pose.parent_from_joint[4] = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    body.add_pose_correctives(&pose, &mut rest_m);
    let row = 9 * 3;
    for (vertex, rest_m) in rest_m.iter().enumerate() {
        let dir = |entry: usize| body.pose_dirs_m[row + entry][vertex];
        let expected = body.template_m[vertex] - dir(4) - dir(5) + dir(7) - dir(8);
        assert!(rest_m.distance(expected) < 1e-6);
    }
}

#[test]
fn fewer_shapes_and_no_pose_correctives_are_fine() {
    let mut file = file();
    file.shapes = filled(&[N_VERTICES as u64, 3, 4], 2_000, 0.02);
    file.poses = None;
    let body = read(&file, Storage::DoubleC).unwrap();
    assert!(body.pose_dirs_m.is_empty());
    assert!(
        body.shape_dirs_m[4..]
            .iter()
            .flatten()
            .all(|dir| *dir == Vec3::ZERO)
    );
}

fn assert_array_error(outcome: Result<BodyModel, BodyError>, expected: &str) {
    match outcome {
        Err(BodyError::Npz(NpzError::Array { key, .. })) => assert_eq!(key, expected),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("a body with a wrong `{expected}` was taken"),
    }
}

#[test]
fn wrong_arrays_are_named() {
    let refused = |key: &str, change: fn(&mut File)| {
        let mut file = file();
        change(&mut file);
        assert_array_error(read(&file, Storage::DoubleC), key);
    };
    refused("v_template", |f| f.template.values[4] = f64::NAN);
    refused("v_template", |f| f.template.shape = vec![3, 30]);
    refused("shapedirs", |f| f.shapes.shape = vec![3, 30, 12]);
    refused("posedirs", |f| {
        f.poses = Some(filled(&[30, 3, 206], 1, 1.0))
    });
    // Finite doubles beyond single precision, and millimetres.
    refused("v_template", |f| f.template.values[4] = 1e300);
    refused("v_template", |f| {
        f.template.values.iter_mut().for_each(|x| *x *= 1000.0);
    });
    refused("shapedirs", |f| f.shapes.values[7] = -1e39);
    refused("posedirs", |f| {
        f.poses.as_mut().unwrap().values[7] = 1e200;
    });
    refused("J_regressor", |f| f.regressor.values[40] = 1e32);
    refused("weights", |f| f.weights.values[..24].fill(0.0));
    refused("kintree_table", |f| f.tree.values[5] = 0);
    refused("f", |f| f.faces.values[0] = 30);
    for missing in [
        "v_template",
        "shapedirs",
        "J_regressor",
        "weights",
        "kintree_table",
        "f",
    ] {
        let mut entries = entries(&file(), Storage::DoubleC);
        entries.retain(|(key, _)| *key != missing);
        assert_array_error(BodyModel::from_smpl_npz(&archive(&entries)), missing);
    }
}

/// An array file with this header text and no data.
fn header_only(text: &str) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

#[test]
fn headers_that_lie_are_refused() {
    let nested = "(".repeat(900);
    for header in [
        "{'descr': '|O', 'fortran_order': False, 'shape': (24, 30), }\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (24, 30), }\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296), }\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 99999999999999999999), }\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (), }\n",
        "{'descr': '<U9', 'fortran_order': False, 'shape': (1, 3), }\n",
        "{'fortran_order': False}\n",
        nested.as_str(),
        "",
    ] {
        let mut entries = entries(&file(), Storage::DoubleC);
        for (key, bytes) in &mut entries {
            if *key == "J_regressor" {
                *bytes = header_only(header);
            }
        }
        assert_array_error(BodyModel::from_smpl_npz(&archive(&entries)), "J_regressor");
    }
}

#[test]
fn joints_that_are_no_means_of_vertices_are_refused() {
    for factor in [0.0, 2.0] {
        let mut file = file();
        for weight in &mut file.regressor.values[3 * N_VERTICES..4 * N_VERTICES] {
            *weight *= factor;
        }
        let bytes = archive(&entries(&file, Storage::DoubleC));
        let text = BodyModel::from_smpl_npz(&bytes).unwrap_err().to_string();
        assert!(
            text.contains("sum to 1") && text.contains("joint 3"),
            "{text}"
        );
    }
}

#[test]
fn what_is_no_archive_is_refused() {
    for bytes in [&b""[..], b"PK", b"no archive"] {
        let error = BodyModel::from_smpl_npz(bytes).unwrap_err();
        assert!(
            matches!(error, BodyError::Npz(NpzError::Archive { .. })),
            "{error}"
        );
    }
}

#[test]
fn a_pickle_is_refused_with_the_way_out() {
    for bytes in [&b"\x80\x04 a pickle"[..], b"(dp0\nS'J_regressor'"] {
        let error = BodyModel::from_smpl_npz(bytes).unwrap_err();
        assert!(matches!(error, BodyError::Pickle), "{error}");
        assert!(error.to_string().contains("numpy.savez"), "{error}");
    }
}

#[test]
fn fingers_jaw_and_eyes_become_hands_and_head() {
    for (count, layout) in [(52, SmplLayout::SmplH), (55, SmplLayout::SmplX)] {
        let file = file_with_fingers(count);
        let bytes = archive(&entries(&file, Storage::DoubleC));
        let (body, found) = BodyModel::read_smpl_npz(&bytes).unwrap();
        assert_eq!(found.layout, layout);
        assert_eq!(found.shape_count, N_SHAPES);
        assert_eq!(found.pose_dir_count, 9 * (count - 1));
        assert_eq!(
            found.folded[..2],
            [(Joint::LeftHand, 15), (Joint::RightHand, 15)]
        );
        assert_eq!(
            found.folded.get(2),
            (count == 55).then_some(&(Joint::Head, 3))
        );
        let first_finger = count - 30;
        // The hand stands amid the five joints that hang on the wrist.
        let knuckles = [0, 3, 6, 9, 12].map(|finger| first_finger + finger);
        let shift =
            body.template_m[0].as_dvec3() - glam::DVec3::from_slice(&file.template.values[..3]);
        let expected = knuckles
            .iter()
            .flat_map(|joint| (0..N_VERTICES).map(move |vertex| (joint, vertex)))
            .map(|(joint, vertex)| {
                0.2 * file.regressor.values[joint * N_VERTICES + vertex]
                    * glam::DVec3::from_slice(&file.template.values[3 * vertex..])
            })
            .sum::<glam::DVec3>()
            + shift;
        let hand_m = body.joint_template_m[Joint::LeftHand as usize];
        assert!(
            hand_m.as_dvec3().distance(expected) < 1e-6,
            "{hand_m} {expected}"
        );
        // All weights of the left fingers are the hand's.
        for (vertex, skin) in body.skin.iter().enumerate() {
            let row = &file.weights.values[count * vertex..count * (vertex + 1)];
            let left: f64 = row[first_finger..first_finger + 15].iter().sum();
            let right: f64 = row[first_finger + 15..].iter().sum();
            let slot = |joint: Joint| skin.joints.iter().position(|own| *own == joint as u8);
            let of = |joint: Joint| f64::from(skin.weights[slot(joint).unwrap()]);
            let ratio = of(Joint::LeftHand) / of(Joint::RightHand);
            assert!((ratio - left / right).abs() < 1e-4 * ratio);
        }
        // The shared joints keep their correctives; those of fingers are left out.
        let poses = file.poses.as_ref().unwrap();
        let dir = |row: usize| poses.values[5 * 3 * 9 * (count - 1) + row] as f32;
        assert!((body.pose_dirs_m[188][5].x - dir(188)).abs() < 1e-7);
        assert!(
            body.pose_dirs_m[189..]
                .iter()
                .flatten()
                .all(|dir| *dir == Vec3::ZERO)
        );
    }
    let mut file = file_with_fingers(52);
    file.tree.values[30] = 3;
    assert_array_error(read(&file, Storage::DoubleC), "kintree_table");
    let mut file = file_with_fingers(52);
    file.tree.values[30] = 31;
    assert_array_error(read(&file, Storage::DoubleC), "kintree_table");
    assert_array_error(read(&file_of(&[0; 40]), Storage::DoubleC), "kintree_table");
}

#[test]
fn a_sparse_regressor_is_read_by_its_fields() {
    let file = file();
    let dense = read(&file, Storage::DoubleC).unwrap();
    let of = |shape: usize, values: Vec<f64>| Array {
        shape: vec![shape as u64],
        values,
    };
    let whole = |values: Vec<usize>| Array {
        shape: vec![values.len() as u64],
        values: values.into_iter().map(|x| x as u32).collect(),
    };
    for by_column in [false, true] {
        let (lines, along) = if by_column {
            (N_VERTICES, 24)
        } else {
            (24, N_VERTICES)
        };
        let at = |line: usize, place: usize| match by_column {
            true => file.regressor.values[place * N_VERTICES + line],
            false => file.regressor.values[line * N_VERTICES + place],
        };
        let pairs = || (0..lines).flat_map(|line| (0..along).map(move |place| (line, place)));
        let data: Vec<f64> = pairs().map(|(line, place)| at(line, place)).collect();
        let with = |starts: Vec<usize>, across: Vec<usize>| {
            let mut entries = entries(&file, Storage::DoubleC);
            entries.retain(|(key, _)| *key != "J_regressor");
            entries.push((
                "J_regressor_data",
                npy(&of(data.len(), data.clone()), Order::C),
            ));
            entries.push(("J_regressor_indices", npy(&whole(across), Order::C)));
            entries.push(("J_regressor_indptr", npy(&whole(starts), Order::C)));
            BodyModel::read_smpl_npz(&archive(&entries))
        };
        let starts: Vec<usize> = (0..=lines).map(|line| line * along).collect();
        let across: Vec<usize> = pairs().map(|(_, place)| place).collect();
        let (body, found) = with(starts.clone(), across.clone()).unwrap();
        assert!(found.has_sparse_regressor);
        for (a, b) in body.joint_template_m.iter().zip(dense.joint_template_m) {
            assert!(a.distance(b) < 1e-6);
        }
        let refused =
            |starts, across, key| assert_array_error(with(starts, across).map(|b| b.0), key);
        let mut far = across.clone();
        far[7] = along;
        refused(starts.clone(), far, "J_regressor_indices");
        let mut falling = starts.clone();
        falling[1] = falling[2] + 1;
        refused(falling, across.clone(), "J_regressor_indptr");
        refused(starts[1..].to_vec(), across, "J_regressor_indptr");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn damaged_files_never_panic(
        cut in any::<prop::sample::Index>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8)
    ) {
        let mut bytes = archive(&entries(&file(), Storage::DoubleC));
        for (index, value) in &flips {
            let at = index.index(bytes.len());
            bytes[at] = *value;
        }
        if flips.is_empty() {
            bytes.truncate(cut.index(bytes.len()));
            prop_assert!(BodyModel::from_smpl_npz(&bytes).is_err());
        } else if let Ok(body) = BodyModel::from_smpl_npz(&bytes) {
            prop_assert!(body.template_m.iter().all(|p| p.is_finite()));
        }
    }
}
