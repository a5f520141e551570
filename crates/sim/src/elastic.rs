//! Elastic forces of tetrahedra and skin triangles, four elements at a time.

use glam::{Mat3, Vec3};
use wide::f32x4;

use crate::settings::SimSettings;
use crate::shell::{Tet, Triangle};

/// Elements computed together.
const LANES: usize = 4;
/// Bounds of `J - 1` within which the volume term is linear: outside it pushes no harder, so that
/// very soft tissue does not blow up at large strain.
const VOLUME_CAP: f32 = 0.5;
/// Largest strain measure `tr(FᵀF) - 3` that still stiffens.
const STRAIN_CAP: f32 = 4.0;
/// Largest area strain that still stiffens the skin.
const SKIN_STRAIN_CAP: f32 = 0.5;

/// Three components of four elements.
#[derive(Clone, Copy, Debug)]
struct Vec3x4 {
    x: f32x4,
    y: f32x4,
    z: f32x4,
}

impl Vec3x4 {
    const ZERO: Self = Self {
        x: f32x4::ZERO,
        y: f32x4::ZERO,
        z: f32x4::ZERO,
    };

    /// One node of each of four elements; nodes are stored as x, y, z and padding.
    #[inline(always)]
    fn gather(values: &[f32x4], nodes: &[u32; LANES]) -> Self {
        let [x, y, z, _] = f32x4::transpose(nodes.map(|node| values[node as usize]));
        Self { x, y, z }
    }

    /// Subtracts from one node of each of four elements, which may be the same.
    #[inline(always)]
    fn scatter_sub(self, values: &mut [f32x4], nodes: &[u32; LANES]) {
        let lanes = f32x4::transpose([self.x, self.y, self.z, f32x4::ZERO]);
        for (node, lane) in nodes.iter().zip(lanes) {
            values[*node as usize] -= lane;
        }
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f32x4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    fn scaled(self, factor: f32x4) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }

    fn set(&mut self, lane: usize, value: Vec3) {
        self.x.as_mut_array()[lane] = value.x;
        self.y.as_mut_array()[lane] = value.y;
        self.z.as_mut_array()[lane] = value.z;
    }
}

/// Constants of the material that all elements share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    stiffening: f32,
    skin_stiffening: f32,
}

impl Law {
    pub fn new(settings: &SimSettings) -> Self {
        Self {
            stiffening: settings.stiffening,
            skin_stiffening: settings.skin_stiffening,
        }
    }
}

/// Four tetrahedra.
#[derive(Clone, Debug)]
pub(crate) struct TetGroup {
    nodes: [[u32; LANES]; 4],
    /// Gradients of corners 1..4 in the rest shape rotated with the bones.
    gradients: [Vec3x4; 3],
    /// Volume times shear modulus; 0 in lanes without an element.
    stiffness: f32x4,
    /// Volume times modulus of the volume term.
    bulk: f32x4,
}

/// Packs elements into groups, taking lanes far apart so that one group rarely meets the same node
/// twice. Returns each element's group and lane.
fn spread(count: usize) -> impl Iterator<Item = (usize, usize)> {
    let groups = count.div_ceil(LANES);
    (0..count).map(move |element| (element % groups, element / groups))
}

impl TetGroup {
    pub fn pack(tets: &[Tet], fixed: u32) -> Vec<Self> {
        let empty = Self {
            nodes: [[fixed; LANES]; 4],
            gradients: [Vec3x4::ZERO; 3],
            stiffness: f32x4::ZERO,
            bulk: f32x4::ZERO,
        };
        let mut groups = vec![empty; tets.len().div_ceil(LANES)];
        for (tet, (group, lane)) in tets.iter().zip(spread(tets.len())) {
            for corner in 0..4 {
                groups[group].nodes[corner][lane] = tet.nodes[corner];
            }
            groups[group].stiffness.as_mut_array()[lane] = tet.stiffness_joules;
            groups[group].bulk.as_mut_array()[lane] = tet.bulk_joules;
        }
        groups
    }

    /// Turns the rest shapes with the bones.
    pub fn rotate(groups: &mut [Self], tets: &[Tet], prism_rotations: &[Mat3]) {
        for (tet, (group, lane)) in tets.iter().zip(spread(tets.len())) {
            let rotation = prism_rotations[tet.prism as usize];
            for (slot, gradient) in groups[group].gradients.iter_mut().zip(tet.gradients_per_m) {
                slot.set(lane, rotation * gradient);
            }
        }
    }

