//! The surface under the painted clothes: no form that is too small for cloth to follow.

use bytemuck::{cast_slice, cast_slice_mut};
use dynaskin_body::vertex_normals;
use dynaskin_clothes::{Drape, Placing, Pocket};
use glam::Vec3;

/// Lays fine patches of the mesh under clothes on what is around them, by the same linear rule for every body: so that
/// chest tips show in no engine, whatever the shape.
///
/// Vertices move along the normal alone, so that the offsets which were learned for them stay where they belong.
///
/// `cloth_shares` says how much of each vertex is cloth, 0..=1, and `mirror` which vertex is each one's twin.
pub(super) fn flatten(
    template_m: &mut [Vec3],
    shape_dirs_m: &mut [Vec<Vec3>],
    faces: &[[u32; 3]],
    cloth_shares: &[f32],
    mirror: &[usize],
) {
    let Some(drape) = Drape::of_clothes(cloth_shares, faces.as_flattened()) else {
        return;
    };
    let normals = vertex_normals(template_m, faces);
    let pockets = drape.find_pockets(cast_slice(template_m), cast_slice(&normals), Placing::Own);
    lay(&pockets, template_m, mirror);
    for dirs_m in shape_dirs_m {
        lay(&pockets, dirs_m, mirror);
    }
}

fn lay(pockets: &[Pocket], vectors: &mut [Vec3], mirror: &[usize]) {
    for pocket in pockets {
        pocket.apply(cast_slice_mut(vectors));
    }
    // The pockets of both sides are fitted by themselves, and differ by a rounding.
    let flip = Vec3::new(-1.0, 1.0, 1.0);
    let laid = vectors.to_vec();
    for (vector, (&own, &twin)) in vectors.iter_mut().zip(laid.iter().zip(mirror)) {
        *vector = 0.5 * (own + flip * laid[twin]);
    }
}
