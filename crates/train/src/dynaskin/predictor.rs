//! The network that turns features into latents, one tick after the other.
//!
//! Soft tissue that moves a little is a sum of damped oscillations, each driven by the inertial
//! forces in the bones' frames (modal analysis); what is left after that is what a general network
//! has to learn. So the predictor is a **bank of damped springs**, whose drives, stiffnesses and
//! dampings are learned and depend on the body's shape. An **LSTM** follows (Hochreiter and
//! Schmidhuber 1997, as in DSNet, Seo, Zou, Cordier 2021, section 5). It is connected to the
//! springs and adds what is not linear: tissue stiffens with strain. One linear layer reads the
//! latents off both, and off the LSTM's input, which tells what is not linear and has no memory.
//!
//! Per tick, with x the normalised motion and β what the body is like ([`super::PredictorInputs`]):
//!
//! ```text
//! e = tanh(x E)                             encoding
//! k = 2 σ(K0 + [β, e] K),  d = σ(D0 + [β, e] D)
//! v' = v - d v + k ([x, e] U - q)           each spring is pulled to where its drive points
//! q' = q + v'
//! m = [q', v'] exp(β G)                     modes, scaled by shape: a power of the thickness
//! c = tanh([m, e] C)
//! i, o, f = σ([c, β, h] W + bias)           the LSTM's gates
//! cell' = f cell + i tanh(c W),  h' = o tanh(cell')
//! latent = [m, h', e, c] R
//! ```
//!
//! **Left and right are tied** where the body is symmetric ([`super::SignedPermutation`]): every matrix is the mean
//! of itself and its mirror image, so a mirrored motion gives mirrored latents by construction.
//!
//! Every unit belongs to a block of the body, and all weights are zero between different blocks
//! ([`crate::Locality`]) but for those of C, which also connect neighbouring blocks.
//!
//! With fixed k and d a spring is stable for 0 < k < 4 - 2 d, which the ranges of k and d grant; k
//! in 0..2 reaches 15 Hz and beyond at 60 ticks a second.
//!
//! **A body at rest settles to zero by construction.** Nothing between motion and latent has a
//! bias: biases and the body's shape act only where they multiply, on stiffness, damping, scale and
//! the LSTM's gates. With zero motion features the springs swing out; then nothing is written to
//! the cells any more, and they decay by their forget gates. For that the cell candidate must not
//! see the hidden state, as it does in a plain LSTM: such a loop was found to hold itself up at 5 mm
//! of offset in a body standing still.

use burn::module::{Module, Param};
use burn::nn::Initializer;
use burn::tensor::{Device, Tensor, TensorData, activation};

use super::locality::Locality;
use super::masks::{Masks, tied_vector};

/// Frames are cut from a window in two stages of about this many, because the gradient of a cut is
/// as large as what it was cut from.
const BLOCK_FRAMES: usize = 10;

/// The springs of a block start at these frequencies in hertz, evenly spread in pitch, and with this
/// damping ratio: the range and the middle of measured soft tissue.
const LOWEST_HZ: f32 = 1.5;
const HIGHEST_HZ: f32 = 14.0;
const DAMPING_RATIO: f32 = 0.25;

/// Sizes of a predictor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PredictorSizes {
    /// Features of the motion.
    pub motion: usize,
    /// Features of the body.
    pub conditions: usize,
    /// Width of the encoding, and of the LSTM's input.
    pub encoding: usize,
    /// Springs.
    pub springs: usize,
    /// Cells of the LSTM.
    pub hidden: usize,
    /// Latents.
    pub latent: usize,
}

/// The trainable part of the predictor; it works on normalised features and gives latents in
/// units of their deviations.
#[derive(Module, Debug)]
pub struct Predictor {
    /// E: `[motion, encoding]`.
    pub encoder: Param<Tensor<2>>,
    /// U: `[motion + encoding, springs]`.
    pub drive: Param<Tensor<2>>,
    /// K and D: `[conditions + encoding, 2 · springs]`, stiffness then damping.
    pub poles: Param<Tensor<2>>,
    /// K0 and D0: `[2 · springs]`.
    pub poles_bias: Param<Tensor<1>>,
    /// G: `[conditions, 2 · springs]`.
    pub mode_scale: Param<Tensor<2>>,
    /// C: `[2 · springs + encoding, encoding]`.
    pub code: Param<Tensor<2>>,
    /// `[encoding, 4 · hidden]`: gates input, output, forget, then the cell candidate.
    pub from_code: Param<Tensor<2>>,
    /// `[conditions, 3 · hidden]`: the gates only.
    pub from_condition: Param<Tensor<2>>,
    /// `[3 · hidden]`: the gates only.
    pub bias: Param<Tensor<1>>,
    /// `[hidden, 3 · hidden]`: the gates only.
    pub from_hidden: Param<Tensor<2>>,
    /// R: `[2 · springs + hidden + 2 · encoding, latent]`.
    pub readout: Param<Tensor<2>>,
    /// Where the weights may differ from 0.
    #[module(skip)]
    masks: Masks,
}

