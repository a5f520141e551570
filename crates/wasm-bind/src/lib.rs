//! JavaScript bindings of bind, a separate file: pages that bind no avatar never download it.
//!
//! No algorithm, only conversions. Errors are thrown as an `Error` with a `code`.

use std::collections::HashMap;

use dynaskin_bind::{Avatar, BindError, BindOptions, EngineMesh, Joint, Node, bind_watched};
use dynaskin_body::BodyModel;
use glam::{DAffine3, DMat4};
use js_sys::{Error, Reflect};
use wasm_bindgen::prelude::*;

/// Version of these bindings, which the SDK compares with its own.
#[wasm_bindgen(js_name = bindVersion)]
pub fn bind_version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// An avatar as an engine has it, handed over piece by piece, then bound.
#[wasm_bindgen]
pub struct AvatarParts {
    avatar: Avatar,
    humanoid: HashMap<usize, String>,
}

#[wasm_bindgen]
impl AvatarParts {
    /// Without nodes and meshes.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::new_without_default)] // JavaScript has no use for it.
    pub fn new() -> Self {
        Self {
            avatar: Avatar {
                nodes: Vec::new(),
                meshes: Vec::new(),
            },
            humanoid: HashMap::new(),
        }
    }

    /// Adds a node: its name, VRM's name of it where it has one, its parent's number, and its matrix in
    /// the avatar's space, 16 numbers, column-major.
    ///
    /// # Errors
    /// Throws `argument` for a matrix of another length.
    #[wasm_bindgen(js_name = addNode)]
    pub fn add_node(
        &mut self,
        name: String,
        humanoid: Option<String>,
        parent: Option<u32>,
        matrix: &[f64],
    ) -> Result<(), JsValue> {
        let Ok(matrix) = <&[f64; 16]>::try_from(matrix) else {
            return Err(thrown("argument", "A matrix has 16 numbers."));
        };
        if let Some(humanoid) = humanoid {
            self.humanoid.insert(self.avatar.nodes.len(), humanoid);
        }
        self.avatar.nodes.push(Node {
            name,
            part_name: String::new(),
            parent: parent.map(|parent| parent as usize),
            world_from_node: DAffine3::from_mat4(DMat4::from_cols_array(matrix)),
        });
        Ok(())
    }

    /// Adds a skinned mesh: positions `[vertex][3]` in its own space, the same number of joints and
    /// weights for each vertex, triangles, the nodes that are its joints, and for each of them the matrix
    /// from the mesh's space to the joint's where the mesh was bound, 16 numbers, column-major.
    ///
    /// # Errors
    /// Throws `avatar` for arrays that do not belong together.
    #[allow(clippy::too_many_arguments)] // JavaScript hands over arrays, not objects of Rust.
    #[wasm_bindgen(js_name = addMesh)]
    pub fn add_mesh(
        &mut self,
        name: &str,
        material: &str,
        positions: &[f32],
        skin_joints: &[u16],
        skin_weights: &[f32],
        indices: &[u32],
        joints: &[u32],
        inverse_binds: &[f64],
    ) -> Result<(), JsValue> {
        let mesh = EngineMesh {
            name,
            material,
            positions,
            skin_joints,
            skin_weights,
            indices,
            joints,
            inverse_binds,
        };
        self.avatar.meshes.push(mesh.read().map_err(refused)?);
        Ok(())
    }

    /// Binds the tissue of a body, a GLB file, to the avatar, and gives the binding's bytes.
    ///
    /// `depicts`: what the avatar depicts. `bones`: pairs of the body's joint and the node that turns it.
    /// `progress` is called with the fraction that is done, 0 to 1.
    ///
    /// # Errors
    /// Throws `adult`, `avatar`, `humanoid`, `body`, and `argument` for joints that a body has not.
    pub fn bind(
        mut self,
        body_glb: &[u8],
        depicts: Option<String>,
        bones: Vec<String>,
        progress: &js_sys::Function,
    ) -> Result<Vec<u8>, JsValue> {
        let body =
            BodyModel::from_glb(body_glb).map_err(|error| thrown("body", &error.to_string()))?;
        let options = BindOptions {
            depicts,
            bones: named(&bones)?,
        };
        let mut tell = |done: f64| {
            // Whoever listens cannot stop the work, so its errors are of no use here.
            let _ = progress.call1(&JsValue::NULL, &done.into());
        };
        self.avatar.name_parts(self.humanoid);
        let bound = bind_watched(&self.avatar, &body, &options, &mut tell).map_err(refused)?;
        Ok(bound.binding.to_bytes())
    }
}

fn named(pairs: &[String]) -> Result<Vec<(Joint, String)>, JsValue> {
    let named = pairs.chunks_exact(2).map(|pair| {
        let joint = Joint::from_name(&pair[0]).ok_or_else(|| {
            let joints: Vec<&str> = Joint::ALL.iter().map(|joint| joint.name()).collect();
            let joints = joints.join(", ");
            thrown(
                "argument",
                &format!("The body has no joint `{}`; it has {joints}.", pair[0]),
            )
        })?;
        Ok((joint, pair[1].clone()))
    });
    named.collect()
}

fn refused(error: BindError) -> JsValue {
    thrown(error.code(), &error.to_string())
}

fn thrown(code: &str, message: &str) -> JsValue {
    let error = Error::new(message);
    // Setting a property of a fresh object cannot fail; if it did, the message still says it.
    let _ = Reflect::set(&error, &"code".into(), &code.into());
    error.into()
}
