//! An avatar's part in a step that several avatars of a model take together.

use dynaskin_body::Pose;

use super::{Avatar, StepReport};
use crate::RuntimeError;
use crate::pipeline::{Member, Pipeline, StageSeconds, Stopwatch};
use crate::surface::skinning;
use crate::timeline::{Showing, Shown};
use crate::tissue::Tissue;

impl Avatar {
    /// Checks a step to `pose` (in metres of the world) and decides what happens in it.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: nothing has changed.
    pub(crate) fn plan(&mut self, pose: &Pose, dt_seconds: f64) -> Result<(), RuntimeError> {
        self.timeline.plan(pose, dt_seconds)
    }

    /// What became of the last step.
    pub(crate) fn report(&self) -> StepReport {
        let (ticks, settled) = self.timeline.report();
        StepReport {
            ticks,
            settled,
            seconds: StageSeconds::default(),
        }
    }

    /// Whether the last step changed the surface.
    pub(crate) fn has_shown(&self) -> bool {
        self.timeline.has_shown()
    }

    /// Ends the step: the clock moves on and the skeleton with it.
    fn commit(&mut self) {
        let scale = self.timeline.scale();
        let pose = self.timeline.commit();
        self.skin = skinning::scaled(pose, &self.shaped.joints_rest_m, scale);
        self.skin_matrices = skinning::matrices(&self.skin);
        if let Some(posed) = &mut self.posed {
            posed.take_pose(pose);
            // Out of sight the surface stays as it is, and so it does where nothing moved.
            if posed.is_on() && self.timeline.visibility.visible && posed.is_due() {
                self.correct();
            }
        }
    }
}

impl Member for Avatar {
    fn begin_settling(&mut self) -> Option<&mut Tissue> {
        let tissue = &mut self.soft.as_mut()?.tissue;
        tissue.begin_settling(self.timeline.settling_pose()?);
        Some(tissue)
    }

    fn begin_tick(&mut self, index: usize) -> Option<&mut Tissue> {
        let tissue = &mut self.soft.as_mut()?.tissue;
        tissue.push_pose(&self.timeline.tick_pose(index)?);
        Some(tissue)
    }

    fn begin_showing(&mut self) -> Option<&mut Tissue> {
        let tissue = &mut self.soft.as_mut()?.tissue;
        let decodes = match self.timeline.begin_showing()? {
            Showing::Settled => tissue.settle(),
            Showing::Between(phase) => tissue.begin_showing(phase),
        };
        decodes.then_some(tissue)
    }

    fn show(&mut self) {
        let Some(soft) = &mut self.soft else {
            return;
        };
        let changed = match self.timeline.shown() {
            Some(Shown::FadesOut(dt_seconds)) => soft.tissue.fade_out(dt_seconds),
            Some(Shown::Settled { fades }) => {
                soft.tissue.show_settled(fades);
                true
            }
            Some(Shown::Moved(seconds)) => {
                soft.tissue.show(seconds);
                true
            }
            None => false,
        };
        if !changed {
            return;
        }
        match &mut self.posed {
            // The end of the step shows both.
            Some(posed) if posed.is_on() => posed.move_tissue(),
            _ => {
                self.apply();
            }
        }
    }
}

/// Moves `avatars` of one model on by the steps they have planned. Without networks there is no
/// `pipeline`.
///
/// # Errors
/// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: some surfaces may have moved on, and
/// for all avatars the next pose counts as the first.
pub(crate) fn step_all(
    pipeline: Option<&mut Pipeline>,
    avatars: &mut [&mut Avatar],
    stopwatch: Stopwatch<'_>,
) -> Result<StageSeconds, RuntimeError> {
    let mut seconds = StageSeconds::default();
    if let Some(pipeline) = pipeline
        && let Err(error) = pipeline.run(avatars, &mut seconds, stopwatch)
    {
        // The states may be halfway between two ticks.
        for avatar in avatars {
            avatar.reset();
        }
        return Err(error);
    }
    let start = stopwatch();
    for avatar in avatars.iter_mut() {
        avatar.commit();
    }
    seconds.skin = stopwatch() - start;
    Ok(seconds)
}
