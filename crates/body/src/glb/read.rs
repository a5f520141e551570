//! Reads a body from GLB, trusting nothing.

use dynaskin_glb::{Document, GlbError, f32_at, i16_at};
use glam::Vec3;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::pose_dirs::is_step;
use super::{
    EXTRAS_VERSION, MAX_POSITION_M, MeshExtras, NORMALIZED, POSITION_STEP_M, THICKNESS_STEP_M,
};
use crate::model::expected_extent;
use crate::{
    BodyError, BodyModel, JOINT_COUNT, POSE_DIR_COUNT, REGION_COUNT, SHAPE_COUNT, SkinWeights,
};

/// More vertices or faces than any body of ours, so that sizes stay within 16-bit indices.
const MAX_VERTICES: usize = 65_535;

impl BodyModel {
    /// Reads a body written by [`BodyModel::to_glb`].
    ///
    /// # Errors
    /// [`BodyError::Glb`] says which part is missing, out of range or of the wrong type.
    pub fn from_glb(bytes: &[u8]) -> Result<Self, BodyError> {
        BodyReader {
            file: Document::parse(bytes)?,
        }
        .body()
    }
}

fn bad(place: impl Into<String>, expected: impl Into<String>) -> BodyError {
    GlbError::new(place, expected).into()
}

struct BodyReader<'a> {
    file: Document<'a>,
}

