//! How well a bundle does on clips it has not learned from, played by the runtime itself.

use dynaskin_body::{BodyModel, Pose, Region};
use dynaskin_motion::MODEL_RATE_HZ;
use dynaskin_sim::ClipData;
use serde::{Deserialize, Serialize};

use crate::player::Player;
use dynaskin_train::Set;
use dynaskin_train::{DataSet, Tissue, TrainError, features_of, motion_of, offsets_of};

/// A vertex belongs to the soft body, or to a region, from this weight on.
const MEMBERSHIP: f32 = 0.5;
/// How long a body stands still in the rest test.
const REST_SECONDS: f64 = 10.0;

/// Mean errors over the frames of a set and some of its vertices, in millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean distance of predicted and true vertex.
    pub error_mm: f64,
    /// The same with no offset at all: mean length of the simulated offsets.
    pub static_mm: f64,
    /// The same with the best latents that the decoder could have been given; none for decoders
    /// that are not linear.
    pub floor_mm: Option<f64>,
    /// `error_mm / static_mm`.
    pub ratio: f64,
}

/// Errors on one set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetReport {
    /// The set.
    pub set: Set,
    /// Clips in it.
    pub clips: usize,
    /// Frames in it.
    pub frames: usize,
    /// Over the soft vertices.
    pub soft: Errors,
    /// Over the vertices of each region that has any, by its name.
    pub regions: Vec<(String, Errors)>,
}

/// What was measured on a bundle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What is meant by the numbers.
    pub metric: String,
    /// Vertices counted as soft.
    pub soft_vertices: usize,
    /// Errors on each test set that has clips.
    pub sets: Vec<SetReport>,
    /// Largest offset in millimetres of a body that stood still in the rest pose for ten seconds
    /// after the held-out clip with the largest offsets.
    pub rest_after_ten_seconds_mm: f64,
}

impl Report {
    /// Error over static on all test sets with unseen motions, frame by frame; none without any.
    pub fn unseen_motion_ratio(&self) -> Option<f64> {
        let unseen = self.sets.iter().filter(|report| {
            matches!(
                report.set,
                Set::UnseenMotion | Set::UnseenSubject | Set::UnseenMotionAndShape
            )
        });
        let (error, still) = unseen.fold((0.0, 0.0), |(error, still), report| {
            let frames = report.frames as f64;
            (
                error + frames * report.soft.error_mm,
                still + frames * report.soft.static_mm,
            )
        });
        (still > 0.0).then(|| error / still)
    }
}

/// Plays every clip of the test sets and measures. `progress` is told the clips done and in all.
///
/// # Errors
/// [`TrainError::Runtime`] where the bundle is refused or a pose is invalid, and what reading a
/// clip can give.
pub fn evaluate(
    player: &mut Player,
    data_set: &DataSet,
    model: &BodyModel,
    mut progress: impl FnMut(usize, usize),
) -> Result<Report, TrainError> {
    let decoder = player.linear_decoder()?;
    let kind = player.feature_kind();
    let sets_of = |set| data_set.of_set(set, Tissue::Usual);
    let all = Set::TEST.into_iter().map(|set| sets_of(set).count()).sum();
    let (mut sets, mut done) = (Vec::new(), 0);
    let mut wildest: Option<(f64, ClipData)> = None;
    for set in Set::TEST {
        let mut sums = Sums::new(data_set.vertices.len());
        for entry in sets_of(set) {
            let clip = data_set.read(entry)?;
            let (motion, truth) = (motion_of(&clip), offsets_of(&clip));
            let predicted = player.play(&features_of(kind, model, &motion, &clip)?)?;
            let floor = decoder.as_ref().map(|decoder| decoder.nearest(&truth));
            sums.add(&truth, &predicted, floor.as_deref());
            let size = mean_length(&truth);
            if wildest.as_ref().is_none_or(|(most, _)| size > *most) {
                wildest = Some((size, clip));
            }
            done += 1;
            progress(done, all);
        }
        if sums.clips > 0 {
            sets.push(sums.report(set, model, &data_set.vertices));
        }
    }
    let rest_after_ten_seconds_mm = match wildest {
        Some((_, clip)) => rest_error_mm(player, model, &clip)?,
        None => 0.0,
    };
    Ok(Report {
        metric: "on clips of the usual tissue: mean distance of predicted and true vertices in millimetres, over the soft \
                 vertices (region weights summing to 0.5 or more) and all frames; static: the \
                 same with no offsets; floor: with the best latents for the decoder; ratio: error \
                 over static"
            .into(),
        soft_vertices: soft_slots(model, &data_set.vertices).len(),
        sets,
        rest_after_ten_seconds_mm,
    })
}

