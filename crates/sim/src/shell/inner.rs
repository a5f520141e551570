//! The inner surface: how deep each column goes and in which direction.

use std::collections::HashSet;

use dynaskin_body::{Region, vertex_normals};
use glam::Vec3;

use super::columns::Columns;
use super::surface::Surface;
use crate::nearby::Blur;
use crate::settings::SimSettings;

/// Rounds of smoothing the directions, so that columns under a breast run side by side to the chest
/// wall instead of meeting in one point.
const DIRECTION_ROUNDS: usize = 40;
/// Rounds of smoothing the depth.
const DEPTH_ROUNDS: usize = 3;
/// Standard deviation in metres of smoothing both along the skin.
const BLUR_M: f32 = 0.02;
/// Rounds of smoothing the inner surface itself: bones are smoother than skin.
const SURFACE_ROUNDS: usize = 12;
/// Smoothing the inner surface changes a column's length to between these parts of itself: where
/// the skin bulges, as at a breast, it would otherwise sink deeper than there is tissue.
const DEPTH_KEPT: [f32; 2] = [0.7, 1.15];
/// A smoothed column counts as such where it keeps the direction: from not at all to wholly, as a share
/// of its length.
const SAME_WAY: [f32; 2] = [0.3, 0.7];
/// Rounds of smoothing the directions under a chest further, until they hardly change: a large breast's
/// normals meet before its depth ends.
const CHEST_ROUNDS: usize = 200;
/// Rounds of cutting depth where columns would cross.
const CUT_ROUNDS: usize = 60;
/// A face's inner copy has this part of its area, seen along the face's own normal (0: no area, below:
/// inside out). From the first on its columns are cut a little, from the second on at full rate. What is
/// done grows steadily from 0, since a shell must change steadily with the body's shape: a yes or no would
/// make two bodies that are nearly alike swing by a fifth more and less.
const CUT_AREA: [f32; 2] = [0.3, 0.1];
/// Share of its depth that a column loses at most per round.
const CUT: f32 = 0.1;
/// Share of that which its neighbours lose with it, so that no step is left beside it.
const CUT_BESIDE: f32 = 0.5;

/// Where every column ends.
pub(super) struct InnerSurface {
    /// Unit vectors from the skin to the end of the column.
    pub inward: Vec<Vec3>,
    /// Length of the column in metres.
    pub depth_m: Vec<f32>,
    /// Columns whose depth was cut.
    pub shortened: usize,
}

impl InnerSurface {
    pub fn fit(surface: &Surface, columns: &Columns, settings: &SimSettings) -> Self {
        let [least, most] = settings.depth_limits_m;
        let outer: Vec<Vec3> = columns
            .vertex
            .iter()
            .map(|v| surface.positions_m[*v as usize])
            .collect();
        let normals = vertex_normals(&surface.positions_m, &surface.faces);
        let mut inward: Vec<Vec3> = columns
            .vertex
            .iter()
            .map(|v| -normals[*v as usize])
            .collect();
        for _ in 0..DIRECTION_ROUNDS {
            inward = smoothed(&inward, columns, 0.5);
            for direction in &mut inward {
                *direction = direction.normalize_or_zero();
            }
        }
        // How much of a column's direction its neighbours decide depends on no shape, so that directions
        // change as steadily with the shape as the skin does.
        let chest = |column: usize| columns.mix[column][Region::Chest as usize];
        for _ in 0..CHEST_ROUNDS {
            let mean = smoothed(&inward, columns, 1.0);
            for (column, direction) in inward.iter_mut().enumerate() {
                let next =
                    direction.lerp(mean[column], 0.5 * chest(column) * columns.softness[column]);
                *direction = next.normalize_or_zero();
            }
        }
        let mut depth_m: Vec<f32> = columns
            .vertex
            .iter()
            .zip(&columns.softness)
            .map(|(v, softness)| {
                // Shallow where the tissue fades into skin over bone.
                let fade = 0.4 + 0.6 * softness;
                (surface.depth_m[*v as usize] * fade).clamp(least, most)
            })
            .collect();
        for _ in 0..DEPTH_ROUNDS {
            depth_m = smoothed(&depth_m, columns, 0.5);
        }
        // A mesh that is finer in one place is smoothed there by the same length.
        let blur = Blur::new(&outer, &columns.prisms, BLUR_M);
        depth_m = blur.of(&depth_m);
        let mut ends: Vec<Vec3> = (0..outer.len())
            .map(|c| outer[c] + inward[c] * depth_m[c])
            .collect();
        // Columns on the rim have neighbours on one side only and would be pulled inwards.
        let on_rim = rim(columns);
        for _ in 0..SURFACE_ROUNDS {
            let moved = smoothed(&ends, columns, 0.5);
            for (column, end) in ends.iter_mut().enumerate() {
                if !on_rim[column] {
                    *end = moved[column];
                }
            }
        }
        for column in 0..outer.len() {
            // Smoothing may only tilt a column and change its length, not turn it around or let
            // it end outside the body.
            let reach = ends[column] - outer[column];
            let along = reach.dot(inward[column]) / reach.length().max(f32::MIN_POSITIVE);
            let share = ramp(along, SAME_WAY);
            let kept = DEPTH_KEPT.map(|part| part * depth_m[column]);
            let smooth_m = reach.length().clamp(kept[0], kept[1]);
            let towards = reach.normalize_or(inward[column]);
            inward[column] = inward[column].lerp(towards, share).normalize();
            depth_m[column] += share * (smooth_m - depth_m[column]);
            depth_m[column] = depth_m[column].clamp(least, most);
        }
        depth_m = blur.of(&depth_m);
        inward = blur.of(&inward);
        for direction in &mut inward {
            *direction = direction.normalize_or_zero();
        }
        let wanted_m = depth_m.clone();
        for _ in 0..CUT_ROUNDS {
            if !cut_folds(&outer, columns, &inward, &mut depth_m, least) {
                break;
            }
        }
        let shortened = depth_m
            .iter()
            .zip(&wanted_m)
            .filter(|(now, wanted)| **now < 0.99 * **wanted)
            .count();
        Self {
            inward,
            depth_m,
            shortened,
        }
    }
}

