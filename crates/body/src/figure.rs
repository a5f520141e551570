//! A body's measures (stature, weight, chest, muscle and age), and shape coefficients with given measures.
//!
//! Shape coefficients are standard deviations, so a random adult's are drawn from N(0, I). The result is the
//! likeliest shape with the given measures: for linear measures `m(β) = m₀ + J β` it is the conditional
//! mean `β = Jᵀ (J Jᵀ)⁻¹ (m - m₀)`, as in Allen, Curless, Popović (2003), "The space of human body shapes".
//! Weight and chest are measured on the surface and are not linear, so the equation is solved again around the
//! last solution (Gauss-Newton). Two bounds keep bodies likely: each measure stays in the range of the
//! bodies behind the shape space, and all coefficients together within [`LARGEST_DISTANCE`].

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::measures::{DENSITY_KG_PER_M3, chest_girth_m, stature_m, volume_m3};
use crate::{BodyModel, Region, SHAPE_COUNT};

/// Largest Mahalanobis distance from the average body, over all ten coefficients: nine in ten random
/// adults lie within it (χ² with 10 degrees of freedom).
pub const LARGEST_DISTANCE: f64 = 4.0;

/// Measures that a [`Figure`] may have.
const COUNT: usize = 5;
const STATURE: usize = 0;
const WEIGHT: usize = 1;
const CHEST: usize = 2;

/// Each measure's name in [`Trait`], what one of its units is in the trait's, the power of the stature with
/// which it grows from body to body, and the values that can be asked for.
const MEASURES: [Measure; COUNT] = [
    Measure::new("stature", "m", 100.0, 1, [LEAST_STATURE_M, 2.2]),
    Measure::new("weight", "kg", 1.0, 3, [30.0, 250.0]),
    Measure::new("chest", "cm", 1.0, 1, [60.0, 170.0]),
    Measure::new("muscle", "", 100.0, 0, [0.0, 1.0]),
    Measure::new("age", "years", 1.0, 0, [18.0, 100.0]),
];

/// Least stature in metres. Smaller people are refused, because all bodies are adults.
pub const LEAST_STATURE_M: f64 = 1.45;

/// Step of a coefficient over which measures are differentiated.
const STEP: f32 = 0.02;
/// Some four are needed.
const MOST_ITERATIONS: usize = 20;
/// Coefficients that change less have arrived: some grams.
const ARRIVED: f64 = 1e-4;

struct Measure {
    name: &'static str,
    unit: &'static str,
    per_unit: f64,
    power: i32,
    asked: [f64; 2],
}

impl Measure {
    const fn new(
        name: &'static str,
        unit: &'static str,
        per_unit: f64,
        power: i32,
        asked: [f64; 2],
    ) -> Self {
        Self {
            name,
            unit,
            per_unit,
            power,
            asked,
        }
    }
}

/// One measure of a body, linear in the shape coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trait {
    /// `stature`, `weight`, `chest`, `muscle` or `age`.
    pub name: String,
    /// `cm`, `kg`, `%` (of the range that the CC0 model knows) or `years`.
    pub unit: String,
    /// Value at β = 0.
    pub mean: f64,
    /// Range of the bodies behind the shape space, without the outer hundredths.
    pub range: [f64; 2],
    /// Change of the value with each shape coefficient.
    pub per_coefficient: [f64; SHAPE_COUNT],
    /// Change of the shape coefficients that raises the value by 1. Stature scales the whole body;
    /// weight, muscle and age do not affect each other but change the chest; the chest changes none of these.
    pub coefficients_per_unit: [f64; SHAPE_COUNT],
    /// Share of the variance among bodies of one stature that the coefficients explain, 0..=1.
    pub explained: f64,
}

