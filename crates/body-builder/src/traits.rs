//! What people call a body's shape by: stature, weight, chest, muscle and age, each linear in the
//! shape coefficients.
//!
//! As in Allen, Curless, Popović (2003), "The space of human body shapes": attributes of the bodies
//! behind the shape space are regressed on its coefficients. The way to change one of them is along
//! the bodies that have it on average, corrected so that certain others stay.

use glam::Vec3;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::error::BuildError;
use crate::morphs::Macro;
use crate::shape_space::STATURE_RELATIVE_DEVIATION;
use dynaskin_body::{Joint, SHAPE_COUNT, SkinWeights};

/// Mean density of an adult body in kg/m³: between fat (900) and lean mass (1100).
const DENSITY_KG_PER_M3: f64 = 1_010.0;

/// One attribute of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trait {
    /// `stature`, `weight`, `chest`, `muscle` or `age`.
    pub name: String,
    /// `cm`, `kg`, `%` (of the range that the CC0 model knows) or `years`.
    pub unit: String,
    /// Value at β = 0.
    pub mean: f64,
    /// Values between which the bodies behind the shape space lie, but for the outer hundredths.
    pub range: [f64; 2],
    /// Change of the value with each shape coefficient.
    pub per_coefficient: [f64; SHAPE_COUNT],
    /// Change of the shape coefficients that raises the value by 1. Stature scales the whole body;
    /// weight, muscle and age leave each other but change the chest; the chest leaves these three.
    pub coefficients_per_unit: [f64; SHAPE_COUNT],
    /// Share of the variance among bodies of one stature that the coefficients explain, 0..=1.
    pub explained: f64,
}

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

/// Volume inside a closed surface: signed tetrahedra from the origin.
fn volume_m3(positions_m: &[Vec3], faces: &[[u32; 3]]) -> f64 {
    let at = |vertex: u32| positions_m[vertex as usize].as_dvec3();
    let six_fold: f64 = faces
        .iter()
        .map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))))
        .sum();
    six_fold / 6.0
}

/// Length of a tape around the trunk at the height of the middle of the chest's tissue.
fn chest_girth_m(
    positions_m: &[Vec3],
    faces: &[[u32; 3]],
    skin: &[SkinWeights],
    chest_weights: &[f32],
) -> f64 {
    let total: f32 = chest_weights.iter().sum();
    let weighted = positions_m.iter().zip(chest_weights);
    let height_m = weighted.map(|(p, weight)| p.y * weight).sum::<f32>() / total;
    let is_trunk = |vertex: u32| !is_arm(&skin[vertex as usize]);
    let mut cut_m: Vec<[f64; 2]> = Vec::new();
    for face in faces
        .iter()
        .filter(|face| face.iter().all(|v| is_trunk(*v)))
    {
        for edge in [[0, 1], [1, 2], [2, 0]] {
            let [a, b] = edge.map(|corner| positions_m[face[corner] as usize]);
            if (a.y < height_m) != (b.y < height_m) {
                let at = a.lerp(b, (height_m - a.y) / (b.y - a.y));
                cut_m.push([f64::from(at.x), f64::from(at.z)]);
            }
        }
    }
    hull_perimeter(cut_m)
}

/// Whether more than half of a vertex moves with an arm.
fn is_arm(skin: &SkinWeights) -> bool {
    let arm = [
        Joint::LeftShoulder,
        Joint::LeftElbow,
        Joint::LeftWrist,
        Joint::LeftHand,
    ];
    let weight: f32 = skin
        .joints
        .iter()
        .zip(skin.weights)
        .filter(|(joint, _)| {
            arm.iter()
                .any(|arm| [*arm as u8, arm.mirrored() as u8].contains(joint))
        })
        .map(|(_, weight)| weight)
        .sum();
    weight > 0.5
}

/// Perimeter of the convex hull of points in a plane (monotone chain).
fn hull_perimeter(mut points: Vec<[f64; 2]>) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b[0] - a[0]) * (point[1] - a[1]) <= (b[1] - a[1]) * (point[0] - a[0])
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain
            .windows(2)
            .map(|edge| f64::hypot(edge[1][0] - edge[0][0], edge[1][1] - edge[0][1]))
            .sum::<f64>()
    };
    half(&mut points.iter().copied()) + half(&mut points.iter().rev().copied())
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
