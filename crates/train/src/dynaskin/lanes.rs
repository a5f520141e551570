//! Sequences of frames laid end to end in parallel lanes, and cut into windows.
//!
//! A lane carries the LSTM's state from window to window and forgets it where a new sequence
//! starts, so that every frame is learned from with its whole past (truncated back-propagation
//! through time: the state is carried, its gradient is not).

use burn::tensor::{Device, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::predictor::Window;

/// One clip as the network sees it.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// Normalised motion features, `[frame][motion]` flat.
    pub motion: Vec<f32>,
    /// What the body is like, normalised.
    pub condition: Vec<f32>,
    /// Latents in units of their deviations, `[frame][latent]` flat.
    pub latents: Vec<f32>,
    /// Number of frames.
    pub frames: usize,
}

/// A window and what the network should say about it.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Input.
    pub window: Window,
    /// Latents in units of their deviations, `[frames · lanes, latent]`, time-major.
    pub latents: Tensor<2>,
    /// 1 for frames that count, 0 for those that only fill up a lane, `[frames · lanes]`.
    pub weights: Tensor<1>,
    /// 1 for frames that count and follow the one before them in the window, `[frames · lanes]`.
    pub follows: Tensor<1>,
    /// Number of frames that count.
    pub frames: usize,
}

/// Sequences in lanes.
#[derive(Debug)]
pub struct Lanes<'a> {
    lanes: Vec<Vec<&'a Sequence>>,
    window_frames: usize,
    motion: usize,
    conditions: usize,
    latent: usize,
}

impl<'a> Lanes<'a> {
    /// Lays the sequences into `lanes` lanes, in the order that `seed` shuffles them into, each
    /// into the lane that is shortest so far. `motion` and `latent` are the widths of a frame.
    pub fn new(
        sequences: &'a [Sequence],
        lanes: usize,
        window_frames: usize,
        (motion, latent): (usize, usize),
        seed: u64,
    ) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut order: Vec<&Sequence> = sequences.iter().collect();
        order.shuffle(&mut rng as &mut dyn Rng);
        let mut laid = vec![Vec::new(); lanes.min(sequences.len()).max(1)];
        let mut lengths = vec![0; laid.len()];
        for sequence in order {
            let shortest = (0..laid.len()).min_by_key(|lane| lengths[*lane]);
            let lane = shortest.unwrap_or(0);
            lengths[lane] += sequence.frames;
            laid[lane].push(sequence);
        }
        Self {
            lanes: laid,
            window_frames,
            motion,
            conditions: sequences.first().map_or(0, |s| s.condition.len()),
            latent,
        }
    }

    /// Number of lanes.
    pub fn count(&self) -> usize {
        self.lanes.len()
    }

    /// Number of windows until the longest lane ends.
    pub fn window_count(&self) -> usize {
        let longest = self.lanes.iter().map(|lane| length(lane)).max();
        longest.unwrap_or(0).div_ceil(self.window_frames)
    }

    /// The `index`-th window.
    pub fn window(&self, index: usize, device: &Device) -> Batch {
        let (lanes, frames) = (self.lanes.len(), self.window_frames);
        let rows = lanes * frames;
        let mut motion = vec![0.0; rows * self.motion];
        let conditions = self.conditions;
        let mut condition = vec![0.0; rows * conditions];
        let mut latents = vec![0.0; rows * self.latent];
        let mut weights = vec![0.0f32; rows];
        let mut follows = vec![0.0f32; rows];
        let mut starts = vec![vec![false; lanes]; frames];
        for (lane, sequences) in self.lanes.iter().enumerate() {
            let mut cursor = Cursor::at(sequences, index * frames);
            for (frame, starts) in starts.iter_mut().enumerate() {
                let Some((sequence, source)) = cursor.next() else {
                    break;
                };
                let row = frame * lanes + lane;
                if frame > 0 && source > 0 {
                    follows[row] = 1.0;
                }
                starts[lane] = source == 0;
                weights[row] = 1.0;
                copy_row(&mut motion, row, &sequence.motion, source, self.motion);
                copy_row(&mut latents, row, &sequence.latents, source, self.latent);
                copy_row(&mut condition, row, &sequence.condition, 0, conditions);
            }
        }
        let keep = starts.iter().map(|starts| keep(starts, device)).collect();
        let matrix = |data: Vec<f32>, columns| {
            Tensor::<2>::from_data(TensorData::new(data, [rows, columns]), device)
        };
        Batch {
            frames: weights.iter().filter(|w| **w > 0.0).count(),
            window: Window {
                motion: matrix(motion, self.motion),
                condition: matrix(condition, conditions),
                keep,
                lanes,
            },
            latents: matrix(latents, self.latent),
            weights: Tensor::from_data(TensorData::new(weights, [rows]), device),
            follows: Tensor::from_data(TensorData::new(follows, [rows]), device),
        }
    }
}

