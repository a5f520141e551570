//! HDF5 files in the layouts of Dyna and D-FAUST, made of our own body; what is found of their numbers, and
//! what is refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{female, rest_mesh};
use dynaskin_body::{BodyModel, Joint, Pose, SHAPE_COUNT, SkinMatrices, skin_linear};
use dynaskin_fit::{
    ClipBuilder, FitOptions, ScanOptions, ScanUnit, Scans, SequenceFit, fit_sequence, sequences,
};
use dynaskin_motion::UpAxis;
use dynaskin_npz::Archive;
use glam::{DQuat, Vec3};
use hdf5_writer::{
    DatasetBuilder, FILTER_DEFLATE, FILTER_SHUFFLE, FilterDescription, H5WriteElement, Hdf5Builder,
    WriteOptions,
};

/// Nothing is said but the frame rate.
fn options(sequence: &str) -> ScanOptions {
    ScanOptions {
        unit: None,
        up: None,
        rate_hz: 60.0,
        key: String::new(),
        sequence: (!sequence.is_empty()).then(|| sequence.to_owned()),
    }
}

fn filter(id: u16, client_data: Vec<u32>) -> FilterDescription {
    FilterDescription {
        id,
        name: None,
        client_data,
    }
}

/// A body that walks on and raises an arm, `[frame][vertex]`, in metres.
fn frames(body: &BodyModel, count: usize) -> Vec<Vec<Vec3>> {
    let shaped = body.shaped(&[0.5; SHAPE_COUNT]);
    (0..count)
        .map(|frame| {
            let mut pose = Pose::REST;
            let turn = 0.02 * frame as f64;
            pose.parent_from_joint[0] = DQuat::from_rotation_y(turn);
            pose.parent_from_joint[Joint::LeftShoulder as usize] = DQuat::from_rotation_z(turn);
            pose.root_translation_m.z = turn;
            let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
            let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
            skin_linear(&shaped.positions_m, &body.skin, &matrices, &mut world_m);
            world_m
        })
        .collect()
}

/// Numbers of a data set `[vertex, 3, frame]`, as captures come.
fn numbers(frames: &[Vec<Vec3>], change: impl Fn(Vec3) -> [f32; 3]) -> Vec<f32> {
    let mut numbers = Vec::new();
    for vertex in 0..frames[0].len() {
        for axis in 0..3 {
            numbers.extend(frames.iter().map(|frame| change(frame[vertex])[axis]));
        }
    }
    numbers
}

fn data<T: H5WriteElement>(name: &str, shape: &[usize], values: &[T]) -> DatasetBuilder {
    let shape: Vec<u64> = shape.iter().map(|&length| length as u64).collect();
    DatasetBuilder::typed_data(name, shape, values).unwrap()
}

fn packed(set: DatasetBuilder, chunk: [u64; 3], bytes: u32) -> DatasetBuilder {
    set.chunked(chunk)
        .filter(filter(FILTER_SHUFFLE, vec![bytes]))
        .filter(filter(FILTER_DEFLATE, vec![4]))
}

fn faces(body: &BodyModel) -> DatasetBuilder {
    let corners: Vec<u32> = body.faces.iter().flatten().copied().collect();
    data("faces", &[body.faces.len(), 3], &corners)
}

fn bytes(sets: impl IntoIterator<Item = DatasetBuilder>) -> Vec<u8> {
    let builder = sets
        .into_iter()
        .fold(Hdf5Builder::new(), Hdf5Builder::dataset);
    let plan = builder.into_plan().unwrap();
    plan.encode(WriteOptions::default()).unwrap()
}

fn write(folder: &Path, sets: impl IntoIterator<Item = DatasetBuilder>) -> PathBuf {
    let path = folder.join("captures.hdf5");
    fs::write(&path, bytes(sets)).unwrap();
    path
}