    /// Columns of `grad d`, so that `F = I + H`.
    #[inline(always)]
    fn displacement_gradient(&self, displacement: &[f32x4]) -> [Vec3x4; 3] {
        let origin = Vec3x4::gather(displacement, &self.nodes[0]);
        let [d1, d2, d3] =
            [1, 2, 3].map(|corner| Vec3x4::gather(displacement, &self.nodes[corner]).minus(origin));
        let [g1, g2, g3] = self.gradients;
        let column = |a, b, c| d1.scaled(a).plus(d2.scaled(b)).plus(d3.scaled(c));
        [
            column(g1.x, g2.x, g3.x),
            column(g1.y, g2.y, g3.y),
            column(g1.z, g2.z, g3.z),
        ]
    }

    /// `tr(FᵀF) - 3` and `J - 1`, each exactly 0 for H = 0.
    #[inline(always)]
    fn invariants([h0, h1, h2]: [Vec3x4; 3]) -> (f32x4, f32x4) {
        let trace = h0.x + h1.y + h2.z;
        let strain = trace + trace + h0.dot(h0) + h1.dot(h1) + h2.dot(h2);
        let minors =
            (h0.x * h1.y - h1.x * h0.y) + (h0.x * h2.z - h2.x * h0.z) + (h1.y * h2.z - h2.y * h1.z);
        (strain, trace + minors + h0.dot(h1.cross(h2)))
    }

    /// Adds the elastic forces at `displacement` to `force`.
    #[inline(always)]
    pub fn add_forces(&self, law: Law, displacement: &[f32x4], force: &mut [f32x4]) {
        let h = self.displacement_gradient(displacement);
        let (strain, volume) = Self::invariants(h);
        let [mut f0, mut f1, mut f2] = h;
        f0.x += f32x4::ONE;
        f1.y += f32x4::ONE;
        f2.z += f32x4::ONE;
        // First Piola stress G (1 + k i) F + (B (J - 1) - G) cof F, times the volume; written so
        // that it is exactly 0 at F = I, where F and cof F are both the identity.
        let strain = strain
            .fast_max(f32x4::ZERO)
            .fast_min(f32x4::splat(STRAIN_CAP));
        let shear = self.stiffness * (f32x4::ONE + strain * f32x4::splat(law.stiffening));
        let volume = volume
            .fast_max(f32x4::splat(-VOLUME_CAP))
            .fast_min(f32x4::splat(VOLUME_CAP));
        let pressure = volume * self.bulk - self.stiffness;
        let p0 = f0.scaled(shear).plus(f1.cross(f2).scaled(pressure));
        let p1 = f1.scaled(shear).plus(f2.cross(f0).scaled(pressure));
        let p2 = f2.scaled(shear).plus(f0.cross(f1).scaled(pressure));
        let mut sum = Vec3x4::ZERO;
        for (corner, g) in self.gradients.iter().enumerate() {
            let pull = p0.scaled(g.x).plus(p1.scaled(g.y)).plus(p2.scaled(g.z));
            sum = sum.minus(pull);
            pull.scatter_sub(force, &self.nodes[corner + 1]);
        }
        sum.scatter_sub(force, &self.nodes[0]);
    }

    /// Elastic energy in joules.
    pub fn energy_joules(&self, law: Law, displacement: &[f32x4]) -> f64 {
        let (strain, volume) = Self::invariants(self.displacement_gradient(displacement));
        let mut sum = 0.0;
        for lane in 0..LANES {
            let [i, v, g, b] =
                [strain, volume, self.stiffness, self.bulk].map(|x| f64::from(x.as_array()[lane]));
            let cap = f64::from(STRAIN_CAP);
            let stiffened = i.clamp(0.0, cap);
            let extra = stiffened * stiffened / 2.0 + (i - cap).max(0.0) * cap;
            let cap = f64::from(VOLUME_CAP);
            let inside = v.clamp(-cap, cap);
            let bulk = inside * inside / 2.0 + (v - inside) * inside;
            sum += g * (i / 2.0 + f64::from(law.stiffening) * extra / 2.0 - v) + b * bulk;
        }
        sum
    }
}