impl BodyReader<'_> {
    fn body(&self) -> Result<BodyModel, BodyError> {
        let mesh = self
            .file
            .root
            .meshes
            .first()
            .ok_or_else(|| bad("meshes", "one mesh"))?;
        let extras = mesh.extras.as_ref().ok_or_else(|| {
            bad(
                "mesh 0 extras",
                "`dynaskin` (build the file with `dynaskin body build`)",
            )
        })?;
        let extras: MeshExtras = serde_json::from_str(extras.get()).map_err(|error| {
            bad(
                "mesh 0 extras",
                format!("`dynaskin` of this version ({error})"),
            )
        })?;
        let extras = extras.dynaskin;
        if extras.version != EXTRAS_VERSION {
            return Err(bad(
                "mesh 0 extras",
                format!("dynaskin version {EXTRAS_VERSION}"),
            ));
        }
        let primitive = mesh
            .primitives
            .first()
            .ok_or_else(|| bad("mesh 0", "one primitive"))?;
        let attribute = |semantic: Semantic, name: &str| {
            primitive
                .attributes
                .get(&Checked::Valid(semantic))
                .map(|index| index.value())
                .ok_or_else(|| bad("mesh 0", format!("attribute {name}")))
        };

        let template_m = self.positions(attribute(Semantic::Positions, "POSITION")?)?;
        let n_vertices = template_m.len();
        if n_vertices == 0 || n_vertices > MAX_VERTICES {
            return Err(bad("POSITION", format!("1 to {MAX_VERTICES} vertices")));
        }
        let indices = primitive.indices.ok_or_else(|| bad("mesh 0", "indices"))?;
        let faces = self.faces(indices.value(), n_vertices)?;
        let skin = self.skin(
            attribute(Semantic::Joints(0), "JOINTS_0")?,
            attribute(Semantic::Weights(0), "WEIGHTS_0")?,
            n_vertices,
        )?;
        let colors_srgba = match (extras.colors, attribute(Semantic::Colors(0), "COLOR_0")) {
            (Some(accessor), _) => self.painted_colors(accessor, n_vertices)?,
            (None, Ok(accessor)) => self.colors(accessor, n_vertices)?,
            (None, Err(_)) => Vec::new(),
        };
        let targets = primitive.targets.as_deref().unwrap_or_default();
        if targets.len() != SHAPE_COUNT {
            return Err(bad(
                "mesh 0 targets",
                format!("{SHAPE_COUNT} morph targets"),
            ));
        }
        let shape_dirs_m = targets
            .iter()
            .map(|target| {
                let positions = target
                    .positions
                    .ok_or_else(|| bad("mesh 0 targets", "POSITION"))?;
                self.steps(positions.value(), Some(n_vertices))
            })
            .collect::<Result<Vec<_>, _>>()?;

        let joints_m = self.vec3_f32(extras.joint_template, JOINT_COUNT)?;
        let joint_dirs_m = self.vec3_f32(extras.joint_shape_dirs, JOINT_COUNT * SHAPE_COUNT)?;
        let (thickness_template_m, thickness_shape_dirs_m) = match extras.thickness {
            Some(accessor) => self.thickness(accessor, n_vertices)?,
            None => (Vec::new(), Vec::new()),
        };
        let region_weights = match extras.region_weights {
            Some(accessor) => self.region_weights(accessor, n_vertices)?,
            None => Vec::new(),
        };
        let pose_dirs_m = match (extras.pose_dirs, extras.pose_dir_steps) {
            (Some(dirs), Some(steps)) => self.pose_dirs(dirs, steps, n_vertices)?,
            (None, None) => Vec::new(),
            _ => return Err(bad("pose_dirs", "`pose_dirs` with `pose_dir_steps`")),
        };
        let body = BodyModel {
            name: extras.name,
            copyright: self.file.root.asset.copyright.clone().unwrap_or_default(),
            template_m,
            faces,
            shape_dirs_m,
            pose_dirs_m,
            joint_template_m: std::array::from_fn(|joint| joints_m[joint]),
            joint_shape_dirs_m: joint_dirs_m
                .chunks_exact(JOINT_COUNT)
                .map(|row| std::array::from_fn(|joint| row[joint]))
                .collect(),
            skin,
            thickness_template_m,
            thickness_shape_dirs_m,
            region_weights,
            colors_srgba,
        };
        match body.misplaced() {
            None => Ok(body),
            Some(misplaced) => Err(bad(misplaced.place, expected_extent())),
        }
    }

    fn steps(&self, index: usize, count: Option<usize>) -> Result<Vec<Vec3>, BodyError> {
        let elements = self.file.elements(index, ComponentType::I16, Type::Vec3)?;
        let elements = match count {
            Some(count) => elements.exactly(count, "positions")?,
            None => elements,
        };
        // Rounding to steps gives back exactly what was written.
        let accessor = self.file.root.accessors.get(index);
        let per_step = match accessor.is_some_and(|accessor| accessor.normalized) {
            true => POSITION_STEP_M * NORMALIZED,
            false => 1.0,
        };
        Ok(elements
            .iter()
            .map(|e| {
                let whole = Vec3::from_array([0, 1, 2].map(|axis| f32::from(i16_at(e, axis))));
                (whole / per_step).round() * POSITION_STEP_M
            })
            .collect())
    }

    /// Rest positions: metres, or steps as earlier versions wrote.
    fn positions(&self, index: usize) -> Result<Vec<Vec3>, BodyError> {
        let Ok(elements) = self.file.elements(index, ComponentType::F32, Type::Vec3) else {
            return self.steps(index, None);
        };
        let positions_m: Vec<Vec3> = elements
            .iter()
            .map(|e| Vec3::new(f32_at(e, 0), f32_at(e, 1), f32_at(e, 2)))
            .collect();
        let fits = |p: &Vec3| p.abs().max_element() <= MAX_POSITION_M && p.is_finite();
        if positions_m.iter().all(fits) {
            return Ok(positions_m);
        }
        Err(bad("POSITION", format!("metres up to {MAX_POSITION_M}")))
    }

    fn vec3_f32(&self, index: usize, count: usize) -> Result<Vec<Vec3>, BodyError> {
        let values: Vec<Vec3> = self
            .file
            .elements(index, ComponentType::F32, Type::Vec3)?
            .exactly(count, "joints")?
            .iter()
            .map(|e| Vec3::new(f32_at(e, 0), f32_at(e, 1), f32_at(e, 2)))
            .collect();
        if values.iter().any(|value| !value.is_finite()) {
            return Err(bad(format!("accessor {index}"), "finite numbers"));
        }
        Ok(values)
    }

    fn faces(&self, index: usize, n_vertices: usize) -> Result<Vec<[u32; 3]>, BodyError> {
        let indices: Vec<u32> = self
            .file
            .elements(index, ComponentType::U16, Type::Scalar)?
            .iter()
            .map(|e| u32::from(u16::from_le_bytes([e[0], e[1]])))
            .collect();
        if !indices.len().is_multiple_of(3) || indices.iter().any(|&v| v as usize >= n_vertices) {
            return Err(bad(
                "indices",
                format!("triangles over {n_vertices} vertices"),
            ));
        }
        Ok(indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect())
    }

    fn skin(
        &self,
        joints: usize,
        weights: usize,
        n_vertices: usize,
    ) -> Result<Vec<SkinWeights>, BodyError> {
        let joints = self
            .file
            .elements(joints, ComponentType::U8, Type::Vec4)?
            .exactly(n_vertices, "JOINTS_0")?;
        let weights = self
            .file
            .elements(weights, ComponentType::F32, Type::Vec4)?
            .exactly(n_vertices, "WEIGHTS_0")?;
        joints
            .iter()
            .zip(weights.iter())
            .map(|(joints, weights)| {
                let skin = SkinWeights {
                    joints: [joints[0], joints[1], joints[2], joints[3]],
                    weights: std::array::from_fn(|slot| f32_at(weights, slot)),
                };
                let sum: f32 = skin.weights.iter().sum();
                let valid = skin
                    .joints
                    .iter()
                    .all(|&joint| (joint as usize) < JOINT_COUNT)
                    && skin.weights.iter().all(|weight| *weight >= 0.0)
                    && (sum - 1.0).abs() < 1e-3;
                valid
                    .then_some(skin)
                    .ok_or_else(|| bad("JOINTS_0, WEIGHTS_0", "24 joints, weights summing to 1"))
            })
            .collect()
    }

    fn colors(&self, index: usize, n_vertices: usize) -> Result<Vec<[u8; 4]>, BodyError> {
        Ok(self
            .file
            .elements(index, ComponentType::U8, Type::Vec4)?
            .exactly(n_vertices, "COLOR_0")?
            .iter()
            .map(|e| [srgb(e[0]), srgb(e[1]), srgb(e[2]), e[3]])
            .collect())
    }

    fn painted_colors(&self, index: usize, n_vertices: usize) -> Result<Vec<[u8; 4]>, BodyError> {
        Ok(self
            .file
            .elements(index, ComponentType::U8, Type::Vec4)?
            .exactly(n_vertices, "colors")?
            .iter()
            .map(|e| [e[0], e[1], e[2], e[3]])
            .collect())
    }

    /// Thickness at β = 0 and its directions.
    fn thickness(
        &self,
        index: usize,
        n_vertices: usize,
    ) -> Result<(Vec<f32>, Vec<Vec<f32>>), BodyError> {
        let values: Vec<f32> = self
            .file
            .elements(index, ComponentType::I16, Type::Scalar)?
            .exactly(n_vertices * (SHAPE_COUNT + 1), "thickness")?
            .iter()
            .map(|e| f32::from(i16_at(e, 0)) * THICKNESS_STEP_M)
            .collect();
        let (template, dirs) = values.split_at(n_vertices);
        let dirs = dirs.chunks_exact(n_vertices).map(<[f32]>::to_vec);
        Ok((template.to_vec(), dirs.collect()))
    }

    /// Pose correctives, `[field][vertex]`, in metres.
    fn pose_dirs(
        &self,
        dirs: usize,
        steps: usize,
        n_vertices: usize,
    ) -> Result<Vec<Vec<Vec3>>, BodyError> {
        let steps_m: Vec<f32> = self
            .file
            .elements(steps, ComponentType::F32, Type::Scalar)?
            .exactly(POSE_DIR_COUNT, "pose_dir_steps")?
            .iter()
            .map(|e| f32_at(e, 0))
            .collect();
        if !steps_m.iter().all(|step_m| is_step(*step_m)) {
            return Err(bad("pose_dir_steps", "powers of two in metres"));
        }
        let values: Vec<Vec3> = self
            .file
            .elements(dirs, ComponentType::I16, Type::Vec3)?
            .exactly(POSE_DIR_COUNT * n_vertices, "pose_dirs")?
            .iter()
            .map(|e| Vec3::from_array([0, 1, 2].map(|axis| f32::from(i16_at(e, axis)))))
            .collect();
        let fields = values.chunks_exact(n_vertices).zip(steps_m);
        Ok(fields
            .map(|(field, step_m)| field.iter().map(|value| *value * step_m).collect())
            .collect())
    }

    fn region_weights(&self, index: usize, n_vertices: usize) -> Result<Vec<Vec<f32>>, BodyError> {
        let bytes: Vec<u8> = self
            .file
            .elements(index, ComponentType::U8, Type::Scalar)?
            .exactly(n_vertices * REGION_COUNT, "region_weights")?
            .iter()
            .map(|element| element[0])
            .collect();
        let regions: Vec<&[u8]> = bytes.chunks_exact(n_vertices).collect();
        // Each region's rounding may lift the sum by half a step.
        let limit = 255 + REGION_COUNT as u32 / 2;
        let sum = |vertex: usize| -> u32 { regions.iter().map(|w| u32::from(w[vertex])).sum() };
        if (0..n_vertices).any(|vertex| sum(vertex) > limit) {
            return Err(bad("region_weights", "a sum of at most 1 at every vertex"));
        }
        let weight = |byte: &u8| f32::from(*byte) / 255.0;
        Ok(regions
            .iter()
            .map(|region| region.iter().map(weight).collect())
            .collect())
    }
}

/// Linear light to sRGB, 8 bits.
fn srgb(linear: u8) -> u8 {
    let linear = f32::from(linear) / 255.0;
    let c = if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (c * 255.0).round() as u8
}
