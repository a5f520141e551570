//! What a bundle tells of its training.

use std::collections::BTreeSet;

use dynaskin_evaluate::{Method, TrainingFacts};
use dynaskin_train::{DataSet, Networks, Set, Split, Tissue};

/// What a bundle tells of its training; the last three are of the run.
pub fn facts(
    data_set: &DataSet,
    networks: &Networks,
    split: Split,
    (method, seed, minutes): (Method, u64, f64),
) -> TrainingFacts {
    let tissue = Tissue::known_to(networks.feature_kind);
    let training = || data_set.of_set(Set::Training, tissue);
    let captured = training()
        .filter(|clip| clip.name.subject.is_some())
        .count();
    let varied = training().filter(|clip| !clip.usual_tissue).count();
    let shapes: BTreeSet<&str> = training().map(|clip| clip.name.shape.as_str()).collect();
    let kinds: BTreeSet<&str> = training()
        .filter(|clip| clip.name.subject.is_none())
        .map(|clip| clip.name.trial.as_str())
        .collect();
    let longest = training().map(|clip| clip.frames).max().unwrap_or(0) as f64 / 60.0;
    let kinds = Vec::from_iter(kinds).join(", ");
    let simulator = simulator(&data_set.sim_json);
    let data = if data_set.is_simulated() {
        let cmu = format!("{captured} clips of CMU motion captures (mocap.cs.cmu.edu)");
        let clips = match (captured, kinds.is_empty()) {
            (_, true) => cmu,
            // Named by the user: where they come from is not told.
            (0, false) => format!("{} clips ({kinds})", training().count()),
            (_, false) => format!(
                "{cmu} and {} clips of motions made by formula ({kinds})",
                training().count() - captured
            ),
        };
        let varied = match varied {
            0 => String::new(),
            varied => format!("; {varied} of them with tissue of other stiffness and damping"),
        };
        format!(
            "Soft tissue simulated by `dynaskin simulate` on {} body shapes: {clips}, each at most \
             {longest:.1} seconds{varied}.",
            shapes.len()
        )
    } else {
        format!(
            "Soft tissue of captures, fitted by `dynaskin fit`: {} clips of {} people ({kinds}), each at \
             most {longest:.1} seconds.",
            training().count(),
            shapes.len()
        )
    };
    TrainingFacts {
        method,
        networks: networks.description.clone(),
        data,
        seed,
        clips: training().count(),
        frames: training().map(|clip| clip.frames).sum(),
        validation_frames: data_set
            .of_set(Set::Validation, tissue)
            .map(|clip| clip.frames)
            .sum(),
        vertices: data_set.vertices.len(),
        parameters: networks.parameters,
        best_epoch: networks.best_epoch,
        minutes,
        config: networks.config.clone(),
        split,
        simulator,
    }
}

/// What all clips of a data set share of how they were simulated: not shape, materials and rig.
fn simulator(sim_json: &str) -> serde_json::Value {
    let mut simulator: serde_json::Value = serde_json::from_str(sim_json).unwrap_or_default();
    if let Some(fields) = simulator.as_object_mut() {
        for of_clip in ["shape", "materials", "rig"] {
            fields.remove(of_clip);
        }
    }
    simulator
}
