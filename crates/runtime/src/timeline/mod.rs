//! From a pose and a time step to a plan: which ticks fall into the step, at which poses, and whether
//! and how the surface is shown after it. It owns no avatar and knows no tissue.

mod clock;
mod interpolation;
mod visibility;

use dynaskin_conditioning::{Conditioner, Diagnosis, PoseSource};
use dynaskin_skeleton::Pose;
use serde::{Deserialize, Serialize};

use crate::{RuntimeError, pose};
use clock::{Advance, TickClock, Ticks};

pub use clock::Settled;
pub use visibility::Detail;
pub(crate) use visibility::{Change, Visibility};

/// Whether a step of `dt_seconds` can be taken.
///
/// # Errors
/// [`RuntimeError::InvalidTimeStep`].
pub(crate) fn check_step(dt_seconds: f64) -> Result<(), RuntimeError> {
    TickClock::check(dt_seconds)
}

/// The time of one avatar.
#[derive(Debug)]
pub(crate) struct Timeline {
    /// Puts poses that repeat, jitter or are noisy on their source's clock.
    conditioner: Conditioner,
    clock: TickClock,
    /// The step at hand.
    planned: Planned,
    pub visibility: Visibility,
    /// Whether the tissue must be settled before it can be ticked.
    unsettled: bool,
    enabled: bool,
    /// Metres of the world in a metre of the body.
    scale: f64,
}

/// A step that was checked and is about to be taken.
#[derive(Clone, Debug)]
struct Planned {
    /// The host's pose, in metres of the body: what the skeleton shows.
    pose: Pose,
    /// What drives the tissue, where it is another pose.
    driven: Option<Pose>,
    /// The seconds that the tissue moves on by.
    dt_seconds: f64,
    advance: Advance,
    /// Whether the surface changes.
    shows: bool,
}

impl Planned {
    fn driven(&self) -> &Pose {
        self.driven.as_ref().unwrap_or(&self.pose)
    }
}

/// What is to be decoded for the surface after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Showing {
    /// Tissue that has settled.
    Settled,
    /// What lies this far (0..1) from the tick before the last to the last.
    Between(f64),
}

/// How the surface changes in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shown {
    /// What was decoded is shown, this many seconds after what was shown before.
    Moved(f64),
    /// What was decoded is that of settled tissue; whether it fades in.
    Settled { fades: bool },
    /// Nothing is decoded, and what is left of the offsets fades for this many seconds more.
    FadesOut(f64),
}

/// What a saved state says.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct TimelineMemory {
    pub scale: f64,
    pub enabled: bool,
    unsettled: bool,
    clock: TickClock,
}

impl TimelineMemory {
    /// Whether it can be gone on from; the scale is checked by itself.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidState`], [`RuntimeError::InvalidPose`].
    pub fn check(&self) -> Result<(), RuntimeError> {
        self.clock.check_saved()
    }
}

impl Default for Timeline {
    fn default() -> Self {
        Self {
            conditioner: Conditioner::default(),
            clock: TickClock::default(),
            planned: Planned {
                pose: Pose::REST,
                driven: None,
                dt_seconds: 0.0,
                advance: Advance::Tick(Ticks::NONE),
                shows: false,
            },
            visibility: Visibility::default(),
            unsettled: true,
            enabled: true,
            scale: 1.0,
        }
    }
}

impl Timeline {
    /// Whether the tissue is switched on.
    pub fn enabled(&self) -> bool {
        self.enabled
    }

    /// Switches it off or on; it then starts settled.
    pub fn set_enabled(&mut self, enabled: bool) {
        self.unsettled |= self.enabled != enabled;
        self.enabled = enabled;
    }

    /// Metres of the world in a metre of the body.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Changes that, converting the past; gives the old scale over the new one.
    pub fn set_scale(&mut self, scale: f64) -> f64 {
        let ratio = self.scale / scale;
        self.clock.rescale(ratio);
        self.conditioner.rescale(ratio);
        self.scale = scale;
        ratio
    }

    /// The next pose counts as the first.
    pub fn reset(&mut self) {
        self.conditioner.reset();
        self.clock.reset();
        self.unsettled = true;
    }

    /// Says where poses come from; the next pose counts as the first.
    pub fn set_source(&mut self, source: PoseSource) {
        self.conditioner.set_source(source);
        self.reset();
    }

    /// Where poses come from.
    pub fn source(&self) -> PoseSource {
        self.conditioner.source()
    }

    /// What was found out about the source.
    pub fn diagnosis(&self) -> Diagnosis {
        self.conditioner.diagnosis()
    }

    /// Changes detail or visibility. What becomes of the surface, if anything.
    pub fn change_visibility(&mut self, change: impl FnOnce(&mut Visibility)) -> Option<Change> {
        let slept = self.visibility.asleep();
        let becomes = self.visibility.change(change);
        self.unsettled |= slept && !self.visibility.asleep();
        becomes.filter(|change| self.enabled || *change == Change::Clears)
    }

