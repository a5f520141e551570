//! The committed bodies in their painted sportswear: smooth hems, and skin of one hue in any light.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::Path;

use common::{SIZE, picture, renderer};
use dynaskin_body::{BodyModel, SHAPE_COUNT, vertex_normals};
use dynaskin_render::{BodyId, BodyMesh, Camera, OffsetSizes, Renderer, SkinningPath};
use glam::Vec3;

/// A committed body as it stands at rest.
struct Standing {
    model: BodyModel,
    positions_m: Vec<f32>,
    normals: Vec<f32>,
}

impl Standing {
    fn new(name: &str) -> Self {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
        let glb = std::fs::read(models.join(name).join("body.glb")).unwrap();
        let model = BodyModel::from_glb(&glb).unwrap();
        let rest_m = model.shaped(&[0.0; SHAPE_COUNT]).positions_m;
        let normals = vertex_normals(&rest_m, &model.faces);
        let flat = |vectors: &[Vec3]| vectors.iter().flat_map(Vec3::to_array).collect();
        Self {
            positions_m: flat(&rest_m),
            normals: flat(&normals),
            model,
        }
    }

    fn add_to(&self, renderer: &mut Renderer) -> BodyId {
        let skin = &self.model.skin;
        let joints: Vec<u8> = skin.iter().flat_map(|s| s.joints).collect();
        let weights: Vec<f32> = skin.iter().flat_map(|s| s.weights).collect();
        let mesh = BodyMesh {
            faces: self.model.faces.as_flattened(),
            skin_joints: &joints,
            skin_weights: &weights,
            colors_srgba: self.model.colors_srgba.as_flattened(),
        };
        renderer.add_body(&mesh).unwrap()
    }

    fn set_surface(&self, renderer: &mut Renderer, id: BodyId) {
        let (positions_m, normals) = (&self.positions_m, &self.normals);
        renderer
            .set_surface(id, positions_m, normals, OffsetSizes::Zero)
            .unwrap();
    }
}

/// Cloth is bluer than red, skin redder than blue, the studio neither by much.
fn is_cloth([r, _, b, _]: [u8; 4]) -> bool {
    b > r.saturating_add(6) && r < 90
}

fn is_skin([r, _, b, _]: [u8; 4]) -> bool {
    r > b.saturating_add(20)
}

/// Looks straight at a point of the body's front, 0.5 m from top to bottom of the picture.
fn front(target_world_m: Vec3) -> Camera {
    Camera {
        eye_world_m: target_world_m + 2.5 * Vec3::Z,
        target_world_m,
        fov_y_radians: 0.2,
    }
}

/// In each column the row of the picture's middle half where skin and cloth meet, if they do so once.
fn hem_rows(pixels: &[u8]) -> Vec<Option<f64>> {
    let pixels = pixels.as_chunks::<4>().0;
    let (width, height) = (SIZE.width as usize, SIZE.height as usize);
    let columns = (0..width).map(|column| {
        let cloth = |row: usize| is_cloth(pixels[row * width + column]);
        // Other hems may be above and below.
        let middle = height / 4..3 * height / 4;
        let mut changes = middle.filter(|&row| cloth(row) != cloth(row - 1));
        let row = changes.next()?;
        (changes.next().is_none()
            && (is_skin(pixels[row.saturating_sub(3) * width + column])
                || is_skin(pixels[(row + 3).min(height - 1) * width + column])))
        .then_some(row as f64)
    });
    columns.collect()
}

