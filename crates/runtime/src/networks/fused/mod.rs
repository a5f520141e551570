//! A network as one operator in tract's place of many.
//!
//! tract runs a graph node by node, with a tensor for each value. The networks of the contract are
//! small, so half of their time goes into that, and their matrices are mostly zeros, which tract
//! multiplies. So a graph all of whose operators are known here (`recognise`) becomes one operator:
//! what it calculates is followed number by number (`calculation`), cut into what changes with the
//! body alone and the rest (`once`), and laid out as steps over one stretch of memory (`layout`,
//! `strips`, `program`). docs/design/fused.md has the reasons and the figures.

#[cfg(feature = "tract")]
mod calculation;
#[cfg(test)]
mod function_tests;
mod functions;
mod kernels;
#[cfg(feature = "tract")]
mod layout;
mod linear;
#[cfg(feature = "tract")]
mod once;
#[cfg(feature = "tract")]
mod operator;
mod parts;
mod program;
#[cfg(feature = "tract")]
mod recognise;
#[cfg(all(test, feature = "tract"))]
mod reference;
#[cfg(feature = "tract")]
mod strips;
#[cfg(all(test, feature = "tract"))]
mod tests;

use std::ops::Range;

#[cfg(feature = "tract")]
use tract_core::prelude::TypedModel;

use super::plans::{BATCH, Rows};
pub use linear::LinearDecoder;
#[cfg(feature = "tract")]
pub(super) use operator::operator;
pub(super) use parts::FusedParts;
use program::{Memory, Program};
#[cfg(feature = "tract")]
pub(super) use recognise::Unrecognised;

/// Numbers of an input that change seldom.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seldom {
    /// Which input.
    pub port: usize,
    /// Which of its numbers.
    pub numbers: Range<usize>,
}

/// A network that was recognised.
#[derive(Debug)]
pub(super) struct Fused {
    /// What depends on seldom changes alone.
    once: Option<Once>,
    /// The rest; where there is `once`, what that gives is its last input.
    tick: Program,
}

#[derive(Debug)]
struct Once {
    seldom: Seldom,
    program: Program,
}

/// What a thread needs to run a [`Fused`].
#[derive(Debug)]
pub(super) struct FusedMemory {
    once: Option<Memory>,
    tick: Memory,
}

impl Fused {
    /// The graph `model`, of one row, fused.
    ///
    /// # Errors
    /// The first node that is not known here.
    #[cfg(feature = "tract")]
    pub fn new(model: &TypedModel, seldom: Option<Seldom>) -> Result<Self, Unrecognised> {
        let calculation = recognise::recognise(model)?;
        let parts = seldom.as_ref().and_then(|seldom| {
            let Seldom { port, numbers } = seldom.clone();
            once::part(&calculation, port, numbers)
        });
        Ok(match (parts, seldom) {
            (Some(once::Parts { once, tick }), Some(seldom)) => Self {
                once: Some(Once {
                    seldom,
                    program: layout::program(once),
                }),
                tick: layout::program(tick),
            },
            _ => Self {
                once: None,
                tick: layout::program(calculation),
            },
        })
    }

    /// Memory for one row.
    pub fn memory(&self) -> FusedMemory {
        FusedMemory {
            once: self.once.as_ref().map(|once| Memory::new(&once.program)),
            tick: Memory::new(&self.tick),
        }
    }

    /// Runs the rows 0 to `count` of `rows`, [`BATCH`] at a time. A row's numbers do not depend on
    /// which others run with it.
    pub fn run(&self, memory: &mut FusedMemory, count: usize, rows: &mut impl Rows) {
        for start in (0..count).step_by(BATCH) {
            let batch = start..count.min(start + BATCH);
            memory.tick.reserve(&self.tick, batch.len());
            for (slot, row) in batch.clone().enumerate() {
                let numbers = memory.tick.row_mut(slot);
                let ports = self.tick.inputs.len() - usize::from(self.once.is_some());
                for (port, place) in self.tick.inputs[..ports].iter().enumerate() {
                    if !place.is_empty() {
                        rows.fill(port, row, &mut numbers[place.clone()]);
                    }
                }
                if let (Some(once), Some(own)) = (&self.once, &mut memory.once) {
                    let place = self.tick.inputs[ports].clone();
                    once.fill(own, row, rows, &mut numbers[place]);
                }
            }
            self.tick.run(&mut memory.tick, batch.len());
            for (slot, row) in batch.enumerate() {
                for (port, place) in self.tick.outputs.iter().enumerate() {
                    rows.take(port, row, &memory.tick.row(slot)[place.clone()]);
                }
            }
        }
    }
}

impl Once {
    /// Writes what depends on seldom changes to `target`: as it was kept with the row, or calculated
    /// anew where what it depends on has changed.
    fn fill(&self, memory: &mut Memory, row: usize, rows: &mut impl Rows, target: &mut [f32]) {
        let input = self.program.inputs[self.seldom.port].clone();
        let mut cause = 0..0;
        // What is the same in every run needs no input.
        if !input.is_empty() {
            rows.fill(self.seldom.port, row, &mut memory.row_mut(0)[input.clone()]);
            let Range { start, end } = self.seldom.numbers;
            cause = input.start + start..input.start + end;
        }
        let count = cause.len();
        let kept = rows.kept(row);
        let cause = &memory.row(0)[cause];
        if kept.len() == count + target.len() && kept[..count] == *cause {
            target.copy_from_slice(&kept[count..]);
            return;
        }
        kept.clear();
        kept.extend_from_slice(cause);
        self.program.run(memory, 1);
        let output = self.program.outputs[0].clone();
        target.copy_from_slice(&memory.row(0)[output]);
        kept.extend_from_slice(target);
    }
}
