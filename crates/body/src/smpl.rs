//! SMPL-family bodies from `.npz` files.
//!
//! Users bring their own licensed file; nothing of it is part of this project. Keys and shapes are
//! those of the published files: `v_template` [V,3], `shapedirs` [V,3,S], `posedirs` [V,3,207]
//! (optional), `J_regressor` [24,V], `weights` [V,24], `kintree_table` [2,24], `f` [F,3]. Floats
//! and integers have 32 or 64 bits, in C or Fortran order.

use std::io::Cursor;

use dynaskin_npz::{Archive, Array, NpzError};
use glam::{DVec3, Vec3};

use crate::model::{Part, expected_extent};
use crate::{BodyError, BodyModel, JOINT_COUNT, Joint, SHAPE_COUNT, SkinWeights};

/// Pose corrective fields: nine entries of `R - I` for every joint but the pelvis.
const POSE_DIR_COUNT: usize = 9 * (JOINT_COUNT - 1);
/// More vertices than any body of the family (SMPL-X has 10,475).
const MAX_VERTICES: usize = 30_000;
const MAX_FACES: usize = 2 * MAX_VERTICES;
/// More shape coefficients than any published file (SMPL-X has 400).
const MAX_SHAPES: usize = 1_000;
/// Larger than any array of the family: `shapedirs` of SMPL-X in double precision is 101 MB.
const MAX_ARRAY_BYTES: u64 = 256 << 20;

impl BodyModel {
    /// Reads a body of the SMPL family with SMPL's 24 joints.
    ///
    /// Only the first ten shape coefficients are kept (fewer are filled up with zeros), and the
    /// four largest weights of each vertex, renormalised. The body is moved so that, as for the
    /// default bodies, the origin lies on the floor under the pelvis. Under every shape the vertex
    /// that is lowest at β = 0 stays at y = 0, which moves SMPL's `trans` by a constant per shape.
    /// The model has neither thickness, regions nor colours.
    ///
    /// # Errors
    /// [`BodyError::Npz`] where the bytes are no such archive or an array is missing, of another
    /// type or shape, or holds numbers that are no body, such as millimetres.
    pub fn from_smpl_npz(bytes: &[u8]) -> Result<Self, BodyError> {
        let mut file = File(Archive::open(Cursor::new(bytes), MAX_ARRAY_BYTES)?);
        let n_vertices = file.0.shape("v_template")?.first().copied().unwrap_or(0);
        if n_vertices == 0 || n_vertices > MAX_VERTICES {
            return Err(wrong(
                "v_template",
                format!("1 to {MAX_VERTICES} vertices"),
                n_vertices.to_string(),
            ));
        }
        let template = file.0.floats("v_template", &[Some(n_vertices), Some(3)])?;
        file.check_tree()?;
        let faces = file.faces(n_vertices)?;
        let regressor = file
            .0
            .floats("J_regressor", &[Some(JOINT_COUNT), Some(n_vertices)])?;
        let weights = file
            .0
            .floats("weights", &[Some(n_vertices), Some(JOINT_COUNT)])?;
        let shapes = file.shapes(n_vertices)?;
        let pose_dirs_m = if file.0.has("posedirs") {
            let shape = [Some(n_vertices), Some(3), Some(POSE_DIR_COUNT)];
            let poses = file.0.floats_single("posedirs", &shape)?;
            if let Some(number) = poses.values().iter().find(|number| !number.is_finite()) {
                return Err(wrong("posedirs", "finite numbers", number.to_string()));
            }
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
        let body = Self {
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
        };
        match body.misplaced() {
            None => Ok(body),
            Some(misplaced) => {
                let key = match misplaced.part {
                    Part::Template => "v_template",
                    Part::ShapeDirs => "shapedirs",
                    Part::PoseDirs => "posedirs",
                    Part::Joints => "J_regressor",
                };
                Err(wrong(key, expected_extent(), misplaced.place))
            }
        }
    }
}

/// The arrays of a body file.
struct File<'a>(Archive<Cursor<&'a [u8]>>);

impl File<'_> {
    /// The kinematic tree must be SMPL's, or joints would turn about the wrong parents.
    fn check_tree(&mut self) -> Result<(), BodyError> {
        let table = self
            .0
            .integers("kintree_table", &[Some(2), Some(JOINT_COUNT)])?;
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

    /// The directions of the shape coefficients that are kept.
    fn shapes(&mut self, n_vertices: usize) -> Result<Array<f64>, BodyError> {
        let expected = [Some(n_vertices), Some(3), None];
        let most = [usize::MAX, usize::MAX, SHAPE_COUNT];
        match self.0.shape("shapedirs")?.get(2) {
            Some(&count) if count == 0 || count > MAX_SHAPES => Err(wrong(
                "shapedirs",
                format!("1 to {MAX_SHAPES} coefficients"),
                count.to_string(),
            )),
            _ => Ok(self.0.floats_within("shapedirs", &expected, &most)?),
        }
    }

    fn faces(&mut self, n_vertices: usize) -> Result<Vec<[u32; 3]>, BodyError> {
        let count = self.0.shape("f")?.first().copied().unwrap_or(0);
        if count > MAX_FACES {
            let expected = format!("at most {MAX_FACES} faces");
            return Err(wrong("f", expected, count.to_string()));
        }
        let table = self.0.integers("f", &[Some(count), Some(3)])?;
        if let Some(index) = table
            .values()
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

fn wrong(key: &str, expected: impl Into<String>, got: impl Into<String>) -> BodyError {
    NpzError::array(key, expected, got).into()
}

/// Points of `[V,3]`, or of one row of `[V,3,rows]`.
fn field<T: Copy + Into<f64>>(
    array: &Array<T>,
    n_vertices: usize,
    row: Option<usize>,
) -> Vec<DVec3> {
    (0..n_vertices)
        .map(|vertex| {
            DVec3::from_array([0, 1, 2].map(|axis| match row {
                Some(row) => array.at(&[vertex, axis, row]).into(),
                None => array.at(&[vertex, axis]).into(),
            }))
        })
        .collect()
}

fn regressed(regressor: &Array<f64>, points_m: &[DVec3]) -> [DVec3; JOINT_COUNT] {
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

fn skin(weights: &Array<f64>) -> Result<Vec<SkinWeights>, BodyError> {
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
                    "a positive weight at every vertex",
                    format!("none at vertex {vertex}"),
                ))
            }
        })
        .collect()
}

fn narrow(points_m: &[DVec3]) -> Vec<Vec3> {
    points_m.iter().map(|point| point.as_vec3()).collect()
}
