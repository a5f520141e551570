//! Whose sequences are, and which of them tells a person's shape.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{female, rest_mesh};
use dynaskin_body::{Joint, Pose, SHAPE_COUNT, SkinMatrices, skin_linear};
use dynaskin_fit::{Capture, ScanOptions, Scans, captures, nearest_to_rest, turned_degrees};
use glam::{DQuat, Vec3};

fn capture(name: &str) -> Capture {
    let (person, motion) = name.split_once('_').unwrap();
    Capture {
        name: name.to_owned(),
        person: person.to_owned(),
        motion: motion.to_owned(),
        path: Path::new(name).to_owned(),
        sequence: None,
    }
}

#[test]
fn a_folder_has_sequences_of_people() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    let told = |words: &[&str]| {
        let text = captures(folder.path(), &body).unwrap_err().to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` is missing in: {text}");
        }
    };
    told(&["holds no captures", "PERSON_MOTION"]);
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("50004_one_leg_jump")).unwrap();
    fs::write(at("50004_one_leg_jump/0001.ply"), "").unwrap();
    fs::create_dir(at("notes")).unwrap();
    fs::write(at("50002_hips.npz"), "").unwrap();
    fs::write(at("readme.txt"), "").unwrap();
    let found = captures(folder.path(), &body).unwrap();
    let names: Vec<_> = found
        .iter()
        .map(|one| (one.person.as_str(), one.motion.as_str()))
        .collect();
    assert_eq!(names, [("50002", "hips"), ("50004", "one_leg_jump")]);

    fs::create_dir(at("50002_hips")).unwrap();
    fs::write(at("50002_hips/0001.obj"), "").unwrap();
    told(&["50002_hips.npz and ", "would have the same files"]);
    fs::remove_dir_all(at("50002_hips")).unwrap();
    fs::write(at("hips.npz"), "").unwrap();
    told(&["`hips` does not say whose it is"]);
    fs::remove_file(at("hips.npz")).unwrap();
    fs::write(at("0001.ply"), "").unwrap();
    told(&["one sequence"]);
}

#[test]
fn names_that_no_file_can_have_are_refused() {
    let body = female();
    let folder = tempfile::tempdir().unwrap();
    let told = |name: &str| {
        let path = folder.path().join(name);
        fs::write(&path, "").unwrap();
        let found = captures(folder.path(), &body);
        fs::remove_file(&path).unwrap();
        found.map_err(|error| error.to_string())
    };
    let long = format!("50002_{}.npz", "x".repeat(200));
    for (name, words) in [
        ("50002_a\\b.npz", "has the character '\\\\'"),
        ("50002_a\nb.npz", "has the character '\\n'"),
        ("50002_\x1b[31mred.npz", "has the character '\\u{1b}'"),
        ("a:b_c.npz", "has the character ':'"),
        ("-p_m.npz", "begins with a dot or a dash"),
        (&long, "has 206 bytes"),
    ] {
        let text = told(name).unwrap_err();
        assert!(text.contains(words), "`{words}` is missing in: {text}");
        assert!(text.contains("PERSON_MOTION"), "{text}");
    }
    // What other systems put beside is no capture.
    told("._50002_hips.npz").unwrap_err();
    let found = told("50002_ü \u{65e5}.b.npz").unwrap();
    assert_eq!(found[0].motion, "ü \u{65e5}.b");
    // Their clips would be one file, on some file systems their fits as well.
    fs::write(folder.path().join("50002_a_b.npz"), "").unwrap();
    for other in ["50002_a__b.npz", "50002__a_b_.npz", "50002_A_b.npz"] {
        let text = told(other).unwrap_err();
        assert!(text.contains("would have the same files"), "{text}");
    }
}

#[test]
fn shapes_are_from_the_sequence_that_begins_nearest_to_rest() {
    let all = ["a_run", "a_stand", "b_walk"].map(capture);
    let of_a = |degrees: &[Option<f64>]| {
        let mut nearest = nearest_to_rest(&all, degrees);
        let (capture, degrees) = nearest.remove("a").unwrap().unwrap();
        (capture.name.clone(), degrees)
    };
    let both = of_a(&[Some(9.0), Some(3.0), Some(4.0)]);
    assert_eq!(both, ("a_stand".to_owned(), 3.0));
    // One that cannot be read is passed over, and somebody who never rests does not matter to others.
    let one = of_a(&[Some(9.0), None, Some(30.0)]);
    assert_eq!(one, ("a_run".to_owned(), 9.0));
    let mut nearest = nearest_to_rest(&all, &[Some(9.0), None, Some(30.0)]);
    let text = nearest.remove("b").unwrap().unwrap_err().to_string();
    assert!(
        text.contains("sequence of b") && text.contains("b_walk"),
        "{text}"
    );
    assert!(
        text.contains("--shape b=") && text.contains("30 degrees"),
        "{text}"
    );
}

#[test]
fn the_distance_from_rest_counts_all_joints_but_the_pelvis() {
    let body = female();
    let shaped = body.shaped(&[1.0; SHAPE_COUNT]);
    let posed = |pose: &Pose| {
        let matrices = SkinMatrices::new(pose, &shaped.joints_m);
        let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
        skin_linear(&shaped.positions_m, &body.skin, &matrices, &mut world_m);
        world_m
    };
    let degrees = |world_m: Vec<Vec3>| {
        let options = ScanOptions {
            unit: None,
            up: None,
            rate_hz: 60.0,
            key: String::new(),
            sequence: None,
        };
        let scans = Scans::new(Path::new("scan"), &body, world_m, &options).unwrap();
        turned_degrees(&body, &scans).unwrap()
    };
    let rest = degrees(rest_mesh(&body));
    assert!(rest < 0.1, "{rest}");
    let mut pose = Pose::REST;
    pose.parent_from_joint[0] = DQuat::from_rotation_y(1.5);
    let turned = degrees(posed(&pose));
    assert!(turned < 5.0, "{turned}");
    for joint in [
        Joint::LeftKnee,
        Joint::RightKnee,
        Joint::LeftHip,
        Joint::RightHip,
    ] {
        pose.parent_from_joint[joint as usize] = DQuat::from_rotation_x(1.5);
    }
    let sitting = degrees(posed(&pose));
    assert!(sitting > turned + 12.0, "{sitting}");
}
