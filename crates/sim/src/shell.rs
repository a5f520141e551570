//! The shell of tetrahedra between the skin and an inner surface that follows the bones.

mod columns;
mod elements;
mod inner;
mod surface;
mod tissue;
mod topology;

use dynaskin_body::{BodyModel, SHAPE_COUNT};

use crate::settings::SimSettings;
pub use surface::{ShellError, Surface};
#[cfg(test)]
pub(crate) use tissue::Tet;
pub(crate) use tissue::{Prism, TETS_PER_PRISM, Triangle};
pub use tissue::{Shell, ShellReport};
pub use topology::soft_vertices;

impl Shell {
    /// The soft tissue of a body at one shape.
    ///
    /// # Errors
    /// [`ShellError`] if the model knows no tissue or nothing of it is soft.
    pub fn for_body(
        model: &BodyModel,
        shape: &[f32; SHAPE_COUNT],
        settings: &SimSettings,
    ) -> Result<Self, ShellError> {
        Self::new(&Surface::of_body(model, shape)?, settings).ok_or_else(|| {
            ShellError::NothingSoft {
                body: model.name.clone(),
                threshold: settings.softness_threshold,
            }
        })
    }

    /// The soft tissue under a surface; none where no vertex is soft.
    pub fn new(surface: &Surface, settings: &SimSettings) -> Option<Self> {
        let columns = columns::Columns::new(surface, settings)?;
        let inner = inner::InnerSurface::fit(surface, &columns, settings);
        Some(elements::build(surface, settings, columns, inner))
    }

    /// Body vertices that move, ascending: the order of every offset array.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Depth of the tissue in metres under each of [`Self::vertices`].
    pub fn depth_m(&self) -> &[f32] {
        &self.depth_m
    }

    /// Counts and masses.
    pub fn report(&self) -> ShellReport {
        self.report
    }
}
