//! Errors of every method on every held-out clip.

use dynaskin_body::BodyModel;

use super::contestant::{Contestant, mean};
use super::groups::{Groups, Movers, SOFT, group_names};
use super::signals::SignalSums;
use super::spectra::{Lag, Spectrum};
use dynaskin_train::{DataSet, Set, TrainError, motion_of, offsets_of};

/// How per-frame errors are spread over the frames of a set, in millimetres. Frames that a method
/// fails at, because what it gives is no number, count as infinitely wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Mean over frames.
    pub mean_mm: f64,
    /// Standard deviation over frames.
    pub deviation_mm: f64,
    /// Quartiles over frames: a quarter, half and three quarters of the frames lie below.
    pub quartiles_mm: [f64; 3],
    /// Frames that the method failed at.
    pub failed: usize,
}

impl Spread {
    fn of(mut per_frame_mm: Vec<f32>) -> Self {
        if per_frame_mm.is_empty() {
            return Self::default();
        }
        per_frame_mm.sort_by(f32::total_cmp);
        let failed = per_frame_mm.iter().filter(|x| !x.is_finite()).count();
        let values = || per_frame_mm.iter().map(|x| f64::from(*x));
        let mean_mm = mean(values());
        let last = (per_frame_mm.len() - 1) as f64;
        let at = |share: f64| f64::from(per_frame_mm[(share * last).round() as usize]);
        Self {
            mean_mm,
            deviation_mm: match failed {
                0 => mean(values().map(|x| (x - mean_mm).powi(2))).sqrt(),
                _ => f64::INFINITY,
            },
            quartiles_mm: [at(0.25), at(0.5), at(0.75)],
            failed,
        }
    }
}

/// An error, infinite where it is no number.
fn judged(error_mm: f32) -> f32 {
    if error_mm.is_nan() {
        f32::INFINITY
    } else {
        error_mm
    }
}

/// All methods on one set.
#[derive(Clone, Debug)]
pub struct SetComparison {
    /// The set.
    pub set: Set,
    /// Clips in it.
    pub clips: usize,
    /// Frames in it.
    pub frames: usize,
    /// `[method][group]`, in the order of the contestants and of [`group_names`].
    pub errors: Vec<Vec<Spread>>,
}

impl SetComparison {
    /// Error over that of the first method, which should be the static one.
    pub fn ratio(&self, method: usize, group: usize) -> f64 {
        let still = self.errors[0][group].mean_mm;
        self.errors[method][group].mean_mm / still.max(f64::MIN_POSITIVE)
    }
}

/// All methods on one clip.
#[derive(Clone, Debug)]
pub struct ClipErrors {
    /// The clip's name: `one-leg-hop-190-060__s0`.
    pub name: String,
    /// Its place in [`DataSet::clips`].
    pub index: usize,
    /// Its set.
    pub set: Set,
    /// Its length.
    pub frames: usize,
    /// Mean error over the soft vertices in millimetres, one a method.
    pub soft_mm: Vec<f64>,
    /// The frame with the largest offsets, and their mean length in millimetres.
    pub wildest: (usize, f64),
}

/// All methods on all test sets.
pub struct Comparison {
    /// The sets that have clips.
    pub sets: Vec<SetComparison>,
    /// The clips, set by set.
    pub clips: Vec<ClipErrors>,
    /// Spectra of the error of each region's mean offset over all sets with unseen motions,
    /// `[method][signal]`; the static one's error is the truth.
    pub error_spectra: Vec<Vec<Spectrum>>,
    /// How late predictions come in those sets, `[method][signal]`.
    pub lags: Vec<Vec<Lag>>,
}

