//! The time stepper: explicit symplectic Euler on displacements from the skinned surface.

use dynaskin_body::Pose;
use dynaskin_skeleton::{MODEL_RATE_HZ, soft_clip};
use glam::{Mat3, Quat, Vec3};
use wide::f32x4;

use crate::contact::Contacts;
use crate::elastic::{Elements, Law, Machine, PrismGroup, TriangleGroup};
use crate::kinematics::{Drive, Kinematics};
use crate::settings::SimSettings;
use crate::shell::{Prism, Shell};

/// Displacement in metres and speed in m/s that no tissue reaches: beyond them a run is unstable.
const MAX_DISPLACEMENT_M: f32 = 0.35;
const MAX_SPEED_M_PER_S: f32 = 30.0;
/// Before the first tick tissue settles under gravity in the first pose, for at most this long...
const SETTLE_TICKS: usize = 90;
/// ...with this many times the damping...
const SETTLE_DAMPING: f32 = 4.0;
/// ...and until nothing moves faster than this.
const SETTLED_M_PER_S: f32 = 2e-3;

/// How many times stiffer stability takes the skin than it is at rest: it stiffens with strain.
const SKIN_MARGIN: f32 = 4.0;

/// The simulation went astray; a smaller time step may help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the simulation is unstable at tick {tick} with {substeps} steps per tick, first under vertex \
     {vertex}"
)]
pub struct Unstable {
    /// The tick, counted from 0.
    pub tick: usize,
    /// Time steps per tick that were used.
    pub substeps: u32,
    /// Body vertex under which the first bad number was found.
    pub vertex: u32,
}

/// Soft tissue of one shell in motion.
///
/// The unknown is d, a node's displacement from where skinning puts it, in world axes. Its
/// acceleration is the elastic force over the mass, minus the (soft-clipped) acceleration of the
/// skinned position, plus gravity's change of direction against the rest pose, minus damping of the
/// velocity relative to the turning bone. Every term is exactly 0 where nothing moves.
#[derive(Clone, Debug)]
pub struct Solver<'a> {
    shell: &'a Shell,
    law: Law,
    machine: Machine,
    substeps: u32,
    relaxation_seconds: f32,
    drive_limit_m_per_s2: f32,
    /// What damping grows by at most.
    damping_growth: f32,
    kinematics: Kinematics,
    prisms: Vec<PrismGroup>,
    triangles: Vec<TriangleGroup>,
    /// None where tissue passes through tissue.
    contacts: Option<Contacts>,
    tick: usize,
    /// Free nodes' displacement (m) and velocity (m/s), and one last, fixed node that stays 0.
    displacement: Vec<f32x4>,
    velocity: Vec<f32x4>,
    force: Vec<f32x4>,
    /// Displacement a moment ahead, at which forces are evaluated: viscosity.
    ahead: Vec<f32x4>,
    per_node: NodeConstants,
    /// Body acceleration (m/s²) on free nodes at the last tick and now.
    drive_before: Vec<f32x4>,
    drive_now: Vec<f32x4>,
    /// Rotation of each column, at the last tick and now.
    rotation_before: Option<Vec<Quat>>,
    rotation: Vec<Quat>,
    /// Linear part of the blended skinning matrix of each slot.
    skin_linear: Vec<Mat3>,
    /// Angular velocity in rad/s of each slot.
    spin: Vec<Vec3>,
}

/// What never changes of each free node.
#[derive(Clone, Debug)]
struct NodeConstants {
    /// One over the mass with the mass that stability needs.
    inverse_mass_per_kg: Vec<f32>,
    /// Real mass over that mass.
    drive_share: Vec<f32>,
    damping_per_s: Vec<f32>,
    /// What damping grows by per squared metre of displacement.
    damping_growth_per_m2: Vec<f32>,
    added_mass_kg: f32,
}

impl<'a> Solver<'a> {
    /// A solver at rest, with `settings.substeps` time steps per tick.
    pub fn new(shell: &'a Shell, settings: &SimSettings) -> Self {
        let free = shell.node_rest_m.len();
        let substeps = settings.substeps.max(1);
        Self {
            shell,
            law: Law::new(settings),
            machine: Machine::detected(),
            substeps,
            relaxation_seconds: settings.relaxation_seconds,
            drive_limit_m_per_s2: settings.drive_limit_m_per_s2,
            damping_growth: settings.damping_growth,
            kinematics: Kinematics::new(shell.joints_rest_m, MODEL_RATE_HZ),
            prisms: PrismGroup::pack(&shell.prisms, free as u32),
            triangles: TriangleGroup::pack(&shell.triangles, free as u32),
            contacts: settings.contact.then(Contacts::default),
            tick: 0,
            displacement: vec![f32x4::ZERO; free + 1],
            velocity: vec![f32x4::ZERO; free + 1],
            force: vec![f32x4::ZERO; free + 1],
            ahead: vec![f32x4::ZERO; free + 1],
            per_node: NodeConstants::new(shell, settings),
            drive_before: vec![f32x4::ZERO; free],
            drive_now: vec![f32x4::ZERO; free],
            rotation_before: None,
            rotation: vec![Quat::IDENTITY; shell.column_skin.len()],
            skin_linear: vec![Mat3::IDENTITY; shell.vertices.len()],
            spin: vec![Vec3::ZERO; shell.vertices.len()],
        }
    }

