//! Pictures drawn on whatever adapter there is: content, both skinning paths, heat map, shadow.

mod common;

use common::{SIZE, TestBody, bent_pose, differing_share, mean_difference, picture, renderer};
use dynaskin_render::{Camera, OffsetSizes, PixelSize, SkinningPath, heat_ramp_srgb};
use glam::Vec3;

const PATHS: [SkinningPath; 2] = [SkinningPath::Compute, SkinningPath::VertexStage];

fn variance(pixels: &[u8]) -> f64 {
    let mean = pixels.iter().map(|&value| f64::from(value)).sum::<f64>() / pixels.len() as f64;
    pixels
        .iter()
        .map(|&value| (f64::from(value) - mean).powi(2))
        .sum::<f64>()
        / pixels.len() as f64
}

#[test]
fn the_picture_shows_a_body_of_the_right_size() {
    for path in PATHS {
        let Some(mut renderer) = renderer("the_picture_shows_a_body_of_the_right_size", path)
        else {
            return;
        };
        let empty = picture(&mut renderer);
        let id = TestBody::standing().add_to(&mut renderer, OffsetSizes::Zero);
        let with_body = picture(&mut renderer);
        // The body is 1.7 m of 2.2 m tall, a fifth of that wide, plus its shadow.
        let share = differing_share(&empty, &with_body, 12);
        assert!((0.06..0.30).contains(&share), "{path:?}: {share}");
        assert!(
            variance(&with_body) > 200.0,
            "{path:?}: {}",
            variance(&with_body)
        );

        renderer.set_body_visible(id, false).unwrap();
        assert_eq!(mean_difference(&picture(&mut renderer), &empty), 0.0);
    }
}

#[test]
fn both_skinning_paths_draw_the_same_picture() {
    let pictures: Vec<Vec<u8>> = PATHS
        .iter()
        .filter_map(|&path| renderer("both_skinning_paths_draw_the_same_picture", path))
        .map(|mut renderer| {
            let id = TestBody::standing().add_to(&mut renderer, OffsetSizes::Zero);
            renderer.set_skin_matrices(id, &bent_pose(0.3)).unwrap();
            picture(&mut renderer)
        })
        .collect();
    if let [compute, vertex_stage] = pictures.as_slice() {
        let difference = mean_difference(compute, vertex_stage);
        println!("mean difference {difference:.4} of 255");
        // A hardware adapter's two paths also differ in the shadow map's resolution.
        assert!(difference < 0.5, "{difference}");
        assert!(differing_share(compute, vertex_stage, 24) < 0.005);
    }
}

#[test]
fn the_floor_under_the_body_is_shadowed() {
    let Some(mut renderer) = renderer(
        "the_floor_under_the_body_is_shadowed",
        SkinningPath::Compute,
    ) else {
        return;
    };
    // Straight down from above, slightly beside: the shadow falls to the body's left and back.
    let eye_world_m = Vec3::new(0.0, 5.0, 0.01);
    let target_world_m = Vec3::ZERO;
    renderer
        .set_camera(Camera {
            eye_world_m,
            target_world_m,
            fov_y_radians: 0.6,
        })
        .unwrap();
    let lit = picture(&mut renderer);
    TestBody::standing().add_to(&mut renderer, OffsetSizes::Zero);
    let shadowed = picture(&mut renderer);
    // A point of the floor on the line from the head away from the key light.
    let at = |x_m: f32, z_m: f32| {
        let pixels_per_m = SIZE.height as f32 / (2.0 * 5.0 * 0.3_f32.tan());
        let column = (SIZE.width as f32 * 0.5 + x_m * pixels_per_m) as usize;
        let row = (SIZE.height as f32 * 0.5 + z_m * pixels_per_m) as usize;
        4 * (row * SIZE.width as usize + column)
    };
    let darkening = |x_m, z_m| {
        let idx = at(x_m, z_m);
        i32::from(lit[idx + 1]) - i32::from(shadowed[idx + 1])
    };
    // The key stands at (-0.30, 0.90, 0.80): a torso 1.1 m up throws its shadow to (0.37, -0.98).
    assert!(darkening(0.37, -0.98) > 10, "{}", darkening(0.37, -0.98));
    assert!(darkening(-0.8, 0.7).abs() <= 3, "{}", darkening(-0.8, 0.7));
}

