//! The report: how near each fit is, and pictures of the worst frames. All of it is read from the fits, so
//! that those of runs before are in it, too.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use anyhow::Context as _;
use dynaskin_body::{BodyModel, JOINT_COUNT, Pose, SHAPE_COUNT, SkinMatrices, skin_linear};
use dynaskin_fit::Capture;
use dynaskin_npz::{Archive, NpzError};
use dynaskin_report::{Picture, Report, Table, Triangle, heat_colour};
use glam::{DQuat, DVec3, Quat, Vec3};

use super::fit_path;
use super::state::Shapes;

/// Largest array of a fit: offsets of as many frames as are fitted.
const MAX_ARRAY_BYTES: u64 = 1 << 40;
/// Pictures in the report.
const PICTURES: usize = 8;
/// A rigid distance that is more than registered scans usually have, in millimetres.
const MUCH_MM: f32 = 10.0;
/// Offset that is drawn in the lightest colour, in metres.
const LIGHTEST_M: f32 = 0.03;

type Fit = Archive<BufReader<File>>;

/// What the report says of a sequence.
struct Told<'c> {
    capture: &'c Capture,
    frames: usize,
    rate_hz: f64,
    median_mm: f32,
    worst_mm: f32,
    worst_frame: usize,
}

/// Writes the report.
pub fn write(
    path: &Path,
    body: &BodyModel,
    out: &Path,
    captures: &[Capture],
    shapes: &Shapes,
    failed: &BTreeMap<String, String>,
) -> anyhow::Result<()> {
    let mut told = Vec::new();
    for capture in captures {
        if !failed.contains_key(&capture.name) {
            let read = tell(out, capture);
            told.push(read.with_context(|| {
                let path = fit_path(out, capture);
                format!(
                    "{} is no whole fit; remove it, and the same command fits it again",
                    path.display()
                )
            })?);
        }
    }
    let mut report = Report::new("Fitted captures");
    report.paragraph(&format!(
        "{} sequences of {} people. The rigid distance is the RMS distance in millimetres between the skin \
         that the model takes to be rigid and the scan; a few millimetres are usual for registered scans of \
         real people. What is left elsewhere counts as soft tissue.",
        told.len(),
        shapes.people().count()
    ));
    report.section("People");
    report.table(&people(shapes));
    report.section("Sequences");
    report.table(&sequences(&told));
    if !failed.is_empty() {
        report.section("Not fitted");
        let mut table = Table::new(["sequence", "why"]);
        for (name, reason) in failed {
            table.marked_row(vec![name.clone(), reason.clone()]);
        }
        report.table(&table);
    }
    told.sort_by(|a, b| b.worst_mm.total_cmp(&a.worst_mm));
    told.truncate(PICTURES);
    if !told.is_empty() {
        report.section("Worst frames");
        report.paragraph(
            "The scans of the frames with the largest rigid distance, one of a sequence, coloured by how far \
             the skin is from the model in the rest pose. Where hands, feet or the head are light, the pose \
             or the scan is wrong, not the tissue.",
        );
        report.heat_scale("0 mm", &format!("{:.0} mm and more", LIGHTEST_M * 1e3));
        let mut pictures = Vec::new();
        for one in &told {
            let caption = format!(
                "{}, frame {}: {:.1} mm",
                one.capture.name, one.worst_frame, one.worst_mm
            );
            pictures.push((caption, picture(body, out, one)?));
        }
        report.pictures(&pictures)?;
    }
    Ok(report.write(path)?)
}

fn people(shapes: &Shapes) -> Table {
    let mut table = Table::new([
        "person",
        "shape from",
        "degrees from rest",
        "β",
        "joints from where β puts them, mean (mm)",
    ]);
    for (person, found) in shapes.people() {
        let (source, degrees) = match &found.source {
            Some((name, degrees)) => (name.clone(), format!("{degrees:.1}")),
            None => ("given".to_owned(), String::new()),
        };
        let betas: Vec<String> = found.shape.iter().map(|b| format!("{b:.2}")).collect();
        let lengths_m = found.joint_offsets_m.map(|offset| offset.length());
        let mean_mm = 1e3 * lengths_m.iter().sum::<f32>() / JOINT_COUNT as f32;
        table.row(vec![
            person.clone(),
            source,
            degrees,
            betas.join(", "),
            format!("{mean_mm:.1}"),
        ]);
    }
    table
}

