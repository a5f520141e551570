//! Wavefront OBJ.

use std::path::Path;

use glam::Vec3;
use obj::ObjData;

use super::mesh::Mesh;
use crate::FitError;

/// Positions and faces of an OBJ file, in the file's order.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh, FitError> {
    let failed = |reason: String| FitError::Mesh {
        path: path.to_owned(),
        reason,
    };
    let data = ObjData::load_buf(bytes).map_err(|error| failed(error.to_string()))?;
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
