//! Unit and up axis, found from the first frame.

use std::path::Path;

use dynaskin_body::{BodyModel, volume_m3};
use dynaskin_motion::UpAxis;
use glam::{DVec3, Vec3};

use super::ScanUnit;
use crate::FitError;
use crate::start::trunk_rotation;

/// How much larger than the body model in its mean shape a person may be.
const SCALES: std::ops::RangeInclusive<f32> = 0.6..=1.6;
/// How far from an axis a trunk may lean that is upright, as the cosine: 40 degrees.
const UPRIGHT: f64 = 0.766;
/// Least volume of a person over that of the body model in its mean shape.
const LEAST_VOLUME: f64 = 0.2;

/// How much longer the edges of a frame are than the body model's, in the median.
fn edge_ratio(body: &BodyModel, frame: &[Vec3]) -> f32 {
    let length = |places: &[Vec3], a: u32, b: u32| {
        let (a, b) = (places.get(a as usize)?, places.get(b as usize)?);
        let length = a.distance(*b);
        (length.is_finite() && length > 0.0).then_some(length)
    };
    let mut ratios: Vec<f32> = body
        .faces
        .iter()
        .filter_map(|&[a, b, _]| Some(length(frame, a, b)? / length(&body.template_m, a, b)?))
        .collect();
    ratios.sort_by(f32::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or_default()
}

/// The unit in which the edges of a frame are as long as a person's. Edges hardly change with the pose.
pub(super) fn unit(
    path: &Path,
    body: &BodyModel,
    frame: &[Vec3],
    notes: &mut Vec<String>,
) -> Result<ScanUnit, FitError> {
    let ratio = edge_ratio(body, frame);
    if frame.iter().all(|place| Some(place) == frame.first()) {
        let path = path.to_owned();
        return Err(FitError::Collapsed { path, frame: 0 });
    }
    let units = [ScanUnit::Metre, ScanUnit::Centimetre, ScanUnit::Millimetre];
    let found = units
        .into_iter()
        .find(|unit| SCALES.contains(&(ratio * unit.metres())));
    let Some(unit) = found else {
        return Err(FitError::UnitUnknown {
            path: path.to_owned(),
            ratio,
        });
    };
    notes.push(format!(
        "the numbers are {}: edges are then {:.2} times the body's",
        unit.name(),
        ratio * unit.metres()
    ));
    Ok(unit)
}

/// Refuses a frame that is the body's mirror image: a mesh whose faces point inwards.
pub(super) fn not_mirrored(
    path: &Path,
    body: &BodyModel,
    frame_m: &[Vec3],
) -> Result<(), FitError> {
    // Vertices in another order make no surface, whose volume would tell something.
    if !SCALES.contains(&edge_ratio(body, frame_m)) {
        return Ok(());
    }
    let own_m3 = volume_m3(&body.template_m, &body.faces);
    let ratio = volume_m3(frame_m, &body.faces) / own_m3;
    // A mesh that is open or crumpled tells nothing.
    if ratio > -LEAST_VOLUME || !ratio.is_finite() {
        return Ok(());
    }
    let path = path.to_owned();
    Err(FitError::Mirrored { path })
}

/// The axis along which the trunk stands in a frame.
pub(super) fn up(
    path: &Path,
    body: &BodyModel,
    frame: &[Vec3],
    notes: &mut Vec<String>,
) -> Result<UpAxis, FitError> {
    let unknown = |trunk: DVec3| FitError::UpUnknown {
        path: path.to_owned(),
        trunk: trunk.as_vec3(),
    };
    let turn = trunk_rotation(body, frame).ok_or_else(|| unknown(DVec3::ZERO))?;
    let trunk = turn * DVec3::Y;
    let axes = [UpAxis::Y, UpAxis::Z, UpAxis::MinusY];
    let leans = |axis: &UpAxis| (axis.y_up_from_world() * trunk).y;
    let Some(up) = axes.into_iter().find(|axis| leans(axis) > UPRIGHT) else {
        return Err(unknown(trunk));
    };
    notes.push(format!(
        "{} is up: the trunk leans by {:.0} degrees from it in the first frame",
        up.name(),
        leans(&up).clamp(-1.0, 1.0).acos().to_degrees()
    ));
    Ok(up)
}