    /// Mass in kg that was added so that no node is too fast for the time step.
    pub fn added_mass_kg(&self) -> f32 {
        self.per_node.added_mass_kg
    }

    /// Advances by one tick of 1/60 s, to `pose`. Before the first tick the tissue settles under
    /// gravity in that pose.
    ///
    /// # Errors
    /// [`Unstable`] if a number is not finite or unreasonably large; the solver is then of no
    /// further use.
    pub fn step(&mut self, pose: &Pose) -> Result<(), Unstable> {
        let drive = self.kinematics.push(pose);
        let first = self.rotation_before.is_none();
        self.follow_bones(&drive);
        if first {
            self.drive_before.copy_from_slice(&self.drive_now);
            for _ in 0..SETTLE_TICKS {
                self.run_substeps(SETTLE_DAMPING);
                if self.check()? < SETTLED_M_PER_S {
                    break;
                }
            }
        }
        self.run_substeps(1.0);
        self.check()?;
        self.tick += 1;
        Ok(())
    }

    /// The offsets of the shell's vertices in the rest pose, in metres: what added to the rest
    /// surface is skinned to the simulated surface.
    pub fn offsets_rest_m(&self) -> impl ExactSizeIterator<Item = Vec3> + '_ {
        self.skin_linear.iter().enumerate().map(|(slot, linear)| {
            let displacement = self.skin_displacement_m(slot);
            // Blending opposed rotations can squash a vertex to nothing; then only the rotation
            // can be undone.
            if linear.determinant() > 0.05 {
                linear.inverse() * displacement
            } else {
                self.rotation[slot].inverse() * displacement
            }
        })
    }

    /// The displacements of the shell's vertices from the skinned surface, world axes, in metres.
    pub fn displacements_world_m(&self) -> impl ExactSizeIterator<Item = Vec3> + '_ {
        (0..self.shell.vertices.len()).map(|slot| self.skin_displacement_m(slot))
    }

    /// Displacement of the skin over a node: evened out, world axes, in metres.
    fn skin_displacement_m(&self, slot: usize) -> Vec3 {
        let slots = self.shell.vertices.len();
        let of_column = |column: usize| {
            // The ring around the moving columns stays on the bones.
            if column < slots {
                xyz(self.displacement[column])
            } else {
                Vec3::ZERO
            }
        };
        self.shell
            .skin_blur
            .at(slot, of_column)
            .unwrap_or_else(|| of_column(slot))
    }

    /// Sets displacement (m) and velocity (m/s), world axes, of every free node as a function of
    /// the body vertex above it and its depth as a share of the column, 0 at the skin: for free
    /// vibration.
    pub fn set_state(&mut self, state: impl Fn(u32, f32) -> (Vec3, Vec3)) {
        let slots = self.shell.vertices.len();
        let layers = self.shell.node_rest_m.len() / slots;
        for node in 0..self.shell.node_rest_m.len() {
            let depth_share = (node / slots) as f32 / layers as f32;
            let (displacement, velocity) = state(self.shell.vertices[node % slots], depth_share);
            self.displacement[node] = pad(displacement);
            self.velocity[node] = pad(velocity);
        }
    }

    /// Elastic and kinetic energy in joules.
    pub fn energy_joules(&self) -> f64 {
        let elastic: f64 = self
            .prisms
            .iter()
            .map(|group| group.energy_joules(self.law, &self.displacement))
            .chain(
                self.triangles
                    .iter()
                    .map(|group| group.energy_joules(self.law, &self.displacement)),
            )
            .sum();
        let kinetic: f64 = self
            .velocity
            .iter()
            .zip(&self.per_node.inverse_mass_per_kg)
            .map(|(v, inverse)| f64::from(xyz(*v).length_squared() / inverse) / 2.0)
            .sum();
        elastic + kinetic
    }

    /// Takes over the bones' rotations and accelerations.
    fn follow_bones(&mut self, drive: &Drive) {
        let slots = self.shell.vertices.len();
        let rotation: Vec<Quat> = self
            .shell
            .column_skin
            .iter()
            .map(|skin| drive.blended_rotation(skin))
            .collect();
        let before = self
            .rotation_before
            .insert(std::mem::take(&mut self.rotation));
        if self.tick > 0 {
            for slot in 0..slots {
                self.spin[slot] = spin_rad_per_s(before[slot], rotation[slot]);
            }
        }
        self.rotation = rotation;
        let columns = &self.shell.column_skin;
        std::mem::swap(&mut self.drive_before, &mut self.drive_now);
        for (slot, skin) in columns[..slots].iter().enumerate() {
            self.skin_linear[slot] = drive.blended_linear(skin);
            let gravity = drive.gravity_change_m_per_s2(skin);
            for node in (slot..self.shell.node_rest_m.len()).step_by(slots) {
                let accel = drive.acceleration_m_per_s2(skin, self.shell.node_rest_m[node]);
                let pull = gravity - soft_clip(accel, self.drive_limit_m_per_s2);
                self.drive_now[node] = pad(pull * self.per_node.drive_share[node]);
            }
        }
        let face_rotations: Vec<Mat3> = self
            .shell
            .faces
            .iter()
            .map(|face| Mat3::from_quat(mean_rotation(face.map(|c| self.rotation[c as usize]))))
            .collect();
        for group in &mut self.prisms {
            group.rotate(&face_rotations);
        }
        for group in &mut self.triangles {
            group.rotate(&face_rotations);
        }
        if let Some(contacts) = &mut self.contacts {
            let skinned_m = columns
                .iter()
                .zip(&self.shell.column_rest_m)
                .map(|(skin, rest_m)| drive.skinned_m(skin, *rest_m))
                .collect();
            contacts.find(&self.shell.contact, skinned_m, &self.displacement);
        }
    }

    fn run_substeps(&mut self, damping_factor: f32) {
        let free = self.shell.node_rest_m.len();
        let slots = self.shell.vertices.len();
        let dt = (1.0 / (MODEL_RATE_HZ * f64::from(self.substeps))) as f32;
        let relaxation = f32x4::splat(self.relaxation_seconds);
        let most_growth = self.damping_growth;
        for substep in 0..self.substeps {
            for node in 0..free {
                self.ahead[node] = self.displacement[node] + self.velocity[node] * relaxation;
            }
            self.force.fill(f32x4::ZERO);
            let elements = Elements {
                law: self.law,
                prisms: &self.prisms,
                triangles: &self.triangles,
                displacement: &self.ahead,
            };
            elements.add_forces(self.machine, &mut self.force);
            // What is known at the two ends of the tick, met in between.
            let passed = (substep as f32 + 0.5) / self.substeps as f32;
            if let Some(contacts) = &self.contacts {
                contacts.add_forces(passed, &self.displacement, &mut self.force);
            }
            let share = f32x4::splat(passed);
            for node in 0..free {
                let drive = self.drive_before[node]
                    + (self.drive_now[node] - self.drive_before[node]) * share;
                let moved = self.displacement[node];
                let growth =
                    (moved * moved).reduce_add() * self.per_node.damping_growth_per_m2[node];
                let damping = self.per_node.damping_per_s[node]
                    * (1.0 + growth.min(most_growth))
                    * damping_factor
                    * dt;
                let carried = self.spin[node % slots].cross(xyz(self.displacement[node]));
                let accel =
                    self.force[node] * f32x4::splat(self.per_node.inverse_mass_per_kg[node]);
                let pushed = self.velocity[node]
                    + (accel + drive) * f32x4::splat(dt)
                    + pad(carried * damping);
                self.velocity[node] = pushed * f32x4::splat(1.0 / (1.0 + damping));
                self.displacement[node] += self.velocity[node] * f32x4::splat(dt);
            }
        }
    }

    /// The largest speed in m/s, if all is well.
    fn check(&self) -> Result<f32, Unstable> {
        let mut speed2 = 0.0_f32;
        let slots = self.shell.vertices.len();
        let states = self.displacement.iter().zip(&self.velocity);
        for (node, (displacement, velocity)) in states.enumerate() {
            let (d2, v2) = (
                xyz(*displacement).length_squared(),
                xyz(*velocity).length_squared(),
            );
            // Written so that NaN fails.
            let fine = d2 < MAX_DISPLACEMENT_M * MAX_DISPLACEMENT_M
                && v2 < MAX_SPEED_M_PER_S * MAX_SPEED_M_PER_S;
            if !fine {
                return Err(Unstable {
                    tick: self.tick,
                    substeps: self.substeps,
                    vertex: self.shell.vertices[node % slots],
                });
            }
            speed2 = speed2.max(v2);
        }
        Ok(speed2.sqrt())
    }
}

