//! Surfaces that are decoded when somebody asks for them: the same as if every step had decoded them, whatever
//! happens meanwhile.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "support/shipped.rs"]
mod shipped;

use std::sync::Arc;

use dynaskin_body::Region;
use dynaskin_motion::{Clip, ProceduralKind};
use dynaskin_runtime::{
    Avatar, Controls, Crowd, Decoder, DecoderSession, Decoding, Detail, Model, RuntimeError,
};
use glam::DVec3;
use shipped::{distance, largest};

const DT: f64 = 1.0 / 60.0;

/// Between a surface decoded in the step and one decoded afterwards, in metres: rounding.
const TOLERANCE_M: f32 = 2e-6;

/// Two avatars that go through the same: one decodes in every step, the other on demand.
struct Both {
    in_step: Avatar,
    on_demand: Avatar,
    clip: Clip,
    frame: usize,
    shift_m: f64,
}

impl Both {
    fn new(model: &Arc<Model>) -> Self {
        let mut on_demand = shipped::avatar(model);
        on_demand.set_decoding(Decoding::OnDemand);
        let in_step = shipped::avatar(model);
        let clip = shipped::clip(ProceduralKind::Hop, &in_step);
        Self {
            in_step,
            on_demand,
            clip,
            frame: 0,
            shift_m: 0.0,
        }
    }

    fn each(&mut self, change: impl Fn(&mut Avatar)) {
        change(&mut self.in_step);
        change(&mut self.on_demand);
    }

    /// Steps both; `dt` in ticks.
    fn step(&mut self, ticks: f64) {
        self.frame += 1;
        let time = (0.5 + DT * self.frame as f64) % self.clip.duration_seconds();
        let mut pose = self.clip.pose_at(time);
        pose.root_translation_m += DVec3::X * self.shift_m;
        self.each(|avatar| {
            avatar.step(&pose, ticks * DT).unwrap();
        });
    }

    /// Holds both surfaces to each other; gives the largest offset.
    fn compare(&mut self, what: &str) -> f32 {
        self.on_demand.update_surface();
        let apart_m = distance(
            self.in_step.offsets_rest_m(),
            self.on_demand.offsets_rest_m(),
        );
        assert!(apart_m <= TOLERANCE_M, "{what}: {apart_m} m");
        let (a, b) = (&self.in_step, &self.on_demand);
        let apart_m = distance(a.positions_rest_m(), b.positions_rest_m());
        assert!(apart_m <= TOLERANCE_M, "{what}, positions: {apart_m} m");
        let turned = distance(a.normals_rest(), b.normals_rest());
        assert!(turned <= 1e-3, "{what}, normals: {turned}");
        largest(a.offsets_rest_m())
    }

    /// Steps and compares `count` times; gives the largest offset.
    fn play(&mut self, count: usize, what: &str) -> f32 {
        let mut largest_m = 0.0_f32;
        for step in 0..count {
            self.step(if step % 5 == 4 { 1.6 } else { 1.0 });
            largest_m = largest_m.max(self.compare(&format!("{what}, step {step}")));
        }
        largest_m
    }

    fn is_undecoded(&self) -> bool {
        self.on_demand.undecoded_latents().is_some()
    }
}

fn stiff() -> Controls {
    let mut controls = Controls::default();
    // Beyond what the networks have learned.
    controls.regions[Region::Chest as usize].stiffness = 10.0;
    controls
}

