//! Bindings as files.
//!
//! ```text
//! "DYNSKINB"  8 bytes
//! version     u32, little-endian
//! payload     postcard (https://postcard.jamesmunns.com/wire-format), deflated
//! checksum    32 bytes: SHA-256 of all before
//! ```

use std::io::{Read as _, Write as _};

use dynaskin_body::{BodyModel, SHAPE_COUNT};
use glam::{Mat3, Quat};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::BindingError;
use crate::binding::{Binding, Fingerprint, MeshBinding, Rows, fingerprint_of_body};
use crate::report::Report;
use crate::rig::{Rig, Turned};

const MAGIC: &[u8; 8] = b"DYNSKINB";
const HASH: usize = 32;
/// The version that is written and read.
pub const BINDING_VERSION: u32 = 2;
/// More bytes than any payload inflates to.
const MOST_BYTES: u64 = 64 << 20;
/// Steps of a stored quaternion's component.
const TURN_STEPS: f32 = 32_767.0;

#[derive(Serialize, Deserialize)]
struct Stored {
    body: Fingerprint,
    shape: [f32; SHAPE_COUNT],
    size: f32,
    rig: Rig,
    /// Entries of each row.
    counts: Vec<u8>,
    /// Vertices of the body, each but a row's first as the step from the one before.
    vertices: Vec<u16>,
    /// Weights in 255ths.
    weights: Vec<u8>,
    meshes: Vec<StoredMesh>,
    report: Report,
}

#[derive(Serialize, Deserialize)]
struct StoredMesh {
    name: String,
    fingerprint: Fingerprint,
    vertex_count: u32,
    /// Steps from one vertex that moves to the next.
    vertices: Vec<u32>,
    /// Steps from one's row to the next one's.
    rows: Vec<i32>,
    mesh_from_root: [f32; 9],
    turns: Vec<[i16; 4]>,
}

impl Binding {
    /// The binding as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(BINDING_VERSION.to_le_bytes());
        let payload = match postcard::to_extend(&self.stored(), Vec::new()) {
            Ok(payload) => payload,
            Err(error) => unreachable!("lists of numbers can be written to memory: {error}"),
        };
        let mut deflated = flate2::write::DeflateEncoder::new(bytes, flate2::Compression::best());
        let written = deflated
            .write_all(&payload)
            .and_then(|()| deflated.finish());
        let mut bytes = match written {
            Ok(bytes) => bytes,
            Err(error) => unreachable!("memory can be written to: {error}"),
        };
        let checksum = Sha256::digest(&bytes);
        bytes.extend(checksum);
        bytes
    }

    /// Reads a binding for `body`.
    ///
    /// # Errors
    /// [`BindingError::Invalid`] for bytes that were changed, cut or written by another version,
    /// [`BindingError::AnotherFile`] for another body.
    pub fn from_bytes(bytes: &[u8], body: &BodyModel) -> Result<Self, BindingError> {
        let Some((rest, checksum)) = bytes.split_last_chunk::<HASH>() else {
            return Err(invalid(format!("it has {} bytes", bytes.len())));
        };
        let Some((magic, after_magic)) = rest.split_first_chunk::<8>() else {
            return Err(invalid("it ends too early"));
        };
        if magic != MAGIC {
            return Err(invalid("it does not begin as a binding does"));
        }
        let Some((version, payload)) = after_magic.split_first_chunk::<4>() else {
            return Err(invalid("it ends too early"));
        };
        let version = u32::from_le_bytes(*version);
        if version != BINDING_VERSION {
            return Err(invalid(format!(
                "it is of version {version}, not {BINDING_VERSION}"
            )));
        }
        if Sha256::digest(rest)[..] != checksum[..] {
            return Err(invalid("its checksum is wrong, so it was changed or cut"));
        }
        let mut inflated = Vec::new();
        let reader = flate2::read::DeflateDecoder::new(payload);
        let read = reader.take(MOST_BYTES).read_to_end(&mut inflated);
        read.map_err(|error| invalid(format!("it cannot be inflated ({error})")))?;
        let stored: Stored = postcard::from_bytes(&inflated)
            .map_err(|error| invalid(format!("its contents are no binding ({error})")))?;
        if stored.body != fingerprint_of_body(body) {
            return Err(BindingError::AnotherFile { what: "body" });
        }
        stored.binding(body)
    }

    fn stored(&self) -> Stored {
        let mut counts = Vec::with_capacity(self.rows.len());
        let mut vertices = Vec::with_capacity(self.rows.vertices.len());
        let mut weights = Vec::with_capacity(self.rows.weights.len());
        for row in 0..self.rows.len() {
            let mut before = 0;
            let mut count = 0;
            for (vertex, weight) in self.rows.entries(row) {
                vertices.push(vertex - before);
                weights.push((weight * 255.0).round().clamp(0.0, 255.0) as u8);
                before = vertex;
                count += 1;
            }
            counts.push(count);
        }
        Stored {
            body: self.body,
            shape: self.shape,
            size: self.size,
            rig: self.rig.clone(),
            counts,
            vertices,
            weights,
            meshes: self.meshes.iter().map(StoredMesh::new).collect(),
            report: self.report.clone(),
        }
    }
}

