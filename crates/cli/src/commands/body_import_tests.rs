//! Importing made files of SMPL's layouts.

#[path = "../../tests/common/smpl_file.rs"]
mod smpl_file;

use std::sync::Arc;

use dynaskin_body::{JOINT_COUNT, Joint, Pose, SkinMatrices, skin_linear};
use dynaskin_runtime::{Avatar, Model};
use glam::{DQuat, Vec3};
use smpl_file::Made;

use super::*;

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models")
}

fn our_body() -> BodyModel {
    lending_body(&models(), Sex::Female).unwrap()
}

fn args(file: &Path, out: &Path) -> ImportArgs {
    ImportArgs {
        file: file.to_owned(),
        out: out.to_owned(),
        depicts: Some("adult".to_owned()),
        sex: Some(Lender::Female),
        no_regions: false,
        models: models(),
        no_pose_correctives: false,
        overwrite: false,
    }
}

fn read(out: &Path) -> BodyModel {
    BodyModel::from_glb(&fs::read(out.join("body.glb")).unwrap()).unwrap()
}

fn bent() -> Pose {
    let mut pose = Pose::REST;
    for joint in Joint::ALL {
        let idx = f64::from(joint as u8);
        let axis = glam::DVec3::new(idx.sin(), 1.0, idx.cos()).normalize();
        pose.parent_from_joint[joint as usize] =
            DQuat::from_axis_angle(axis, 0.6 * (2.0 * idx).sin());
    }
    pose
}

#[test]
fn a_body_of_smpls_layout_comes_back_and_moves_as_the_equations_say() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("smpl.npz"), folder.path().join("mine"));
    let ours = our_body();
    Made::of(&ours).write(&ours, &file);
    run(&args(&file, &out)).unwrap();
    let body = read(&out);
    assert_eq!(body.name, "smpl");
    assert!(body.copyright.contains("smpl.npz"), "{}", body.copyright);
    for (joint, (a, b)) in body
        .joint_template_m
        .iter()
        .zip(ours.joint_template_m)
        .enumerate()
    {
        assert!(a.distance(b) < 2e-3, "joint {joint}: {a} {b}");
    }
    // The body's own regions come back from its own surface.
    for (own, taken) in ours.region_weights.iter().zip(&body.region_weights) {
        let sum = |weights: &[f32]| weights.iter().sum::<f32>();
        let off: f32 = own.iter().zip(taken).map(|(a, b)| (a - b).abs()).sum();
        assert!(off < 0.05 * sum(own), "{off} of {}", sum(own));
    }
    let off_m = ours
        .thickness_template_m
        .iter()
        .zip(&body.thickness_template_m)
        .map(|(a, b)| (a - b).abs());
    assert!(off_m.sum::<f32>() < 0.05 * ours.thickness_template_m.iter().sum::<f32>());

    let mut avatar = Avatar::new(
        Arc::new(Model::body_only(Arc::new(body.clone()))),
        &[0.5; 10],
    )
    .unwrap();
    let pose = bent();
    avatar.step(&pose, 1.0 / 60.0).unwrap();
    // Against the arrays of the file itself, which the file's steps of 0.1 mm have rounded.
    let unrounded = BodyModel::from_smpl_npz(&fs::read(&file).unwrap()).unwrap();
    for (reference, most_m) in [(body, 1e-5), (unrounded, 1.5e-4)] {
        let shaped = reference.shaped(&[0.5; 10]);
        let mut rest_m = shaped.positions_m;
        reference.add_pose_correctives(&pose, &mut rest_m);
        let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
        let mut world_m = vec![Vec3::ZERO; rest_m.len()];
        skin_linear(&rest_m, &reference.skin, &matrices, &mut world_m);
        let (skinned_m, _) = avatar.skin();
        let worst_m = world_m
            .iter()
            .zip(skinned_m)
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f32::max);
        assert!(worst_m <= most_m, "{worst_m} m");
    }
}

