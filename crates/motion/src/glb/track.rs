//! One animated property of one node: times, values and what lies between.

use dynaskin_glb::{Document, Elements, GlbError, f32_at, i16_at};
use glam::{DQuat, DVec3, DVec4, Vec4};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation, Sampler};
use gltf::json::validation::Checked;

/// Keyframes of a rotation (x, y, z, w) or of a vector (the fourth component is 0).
#[derive(Clone, Debug)]
pub struct Track {
    /// Seconds, strictly increasing, at least one.
    times: Vec<f32>,
    /// One value a time; three (tangent in, value, tangent out) for splines. As precise as files are.
    values: Vec<Vec4>,
    interpolation: Interpolation,
}

impl Track {
    /// Rotations; components may be normalised integers.
    pub fn rotations(file: &Document<'_>, sampler: &Sampler) -> Result<Self, GlbError> {
        let output = sampler.output.value();
        let component = file.component_type(output)?;
        let elements = file.elements(output, component, Type::Vec4)?;
        let number: fn(&[u8], usize) -> f32 = match component {
            ComponentType::F32 => f32_at,
            // Normalised integers, by the conversions of the glTF specification, section 3.11.
            ComponentType::I8 => |e, k| (f32::from(e[k] as i8) / 127.0).max(-1.0),
            ComponentType::U8 => |e, k| f32::from(e[k]) / 255.0,
            ComponentType::I16 => |e, k| (f32::from(i16_at(e, k)) / 32767.0).max(-1.0),
            ComponentType::U16 => |e, k| f32::from(i16_at(e, k) as u16) / 65535.0,
            ComponentType::U32 => {
                let place = format!("accessor {output}");
                return Err(GlbError::new(place, "floats or normalised integers"));
            }
        };
        let values = elements
            .iter()
            .map(|e| Vec4::from_array(std::array::from_fn(|k| number(e, k))))
            .collect();
        let track = Self::new(file, sampler, values)?;
        let lengthless = (0..track.times.len()).find(|key| track.value(*key).length() < 1e-3);
        match lengthless {
            None => Ok(track),
            Some(key) => {
                let place = format!("accessor {output}, element {key}");
                Err(GlbError::new(place, "a rotation that is not of zeros"))
            }
        }
    }

    /// Translations or scales.
    pub fn vectors(file: &Document<'_>, sampler: &Sampler) -> Result<Self, GlbError> {
        let elements: Elements<'_> =
            file.elements(sampler.output.value(), ComponentType::F32, Type::Vec3)?;
        let values = elements
            .iter()
            .map(|e| Vec4::new(f32_at(e, 0), f32_at(e, 1), f32_at(e, 2), 0.0))
            .collect();
        Self::new(file, sampler, values)
    }

    fn new(file: &Document<'_>, sampler: &Sampler, values: Vec<Vec4>) -> Result<Self, GlbError> {
        let [input, output] = [sampler.input.value(), sampler.output.value()];
        let bad = |accessor: usize, expected: &str| {
            Err(GlbError::new(format!("accessor {accessor}"), expected))
        };
        let times: Vec<f32> = file
            .elements(input, ComponentType::F32, Type::Scalar)?
            .iter()
            .map(|e| f32_at(e, 0))
            .collect();
        let rises = times.windows(2).all(|pair| pair[0] < pair[1]);
        if times.is_empty() || !rises || times.iter().any(|time| !time.is_finite()) {
            return bad(input, "at least one time, each later than the one before");
        }
        let Checked::Valid(interpolation) = sampler.interpolation else {
            let place = format!("the sampler of accessor {output}");
            return Err(GlbError::new(place, "LINEAR, STEP or CUBICSPLINE"));
        };
        let per_key = match interpolation {
            Interpolation::CubicSpline => 3,
            Interpolation::Linear | Interpolation::Step => 1,
        };
        if times.len().checked_mul(per_key) != Some(values.len()) {
            let expected = format!("{per_key} values for each of the {} times", times.len());
            return bad(output, &expected);
        }
        if values.iter().any(|value| !value.is_finite()) {
            return bad(output, "finite numbers");
        }
        Ok(Self {
            times,
            values,
            interpolation,
        })
    }