/// 0 at the first bound, 1 at the second, steady between and without a kink.
pub(super) fn ramp(value: f32, [from, to]: [f32; 2]) -> f32 {
    let share = ((value - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// Which columns lie on an edge that only one prism has.
fn rim(columns: &Columns) -> Vec<bool> {
    let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    let walked: HashSet<[u32; 2]> = columns.prisms.iter().flat_map(|p| edges(*p)).collect();
    let mut on_rim = vec![false; columns.vertex.len()];
    for &[from, to] in &walked {
        if !walked.contains(&[to, from]) {
            on_rim[from as usize] = true;
            on_rim[to as usize] = true;
        }
    }
    on_rim
}

/// How much is to be done at each column, 0..=1, about faces whose inner copy shrinks.
fn squeezed(
    outer_m: &[Vec3],
    columns: &Columns,
    inward: &[Vec3],
    depth_m: &[f32],
    areas: [f32; 2],
) -> Vec<f32> {
    let mut found = vec![0.0_f32; depth_m.len()];
    for prism in &columns.prisms {
        let outer = prism.map(|c| outer_m[c as usize]);
        let inner: [Vec3; 3] = std::array::from_fn(|k| {
            outer[k] + inward[prism[k] as usize] * depth_m[prism[k] as usize]
        });
        let normal = area_vector(outer);
        let squared = normal.length_squared().max(f32::MIN_POSITIVE);
        let share = ramp(area_vector(inner).dot(normal) / squared, areas);
        for &column in prism {
            found[column as usize] = found[column as usize].max(share);
        }
    }
    found
}

/// Each number or `share` of the largest beside it, whichever is more.
fn spread(values: &[f32], columns: &Columns, share: f32) -> Vec<f32> {
    values
        .iter()
        .zip(&columns.neighbours)
        .map(|(own, around)| {
            let beside = around.iter().map(|&n| values[n as usize]);
            own.max(share * beside.fold(0.0, f32::max))
        })
        .collect()
}

/// Shortens the columns of squeezed faces; tells whether there was one.
fn cut_folds(
    outer_m: &[Vec3],
    columns: &Columns,
    inward: &[Vec3],
    depth_m: &mut [f32],
    least_m: f32,
) -> bool {
    let cut = squeezed(outer_m, columns, inward, depth_m, CUT_AREA);
    if cut.iter().all(|share| *share == 0.0) {
        return false;
    }
    for (depth_m, share) in depth_m.iter_mut().zip(spread(&cut, columns, CUT_BESIDE)) {
        *depth_m = (*depth_m * (1.0 - CUT * share)).max(least_m);
    }
    true
}

fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a) * 0.5
}

/// One round of moving every value towards the mean of its neighbours.
fn smoothed<T>(values: &[T], columns: &Columns, amount: f32) -> Vec<T>
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    values
        .iter()
        .zip(&columns.neighbours)
        .map(|(value, around)| {
            let mut others = around.iter().map(|&n| values[n as usize]);
            let Some(first) = others.next() else {
                return *value;
            };
            let mean = others.fold(first, |sum, other| sum + other) * (1.0 / around.len() as f32);
            *value * (1.0 - amount) + mean * amount
        })
        .collect()
}
