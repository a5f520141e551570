//! Writes a body as GLB.

use glam::{Mat4, Vec3};
use serde_json::{Value, json};

use super::painting::{self, Painting};
use super::pose_dirs::{self, Steps};
use super::{
    BodyExtras, EXTRAS_VERSION, MAX_POSITION_M, MeshExtras, NORMALIZED, POSITION_STEP_M,
    THICKNESS_STEP_M,
};
use crate::normals::vertex_normals;
use crate::{BodyError, BodyModel, JOINT_COUNT, Joint, POSE_DIR_COUNT, REGION_COUNT, SHAPE_COUNT};

const I16: u32 = 5122;
const U8: u32 = 5121;
const U16: u32 = 5123;
const F32: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Step of normals. Finer ones cost more when files are compressed, and nobody sees them.
const NORMAL_STEP: f32 = 1.0 / 2048.0;

/// The binary chunk and the accessors over it, one buffer view each.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// How one accessor is laid out.
struct Layout {
    component: u32,
    kind: &'static str,
    count: usize,
    /// Bytes from one element to the next where elements are padded.
    stride: Option<usize>,
    target: Option<u32>,
}

impl Buffer {
    fn push(&mut self, bytes: &[u8], layout: &Layout, more: Value) -> usize {
        self.align();
        let mut view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(),
        });
        if let Some(stride) = layout.stride {
            view["byteStride"] = json!(stride);
        }
        if let Some(target) = layout.target {
            view["target"] = json!(target);
        }
        let mut accessor = json!({
            "bufferView": self.views.len(), "componentType": layout.component,
            "type": layout.kind, "count": layout.count,
        });
        if let (Some(accessor), Some(more)) = (accessor.as_object_mut(), more.as_object()) {
            accessor.extend(more.clone());
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn vec3_f32(&mut self, values: &[Vec3], target: Option<u32>) -> usize {
        let layout = Layout {
            component: F32,
            kind: "VEC3",
            count: values.len(),
            stride: None,
            target,
        };
        self.push(bytemuck::cast_slice(values), &layout, json!({}))
    }

    /// Bytes that are no accessor; the index of their view.
    fn push_bytes(&mut self, bytes: &[u8]) -> usize {
        self.align();
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(),
        }));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn align(&mut self) {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
    }

    /// Positions in metres, rounded to steps.
    fn positions(&mut self, values_m: &[Vec3]) -> usize {
        let rounded: Vec<[f32; 3]> = values_m
            .iter()
            .map(|value| (in_steps(*value) * POSITION_STEP_M).to_array())
            .collect();
        let bounds = json!({
            "min": bound(&rounded, f32::min, f32::INFINITY),
            "max": bound(&rounded, f32::max, f32::NEG_INFINITY),
        });
        let layout = Layout {
            component: F32,
            kind: "VEC3",
            count: rounded.len(),
            stride: None,
            target: Some(ARRAY_BUFFER),
        };
        self.push(bytemuck::cast_slice(&rounded), &layout, bounds)
    }

    /// Numbers from -1 to 1 as whole ones, padded to 8 bytes as vertex attributes must be aligned to 4.
    fn normalized(&mut self, values: impl Iterator<Item = Vec3>, has_bounds: bool) -> usize {
        let whole: Vec<[i16; 4]> = values
            .map(|value| {
                let [x, y, z] = value.to_array().map(|x| (x * NORMALIZED).round() as i16);
                [x, y, z, 0]
            })
            .collect();
        let mut more = json!({ "normalized": true });
        if has_bounds {
            more["min"] = json!(bound::<i16, 4>(&whole, i16::min, i16::MAX));
            more["max"] = json!(bound::<i16, 4>(&whole, i16::max, i16::MIN));
        }
        let layout = Layout {
            component: I16,
            kind: "VEC3",
            count: whole.len(),
            stride: Some(8),
            target: Some(ARRAY_BUFFER),
        };
        self.push(bytemuck::cast_slice(&whole), &layout, more)
    }
}

fn in_steps(value_m: Vec3) -> Vec3 {
    (value_m / POSITION_STEP_M).round()
}

fn bound<T: Copy, const N: usize>(rows: &[[T; N]], fold: fn(T, T) -> T, from: T) -> [T; 3] {
    std::array::from_fn(|axis| rows.iter().map(|row| row[axis]).fold(from, fold))
}

