//! A binding as a vertex stage plays it: what it reads from textures of four floats a texel.

use glam::{Mat3A, Quat};

use crate::error::BindingError;
use crate::player::{Change, Player, Surface};

/// Sources in a line of the texture of changes, two texels each: the list is padded to whole lines.
pub const SOURCES_PER_LINE: usize = 128;

/// Entries of a vertex.
const MOST_ENTRIES: usize = 8;

/// Numbers of a vertex in [`Player::vertex_rows`]: its entries and two quaternions.
pub const VERTEX_NUMBERS: usize = 2 * MOST_ENTRIES + 8;

// Two texels.
const _: () = assert!(size_of::<Change>() == 2 * 4 * size_of::<f32>());

impl Player {
    /// Makes [`Self::update`] leave the surfaces as they are from now on: a vertex stage works them out from
    /// [`Self::changes`].
    pub fn leave_surfaces(&mut self) {
        self.leaves_surfaces = true;
    }

    /// What the vertices of the body that rows name have changed by, in the body's rest pose, padded with still ones
    /// to lines of [`SOURCES_PER_LINE`].
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// What a vertex takes, for each vertex of a surface from the first that moves to the last:
    /// [`VERTEX_NUMBERS`] numbers.
    ///
    /// - eight pairs of a place in [`Self::changes`] and its weight, which is 0 where there are fewer;
    /// - the turn of the row, a quaternion;
    /// - the turn of the vertex after [`Self::mesh_from_row`], a quaternion.
    ///
    /// # Errors
    /// [`BindingError::NoMesh`] for a surface that is not there, [`BindingError::Invalid`] for a row of more entries.
    pub fn vertex_rows(&self, surface: usize) -> Result<Vec<f32>, BindingError> {
        let surface = self.surface(surface)?;
        let range = surface.moving();
        let mut numbers = vec![0.0; VERTEX_NUMBERS * range.len()];
        for (at, moving) in surface.vertices.iter().enumerate() {
            let row = moving.row as usize;
            let entries = self.entries_of(row);
            if entries.len() > MOST_ENTRIES {
                return Err(BindingError::Invalid {
                    problem: format!("a row has {} entries, over {MOST_ENTRIES}", entries.len()),
                });
            }
            let from = VERTEX_NUMBERS * (moving.vertex - range.start) as usize;
            let of_vertex = &mut numbers[from..from + VERTEX_NUMBERS];
            for (pair, entry) in of_vertex.as_chunks_mut::<2>().0.iter_mut().zip(entries) {
                *pair = [entry.place as f32, entry.weight * moving.share];
            }
            let turn = surface.turns.get(at).copied().unwrap_or(Quat::IDENTITY);
            let turns = &mut of_vertex[2 * MOST_ENTRIES..];
            turns[..4].copy_from_slice(&self.binding().rows.turns[row].to_array());
            turns[4..].copy_from_slice(&turn.to_array());
        }
        Ok(numbers)
    }

    /// From a row's offset in metres to a surface's own unit and axes, and the same for changes of normals.
    ///
    /// # Errors
    /// [`BindingError::NoMesh`] for a surface that is not there.
    pub fn mesh_from_row(&self, surface: usize) -> Result<[Mat3A; 2], BindingError> {
        let surface = self.surface(surface)?;
        Ok([surface.mesh_from_row, surface.normals_from_row])
    }

    fn surface(&self, idx: usize) -> Result<&Surface, BindingError> {
        let surfaces = self.surfaces();
        surfaces.get(idx).ok_or(BindingError::NoMesh {
            mesh: idx,
            count: surfaces.len(),
        })
    }
}
