//! How far the tissue of each part of the body gives way, as a formula over β.
//!
//! The simulator computes the compliance of some hundred shapes ([`ComplianceTable`]). A polynomial of second
//! degree in β and the logarithms of the parts' thickness, which include its lower limit, approximates the
//! logarithm of the compliance; the weights are fitted once by least squares. The formula is part of the
//! predictor, so it applies to a body of any shape without a simulator.

use dynaskin_body::SHAPE_COUNT;
use dynaskin_onnx::{Graph, Precision, Value, WriteError};
use dynaskin_sim::{COMPLIANCE_COUNT, ComplianceTable};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::thickness::Thickness;

/// Less than this in metres counts as this: skin over bone, whose ratios mean nothing.
const LEAST_M: f32 = 1e-4;
/// Weight of the squares of the polynomial's coefficients beside an even number of rows: enough to
/// keep the fit solvable.
const RIDGE: f64 = 1e-2;
/// Products of two coefficients, squares among them.
const PAIRS: usize = SHAPE_COUNT * (SHAPE_COUNT + 1) / 2;
/// Fewer shapes than this for each weight of the formula cannot tell it.
const ROWS_PER_TERM: usize = 2;

/// The natural logarithm of the compliance of each part of each region in each turn of gravity, over that
/// at β = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compliance {
    /// The least and the greatest of each coefficient of β in the table; β is clamped to it.
    range: [(f32, f32); SHAPE_COUNT],
    /// The thickness of the parts, where the body tells it.
    thickness: Option<Thickness>,
    /// Weights of β, of its [`PAIRS`] products and of the thickness, `[term][number]` flat.
    weights: Vec<f32>,
    /// Root mean square over all numbers of what the formula leaves of the logarithms on rows that it
    /// was not fitted to.
    pub unexplained: f32,
}

impl Compliance {
    /// Fits the formula; none where the table has fewer than two shapes for each of its weights.
    pub(super) fn fit(table: &ComplianceTable, thickness: Option<&Thickness>) -> Option<Self> {
        let rows = table.rows.iter();
        let rows: Vec<(&[f32], &[f32])> = rows
            .filter_map(|row| Some((row.shape.as_slice(), row.metres.as_deref()?)))
            .collect();
        let mut compliance = Self {
            range: [(f32::MAX, f32::MIN); SHAPE_COUNT],
            thickness: thickness.cloned(),
            weights: Vec::new(),
            unexplained: 0.0,
        };
        if rows.len() < ROWS_PER_TERM * (1 + compliance.term_count()) {
            return None;
        }
        for (shape, _) in &rows {
            for ((least, most), beta) in compliance.range.iter_mut().zip(*shape) {
                (*least, *most) = (least.min(*beta), most.max(*beta));
            }
        }
        let rows = rows.iter().map(|(shape, metres)| {
            let terms = compliance.terms(shape).into_iter().map(f64::from);
            let terms: Vec<f64> = std::iter::once(1.0).chain(terms).collect();
            let logarithms = metres.iter().map(|m| f64::from(m.max(LEAST_M)).ln());
            (
                DVector::from(terms),
                DVector::from_iterator(metres.len(), logarithms),
            )
        });
        let rows: Vec<Row> = rows.collect();
        let (check, learn): (Vec<_>, Vec<_>) = rows
            .iter()
            .enumerate()
            .partition(|(index, _)| index % 8 == 7);
        let without = least_squares(learn.iter().map(|(_, row)| *row))?;
        let left = check.iter().map(|(_, (terms, logarithms))| {
            (without.transpose() * terms - logarithms).norm_squared()
        });
        let numbers = (check.len() * COMPLIANCE_COUNT).max(1) as f64;
        compliance.unexplained = (left.sum::<f64>() / numbers).sqrt() as f32;
        // The constant falls away: numbers are told over those at β = 0.
        let all = least_squares(rows.iter())?.remove_row(0);
        let weights = all.row_iter();
        let weights = weights.flat_map(|row| row.iter().map(|w| *w as f32).collect::<Vec<_>>());
        compliance.weights = weights.collect();
        Some(compliance)
    }

    fn term_count(&self) -> usize {
        SHAPE_COUNT + PAIRS + self.thickness.as_ref().map_or(0, Thickness::count)
    }

    /// β within the range, its products, the thickness.
    fn terms(&self, shape: &[f32]) -> Vec<f32> {
        let within = shape.iter().zip(&self.range);
        let within = within.map(|(beta, (least, most))| beta.max(*least).min(*most));
        let mut terms: Vec<f32> = within.collect();
        let thickness = self
            .thickness
            .as_ref()
            .map(|thickness| thickness.of(&terms));
        let [first, second] = factors();
        let products = first.iter().zip(&second);
        let products: Vec<f32> = products.map(|(i, j)| terms[*i] * terms[*j]).collect();
        terms.extend(products);
        terms.extend(thickness.unwrap_or_default());
        terms
    }

