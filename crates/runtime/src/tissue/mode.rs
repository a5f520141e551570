//! How a region of soft tissue swings by itself.

use dynaskin_skeleton::MODEL_RATE_HZ;

/// How a region swings by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mode {
    /// ω in rad/s.
    pub frequency_rad_s: f64,
    /// ζ: 1 is critically damped.
    pub damping_ratio: f64,
}

impl Mode {
    /// Soft tissue of no particular kind, where a region does not swing visibly: 4 Hz, a quarter of
    /// critical damping.
    pub const TYPICAL: Self = Self {
        frequency_rad_s: 4.0 * std::f64::consts::TAU,
        damping_ratio: 0.25,
    };

    /// The mode of tissue stiffer and more damped by the given factors.
    pub fn of_material(self, stiffness: f32, damping: f32) -> Self {
        Self {
            frequency_rad_s: self.frequency_rad_s * f64::from(stiffness).sqrt(),
            damping_ratio: self.damping_ratio * f64::from(damping),
        }
    }

    /// The mode of a free decay `u_t = a1 u_{t-1} + a2 u_{t-2}` at the model's rate.
    fn of_decay(a1: f64, a2: f64) -> Option<Self> {
        let discriminant = a1 * a1 / 4.0 + a2;
        // ln z of the two poles: their mean and half their difference.
        let (mean, split_squared) = if discriminant < 0.0 {
            let angle = (-discriminant).sqrt().atan2(a1 / 2.0);
            (0.5 * (-a2).ln(), -angle * angle)
        } else {
            let (fast, slow) = (
                a1 / 2.0 - discriminant.sqrt(),
                a1 / 2.0 + discriminant.sqrt(),
            );
            if fast <= 0.0 {
                return None;
            }
            let half = 0.5 * (slow.ln() - fast.ln());
            (0.5 * (slow.ln() + fast.ln()), half * half)
        };
        let squared = mean * mean - split_squared;
        if !(squared.is_finite() && squared > 0.0 && mean < 0.0) {
            return None;
        }
        let frequency_rad_s = squared.sqrt() * MODEL_RATE_HZ;
        let damping_ratio = -mean / squared.sqrt();
        let hertz = frequency_rad_s / std::f64::consts::TAU;
        let plausible = (1.0..=15.0).contains(&hertz) && (0.02..=2.0).contains(&damping_ratio);
        plausible.then_some(Self {
            frequency_rad_s,
            damping_ratio,
        })
    }

    /// `1 - p1 z⁻¹ - p2 z⁻²` with this mode's poles.
    pub fn recursion(self) -> (f64, f64) {
        let decay = self.damping_ratio * self.frequency_rad_s / MODEL_RATE_HZ;
        let split = 1.0 - self.damping_ratio * self.damping_ratio;
        let turn = self.frequency_rad_s / MODEL_RATE_HZ * split.abs().sqrt();
        let shrink = (-decay).exp();
        if split >= 0.0 {
            // Beyond half the rate, frequencies would alias down again.
            (2.0 * shrink * turn.min(2.8).cos(), -shrink * shrink)
        } else {
            let (fast, slow) = ((-decay - turn).exp(), (-decay + turn).exp());
            (fast + slow, -fast * slow)
        }
    }
}

/// Least squares for `u_t = a1 u_{t-1} + a2 u_{t-2}`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fit {
    s11: f64,
    s12: f64,
    s22: f64,
    r1: f64,
    r2: f64,
}

impl Fit {
    pub fn add(&mut self, now: f64, before: f64, earlier: f64) {
        self.s11 += before * before;
        self.s12 += before * earlier;
        self.s22 += earlier * earlier;
        self.r1 += now * before;
        self.r2 += now * earlier;
    }

    pub fn mode(&self) -> Option<Mode> {
        let determinant = self.s11 * self.s22 - self.s12 * self.s12;
        let solvable = determinant > 1e-9 * self.s11 * self.s22;
        if !solvable {
            return None;
        }
        let a1 = (self.r1 * self.s22 - self.r2 * self.s12) / determinant;
        let a2 = (self.r2 * self.s11 - self.r1 * self.s12) / determinant;
        Mode::of_decay(a1, a2)
    }
}
