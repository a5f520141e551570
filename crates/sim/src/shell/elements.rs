//! Tetrahedra, skin triangles, masses and damping of a shell.

use dynaskin_body::SkinWeights;
use glam::{Mat3, Vec3};

use super::columns::Columns;
use super::inner::{InnerSurface, ramp};
use super::surface::Surface;
use super::tissue::{Prism, Shell, ShellReport, TETS_PER_PRISM, Tet, Triangle};
use crate::contact::ContactSurface;
use crate::nearby::Blur;
use crate::settings::SimSettings;

/// Tetrahedra with a least height up to the first, in metres, are left out, since they would dictate the
/// time step; up to the second they grow steadily to their full stiffness. It is the height that counts
/// and no ratio: over the fine triangles of a nipple stand needles, which hold the skin.
const LEAST_HEIGHT_M: [f32; 2] = [4e-4, 1e-3];

/// Standard deviation in metres over which skin, a millimetre or two thick, evens out what lies under
/// it: the elements have no stiffness against bending, and the fine triangles of a nipple would crumple.
const SKIN_BLUR_M: f32 = 0.004;

/// Acceleration of a hard landing, for the strain that stability must allow for.
const LANDING_M_PER_S2: f32 = 20.0;

pub(super) fn build(
    surface: &Surface,
    settings: &SimSettings,
    columns: Columns,
    inner: InnerSurface,
) -> Shell {
    let slots = columns.slots;
    let layers = settings.layers.max(1) as usize;
    let free = slots * layers;
    let builder = Builder {
        surface,
        settings,
        shear_pa: shear_moduli_pa(settings, &columns, &inner),
        columns,
        inner,
        layers,
    };
    let mut node_mass_kg = vec![0.0; free];
    let (prisms, dropped_tets) = builder.prisms(&mut node_mass_kg);
    let triangles = builder.triangles(&mut node_mass_kg);
    // A node that lost all its elements still needs a mass; it moves as if alone.
    for mass in &mut node_mass_kg {
        *mass = mass.max(1e-6);
    }
    let node_rest_m = (0..free)
        .map(|node| builder.node_m(node % slots, node / slots))
        .collect();
    let node_damping_per_s = (0..free)
        .map(|node| builder.damping_per_s(node % slots))
        .collect();
    let column_rest_m: Vec<Vec3> = columns_rest_m(surface, &builder.columns);
    let contact_stiffness = builder.contact_stiffness_n_per_m(&column_rest_m);
    let Builder { columns, inner, .. } = builder;
    let depth_m = inner.depth_m[..slots].to_vec();
    let mean = depth_m.iter().sum::<f32>() / slots as f32;
    let report = ShellReport {
        vertices: slots,
        tets: prisms
            .iter()
            .flat_map(|prism| &prism.tets)
            .filter(|tet| tet.stiffness_joules > 0.0)
            .count(),
        dropped_tets,
        shortened_columns: inner.shortened,
        mass_kg: node_mass_kg.iter().sum(),
        depth_m: [
            depth_m.iter().copied().fold(f32::INFINITY, f32::min),
            mean,
            depth_m.iter().copied().fold(0.0, f32::max),
        ],
    };
    let column_skin: Vec<SkinWeights> = columns
        .vertex
        .iter()
        .map(|v| surface.skin[*v as usize])
        .collect();
    Shell {
        skin_blur: Blur::new(&column_rest_m, &columns.prisms, SKIN_BLUR_M),
        contact: ContactSurface::new(
            &column_rest_m,
            &column_skin,
            &columns.prisms,
            contact_stiffness,
            depth_m.clone(),
        ),
        vertices: columns.vertex[..slots].to_vec(),
        column_skin,
        column_rest_m,
        node_rest_m,
        node_mass_kg,
        node_damping_per_s,
        prisms,
        triangles,
        faces: columns.prisms,
        joints_rest_m: surface.joints_rest_m,
        depth_m,
        report,
    }
}

fn shear_moduli_pa(settings: &SimSettings, columns: &Columns, inner: &InnerSurface) -> Vec<f32> {
    (0..columns.vertex.len())
        .map(|column| {
            let tissue = columns.mixed(column, |region| {
                settings.tissues[region].shear_modulus_at_pa(inner.depth_m[column])
            });
            let fade = 1.0 - columns.softness[column];
            tissue * (1.0 + settings.edge_stiffening * fade * fade)
        })
        .collect()
}

fn columns_rest_m(surface: &Surface, columns: &Columns) -> Vec<Vec3> {
    let at = |v: &u32| surface.positions_m[*v as usize];
    columns.vertex.iter().map(at).collect()
}

struct Builder<'a> {
    surface: &'a Surface,
    settings: &'a SimSettings,
    columns: Columns,
    inner: InnerSurface,
    shear_pa: Vec<f32>,
    layers: usize,
}