    /// The numbers of the body with this β.
    pub(super) fn of(&self, shape: &[f32]) -> Vec<f32> {
        let terms = self.terms(shape);
        let mut numbers = vec![0.0; COMPLIANCE_COUNT];
        for (term, weights) in terms
            .iter()
            .zip(self.weights.chunks_exact(COMPLIANCE_COUNT))
        {
            for (number, weight) in numbers.iter_mut().zip(weights) {
                *number += term * weight;
            }
        }
        numbers
    }

    /// The same in a graph, from β `[1,10]`.
    pub(super) fn write(&self, graph: &mut Graph, shape: &Value) -> Result<Value, WriteError> {
        let within = super::clamped::clamped(graph, "compliance_shape", shape, &self.range)?;
        let [first, second] = factors();
        let first = graph.gather(&within, 1, &first)?;
        let second = graph.gather(&within, 1, &second)?;
        let products = graph.mul(&first, &second)?;
        let thickness = self.thickness.as_ref();
        let thickness = thickness.map(|t| t.write(graph, &within)).transpose()?;
        let mut terms = vec![&within, &products];
        terms.extend(&thickness);
        let terms = graph.concat(&terms, 1)?;
        let size = [self.term_count(), COMPLIANCE_COUNT];
        let weights = graph.weights("compliance", &size, &self.weights, Precision::Single)?;
        graph.matmul(&terms, &weights)
    }
}

/// Indices into β of the factors of each product.
fn factors() -> [Vec<usize>; 2] {
    let pairs = (0..SHAPE_COUNT).flat_map(|i| (i..SHAPE_COUNT).map(move |j| (i, j)));
    let (first, second) = pairs.unzip();
    [first, second]
}

/// One and the terms of a shape, and the logarithms of its compliances.
type Row = (DVector<f64>, DVector<f64>);

/// Weights `[1 + terms][number]`; none where they cannot be told.
fn least_squares<'a>(rows: impl Iterator<Item = &'a Row>) -> Option<DMatrix<f64>> {
    let mut sums: Option<(DMatrix<f64>, DMatrix<f64>)> = None;
    for (terms, logarithms) in rows {
        let (square, cross) = sums.get_or_insert_with(|| {
            let mut ridge = DMatrix::identity(terms.len(), terms.len()) * RIDGE;
            ridge[(0, 0)] = 0.0;
            (ridge, DMatrix::zeros(terms.len(), logarithms.len()))
        });
        *square += terms * terms.transpose();
        *cross += terms * logarithms.transpose();
    }
    let (square, cross) = sums?;
    Some(square.cholesky()?.solve(&cross))
}

#[cfg(test)]
mod tests {
    use dynaskin_sim::{ComplianceRow, SimSettings};

    use super::*;

    /// Compliances that are a polynomial of second degree in β, up to a factor that is not.
    fn table(rows: usize, odd: f32) -> ComplianceTable {
        let row = |index: usize| {
            let shape = ComplianceTable::shape(index);
            let odd = odd * (7.0 * shape[1]).sin();
            let metres = (0..COMPLIANCE_COUNT).map(|number| law_m(number, &shape) * odd.exp());
            ComplianceRow {
                shape,
                // Some shapes find no rest.
                metres: (index % 9 != 4).then(|| metres.collect()),
            }
        };
        ComplianceTable::new("", SimSettings::default(), (0..rows).map(row).collect())
    }

    fn law_m(number: usize, shape: &[f32; SHAPE_COUNT]) -> f32 {
        let (a, b) = (
            shape[number % SHAPE_COUNT],
            shape[(number + 3) % SHAPE_COUNT],
        );
        0.01 * (0.3 * a - 0.1 * a * b + 0.05 * b * b).exp()
    }

    #[test]
    fn a_polynomial_is_found_and_told_over_that_at_the_mean_shape() {
        let compliance = Compliance::fit(&table(300, 0.0), None).expect("enough rows");
        assert!(compliance.unexplained < 1e-3, "{}", compliance.unexplained);
        assert_eq!(compliance.of(&[0.0; SHAPE_COUNT]), [0.0; COMPLIANCE_COUNT]);
        let shape = [0.5, -1.0, 0.3, 0.0, 1.2, -0.7, 0.2, 0.1, -0.1, 0.4];
        for (number, told) in compliance.of(&shape).iter().enumerate() {
            let expected = (law_m(number, &shape) / 0.01).ln();
            assert!(
                (told - expected).abs() < 3e-3,
                "{number}: {told} {expected}"
            );
        }
    }

    #[test]
    fn beyond_the_table_nothing_changes_any_more() {
        let compliance = Compliance::fit(&table(300, 0.0), None).expect("enough rows");
        let (far, farther) = ([20.0; SHAPE_COUNT], [50.0; SHAPE_COUNT]);
        assert_eq!(compliance.of(&far), compliance.of(&farther));
    }

    #[test]
    fn what_it_does_not_explain_is_told_and_few_shapes_are_refused() {
        let compliance = Compliance::fit(&table(400, 0.2), None).expect("enough rows");
        // A sine of 0.2 has a deviation of 0.14; the polynomial follows a little of it.
        let unexplained = compliance.unexplained;
        assert!((0.1..0.25).contains(&unexplained), "{unexplained}");
        assert_eq!(Compliance::fit(&table(140, 0.0), None), None);
    }
}
