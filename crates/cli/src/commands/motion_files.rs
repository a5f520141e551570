//! What is said of motion files on the command line.

use anyhow::Context as _;
use clap::Args;
use dynaskin_motion::{AnimationChoice, ReadOptions, UpAxis};

/// What the motion files of --mocap do not say, or say otherwise; docs/motion-files.md.
#[derive(Debug, Default, Args)]
pub struct MotionFileArgs {
    /// The files' joint for one of the body's, such as left_hip=Bone_17; may be given several times.
    #[arg(long, value_name = "BODY=FILE", requires = "mocap")]
    joint: Vec<String>,
    /// Name of the animation of glTF files, or its place counted from 0; without it the one that moves.
    #[arg(long, value_name = "NAME", requires = "mocap")]
    animation: Option<String>,
    /// Frames per second of BVH and SMPL files, in place of what they say.
    #[arg(long, value_name = "HZ", requires = "mocap")]
    rate: Option<f64>,
    /// The axis that points up in files of SMPL poses: y, z or -y.
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
