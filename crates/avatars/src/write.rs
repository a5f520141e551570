//! Writes an avatar as GLB or VRM.

use glam::{DAffine3, DMat4, DVec3, Vec3};
use serde_json::{Value, json};

use crate::mesh::Mesh;
use crate::recipe::{Container, Recipe, Unit};
use crate::rig::Rig;

const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// The binary chunk and what points into it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// One attribute of a mesh: bytes of each vertex, a multiple of four.
struct Attribute {
    name: &'static str,
    accessor: Value,
    size: usize,
    bytes: Vec<u8>,
}

impl Buffer {
    fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        let mut view =
            json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, offset: usize, mut accessor: Value) -> usize {
        accessor["bufferView"] = json!(view);
        accessor["byteOffset"] = json!(offset);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn attributes(&mut self, attributes: &[Attribute], count: usize, interleaved: bool) -> Value {
        let mut of_mesh = json!({});
        if interleaved {
            let stride: usize = attributes.iter().map(|attribute| attribute.size).sum();
            let mut bytes = Vec::with_capacity(count * stride);
            for vertex in 0..count {
                for attribute in attributes {
                    let start = vertex * attribute.size;
                    bytes.extend_from_slice(&attribute.bytes[start..start + attribute.size]);
                }
            }
            let view = self.view(&bytes, Some(stride));
            let mut offset = 0;
            for attribute in attributes {
                of_mesh[attribute.name] =
                    json!(self.accessor(view, offset, attribute.accessor.clone()));
                offset += attribute.size;
            }
        } else {
            for attribute in attributes {
                let view = self.view(&attribute.bytes, Some(attribute.size));
                of_mesh[attribute.name] = json!(self.accessor(view, 0, attribute.accessor.clone()));
            }
        }
        of_mesh
    }
}

/// How positions are stored: a mesh's unit and origin.
struct Quantised {
    /// Metres per full scale of a 16-bit integer.
    extent_m: f64,
    centre_m: DVec3,
}

impl Quantised {
    fn new(mesh: &Mesh) -> Self {
        let low = mesh
            .positions_m
            .iter()
            .copied()
            .reduce(Vec3::min)
            .unwrap_or_default();
        let high = mesh
            .positions_m
            .iter()
            .copied()
            .reduce(Vec3::max)
            .unwrap_or_default();
        Self {
            extent_m: f64::from(0.5 * (high - low).max_element()).max(1e-6),
            centre_m: (0.5 * (low + high)).as_dvec3(),
        }
    }

    /// Metres from the mesh's own space.
    fn metres_from_mesh(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(
            DVec3::splat(self.extent_m),
            glam::DQuat::IDENTITY,
            self.centre_m,
        )
    }
}

/// The bytes of an avatar's file.
pub fn glb(recipe: &Recipe, rig: &Rig, meshes: &[Mesh]) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let units_per_metre = match recipe.unit {
        Unit::Metres => 1.0,
        Unit::Centimetres | Unit::Armature => 100.0,
    };
    let unit = DAffine3::from_scale(DVec3::splat(units_per_metre));
    let mut nodes = bone_nodes(rig, unit);
    let mut scene: Vec<usize> = vec![0];
    if recipe.unit == Unit::Armature {
        nodes.push(json!({"name": "Armature", "scale": [0.01, 0.01, 0.01], "children": [0]}));
        scene = vec![nodes.len() - 1];
    }
    let (mut all, mut skins) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let quantised = recipe.quantised.then(|| Quantised::new(mesh));
        let from_mesh = match &quantised {
            Some(quantised) => unit * quantised.metres_from_mesh(),
            None => DAffine3::IDENTITY,
        };
        let inverse_binds: Vec<u8> = rig
            .bones
            .iter()
            .flat_map(|bone| {
                let world = scaled(bone.world, units_per_metre);
                let inverse = DMat4::from(world.inverse() * from_mesh);
                inverse.to_cols_array().map(|x| (x as f32).to_le_bytes())
            })
            .flatten()
            .collect();
        let view = buffer.view(&inverse_binds, None);
        let matrices = json!({"componentType": F32, "type": "MAT4", "count": rig.bones.len()});
        let matrices = buffer.accessor(view, 0, matrices);
        skins.push(json!({
            "joints": (0..rig.bones.len()).collect::<Vec<_>>(),
            "inverseBindMatrices": matrices,
        }));
        all.push(primitive(
            &mut buffer,
            recipe,
            mesh,
            quantised.as_ref(),
            units_per_metre,
        ));
        scene.push(nodes.len());
        nodes.push(json!({"name": mesh.name, "mesh": all.len() - 1, "skin": skins.len() - 1}));
    }
    let mut root = json!({
        "asset": {"version": "2.0", "generator": "dynaskin avatars"},
        "scene": 0,
        "scenes": [{"nodes": scene}],
        "nodes": nodes,
        "meshes": all,
        "skins": skins,
        "materials": materials(recipe),
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.bytes.len()}],
    });
    if recipe.quantised {
        use_extensions(&mut root, &["KHR_mesh_quantization"]);
        root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    }
    add_humanoid(&mut root, recipe, rig);
    container(&root, &buffer.bytes)
}

