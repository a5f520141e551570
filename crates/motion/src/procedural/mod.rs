//! Procedural motions, which need no capture.
//!
//! Each starts and ends standing still, keeps planted soles where they are, and joins its phases
//! with equal position, speed and acceleration. A flight is a parabola under gravity.

mod bounce;
mod grounded;
mod hops;
pub(crate) mod ik;
mod parameters;
mod track;

use dynaskin_body::{JOINT_COUNT, Pose};
use glam::Vec3;

use crate::clip::check_range;
use crate::{Clip, MODEL_RATE_HZ, MotionError};
use ik::{IkSolver, StanceAt};
pub(crate) use parameters::{LEAD_SECONDS, TAIL_SECONDS};
pub use parameters::{Procedural, ProceduralKind};

impl Procedural {
    /// Poses at 60 Hz for a body with these rest joint positions (metres, standing in an A-pose or
    /// T-pose on y = 0, facing +Z). The clip is named after the motion.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a parameter out of range or a clip too short for one
    /// repetition, [`MotionError::FlightDoesNotFit`] where the height needs more time than the
    /// tempo leaves, [`MotionError::Degenerate`] for joints that are no standing person.
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Clip, MotionError> {
        self.clip_at(MODEL_RATE_HZ, joints_rest_m)
    }

    /// The same at `rate_hz`, 1 to 1000.
    ///
    /// # Errors
    /// As [`Self::clip`], and [`MotionError::Parameter`] for another rate.
    pub fn clip_at(
        &self,
        rate_hz: f64,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Clip, MotionError> {
        check_range("rate_hz", rate_hz, 1.0, 1000.0)?;
        let (low, high) = self.kind.tempos_hz();
        check_range("tempo_hz", self.tempo_hz, low, high)?;
        let (low, high) = self.kind.heights_m();
        check_range("height_m", self.height_m, low, high)?;
        check_range("duration_seconds", self.duration_seconds, 0.0, 3600.0)?;
        let solver = IkSolver::new(joints_rest_m)?;
        let stances = self.stances(&solver)?;
        let last = (self.duration_seconds * rate_hz).round() as usize;
        let frames: Vec<Pose> = (0..=last)
            .map(|frame| solver.pose(&stances(frame as f64 / rate_hz)))
            .collect();
        Ok(Clip {
            name: self.kind.name().to_owned(),
            rate_hz,
            frames,
        })
    }

    fn stances<'a>(&self, solver: &'a IkSolver) -> Result<StanceAt<'a>, MotionError> {
        match self.kind {
            ProceduralKind::Jump => hops::jump(self, solver),
            ProceduralKind::Hop => hops::hop(self, solver),
            ProceduralKind::OneLegHop => hops::one_leg_hop(self, solver),
            ProceduralKind::JumpingJacks => hops::jumping_jacks(self, solver),
            ProceduralKind::RunInPlace => hops::run_in_place(self, solver),
            ProceduralKind::Walk => grounded::walk(self, solver),
            ProceduralKind::Twist => grounded::twist(self, solver),
            ProceduralKind::ShakeHips => grounded::shake_hips(self, solver),
        }
    }
}
