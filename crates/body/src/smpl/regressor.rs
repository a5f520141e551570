//! The joint regressor: a matrix that gives joints as sums over vertices.
//!
//! SciPy keeps it sparse, as compressed rows or columns. Files that were made from it have it dense, or
//! its fields one by one: `J_regressor_data`, `J_regressor_indices` and `J_regressor_indptr` (also with
//! a dot or a slash).

use std::io::{Read, Seek};

use dynaskin_npz::Archive;
use glam::DVec3;

use super::joints::Joints;
use super::wrong;
use crate::{BodyError, JOINT_COUNT, Joint};

const KEY: &str = "J_regressor";
/// How far from 1 the weights of a joint may sum: published ones do to rounding.
const MOST_OFF: f64 = 0.01;

/// The vertices of each joint and their shares.
pub(super) struct Regressor {
    /// `[joint]`.
    rows: [Vec<(usize, f64)>; JOINT_COUNT],
    /// Whether the file has it as a sparse matrix's fields.
    pub is_sparse: bool,
}

impl Regressor {
    /// Reads it for SMPL's joints.
    ///
    /// # Errors
    /// [`BodyError::Npz`].
    pub fn read<R: Read + Seek>(
        file: &mut Archive<R>,
        joints: &Joints,
        vertex_count: usize,
    ) -> Result<Self, BodyError> {
        let fields = ['_', '.', '/']
            .map(|between| {
                ["data", "indices", "indptr"].map(|field| format!("{KEY}{between}{field}"))
            })
            .into_iter()
            .find(|keys| keys.iter().all(|key| file.has(key)));
        let (of_file, is_sparse) = match fields {
            Some(keys) if !file.has(KEY) => {
                (sparse(file, &keys, joints.count(), vertex_count)?, true)
            }
            _ => (dense(file, joints.count(), vertex_count)?, false),
        };
        // Joints are means of vertices: other sums come of a matrix that is empty or turned round.
        let off = (of_file.iter()).position(|row| {
            let sum: f64 = row.iter().map(|(_, weight)| weight).sum();
            (sum - 1.0).abs() > MOST_OFF
        });
        if let Some(joint) = off {
            let expected = "weights that sum to 1 at every joint".to_owned();
            return Err(wrong(KEY, expected, format!("others at joint {joint}")));
        }
        let rows = Joint::ALL.map(|joint| {
            let sources = &joints.placed_by[joint as usize];
            let share = 1.0 / sources.len() as f64;
            let entries = sources.iter().filter_map(|source| of_file.get(*source));
            entries
                .flatten()
                .map(|(vertex, weight)| (*vertex, share * weight))
                .collect()
        });
        Ok(Self { rows, is_sparse })
    }

    /// The joints of a surface, or their directions of its directions.
    pub fn joints_m(&self, points_m: &[DVec3]) -> [DVec3; JOINT_COUNT] {
        self.rows.each_ref().map(|row| {
            row.iter()
                .map(|(vertex, weight)| *weight * points_m[*vertex])
                .sum()
        })
    }
}

type Rows = Vec<Vec<(usize, f64)>>;

fn dense<R: Read + Seek>(
    file: &mut Archive<R>,
    joint_count: usize,
    vertex_count: usize,
) -> Result<Rows, BodyError> {
    let mut rows: Rows = vec![Vec::new(); joint_count];
    let shape = [Some(joint_count), Some(vertex_count)];
    file.visit_floats(KEY, &shape, &[], |index, weight| {
        if let [joint, vertex] = index
            && weight != 0.0
        {
            rows[*joint].push((*vertex, weight));
        }
    })?;
    Ok(rows)
}

fn sparse<R: Read + Seek>(
    file: &mut Archive<R>,
    [data, indices, indptr]: &[String; 3],
    joint_count: usize,
    vertex_count: usize,
) -> Result<Rows, BodyError> {
    let weights = file.floats(data, &[None])?.into_c_order();
    let across = file
        .integers(indices, &[Some(weights.len())])?
        .into_c_order();
    let starts = file.integers(indptr, &[None])?.into_c_order();
    let is_by_column = starts.len() == vertex_count + 1;
    if !is_by_column && starts.len() != joint_count + 1 {
        let expected = format!(
            "{} starts of rows or {} of columns",
            joint_count + 1,
            vertex_count + 1
        );
        return Err(wrong(indptr, expected, starts.len().to_string()));
    }
    let is_rising = starts.windows(2).all(|pair| pair[0] <= pair[1])
        && starts.first() == Some(&0.0)
        && starts.last() == Some(&(weights.len() as f64));
    if !is_rising {
        let expected = format!("starts that rise from 0 to {}", weights.len());
        return Err(wrong(indptr, expected, "others"));
    }
    let limit = if is_by_column {
        joint_count
    } else {
        vertex_count
    };
    if let Some(odd) = across
        .iter()
        .find(|index| !(0.0..limit as f64).contains(*index))
    {
        return Err(wrong(
            indices,
            format!("indices below {limit}"),
            odd.to_string(),
        ));
    }
    let mut rows: Rows = vec![Vec::new(); joint_count];
    for (line, pair) in starts.windows(2).enumerate() {
        let line_entries = pair[0] as usize..pair[1] as usize;
        for (across, weight) in across[line_entries.clone()]
            .iter()
            .zip(&weights[line_entries])
        {
            let across = *across as usize;
            let (joint, vertex) = if is_by_column {
                (across, line)
            } else {
                (line, across)
            };
            rows[joint].push((vertex, *weight));
        }
    }
    Ok(rows)
}