#[test]
fn surfaces_are_the_same_whatever_happens() {
    for name in ["female", "male"] {
        let model = shipped::model(name);
        let mut both = Both::new(&model);
        assert!(both.is_undecoded(), "from the first step on");
        let largest_m = both.play(40, "a motion");
        assert!(largest_m > 0.01, "{largest_m}");

        both.shift_m = 5.0;
        both.play(4, "a jump to elsewhere, which fades");
        let mut other = Controls::default();
        other.strength = 1.5;
        other.regions[Region::Belly as usize].gain = 0.5;
        other.regions[Region::Chest as usize].limit_m = 0.01;
        both.each(|avatar| avatar.set_controls(&other).unwrap());
        both.compare("other controls at once");
        both.play(4, "other controls");
        both.each(|avatar| avatar.set_shape(&[1.0; 10]).unwrap());
        both.compare("another shape at once");
        both.play(20, "another shape");
        both.each(|avatar| avatar.set_controls(&Controls::default()).unwrap());
        both.each(|avatar| avatar.set_detail(Detail::Half));
        both.play(20, "half detail");
        both.each(|avatar| avatar.set_detail(Detail::Asleep));
        both.play(8, "falling asleep");
        both.each(|avatar| avatar.set_detail(Detail::Full));
        both.play(20, "waking");
        both.each(|avatar| avatar.set_visible(false));
        both.play(3, "out of sight");
        both.each(|avatar| avatar.set_visible(true));
        both.play(10, "in sight again");
        both.each(|avatar| avatar.set_enabled(false));
        assert_eq!(both.compare("switched off"), 0.0);
        both.each(|avatar| avatar.set_enabled(true));
        both.play(20, "switched on");
        assert!(both.is_undecoded());
        both.step(100.0);
        both.compare("a stall");
    }
}

#[test]
fn steps_decode_where_nobody_else_can_and_stop_when_others_can() {
    let model = shipped::model("female");
    let mut both = Both::new(&model);
    both.play(20, "a motion");
    // In the middle of a fade.
    both.shift_m = 5.0;
    both.play(3, "a fade");
    both.each(|avatar| avatar.set_controls(&stiff()).unwrap());
    both.compare("a stiffness that was not learned, at once");
    both.play(20, "a stiffness that was not learned");
    assert!(!both.is_undecoded());
    both.each(|avatar| avatar.set_controls(&Controls::default()).unwrap());
    both.play(20, "learned again");
    assert!(both.is_undecoded());

    both.each(|avatar| avatar.set_max_strain(Some(0.3)).unwrap());
    both.compare("a largest strain, at once");
    assert!(!both.is_undecoded());
    both.play(10, "a largest strain");
    both.each(|avatar| avatar.set_max_strain(None).unwrap());
    both.play(10, "no largest strain");
    assert!(both.is_undecoded());

    both.shift_m = 10.0;
    both.play(3, "another fade");
    both.on_demand.set_decoding(Decoding::InStep);
    assert!(!both.is_undecoded());
    both.compare("decoding in steps, at once");
    both.play(3, "decoding in steps");
    both.on_demand.set_decoding(Decoding::OnDemand);
    assert!(!both.is_undecoded(), "until nothing fades");
    both.play(20, "on demand again");
    assert!(both.is_undecoded());
}

#[test]
fn surfaces_wait_until_they_are_asked_for_and_say_that_they_changed() {
    let model = shipped::model("female");
    let mut both = Both::new(&model);
    let mut moved_m = 0.0_f32;
    for _ in 0..30 {
        let before = both.on_demand.surface_revision();
        both.step(1.0);
        moved_m = moved_m.max(largest(both.in_step.offsets_rest_m()));
        assert_ne!(both.on_demand.surface_revision(), before);
    }
    assert_eq!(largest(both.on_demand.offsets_rest_m()), 0.0);
    assert!(moved_m > 0.005, "{moved_m}");
    both.compare("asked for");
    let revision = both.on_demand.surface_revision();
    both.on_demand.update_surface();
    assert_eq!(both.on_demand.surface_revision(), revision);
    // At half detail every second surface is the one before.
    both.each(|avatar| avatar.set_detail(Detail::Half));
    let mut revisions: Vec<u32> = (0..20)
        .map(|_| {
            both.step(1.0);
            both.on_demand.surface_revision()
        })
        .collect();
    revisions.dedup();
    assert!((9..=11).contains(&revisions.len()), "{revisions:?}");
    let revision = both.on_demand.controls_revision();
    both.on_demand.set_strength(0.5).unwrap();
    assert_ne!(both.on_demand.controls_revision(), revision);
}

