//! What can go wrong with a motion.

use dynaskin_body::Joint;

/// A motion file, clip or parameter that cannot be used, with the place and what would be right.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The text is not the BVH that was expected at this line.
    #[error("BVH line {line}: expected {expected}, found {found}")]
    Syntax {
        /// Line, counted from 1.
        line: usize,
        /// What would be right here.
        expected: String,
        /// What stands there instead, shortened.
        found: String,
    },
    /// The file ends too early.
    #[error(
        "BVH ends at line {line}, expected {expected}; the file seems truncated, export it again"
    )]
    Truncated {
        /// Last line, counted from 1.
        line: usize,
        /// What is missing.
        expected: String,
    },
    /// A number is not finite or absurdly large.
    #[error("BVH line {line}: {found} is not a usable number (finite, below 1e9 in size)")]
    BadNumber {
        /// Line, counted from 1.
        line: usize,
        /// The text of the number.
        found: String,
    },
    /// The file asks for more than this reader accepts.
    #[error("BVH line {line}: {what} is {got}, at most {limit} are accepted")]
    Limit {
        /// Line, counted from 1.
        line: usize,
        /// What is counted.
        what: &'static str,
        /// Largest accepted count.
        limit: usize,
        /// The file's count.
        got: usize,
    },
    /// A frame's values do not end where its line ends.
    #[error(
        "BVH line {line}: the values of frame {frame} do not end with the line; each frame needs \
         exactly {expected} values (the sum of all CHANNELS)"
    )]
    FrameLength {
        /// Line, counted from 1.
        line: usize,
        /// Frame, counted from 1.
        frame: usize,
        /// Values per frame.
        expected: usize,
    },
    /// More values follow the number of frames the file announced.
    #[error("BVH line {line}: more values after the {frames} announced by `Frames:`")]
    ExtraFrames {
        /// Line of the first surplus value, counted from 1.
        line: usize,
        /// Announced number of frames.
        frames: usize,
    },
    /// `Frame Time:` is not a time step that can be played.
    #[error("BVH line {line}: frame time {found} s, expected between 0.0001 and 10 seconds")]
    FrameTime {
        /// Line, counted from 1.
        line: usize,
        /// The file's value.
        found: f64,
    },
    /// The joint names do not show a human skeleton.
    #[error(
        "no source joint found for {}; recognised {recognised} of the file's {total} joints. Rename \
         them as in CMU, Mixamo or SMPL skeletons (Hips, LeftUpLeg, LeftLeg, LeftArm, LeftForeArm, ...) \
         or say which joint is which (`joints` of a motion, `bones` of an avatar: left_hip is `...`). The \
         file's joints: {}",
        list(.missing),
        shortened(.names)
    )]
    MissingJoints {
        /// Joints without which there is no retargeting.
        missing: Vec<Joint>,
        /// Number of joints recognised.
        recognised: usize,
        /// Number of joints in the file.
        total: usize,
        /// Names of the joints in the file.
        names: Vec<String>,
    },
    /// The caller named a joint that cannot be used.
    #[error(
        "the joint `{name}`, named for {}, {problem}; the file's joints: {}",
        .joint.name(),
        shortened(.available)
    )]
    NamedJoint {
        /// The body's joint.
        joint: Joint,
        /// The name that was given.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
        /// Names of the joints in the file.
        available: Vec<String>,
    },
    /// The body has no joint of that name.
    #[error(
        "the body has no joint `{name}`; it has {}",
        list(&Joint::ALL)
    )]
    UnknownBodyJoint {
        /// The name that was given.
        name: String,
    },
    /// The file has no such animation.
    #[error("the file has no animation {asked}; it has {}", shortened(.available))]
    UnknownAnimation {
        /// What was asked for.
        asked: String,
        /// Place and name of each animation of the file.
        available: Vec<String>,
    },
    /// An option was given that means nothing for this kind of file.
    #[error("the option `{option}` means nothing for {kind}; leave it out for this file")]
    OptionNotForFile {
        /// The option.
        option: &'static str,
        /// The kind of file.
        kind: &'static str,
    },
    /// The rest pose of a skeleton has no usable geometry.
    #[error("{skeleton} skeleton: {problem}")]
    Degenerate {
        /// `source` or `target`.
        skeleton: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// The body is taken farther from its start than any motion leads.
    #[error(
        "frame {frame}: the body is {distance_m:.3e} m from where it starts, at most {limit_m} m \
         are accepted; look for a broken value in this frame"
    )]
    TooFar {
        /// Frame, counted from 1.
        frame: usize,
        /// Distance in metres, scaled to the body.
        distance_m: f64,
        /// Largest accepted distance in metres.
        limit_m: f64,
    },
    /// An AMASS-like `.npz` file cannot be used.
    #[error(
        "motion .npz: {reason}; expected are `poses` [frames, 66 to 165] (or `root_orient` and \
         `pose_body`), `trans` [frames, 3] and `mocap_framerate`, as AMASS has them"
    )]
    Amass {
        /// The array, what it should be and what it is.
        reason: String,
    },
    /// There are no bytes.
    #[error("the file is empty: nothing was saved into it; export or download it again")]
    EmptyFile,
    /// The bytes are of a known kind that is not read.
    #[error("this is {kind}, which is not read; {what_to_do}")]
    OtherKind {
        /// The kind.
        kind: &'static str,
        /// How to make a file that is read.
        what_to_do: &'static str,
    },
    /// The bytes are no motion file of a known kind.
    #[error(
        "neither BVH (text that begins with HIERARCHY), binary glTF (GLB, VRM, VRMA) nor SMPL poses \
         (.npz): it begins with {found}. Export the motion as one of these; Blender and most other programs do"
    )]
    UnknownFile {
        /// The first bytes, as far as they are text.
        found: String,
    },
    /// A binary glTF file cannot be used.
    #[error("motion GLB, {0}; export it as one binary file with an animation, uncompressed")]
    Glb(#[from] dynaskin_glb::GlbError),
    /// A parameter is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        got: f64,
        /// Its range.
        expected: String,
    },
    /// A clip has no frames.
    #[error("the clip has no frames, expected at least one pose")]
    EmptyClip,
    /// A result would be longer than a clip may be.
    #[error(
        "the clip would have {frames:.0} frames, at most {limit} are accepted; lower the rate or shorten it"
    )]
    TooLong {
        /// Frames asked for.
        frames: f64,
        /// Largest accepted count.
        limit: usize,
    },
    /// Frames times joints are more than a page can evaluate while its user waits.
    #[error(
        "{frames} frames of {joints} joints are {} million rotations, at most {} million are accepted; \
         shorten the animation, lower its rate or leave out nodes that no person needs",
        frames * joints / 1_000_000,
        limit / 1_000_000
    )]
    TooMuch {
        /// Frames of the clip.
        frames: usize,
        /// Nodes of the file that stand among the joints.
        joints: usize,
        /// Largest accepted product.
        limit: usize,
    },
    /// A ballistic flight of that height takes longer than the tempo leaves.
    #[error(
        "{motion}: a flight of {height_m} m lasts {flight_seconds:.2} s and does not fit a tempo of \
         {tempo_hz} Hz; lower the height to {max_height_m:.3} m or the tempo"
    )]
    FlightDoesNotFit {
        /// Name of the motion.
        motion: &'static str,
        /// Asked height in metres.
        height_m: f64,
        /// Asked tempo in hertz.
        tempo_hz: f64,
        /// Duration of the flight in seconds.
        flight_seconds: f64,
        /// Largest height that fits the tempo, in metres.
        max_height_m: f64,
    },
}

#[cfg(feature = "amass")]
impl From<dynaskin_npz::NpzError> for MotionError {
    fn from(error: dynaskin_npz::NpzError) -> Self {
        Self::Amass {
            reason: error.to_string(),
        }
    }
}

fn list(joints: &[Joint]) -> String {
    let names: Vec<&str> = joints.iter().map(|joint| joint.name()).collect();
    names.join(", ")
}

/// As many names as a message bears.
pub(crate) fn shortened(names: &[String]) -> String {
    const MOST: usize = 80;
    const MOST_LETTERS: usize = 60;
    let cut = |name: &String| match name.char_indices().nth(MOST_LETTERS) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.clone(),
    };
    let shown: Vec<String> = names.iter().take(MOST).map(cut).collect();
    let shown = shown.join(", ");
    match names.len().saturating_sub(MOST) {
        0 if names.is_empty() => "none".to_owned(),
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
