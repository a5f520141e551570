//! Animations in binary glTF, made here of BVH motions: the same motion must come out.

mod common;

use common::glb::{GlbFile, Storage};
use common::{MIXAMO, female_joints_m, source_bvh};
use dynaskin_body::Joint;
use dynaskin_motion::{
    Bvh, Clip, FileClip, GltfMotion, JointReport, MotionError, MotionFile, SourceMotion, retarget,
};
use proptest::prelude::*;
use serde_json::{Value, json};

const FRAMES: usize = 40;

/// A person who bends everything slowly, at 60 frames a second, in centimetres.
fn bvh() -> Bvh {
    let frames: Vec<Vec<f64>> = (0..FRAMES)
        .map(|frame| {
            let angle = |idx: usize| 30.0 * (0.1 * frame as f64 + 1.7 * idx as f64).sin();
            let root = [0.4 * frame as f64, 95.0 + (0.2 * frame as f64).sin(), 0.0];
            root.into_iter().chain((0..66).map(angle)).collect()
        })
        .collect();
    let text = source_bvh(&MIXAMO, 1.0, &frames).replace("0.0333333", "0.01666666667");
    Bvh::parse(text.as_bytes()).expect("the test's file is right")
}

fn play(file: &GlbFile) -> (Clip, JointReport) {
    let motion = MotionFile::parse(&file.bytes()).unwrap_or_else(|error| panic!("{error}"));
    let FileClip { clip, report, .. } = motion.clip(&female_joints_m()).expect("a person");
    (clip, report.expect("of named joints"))
}

/// Largest angle between the rotations of any joint, in radians, and distance of the roots in metres.
fn differences(a: &Clip, b: &Clip) -> [f64; 2] {
    assert_eq!(a.frames.len(), b.frames.len());
    let mut worst = [0.0_f64; 2];
    for (a, b) in a.frames.iter().zip(&b.frames) {
        for joint in Joint::ALL {
            let [a, b] = [a, b].map(|pose| pose.parent_from_joint[joint as usize]);
            worst[0] = worst[0].max(a.angle_between(b).min(a.angle_between(-b)));
        }
        worst[1] = worst[1].max(a.root_translation_m.distance(b.root_translation_m));
    }
    worst
}

#[test]
fn a_glb_moves_the_body_as_the_bvh_it_was_made_of() {
    let bvh = bvh();
    let (expected, expected_report) = retarget(&bvh, &female_joints_m()).expect("a person");
    for (storage, radians) in [
        (Storage::Float, 1e-5),
        (Storage::Spline, 1e-5),
        (Storage::ShortInteger, 2e-3),
    ] {
        let (clip, report) = play(&GlbFile::new(&bvh, storage));
        let [turn, metres] = differences(&clip, &expected);
        assert!(turn < radians, "{turn} rad");
        assert!(metres < 2e-3, "{metres} m");
        assert_eq!(clip.name, "as the BVH");
        assert_eq!(report.mapped, expected_report.mapped);
        assert!((report.metres_per_unit / expected_report.metres_per_unit - 100.0).abs() < 1e-3);
        assert!((report.frame_seconds - 1.0 / 60.0).abs() < 1e-12);
    }
}

#[test]
fn keys_in_another_unit_than_the_nodes_are_said() {
    let notes = |factor: f64| {
        let mut file = GlbFile::new(&bvh(), Storage::Float);
        let rest = file.json["nodes"][0]["translation"].as_array_mut();
        for number in rest.expect("three numbers") {
            // The motion holds the pelvis at twice its offset.
            *number = json!(2.0 * factor * number.as_f64().expect("a number"));
        }
        let motion = GltfMotion::parse(&file.bytes()).expect("the test's file is right");
        motion.notes().join("; ")
    };
    // As the pelvis of an armature that is scaled by 0.01 and left out.
    assert!(notes(0.01).contains("`mixamorig:Hips` have it 100 times as far as it rests"));
    assert!(notes(100.0).contains("100 times as near"));
    for usual in [1.0, 0.7, 3.0, 0.0] {
        assert!(!notes(usual).contains("times as"), "{usual}");
    }
}

