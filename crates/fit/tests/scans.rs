//! Mesh sequences from files, and files that are refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use common::{female, rest_mesh};
use dynaskin_body::BodyModel;
use dynaskin_fit::{FitError, ScanOptions, ScanUnit, Scans};
use dynaskin_motion::UpAxis;
use dynaskin_npz::Writer;
use glam::Vec3;

fn options() -> ScanOptions {
    ScanOptions {
        unit: Some(ScanUnit::Metre),
        up: Some(UpAxis::Y),
        rate_hz: 60.0,
        key: "vertices".to_owned(),
        sequence: None,
    }
}

fn obj(positions: &[Vec3], faces: &[[u32; 3]]) -> String {
    let mut text = String::from("# a scan\nmtllib body.mtl\no body\n");
    for p in positions {
        // Colours behind the position, as scanners write them.
        writeln!(text, "v {} {} {} 0.5 0.5 0.5", p.x, p.y, p.z).unwrap();
    }
    text.push_str("g skin\ns 1\n");
    for [a, b, c] in faces {
        writeln!(text, "f {}/1/1 {}//1 {}", a + 1, b + 1, c + 1).unwrap();
    }
    text
}

fn ply_header(format: &str, vertices: usize, faces: usize) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment a scan\nelement vertex {vertices}\nproperty uchar red\n\
         property float x\nproperty float y\nproperty float z\nelement face {faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    )
}

fn ply_binary(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec<u8> {
    let header = ply_header("binary_little_endian", positions.len(), faces.len());
    let mut bytes = header.into_bytes();
    for p in positions {
        bytes.push(200);
        bytes.extend(p.to_array().into_iter().flat_map(f32::to_le_bytes));
    }
    for face in faces {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|&index| (index as i32).to_le_bytes()));
    }
    bytes
}

fn ply_ascii(positions: &[Vec3], faces: &[[u32; 3]]) -> String {
    let mut text = ply_header("ascii", positions.len(), faces.len());
    for p in positions {
        writeln!(text, "200 {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in faces {
        writeln!(text, "3 {a} {b} {c}").unwrap();
    }
    text
}

fn raised(positions: &[Vec3], frame: usize) -> Vec<Vec3> {
    let up_m = Vec3::Y * frame as f32 * 0.1;
    positions.iter().map(|p| *p + up_m).collect()
}

#[track_caller]
fn check_raised(scans: &Scans<'_>, mesh: &[Vec3], frames: usize) {
    assert_eq!(scans.frame_count(), frames);
    for frame in 0..frames {
        let got = scans.frames_m(frame..frame + 1).unwrap();
        for (got, expected) in got.iter().zip(raised(mesh, frame)) {
            assert!(
                got.distance(expected) < 1e-5,
                "frame {frame}: {got} {expected}"
            );
        }
    }
}

#[test]
fn objs_and_plys_are_read_in_the_order_of_their_numbers() {
    let body = female();
    let mesh = rest_mesh(&body);
    let folder = tempfile::tempdir().unwrap();
    for frame in 0..12 {
        let path = folder.path().join(format!("scan{frame}.OBJ"));
        fs::write(path, obj(&raised(&mesh, frame), &body.faces)).unwrap();
    }
    fs::write(folder.path().join("notes.txt"), "no mesh").unwrap();
    check_raised(
        &Scans::open(folder.path(), &body, &options()).unwrap(),
        &mesh,
        12,
    );

    let folder = tempfile::tempdir().unwrap();
    let path = |frame: usize| folder.path().join(format!("{frame:04}.ply"));
    fs::write(path(0), ply_binary(&mesh, &body.faces)).unwrap();
    fs::write(path(1), ply_ascii(&raised(&mesh, 1), &body.faces)).unwrap();
    // Bare points have no faces that could differ.
    fs::write(path(2), ply_binary(&raised(&mesh, 2), &[])).unwrap();
    check_raised(
        &Scans::open(folder.path(), &body, &options()).unwrap(),
        &mesh,
        3,
    );
}

#[test]
fn units_axes_and_keys_are_told() {
    let body = female();
    let mesh = rest_mesh(&body);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scans.npz");
    let mut writer = Writer::create(&path).unwrap();
    // Millimetres, +Z up: (x, y, z) becomes (x, -z, y).
    let numbers: Vec<f64> = (0..2)
        .flat_map(|frame| raised(&mesh, frame))
        .flat_map(|p| [p.x, -p.z, p.y].map(|x| f64::from(x) * 1e3))
        .collect();
    let shape = [2, mesh.len(), 3];
    writer.array("verts", &shape, &numbers).unwrap();
    writer.finish().unwrap();
    let told = ScanOptions {
        unit: Some(ScanUnit::Millimetre),
        up: Some(UpAxis::Z),
        key: "verts".to_owned(),
        ..options()
    };
    check_raised(&Scans::open(&path, &body, &told).unwrap(), &mesh, 2);

    refused(
        &path,
        &body,
        &options(),
        &["scans.npz", "`vertices`", "--key", "which has verts"],
    );
    let metres = ScanOptions {
        unit: Some(ScanUnit::Metre),
        ..told.clone()
    };
    refused(&path, &body, &metres, &["frame 0", "--unit"]);
    let chosen = ScanOptions {
        sequence: Some("hips".to_owned()),
        ..told.clone()
    };
    refused(&path, &body, &chosen, &["--sequence", "only HDF5"]);
    for rate_hz in [0.0, -30.0, f64::NAN, 1e9] {
        let told = ScanOptions {
            rate_hz,
            ..told.clone()
        };
        refused(&path, &body, &told, &["the frame rate", "1 to 1000 Hz"]);
    }
}

#[track_caller]
fn refused(path: &Path, body: &BodyModel, options: &ScanOptions, words: &[&str]) -> FitError {
    let error = Scans::open(path, body, options).unwrap_err();
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
    error
}

#[test]
fn folders_without_frames_are_refused() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    refused(folder.path(), &body, &options(), &["no .obj or .ply"]);
    fs::write(folder.path().join("a.obj"), "").unwrap();
    refused(
        folder.path(),
        &body,
        &options(),
        &["a.obj", "number of vertices is 0", "6890"],
    );
    fs::write(folder.path().join("a.ply"), "").unwrap();
    refused(folder.path(), &body, &options(), &["both .obj and .ply"]);
    let missing = folder.path().join("missing.npz");
    refused(
        &missing,
        &body,
        &options(),
        &["missing.npz", "opening failed"],
    );
}