#[track_caller]
fn refused(path: &Path, body: &BodyModel, options: &ScanOptions, words: &[&str]) {
    let error = Scans::open(path, body, options).and_then(|scans| scans.check(|_| ()));
    let text = error.unwrap_err().to_string();
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

#[track_caller]
fn check_frames(scans: &Scans<'_>, expected: &[Vec<Vec3>]) {
    assert_eq!(scans.frame_count(), expected.len());
    scans.check(|_| ()).unwrap();
    let all = scans.frames_m(0..expected.len()).unwrap();
    let some = scans.frames_m(1..3).unwrap();
    assert_eq!(some, all[scans.vertex_count..3 * scans.vertex_count]);
    for (got, expected) in all.iter().zip(expected.iter().flatten()) {
        assert!(got.distance(*expected) < 2e-5, "{got} {expected}");
    }
}

#[test]
fn sequences_are_listed_chosen_and_read_in_any_order_of_axes() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    let made = frames(&body, 5);
    let n = body.vertex_count();
    let plain = numbers(&made, |p| p.to_array());
    let doubles: Vec<f64> = plain.iter().map(|&x| f64::from(x)).collect();
    let by_frame: Vec<f32> = made.iter().flatten().flat_map(|p| p.to_array()).collect();
    let by_axis: Vec<f32> = (0..3)
        .flat_map(|axis| (0..n).flat_map(move |v| (0..5).map(move |f| (axis, v, f))))
        .map(|(axis, v, f)| made[f][v][axis])
        .collect();
    let millimetres = numbers(&made, |p| [p.x, -p.z, p.y].map(|x| 1e3 * x));
    let path = write(
        folder.path(),
        [
            packed(data("50002_hips", &[n, 3, 5], &plain), [500, 3, 2], 4),
            packed(
                data("50002_jump", &[n, 3, 5], &doubles),
                [n as u64, 1, 5],
                8,
            ),
            data("50004_hips", &[5, n, 3], &by_frame),
            data("50004_jump", &[3, n, 5], &by_axis),
            data("50007_mm", &[n, 3, 5], &millimetres),
            data("other", &[99, 3, 5], &vec![0.0_f32; 99 * 15]),
            faces(&body),
        ],
    );
    let found = sequences(&path, &body).unwrap();
    let names: Vec<_> = found
        .iter()
        .map(|one| (one.name.as_str(), one.frame_count))
        .collect();
    assert_eq!(names.len(), 6);
    assert!(names.contains(&("50004_hips", Some(5))) && names.contains(&("other", None)));
    for (name, words) in [
        ("50002_hips", "[vertices, 3, frames]"),
        ("50002_jump", "[vertices, 3, frames]"),
        ("50004_hips", "[frames, vertices, 3]"),
        ("50004_jump", "[3, vertices, frames]"),
    ] {
        let scans = Scans::open(&path, &body, &options(name)).unwrap();
        let notes = scans.notes.join("\n");
        assert!(notes.contains(words), "{notes}");
        assert_eq!((scans.unit, scans.up), (ScanUnit::Metre, UpAxis::Y));
        check_frames(&scans, &made);
    }
    let scans = Scans::open(&path, &body, &options("50007_mm")).unwrap();
    assert_eq!((scans.unit, scans.up), (ScanUnit::Millimetre, UpAxis::Z));
    check_frames(&scans, &made);
    let told = ScanOptions {
        unit: Some(ScanUnit::Metre),
        ..options("50007_mm")
    };
    refused(&path, &body, &told, &["`50007_mm`, frame 0", "--unit"]);

    let names = ["captures.hdf5", "50002_hips", "50004_jump", "other"];
    let choose = [&names[..], &["6 sequences", "--sequence"]].concat();
    refused(&path, &body, &options(""), &choose);
    let missing = [&names[..], &["no sequence `50002_walk`"]].concat();
    refused(&path, &body, &options("50002_walk"), &missing);
    refused(
        &path,
        &body,
        &options("other"),
        &["data set `other`", "[99, 3, 5]", "6890"],
    );
    refused(&path, &body, &options("faces"), &["`faces`", "floats"]);
}

#[test]
fn files_that_hold_no_captures_are_refused_in_a_sentence() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    let n = body.vertex_count();
    let plain = numbers(&frames(&body, 3), |p| p.to_array());
    // Three frames: which 3 is which?
    let path = write(folder.path(), [data("a", &[n, 3, 3], &plain)]);
    refused(&path, &body, &options(""), &["`a`", "more than one way"]);

    let path = write(
        folder.path(),
        [data("image", &[9, 4], &[0.5_f32; 36]), faces(&body)],
    );
    refused(
        &path,
        &body,
        &options(""),
        &[
            "captures.hdf5",
            "no sequence",
            "image [9, 4] of 32-bit floats",
            "faces",
        ],
    );
    // Whole numbers, as of millimetres, are not read.
    let path = write(folder.path(), [data("a", &[n, 3, 4], &vec![7_u32; 12 * n])]);
    refused(
        &path,
        &body,
        &options("a"),
        &["`a`", "32-bit integers", "floats of 32 or 64 bits"],
    );
    // The right numbers of vertices, in another order: the faces tell.
    let mut other = body.faces.clone();
    other[7] = [other[7][0], other[7][1], (other[7][2] + 3_000) % 6_890];
    let corners: Vec<u32> = other.iter().flatten().copied().collect();
    let four = numbers(&frames(&body, 4), |p| p.to_array());
    let sets = [
        data("a", &[n, 3, 4], &four),
        data("faces", &[other.len(), 3], &corners),
    ];
    let path = write(folder.path(), sets);
    refused(&path, &body, &options("a"), &["`faces`", "face 7"]);

    // MATLAB counts from 1, and a corner below 0 is none.
    let from_1: Vec<u32> = body.faces.iter().flatten().map(|v| v + 1).collect();
    let sets = [
        data("a", &[n, 3, 4], &four),
        data("faces", &[body.faces.len(), 3], &from_1),
    ];
    let path = write(folder.path(), sets);
    check_frames(
        &Scans::open(&path, &body, &options("a")).unwrap(),
        &frames(&body, 4),
    );
    let mut below: Vec<i32> = body.faces.iter().flatten().map(|v| *v as i32).collect();
    below[16] = -3;
    let sets = [
        data("a", &[n, 3, 4], &four),
        data("faces", &[body.faces.len(), 3], &below),
    ];
    let path = write(folder.path(), sets);
    refused(
        &path,
        &body,
        &options("a"),
        &["`faces`", "names vertex -3", "6890"],
    );

    fs::write(&path, "not a capture").unwrap();
    refused(
        &path,
        &body,
        &options(""),
        &["captures.hdf5", "no HDF5 file"],
    );
    let whole = bytes([packed(data("a", &[n, 3, 4], &four), [1_000, 3, 2], 4)]);
    for length in [100, whole.len() / 2, whole.len() - 1] {
        fs::write(&path, &whole[..length]).unwrap();
        refused(&path, &body, &options(""), &["captures.hdf5", "again"]);
    }
}

