//! Smooth functions of time: quintic pieces that join with equal value, speed and acceleration.

/// Value, first and second derivative at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    pub time: f64,
    pub value: f64,
    pub speed: f64,
    pub acceleration: f64,
}

impl Knot {
    /// At rest at `value`.
    pub const fn still(time: f64, value: f64) -> Self {
        Self {
            time,
            value,
            speed: 0.0,
            acceleration: 0.0,
        }
    }
}

/// A twice continuously differentiable function through knots; constant before the first and after
/// the last.
#[derive(Clone, Debug, Default)]
pub struct Track {
    knots: Vec<Knot>,
}

impl Track {
    /// Through knots in order of time.
    pub fn new(knots: Vec<Knot>) -> Self {
        debug_assert!(knots.windows(2).all(|pair| pair[0].time < pair[1].time));
        Self { knots }
    }

    /// Through values at which it stands still.
    pub fn through(values: &[(f64, f64)]) -> Self {
        Self::new(
            values
                .iter()
                .map(|(time, value)| Knot::still(*time, *value))
                .collect(),
        )
    }

    /// The value at `time`.
    pub fn at(&self, time: f64) -> f64 {
        let after = self.knots.partition_point(|knot| knot.time <= time);
        match (
            after
                .checked_sub(1)
                .and_then(|before| self.knots.get(before)),
            self.knots.get(after),
        ) {
            (Some(from), Some(to)) => quintic(from, to, time),
            (Some(knot), None) | (None, Some(knot)) => knot.value,
            (None, None) => 0.0,
        }
    }
}

/// Quintic Hermite interpolation.
fn quintic(from: &Knot, to: &Knot, time: f64) -> f64 {
    let span = to.time - from.time;
    let s = (time - from.time) / span;
    let (v0, v1) = (from.speed * span, to.speed * span);
    let (a0, a1) = (
        from.acceleration * span * span,
        to.acceleration * span * span,
    );
    let rise = to.value - from.value;
    let c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
    let c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
    let c5 = 6.0 * rise - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1;
    from.value + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
}

/// From 0 to 1 while `s` goes from 0 to 1, with no speed and no acceleration at both ends (the
/// minimum-jerk profile of Flash and Hogan 1985).
pub fn smooth_step(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// Rises from 0 to 1 at `s` = 1/2 and falls to 0 at `s` = 1, twice continuously differentiable.
pub fn bump(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    64.0 * (s * (1.0 - s)).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_meets_its_knots_with_speed_and_acceleration() {
        let knot = Knot {
            time: 1.0,
            value: 2.0,
            speed: -3.0,
            acceleration: 4.0,
        };
        let track = Track::new(vec![Knot::still(0.0, 1.0), knot, Knot::still(1.5, 0.0)]);
        let h = 1e-4;
        for side in [-1.0, 1.0] {
            let [x0, x1, x2] = [0.0, 1.0, 2.0].map(|k| track.at(1.0 + side * k * h));
            assert!((x0 - 2.0).abs() < 1e-12);
            assert!((side * (x1 - x0) / h + 3.0).abs() < 1e-2);
            assert!(((x2 - 2.0 * x1 + x0) / (h * h) - 4.0).abs() < 0.1);
        }
        assert_eq!(track.at(-1.0), 1.0);
        assert_eq!(track.at(9.0), 0.0);
    }
}
