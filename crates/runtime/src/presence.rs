//! How one avatar takes its steps: at once or every second tick, asleep, out of sight.

use dynaskin_body::Pose;

use crate::RuntimeError;
use crate::avatar::{Avatar, StageSeconds, StepReport};
use crate::clock::{Advance, Settled, TickClock, Ticks};
use crate::pose;
use crate::skin;
use crate::tissue::Tissue;

/// How much work an avatar's tissue is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// None: the tissue comes to rest over [`crate::FADE_SECONDS`] and then costs nothing. Waking,
    /// it starts settled in the pose of that moment, and fades in over as long.
    Asleep,
    /// The surface follows every second tick, at 30 Hz, and is held in between. The predictor ticks
    /// on at 60 Hz, because that is the rate it learned at: its memory is the same as at full
    /// detail, and what is shown is what full detail showed one tick before, or shows now.
    Half,
    /// All of it, at every step.
    #[default]
    Full,
}

/// Ticks between two surfaces at half detail.
const HALF_TICKS: usize = 2;

/// Whether and how finely the avatar is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Presence {
    pub detail: Detail,
    pub visible: bool,
    /// Metres from the camera, where the host says so.
    pub distance_m: f64,
    /// Whether the avatar was asleep or out of sight until the step at hand.
    woken: bool,
    /// Whether the settled surface is shown at once, because nobody saw the one before.
    unseen: bool,
    /// Ticks and seconds since the surface was last shown.
    unshown_ticks: usize,
    unshown_seconds: f64,
}

impl Default for Presence {
    fn default() -> Self {
        Self {
            detail: Detail::Full,
            visible: true,
            distance_m: 0.0,
            woken: false,
            unseen: false,
            unshown_ticks: 0,
            unshown_seconds: 0.0,
        }
    }
}

/// A step that was checked and is about to be taken.
#[derive(Clone, Debug)]
pub(crate) struct Planned {
    /// In metres of the body.
    pose: Pose,
    dt_seconds: f64,
    /// What drives the tissue, where it is not the host's pose.
    driven: Option<Pose>,
    /// The seconds that the tissue moves on by.
    driven_seconds: f64,
    advance: Advance,
    /// Whether the surface changes.
    shows: bool,
}

impl Default for Planned {
    fn default() -> Self {
        Self {
            pose: Pose::REST,
            dt_seconds: 0.0,
            driven: None,
            driven_seconds: 0.0,
            advance: Advance::Tick(Ticks::NONE),
            shows: false,
        }
    }
}

impl Planned {
    fn driven(&self) -> &Pose {
        self.driven.as_ref().unwrap_or(&self.pose)
    }
}

impl Avatar {
    /// How much work the tissue is worth.
    pub fn detail(&self) -> Detail {
        self.presence.detail
    }

    /// Changes that. A [`crate::Crowd`] with a level of detail does it by itself.
    pub fn set_detail(&mut self, detail: Detail) {
        self.change_presence(|presence| presence.detail = detail);
    }

    /// Whether anybody sees the avatar.
    pub fn visible(&self) -> bool {
        self.presence.visible
    }

    /// Says whether anybody sees the avatar. Out of sight its tissue costs nothing and its surface
    /// stays as it is; steps go on moving the skeleton, but may also be left out. The first step
    /// back in sight shows, at once, tissue that has settled in that step's pose.
    pub fn set_visible(&mut self, visible: bool) {
        self.change_presence(|presence| presence.visible = visible);
    }

    /// Metres from the camera as the host last said, by which a [`crate::Crowd`] chooses the detail.
    pub fn distance_m(&self) -> f64 {
        self.presence.distance_m
    }

    /// Says how far the avatar is from the camera, in metres.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidDistance`] for a negative number or NaN.
    pub fn set_distance_m(&mut self, distance_m: f64) -> Result<(), RuntimeError> {
        if distance_m >= 0.0 {
            self.presence.distance_m = distance_m;
            Ok(())
        } else {
            Err(RuntimeError::InvalidDistance { got: distance_m })
        }
    }

    /// Whether the tissue rests because nobody would see it move.
    fn asleep(&self) -> bool {
        !self.presence.visible || self.presence.detail == Detail::Asleep
    }

    fn change_presence(&mut self, change: impl FnOnce(&mut Presence)) {
        let (slept, was_visible) = (self.asleep(), self.presence.visible);
        change(&mut self.presence);
        let sleeps = self.asleep();
        if sleeps
            && !slept
            && self.presence.visible
            && self.enabled
            && let Some(tissue) = &mut self.tissue
        {
            tissue.begin_fading_out();
        }
        if !was_visible && self.presence.visible {
            self.presence.unseen = true;
            if sleeps {
                if let Some(tissue) = &mut self.tissue {
                    tissue.clear();
                }
                self.surface.clear(&self.figure);
            }
        }
        if slept && !sleeps {
            self.presence.woken = true;
            self.unsettled = true;
        }
    }

    /// Shows the next surface of half detail at tick `ticks` from now: avatars that take turns cost
    /// the same in every frame.
    pub(crate) fn take_turn(&mut self, ticks: usize) {
        self.presence.unshown_ticks = HALF_TICKS - ticks % HALF_TICKS;
    }

