//! The skin: membranes of the Saint Venant-Kirchhoff kind that stiffen with area strain.

use glam::Mat3;
use wide::f32x4;

use super::Law;
use super::lanes::{Lanes, PACKED, Packed, PackedVec3, Vec3s, spread};
use crate::shell::Triangle;

/// Largest area strain that still stiffens the skin.
const SKIN_STRAIN_CAP: f32 = 0.5;

/// Eight pieces of skin.
#[derive(Clone, Debug)]
pub(crate) struct TriangleGroup {
    nodes: [[u32; PACKED]; 3],
    /// Face whose rotation each lane follows.
    faces: [u32; PACKED],
    rest_tangents: [PackedVec3; 2],
    /// The tangents rotated with the bones.
    tangents: [PackedVec3; 2],
    /// `[corner - 1][tangent]`.
    gradients: [[Packed; 2]; 2],
    stiffness: Packed,
}

/// How several pieces are stretched.
struct Stretch<L> {
    /// Tangents and the displacement's gradient along them.
    tangents: [Vec3s<L>; 2],
    slopes: [Vec3s<L>; 2],
    /// `[corner - 1][tangent]`.
    gradients: [[L; 2]; 2],
    /// Green's strain.
    e00: L,
    e11: L,
    e01: L,
}

impl TriangleGroup {
    pub fn pack(triangles: &[Triangle], fixed: u32) -> Vec<Self> {
        let empty = Self {
            nodes: [[fixed; PACKED]; 3],
            faces: [0; PACKED],
            rest_tangents: [PackedVec3::ZERO; 2],
            tangents: [PackedVec3::ZERO; 2],
            gradients: [[Packed::ZERO; 2]; 2],
            stiffness: Packed::ZERO,
        };
        let mut groups = vec![empty; triangles.len().div_ceil(PACKED)];
        for (triangle, (group, lane)) in triangles.iter().zip(spread(triangles.len())) {
            let group = &mut groups[group];
            for (lanes, node) in group.nodes.iter_mut().zip(triangle.nodes) {
                lanes[lane] = node;
            }
            group.faces[lane] = triangle.face;
            for (tangent, of_triangle) in group.rest_tangents.iter_mut().zip(triangle.tangents) {
                tangent.set(lane, of_triangle);
            }
            for (lanes, corner) in group.gradients.iter_mut().zip(triangle.gradients_per_m) {
                for (lanes, gradient) in lanes.iter_mut().zip(corner) {
                    lanes.0[lane] = gradient;
                }
            }
            group.stiffness.0[lane] = triangle.stiffness_joules;
        }
        groups
    }

    /// Turns the rest shapes with the bones.
    pub fn rotate(&mut self, face_rotations: &[Mat3]) {
        let rotations = self.faces.map(|face| face_rotations[face as usize]);
        self.tangents = self.rest_tangents.map(|rest| rest.turned(&rotations));
    }

    #[inline(always)]
    fn stretch<L: Lanes>(
        &self,
        machine: L::Machine,
        displacement: &[f32x4],
        step: usize,
    ) -> Stretch<L> {
        let [n0, n1, n2] = &self.nodes;
        let origin = Vec3s::<L>::gather(machine, displacement, n0, step);
        let d1 = Vec3s::<L>::gather(machine, displacement, n1, step).minus(origin);
        let d2 = Vec3s::<L>::gather(machine, displacement, n2, step).minus(origin);
        let [[a0, a1], [b0, b1]] = &self.gradients;
        let a = [L::load(machine, a0, step), L::load(machine, a1, step)];
        let b = [L::load(machine, b0, step), L::load(machine, b1, step)];
        let h0 = d1.scaled_plus(a[0], d2.scaled(b[0]));
        let h1 = d1.scaled_plus(a[1], d2.scaled(b[1]));
        let t0 = Vec3s::load(machine, &self.tangents[0], step);
        let t1 = Vec3s::load(machine, &self.tangents[1], step);
        let half = L::splat(machine, 0.5);
        Stretch {
            tangents: [t0, t1],
            slopes: [h0, h1],
            gradients: [a, b],
            e00: t0.dot(h0) + half * h0.dot(h0),
            e11: t1.dot(h1) + half * h1.dot(h1),
            e01: half * (t0.dot(h1) + t1.dot(h0) + h0.dot(h1)),
        }
    }

