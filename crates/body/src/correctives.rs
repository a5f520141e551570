//! Pose correctives laid out for every frame: in blocks of vertices, in 16 bits, without what moves nothing.

use glam::{DMat3, Vec3};

use crate::glb::smallest_step_m;
use crate::{BodyModel, JOINT_COUNT, Pose};

/// Fields of one joint: the entries of `R - I`, row by row.
const FIELDS: usize = 9;

/// Vertices of a block. A block's positions stay in the processor's nearest memory while all joints move them.
const BLOCK_VERTICES: usize = 64;
const BLOCK_NUMBERS: usize = 3 * BLOCK_VERTICES;

/// What all fields of one joint move a vertex by at most where they are left out, in metres.
const NEGLIGIBLE_M: f32 = 1e-7;

/// The numbers of one field in one block, in steps.
type Field = [i16; BLOCK_NUMBERS];

/// The factors of the fields of each joint but the pelvis: the entries of `R - I`, row by row (Eq. 3 of Casas &
/// Otaduy 2018).
pub(crate) fn factors(pose: &Pose) -> impl Iterator<Item = [f32; FIELDS]> + '_ {
    pose.parent_from_joint[1..].iter().map(|rotation| {
        // Rows of R are numbered first; glam keeps columns.
        let difference = (DMat3::from_quat(*rotation) - DMat3::IDENTITY).transpose();
        difference.to_cols_array().map(|entry| entry as f32)
    })
}

/// The pose correctives of a body, for hosts that add them in every frame: faster than
/// [`BodyModel::add_pose_correctives`], with half the numbers.
///
/// Numbers of a body's file are kept exactly. Others are rounded to 16 bits of the largest beside them. Where
/// a joint's fields together move no vertex of a block by 0.1 µm they are left out, 2.3 µm for all joints.
#[derive(Clone, Debug)]
pub struct PoseCorrectives {
    vertex_count: usize,
    /// By vertices, then by joints.
    parts: Vec<Part>,
    /// Of each part.
    fields: Vec<[Field; FIELDS]>,
}

/// What one joint does to one block of vertices.
#[derive(Clone, Debug)]
struct Part {
    block: u32,
    /// Counted without the pelvis.
    joint: u8,
    steps_m: [f32; FIELDS],
    /// The largest length of a vertex's numbers of all fields, in metres.
    reach_m: f32,
}

impl PoseCorrectives {
    /// Those of `body`; none where it has none.
    pub fn new(body: &BodyModel) -> Option<Self> {
        let vertex_count = body.vertex_count();
        let (joints, rest) = body.pose_dirs_m.as_chunks::<FIELDS>();
        let is_whole = rest.is_empty() && joints.len() == JOINT_COUNT - 1;
        let has_all = body
            .pose_dirs_m
            .iter()
            .all(|dirs| dirs.len() == vertex_count);
        if !is_whole || !has_all {
            return None;
        }
        let mut all = Self {
            vertex_count,
            parts: Vec::new(),
            fields: Vec::new(),
        };
        for block in 0..vertex_count.div_ceil(BLOCK_VERTICES) {
            let first = block * BLOCK_VERTICES;
            let last = vertex_count.min(first + BLOCK_VERTICES);
            for (joint, dirs) in (0..).zip(joints) {
                let squares = (first..last).map(|vertex| {
                    let of_vertex = dirs.iter().map(|dirs| dirs[vertex].length_squared());
                    of_vertex.sum::<f32>()
                });
                let reach_m = squares.fold(0.0, f32::max).sqrt();
                // No entry of `R - I` is beyond 2, so nothing that is smaller ever counts.
                if reach_m * LARGEST_DIFFERENCE < NEGLIGIBLE_M {
                    continue;
                }
                let packed = dirs.each_ref().map(|dirs| pack(&dirs[first..last]));
                all.parts.push(Part {
                    block: block as u32,
                    joint,
                    steps_m: packed.map(|(step_m, _)| step_m),
                    reach_m,
                });
                all.fields.push(packed.map(|(_, field)| field));
            }
        }
        Some(all)
    }

    /// Adds them to rest positions in metres, as [`BodyModel::add_pose_correctives`] does.
    ///
    /// # Panics
    /// When there are not as many positions as the body has vertices.
    pub fn add(&self, pose: &Pose, rest_m: &mut [Vec3]) {
        assert!(rest_m.len() == self.vertex_count);
        let mut joints = [([0.0; FIELDS], 0.0_f32); JOINT_COUNT - 1];
        for (joint, factors) in joints.iter_mut().zip(factors(pose)) {
            let squares = factors.iter().map(|factor| factor * factor);
            *joint = (factors, squares.sum::<f32>().sqrt());
        }
        let numbers_m: &mut [f32] = bytemuck::cast_slice_mut(rest_m);
        let (blocks, rest) = numbers_m.as_chunks_mut::<BLOCK_NUMBERS>();
        // The last block may have fewer vertices.
        let mut last = [0.0; BLOCK_NUMBERS];
        last[..rest.len()].copy_from_slice(rest);
        for (part, fields) in self.parts.iter().zip(&self.fields) {
            let (factors, length) = &joints[usize::from(part.joint)];
            if length * part.reach_m < NEGLIGIBLE_M {
                continue;
            }
            let mut weights_m = part.steps_m;
            for (weight_m, factor) in weights_m.iter_mut().zip(factors) {
                *weight_m *= factor;
            }
            let block = blocks.get_mut(part.block as usize);
            add_fields(block.unwrap_or(&mut last), fields, &weights_m);
        }
        rest.copy_from_slice(&last[..rest.len()]);
    }
}

/// The largest length of the entries of `R - I` together: that of half a turn, whose trace is -1.
const LARGEST_DIFFERENCE: f32 = 2.829;

/// One field of a block in steps.
fn pack(dirs_m: &[Vec3]) -> (f32, Field) {
    let mut field = [0; BLOCK_NUMBERS];
    let numbers_m: &[f32] = bytemuck::cast_slice(dirs_m);
    let largest_m = numbers_m.iter().fold(0.0_f32, |most, m| most.max(m.abs()));
    // A body has none as large as that.
    let step_m = smallest_step_m(largest_m).unwrap_or(f32::MAX);
    for (number, m) in field.iter_mut().zip(numbers_m) {
        *number = (m / step_m).round() as i16;
    }
    (step_m, field)
}

/// Adds all fields of a part in one pass. How many numbers there are is known, so that several are worked on at once.
fn add_fields(
    numbers_m: &mut [f32; BLOCK_NUMBERS],
    fields: &[Field; FIELDS],
    weights_m: &[f32; FIELDS],
) {
    for (number, sum_m) in numbers_m.iter_mut().enumerate() {
        for (field, weight_m) in fields.iter().zip(weights_m) {
            *sum_m += weight_m * f32::from(field[number]);
        }
    }
}
