//! Measuring the simulator, on a small figure.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/figure.rs"]
mod figure;

use std::path::PathBuf;

use dynaskin_body::Region;
use dynaskin_motion::ReadOptions;
use dynaskin_sim::{
    Activity, Calibration, MEASURED, Motion, Quantity, Run, SimSettings, Survey, execute,
    procedurals,
};

#[test]
fn every_measured_quantity_has_a_value_of_ours() {
    let body = figure::figure();
    let settings = SimSettings::default();
    let measured = Calibration::of_shape(&body, &settings, Run::shape(0), &[]).unwrap();
    assert_eq!(measured.moved.len(), 3);
    for vibration in &measured.vibrations {
        if vibration.depth_m > 0.0 {
            assert!(
                (1.0..40.0).contains(&vibration.frequency_hz),
                "{}: {} Hz",
                vibration.region.name(),
                vibration.frequency_hz
            );
            assert!((0.0..1.0).contains(&vibration.damping_ratio));
        }
    }
    let belly = |activity| {
        let moved = measured.moved.iter().find(|m| m.activity == activity);
        moved.unwrap().regions[Region::Belly as usize]
    };
    // Running moves more than walking, and a region no more than its three axes together.
    let (running, walking) = (belly(Activity::Running), belly(Activity::Walking));
    assert!(running.peak_to_peak_m[1] > 2.0 * walking.peak_to_peak_m[1]);
    assert!(running.largest_m <= running.total_m());
    let belly_only = MEASURED
        .iter()
        .filter(|measured| measured.region == Region::Belly);
    for wanted in belly_only {
        assert_eq!(wanted.quantity, Quantity::HoppingVerticalM);
        let (value, from) = measured.value_of(wanted).unwrap();
        assert!((1e-3..0.2).contains(&value), "{value} m");
        assert_eq!(from, "hop");
    }
}

#[test]
fn an_unreadable_capture_is_named() {
    let motion = Motion::Capture {
        name: "gone".to_owned(),
        path: PathBuf::from("no-such-folder/gone.bvh"),
        speed: 1.0,
        options: ReadOptions::default(),
    };
    let captures = [(Activity::Walking, motion)];
    let body = figure::figure();
    let settings = SimSettings::default();
    let error = Calibration::of_shape(&body, &settings, Run::shape(0), &captures).unwrap_err();
    assert!(error.to_string().contains("gone.bvh"), "{error}");
}

#[test]
fn a_survey_finds_the_largest_offset_where_it_is() {
    let body = figure::figure();
    let folder = tempfile::tempdir().unwrap();
    let run = Run {
        body: &body,
        body_sha256: "test",
        settings: SimSettings::default(),
        seed: 1,
        out: folder.path().to_owned(),
        limit_frames: Some(120),
        mirrored: false,
        vary_materials: true,
        further_shapes: true,
        vary_rigs: true,
        shapes: 2,
    };
    let motions: Vec<_> = procedurals()
        .into_iter()
        .filter(|motion| motion.name() == "hop-190-090")
        .collect();
    let jobs = run.plan(&motions).unwrap();
    let varied = jobs
        .iter()
        .filter(|job| !job.materials.is_nominal())
        .count();
    execute(&run, &jobs, |_| {}).unwrap();
    let survey = Survey::of_folder(&body, folder.path(), |_, _| {}).unwrap();
    assert_eq!(survey.clips, jobs.len());
    assert_eq!(survey.varied_clips, varied);
    assert_eq!(survey.frames, 120 * jobs.len());
    let belly = &survey.largest[Region::Belly as usize];
    let path = folder.path().join(format!("{}.safetensors", belly.clip));
    let clip = dynaskin_sim::ClipData::read(&path).unwrap();
    let slot = clip
        .vertices
        .iter()
        .position(|vertex| *vertex == belly.vertex)
        .unwrap();
    assert_eq!(clip.offset_rest_m(belly.frame, slot).length(), belly.metres);
    assert!(belly.metres > 0.002, "{} m", belly.metres);
}
