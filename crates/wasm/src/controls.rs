//! Controls as flat arrays: strength, root inertia, then four numbers a region.

use dynaskin_body::REGION_COUNT;
use dynaskin_runtime::Controls;

use crate::error::Thrown;

/// Numbers before those of the regions.
const HEAD: usize = 2;

/// Numbers of a region: gain, stiffness, damping, limit in metres.
const PER_REGION: usize = 4;

/// The controls of a flat array; their ranges are checked by the runtime.
pub(crate) fn from_numbers(numbers: &[f32]) -> Result<Controls, Thrown> {
    let expected = HEAD + PER_REGION * REGION_COUNT;
    if numbers.len() != expected {
        return Err(Thrown::argument(format!(
            "Controls are {expected} numbers, this array has {}.",
            numbers.len()
        )));
    }
    let mut controls = Controls::default();
    (controls.strength, controls.root_inertia) = (numbers[0], numbers[1]);
    let regions = numbers[HEAD..].as_chunks::<PER_REGION>().0;
    for (region, &[gain, stiffness, damping, limit_m]) in controls.regions.iter_mut().zip(regions) {
        (region.gain, region.limit_m) = (gain, limit_m);
        (region.stiffness, region.damping) = (stiffness, damping);
    }
    Ok(controls)
}

/// The flat array of `controls`.
pub(crate) fn to_numbers(controls: &Controls) -> Vec<f32> {
    let head = [controls.strength, controls.root_inertia];
    let regions = controls.regions.iter();
    let regions = regions.flat_map(|r| [r.gain, r.stiffness, r.damping, r.limit_m]);
    head.into_iter().chain(regions).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_round_trip_and_wrong_lengths_are_refused() {
        let calm = Controls::calm_clothes();
        let numbers = to_numbers(&calm);
        assert!(from_numbers(&numbers).is_ok_and(|back| back == calm));
        assert!(from_numbers(&numbers[1..]).is_err());
    }
}
