//! Rows: for each vertex of an avatar that moves, the vertices of the body whose offsets it takes.

use crate::correspond::Link;
use crate::skin::Skin;

/// Vertices of the body that a row names, at most.
pub const ROW_ENTRIES: usize = 8;
/// Rounds in which rows mix with those around them.
const SMOOTHING_ROUNDS: usize = 3;
/// How much of a row its neighbours make in a round, at most.
const SMOOTHING: f32 = 0.5;
/// Nearer than this to the body a row stays as it is, farther than that it mixes most, metres.
const SMOOTHED_M: (f32, f32) = (0.005, 0.03);
/// Sure rows mix over this distance and no farther, however long edges are, metres.
const REACH_M: f32 = 0.015;
/// Weights below this are none: the step in which they are stored.
pub const WEIGHT_STEP: f32 = 1.0 / 255.0;

/// A row: vertices of the body, ascending, and their weights, which sum to at most 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row(pub Vec<(u16, f32)>);

impl Row {
    fn of_link(link: &Link) -> Self {
        let corners = link.at.corners.into_iter().zip(link.at.shares);
        let entries = corners.filter(|(_, share)| *share > 0.0);
        let mut row = Self(
            entries
                .map(|(corner, share)| (corner as u16, share))
                .collect(),
        );
        row.0.sort_by_key(|(vertex, _)| *vertex);
        row
    }

    /// Adds `share` of another row.
    fn add(&mut self, other: &Self, share: f32) {
        for (vertex, weight) in &other.0 {
            match self.0.binary_search_by_key(vertex, |(own, _)| *own) {
                Ok(at) => self.0[at].1 += share * weight,
                Err(at) => self.0.insert(at, (*vertex, share * weight)),
            }
        }
    }

    /// Keeps the largest entries, with the sum as it was.
    fn cut(&mut self, most: usize) {
        if self.0.len() <= most {
            return;
        }
        let sum = |row: &Self| -> f32 { row.0.iter().map(|(_, weight)| weight).sum() };
        let before = sum(self);
        self.0.sort_by(|a, b| b.1.total_cmp(&a.1));
        self.0.truncate(most);
        let scale = before / sum(self).max(f32::MIN_POSITIVE);
        self.0.iter_mut().for_each(|(_, weight)| *weight *= scale);
        self.0.sort_by_key(|(vertex, _)| *vertex);
    }
}

/// The rows of all welded vertices; empty for those that stay still.
///
/// `takes`: how much of each body vertex's offset may be taken at all, 0 where it never moves.
pub fn rows(skin: &Skin, links: &[Option<Link>], takes: &[f32]) -> Vec<Row> {
    let mut rows: Vec<Row> = links
        .iter()
        .map(|link| link.as_ref().map(Row::of_link).unwrap_or_default())
        .collect();
    for _ in 0..SMOOTHING_ROUNDS {
        rows = smoothed(skin, links, &rows);
    }
    for (row, link) in rows.iter_mut().zip(links) {
        row.cut(ROW_ENTRIES);
        let strength = link.map_or(0.0, |link| link.strength);
        for (vertex, weight) in &mut row.0 {
            *weight *= strength * takes[usize::from(*vertex)];
        }
        row.0.retain(|(_, weight)| *weight >= 0.5 * WEIGHT_STEP);
    }
    rows
}

fn smoothed(skin: &Skin, links: &[Option<Link>], rows: &[Row]) -> Vec<Row> {
    let mixed = |vertex: usize| {
        let own = &rows[vertex];
        let Some(link) = &links[vertex] else {
            return own.clone();
        };
        let around = skin.beside(vertex).iter().map(|other| *other as usize);
        let around: Vec<usize> = around.filter(|other| links[*other].is_some()).collect();
        let near = (link.distance_m - SMOOTHED_M.0) / (SMOOTHED_M.1 - SMOOTHED_M.0);
        let edges_m = around
            .iter()
            .map(|other| skin.positions_m[vertex].distance(skin.positions_m[*other]));
        let edge_m = edges_m.sum::<f32>() / around.len().max(1) as f32;
        let reach = (REACH_M / edge_m.max(f32::MIN_POSITIVE)).powi(2).min(1.0);
        let share = SMOOTHING
            * if link.is_sure {
                near.clamp(0.0, 1.0) * reach
            } else {
                1.0
            };
        if share <= 0.0 || around.is_empty() {
            return own.clone();
        }
        let mut row = Row(own.0.iter().map(|(v, w)| (*v, w * (1.0 - share))).collect());
        for other in &around {
            row.add(&rows[*other], share / around.len() as f32);
        }
        row.cut(2 * ROW_ENTRIES);
        row
    };
    (0..rows.len()).map(mixed).collect()
}
