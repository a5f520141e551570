//! A body of capsules and an offscreen renderer, for tests that draw.

// Each test file uses its own part of this. Clippy takes only `#[test]` functions for tests.
#![allow(dead_code, clippy::unwrap_used, clippy::print_stdout)]

use dynaskin_render::{
    BodyId, BodyMesh, Gpu, OffsetSizes, PixelSize, RenderError, Renderer, SkinningPath, wgpu,
};
use glam::{Mat4, Quat, Vec3};

pub const SIZE: PixelSize = PixelSize {
    width: 320,
    height: 400,
};

/// An offscreen renderer, or none with the reason printed where there is no adapter.
pub fn renderer(test: &str, skinning: SkinningPath) -> Option<Renderer> {
    let instance = wgpu::Instance::default();
    match pollster::block_on(Gpu::new(&instance, None, Some(skinning))) {
        Ok(gpu) => Some(pollster::block_on(Renderer::offscreen(gpu, SIZE)).unwrap()),
        Err(error @ (RenderError::NoAdapter { .. } | RenderError::ReadBackUnsupported)) => {
            println!("skipped: {test} needs a graphics adapter: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A mesh with its owned arrays.
#[derive(Default)]
pub struct TestBody {
    pub positions_m: Vec<f32>,
    pub normals: Vec<f32>,
    pub faces: Vec<u32>,
    pub joints: Vec<u8>,
    pub weights: Vec<f32>,
}

impl TestBody {
    /// A standing body of capsules 1.7 m tall, each on one joint.
    pub fn standing() -> Self {
        let mut body = Self::default();
        let mut limb = |joint, from: [f32; 3], to: [f32; 3], radius_m| {
            body.add_capsule(joint, Vec3::from(from), Vec3::from(to), radius_m);
        };
        limb(0, [0.0, 0.95, 0.0], [0.0, 1.05, 0.0], 0.16);
        limb(9, [0.0, 1.15, 0.0], [0.0, 1.32, 0.0], 0.15);
        limb(15, [0.0, 1.55, 0.0], [0.0, 1.60, 0.0], 0.10);
        for (side, x) in [(0, 0.1), (1, -0.1)] {
            limb(1 + side, [x, 0.85, 0.0], [x, 0.52, 0.0], 0.08);
            limb(4 + side, [x, 0.45, 0.0], [x, 0.12, 0.0], 0.055);
            limb(7 + side, [x, 0.05, 0.0], [x, 0.05, 0.15], 0.045);
            limb(16 + side, [2.0 * x, 1.35, 0.0], [3.2 * x, 1.1, 0.0], 0.045);
            limb(
                18 + side,
                [3.4 * x, 1.06, 0.0],
                [4.4 * x, 0.82, 0.05],
                0.038,
            );
        }
        body
    }

    fn add_capsule(&mut self, joint: u8, from: Vec3, to: Vec3, radius_m: f32) {
        const RINGS: u32 = 24;
        const SECTORS: u32 = 32;
        let first = (self.positions_m.len() / 3) as u32;
        let turn = Quat::from_rotation_arc(Vec3::Y, (to - from).normalize());
        for ring in 0..=RINGS {
            let polar = std::f32::consts::PI * ring as f32 / RINGS as f32;
            let end = if ring <= RINGS / 2 { to } else { from };
            for sector in 0..=SECTORS {
                let angle = std::f32::consts::TAU * sector as f32 / SECTORS as f32;
                let out = Vec3::new(
                    angle.sin() * polar.sin(),
                    polar.cos(),
                    angle.cos() * polar.sin(),
                );
                let normal = turn * out;
                self.positions_m
                    .extend((end + normal * radius_m).to_array());
                self.normals.extend(normal.to_array());
                self.joints.extend([joint, 0, 0, 0]);
                self.weights.extend([1.0, 0.0, 0.0, 0.0]);
            }
        }
        for ring in 0..RINGS {
            for sector in 0..SECTORS {
                let a = first + ring * (SECTORS + 1) + sector;
                let b = a + SECTORS + 1;
                self.faces.extend([a, b, a + 1, a + 1, b, b + 1]);
            }
        }
    }

    pub fn vertex_count(&self) -> usize {
        self.positions_m.len() / 3
    }

    pub fn mesh(&self) -> BodyMesh<'_> {
        BodyMesh {
            faces: &self.faces,
            skin_joints: &self.joints,
            skin_weights: &self.weights,
            colors_srgba: &[],
        }
    }

    /// Adds the body with its surface.
    pub fn add_to(&self, renderer: &mut Renderer, offsets: OffsetSizes<'_>) -> BodyId {
        let id = renderer.add_body(&self.mesh()).unwrap();
        renderer
            .set_surface(id, &self.positions_m, &self.normals, offsets)
            .unwrap();
        id
    }
}

/// Draws and reads the picture: RGBA rows.
pub fn picture(renderer: &mut Renderer) -> Vec<u8> {
    renderer.render().unwrap();
    let pixels = pollster::block_on(renderer.read_pixels()).unwrap();
    assert_eq!(pixels.len(), 4 * (SIZE.width * SIZE.height) as usize);
    pixels
}

/// Share of pixels in which a channel differs by more than `threshold`.
pub fn differing_share(a: &[u8], b: &[u8], threshold: u8) -> f64 {
    let pairs = a.as_chunks::<4>().0.iter().zip(b.as_chunks::<4>().0);
    let n_differing = pairs
        .filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > threshold))
        .count();
    n_differing as f64 * 4.0 / a.len() as f64
}

/// Mean absolute difference of all channels, in steps of 1/255.
pub fn mean_difference(a: &[u8], b: &[u8]) -> f64 {
    let sum: u64 = a
        .iter()
        .zip(b)
        .map(|(a, b)| u64::from(a.abs_diff(*b)))
        .sum();
    sum as f64 / a.len() as f64
}

/// A bent pose: every joint's matrix is another rigid motion near the identity.
pub fn bent_pose(strength: f32) -> [Mat4; 24] {
    std::array::from_fn(|joint| {
        let phase = joint as f32;
        let axis =
            Vec3::new(phase.sin(), (1.7 * phase).cos(), (0.6 * phase).sin() + 0.2).normalize();
        let angle = strength * (2.3 * phase).sin();
        let shift_m = strength * 0.2 * Vec3::new((0.9 * phase).cos(), phase.sin(), 0.3);
        Mat4::from_rotation_translation(Quat::from_axis_angle(axis, angle), shift_m)
    })
}