/// Bones of VRM in the order of the BVH's joints.
const VRM_BONES: [&str; 22] = [
    "hips",
    "spine",
    "chest",
    "upperChest",
    "neck",
    "head",
    "leftShoulder",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "rightShoulder",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "leftToes",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "rightToes",
];

#[test]
fn vrm_files_say_who_is_who_whatever_the_nodes_are_called() {
    let bvh = bvh();
    let (expected, _) = retarget(&bvh, &female_joints_m()).expect("a person");
    assert_eq!(bvh.joints.len(), VRM_BONES.len());
    let bones: Value = VRM_BONES
        .iter()
        .enumerate()
        .map(|(node, bone)| ((*bone).to_owned(), json!({ "node": node })))
        .collect::<serde_json::Map<_, _>>()
        .into();
    let bones_0: Vec<Value> = VRM_BONES
        .iter()
        .enumerate()
        .map(|(node, bone)| json!({ "bone": bone, "node": node }))
        .collect();
    for extensions in [
        json!({ "VRMC_vrm_animation": { "specVersion": "1.0", "humanoid": { "humanBones": bones } } }),
        json!({ "VRMC_vrm": { "specVersion": "1.0", "humanoid": { "humanBones": bones } } }),
        json!({ "VRM": { "humanoid": { "humanBones": bones_0 } } }),
    ] {
        let mut file = GlbFile::new(&bvh, Storage::Float);
        for (idx, node) in file.json["nodes"]
            .as_array_mut()
            .expect("nodes")
            .iter_mut()
            .enumerate()
        {
            // All called like a part of another person.
            node["name"] = json!(format!("Head{}", idx % 3));
        }
        file.json["extensions"] = extensions;
        let (clip, report) = play(&file);
        let [turn, metres] = differences(&clip, &expected);
        assert!(turn < 1e-5 && metres < 1e-4, "{turn} rad, {metres} m");
        assert!(report.unmapped.is_empty(), "{:?}", report.unmapped);
    }
}

#[test]
fn meshes_named_like_people_are_not_taken_for_joints_where_there_is_a_skin() {
    let bvh = bvh();
    let mut file = GlbFile::new(&bvh, Storage::Float);
    let nodes = file.json["nodes"].as_array_mut().expect("nodes");
    nodes.insert(0, json!({ "name": "Hips" }));
    nodes.insert(0, json!({ "name": "LeftArm" }));
    for node in nodes.iter_mut() {
        for child in node["children"].as_array_mut().into_iter().flatten() {
            *child = json!(child.as_u64().expect("an index") + 2);
        }
    }
    for channel in file.json["animations"][1]["channels"]
        .as_array_mut()
        .expect("channels")
    {
        let node = channel["target"]["node"].as_u64().expect("an index");
        channel["target"]["node"] = json!(node + 2);
    }
    file.json["skins"] = json!([{ "joints": (2..24).collect::<Vec<_>>() }]);
    let (expected, _) = retarget(&bvh, &female_joints_m()).expect("a person");
    let [turn, _] = differences(&play(&file).0, &expected);
    assert!(turn < 1e-5, "{turn} rad");
}

