//! Elastic forces of tetrahedra and skin triangles, several at a time.

mod lanes;
mod prisms;
mod skin;

use wide::f32x4;

use crate::settings::SimSettings;
use lanes::Lanes;
pub(crate) use prisms::PrismGroup;
pub(crate) use skin::TriangleGroup;

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

/// What vectors the machine has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Machine {
    Any,
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
}

impl Machine {
    pub fn detected() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(machine) = pulp::x86::V3::try_new() {
            return Self::Avx2(machine);
        }
        Self::Any
    }
}

/// What elastic forces are computed of.
pub(crate) struct Elements<'a> {
    pub law: Law,
    pub prisms: &'a [PrismGroup],
    pub triangles: &'a [TriangleGroup],
    /// Displacement of each node in metres; the last stands for "fixed to the bone".
    pub displacement: &'a [f32x4],
}

impl Elements<'_> {
    /// Adds the elastic forces in newtons to `force`, of each node.
    pub fn add_forces(self, machine: Machine, force: &mut [f32x4]) {
        match machine {
            Machine::Any => self.add_with::<f32x4>((), force),
            #[cfg(target_arch = "x86_64")]
            Machine::Avx2(machine) => machine.vectorize(WithAvx2 {
                elements: self,
                machine,
                force,
            }),
        }
    }

    #[inline(always)]
    fn add_with<L: Lanes>(self, machine: L::Machine, force: &mut [f32x4]) {
        for group in self.prisms {
            group.add_forces::<L>(machine, self.law, self.displacement, force);
        }
        for group in self.triangles {
            group.add_forces::<L>(machine, self.law, self.displacement, force);
        }
    }
}

/// A call that is compiled for machines with AVX2. A closure would do, were it always inlined.
#[cfg(target_arch = "x86_64")]
struct WithAvx2<'a, 'f> {
    elements: Elements<'a>,
    machine: pulp::x86::V3,
    force: &'f mut [f32x4],
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for WithAvx2<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.elements
            .add_with::<lanes::Avx2>(self.machine, self.force);
    }
}

#[cfg(test)]
mod check {
    use super::{Law, f32x4};

    pub(super) fn law() -> Law {
        Law {
            stiffening: 0.5,
            skin_stiffening: 6.0,
        }
    }

    /// Displacements of `nodes` nodes that move and one that does not.
    pub(super) fn displacement(nodes: usize) -> Vec<f32x4> {
        let moved = (0..nodes as u32).map(|n| {
            let at = |k: u32| 0.01 * ((n * 7 + k * 3) as f32).sin();
            f32x4::new([at(0), at(1), at(2), 0.0])
        });
        moved.chain([f32x4::ZERO]).collect()
    }

    /// Forces must be minus the gradient of the energy, whatever the strain, and 0 at rest.
    pub(super) fn forces_fit_energy(
        nodes: usize,
        energy: impl Fn(&[f32x4]) -> f64,
        add_forces: impl Fn(&[f32x4], &mut [f32x4]),
    ) {
        let mut force = vec![f32x4::ZERO; nodes + 1];
        add_forces(&force.clone(), &mut force);
        assert!(force.iter().all(|f| f.to_array() == [0.0; 4]), "{force:?}");
        let base = displacement(nodes);
        add_forces(&base, &mut force);
        let step = 3e-4;
        for node in 0..nodes {
            for axis in 0..3 {
                let moved = |sign: f32| {
                    let mut at = base.clone();
                    at[node].as_mut_array()[axis] += sign * step;
                    energy(&at)
                };
                let slope = (moved(1.0) - moved(-1.0)) / (2.0 * f64::from(step));
                let force = f64::from(force[node].as_array()[axis]);
                assert!(
                    (force + slope).abs() < 2e-2 * (1.0 + slope.abs()),
                    "node {node} axis {axis}: force {force}, energy slope {slope}"
                );
            }
        }
    }
}