/// Plays every test clip of the usual tissue to all `contestants`, the first of which should be
/// [`Contestant::still`]. `progress` is told the clips done and in all.
///
/// # Errors
/// [`TrainError::EmptySplit`] where no test set has a clip; [`TrainError::Runtime`], and what
/// reading a clip can give.
pub fn compare(
    contestants: &mut [Contestant],
    data_set: &DataSet,
    model: &BodyModel,
    mut progress: impl FnMut(usize, usize),
) -> Result<Comparison, TrainError> {
    let of_set = |set: Set| {
        let clips = data_set.clips.iter().enumerate();
        clips.filter(move |(_, clip)| clip.set == set && clip.usual_tissue)
    };
    let all: usize = Set::TEST.into_iter().map(|set| of_set(set).count()).sum();
    if all == 0 {
        return Err(TrainError::EmptySplit {
            set: "testing",
            clips: data_set.clips.len(),
        });
    }
    let groups = Groups::new(model, &data_set.vertices);
    let movers = Movers::new(model, &data_set.vertices);
    let coordinates = 3 * data_set.vertices.len();
    let mut signals = SignalSums::new(contestants.len(), &movers);
    let (mut sets, mut clips) = (Vec::new(), Vec::new());
    for set in Set::TEST {
        let mut per_frame = vec![vec![Vec::new(); group_names().len()]; contestants.len()];
        let first = clips.len();
        for (index, entry) in of_set(set) {
            let clip = data_set.read(entry)?;
            let (motion, truth) = (motion_of(&clip), offsets_of(&clip));
            let moved = movers.signals_mm(&truth, coordinates);
            let mut soft_mm = Vec::new();
            let mut wildest = (0, 0.0);
            for (method, contestant) in contestants.iter_mut().enumerate() {
                let predicted = contestant.predict(model, &motion, &clip)?;
                let frames = truth.chunks_exact(coordinates);
                let mut sum = 0.0;
                for (frame, (truth, predicted)) in
                    frames.zip(predicted.chunks_exact(coordinates)).enumerate()
                {
                    let errors_mm = groups.errors_mm(truth, predicted);
                    let soft = f64::from(judged(errors_mm[SOFT]));
                    sum += soft;
                    if method == 0 && soft > wildest.1 {
                        wildest = (frame, soft);
                    }
                    for (group, error_mm) in errors_mm.into_iter().enumerate() {
                        if groups.has_vertices(group) {
                            per_frame[method][group].push(judged(error_mm));
                        }
                    }
                }
                soft_mm.push(sum / clip.frame_count() as f64);
                if set != Set::UnseenShape {
                    let predicted = movers.signals_mm(&predicted, coordinates);
                    signals.add(method, &moved, &predicted);
                }
            }
            clips.push(ClipErrors {
                name: clip.name,
                index,
                set,
                frames: motion.frames.len(),
                soft_mm,
                wildest,
            });
            progress(clips.len(), all);
        }
        let of_this = &clips[first..];
        if of_this.is_empty() {
            continue;
        }
        let spreads = |groups: Vec<Vec<f32>>| groups.into_iter().map(Spread::of).collect();
        sets.push(SetComparison {
            set,
            clips: of_this.len(),
            frames: of_this.iter().map(|clip| clip.frames).sum(),
            errors: per_frame.into_iter().map(spreads).collect(),
        });
    }
    Ok(Comparison {
        sets,
        clips,
        error_spectra: signals.errors,
        lags: signals.lags,
    })
}

impl Comparison {
    /// The clip with the largest offsets among those with motions not trained on, or among all.
    pub fn wildest(&self) -> Option<&ClipErrors> {
        let largest = |unseen: bool| {
            let clips = self.clips.iter();
            clips
                .filter(|clip| !unseen || clip.set != Set::UnseenShape)
                .max_by(|a, b| a.wildest.1.total_cmp(&b.wildest.1))
        };
        largest(true).or_else(|| largest(false))
    }

    /// The clips of a trial that was not learned from.
    pub fn clips_of<'a>(
        &'a self,
        data_set: &'a DataSet,
        trial: &'a str,
    ) -> impl Iterator<Item = &'a ClipErrors> {
        self.clips.iter().filter(move |clip| {
            clip.set != Set::UnseenShape && data_set.clips[clip.index].name.trial == trial
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_tells_mean_deviation_and_quartiles() {
        let spread = Spread::of(vec![4.0, 0.0, 1.0, 3.0, 2.0]);
        assert_eq!(spread.mean_mm, 2.0);
        assert!((spread.deviation_mm - 2f64.sqrt()).abs() < 1e-9);
        assert_eq!(spread.quartiles_mm, [1.0, 2.0, 3.0]);
        assert_eq!(spread.failed, 0);
        assert_eq!(Spread::of(Vec::new()), Spread::default());
    }

    #[test]
    fn frames_without_a_number_count_as_infinitely_wrong() {
        let errors_mm = [4.0, f32::NAN, 0.0, -f32::NAN, 1.0].map(judged);
        let spread = Spread::of(errors_mm.to_vec());
        assert_eq!(spread.failed, 2);
        assert_eq!(
            (spread.mean_mm, spread.deviation_mm),
            (f64::INFINITY, f64::INFINITY)
        );
        assert_eq!(spread.quartiles_mm, [1.0, 4.0, f64::INFINITY]);
        let still = Spread::of(vec![2.0; 5]);
        let set = SetComparison {
            set: Set::UnseenMotion,
            clips: 1,
            frames: 5,
            errors: vec![vec![still], vec![spread]],
        };
        assert_eq!(set.ratio(1, 0), f64::INFINITY);
    }
}
