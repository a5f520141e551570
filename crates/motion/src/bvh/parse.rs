//! The grammar of a BVH file.

use dynaskin_body::JOINT_COUNT;
use glam::DVec3;

use super::text::Text;
use super::{BreakOff, Bvh, BvhJoint, Channel, MAX_BVH_JOINTS, MAX_JOINT_CHANNELS};
use crate::{MAX_CLIP_FRAMES, MotionError};

/// Shortest and longest accepted time step in seconds.
const FRAME_SECONDS: std::ops::RangeInclusive<f64> = 1e-4..=10.0;

pub fn parse(bytes: &[u8]) -> Result<Bvh, MotionError> {
    let mut text = Text::new(bytes);
    text.skip_comments();
    text.keyword("HIERARCHY")?;
    let (joints, channel_count) = hierarchy(&mut text)?;
    let (frame_count, frame_seconds) = motion_header(&mut text)?;
    let (values, break_off) = frames(&mut text, frame_count, channel_count)?;
    Ok(Bvh {
        joints,
        frame_seconds,
        channel_count,
        values,
        break_off,
        named: [None; JOINT_COUNT],
    })
}

/// Whether the text begins with the word that BVH files begin with.
pub fn begins(bytes: &[u8]) -> bool {
    let mut text = Text::new(bytes);
    text.skip_comments();
    text.keyword("HIERARCHY").is_ok()
}

/// A block whose closing brace has not been read yet.
enum Open {
    Joint(usize),
    EndSite(usize),
}

/// Reads the joints up to and including the word `MOTION`. Nesting is kept on a list of its own,
/// so that a deep file cannot exhaust the call stack.
fn hierarchy(text: &mut Text<'_>) -> Result<(Vec<BvhJoint>, usize), MotionError> {
    let mut joints: Vec<BvhJoint> = Vec::new();
    let mut channel_count = 0;
    let mut open: Vec<Open> = Vec::new();
    loop {
        let expected = match open.last() {
            None if joints.is_empty() => "ROOT",
            None => "MOTION or ROOT",
            Some(Open::EndSite(_)) => "OFFSET or }",
            Some(Open::Joint(_)) => "OFFSET, CHANNELS, JOINT, End Site or }",
        };
        let word = text.word(expected)?;
        match (word.to_ascii_lowercase().as_slice(), open.last()) {
            (b"motion", None) if !joints.is_empty() => break,
            (b"root", None) => {
                open.push(Open::Joint(joints.len()));
                joints.push(joint_header(text, None, joints.len(), channel_count)?);
            }
            (b"joint", Some(&Open::Joint(parent))) => {
                open.push(Open::Joint(joints.len()));
                joints.push(joint_header(
                    text,
                    Some(parent),
                    joints.len(),
                    channel_count,
                )?);
            }
            (b"end" | b"endsite", Some(&Open::Joint(joint))) => {
                open.push(Open::EndSite(joint));
                text.rest_of_line();
                text.keyword("{")?;
            }
            (b"offset", Some(&Open::Joint(joint))) => joints[joint].offset = offset(text)?,
            (b"offset", Some(&Open::EndSite(joint))) => {
                let end_site = offset(text)?;
                joints[joint].end_site.get_or_insert(end_site);
            }
            (b"channels", Some(&Open::Joint(joint))) if joints[joint].channels.is_empty() => {
                joints[joint].first_channel = channel_count;
                joints[joint].channels = channels(text)?;
                channel_count += joints[joint].channels.len();
            }
            (b"}", Some(_)) => {
                open.pop();
            }
            _ => return Err(text.unexpected(expected, word)),
        }
    }
    if channel_count == 0 {
        return Err(MotionError::Syntax {
            line: text.line,
            expected: "at least one joint with CHANNELS".to_owned(),
            found: "none".to_owned(),
        });
    }
    Ok((joints, channel_count))
}

fn joint_header(
    text: &mut Text<'_>,
    parent: Option<usize>,
    joints_before: usize,
    first_channel: usize,
) -> Result<BvhJoint, MotionError> {
    if joints_before >= MAX_BVH_JOINTS {
        return Err(MotionError::Limit {
            line: text.line,
            what: "number of joints",
            limit: MAX_BVH_JOINTS,
            got: joints_before + 1,
        });
    }
    let name = text.rest_of_line();
    if name.is_empty() {
        return Err(text.unexpected("a joint name", b""));
    }
    text.keyword("{")?;
    Ok(BvhJoint {
        name,
        parent,
        offset: DVec3::ZERO,
        channels: Vec::new(),
        first_channel,
        end_site: None,
    })
}

fn offset(text: &mut Text<'_>) -> Result<DVec3, MotionError> {
    let mut offset = DVec3::ZERO;
    for axis in 0..3 {
        let expected = "three numbers after OFFSET";
        let word = text.word(expected)?;
        offset[axis] = text.number(word, expected)?;
    }
    Ok(offset)
}

fn channels(text: &mut Text<'_>) -> Result<Vec<Channel>, MotionError> {
    let expected = "the number of channels";
    let word = text.word(expected)?;
    let count = text.count(word, expected)?;
    if count > MAX_JOINT_CHANNELS {
        return Err(MotionError::Limit {
            line: text.line,
            what: "number of channels of a joint",
            limit: MAX_JOINT_CHANNELS,
            got: count,
        });
    }
    (0..count).map(|_| channel(text)).collect()
}

fn channel(text: &mut Text<'_>) -> Result<Channel, MotionError> {
    let expected = "a channel such as Xposition or Zrotation";
    let word = text.word(expected)?;
    let lower = word.to_ascii_lowercase();
    let axis = match lower.first() {
        Some(b'x') => 0,
        Some(b'y') => 1,
        Some(b'z') => 2,
        _ => return Err(text.unexpected(expected, word)),
    };
    match &lower[1..] {
        b"position" | b"translation" => Ok(Channel::Position(axis)),
        b"rotation" => Ok(Channel::Rotation(axis)),
        _ => Err(text.unexpected(expected, word)),
    }
}