impl BodyModel {
    /// The body as a GLB file; [`BodyModel::from_glb`] reads it back within half a step.
    ///
    /// # Errors
    /// [`BodyError::Unwritable`] where arrays disagree in length or numbers exceed the range of the
    /// steps.
    pub fn to_glb(&self) -> Result<Vec<u8>, BodyError> {
        self.check_writable()?;
        let pose_dirs = self.pose_dirs_in_steps()?;
        let mut buffer = Buffer::default();
        let n_vertices = self.vertex_count();
        let indices: Vec<u16> = self.faces.iter().flatten().map(|&v| v as u16).collect();
        let attribute = |component, kind| Layout {
            component,
            kind,
            count: n_vertices,
            stride: None,
            target: Some(ARRAY_BUFFER),
        };
        let index_layout = Layout {
            component: U16,
            kind: "SCALAR",
            count: indices.len(),
            stride: None,
            target: Some(ELEMENT_ARRAY_BUFFER),
        };
        let indices = buffer.push(bytemuck::cast_slice(&indices), &index_layout, json!({}));
        let position = buffer.positions(&self.template_m);
        let normals = vertex_normals(&self.template_m, &self.faces);
        let coarse = |normal: &Vec3| (*normal / NORMAL_STEP).round() * NORMAL_STEP;
        let normal = buffer.normalized(normals.iter().map(coarse), false);
        let joints: Vec<[u8; 4]> = self.skin.iter().map(|skin| skin.joints).collect();
        let joints = buffer.push(joints.as_flattened(), &attribute(U8, "VEC4"), json!({}));
        let weights: Vec<[f32; 4]> = self.skin.iter().map(|skin| skin.weights).collect();
        let weights = buffer.push(
            bytemuck::cast_slice(&weights),
            &attribute(F32, "VEC4"),
            json!({}),
        );
        let mut attributes = json!({
            "POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights,
        });
        let painting = Painting::of(self).map_err(|error| BodyError::Unwritable {
            what: "colours that fit into a PNG image",
            got: error.to_string(),
        })?;
        if let Some(painting) = &painting {
            let normalized = json!({ "normalized": true });
            let texels = bytemuck::cast_slice(&painting.texels);
            attributes["TEXCOORD_0"] =
                json!(buffer.push(texels, &attribute(U16, "VEC2"), normalized));
        } else if !self.colors_srgba.is_empty() {
            // glTF multiplies vertex colours in linear light.
            let linear: Vec<[u8; 4]> = self.colors_srgba.iter().map(|c| linear_color(*c)).collect();
            let normalized = json!({ "normalized": true });
            attributes["COLOR_0"] =
                json!(buffer.push(linear.as_flattened(), &attribute(U8, "VEC4"), normalized));
        }
        let targets: Vec<Value> = self
            .shape_dirs_m
            .iter()
            .map(|dirs| {
                let rounded = dirs.iter().map(|dir| in_steps(*dir) * POSITION_STEP_M);
                json!({ "POSITION": buffer.normalized(rounded, true) })
            })
            .collect();

        let extras = self.extras(&mut buffer, &pose_dirs, painting.is_some());
        let inverse_bind: Vec<[f32; 16]> = self
            .joint_template_m
            .iter()
            .map(|joint| Mat4::from_translation(-*joint).to_cols_array())
            .collect();
        let matrices = Layout {
            component: F32,
            kind: "MAT4",
            count: JOINT_COUNT,
            stride: None,
            target: None,
        };
        let inverse_bind = buffer.push(bytemuck::cast_slice(&inverse_bind), &matrices, json!({}));

        let mut nodes: Vec<Value> = Joint::ALL
            .iter()
            .map(|joint| self.joint_node(*joint))
            .collect();
        nodes.push(json!({ "name": self.name, "mesh": 0, "skin": 0 }));
        let names: Vec<String> = (0..targets.len()).map(|i| format!("shape_{i}")).collect();
        let mut mesh_extras = json!(extras);
        mesh_extras["targetNames"] = json!(names);
        let mut material =
            json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.7 } });
        if painting.is_some() {
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
        }
        let mut document = json!({
            "asset": self.asset(),
            "extensionsUsed": ["KHR_mesh_quantization"],
            "extensionsRequired": ["KHR_mesh_quantization"],
            "scene": 0,
            "scenes": [{ "nodes": [0, JOINT_COUNT] }],
            "nodes": nodes,
            "skins": [{ "joints": (0..JOINT_COUNT).collect::<Vec<_>>(), "skeleton": 0,
                        "inverseBindMatrices": inverse_bind }],
            "materials": [material],
            "meshes": [{ "name": self.name, "extras": mesh_extras,
                         "weights": vec![0.0; targets.len()],
                         "primitives": [{ "attributes": attributes, "indices": indices,
                                          "material": 0, "targets": targets }] }],
        });
        if let Some(painting) = &painting {
            let view = buffer.push_bytes(&painting.png);
            document["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
            document["samplers"] = json!([painting::SAMPLER]);
            document["textures"] = json!([{ "source": 0, "sampler": 0 }]);
        }
        document["accessors"] = json!(buffer.accessors);
        document["bufferViews"] = json!(buffer.views);
        document["buffers"] = json!([{ "byteLength": buffer.bytes.len() }]);
        Ok(container(document.to_string().into_bytes(), buffer.bytes))
    }

    fn check_writable(&self) -> Result<(), BodyError> {
        let count = self.vertex_count();
        let over_vertices = |len: usize| len == 0 || len == count;
        let fits_i16 = |x: f32, step_m: f32| (x / step_m).abs() <= f32::from(i16::MAX);
        let points_fit = |points: &[Vec3], most_m: f32| {
            let fits = |p: &Vec3| p.to_array().iter().all(|&x| x.abs() <= most_m);
            points.iter().all(fits)
        };
        let thickness_fits = |row: &Vec<f32>| {
            row.len() == count && row.iter().all(|&t| fits_i16(t, THICKNESS_STEP_M))
        };
        let checks = [
            (
                "1 to 65,535 vertices",
                (1..=usize::from(u16::MAX)).contains(&count),
            ),
            ("faces over the vertices", {
                self.faces.iter().flatten().all(|&v| (v as usize) < count)
            }),
            ("skin weights for every vertex", self.skin.len() == count),
            (
                "ten shape directions over the vertices and joints",
                self.shape_dirs_m.len() == SHAPE_COUNT
                    && self.joint_shape_dirs_m.len() == SHAPE_COUNT
                    && self.shape_dirs_m.iter().all(|dirs| dirs.len() == count),
            ),
            (
                "positions within 3.2 m",
                points_fit(&self.template_m, MAX_POSITION_M),
            ),
            (
                "shape directions within 1 m",
                self.shape_dirs_m.iter().all(|dirs| points_fit(dirs, 1.0)),
            ),
            (
                "no thickness, or eleven rows within 0.32 m",
                (self.thickness_template_m.is_empty() && self.thickness_shape_dirs_m.is_empty())
                    || thickness_fits(&self.thickness_template_m)
                        && self.thickness_shape_dirs_m.len() == SHAPE_COUNT
                        && self.thickness_shape_dirs_m.iter().all(thickness_fits),
            ),
            (
                "no region weights, or six rows over the vertices",
                self.region_weights.is_empty()
                    || self.region_weights.len() == REGION_COUNT
                        && self.region_weights.iter().all(|row| row.len() == count),
            ),
            (
                "no colours, or one per vertex",
                over_vertices(self.colors_srgba.len()),
            ),
            (
                "no pose correctives, or 207 fields over the vertices",
                self.pose_dirs_m.is_empty()
                    || self.pose_dirs_m.len() == POSE_DIR_COUNT
                        && self.pose_dirs_m.iter().all(|dirs| dirs.len() == count),
            ),
        ];
        match checks.iter().find(|(_, fits)| !fits) {
            None => Ok(()),
            Some((what, _)) => Err(self.unwritable(what)),
        }
    }

    fn unwritable(&self, what: &'static str) -> BodyError {
        let count = self.vertex_count();
        BodyError::Unwritable {
            what,
            got: format!("model `{}` of {count} vertices", self.name),
        }
    }

    fn pose_dirs_in_steps(&self) -> Result<Vec<Steps>, BodyError> {
        let fields = self.pose_dirs_m.iter();
        let steps: Option<Vec<Steps>> = fields.map(|dirs| pose_dirs::in_steps(dirs)).collect();
        steps.ok_or_else(|| self.unwritable("pose correctives in metres"))
    }

    /// Who made the file, and whose the body is.
    fn asset(&self) -> Value {
        let mut asset = json!({ "version": "2.0", "generator": "dynaskin body build" });
        if !self.copyright.is_empty() {
            asset["copyright"] = json!(self.copyright);
        }
        asset
    }

    fn extras(&self, buffer: &mut Buffer, pose_dirs: &[Steps], is_painting: bool) -> MeshExtras {
        let flat = |component, count| Layout {
            component,
            kind: "SCALAR",
            count,
            stride: None,
            target: None,
        };
        let thickness: Vec<i16> = std::iter::once(&self.thickness_template_m)
            .chain(&self.thickness_shape_dirs_m)
            .flatten()
            .map(|value| (value / THICKNESS_STEP_M).round() as i16)
            .collect();
        let regions: Vec<u8> = self
            .region_weights
            .iter()
            .flatten()
            .map(|w| (w * 255.0).round() as u8)
            .collect();
        MeshExtras {
            dynaskin: BodyExtras {
                version: EXTRAS_VERSION,
                name: self.name.clone(),
                joint_template: buffer.vec3_f32(&self.joint_template_m, None),
                joint_shape_dirs: buffer.vec3_f32(self.joint_shape_dirs_m.as_flattened(), None),
                thickness: (!thickness.is_empty()).then(|| {
                    let bytes = bytemuck::cast_slice(&thickness);
                    buffer.push(bytes, &flat(I16, thickness.len()), json!({}))
                }),
                region_weights: (!regions.is_empty())
                    .then(|| buffer.push(&regions, &flat(U8, regions.len()), json!({}))),
                colors: is_painting.then(|| {
                    let layout = Layout {
                        kind: "VEC4",
                        ..flat(U8, self.colors_srgba.len())
                    };
                    buffer.push(self.colors_srgba.as_flattened(), &layout, json!({}))
                }),
                pose_dirs: (!pose_dirs.is_empty()).then(|| {
                    let values: Vec<[i16; 3]> = pose_dirs
                        .iter()
                        .flat_map(|steps| steps.values.iter().copied())
                        .collect();
                    let layout = Layout {
                        kind: "VEC3",
                        ..flat(I16, values.len())
                    };
                    buffer.push(bytemuck::cast_slice(&values), &layout, json!({}))
                }),
                pose_dir_steps: (!pose_dirs.is_empty()).then(|| {
                    let steps_m: Vec<f32> = pose_dirs.iter().map(|steps| steps.step_m).collect();
                    buffer.push(
                        bytemuck::cast_slice(&steps_m),
                        &flat(F32, steps_m.len()),
                        json!({}),
                    )
                }),
            },
        }
    }

    fn joint_node(&self, joint: Joint) -> Value {
        let position = self.joint_template_m[joint as usize];
        let parent = joint
            .parent()
            .map_or(Vec3::ZERO, |parent| self.joint_template_m[parent as usize]);
        let children: Vec<usize> = Joint::ALL
            .iter()
            .filter(|child| child.parent() == Some(joint))
            .map(|child| *child as usize)
            .collect();
        let mut node =
            json!({ "name": joint.name(), "translation": (position - parent).to_array() });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        node
    }
}

fn linear_color([r, g, b, a]: [u8; 4]) -> [u8; 4] {
    let linear = |c: u8| {
        let c = f32::from(c) / 255.0;
        let c = if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        };
        (c * 255.0).round() as u8
    };
    [linear(r), linear(g), linear(b), a]
}

/// The GLB container: header, JSON chunk, binary chunk, each padded to 4 bytes.
fn container(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    while !json.len().is_multiple_of(4) {
        json.push(b' ');
    }
    while !binary.len().is_multiple_of(4) {
        binary.push(0);
    }
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut glb = Vec::with_capacity(length);
    glb.extend_from_slice(b"glTF");
    for word in [2, length as u32, json.len() as u32] {
        glb.extend_from_slice(&word.to_le_bytes());
    }
    glb.extend_from_slice(b"JSON");
    glb.extend_from_slice(&json);
    glb.extend_from_slice(&(binary.len() as u32).to_le_bytes());
    glb.extend_from_slice(b"BIN\0");
    glb.extend_from_slice(&binary);
    glb
}