/// Four pieces of skin: membranes of the Saint Venant-Kirchhoff kind that stiffen with area strain.
#[derive(Clone, Debug)]
pub(crate) struct TriangleGroup {
    nodes: [[u32; LANES]; 3],
    tangents: [Vec3x4; 2],
    /// `[corner - 1][tangent]`.
    gradients: [[f32x4; 2]; 2],
    stiffness: f32x4,
}

impl TriangleGroup {
    pub fn pack(triangles: &[Triangle], fixed: u32) -> Vec<Self> {
        let empty = Self {
            nodes: [[fixed; LANES]; 3],
            tangents: [Vec3x4::ZERO; 2],
            gradients: [[f32x4::ZERO; 2]; 2],
            stiffness: f32x4::ZERO,
        };
        let mut groups = vec![empty; triangles.len().div_ceil(LANES)];
        for (triangle, (group, lane)) in triangles.iter().zip(spread(triangles.len())) {
            let group = &mut groups[group];
            for corner in 0..3 {
                group.nodes[corner][lane] = triangle.nodes[corner];
            }
            for corner in 0..2 {
                for axis in 0..2 {
                    group.gradients[corner][axis].as_mut_array()[lane] =
                        triangle.gradients_per_m[corner][axis];
                }
            }
            group.stiffness.as_mut_array()[lane] = triangle.stiffness_joules;
        }
        groups
    }

    /// Turns the rest shapes with the bones.
    pub fn rotate(groups: &mut [Self], triangles: &[Triangle], prism_rotations: &[Mat3]) {
        for (triangle, (group, lane)) in triangles.iter().zip(spread(triangles.len())) {
            let rotation = prism_rotations[triangle.prism as usize];
            for (slot, tangent) in groups[group].tangents.iter_mut().zip(triangle.tangents) {
                slot.set(lane, rotation * tangent);
            }
        }
    }

    /// Displacement gradient along the two tangents and Green's strain `(E11, E22, E12)`.
    #[inline(always)]
    fn strain(&self, displacement: &[f32x4]) -> ([Vec3x4; 2], [f32x4; 3]) {
        let origin = Vec3x4::gather(displacement, &self.nodes[0]);
        let d1 = Vec3x4::gather(displacement, &self.nodes[1]).minus(origin);
        let d2 = Vec3x4::gather(displacement, &self.nodes[2]).minus(origin);
        let [a, b] = self.gradients;
        let h0 = d1.scaled(a[0]).plus(d2.scaled(b[0]));
        let h1 = d1.scaled(a[1]).plus(d2.scaled(b[1]));
        let [t0, t1] = self.tangents;
        let half = f32x4::HALF;
        let e00 = t0.dot(h0) + half * h0.dot(h0);
        let e11 = t1.dot(h1) + half * h1.dot(h1);
        let e01 = half * (t0.dot(h1) + t1.dot(h0) + h0.dot(h1));
        ([h0, h1], [e00, e11, e01])
    }

    #[inline(always)]
    fn area_strain([e00, e11, _]: [f32x4; 3]) -> f32x4 {
        (e00 + e11)
            .fast_max(f32x4::ZERO)
            .fast_min(f32x4::splat(SKIN_STRAIN_CAP))
    }

    /// Adds the elastic forces at `displacement` to `force`.
    #[inline(always)]
    pub fn add_forces(&self, law: Law, displacement: &[f32x4], force: &mut [f32x4]) {
        let ([h0, h1], strain) = self.strain(displacement);
        let [e00, e11, e01] = strain;
        let area = Self::area_strain(strain);
        let squares = e00 * e00 + e11 * e11 + (e01 * e01) * f32x4::splat(2.0);
        let growth = f32x4::splat(law.skin_stiffening);
        let modulus = self.stiffness * (f32x4::ONE + growth * area);
        // The energy is k (1 + g a) E:E with a the area strain; its derivative by E has a second
        // part along the identity wherever a moves.
        let moving = (e00 + e11).simd_gt(f32x4::ZERO) & area.simd_lt(f32x4::splat(SKIN_STRAIN_CAP));
        let isotropic = moving.bitselect(self.stiffness * growth * squares, f32x4::ZERO);
        let twice = modulus + modulus;
        let (s00, s11, s01) = (
            twice * e00 + isotropic,
            twice * e11 + isotropic,
            twice * e01,
        );
        let f0 = self.tangents[0].plus(h0);
        let f1 = self.tangents[1].plus(h1);
        let p0 = f0.scaled(s00).plus(f1.scaled(s01));
        let p1 = f0.scaled(s01).plus(f1.scaled(s11));
        let mut sum = Vec3x4::ZERO;
        for (corner, gradient) in self.gradients.iter().enumerate() {
            let pull = p0.scaled(gradient[0]).plus(p1.scaled(gradient[1]));
            sum = sum.minus(pull);
            pull.scatter_sub(force, &self.nodes[corner + 1]);
        }
        sum.scatter_sub(force, &self.nodes[0]);
    }

