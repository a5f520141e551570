//! Tetrahedra, three to a prism: they share six nodes, which are read and written once.

use glam::Mat3;
use wide::f32x4;

use super::Law;
use super::lanes::{Lanes, PACKED, Packed, PackedVec3, Vec3s, spread};
use crate::shell::{Prism, TETS_PER_PRISM};

/// Bounds of `J - 1` within which the volume term is linear: outside it pushes no harder, so that
/// very soft tissue does not blow up at large strain.
const VOLUME_CAP: f32 = 0.5;
/// Largest strain measure `tr(FᵀF) - 3` that still stiffens.
const STRAIN_CAP: f32 = 4.0;

/// Eight prisms of three tetrahedra.
#[derive(Clone, Debug)]
pub(crate) struct PrismGroup {
    /// Nodes 0..6 of each lane, in [`Prism`]'s order.
    nodes: [[u32; PACKED]; 6],
    /// Face whose rotation each lane follows.
    faces: [u32; PACKED],
    tets: [PackedTets; TETS_PER_PRISM],
    /// Gradients of each tetrahedron's corners 1..4 at rest; elsewhere in memory, since they are not
    /// read in a time step.
    rest_gradients: Box<[[PackedVec3; 3]; TETS_PER_PRISM]>,
}

/// One tetrahedron of each of eight prisms.
#[derive(Clone, Debug)]
struct PackedTets {
    /// Gradients of corners 1..4 in the rest shape rotated with the bones.
    gradients: [PackedVec3; 3],
    /// Volume times shear modulus; 0 in lanes without an element.
    stiffness: Packed,
    /// Volume times modulus of the volume term.
    bulk: Packed,
}

impl PackedTets {
    const EMPTY: Self = Self {
        gradients: [PackedVec3::ZERO; 3],
        stiffness: Packed::ZERO,
        bulk: Packed::ZERO,
    };
}

/// Several tetrahedra as they are computed with.
struct Tets<L> {
    gradients: [Vec3s<L>; 3],
    stiffness: L,
    bulk: L,
    one: L,
}

impl<L: Lanes> Tets<L> {
    #[inline(always)]
    fn load(machine: L::Machine, packed: &PackedTets, step: usize) -> Self {
        let [g1, g2, g3] = &packed.gradients;
        Self {
            gradients: [
                Vec3s::load(machine, g1, step),
                Vec3s::load(machine, g2, step),
                Vec3s::load(machine, g3, step),
            ],
            stiffness: L::load(machine, &packed.stiffness, step),
            bulk: L::load(machine, &packed.bulk, step),
            one: L::splat(machine, 1.0),
        }
    }

    /// Columns of `grad d`, so that `F = I + H`, from the displacements of corners 1..4 against that
    /// of corner 0.
    #[inline(always)]
    fn displacement_gradient(&self, [d1, d2, d3]: [Vec3s<L>; 3]) -> [Vec3s<L>; 3] {
        let [g1, g2, g3] = self.gradients;
        [
            d1.scaled_plus(g1.x, d2.scaled_plus(g2.x, d3.scaled(g3.x))),
            d1.scaled_plus(g1.y, d2.scaled_plus(g2.y, d3.scaled(g3.y))),
            d1.scaled_plus(g1.z, d2.scaled_plus(g2.z, d3.scaled(g3.z))),
        ]
    }

    /// `tr(FᵀF) - 3` and `J - 1`, each exactly 0 for H = 0.
    #[inline(always)]
    fn invariants([h0, h1, h2]: [Vec3s<L>; 3]) -> (L, L) {
        let trace = h0.x + h1.y + h2.z;
        let strain = trace + trace + h0.dot(h0) + h1.dot(h1) + h2.dot(h2);
        let minors =
            (h0.x * h1.y - h1.x * h0.y) + (h0.x * h2.z - h2.x * h0.z) + (h1.y * h2.z - h2.y * h1.z);
        (strain, trace + minors + h0.dot(h1.cross(h2)))
    }