    /// Times of the keyframes in seconds.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.times.iter().map(|time| f64::from(*time))
    }

    /// Whether what lies between the keyframes stands in the file.
    pub fn is_spline(&self) -> bool {
        self.interpolation == Interpolation::CubicSpline
    }

    /// Largest angle in radians between the rotation of the first keyframe and another's.
    pub fn largest_turn(&self) -> f64 {
        let rotation = |key| DQuat::from_vec4(self.value(key)).normalize();
        let first = rotation(0);
        (1..self.times.len())
            .map(|key| 2.0 * first.dot(rotation(key)).abs().min(1.0).acos())
            .fold(0.0, f64::max)
    }

    pub fn start_seconds(&self) -> f64 {
        self.times.first().copied().map_or(0.0, f64::from)
    }

    pub fn end_seconds(&self) -> f64 {
        self.times.last().copied().map_or(0.0, f64::from)
    }

    /// The value at a time; before the first and after the last keyframe that one's.
    pub fn vector_at(&self, seconds: f64) -> DVec3 {
        let (key, fraction) = self.place(seconds);
        let value = match self.interpolation {
            Interpolation::CubicSpline if fraction > 0.0 => self.spline(key, fraction),
            Interpolation::Linear if fraction > 0.0 => {
                self.value(key).lerp(self.value(key + 1), fraction)
            }
            _ => self.value(key),
        };
        value.truncate()
    }

    /// The rotation at a time; before the first and after the last keyframe that one's.
    pub fn rotation_at(&self, seconds: f64) -> DQuat {
        let (key, fraction) = self.place(seconds);
        let rotation = |value: DVec4| DQuat::from_vec4(value).normalize();
        match self.interpolation {
            Interpolation::CubicSpline if fraction > 0.0 => {
                let value = self.spline(key, fraction);
                // Tangents can be such that a spline passes through zero.
                if value.length() < 1e-6 {
                    rotation(self.value(key))
                } else {
                    rotation(value)
                }
            }
            Interpolation::Linear if fraction > 0.0 => {
                rotation(self.value(key)).slerp(rotation(self.value(key + 1)), fraction)
            }
            _ => rotation(self.value(key)),
        }
    }

    /// The keyframe at or before a time and the fraction of the way to the next.
    fn place(&self, seconds: f64) -> (usize, f64) {
        let after = self
            .times
            .partition_point(|time| f64::from(*time) <= seconds);
        let key = after.saturating_sub(1);
        match (self.times.get(key), self.times.get(after)) {
            (Some(&from), Some(&to)) if after > 0 => {
                let [from, to] = [from, to].map(f64::from);
                (key, (seconds - from) / (to - from))
            }
            _ => (key, 0.0),
        }
    }

    fn value(&self, key: usize) -> DVec4 {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1].as_dvec4(),
            Interpolation::Linear | Interpolation::Step => self.values[key].as_dvec4(),
        }
    }

    /// Cubic Hermite spline; tangents are per second.
    fn spline(&self, key: usize, t: f64) -> DVec4 {
        let seconds = f64::from(self.times[key + 1] - self.times[key]);
        let tangent_out = self.values[3 * key + 2].as_dvec4() * seconds;
        let tangent_in = self.values[3 * (key + 1)].as_dvec4() * seconds;
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * self.value(key)
            + (t3 - 2.0 * t2 + t) * tangent_out
            + (3.0 * t2 - 2.0 * t3) * self.value(key + 1)
            + (t3 - t2) * tangent_in
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, values: &[f32]) -> Track {
        Track {
            times: vec![1.0, 3.0],
            values: values.iter().map(|x| Vec4::splat(*x)).collect(),
            interpolation,
        }
    }

    #[test]
    fn a_spline_follows_the_cubic_whose_tangents_it_has() {
        // t³ at 1 and 3 seconds: tangent in, value, tangent out.
        let spline = track(
            Interpolation::CubicSpline,
            &[3.0, 1.0, 3.0, 27.0, 27.0, 27.0],
        );
        for t in [1.0_f64, 1.5, 2.0, 2.9, 3.0] {
            let got = spline.vector_at(t).x;
            assert!((got - t.powi(3)).abs() < 1e-9, "{got} at {t}");
        }
        assert_eq!([0.0, 9.0].map(|t| spline.vector_at(t).x), [1.0, 27.0]);
    }

    #[test]
    fn steps_hold_and_lines_lead() {
        let step = track(Interpolation::Step, &[2.0, 4.0]);
        assert_eq!(
            [0.0, 1.0, 2.9, 3.0, 4.0].map(|t| step.vector_at(t).x),
            [2.0, 2.0, 2.0, 4.0, 4.0]
        );
        let line = track(Interpolation::Linear, &[2.0, 4.0]);
        assert_eq!(
            [0.0, 1.5, 3.0, 4.0].map(|t| line.vector_at(t).x),
            [2.0, 2.5, 4.0, 4.0]
        );
        let turn = Track {
            times: vec![0.0, 1.0],
            values: vec![
                Vec4::W,
                // A turn of 1 rad about x, with the other sign: the short way counts.
                -DVec4::from(DQuat::from_rotation_x(1.0)).as_vec4(),
            ],
            interpolation: Interpolation::Linear,
        };
        let half = turn.rotation_at(0.5);
        assert!(half.angle_between(DQuat::from_rotation_x(0.5)) < 1e-6);
    }
}
