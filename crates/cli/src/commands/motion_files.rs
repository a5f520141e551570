//! What is said of motion files on the command line.

use anyhow::Context as _;
use clap::Args;
use dynaskin_motion::{AnimationChoice, ReadOptions, UpAxis};

/// What motion files do not state, or state wrongly; docs/motion-files.md.
#[derive(Debug, Default, Args)]
pub struct MotionFileArgs {
    /// Joint of the motion files for a joint of the body, such as left_hip=Bone_17; may be given several times.
    #[arg(long, value_name = "BODY=FILE", requires = "mocap")]
    joint: Vec<String>,
    /// Animation of glTF files: its name, or its index from 0 [default: the one that moves the most joints].
    #[arg(long, value_name = "NAME", requires = "mocap")]
    animation: Option<String>,
    /// Frames per second of BVH and SMPL files, in place of the rate in the file.
    #[arg(long, value_name = "HZ", requires = "mocap")]
    rate: Option<f64>,
    /// Up axis of files with SMPL poses: y, z or -y [default: the file's, or detected from the body].
    #[arg(
        long,
        value_name = "AXIS",
        requires = "mocap",
        allow_hyphen_values = true
    )]
    up: Option<String>,
}

impl MotionFileArgs {
    /// What is said, for the readers.
    pub fn options(&self) -> anyhow::Result<ReadOptions> {
        let mut options = ReadOptions::default();
        for pair in &self.joint {
            let (joint, name) = pair.split_once('=').with_context(|| {
                format!("--joint {pair}: expected BODY=FILE, as in left_hip=LThigh")
            })?;
            options
                .name_joint(joint, name)
                .with_context(|| format!("--joint {pair}"))?;
        }
        options.animation = self.animation.as_ref().map(|wanted| {
            wanted.parse().map_or_else(
                |_| AnimationChoice::Name(wanted.clone()),
                AnimationChoice::Index,
            )
        });
        options.rate_hz = self.rate;
        options.up = match &self.up {
            None => None,
            Some(axis) => Some(
                UpAxis::from_name(axis)
                    .with_context(|| format!("--up {axis}: expected y, z or -y"))?,
            ),
        };
        Ok(options)
    }
}
