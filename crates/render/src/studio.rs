//! Where the studio's lights, shadow and floor are in one frame.

use glam::{
    Mat4, Vec3, Vec3Swizzles,
    camera::rh::{proj::directx, view},
};

use crate::{Camera, gpu_data::MAX_OCCLUDERS, parts::WorldPart};

/// Towards the key light, in the world: above, in front of the body, a little to its right: on the side
/// from which a body is usually looked at.
const KEY_WORLD: Vec3 = Vec3::new(-0.30, 0.90, 0.80);

/// Width of the shadow map's texels in metres, where the map has enough of them. The shaders compare points that are
/// as far apart: where they stand wider than the texels, a shadow's edge has as many steps as there are points.
const SHADOW_TEXEL_M: f32 = 0.005;

/// Radius of the floor disc in metres.
pub(crate) const FLOOR_RADIUS_M: f32 = 7.0;

/// The key light's orthographic view of the bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowView {
    /// World to the light's clip space (depth 0..1).
    pub shadow_from_world: Mat4,
    /// Texels along a side, from the map's corner: no more than it takes.
    pub side_px: u32,
    /// Width of one texel in metres.
    pub texel_m: f32,
}

/// Unit vector towards the key light.
pub(crate) fn key_world() -> Vec3 {
    KEY_WORLD.normalize()
}

/// Unit vector towards the fill light: beside the camera, opposite the key, so that no view of
/// the body is dark.
pub(crate) fn fill_world(camera: &Camera) -> Vec3 {
    (-camera.forward() + 0.8 * camera.right() + 0.25 * Vec3::Y).normalize()
}

/// Unit vector towards the rim light: behind the body as the camera sees it, above, on the side
/// away from the key.
pub(crate) fn rim_world(camera: &Camera) -> Vec3 {
    let flat = (camera.forward() * Vec3::new(1.0, 0.0, 1.0))
        .try_normalize()
        .unwrap_or(Vec3::NEG_Z);
    (flat + 0.75 * camera.right() + 0.75 * Vec3::Y).normalize()
}

/// Fits the key light's view to all parts, for a square map of at most `size_px` texels.
///
/// The view's radius grows in steps and its centre moves by whole texels: a moving body's shadow
/// edges would crawl otherwise.
pub(crate) fn fit_shadow(parts: &[WorldPart], size_px: u32) -> ShadowView {
    const STEP_M: f32 = 0.25;
    let (min, max) = parts
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), part| {
            (min.min(part.min_m), max.max(part.max_m))
        });
    let (center_m, radius_m) = if parts.is_empty() {
        (Vec3::Y, 1.0)
    } else {
        ((min + max) * 0.5, (max - min).length() * 0.5)
    };
    let radius_m = (radius_m / STEP_M).ceil().max(1.0) * STEP_M;
    let side_px = ((2.0 * radius_m / SHADOW_TEXEL_M).ceil() as u32).clamp(1, size_px);
    let texel_m = 2.0 * radius_m / side_px as f32;

    let light_from_world = view::look_to_mat4(Vec3::ZERO, -key_world(), Vec3::Y);
    let center_light = light_from_world.transform_point3(center_m);
    let snapped = (center_light / texel_m).round() * texel_m;
    let clip_from_light = directx::orthographic(
        snapped.x - radius_m,
        snapped.x + radius_m,
        snapped.y - radius_m,
        snapped.y + radius_m,
        -snapped.z - radius_m,
        -snapped.z + radius_m,
    );
    ShadowView {
        shadow_from_world: clip_from_light * light_from_world,
        side_px,
        texel_m,
    }
}

/// Spheres (world centre, radius) in place of the parts that come near the floor, the nearest first:
/// where there are too many for all, each body keeps its feet.
pub(crate) fn occluders(parts: &[WorldPart]) -> ([[f32; 4]; MAX_OCCLUDERS], u32) {
    let near_floor = parts.iter().filter(|part| part.min_m.y < 1.0);
    let mut near_floor: Vec<&WorldPart> = near_floor.collect();
    near_floor.sort_by(|a, b| a.min_m.y.total_cmp(&b.min_m.y));
    let mut spheres = [[0.0; 4]; MAX_OCCLUDERS];
    let mut count = 0;
    for (slot, part) in spheres.iter_mut().zip(near_floor) {
        *slot = part.sphere_m().to_array();
        count += 1;
    }
    (spheres, count)
}

