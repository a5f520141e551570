//! Different bodies in the same motion (DSNet, Figure 9): how far their regions move, simulated and
//! predicted.

use dynaskin_body::{BodyModel, REGION_COUNT, SHAPE_COUNT};
use dynaskin_motion::{Clip, MODEL_RATE_HZ, Procedural, ProceduralKind};
use dynaskin_sim::{
    Amplitude, ClipData, ClipLabels, HELD_OUT_SHAPES, Materials, Shell, SimSettings, amplitudes,
    simulate_clip,
};
use half::f16;
use rayon::prelude::*;

use super::Contestant;
use super::groups::Groups;
use super::showcase::Snapshot;
use dynaskin_train::TrainError;

/// The held-out shapes.
pub const BODIES: [(&str, [f32; SHAPE_COUNT]); 3] = [
    ("usual", HELD_OUT_SHAPES[0]),
    ("heavy", HELD_OUT_SHAPES[1]),
    ("lean, large chest", HELD_OUT_SHAPES[2]),
];
/// Frames that are left out at the start: the body gets going.
const LEAD_TICKS: usize = 60;

/// One body's movement.
#[derive(Clone, Debug)]
pub struct BodyAmplitudes {
    /// What the body is like.
    pub name: &'static str,
    /// What the simulator gives.
    pub simulated: [Amplitude; REGION_COUNT],
    /// What the methods give, one a contestant.
    pub predicted: Vec<[Amplitude; REGION_COUNT]>,
    /// The frame with the largest offsets.
    pub snapshot: Snapshot,
}

/// Simulates hops on one leg, a motion that is held out, on every held-out body, and plays them to
/// all contestants. `ticks` are simulated at 60 Hz: at least one hop beyond the first second.
///
/// # Errors
/// [`TrainError::Shell`], [`TrainError::Sim`], [`TrainError::Motion`], [`TrainError::Runtime`].
pub fn amplitudes_of_bodies(
    contestants: &mut [Contestant],
    model: &BodyModel,
    settings: &SimSettings,
    ticks: usize,
) -> Result<Vec<BodyAmplitudes>, TrainError> {
    let hops = Procedural {
        duration_seconds: ticks as f64 / MODEL_RATE_HZ,
        ..Procedural::new(ProceduralKind::OneLegHop)
    };
    let cycle = (MODEL_RATE_HZ / hops.tempo_hz).round() as usize;
    let clips = BODIES
        .par_iter()
        .map(|(_, shape)| {
            let motion = hops.clip(&model.shaped(shape).joints_m)?;
            let materials = Materials::NOMINAL;
            simulated(model, settings, &motion, *shape, materials)
        })
        .collect::<Result<Vec<ClipData>, TrainError>>()?;
    let mut bodies = Vec::new();
    for ((name, _), clip) in BODIES.into_iter().zip(clips) {
        let frames = LEAD_TICKS.min(clip.frame_count() / 2)..clip.frame_count();
        let frame = wildest_frame(model, &clip);
        let coordinates = 3 * clip.vertices.len();
        let (mut predicted, mut predicted_m) = (Vec::new(), Vec::new());
        for contestant in contestants.iter_mut() {
            let offsets = contestant.predict(model, &dynaskin_train::motion_of(&clip), &clip)?;
            predicted_m.push(offsets[frame * coordinates..(frame + 1) * coordinates].to_vec());
            let of_method = ClipData {
                offsets_rest_m: offsets.into_iter().map(f16::from_f32).collect(),
                ..clip.clone()
            };
            predicted.push(amplitudes(model, &of_method, frames.clone(), cycle));
        }
        bodies.push(BodyAmplitudes {
            name,
            simulated: amplitudes(model, &clip, frames, cycle),
            predicted,
            snapshot: Snapshot {
                name: clip.name.clone(),
                pose: clip.poses[frame].clone(),
                shape: clip.shape,
                truth_m: frame_m(&clip, frame),
                predicted_m,
            },
        });
    }
    Ok(bodies)
}

/// A motion simulated on a body of the given shape and materials.
pub(super) fn simulated(
    model: &BodyModel,
    settings: &SimSettings,
    motion: &Clip,
    shape: [f32; SHAPE_COUNT],
    materials: Materials,
) -> Result<ClipData, TrainError> {
    let settings = settings.with_materials(&materials);
    let shell = Shell::for_body(model, &shape, &settings)?;
    let labels = ClipLabels {
        name: motion.name.clone(),
        body_sha256: String::new(),
        seed: 0,
        shape,
        materials,
        sim_json: "{}".into(),
    };
    Ok(simulate_clip(&shell, motion, &settings, labels)?.data)
}

fn frame_m(clip: &ClipData, frame: usize) -> Vec<f32> {
    let offsets = clip.frame_offsets_rest_m(frame).iter();
    offsets.map(|x| x.to_f32()).collect()
}

fn wildest_frame(model: &BodyModel, clip: &ClipData) -> usize {
    let groups = Groups::new(model, &clip.vertices);
    let still = vec![0.0; 3 * clip.vertices.len()];
    let size = |frame: usize| groups.errors_mm(&frame_m(clip, frame), &still)[1];
    (0..clip.frame_count())
        .max_by(|a, b| size(*a).total_cmp(&size(*b)))
        .unwrap_or(0)
}
