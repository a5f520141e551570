//! How far regions move in a repeated motion.

use dynaskin_body::{BodyModel, REGION_COUNT, Region};
use glam::Vec3;

use crate::dataset::ClipData;

/// Vertices with more than this weight belong to a region.
const MEMBER_WEIGHT: f32 = 0.6;
/// Share of a region's vertices that move less than the reported amplitude.
const PERCENTILE: f32 = 0.9;

/// Peak-to-peak movement of a region against the bones, mean over the cycles of a motion.
///
/// The chest is measured at the foremost vertex of each side, where studies put their marker; other
/// regions at the 90th percentile of their vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplitude {
    /// The region.
    pub region: Region,
    /// Peak to peak along x (side), y (vertical) and z (fore-aft) of the rest pose, in metres.
    pub peak_to_peak_m: [f64; 3],
    /// The largest offset's length over all cycles, in metres.
    pub largest_m: f64,
}

impl Amplitude {
    /// Sum of the three ranges in metres: studies of running give each axis's share of it.
    pub fn total_m(&self) -> f64 {
        self.peak_to_peak_m.iter().sum()
    }
}

/// Amplitudes of all regions over `frames` of a clip, cut into cycles of `cycle_frames`.
/// A range without one whole cycle counts as a single cycle.
pub fn amplitudes(
    body: &BodyModel,
    clip: &ClipData,
    frames: std::ops::Range<usize>,
    cycle_frames: usize,
) -> [Amplitude; REGION_COUNT] {
    let frames = frames.start.min(clip.frame_count())..frames.end.min(clip.frame_count());
    Region::ALL.map(|region| {
        let slots = markers(body, clip, region);
        let mut per_slot: Vec<Moved> = slots
            .iter()
            .map(|slot| moved(clip, *slot, frames.clone(), cycle_frames.max(2)))
            .collect();
        let pick = |values: &mut Vec<f32>| {
            values.sort_by(f32::total_cmp);
            let last = values.len().saturating_sub(1);
            values
                .get((last as f32 * PERCENTILE).round() as usize)
                .map_or(0.0, |value| f64::from(*value))
        };
        if region == Region::Chest {
            // Two markers, left and right: their mean.
            let count = per_slot.len().max(1) as f32;
            let sum: Vec3 = per_slot.iter().map(|m| m.range_m).sum();
            let largest = per_slot.iter().map(|m| m.largest_m).fold(0.0, f32::max);
            return Amplitude {
                region,
                peak_to_peak_m: (sum / count).to_array().map(f64::from),
                largest_m: f64::from(largest),
            };
        }
        let peak_to_peak_m = std::array::from_fn(|axis| {
            pick(&mut per_slot.iter().map(|m| m.range_m[axis]).collect())
        });
        let largest_m = pick(&mut per_slot.iter_mut().map(|m| m.largest_m).collect());
        Amplitude {
            region,
            peak_to_peak_m,
            largest_m,
        }
    })
}

/// Slots at which a region is measured.
fn markers(body: &BodyModel, clip: &ClipData, region: Region) -> Vec<usize> {
    let weights = &body.region_weights[region as usize];
    let members = (0..clip.vertices.len())
        .filter(|slot| weights[clip.vertices[*slot] as usize] > MEMBER_WEIGHT);
    if region != Region::Chest {
        return members.collect();
    }
    // The same vertices for every shape, so that shapes can be compared.
    let members: Vec<usize> = members.collect();
    let at = |slot: usize| body.template_m[clip.vertices[slot] as usize];
    [1.0_f32, -1.0]
        .into_iter()
        .filter_map(|side| {
            members
                .iter()
                .copied()
                .filter(|slot| at(*slot).x * side > 0.0)
                .max_by(|a, b| at(*a).z.total_cmp(&at(*b).z))
        })
        .collect()
}

struct Moved {
    range_m: Vec3,
    largest_m: f32,
}

fn moved(
    clip: &ClipData,
    slot: usize,
    frames: std::ops::Range<usize>,
    cycle_frames: usize,
) -> Moved {
    let offsets: Vec<Vec3> = frames
        .map(|frame| clip.offset_rest_m(frame, slot))
        .collect();
    let range = |part: &[Vec3]| {
        let low = part.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = part.iter().copied().reduce(Vec3::max).unwrap_or_default();
        high - low
    };
    let cycles: Vec<&[Vec3]> = offsets.chunks_exact(cycle_frames).collect();
    let range_m = if cycles.is_empty() {
        range(&offsets)
    } else {
        cycles.iter().map(|part| range(part)).sum::<Vec3>() / cycles.len() as f32
    };
    Moved {
        range_m,
        largest_m: offsets.iter().map(|o| o.length()).fold(0.0, f32::max),
    }
}
