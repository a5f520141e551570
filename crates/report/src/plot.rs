//! Line plots as SVG.

use plotters::prelude::*;

use crate::ReportError;

/// A line plot.
#[derive(Clone, Debug, Default)]
pub struct Plot {
    /// Title, above the plot.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Label of the vertical axis, with its unit.
    pub y_label: String,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// A named curve of a [`Plot`].
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y); those that are not finite are left out.
    pub points: Vec<(f64, f64)>,
}

/// Colours that differ in lightness too, for the colour-blind (Okabe and Ito).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
    RGBColor(140, 86, 75),
];
const SIZE: (u32, u32) = (760, 340);
const FONT: &str = "sans-serif";

impl Plot {
    /// Colours of the curves, for the legend, which stands below the plot where it hides nothing.
    pub(crate) fn colours(&self) -> impl Iterator<Item = [u8; 3]> {
        (0..self.curves.len()).map(|index| {
            let RGBColor(r, g, b) = colour(index);
            [r, g, b]
        })
    }

    /// The plot as an SVG element.
    ///
    /// # Errors
    /// [`ReportError::Plot`] if there is no finite point.
    pub(crate) fn svg(&self) -> Result<String, ReportError> {
        let failed = |reason: String| ReportError::Plot {
            title: self.title.clone(),
            reason,
        };
        let finite = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
        let curves: Vec<Vec<(f64, f64)>> = self
            .curves
            .iter()
            .map(|curve| curve.points.iter().copied().filter(finite).collect())
            .collect();
        let all = || curves.iter().flatten().copied();
        let (Some(x), Some(y)) = (range(all().map(|p| p.0)), range(all().map(|p| p.1))) else {
            return Err(failed("it has no finite point".to_owned()));
        };
        let mut svg = String::new();
        draw(self, &curves, x, y, &mut svg).map_err(|error| failed(error.to_string()))?;
        Ok(svg)
    }
}

/// Colour of a curve.
fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// Least and largest value with a little room around them.
fn range(values: impl Iterator<Item = f64>) -> Option<std::ops::Range<f64>> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return None;
    }
    let room = 0.05 * (high - low).max(1e-9 * high.abs()).max(1e-12);
    Some(low - room..high + room)
}

fn draw(
    plot: &Plot,
    curves: &[Vec<(f64, f64)>],
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    svg: &mut String,
) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .caption(&plot.title, (FONT, 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(62)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(&plot.x_label)
        .y_desc(&plot.y_label)
        .axis_desc_style((FONT, 14))
        .label_style((FONT, 13))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(225, 225, 225))
        .draw()?;
    for (index, points) in curves.iter().enumerate() {
        let line = LineSeries::new(points.iter().copied(), colour(index).stroke_width(2));
        chart.draw_series(line)?;
    }
    area.present()?;
    drop(chart);
    Ok(())
}