impl NodeConstants {
    /// Adds mass to nodes that would vibrate too fast for the time step.
    fn new(shell: &Shell, settings: &SimSettings) -> Self {
        let dt = (1.0 / (MODEL_RATE_HZ * f64::from(settings.substeps.max(1)))) as f32;
        let allowed = settings.stability_limit / dt;
        let mut constants = Self {
            inverse_mass_per_kg: Vec::with_capacity(shell.node_rest_m.len()),
            drive_share: Vec::with_capacity(shell.node_rest_m.len()),
            damping_per_s: shell.node_damping_per_s.clone(),
            damping_growth_per_m2: (0..shell.node_rest_m.len())
                .map(|node| {
                    let depth_m = shell.depth_m[node % shell.vertices.len()];
                    settings.damping_growth / (depth_m * depth_m)
                })
                .collect(),
            added_mass_kg: 0.0,
        };
        for (mass, block) in shell.node_mass_kg.iter().zip(stiffness_blocks(shell)) {
            // A chain of equal nodes vibrates at up to twice a node's own stiffness over its mass.
            let stiffness = largest_eigenvalue(block);
            let scaled = mass.max(2.0 * stiffness / (allowed * allowed));
            constants.added_mass_kg += scaled - mass;
            constants.inverse_mass_per_kg.push(1.0 / scaled);
            // A node whose elements were all left out has nothing to hold it: nothing pulls it.
            let held = stiffness > 0.0;
            constants
                .drive_share
                .push(if held { mass / scaled } else { 0.0 });
        }
        constants
    }
}

