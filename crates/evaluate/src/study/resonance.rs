//! Whether networks respond correctly to their material inputs: resonance of a region with changed
//! stiffness, predicted and simulated.

use dynaskin_body::{BodyModel, Pose, REGION_COUNT, Region, SHAPE_COUNT};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_sim::{ClipData, Materials, Ringing, SimSettings};
use rayon::prelude::*;

use super::bodies::simulated;
use super::contestant::{Contestant, mean};
use dynaskin_train::TrainError;

/// Speed in m/s that the body takes on within one tick: an impulse of acceleration, small enough
/// that tissue stays close to linear.
const SPEED_M_PER_S: f64 = 0.2;
/// Ticks at rest before it.
const STILL_TICKS: usize = 3;
/// Ticks recorded from it on.
const RINGING_TICKS: usize = 90;
/// Factors on the stiffness that are tried.
const STIFFNESSES: [f32; 3] = [0.5, 1.0, 2.0];
/// Frequencies above this cannot be told apart well enough: less than three frames a swing.
pub const HIGHEST_HZ: f64 = 20.0;
/// Vertices with more than this weight belong to a region.
const MEMBER_WEIGHT: f32 = 0.6;

/// A region whose tissue is made stiffer or softer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResonanceTest {
    /// The region.
    pub region: Region,
    /// Factor on its stiffness.
    pub stiffness: f32,
}

/// How a region rings.
#[derive(Clone, Debug)]
pub struct Resonance {
    /// What was changed.
    pub test: ResonanceTest,
    /// In the simulator.
    pub simulated: Ringing,
    /// As each contestant predicts it; none for those without materials among their features.
    pub predicted: Vec<Option<Ringing>>,
}

/// Every region at half, usual and double stiffness.
pub fn tests() -> Vec<ResonanceTest> {
    let of_region = |region| STIFFNESSES.map(|stiffness| ResonanceTest { region, stiffness });
    Region::ALL.into_iter().flat_map(of_region).collect()
}

/// Jerks the mean body upwards at rest, in the simulator and in every network that knows materials,
/// and fits a damped sine to the vertical ringing of the region, by the same estimator for both.
///
/// # Errors
/// [`TrainError::Shell`], [`TrainError::Sim`], [`TrainError::Runtime`].
pub fn resonances(
    contestants: &mut [Contestant],
    model: &BodyModel,
    settings: &SimSettings,
    tests: &[ResonanceTest],
) -> Result<Vec<Resonance>, TrainError> {
    let motion = jerk();
    // The usual tissue is that of every region's test at 1.
    let mut tissues: Vec<[f32; REGION_COUNT]> = Vec::new();
    for test in tests {
        let stiffness = test.stiffnesses();
        if !tissues.contains(&stiffness) {
            tissues.push(stiffness);
        }
    }
    let clips = tissues
        .par_iter()
        .map(|stiffness| {
            let materials = Materials {
                stiffness: *stiffness,
                ..Materials::NOMINAL
            };
            simulated(model, settings, &motion, [0.0; SHAPE_COUNT], materials)
        })
        .collect::<Result<Vec<ClipData>, TrainError>>()?;
    let mut resonances = Vec::new();
    for (stiffness, clip) in tissues.iter().zip(clips) {
        let truth_m = dynaskin_train::offsets_of(&clip);
        let mut predicted_m = Vec::new();
        for contestant in contestants.iter_mut() {
            let knows = contestant
                .feature_kind()
                .is_some_and(|kind| kind.has_materials());
            predicted_m.push(match knows {
                true => Some(contestant.predict(model, &motion, &clip)?),
                false => None,
            });
        }
        for test in tests.iter().filter(|test| test.stiffnesses() == *stiffness) {
            let ringing =
                |offsets_m: &[f32]| ringing(model, &clip.vertices, test.region, offsets_m);
            let predicted = predicted_m.iter().map(|m| m.as_deref().map(ringing));
            resonances.push(Resonance {
                test: *test,
                simulated: ringing(&truth_m),
                predicted: predicted.collect(),
            });
        }
    }
    let place = |found: &Resonance| tests.iter().position(|test| *test == found.test);
    resonances.sort_by_key(place);
    Ok(resonances)
}

