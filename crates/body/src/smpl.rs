//! SMPL-family bodies from `.npz` files.
//!
//! Users bring their own licensed file; nothing of it is part of this project. Keys and shapes are
//! those of the published files: `v_template` [V,3], `shapedirs` [V,3,S], `posedirs` [V,3,207]
//! (optional), `J_regressor` [24,V], `weights` [V,24], `kintree_table` [2,24], `f` [F,3]; floats of
//! 32 or 64 bits, integers of 32 or 64 bits, in C or Fortran order.

use std::io::{Cursor, Read};

use glam::{DVec3, Vec3};
use npyz::{NpyFile, Order};

use crate::{BodyError, BodyModel, JOINT_COUNT, Joint, SHAPE_COUNT, SkinWeights};

/// Pose corrective fields: nine entries of `R - I` for every joint but the pelvis.
const POSE_DIR_COUNT: usize = 9 * (JOINT_COUNT - 1);
/// More vertices than any body of the family (SMPL-X has 10,475).
const MAX_VERTICES: usize = 100_000;
const MAX_FACES: usize = 2 * MAX_VERTICES;
/// More shape coefficients than any published file (SMPL-X has 400).
const MAX_SHAPES: usize = 1_000;
/// Larger than any array of the family: `posedirs` of SMPL-X in double precision is 122 MB.
const MAX_ARRAY_BYTES: u64 = 512 << 20;
/// A header describes type, order and shape in about 100 bytes.
const MAX_HEADER_BYTES: usize = 1_024;

impl BodyModel {
    /// Reads a body of the SMPL family with SMPL's 24 joints.
    ///
    /// Only the first ten shape coefficients are kept (fewer are filled up with zeros), and the
    /// four largest weights of each vertex, renormalised. The body is moved so that, as for the
    /// default bodies, the origin lies on the floor under the pelvis: under every shape the vertex
    /// lowest at β = 0 stays at y = 0, which moves SMPL's `trans` by a constant per shape. The
    /// model has neither thickness, regions nor colours.
    ///
    /// # Errors
    /// [`BodyError::Npz`] where the bytes are no such archive, [`BodyError::NpzArray`] where an
    /// array is missing, of another type or shape, or holds numbers that are no body.
    pub fn from_smpl_npz(bytes: &[u8]) -> Result<Self, BodyError> {
        let mut archive = Archive::open(bytes)?;
        let template = archive.floats("v_template", &[None, Some(3)])?;
        let n_vertices = template.shape[0];
        if n_vertices == 0 || n_vertices > MAX_VERTICES {
            return Err(wrong(
                "v_template",
                format!("1 to {MAX_VERTICES} vertices"),
                n_vertices.to_string(),
            ));
        }
        archive.check_tree()?;
        let faces = archive.faces(n_vertices)?;
        let regressor = archive.floats("J_regressor", &[Some(JOINT_COUNT), Some(n_vertices)])?;
        let weights = archive.floats("weights", &[Some(n_vertices), Some(JOINT_COUNT)])?;
        let shapes = archive.floats("shapedirs", &[Some(n_vertices), Some(3), None])?;
        if shapes.shape[2] == 0 || shapes.shape[2] > MAX_SHAPES {
            return Err(wrong(
                "shapedirs",
                format!("1 to {MAX_SHAPES} coefficients"),
                shapes.shape[2].to_string(),
            ));
        }
        let pose_dirs_m = if archive.has("posedirs") {
            let shape = [Some(n_vertices), Some(3), Some(POSE_DIR_COUNT)];
            let poses = archive.floats("posedirs", &shape)?;
            (0..POSE_DIR_COUNT)
                .map(|row| narrow(&field(&poses, n_vertices, Some(row))))
                .collect()
        } else {
            Vec::new()
        };

        let mut template_m = field(&template, n_vertices, None);
        let lowest = lowest_vertex(&template_m);
        let mut joints_m = regressed(&regressor, &template_m);
        let mut shape_dirs_m = Vec::with_capacity(SHAPE_COUNT);
        let mut joint_shape_dirs_m = Vec::with_capacity(SHAPE_COUNT);
        for coefficient in 0..SHAPE_COUNT {
            let mut dirs_m = if coefficient < shapes.shape[2] {
                field(&shapes, n_vertices, Some(coefficient))
            } else {
                vec![DVec3::ZERO; n_vertices]
            };
            let mut joint_dirs_m = regressed(&regressor, &dirs_m);
            ground(&mut dirs_m, &mut joint_dirs_m, lowest);
            shape_dirs_m.push(narrow(&dirs_m));
            joint_shape_dirs_m.push(joint_dirs_m.map(|dir| dir.as_vec3()));
        }
        ground(&mut template_m, &mut joints_m, lowest);
        Ok(Self {
            name: "smpl".to_owned(),
            template_m: narrow(&template_m),
            faces,
            shape_dirs_m,
            pose_dirs_m,
            joint_template_m: joints_m.map(|joint| joint.as_vec3()),
            joint_shape_dirs_m,
            skin: skin(&weights)?,
            thickness_template_m: Vec::new(),
            thickness_shape_dirs_m: Vec::new(),
            region_weights: Vec::new(),
            colors_srgba: Vec::new(),
        })
    }
}

