//! HTML reports of measurements: headings, paragraphs, tables, line plots and pictures in one
//! self-contained file.

mod picture;
mod plot;

use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};

pub use picture::{Picture, Triangle, heat_colour};
pub use plot::{Curve, Plot};

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A plot cannot be drawn.
    #[error("plot \"{title}\": {reason}")]
    Plot {
        /// Title of the plot.
        title: String,
        /// Why not.
        reason: String,
    },
    /// A picture cannot be drawn.
    #[error("picture \"{caption}\": {reason}")]
    Picture {
        /// Its caption.
        caption: String,
        /// Why not.
        reason: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] dynaskin_files::FileError),
}

/// A report being put together, from top to bottom.
#[derive(Debug, Default)]
pub struct Report {
    title: String,
    parts: Vec<Markup>,
}

/// Style of the page: plain, in the reader's own light or dark colours; plots stay on white.
const STYLE: &str = "
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 96rem; margin: 2rem auto; padding: 0 1rem; }
p, ul { max-width: 66rem; }
h2 { margin-top: 2.5rem; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 0.25rem 0.6rem; text-align: left; border-bottom: 1px solid #8884; }
th { vertical-align: bottom; }
td.number { text-align: right; white-space: pre; }
th:first-child, td:first-child { position: sticky; left: 0; background: Canvas; }
@media (min-width: 48rem) { td:first-child { white-space: nowrap; } }
tr.marked td { background: #d9770626; }
figure { margin: 1rem 0; background: #fff; color: #222; border-radius: 6px; width: fit-content; }
figure svg { max-width: 100%; height: auto; display: block; }
.pictures { display: flex; flex-wrap: wrap; gap: 0.75rem; }
.pictures figure { margin: 0; width: 11rem; flex: none; }
.pictures img { width: 100%; height: auto; display: block; }
figcaption { padding: 0.25rem 0.5rem 0.5rem; font-size: 0.85rem; line-height: 1.3; }
.legend { display: flex; flex-wrap: wrap; gap: 0.1rem 1rem; padding-left: 4.5rem; }
.legend i { display: inline-block; width: 1.2rem; height: 0.2rem; margin-right: 0.4rem; vertical-align: middle; }
.scale { display: flex; align-items: center; gap: 0.5rem; font-size: 0.85rem; margin: 0.75rem 0; }
.scale span.bar { width: 12rem; height: 0.9rem; border-radius: 3px; }
";

impl Report {
    /// An empty report.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            parts: Vec::new(),
        }
    }

    /// Begins a section.
    pub fn section(&mut self, heading: &str) {
        self.parts.push(html! { h2 { (heading) } });
    }

    /// Adds a paragraph of plain text.
    pub fn paragraph(&mut self, text: &str) {
        self.parts.push(html! { p { (text) } });
    }

    /// Adds a table. Cells that begin with a digit or a sign are set to the right, but for names of clips such as
    /// `50002_hop`; line breaks in them are kept.
    pub fn table(&mut self, table: &Table) {
        let numeric = |cell: &str| {
            let text = cell.trim_start_matches(['+', '-', '−', '±', '<', '>', ' ']);
            text.starts_with(|c: char| c.is_ascii_digit()) && !text.contains('_')
        };
        self.parts.push(html! {
            div.wide { table {
                thead { tr { @for head in &table.head { th { (head) } } } }
                tbody { @for row in &table.rows {
                    tr.marked[row.marked] { @for cell in &row.cells {
                        td.number[numeric(cell)] { (cell) }
                    } }
                } }
            } }
        });
    }

    /// Adds a line plot.
    ///
    /// # Errors
    /// [`ReportError::Plot`] if it has no finite point or cannot be drawn.
    pub fn plot(&mut self, plot: &Plot) -> Result<(), ReportError> {
        let svg = plot.svg()?;
        let colours = plot
            .colours()
            .map(|[r, g, b]| format!("background:rgb({r},{g},{b})"));
        self.parts.push(html! {
            figure {
                div role="img" aria-label=(plot.title) { (PreEscaped(svg)) }
                figcaption.legend { @for (curve, style) in plot.curves.iter().zip(colours) {
                    span { i style=(style) {} (curve.name) }
                } }
            }
        });
        Ok(())
    }

    /// Adds pictures side by side, each with a caption.
    ///
    /// # Errors
    /// [`ReportError::Picture`] for one that cannot be drawn.
    pub fn pictures(&mut self, pictures: &[(String, Picture)]) -> Result<(), ReportError> {
        let mut drawn = Vec::new();
        for (caption, picture) in pictures {
            drawn.push((caption, picture.data_uri(caption)?));
        }
        self.parts.push(html! {
            div.pictures { @for (caption, uri) in &drawn {
                figure { img src=(uri) alt=(caption); figcaption { (caption) } }
            } }
        });
        Ok(())
    }

    /// Adds the legend of the colours of [`heat_colour`]: what 0 and 1 stand for.
    pub fn heat_scale(&mut self, low: &str, high: &str) {
        let stops: Vec<String> = (0..=8)
            .map(|stop| {
                let [r, g, b] = heat_colour(f64::from(stop) / 8.0);
                format!("rgb({r},{g},{b})")
            })
            .collect();
        let style = format!("background:linear-gradient(to right,{})", stops.join(","));
        self.parts.push(html! {
            div.scale { (low) span.bar style=(style) {} (high) }
        });
    }

    /// The page.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (self.title) }
                    @for part in &self.parts { (part) }
                }
            }
        };
        page.into_string()
    }

    /// Writes the page to a file, by way of a temporary one beside it.
    ///
    /// # Errors
    /// [`ReportError::File`]; the file is then as it was.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        Ok(dynaskin_files::replace(path, self.html().as_bytes())?)
    }
}

/// A table of text cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Column headings.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Row>,
}

/// A row of a [`Table`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// As many cells as the table has headings.
    pub cells: Vec<String>,
    /// Whether the row stands out: a goal missed.
    pub marked: bool,
}

impl Table {
    /// A table without rows.
    pub fn new<const N: usize>(head: [&str; N]) -> Self {
        Self {
            head: head.map(str::to_owned).to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(Row {
            cells,
            marked: false,
        });
    }

    /// Adds a row that stands out.
    pub fn marked_row(&mut self, cells: Vec<String>) {
        self.rows.push(Row {
            cells,
            marked: true,
        });
    }
}
