//! Bodies as pictures: skinned with offsets, coloured by numbers of their vertices.

use std::fs;

use anyhow::Context as _;
use dynaskin_body::{BodyModel, SkinMatrices, skin_linear};
use dynaskin_evaluate::study::{self, Comparison, Reach, Snapshot};
use dynaskin_report::{Picture, Report, Triangle, heat_colour};
use glam::Vec3;

use super::subject::{Methods, Subject};
use crate::commands::train::clip_bar;

/// Pixels, twice what the page shows, for dense displays.
const SIZE: (u32, u32) = (352, 720);
/// Colour of skin that has no soft tissue.
const STIFF: [u8; 3] = [190, 190, 196];

/// A frame of a held-out clip as colour maps: the truth, and for each method what it predicts, what
/// its decoder could have given, and the errors of both.
pub fn picture_section(
    report: &mut Report,
    subject: &Subject<'_>,
    methods: &mut Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let Some(clip) = comparison.wildest() else {
        return Ok(());
    };
    let (frame, size_mm) = clip.wildest;
    let snapshot = study::snapshot(
        &mut methods.contestants,
        subject.data_set,
        subject.body,
        &subject.data_set.clips[clip.index],
        frame,
    )?;
    report.section("A frame as a picture");
    let truth_mm = lengths_mm(&snapshot.truth_m, None);
    let most_mm = round_up(percentile(&truth_mm, 0.99));
    report.paragraph(&format!(
        "Frame {frame} of {} ({}), the held-out frame with the largest offsets, {size_mm:.1} mm on \
         average over the soft vertices. First how far the skin is from plain skinning in the \
         clip. Then, for each method, how far it is in its prediction and in its reconstruction, which is \
         the nearest to the clip that its decoder can give, and how far both are from the clip. (DSNet, figures 4 and 7.) The latents of a reconstruction are exact for linear \
         decoders; for others they are searched for from 0 by Levenberg's and Marquardt's method, and \
         there may be better ones. All on the same scale; grey skin has no soft tissue.",
        snapshot.name,
        clip.set.name()
    ));
    report.heat_scale("0 mm", &format!("{most_mm:.0} mm and more"));
    let draw = |offsets_m: &[f32], values_mm: &[f64]| {
        let vertices = &subject.data_set.vertices;
        heat(
            subject.body,
            vertices,
            &snapshot,
            offsets_m,
            values_mm,
            most_mm,
        )
    };
    // A field, and its distance from the truth.
    let pair = |what: String, offsets_m: &[f32]| {
        let errors_mm = lengths_mm(offsets_m, Some(&snapshot.truth_m));
        let mean_mm = errors_mm.iter().sum::<f64>() / errors_mm.len().max(1) as f64;
        let sizes_mm = lengths_mm(offsets_m, None);
        let caption = format!("{what}: error, mean {mean_mm:.1} mm");
        [
            (what, draw(offsets_m, &sizes_mm)),
            (caption, draw(offsets_m, &errors_mm)),
        ]
    };
    let truth = draw(&snapshot.truth_m, &truth_mm);
    report.pictures(&[("the clip".to_owned(), truth)])?;
    let bar = clip_bar("reconstructing a frame");
    bar.set_length(methods.names.len() as u64);
    for ((label, decoder), predicted_m) in methods
        .labels()
        .zip(&methods.decoders)
        .zip(&snapshot.predicted_m)
    {
        bar.inc(1);
        let mut row = Vec::new();
        match predicted_m.iter().all(|x| x.is_finite()) {
            true => row.extend(pair(label.to_owned(), predicted_m)),
            false => report.paragraph(&format!("{label} gives no numbers in this frame.")),
        }
        if let Some(decoder) = decoder {
            let onnx =
                fs::read(decoder).with_context(|| format!("cannot read {}", decoder.display()))?;
            let nearest_m = Reach::load(&onnx)?.nearest(&snapshot.truth_m)?;
            row.extend(pair(format!("{label}, reconstruction"), &nearest_m));
        }
        report.pictures(&row)?;
    }
    bar.finish_and_clear();
    Ok(())
}

/// The value below which a share of the values lies.
pub fn percentile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((share * last) as usize).copied().unwrap_or(0.0)
}

/// To the next multiple of 5 above 0.
pub fn round_up(mm: f64) -> f64 {
    5.0 * (mm / 5.0).ceil().max(1.0)
}

/// The body of a snapshot moved by `offsets_m` (`[slot][xyz]`), the soft vertices coloured by
/// `values_mm` (one a slot) between 0 and `most_mm`; from the front.
pub fn heat(
    body: &BodyModel,
    vertices: &[u32],
    snapshot: &Snapshot,
    offsets_m: &[f32],
    values_mm: &[f64],
    most_mm: f64,
) -> Picture {
    let world_m = skinned(body, vertices, snapshot, offsets_m);
    let mut shares = vec![None; world_m.len()];
    for (vertex, value) in vertices.iter().zip(values_mm) {
        shares[*vertex as usize] = Some(value / most_mm.max(f64::MIN_POSITIVE));
    }
    let triangles = body.faces.iter().map(|face| {
        let corners = face.map(|vertex| world_m[vertex as usize].to_array());
        let known: Vec<f64> = face.iter().filter_map(|v| shares[*v as usize]).collect();
        // A triangle at the rim of the tissue has corners that never move.
        let colour = match known.is_empty() {
            true => STIFF,
            false => heat_colour(known.iter().sum::<f64>() / 3.0),
        };
        Triangle { corners, colour }
    });
    Picture {
        size: SIZE,
        triangles: triangles.collect(),
        window: None,
    }
}

/// Lengths of offsets, or of their differences from others, in millimetres, one a slot.
pub fn lengths_mm(offsets_m: &[f32], from_m: Option<&[f32]>) -> Vec<f64> {
    let at = |field: &[f32], slot: usize| {
        Vec3::new(field[3 * slot], field[3 * slot + 1], field[3 * slot + 2])
    };
    (0..offsets_m.len() / 3)
        .map(|slot| {
            let from = from_m.map_or(Vec3::ZERO, |field| at(field, slot));
            1000.0 * f64::from((at(offsets_m, slot) - from).length())
        })
        .collect()
}

/// Vertices in the world, turned so that the pelvis faces the viewer.
fn skinned(
    body: &BodyModel,
    vertices: &[u32],
    snapshot: &Snapshot,
    offsets_m: &[f32],
) -> Vec<Vec3> {
    let shaped = body.shaped(&snapshot.shape);
    let mut rest_m = shaped.positions_m;
    body.add_pose_correctives(&snapshot.pose, &mut rest_m);
    for (vertex, offset) in vertices.iter().zip(offsets_m.chunks_exact(3)) {
        rest_m[*vertex as usize] += Vec3::new(offset[0], offset[1], offset[2]);
    }
    let mut pose = snapshot.pose.clone();
    let forward = pose.parent_from_joint[0] * glam::DVec3::Z;
    let back = glam::DQuat::from_rotation_y(-forward.x.atan2(forward.z));
    pose.parent_from_joint[0] = back * pose.parent_from_joint[0];
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    let mut world_m = vec![Vec3::ZERO; rest_m.len()];
    skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
    world_m
}
