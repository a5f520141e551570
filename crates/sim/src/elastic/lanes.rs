//! Numbers of several elements side by side: eight where the machine has vectors that long, else four.
//!
//! Long vectors come with fused multiply-adds, so that machines with and without them differ in the last
//! bits; any two with them compute the same.
//!
//! Long vectors are only compiled into code that is inlined into [`super::Elements::add_forces`]: nothing that
//! computes with [`Lanes`] may stand in a closure handed to another function, such as `map`'s.

use std::ops::{Add, Mul, Sub};

use glam::{Mat3, Vec3};
use wide::f32x4;

/// Elements that are packed together; a run over them takes `PACKED / WIDTH` steps.
pub(super) const PACKED: usize = 8;

/// One number of each of eight elements, as it is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Packed(pub [f32; PACKED]);

impl Packed {
    pub const ZERO: Self = Self([0.0; PACKED]);
}

/// Three components of each of eight elements, as they are stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedVec3([Packed; 3]);

impl PackedVec3 {
    pub const ZERO: Self = Self([Packed::ZERO; 3]);

    pub fn set(&mut self, lane: usize, value: Vec3) {
        for (axis, value) in self.0.iter_mut().zip(value.to_array()) {
            axis.0[lane] = value;
        }
    }

    /// Each lane's vector times its matrix.
    pub fn turned(&self, matrices: &[Mat3; PACKED]) -> Self {
        let mut turned = Self::ZERO;
        for (lane, matrix) in matrices.iter().enumerate() {
            let [x, y, z] = self.0.map(|axis| axis.0[lane]);
            turned.set(lane, *matrix * Vec3::new(x, y, z));
        }
        turned
    }
}

/// Numbers of [`Self::WIDTH`] elements.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Proof that the machine has these vectors.
    type Machine: Copy;
    const WIDTH: usize;

    fn splat(machine: Self::Machine, value: f32) -> Self;
    /// `self * factor + sum`.
    fn times_plus(self, factor: Self, sum: Self) -> Self;
    /// Step `step` of eight packed elements.
    fn load(machine: Self::Machine, packed: &Packed, step: usize) -> Self;
    fn clamped(self, least: f32, most: f32) -> Self;
    /// This where `by` lies between the bounds, and 0 elsewhere.
    fn where_between(self, by: Self, above: f32, below: f32) -> Self;
    /// Fours of nodes' components, x, y and z; the second four is not asked for where there is none.
    fn from_fours(machine: Self::Machine, fours: impl Fn(usize) -> [f32x4; 4]) -> Vec3s<Self>;
    /// The reverse: `take` is given each four with its number.
    fn to_fours(vectors: Vec3s<Self>, take: impl FnMut(usize, [f32x4; 3]));
}

impl Lanes for f32x4 {
    type Machine = ();
    const WIDTH: usize = 4;

    #[inline(always)]
    fn splat((): (), value: f32) -> Self {
        f32x4::splat(value)
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, sum: Self) -> Self {
        self * factor + sum
    }

    #[inline(always)]
    fn load((): (), packed: &Packed, step: usize) -> Self {
        let [a, b, c, d, e, f, g, h] = packed.0;
        f32x4::new(if step == 0 {
            [a, b, c, d]
        } else {
            [e, f, g, h]
        })
    }

    #[inline(always)]
    fn clamped(self, least: f32, most: f32) -> Self {
        self.fast_max(f32x4::splat(least))
            .fast_min(f32x4::splat(most))
    }

    #[inline(always)]
    fn where_between(self, by: Self, above: f32, below: f32) -> Self {
        let between = by.simd_gt(f32x4::splat(above)) & by.simd_lt(f32x4::splat(below));
        between.bitselect(self, f32x4::ZERO)
    }

    #[inline(always)]
    fn from_fours((): (), fours: impl Fn(usize) -> [f32x4; 4]) -> Vec3s<Self> {
        let [x, y, z, _] = fours(0);
        Vec3s { x, y, z }
    }

