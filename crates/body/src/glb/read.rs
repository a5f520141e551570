//! Reads a body from GLB, trusting nothing.

use glam::Vec3;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::{EXTRAS_VERSION, MeshExtras, POSITION_STEP_M, THICKNESS_STEP_M};
use crate::{BodyError, BodyModel, JOINT_COUNT, REGION_COUNT, SHAPE_COUNT, SkinWeights};

/// More vertices or faces than any body of ours, so that sizes stay within 16-bit indices.
const MAX_VERTICES: usize = 65_535;

impl BodyModel {
    /// Reads a body written by [`BodyModel::to_glb`].
    ///
    /// # Errors
    /// [`BodyError::Glb`] says which part is missing, out of range or of the wrong type.
    pub fn from_glb(bytes: &[u8]) -> Result<Self, BodyError> {
        check_length(bytes)?;
        let glb = gltf::binary::Glb::from_slice(bytes)
            .map_err(|error| bad("container", format!("a binary glTF 2.0 file ({error})")))?;
        let root = gltf::json::Root::from_slice(&glb.json)
            .map_err(|error| bad("JSON chunk", format!("a glTF 2.0 document ({error})")))?;
        let binary = glb
            .bin
            .as_deref()
            .ok_or_else(|| bad("BIN chunk", "a binary buffer"))?;
        Document {
            root: &root,
            binary,
        }
        .body()
    }
}

fn bad(place: impl Into<String>, expected: impl Into<String>) -> BodyError {
    BodyError::Glb {
        place: place.into(),
        expected: expected.into(),
    }
}

/// The `gltf` crate subtracts the header's size from the length written there unchecked.
fn check_length(bytes: &[u8]) -> Result<(), BodyError> {
    let written = match bytes.get(8..12) {
        Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]) as usize,
        _ => 0,
    };
    if written < 12 || written > bytes.len() {
        return Err(bad(
            "container",
            format!(
                "a header that gives the file's length, {} bytes",
                bytes.len()
            ),
        ));
    }
    Ok(())
}

struct Document<'a> {
    root: &'a gltf::json::Root,
    binary: &'a [u8],
}

/// The bytes of one accessor's elements.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |idx| &bytes[idx * stride..idx * stride + size])
    }
}

fn f32_at(element: &[u8], idx: usize) -> f32 {
    let at = idx * 4;
    f32::from_le_bytes([
        element[at],
        element[at + 1],
        element[at + 2],
        element[at + 3],
    ])
}

fn i16_at(element: &[u8], idx: usize) -> i16 {
    i16::from_le_bytes([element[idx * 2], element[idx * 2 + 1]])
}

impl Document<'_> {
    fn body(&self) -> Result<BodyModel, BodyError> {
        let mesh = self
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

        let template_m = self.steps(attribute(Semantic::Positions, "POSITION")?, None)?;
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
        let colors_srgba = match attribute(Semantic::Colors(0), "COLOR_0") {
            Ok(accessor) => self.colors(accessor, n_vertices)?,
            Err(_) => Vec::new(),
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
        Ok(BodyModel {
            name: extras.name,
            template_m,
            faces,
            shape_dirs_m,
            pose_dirs_m: Vec::new(),
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
        })
    }

    /// The elements of accessor `index`, after checking its type and that it lies in the buffer.
    fn elements(
        &self,
        index: usize,
        component: ComponentType,
        kind: Type,
    ) -> Result<Elements<'_>, BodyError> {
        let place = || format!("accessor {index}");
        let accessor = self
            .root
            .accessors
            .get(index)
            .ok_or_else(|| bad(place(), "an accessor"))?;
        let found_component = match &accessor.component_type {
            Checked::Valid(found) => found.0,
            Checked::Invalid => return Err(bad(place(), "a known component type")),
        };
        if found_component != component || accessor.type_ != Checked::Valid(kind) {
            return Err(bad(place(), format!("{kind:?} of {component:?}")));
        }
        if accessor.sparse.is_some() {
            return Err(bad(place(), "no sparse storage"));
        }
        let view = accessor
            .buffer_view
            .and_then(|view| self.root.buffer_views.get(view.value()))
            .ok_or_else(|| bad(place(), "a buffer view"))?;
        if view.buffer.value() != 0 {
            return Err(bad(place(), "the file's own buffer"));
        }
        let size = component.size() * kind.multiplicity();
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let view_start = view.byte_offset.map_or(0, |offset| offset.0);
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let range = || -> Option<&[u8]> {
            let view_start = usize::try_from(view_start).ok()?;
            let view_end = view_start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
            let view = self.binary.get(view_start..view_end)?;
            let needed = match count {
                0 => 0,
                _ => (count - 1).checked_mul(stride)?.checked_add(size)?,
            };
            let bytes = view.get(usize::try_from(offset).ok()?..)?;
            (stride >= size && bytes.len() >= needed).then_some(bytes)
        };
        let bytes = range().ok_or_else(|| bad(place(), "data inside the BIN chunk"))?;
        Ok(Elements {
            bytes,
            stride,
            size,
            count,
        })
    }

    fn steps(&self, index: usize, count: Option<usize>) -> Result<Vec<Vec3>, BodyError> {
        let elements = self.elements(index, ComponentType::I16, Type::Vec3)?;
        let elements = match count {
            Some(count) => elements.exactly(count, "positions")?,
            None => elements,
        };
        Ok(elements
            .iter()
            .map(|e| {
                let steps = [i16_at(e, 0), i16_at(e, 1), i16_at(e, 2)];
                Vec3::from_array(steps.map(f32::from)) * POSITION_STEP_M
            })
            .collect())
    }

    fn vec3_f32(&self, index: usize, count: usize) -> Result<Vec<Vec3>, BodyError> {
        let values: Vec<Vec3> = self
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
            .elements(joints, ComponentType::U8, Type::Vec4)?
            .exactly(n_vertices, "JOINTS_0")?;
        let weights = self
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
            .elements(index, ComponentType::U8, Type::Vec4)?
            .exactly(n_vertices, "COLOR_0")?
            .iter()
            .map(|e| [srgb(e[0]), srgb(e[1]), srgb(e[2]), e[3]])
            .collect())
    }

    /// Thickness at β = 0 and its directions.
    fn thickness(
        &self,
        index: usize,
        n_vertices: usize,
    ) -> Result<(Vec<f32>, Vec<Vec<f32>>), BodyError> {
        let values: Vec<f32> = self
            .elements(index, ComponentType::I16, Type::Scalar)?
            .exactly(n_vertices * (SHAPE_COUNT + 1), "thickness")?
            .iter()
            .map(|e| f32::from(i16_at(e, 0)) * THICKNESS_STEP_M)
            .collect();
        let (template, dirs) = values.split_at(n_vertices);
        let dirs = dirs.chunks_exact(n_vertices).map(<[f32]>::to_vec);
        Ok((template.to_vec(), dirs.collect()))
    }

    fn region_weights(&self, index: usize, n_vertices: usize) -> Result<Vec<Vec<f32>>, BodyError> {
        let bytes: Vec<u8> = self
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

impl<'a> Elements<'a> {
    fn exactly(self, count: usize, what: &str) -> Result<Elements<'a>, BodyError> {
        if self.count == count {
            Ok(self)
        } else {
            Err(bad(what, format!("{count} elements, got {}", self.count)))
        }
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
