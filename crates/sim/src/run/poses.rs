//! Poses that avatars are held in and slowly moved between, with a bounce, a shake or a jerk now and then:
//! what captures of sports and everyday movement hardly have.

mod held;
mod movement;

use dynaskin_body::{JOINT_COUNT, Pose};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use glam::Vec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use held::{HELD, drawn};
use movement::{Jerk, RING_SECONDS, Sway, between, smooth};

/// Time in seconds that a pose is held for.
const HOLD_SECONDS: [f64; 2] = [1.0, 2.6];
/// Time in seconds from one pose to the next.
const CHANGE_SECONDS: [f64; 2] = [0.5, 1.6];

/// A clip of held poses, drawn by its seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldPoses {
    /// Poses, times, collars and movements depend on nothing else.
    pub seed: u64,
    /// Length of the clip in seconds.
    pub duration_seconds: f64,
    /// What the body does in a pose.
    pub movement: PoseMovement,
}

/// What a body does in the poses it is held in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseMovement {
    /// It bounces or shakes in half of them and is still in the others.
    Sways,
    /// It is jerked a little in each and left to ring, again and again: the tissue's own frequencies, which
    /// larger movements hide.
    Jerks,
}

/// What stands at a time: a pose, and what the body does in it.
#[derive(Clone, Debug)]
struct Stop {
    pose: Pose,
    /// From when to when it is held, in seconds.
    held: [f64; 2],
    sway: Sway,
    jerks: Vec<Jerk>,
}

impl HeldPoses {
    /// The clip at 60 Hz for a body with these rest joint positions in metres.
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed);
        let mut stops = Vec::new();
        let mut at = 0.0;
        while at < self.duration_seconds {
            let first = stops.is_empty();
            let held = &HELD[rng.random_range(0..if first { 2 } else { HELD.len() })];
            let stop = match self.movement {
                PoseMovement::Sways => {
                    let until = at + between(&mut rng, HOLD_SECONDS);
                    Stop {
                        pose: drawn(held, joints_rest_m, &mut rng),
                        held: [at, until],
                        sway: Sway::drawn(&mut rng),
                        jerks: Vec::new(),
                    }
                }
                PoseMovement::Jerks => {
                    let jerks = Jerk::drawn(at, &mut rng);
                    // The clip begins in the rest pose, which bodies are shown in.
                    let pose = if first {
                        Pose::REST
                    } else {
                        drawn(held, joints_rest_m, &mut rng)
                    };
                    Stop {
                        pose,
                        held: [
                            at,
                            jerks.last().map_or(at, |jerk| jerk.span[1])
                                + between(&mut rng, RING_SECONDS),
                        ],
                        sway: Sway::default(),
                        jerks,
                    }
                }
            };
            let until = stop.held[1];
            stops.push(stop);
            at = until + between(&mut rng, CHANGE_SECONDS);
        }
        let last = (self.duration_seconds * MODEL_RATE_HZ).round() as usize;
        Clip {
            name: format!("held-poses-{}", self.seed),
            rate_hz: MODEL_RATE_HZ,
            frames: (0..=last)
                .map(|frame| at_time(&stops, frame as f64 / MODEL_RATE_HZ))
                .collect(),
        }
    }
}

fn at_time(stops: &[Stop], seconds: f64) -> Pose {
    let after = stops.partition_point(|stop| stop.held[0] <= seconds).max(1);
    let now = &stops[after - 1];
    let [from, until] = now.held;
    match stops.get(after) {
        Some(next) if seconds > until => {
            let share = smooth((seconds - until) / (next.held[0] - until));
            blended(&now.jerked(until), &next.pose, share)
        }
        _ => now
            .sway
            .applied(&now.jerked(seconds), seconds - from, until - from),
    }
}

impl Stop {
    /// Its pose as far as jerks have moved it by then.
    fn jerked(&self, seconds: f64) -> Pose {
        let mut pose = self.pose.clone();
        for jerk in &self.jerks {
            jerk.applied(&mut pose, seconds);
        }
        pose
    }
}

fn blended(from: &Pose, to: &Pose, share: f64) -> Pose {
    let mut pose = from.clone();
    pose.root_translation_m = from.root_translation_m.lerp(to.root_translation_m, share);
    for (now, next) in pose.parent_from_joint.iter_mut().zip(to.parent_from_joint) {
        *now = now.slerp(next, share);
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::held::tests::joints;
    use super::*;

    #[test]
    fn clips_change_steadily_and_repeat_by_their_seed() {
        let held = |seed| HeldPoses {
            seed,
            duration_seconds: 12.0,
            movement: PoseMovement::Sways,
        };
        let clip = held(4).clip(&joints());
        assert_eq!(clip.frames.len(), 721);
        assert_eq!(clip.frames, held(4).clip(&joints()).frames);
        assert_ne!(clip.frames, held(5).clip(&joints()).frames);
        let mut turned = 0.0_f64;
        for pair in clip.frames.windows(2) {
            for (a, b) in pair[0]
                .parent_from_joint
                .iter()
                .zip(pair[1].parent_from_joint)
            {
                turned = turned.max(a.angle_between(b));
            }
        }
        // Half a turn in half a second at its fastest.
        assert!((0.02..0.25).contains(&turned), "{turned} rad in a tick");
    }

    #[test]
    fn jerks_are_small_and_the_body_stays_where_they_left_it() {
        let jerked = HeldPoses {
            seed: 3,
            duration_seconds: 12.0,
            movement: PoseMovement::Jerks,
        };
        let clip = jerked.clip(&joints());
        assert_eq!(clip.frames[0], Pose::REST);
        let speeds_m_s: Vec<f64> = clip
            .frames
            .windows(2)
            .map(|pair| {
                let moved_m = pair[1].root_translation_m - pair[0].root_translation_m;
                moved_m.length() * MODEL_RATE_HZ
            })
            .collect();
        // The first pose alone, which lasts for 2.55 s at least: jerks from 0.6 s on, each followed by stillness.
        let first = &speeds_m_s[..(2.5 * MODEL_RATE_HZ) as usize];
        let fastest = first.iter().fold(0.0_f64, |most, speed| most.max(*speed));
        assert!((0.02..0.8).contains(&fastest), "{fastest} m/s");
        assert!(first[..35].iter().all(|speed| *speed == 0.0));
        let still = first.iter().filter(|speed| **speed == 0.0).count();
        assert!(still > first.len() / 2, "{still} of {}", first.len());
    }
}
