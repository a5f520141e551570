//! The capture clips of the shared folder, where there is one.

mod common;

use common::female_joints_m;
use common::poses::shared;
use dynaskin_body::{Joint, Pose};
use dynaskin_motion::{Bvh, LengthUnit, retarget};

#[test]
fn every_training_clip_retargets_with_feet_on_the_floor() {
    let Ok(folder) = std::fs::read_dir(shared().join("mocap/train")) else {
        println!(
            "skipped: every_training_clip_retargets_with_feet_on_the_floor needs ../shared/mocap/train"
        );
        return;
    };
    let rest_m = female_joints_m();
    let mut count = 0;
    for entry in folder {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "bvh") {
            continue;
        }
        count += 1;
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let bvh = Bvh::parse(&std::fs::read(&path).unwrap()).unwrap();
        let (clip, report) = retarget(&bvh, &rest_m).unwrap();
        assert_eq!(report.unit, LengthUnit::Centimetre, "{name}");
        assert_eq!(report.missing, [], "{name}");
        assert!((clip.rate_hz - 60.0).abs() < 0.01, "{name}");
        assert!(clip.frames.iter().all(Pose::is_valid), "{name}");
        let root_m = clip.frames[0].root_translation_m;
        assert_eq!((root_m.x, root_m.z), (0.0, 0.0), "{name}");
        // Ball and ankle joints lie 2 and 7 cm above the sole. A rolling body has its feet up.
        let mut lowest_m: Vec<f64> = clip
            .frames
            .iter()
            .map(|pose| {
                let world = pose.world_joints(&rest_m);
                let feet = [
                    Joint::LeftFoot,
                    Joint::RightFoot,
                    Joint::LeftAnkle,
                    Joint::RightAnkle,
                ];
                feet.map(|foot| world.position_m[foot as usize].y)
                    .into_iter()
                    .fold(f64::INFINITY, f64::min)
            })
            .collect();
        lowest_m.sort_by(f64::total_cmp);
        let typical_m = lowest_m[lowest_m.len() / 10];
        assert!((-0.03..0.06).contains(&typical_m), "{name}: {typical_m}");
        assert!(lowest_m[0] > -0.1, "{name}: {}", lowest_m[0]);
    }
    assert_eq!(count, 170);
}