impl Builder<'_> {
    fn node_m(&self, column: usize, layer: usize) -> Vec3 {
        let share = layer as f32 / self.layers as f32;
        self.surface.positions_m[self.columns.vertex[column] as usize]
            + self.inner.inward[column] * (self.inner.depth_m[column] * share)
    }

    fn node(&self, column: usize, layer: usize) -> u32 {
        let slots = self.columns.slots;
        let free = column < slots && layer < self.layers;
        (if free {
            layer * slots + column
        } else {
            slots * self.layers
        }) as u32
    }

    /// Damping rate from the ratio at the frequency of a layer on bone, `sqrt(G/rho)/(4h)`.
    fn damping_per_s(&self, slot: usize) -> f32 {
        let speed = (self.shear_pa[slot] / self.settings.density_kg_per_m3).sqrt();
        let frequency_hz = speed / (4.0 * self.inner.depth_m[slot]);
        let ratio = self
            .columns
            .mixed(slot, |r| self.settings.tissues[r].damping_ratio);
        2.0 * ratio * std::f32::consts::TAU * frequency_hz
    }

    /// What each slot's column sets against pressure on its skin: the volume term's modulus times
    /// its area over its depth.
    fn contact_stiffness_n_per_m(&self, column_rest_m: &[Vec3]) -> Vec<f32> {
        let mut area_m2 = vec![0.0; self.columns.vertex.len()];
        for prism in &self.columns.prisms {
            let [a, b, c] = prism.map(|column| column_rest_m[column as usize]);
            let third = (b - a).cross(c - a).length() / 6.0;
            for &column in prism {
                area_m2[column as usize] += third;
            }
        }
        (0..self.columns.slots)
            .map(|slot| {
                let modulus_pa = self.settings.bulk_modulus_pa(self.shear_pa[slot]);
                modulus_pa * area_m2[slot] / self.inner.depth_m[slot]
            })
            .collect()
    }

    /// Stiffening at the shear strain of a layer under a hard landing, `rho a h / G`, at most 2:
    /// the volume term alone grows with the square of the strain.
    fn strain_margin(&self, prism: &[u32; 3], shear_pa: f32) -> f32 {
        let depth_m = prism
            .iter()
            .map(|c| self.inner.depth_m[*c as usize])
            .sum::<f32>()
            / 3.0;
        let load_pa = self.settings.density_kg_per_m3 * LANDING_M_PER_S2 * depth_m;
        let strain = (load_pa / shear_pa).min(2.0);
        1.0 + strain * strain
    }

    fn prisms(&self, mass_kg: &mut [f32]) -> (Vec<Prism>, usize) {
        let mut prisms = Vec::new();
        let mut dropped = 0;
        let fixed = mass_kg.len() as u32;
        for (face, columns) in self.columns.prisms.iter().enumerate() {
            let mut order = columns.map(|column| column as usize);
            order.sort_by(|&a, &b| {
                let key = |c: usize| self.surface.split_order[self.columns.vertex[c] as usize];
                key(a).total_cmp(&key(b)).then(a.cmp(&b))
            });
            let even = parity(columns.map(|column| column as usize), order);
            let [a, b, c] = order;
            let shear_pa = columns
                .iter()
                .map(|c| self.shear_pa[*c as usize])
                .sum::<f32>()
                / 3.0;
            let strain_margin = self.strain_margin(columns, shear_pa);
            for top in 0..self.layers {
                let low = top + 1;
                let corners = [(a, top), (b, top), (c, top), (a, low), (b, low), (c, low)];
                let nodes = corners.map(|(column, layer)| self.node(column, layer));
                let positions = corners.map(|(column, layer)| self.node_m(column, layer));
                let mut tets = [Tet::default(); TETS_PER_PRISM];
                // Diagonals run from the lower to the higher column on every side, so that
                // neighbouring prisms agree.
                let signs = [-even, even, -even];
                for ((tet, places), sign) in tets.iter_mut().zip(Prism::CORNERS).zip(signs) {
                    let of_tet = places.map(|place| nodes[place]);
                    if of_tet.iter().all(|&node| node == fixed) {
                        continue;
                    }
                    let at = places.map(|place| positions[place]);
                    let Some(shape) = TetShape::new(at, sign) else {
                        dropped += 1;
                        continue;
                    };
                    let share = shape.volume_m3 * self.settings.density_kg_per_m3 / 4.0;
                    add_mass(mass_kg, &of_tet, share);
                    let volume_m3 = shape.volume_m3 * shape.share;
                    *tet = Tet {
                        gradients_per_m: shape.gradients_per_m,
                        stiffness_joules: volume_m3 * shear_pa,
                        bulk_joules: volume_m3 * self.settings.bulk_modulus_pa(shear_pa),
                        strain_margin,
                    };
                }
                if tets.iter().any(|tet| tet.stiffness_joules > 0.0) {
                    prisms.push(Prism {
                        nodes,
                        face: face as u32,
                        tets,
                    });
                }
            }
        }
        (prisms, dropped)
    }
}

