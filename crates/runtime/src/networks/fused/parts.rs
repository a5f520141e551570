//! Fused networks as they stand in lowered files, and the checks that make what was read safe to run.
//!
//! Steps take their places and weights one after the other, so a file says only how many each takes:
//! what a run costs is then bounded by the file's size.

use std::ops::Range;

use half::f16;
use serde::{Deserialize, Serialize};

use super::functions::{Binary, Unary};
use super::kernels::{LANES, MOST_COLUMNS};
use super::program::{Multiply, Program, Step};
use super::{Fused, Once, Seldom};

/// Most numbers of a row's memory: 16 MiB.
const MOST_NUMBERS: usize = 1 << 22;

/// A [`Fused`] without what follows from the rest.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::networks) struct FusedParts {
    once: Option<OnceParts>,
    tick: ProgramParts,
}

#[derive(Debug, Serialize, Deserialize)]
struct OnceParts {
    port: usize,
    numbers: Range<usize>,
    program: ProgramParts,
}

#[derive(Debug, Serialize, Deserialize)]
struct ProgramParts {
    /// Numbers of a row's memory.
    length: usize,
    /// Those of them that are not 0 before the first run, and their places.
    constants: Vec<(u32, f32)>,
    inputs: Vec<Range<usize>>,
    outputs: Vec<Range<usize>>,
    steps: Vec<StepParts>,
    places: Vec<u32>,
    weights: Weights,
}

#[derive(Debug, Serialize, Deserialize)]
enum StepParts {
    Multiply {
        first: Option<usize>,
        width: usize,
        to: usize,
        rows: usize,
    },
    Unary {
        function: Unary,
        from: usize,
        to: usize,
        length: usize,
    },
    Binary {
        function: Binary,
        from: [usize; 2],
        to: usize,
        length: usize,
    },
    Gather {
        count: usize,
        to: usize,
    },
}

/// Numbers as bytes, little-endian: two each where that loses nothing.
#[derive(Debug, Serialize, Deserialize)]
enum Weights {
    Half(Vec<u8>),
    Single(Vec<u8>),
}

/// What is wrong with a file's contents.
pub(in crate::networks) type Problem = &'static str;

impl FusedParts {
    /// What `fused` is made of.
    #[cfg(feature = "tract")]
    pub fn of(fused: &Fused) -> Self {
        Self {
            once: fused.once.as_ref().map(|once| OnceParts {
                port: once.seldom.port,
                numbers: once.seldom.numbers.clone(),
                program: ProgramParts::of(&once.program),
            }),
            tick: ProgramParts::of(&fused.tick),
        }
    }

    /// The network, for inputs and outputs of so many numbers.
    ///
    /// # Errors
    /// What does not fit.
    pub fn fused(self, inputs: &[usize], outputs: &[usize]) -> Result<Fused, Problem> {
        let tick = self.tick.program()?;
        let mut widths = inputs.to_vec();
        let once = match self.once {
            None => None,
            Some(parts) => {
                let once = parts.once(inputs)?;
                let output = &once.program.outputs[0];
                widths.push(output.len());
                // Written in any case.
                if tick.inputs.last().map(Range::len) != Some(output.len()) {
                    return Err("the two parts do not fit each other");
                }
                Some(once)
            }
        };
        fit(&tick.inputs, &widths, true)?;
        fit(&tick.outputs, outputs, false)?;
        Ok(Fused { once, tick })
    }
}

impl OnceParts {
    fn once(self, inputs: &[usize]) -> Result<Once, Problem> {
        let program = self.program.program()?;
        fit(&program.inputs, inputs, true)?;
        let fits =
            |width: &usize| self.numbers.start <= self.numbers.end && self.numbers.end <= *width;
        if program.outputs.len() != 1 || !inputs.get(self.port).is_some_and(fits) {
            return Err("the part for seldom changes has wrong ports");
        }
        Ok(Once {
            seldom: Seldom {
                port: self.port,
                numbers: self.numbers,
            },
            program,
        })
    }
}

/// Whether ports have so many numbers; or none, where that is `optional`.
fn fit(ports: &[Range<usize>], widths: &[usize], optional: bool) -> Result<(), Problem> {
    let fits = |(port, width): (&Range<usize>, &usize)| {
        port.len() == *width || optional && port.is_empty()
    };
    if ports.len() == widths.len() && ports.iter().zip(widths).all(fits) {
        return Ok(());
    }
    Err("its inputs and outputs are not those of its program")
}

impl ProgramParts {
    #[cfg(feature = "tract")]
    fn of(program: &Program) -> Self {
        let numbers = (0..).zip(&program.memory);
        let constants = numbers.filter(|(_, number)| number.to_bits() != 0);
        Self {
            length: program.memory.len(),
            constants: constants.map(|(place, number)| (place, *number)).collect(),
            inputs: program.inputs.clone(),
            outputs: program.outputs.clone(),
            steps: program.steps.iter().map(StepParts::of).collect(),
            places: program.places.clone(),
            weights: Weights::of(&program.weights),
        }
    }

    /// The program, all of whose places lie where they may.
    fn program(self) -> Result<Program, Problem> {
        let length = self.length;
        if length > MOST_NUMBERS {
            return Err("its memory is too large");
        }
        let mut memory = vec![0.0; length];
        for (place, number) in self.constants {
            *memory
                .get_mut(place as usize)
                .ok_or("a constant lies outside")? = number;
        }
        let inside = |range: &Range<usize>| range.start <= range.end && range.end <= length;
        if !self.inputs.iter().chain(&self.outputs).all(inside) {
            return Err("a port lies outside");
        }
        let mut program = Program {
            memory,
            inputs: self.inputs,
            outputs: self.outputs,
            steps: Vec::with_capacity(self.steps.len()),
            places: self.places,
            weights: self.weights.numbers()?,
        };
        let mut cursor = Cursor::default();
        for step in self.steps {
            let step = cursor.step(step, &program)?;
            program.steps.push(step);
        }
        let all = (program.places.len(), program.weights.len());
        if (cursor.places, cursor.weights) != all {
            return Err("its steps are not those of its numbers");
        }
        Ok(program)
    }
}

