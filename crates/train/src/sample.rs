//! Frames drawn from the training clips, and mirror images of latents.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::TrainError;
use crate::data::{DataSet, Tissue};
use crate::mirror::Mirror;
use crate::split::Set;

/// Latents of the mirror images of frames whose `latents` are given, `[frame][component]` flat;
/// `induced` is what mirroring does to a latent, `[component][component]` row-major.
pub fn mirrored_latents(induced: &[f32], components: usize, latents: &[f32]) -> Vec<f32> {
    let induced = DMatrix::from_row_slice(components, components, induced);
    let frames = DMatrix::from_row_slice(latents.len() / components, components, latents);
    (frames * induced).transpose().as_slice().to_vec()
}

/// Which frames [`sample_offsets`] draws.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// From clips of which tissue.
    pub tissue: Tissue,
    /// How many, about.
    pub frames: usize,
    /// Seed of the draw.
    pub seed: u64,
}

/// Random frames of the training clips, and their mirror images, one a row. `progress` is told the
/// number of clips read.
///
/// # Errors
/// What reading a clip can give.
pub fn sample_offsets(
    data_set: &DataSet,
    draw: Draw,
    mirror: Option<&Mirror>,
    mut progress: impl FnMut(usize),
) -> Result<DMatrix<f32>, TrainError> {
    let tissue = draw.tissue;
    let coordinates = 3 * data_set.vertices.len();
    let frames: usize = data_set
        .of_set(Set::Training, tissue)
        .map(|clip| clip.frames)
        .sum();
    let share = draw.frames as f64 / frames.max(1) as f64;
    let mut rng = Pcg64Mcg::seed_from_u64(draw.seed);
    // Column-major with a frame a column, turned at the end.
    let mut columns: Vec<f32> = Vec::new();
    let mut image = vec![0.0; coordinates];
    for (index, entry) in data_set.of_set(Set::Training, tissue).enumerate() {
        let clip = data_set.read(entry)?;
        for frame in 0..clip.frame_count() {
            if rng.random::<f64>() >= share {
                continue;
            }
            let start = columns.len();
            columns.extend(clip.frame_offsets_rest_m(frame).iter().map(|x| x.to_f32()));
            if let Some(mirror) = mirror {
                mirror.apply(&columns[start..], &mut image);
                columns.extend_from_slice(&image);
            }
        }
        progress(index + 1);
    }
    let rows = columns.len() / coordinates;
    Ok(DMatrix::from_vec(coordinates, rows, columns).transpose())
}