    /// What the element pulls corners 1..4 with; corner 0 gets minus their sum.
    #[inline(always)]
    fn pulls(&self, stiffening: L, edges: [Vec3s<L>; 3]) -> [Vec3s<L>; 3] {
        let h = self.displacement_gradient(edges);
        let (strain, volume) = Self::invariants(h);
        let [mut f0, mut f1, mut f2] = h;
        f0.x = f0.x + self.one;
        f1.y = f1.y + self.one;
        f2.z = f2.z + self.one;
        // First Piola stress G (1 + k i) F + (B (J - 1) - G) cof F, times the volume; written so
        // that it is exactly 0 at F = I, where F and cof F are both the identity.
        let strain = strain.clamped(0.0, STRAIN_CAP);
        let shear = self.stiffness * (self.one + strain * stiffening);
        let pressure = volume.clamped(-VOLUME_CAP, VOLUME_CAP) * self.bulk - self.stiffness;
        let p0 = f0.scaled_plus(shear, f1.cross(f2).scaled(pressure));
        let p1 = f1.scaled_plus(shear, f2.cross(f0).scaled(pressure));
        let p2 = f2.scaled_plus(shear, f0.cross(f1).scaled(pressure));
        let [g1, g2, g3] = self.gradients;
        [
            p0.scaled_plus(g1.x, p1.scaled_plus(g1.y, p2.scaled(g1.z))),
            p0.scaled_plus(g2.x, p1.scaled_plus(g2.y, p2.scaled(g2.z))),
            p0.scaled_plus(g3.x, p1.scaled_plus(g3.y, p2.scaled(g3.z))),
        ]
    }
}

/// Displacements of a prism's nodes against its first.
struct Edges<L> {
    b: Vec3s<L>,
    c: Vec3s<L>,
    low_a: Vec3s<L>,
    low_b: Vec3s<L>,
    low_c: Vec3s<L>,
}

impl<L: Lanes> Edges<L> {
    /// Corners 1..4 of each tetrahedron; corner 0 is the prism's first node in all of them.
    #[inline(always)]
    fn of_tets(&self) -> [[Vec3s<L>; 3]; TETS_PER_PRISM] {
        [
            [self.b, self.c, self.low_c],
            [self.b, self.low_b, self.low_c],
            [self.low_a, self.low_b, self.low_c],
        ]
    }
}

impl PrismGroup {
    pub fn pack(prisms: &[Prism], fixed: u32) -> Vec<Self> {
        let empty = Self {
            nodes: [[fixed; PACKED]; 6],
            faces: [0; PACKED],
            tets: [const { PackedTets::EMPTY }; TETS_PER_PRISM],
            rest_gradients: Box::new([[PackedVec3::ZERO; 3]; TETS_PER_PRISM]),
        };
        let mut groups = vec![empty; prisms.len().div_ceil(PACKED)];
        for (prism, (group, lane)) in prisms.iter().zip(spread(prisms.len())) {
            let group = &mut groups[group];
            for (lanes, node) in group.nodes.iter_mut().zip(prism.nodes) {
                lanes[lane] = node;
            }
            group.faces[lane] = prism.face;
            for (rest, tet) in group.rest_gradients.iter_mut().zip(&prism.tets) {
                for (gradient, of_tet) in rest.iter_mut().zip(tet.gradients_per_m) {
                    gradient.set(lane, of_tet);
                }
            }
            for (lanes, tet) in group.tets.iter_mut().zip(&prism.tets) {
                lanes.stiffness.0[lane] = tet.stiffness_joules;
                lanes.bulk.0[lane] = tet.bulk_joules;
            }
        }
        groups
    }

    /// Turns the rest shapes with the bones.
    pub fn rotate(&mut self, face_rotations: &[Mat3]) {
        let rotations = self.faces.map(|face| face_rotations[face as usize]);
        for (tet, rest) in self.tets.iter_mut().zip(&*self.rest_gradients) {
            for (turned, rest) in tet.gradients.iter_mut().zip(rest) {
                *turned = rest.turned(&rotations);
            }
        }
    }