    /// Adds the elastic forces at `displacement` to `force`.
    #[inline(always)]
    pub fn add_forces<L: Lanes>(
        &self,
        machine: L::Machine,
        law: Law,
        displacement: &[f32x4],
        force: &mut [f32x4],
    ) {
        for step in 0..PACKED / L::WIDTH {
            let stretch = self.stretch::<L>(machine, displacement, step);
            let Stretch { e00, e11, e01, .. } = stretch;
            let area = (e00 + e11).clamped(0.0, SKIN_STRAIN_CAP);
            let squares = e00 * e00 + e11 * e11 + (e01 * e01) * L::splat(machine, 2.0);
            let growth = L::splat(machine, law.skin_stiffening);
            let stiffness = L::load(machine, &self.stiffness, step);
            let modulus = stiffness * (L::splat(machine, 1.0) + growth * area);
            // The energy is k (1 + g a) E:E with a the area strain; its derivative by E has a second
            // part along the identity wherever a moves.
            let isotropic =
                (stiffness * growth * squares).where_between(e00 + e11, 0.0, SKIN_STRAIN_CAP);
            let twice = modulus + modulus;
            let (s00, s11, s01) = (
                twice * e00 + isotropic,
                twice * e11 + isotropic,
                twice * e01,
            );
            let f0 = stretch.tangents[0].plus(stretch.slopes[0]);
            let f1 = stretch.tangents[1].plus(stretch.slopes[1]);
            let p0 = f0.scaled_plus(s00, f1.scaled(s01));
            let p1 = f0.scaled_plus(s01, f1.scaled(s11));
            let zero = L::splat(machine, 0.0);
            let nothing = Vec3s {
                x: zero,
                y: zero,
                z: zero,
            };
            let [a, b] = stretch.gradients;
            let pull_a = p0.scaled_plus(a[0], p1.scaled(a[1]));
            let pull_b = p0.scaled_plus(b[0], p1.scaled(b[1]));
            let others = pull_a.plus(pull_b);
            nothing
                .minus(others)
                .scatter_sub(force, &self.nodes[0], step);
            pull_a.scatter_sub(force, &self.nodes[1], step);
            pull_b.scatter_sub(force, &self.nodes[2], step);
        }
    }

    /// Elastic energy in joules.
    pub fn energy_joules(&self, law: Law, displacement: &[f32x4]) -> f64 {
        let mut sum = 0.0;
        for step in 0..PACKED / f32x4::WIDTH {
            let stretch = self.stretch::<f32x4>((), displacement, step);
            let stiffness = f32x4::load((), &self.stiffness, step);
            let area = (stretch.e00 + stretch.e11).clamped(0.0, SKIN_STRAIN_CAP);
            for lane in 0..f32x4::WIDTH {
                let [e00, e11, e01, area, stiffness] =
                    [stretch.e00, stretch.e11, stretch.e01, area, stiffness]
                        .map(|lanes| f64::from(lanes.as_array()[lane]));
                let squares = e00 * e00 + e11 * e11 + 2.0 * e01 * e01;
                sum += stiffness * (1.0 + f64::from(law.skin_stiffening) * area) * squares;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::elastic::check::{forces_fit_energy, law};

    #[test]
    fn forces_are_minus_the_energy_gradient_and_zero_at_rest() {
        let triangle = Triangle {
            nodes: [0, 1, 2],
            tangents: [Vec3::X, Vec3::Y],
            gradients_per_m: [[30.0, -4.0], [0.0, 25.0]],
            stiffness_joules: 3.0,
            face: 0,
        };
        let mut groups = TriangleGroup::pack(&[triangle], 3);
        groups[0].rotate(&[Mat3::from_rotation_z(-0.7)]);
        forces_fit_energy(
            3,
            |d| groups[0].energy_joules(law(), d),
            |d, force| groups[0].add_forces::<f32x4>((), law(), d, force),
        );
    }
}
