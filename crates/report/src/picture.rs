//! Pictures of coloured triangles, drawn in software and held in the page itself.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use plotters::style::RGBColor;
use plotters::style::colors::colormaps::ViridisRGB;
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Transform};

use crate::ReportError;

/// Pixels of room around the triangles.
const MARGIN: f32 = 8.0;

/// A flat triangle in space: x to the right, y up, z towards the viewer, all in one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners, counter-clockwise seen from outside.
    pub corners: [[f32; 3]; 3],
    /// Its colour, sRGB; light is added.
    pub colour: [u8; 3],
}

/// Triangles seen from the front, far away.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// What is drawn.
    pub triangles: Vec<Triangle>,
    /// Least and greatest x, then y, that the picture shows; none: those of the triangles.
    pub window: Option<[[f32; 2]; 2]>,
}

/// Colour of a share between 0 and 1 (clamped), from dark violet to yellow: the map viridis, whose
/// lightness grows evenly, also for the colour-blind.
pub fn heat_colour(share: f64) -> [u8; 3] {
    let share = if share.is_finite() {
        share.clamp(0.0, 1.0)
    } else {
        0.0
    };
    let RGBColor(r, g, b) = ViridisRGB::get_color_normalized(share, 0.0, 1.0);
    [r, g, b]
}

impl Picture {
    /// The picture as the source of an `img` element.
    pub(crate) fn data_uri(&self, caption: &str) -> Result<String, ReportError> {
        let png = self.png(caption)?;
        Ok(format!("data:image/png;base64,{}", STANDARD.encode(png)))
    }

    /// The picture as the bytes of a PNG file.
    ///
    /// # Errors
    /// [`ReportError::Picture`], with `caption`, for one that cannot be drawn.
    pub fn png(&self, caption: &str) -> Result<Vec<u8>, ReportError> {
        let failed = |reason: &str| ReportError::Picture {
            caption: caption.to_owned(),
            reason: reason.to_owned(),
        };
        let pixmap = self.draw().map_err(failed)?;
        pixmap
            .encode_png()
            .map_err(|error| failed(&error.to_string()))
    }

    fn draw(&self) -> Result<Pixmap, &'static str> {
        let (width, height) = self.size;
        let mut pixmap = Pixmap::new(width, height).ok_or("its width or height is 0")?;
        pixmap.fill(Color::WHITE);
        let points = || self.triangles.iter().flat_map(|t| t.corners);
        if !points().flatten().all(f32::is_finite) {
            return Err("a corner is not finite");
        }
        let fold = |axis: usize| {
            points().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| {
                (low.min(p[axis]), high.max(p[axis]))
            })
        };
        let ((left, right), (bottom, top)) = match self.window {
            Some([[left, right], [bottom, top]]) => ((left, right), (bottom, top)),
            None => (fold(0), fold(1)),
        };
        if left >= right || bottom >= top {
            return Err("it has nothing to show");
        }
        let room = |pixels: u32| (pixels as f32 - 2.0 * MARGIN).max(1.0);
        let scale = (room(width) / (right - left)).min(room(height) / (top - bottom));
        let x = |p: [f32; 3]| 0.5 * width as f32 + scale * (p[0] - 0.5 * (left + right));
        let y = |p: [f32; 3]| 0.5 * height as f32 - scale * (p[1] - 0.5 * (bottom + top));

        // Far triangles first; those that face away are never seen of a closed surface.
        let mut order: Vec<(f32, [f32; 3], &Triangle)> = self
            .triangles
            .iter()
            .map(|t| (t.corners.iter().map(|p| p[2]).sum(), normal(t), t))
            .filter(|(_, normal, _)| normal[2] > 0.0)
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut paint = Paint {
            // Edges would show the white below.
            anti_alias: false,
            ..Paint::default()
        };
        for (_, normal, triangle) in order {
            let mut builder = PathBuilder::new();
            let [a, b, c] = triangle.corners;
            builder.move_to(x(a), y(a));
            builder.line_to(x(b), y(b));
            builder.line_to(x(c), y(c));
            builder.close();
            let Some(path) = builder.finish() else {
                continue; // It has no area.
            };
            // Soft light from the viewer: enough to see the form, not to change the colour.
            let light = 0.72 + 0.28 * normal[2];
            let [r, g, b] = triangle.colour.map(|c| (f32::from(c) * light) as u8);
            paint.set_color_rgba8(r, g, b, 255);
            pixmap.fill_path(
                &path,
                &paint,
                FillRule::Winding,
                Transform::identity(),
                None,
            );
        }
        Ok(pixmap)
    }
}

/// Unit normal of a triangle; 0 where it has no area.
fn normal(triangle: &Triangle) -> [f32; 3] {
    let [a, b, c] = triangle.corners;
    let edge = |to: [f32; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
    let (u, v) = (edge(b), edge(c));
    let cross = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let length = cross.iter().map(|x| x * x).sum::<f32>().sqrt();
    cross.map(|x| x / length.max(f32::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f32, half: f32, colour: [u8; 3]) -> [Triangle; 2] {
        let p = |x: f32, y: f32| [half * x, half * y, z];
        [
            [p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0)],
            [p(-1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0)],
        ]
        .map(|corners| Triangle { corners, colour })
    }

    #[test]
    fn what_is_nearer_hides_what_is_behind() {
        let mut triangles = square(1.0, 0.5, [200, 0, 0]).to_vec();
        triangles.extend(square(0.0, 1.0, [0, 0, 200]));
        let size = (60, 60);
        let pixmap = Picture {
            size,
            triangles,
            window: None,
        }
        .draw()
        .expect("a picture");
        let at = |x, y| {
            let pixel = pixmap.pixel(x, y).expect("inside");
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        assert_eq!(at(30, 30), [200, 0, 0]);
        assert_eq!(at(11, 30), [0, 0, 200]);
        assert_eq!(at(2, 2), [255, 255, 255]);
    }

    #[test]
    fn the_scale_runs_from_dark_to_light() {
        let lightness = |share| {
            heat_colour(share)
                .iter()
                .map(|c| u32::from(*c))
                .sum::<u32>()
        };
        assert!(lightness(0.0) < lightness(0.5) && lightness(0.5) < lightness(1.0));
        assert_eq!(heat_colour(f64::NAN), heat_colour(-1.0));
    }
}