/// Mean colour, 0..=1, of the pixels that `select` picks by column.
fn mean_color(pixels: &[u8], mask: &[bool], select: impl Fn(usize) -> bool) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut count = 0.0;
    for (idx, pixel) in pixels.as_chunks::<4>().0.iter().enumerate() {
        if mask[idx] && select(idx % SIZE.width as usize) {
            count += 1.0;
            for (sum, &value) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(value) / 255.0;
            }
        }
    }
    sum.map(|sum| sum / count)
}

fn distance(a: [f64; 3], b: [f32; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - f64::from(b)).powi(2))
        .sum::<f64>()
        .sqrt()
}

#[test]
fn the_heat_map_shows_the_legends_colors() {
    for path in PATHS {
        let Some(mut renderer) = renderer("the_heat_map_shows_the_legends_colors", path) else {
            return;
        };
        let camera = Camera {
            eye_world_m: Vec3::new(0.0, 1.0, 4.0),
            ..Camera::default()
        };
        renderer.set_camera(camera).unwrap();
        let body = TestBody::standing();
        // The body's left half (+X, right in the picture) is off by 20 mm, given as vectors.
        let offset = |x_m: f32| {
            if x_m > 0.0 {
                [0.0, 0.012, -0.016]
            } else {
                [0.0; 3]
            }
        };
        let offsets_m: Vec<f32> = body
            .positions_m
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|p| offset(p[0]))
            .collect();
        body.add_to(&mut renderer, OffsetSizes::Vectors(&offsets_m));
        let painted = picture(&mut renderer);
        renderer.set_heat_map(Some(20.0)).unwrap();
        let heated = picture(&mut renderer);

        let pairs = painted
            .as_chunks::<4>()
            .0
            .iter()
            .zip(heated.as_chunks::<4>().0);
        let mask: Vec<bool> = pairs.map(|(a, b)| a != b).collect();
        let half = SIZE.width as usize / 2;
        let cold = mean_color(&heated, &mask, |column| column + 6 < half);
        let hot = mean_color(&heated, &mask, |column| column > half + 6);
        let ramp = heat_ramp_srgb();
        let ends = [ramp[0], ramp[ramp.len() - 1]];
        println!("{path:?}: cold {cold:.2?}, hot {hot:.2?}, legend {ends:.2?}");
        // Shading dims the colours: each side has to be nearest to its own end of the legend.
        assert!(distance(cold, ends[0]) < 0.3 && distance(hot, ends[1]) < 0.3);
        assert!(distance(cold, ends[1]) > 0.5 && distance(hot, ends[0]) > 0.5);

        // A longer range makes the hot side less hot.
        renderer.set_heat_map(Some(60.0)).unwrap();
        let cooler = mean_color(&picture(&mut renderer), &mask, |column| column > half + 6);
        assert!(distance(cooler, ends[1]) > distance(hot, ends[1]) + 0.1);
    }
}

#[test]
fn a_resized_picture_has_the_new_size() {
    let Some(mut renderer) = renderer("a_resized_picture_has_the_new_size", SkinningPath::Compute)
    else {
        return;
    };
    TestBody::standing().add_to(&mut renderer, OffsetSizes::Zero);
    for (css, ratio, bytes) in [((50.0, 30.0), 1.5, 75 * 45 * 4), ((1.0, 1.0), 1.0, 4)] {
        renderer.resize(PixelSize::from_css(css.0, css.1, ratio).unwrap());
        renderer.render().unwrap();
        assert_eq!(
            pollster::block_on(renderer.read_pixels()).unwrap().len(),
            bytes
        );
    }
    renderer.resize(PixelSize {
        width: u32::MAX,
        height: 1,
    });
    assert!(renderer.size().width < 1 << 16);
    renderer.render().unwrap();
}
