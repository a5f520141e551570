//! The runtime's errors.

use std::fmt;

use thiserror::Error;

/// One of a bundle's two networks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Network {
    /// Features and state to latent and next state.
    Predictor,
    /// Latent to offsets.
    Decoder,
}

impl fmt::Display for Network {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Predictor => "predictor",
            Self::Decoder => "decoder",
        })
    }
}

/// What can go wrong when a bundle is loaded or an avatar is stepped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RuntimeError {
    /// `bundle.json` is not JSON, or a field is missing or of the wrong type.
    #[error(
        "bundle.json cannot be read: {reason}; download it again, or write it with `dynaskin train`"
    )]
    BundleJson {
        /// What kind of file it is instead, or what the JSON parser found, with line and column.
        reason: String,
    },
    /// `bundle.json` is of a kind or version this build does not know.
    #[error(
        "bundle.json says {field} = {got}, this build reads {expected}; update dynaskin or export \
         the bundle again"
    )]
    BundleVersion {
        /// `format` or `version`.
        field: &'static str,
        /// The only value known here.
        expected: String,
        /// The value found.
        got: String,
    },
    /// The bundle is one of a compared method, whose code this build leaves out.
    #[error(
        "{place} needs {needs}, which only the methods have that dynaskin is compared with; this build \
         is without them: use one with the cargo feature `guests`"
    )]
    LeftOut {
        /// `bundle.json`, or which network.
        place: String,
        /// What is missing.
        needs: String,
    },
    /// A field of `bundle.json` contradicts the body, the networks or another field.
    #[error(
        "bundle.json's {field}: expected {expected}, got {got}; the files do not belong together, \
         so export the bundle again"
    )]
    BundleField {
        /// The field.
        field: &'static str,
        /// What it should be.
        expected: String,
        /// What it is.
        got: String,
    },
    /// A file that the bundle names could not be read.
    #[error("the bundle's file `{file}` could not be read: {reason}")]
    ReadFile {
        /// The file's name in `bundle.json`.
        file: String,
        /// What the host says.
        reason: String,
    },
    /// A file is not the one the bundle was made with.
    #[error(
        "`{file}` has SHA-256 {got}, bundle.json expects {expected}; fetch the file again, or \
         export the bundle again if you changed it"
    )]
    HashMismatch {
        /// The file's name in `bundle.json`.
        file: String,
        /// Hash in `bundle.json`.
        expected: String,
        /// Hash of the file.
        got: String,
    },
    /// The body file cannot be used.
    #[error(transparent)]
    Body(#[from] dynaskin_body::BodyError),
    /// The bytes are no ONNX file.
    #[error("the {network} is not an ONNX file: {reason}; check that the download is complete")]
    NotOnnx {
        /// Which network.
        network: Network,
        /// What the decoder found.
        reason: String,
    },
    /// A lowered file cannot be used.
    #[error(
        "the {network} is not a lowered network that this build plays: {reason}; write it again with \
         `dynaskin slim`"
    )]
    NotLowered {
        /// Which network.
        network: Network,
        /// What is wrong with the file.
        reason: String,
    },
    /// A build without tract was given an ONNX file.
    #[error(
        "the {network} is not a lowered file, and this build plays no others: write it with \
         `dynaskin slim`, or use the whole core, which plays ONNX files"
    )]
    NeedsLowered {
        /// Which network.
        network: Network,
    },
    /// A bundle whose lowered files are asked for names none.
    #[error(
        "bundle.json names no lowered networks, which this build needs: write them with `dynaskin \
         slim`, or use the whole core, which plays ONNX files"
    )]
    NoLowered,
    /// A graph has an operator that only tract runs.
    #[error(
        "the {network} cannot be lowered: its node `{node}` ({operator}) is none of those that lowered \
         networks have; play this bundle with the whole core"
    )]
    CannotLower {
        /// Which network.
        network: Network,
        /// The node's name.
        node: String,
        /// Its operator.
        operator: String,
    },
    /// The graph uses an operator outside the set that the runtime implements.
    #[error(
        "the {network}'s node `{node}` uses the operator {operator}, which the runtime does not \
         have; it has {supported}"
    )]
    UnknownOperator {
        /// Which network.
        network: Network,
        /// The node's name.
        node: String,
        /// The operator, with its domain if it is not ONNX's own.
        operator: String,
        /// The operators there are.
        supported: String,
    },
    /// The graph contradicts itself or the ONNX operators' definitions.
    #[error("the {network} is not a valid graph: {place}: {problem}; export it again")]
    InvalidGraph {
        /// Which network.
        network: Network,
        /// Node, value or field.
        place: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The graph is valid ONNX but not what the bundle contract asks for.
    #[error(
        "the {network} breaks the bundle contract: {place}: expected {expected}, got {got} (see \
         ARCHITECTURE.md, \"ONNX\")"
    )]
    BrokenContract {
        /// Which network.
        network: Network,
        /// Input, output or field.
        place: String,
        /// What the contract asks for.
        expected: String,
        /// What the graph has.
        got: String,
    },
    /// The inference library refused the graph or failed while running it.
    #[error("the {network} could not be run: {reason}")]
    Inference {
        /// Which network.
        network: Network,
        /// The library's message.
        reason: String,
    },
    /// A network put out NaN, an infinite number, or one so large that what follows overflows.
    #[error(
        "the {network} put out a number that is not finite, or above 3e9; its weights are unusable, so \
         use another bundle or train again"
    )]
    NonFinite {
        /// Which network.
        network: Network,
    },
    /// A clip whose features were asked for is not at the model's rate.
    #[error("the clip is at {got_hz} Hz; features need 60 Hz, so resample the clip first")]
    ClipRate {
        /// The clip's rate.
        got_hz: f64,
    },
    /// A pose holds NaN, an infinite number, a quaternion that is not of unit length, or a
    /// translation of more than a thousand kilometres.
    #[error(
        "the pose's {place} is {value}; every number must be finite, the translation below 1e6 m \
         and every quaternion of unit length (within 0.001), so normalise quaternions before \
         handing them over"
    )]
    InvalidPose {
        /// The part of the pose: `root_translation_m` or a joint's name.
        place: String,
        /// What stands there.
        value: String,
    },
    /// A time step is negative, not finite, or longer than a day.
    #[error(
        "the time step is {got} s; give the seconds since the last step (not milliseconds, not a \
         date), from 0 to 86400"
    )]
    InvalidTimeStep {
        /// The step given, in seconds.
        got: f64,
    },
    /// A distance is negative or not a number.
    #[error("the distance to the camera is {got} m; give a number of metres from 0")]
    InvalidDistance {
        /// The distance given, in metres.
        got: f64,
    },
    /// A level of detail that contradicts itself.
    #[error("the level of detail's {field} is {got}; {expected}")]
    InvalidLevelOfDetail {
        /// The field.
        field: &'static str,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// A crowd was given avatars that it cannot step.
    #[error("the crowd cannot be stepped: {problem}")]
    InvalidCrowd {
        /// What is wrong.
        problem: String,
    },
    /// Shape coefficients of the wrong number or size.
    #[error("the shape has {problem}; give {expected} finite coefficients between -5 and 5")]
    InvalidShape {
        /// Number of coefficients.
        expected: usize,
        /// What is wrong.
        problem: String,
    },
    /// Bytes that were to be a saved state of an avatar.
    #[error("the saved state cannot be used: {problem}; save it again with this model")]
    InvalidState {
        /// What is wrong with it.
        problem: String,
    },
    /// Offsets that a host wants shown cannot be.
    #[error(
        "these offsets cannot be shown: {problem}; give three finite numbers for each vertex to an \
         avatar made of a body alone"
    )]
    InvalidOffsets {
        /// What is wrong with them.
        problem: String,
    },
    /// A control of an avatar is too small, too large or not finite.
    #[error("{control} is {got}; give a number from {least} to {limit}")]
    InvalidControl {
        /// Which control, and of which region.
        control: String,
        /// The number given.
        got: f32,
        /// Smallest allowed.
        least: f32,
        /// Largest allowed.
        limit: f32,
    },
}

