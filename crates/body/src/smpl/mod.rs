//! SMPL-family bodies from `.npz` files.
//!
//! Users bring their own licensed file; this project contains nothing of it. Keys and shapes are
//! those of the published files of SMPL (J is 24), SMPL-H (52) and SMPL-X (55): `v_template` [V,3],
//! `shapedirs` [V,3,S], `posedirs` [V,3,9(J-1)] (optional), `J_regressor` [J,V] or the fields of a
//! sparse matrix, `weights` [V,J], `kintree_table` [2,J], `f` [F,3]. Floats and integers have 32 or 64
//! bits, in C or Fortran order.

mod joints;
mod regressor;

use std::io::Cursor;

use dynaskin_npz::{Archive, Array, NpzError};
use glam::{DVec3, Vec3};

use crate::model::{Part, expected_extent};
use crate::{BodyError, BodyModel, JOINT_COUNT, Joint, POSE_DIR_COUNT, SHAPE_COUNT, SkinWeights};
use joints::Joints;
pub use joints::SmplLayout;
use regressor::Regressor;

/// More vertices than any body of the family (SMPL-X has 10,475).
const MAX_VERTICES: usize = 30_000;
const MAX_FACES: usize = 2 * MAX_VERTICES;
/// More shape coefficients than any published file (SMPL-X has 400).
const MAX_SHAPES: usize = 1_000;
/// Larger than any array of the family: `posedirs` of SMPL-X in double precision is 122 MB.
const MAX_ARRAY_BYTES: u64 = 256 << 20;

/// Contents of a file of the family.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SmplFile {
    /// Which body it is.
    pub layout: SmplLayout,
    /// Shape coefficients of the file, of which ten are kept.
    pub shape_count: usize,
    /// Pose corrective fields of the file; 0 where it has none.
    pub pose_dir_count: usize,
    /// How many of the file's joints became part of a hand or of the head.
    pub folded: Vec<(Joint, usize)>,
    /// Whether the joint regressor came as a sparse matrix's fields.
    pub has_sparse_regressor: bool,
}

impl BodyModel {
    /// Reads a body of the SMPL family with SMPL's 24 joints.
    ///
    /// Only the first ten shape coefficients are kept (fewer are filled up with zeros), and the
    /// four largest weights of each vertex, renormalised. The skin of the fingers of SMPL-H and SMPL-X
    /// moves with the hand, that of jaw and eyes with the head, and their pose correctives are left
    /// out. The body is moved so that, as for the default bodies, the origin lies on the floor under
    /// the pelvis. Under every shape the vertex that is lowest at β = 0 stays at y = 0, which moves
    /// SMPL's `trans` by a constant per shape. The model has neither thickness, regions nor colours.
    ///
    /// # Errors
    /// [`BodyError::Npz`] if the bytes are not such an archive or an array is missing, of another
    /// type or shape, or its numbers are no body's, for example millimetres; [`BodyError::Pickle`]
    /// for pickles, the format in which SMPL is published.
    pub fn from_smpl_npz(bytes: &[u8]) -> Result<Self, BodyError> {
        Ok(Self::read_smpl_npz(bytes)?.0)
    }

