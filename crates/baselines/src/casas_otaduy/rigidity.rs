//! How rigid a vertex is, from the training data (Eq. 7).

/// Sums over frames, per vertex.
#[derive(Clone, Debug)]
pub(super) struct Rigidity {
    squares: Vec<f64>,
}

impl Rigidity {
    /// For `vertices` vertices.
    pub fn new(vertices: usize) -> Self {
        Self {
            squares: vec![0.0; vertices],
        }
    }

    /// Adds a clip, `[frame][vertex][xyz]` flat, in metres.
    pub fn add(&mut self, offsets_m: &[f32]) {
        let coordinates = 3 * self.squares.len();
        let frames: Vec<&[f32]> = offsets_m.chunks_exact(coordinates).collect();
        for window in frames.windows(3) {
            let numbers = window[0].iter().zip(window[1]).zip(window[2]);
            for (at, ((earlier, before), newest)) in numbers.enumerate() {
                // The difference of two velocities, a tick being the unit of time.
                let change = newest - 2.0 * before + earlier;
                self.squares[at / 3] += f64::from(change).powi(2);
            }
        }
    }

    /// w of each vertex: the mean squared difference of its velocities at neighbouring frames,
    /// over the mean of all vertices (which also takes out the number of frames), so that weights
    /// leave the size of a loss as it is. All 1
    /// where nothing moves.
    pub fn weights(&self) -> Vec<f32> {
        let mean = self.squares.iter().sum::<f64>() / self.squares.len().max(1) as f64;
        if mean == 0.0 {
            return vec![1.0; self.squares.len()];
        }
        self.squares
            .iter()
            .map(|square| (square / mean) as f32)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_that_swings_twice_as_far_weighs_four_times_as_much() {
        let mut rigidity = Rigidity::new(3);
        let frames: Vec<f32> = (0..60)
            .flat_map(|frame| {
                let swing = (frame as f32 * 0.4).sin();
                // The third moves steadily: no change of velocity.
                let steady = 0.001 * frame as f32;
                [
                    0.01 * swing,
                    0.0,
                    0.0,
                    0.0,
                    0.02 * swing,
                    0.0,
                    0.0,
                    0.0,
                    steady,
                ]
            })
            .collect();
        rigidity.add(&frames);
        let weights = rigidity.weights();
        assert!((weights[1] / weights[0] - 4.0).abs() < 1e-3, "{weights:?}");
        assert!(weights[2] < 1e-6, "{weights:?}");
        assert!(
            (weights.iter().sum::<f32>() - 3.0).abs() < 1e-4,
            "{weights:?}"
        );
    }

    #[test]
    fn vertices_that_never_move_weigh_alike() {
        let mut rigidity = Rigidity::new(2);
        rigidity.add(&[0.0; 30]);
        assert_eq!(rigidity.weights(), [1.0, 1.0]);
    }
}
