//! Captured motion: none of it may be taken for a cut.

use std::path::PathBuf;
use std::sync::Arc;

use dynaskin_body::BodyModel;
use dynaskin_motion::{Bvh, retarget};
use dynaskin_runtime::{Avatar, Model, Settled};

#[test]
fn captured_motion_has_no_cuts() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let shared = std::env::var_os("DYNASKIN_SHARED").map_or(root.join("../shared"), PathBuf::from);
    let folder = shared.join("mocap/train");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: captured_motion_has_no_cuts needs ../shared/mocap/train");
        return;
    };
    let body = BodyModel::from_glb(&std::fs::read(root.join("models/female/body.glb")).unwrap());
    let model = Arc::new(Model::body_only(Arc::new(body.unwrap())));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bvh"));
    paths.sort();
    let mut avatar = Avatar::new(model, &[0.0; 10]).unwrap();
    let mut cuts = Vec::new();
    let mut frames = 0;
    // Every fifth file, to be quick.
    for path in paths.iter().step_by(5) {
        let bvh = Bvh::parse(&std::fs::read(path).unwrap()).unwrap();
        let (clip, _) = retarget(&bvh, avatar.joints_rest_m()).unwrap();
        avatar.reset();
        for (frame, pose) in clip.frames.iter().enumerate() {
            let report = avatar.step(pose, 1.0 / clip.rate_hz).unwrap();
            frames += 1;
            if report.settled == Some(Settled::Cut) {
                cuts.push(format!("{} frame {frame}", path.display()));
            }
        }
    }
    println!("{} cuts in {frames} frames: {cuts:?}", cuts.len());
    assert!(frames > 0);
    assert!(cuts.is_empty(), "{cuts:?}");
}
