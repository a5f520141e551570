//! Which vertices are soft, and their neighbours.

/// Vertices whose region weights sum to more than `threshold`, ascending. It depends on no shape,
/// so that one network serves all shapes of a body.
pub fn soft_vertices(region_weights: &[Vec<f32>], threshold: f32) -> Vec<u32> {
    let count = region_weights.first().map_or(0, Vec::len);
    (0..count)
        .filter(|&vertex| softness(region_weights, vertex) > threshold)
        .map(|vertex| vertex as u32)
        .collect()
}

/// Sum of a vertex's region weights, at most 1.
pub(super) fn softness(region_weights: &[Vec<f32>], vertex: usize) -> f32 {
    region_weights
        .iter()
        .map(|weights| weights[vertex])
        .sum::<f32>()
        .min(1.0)
}

/// Neighbours of each vertex along the edges of `faces`, ascending.
pub(super) fn neighbours(vertex_count: usize, faces: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); vertex_count];
    for face in faces {
        for corner in 0..3 {
            let (a, b) = (face[corner], face[(corner + 1) % 3]);
            lists[a as usize].push(b);
            lists[b as usize].push(a);
        }
    }
    for list in &mut lists {
        list.sort_unstable();
        list.dedup();
    }
    lists
}