/// A body's measures. As a request, measures that are left out follow from the others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// Height in metres, 1.45 to 2.2.
    pub stature_m: Option<f64>,
    /// Weight in kilograms, 30 to 250: the volume times [`DENSITY_KG_PER_M3`].
    pub weight_kg: Option<f64>,
    /// Chest circumference in centimetres, 60 to 170.
    pub chest_cm: Option<f64>,
    /// Muscle, from 0 (none visible) to 1 (a bodybuilder's); the average of many people is 0.5.
    pub muscle: Option<f64>,
    /// Age in years, 18 to 100.
    pub age_years: Option<f64>,
}

impl Figure {
    fn from_values(values: [Option<f64>; COUNT]) -> Self {
        let [stature_m, weight_kg, chest_cm, muscle, age_years] = values;
        Self {
            stature_m,
            weight_kg,
            chest_cm,
            muscle,
            age_years,
        }
    }

    /// Stature, weight, chest, muscle and age, in the order of the fields.
    pub fn values(&self) -> [Option<f64>; COUNT] {
        [
            self.stature_m,
            self.weight_kg,
            self.chest_cm,
            self.muscle,
            self.age_years,
        ]
    }

    fn check(&self) -> Result<(), FigureError> {
        for (measure, value) in MEASURES.iter().zip(self.values()) {
            let Some(got) = value else { continue };
            let [least, greatest] = measure.asked;
            if measure.name == "stature" && got < least {
                return Err(FigureError::Child { got });
            }
            if !(least..=greatest).contains(&got) {
                return Err(FigureError::Outside {
                    name: measure.name,
                    unit: measure.unit,
                    least,
                    greatest,
                    got,
                });
            }
        }
        Ok(())
    }
}

/// Why there is no shape with the given measures.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// Nothing says what the body's shapes look like.
    #[error(
        "this body can be shaped by coefficients alone: its bundle does not tell its measures \
         (`traits` in bundle.json)"
    )]
    Untold,
    /// A stature that adults do not have.
    #[error("stature must be at least {LEAST_STATURE_M} m, got {got}: the bodies are adults")]
    Child {
        /// What was asked for, metres.
        got: f64,
    },
    /// A number outside the measures of people; often one in another unit.
    #[error("{name} must be {least} to {greatest} {unit}, got {got}")]
    Outside {
        /// Which measure.
        name: &'static str,
        /// Its unit.
        unit: &'static str,
        /// Least value that can be asked for.
        least: f64,
        /// Greatest value that can be asked for.
        greatest: f64,
        /// What was asked for.
        got: f64,
    },
}

/// Measures bodies of a model, and finds shapes with given measures.
#[derive(Clone, Copy, Debug)]
pub struct Figures<'a> {
    body: &'a BodyModel,
    traits: [&'a Trait; COUNT],
}

impl<'a> Figures<'a> {
    /// For a body and the traits of its shape space.
    ///
    /// # Errors
    /// [`FigureError::Untold`] if a trait or the body's chest is unknown.
    pub fn new(body: &'a BodyModel, traits: &'a [Trait]) -> Result<Self, FigureError> {
        let [stature, weight, chest, muscle, age] = MEASURES.map(|measure| {
            traits
                .iter()
                .find(|known| known.name == measure.name && known.is_sound())
        });
        let all = stature.zip(weight).zip(chest).zip(muscle).zip(age);
        let ((((stature, weight), chest), muscle), age) = all.ok_or(FigureError::Untold)?;
        if body.region_weights.len() <= Region::Chest as usize {
            return Err(FigureError::Untold);
        }
        Ok(Self {
            body,
            traits: [stature, weight, chest, muscle, age],
        })
    }

    /// The measures of a body: stature, weight and chest of its surface, and the average muscle and age of
    /// bodies with that shape.
    pub fn measure(&self, shape: &[f32; SHAPE_COUNT]) -> Figure {
        let positions_m = self.body.shaped(shape).positions_m;
        let mut values = self.measure_surface(&positions_m, shape).map(Some);
        values[COUNT - 2] = values[COUNT - 2].map(|muscle| muscle.clamp(0.0, 1.0));
        Figure::from_values(values)
    }

