//! Whether and how finely an avatar is seen, and how often its surface is shown.

/// Level of detail of an avatar's tissue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// No tissue: it fades out over [`crate::FADE_SECONDS`] and then costs nothing. When it wakes,
    /// it starts settled in the current pose, and fades in over the same time.
    Asleep,
    /// The surface is updated every second tick, at 30 Hz, and held in between. The predictor still
    /// ticks at 60 Hz, the rate it is trained at: its state is the same as at full
    /// detail, and the surface is that of full detail now or one tick earlier.
    Half,
    /// The surface is updated at every step.
    #[default]
    Full,
}

/// Ticks between two surfaces at half detail.
const HALF_TICKS: usize = 2;

/// Whether and how finely the avatar is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visibility {
    pub detail: Detail,
    pub visible: bool,
    /// Metres from the camera, where the host says so.
    pub distance_m: f64,
    /// Whether the avatar was asleep or out of sight until the step at hand.
    pub woken: bool,
    /// Whether the settled surface is shown at once, because nobody saw the one before.
    pub unseen: bool,
    /// Ticks and seconds since the surface was last shown.
    unshown_ticks: usize,
    unshown_seconds: f64,
}

impl Default for Visibility {
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

/// What becomes of the surface when the visibility changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// Its offsets give way to none over [`crate::FADE_SECONDS`].
    FadesOut,
    /// Its offsets go at once.
    Clears,
}

impl Visibility {
    /// Whether the tissue rests because nobody would see it move.
    pub fn asleep(&self) -> bool {
        !self.visible || self.detail == Detail::Asleep
    }

    /// Changes detail or visibility. What becomes of the surface, if anything.
    pub fn change(&mut self, change: impl FnOnce(&mut Self)) -> Option<Change> {
        let (slept, was_visible) = (self.asleep(), self.visible);
        change(self);
        let sleeps = self.asleep();
        self.woken |= slept && !sleeps;
        if !was_visible && self.visible {
            self.unseen = true;
            return sleeps.then_some(Change::Clears);
        }
        (sleeps && !slept && self.visible).then_some(Change::FadesOut)
    }

    /// Shows the next surface of half detail at tick `ticks` from now: avatars that take turns cost
    /// the same in every frame.
    pub fn take_turn(&mut self, ticks: usize) {
        self.unshown_ticks = HALF_TICKS - ticks % HALF_TICKS;
    }

    /// Counts a step; whether its surface is shown.
    pub fn is_due(&mut self, ticks: usize, dt_seconds: f64) -> bool {
        self.unshown_ticks += ticks;
        self.unshown_seconds += dt_seconds;
        self.detail != Detail::Half || self.unshown_ticks >= HALF_TICKS
    }

    /// Counts anew, since the surface is shown; gives the seconds since it was last shown.
    pub fn mark_shown(&mut self) -> f64 {
        self.unshown_ticks = 0;
        std::mem::take(&mut self.unshown_seconds)
    }
}