    #[inline(always)]
    fn to_fours(vectors: Vec3s<Self>, mut take: impl FnMut(usize, [f32x4; 3])) {
        take(0, [vectors.x, vectors.y, vectors.z]);
    }
}

/// Eight lanes of an x86-64 machine with AVX2.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(super) struct Avx2 {
    lanes: pulp::f32x8,
    machine: pulp::x86::V3,
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use pulp::Simd as _;
    use pulp::x86::V3;

    use super::{Add, Avx2, Lanes, Mul, Packed, Sub, Vec3s, f32x4};

    macro_rules! lanewise {
        ($($trait:ident $method:ident $of_machine:ident),*) => {$(
            impl $trait for Avx2 {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    let lanes = self.machine.$of_machine(self.lanes, other.lanes);
                    Self { lanes, ..self }
                }
            }
        )*};
    }

    lanewise!(Add add add_f32s, Sub sub sub_f32s, Mul mul mul_f32s);

    impl Lanes for Avx2 {
        type Machine = V3;
        const WIDTH: usize = 8;

        #[inline(always)]
        fn splat(machine: V3, value: f32) -> Self {
            let lanes = machine.splat_f32s(value);
            Self { lanes, machine }
        }

        #[inline(always)]
        fn times_plus(self, factor: Self, sum: Self) -> Self {
            let lanes = self
                .machine
                .mul_add_f32s(self.lanes, factor.lanes, sum.lanes);
            Self { lanes, ..self }
        }

        #[inline(always)]
        fn load(machine: V3, packed: &Packed, _: usize) -> Self {
            let lanes = pulp::cast(packed.0);
            Self { lanes, machine }
        }

        #[inline(always)]
        fn clamped(self, least: f32, most: f32) -> Self {
            let machine = self.machine;
            let lanes = machine.max_f32s(self.lanes, machine.splat_f32s(least));
            let lanes = machine.min_f32s(lanes, machine.splat_f32s(most));
            Self { lanes, machine }
        }

        #[inline(always)]
        fn where_between(self, by: Self, above: f32, below: f32) -> Self {
            let machine = self.machine;
            let between = machine.and_m32s(
                machine.greater_than_f32s(by.lanes, machine.splat_f32s(above)),
                machine.less_than_f32s(by.lanes, machine.splat_f32s(below)),
            );
            let lanes = machine.select_f32s(between, self.lanes, machine.splat_f32s(0.0));
            Self { lanes, machine }
        }

        #[inline(always)]
        fn from_fours(machine: V3, fours: impl Fn(usize) -> [f32x4; 4]) -> Vec3s<Self> {
            let (low, high) = (fours(0), fours(1));
            let joined = |low: f32x4, high: f32x4| Self {
                lanes: pulp::cast([low, high]),
                machine,
            };
            Vec3s {
                x: joined(low[0], high[0]),
                y: joined(low[1], high[1]),
                z: joined(low[2], high[2]),
            }
        }

        #[inline(always)]
        fn to_fours(vectors: Vec3s<Self>, mut take: impl FnMut(usize, [f32x4; 3])) {
            let x: [f32x4; 2] = pulp::cast(vectors.x.lanes);
            let y: [f32x4; 2] = pulp::cast(vectors.y.lanes);
            let z: [f32x4; 2] = pulp::cast(vectors.z.lanes);
            take(0, [x[0], y[0], z[0]]);
            take(1, [x[1], y[1], z[1]]);
        }
    }
}

/// Three components of several elements.
#[derive(Clone, Copy)]
pub(crate) struct Vec3s<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

impl<L: Lanes> Vec3s<L> {
    #[inline(always)]
    pub fn load(machine: L::Machine, packed: &PackedVec3, step: usize) -> Self {
        let [x, y, z] = &packed.0;
        Self {
            x: L::load(machine, x, step),
            y: L::load(machine, y, step),
            z: L::load(machine, z, step),
        }
    }

