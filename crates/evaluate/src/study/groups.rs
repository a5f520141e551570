//! The vertices that errors are averaged over, and the regions whose movement is followed.

use dynaskin_body::{BodyModel, Region};

use crate::report::{distance, region_slots, soft_slots};

/// Index of the soft vertices among [`group_names`].
pub(super) const SOFT: usize = 1;

/// A set of vertices of a data set's list.
#[derive(Clone, Debug)]
struct Group {
    slots: Vec<usize>,
    /// Vertices that the sum of errors is divided by.
    vertices: usize,
}

/// Whole body, soft body and regions.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    groups: Vec<Group>,
}

/// Names of the groups that errors are given for: the whole body (vertices without soft tissue
/// count as errors of 0), the soft vertices, and the regions.
pub fn group_names() -> Vec<&'static str> {
    let regions = Region::ALL.map(Region::name);
    ["whole body", "all soft"]
        .into_iter()
        .chain(regions)
        .collect()
}

impl Groups {
    /// Of the vertex list `vertices`.
    pub fn new(model: &BodyModel, vertices: &[u32]) -> Self {
        let part = |slots: Vec<usize>| Group {
            vertices: slots.len(),
            slots,
        };
        let mut groups = vec![
            Group {
                slots: (0..vertices.len()).collect(),
                vertices: model.vertex_count(),
            },
            part(soft_slots(model, vertices)),
        ];
        groups.extend(Region::ALL.map(|region| part(region_slots(model, vertices, region))));
        Self { groups }
    }

    /// Whether a group has any vertices, on this body and in this list.
    pub fn has_vertices(&self, group: usize) -> bool {
        !self.groups[group].slots.is_empty()
    }

    /// Mean distances of one frame of offsets (`[slot][xyz]` in metres) from another, in
    /// millimetres, one a group; NaN for a group without vertices.
    pub fn errors_mm(&self, truth_m: &[f32], predicted_m: &[f32]) -> Vec<f32> {
        let at = |field: &[f32], slot: usize| {
            std::array::from_fn(|axis| f64::from(field[3 * slot + axis]))
        };
        let per_slot: Vec<f64> = (0..truth_m.len() / 3)
            .map(|slot| distance(at(truth_m, slot), at(predicted_m, slot)))
            .collect();
        let mean = |group: &Group| {
            let sum: f64 = group.slots.iter().map(|slot| per_slot[*slot]).sum();
            match group.slots.is_empty() {
                true => f32::NAN,
                false => (1000.0 * sum / group.vertices as f64) as f32,
            }
        };
        self.groups.iter().map(mean).collect()
    }
}

/// Names of the signals of [`Movers`].
pub fn signal_names() -> Vec<String> {
    Region::ALL
        .into_iter()
        .flat_map(|region| match region {
            Region::Belly => vec![region.name().to_owned()],
            _ => vec![
                format!("left {}", region.name()),
                format!("right {}", region.name()),
            ],
        })
        .collect()
}

/// The regions, those on both sides once for each: their mean offsets are the signals whose spectra
/// and delays are measured. The mean over both sides together would not show what they do against
/// each other.
#[derive(Clone, Debug)]
pub(super) struct Movers {
    slots: Vec<Vec<usize>>,
}

impl Movers {
    /// Of the vertex list `vertices`.
    pub fn new(model: &BodyModel, vertices: &[u32]) -> Self {
        let mut slots = Vec::new();
        for region in Region::ALL {
            let all = region_slots(model, vertices, region);
            if region == Region::Belly {
                slots.push(all);
                continue;
            }
            for side in [1.0, -1.0] {
                let x = |slot: &usize| model.template_m[vertices[*slot] as usize].x;
                slots.push(all.iter().copied().filter(|s| side * x(s) > 0.0).collect());
            }
        }
        Self { slots }
    }

    /// Number of signals.
    pub fn count(&self) -> usize {
        self.slots.len()
    }

    /// Mean offset of each mover in each frame, `[mover][axis][frame]`, in millimetres.
    pub fn signals_mm(&self, offsets_m: &[f32], coordinates: usize) -> Vec<[Vec<f64>; 3]> {
        let frames = offsets_m.len() / coordinates.max(1);
        self.slots
            .iter()
            .map(|slots| {
                std::array::from_fn(|axis| {
                    (0..frames)
                        .map(|frame| {
                            let start = frame * coordinates + axis;
                            let values = slots.iter().map(|s| offsets_m[start + 3 * s]);
                            1000.0 * super::contestant::mean(values.map(f64::from))
                        })
                        .collect()
                })
            })
            .collect()
    }
}