    /// As [`Self::from_smpl_npz`], and describes the file.
    ///
    /// # Errors
    /// As [`Self::from_smpl_npz`].
    pub fn read_smpl_npz(bytes: &[u8]) -> Result<(Self, SmplFile), BodyError> {
        if is_pickle(bytes) {
            return Err(BodyError::Pickle);
        }
        let mut file = File(Archive::open(Cursor::new(bytes), MAX_ARRAY_BYTES)?);
        let n_vertices = file.vertex_count()?;
        let template = file.0.floats("v_template", &[Some(n_vertices), Some(3)])?;
        let joints = Joints::read(&mut file.0)?;
        let faces = file.faces(n_vertices)?;
        let regressor = Regressor::read(&mut file.0, &joints, n_vertices)?;
        let shape = [Some(n_vertices), Some(joints.count())];
        let weights = file.0.floats("weights", &shape)?;
        let (shapes, shape_count) = file.shapes(n_vertices)?;
        let pose_dirs_m = file.pose_dirs_m(&joints, n_vertices)?;

        let mut template_m = field(&template, n_vertices, None);
        let lowest = lowest_vertex(&template_m);
        let mut joints_m = regressor.joints_m(&template_m);
        let mut shape_dirs_m = Vec::with_capacity(SHAPE_COUNT);
        let mut joint_shape_dirs_m = Vec::with_capacity(SHAPE_COUNT);
        for coefficient in 0..SHAPE_COUNT {
            let mut dirs_m = if coefficient < shapes.shape[2] {
                field(&shapes, n_vertices, Some(coefficient))
            } else {
                vec![DVec3::ZERO; n_vertices]
            };
            let mut joint_dirs_m = regressor.joints_m(&dirs_m);
            ground(&mut dirs_m, &mut joint_dirs_m, lowest);
            shape_dirs_m.push(narrow(&dirs_m));
            joint_shape_dirs_m.push(joint_dirs_m.map(|dir| dir.as_vec3()));
        }
        ground(&mut template_m, &mut joints_m, lowest);
        let found = SmplFile {
            layout: joints.layout,
            shape_count,
            pose_dir_count: if pose_dirs_m.is_empty() {
                0
            } else {
                joints.pose_dir_counts().0
            },
            folded: joints.folded(),
            has_sparse_regressor: regressor.is_sparse,
        };
        let body = Self {
            name: "smpl".to_owned(),
            copyright: String::new(),
            template_m: narrow(&template_m),
            faces,
            shape_dirs_m,
            pose_dirs_m,
            joint_template_m: joints_m.map(|joint| joint.as_vec3()),
            joint_shape_dirs_m,
            skin: skin(&weights, &joints)?,
            thickness_template_m: Vec::new(),
            thickness_shape_dirs_m: Vec::new(),
            region_weights: Vec::new(),
            colors_srgba: Vec::new(),
        };
        match body.misplaced() {
            None => Ok((body, found)),
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

/// Whether the bytes begin as Python's pickles do, of its binary protocols or of its first.
fn is_pickle(bytes: &[u8]) -> bool {
    matches!(bytes, [0x80, 2..=5, ..] | [b'(' | b'c', ..])
}

/// The arrays of a body file.
struct File<'a>(Archive<Cursor<&'a [u8]>>);

impl File<'_> {
    fn vertex_count(&mut self) -> Result<usize, BodyError> {
        let count = self.0.shape("v_template")?.first().copied().unwrap_or(0);
        if count == 0 || count > MAX_VERTICES {
            let expected = format!("1 to {MAX_VERTICES} vertices");
            return Err(wrong("v_template", expected, count.to_string()));
        }
        Ok(count)
    }

    /// The pose correctives of SMPL's joints, `[field][vertex]`; none where the file has none.
    fn pose_dirs_m(
        &mut self,
        joints: &Joints,
        n_vertices: usize,
    ) -> Result<Vec<Vec<Vec3>>, BodyError> {
        if !self.0.has("posedirs") {
            return Ok(Vec::new());
        }
        let (in_file, kept) = joints.pose_dir_counts();
        let mut dirs_m: Vec<Vec<Vec3>> = Vec::new();
        let shape = [Some(n_vertices), Some(3), Some(in_file)];
        let most = [usize::MAX, usize::MAX, kept];
        self.0
            .visit_floats("posedirs", &shape, &most, |index, value| {
                // Not before a number has come: a header alone is not worth the memory.
                if dirs_m.is_empty() {
                    dirs_m = vec![vec![Vec3::ZERO; n_vertices]; POSE_DIR_COUNT];
                }
                if let [vertex, axis, row] = index {
                    dirs_m[*row][*vertex][*axis] = value as f32;
                }
            })?;
        Ok(dirs_m)
    }

    /// The directions of the shape coefficients that are kept, and how many the file has.
    fn shapes(&mut self, n_vertices: usize) -> Result<(Array<f64>, usize), BodyError> {
        let expected = [Some(n_vertices), Some(3), None];
        let most = [usize::MAX, usize::MAX, SHAPE_COUNT];
        let count = self.0.shape("shapedirs")?.get(2).copied();
        match count {
            Some(count) if count == 0 || count > MAX_SHAPES => Err(wrong(
                "shapedirs",
                format!("1 to {MAX_SHAPES} coefficients"),
                count.to_string(),
            )),
            _ => {
                let shapes = self.0.floats_within("shapedirs", &expected, &most)?;
                Ok((shapes, count.unwrap_or(0)))
            }
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

fn skin(weights: &Array<f64>, joints: &Joints) -> Result<Vec<SkinWeights>, BodyError> {
    (0..weights.shape[0])
        .map(|vertex| {
            let mut dense = [0.0; JOINT_COUNT];
            for (joint, moved_by) in joints.moved_by.iter().enumerate() {
                dense[*moved_by as usize] += weights.at(&[vertex, joint]) as f32;
            }
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
