//! The loops that a run spends its time in: four numbers at once, on WebAssembly's `v128` and its like.
//!
//! All work in one row's memory: what is read lies before what is written. Lists are walked in steps of
//! four, so up to three numbers behind the end of a list are read and written; the memory has room for
//! them.

use wide::bytemuck::cast;
use wide::{f32x4, i32x4};

use super::functions::{Binary, Unary};

/// Numbers that are worked on at once.
pub(super) const LANES: usize = 4;

/// Most columns of a strip: their sums fit into the registers.
pub(super) const MOST_COLUMNS: usize = 24;

/// Writes `first + Σ x[place] · weights` for `4 N` columns to `target`; `weights` has a line of them
/// for each of `places`. `first` is where the columns start from; they start from 0 where it is empty.
#[inline(always)]
fn strip<const N: usize>(
    before: &[f32],
    first: &[f32],
    places: &[u32],
    weights: &[f32],
    target: &mut [f32],
) {
    let mut sums = [f32x4::ZERO; N];
    for (sum, first) in sums.iter_mut().zip(first.as_chunks::<LANES>().0) {
        *sum = f32x4::from(*first);
    }
    let weights = weights.as_chunks::<LANES>().0.as_chunks::<N>().0;
    for (place, weights) in places.iter().zip(weights) {
        let x = f32x4::splat(before[*place as usize]);
        for (sum, weights) in sums.iter_mut().zip(weights) {
            *sum += f32x4::from(*weights) * x;
        }
    }
    for (sum, target) in sums.iter().zip(target.as_chunks_mut::<LANES>().0) {
        *target = sum.to_array();
    }
}

/// As [`strip`] for narrow strips: even and odd rows are added up apart, because each addition would
/// wait for the one before.
#[inline(always)]
fn narrow_strip<const N: usize>(
    before: &[f32],
    first: &[f32],
    places: &[u32],
    weights: &[f32],
    target: &mut [f32],
) {
    let mut even = [f32x4::ZERO; N];
    let mut odd = [f32x4::ZERO; N];
    for (sum, first) in even.iter_mut().zip(first.as_chunks::<LANES>().0) {
        *sum = f32x4::from(*first);
    }
    let weights = weights.as_chunks::<LANES>().0.as_chunks::<N>().0;
    let (pairs, last) = places.as_chunks::<2>();
    let (weight_pairs, last_weights) = weights.as_chunks::<2>();
    for (places, weights) in pairs.iter().zip(weight_pairs) {
        let x = places.map(|place| f32x4::splat(before[place as usize]));
        for n in 0..N {
            even[n] += f32x4::from(weights[0][n]) * x[0];
            odd[n] += f32x4::from(weights[1][n]) * x[1];
        }
    }
    for (place, weights) in last.iter().zip(last_weights) {
        let x = f32x4::splat(before[*place as usize]);
        for n in 0..N {
            even[n] += f32x4::from(weights[n]) * x;
        }
    }
    for (n, target) in target.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        *target = (even[n] + odd[n]).to_array();
    }
}

/// As [`strip`], for `target`s of 4 to 24 columns.
pub(super) fn multiply(
    before: &[f32],
    first: &[f32],
    places: &[u32],
    weights: &[f32],
    target: &mut [f32],
) {
    match target.len() / LANES {
        1 => narrow_strip::<1>(before, first, places, weights, target),
        2 => narrow_strip::<2>(before, first, places, weights, target),
        3 => strip::<3>(before, first, places, weights, target),
        4 => strip::<4>(before, first, places, weights, target),
        5 => strip::<5>(before, first, places, weights, target),
        _ => strip::<6>(before, first, places, weights, target),
    }
}

/// Writes `function` of each of `x` to `target`.
pub(super) fn unary(function: Unary, x: &[f32], target: &mut [f32]) {
    match function {
        Unary::Exp => each(x, target, exp),
        Unary::Sigmoid => each(x, target, sigmoid),
        Unary::Tanh => each(x, target, tanh),
        Unary::Log => {
            for (x, target) in x.iter().zip(target) {
                *target = x.ln();
            }
        }
    }
}