    #[inline(always)]
    fn edges<L: Lanes>(
        &self,
        machine: L::Machine,
        displacement: &[f32x4],
        step: usize,
    ) -> Edges<L> {
        let [a, b, c, low_a, low_b, low_c] = &self.nodes;
        let origin = Vec3s::gather(machine, displacement, a, step);
        Edges {
            b: Vec3s::gather(machine, displacement, b, step).minus(origin),
            c: Vec3s::gather(machine, displacement, c, step).minus(origin),
            low_a: Vec3s::gather(machine, displacement, low_a, step).minus(origin),
            low_b: Vec3s::gather(machine, displacement, low_b, step).minus(origin),
            low_c: Vec3s::gather(machine, displacement, low_c, step).minus(origin),
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
        let stiffening = L::splat(machine, law.stiffening);
        for step in 0..PACKED / L::WIDTH {
            let [first, second, third] = self.edges(machine, displacement, step).of_tets();
            let [t0, t1, t2] = &self.tets;
            let [b0, c, low_c0] = Tets::<L>::load(machine, t0, step).pulls(stiffening, first);
            let [b1, low_b1, low_c1] = Tets::<L>::load(machine, t1, step).pulls(stiffening, second);
            let [low_a, low_b2, low_c2] =
                Tets::<L>::load(machine, t2, step).pulls(stiffening, third);
            let b = b0.plus(b1);
            let low_b = low_b1.plus(low_b2);
            let low_c = low_c0.plus(low_c1).plus(low_c2);
            let zero = L::splat(machine, 0.0);
            let nothing = Vec3s {
                x: zero,
                y: zero,
                z: zero,
            };
            let others = b.plus(c).plus(low_a).plus(low_b).plus(low_c);
            nothing
                .minus(others)
                .scatter_sub(force, &self.nodes[0], step);
            b.scatter_sub(force, &self.nodes[1], step);
            c.scatter_sub(force, &self.nodes[2], step);
            low_a.scatter_sub(force, &self.nodes[3], step);
            low_b.scatter_sub(force, &self.nodes[4], step);
            low_c.scatter_sub(force, &self.nodes[5], step);
        }
    }

    /// Elastic energy in joules.
    pub fn energy_joules(&self, law: Law, displacement: &[f32x4]) -> f64 {
        let mut sum = 0.0;
        for step in 0..PACKED / f32x4::WIDTH {
            let edges = self.edges::<f32x4>((), displacement, step).of_tets();
            for (packed, edges) in self.tets.iter().zip(edges) {
                let tets = Tets::<f32x4>::load((), packed, step);
                let (strain, volume) = Tets::invariants(tets.displacement_gradient(edges));
                for lane in 0..f32x4::WIDTH {
                    let [i, v, g, b] = [strain, volume, tets.stiffness, tets.bulk]
                        .map(|x| f64::from(x.as_array()[lane]));
                    let cap = f64::from(STRAIN_CAP);
                    let stiffened = i.clamp(0.0, cap);
                    let extra = stiffened * stiffened / 2.0 + (i - cap).max(0.0) * cap;
                    let cap = f64::from(VOLUME_CAP);
                    let inside = v.clamp(-cap, cap);
                    let bulk = inside * inside / 2.0 + (v - inside) * inside;
                    sum += g * (i / 2.0 + f64::from(law.stiffening) * extra / 2.0 - v) + b * bulk;
                }
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
    use crate::shell::Tet;

    #[test]
    fn forces_are_minus_the_energy_gradient_and_zero_at_rest() {
        let tet = |turn: f32| Tet {
            gradients_per_m: [
                Mat3::from_rotation_x(turn) * Vec3::new(20.0, 1.0, 0.0),
                Vec3::new(-2.0, 15.0, 3.0),
                Vec3::new(1.0, 4.0, 25.0 - turn),
            ],
            stiffness_joules: 2.0 + turn,
            bulk_joules: 16.0,
            strain_margin: 1.0,
        };
        let prism = Prism {
            nodes: [0, 1, 2, 3, 4, 5],
            face: 0,
            tets: [tet(0.0), tet(0.5), tet(1.0)],
        };
        let mut groups = PrismGroup::pack(&[prism], 6);
        groups[0].rotate(&[Mat3::from_rotation_y(0.4)]);
        forces_fit_energy(
            6,
            |d| groups[0].energy_joules(law(), d),
            |d, force| groups[0].add_forces::<f32x4>((), law(), d, force),
        );
    }
}
