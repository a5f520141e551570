//! The shipped models, in `models/`: parity with plain tract, invariance, bone, rest, and the
//! golden offsets that the WebAssembly tests compare with as well.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod plain_tract;

use std::path::PathBuf;
use std::sync::Arc;

use dynaskin_body::{Joint, Pose};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_runtime::features::{Materials, clip_features};
use dynaskin_runtime::{Avatar, Model};
use glam::{DQuat, DVec3, Vec3};
use plain_tract::PlainTract;
use serde::{Deserialize, Serialize};

const DT: f64 = 1.0 / 60.0;
const SHAPE: [f32; 10] = [0.0; 10];
const NAMES: [&str; 2] = ["female", "male"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(model: &str, file: &str) -> Vec<u8> {
    std::fs::read(root().join("models").join(model).join(file)).expect("the model's file")
}

fn model(name: &str) -> Arc<Model> {
    let mut files = |file: &str| Ok(read(name, file));
    Arc::new(Model::load(&read(name, "bundle.json"), &mut files).expect("a shipped model loads"))
}

/// A hop of five seconds and one frame.
fn hop(avatar: &Avatar) -> Clip {
    let mut hop = Procedural::new(ProceduralKind::Hop);
    hop.duration_seconds = 5.0;
    hop.clip(avatar.joints_rest_m()).expect("a usual hop")
}

fn largest(offsets: &[Vec3]) -> f32 {
    offsets.iter().map(|o| o.length()).fold(0.0, f32::max)
}

fn distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max)
}

/// The latent after two seconds of the same features.
fn settled(plain: &mut PlainTract, features: &[f32]) -> Vec<f32> {
    (1..120).fold(plain.tick(features), |_, _| plain.tick(features))
}

#[test]
fn offsets_are_those_of_plain_tract_one_tick_later() {
    for name in NAMES {
        let mut avatar = Avatar::new(model(name), &SHAPE).unwrap();
        let clip = hop(&avatar);
        let kind = avatar.model().bundle().unwrap().feature_kind;
        let features = |clip: &Clip| {
            clip_features(
                kind,
                &clip.frames,
                clip.rate_hz,
                avatar.joints_rest_m(),
                &SHAPE,
                &Materials::default(),
            )
            .unwrap()
        };
        let standing = Clip {
            frames: vec![Pose::REST],
            ..clip.clone()
        };
        let mut plain = PlainTract::load(&root().join("models").join(name));
        let rest = settled(&mut plain, &features(&standing));
        let rest_m = plain.decode(&rest);
        let all_features = features(&clip);
        let mut rows = all_features.chunks(kind.count());
        let mut plain = PlainTract::load(&root().join("models").join(name));
        let mut latent_before = settled(&mut plain, rows.next().unwrap());
        avatar.step(&clip.frames[0], DT).unwrap();
        let (mut worst, mut seen) = (0.0_f32, 0.0_f32);
        for (pose, row) in clip.frames[1..].iter().zip(rows) {
            avatar.step(pose, DT).unwrap();
            let raw_m = plain.decode(&latent_before);
            latent_before = plain.tick(row);
            for (slot, &vertex) in avatar.model().soft_vertices().iter().enumerate() {
                let vertex = vertex as usize;
                if avatar.model().body().softness(vertex) <= 1e-6 {
                    continue;
                }
                let triple = |numbers: &[f32]| Vec3::from_slice(&numbers[3 * slot..]);
                let expected = triple(&raw_m) - triple(&rest_m);
                worst = worst.max(avatar.offsets_rest_m()[vertex].distance(expected));
                seen = seen.max(expected.length());
            }
        }
        println!("{name}: largest offset {seen} m, difference to plain tract {worst:e} m");
        assert!(seen > 0.005, "{name}: the hop moves nothing");
        assert!(worst <= 1e-6, "{name}: {worst} m");
    }
}

#[test]
fn motion_moved_by_10_m_and_turned_by_90_degrees_gives_the_same_offsets() {
    for name in NAMES {
        let model = model(name);
        let mut here = Avatar::new(Arc::clone(&model), &SHAPE).unwrap();
        let mut there = Avatar::new(model, &SHAPE).unwrap();
        let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let pelvis_m = here.joints_rest_m()[0].as_dvec3();
        let mut worst = 0.0_f32;
        for pose in &hop(&here).frames {
            let mut moved = pose.clone();
            moved.root_translation_m =
                turn * (pose.root_translation_m + pelvis_m) - pelvis_m + DVec3::new(10.0, 0.0, 0.0);
            moved.parent_from_joint[0] = turn * moved.parent_from_joint[0];
            here.step(pose, DT).unwrap();
            there.step(&moved, DT).unwrap();
            worst = worst.max(distance(here.offsets_rest_m(), there.offsets_rest_m()));
        }
        println!("{name}: moved and turned, offsets differ by {worst:e} m");
        assert!(worst <= 1e-5, "{name}: {worst} m");
    }
}