#[test]
fn regions_of_another_body_lie_where_its_own_are() {
    let [female, male] = [Sex::Female, Sex::Male].map(|sex| lending_body(&models(), sex).unwrap());
    let options = BindOptions::adult();
    let taken = transfer(&male, &female, &options).unwrap();
    assert!(taken.regions_off.is_empty(), "{:?}", taken.regions_off);
    let regions = male.region_weights.iter().zip(&taken.region_weights);
    for (region, (own, taken)) in regions.enumerate() {
        let shared: f32 = own.iter().zip(taken).map(|(a, b)| a.min(*b)).sum();
        let either: f32 = own.iter().zip(taken).map(|(a, b)| a.max(*b)).sum();
        assert!(
            shared > 0.6 * either,
            "region {region}: {}",
            shared / either
        );
    }
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
    let ratio = mean(&taken.thickness_m) / mean(&male.thickness_template_m);
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

#[test]
fn fingers_are_said_to_have_become_hands() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("smplh.npz");
    let ours = our_body();
    Made::of(&ours).with_fingers().write(&ours, &file);
    let mut args = args(&file, &folder.path().join("mine"));
    (args.sex, args.no_regions) = (None, true);
    let (body, note) = imported(&args).unwrap();
    let note = note.join("\n");
    assert!(note.contains("SMPL-H"), "{note}");
    assert!(note.contains("459 (189 kept)"), "{note}");
    assert!(note.contains("12 (10 kept)"), "{note}");
    assert!(
        note.contains("15 joints became part of left_hand"),
        "{note}"
    );
    assert!(note.contains("without soft regions"), "{note}");
    assert!(body.region_weights.is_empty() && body.thickness_template_m.is_empty());
    for (a, b) in body.skin.iter().zip(&ours.skin) {
        let dense = |skin: &dynaskin_body::SkinWeights| {
            let mut dense = [0.0_f32; JOINT_COUNT];
            for (joint, weight) in skin.joints.iter().zip(skin.weights) {
                dense[usize::from(*joint)] += weight;
            }
            dense
        };
        assert!(
            dense(a)
                .iter()
                .zip(dense(b))
                .all(|(a, b)| (a - b).abs() < 1e-5)
        );
    }
}

#[test]
fn what_cannot_be_imported_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let ours = our_body();
    let file = folder.path().join("smpl.npz");
    let out = folder.path().join("mine");
    let refused = |args: &ImportArgs, words: &str| {
        let error = format!("{:#}", run(args).unwrap_err());
        assert!(error.contains(words), "{error}");
        assert!(!out.exists());
    };
    // Without `posedirs`, which take long to write and are asked for after the other arrays.
    let made = || Made {
        has_pose_dirs: false,
        ..Made::of(&ours)
    };
    let plain = || ImportArgs {
        no_pose_correctives: true,
        ..args(&file, &out)
    };
    let bare = || ImportArgs {
        sex: None,
        no_regions: true,
        ..plain()
    };
    made().write(&ours, &file);
    refused(&args(&file, &out), "no `posedirs`");
    let (body, note) = imported(&plain()).unwrap();
    assert!(body.pose_dirs_m.is_empty(), "{note:?}");

    for told in [plain(), bare()] {
        let undeclared = ImportArgs {
            depicts: None,
            ..told
        };
        refused(&undeclared, "adults alone");
    }

    // A head and a stature as a child has them.
    let mut child = made();
    let shrink = |point: &mut Vec3| *point *= if point.y > 1.3 { 0.75 } else { 0.65 };
    child.template_m.iter_mut().for_each(shrink);
    child.joints_m.iter_mut().for_each(shrink);
    child.write(&ours, &file);
    for told in [plain(), bare()] {
        refused(&told, "proportions of an adult");
    }

    // Another unit, another axis, and left for right.
    let changes: [(&dyn Fn(Vec3) -> Vec3, &str); 3] = [
        (&|p| 10.0 * p, "must be metres"),
        (&|p| Vec3::new(p.x, -p.z, p.y), "so that y is up"),
        (&|p| Vec3::new(-p.x, p.y, p.z), "the faces look inwards"),
    ];
    for (change, words) in changes {
        let mut changed = made();
        for place in changed.template_m.iter_mut().chain(&mut changed.joints_m) {
            *place = change(*place);
        }
        changed.write(&ours, &file);
        refused(&bare(), words);
    }

    let mut broken = made();
    broken.template_m[17].y = f32::NAN;
    broken.write(&ours, &file);
    refused(&args(&file, &out), "`v_template`: expected finite numbers");
    let mut shorter = made();
    shorter.template_m.pop();
    shorter.write(&ours, &file);
    refused(&args(&file, &out), "`f`: expected indices below 6889");
    fs::write(&file, b"\x80\x02}q\x01(X\x0b").unwrap();
    refused(&args(&file, &out), "Python pickle");
    made().write(&ours, &file);
    let nowhere = ImportArgs {
        models: folder.path().to_owned(),
        ..plain()
    };
    refused(&nowhere, "--models");
}

#[test]
fn a_body_that_is_there_stays() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("body.glb");
    fs::write(&kept, b"mine").unwrap();
    let error = run(&args(&folder.path().join("smpl.npz"), folder.path())).unwrap_err();
    assert!(error.to_string().contains("--overwrite"), "{error}");
    assert_eq!(fs::read(&kept).unwrap(), b"mine");
}
