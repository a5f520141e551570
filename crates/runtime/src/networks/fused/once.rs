//! What of a calculation has to be done again only when some of its inputs change.
//!
//! It is found by following those inputs: a number belongs to the part done once where all that it
//! is calculated from does. A sum of which only some rows do is cut in two: the part done once is
//! what the rest starts from.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::calculation::{Calculation, Element, Sum, Term, Vector, Weights};

/// A calculation in two parts, both with the inputs of the whole.
#[derive(Debug)]
pub(super) struct Parts {
    /// Puts out one list: what the other part needs of it.
    pub once: Calculation,
    /// Has that list as a further input, the last.
    pub tick: Calculation,
}

/// Cuts `calculation` in two, where the numbers `seldom` of input `port` change seldom; none where
/// nothing can be done once.
pub(super) fn part(calculation: &Calculation, port: usize, seldom: Range<usize>) -> Option<Parts> {
    let mut cut = Cut::default();
    for &input in &calculation.inputs {
        cut.once.inputs.push(input);
        cut.tick.inputs.push(input);
    }
    let needed = calculation.needed();
    for (id, vector) in calculation.vectors.iter().enumerate() {
        let moved = match vector {
            Vector::Input(length) => {
                let is_it = calculation.inputs.get(port) == Some(&(id as u32));
                let seldom = if is_it { seldom.clone() } else { 0..0 };
                cut.input(*length, &seldom)
            }
            vector if !needed[id] => vec![Moved::Unneeded; vector.len()],
            Vector::Sum(sum) => cut.sum(sum),
            Vector::Unary(function, of) => {
                cut.elementwise(&[of], |[of]| Vector::Unary(*function, of))
            }
            Vector::Binary(function, [a, b]) => {
                cut.elementwise(&[a, b], |of| Vector::Binary(*function, of))
            }
        };
        cut.moved.push(moved);
    }
    let outputs = calculation.outputs.iter();
    let outputs: Vec<Vec<Element>> = outputs.map(|output| cut.all_in_tick(output)).collect();
    cut.finish(outputs)
}

/// Where a number of the whole is calculated now.
#[derive(Clone, Copy, Debug)]
enum Moved {
    Unneeded,
    /// An input that changes seldom: both parts have it.
    Seldom {
        once: Element,
        tick: Element,
    },
    Once(Element),
    Tick(Element),
}

#[derive(Default)]
struct Cut {
    once: Calculation,
    tick: Calculation,
    /// By vector of the whole.
    moved: Vec<Vec<Moved>>,
    /// What the tick takes over, and where it stands in that list.
    kept: Vec<Element>,
    places: HashMap<(u32, u32), u32>,
}

/// The vector that stands for what is taken over until its length is known.
const KEPT: u32 = u32::MAX;

impl Cut {
    fn input(&mut self, length: usize, seldom: &Range<usize>) -> Vec<Moved> {
        let once = self.once.push(Vector::Input(length));
        let tick = self.tick.push(Vector::Input(length));
        let both = once.into_iter().zip(tick).enumerate();
        both.map(|(index, (once, tick))| {
            if seldom.contains(&index) {
                Moved::Seldom { once, tick }
            } else {
                Moved::Tick(tick)
            }
        })
        .collect()
    }

    /// The element in the part done once; none where it belongs to the tick.
    fn in_once(&self, element: Element) -> Option<Element> {
        let Element::Of { vector, index } = element else {
            return Some(element);
        };
        match self.moved[vector as usize][index as usize] {
            Moved::Once(once) | Moved::Seldom { once, .. } => Some(once),
            Moved::Tick(_) | Moved::Unneeded => None,
        }
    }

    fn in_tick(&mut self, element: Element) -> Element {
        let Element::Of { vector, index } = element else {
            return element;
        };
        match self.moved[vector as usize][index as usize] {
            Moved::Tick(tick) | Moved::Seldom { tick, .. } => tick,
            Moved::Once(once) => self.keep(once),
            Moved::Unneeded => Element::Constant(0.0),
        }
    }

