//! The examples run, on the models of the repository and on small files made here.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]
// Examples are programs of their own and share a file.
#![allow(clippy::duplicate_mod)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use dynaskin::{JOINT_COUNT, Joint, RuntimeError, load_model};
use dynaskin_npz::Writer;

#[path = "../examples/crowd.rs"]
mod crowd;
#[path = "../examples/play_bvh.rs"]
mod play_bvh;
#[path = "../examples/smpl_npz.rs"]
mod smpl_npz;

fn female() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female")
}

/// A BVH file in centimetres: the body hops twice a second, 10 cm high, for a second.
fn hopping_bvh(rest_cm: &[[f64; 3]; JOINT_COUNT]) -> String {
    fn write_joint(
        text: &mut String,
        joint: Joint,
        depth: usize,
        rest_cm: &[[f64; 3]; JOINT_COUNT],
    ) {
        let indent = "\t".repeat(depth);
        let own = rest_cm[joint as usize];
        let above = joint.parent().map_or([0.0; 3], |up| rest_cm[up as usize]);
        let (kind, channels) = match joint.parent() {
            None => ("ROOT", "6 Xposition Yposition Zposition"),
            Some(_) => ("JOINT", "3"),
        };
        let [x, y, z] = [0, 1, 2].map(|axis| own[axis] - above[axis]);
        writeln!(text, "{indent}{kind} {}\n{indent}{{", joint.name()).unwrap();
        writeln!(text, "{indent}\tOFFSET {x} {y} {z}").unwrap();
        writeln!(
            text,
            "{indent}\tCHANNELS {channels} Zrotation Xrotation Yrotation"
        )
        .unwrap();
        let children = Joint::ALL
            .into_iter()
            .filter(|below| below.parent() == Some(joint));
        let children: Vec<Joint> = children.collect();
        for child in &children {
            write_joint(text, *child, depth + 1, rest_cm);
        }
        if children.is_empty() {
            writeln!(
                text,
                "{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET 0 5 0\n{indent}\t}}"
            )
            .unwrap();
        }
        writeln!(text, "{indent}}}").unwrap();
    }
    const FRAMES: usize = 61;
    let mut text = "HIERARCHY\n".to_owned();
    write_joint(&mut text, Joint::Pelvis, 0, rest_cm);
    writeln!(text, "MOTION\nFrames: {FRAMES}\nFrame Time: 0.0166667").unwrap();
    let [x, y, z] = rest_cm[0];
    for frame in 0..FRAMES {
        let rise_cm = 10.0 * (std::f64::consts::TAU * frame as f64 / 60.0).sin().abs();
        let turns = "0 ".repeat(3 * JOINT_COUNT);
        writeln!(text, "{x} {} {z} {turns}", y + rise_cm).unwrap();
    }
    text
}

/// The numbers of the lines of an OBJ file that begin with `kind`.
fn numbers(obj: &str, kind: &str) -> Vec<Vec<f32>> {
    let lines = obj.lines().filter_map(|line| line.strip_prefix(kind));
    lines
        .map(|line| {
            line.split_whitespace()
                .map(|word| word.parse().unwrap())
                .collect()
        })
        .collect()
}

#[test]
fn a_bvh_file_becomes_a_mesh_sequence_whose_skin_moves() {
    let folder = tempfile::tempdir().unwrap();
    let model = load_model(female()).unwrap();
    let joints_m = model.body().shaped(&[0.0; 10]).joints_m;
    let rest_cm = joints_m.map(|m| m.to_array().map(|m| f64::from(m) * 100.0));
    let bvh = folder.path().join("hop.bvh");
    std::fs::write(&bvh, hopping_bvh(&rest_cm)).unwrap();
    let out = folder.path().join("meshes");
    let frames = play_bvh::run(&female(), &bvh, &out).unwrap();
    assert_eq!(frames, 31);

    let read = |frame: usize| std::fs::read_to_string(out.join(format!("frame_{frame:05}.obj")));
    let (first, later) = (read(0).unwrap(), read(20).unwrap());
    let (standing_m, moving_m) = (numbers(&first, "v "), numbers(&later, "v "));
    assert_eq!(standing_m.len(), model.body().vertex_count());
    assert_eq!(numbers(&first, "vn ").len(), standing_m.len());
    let faces = first.lines().filter(|line| line.starts_with("f ")).count();
    assert_eq!(faces, model.body().faces.len());
    // Bones rise together. Skin that moved against them is soft.
    let rises_m = standing_m.iter().zip(&moving_m).map(|(a, b)| b[1] - a[1]);
    let (least, most) = rises_m.fold((f32::MAX, f32::MIN), |(least, most), rise| {
        (least.min(rise), most.max(rise))
    });
    assert!(most - least > 0.005, "{least} to {most} m");
    assert!(read(31).is_err());
}

