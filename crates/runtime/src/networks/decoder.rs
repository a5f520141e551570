//! The decoder: its contract and its runs.

use std::sync::OnceLock;

use super::fused::LinearDecoder;
use super::plans::{NetworkFile, Plans, Rows, Runner, finite};
use crate::ports::{broken, names, row};
use crate::{Network, RuntimeError};

const NETWORK: Network = Network::Decoder;

/// The decoder: latent to offsets.
#[derive(Debug)]
pub struct Decoder {
    plans: Plans,
    latent_count: usize,
    vertex_count: usize,
    /// Made when first asked for; none where it is not linear.
    linear: OnceLock<Option<LinearDecoder>>,
}

/// One call of the decoder, of which [`DecoderSession::decode_rows`] makes several at once.
pub(crate) trait DecoderRow {
    /// What is decoded.
    fn latent(&self) -> &[f32];
    /// Where the offsets go, three numbers a vertex, in metres.
    fn offsets_m(&mut self) -> &mut [f32];
}

/// A use of a [`Decoder`] by one thread.
#[derive(Debug)]
pub struct DecoderSession {
    runner: Runner,
    latent_count: usize,
    vertex_count: usize,
}

impl Decoder {
    /// Reads `bytes`, an ONNX or a lowered file, and checks it against the contract.
    ///
    /// # Errors
    /// As [`super::Predictor::load`].
    pub fn load(bytes: &[u8]) -> Result<Self, RuntimeError> {
        Self::of(NetworkFile::read(NETWORK, bytes)?, |file| {
            file.into_plans(None)
        })
    }

    /// As [`Self::load`], run by tract: the reference.
    ///
    /// # Errors
    /// As [`Self::load`].
    #[cfg(feature = "tract")]
    pub(super) fn load_plain(onnx_bytes: &[u8]) -> Result<Self, RuntimeError> {
        Self::of(
            NetworkFile::read(NETWORK, onnx_bytes)?,
            NetworkFile::into_plain_plans,
        )
    }

    fn of(
        graph: NetworkFile,
        plans: impl Fn(NetworkFile) -> Result<Plans, RuntimeError>,
    ) -> Result<Self, RuntimeError> {
        if graph.inputs.len() != 1 || graph.outputs.len() != 1 {
            let got = format!("{}; {}", names(&graph.inputs), names(&graph.outputs));
            let expected = "input `latent`; output `offsets`";
            return Err(broken(NETWORK, "ports", expected, got));
        }
        let (_, latent_count) = row(NETWORK, &graph.inputs, "latent")?;
        let output = &graph.outputs[0];
        let vertex_count = match output.shape[..] {
            [1, vertices, 3] if output.name == "offsets" => vertices,
            _ => {
                let got = format!("`{}` {:?}", output.name, output.shape);
                return Err(broken(NETWORK, "output", "`offsets` [1, V, 3]", got));
            }
        };
        Ok(Self {
            plans: plans(graph)?,
            latent_count,
            vertex_count,
            linear: OnceLock::new(),
        })
    }

    /// The decoder as one matrix of finite numbers; none where it is anything else, or is not recognised.
    pub fn linear(&self) -> Option<&LinearDecoder> {
        let linear = self.linear.get_or_init(|| {
            let linear = self.plans.fused()?.linear()?;
            // Whoever else decodes need not look for what is not finite: steps do.
            finite(linear.weights().as_flattened()).then_some(linear)
        });
        linear.as_ref()
    }

    /// L: numbers that [`DecoderSession::decode`] takes.
    pub fn latent_count(&self) -> usize {
        self.latent_count
    }

    /// V: a third of the numbers that [`DecoderSession::decode`] writes.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}

impl DecoderSession {
    /// Sets up runs of `decoder`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot set them up.
    pub fn new(decoder: &Decoder) -> Result<Self, RuntimeError> {
        Ok(Self {
            runner: Runner::new(&decoder.plans)?,
            latent_count: decoder.latent_count,
            vertex_count: decoder.vertex_count,
        })
    }

    /// V: a third of the numbers that [`Self::decode`] writes.
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Decodes `latent` into `offsets_m`, three numbers a vertex.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], also for a wrong length; [`RuntimeError::NonFinite`].
    pub fn decode(&mut self, latent: &[f32], offsets_m: &mut [f32]) -> Result<(), RuntimeError> {
        struct One<'a>(&'a [f32], &'a mut [f32]);
        impl DecoderRow for One<'_> {
            fn latent(&self) -> &[f32] {
                self.0
            }
            fn offsets_m(&mut self) -> &mut [f32] {
                self.1
            }
        }
        self.decode_rows(&mut [One(latent, offsets_m)])
    }

    /// Decodes several rows.
    ///
    /// # Errors
    /// As [`Self::decode`], for all rows if for one.
    pub(crate) fn decode_rows(&mut self, rows: &mut [impl DecoderRow]) -> Result<(), RuntimeError> {
        let expected = (self.latent_count, 3 * self.vertex_count);
        let count = rows.len();
        for row in rows.iter_mut() {
            let got = (row.latent().len(), row.offsets_m().len());
            if got != expected {
                let reason = format!("it turns {expected:?} numbers into each other, not {got:?}");
                return Err(RuntimeError::Inference {
                    network: NETWORK,
                    reason,
                });
            }
        }
        let mut run = Run {
            rows,
            sound: true,
            kept: Vec::new(),
        };
        self.runner.run(count, &mut run)?;
        if run.sound {
            Ok(())
        } else {
            Err(RuntimeError::NonFinite { network: NETWORK })
        }
    }
}

/// The rows of one run.
struct Run<'a, R> {
    rows: &'a mut [R],
    /// Whether all numbers so far were finite.
    sound: bool,
    /// Nothing: all of a decoder's inputs change with every run.
    kept: Vec<f32>,
}

impl<R: DecoderRow> Rows for Run<'_, R> {
    fn fill(&self, _port: usize, row: usize, target: &mut [f32]) {
        target.copy_from_slice(self.rows[row].latent());
    }

    fn take(&mut self, _port: usize, row: usize, source: &[f32]) {
        self.sound &= finite(source);
        self.rows[row].offsets_m().copy_from_slice(source);
    }

    fn kept(&mut self, _row: usize) -> &mut Vec<f32> {
        &mut self.kept
    }
}
