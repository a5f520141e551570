//! How a body is shown: as it is painted, or as a sculpture; with clothes that are paint, or that span.

use dynaskin_clothes::Drape;

use crate::{BodyMesh, gpu_data::MaterialUniform, paint::Paint};

/// Plaster and dyed plaster, in linear sRGB.
const PLASTER_LINEAR: [f32; 3] = [0.56, 0.535, 0.51];
const DYED_LINEAR: [f32; 3] = [0.135, 0.175, 0.215];

/// How a body is shown; by default with its painted colours and its own surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Matt plaster in place of skin and cloth. Bodies that are not painted in skin and cloth keep their
    /// colours.
    pub sculpture: bool,
    /// Painted clothes span hollows of the skin instead of following them. Costs a few hundred thousand
    /// additions per frame.
    pub draped: bool,
}

/// What the looks of one body are made from.
#[derive(Debug)]
pub(crate) struct Looks {
    painted: MaterialUniform,
    cloth: Option<Drape>,
}

impl Looks {
    pub fn new(mesh: &BodyMesh<'_>, paint: &Paint) -> Self {
        let cloth = paint
            .cloth_shares()
            .and_then(|shares| Drape::of_clothes(&shares, mesh.faces));
        Self {
            painted: paint.material,
            cloth,
        }
    }

    /// The material of a look.
    pub fn material(&self, look: Look) -> MaterialUniform {
        if !look.sculpture || self.painted.two_tone == 0 {
            return self.painted;
        }
        let first_is_skin = self.painted.first_is_skin();
        let [first_linear, second_linear] = if first_is_skin {
            [PLASTER_LINEAR, DYED_LINEAR]
        } else {
            [DYED_LINEAR, PLASTER_LINEAR]
        };
        MaterialUniform {
            first_linear,
            second_linear,
            two_tone: 2,
            ..self.painted
        }
    }

    /// What is smoothed in a look.
    pub fn drape(&self, look: Look) -> Option<&Drape> {
        self.cloth.as_ref().filter(|_| look.draped)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use dynaskin_body::{BodyModel, Region, SHAPE_COUNT, vertex_normals};
    use glam::Vec3;

    use super::*;

    /// Normals at the ends of edges of a committed body's chest that clothes leave free, and lengths of the edges.
    fn chest_edges(name: &str, draped: bool) -> Vec<(f32, f32)> {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
        let glb = std::fs::read(models.join(name).join("body.glb")).unwrap();
        let model = BodyModel::from_glb(&glb).unwrap();
        let rest_m = model.shaped(&[0.0; SHAPE_COUNT]).positions_m;
        let joints: Vec<u8> = model.skin.iter().flat_map(|skin| skin.joints).collect();
        let weights: Vec<f32> = model.skin.iter().flat_map(|skin| skin.weights).collect();
        let mesh = BodyMesh {
            faces: model.faces.as_flattened(),
            skin_joints: &joints,
            skin_weights: &weights,
            colors_srgba: model.colors_srgba.as_flattened(),
        };
        let looks = Looks::new(&mesh, &Paint::new(&mesh));
        let look = Look {
            sculpture: true,
            draped: true,
        };
        let drape = looks.drape(look).unwrap();
        let flat = |vectors: &[Vec3]| vectors.iter().flat_map(Vec3::to_array).collect::<Vec<_>>();
        let mut positions_m = flat(&rest_m);
        let mut normals = flat(&vertex_normals(&rest_m, &model.faces));
        if draped {
            drape.apply(&mut positions_m, &mut normals);
        }
        let at = |array: &[f32], vertex: u32| Vec3::from_slice(&array[3 * vertex as usize..]);
        let chest = &model.region_weights[Region::Chest as usize];
        let faces = model.faces.iter();
        faces
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .filter(|ends| {
                let inside = |&end: &u32| chest[end as usize] > 0.5 && drape.share(end) >= 1.0;
                ends.iter().all(inside)
            })
            .map(|[a, b]| {
                let angle = at(&normals, a).angle_between(at(&normals, b)).to_degrees();
                (angle, at(&positions_m, a).distance(at(&positions_m, b)))
            })
            .collect()
    }

    #[test]
    fn no_form_smaller_than_a_fingertip_shows_under_cloth() {
        // Of edges of a centimetre at most: longer ones turn with the body.
        let sharpest = |name, draped| {
            chest_edges(name, draped)
                .into_iter()
                .filter(|&(_, length_m)| length_m < 0.01)
                .map(|(angle, _)| angle)
                .fold(0.0, f32::max)
        };
        assert!(sharpest("female", false) > 40.0);
        for name in ["female", "male"] {
            let angle = sharpest(name, true);
            assert!(angle < 20.0, "{name}: {angle}°");
        }
    }
}