impl Builder<'_> {
    fn triangles(&self, mass_kg: &mut [f32]) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for (face, prism) in self.columns.prisms.iter().enumerate() {
            let columns = prism.map(|column| column as usize);
            let [a, b, c] = columns.map(|column| self.node_m(column, 0));
            let (edge_b, edge_c) = (b - a, c - a);
            let normal = edge_b.cross(edge_c);
            let area_m2 = normal.length() / 2.0;
            let longest = edge_b.length_squared().max(edge_c.length_squared());
            if area_m2 < 1e-3 * longest {
                continue;
            }
            let first = edge_b.normalize();
            let second = normal.normalize().cross(first);
            // Columns of the inverse of [[b·t1, c·t1], [b·t2, c·t2]] are the gradients.
            let (b1, c1, c2) = (edge_b.dot(first), edge_c.dot(first), edge_c.dot(second));
            let gradients_per_m = [[1.0 / b1, -c1 / (b1 * c2)], [0.0, 1.0 / c2]];
            let nodes = columns.map(|column| self.node(column, 0));
            add_mass(
                mass_kg,
                &nodes,
                area_m2 * self.settings.skin_kg_per_m2 / 3.0,
            );
            let skin_n_per_m = columns
                .iter()
                .map(|&c| {
                    self.columns
                        .mixed(c, |r| self.settings.tissues[r].skin_n_per_m)
                })
                .sum::<f32>()
                / 3.0;
            triangles.push(Triangle {
                nodes,
                tangents: [first, second],
                gradients_per_m,
                stiffness_joules: area_m2 * skin_n_per_m,
                face: face as u32,
            });
        }
        triangles
    }
}

/// 1 if `order` is an even permutation of `winding`, -1 if it is odd.
fn parity(winding: [usize; 3], order: [usize; 3]) -> f32 {
    let start = winding
        .iter()
        .position(|&column| column == order[0])
        .unwrap_or(0);
    if winding[(start + 1) % 3] == order[1] {
        1.0
    } else {
        -1.0
    }
}

fn add_mass(mass_kg: &mut [f32], nodes: &[u32], share_kg: f32) {
    for &node in nodes {
        if let Some(mass) = mass_kg.get_mut(node as usize) {
            *mass += share_kg;
        }
    }
}

/// What a tetrahedron's corners make of it.
struct TetShape {
    /// Gradients of the shape functions of corners 1..4.
    gradients_per_m: [Vec3; 3],
    volume_m3: f32,
    /// Share of its stiffness that it takes part with.
    share: f32,
}

impl TetShape {
    /// None for a sliver or a tetrahedron whose orientation is not `sign`.
    fn new([a, b, c, d]: [Vec3; 4], sign: f32) -> Option<Self> {
        let edges = Mat3::from_cols(b - a, c - a, d - a);
        let volume_m3 = sign * edges.determinant() / 6.0;
        if volume_m3 <= 0.0 {
            return None;
        }
        let gradients = edges.inverse().transpose();
        let [b, c, d] = [gradients.x_axis, gradients.y_axis, gradients.z_axis];
        // A corner's gradient is one over its height.
        let steepest = [b, c, d, b + c + d]
            .iter()
            .map(|gradient| gradient.length())
            .fold(0.0, f32::max);
        let share = ramp(1.0 / steepest, LEAST_HEIGHT_M);
        (share > 0.0).then_some(Self {
            gradients_per_m: [b, c, d],
            volume_m3,
            share,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_reproduce_a_linear_field() {
        let corners = [
            Vec3::new(0.0, 0.1, 0.0),
            Vec3::new(0.1, 0.0, 0.02),
            Vec3::new(0.03, 0.2, 0.1),
            Vec3::new(0.05, 0.0, -0.1),
        ];
        let volume = Mat3::from_cols(
            corners[1] - corners[0],
            corners[2] - corners[0],
            corners[3] - corners[0],
        )
        .determinant()
            / 6.0;
        let tet = TetShape::new(corners, volume.signum()).unwrap();
        assert!((tet.volume_m3 - volume.abs()).abs() < 1e-9);
        assert!(
            TetShape::new(corners, -volume.signum()).is_none(),
            "inverted is refused"
        );
        let slope = Vec3::new(1.0, -2.0, 0.5);
        let mut sum = Vec3::ZERO;
        for (corner, gradient) in corners[1..].iter().zip(tet.gradients_per_m) {
            sum += gradient * slope.dot(*corner - corners[0]);
        }
        assert!((sum - slope).length() < 1e-4, "{sum}");
    }

    #[test]
    fn slivers_are_refused() {
        let flat = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.3, 0.3, 3e-4)];
        assert!(TetShape::new(flat, 1.0).is_none());
    }
}