#[test]
fn a_crowd_steps_and_the_far_ones_get_less_detail() {
    let (report, longest_m) = crowd::run(&female(), 5, 90).unwrap();
    // At 3, 6 and 9 m; at 12 and 15 m.
    assert_eq!((report.full, report.half, report.asleep), (3, 2, 0));
    assert!(longest_m.iter().all(|&m| m > 0.001), "{longest_m:?}");
}

#[test]
fn a_smpl_body_and_an_amass_motion_become_a_mesh_sequence() {
    let folder = tempfile::tempdir().unwrap();
    let (body, motion) = (
        folder.path().join("body.npz"),
        folder.path().join("motion.npz"),
    );
    write_body(&body);
    const FRAMES: usize = 61;
    let mut file = Writer::create(&motion).unwrap();
    file.array("mocap_framerate", &[], &[60.0_f64]).unwrap();
    // Upright in a world with +Z up.
    let upright = std::f64::consts::FRAC_PI_2;
    let poses: Vec<f64> = (0..FRAMES * 72)
        .map(|i| if i % 72 == 0 { upright } else { 0.0 })
        .collect();
    let trans: Vec<f64> = (0..FRAMES)
        .flat_map(|f| [0.01 * f as f64, 0.0, 1.0])
        .collect();
    file.array("poses", &[FRAMES, 72], &poses).unwrap();
    file.array("trans", &[FRAMES, 3], &trans).unwrap();
    file.array("betas", &[10], &[0.5_f64; 10]).unwrap();
    file.finish().unwrap();

    let out = folder.path().join("meshes");
    assert_eq!(smpl_npz::run(&body, &motion, &out).unwrap(), 31);
    let read = |frame: usize| std::fs::read_to_string(out.join(format!("frame_{frame:05}.obj")));
    let (first, last) = (read(0).unwrap(), read(30).unwrap());
    for (a, b) in numbers(&first, "v ").iter().zip(numbers(&last, "v ")) {
        let moved_m = [0, 1, 2].map(|axis| b[axis] - a[axis]);
        assert!((moved_m[0] - 0.6).abs() < 1e-4, "{moved_m:?}");
        assert!(moved_m[1].abs() < 1e-4, "{moved_m:?}");
    }
}

/// A body in the layout of SMPL's files: a vertex at each joint of the model, and some triangles.
fn write_body(path: &Path) {
    let joints_m = load_model(female()).unwrap().body().joint_template_m;
    let n = JOINT_COUNT;
    let template: Vec<f64> = joints_m
        .iter()
        .flat_map(|m| m.to_array().map(f64::from))
        .collect();
    let identity: Vec<f64> = (0..n * n)
        .map(|i| f64::from(u8::from(i % (n + 1) == 0)))
        .collect();
    let parents = Joint::ALL.map(|joint| joint.parent().map_or(u32::MAX, |up| up as u32));
    let tree: Vec<u32> = parents.into_iter().chain(0..n as u32).collect();
    let faces: Vec<u32> = (0..n as u32 - 2).flat_map(|v| [v, v + 1, v + 2]).collect();
    let mut file = Writer::create(path).unwrap();
    file.array("v_template", &[n, 3], &template).unwrap();
    file.array("shapedirs", &[n, 3, 10], &vec![0.001_f64; n * 30])
        .unwrap();
    file.array("J_regressor", &[n, n], &identity).unwrap();
    file.array("weights", &[n, n], &identity).unwrap();
    file.array("kintree_table", &[2, n], &tree).unwrap();
    file.array("f", &[n - 2, 3], &faces).unwrap();
    file.finish().unwrap();
}

#[test]
fn a_folder_without_a_bundle_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = load_model(folder.path()).unwrap_err();
    let RuntimeError::ReadFile { file, .. } = &error else {
        panic!("{error}");
    };
    assert!(file.ends_with("bundle.json"), "{file}");
    assert!(file.len() > "bundle.json".len(), "{file}");
}