/// Plays the motion of `clip`, then stands in the rest pose; gives the largest offset at the end.
fn rest_error_mm(
    player: &mut Player,
    model: &BodyModel,
    clip: &ClipData,
) -> Result<f64, TrainError> {
    let mut motion = motion_of(clip);
    let still = (REST_SECONDS * MODEL_RATE_HZ) as usize;
    let place = motion.frames.last().map(|pose| pose.root_translation_m);
    let rest = Pose {
        root_translation_m: place.unwrap_or_default(),
        ..Pose::REST
    };
    motion.frames.extend(std::iter::repeat_n(rest, still));
    let predicted = player.play(&features_of(player.feature_kind(), model, &motion, clip)?)?;
    let frame = predicted.len() / motion.frames.len();
    let last = &predicted[predicted.len() - frame..];
    Ok(1000.0 * lengths(last).fold(0.0, f64::max))
}

/// Sums over frames, per vertex.
struct Sums {
    error_m: Vec<f64>,
    static_m: Vec<f64>,
    /// None where the decoder is not linear.
    floor_m: Option<Vec<f64>>,
    frames: usize,
    clips: usize,
}

impl Sums {
    fn new(vertices: usize) -> Self {
        Self {
            error_m: vec![0.0; vertices],
            static_m: vec![0.0; vertices],
            floor_m: Some(vec![0.0; vertices]),
            frames: 0,
            clips: 0,
        }
    }

    /// Adds a clip; all are `[frame][slot][xyz]` in metres.
    fn add(&mut self, truth: &[f32], predicted: &[f32], floor: Option<&[f32]>) {
        let coordinates = 3 * self.error_m.len();
        for (truth, predicted) in truth
            .chunks_exact(coordinates)
            .zip(predicted.chunks_exact(coordinates))
        {
            add_distances(&mut self.error_m, truth, predicted);
            for (sum, length) in self.static_m.iter_mut().zip(lengths(truth)) {
                *sum += length;
            }
            self.frames += 1;
        }
        match (&mut self.floor_m, floor) {
            (Some(sums), Some(floor)) => {
                let frames = truth.chunks_exact(coordinates);
                for (truth, floor) in frames.zip(floor.chunks_exact(coordinates)) {
                    add_distances(sums, truth, floor);
                }
            }
            _ => self.floor_m = None,
        }
        self.clips += 1;
    }

    fn errors(&self, slots: &[usize]) -> Errors {
        let count = (slots.len() * self.frames).max(1) as f64;
        let mean_mm =
            |sums: &[f64]| 1000.0 * slots.iter().map(|slot| sums[*slot]).sum::<f64>() / count;
        let (error_mm, static_mm) = (mean_mm(&self.error_m), mean_mm(&self.static_m));
        Errors {
            error_mm,
            static_mm,
            floor_mm: self.floor_m.as_deref().map(mean_mm),
            ratio: error_mm / static_mm.max(f64::MIN_POSITIVE),
        }
    }