#[test]
fn other_meshes_are_refused_with_file_and_place() {
    let body = female();
    let mesh = rest_mesh(&body);
    let check = |name: &str, content: &[u8], words: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(name), content).unwrap();
        refused(folder.path(), &body, &options(), &[&[name], words].concat());
    };
    // A vertex too few.
    let short = obj(&mesh[1..], &[]);
    check(
        "a.obj",
        short.as_bytes(),
        &["number of vertices is 6889", "6890"],
    );
    // The same vertices in another order.
    let mut faces = body.faces.clone();
    faces[7] = [faces[7][0], faces[7][1], (faces[7][2] + 3_000) % 6_890];
    let other = obj(&mesh, &faces);
    check(
        "a.obj",
        other.as_bytes(),
        &["face 7 is [", "whose edges the body has not"],
    );
    check("a.ply", &ply_binary(&mesh, &faces), &["face 7"]);
    // An index beyond the vertices, from either end.
    for index in ["99999", "-99999"] {
        let bad = format!("{}f 1 2 {index}\n", obj(&mesh, &[]));
        check("a.obj", bad.as_bytes(), &["a face names vertex", "6890"]);
    }
    check("a.obj", b"v 1 2\n", &["line 1 has numbers", "again"]);
    check(
        "a.obj",
        b"v 1 2 3\nv 1,0 2,0 3,0\n",
        &["line 2 has numbers"],
    );
    check("a.obj", b"v 1 2 3\nf 0 1 1\n", &["line 2", "from 1"]);
    check("a.obj", b"\xff\xfe\x00\x01", &["a.obj", "again"]);
    check(
        "a.ply",
        b"ply\nformat ascii 1.0\nend_header\n",
        &["no element `vertex`"],
    );
    check("a.ply", b"solid stl", &["a.ply", "no PLY file", "again"]);
    check(
        "a.ply",
        b"ply\nformat ascii 1.0\nelem",
        &["its header", "again"],
    );
    let huge = ply_header("ascii", 999_999_999_999, 0);
    check(
        "a.ply",
        huge.as_bytes(),
        &["999999999999", "more than the file can hold"],
    );
    let flat = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                end_header\n0 0\n";
    check("a.ply", flat.as_bytes(), &["no property `z`"]);
    let mut cut = ply_binary(&mesh, &body.faces);
    cut.truncate(cut.len() / 3);
    check(
        "a.ply",
        &cut,
        &["promises 6890 of element `vertex`", "again"],
    );
}