    fn all_in_tick(&mut self, elements: &[Element]) -> Vec<Element> {
        elements.iter().map(|&e| self.in_tick(e)).collect()
    }

    /// Lets the tick take over a number of the part done once.
    fn keep(&mut self, once: Element) -> Element {
        let Element::Of { vector, index } = once else {
            return once;
        };
        let kept = &mut self.kept;
        let place = self.places.entry((vector, index)).or_insert_with(|| {
            kept.push(once);
            kept.len() as u32 - 1
        });
        Element::Of {
            vector: KEPT,
            index: *place,
        }
    }

    /// A vector whose numbers each depend on one of each of `operands`.
    fn elementwise<const N: usize>(
        &mut self,
        operands: &[&Vec<Element>; N],
        vector: impl Fn([Vec<Element>; N]) -> Vector,
    ) -> Vec<Moved> {
        let length = operands[0].len();
        let in_once = |index: usize| operands.map(|list| self.in_once(list[index]));
        let (mut once, mut tick) = (operands.map(|_| vec![]), operands.map(|_| vec![]));
        let mut is_once = vec![false; length];
        for (index, is_once) in is_once.iter_mut().enumerate() {
            let found = in_once(index);
            *is_once = found.iter().all(Option::is_some);
            if *is_once {
                let found = once.iter_mut().zip(found.into_iter().flatten());
                found.for_each(|(list, element)| list.push(element));
            }
        }
        for index in (0..length).filter(|&index| !is_once[index]) {
            for (list, operand) in tick.iter_mut().zip(operands) {
                list.push(self.in_tick(operand[index]));
            }
        }
        let once = pushed(&mut self.once, vector(once));
        let tick = pushed(&mut self.tick, vector(tick));
        let (mut once, mut tick) = (once.into_iter(), tick.into_iter());
        let moved = is_once.iter().map(|&is_once| {
            if is_once {
                once.next().map(Moved::Once)
            } else {
                tick.next().map(Moved::Tick)
            }
        });
        moved
            .map(|moved| moved.unwrap_or(Moved::Unneeded))
            .collect()
    }

    fn sum(&mut self, sum: &Sum) -> Vec<Moved> {
        let is_once = |element: &Element| self.in_once(*element).is_some();
        let rows: Vec<Vec<bool>> = sum
            .terms
            .iter()
            .map(|term| term.of.iter().map(is_once).collect())
            .collect();
        let columns = sum.first.len();
        let some = |wanted: bool| -> Vec<bool> {
            let mut some = vec![false; columns];
            for (term, rows) in sum.terms.iter().zip(&rows) {
                for row in (0..rows.len()).filter(|&row| rows[row] == wanted) {
                    for (column, some) in some.iter_mut().enumerate() {
                        *some |= term.weight(row, column) != 0.0;
                    }
                }
            }
            some
        };
        let (from_once, from_tick) = (some(true), some(false));
        let starts_once: Vec<bool> = sum.first.iter().map(is_once).collect();
        // A column that starts from a number of the tick cannot start from one done once as well.
        let whole = (0..columns).any(|c| from_once[c] && !starts_once[c]);
        let kinds: Vec<Kind> = (0..columns)
            .map(|c| match (from_once[c], from_tick[c], starts_once[c]) {
                (_, false, true) => Kind::Once,
                (true, true, true) if !whole => Kind::Both,
                _ => Kind::Tick,
            })
            .collect();
        self.cut_sum(sum, &rows, &kinds, whole)
    }