/// Reads `Frames:` and `Frame Time:`.
fn motion_header(text: &mut Text<'_>) -> Result<(usize, f64), MotionError> {
    text.header_keyword("Frames")?;
    let expected = "the number of frames, at least 1";
    let word = text.header_word(expected)?;
    let frame_count = text.count(word, expected)?;
    if frame_count == 0 {
        return Err(text.unexpected(expected, word));
    }
    if frame_count > MAX_CLIP_FRAMES {
        return Err(MotionError::Limit {
            line: text.line,
            what: "number of frames",
            limit: MAX_CLIP_FRAMES,
            got: frame_count,
        });
    }
    text.header_keyword("Frame")?;
    text.header_keyword("Time")?;
    let expected = "the frame time in seconds";
    let word = text.header_word(expected)?;
    let frame_seconds = text.number(word, expected)?;
    if !FRAME_SECONDS.contains(&frame_seconds) {
        return Err(MotionError::FrameTime {
            line: text.line,
            found: frame_seconds,
        });
    }
    let frame_seconds = usual_frame_seconds(word, frame_seconds);
    Ok((frame_count, frame_seconds))
}

/// Rates at which motions are captured and exported, in hertz.
const USUAL_RATES_HZ: [f64; 22] = [
    8.0, 10.0, 12.0, 12.5, 15.0, 20.0, 24.0, 25.0, 30.0, 40.0, 48.0, 50.0, 60.0, 72.0, 75.0, 90.0,
    100.0, 120.0, 144.0, 180.0, 200.0, 240.0,
];

/// The time step of the usual rate that a file means by `word`: 0.0333, 0.033333 and 0.03333333 are
/// all 30 Hz. Digits may be rounded or cut off. Other steps stay as they are.
fn usual_frame_seconds(word: &[u8], seconds: f64) -> f64 {
    let word = String::from_utf8_lossy(word).to_ascii_lowercase();
    let (digits, exponent) = word.split_once('e').unwrap_or((&word, "0"));
    let decimals = digits
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let exponent: f64 = exponent.parse().unwrap_or(0.0);
    let last_digit = 10.0_f64.powf(exponent - decimals as f64);
    // Rounded to the nearest, or cut off and thus too small by up to a whole last digit.
    let (low, high) = (seconds - 0.51 * last_digit, seconds + 1.01 * last_digit);
    USUAL_RATES_HZ
        .iter()
        .map(|rate_hz| 1.0 / rate_hz)
        .filter(|usual| (low..=high).contains(usual))
        // So few digits that the rate itself is in doubt say what they say.
        .filter(|usual| (usual / seconds - 1.0).abs() < 0.02)
        .min_by(|a, b| (a - seconds).abs().total_cmp(&(b - seconds).abs()))
        .unwrap_or(seconds)
}

/// Reads the frames. A frame may take several lines but ends with one: so a missing or surplus
/// value is found where it is, and does not shift all that follows. Where the file ends early, its
/// whole frames count; one that ends with the file and not with its line may have lost digits.
fn frames(
    text: &mut Text<'_>,
    frame_count: usize,
    channel_count: usize,
) -> Result<(Vec<f64>, Option<BreakOff>), MotionError> {
    // A value takes a digit and a blank; both factors are bounded, so this cannot overflow.
    let fits = text.remaining().div_ceil(2);
    let mut values = Vec::with_capacity((frame_count * channel_count).min(fits));
    for frame in 1..=frame_count {
        for channel in 0..channel_count {
            match text.value_word() {
                Some(word) => {
                    // What the end of the file cut in two need not be a number.
                    let is_inside = frame < frame_count || channel + 1 < channel_count;
                    let goes_on = word.last().is_some_and(|last| b"+-.eE".contains(last));
                    let is_cut = text.remaining() == 0 && (is_inside || goes_on);
                    match text.number(word, "a number") {
                        Ok(value) => values.push(value),
                        Err(_) if is_cut => {
                            return broken_off(
                                text,
                                values,
                                frame,
                                channel,
                                [frame_count, channel_count],
                            );
                        }
                        Err(error) => return Err(error),
                    }
                }
                None => {
                    return broken_off(text, values, frame, channel, [frame_count, channel_count]);
                }
            }
        }
        if frame < frame_count && text.remaining() == 0 {
            return broken_off(
                text,
                values,
                frame,
                channel_count,
                [frame_count, channel_count],
            );
        }
        if !text.at_line_end() {
            return Err(MotionError::FrameLength {
                line: text.line,
                frame,
                expected: channel_count,
            });
        }
    }
    match text.value_word() {
        None => Ok((values, None)),
        Some(_) => Err(MotionError::ExtraFrames {
            line: text.line,
            frames: frame_count,
        }),
    }
}

/// The whole frames of a file that ends within `frame`, of which it has `channel` values.
fn broken_off(
    text: &Text<'_>,
    mut values: Vec<f64>,
    frame: usize,
    channel: usize,
    [frame_count, channel_count]: [usize; 2],
) -> Result<(Vec<f64>, Option<BreakOff>), MotionError> {
    let whole_frames = frame - 1;
    if whole_frames == 0 {
        return Err(text.truncated(&format!(
            "{channel_count} values in each of {frame_count} frames; frame {frame} has {channel}"
        )));
    }
    values.truncate(whole_frames * channel_count);
    let break_off = BreakOff {
        line: text.line,
        whole_frames,
        announced_frames: frame_count,
    };
    Ok((values, Some(break_off)))
}
