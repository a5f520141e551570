//! Stature, weight, chest, muscle and age as linear functions of the shape coefficients.
//!
//! As in Allen, Curless, Popović (2003), "The space of human body shapes": attributes of the bodies
//! behind the shape space are regressed on its coefficients. The direction that changes one of them follows
//! the average bodies with that value, corrected so that certain others do not change.

use glam::Vec3;
use nalgebra::{DMatrix, DVector};

use crate::error::BuildError;
use crate::morphs::Macro;
use crate::shape_space::STATURE_RELATIVE_DEVIATION;
use dynaskin_body::{DENSITY_KG_PER_M3, SHAPE_COUNT, SkinWeights, Trait, chest_girth_m, volume_m3};

/// Attributes of one random adult at mean stature.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attributes {
    pub weight_kg: f64,
    pub chest_cm: f64,
    pub muscle_percent: f64,
    pub age_years: f64,
}

impl Attributes {
    pub(super) fn new(
        adult: &Macro,
        positions_m: &[Vec3],
        faces: &[[u32; 3]],
        skin: &[SkinWeights],
        chest_weights: &[f32],
    ) -> Self {
        Self {
            weight_kg: DENSITY_KG_PER_M3 * volume_m3(positions_m, faces),
            chest_cm: 100.0 * chest_girth_m(positions_m, faces, skin, chest_weights),
            muscle_percent: 100.0 * f64::from(adult.muscle),
            // The CC0 model's age runs from 25 years at 0.5 to 90 at 1.
            age_years: 25.0 + 130.0 * (f64::from(adult.age) - 0.5),
        }
    }
}

/// The traits of a shape space: `attributes` and `coefficients` (rows: bodies; column 0 is the
/// stature and ignored) of the bodies behind it.
pub(super) fn traits(
    attributes: &[Attributes],
    coefficients: &DMatrix<f64>,
    mean_stature_m: f32,
) -> Result<Vec<Trait>, BuildError> {
    let of = |value: fn(&Attributes) -> f64| attributes.iter().map(value).collect::<Vec<f64>>();
    // Unit, values, and the power of the stature with which they grow.
    let measured = [
        ("weight", "kg", of(|a| a.weight_kg), 3.0),
        ("chest", "cm", of(|a| a.chest_cm), 1.0),
        ("muscle", "%", of(|a| a.muscle_percent), 0.0),
        ("age", "years", of(|a| a.age_years), 0.0),
    ];
    let n_bodies = attributes.len() as f64;
    let stature_cm = 100.0 * f64::from(mean_stature_m);
    let deviation = f64::from(STATURE_RELATIVE_DEVIATION);
    let mut stature_row = [0.0; SHAPE_COUNT];
    stature_row[0] = stature_cm * deviation;
    let mut traits = vec![Trait {
        name: "stature".to_owned(),
        unit: "cm".to_owned(),
        mean: stature_cm,
        range: [-2.5, 2.5].map(|sigma| stature_cm * (1.0 + deviation * sigma)),
        per_coefficient: stature_row,
        coefficients_per_unit: [0.0; SHAPE_COUNT],
        explained: 1.0,
    }];
    let mut centred = DMatrix::zeros(attributes.len(), measured.len());
    for (column, (name, unit, values, power)) in measured.into_iter().enumerate() {
        let mean = values.iter().sum::<f64>() / n_bodies;
        let deviations = DVector::from_iterator(values.len(), values.iter().map(|x| x - mean));
        centred.set_column(column, &deviations);
        // The coefficients are uncorrelated and of unit variance.
        let per_coefficient: [f64; SHAPE_COUNT] = std::array::from_fn(|k| match k {
            0 => mean * power * deviation,
            _ => coefficients.column(k).dot(&deviations) / (n_bodies - 1.0),
        });
        let variance = deviations.norm_squared() / (n_bodies - 1.0);
        let mut sorted = values;
        sorted.sort_by(f64::total_cmp);
        let outer = sorted.len() / 100;
        traits.push(Trait {
            name: name.to_owned(),
            unit: unit.to_owned(),
            mean,
            range: [sorted[outer], sorted[sorted.len() - 1 - outer]],
            per_coefficient,
            coefficients_per_unit: [0.0; SHAPE_COUNT],
            explained: per_coefficient[1..].iter().map(|x| x * x).sum::<f64>() / variance,
        });
    }
    // A taller body is larger all over: only its own coefficient changes. Weight, muscle and age
    // each leave the other two but take the chest along; the chest alone leaves all three.
    traits[0].coefficients_per_unit[0] = 1.0 / stature_row[0];
    let shapes = coefficients.columns(1, SHAPE_COUNT - 1);
    let [weight, chest, muscle, age] = [0, 1, 2, 3];
    for (group, solved) in [
        (&[weight, muscle, age][..], &[weight, muscle, age][..]),
        (&[weight, muscle, age, chest], &[chest]),
    ] {
        // Mean change of the coefficients with each trait of the group, the others held.
        let values = centred.select_columns(group);
        let singular = || BuildError::Degenerate("the random adults' traits depend on each other");
        let gram = values.tr_mul(&values).try_inverse().ok_or_else(singular)?;
        let average = (gram * values.tr_mul(&shapes)).transpose();
        let rows = DMatrix::from_fn(group.len(), SHAPE_COUNT - 1, |row, k| {
            traits[group[row] + 1].per_coefficient[k + 1]
        });
        let correction = (rows * &average).try_inverse().ok_or_else(singular)?;
        let directions = average * correction;
        for column in (0..group.len()).filter(|column| solved.contains(&group[*column])) {
            traits[group[column] + 1].coefficients_per_unit = std::array::from_fn(|k| match k {
                0 => 0.0,
                _ => directions[(k - 1, column)],
            });
        }
    }
    for of_body in &mut traits {
        let numbers = of_body.range.iter_mut().chain(&mut of_body.per_coefficient);
        for number in numbers
            .chain(&mut of_body.coefficients_per_unit)
            .chain([&mut of_body.mean, &mut of_body.explained])
        {
            // Finer than anyone sees, and the file stays short; never minus zero.
            *number = (*number * 1e5).round() / 1e5 + 0.0;
        }
    }
    Ok(traits)
}