/// The state of a batch of lanes. Zero is the state at rest.
#[derive(Clone, Debug)]
pub struct PredictorState {
    /// q: `[lanes, springs]`.
    pub position: Tensor<2>,
    /// v: `[lanes, springs]`.
    pub velocity: Tensor<2>,
    /// h: `[lanes, hidden]`.
    pub hidden: Tensor<2>,
    /// The LSTM's cells: `[lanes, hidden]`.
    pub cell: Tensor<2>,
}

/// A window of frames in several lanes, time-major.
#[derive(Clone, Debug)]
pub struct Window {
    /// Normalised motion features, `[frames · lanes, motion]`.
    pub motion: Tensor<2>,
    /// What the bodies are like, normalised, `[frames · lanes, conditions]`.
    pub condition: Tensor<2>,
    /// For each frame: none where every lane goes on, else `[lanes, 1]` with 0 for the lanes
    /// where a new sequence starts and 1 for the others.
    pub keep: Vec<Option<Tensor<2>>>,
    /// Number of lanes.
    pub lanes: usize,
}

impl PredictorState {
    fn map(self, f: impl Fn(Tensor<2>) -> Tensor<2>) -> Self {
        Self {
            position: f(self.position),
            velocity: f(self.velocity),
            hidden: f(self.hidden),
            cell: f(self.cell),
        }
    }

    /// The same numbers, cut off from the gradient (truncated back-propagation through time).
    pub fn detached(self) -> Self {
        self.map(Tensor::detach)
    }
}

impl Predictor {
    /// Random weights; seed the device first. The latents are those of `locality`.
    pub fn new(sizes: PredictorSizes, locality: &Locality, device: &Device) -> Self {
        let masks = Masks::new(sizes, locality, device);
        let PredictorSizes {
            motion,
            conditions,
            encoding,
            springs,
            hidden,
            latent,
        } = sizes;
        // The mean of two independent weights has half their variance.
        let tied = if locality.mirror.is_some() {
            2f64.sqrt()
        } else {
            1.0
        };
        let random = |inputs: usize, outputs: usize, fan_out: usize, gain: f64| {
            let gain = tied * gain;
            Initializer::XavierUniform { gain }.init_with(
                [inputs, outputs],
                Some(inputs),
                Some(fan_out),
                device,
            )
        };
        // Forget gates near 0.88: a memory of about eight ticks.
        let mut bias = vec![0.0f32; 3 * hidden];
        bias[2 * hidden..].fill(2.0);
        let vector = |numbers: Vec<f32>| {
            let length = numbers.len();
            Param::from_data(TensorData::new(numbers, [length]), device)
        };
        let modes = 2 * springs;
        Self {
            encoder: random(motion, encoding, encoding, masks.encoder.gain()),
            drive: random(motion + encoding, springs, springs, masks.drive.gain()),
            poles: random(conditions + encoding, modes, springs, 0.2),
            poles_bias: vector(first_poles(&locality.units(springs).blocks)),
            mode_scale: random(conditions, modes, springs, 0.3),
            code: random(modes + encoding, encoding, encoding, masks.code.gain()),
            // One gate's fan, not four: each gate is a layer of its own.
            from_code: random(encoding, 4 * hidden, hidden, masks.from_code.gain()),
            from_condition: random(conditions, 3 * hidden, hidden, 0.5),
            bias: vector(bias),
            from_hidden: random(hidden, 3 * hidden, hidden, masks.from_hidden.gain()),
            readout: random(modes + hidden + 2 * encoding, latent, latent, 0.5),
            masks,
        }
    }

