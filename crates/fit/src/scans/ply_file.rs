//! Stanford PLY, ASCII or binary.

use std::io::BufReader;
use std::path::Path;

use glam::Vec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult};

use super::mesh::Mesh;
use crate::FitError;

/// More vertices or faces than a body has; a header's counts are not trusted.
const MAX_ELEMENTS: usize = 2_000_000;

/// A vertex's position; what else a file says about it is passed over.
struct Vertex([f32; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        // A file without such a property must not give a position.
        Self([f32::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == name);
        match (axis, property.to_f32_lossy()) {
            (Some(axis), Some(value)) => {
                self.0[axis] = value;
                PropertyAccessResult::Set
            }
            _ => PropertyAccessResult::Ignored,
        }
    }
}

/// A face's vertex indices.
struct Face(Vec<u32>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match property.to_u32_list() {
            Some(indices) if matches!(name, "vertex_indices" | "vertex_index") => {
                self.0 = indices;
                PropertyAccessResult::Set
            }
            _ => PropertyAccessResult::Ignored,
        }
    }
}

/// An element that is only read over.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}

/// Positions and faces of a PLY file, in the file's order.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh, FitError> {
    let failed = |reason: String| FitError::Mesh {
        path: path.to_owned(),
        reason,
    };
    let mut reader = Reader::new(BufReader::new(bytes));
    if !bytes.starts_with(b"ply") {
        return Err(failed(
            "it is no PLY file: it does not begin with `ply`; export the mesh again".to_owned(),
        ));
    }
    let header = Parser::<Other>::new()
        .read_header(&mut reader)
        .map_err(|_| {
            let header = "its header is cut off or none of PLY's";
            failed(format!("{header}; copy the file or export the mesh again"))
        })?;
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for (_, element) in &header.elements {
        check_count(element, bytes.len()).map_err(failed)?;
        let read = match element.name.as_str() {
            "vertex" => Parser::<Vertex>::new()
                .read_payload_for_element(&mut reader, element, &header)
                .map(|vertices| positions = vertices),
            "face" => Parser::<Face>::new()
                .read_payload_for_element(&mut reader, element, &header)
                .map(|read| faces = read),
            _ => Parser::<Other>::new()
                .read_payload_for_element(&mut reader, element, &header)
                .map(drop),
        };
        read.map_err(|_| {
            failed(format!(
                "its header promises {} of element `{}`, and what follows is something else or ends before; \
                 copy the file or export the mesh again",
                element.count, element.name
            ))
        })?;
    }
    if !header.elements.contains_key("vertex") {
        return Err(failed("there is no element `vertex`".to_owned()));
    }
    let vertex = &header.elements["vertex"];
    for axis in ["x", "y", "z"] {
        if !vertex.properties.contains_key(axis) {
            return Err(failed(format!(
                "element `vertex` has no property `{axis}`; export the mesh with positions"
            )));
        }
    }
    Ok(Mesh {
        positions: positions
            .into_iter()
            .map(|vertex: Vertex| Vec3::from_array(vertex.0))
            .collect(),
        faces: faces.into_iter().map(|face: Face| face.0).collect(),
    })
}

fn check_count(element: &ElementDef, bytes: usize) -> Result<(), String> {
    // An element takes at least a byte.
    if element.count <= MAX_ELEMENTS.min(bytes) {
        Ok(())
    } else {
        Err(format!(
            "the header says {} of element `{}`, more than the file can hold; copy the file or export the mesh again",
            element.count, element.name
        ))
    }
}
