//! Random calls on a shipped model: the native runtime and the WebAssembly (web/sdk/tests/walks.test.ts)
//! show the same. Poses are made by additions, products, quotients and roots alone, which every machine
//! rounds alike, so skin matrices have the same bits. Networks are summed in another order by other
//! machines' vector units, so offsets are held to a limit.
//!
//! `DYNASKIN_WRITE_GOLDEN=1` writes what the other side is compared with.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "support/shipped.rs"]
mod shipped;

use std::path::PathBuf;

use dynaskin_body::{Pose, Region};
use dynaskin_runtime::{Avatar, Detail};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

const SEEDS: [u32; 12] = [1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233];
const STEPS: usize = 160;
/// Steps from one look at the offsets to the next.
const LOOK: usize = 16;
/// Vertices that are looked at: soft ones of the female body.
const VERTICES: [usize; 8] = [327, 934, 1476, 2360, 3415, 4449, 5547, 6021];
/// A golden look may be off by so much, in micrometres.
const LIMIT_UM: f64 = 10.0;
/// Sixtieths of a second twice as fine: what the motion counts in.
const SEGMENT: u32 = 48;
/// Numbers of a pose that move: the root's place, and three of each joint.
const MOVING: usize = 3 + 3 * 24;

#[derive(Debug, Serialize, Deserialize)]
struct Golden {
    vertices: Vec<usize>,
    walks: Vec<Shown>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Shown {
    seed: u32,
    /// Hash of the bits of all skin matrices.
    matrices: String,
    /// `[look][vertex * 3 + axis]`, micrometres.
    offsets_um: Vec<Vec<f64>>,
}

/// Xorshift.
struct Random(u32);

impl Random {
    fn below(&mut self, count: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0 % count
    }

    fn goal(&mut self) -> [f64; MOVING] {
        std::array::from_fn(|_| (f64::from(self.below(2001)) - 1000.0) / 1000.0 * 0.3)
    }
}

/// A motion from goal to goal.
struct Motion {
    from: [f64; MOVING],
    to: [f64; MOVING],
    ticks: u32,
    shift_m: [f64; 2],
}

impl Motion {
    fn advance(&mut self, ticks: u32, random: &mut Random) -> Pose {
        self.ticks += ticks;
        if self.ticks >= SEGMENT {
            self.ticks -= SEGMENT;
            self.from = self.to;
            self.to = random.goal();
        }
        let u = f64::from(self.ticks) / f64::from(SEGMENT);
        let share = u * u * (3.0 - 2.0 * u);
        let at = |idx: usize| self.from[idx] + (self.to[idx] - self.from[idx]) * share;
        let mut pose = Pose::REST;
        let [x_m, z_m] = self.shift_m;
        pose.root_translation_m = DVec3::new(at(0) + x_m, at(1), at(2) + z_m);
        for (joint, turn) in pose.parent_from_joint.iter_mut().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis| at(3 + 3 * joint + axis));
            let length = (x * x + y * y + z * z + 1.0).sqrt();
            *turn = DQuat::from_xyzw(x / length, y / length, z / length, 1.0 / length);
        }
        pose
    }
}

fn walk(avatar: &mut Avatar, seed: u32) -> Shown {
    let mut random = Random(seed);
    let mut motion = Motion {
        from: random.goal(),
        to: random.goal(),
        ticks: 0,
        shift_m: [0.0; 2],
    };
    let (mut hash, mut offsets_um) = (0x811c_9dc5_u32, Vec::new());
    for step in 0..STEPS {
        change(avatar, &mut random, &mut motion);
        let (ticks, dt) = match random.below(40) {
            0 => (0, 0.3),
            _ => [
                (2, 1.0 / 60.0),
                (2, 1.0 / 60.0),
                (1, 1.0 / 120.0),
                (4, 1.0 / 30.0),
            ][random.below(4) as usize],
        };
        let pose = motion.advance(ticks, &mut random);
        avatar.step(&pose, dt).unwrap();
        for number in avatar
            .skin_matrices()
            .iter()
            .flat_map(|m| m.to_cols_array())
        {
            hash = (hash ^ number.to_bits()).wrapping_mul(0x0100_0193);
        }
        if step % LOOK == LOOK - 1 {
            let places = VERTICES
                .iter()
                .map(|vertex| avatar.offsets_rest_m()[*vertex]);
            let numbers = places.flat_map(|m| m.to_array());
            offsets_um.push(
                numbers
                    .map(|m| (1e7 * f64::from(m)).round() / 10.0)
                    .collect(),
            );
        }
    }
    Shown {
        seed,
        matrices: format!("{hash:08x}"),
        offsets_um,
    }
}

/// Most times nothing; else a call of another kind.
fn change(avatar: &mut Avatar, random: &mut Random, motion: &mut Motion) {
    match random.below(64) {
        0 => motion.shift_m = [0, 1].map(|_| (f64::from(random.below(2000)) - 1000.0) / 10.0),
        1 => avatar.reset(),
        2 => {
            let details = [Detail::Full, Detail::Half, Detail::Asleep];
            avatar.set_detail(details[random.below(3) as usize]);
        }
        3 => avatar.set_visible(random.below(2) == 0),
        4 => {
            let strength = f64::from(random.below(400)) / 100.0;
            avatar.set_strength(strength as f32).unwrap();
        }
        5 => {
            let state = avatar.save();
            avatar.restore(&state).unwrap();
        }
        6 => avatar
            .set_scale((10.0 + f64::from(random.below(40))) / 20.0)
            .unwrap(),
        7 => {
            let stiffness = (50.0 + f64::from(random.below(150))) / 100.0;
            let mut controls = *avatar.controls();
            controls.regions[Region::Belly as usize].stiffness = stiffness as f32;
            avatar.set_controls(&controls).unwrap();
        }
        _ => {}
    }
}

#[test]
fn the_same_calls_show_the_same_as_in_webassembly() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/walks.json");
    let model = shipped::model("female");
    let walks = SEEDS.map(|seed| walk(&mut shipped::avatar(&model), seed));
    let vertices = VERTICES.to_vec();
    let got = Golden {
        vertices,
        walks: walks.into(),
    };
    if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, serde_json::to_string(&got).unwrap()).unwrap();
    }
    let golden: Golden = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(got.vertices, golden.vertices);
    assert_eq!(got.walks.len(), golden.walks.len());
    let (mut worst_um, mut largest_um) = (0.0_f64, 0.0_f64);
    for (got, golden) in got.walks.iter().zip(&golden.walks) {
        assert_eq!((got.seed, &got.matrices), (golden.seed, &golden.matrices));
        let pairs = got
            .offsets_um
            .iter()
            .flatten()
            .zip(golden.offsets_um.iter().flatten());
        for (got, golden) in pairs {
            worst_um = worst_um.max((got - golden).abs());
            largest_um = largest_um.max(got.abs());
        }
    }
    println!("offsets to {largest_um:.0} µm, off by {worst_um:.2} µm");
    assert!(
        largest_um > 2000.0 && worst_um <= LIMIT_UM,
        "{worst_um} of {largest_um}"
    );
}
