//! A network as what runs it: fused into one program where its graph is recognised
//! ([`super::fused`]), or read as such a program from a lowered file ([`super::lowered`]); else as
//! plans of tract.

use std::sync::Arc;

#[cfg(feature = "tract")]
use tract_core::prelude::TypedModel;

#[cfg(feature = "tract")]
use super::fused::operator;
use super::fused::{Fused, FusedMemory, Seldom};
#[cfg(feature = "tract")]
use super::graph::{GraphPlans, GraphRunner, failed, plan};
use super::lowered;
#[cfg(feature = "tract")]
use crate::onnx::{Graph, read};
use crate::ports::Port;
use crate::{Network, RuntimeError};

/// Rows that run together: the width of tract's matrix kernels for WebAssembly.
pub(crate) const BATCH: usize = 8;

/// A network's file, read: what it takes and gives, and what it calculates.
pub(crate) struct NetworkFile {
    network: Network,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
    form: Form,
}

enum Form {
    Lowered(Box<Fused>),
    /// The file and its graph.
    #[cfg(feature = "tract")]
    Graph(Box<[u8]>, Box<TypedModel>),
}

/// A network that can be run.
#[derive(Debug)]
pub(crate) enum Plans {
    /// As one program.
    Fused(Arc<Fused>),
    /// As tract runs it.
    #[cfg(feature = "tract")]
    Graph(Arc<GraphPlans>),
}

impl NetworkFile {
    /// Reads a file, ONNX or lowered.
    ///
    /// # Errors
    /// [`RuntimeError::NotLowered`] for a lowered file that cannot be used, those of
    /// [`crate::onnx::read`] for any other; without the feature `tract`
    /// [`RuntimeError::NeedsLowered`].
    pub fn read(network: Network, bytes: &[u8]) -> Result<Self, RuntimeError> {
        if lowered::is_lowered(bytes) {
            let file = lowered::from_bytes(network, bytes)?;
            return Ok(Self {
                network,
                inputs: file.inputs,
                outputs: file.outputs,
                form: Form::Lowered(Box::new(file.fused)),
            });
        }
        Self::read_graph(network, bytes)
    }

    #[cfg(feature = "tract")]
    fn read_graph(network: Network, onnx_bytes: &[u8]) -> Result<Self, RuntimeError> {
        let graph = read(network, onnx_bytes, 1)?;
        Ok(Self {
            network,
            inputs: graph.inputs,
            outputs: graph.outputs,
            form: Form::Graph(onnx_bytes.into(), Box::new(graph.model)),
        })
    }

    #[cfg(not(feature = "tract"))]
    fn read_graph(network: Network, _onnx_bytes: &[u8]) -> Result<Self, RuntimeError> {
        Err(RuntimeError::NeedsLowered { network })
    }

    /// Gets the network ready, and tries it on zeros. `seldom` says which of a graph's inputs change
    /// seldom.
    ///
    /// # Errors
    /// [`RuntimeError::BrokenContract`], [`RuntimeError::Inference`], [`RuntimeError::NonFinite`].
    #[cfg_attr(not(feature = "tract"), allow(unused_variables))]
    pub fn into_plans(self, seldom: Option<Seldom>) -> Result<Plans, RuntimeError> {
        let network = self.network;
        match self.form {
            Form::Lowered(fused) => {
                let mut trial = Zeros {
                    sound: true,
                    kept: Vec::new(),
                };
                fused.run(&mut fused.memory(), 1, &mut trial);
                if !trial.sound {
                    return Err(RuntimeError::NonFinite { network });
                }
                Ok(Plans::Fused(Arc::new(*fused)))
            }
            #[cfg(feature = "tract")]
            Form::Graph(bytes, model) => {
                let (inputs, outputs) = (self.inputs, self.outputs);
                let graph = Graph {
                    model: *model,
                    inputs,
                    outputs,
                };
                Plans::of_graph(network, &bytes, graph, seldom)
            }
        }
    }
}

#[cfg(feature = "tract")]
impl NetworkFile {
    /// The network as tract runs it, whether its graph is recognised or not: the reference.
    ///
    /// # Errors
    /// As [`Self::into_plans`]; [`RuntimeError::NotOnnx`] for a lowered file.
    pub fn into_plain_plans(self) -> Result<Plans, RuntimeError> {
        let network = self.network;
        let Form::Graph(bytes, model) = self.form else {
            return Err(RuntimeError::NotOnnx {
                network,
                reason: "it is a lowered file".to_owned(),
            });
        };
        let (inputs, outputs) = (self.inputs, self.outputs);
        let graph = Graph {
            model: *model,
            inputs,
            outputs,
        };
        Ok(Plans::Graph(Arc::new(GraphPlans::new(
            network, &bytes, graph,
        )?)))
    }

