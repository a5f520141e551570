#![doc = include_str!("../README.md")]

use std::path::Path;
use std::sync::Arc;

pub use dynaskin_body::{
    BodyError, BodyModel, JOINT_COUNT, Joint, Materials, Pose, REGION_COUNT, Region, SHAPE_COUNT,
    ShapedBody, SkinWeights, Skinning, WorldJoints,
};
pub use dynaskin_runtime::{
    Avatar, Bundle, BundleFile, Controls, Crowd, CrowdReport, Detail, Diagnosis, LevelOfDetail,
    Model, Network, PoseSource, RegionControls, RuntimeError, Settled, StageSeconds, StepReport,
    Stopwatch,
};
pub use dynaskin_skeleton::MODEL_RATE_HZ;
pub use glam;

/// Clips of motion: read from files, made by formula, or moved by hand.
pub mod motion {
    #[cfg(feature = "npz")]
    pub use dynaskin_motion::Amass;
    pub use dynaskin_motion::{
        AnimationChoice, AnimationInfo, Bvh, Clip, FileClip, GltfMotion, Grip, JointReport,
        LengthUnit, MotionError, MotionFile, Procedural, ProceduralKind, Puppet, ReadOptions,
        SourceMotion, UpAxis, retarget,
    };
}

pub use motion::{Clip, MotionError, MotionFile};

/// Loads the model in `folder`: its `bundle.json` and the three files that this names.
///
/// # Errors
/// [`RuntimeError::ReadFile`] for a file that cannot be opened, and all of [`Model::load`].
pub fn load_model(folder: impl AsRef<Path>) -> Result<Arc<Model>, RuntimeError> {
    let folder = folder.as_ref();
    let mut read = |file: &str| std::fs::read(folder.join(file)).map_err(|error| error.to_string());
    let bundle_json = read("bundle.json").map_err(|reason| RuntimeError::ReadFile {
        file: folder.join("bundle.json").display().to_string(),
        reason,
    })?;
    Model::load(&bundle_json, &mut read).map(Arc::new)
}