/// An array of finite numbers.
struct Array {
    shape: Vec<usize>,
    /// Elements between neighbours along each axis.
    strides: Vec<usize>,
    values: Vec<f64>,
}

impl Array {
    fn at(&self, index: &[usize]) -> f64 {
        let offset: usize = index.iter().zip(&self.strides).map(|(i, s)| i * s).sum();
        self.values[offset]
    }
}

struct Archive<'a> {
    zip: zip::ZipArchive<Cursor<&'a [u8]>>,
}

impl<'a> Archive<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, BodyError> {
        let zip = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| BodyError::Npz {
            reason: format!(
                "not an archive that numpy.savez writes ({error}); convert .pkl files to .npz first"
            ),
        })?;
        Ok(Self { zip })
    }

    fn has(&self, key: &str) -> bool {
        self.zip.index_for_name(&format!("{key}.npy")).is_some()
    }

    /// The unpacked `.npy` file of a key.
    fn bytes(&mut self, key: &'static str) -> Result<Vec<u8>, BodyError> {
        let entry = self.zip.by_name(&format!("{key}.npy")).map_err(|error| {
            wrong(
                key,
                "an array".into(),
                format!("none in the file ({error})"),
            )
        })?;
        let mut bytes = Vec::new();
        let read = entry.take(MAX_ARRAY_BYTES + 1).read_to_end(&mut bytes);
        match read {
            Ok(count) if count as u64 <= MAX_ARRAY_BYTES => Ok(bytes),
            Ok(_) => Err(wrong(
                key,
                format!("at most {MAX_ARRAY_BYTES} bytes"),
                "more".into(),
            )),
            Err(error) => Err(wrong(key, "intact data".into(), error.to_string())),
        }
    }

    /// Reads an array of floats; `shape` gives the fixed lengths.
    fn floats(&mut self, key: &'static str, shape: &[Option<usize>]) -> Result<Array, BodyError> {
        let array = self.numbers(key, shape, |file| match file.try_data::<f64>() {
            Ok(reader) => collect(reader),
            Err(file) => match file.try_data::<f32>() {
                Ok(reader) => collect(reader.map(|value| value.map(f64::from))),
                Err(_) => None,
            },
        })?;
        if let Some(value) = array.values.iter().find(|value| !value.is_finite()) {
            return Err(wrong(key, "finite numbers".into(), value.to_string()));
        }
        Ok(array)
    }

    /// Reads an array of integers.
    fn integers(&mut self, key: &'static str, shape: &[Option<usize>]) -> Result<Array, BodyError> {
        self.numbers(key, shape, |file| {
            let file = match file.try_data::<u32>() {
                Ok(reader) => return collect(reader.map(|value| value.map(f64::from))),
                Err(file) => file,
            };
            let file = match file.try_data::<i32>() {
                Ok(reader) => return collect(reader.map(|value| value.map(f64::from))),
                Err(file) => file,
            };
            let file = match file.try_data::<i64>() {
                Ok(reader) => return collect(reader.map(|value| value.map(|v| v as f64))),
                Err(file) => file,
            };
            match file.try_data::<u64>() {
                Ok(reader) => collect(reader.map(|value| value.map(|v| v as f64))),
                Err(_) => None,
            }
        })
    }

    fn numbers(
        &mut self,
        key: &'static str,
        expected: &[Option<usize>],
        read: impl FnOnce(NpyFile<&[u8]>) -> Option<Result<Vec<f64>, std::io::Error>>,
    ) -> Result<Array, BodyError> {
        let bytes = self.bytes(key)?;
        check_header(key, &bytes)?;
        let file = NpyFile::new(bytes.as_slice())
            .map_err(|error| wrong(key, "an array of numpy's format".into(), error.to_string()))?;
        let dtype = file.dtype().descr();
        if file.uses_pickled_array() {
            return Err(wrong(
                key,
                "a dense array (convert a sparse one with `.toarray()`)".into(),
                "pickled Python objects".into(),
            ));
        }
        let shape: Vec<usize> = file.shape().iter().map(|&length| length as usize).collect();
        let fits = shape.len() == expected.len()
            && shape
                .iter()
                .zip(expected)
                .all(|(length, expected)| expected.is_none_or(|expected| expected == *length));
        if !fits {
            return Err(wrong(key, describe(expected), format!("shape {shape:?}")));
        }
        let strides = match file.order() {
            Order::C => strides(shape.iter().rev()).into_iter().rev().collect(),
            Order::Fortran => strides(shape.iter()),
        };
        let values = read(file)
            .ok_or_else(|| wrong(key, "32 or 64-bit numbers".into(), format!("dtype {dtype}")))?
            .map_err(|error| wrong(key, "intact data".into(), error.to_string()))?;
        Ok(Array {
            shape,
            strides,
            values,
        })
    }

    /// The kinematic tree must be SMPL's, or joints would turn about the wrong parents.
    fn check_tree(&mut self) -> Result<(), BodyError> {
        let table = self.integers("kintree_table", &[Some(2), Some(JOINT_COUNT)])?;
        for joint in &Joint::ALL[1..] {
            let parent = table.at(&[0, *joint as usize]);
            let own = joint.parent().map_or(0, |parent| parent as usize);
            if parent != own as f64 {
                return Err(wrong(
                    "kintree_table",
                    format!("SMPL's tree: {} hangs on joint {own}", joint.name()),
                    format!("joint {parent}"),
                ));
            }
        }
        Ok(())
    }

    fn faces(&mut self, n_vertices: usize) -> Result<Vec<[u32; 3]>, BodyError> {
        let table = self.integers("f", &[None, Some(3)])?;
        if table.shape[0] > MAX_FACES {
            return Err(wrong(
                "f",
                format!("at most {MAX_FACES} faces"),
                table.shape[0].to_string(),
            ));
        }
        if let Some(index) = table
            .values
            .iter()
            .find(|&&index| index < 0.0 || index >= n_vertices as f64)
        {
            return Err(wrong(
                "f",
                format!("indices below {n_vertices}"),
                index.to_string(),
            ));
        }
        Ok((0..table.shape[0])
            .map(|face| [0, 1, 2].map(|corner| table.at(&[face, corner]) as u32))
            .collect())
    }
}