    /// Checks a step to `pose` (in metres of the world) and decides what happens in it.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: nothing has changed.
    pub fn plan(&mut self, pose: &Pose, dt_seconds: f64) -> Result<(), RuntimeError> {
        check_step(dt_seconds)?;
        let mut pose = pose::checked(pose)?;
        pose.root_translation_m /= self.scale;
        let given = self.conditioner.push(&pose, dt_seconds);
        let dt_seconds = given.dt_seconds;
        let mut advance = self.clock.plan(&given.pose, dt_seconds);
        if given.cut && !matches!(advance, Advance::Settle(_)) {
            advance = Advance::Settle(Settled::Cut);
        }
        if self.unsettled && self.visibility.woken {
            advance = Advance::Settle(Settled::Woken);
        } else if self.unsettled && !matches!(advance, Advance::Settle(_)) {
            advance = Advance::Settle(Settled::FirstPose);
        }
        let driven = (given.pose != pose).then_some(given.pose);
        self.planned = Planned {
            pose,
            driven,
            dt_seconds,
            advance,
            shows: false,
        };
        Ok(())
    }

    /// Ticks of the last step, and why it settled the tissue, if it did.
    pub fn report(&self) -> (usize, Option<Settled>) {
        match self.planned.advance {
            _ if self.visibility.asleep() => (0, None),
            Advance::Settle(reason) => (0, Some(reason)),
            Advance::Tick(ticks) => (ticks.count, None),
        }
    }

    /// Whether the last step changed the surface.
    pub fn has_shown(&self) -> bool {
        self.planned.shows
    }

    /// Whether the networks run.
    fn moves(&self) -> bool {
        self.enabled && !self.visibility.asleep()
    }

    /// The pose that the planned step settles in, if it does.
    pub fn settling_pose(&self) -> Option<&Pose> {
        let settles = self.moves() && matches!(self.planned.advance, Advance::Settle(_));
        settles.then_some(self.planned.driven())
    }

    /// The pose of tick `index` of the planned step, where there is one.
    pub fn tick_pose(&self, index: usize) -> Option<Pose> {
        match self.planned.advance {
            Advance::Tick(ticks) if index < ticks.count && self.moves() => {
                let between = self.conditioner.pose_at(ticks.position(index));
                Some(between.unwrap_or_else(|| {
                    self.clock.pose_of_tick(ticks, index, self.planned.driven())
                }))
            }
            _ => None,
        }
    }

    /// What the surface is to show after the ticks, where it changes.
    pub fn begin_showing(&mut self) -> Option<Showing> {
        let moves = self.moves();
        let Planned {
            dt_seconds,
            advance,
            shows,
            ..
        } = &mut self.planned;
        *shows = match advance {
            _ if !moves => false,
            Advance::Settle(_) => true,
            Advance::Tick(_) if *dt_seconds == 0.0 => false,
            Advance::Tick(ticks) => self.visibility.is_due(ticks.count, *dt_seconds),
        };
        shows.then(|| match *advance {
            Advance::Settle(_) => Showing::Settled,
            Advance::Tick(_) => Showing::Between(self.clock.phase_after(*dt_seconds, *advance)),
        })
    }

    /// How the surface changes, after decoding.
    pub fn shown(&mut self) -> Option<Shown> {
        if self.enabled && self.visibility.visible && self.visibility.asleep() {
            return Some(Shown::FadesOut(self.planned.dt_seconds));
        }
        if !self.planned.shows {
            return None;
        }
        let seconds = self.visibility.mark_shown();
        Some(match self.planned.advance {
            Advance::Settle(reason) => Shown::Settled {
                fades: reason != Settled::FirstPose && !self.visibility.unseen,
            },
            Advance::Tick(_) => Shown::Moved(seconds),
        })
    }

    /// Ends the step; gives its pose, in metres of the body.
    pub fn commit(&mut self) -> &Pose {
        let Planned {
            dt_seconds,
            advance,
            ..
        } = self.planned;
        self.clock
            .commit(self.planned.driven(), dt_seconds, advance);
        self.unsettled = !self.moves();
        if !self.unsettled {
            self.visibility.woken = false;
            self.visibility.unseen = false;
        }
        &self.planned.pose
    }

    /// The last pose that took time, in metres of the body.
    pub fn pose(&self) -> Option<&Pose> {
        self.clock.pose()
    }

    /// What a saved state says of it, for [`Self::remember`]. Poses on their way to the tissue are not in
    /// it: where there are any, the next pose counts as the first.
    pub fn memory(&self) -> TimelineMemory {
        TimelineMemory {
            scale: self.scale,
            enabled: self.enabled,
            unsettled: self.unsettled || self.conditioner.engaged(),
            clock: self.clock.clone(),
        }
    }

    /// Goes on from that; visibility stays the host's.
    pub fn remember(&mut self, memory: TimelineMemory) {
        self.scale = memory.scale;
        self.enabled = memory.enabled;
        self.unsettled = memory.unsettled;
        self.clock = memory.clock;
        self.conditioner.resume();
    }
}
