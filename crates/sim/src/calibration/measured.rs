//! Measurements of real bodies.

use dynaskin_body::Region;

/// What a figure is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Frequency of free vibration, in hertz.
    FrequencyHz,
    /// Damping ratio of free vibration.
    DampingRatio,
    /// Vertical peak to peak in running, in metres.
    RunningVerticalM,
    /// Sum of the three axes' peak to peak in running, in metres.
    RunningTotalM,
    /// Sum of the three axes' peak to peak in walking, in metres.
    WalkingTotalM,
    /// Vertical peak to peak in hopping, in metres.
    HoppingVerticalM,
}

/// A figure measured on real bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The region.
    pub region: Region,
    /// What was measured.
    pub quantity: Quantity,
    /// The value, or the middle of the range.
    pub value: f64,
    /// Where it comes from and on whom.
    pub source: &'static str,
}

/// The figures that the simulator is calibrated against.
///
/// They are of women without support: a D cup for amplitudes and resonance alike. The visceral mass
/// in hopping is the gut's, which lies behind the wall that our belly tissue covers.
pub const MEASURED: [Measured; 6] = [
    Measured {
        region: Region::Chest,
        quantity: Quantity::FrequencyHz,
        value: 4.0,
        source: "Chen, Ng, Yu 2013, free vibration",
    },
    Measured {
        region: Region::Chest,
        quantity: Quantity::DampingRatio,
        value: 0.215,
        source: "Chen, Ng, Yu 2013, free vibration",
    },
    Measured {
        region: Region::Chest,
        quantity: Quantity::RunningVerticalM,
        value: 0.076,
        source: "Scurr 2011, D cup, n = 21: about half of 15.2 ± 4.2 cm",
    },
    Measured {
        region: Region::Chest,
        quantity: Quantity::RunningTotalM,
        value: 0.152,
        source: "Scurr 2011, D cup, n = 21: 15.2 ± 4.2 cm",
    },
    Measured {
        region: Region::Chest,
        quantity: Quantity::WalkingTotalM,
        value: 0.042,
        source: "Scurr 2011, D cup, n = 21: 4.2 ± 1.0 cm",
    },
    Measured {
        region: Region::Belly,
        quantity: Quantity::HoppingVerticalM,
        value: 0.065,
        source: "Minetti & Belli 1994, visceral mass: 5-8 cm",
    },
];