    /// Sizes of the network.
    pub fn sizes(&self) -> PredictorSizes {
        let [motion, encoding] = self.encoder.val().dims();
        let [hidden, _] = self.from_hidden.val().dims();
        let [_, springs] = self.drive.val().dims();
        let [conditions, _] = self.from_condition.val().dims();
        let [_, latent] = self.readout.val().dims();
        PredictorSizes {
            motion,
            conditions,
            encoding,
            springs,
            hidden,
            latent,
        }
    }

    /// Number of trained weights.
    pub fn weight_count(&self) -> usize {
        self.num_params() - self.masks.silent()
    }

    /// E, with zeros where a unit is not connected to a feature.
    pub fn local_encoder(&self) -> Tensor<2> {
        self.masks.encoder.apply(&self.encoder)
    }

    /// U, with zeros where a spring is not connected to a drive.
    pub fn local_drive(&self) -> Tensor<2> {
        self.masks.drive.apply(&self.drive)
    }

    /// K and D, with zeros where a spring is not connected to an encoding or a number about the body.
    pub fn local_poles(&self) -> Tensor<2> {
        self.masks.poles.apply(&self.poles)
    }

    /// K0 and D0, left and right tied.
    pub fn tied_poles_bias(&self) -> Tensor<1> {
        tied_vector(&self.poles_bias, self.masks.poles_bias.as_ref())
    }

    /// The gates' biases, left and right tied.
    pub fn tied_bias(&self) -> Tensor<1> {
        tied_vector(&self.bias, self.masks.bias.as_ref())
    }

    /// G, with zeros where a spring is not conditioned on a number about the body.
    pub fn local_mode_scale(&self) -> Tensor<2> {
        self.masks.mode_scale.apply(&self.mode_scale)
    }

    /// C, with zeros where a code is not connected to a spring or an encoding.
    pub fn local_code(&self) -> Tensor<2> {
        self.masks.code.apply(&self.code)
    }

    /// From the code to gates and cells, with zeros between blocks.
    pub fn local_from_code(&self) -> Tensor<2> {
        self.masks.from_code.apply(&self.from_code)
    }

    /// From the cells' outputs to the gates, with zeros between blocks.
    pub fn local_from_hidden(&self) -> Tensor<2> {
        self.masks.from_hidden.apply(&self.from_hidden)
    }

    /// From the numbers about the body to the gates.
    pub fn local_from_condition(&self) -> Tensor<2> {
        self.masks.from_condition.apply(&self.from_condition)
    }

    /// R, with zeros where a latent is not connected to a spring or an encoding.
    pub fn local_readout(&self) -> Tensor<2> {
        self.masks.readout.apply(&self.readout)
    }

    /// The state at rest of a number of lanes.
    pub fn rest_state(&self, lanes: usize, device: &Device) -> PredictorState {
        let sizes = self.sizes();
        let springs = Tensor::zeros([lanes, sizes.springs], device);
        let hidden = Tensor::zeros([lanes, sizes.hidden], device);
        PredictorState {
            position: springs.clone(),
            velocity: springs,
            hidden: hidden.clone(),
            cell: hidden,
        }
    }

    /// Latents of a window, in units of their deviations, and the state after it.
    ///
    /// # Shapes
    /// Gives `[frames · lanes, latent]`, time-major.
    pub fn forward(&self, window: &Window, state: PredictorState) -> (Tensor<2>, PredictorState) {
        let motion = window.motion.clone();
        let encoding = motion.clone().matmul(self.local_encoder()).tanh();
        let (modes, position, velocity) = self.swing(window, motion, &encoding, &state);
        let code = Tensor::cat(vec![modes.clone(), encoding.clone()], 1);
        let code = code.matmul(self.local_code()).tanh();
        let (outputs, hidden, cell) = self.remember(window, code.clone(), &state);
        let read = Tensor::cat(vec![modes, outputs, encoding, code], 1);
        let latents = read.matmul(self.local_readout());
        let state = PredictorState {
            position,
            velocity,
            hidden,
            cell,
        };
        (latents, state)
    }