    fn report(&self, set: Set, model: &BodyModel, vertices: &[u32]) -> SetReport {
        let regions = Region::ALL.into_iter().filter_map(|region| {
            let slots = region_slots(model, vertices, region);
            (!slots.is_empty()).then(|| (region.name().to_owned(), self.errors(&slots)))
        });
        SetReport {
            set,
            clips: self.clips,
            frames: self.frames,
            soft: self.errors(&soft_slots(model, vertices)),
            regions: regions.collect(),
        }
    }
}

/// Adds the distances of two frames' vertices to sums, slot by slot.
fn add_distances(sums: &mut [f64], a: &[f32], b: &[f32]) {
    for (slot, sum) in sums.iter_mut().enumerate() {
        let at = |field: &[f32]| [0, 1, 2].map(|axis| f64::from(field[3 * slot + axis]));
        *sum += distance(at(a), at(b));
    }
}

/// Slots of the vertex list that are soft.
pub(crate) fn soft_slots(model: &BodyModel, vertices: &[u32]) -> Vec<usize> {
    slots(vertices, |vertex| model.softness(vertex))
}

/// Slots of the vertex list that belong to a region.
pub(crate) fn region_slots(model: &BodyModel, vertices: &[u32], region: Region) -> Vec<usize> {
    match model.region_weights.get(region as usize) {
        Some(weights) => slots(vertices, |vertex| weights[vertex]),
        None => Vec::new(),
    }
}

fn slots(vertices: &[u32], weight: impl Fn(usize) -> f32) -> Vec<usize> {
    (0..vertices.len())
        .filter(|slot| weight(vertices[*slot] as usize) >= MEMBERSHIP)
        .collect()
}

/// Distance of two points.
pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square: f64 = (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum();
    square.sqrt()
}

fn lengths(field: &[f32]) -> impl Iterator<Item = f64> {
    field
        .chunks_exact(3)
        .map(|v| distance([0, 1, 2].map(|axis| f64::from(v[axis])), [0.0; 3]))
}

fn mean_length(field: &[f32]) -> f64 {
    lengths(field).sum::<f64>() / (field.len() / 3).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::LinearDecoder;
    use dynaskin_train::fixture;

    #[test]
    fn errors_are_means_over_frames_and_vertices() {
        let model = fixture::symmetric_body(2);
        let vertices = [0, 1, 2, 3];
        let mut sums = Sums::new(4);
        // Two frames: offsets of 2 mm along x, predicted as 1 mm; the floor has 3 mm along y.
        let truth = [[0.002, 0.0, 0.0]; 8].concat();
        let predicted = [[0.001, 0.0, 0.0]; 8].concat();
        let floor = [[0.002, 0.003, 0.0]; 8].concat();
        sums.add(&truth, &predicted, Some(&floor));
        let report = sums.report(Set::UnseenMotion, &model, &vertices);
        assert_eq!((report.clips, report.frames), (1, 2));
        for errors in [report.soft, report.regions[0].1] {
            assert!((errors.error_mm - 1.0).abs() < 1e-4, "{errors:?}");
            assert!((errors.static_mm - 2.0).abs() < 1e-4, "{errors:?}");
            assert!(
                (errors.floor_mm.unwrap_or(0.0) - 3.0).abs() < 1e-4,
                "{errors:?}"
            );
            assert!((errors.ratio - 0.5).abs() < 1e-4, "{errors:?}");
        }
        assert_eq!(report.regions.len(), 1);
        assert_eq!(report.regions[0].0, "belly");
    }

    #[test]
    fn the_floor_keeps_what_the_decoder_can_give() {
        // Latents move coordinate 0, and coordinates 1 and 2 together.
        let decoder = LinearDecoder::new(vec![2.0, 0.0, 0.0, 0.0, 1.0, 1.0], 2);
        let nearest = decoder.nearest(&[5.0, 3.0, 1.0]);
        for (got, expected) in nearest.iter().zip([5.0, 2.0, 2.0]) {
            assert!((got - expected).abs() < 1e-5, "{nearest:?}");
        }
    }
}