    /// The network as a lowered file, made from an ONNX file of this hash.
    ///
    /// # Errors
    /// [`RuntimeError::CannotLower`] where its graph is not recognised.
    pub fn lower(
        self,
        onnx_sha256: [u8; 32],
        seldom: Option<Seldom>,
    ) -> Result<Vec<u8>, RuntimeError> {
        let network = self.network;
        let fused = match self.form {
            Form::Lowered(fused) => *fused,
            Form::Graph(_, model) => {
                Fused::new(&model, seldom).map_err(|unknown| RuntimeError::CannotLower {
                    network,
                    node: unknown.node,
                    operator: unknown.operator,
                })?
            }
        };
        let ports = (self.inputs, self.outputs);
        Ok(lowered::to_bytes(network, onnx_sha256, ports, &fused))
    }
}

impl Plans {
    /// The program; none where tract runs the network.
    pub fn fused(&self) -> Option<&Fused> {
        match self {
            Self::Fused(fused) => Some(fused),
            #[cfg(feature = "tract")]
            Self::Graph(_) => None,
        }
    }
}

#[cfg(feature = "tract")]
impl Plans {
    fn of_graph(
        network: Network,
        onnx_bytes: &[u8],
        graph: Graph,
        seldom: Option<Seldom>,
    ) -> Result<Self, RuntimeError> {
        let Ok(fused) = Fused::new(&graph.model, seldom) else {
            let plans = GraphPlans::new(network, onnx_bytes, graph)?;
            return Ok(Self::Graph(Arc::new(plans)));
        };
        let fused = Arc::new(fused);
        let model = operator(&graph.model, &fused).map_err(|error| failed(network, &error))?;
        plan(network, Graph { model, ..graph })?;
        Ok(Self::Fused(fused))
    }
}

/// What a network reads and writes, row by row.
pub(crate) trait Rows {
    /// Writes the numbers of row `row` of input `port`.
    fn fill(&self, port: usize, row: usize, target: &mut [f32]);
    /// Gets the numbers of row `row` of output `port`; they may be NaN or infinite.
    fn take(&mut self, port: usize, row: usize, source: &[f32]);
    /// What the network keeps for row `row` from one run to the next: empty before its first.
    fn kept(&mut self, row: usize) -> &mut Vec<f32>;
}

/// A row of zeros, and whether all that comes of it is finite.
struct Zeros {
    sound: bool,
    kept: Vec<f32>,
}

impl Rows for Zeros {
    fn fill(&self, _port: usize, _row: usize, target: &mut [f32]) {
        target.fill(0.0);
    }

    fn take(&mut self, _port: usize, _row: usize, source: &[f32]) {
        self.sound &= finite(source);
    }

    fn kept(&mut self, _row: usize) -> &mut Vec<f32> {
        &mut self.kept
    }
}

/// What runs a network; not shared between threads.
#[derive(Debug)]
pub(crate) enum Runner {
    /// In this memory.
    Fused(Arc<Fused>, Box<FusedMemory>),
    /// By tract.
    #[cfg(feature = "tract")]
    Graph(Box<GraphRunner>),
}

impl Runner {
    /// Sets up runs of `plans`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot.
    pub fn new(plans: &Plans) -> Result<Self, RuntimeError> {
        Ok(match plans {
            Plans::Fused(fused) => Self::Fused(Arc::clone(fused), Box::new(fused.memory())),
            #[cfg(feature = "tract")]
            Plans::Graph(plans) => Self::Graph(Box::new(GraphRunner::new(plans)?)),
        })
    }

    /// Runs the rows 0 to `count` of `rows`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`].
    pub fn run(&mut self, count: usize, rows: &mut impl Rows) -> Result<(), RuntimeError> {
        match self {
            Self::Fused(fused, memory) => {
                fused.run(memory, count, rows);
                Ok(())
            }
            #[cfg(feature = "tract")]
            Self::Graph(runner) => runner.run(count, rows),
        }
    }
}

/// Numbers beyond this overflow in what is computed from them.
const LARGEST: f32 = 3.4e9;

/// Whether no number is NaN, infinite, or so large that what is computed from it overflows.
pub(crate) fn finite(numbers: &[f32]) -> bool {
    // Without the sign, the bits of larger numbers, infinity and NaN are greater. The greatest of
    // integers is found several at once, where a test of each number, or a sum, would be one after
    // the other.
    let bits = numbers.iter().map(|n| n.to_bits() & !(1 << 31));
    bits.fold(0, u32::max) <= LARGEST.to_bits()
}
