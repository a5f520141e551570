//! Numbers as CSV files beside the report.

use std::path::Path;

/// A CSV file being put together. Its cells are names of methods, regions and clips, which hold
/// neither commas nor quotes, and numbers.
pub struct Csv {
    text: String,
}

impl Csv {
    /// A file with the given column names.
    pub fn new(columns: &[&str]) -> Self {
        Self {
            text: format!("{}\n", columns.join(",")),
        }
    }

    /// Adds a row: first names, then numbers; those that are not finite stay empty.
    pub fn row(&mut self, names: &[&str], numbers: &[f64]) {
        let numbers = numbers.iter().map(|x| match x.is_finite() {
            true => format!("{x:.5}"),
            false => String::new(),
        });
        let cells: Vec<String> = names
            .iter()
            .map(ToString::to_string)
            .chain(numbers)
            .collect();
        self.text.push_str(&cells.join(","));
        self.text.push('\n');
    }

    /// Writes the file beside the report: `report-errors.csv` for `report.html` and `errors`.
    pub fn write(&self, report: &Path, what: &str) -> anyhow::Result<()> {
        let stem = report.file_stem().unwrap_or_default().to_string_lossy();
        let path = report.with_file_name(format!("{stem}-{what}.csv"));
        Ok(dynaskin_files::replace(&path, self.text.as_bytes())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_names_numbers_and_gaps() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut csv = Csv::new(&["method", "mm", "ratio"]);
        csv.row(&["dmpl"], &[1.5, f64::NAN]);
        let report = folder.path().join("out.html");
        csv.write(&report, "errors").expect("a file");
        let text = std::fs::read_to_string(folder.path().join("out-errors.csv")).expect("a file");
        assert_eq!(text, "method,mm,ratio\ndmpl,1.50000,\n");
    }
}
