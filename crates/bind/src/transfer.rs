//! Transfers soft regions and tissue thickness from one body to another with the same joints, by surface.

use dynaskin_binding::{Proportions, RegionOff};
use dynaskin_body::{BodyModel, LEAST_THICKNESS_M, REGION_COUNT, SHAPE_COUNT};
use dynaskin_skeleton::Joint;
use glam::DAffine3;

use crate::BindError;
use crate::avatar::{Avatar, Influences, MAX_INFLUENCES, Node, SkinnedMesh};
use crate::bind::BindOptions;
use crate::correspond::Places;
use crate::matched::{declared, matched, person, takes};

/// Regions and thickness of one body on the vertices of another.
#[derive(Clone, Debug)]
pub struct Transfer {
    /// Membership of each soft region, `[region][vertex]`, as in [`BodyModel::region_weights`].
    pub region_weights: Vec<Vec<f32>>,
    /// Soft-tissue thickness in metres, `[vertex]`.
    pub thickness_m: Vec<f32>,
    /// Shape coefficients of the body that fits under the other's surface.
    pub shape: [f32; SHAPE_COUNT],
    /// Size of the other body relative to that one.
    pub size: f32,
    /// Share of the surface within 2 cm of the fitted body.
    pub share_close: f32,
    /// Median distance from the fitted body, metres.
    pub median_m: f32,
    /// The other's proportions.
    pub proportions: Proportions,
    /// Regions that do not move, because proportions or fit do not clearly show an adult.
    pub regions_off: Vec<RegionOff>,
}

/// Transfers regions and thickness of `source` to `target`, in the way in which tissue is bound to an avatar.
///
/// # Errors
/// As [`crate::bind`], also for a `target` that is not declared or not proportioned as an adult.
pub fn transfer(
    target: &BodyModel,
    source: &BodyModel,
    options: &BindOptions,
) -> Result<Transfer, BindError> {
    let matched = matched(&avatar_of(target), source, options, &mut |_| {})?;
    let places = Places::new(source, &matched.draped_m, &matched.fitted.positions_m);
    let shape = matched.placement.shape.map(|beta| beta as f32);
    let size = matched.placement.size as f32;
    let source_thickness_m = source.shaped(&shape).thickness_m;
    let takes = takes(source, !matched.regions_off.is_empty());
    let source_weights: Vec<Vec<f32>> = source
        .region_weights
        .iter()
        .map(|region| {
            region
                .iter()
                .zip(&takes)
                .map(|(w, take)| w * take)
                .collect()
        })
        .collect();
    let mut region_weights = vec![vec![0.0; target.vertex_count()]; REGION_COUNT];
    let mut thickness_m = vec![LEAST_THICKNESS_M; target.vertex_count()];
    for (vertex, welded) in matched.skin.welded.iter().enumerate() {
        let welded = *welded as usize;
        let link = matched.links[welded];
        if let Some(link) = link {
            for (target, source) in region_weights.iter_mut().zip(&source_weights) {
                target[vertex] = link.strength * link.at.mix(source);
            }
        }
        // Head, hands and feet have a thickness as well, though they stay still.
        let at = link.map(|link| link.at).or_else(|| {
            let position_m = matched.skin.positions_m[welded];
            places.closest(position_m, &matched.skin.parts[welded], None)
        });
        if let Some(at) = at
            && !source_thickness_m.is_empty()
        {
            thickness_m[vertex] = (size * at.mix(&source_thickness_m)).max(LEAST_THICKNESS_M);
        }
    }
    Ok(Transfer {
        region_weights,
        thickness_m,
        shape,
        size,
        share_close: matched.closeness.share_close_bare,
        median_m: matched.closeness.median_m,
        proportions: matched.proportions,
        regions_off: matched.regions_off,
    })
}

/// Checks that a body is declared and proportioned as an adult, as for an avatar.
///
/// # Errors
/// As [`crate::bind`] for an avatar.
pub fn check_adult(body: &BodyModel, options: &BindOptions) -> Result<Proportions, BindError> {
    declared(options)?;
    Ok(person(&avatar_of(body), options)?.proportions)
}

/// A body at rest as an avatar whose bones are the joints themselves.
fn avatar_of(body: &BodyModel) -> Avatar {
    let rest =
        |joint: Joint| DAffine3::from_translation(body.joint_template_m[joint as usize].as_dvec3());
    let node = |joint: Joint| Node {
        name: joint.name().to_owned(),
        part_name: joint.name().to_owned(),
        parent: joint.parent().map(|parent| parent as usize),
        world_from_node: rest(joint),
    };
    let influences = body.skin.iter().map(|skin| {
        let mut influences = Influences {
            joints: [0; MAX_INFLUENCES],
            weights: [0.0; MAX_INFLUENCES],
        };
        for (slot, (joint, weight)) in skin.joints.iter().zip(skin.weights).enumerate() {
            influences.joints[slot] = u16::from(*joint);
            influences.weights[slot] = weight;
        }
        influences
    });
    Avatar {
        nodes: Joint::ALL.map(node).to_vec(),
        meshes: vec![SkinnedMesh {
            name: body.name.clone(),
            material: String::new(),
            positions: body.template_m.clone(),
            influences: influences.collect(),
            faces: body.faces.clone(),
            joints: (0..Joint::ALL.len()).collect(),
            inverse_binds: Joint::ALL.map(|joint| rest(joint).inverse()).to_vec(),
        }],
    }
}