impl ResonanceTest {
    /// The factors on the stiffness of all regions.
    fn stiffnesses(&self) -> [f32; REGION_COUNT] {
        let mut stiffnesses = [1.0; REGION_COUNT];
        stiffnesses[self.region as usize] = self.stiffness;
        stiffnesses
    }
}

/// What other stiffness makes of a region's resonance.
#[derive(Clone, Debug, PartialEq)]
pub struct Shift {
    /// What was changed.
    pub test: ResonanceTest,
    /// Frequency over that of the usual tissue, in the simulator.
    pub simulated: f64,
    /// The same as each contestant predicts it; none for those that do not know materials.
    pub predicted: Vec<Option<f64>>,
    /// Whether both simulated frequencies are low enough to be told at 60 frames a second.
    pub resolved: bool,
}

impl Shift {
    /// Predicted shift over the simulated one, less 1.
    pub fn difference(&self, method: usize) -> Option<f64> {
        self.predicted[method].map(|predicted| predicted / self.simulated - 1.0)
    }
}

/// The shifts of all tests of other than the usual stiffness whose region was also tested with the
/// usual one.
pub fn shifts(resonances: &[Resonance]) -> Vec<Shift> {
    let usual = |region: Region| {
        let mut all = resonances.iter();
        all.find(|found| found.test.region == region && found.test.stiffness == 1.0)
    };
    let changed = resonances
        .iter()
        .filter(|found| found.test.stiffness != 1.0);
    changed
        .filter_map(|found| {
            let usual = usual(found.test.region)?;
            let pairs = found.predicted.iter().zip(&usual.predicted);
            let over = |a: &Ringing, b: &Ringing| a.frequency_hz / b.frequency_hz;
            Some(Shift {
                test: found.test,
                simulated: over(&found.simulated, &usual.simulated),
                resolved: [found, usual]
                    .iter()
                    .all(|found| found.simulated.frequency_hz <= HIGHEST_HZ),
                predicted: pairs
                    .map(|(a, b)| Some(over(a.as_ref()?, b.as_ref()?)))
                    .collect(),
            })
        })
        .collect()
}

/// A body at rest that suddenly moves upwards at constant speed.
fn jerk() -> Clip {
    let pose = |tick: usize| {
        let mut pose = Pose::REST;
        let moving = (tick + 1).saturating_sub(STILL_TICKS) as f64;
        pose.root_translation_m.y += SPEED_M_PER_S * moving / MODEL_RATE_HZ;
        pose
    };
    Clip {
        name: "jerk".into(),
        rate_hz: MODEL_RATE_HZ,
        frames: (0..STILL_TICKS + RINGING_TICKS).map(pose).collect(),
    }
}

fn ringing(model: &BodyModel, vertices: &[u32], region: Region, offsets_m: &[f32]) -> Ringing {
    let weights = &model.region_weights[region as usize];
    let members: Vec<usize> = (0..vertices.len())
        .filter(|slot| weights[vertices[*slot] as usize] > MEMBER_WEIGHT)
        .collect();
    let frames = offsets_m.chunks_exact(3 * vertices.len());
    let trace_m: Vec<f32> = frames
        .skip(STILL_TICKS)
        .map(|frame| mean(members.iter().map(|slot| f64::from(frame[3 * slot + 1]))) as f32)
        .collect();
    Ringing::fit(&trace_m)
}

#[cfg(test)]
mod tests {
    use dynaskin_runtime::features::{FeatureKind, Materials, clip_features};
    use dynaskin_skeleton::GRAVITY_M_S2;

    use super::*;
    use dynaskin_train::fixture;