#[test]
fn hems_are_smooth_though_the_triangles_are_not() {
    // The waist of her shorts, and the hem at his left thigh.
    let places = [
        ("female", Vec3::new(0.0, 0.92, 0.0)),
        ("male", Vec3::new(0.13, 0.72, 0.0)),
    ];
    for (name, target_m) in places {
        let test = "hems_are_smooth_though_the_triangles_are_not";
        let Some(mut renderer) = renderer(test, SkinningPath::Compute) else {
            return;
        };
        renderer.set_camera(front(target_m)).unwrap();
        let body = Standing::new(name);
        let id = body.add_to(&mut renderer);
        body.set_surface(&mut renderer, id);
        let rows = hem_rows(&picture(&mut renderer));
        // How far the hem leaves the mean of itself two centimetres to either side, at 1.25 mm a pixel.
        let leaves: Vec<f64> = (16..rows.len() - 16)
            .filter_map(|at| {
                let [left, here, right] = [rows[at - 16]?, rows[at]?, rows[at + 16]?];
                Some((here - 0.5 * (left + right)).abs() * 1.25)
            })
            .collect();
        let worst_mm = leaves.iter().copied().fold(0.0, f64::max);
        println!(
            "{name}: the hem leaves itself by {worst_mm:.1} mm, {} columns",
            leaves.len()
        );
        assert!(leaves.len() > 60, "{name}: {}", leaves.len());
        assert!(worst_mm < 3.0, "{name}: {worst_mm} mm");
    }
}

#[test]
fn clothes_are_cut_the_same_whenever_a_body_appears() {
    let test = "clothes_are_cut_the_same_whenever_a_body_appears";
    let body = Standing::new("female");
    let pictures: Vec<Vec<u8>> = [false, true]
        .into_iter()
        .filter_map(|moves_first| {
            let mut renderer = renderer(test, SkinningPath::Compute)?;
            renderer
                .set_camera(front(Vec3::new(0.0, 1.15, 0.0)))
                .unwrap();
            let id = body.add_to(&mut renderer);
            if moves_first {
                // Everything hangs two centimetres lower towards the front.
                let offsets_m: Vec<f32> = body
                    .positions_m
                    .as_chunks::<3>()
                    .0
                    .iter()
                    .flat_map(|p| [0.0, -0.2 * p[2].max(0.0), 0.0])
                    .collect();
                let pairs = body.positions_m.iter().zip(&offsets_m);
                let moved_m: Vec<f32> = pairs.map(|(at, offset)| at + offset).collect();
                let offsets = OffsetSizes::Vectors(&offsets_m);
                renderer
                    .set_surface(id, &moved_m, &body.normals, offsets)
                    .unwrap();
            }
            body.set_surface(&mut renderer, id);
            Some(picture(&mut renderer))
        })
        .collect();
    if let [still, moved] = pictures.as_slice() {
        assert!(common::differing_share(still, moved, 3) < 1e-3);
    }
}

#[test]
fn skin_has_one_hue_where_light_turns_to_shade() {
    let test = "skin_has_one_hue_where_light_turns_to_shade";
    let Some(mut renderer) = renderer(test, SkinningPath::Compute) else {
        return;
    };
    // From her left, where the key light's edge runs down face, trunk and legs.
    let camera = Camera {
        eye_world_m: Vec3::new(1.4, 1.5, 3.6),
        target_world_m: Vec3::new(0.0, 0.9, 0.0),
        fov_y_radians: 0.5,
    };
    renderer.set_camera(camera).unwrap();
    let body = Standing::new("female");
    let id = body.add_to(&mut renderer);
    body.set_surface(&mut renderer, id);
    let pixels = picture(&mut renderer);
    let linear = |byte: u8| (f64::from(byte) / 255.0).powf(2.2);
    let mut redness: Vec<f64> = pixels
        .as_chunks::<4>()
        .0
        .iter()
        .filter(|&&pixel| is_skin(pixel))
        .map(|&[r, g, _, _]| linear(r) / linear(g))
        .collect();
    redness.sort_by(f64::total_cmp);
    let at = |share: f64| redness[(share * (redness.len() - 1) as f64) as usize];
    println!(
        "red over green: median {:.2}, 98 % below {:.2}",
        at(0.5),
        at(0.98)
    );
    assert!(redness.len() > 3_000, "{}", redness.len());
    assert!(at(0.98) < 1.18 * at(0.5), "{} {}", at(0.98), at(0.5));
}
