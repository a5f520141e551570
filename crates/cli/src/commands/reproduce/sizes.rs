//! How many weights the papers' networks have: as published, with this project's usual sizes, and of models.

use dynaskin_baselines::dsnet::decoder_parameter_count;
use dynaskin_baselines::dsnet::{AutoencoderSizes, DsnetConfig, DsnetPredictor, parameter_count};
use dynaskin_baselines::{AutoencoderConfig, AutoencoderWidths};
use dynaskin_evaluate::Method;
use dynaskin_report::{Report, Table};
use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::Compute;
use serde_json::Value;

use super::Shown;
use crate::commands::evaluate::subject::thousands;

/// Vertices of the papers' body.
const PAPER_VERTICES: usize = 6890;
/// What the papers count.
const DSNET_AUTOENCODER: u64 = 33_626_606;
const CASAS_AUTOENCODER: u64 = 284_678_770;

/// Adds the section.
pub fn section(report: &mut Report, shown: &[Shown]) -> anyhow::Result<()> {
    report.section("Weights");
    let vertices = shown
        .first()
        .map_or(PAPER_VERTICES, |one| one.bundle.vertices.len());
    let counted = match shown.is_empty() {
        true => "as many, because no model says which vertices move".to_owned(),
        false => format!("the {vertices} vertices that move"),
    };
    report.paragraph(&format!(
        "Weights and biases. The second column counts networks of the published sizes over {PAPER_VERTICES} \
         vertices, the third those of the usual sizes here over {counted}. Neither \
         paper counts its predictor. DSNet tells its autoencoder's layers, but neither channels nor kernels nor \
         strides: ours are the round numbers that come nearest. Casas & Otaduy's regressor gives offsets of \
         vertices in the paper and latents here."
    ));
    let mut table = Table::new([
        "network",
        "the paper's count",
        "published sizes",
        "usual sizes here",
    ]);
    table.head.extend(shown.iter().map(|one| one.label.clone()));
    let usual = DsnetConfig::default().autoencoder;
    let mut row = |network: &str, counts: [Option<u64>; 3], of: &dyn Fn(&Shown) -> Option<u64>| {
        let cell = |count: Option<u64>| count.map_or_else(String::new, thousands);
        let models = shown.iter().map(of);
        let cells = counts.into_iter().chain(models).map(cell);
        table.row(std::iter::once(network.to_owned()).chain(cells).collect());
    };
    let dsnet = |sizes: &AutoencoderSizes, vertices| Some(parameter_count(sizes, vertices) as u64);
    row(
        "DSNet, autoencoder",
        [
            Some(DSNET_AUTOENCODER),
            dsnet(&AutoencoderSizes::PUBLISHED, PAPER_VERTICES),
            dsnet(&usual, vertices),
        ],
        &|one| dsnet(&sizes_of(one)?, one.bundle.vertices.len()),
    );
    let predictor = predictor_count()?;
    row(
        "DSNet, predictor",
        [None, Some(predictor), Some(predictor)],
        &|one| {
            let decoder = decoder_parameter_count(&sizes_of(one)?, one.bundle.vertices.len());
            trained(one)?.checked_sub(decoder as u64)
        },
    );
    let casas =
        |widths: &AutoencoderWidths, vertices: usize| Some(widths.parameters(3 * vertices) as u64);
    row(
        "Casas & Otaduy, autoencoder",
        [
            Some(CASAS_AUTOENCODER),
            casas(&AutoencoderWidths::PUBLISHED, PAPER_VERTICES),
            casas(&AutoencoderConfig::default().widths, vertices),
        ],
        &|one| casas(&widths_of(one)?, one.bundle.vertices.len()),
    );
    let published = Some(casas_regressor());
    row(
        "Casas & Otaduy, regressor",
        [None, published, None],
        &|one| {
            let autoencoder = casas(&widths_of(one)?, one.bundle.vertices.len())?;
            trained(one)?.checked_sub(autoencoder)
        },
    );
    if !shown.is_empty() {
        row("as the bundle counts", [None; 3], &trained);
    }
    report.table(&table);
    Ok(())
}

/// Weights of the regressor of the sizes that the paper tells: its 2,689 neurons are the root of the inputs times
/// the coordinates of all vertices.
fn casas_regressor() -> u64 {
    let [inputs, outputs] = [350, 3 * PAPER_VERTICES];
    let hidden = (inputs * outputs).isqrt();
    ((inputs + 1) * hidden + (hidden + 1) * outputs) as u64
}

/// Weights of DSNet's predictor, whose sizes are the published ones here, too.
fn predictor_count() -> anyhow::Result<u64> {
    let device = Compute::Cpu.device()?;
    let inputs = FeatureKind::PoseShape.count();
    let predictor = DsnetPredictor::new(&DsnetConfig::default(), inputs, None, &device);
    Ok(predictor.weight_count() as u64)
}

fn trained(one: &Shown) -> Option<u64> {
    one.bundle.training.get("parameters")?.as_u64()
}

/// A part of the settings that a bundle of one of these methods was trained with.
fn setting(one: &Shown, methods: [Method; 2], path: &str) -> Option<Value> {
    one.method.filter(|method| methods.contains(method))?;
    one.bundle.training.get("config")?.pointer(path).cloned()
}

fn sizes_of(one: &Shown) -> Option<AutoencoderSizes> {
    let sizes = setting(one, [Method::Dsnet, Method::DsnetRbf], "/autoencoder")?;
    serde_json::from_value(sizes).ok()
}

fn widths_of(one: &Shown) -> Option<AutoencoderWidths> {
    let methods = [Method::CasasOtaduy, Method::CasasOtaduyUnweighted];
    let widths = setting(one, methods, "/autoencoder/widths")?;
    serde_json::from_value(widths).ok()
}