    /// One node of each element; nodes are stored as x, y, z and padding.
    #[inline(always)]
    pub fn gather(
        machine: L::Machine,
        values: &[f32x4],
        nodes: &[u32; PACKED],
        step: usize,
    ) -> Self {
        L::from_fours(
            machine,
            #[inline(always)]
            |four| {
                let first = step * L::WIDTH + 4 * four;
                f32x4::transpose([
                    values[nodes[first] as usize],
                    values[nodes[first + 1] as usize],
                    values[nodes[first + 2] as usize],
                    values[nodes[first + 3] as usize],
                ])
            },
        )
    }

    /// Subtracts four elements from one node each, which may be the same.
    #[inline(always)]
    pub fn scatter_sub(self, values: &mut [f32x4], nodes: &[u32; PACKED], step: usize) {
        L::to_fours(
            self,
            #[inline(always)]
            |four, [x, y, z]| {
                let first = step * L::WIDTH + 4 * four;
                let lanes = f32x4::transpose([x, y, z, f32x4::ZERO]);
                for (lane, value) in lanes.into_iter().enumerate() {
                    values[nodes[first + lane] as usize] -= value;
                }
            },
        );
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        let yz = self.y.times_plus(other.y, self.z * other.z);
        self.x.times_plus(other.x, yz)
    }

    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    pub fn scaled(self, factor: L) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    /// `self * factor + sum`.
    #[inline(always)]
    pub fn scaled_plus(self, factor: L, sum: Self) -> Self {
        Self {
            x: self.x.times_plus(factor, sum.x),
            y: self.y.times_plus(factor, sum.y),
            z: self.z.times_plus(factor, sum.z),
        }
    }

    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }

    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }
}

/// Each element's group and lane: lanes far apart, so that one group rarely meets the same node
/// twice.
pub(super) fn spread(count: usize) -> impl Iterator<Item = (usize, usize)> {
    let groups = count.div_ceil(PACKED).max(1);
    (0..count).map(move |element| (element % groups, element / groups))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gathered_nodes_come_back_to_their_places() {
        fn check<L: Lanes>(machine: L::Machine) {
            let values: Vec<f32x4> = (0..9)
                .map(|n| f32x4::new([n as f32, 10.0 * n as f32, -(n as f32), 0.0]))
                .collect();
            let nodes = [3, 1, 4, 1, 5, 8, 2, 6];
            let mut sums = vec![f32x4::ZERO; 9];
            for step in 0..PACKED / L::WIDTH {
                let gathered = Vec3s::<L>::gather(machine, &values, &nodes, step);
                gathered.scatter_sub(&mut sums, &nodes, step);
            }
            for (node, sum) in sums.iter().enumerate() {
                let times = nodes.iter().filter(|n| **n as usize == node).count() as f32;
                assert_eq!(*sum, values[node] * f32x4::splat(-times), "node {node}");
            }
        }
        check::<f32x4>(());
        #[cfg(target_arch = "x86_64")]
        if let Some(machine) = pulp::x86::V3::try_new() {
            check::<Avx2>(machine);
        }
    }

    #[test]
    fn matrices_turn_vectors_lane_by_lane() {
        let turns: [Mat3; PACKED] = std::array::from_fn(|k| Mat3::from_rotation_y(0.1 * k as f32));
        let mut vector = PackedVec3::ZERO;
        for lane in 0..PACKED {
            vector.set(lane, Vec3::new(1.0, 2.0, lane as f32));
        }
        let turned = vector.turned(&turns);
        for (lane, turn) in turns.iter().enumerate() {
            let expected = *turn * Vec3::new(1.0, 2.0, lane as f32);
            let got = Vec3::from_array(turned.0.map(|axis| axis.0[lane]));
            assert_eq!(got, expected);
        }
    }
}
