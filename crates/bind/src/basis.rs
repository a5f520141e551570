//! The body in an avatar's pose, linear in its size and shape.
//!
//! Once the rotations are fixed, skinning is linear in rest positions and joints, and these are linear in
//! the shape: a posed vertex is `size · x0 + Σ (size · β_k) · x_k + translation`.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, SHAPE_COUNT, SkinWeights};
use glam::{DQuat, Mat3, Vec3};

/// Template and shape directions.
pub const BASIS_COUNT: usize = SHAPE_COUNT + 1;
/// Unknowns of the shape fit: size, size times β, translation.
pub const UNKNOWNS: usize = BASIS_COUNT + 3;

/// Size, shape and place of a body: the unknowns of the shape fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Avatar's metres per body's metre.
    pub size: f64,
    /// β, standard deviations.
    pub shape: [f64; SHAPE_COUNT],
    /// Metres.
    pub translation_m: [f64; 3],
}

impl Placement {
    pub fn from_unknowns(unknowns: &[f64; UNKNOWNS], most_shape: f64) -> Self {
        let size = unknowns[0];
        let shape = |k: usize| (unknowns[k + 1] / size).clamp(-most_shape, most_shape);
        Self {
            size,
            shape: std::array::from_fn(shape),
            translation_m: std::array::from_fn(|axis| unknowns[BASIS_COUNT + axis]),
        }
    }

    /// The same surface with the size told by the first coefficient, which scales the whole body, as far
    /// as it may: tissue is that of a person as tall as the avatar.
    pub fn with_stature(self, body: &BodyModel, most_shape: f64) -> Self {
        let (mut along, mut total) = (0.0, 0.0);
        for (dir, at) in body.shape_dirs_m[0].iter().zip(&body.template_m) {
            along += f64::from(dir.dot(*at));
            total += f64::from(at.length_squared());
        }
        let per_sigma = along / total.max(1e-9);
        if per_sigma.is_nan() || per_sigma <= 1e-3 {
            return self;
        }
        // size · (1 + β0 d) is the scale of the template.
        let scale = self.size * (1.0 + self.shape[0] * per_sigma);
        let stature = ((scale - 1.0) / per_sigma).clamp(-most_shape, most_shape);
        let size = scale / (1.0 + stature * per_sigma);
        let mut shape = self.shape.map(|beta| beta * self.size / size);
        shape[0] = stature;
        Self {
            size,
            shape,
            translation_m: self.translation_m,
        }
    }

    pub fn unknowns(&self) -> [f64; UNKNOWNS] {
        std::array::from_fn(|idx| match idx {
            0 => self.size,
            idx if idx < BASIS_COUNT => self.size * self.shape[idx - 1],
            idx => self.translation_m[idx - BASIS_COUNT],
        })
    }
}

/// Posed template and shape directions.
pub struct Basis {
    /// Metres at size 1, `[vertex][basis]`.
    pub vertices: Vec<[Vec3; BASIS_COUNT]>,
    /// Metres at size 1, `[joint][basis]`.
    pub joints: [[Vec3; BASIS_COUNT]; JOINT_COUNT],
}

impl Basis {
    /// `turns`: world rotations of the joints; `wanted`: the vertices that are posed, the others stay 0.
    pub fn new(body: &BodyModel, turns: &[DQuat; JOINT_COUNT], wanted: &[bool]) -> Self {
        let matrices = turns.map(|turn| Mat3::from_quat(turn.as_quat()));
        let rest = |basis: usize| match basis.checked_sub(1) {
            None => body.joint_template_m,
            Some(k) => body.joint_shape_dirs_m[k],
        };
        let mut joints = [[Vec3::ZERO; BASIS_COUNT]; JOINT_COUNT];
        // What a joint adds to what it turns.
        let mut shifts = [[Vec3::ZERO; BASIS_COUNT]; JOINT_COUNT];
        for basis in 0..BASIS_COUNT {
            let rest = rest(basis);
            for joint in Joint::ALL {
                let idx = joint as usize;
                joints[idx][basis] = match joint.parent() {
                    None => rest[idx],
                    Some(parent) => {
                        let parent = parent as usize;
                        joints[parent][basis] + matrices[parent] * (rest[idx] - rest[parent])
                    }
                };
                shifts[idx][basis] = joints[idx][basis] - matrices[idx] * rest[idx];
            }
        }
        let posed = |vertex: usize| {
            let skin = &body.skin[vertex];
            let matrix = blended(skin, &matrices);
            std::array::from_fn(|basis| {
                let rest = match basis.checked_sub(1) {
                    None => body.template_m[vertex],
                    Some(k) => body.shape_dirs_m[k][vertex],
                };
                let weighted = skin.joints.iter().zip(skin.weights);
                let shift: Vec3 = weighted
                    .map(|(joint, weight)| shifts[usize::from(*joint)][basis] * weight)
                    .sum();
                matrix * rest + shift
            })
        };
        let vertices = wanted.iter().enumerate();
        Self {
            vertices: vertices
                .map(|(vertex, wanted)| {
                    if *wanted {
                        posed(vertex)
                    } else {
                        [Vec3::ZERO; BASIS_COUNT]
                    }
                })
                .collect(),
            joints,
        }
    }

    /// Positions in metres.
    pub fn placed(&self, placement: &Placement) -> Vec<Vec3> {
        self.vertices
            .iter()
            .map(|row| mixed(row, placement))
            .collect()
    }

    /// Joints in metres.
    pub fn joints_m(&self, placement: &Placement) -> [Vec3; JOINT_COUNT] {
        self.joints.map(|row| mixed(&row, placement))
    }
}

fn blended(skin: &SkinWeights, matrices: &[Mat3; JOINT_COUNT]) -> Mat3 {
    let weighted = skin.joints.iter().zip(skin.weights);
    weighted.fold(Mat3::ZERO, |sum, (joint, weight)| {
        sum + matrices[usize::from(*joint)] * weight
    })
}

fn mixed(row: &[Vec3; BASIS_COUNT], placement: &Placement) -> Vec3 {
    let unknowns = placement.unknowns().map(|x| x as f32);
    let shaped: Vec3 = row.iter().zip(unknowns).map(|(basis, x)| *basis * x).sum();
    shaped + Vec3::from_slice(&unknowns[BASIS_COUNT..])
}