/// Stiffness of each free node with all others held, at the strain that tissue so soft and deep
/// reaches, in N/m.
fn stiffness_blocks(shell: &Shell) -> Vec<Mat3> {
    let mut blocks = vec![Mat3::ZERO; shell.node_rest_m.len()];
    let mut add = |node: u32, block: Mat3| {
        if let Some(sum) = blocks.get_mut(node as usize) {
            *sum += block;
        }
    };
    let outer = |g: Vec3| Mat3::from_cols(g * g.x, g * g.y, g * g.z);
    for prism in &shell.prisms {
        for (tet, places) in prism.tets.iter().zip(Prism::CORNERS) {
            let [a, b, c] = tet.gradients_per_m;
            let stiffness = tet.stiffness_joules * tet.strain_margin;
            for (place, g) in places.into_iter().zip([-(a + b + c), a, b, c]) {
                let shear = Mat3::from_diagonal(Vec3::splat(g.length_squared()));
                add(
                    prism.nodes[place],
                    shear * stiffness + outer(g) * (tet.bulk_joules * tet.strain_margin),
                );
            }
        }
    }
    for triangle in &shell.triangles {
        let [[b0, b1], [c0, c1]] = triangle.gradients_per_m;
        let [t0, t1] = triangle.tangents;
        for (node, [g0, g1]) in
            triangle
                .nodes
                .iter()
                .zip([[-b0 - c0, -b1 - c1], [b0, b1], [c0, c1]])
        {
            let g = t0 * g0 + t1 * g1;
            let in_plane = Mat3::from_diagonal(Vec3::splat(g.length_squared()));
            add(
                *node,
                (in_plane + outer(g)) * (triangle.stiffness_joules * SKIN_MARGIN),
            );
        }
    }
    blocks
}

/// Largest eigenvalue of a symmetric positive matrix, by power iteration from above: repeated
/// squaring of the matrix scaled by its trace.
fn largest_eigenvalue(matrix: Mat3) -> f32 {
    let trace = |m: &Mat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
    let whole = trace(&matrix);
    if whole <= 0.0 {
        return 0.0;
    }
    let scaled = matrix * (1.0 / whole);
    let mut power = scaled;
    for _ in 0..5 {
        power = power * power;
        power *= 1.0 / trace(&power);
    }
    // The power is now close to the projector onto the largest eigenvector.
    trace(&(power * scaled)) * whole
}

fn mean_rotation([a, b, c]: [Quat; 3]) -> Quat {
    let near = |q: Quat| if q.dot(a) < 0.0 { -q } else { q };
    let sum = a + near(b) + near(c);
    if sum.length_squared() > 1e-6 {
        sum.normalize()
    } else {
        a
    }
}

fn spin_rad_per_s(before: Quat, now: Quat) -> Vec3 {
    let turn = now * before.conjugate();
    let half = if turn.w < 0.0 {
        -turn.xyz()
    } else {
        turn.xyz()
    };
    half * (2.0 * MODEL_RATE_HZ as f32)
}

fn pad(v: Vec3) -> f32x4 {
    f32x4::new([v.x, v.y, v.z, 0.0])
}

fn xyz(v: f32x4) -> Vec3 {
    let [x, y, z, _] = v.to_array();
    Vec3::new(x, y, z)
}