/// How far steps have come.
#[derive(Default)]
struct Cursor {
    places: usize,
    weights: usize,
    /// Numbers that they write.
    written: usize,
}

impl Cursor {
    /// The next step, checked.
    fn step(&mut self, step: StepParts, program: &Program) -> Result<Step, Problem> {
        let length = program.memory.len();
        // Numbers `count` from `from` on lie before `end`.
        let before = |from: usize, count: usize, end: usize| {
            from.checked_add(count).is_some_and(|last| last <= end)
        };
        let outside = "a step reads or writes outside";
        let (step, to, count) = match step {
            StepParts::Multiply {
                first,
                width,
                to,
                rows,
            } => {
                let is_strip =
                    (LANES..=MOST_COLUMNS).contains(&width) && width.is_multiple_of(LANES);
                if !is_strip || !first.is_none_or(|first| before(first, width, to)) {
                    return Err(outside);
                }
                let places = self.places(rows, to, program)?;
                let start = self.weights;
                // At most the number of places times 24.
                self.weights += rows * width;
                if self.weights > program.weights.len() {
                    return Err("weights are missing");
                }
                let weights = start..self.weights;
                (
                    Step::Multiply(Multiply {
                        first,
                        width,
                        to,
                        places,
                        weights,
                    }),
                    to,
                    width,
                )
            }
            StepParts::Unary {
                function,
                from,
                to,
                length: own,
            } => {
                let count = rounded(own, length)?;
                if !before(from, count, to) {
                    return Err(outside);
                }
                (
                    Step::Unary {
                        function,
                        from,
                        to,
                        length: own,
                    },
                    to,
                    count,
                )
            }
            StepParts::Binary {
                function,
                from,
                to,
                length: own,
            } => {
                let count = rounded(own, length)?;
                if !from.iter().all(|from| before(*from, count, to)) {
                    return Err(outside);
                }
                (
                    Step::Binary {
                        function,
                        from,
                        to,
                        length: own,
                    },
                    to,
                    count,
                )
            }
            StepParts::Gather { count, to } => {
                let places = self.places(count, to, program)?;
                (Step::Gather { places, to }, to, count)
            }
        };
        if !before(to, count, length) {
            return Err(outside);
        }
        self.written += count;
        // Every number is written once, but stretches that begin at any number are rounded up to four.
        if self.written > LANES * length {
            return Err("its steps write more than its memory");
        }
        Ok(step)
    }

    /// The next `count` places, all before `to`.
    fn places(
        &mut self,
        count: usize,
        to: usize,
        program: &Program,
    ) -> Result<Range<usize>, Problem> {
        let end = self.places.checked_add(count);
        let range = self.places..end.unwrap_or(usize::MAX);
        let places = program
            .places
            .get(range.clone())
            .ok_or("places are missing")?;
        if !places.iter().all(|place| (*place as usize) < to) {
            return Err("a step reads what comes after it");
        }
        self.places = range.end;
        Ok(range)
    }
}

/// `count` as steps of four walk it, at most `most`.
fn rounded(count: usize, most: usize) -> Result<usize, Problem> {
    if count > most {
        return Err("a step is too long");
    }
    Ok(count.next_multiple_of(LANES))
}

impl StepParts {
    #[cfg(feature = "tract")]
    fn of(step: &Step) -> Self {
        match step.clone() {
            Step::Multiply(strip) => Self::Multiply {
                first: strip.first,
                width: strip.width,
                to: strip.to,
                rows: strip.places.len(),
            },
            Step::Unary {
                function,
                from,
                to,
                length,
            } => Self::Unary {
                function,
                from,
                to,
                length,
            },
            Step::Binary {
                function,
                from,
                to,
                length,
            } => Self::Binary {
                function,
                from,
                to,
                length,
            },
            Step::Gather { places, to } => Self::Gather {
                count: places.len(),
                to,
            },
        }
    }
}

impl Weights {
    #[cfg(feature = "tract")]
    fn of(numbers: &[f32]) -> Self {
        let half = |number: &f32| {
            let half = f16::from_f32(*number);
            (half.to_f32().to_bits() == number.to_bits()).then(|| half.to_le_bytes())
        };
        let halves: Option<Vec<[u8; 2]>> = numbers.iter().map(half).collect();
        match halves {
            Some(halves) => Self::Half(halves.concat()),
            None => Self::Single(numbers.iter().flat_map(|n| n.to_le_bytes()).collect()),
        }
    }

    fn numbers(&self) -> Result<Vec<f32>, Problem> {
        let (numbers, rest): (Vec<f32>, &[u8]) = match self {
            Self::Half(bytes) => {
                let (chunks, rest) = bytes.as_chunks();
                let number = |bytes: &[u8; 2]| f16::from_le_bytes(*bytes).to_f32();
                (chunks.iter().map(number).collect(), rest)
            }
            Self::Single(bytes) => {
                let (chunks, rest) = bytes.as_chunks();
                (
                    chunks
                        .iter()
                        .map(|bytes| f32::from_le_bytes(*bytes))
                        .collect(),
                    rest,
                )
            }
        };
        if rest.is_empty() {
            return Ok(numbers);
        }
        Err("a weight is cut")
    }
}