fn wrong(key: &'static str, expected: String, got: String) -> BodyError {
    BodyError::NpzArray { key, expected, got }
}

fn describe(shape: &[Option<usize>]) -> String {
    let lengths: Vec<String> = shape
        .iter()
        .map(|length| length.map_or("any".to_owned(), |length| length.to_string()))
        .collect();
    format!("shape [{}]", lengths.join(", "))
}

/// What npyz takes on trust: version 1 with a short, flat header, whose numbers multiply to no more
/// elements than the file has bytes.
fn check_header(key: &'static str, bytes: &[u8]) -> Result<(), BodyError> {
    let bad = |got: &str| wrong(key, "a plain array header".into(), got.to_owned());
    let length = match bytes.get(6..10) {
        Some(&[1, 0, low, high]) => usize::from(u16::from_le_bytes([low, high])),
        _ => return Err(bad("another version")),
    };
    let text = match bytes.get(10..10 + length) {
        Some(text) if length <= MAX_HEADER_BYTES && text.is_ascii() => {
            String::from_utf8_lossy(text)
        }
        _ => return Err(bad("a truncated or overlong header")),
    };
    if text.matches(['(', '[', '{']).count() > 3 {
        return Err(bad("a nested type"));
    }
    let shape = text.split("'shape'").nth(1).unwrap_or_default();
    let elements = shape
        .split(|c: char| !c.is_ascii_digit())
        .filter(|digits| !digits.is_empty())
        .try_fold(1u64, |product, digits| {
            product.checked_mul(digits.parse().ok()?)
        });
    match elements {
        Some(elements) if elements <= bytes.len() as u64 => Ok(()),
        _ => Err(bad("more elements than the file holds")),
    }
}

