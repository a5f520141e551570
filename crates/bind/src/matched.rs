//! The body laid under a skin, and the place of the body that moves each vertex.

use dynaskin_binding::{CLOSE_M, Proportions, RegionOff};
use dynaskin_body::{BodyModel, REGION_COUNT, Region};
use glam::Vec3;

use crate::BindError;
use crate::align::alignment;
use crate::avatar::Avatar;
use crate::basis::Placement;
use crate::bind::BindOptions;
use crate::bones::Bones;
use crate::correspond::{Link, Places};
use crate::drape::draped;
use crate::fit::fit_shape;
use crate::inpaint;
use crate::limbs::{FittedBody, fit_limbs};
use crate::parts::Part;
use crate::proportions::{self, GUARDED_CROWN_TO_SHOULDER, GUARDED_MEDIAN_M};
use crate::samples::Samples;
use crate::skin::Skin;

/// A person in a skin, who has the proportions of an adult.
pub(crate) struct Person {
    pub bones: Bones,
    pub skin: Skin,
    pub proportions: Proportions,
}

/// A person and the body that lies under the skin.
pub(crate) struct Matched {
    pub bones: Bones,
    pub skin: Skin,
    pub proportions: Proportions,
    pub placement: Placement,
    pub fitted: FittedBody,
    /// The fitted body drawn out to the skin, metres, `[vertex]`.
    pub draped_m: Vec<Vec3>,
    /// The place of the body that moves each vertex, `[welded]`.
    pub links: Vec<Option<Link>>,
    /// How far each vertex lies from its place as it was found, metres, `[welded]`; not a number where
    /// it has none.
    pub distances_m: Vec<f32>,
    pub closeness: Closeness,
    pub regions_off: Vec<RegionOff>,
}

/// Refuses what the caller does not declare to be an adult.
///
/// # Errors
/// [`BindError::Undeclared`].
pub(crate) fn declared(options: &BindOptions) -> Result<(), BindError> {
    match options.depicts.as_deref() {
        Some("adult") => Ok(()),
        _ => Err(BindError::Undeclared {
            declared: options.depicts.clone(),
        }),
    }
}

/// Finds the person and measures the proportions.
///
/// # Errors
/// As [`crate::bind`] for what is no adult, or no person in a skin.
pub(crate) fn person(avatar: &Avatar, options: &BindOptions) -> Result<Person, BindError> {
    avatar.check()?;
    let bones = Bones::find(avatar, &options.bones)?;
    let skin = Skin::new(avatar, &bones)?;
    // Vertices without faces are not seen, and may lie anywhere.
    let mut largest: Vec<Option<Part>> = vec![None; skin.len()];
    for corner in skin.faces.iter().flatten() {
        let corner = *corner as usize;
        largest[corner] = skin.parts[corner].largest();
    }
    let proportions = proportions::measured(&bones, &skin.positions_m, &largest);
    proportions::check(&proportions)?;
    Ok(Person {
        bones,
        skin,
        proportions,
    })
}

/// Fits the body under the skin; `progress` is told the fraction that is done.
///
/// # Errors
/// As [`crate::bind`].
pub(crate) fn matched(
    avatar: &Avatar,
    body: &BodyModel,
    options: &BindOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Matched, BindError> {
    declared(options)?;
    if body.region_weights.len() != REGION_COUNT {
        return Err(BindError::Body("it has no soft regions"));
    }
    if body.vertex_count() > usize::from(u16::MAX) {
        return Err(BindError::Body("it has more than 65,535 vertices"));
    }
    let Person {
        bones,
        skin,
        proportions,
    } = person(avatar, options)?;
    progress(0.1);

    let samples = Samples::new(body, &skin);
    let turns = alignment(&bones, &body.joint_template_m);
    let placement = fit_shape(body, &bones, &samples, &turns)?;
    progress(0.3);
    let fitted = fit_limbs(body, &bones, &samples, &placement, turns)?;
    progress(0.45);
    let draped_m = draped(body, &samples, &fitted.positions_m)?;
    progress(0.6);
    let places = Places::new(body, &draped_m, &fitted.positions_m);
    let mut links = places.links(&skin);
    let closeness = Closeness::new(&skin, &places, &links);
    let distance_m = |link: &Option<Link>| link.map_or(f32::NAN, |link| link.distance_m);
    let distances_m = links.iter().map(distance_m).collect();
    progress(0.75);
    inpaint::fill(&skin, &places, &mut links)?;
    progress(0.9);
    let regions_off = regions_off(&proportions, &closeness);
    Ok(Matched {
        bones,
        skin,
        proportions,
        placement,
        fitted,
        draped_m,
        links,
        distances_m,
        closeness,
        regions_off,
    })
}

/// How closely the fitted body lies under the skin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closeness {
    pub share_close: f32,
    pub share_close_bare: f32,
    /// Without the drape.
    pub median_m: f32,
}

impl Closeness {
    fn new(skin: &Skin, places: &Places<'_>, links: &[Option<Link>]) -> Self {
        let found = || {
            links
                .iter()
                .enumerate()
                .filter_map(|(vertex, link)| Some((vertex, (*link)?)))
        };
        let draped_m: Vec<f32> = found().map(|(_, link)| link.distance_m).collect();
        let mut bare_m: Vec<f32> = found()
            .map(|(vertex, link)| places.bare_distance_m(skin.positions_m[vertex], &link.at))
            .collect();
        bare_m.sort_by(f32::total_cmp);
        let share = |distances_m: &[f32]| {
            let close = distances_m
                .iter()
                .filter(|distance_m| **distance_m <= CLOSE_M)
                .count();
            close as f32 / distances_m.len().max(1) as f32
        };
        Self {
            share_close: share(&draped_m),
            share_close_bare: share(&bare_m),
            // Nothing near the body fits it badly.
            median_m: bare_m
                .get(bare_m.len() / 2)
                .copied()
                .unwrap_or(f32::INFINITY),
        }
    }
}

/// Chest and buttocks, where proportions or fit do not show an adult for sure. No option turns them on.
fn regions_off(proportions: &Proportions, closeness: &Closeness) -> Vec<RegionOff> {
    let reason = if proportions::is_guarded(proportions) {
        format!(
            "crown to shoulder is {:.3} of the stature, {GUARDED_CROWN_TO_SHOULDER} and more",
            proportions.crown_to_shoulder
        )
    } else if !matches!(f64::from(closeness.median_m), 0.0..=GUARDED_MEDIAN_M) {
        format!(
            "half of the skin lies {:.0} mm and more from the body",
            1e3 * closeness.median_m
        )
    } else {
        return Vec::new();
    };
    [Region::Chest, Region::Buttocks]
        .map(|region| RegionOff {
            region: region.name().to_owned(),
            reason: reason.clone(),
        })
        .to_vec()
}

/// How much of each body vertex's offset may be taken: none where it never moves, and none of chest and
/// buttocks where these are off.
pub(crate) fn takes(body: &BodyModel, is_guarded: bool) -> Vec<f32> {
    let weight = |region: Region, vertex: usize| body.region_weights[region as usize][vertex];
    (0..body.vertex_count())
        .map(|vertex| {
            let softness = body.softness(vertex);
            if softness <= 0.0 {
                return 0.0;
            }
            if !is_guarded {
                return 1.0;
            }
            let off = weight(Region::Chest, vertex) + weight(Region::Buttocks, vertex);
            (1.0 - off / softness).clamp(0.0, 1.0)
        })
        .collect()
}
