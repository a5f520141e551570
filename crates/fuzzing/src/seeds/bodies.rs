//! Bodies as the two formats have them.

use dynaskin_body::{Joint, POSE_DIR_COUNT};
use glam::Vec3;

use crate::{container, stage};

/// The made-up body, without what a body may lack, without pose correctives, and with them.
pub fn glb() -> Vec<Vec<u8>> {
    let mut bare = (**stage::body()).clone();
    bare.region_weights = Vec::new();
    let mut full = (**stage::body()).clone();
    let n = full.vertex_count();
    full.thickness_template_m = vec![0.02; n];
    full.thickness_shape_dirs_m = vec![vec![0.001; n]; 10];
    full.colors_srgba = vec![[200, 150, 120, 255]; n];
    let mut corrected = full.clone();
    corrected.pose_dirs_m = vec![vec![Vec3::new(0.01, -0.003, 0.0); n]; POSE_DIR_COUNT];
    let written =
        [bare, full, corrected].map(|body| body.to_glb().expect("the made-up body can be written"));
    written.to_vec()
}

/// Four vertices with pose correctives, and in single precision without.
pub fn npz() -> Vec<Vec<u8>> {
    [(8, true), (4, false)]
        .into_iter()
        .filter_map(|(size, has_correctives)| npz_file(size, has_correctives))
        .collect()
}

fn npz_file(size: usize, has_correctives: bool) -> Option<Vec<u8>> {
    const VERTICES: usize = 4;
    let floats = |name: &str, shape: &[usize], number: &dyn Fn(usize) -> f64| {
        let numbers = (0..shape.iter().product()).map(number);
        let data: Vec<u8> = match size {
            8 => numbers.flat_map(f64::to_le_bytes).collect(),
            _ => numbers.flat_map(|x| (x as f32).to_le_bytes()).collect(),
        };
        (
            format!("{name}.npy"),
            container::npy(&format!("<f{size}"), shape, &data),
        )
    };
    let integers = |name: &str, shape: &[usize], numbers: &[u32]| {
        let data: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        (format!("{name}.npy"), container::npy("<u4", shape, &data))
    };
    let wave = |scale: f64| move |k: usize| scale * (k as f64 * 1.3).sin();
    let parents = Joint::ALL.map(|joint| joint.parent().map_or(u32::MAX, |p| p as u32));
    let tree: Vec<u32> = parents.into_iter().chain(0..24).collect();
    let mut entries = vec![
        floats("v_template", &[VERTICES, 3], &wave(0.9)),
        floats("shapedirs", &[VERTICES, 3, 10], &wave(0.02)),
        floats("J_regressor", &[24, VERTICES], &|_| 1.0 / VERTICES as f64),
        floats("weights", &[VERTICES, 24], &|k| {
            if k % 24 < 4 { 0.25 } else { 0.0 }
        }),
        integers("kintree_table", &[2, 24], &tree),
        integers("f", &[2, 3], &[0, 1, 2, 1, 2, 3]),
    ];
    if has_correctives {
        entries.push(floats("posedirs", &[VERTICES, 3, 207], &wave(0.01)));
    }
    container::zip(&entries, !has_correctives)
}