    /// The columns of `sum` by their `kinds`; with the rows done once in the tick too where `whole`.
    fn cut_sum(
        &mut self,
        sum: &Sum,
        rows: &[Vec<bool>],
        kinds: &[Kind],
        whole: bool,
    ) -> Vec<Moved> {
        let those = |wanted: &[Kind]| -> Vec<u32> {
            let columns = (0..kinds.len() as u32).zip(kinds);
            let columns = columns.filter(|(_, kind)| wanted.contains(kind));
            columns.map(|(column, _)| column).collect()
        };
        let early = those(&[Kind::Once, Kind::Both]);
        let late = those(&[Kind::Tick, Kind::Both]);
        let mut moved = vec![Moved::Unneeded; kinds.len()];
        let mut once = with_rows(sum.of_columns(&early), |term, row| rows[term][row]);
        for list in lists(&mut once) {
            for element in list {
                *element = self.in_once(*element).unwrap_or(Element::Constant(0.0));
            }
        }
        let once = pushed(&mut self.once, Vector::Sum(once));
        for (column, element) in early.iter().zip(once) {
            moved[*column as usize] = Moved::Once(element);
        }
        let mut tick = with_rows(sum.of_columns(&late), |term, row| whole || !rows[term][row]);
        for (first, &column) in tick.first.iter_mut().zip(&late) {
            *first = match moved[column as usize] {
                Moved::Once(once) => self.keep(once),
                _ => self.in_tick(*first),
            };
        }
        for term in &mut tick.terms {
            term.of = self.all_in_tick(&term.of);
        }
        let tick = pushed(&mut self.tick, Vector::Sum(tick));
        for (column, element) in late.iter().zip(tick) {
            moved[*column as usize] = Moved::Tick(element);
        }
        moved
    }

    /// The two parts, where there are two.
    fn finish(mut self, mut outputs: Vec<Vec<Element>>) -> Option<Parts> {
        if self.kept.is_empty() {
            return None;
        }
        // The vector that was not there yet stands behind the inputs, which have no operands.
        let place = self.tick.inputs.len() as u32;
        let shifted = |element: &mut Element| {
            if let Element::Of { vector, .. } = element {
                *vector = match *vector {
                    KEPT => place,
                    id if id >= place => id + 1,
                    id => id,
                };
            }
        };
        for vector in &mut self.tick.vectors {
            match vector {
                Vector::Input(_) => {}
                Vector::Sum(sum) => lists(sum).into_iter().flatten().for_each(shifted),
                Vector::Unary(_, of) => of.iter_mut().for_each(shifted),
                Vector::Binary(_, of) => of.iter_mut().flatten().for_each(shifted),
            }
        }
        outputs.iter_mut().flatten().for_each(shifted);
        self.tick
            .vectors
            .insert(place as usize, Vector::Input(self.kept.len()));
        self.tick.inputs.push(place);
        self.tick.outputs = outputs;
        self.once.outputs = vec![self.kept];
        Some(Parts {
            once: self.once,
            tick: self.tick,
        })
    }
}

/// Where a column of a sum is calculated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Once,
    Tick,
    Both,
}

fn pushed(calculation: &mut Calculation, vector: Vector) -> Vec<Element> {
    if vector.len() == 0 {
        return Vec::new();
    }
    calculation.push(vector)
}

fn lists(sum: &mut Sum) -> Vec<&mut Vec<Element>> {
    let terms = sum.terms.iter_mut().map(|term| &mut term.of);
    std::iter::once(&mut sum.first).chain(terms).collect()
}

/// `sum` with those rows of each term alone for which `keep`, given both numbers, holds.
fn with_rows(sum: Sum, keep: impl Fn(usize, usize) -> bool) -> Sum {
    let terms = sum.terms.into_iter().enumerate().map(|(index, term)| {
        let columns = term.weights.columns;
        let rows: Vec<usize> = (0..term.of.len()).filter(|&row| keep(index, row)).collect();
        let numbers = rows.iter().flat_map(|row| {
            let start = row * columns;
            term.weights.numbers[start..start + columns].iter().copied()
        });
        Term {
            of: rows.iter().map(|&row| term.of[row]).collect(),
            weights: Arc::new(Weights {
                columns,
                numbers: numbers.collect(),
            }),
            columns: term.columns,
        }
    });
    Sum {
        first: sum.first,
        terms: terms.filter(|term| !term.of.is_empty()).collect(),
    }
}
