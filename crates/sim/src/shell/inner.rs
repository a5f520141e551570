//! The inner surface: how deep each column goes and in which direction.

use std::collections::HashSet;

use dynaskin_body::vertex_normals;
use glam::Vec3;

use super::columns::Columns;
use super::surface::Surface;
use crate::settings::SimSettings;

/// Rounds of smoothing the directions, so that columns under a breast run side by side to the chest
/// wall instead of meeting in one point.
const DIRECTION_ROUNDS: usize = 40;
/// Rounds of smoothing the depth.
const DEPTH_ROUNDS: usize = 3;
/// Rounds of smoothing the inner surface itself: bones are smoother than skin.
const SURFACE_ROUNDS: usize = 12;
/// Smoothing the inner surface changes a column's length to between these parts of itself: where
/// the skin bulges, as at a breast, it would otherwise sink deeper than there is tissue.
const DEPTH_KEPT: [f32; 2] = [0.7, 1.15];
/// Rounds of turning columns that cross each other towards their neighbours, before any is cut.
const TURN_ROUNDS: usize = 150;
/// How many rings around a crossing are turned with it.
const TURN_RINGS: usize = 3;
/// Rounds of cutting depth where the inner surface folds.
const LIMIT_ROUNDS: usize = 60;
/// A column is cut while a face's inner copy has less than this part of its area, seen along the
/// face's own normal: at 0 it has no area, below it is inside out.
const LEAST_AREA_RATIO: f32 = 0.15;
/// Share of its depth that a cut column keeps per round.
const CUT: f32 = 0.9;

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
            let along = reach.dot(inward[column]);
            if along > 0.5 * reach.length() {
                let kept = DEPTH_KEPT.map(|part| part * depth_m[column]);
                inward[column] = reach.normalize();
                depth_m[column] = reach.length().clamp(kept[0], kept[1]);
            }
            depth_m[column] = depth_m[column].clamp(least, most);
        }
        for _ in 0..TURN_ROUNDS {
            if !turn_crossing(&outer, columns, &mut inward, &depth_m) {
                break;
            }
        }
        let wanted_m = depth_m.clone();
        for _ in 0..LIMIT_ROUNDS {
            if !cut_folds(&outer, columns, &inward, &mut depth_m, least) {
                break;
            }
        }
        let shortened = depth_m
            .iter()
            .zip(&wanted_m)
            .filter(|(now, wanted)| now < wanted)
            .count();
        Self {
            inward,
            depth_m,
            shortened,
        }
    }
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

/// Columns of the faces whose inner copy is folded or nearly so.
fn folded(outer_m: &[Vec3], columns: &Columns, inward: &[Vec3], depth_m: &[f32]) -> Vec<bool> {
    let mut found = vec![false; depth_m.len()];
    for prism in &columns.prisms {
        let outer = prism.map(|c| outer_m[c as usize]);
        let inner: [Vec3; 3] = std::array::from_fn(|k| {
            outer[k] + inward[prism[k] as usize] * depth_m[prism[k] as usize]
        });
        let normal = area_vector(outer);
        if area_vector(inner).dot(normal) < LEAST_AREA_RATIO * normal.length_squared() {
            for &column in prism {
                found[column as usize] = true;
            }
        }
    }
    found
}

/// Makes the columns around folded faces more parallel; tells whether there was such a face. A large
/// breast keeps its depth this way, where cutting would leave a third of it.
fn turn_crossing(
    outer_m: &[Vec3],
    columns: &Columns,
    inward: &mut [Vec3],
    depth_m: &[f32],
) -> bool {
    let mut turned = folded(outer_m, columns, inward, depth_m);
    if !turned.contains(&true) {
        return false;
    }
    for _ in 0..TURN_RINGS {
        turned = (0..turned.len())
            .map(|c| turned[c] || columns.neighbours[c].iter().any(|&n| turned[n as usize]))
            .collect();
    }
    let mean = smoothed(inward, columns, 0.5);
    for (column, direction) in inward.iter_mut().enumerate() {
        if turned[column] {
            *direction = mean[column].try_normalize().unwrap_or(*direction);
        }
    }
    true
}

/// Shortens the columns of folded faces; tells whether there was one.
fn cut_folds(
    outer_m: &[Vec3],
    columns: &Columns,
    inward: &[Vec3],
    depth_m: &mut [f32],
    least_m: f32,
) -> bool {
    let mut cut = folded(outer_m, columns, inward, depth_m);
    for (cut, depth_m) in cut.iter_mut().zip(&*depth_m) {
        *cut &= *depth_m > least_m;
    }
    let any = cut.contains(&true);
    // The neighbours give way a little too, so that no step is left beside a cut column.
    let limit: Vec<f32> = (0..depth_m.len())
        .map(|c| {
            if cut[c] {
                (depth_m[c] * CUT).max(least_m)
            } else {
                depth_m[c]
            }
        })
        .collect();
    for column in 0..depth_m.len() {
        let beside = columns.neighbours[column]
            .iter()
            .filter(|&&n| cut[n as usize])
            .map(|&n| limit[n as usize] * 1.25)
            .fold(f32::INFINITY, f32::min);
        depth_m[column] = limit[column].min(beside);
    }
    any
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