#[test]
fn hidden_files_are_no_frames_and_comments_may_be_in_any_encoding() {
    let body = female();
    let mesh = rest_mesh(&body);
    let folder = tempfile::tempdir().unwrap();
    let mut text = b"# K\xf6rper\n".to_vec();
    text.extend(obj(&mesh, &body.faces).bytes());
    fs::write(folder.path().join("scan0.obj"), text).unwrap();
    fs::write(folder.path().join("._scan0.obj"), b"\0\x05\x16\x07").unwrap();
    let scans = Scans::open(folder.path(), &body, &options()).unwrap();
    check_raised(&scans, &mesh, 1);
    assert_eq!(scans.doubts, [] as [&str; 0]);
    // One was left out.
    for frame in [1, 3] {
        let path = folder.path().join(format!("scan{frame}.obj"));
        fs::write(path, obj(&raised(&mesh, frame), &body.faces)).unwrap();
    }
    let scans = Scans::open(folder.path(), &body, &options()).unwrap();
    let doubts = scans.doubts.join("\n");
    assert!(
        doubts.contains("between scan1.obj and scan3.obj"),
        "{doubts}"
    );
}

#[test]
fn holes_and_sizes_that_no_body_has_are_refused() {
    let body = female();
    let check = |mesh: Vec<Vec3>, words: &[&str]| {
        let path = Path::new("scan");
        let positions = [rest_mesh(&body), mesh].concat();
        let error = Scans::new(path, &body, positions, &options()).unwrap_err();
        let text = error.to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` is missing in: {text}");
        }
    };
    let mut holed = rest_mesh(&body);
    holed[4_000].y = f32::NAN;
    check(holed, &["scan, frame 1, vertex 4000: NaN"]);
    let mut endless = rest_mesh(&body);
    endless[17].z = f32::INFINITY;
    check(endless, &["frame 1, vertex 17: inf"]);
    let mut astray = rest_mesh(&body);
    astray[77].x = 1e30;
    check(astray, &["frame 1, vertex 77", "no position"]);
    check(
        vec![Vec3::ONE; body.vertex_count()],
        &["frame 1", "in one place"],
    );
    let tiny = rest_mesh(&body).iter().map(|p| *p * 0.001).collect();
    check(tiny, &["frame 1", "0.002 m", "--unit"]);
    check(vec![Vec3::ONE; 3], &["number of vertices"]);
}

#[test]
fn a_first_frame_that_is_no_body_is_refused_whatever_is_known_of_it() {
    let body = female();
    let found = ScanOptions {
        unit: None,
        up: None,
        ..options()
    };
    let mirrored: Vec<Vec3> = rest_mesh(&body)
        .iter()
        .map(|p| Vec3::new(-p.x, p.y, p.z))
        .collect();
    let nowhere = vec![Vec3::ZERO; body.vertex_count()];
    let mut holed = rest_mesh(&body);
    holed[3].z = f32::NAN;
    for (mesh, words) in [
        (mirrored, "mirror image"),
        (nowhere, "frame 0: all vertices lie in one place"),
        (holed, "frame 0, vertex 3: NaN"),
    ] {
        for options in [&found, &options()] {
            let path = Path::new("scan");
            let error = Scans::new(path, &body, mesh.clone(), options).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(words), "`{words}` is missing in: {text}");
        }
    }
    let error = Scans::new(Path::new("scan"), &body, Vec::new(), &options()).unwrap_err();
    assert!(
        error.to_string().starts_with("scan has no frames"),
        "{error}"
    );
}
