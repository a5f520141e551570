//! A flat slab of tissue on bone, whose physics is known exactly.
#![allow(dead_code, unreachable_pub, missing_docs)]

use dynaskin_body::{JOINT_COUNT, Pose, REGION_COUNT, SkinWeights};
use dynaskin_motion::Clip;
use dynaskin_sim::{Shell, SimSettings, Surface};
use glam::Vec3;

/// Shear modulus of the slab, in pascals.
pub const SHEAR_PA: f32 = 800.0;

/// One material everywhere, no skin, no damping.
pub fn plain_settings() -> SimSettings {
    let mut settings = SimSettings {
        skin_kg_per_m2: 0.0,
        stiffening: 0.0,
        relaxation_seconds: 0.0,
        ..SimSettings::default()
    };
    for tissue in &mut settings.tissues {
        tissue.shear_modulus_pa = SHEAR_PA;
        tissue.depth_exponent = 0.0;
        tissue.damping_ratio = 0.0;
        tissue.skin_n_per_m = 0.0;
    }
    settings
}

/// A square slab facing +Y, `width_m` wide and `depth_m` deep, bound to joint 0.
pub fn slab(width_m: f32, spacing_m: f32, depth_m: f32) -> Surface {
    let n = (width_m / spacing_m).round() as u32 + 1;
    let at = |i: u32, k: u32| i * n + k;
    let mut positions_m = Vec::new();
    let mut faces = Vec::new();
    for i in 0..n {
        for k in 0..n {
            positions_m.push(Vec3::new(i as f32 * spacing_m, 0.0, k as f32 * spacing_m));
            if i + 1 < n && k + 1 < n {
                // Alternate the diagonal, as no direction should be preferred.
                let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
                if (i + k) % 2 == 0 {
                    faces.extend([[a, c, b], [a, d, c]]);
                } else {
                    faces.extend([[a, d, b], [b, d, c]]);
                }
            }
        }
    }
    let count = positions_m.len();
    let mut region_weights = vec![vec![0.0; count]; REGION_COUNT];
    region_weights[3] = vec![1.0; count];
    Surface {
        split_order: (0..count).map(|v| ((v * 7919) % count) as f32).collect(),
        positions_m,
        faces,
        skin: vec![
            SkinWeights {
                joints: [0; 4],
                weights: [1.0, 0.0, 0.0, 0.0],
            };
            count
        ],
        joints_rest_m: [Vec3::ZERO; JOINT_COUNT],
        depth_m: vec![depth_m; count],
        region_weights,
    }
}

pub fn slab_shell(width_m: f32, spacing_m: f32, depth_m: f32, settings: &SimSettings) -> Shell {
    Shell::new(&slab(width_m, spacing_m, depth_m), settings).expect("the slab is soft")
}

pub fn clip(name: &str, frames: Vec<Pose>) -> Clip {
    Clip {
        name: name.to_owned(),
        rate_hz: 60.0,
        frames,
    }
}