#[test]
fn frames_with_holes_are_named_before_anything_is_fitted() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    let n = body.vertex_count();
    for (vertex, frame, value) in [(4_000, 3, f32::NAN), (17, 0, f32::INFINITY)] {
        let mut made = frames(&body, 4);
        made[frame][vertex].y = value;
        let sets = [data("a", &[n, 3, 4], &numbers(&made, |p| p.to_array()))];
        let path = write(folder.path(), sets);
        let place = format!("`a`, frame {frame}, vertex {vertex}");
        refused(&path, &body, &options(""), &["captures.hdf5", &place]);
    }
}

#[test]
fn a_unit_or_an_axis_that_is_not_sure_is_asked_for() {
    let body = female();
    let mesh = rest_mesh(&body);
    let open = |change: &dyn Fn(Vec3) -> Vec3, options: &ScanOptions| {
        let positions = mesh.iter().map(|p| change(*p)).collect();
        Scans::new(Path::new("scan"), &body, positions, options).map(|scans| (scans.unit, scans.up))
    };
    let found = |change: &dyn Fn(Vec3) -> Vec3| open(change, &options("")).unwrap();
    assert_eq!(found(&|p| p * 1.2), (ScanUnit::Metre, UpAxis::Y));
    assert_eq!(found(&|p| p * 80.0), (ScanUnit::Centimetre, UpAxis::Y));
    let y_down = |p: Vec3| Vec3::new(p.x, -p.y, -p.z) * 1e3;
    assert_eq!(found(&y_down), (ScanUnit::Millimetre, UpAxis::MinusY));

    let inches = |p: Vec3| p * 39.37;
    let error = open(&inches, &options("")).unwrap_err().to_string();
    assert!(
        error.contains("39.37") && error.contains("--unit"),
        "{error}"
    );
    // Lying on the back along x.
    let lying = |p: Vec3| Vec3::new(p.y, p.z, p.x);
    let error = open(&lying, &options("")).unwrap_err().to_string();
    assert!(error.contains("--up"), "{error}");
    let told = ScanOptions {
        up: Some(UpAxis::Z),
        ..options("")
    };
    assert_eq!(open(&lying, &told).unwrap(), (ScanUnit::Metre, UpAxis::Z));
}

#[test]
fn a_streamed_fit_is_the_one_that_is_held() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    let n = body.vertex_count();
    let made = frames(&body, 5);
    let set = data("a", &[n, 3, 5], &numbers(&made, |p| p.to_array()));
    let path = write(folder.path(), [packed(set, [1_000, 3, 2], 4)]);
    let scans = Scans::open(&path, &body, &options("")).unwrap();
    let fit_options = FitOptions::for_body(&body);
    let held = fit_sequence(&body, &scans, &fit_options, |_| {}).unwrap();
    assert!(held.frames.iter().all(|f| f.rigid_distance_m < 1e-3));

    let fit = SequenceFit::begin(&body, &scans, &fit_options).unwrap();
    assert_eq!(fit.shape(), held.shape);
    let out = folder.path().join("fit.npz");
    let mut clip = ClipBuilder::new(&body, fit.rate_hz(), fit.shape());
    fit.write_npz(&out, |_| {}, |frame| clip.push(frame))
        .unwrap();
    let mut archive = Archive::open(fs::File::open(&out).unwrap(), 1 << 30).unwrap();
    let shape = [Some(5), Some(n), Some(3)];
    let offsets = archive.floats_single("offsets_rest_m", &shape).unwrap();
    let expected: Vec<f32> = held
        .frames
        .iter()
        .flat_map(|frame| frame.offsets_rest_m.iter().flat_map(|p| p.to_array()))
        .collect();
    assert_eq!(offsets.values(), expected);
    assert_eq!(archive.shape("poses").unwrap(), [5, 72]);
    let clip = clip.finish("", "a__b").unwrap();
    assert_eq!(clip.frame_count(), 5);
}
