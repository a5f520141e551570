//! Where the predictor's weights may differ from 0, and how left and right are tied.

use burn::module::Param;
use burn::tensor::{Device, Int, Tensor, TensorData};

use super::locality::{Locality, Units, same_block};
use super::predictor::PredictorSizes;
use super::symmetry::SignedPermutation;

/// Ones where a unit may be connected to another ([`Locality`]), as long and wide as the weights are. They do not
/// change, so they lie on the network's device from the start, without gradients.
#[derive(Clone, Debug)]
pub(super) struct Masks {
    pub encoder: Mask,
    pub drive: Mask,
    pub poles: Mask,
    pub mode_scale: Mask,
    pub code: Mask,
    pub from_code: Mask,
    pub from_condition: Mask,
    pub from_hidden: Mask,
    pub readout: Mask,
    pub poles_bias: Option<Tie>,
    pub bias: Option<Tie>,
}

/// The mask of one matrix of weights, and its mirror image.
#[derive(Clone, Debug)]
pub(super) struct Mask {
    ones: Tensor<2>,
    /// Numbers of the matrix.
    all: usize,
    /// Those of them that are 1.
    connected: usize,
    tie: Option<Tie>,
}

/// How a matrix or vector of weights is tied to its mirror image.
#[derive(Clone, Debug)]
pub(super) struct Tie {
    rows: Tensor<1, Int>,
    columns: Tensor<1, Int>,
    /// Half the product of the signs of row and column, one where neither changes.
    half_signs: Tensor<2>,
}

impl Tie {
    fn new(rows: &SignedPermutation, columns: &SignedPermutation, device: &Device) -> Self {
        let device = &device.clone().inner();
        let places = |of: &SignedPermutation| {
            let places: Vec<i32> = of.partner.iter().map(|place| *place as i32).collect();
            Tensor::from_data(TensorData::new(places, [of.count()]), device)
        };
        let row_signs = rows.sign.iter();
        let half_signs =
            row_signs.flat_map(|row| columns.sign.iter().map(move |sign| 0.5 * row * sign));
        let half_signs = TensorData::new(
            half_signs.collect::<Vec<f32>>(),
            [rows.count(), columns.count()],
        );
        Self {
            rows: places(rows),
            columns: places(columns),
            half_signs: Tensor::from_data(half_signs, device),
        }
    }

    /// The mean of `weights` and their mirror image.
    fn apply(&self, weights: Tensor<2>) -> Tensor<2> {
        let mirrored = weights.clone().select(0, self.rows.clone());
        let mirrored = mirrored.select(1, self.columns.clone()) * self.half_signs.clone();
        weights * 0.5 + mirrored
    }
}

impl Mask {
    /// From ones and zeros, row by row, for weights of so many rows.
    fn new(ones: Vec<f32>, rows: usize, device: &Device) -> Self {
        let (all, connected) = (ones.len(), ones.iter().filter(|one| **one != 0.0).count());
        let ones = TensorData::new(ones, [rows, all / rows.max(1)]);
        Self {
            ones: Tensor::from_data(ones, &device.clone().inner()),
            all,
            connected,
            tie: None,
        }
    }

    /// `weights` with zeros where the mask has them, and tied to their mirror image.
    pub fn apply(&self, weights: &Param<Tensor<2>>) -> Tensor<2> {
        let connected = weights.val() * self.ones.clone();
        match &self.tie {
            Some(tie) => tie.apply(connected),
            None => connected,
        }
    }

    /// Factor on the initial weights of a unit with fewer connections, which keeps its output's variance.
    pub fn gain(&self) -> f64 {
        (self.all as f64 / f64::from((self.connected as f32).max(1.0))).sqrt()
    }
}

