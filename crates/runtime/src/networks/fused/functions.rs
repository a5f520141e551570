//! The functions that programs know.

use serde::{Deserialize, Serialize};

/// Functions of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Unary {
    Exp,
    Log,
    Sigmoid,
    Tanh,
}

/// Functions of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Binary {
    Add,
    Max,
    Mul,
    Sub,
}