fn length(lane: &[&Sequence]) -> usize {
    lane.iter().map(|sequence| sequence.frames).sum()
}

fn copy_row(to: &mut [f32], to_row: usize, from: &[f32], from_row: usize, width: usize) {
    to[to_row * width..(to_row + 1) * width]
        .copy_from_slice(&from[from_row * width..(from_row + 1) * width]);
}

fn keep(starts: &[bool], device: &Device) -> Option<Tensor<2>> {
    starts.contains(&true).then(|| {
        let keep: Vec<f32> = starts.iter().map(|s| if *s { 0.0 } else { 1.0 }).collect();
        Tensor::from_data(TensorData::new(keep, [starts.len(), 1]), device)
    })
}

/// Walks a lane frame by frame.
struct Cursor<'l, 's> {
    lane: &'l [&'s Sequence],
    sequence: usize,
    frame: usize,
}

impl<'l, 's> Cursor<'l, 's> {
    fn at(lane: &'l [&'s Sequence], mut frame: usize) -> Self {
        let mut sequence = 0;
        while sequence < lane.len() && frame >= lane[sequence].frames {
            frame -= lane[sequence].frames;
            sequence += 1;
        }
        Self {
            lane,
            sequence,
            frame,
        }
    }
}

impl<'s> Iterator for Cursor<'_, 's> {
    type Item = (&'s Sequence, usize);

    fn next(&mut self) -> Option<Self::Item> {
        let sequence = *self.lane.get(self.sequence)?;
        let frame = self.frame;
        self.frame += 1;
        if self.frame == sequence.frames {
            self.frame = 0;
            self.sequence += 1;
        }
        Some((sequence, frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sequences whose every number tells its sequence and frame.
    fn sequences(lengths: &[usize]) -> Vec<Sequence> {
        lengths
            .iter()
            .enumerate()
            .map(|(s, frames)| Sequence {
                motion: (0..*frames).map(|f| (100 * s + f) as f32).collect(),
                condition: vec![s as f32; 10],
                latents: (0..*frames).map(|f| -((100 * s + f) as f32)).collect(),
                frames: *frames,
            })
            .collect()
    }

    #[test]
    fn every_frame_comes_once_in_order_and_starts_are_marked() {
        let sequences = sequences(&[7, 3, 12, 5, 1]);
        let device = Device::flex();
        let lanes = Lanes::new(&sequences, 2, 4, (1, 1), 3);
        let mut seen = Vec::new();
        let mut per_lane = vec![Vec::new(); lanes.count()];
        for index in 0..lanes.window_count() {
            let batch = lanes.window(index, &device);
            let motion: Vec<f32> = batch.window.motion.into_data().try_to_vec().expect("f32");
            let latents: Vec<f32> = batch.latents.into_data().try_to_vec().expect("f32");
            let weights: Vec<f32> = batch.weights.into_data().try_to_vec().expect("f32");
            let follows: Vec<f32> = batch.follows.into_data().try_to_vec().expect("f32");
            for (row, weight) in weights.iter().enumerate().filter(|(_, w)| **w == 1.0) {
                assert_eq!(*weight, 1.0);
                let (frame, lane) = (row / lanes.count(), row % lanes.count());
                let start = batch.window.keep[frame].as_ref().is_some_and(|keep| {
                    keep.clone().into_data().try_to_vec::<f32>().expect("f32")[lane] == 0.0
                });
                assert_eq!(start, motion[row] % 100.0 == 0.0);
                assert_eq!(latents[row], -motion[row]);
                assert_eq!(follows[row] == 1.0, frame > 0 && !start);
                if follows[row] == 1.0 {
                    assert_eq!(motion[row], motion[row - lanes.count()] + 1.0);
                }
                seen.push(motion[row] as usize);
                per_lane[lane].push(motion[row]);
            }
        }
        seen.sort_unstable();
        let expected: Vec<usize> = [7, 3, 12, 5, 1]
            .iter()
            .enumerate()
            .flat_map(|(s, frames)| (0..*frames).map(move |f| 100 * s + f))
            .collect();
        assert_eq!(seen, expected);
        for lane in per_lane {
            for pair in lane.windows(2) {
                assert!(pair[1] == pair[0] + 1.0 || pair[1] % 100.0 == 0.0);
            }
        }
    }

    #[test]
    fn the_seed_gives_the_order() {
        let sequences = sequences(&[5, 5, 5, 5, 5, 5]);
        let first = |seed| {
            let lanes = Lanes::new(&sequences, 2, 4, (1, 1), seed);
            let data = lanes.window(0, &Device::flex()).window.motion.into_data();
            data.try_to_vec::<f32>().expect("f32")
        };
        assert_eq!(first(1), first(1));
        assert!((2..9).any(|seed| first(seed) != first(1)));
    }
}