fn sequences(told: &[Told<'_>]) -> Table {
    let mut table = Table::new([
        "sequence",
        "frames",
        "seconds",
        "rigid distance, median (mm)",
        "worst (mm)",
        "worst frame",
    ]);
    for one in told {
        let cells = vec![
            one.capture.name.clone(),
            one.frames.to_string(),
            format!("{:.1}", one.frames as f64 / one.rate_hz),
            format!("{:.2}", one.median_mm),
            format!("{:.2}", one.worst_mm),
            one.worst_frame.to_string(),
        ];
        if one.worst_mm > MUCH_MM {
            table.marked_row(cells);
        } else {
            table.row(cells);
        }
    }
    table
}

fn open(out: &Path, capture: &Capture) -> anyhow::Result<Fit> {
    let path = fit_path(out, capture);
    let file = File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(Archive::open(BufReader::new(file), MAX_ARRAY_BYTES)?)
}

fn tell<'c>(out: &Path, capture: &'c Capture) -> anyhow::Result<Told<'c>> {
    let mut fit = open(out, capture)?;
    let distances = fit.floats_single("rigid_distance_m", &[None])?;
    let mut millimetres: Vec<f32> = distances.values().iter().map(|m| m * 1e3).collect();
    let worst = millimetres
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(b.1));
    let (worst_frame, worst_mm) = worst.map_or((0, 0.0), |(frame, mm)| (frame, *mm));
    millimetres.sort_by(f32::total_cmp);
    let middle = millimetres.len().saturating_sub(1) / 2;
    Ok(Told {
        capture,
        frames: millimetres.len(),
        rate_hz: fit.scalar("mocap_framerate")?,
        median_mm: millimetres.get(middle).copied().unwrap_or_default(),
        worst_mm,
        worst_frame,
    })
}

/// The scan of the worst frame, coloured by its offsets.
fn picture(body: &BodyModel, out: &Path, one: &Told<'_>) -> anyhow::Result<Picture> {
    let mut fit = open(out, one.capture)?;
    let frame = one.worst_frame;
    let pose = pose(&mut fit, frame)?;
    let betas = fit.floats("betas", &[Some(SHAPE_COUNT)])?;
    let shape: [f32; SHAPE_COUNT] = std::array::from_fn(|i| betas.at(&[i]) as f32);
    let count = body.vertex_count();
    let mut offsets_m = vec![Vec3::ZERO; count];
    let all = [None, Some(count), Some(3)];
    fit.visit_floats("offsets_rest_m", &all, &[frame + 1], |index, value| {
        if index[0] == frame {
            offsets_m[index[1]][index[2]] = value as f32;
        }
    })?;
    let mut shaped = body.shaped(&shape);
    let joints = fit.floats("joint_offsets_m", &[Some(JOINT_COUNT), Some(3)])?;
    for (joint, place_m) in shaped.joints_m.iter_mut().enumerate() {
        *place_m += Vec3::from_array(std::array::from_fn(|axis| joints.at(&[joint, axis]) as f32));
    }
    let mut rest_m = shaped.positions_m.clone();
    body.add_pose_correctives(&pose, &mut rest_m);
    for (rest, offset) in rest_m.iter_mut().zip(&offsets_m) {
        *rest += *offset;
    }
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    let mut world_m = vec![Vec3::ZERO; count];
    skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
    // Seen from half left, whichever way the body faces.
    let forward = pose.parent_from_joint[0] * DVec3::Z;
    let turn = Quat::from_rotation_y(0.5 - forward.x.atan2(forward.z) as f32);
    let triangles = body.faces.iter().map(|face| {
        let size_m = face
            .iter()
            .map(|&v| offsets_m[v as usize].length())
            .sum::<f32>()
            / 3.0;
        Triangle {
            corners: face.map(|vertex| (turn * world_m[vertex as usize]).to_array()),
            colour: heat_colour(f64::from(size_m / LIGHTEST_M)),
        }
    });
    Ok(Picture {
        size: (440, 640),
        triangles: triangles.collect(),
        window: None,
    })
}

fn pose(fit: &mut Fit, frame: usize) -> Result<Pose, NpzError> {
    let turns = fit.floats("poses", &[None, Some(3 * JOINT_COUNT)])?;
    let places = fit.floats("trans", &[None, Some(3)])?;
    let mut pose = Pose::REST;
    let vector = |at: &dyn Fn(usize) -> f64| DVec3::new(at(0), at(1), at(2));
    for (joint, turn) in pose.parent_from_joint.iter_mut().enumerate() {
        *turn = DQuat::from_scaled_axis(vector(&|axis| turns.at(&[frame, 3 * joint + axis])));
    }
    pose.root_translation_m = vector(&|axis| places.at(&[frame, axis]));
    Ok(pose)
}
