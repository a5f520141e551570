//! Mean errors of groups of held-out clips, such as all clips of one body or of one motion.

use dynaskin_evaluate::study::ClipErrors;
use dynaskin_report::{Report, Table};

use super::page::Methods;
use super::tables::Csv;

/// Clips that are judged together.
pub struct Group<'a> {
    /// Words at the head of its row, as many as the table has names for them.
    pub head: Vec<String>,
    /// Its clips.
    pub clips: Vec<&'a ClipErrors>,
}

impl Group<'_> {
    fn frames(&self) -> usize {
        self.clips.iter().map(|clip| clip.frames).sum()
    }

    /// Mean error of a method over the soft vertices and all frames, in millimetres.
    fn soft_mm(&self, method: usize) -> f64 {
        let sums = self.clips.iter();
        let sums = sums.map(|clip| clip.frames as f64 * clip.soft_mm[method]);
        sums.sum::<f64>() / self.frames().max(1) as f64
    }
}

/// Adds a table with a row for each group and a column for each method, and gives the same numbers as
/// CSV, a row for each group and method.
pub fn groups_table(
    report: &mut Report,
    methods: &Methods,
    head: &[&str],
    groups: &[Group<'_>],
) -> Csv {
    let mut table = Table::new([]);
    let heads = head.iter().copied().chain(["clips"]);
    let heads = heads.chain(methods.labels());
    table.head.extend(heads.map(str::to_owned));
    let columns = head.iter().copied();
    let columns = columns.chain(["method", "frames", "soft_mm", "over_static"]);
    let mut csv = Csv::new(&columns.collect::<Vec<_>>());
    for group in groups {
        let still_mm = group.soft_mm(0);
        let mut row = group.head.clone();
        row.push(group.clips.len().to_string());
        for (method, name) in methods.names.iter().enumerate() {
            let error_mm = group.soft_mm(method);
            row.push(match method {
                0 => format!("{error_mm:.2}"),
                _ => format!("{error_mm:.2} ({:.2})", error_mm / still_mm),
            });
            let names = group.head.iter().map(String::as_str);
            let names: Vec<&str> = names.chain([name.as_str()]).collect();
            let numbers = [group.frames() as f64, error_mm, error_mm / still_mm];
            csv.row(&names, &numbers);
        }
        table.row(row);
    }
    report.table(&table);
    csv
}