    #[test]
    fn the_jerk_is_one_tick_of_acceleration() {
        let joints_rest_m = fixture::symmetric_body(2).joint_template_m;
        let kind = FeatureKind::InertialMaterials;
        let shape = [0.0; SHAPE_COUNT];
        let features = clip_features(
            kind,
            &jerk().frames,
            MODEL_RATE_HZ,
            &joints_rest_m,
            &shape,
            &Materials::default(),
        );
        let features = features.expect("features");
        let upwards: Vec<f64> = features
            .chunks_exact(kind.count())
            .map(|frame| f64::from(frame[1]) - GRAVITY_M_S2)
            .collect();
        for (tick, acceleration) in upwards.iter().enumerate() {
            let expected = if tick == STILL_TICKS {
                SPEED_M_PER_S * MODEL_RATE_HZ
            } else {
                0.0
            };
            assert!(
                (acceleration - expected).abs() < 1e-3,
                "{tick}: {acceleration}"
            );
        }
    }

    #[test]
    fn a_region_s_vertical_ringing_is_measured() {
        let model = fixture::symmetric_body(2);
        let vertices = [0, 1, 2, 3];
        let mut offsets_m = vec![0.0f32; 12 * (STILL_TICKS + RINGING_TICKS)];
        for tick in 0..RINGING_TICKS {
            let t = tick as f64 / MODEL_RATE_HZ;
            let y = 0.01 * (-4.0 * t).exp() * (std::f64::consts::TAU * 3.2 * t).sin();
            for slot in 0..4 {
                offsets_m[12 * (STILL_TICKS + tick) + 3 * slot + 1] = y as f32;
            }
        }
        let found = ringing(&model, &vertices, Region::Belly, &offsets_m);
        assert!((found.frequency_hz / 3.2 - 1.0).abs() < 0.01, "{found:?}");
    }
    #[test]
    fn shifts_are_ratios_to_the_usual_tissue_of_the_same_region() {
        let ringing = |frequency_hz: f64| Ringing {
            frequency_hz,
            damping_ratio: 0.2,
            unexplained: 0.0,
        };
        let of = |(region, stiffness, simulated_hz, predicted_hz)| Resonance {
            test: ResonanceTest { region, stiffness },
            simulated: ringing(simulated_hz),
            predicted: vec![None, Some(ringing(predicted_hz))],
        };
        let measured = [
            (Region::Chest, 0.5, 4.0, 3.0),
            (Region::Chest, 1.0, 5.0, 5.0),
            (Region::Belly, 2.0, 9.0, 12.0),
            (Region::Belly, 1.0, 6.0, 8.0),
            (Region::Calves, 1.0, 26.0, 19.0),
            (Region::Calves, 0.5, 17.0, 15.0),
            // Without the usual tissue there is nothing to compare with.
            (Region::Thighs, 2.0, 9.0, 9.0),
        ];
        let shifts = shifts(&measured.map(of));
        assert_eq!(shifts.len(), 3);
        let resolved = shifts.iter().map(|shift| shift.resolved);
        assert!(resolved.eq([true, true, false]), "{shifts:?}");
        assert_eq!(
            (shifts[0].test.region, shifts[0].simulated),
            (Region::Chest, 0.8)
        );
        assert_eq!(shifts[0].predicted, [None, Some(0.6)]);
        let differences = shifts
            .iter()
            .map(|shift| shift.difference(1).unwrap_or(1.0));
        let differences: Vec<f64> = differences.collect();
        assert!((differences[0] + 0.25).abs() < 1e-12 && differences[1].abs() < 1e-12);
        assert_eq!(shifts[0].difference(0), None);
    }

    #[test]
    fn every_region_is_tested_and_the_usual_tissue_is_the_same_for_all() {
        let tests = tests();
        for region in Region::ALL {
            let of_region = tests.iter().filter(|test| test.region == region);
            assert_eq!(of_region.count(), STIFFNESSES.len());
        }
        let usual = tests.iter().filter(|test| test.stiffness == 1.0);
        for test in usual {
            assert_eq!(test.stiffnesses(), [1.0; REGION_COUNT]);
        }
    }
}
