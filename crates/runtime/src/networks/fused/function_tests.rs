//! Functions of numbers, four at once, beside those of the standard library.

use std::ops::Range;

use super::functions::{Binary, Unary};
use super::{kernels, reference};

/// `function` of numbers from `range`.
fn sweep(function: Unary, range: Range<f32>) -> impl Iterator<Item = (f32, f32)> {
    let x: Vec<f32> = (0..40_000)
        .map(|step| range.start + (range.end - range.start) * step as f32 / 40_000.0)
        .collect();
    let mut values = vec![0.0; x.len()];
    kernels::unary(function, &x, &mut values);
    x.into_iter().zip(values)
}

#[test]
fn functions_are_right_to_single_precision() {
    for (function, range) in [
        (Unary::Exp, -87.0..88.6),
        (Unary::Exp, -1.0..1.0),
        (Unary::Sigmoid, -80.0..80.0),
        (Unary::Sigmoid, -4.0..4.0),
        (Unary::Tanh, -12.0..12.0),
        (Unary::Tanh, -1e-3..1e-3),
        (Unary::Log, 1e-6..3.0),
    ] {
        for (x, got) in sweep(function, range.clone()) {
            let exact = match function {
                Unary::Exp => f64::from(x).exp(),
                Unary::Log => f64::from(x).ln(),
                Unary::Sigmoid => 1.0 / (1.0 + (-f64::from(x)).exp()),
                Unary::Tanh => f64::from(x).tanh(),
            };
            let error = (f64::from(got) - exact).abs();
            assert!(
                error <= 4e-7 * exact.abs() + 1e-37,
                "{function:?} {x}: {got}, exactly {exact}"
            );
        }
    }
}

#[test]
fn zero_stays_zero_and_what_is_no_number_stays_none() {
    let of = |function: Unary, x: f32| {
        let mut target = [1.0; 4];
        kernels::unary(function, &[x; 4], &mut target);
        target[0]
    };
    assert_eq!(of(Unary::Tanh, 0.0), 0.0);
    assert_eq!(of(Unary::Exp, 0.0), 1.0);
    assert_eq!(of(Unary::Sigmoid, 0.0), 0.5);
    assert_eq!(of(Unary::Exp, 90.0), f32::INFINITY);
    assert_eq!(of(Unary::Tanh, f32::INFINITY), 1.0);
    assert_eq!(of(Unary::Tanh, f32::NEG_INFINITY), -1.0);
    assert_eq!(of(Unary::Sigmoid, f32::NEG_INFINITY), 0.0);
    for function in [Unary::Exp, Unary::Log, Unary::Sigmoid, Unary::Tanh] {
        assert!(of(function, f32::NAN).is_nan(), "{function:?}");
    }
}

#[test]
fn pairs_are_as_the_reference() {
    let a = [1.0, -2.0, 0.5, 0.0, 3.5, -0.25, 8.0, -8.0];
    let b = [0.5, -3.0, 0.5, -1.0, 4.0, 0.25, -8.0, 8.0];
    for function in [Binary::Add, Binary::Max, Binary::Mul, Binary::Sub] {
        let mut target = [0.0; 8];
        kernels::binary(function, &a, &b, &mut target);
        for index in 0..8 {
            assert_eq!(
                target[index],
                reference::binary(function, a[index], b[index])
            );
        }
    }
    assert_eq!(reference::unary(Unary::Tanh, 0.0), 0.0);
}