/// Adds names to the extensions that the file says it uses.
fn use_extensions(root: &mut Value, names: &[&str]) {
    let used = root["extensionsUsed"].as_array().cloned();
    let names = names.iter().map(|name| json!(name));
    root["extensionsUsed"] = used.unwrap_or_default().into_iter().chain(names).collect();
}

/// Matt colours, linear, in the order of the meshes' numbers.
fn materials(recipe: &Recipe) -> Value {
    let colours: &[(&str, [f32; 3])] = if recipe.sportswear {
        &[
            ("skin", [0.46, 0.32, 0.25]),
            ("top", [0.03, 0.2, 0.24]),
            ("leggings", [0.035, 0.04, 0.06]),
            ("shoes", [0.06, 0.06, 0.07]),
        ]
    } else {
        &[("skin", [0.55, 0.6, 0.7]), ("suit", [0.2, 0.3, 0.45])]
    };
    let of = |(name, [red, green, blue]): &(&str, [f32; 3])| {
        json!({"name": name, "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9,
        // One sees into collars and sleeves.
        }, "doubleSided": recipe.sportswear})
    };
    colours.iter().map(of).collect()
}

fn scaled(world: DAffine3, units_per_metre: f64) -> DAffine3 {
    DAffine3 {
        matrix3: world.matrix3,
        translation: world.translation * units_per_metre,
    }
}

fn bone_nodes(rig: &Rig, unit: DAffine3) -> Vec<Value> {
    let units_per_metre = unit.matrix3.x_axis.x;
    let world = |bone: usize| scaled(rig.bones[bone].world, units_per_metre);
    (0..rig.bones.len())
        .map(|idx| {
            let bone = &rig.bones[idx];
            let local = match bone.parent {
                None => world(idx),
                Some(parent) => world(parent).inverse() * world(idx),
            };
            let (_, rotation, translation) = local.to_scale_rotation_translation();
            let children: Vec<usize> = (0..rig.bones.len())
                .filter(|child| rig.bones[*child].parent == Some(idx))
                .collect();
            let mut node = json!({
                "name": bone.name,
                "translation": translation.as_vec3().to_array(),
                "rotation": rotation.as_quat().to_array(),
            });
            if !children.is_empty() {
                node["children"] = json!(children);
            }
            node
        })
        .collect()
}

fn primitive(
    buffer: &mut Buffer,
    recipe: &Recipe,
    mesh: &Mesh,
    quantised: Option<&Quantised>,
    units_per_metre: f64,
) -> Value {
    let count = mesh.positions_m.len();
    let floats = |values: &[Vec3]| -> Vec<u8> {
        values
            .iter()
            .flat_map(|v| v.to_array())
            .flat_map(f32::to_le_bytes)
            .collect()
    };
    let position = match quantised {
        Some(quantised) => {
            let step = |position: &Vec3| {
                let inside = (position.as_dvec3() - quantised.centre_m) / quantised.extent_m;
                let [x, y, z] = (inside * 32_767.0).round().to_array().map(|x| x as i16);
                [x, y, z, 0].map(i16::to_le_bytes)
            };
            Attribute {
                name: "POSITION",
                accessor: json!({"componentType": I16, "type": "VEC3", "count": count,
                    "normalized": true, "min": [-32767, -32767, -32767], "max": [32767, 32767, 32767]}),
                size: 8,
                bytes: mesh.positions_m.iter().flat_map(step).flatten().collect(),
            }
        }
        None => {
            let placed: Vec<Vec3> = mesh
                .positions_m
                .iter()
                .map(|p| *p * units_per_metre as f32)
                .collect();
            let low = placed.iter().copied().reduce(Vec3::min).unwrap_or_default();
            let high = placed.iter().copied().reduce(Vec3::max).unwrap_or_default();
            Attribute {
                name: "POSITION",
                accessor: json!({"componentType": F32, "type": "VEC3", "count": count,
                    "min": low.to_array(), "max": high.to_array()}),
                size: 12,
                bytes: floats(&placed),
            }
        }
    };
    let normal = Attribute {
        name: "NORMAL",
        accessor: json!({"componentType": F32, "type": "VEC3", "count": count}),
        size: 12,
        bytes: floats(&mesh.normals),
    };
    let joint = |row: &[(u16, f32); 4]| row.map(|(bone, _)| bone as u8);
    let joints = Attribute {
        name: "JOINTS_0",
        accessor: json!({"componentType": U8, "type": "VEC4", "count": count}),
        size: 4,
        bytes: mesh.weights.iter().flat_map(joint).collect(),
    };
    let attributes = [position, normal, joints, weights(mesh, recipe.quantised)];
    let attributes = buffer.attributes(&attributes, count, recipe.interleaved);
    let corners = mesh.faces.iter().flatten();
    let (component, bytes): (u32, Vec<u8>) = if count <= usize::from(u16::MAX) {
        (
            U16,
            corners
                .flat_map(|corner| (*corner as u16).to_le_bytes())
                .collect(),
        )
    } else {
        (
            U32,
            corners.flat_map(|corner| corner.to_le_bytes()).collect(),
        )
    };
    let view = buffer.view(&bytes, None);
    let count = 3 * mesh.faces.len();
    let indices = json!({"componentType": component, "type": "SCALAR", "count": count});
    let indices = buffer.accessor(view, 0, indices);
    json!({
        "name": mesh.name,
        "primitives": [{
            "attributes": attributes, "indices": indices, "material": mesh.material,
        }],
    })
}