#[test]
fn crowds_mix_both() {
    let model = shipped::model("male");
    let avatars = || -> Vec<Avatar> { (0..11).map(|_| shipped::avatar(&model)).collect() };
    let (mut mixed, mut plain) = (avatars(), avatars());
    for avatar in mixed.iter_mut().step_by(2) {
        avatar.set_decoding(Decoding::OnDemand);
    }
    let clip = shipped::clip(ProceduralKind::RunInPlace, &plain[0]);
    let mut crowds = [(); 2].map(|()| Crowd::new(Arc::clone(&model)).unwrap());
    for step in 0..30 {
        let pose = |idx: usize| clip.pose_at(0.5 + DT * step as f64 + 0.1 * idx as f64);
        let poses: Vec<_> = (0..11).map(pose).collect();
        for (crowd, avatars) in crowds.iter_mut().zip([&mut mixed, &mut plain]) {
            let mut all: Vec<&mut Avatar> = avatars.iter_mut().collect();
            crowd.step_all(&mut all, &poses, DT, &mut || 0.0).unwrap();
        }
    }
    for (mixed, plain) in mixed.iter_mut().zip(&plain) {
        mixed.update_surface();
        let apart_m = distance(mixed.offsets_rest_m(), plain.offsets_rest_m());
        assert!(apart_m <= TOLERANCE_M, "{apart_m}");
        assert!(largest(plain.offsets_rest_m()) > 0.001);
    }
}

#[test]
fn saved_states_have_what_was_not_decoded() {
    let model = shipped::model("female");
    let mut both = Both::new(&model);
    both.play(30, "a motion");
    both.shift_m = 5.0;
    both.play(3, "a fade");
    let mut restored = shipped::avatar(&model);
    restored.restore(&both.on_demand.save()).unwrap();
    let apart_m = distance(restored.offsets_rest_m(), both.in_step.offsets_rest_m());
    assert!(apart_m <= TOLERANCE_M, "{apart_m}");
    // And the other way round.
    let saved = both.in_step.save();
    both.on_demand.restore(&saved).unwrap();
    both.compare("restored");
    both.play(30, "after it was restored");
    assert!(both.is_undecoded());
}

#[test]
fn a_matrix_gives_what_its_decoder_gives() -> Result<(), RuntimeError> {
    for name in ["female", "male"] {
        let folder = format!("{}/../../models/{name}", env!("CARGO_MANIFEST_DIR"));
        for file in ["decoder.onnx", "decoder.lowered"] {
            let bytes = std::fs::read(format!("{folder}/{file}")).unwrap();
            let decoder = Decoder::load(&bytes)?;
            let matrix = decoder.linear().expect("a matrix");
            let count = decoder.latent_count();
            assert_eq!(
                (matrix.latent_count(), matrix.vertex_count()),
                (count, decoder.vertex_count())
            );
            assert_eq!(matrix.latents().len(), matrix.weights().len());
            let mut session = DecoderSession::new(&decoder)?;
            let mut decode = |latents: &[f32]| -> Result<Vec<f32>, RuntimeError> {
                let mut offsets_m = vec![0.0; 3 * decoder.vertex_count()];
                session.decode(latents, &mut offsets_m)?;
                Ok(offsets_m)
            };
            let still = decode(&vec![0.0; count])?;
            let latents: Vec<f32> = (0..count).map(|idx| (idx as f32 * 1.7).sin()).collect();
            let moved = decode(&latents)?;
            let size = moved
                .iter()
                .fold(0.0_f32, |size, number| size.max(number.abs()));
            for (vertex, range) in matrix.starts().windows(2).enumerate() {
                let own = range[0] as usize..range[1] as usize;
                for axis in 0..3 {
                    let products = own.clone().map(|idx| {
                        latents[matrix.latents()[idx] as usize] * matrix.weights()[idx][axis]
                    });
                    let got: f32 = products.sum();
                    let expected = moved[3 * vertex + axis] - still[3 * vertex + axis];
                    assert!(
                        (got - expected).abs() <= 1e-5 * size,
                        "{file}: {got}, {expected}"
                    );
                }
            }
        }
    }
    Ok(())
}