impl RuntimeError {
    /// What was refused, in one word: `bundle`, `body`, `network`, `motion`, `pose`, `shape`,
    /// `state` or `argument`. The SDK's `error.code` carries it.
    pub fn code(&self) -> &'static str {
        match self {
            Self::BundleJson { .. }
            | Self::BundleVersion { .. }
            | Self::LeftOut { .. }
            | Self::BundleField { .. }
            | Self::ReadFile { .. }
            | Self::NoLowered
            | Self::HashMismatch { .. } => "bundle",
            Self::Body(_) => "body",
            Self::NotOnnx { .. }
            | Self::NotLowered { .. }
            | Self::NeedsLowered { .. }
            | Self::CannotLower { .. }
            | Self::UnknownOperator { .. }
            | Self::InvalidGraph { .. }
            | Self::BrokenContract { .. }
            | Self::Inference { .. }
            | Self::NonFinite { .. } => "network",
            Self::ClipRate { .. } => "motion",
            Self::InvalidPose { .. } => "pose",
            Self::InvalidShape { .. } => "shape",
            Self::InvalidState { .. } => "state",
            Self::InvalidTimeStep { .. }
            | Self::InvalidDistance { .. }
            | Self::InvalidLevelOfDetail { .. }
            | Self::InvalidCrowd { .. }
            | Self::InvalidOffsets { .. }
            | Self::InvalidControl { .. } => "argument",
        }
    }
}
