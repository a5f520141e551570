//! One step of the recurrent cells, from elementary operations.
//!
//! Elementary operations instead of ONNX's `LSTM` and `GRU`: those loop over a time axis of one,
//! and need sequence and direction axes around every tensor.

use super::{Graph, Value, WriteError};

/// Weights of an LSTM cell with `inputs` inputs and `cells` cells. Gates lie side by side in the
/// order input, output, forget, cell (ONNX's `iofc`).
#[derive(Clone, Copy, Debug)]
pub struct LstmWeights<'a> {
    /// [inputs, 4 · cells].
    pub from_input: &'a Value,
    /// [cells, 4 · cells].
    pub from_hidden: &'a Value,
    /// [4 · cells]: the sum of the two biases that some libraries keep apart.
    pub bias: &'a Value,
}

/// Weights of a GRU cell with `inputs` inputs and `cells` cells. Gates lie side by side in the
/// order update, reset, hidden (ONNX's `zrh`).
#[derive(Clone, Copy, Debug)]
pub struct GruWeights<'a> {
    /// [inputs, 3 · cells].
    pub from_input: &'a Value,
    /// [cells, 3 · cells].
    pub from_hidden: &'a Value,
    /// [3 · cells], added to the product with the input.
    pub input_bias: &'a Value,
    /// [3 · cells], added to the product with the hidden state; kept apart because the reset gate
    /// multiplies its last third.
    pub hidden_bias: &'a Value,
}

impl Graph {
    /// One step of an LSTM (Hochreiter and Schmidhuber 1997, with forget gates, Gers et al. 2000):
    /// `x` [N, inputs], `hidden` and `cell` [N, cells]; gives the next hidden and cell states.
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn lstm_cell(
        &mut self,
        x: &Value,
        hidden: &Value,
        cell: &Value,
        weights: LstmWeights<'_>,
    ) -> Result<(Value, Value), WriteError> {
        let cells = cell.shape().last().copied().unwrap_or(0);
        let from_input = self.dense(x, weights.from_input, weights.bias)?;
        let from_hidden = self.matmul(hidden, weights.from_hidden)?;
        let sum = self.add(&from_input, &from_hidden)?;
        // One sigmoid over the three gates that take one.
        let parts = self.split(&sum, 1, &[3 * cells, cells])?;
        let gates = self.sigmoid(&parts[0]);
        let gates = self.split(&gates, 1, &[cells, cells, cells])?;
        let candidate = self.tanh(&parts[1]);
        let written = self.mul(&gates[0], &candidate)?;
        let kept = self.mul(&gates[2], cell)?;
        let next_cell = self.add(&kept, &written)?;
        let squashed = self.tanh(&next_cell);
        let next_hidden = self.mul(&gates[1], &squashed)?;
        Ok((next_hidden, next_cell))
    }

    /// One step of a GRU (Cho et al. 2014, in the variant that resets after the product, ONNX's
    /// `linear_before_reset = 1`): `x` [N, inputs], `hidden` [N, cells]; gives the next hidden
    /// state `n + z · (h - n)`.
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn gru_cell(
        &mut self,
        x: &Value,
        hidden: &Value,
        weights: GruWeights<'_>,
    ) -> Result<Value, WriteError> {
        let cells = hidden.shape().last().copied().unwrap_or(0);
        let from_input = self.dense(x, weights.from_input, weights.input_bias)?;
        let from_hidden = self.dense(hidden, weights.from_hidden, weights.hidden_bias)?;
        let input_parts = self.split(&from_input, 1, &[2 * cells, cells])?;
        let hidden_parts = self.split(&from_hidden, 1, &[2 * cells, cells])?;
        let gates = self.add(&input_parts[0], &hidden_parts[0])?;
        let gates = self.sigmoid(&gates);
        let gates = self.split(&gates, 1, &[cells, cells])?;
        let reset = self.mul(&gates[1], &hidden_parts[1])?;
        let candidate = self.add(&input_parts[1], &reset)?;
        let candidate = self.tanh(&candidate);
        let difference = self.sub(hidden, &candidate)?;
        let kept = self.mul(&gates[0], &difference)?;
        self.add(&candidate, &kept)
    }
}
