//! Convolutions along one axis, as the decoder of DSNet has them: `Conv` and `ConvTranspose`.

use tract_core::internal::AxisOp;
use tract_core::ops::cnn::{Conv, Deconv, KernelFormat, PaddingSpec, PoolSpec};
use tract_core::ops::nn::DataFormat;
use tract_core::prelude::*;

use super::ReadError;
use super::operators::{Node, Wire};

/// Largest kernel, stride, dilation and padding: far above what a network has, far below what
/// overflows.
const MAX_STEP: i64 = 1 << 16;

/// Attributes of both operators, for one axis.
struct Geometry {
    kernel: usize,
    stride: usize,
    dilation: usize,
    before: usize,
    after: usize,
}

impl Geometry {
    /// Cells from the first to the last tap of the kernel.
    fn reach(&self) -> usize {
        self.dilation * (self.kernel - 1) + 1
    }

    fn pool(&self, inputs: usize, outputs: usize) -> PoolSpec {
        PoolSpec::new(
            DataFormat::NCHW,
            tvec!(self.kernel),
            PaddingSpec::Explicit(tvec!(self.before), tvec!(self.after)),
            Some(tvec!(self.dilation)),
            Some(tvec!(self.stride)),
            inputs,
            outputs,
        )
    }
}

impl Node<'_> {
    /// `x` [N, C, L] with weights [M, C, K] and biases [M]: [N, M, L'] with
    /// `L' = (L + before + after - reach) / stride + 1`.
    pub fn conv(&mut self) -> Result<(), ReadError> {
        self.attributes(&["dilations", "group", "kernel_shape", "pads", "strides"])?;
        let (x, weights) = self.convolved()?;
        let (rows, channels, length) = (x.shape[0], x.shape[1], x.shape[2]);
        let (outputs, kernel) = (weights.shape[0], weights.shape[2]);
        if weights.shape[1] != channels {
            return Err(self.mismatch(&x, &weights, "[M, C, K]"));
        }
        let geometry = self.geometry(kernel)?;
        let padded = length + geometry.before + geometry.after;
        let Some(room) = padded.checked_sub(geometry.reach()) else {
            let problem = format!(
                "its kernel reaches over {} cells, its padded input has {padded}",
                geometry.reach()
            );
            return Err(self.problem(problem));
        };
        let shape = vec![rows, outputs, room / geometry.stride + 1];
        let place = self.place.clone();
        let taps = channels.saturating_mul(kernel);
        self.translation
            .spend(&place, [rows.saturating_mul(shape[2]), outputs, taps])?;
        let bias = self.bias(outputs)?;
        let op = Conv {
            pool_spec: geometry.pool(channels, outputs),
            kernel_fmt: KernelFormat::OIHW,
            group: 1,
            q_params: None,
        };
        self.push(op, &[x.outlet, weights.outlet, bias], shape)
    }

    /// `x` [N, C, L] with weights [C, M, K] and biases [M]: [N, M, L'] with
    /// `L' = (L - 1) · stride + reach - before - after + output padding`.
    pub fn conv_transpose(&mut self) -> Result<(), ReadError> {
        let known = ["dilations", "group", "kernel_shape", "output_padding"];
        self.attributes(&[&known[..], &["pads", "strides"]].concat())?;
        let (x, weights) = self.convolved()?;
        let (rows, channels, length) = (x.shape[0], x.shape[1], x.shape[2]);
        let (outputs, kernel) = (weights.shape[1], weights.shape[2]);
        if weights.shape[0] != channels {
            return Err(self.mismatch(&x, &weights, "[C, M, K]"));
        }
        let geometry = self.geometry(kernel)?;
        let more = self.steps("output_padding", 0, 0)?;
        if more > 0 && more >= geometry.stride {
            let problem = format!("its output_padding {more} is not below its stride");
            return Err(self.problem(problem));
        }
        let whole = (length - 1) * geometry.stride + geometry.reach() + more;
        let cut = geometry.before + geometry.after;
        let shape = match whole.checked_sub(cut) {
            Some(length) if length > 0 => vec![rows, outputs, length],
            _ => {
                let problem = format!("its pads cut {cut} cells from an output of {whole}");
                return Err(self.problem(problem));
            }
        };
        let place = self.place.clone();
        let taps = outputs.saturating_mul(kernel);
        self.translation
            .spend(&place, [rows.saturating_mul(length), channels, taps])?;
        // Every tap's product is laid down before they are summed.
        self.translation
            .put_out(&place, rows.saturating_mul(length).saturating_mul(taps))?;
        let bias = self.bias(outputs)?;
        let turned = self.translation.model.wire_node(
            format!("{place}.weights"),
            AxisOp::Move(0, 1),
            &[weights.outlet],
        );
        let turned = turned.map_err(|error| self.translation.refused(&error))?[0];
        let op = Deconv::new(
            geometry.pool(channels, outputs),
            KernelFormat::OIHW,
            tvec!(more),
            1,
        );
        self.push(op, &[x.outlet, turned, bias], shape)
    }

    /// The input and the weights, both with three axes.
    fn convolved(&mut self) -> Result<(Wire, Wire), ReadError> {
        self.arity(if self.proto.input.len() == 2 { 2 } else { 3 }, 1)?;
        let (x, weights) = (self.input(0)?, self.input(1)?);
        if x.shape.len() != 3 || weights.shape.len() != 3 {
            return Err(self.mismatch(&x, &weights, "three axes"));
        }
        Ok((x, weights))
    }

    fn mismatch(&self, x: &Wire, weights: &Wire, expected: &str) -> ReadError {
        self.problem(format!(
            "its input is {:?} and its weights are {:?}, expected [N, C, L] and {expected}",
            x.shape, weights.shape
        ))
    }

    fn geometry(&self, kernel: usize) -> Result<Geometry, ReadError> {
        if self.integer("group", 1)? != 1 {
            return Err(self.problem("its group is not 1"));
        }
        if self.steps("kernel_shape", kernel, 1)? != kernel {
            return Err(self.problem(format!("its weights have {kernel} taps")));
        }
        let pads = self.attribute("pads").map_or(&[0, 0][..], |a| &a.ints);
        let &[before, after] = pads else {
            return Err(self.problem(format!("its pads are {pads:?}, expected two numbers")));
        };
        Ok(Geometry {
            kernel,
            stride: self.steps("strides", 1, 1)?,
            dilation: self.steps("dilations", 1, 1)?,
            before: self.step("pads", before, 0)?,
            after: self.step("pads", after, 0)?,
        })
    }

    /// The one number, `least` or more, of the attribute `name`.
    fn steps(&self, name: &str, default: usize, least: i64) -> Result<usize, ReadError> {
        match self.attribute(name) {
            None => Ok(default),
            Some(attribute) => match attribute.ints[..] {
                [number] => self.step(name, number, least),
                _ => Err(self.problem(format!(
                    "its {name} are {:?}, expected one number",
                    attribute.ints
                ))),
            },
        }
    }

    fn step(&self, name: &str, number: i64, least: i64) -> Result<usize, ReadError> {
        usize::try_from(number)
            .ok()
            .filter(|_| (least..=MAX_STEP).contains(&number))
            .ok_or_else(|| {
                self.problem(format!(
                    "its {name} has {number}, expected {least} to {MAX_STEP}"
                ))
            })
    }

    /// The biases [M]; zeros where the node has none.
    fn bias(&mut self, outputs: usize) -> Result<OutletId, ReadError> {
        if self.proto.input.len() == 3 {
            let bias = self.input(2)?;
            return match bias.shape[..] {
                [length] if length == outputs => Ok(bias.outlet),
                _ => Err(self.problem(format!(
                    "its biases are {:?}, expected [{outputs}]",
                    bias.shape
                ))),
            };
        }
        let name = format!("{}.zeros", self.place);
        let zeros = tensor1(&vec![0.0_f32; outputs]);
        let zeros = self.translation.model.add_const(name, zeros);
        zeros.map_err(|error| self.translation.refused(&error))
    }
}