fn weights(mesh: &Mesh, is_quantised: bool) -> Attribute {
    let count = mesh.weights.len();
    if is_quantised {
        let bytes = mesh.weights.iter().flat_map(|row| {
            let mut bytes = row.map(|(_, weight)| (weight * 255.0).round() as u8);
            // They must sum to 255: the largest takes what rounding left.
            let others: u8 = bytes[1..].iter().sum();
            bytes[0] = 255 - others;
            bytes
        });
        return Attribute {
            name: "WEIGHTS_0",
            accessor: json!({"componentType": U8, "type": "VEC4", "count": count, "normalized": true}),
            size: 4,
            bytes: bytes.collect(),
        };
    }
    let bytes = mesh
        .weights
        .iter()
        .flat_map(|row| row.map(|(_, weight)| weight.to_le_bytes()));
    Attribute {
        name: "WEIGHTS_0",
        accessor: json!({"componentType": F32, "type": "VEC4", "count": count}),
        size: 16,
        bytes: bytes.flatten().collect(),
    }
}

fn add_humanoid(root: &mut Value, recipe: &Recipe, rig: &Rig) {
    let human = rig.bones.iter().enumerate();
    let human = human.filter_map(|(node, bone)| Some((node, bone.human?)));
    match recipe.container {
        Container::Glb => {}
        Container::Vrm0 => {
            let bones: Vec<Value> = human
                .map(|(node, bone)| json!({"bone": bone, "node": node}))
                .collect();
            use_extensions(root, &["VRM"]);
            root["extensions"] = json!({"VRM": {
                "specVersion": "0.0",
                "meta": {"title": recipe.name, "licenseName": "CC0"},
                "humanoid": {"humanBones": bones},
                "secondaryAnimation": {"boneGroups": [{"comment": "chest", "bones": rig.tissue,
                    "stiffiness": 1.0, "dragForce": 0.4, "gravityPower": 0.0,
                    "gravityDir": {"x": 0, "y": -1, "z": 0}, "center": -1, "hitRadius": 0.02,
                    "colliderGroups": []}], "colliderGroups": []},
            }});
        }
        Container::Vrm1 => {
            let mut bones = json!({});
            for (node, bone) in human {
                bones[bone] = json!({"node": node});
            }
            let springs: Vec<Value> = rig
                .tissue
                .iter()
                .map(|node| json!({"name": "chest", "joints": [{"node": node, "stiffness": 1.0}]}))
                .collect();
            use_extensions(root, &["VRMC_vrm", "VRMC_springBone"]);
            root["extensions"] = json!({
                "VRMC_vrm": {
                    "specVersion": "1.0",
                    "meta": {"name": recipe.name, "authors": ["dynaskin"],
                        "licenseUrl": "https://creativecommons.org/publicdomain/zero/1.0/"},
                    "humanoid": {"humanBones": bones},
                },
                "VRMC_springBone": {"specVersion": "1.0", "springs": springs},
            });
        }
    }
}

fn container(root: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((total as u32).to_le_bytes());
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}