    /// The springs: scaled modes `[frames · lanes, 2 · springs]` and the last q and v.
    fn swing(
        &self,
        window: &Window,
        motion: Tensor<2>,
        encoding: &Tensor<2>,
        state: &PredictorState,
    ) -> (Tensor<2>, Tensor<2>, Tensor<2>) {
        let springs = self.sizes().springs;
        let condition = &window.condition;
        let poles = Tensor::cat(vec![condition.clone(), encoding.clone()], 1);
        let poles = poles.matmul(self.local_poles()) + self.tied_poles_bias().unsqueeze::<2>();
        let poles = activation::sigmoid(poles);
        let stiffness = poles.clone().narrow(1, 0, springs) * 2.0;
        let retained = 1.0 - poles.narrow(1, springs, springs);
        let drive = Tensor::cat(vec![motion, encoding.clone()], 1).matmul(self.local_drive());
        let pull = stiffness.clone() * drive;

        let mut position = state.position.clone();
        let mut velocity = state.velocity.clone();
        let (mut positions, mut velocities) = (Vec::new(), Vec::new());
        let ticks = ticks(stiffness, window.lanes)
            .zip(ticks(retained, window.lanes))
            .zip(ticks(pull, window.lanes));
        for (((stiffness, retained), pull), keep) in ticks.zip(&window.keep) {
            if let Some(keep) = keep {
                position = position * keep.clone();
                velocity = velocity * keep.clone();
            }
            velocity = retained * velocity + (pull - stiffness * position.clone());
            position = position + velocity.clone();
            positions.push(position.clone());
            velocities.push(velocity.clone());
        }
        let modes = Tensor::cat(
            vec![Tensor::cat(positions, 0), Tensor::cat(velocities, 0)],
            1,
        );
        let scale = condition.clone().matmul(self.local_mode_scale()).exp();
        (modes * scale, position, velocity)
    }

    /// The LSTM: its outputs `[frames · lanes, hidden]`, and the last h and cells.
    fn remember(
        &self,
        window: &Window,
        code: Tensor<2>,
        state: &PredictorState,
    ) -> (Tensor<2>, Tensor<2>, Tensor<2>) {
        let cells = self.sizes().hidden;
        let device = code.device();
        // The cell candidate (the last quarter) gets neither condition nor bias.
        let nothing = Tensor::zeros([self.sizes().conditions, cells], &device);
        let from_condition = Tensor::cat(vec![self.local_from_condition(), nothing], 1);
        let bias = Tensor::cat(vec![self.tied_bias(), Tensor::zeros([cells], &device)], 0);
        let from_input = code.matmul(self.local_from_code())
            + window.condition.clone().matmul(from_condition)
            + bias.unsqueeze::<2>(); // [frames · lanes, 4 · hidden]
        let from_hidden = self.local_from_hidden();

        let (mut hidden, mut cell) = (state.hidden.clone(), state.cell.clone());
        let mut outputs = Vec::new();
        for (from_input, keep) in ticks(from_input, window.lanes).zip(&window.keep) {
            if let Some(keep) = keep {
                hidden = hidden * keep.clone();
                cell = cell * keep.clone();
            }
            let from_gates = from_input.clone().narrow(1, 0, 3 * cells);
            let gates = activation::sigmoid(from_gates + hidden.matmul(from_hidden.clone()));
            let candidate = from_input.narrow(1, 3 * cells, cells).tanh();
            let written = gates.clone().narrow(1, 0, cells) * candidate;
            cell = gates.clone().narrow(1, 2 * cells, cells) * cell + written;
            hidden = gates.narrow(1, cells, cells) * cell.clone().tanh();
            outputs.push(hidden.clone());
        }
        (Tensor::cat(outputs, 0), hidden, cell)
    }
}

/// Cuts `[frames · lanes, width]` into one piece a frame.
fn ticks(window: Tensor<2>, lanes: usize) -> impl Iterator<Item = Tensor<2>> {
    let blocks = window.split(BLOCK_FRAMES * lanes, 0).into_iter();
    blocks.flat_map(move |block| block.split(lanes, 0))
}