#[test]
fn the_skull_does_not_move_at_all() {
    for name in NAMES {
        let mut avatar = Avatar::new(model(name), &SHAPE).unwrap();
        let body = Arc::clone(avatar.model());
        let head = Joint::Head as u8;
        let skull: Vec<usize> = (0..body.body().vertex_count())
            .filter(|&v| {
                let skin = &body.body().skin[v];
                skin.joints
                    .iter()
                    .zip(skin.weights)
                    .any(|(&j, w)| j == head && w > 0.5)
            })
            .collect();
        assert!(skull.len() > 100, "{name}: {} vertices", skull.len());
        for pose in &hop(&avatar).frames {
            avatar.step(pose, DT).unwrap();
            assert!(
                skull
                    .iter()
                    .all(|&v| avatar.offsets_rest_m()[v] == Vec3::ZERO)
            );
        }
    }
}

#[test]
fn standing_still_settles_to_zero() {
    for name in NAMES {
        let mut avatar = Avatar::new(model(name), &SHAPE).unwrap();
        let clip = hop(&avatar);
        let mut peak = 0.0_f32;
        for pose in &clip.frames {
            avatar.step(pose, DT).unwrap();
            peak = peak.max(largest(avatar.offsets_rest_m()));
        }
        let stand = clip.frames.last().unwrap();
        let mut after = Vec::new();
        for tick in 1..=300 {
            avatar.step(stand, DT).unwrap();
            if tick % 60 == 0 {
                after.push(largest(avatar.offsets_rest_m()));
            }
        }
        let moving = {
            let before = avatar.offsets_rest_m().to_vec();
            avatar.step(stand, DT).unwrap();
            distance(&before, avatar.offsets_rest_m())
        };
        // Back to the rest pose within a second, and ten seconds there.
        for tick in 1..=660 {
            let part = f64::from(tick.min(60)) / 60.0;
            let pose = stand.interpolated(&Pose::REST, part);
            avatar.step(&pose, DT).unwrap();
        }
        let rest = largest(avatar.offsets_rest_m());
        println!("{name}: peak {peak} m; standing after 1..5 s {after:?} m; rest pose {rest:e} m");
        assert!(rest <= 1e-5, "{name}: {rest} m in the rest pose");
        assert!(moving <= 1e-7, "{name}: still moving by {moving} m a tick");
        // The last pose is not the rest pose: gravity pulls at hanging arms another way.
        assert!(after[4] < 0.002, "{name}: {} m left", after[4]);
    }
}

/// Offsets of some soft vertices on every frame of the hop, at the average shape, stepped with
/// 1/60 s from the first frame on. `web/sdk/tests/golden.test.ts` and
/// `tests/browser/golden.spec.ts` compare the WebAssembly with the same files (at most 1e-5 m).
#[derive(Deserialize, Serialize)]
struct Golden {
    model: String,
    motion: String,
    duration_seconds: f64,
    vertices: Vec<u32>,
    /// `[frame][vertex * 3 + axis]`, micrometres, to a tenth.
    offsets_rest_um: Vec<Vec<f64>>,
}

impl Golden {
    fn play(name: &str) -> Self {
        let mut avatar = Avatar::new(model(name), &SHAPE).unwrap();
        let soft = avatar.model().soft_vertices();
        let vertices: Vec<u32> = soft.iter().copied().step_by(soft.len() / 24 + 1).collect();
        let mut offsets_rest_um = Vec::new();
        for pose in hop(&avatar).frames.iter().take(300) {
            avatar.step(pose, DT).unwrap();
            let offsets = vertices
                .iter()
                .flat_map(|&v| avatar.offsets_rest_m()[v as usize].to_array());
            offsets_rest_um.push(
                offsets
                    .map(|x_m| (f64::from(x_m) * 1e7).round() / 10.0)
                    .collect(),
            );
        }
        Self {
            model: name.to_owned(),
            motion: "hop".to_owned(),
            duration_seconds: 5.0,
            vertices,
            offsets_rest_um,
        }
    }
}

/// With `DYNASKIN_WRITE_GOLDEN=1` in the environment the files are written anew: after training or
/// another definition of the features, and never to make a test pass.
#[test]
fn offsets_are_the_golden_ones() {
    for name in NAMES {
        let path = root().join(format!("tests/golden/{name}-hop.json"));
        let golden = Golden::play(name);
        if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, serde_json::to_string(&golden).unwrap() + "\n").unwrap();
        }
        let stored: Golden = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(stored.vertices, golden.vertices);
        let [stored_um, got_um] = [&stored, &golden].map(|golden| golden.offsets_rest_um.concat());
        assert_eq!(stored_um.len(), 300 * stored.vertices.len() * 3);
        assert_eq!(stored_um.len(), got_um.len());
        let largest = stored_um.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(
            largest > 2_000.0,
            "{name}: nothing moves by more than {largest} µm"
        );
        let worst = stored_um
            .iter()
            .zip(&got_um)
            .fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
        println!("{name}: offsets to {largest} µm differ from the golden ones by {worst} µm");
        assert!(worst <= 1.0, "{name}: {worst} µm");
    }
}