    /// The likeliest shape (β, in standard deviations) with the wanted measures, as near to them as the bounds
    /// allow. [`Self::measure`] returns the measures of the result.
    ///
    /// # Errors
    /// [`FigureError::Child`], [`FigureError::Outside`].
    pub fn shape_of(&self, wanted: &Figure) -> Result<[f32; SHAPE_COUNT], FigureError> {
        wanted.check()?;
        let wanted = wanted.values();
        let mut shape = [0.0_f32; SHAPE_COUNT];
        for _ in 0..MOST_ITERATIONS {
            let (now, jacobian) = self.linearised(&shape, &wanted);
            let stature_m =
                wanted[STATURE].map_or(now[STATURE], |m| self.limited(STATURE, m, now[STATURE]));
            let rows: Vec<Row> = wanted
                .iter()
                .enumerate()
                .filter_map(|(which, value)| {
                    let slope = jacobian[which];
                    let target = self.limited(which, (*value)?, stature_m);
                    let here: f64 = slope
                        .iter()
                        .zip(&shape)
                        .map(|(s, b)| s * f64::from(*b))
                        .sum();
                    Some(Row {
                        slope,
                        rest: target - now[which] + here,
                    })
                })
                .filter(|row| row.variance() > 0.0)
                .collect();
            let next = within_distance(&rows).map(|beta| beta as f32);
            let moved = shape
                .iter()
                .zip(&next)
                .map(|(a, b)| f64::from((a - b).abs()));
            let arrived = moved.fold(0.0, f64::max) < ARRIVED;
            shape = next;
            if arrived {
                break;
            }
        }
        Ok(shape)
    }

    /// A wish as far as bodies of that stature have it.
    fn limited(&self, which: usize, value: f64, stature_m: f64) -> f64 {
        let Measure {
            per_unit, power, ..
        } = MEASURES[which];
        let growth = match which {
            STATURE => 1.0,
            _ => (100.0 * stature_m / self.traits[STATURE].mean).powi(power),
        };
        let [least, greatest] = self.traits[which].range.map(|end| end / per_unit * growth);
        value.max(least).min(greatest)
    }

    /// The measures at a shape, and how those that are wanted change with each coefficient.
    fn linearised(
        &self,
        shape: &[f32; SHAPE_COUNT],
        wanted: &[Option<f64>; COUNT],
    ) -> ([f64; COUNT], [[f64; SHAPE_COUNT]; COUNT]) {
        let base_m = self.body.shaped(shape).positions_m;
        let now = self.measure_surface(&base_m, shape);
        let mut jacobian = [[0.0; SHAPE_COUNT]; COUNT];
        let mut moved_m = base_m.clone();
        for (k, dirs) in self.body.shape_dirs_m.iter().take(SHAPE_COUNT).enumerate() {
            for ((moved, base), dir) in moved_m.iter_mut().zip(&base_m).zip(dirs) {
                *moved = *base + STEP * *dir;
            }
            let mut beside = *shape;
            beside[k] += STEP;
            let then = self.measure_surface(&moved_m, &beside);
            for which in (0..COUNT).filter(|which| wanted[*which].is_some()) {
                jacobian[which][k] = (then[which] - now[which]) / f64::from(STEP);
            }
        }
        (now, jacobian)
    }

    fn measure_surface(&self, positions_m: &[Vec3], shape: &[f32; SHAPE_COUNT]) -> [f64; COUNT] {
        let chest = &self.body.region_weights[Region::Chest as usize];
        let girth_m = chest_girth_m(positions_m, &self.body.faces, &self.body.skin, chest);
        std::array::from_fn(|which| match which {
            STATURE => stature_m(positions_m),
            WEIGHT => DENSITY_KG_PER_M3 * volume_m3(positions_m, &self.body.faces),
            CHEST => 100.0 * girth_m,
            _ => self.traits[which].at(shape) / MEASURES[which].per_unit,
        })
    }
}