impl StoredMesh {
    fn new(mesh: &MeshBinding) -> Self {
        let mut before = 0;
        let vertices = mesh.vertices.iter().map(|vertex| {
            let step = vertex - before;
            before = *vertex;
            step
        });
        let vertices = vertices.collect();
        let mut before = 0_i64;
        let rows = mesh.rows.iter().map(|row| {
            let step = i64::from(*row) - before;
            before = i64::from(*row);
            step as i32
        });
        Self {
            name: mesh.name.clone(),
            fingerprint: mesh.fingerprint,
            vertex_count: mesh.vertex_count,
            vertices,
            rows: rows.collect(),
            mesh_from_root: mesh.mesh_from_root.to_cols_array(),
            turns: mesh
                .turns
                .iter()
                .map(|turn| turn.to_array().map(|x| (x * TURN_STEPS).round() as i16))
                .collect(),
        }
    }

    fn binding(self, row_count: usize) -> Result<MeshBinding, BindingError> {
        let bad = || {
            invalid(format!(
                "its mesh `{}` holds what no binding does",
                self.name
            ))
        };
        let mut vertex = Some(0_u32);
        let vertices: Option<Vec<u32>> = self
            .vertices
            .iter()
            .enumerate()
            .map(|(at, step)| {
                let next = vertex?.checked_add(*step)?;
                vertex = Some(next);
                (next < self.vertex_count && (at == 0 || *step > 0)).then_some(next)
            })
            .collect();
        let mut row = 0_i64;
        let rows: Option<Vec<u32>> = self
            .rows
            .iter()
            .map(|step| {
                row += i64::from(*step);
                u32::try_from(row)
                    .ok()
                    .filter(|row| (*row as usize) < row_count)
            })
            .collect();
        let (Some(vertices), Some(rows)) = (vertices, rows) else {
            return Err(bad());
        };
        let has_turns = self.turns.is_empty() || self.turns.len() == vertices.len();
        let is_finite = self.mesh_from_root.iter().all(|x| x.is_finite());
        if vertices.len() != rows.len() || !has_turns || !is_finite {
            return Err(bad());
        }
        let turn = |turn: &[i16; 4]| {
            let turn = glam::Vec4::from_array(turn.map(|x| f32::from(x) / TURN_STEPS));
            turn.try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4)
        };
        Ok(MeshBinding {
            turns: self.turns.iter().map(turn).collect(),
            mesh_from_root: Mat3::from_cols_array(&self.mesh_from_root),
            name: self.name,
            fingerprint: self.fingerprint,
            vertex_count: self.vertex_count,
            vertices,
            rows,
        })
    }
}

impl Stored {
    /// Checks every number before it is used.
    fn binding(self, body: &BodyModel) -> Result<Binding, BindingError> {
        self.check_rig()?;
        let entries: usize = self.counts.iter().map(|count| usize::from(*count)).sum();
        if entries != self.vertices.len() || entries != self.weights.len() {
            return Err(invalid("its rows have other entries than they should"));
        }
        let mut steps = self.vertices.iter().zip(&self.weights);
        let mut rows: Vec<Vec<(u16, f32)>> = Vec::with_capacity(self.counts.len());
        for count in &self.counts {
            let mut vertex = 0_u16;
            let row: Option<Vec<(u16, f32)>> = steps
                .by_ref()
                .take(usize::from(*count))
                .map(|(step, weight)| {
                    vertex = vertex.checked_add(*step)?;
                    let is_there = usize::from(vertex) < body.vertex_count();
                    is_there.then_some((vertex, f32::from(*weight) / 255.0))
                })
                .collect();
            rows.push(row.ok_or_else(|| invalid("a row names a vertex that the body lacks"))?);
        }
        let meshes = self.meshes.into_iter().map(|mesh| mesh.binding(rows.len()));
        let meshes = meshes.collect::<Result<Vec<_>, _>>()?;
        Ok(Binding {
            rows: Rows::new(rows.iter().map(Vec::as_slice), body, &self.rig),
            body: self.body,
            shape: self.shape,
            size: self.size,
            rig: self.rig,
            meshes,
            report: self.report,
        })
    }

    fn check_rig(&self) -> Result<(), BindingError> {
        let is_turn = |turn: &glam::DQuat| turn.is_finite() && (turn.length() - 1.0).abs() < 1e-3;
        let has_bone = |bone: u8| usize::from(bone) < self.rig.bones.len();
        let is_size = |bone: &crate::Bone| bone.size_m.is_finite() && bone.size_m > 0.0;
        let has_bones = self.rig.joints.iter().all(|joint| match joint {
            Turned::By(bone) => has_bone(*bone),
            Turned::Between(low, high, share) => {
                has_bone(*low) && has_bone(*high) && (0.0..=1.0).contains(share)
            }
            Turned::WithParent => true,
        });
        let binds = self.rig.bones.iter().map(|bone| &bone.bind);
        let numbers = self.shape.iter().chain([&self.size]);
        let is_sound = self.rig.turns.iter().chain(binds).all(is_turn)
            && has_bones
            && numbers.clone().all(|x| x.is_finite())
            && self.size > 0.0
            && self.rig.bones.iter().all(is_size)
            && self.rig.metres_per_unit.is_finite();
        if is_sound {
            Ok(())
        } else {
            Err(invalid("a number in it is none that a binding has"))
        }
    }
}

fn invalid(problem: impl Into<String>) -> BindingError {
    BindingError::Invalid {
        problem: problem.into(),
    }
}
