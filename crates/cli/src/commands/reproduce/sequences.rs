//! Table 1 of DSNet: people, motions, rates and sequences.

use std::collections::BTreeSet;

use dynaskin_report::{Report, Table};
use dynaskin_train::{ClipEntry, DataSet, Set};

use super::differences;

/// The page.
pub fn page(data_set: &DataSet) -> Report {
    let mut report = Report::new("Table 1 of DSNet (2021): the data");
    report.paragraph(&format!(
        "What the paper learned from (Dyna) and validated on (MoSh), and the clips of {}. All clips here are at \
         60 Hz: captures at other rates are resampled, and worlds with z up are turned, as the paper does \
         with MoSh's 100 frames a second.",
        data_set.dir.display()
    ));
    let mut table = Table::new([
        "data",
        "used for",
        "people",
        "motions",
        "frames a second",
        "sequences",
    ]);
    for row in [
        [
            "Dyna",
            "training",
            "5 men, 5 women",
            "10 to 14 a person",
            "60",
            "66 of men, 67 of women",
        ],
        [
            "MoSh",
            "validation",
            "the same",
            "not told; some that Dyna has not",
            "100",
            "24 of men, 30 of women",
        ],
    ] {
        table.row(row.map(str::to_owned).to_vec());
    }
    let sets = [Set::Training, Set::Validation]
        .into_iter()
        .chain(Set::TEST);
    for set in sets {
        let clips = || data_set.clips.iter().filter(move |clip| clip.set == set);
        if clips().next().is_none() {
            continue;
        }
        let count = |of: fn(&ClipEntry) -> &str| clips().map(of).collect::<BTreeSet<_>>().len();
        let frames: usize = clips().map(|clip| clip.frames).sum();
        table.row(vec![
            "here".to_owned(),
            set.name().to_owned(),
            count(|clip| &clip.name.shape).to_string(),
            count(|clip| &clip.name.trial).to_string(),
            "60".to_owned(),
            format!(
                "{} ({:.1} minutes)",
                clips().count(),
                frames as f64 / 3600.0
            ),
        ]);
    }
    report.table(&table);
    let simulated = data_set.is_simulated();
    let captured = data_set
        .clips
        .iter()
        .any(|clip| clip.name.subject.is_some());
    differences(
        &mut report,
        &[
            [
                "people",
                "bodies of captured people, by sex",
                match simulated {
                    true => {
                        "shapes of one body that is in the public domain; a shape counts as a person"
                    }
                    false => "captured people, each with one fitted shape",
                },
            ],
            [
                "tissue",
                "left over from 4D scans after a SMPL fit",
                match (simulated, captured) {
                    (true, true) => {
                        "simulated under motion captures (CMU) and motions made by formula"
                    }
                    (true, false) => "simulated",
                    (false, _) => "left over from captures after a fit of the body",
                },
            ],
        ],
    );
    report
}