    /// Elastic energy in joules.
    pub fn energy_joules(&self, law: Law, displacement: &[f32x4]) -> f64 {
        let (_, strain) = self.strain(displacement);
        let area = Self::area_strain(strain);
        (0..LANES)
            .map(|lane| {
                let [e00, e11, e01] = strain.map(|e| f64::from(e.as_array()[lane]));
                let squares = e00 * e00 + e11 * e11 + 2.0 * e01 * e01;
                let growth = 1.0 + f64::from(law.skin_stiffening * area.as_array()[lane]);
                f64::from(self.stiffness.as_array()[lane]) * growth * squares
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> Law {
        Law {
            stiffening: 0.5,
            skin_stiffening: 6.0,
        }
    }

    fn sample_displacement() -> Vec<f32x4> {
        (0..5)
            .map(|n| {
                let at = |k: u32| 0.02 * ((n * 7 + k * 3) as f32).sin();
                f32x4::new([at(0), at(1), at(2), 0.0])
            })
            .collect()
    }

    /// Forces must be minus the gradient of the energy, whatever the strain.
    fn check_forces(energy: impl Fn(&[f32x4]) -> f64, forces: &[f32x4]) {
        let base = sample_displacement();
        let step = 1e-3;
        for node in 0..4 {
            for axis in 0..3 {
                let moved = |sign: f32| {
                    let mut at = base.clone();
                    at[node].as_mut_array()[axis] += sign * step;
                    energy(&at)
                };
                let slope = (moved(1.0) - moved(-1.0)) / (2.0 * f64::from(step));
                let force = f64::from(forces[node].as_array()[axis]);
                assert!(
                    (force + slope).abs() < 2e-2 * (1.0 + slope.abs()),
                    "node {node} axis {axis}: force {force}, energy slope {slope}"
                );
            }
        }
    }

    #[test]
    fn tetrahedron_forces_are_minus_the_energy_gradient_and_zero_at_rest() {
        let tet = Tet {
            nodes: [0, 1, 2, 3],
            gradients_per_m: [
                Vec3::new(20.0, 1.0, 0.0),
                Vec3::new(-2.0, 15.0, 3.0),
                Vec3::new(1.0, 4.0, 25.0),
            ],
            stiffness_joules: 2.0,
            bulk_joules: 16.0,
            strain_margin: 1.0,
            prism: 0,
        };
        let tets = [tet];
        let mut groups = TetGroup::pack(&tets, 4);
        TetGroup::rotate(&mut groups, &tets, &[Mat3::from_rotation_y(0.4)]);
        let mut force = vec![f32x4::ZERO; 5];
        groups[0].add_forces(law(), &sample_displacement(), &mut force);
        check_forces(|d| groups[0].energy_joules(law(), d), &force);
        let mut force = vec![f32x4::ZERO; 5];
        groups[0].add_forces(law(), &[f32x4::ZERO; 5], &mut force);
        assert!(force.iter().all(|f| f.to_array() == [0.0; 4]), "{force:?}");
    }

    #[test]
    fn skin_forces_are_minus_the_energy_gradient_and_zero_at_rest() {
        let triangles = [Triangle {
            nodes: [0, 1, 2],
            tangents: [Vec3::X, Vec3::Y],
            gradients_per_m: [[30.0, -4.0], [0.0, 25.0]],
            stiffness_joules: 3.0,
            prism: 0,
        }];
        let mut groups = TriangleGroup::pack(&triangles, 4);
        TriangleGroup::rotate(&mut groups, &triangles, &[Mat3::from_rotation_z(-0.7)]);
        let mut force = vec![f32x4::ZERO; 5];
        groups[0].add_forces(law(), &sample_displacement(), &mut force);
        check_forces(|d| groups[0].energy_joules(law(), d), &force);
        let mut force = vec![f32x4::ZERO; 5];
        groups[0].add_forces(law(), &[f32x4::ZERO; 5], &mut force);
        assert!(force.iter().all(|f| f.to_array() == [0.0; 4]));
    }
}
