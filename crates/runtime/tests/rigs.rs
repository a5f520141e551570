//! A walk on a rig like Mixamo's, whose collars take a share of the arms' swing, read from a BVH file:
//! the shipped networks beside what the simulator says of it.
//!
//! `DYNASKIN_WRITE_GOLDEN=1` simulates again what is compared with.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use dynaskin_body::{BodyModel, Joint, Materials, Pose, Region};
use dynaskin_motion::{Clip, MODEL_RATE_HZ, MotionFile, Procedural, ProceduralKind};
use dynaskin_runtime::features::clip_features;
use dynaskin_runtime::{Bundle, Decoder, DecoderSession, Predictor, PredictorSession};
use dynaskin_sim::{ClipLabels, CollarHabit, Shell, SimSettings, simulate_clip};
use glam::{EulerRot, Vec3};
use serde::{Deserialize, Serialize};

/// The collars' share of an arm's swing in the median of Mixamo's files while arms hang.
const SHARE: f64 = 0.28;
const SHAPE: [f32; 10] = [0.0; 10];
const REGIONS: [Region; 3] = [Region::Chest, Region::Belly, Region::UpperArms];
/// Error over static that the networks may have in each of [`REGIONS`], of the region's mean offset.
const LIMITS: [f64; 3] = [0.2, 0.2, 0.3];
/// A region that hardly moves may be off by this much instead, on average over the ticks, in millimetres: the
/// belly moves by 0.7 mm in this walk.
const LEAST_MM: f64 = 0.4;
/// Ticks until what swings at the start has gone.
const SETTLING: usize = 60;

/// Mean offsets of the regions, millimetres.
#[derive(Serialize, Deserialize)]
struct Truth {
    /// `[tick][region][xyz]`.
    mean_offset_mm: Vec<[[f32; 3]; 3]>,
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn golden() -> PathBuf {
    root().join("tests/golden/mixamo-walk.json")
}

/// The name in Mixamo's files of a joint of the body.
fn mixamo(joint: Joint) -> String {
    let name = joint.name();
    let (side, part) = match name.split_once('_') {
        Some(("left", part)) => ("Left", part),
        Some(("right", part)) => ("Right", part),
        _ => ("", name),
    };
    let bone = match part {
        "pelvis" => "Hips",
        "spine1" => "Spine",
        "spine2" => "Spine1",
        "spine3" => "Spine2",
        "neck" => "Neck",
        "head" => "Head",
        "collar" => "Shoulder",
        "shoulder" => "Arm",
        "elbow" => "ForeArm",
        "wrist" => "Hand",
        "hand" => "HandMiddle1",
        "hip" => "UpLeg",
        "knee" => "Leg",
        "ankle" => "Foot",
        "foot" => "ToeBase",
        other => panic!("{other}"),
    };
    format!("mixamorig:{side}{bone}")
}

/// The joint and what hangs on it, in centimetres.
fn hierarchy(joint: Joint, joints_m: &[Vec3; 24], order: &mut Vec<Joint>, text: &mut String) {
    order.push(joint);
    let at = joints_m[joint as usize];
    let offset_cm = 100.0
        * joint
            .parent()
            .map_or(at, |parent| at - joints_m[parent as usize]);
    let (kind, channels) = match joint.parent() {
        None => (
            "ROOT",
            "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
        ),
        Some(_) => ("JOINT", "3 Zrotation Xrotation Yrotation"),
    };
    let Vec3 { x, y, z } = offset_cm;
    writeln!(
        text,
        "{kind} {}\n{{\nOFFSET {x} {y} {z}\nCHANNELS {channels}",
        mixamo(joint)
    )
    .unwrap();
    let mut children = Joint::ALL
        .into_iter()
        .filter(|child| child.parent() == Some(joint));
    let mut any = false;
    for child in &mut children {
        any = true;
        hierarchy(child, joints_m, order, text);
    }
    if !any {
        text.push_str("End Site\n{\nOFFSET 0 0 8\n}\n");
    }
    text.push_str("}\n");
}

fn bvh(clip: &Clip, joints_m: &[Vec3; 24]) -> String {
    let (mut text, mut order) = (String::from("HIERARCHY\n"), Vec::new());
    hierarchy(Joint::Pelvis, joints_m, &mut order, &mut text);
    let (frames, seconds) = (clip.frames.len(), 1.0 / clip.rate_hz);
    writeln!(text, "MOTION\nFrames: {frames}\nFrame Time: {seconds:.8}").unwrap();
    for pose in &clip.frames {
        let root_cm = 100.0 * (pose.root_translation_m + joints_m[0].as_dvec3());
        write!(text, "{:.5} {:.5} {:.5}", root_cm.x, root_cm.y, root_cm.z).unwrap();
        for joint in &order {
            let (z, x, y) = pose.parent_from_joint[*joint as usize].to_euler(EulerRot::ZXY);
            for angle in [z, x, y] {
                write!(text, " {:.5}", angle.to_degrees()).unwrap();
            }
        }
        text.push('\n');
    }
    text
}

/// Mean offset of each of [`REGIONS`] in a frame, `[slot][xyz]` flat in metres.
fn means_mm(body: &BodyModel, vertices: &[u32], frame: &[f32]) -> [[f32; 3]; 3] {
    REGIONS.map(|region| {
        let weights = &body.region_weights[region as usize];
        let (mut sum, mut all) = (Vec3::ZERO, 0.0);
        for (vertex, offset) in vertices.iter().zip(frame.chunks_exact(3)) {
            // One side tells; two may cancel.
            if body.template_m[*vertex as usize].x >= 0.0 {
                sum += weights[*vertex as usize] * Vec3::from_slice(offset);
                all += weights[*vertex as usize];
            }
        }
        (1000.0 * sum / all)
            .to_array()
            .map(|mm| (100.0 * mm).round() / 100.0)
    })
}

#[test]
fn a_walk_on_a_rig_like_mixamos_moves_tissue_as_the_simulator_does() {
    let folder = root().join("models/female");
    let body = BodyModel::from_glb(&std::fs::read(folder.join("body.glb")).unwrap()).unwrap();
    let joints_m = body.shaped(&SHAPE).joints_m;
    let mut walk = Procedural::new(ProceduralKind::Walk);
    walk.duration_seconds = 6.0;
    let walk = walk.clip(&joints_m).unwrap();
    let habit = CollarHabit {
        share: SHARE,
        lowered: 0.0,
    };
    let rigged = habit.applied(&walk, &joints_m);

    if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
        let settings = SimSettings::for_body(&body);
        let shell = Shell::for_body(&body, &SHAPE, &settings).unwrap();
        let labels = ClipLabels {
            name: "walk".into(),
            body_sha256: String::new(),
            seed: 0,
            shape: SHAPE,
            materials: Materials::NOMINAL,
            sim_json: "{}".into(),
        };
        let data = simulate_clip(&shell, &rigged, &settings, labels)
            .unwrap()
            .data;
        let offsets: Vec<f32> = data.offsets_rest_m.iter().map(|x| x.to_f32()).collect();
        let frames = offsets.chunks_exact(3 * data.vertices.len());
        let mean_offset_mm = frames
            .map(|frame| means_mm(&body, &data.vertices, frame))
            .collect();
        let text = serde_json::to_string(&Truth { mean_offset_mm }).unwrap();
        std::fs::write(golden(), text + "\n").unwrap();
    }
    let truth: Truth = serde_json::from_slice(&std::fs::read(golden()).unwrap()).unwrap();