/// Writes `function` of each of `a` and `b` to `target`.
pub(super) fn binary(function: Binary, a: &[f32], b: &[f32], target: &mut [f32]) {
    match function {
        Binary::Add => pairs(a, b, target, |a, b| a + b),
        Binary::Max => pairs(a, b, target, |a, b| a.simd_gt(b).bitselect(a, b)),
        Binary::Mul => pairs(a, b, target, |a, b| a * b),
        Binary::Sub => pairs(a, b, target, |a, b| a - b),
    }
}

#[inline(always)]
fn each(x: &[f32], target: &mut [f32], function: impl Fn(f32x4) -> f32x4) {
    let x = x.as_chunks::<LANES>().0;
    for (x, target) in x.iter().zip(target.as_chunks_mut::<LANES>().0) {
        *target = function(f32x4::from(*x)).to_array();
    }
}

#[inline(always)]
fn pairs(a: &[f32], b: &[f32], target: &mut [f32], function: impl Fn(f32x4, f32x4) -> f32x4) {
    let pairs = a
        .as_chunks::<LANES>()
        .0
        .iter()
        .zip(b.as_chunks::<LANES>().0);
    for ((a, b), target) in pairs.zip(target.as_chunks_mut::<LANES>().0) {
        *target = function(f32x4::from(*a), f32x4::from(*b)).to_array();
    }
}

/// `2^n` and `exp(r) - 1`, where `x = n ln 2 + r` and |r| is at most half of ln 2 (more at the ends).
#[inline(always)]
fn power_and_rest(x: f32x4) -> (f32x4, f32x4) {
    /// Beyond these the result is infinite, or 0 to single precision.
    const LEAST: f32 = -87.0;
    const GREATEST: f32 = 89.0;
    // ln 2 in two parts, of which the first has few digits: its products with n are exact.
    const LN_2_HIGH: f32 = 0.693_359_4;
    const LN_2_LOW: f32 = -2.121_944_4e-4;
    // Comparisons that NaN fails, so that it comes out again.
    let x = x
        .simd_lt(f32x4::splat(LEAST))
        .bitselect(f32x4::splat(LEAST), x);
    let x = x
        .simd_gt(f32x4::splat(GREATEST))
        .bitselect(f32x4::splat(GREATEST), x);
    let n = x * f32x4::splat(std::f32::consts::LOG2_E);
    let n = n
        .simd_gt(f32x4::splat(127.0))
        .bitselect(f32x4::splat(127.0), n);
    // Numbers of this size have no digits behind the point, and end in their whole part's bits.
    let rounding = f32x4::splat(12_582_912.0);
    let shifted = n + rounding;
    let n = shifted - rounding;
    let r = x - n * f32x4::splat(LN_2_HIGH) - n * f32x4::splat(LN_2_LOW);
    // Taylor's series: the first term left out is 5e-9.
    let mut rest = f32x4::splat(1.0 / 5040.0);
    for factor in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0] {
        rest = rest * r + f32x4::splat(factor);
    }
    let exponent = (cast::<f32x4, i32x4>(shifted) + i32x4::splat(127)) << 23;
    (cast(exponent), rest * r)
}

#[inline(always)]
fn exp(x: f32x4) -> f32x4 {
    let (power, rest) = power_and_rest(x);
    power * (f32x4::ONE + rest)
}

#[inline(always)]
fn sigmoid(x: f32x4) -> f32x4 {
    f32x4::ONE / (f32x4::ONE + exp(-x))
}

/// `(exp(2x) - 1) / (exp(2x) + 1)`, the difference without loss of digits near 0.
#[inline(always)]
fn tanh(x: f32x4) -> f32x4 {
    /// From here on the result is 1 to single precision.
    const ONE_FROM: f32 = 10.0;
    let x = x
        .simd_lt(f32x4::splat(-ONE_FROM))
        .bitselect(f32x4::splat(-ONE_FROM), x);
    let x = x
        .simd_gt(f32x4::splat(ONE_FROM))
        .bitselect(f32x4::splat(ONE_FROM), x);
    let (power, rest) = power_and_rest(x + x);
    let less_one = power * rest + (power - f32x4::ONE);
    less_one / (less_one + f32x4::splat(2.0))
}
