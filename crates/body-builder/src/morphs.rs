//! Adult bodies from macro parameters: which targets, with which weights.
//!
//! A target's weight is the product of its parts' weights (`macrodetails/macro.json`).

use std::collections::HashMap;

use glam::Vec3;

use crate::error::BuildError;
use crate::source::{Source, Target};
use dynaskin_body::Sex;

/// Macro parameters of one adult body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Macro {
    /// 0.5 (25 years) to 1 (old).
    pub age: f32,
    /// 0..=1, as are the following.
    pub muscle: f32,
    pub weight: f32,
    pub height: f32,
    pub proportions: f32,
    /// Cup size and firmness, female only.
    pub cup: f32,
    pub firmness: f32,
    /// African, Asian, Caucasian: non-negative, summing to 1.
    pub race: [f32; 3],
}

impl Macro {
    /// A 25-year-old of average build.
    pub(super) const AVERAGE: Self = Self {
        age: 0.5,
        muscle: 0.5,
        weight: 0.5,
        height: 0.53,
        proportions: 0.5,
        cup: 0.5,
        firmness: 0.5,
        race: [1.0 / 3.0; 3],
    };
}

/// Loaded targets and the base they act on.
pub(super) struct Morphs {
    base_m: Vec<Vec3>,
    sex: Sex,
    targets: HashMap<String, Option<Target>>,
}

impl Morphs {
    pub(super) fn new(base_m: Vec<Vec3>, sex: Sex) -> Self {
        Self {
            base_m,
            sex,
            targets: HashMap::new(),
        }
    }

    /// All base-mesh vertices of the body with these parameters, in metres.
    pub(super) fn vertices(
        &mut self,
        source: &Source,
        body: &Macro,
    ) -> Result<Vec<Vec3>, BuildError> {
        let mut vertices = self.base_m.clone();
        for (name, weight) in self.weights(body) {
            if weight < 1e-5 {
                continue;
            }
            if !self.targets.contains_key(&name) {
                self.targets.insert(name.clone(), source.target(&name)?);
            }
            if let Some(Some(target)) = self.targets.get(&name) {
                for &(vertex, delta_m) in target {
                    vertices[vertex] += weight * delta_m;
                }
            }
        }
        Ok(vertices)
    }

    fn weights(&self, body: &Macro) -> Vec<(String, f32)> {
        let sex = self.sex.name();
        let old = 2.0 * (body.age - 0.5);
        let muscle = low_mid_high("muscle", body.muscle);
        let weight = low_mid_high("weight", body.weight);
        let cup = low_mid_high("cup", body.cup);
        let firmness = low_mid_high("firmness", body.firmness);
        let ends = |x: f32| [(1.0 - 2.0 * x).max(0.0), (2.0 * x - 1.0).max(0.0)];
        let [short, tall] = ends(body.height);
        let [uncommon, ideal] = ends(body.proportions);
        let mut weights = Vec::new();
        for (age, by_age) in [("young", 1.0 - old), ("old", old)] {
            for (race, share) in ["african", "asian", "caucasian"].iter().zip(body.race) {
                weights.push((format!("macrodetails/{race}-{sex}-{age}"), by_age * share));
            }
            for (muscle, by_muscle) in &muscle {
                for (weight, by_weight) in &weight {
                    let build = format!("{sex}-{age}-{muscle}-{weight}");
                    let share = by_age * by_muscle * by_weight;
                    weights.push((format!("macrodetails/universal-{build}"), share));
                    for (end, by_end) in [("minheight", short), ("maxheight", tall)] {
                        let name = format!("macrodetails/height/{build}-{end}");
                        weights.push((name, share * by_end));
                    }
                    for (end, by_end) in [
                        ("uncommonproportions", uncommon),
                        ("idealproportions", ideal),
                    ] {
                        let name = format!("macrodetails/proportions/{build}-{end}");
                        weights.push((name, share * by_end));
                    }
                    if self.sex == Sex::Female {
                        for (cup, by_cup) in &cup {
                            for (firmness, by_firmness) in &firmness {
                                let name = format!("breast/{build}-{cup}-{firmness}");
                                weights.push((name, share * by_cup * by_firmness));
                            }
                        }
                    }
                }
            }
        }
        weights
    }
}

fn low_mid_high(what: &str, x: f32) -> [(String, f32); 3] {
    [
        (format!("min{what}"), (1.0 - 2.0 * x).max(0.0)),
        (format!("average{what}"), 1.0 - (2.0 * x - 1.0).abs()),
        (format!("max{what}"), (2.0 * x - 1.0).max(0.0)),
    ]
}