/// Biases that give the springs their first frequencies and dampings, from the block of each spring.
/// A spring with poles exp(-ζω ± iω) a tick has d = 1 - exp(-2 ζω) and k = 2 - d - 2 √(1 - d) cos ω.
fn first_poles(springs: &[usize]) -> Vec<f32> {
    let logit = |share: f32| (share / (1.0 - share)).ln();
    let poles = springs.iter().enumerate().map(|(spring, block)| {
        let before = springs[..spring].iter().filter(|b| *b == block).count();
        let together = springs.iter().filter(|b| *b == block).count();
        let pitch = before as f32 / (together - 1).max(1) as f32;
        let hertz = LOWEST_HZ * (HIGHEST_HZ / LOWEST_HZ).powf(pitch);
        let omega = std::f32::consts::TAU * hertz / 60.0;
        let damping = 1.0 - (-2.0 * DAMPING_RATIO * omega).exp();
        let stiffness = 2.0 - damping - 2.0 * (1.0 - damping).sqrt() * omega.cos();
        (logit(0.5 * stiffness), logit(damping))
    });
    let (mut stiffness, damping): (Vec<f32>, Vec<f32>) = poles.unzip();
    stiffness.extend(damping);
    stiffness
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::dynaskin::locality::LocalityMirror;
    use crate::dynaskin::symmetry::SignedPermutation;

    const FRAMES: usize = 9;

    /// Left, middle and right; five numbers about the motion, two about the body.
    fn tied() -> Locality {
        let (yes, no) = (true, false);
        let locality = Locality {
            motion_inputs: vec![
                vec![yes, no, no, yes, no],
                vec![yes; 5],
                vec![no, yes, no, no, no],
            ],
            condition_inputs: vec![vec![yes; 2]; 3],
            near: vec![vec![yes, yes, no], vec![yes; 3], vec![no, yes, yes]],
            latents: vec![2, 3, 2],
            mirror: None,
        };
        locality.tied(LocalityMirror {
            blocks: vec![2, 1, 0],
            motion: SignedPermutation {
                partner: vec![1, 0, 2, 4, 3],
                sign: vec![1.0, 1.0, -1.0, -1.0, -1.0],
            },
            latents: SignedPermutation {
                partner: vec![5, 6, 2, 3, 4, 0, 1],
                sign: vec![1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0],
            },
        })
    }

    fn mirrored(numbers: &[f32], by: &SignedPermutation) -> Vec<f32> {
        let rows = numbers.chunks_exact(by.count());
        rows.flat_map(|row| {
            by.partner
                .iter()
                .zip(&by.sign)
                .map(|(p, sign)| sign * row[*p])
        })
        .collect()
    }

    #[test]
    fn a_mirrored_motion_gives_mirrored_latents() {
        let locality = tied();
        let mirror = locality.mirror.clone().expect("tied");
        let sizes = PredictorSizes {
            motion: 5,
            conditions: 2,
            encoding: 12,
            springs: 11,
            hidden: 9,
            latent: 7,
        };
        let device = Device::flex();
        device.seed(3);
        let mut predictor = Predictor::new(sizes, &locality, &device);
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut numbers = |count: usize| -> Vec<f32> {
            (0..count).map(|_| rng.random_range(-1.5..1.5)).collect()
        };
        // Biases that training has moved apart.
        let vector = |numbers: Vec<f32>| {
            let length = numbers.len();
            Param::from_data(TensorData::new(numbers, [length]), &device)
        };
        predictor.poles_bias = vector(numbers(22));
        predictor.bias = vector(numbers(27));
        let condition = numbers(2).repeat(FRAMES);
        let motion = numbers(5 * FRAMES);
        let latents = |motion: &[f32]| -> Vec<f32> {
            let matrix = |numbers: &[f32]| {
                let shape = [FRAMES, numbers.len() / FRAMES];
                Tensor::<2>::from_data(TensorData::new(numbers.to_vec(), shape), &device)
            };
            let window = Window {
                motion: matrix(motion),
                condition: matrix(&condition),
                keep: vec![None; FRAMES],
                lanes: 1,
            };
            let (latents, _) = predictor.forward(&window, predictor.rest_state(1, &device));
            latents.into_data().iter::<f32>().collect()
        };
        let plain = latents(&motion);
        let expected = mirrored(&plain, &mirror.latents);
        let got = latents(&mirrored(&motion, &mirror.motion));
        let largest = expected.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        let differ = plain
            .iter()
            .zip(&expected)
            .any(|(a, b)| (a - b).abs() > 0.1 * largest);
        assert!(largest > 0.05 && differ, "{largest}");
        for (got, expected) in got.iter().zip(&expected) {
            assert!(
                (got - expected).abs() < 1e-5 * largest.max(1.0),
                "{got} {expected}"
            );
        }
    }
}