    let file = MotionFile::parse(bvh(&rigged, &joints_m).as_bytes()).unwrap();
    let read = file
        .clip(&joints_m)
        .unwrap()
        .clip
        .resampled(MODEL_RATE_HZ)
        .unwrap();
    let turned = |pose: &Pose| pose.parent_from_joint[Joint::LeftCollar as usize];
    let degrees = turned(&read.frames[90])
        .angle_between(glam::DQuat::IDENTITY)
        .to_degrees();
    assert!(
        degrees > 10.0,
        "the file turns its collars by {degrees} degrees"
    );

    let bundle = Bundle::from_json(&std::fs::read(folder.join("bundle.json")).unwrap()).unwrap();
    let network = |file: &str| std::fs::read(folder.join(file)).unwrap();
    let kind = bundle.feature_kind;
    let predictor = network(&bundle.predictor.file);
    let predictor = Predictor::load_conditioned(&predictor, kind.condition_count()).unwrap();
    let mut session = PredictorSession::new(Arc::new(predictor)).unwrap();
    let decoder = Decoder::load(&network(&bundle.decoder.file)).unwrap();
    let mut decoding = DecoderSession::new(&decoder).unwrap();
    let features = clip_features(
        kind,
        &read.frames,
        read.rate_hz,
        &joints_m,
        &SHAPE,
        &Materials::NOMINAL,
    )
    .unwrap();
    let mut state = session.predictor().zero_state();
    let mut latent = vec![0.0; decoder.latent_count()];
    let mut frame = vec![0.0; 3 * decoder.vertex_count()];
    let vertices = &bundle.vertices;
    let (mut error, mut size, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    let ticks = features
        .chunks_exact(kind.count())
        .zip(&truth.mean_offset_mm);
    for (tick, (features, truth)) in ticks.enumerate() {
        session.step(features, &mut state, &mut latent).unwrap();
        if tick < SETTLING {
            continue;
        }
        decoding.decode(&latent, &mut frame).unwrap();
        count += 1.0;
        for (region, shown) in means_mm(&body, vertices, &frame).into_iter().enumerate() {
            let truth = Vec3::from_array(truth[region]);
            error[region] += f64::from(truth.distance(Vec3::from_array(shown)));
            size[region] += f64::from(truth.length());
        }
    }
    for (region, limit) in LIMITS.into_iter().enumerate() {
        let off = error[region] / size[region];
        let name = REGIONS[region].name();
        let off_mm = error[region] / count;
        println!("{name}: {off:.3} of static, {off_mm:.2} mm");
        assert!(
            size[region] > 100.0 && (off < limit || off_mm < LEAST_MM),
            "{name}: {off:.3} of static, {off_mm:.2} mm"
        );
    }
}