impl Masks {
    /// Of a predictor of these sizes on `device`.
    pub fn new(sizes: PredictorSizes, locality: &Locality, device: &Device) -> Self {
        let tied = locality.mirror.as_ref();
        let encoding = locality.units(sizes.encoding);
        let springs = locality.units(sizes.springs);
        let hidden = locality.units(sizes.hidden);
        let latents = locality.latent_blocks();
        let modes = springs.blocks.repeat(2);
        let gates = hidden.blocks.repeat(3);
        let (motion, conditions) = (sizes.motion, sizes.conditions);
        let mirror = |units: &Units| {
            let identity = || SignedPermutation::identity(units.blocks.len());
            units.mirror.clone().unwrap_or_else(identity)
        };
        let of_encoding = mirror(&encoding);
        let of_springs = mirror(&springs);
        let of_modes = of_springs.repeat(2);
        let of_poles = of_modes.unsigned();
        let of_hidden = mirror(&hidden);
        let of_gates = of_hidden.unsigned().repeat(3);
        let of_conditions = SignedPermutation::identity(conditions);
        let identity = |count: usize| SignedPermutation::identity(count);
        let of_motion = tied.map_or_else(|| identity(motion), |tied| tied.motion.clone());
        let of_latents = tied.map_or_else(|| identity(sizes.latent), |tied| tied.latents.clone());
        let mask = |ones: Vec<f32>, rows: &[&SignedPermutation], columns: &SignedPermutation| {
            let rows = SignedPermutation::concat(rows);
            let mut mask = Mask::new(ones, rows.count(), device);
            mask.tie = tied.map(|_| Tie::new(&rows, columns, device));
            mask
        };
        let bias = |columns: &SignedPermutation| {
            tied.map(|_| Tie::new(&SignedPermutation::identity(1), columns, device))
        };
        let (encoding, springs, hidden) = (&encoding.blocks, &springs.blocks, &hidden.blocks);
        Self {
            encoder: mask(locality.motion_mask(encoding), &[&of_motion], &of_encoding),
            drive: mask(
                [locality.motion_mask(springs), same_block(encoding, springs)].concat(),
                &[&of_motion, &of_encoding],
                &of_springs,
            ),
            poles: mask(
                [
                    locality.condition_mask(&modes),
                    same_block(encoding, &modes),
                ]
                .concat(),
                &[&of_conditions, &of_encoding],
                &of_poles,
            ),
            poles_bias: bias(&of_poles),
            mode_scale: mask(
                locality.condition_mask(&modes),
                &[&of_conditions],
                &of_poles,
            ),
            code: mask(
                [
                    locality.neighbour_mask(&modes, encoding),
                    locality.neighbour_mask(encoding, encoding),
                ]
                .concat(),
                &[&of_modes, &of_encoding],
                &of_encoding,
            ),
            from_code: mask(
                same_block(encoding, &hidden.repeat(4)),
                &[&of_encoding],
                &SignedPermutation::concat(&[&of_gates, &of_hidden]),
            ),
            from_condition: mask(
                locality.condition_mask(&gates),
                &[&of_conditions],
                &of_gates,
            ),
            bias: bias(&of_gates),
            from_hidden: mask(same_block(hidden, &gates), &[&of_hidden], &of_gates),
            readout: mask(
                same_block(
                    &[modes.as_slice(), hidden, encoding, encoding].concat(),
                    &latents,
                ),
                &[&of_modes, &of_hidden, &of_encoding, &of_encoding],
                &of_latents,
            ),
        }
    }

    /// Number of weights that stay 0.
    pub fn silent(&self) -> usize {
        let masks = [
            &self.encoder,
            &self.drive,
            &self.poles,
            &self.mode_scale,
            &self.code,
            &self.from_code,
            &self.from_condition,
            &self.from_hidden,
            &self.readout,
        ];
        masks
            .into_iter()
            .map(|mask| mask.all - mask.connected)
            .sum()
    }
}

/// `weights` tied to their mirror image, where they are.
pub(super) fn tied_vector(weights: &Param<Tensor<1>>, tie: Option<&Tie>) -> Tensor<1> {
    match tie {
        Some(tie) => tie
            .apply(weights.val().unsqueeze::<2>())
            .squeeze_dim::<1>(0),
        None => weights.val(),
    }
}
