//! Convolutions along one axis.

use super::graph::mismatch;
use super::{Graph, Value, WriteError, proto};
use crate::messages::Attribute;

/// How the kernel of a convolution walks along its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Cells between two places of the kernel; 1 or more.
    pub stride: usize,
    /// Zeros put before and after the axis (`conv1d`), or cells cut from both ends of the result
    /// (`conv_transpose1d`).
    pub padding: usize,
    /// Cells put after the result of `conv_transpose1d`, fewer than `stride`: which of the lengths
    /// that a strided convolution makes equally short is meant.
    pub output_padding: usize,
}

impl Steps {
    fn attributes(self, kernel: usize) -> Vec<Attribute> {
        vec![
            proto::ints_attribute("kernel_shape", &[kernel]),
            proto::ints_attribute("strides", &[self.stride]),
            proto::ints_attribute("pads", &[self.padding, self.padding]),
        ]
    }
}

impl Graph {
    /// Convolution (ONNX `Conv`) of `x` [N, inputs, L] with `weights` [outputs, inputs, K] and
    /// `bias` `[outputs]`; gives [N, outputs, (L + 2 · padding - K) / stride + 1].
    ///
    /// # Errors
    /// [`WriteError::Shape`], also for a kernel longer than the padded axis and for an
    /// `output_padding`, which this operator does not have.
    pub fn conv1d(
        &mut self,
        x: &Value,
        weights: &Value,
        bias: &Value,
        steps: Steps,
    ) -> Result<Value, WriteError> {
        if let (&[n, inputs, length], &[outputs, channels, kernel], &[biases]) =
            (x.shape(), weights.shape(), bias.shape())
            && channels == inputs
            && biases == outputs
            && steps.output_padding == 0
            && let Some(room) = (length + 2 * steps.padding).checked_sub(kernel)
            && let Some(places) = room.checked_div(steps.stride)
        {
            let shape = vec![n, outputs, places + 1];
            return Ok(self.apply("Conv", &[x, weights, bias], shape, steps.attributes(kernel)));
        }
        let expected =
            format!("[N, inputs, L], [outputs, inputs, K] and [outputs] that fit {steps:?}");
        Err(mismatch("Conv", &expected, &[x, weights, bias]))
    }

    /// Transposed convolution (ONNX `ConvTranspose`) of `x` [N, inputs, L] with `weights`
    /// [inputs, outputs, K] and `bias` `[outputs]`; gives
    /// [N, outputs, (L - 1) · stride + K - 2 · padding + output_padding].
    ///
    /// # Errors
    /// [`WriteError::Shape`], also where nothing is left after the padding is cut, and for an
    /// `output_padding` not below `stride`.
    pub fn conv_transpose1d(
        &mut self,
        x: &Value,
        weights: &Value,
        bias: &Value,
        steps: Steps,
    ) -> Result<Value, WriteError> {
        if let (&[n, inputs, length], &[channels, outputs, kernel], &[biases]) =
            (x.shape(), weights.shape(), bias.shape())
            && channels == inputs
            && biases == outputs
            && steps.output_padding < steps.stride
            && length > 0
            && let whole = (length - 1) * steps.stride + kernel + steps.output_padding
            && whole > 2 * steps.padding
        {
            let shape = vec![n, outputs, whole - 2 * steps.padding];
            let mut attributes = steps.attributes(kernel);
            let more = proto::ints_attribute("output_padding", &[steps.output_padding]);
            attributes.push(more);
            return Ok(self.apply("ConvTranspose", &[x, weights, bias], shape, attributes));
        }
        let expected =
            format!("[N, inputs, L], [inputs, outputs, K] and [outputs] that fit {steps:?}");
        Err(mismatch("ConvTranspose", &expected, &[x, weights, bias]))
    }
}