    pub(crate) fn tissue(&self) -> Option<&Tissue> {
        self.tissue.as_ref()
    }

    pub(crate) fn tissue_mut(&mut self) -> Option<&mut Tissue> {
        self.tissue.as_mut()
    }

    /// Checks a step to `pose` (in metres of the world) and decides what happens in it.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: nothing has changed.
    pub(crate) fn plan(&mut self, pose: &Pose, dt_seconds: f64) -> Result<(), RuntimeError> {
        TickClock::check(dt_seconds)?;
        let mut pose = pose::checked(pose)?;
        pose.root_translation_m /= self.scale;
        let given = self.conditioner.push(&pose, dt_seconds);
        let driven_seconds = given.dt_seconds;
        let mut advance = self.clock.plan(&given.pose, driven_seconds);
        if given.cut && !matches!(advance, Advance::Settle(_)) {
            advance = Advance::Settle(Settled::Cut);
        }
        let driven = (given.pose != pose).then_some(given.pose);
        if self.unsettled && self.presence.woken {
            advance = Advance::Settle(Settled::Woken);
        } else if self.unsettled && !matches!(advance, Advance::Settle(_)) {
            advance = Advance::Settle(Settled::FirstPose);
        }
        self.planned = Planned {
            pose,
            dt_seconds,
            driven,
            driven_seconds,
            advance,
            shows: false,
        };
        Ok(())
    }

    /// What became of the last step.
    pub(crate) fn report(&self) -> StepReport {
        let (ticks, settled) = match self.planned.advance {
            _ if self.asleep() => (0, None),
            Advance::Settle(reason) => (0, Some(reason)),
            Advance::Tick(ticks) => (ticks.count, None),
        };
        StepReport {
            ticks,
            settled,
            seconds: StageSeconds::default(),
        }
    }

    /// Whether the last step changed the surface.
    pub(crate) fn has_shown(&self) -> bool {
        self.planned.shows
    }

    /// Whether the networks run.
    fn moves(&self) -> bool {
        self.enabled && !self.asleep() && self.tissue.is_some()
    }

    /// Gets ready to settle, where that is planned.
    pub(crate) fn begin_settling(&mut self) -> bool {
        let settles = self.moves() && matches!(self.planned.advance, Advance::Settle(_));
        if settles && let Some(tissue) = &mut self.tissue {
            tissue.begin_settling(self.planned.driven());
        }
        settles
    }

    /// Computes the features of tick `index`, where there is one.
    pub(crate) fn feel_tick(&mut self, index: usize) -> bool {
        match self.planned.advance {
            Advance::Tick(ticks) if index < ticks.count && self.moves() => {
                let driven = self.planned.driven();
                let on_path = self.conditioner.pose_at(ticks.position(index));
                let pose = on_path.unwrap_or_else(|| self.clock.pose_of_tick(ticks, index, driven));
                if let Some(tissue) = &mut self.tissue {
                    tissue.feel(&pose);
                }
                true
            }
            _ => false,
        }
    }

    /// Gets ready to show the surface, where it changes. Whether it has to be decoded.
    pub(crate) fn begin_showing(&mut self) -> bool {
        let moves = self.moves();
        let Planned {
            driven_seconds: dt_seconds,
            advance,
            ..
        } = self.planned;
        let presence = &mut self.presence;
        let Some(tissue) = &mut self.tissue else {
            return false;
        };
        self.planned.shows = false;
        match advance {
            _ if !moves => false,
            Advance::Settle(_) => {
                self.planned.shows = true;
                tissue.settle();
                true
            }
            Advance::Tick(_) if dt_seconds == 0.0 => false,
            Advance::Tick(ticks) => {
                presence.unshown_ticks += ticks.count;
                presence.unshown_seconds += dt_seconds;
                if presence.detail == Detail::Half && presence.unshown_ticks < HALF_TICKS {
                    return false;
                }
                self.planned.shows = true;
                tissue.begin_showing(self.clock.phase_after(dt_seconds, advance))
            }
        }
    }

    /// Shows what was decoded.
    pub(crate) fn show(&mut self) {
        let fades_out = self.enabled && self.presence.visible && self.asleep();
        let Some(tissue) = &mut self.tissue else {
            return;
        };
        if fades_out && tissue.fade_out(self.planned.dt_seconds) {
            self.apply();
        } else if self.planned.shows {
            let presence = &mut self.presence;
            match self.planned.advance {
                Advance::Settle(reason) => {
                    tissue.show_settled(reason != Settled::FirstPose && !presence.unseen);
                }
                Advance::Tick(_) => tissue.show(presence.unshown_seconds),
            }
            (presence.unshown_ticks, presence.unshown_seconds) = (0, 0.0);
            self.apply();
        }
    }

    /// Ends the step.
    pub(crate) fn commit(&mut self) {
        let Planned {
            pose,
            driven_seconds,
            advance,
            ..
        } = &self.planned;
        self.clock
            .commit(self.planned.driven(), *driven_seconds, *advance);
        self.skin = skin::scaled(pose, &self.figure.joints_rest_m, self.scale);
        self.skin_matrices = skin::matrices(&self.skin);
        self.unsettled = !self.enabled || self.asleep();
        if !self.unsettled {
            self.presence.woken = false;
            self.presence.unseen = false;
        }
    }
}