impl Trait {
    /// The average value of bodies with a shape, in [`Self::unit`].
    pub fn at(&self, shape: &[f32; SHAPE_COUNT]) -> f64 {
        let steps = self.per_coefficient.iter().zip(shape);
        self.mean
            + steps
                .map(|(step, beta)| step * f64::from(*beta))
                .sum::<f64>()
    }

    /// Whether all its numbers are finite and its range is one.
    pub fn is_sound(&self) -> bool {
        let numbers = self
            .per_coefficient
            .iter()
            .chain(&self.coefficients_per_unit);
        numbers.chain(&self.range).all(|x| x.is_finite())
            && self.mean.is_finite()
            && self.explained.is_finite()
            && self.range[0] <= self.range[1]
    }
}

/// One wanted measure, linear in the coefficients: `slope · β = rest`.
struct Row {
    slope: [f64; SHAPE_COUNT],
    rest: f64,
}

impl Row {
    /// Its variance among all adults.
    fn variance(&self) -> f64 {
        dot(&self.slope, &self.slope)
    }
}

fn dot(a: &[f64; SHAPE_COUNT], b: &[f64; SHAPE_COUNT]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The conditional mean; where it lies beyond [`LARGEST_DISTANCE`], that of measures known so vaguely that it does
/// not. The distance falls as the vagueness grows, which is found by halving.
fn within_distance(rows: &[Row]) -> [f64; SHAPE_COUNT] {
    let is_within = |beta: &[f64; SHAPE_COUNT]| dot(beta, beta) <= LARGEST_DISTANCE.powi(2);
    let exact = conditional_mean(rows, 1e-9);
    if is_within(&exact) {
        return exact;
    }
    // Powers of ten.
    let [mut near, mut far] = [-9.0_f64, 6.0];
    for _ in 0..40 {
        let middle = f64::midpoint(near, far);
        if is_within(&conditional_mean(rows, 10.0_f64.powf(middle))) {
            far = middle;
        } else {
            near = middle;
        }
    }
    conditional_mean(rows, 10.0_f64.powf(far))
}

/// Mean of β ~ N(0, I) where the rows hold but for a normal error, whose variance is `vagueness` times each row's own:
/// `β = Jᵀ (J Jᵀ + vagueness diag(J Jᵀ))⁻¹ rest`.
fn conditional_mean(rows: &[Row], vagueness: f64) -> [f64; SHAPE_COUNT] {
    let mut system: Vec<Vec<f64>> = Vec::with_capacity(rows.len());
    for (i, row) in rows.iter().enumerate() {
        let mut line: Vec<f64> = rows
            .iter()
            .map(|other| dot(&row.slope, &other.slope))
            .collect();
        line[i] *= 1.0 + vagueness;
        line.push(row.rest);
        system.push(line);
    }
    let weights = solved(system);
    std::array::from_fn(|k| {
        let parts = rows.iter().zip(&weights);
        parts.map(|(row, weight)| row.slope[k] * weight).sum()
    })
}

/// Solves a small symmetric positive definite system, whose lines end with the right side, by elimination.
fn solved(mut lines: Vec<Vec<f64>>) -> Vec<f64> {
    let count = lines.len();
    for pivot in 0..count {
        let (above, below) = lines.split_at_mut(pivot + 1);
        let line = &above[pivot];
        for other in below {
            let factor = other[pivot] / line[pivot];
            for (value, from) in other.iter_mut().zip(line) {
                *value -= factor * from;
            }
        }
    }
    let mut solution = vec![0.0; count];
    for pivot in (0..count).rev() {
        let line = &lines[pivot];
        let known: f64 = (pivot + 1..count).map(|k| line[k] * solution[k]).sum();
        solution[pivot] = (line[count] - known) / line[pivot];
    }
    solution
}