#[test]
fn what_cannot_be_played_is_refused_with_its_place() {
    let bvh = bvh();
    #[track_caller]
    fn check(bvh: &Bvh, change: impl FnOnce(&mut GlbFile), words: &[&str]) {
        let mut file = GlbFile::new(bvh, Storage::Float);
        change(&mut file);
        let error = MotionFile::parse(&file.bytes())
            .and_then(|motion| motion.clip(&female_joints_m()))
            .expect_err("a broken file");
        let text = error.to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` is missing in: {text}");
        }
    }
    check(
        &bvh,
        |file| file.json["animations"] = json!([]),
        &["model at rest"],
    );
    check(
        &bvh,
        |file| {
            file.json["animations"]
                .as_array_mut()
                .expect("two")
                .truncate(1)
        },
        &["none of the 1"],
    );
    check(
        &bvh,
        |file| file.json["nodes"][3]["children"] = json!([0]),
        &["one parent"],
    );
    check(
        &bvh,
        |file| {
            file.json["nodes"][22]["children"] = json!([]);
            file.json["nodes"][5]["children"] = json!([0]);
        },
        &["circles"],
    );
    check(
        &bvh,
        |file| file.json["nodes"][3]["children"] = json!([77]),
        &["node 3", "children"],
    );
    check(
        &bvh,
        |file| file.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]),
        &["node 0"],
    );
    check(
        &bvh,
        |file| file.json["accessors"][0]["count"] = json!(39),
        &["accessor 1", "39 times"],
    );
    check(
        &bvh,
        |file| file.json["accessors"][0]["count"] = json!(1_u64 << 62),
        &["accessor 0", "inside the BIN chunk"],
    );
    check(
        &bvh,
        |file| file.json["bufferViews"][0]["byteStride"] = json!(0),
        &["accessor 0"],
    );
    check(
        &bvh,
        |file| file.json["bufferViews"][2]["buffer"] = json!(1),
        &["compressed"],
    );
    check(
        &bvh,
        |file| {
            file.json["accessors"][1]["sparse"] = json!({
                "count": 1,
                "indices": { "bufferView": 0, "componentType": 5123 },
                "values": { "bufferView": 0 }
            })
        },
        &["sparse"],
    );
    check(
        &bvh,
        |file| file.binary[4..8].copy_from_slice(&f32::NAN.to_le_bytes()),
        &["time"],
    );
    check(
        &bvh,
        |file| file.binary[160..176].fill(0),
        &["accessor 1, element 0", "zeros"],
    );
    check(
        &bvh,
        |file| {
            let last = 4 * (FRAMES - 1);
            file.binary[last..last + 4].copy_from_slice(&1e7_f32.to_le_bytes());
        },
        &["frames", "162000"],
    );
    check(
        &bvh,
        |file| {
            for node in file.json["nodes"].as_array_mut().expect("nodes") {
                node["name"] = json!("Box");
            }
        },
        &["no source joint"],
    );
    let mut cut = GlbFile::new(&bvh, Storage::Float).bytes();
    cut.truncate(300);
    assert!(GltfMotion::parse(&cut).is_err());
}

#[test]
fn a_small_file_of_great_length_and_many_nodes_is_refused_at_once() {
    let mut file = GlbFile::new(&bvh(), Storage::Float);
    // The last key comes after 43 minutes; the times are the first accessor.
    let keys = file.json["accessors"][0]["count"].as_u64().expect("keys") as usize;
    file.binary[4 * (keys - 1)..4 * keys].copy_from_slice(&2_600.0_f32.to_le_bytes());
    let nodes = file.json["nodes"].as_array_mut().expect("nodes");
    let first = nodes.len();
    // Each of them carries the next, and the last the root: all are needed for every frame.
    nodes.extend((first..first + 400).map(|idx| {
        let child = if idx == first + 399 {
            first - 1
        } else {
            idx + 1
        };
        json!({ "name": format!("link {idx}"), "children": [child] })
    }));
    let motion = GltfMotion::parse(&file.bytes()).expect("a file that can be read");
    let error = retarget(&motion, &female_joints_m()).expect_err("too much");
    assert!(matches!(error, MotionError::TooMuch { .. }), "{error}");
    assert!(error.to_string().contains("at most 10 million"), "{error}");
}

/// Joints that turn nothing on the body cost nothing.
#[test]
fn what_stands_beside_a_person_changes_nothing() {
    let plain = GlbFile::new(&bvh(), Storage::Float);
    let mut file = GlbFile::new(&bvh(), Storage::Float);
    let nodes = file.json["nodes"].as_array_mut().expect("nodes");
    let first = nodes.len();
    nodes.extend((0..400).map(|idx| json!({ "name": format!("leaf {idx}") })));
    let children = nodes[0]["children"].as_array_mut().expect("children");
    children.extend((first..first + 400).map(|node| json!(node)));
    let [plain, beside] = [plain, file].map(|file| {
        let motion = GltfMotion::parse(&file.bytes()).expect("a file that can be read");
        retarget(&motion, &female_joints_m()).expect("a person").0
    });
    assert_eq!(plain.frames, beside.frames);
}

/// Channels may share their keys: each is read for itself.
#[test]
fn a_small_file_whose_channels_share_many_keys_is_refused_at_once() {
    let mut file = GlbFile::new(&bvh(), Storage::Float);
    let animation = file.json["animations"][1].clone();
    let animations = std::iter::repeat_n(animation, 10_000);
    file.json["animations"] = animations.collect();
    for read in [
        GltfMotion::parse(&file.bytes()).map(|_| ()),
        GltfMotion::animations(&file.bytes()).map(|_| ()),
    ] {
        let error = read.expect_err("too much").to_string();
        assert!(error.contains("at most 2000000 keys"), "{error}");
    }
}

#[test]
fn other_files_are_told_what_would_be_one() {
    let text_of = |bytes| MotionFile::parse(bytes).expect_err("no motion").to_string();
    let unknown = text_of(b"Dear reader");
    for word in ["BVH", "GLB", "HIERARCHY", "Dear reader"] {
        assert!(unknown.contains(word), "`{word}` is missing in: {unknown}");
    }
    for (bytes, what, what_to_do) in [
        (&b"\x89PNG\r\n\x1a\n"[..], "a picture", "choose the file"),
        (b"", "the file is empty", "export or download it again"),
        (
            b"; FBX 7.4.0 project file",
            "an FBX file",
            "convert it to GLB",
        ),
        (b"{\"asset\":{}}", "glTF of several files", "GLB"),
    ] {
        let error = text_of(bytes);
        assert!(
            error.contains(what) && error.contains(what_to_do),
            "{error}"
        );
    }
}

proptest! {
    /// Nothing a file holds panics or hangs.
    #[test]
    fn broken_bytes_are_refused_or_played(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        let mut bytes = GlbFile::new(&bvh(), Storage::Float).bytes();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let _ = GltfMotion::animations(&bytes);
        if let Ok(motion) = GltfMotion::parse(&bytes) {
            prop_assert!(motion.frame_count() >= 1);
            let _ = retarget(&motion, &female_joints_m());
        }
    }

    /// Nor what stands in the document.
    #[test]
    fn documents_with_other_numbers_are_refused_or_played(
        which in any::<prop::sample::Index>(),
        number in prop::sample::select(vec!["0", "1", "7", "4294967295", "18446744073709551615", "1e39"]),
    ) {
        let mut file = GlbFile::new(&bvh(), Storage::Float);
        let text = file.json.to_string();
        let numbers: Vec<(usize, usize)> = number_places(&text);
        let (from, to) = numbers[which.index(numbers.len())];
        let changed = format!("{}{number}{}", &text[..from], &text[to..]);
        if let Ok(json) = serde_json::from_str(&changed) {
            file.json = json;
            if let Ok(motion) = GltfMotion::parse(&file.bytes()) {
                let _ = retarget(&motion, &female_joints_m());
            }
        }
    }
}

/// Where the numbers of a JSON text stand.
fn number_places(text: &str) -> Vec<(usize, usize)> {
    let is_number = |c: char| c.is_ascii_digit() || ".-e".contains(c);
    let mut places = Vec::new();
    for (at, _) in text.match_indices([':', '[', ',']) {
        let from = at + 1;
        let length = text[from..].find(|c| !is_number(c)).unwrap_or(0);
        if length > 0 {
            places.push((from, from + length));
        }
    }
    places
}