/// Where the floor disc lies under the camera's target.
pub(crate) fn floor_center_m(camera: &Camera) -> [f32; 2] {
    camera.target_world_m.xz().to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(min_m: Vec3, max_m: Vec3) -> WorldPart {
        WorldPart {
            min_m,
            max_m,
            radius_m: 0.1,
        }
    }

    #[test]
    fn the_shadow_view_holds_every_corner_of_every_part() {
        let parts = [
            part(Vec3::new(-1.0, 0.0, -0.2), Vec3::new(-0.2, 1.8, 0.3)),
            part(Vec3::new(9.0, 0.5, 4.0), Vec3::new(10.0, 2.0, 4.5)),
        ];
        for size_px in [512, 2048] {
            let view = fit_shadow(&parts, size_px);
            for part in &parts {
                for corner in 0..8 {
                    let pick = |axis: usize| {
                        if corner >> axis & 1 == 0 {
                            part.min_m
                        } else {
                            part.max_m
                        }
                    };
                    let world = Vec3::new(pick(0).x, pick(1).y, pick(2).z);
                    let clip = view.shadow_from_world.transform_point3(world);
                    // One texel may be lost to snapping.
                    let edge = 1.0 + 2.0 / view.side_px as f32;
                    assert!(clip.x.abs() <= edge && clip.y.abs() <= edge, "{clip}");
                    assert!((-0.01..=1.01).contains(&clip.z), "{clip}");
                }
            }
        }
    }

    #[test]
    fn moving_a_body_moves_the_shadow_view_by_whole_texels() {
        let at = |x: f32| {
            let offset = Vec3::new(x, 0.0, 0.0);
            let body = part(
                Vec3::new(-0.5, 0.0, -0.2) + offset,
                Vec3::new(0.5, 1.8, 0.2) + offset,
            );
            fit_shadow(&[body], 1024)
        };
        let [from, to] = [0.0, 0.0137].map(at);
        let origin = |view: ShadowView| view.shadow_from_world.transform_point3(Vec3::ZERO);
        let moved_texels = (origin(to) - origin(from)) * (from.side_px as f32 / 2.0);
        assert!(
            (moved_texels - moved_texels.round()).truncate().length() < 0.02,
            "{moved_texels}"
        );
    }

    #[test]
    fn texels_are_as_far_apart_as_the_points_that_are_compared() {
        let one = part(Vec3::new(-0.5, 0.0, -0.2), Vec3::new(0.5, 1.8, 0.2));
        for size_px in [1024, 2048] {
            let view = fit_shadow(&[one], size_px);
            assert!(view.side_px < size_px, "{}", view.side_px);
            let share = view.texel_m / SHADOW_TEXEL_M;
            assert!((0.99..=1.0).contains(&share), "{share}");
        }
        let many = part(Vec3::new(-9.0, 0.0, -0.2), Vec3::new(9.0, 1.8, 0.2));
        assert_eq!(fit_shadow(&[many], 1024).side_px, 1024);
    }

    #[test]
    fn the_feet_of_every_body_darken_the_floor() {
        let body = |x: f32| {
            (0..24).map(move |k| {
                let low = Vec3::new(x, 0.04 * k as f32, 0.0);
                part(low, low + 0.1)
            })
        };
        let parts: Vec<WorldPart> = (0..4).flat_map(|index| body(index as f32)).collect();
        let (spheres, count) = occluders(&parts);
        assert_eq!(count as usize, MAX_OCCLUDERS);
        for index in 0..4 {
            let of_body = spheres
                .iter()
                .filter(|s| (s[0] - 0.05 - index as f32).abs() < 0.01);
            assert_eq!(of_body.count(), 12, "body {index}");
        }
    }

    #[test]
    fn lights_are_unit_vectors_from_any_camera() {
        for eye_world_m in [Vec3::new(0.0, 9.0, 0.0), Vec3::new(-2.0, 1.0, -3.0)] {
            let camera = Camera {
                eye_world_m,
                ..Camera::default()
            };
            for light in [key_world(), fill_world(&camera), rim_world(&camera)] {
                assert!((light.length() - 1.0).abs() < 1e-5, "{light}");
            }
        }
    }
}