fn strides<'a>(fastest_first: impl Iterator<Item = &'a usize>) -> Vec<usize> {
    fastest_first
        .scan(1, |stride, length| {
            let own = *stride;
            *stride *= length;
            Some(own)
        })
        .collect()
}

fn collect<T: Into<f64>>(
    values: impl Iterator<Item = std::io::Result<T>>,
) -> Option<Result<Vec<f64>, std::io::Error>> {
    Some(values.map(|value| value.map(Into::into)).collect())
}

/// Points of `[V,3]`, or of one row of `[V,3,rows]`.
fn field(array: &Array, n_vertices: usize, row: Option<usize>) -> Vec<DVec3> {
    (0..n_vertices)
        .map(|vertex| {
            DVec3::from_array([0, 1, 2].map(|axis| match row {
                Some(row) => array.at(&[vertex, axis, row]),
                None => array.at(&[vertex, axis]),
            }))
        })
        .collect()
}

fn regressed(regressor: &Array, points_m: &[DVec3]) -> [DVec3; JOINT_COUNT] {
    std::array::from_fn(|joint| {
        points_m
            .iter()
            .enumerate()
            .map(|(vertex, point)| regressor.at(&[joint, vertex]) * *point)
            .sum()
    })
}

fn lowest_vertex(points_m: &[DVec3]) -> usize {
    (0..points_m.len())
        .min_by(|&a, &b| points_m[a].y.total_cmp(&points_m[b].y))
        .unwrap_or(0)
}

/// Moves the pelvis above the origin and vertex `lowest` to y = 0; works alike on directions.
fn ground(points_m: &mut [DVec3], joints_m: &mut [DVec3; JOINT_COUNT], lowest: usize) {
    let pelvis = joints_m[Joint::Pelvis as usize];
    let origin = DVec3::new(pelvis.x, points_m[lowest].y, pelvis.z);
    for point in points_m.iter_mut().chain(joints_m) {
        *point -= origin;
    }
}

fn skin(weights: &Array) -> Result<Vec<SkinWeights>, BodyError> {
    (0..weights.shape[0])
        .map(|vertex| {
            let dense = std::array::from_fn(|joint| weights.at(&[vertex, joint]) as f32);
            let skin = SkinWeights::largest_four(&dense);
            let sum: f32 = skin.weights.iter().sum();
            if (sum - 1.0).abs() < 1e-3 {
                Ok(skin)
            } else {
                Err(wrong(
                    "weights",
                    "a positive weight at every vertex".into(),
                    format!("none at vertex {vertex}"),
                ))
            }
        })
        .collect()
}

fn narrow(points_m: &[DVec3]) -> Vec<Vec3> {
    points_m.iter().map(|point| point.as_vec3()).collect()
}
