//! Wavefront OBJ.

use std::path::Path;

use glam::Vec3;
use obj::{ObjData, ObjError};

use super::mesh::Mesh;
use crate::FitError;

/// Positions and faces of an OBJ file, in the file's order.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh, FitError> {
    let failed = |reason: String| FitError::Mesh {
        path: path.to_owned(),
        reason,
    };
    // Comments and names may be in any encoding.
    let text = String::from_utf8_lossy(bytes);
    let data = ObjData::load_buf(text.as_bytes()).map_err(|error| failed(told(&error)))?;
    let count = data.position.len();
    let mut faces = Vec::new();
    for group in data.objects.iter().flat_map(|object| &object.groups) {
        for polygon in &group.polys {
            let corners: Vec<u32> = polygon.0.iter().map(|corner| corner.0 as u32).collect();
            // The parser takes an index from the file as it is.
            if let Some(corner) = polygon.0.iter().find(|corner| corner.0 >= count) {
                let index = corner.0.wrapping_add(1) as isize;
                return Err(failed(format!(
                    "a face names vertex {index}, there are {count}"
                )));
            }
            faces.push(corners);
        }
    }
    Ok(Mesh {
        positions: data.position.into_iter().map(Vec3::from_array).collect(),
        faces,
    })
}

/// Why the parser refused a file, and what to do.
fn told(error: &ObjError) -> String {
    let line = |line: usize, problem: String| {
        format!("line {} {problem}; export the mesh again", line + 1)
    };
    match error {
        ObjError::MalformedFaceGroup { line_number, group } => line(
            *line_number,
            format!("has a face corner `{group}` that names no vertex"),
        ),
        ObjError::ArgumentListFailure { line_number, list } => line(
            *line_number,
            format!("has numbers that cannot be read: {list}"),
        ),
        ObjError::UnexpectedCommand {
            line_number,
            command,
        } => line(
            *line_number,
            format!("begins with `{command}`, which OBJ files have not"),
        ),
        ObjError::MissingMTLName { line_number } => {
            line(*line_number, "names no material file".to_owned())
        }
        ObjError::ZeroVertexNumber { line_number } => line(
            *line_number,
            "has a face corner of number 0, and OBJ files count vertices from 1".to_owned(),
        ),
        _ => "it cannot be read as OBJ; export the mesh again".to_owned(),
    }
}
