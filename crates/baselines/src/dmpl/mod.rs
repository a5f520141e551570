//! Dyna / DMPL: principal components and a linear second-order auto-regression.
//!
//! `δ_t = A δ_{t-1} + B δ_{t-2} + C φ_t` (Pons-Moll et al. 2015, Eq. 11; Loper et al. 2015, section
//! 6), with the project's inertial features and β for the control vector φ: those are the
//! velocities and accelerations of joints and root, seen from the joints. A, B and C are fitted by
//! ridge regression on true coefficients, one step at a time, and then made stable: see
//! [`regression`].

mod export;
mod regression;

use dynaskin_body::SHAPE_COUNT;
use dynaskin_runtime::features::FeatureKind;
use serde::{Deserialize, Serialize};
use serde_json::json;

use dynaskin_train::{
    Basis, Draw, Mirror, Networks, Normaliser, Set, Tissue, TrainError, TrainingInput, features_of,
    mirrored_latents, motion_of, offsets_of, sample_offsets,
};
use regression::{Regression, Series, Sums};

const KIND: FeatureKind = FeatureKind::Inertial;

/// Settings of the auto-regression.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DmplConfig {
    /// Seed of the frames that the principal components are fitted to.
    pub seed: u64,
    /// Principal components.
    pub components: usize,
    /// Frames that they are fitted to, drawn from the training set.
    pub pca_frames: usize,
    /// Ridges tried, in units of the inputs' mean square; the one whose roll-out over the
    /// validation set errs least is kept.
    pub ridges: Vec<f64>,
    /// Largest spectral radius of the auto-regression, per tick.
    pub spectral_radius: f64,
    /// Whether the mirror image of every training clip is learned from as well.
    pub mirror: bool,
}

impl Default for DmplConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            components: 100,
            pca_frames: 2400,
            ridges: vec![1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1],
            spectral_radius: 0.99,
            mirror: true,
        }
    }
}

impl DmplConfig {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`TrainError::Config`], naming the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let wrong = |setting, got: String, expected: &str| {
            Err(TrainError::Config {
                setting,
                got,
                expected: expected.to_owned(),
            })
        };
        if !(1..=1024).contains(&self.components) {
            return wrong("components", self.components.to_string(), "1 to 1024");
        }
        if !(1..=50_000).contains(&self.pca_frames) {
            return wrong("pca_frames", self.pca_frames.to_string(), "1 to 50000");
        }
        if self.ridges.is_empty() || !self.ridges.iter().all(|r| *r > 0.0 && r.is_finite()) {
            let got = format!("{:?}", self.ridges);
            return wrong("ridges", got, "one or more numbers above 0");
        }
        if !(self.spectral_radius > 0.0 && self.spectral_radius < 1.0) {
            let got = self.spectral_radius.to_string();
            return wrong("spectral_radius", got, "above 0 and below 1");
        }
        Ok(())
    }
}

/// Fits components and auto-regression on the clips of the usual tissue. `progress` is told the
/// number of clips read so far and in all.
///
/// # Errors
/// [`TrainError::Config`], [`TrainError::EmptySplit`], [`TrainError::NotFinite`] where no ridge
/// gives a regression that stays finite, and what reading a clip can give.
pub fn train_dmpl(
    input: TrainingInput<'_>,
    config: &DmplConfig,
    mut progress: impl FnMut(usize, usize),
) -> Result<Networks, TrainError> {
    config.check()?;
    input.require(&[Set::Training, Set::Validation], KIND)?;
    let data_set = input.data_set;
    let tissue = Tissue::known_to(KIND);
    let training = data_set.of_set(Set::Training, tissue).count();
    let all = 2 * training + data_set.of_set(Set::Validation, tissue).count();
    let mirror = match config.mirror {
        true => Some(Mirror::of_body(input.body, &data_set.vertices)?),
        false => None,
    };
    let draw = Draw {
        tissue,
        frames: config.pca_frames,
        seed: config.seed,
    };
    let sample = sample_offsets(data_set, draw, mirror.as_ref(), |done| progress(done, all))?;
    let basis = Basis::fit(&sample, config.components, config.seed)?;
    drop(sample);

    let induced = mirror
        .as_ref()
        .map(|mirror| basis.induced(|from, to| mirror.apply(from, to)));
    let (mut learned, mut held_back) = (Vec::new(), Vec::new());
    let mut done = training;
    for set in [Set::Training, Set::Validation] {
        for entry in data_set.of_set(set, tissue) {
            let clip = data_set.read(entry)?;
            let motion = motion_of(&clip);
            let latents = basis.project(&offsets_of(&clip));
            let to = match set {
                Set::Training => &mut learned,
                _ => &mut held_back,
            };
            if let (Some(induced), Set::Training) = (&induced, set) {
                to.push((
                    features_of(KIND, input.body, &motion.mirrored(), &clip)?,
                    mirrored_latents(induced, basis.components(), &latents),
                ));
            }
            to.push((features_of(KIND, input.body, &motion, &clip)?, latents));
            done += 1;
            progress(done, all);
        }
    }
    let normaliser = Normaliser::fit(
        KIND,
        &input.body.shaped(&[0.0; SHAPE_COUNT]),
        learned.iter().map(|(features, _)| features.as_slice()),
    );
    let series = |raw: Vec<(Vec<f32>, Vec<f32>)>| -> Vec<Series> {
        let standardised = raw.into_iter().map(|(features, latents)| {
            Series::new(&normaliser, &features, &latents, &basis.deviation_m)
        });
        standardised.collect()
    };
    let (learned, held_back) = (series(learned), series(held_back));
    let sums = Sums::of(&learned);
    let mut best: Option<(Regression, f64, f64)> = None;
    for ridge in &config.ridges {
        let Some(regression) = sums.solve(*ridge, config.spectral_radius) else {
            continue;
        };
        let ratio = regression.roll_out_ratio(&held_back, &basis.deviation_m);
        if ratio.is_finite() && best.as_ref().is_none_or(|(_, least, _)| ratio < *least) {
            best = Some((regression, ratio, *ridge));
        }
    }
    let Some((regression, ratio, ridge)) = best else {
        return Err(TrainError::NotFinite {
            place: "every regression, whatever its ridge,".into(),
        });
    };
    let (components, inputs) = (basis.components(), KIND.count());
    Ok(Networks {
        feature_kind: KIND,
        predictor_onnx: export::predictor_onnx(&regression, &normaliser, &basis.deviation_m)?,
        decoder_onnx: export::decoder_onnx(&basis)?,
        latent_count: components,
        parameters: components * (2 * components + inputs) + components * basis.coordinates(),
        description: format!(
            "{components} principal components about zero and a linear second-order auto-regression \
             on inertial features and shape (Dyna, DMPL). Ridge regression, one step at a time; both \
             matrices of the auto-regression scaled so that its spectral radius is at most {}; the \
             ridge whose roll-out over the validation set errs least.",
            config.spectral_radius
        ),
        config: json!({
            "settings": config,
            "ridge": ridge,
            "fitted_spectral_radius": regression.fitted_radius,
            "pole_scale": regression.pole_scale,
            "validation_ratio": ratio,
        }),
        best_epoch: 1,
    })
}
