//! Bindings, and the tissue that they play on somebody else's avatar.

use dynaskin_binding::{Binding, BindingError, Player, Report, SOURCES_PER_LINE};
use glam::{DAffine3, DMat4, Vec3};
use serde_json::{Value, json};
use wasm_bindgen::prelude::*;

use crate::avatar::CoreAvatar;
use crate::error::Thrown;
use crate::model::CoreBody;
use crate::pose;

/// Numbers of a matrix.
const MATRIX: usize = 16;

/// What an avatar's vertices take from a body's, and which bones turn its joints.
#[wasm_bindgen]
pub struct CoreBinding {
    binding: Binding,
}

#[wasm_bindgen]
impl CoreBinding {
    /// Reads a binding for a body.
    ///
    /// # Errors
    /// Throws `binding` for bytes that are none, and for a binding of another body.
    #[wasm_bindgen(constructor)]
    pub fn new(bytes: &[u8], body: &CoreBody) -> Result<CoreBinding, JsValue> {
        let binding = Binding::from_bytes(bytes, &body.body).map_err(Thrown::from)?;
        Ok(Self { binding })
    }

    /// The body's shape under the avatar's skin, standard deviations.
    pub fn shape(&self) -> Vec<f32> {
        self.binding.shape.to_vec()
    }

    /// What was found.
    ///
    /// # Errors
    /// None in practice: the report is valid JSON.
    pub fn report(&self) -> Result<JsValue, JsValue> {
        js_sys::JSON::parse(&report_json(&self.binding.report).to_string())
    }

    /// The bones that turn joints: objects with `name`, and `mesh` and `joint` of a skin that has them.
    ///
    /// # Errors
    /// None in practice: the list is valid JSON.
    pub fn bones(&self) -> Result<JsValue, JsValue> {
        let bones = self.binding.rig.bones.iter().map(|bone| {
            json!({
                "name": bone.name,
                "mesh": bone.joint.map(|joint| joint.mesh),
                "joint": bone.joint.map(|joint| joint.joint),
            })
        });
        js_sys::JSON::parse(&Value::from_iter(bones).to_string())
    }

    /// The number of the mesh that has these positions in its own space, `[vertex][3]`; -1 where the
    /// binding has no such mesh.
    #[wasm_bindgen(js_name = meshOf)]
    pub fn mesh_of(&self, positions: &[f32]) -> i32 {
        let positions = positions.as_chunks::<3>().0;
        let positions: Vec<Vec3> = positions.iter().copied().map(Vec3::from_array).collect();
        let found = self.binding.mesh_of(&positions);
        found.map_or(-1, |mesh| mesh as i32)
    }
}

/// The tissue of one avatar on the meshes of another.
#[wasm_bindgen]
pub struct CoreTissue {
    player: Player,
    /// `[bone][16]`, column-major; the page writes them.
    world_from_bone: Vec<f64>,
    bones: Vec<DAffine3>,
}

#[wasm_bindgen]
impl CoreTissue {
    /// `avatar` must have the binding's shape and not have been stepped.
    #[wasm_bindgen(constructor)]
    pub fn new(binding: &CoreBinding, avatar: &CoreAvatar) -> CoreTissue {
        let mut avatar = avatar.avatar.borrow_mut();
        avatar.update_surface();
        let binding = binding.binding.clone();
        let count = binding.rig.bones.len();
        Self {
            player: Player::new(binding, avatar.model().body(), avatar.normals_rest()),
            world_from_bone: vec![0.0; MATRIX * count],
            bones: vec![DAffine3::IDENTITY; count],
        }
    }

    /// Address of the bones' matrices in the world, f64 `[bone][16]`, column-major, for the page to write.
    #[wasm_bindgen(js_name = bonesPtr)]
    pub fn bones_ptr(&self) -> usize {
        self.world_from_bone.as_ptr() as usize
    }

    /// Adds a surface of the binding's mesh number `mesh`: positions and normals as the engine has them,
    /// `[vertex][3]`, and how much each vertex takes of the tissue, 0 to 1. Normals may be empty for none,
    /// shares for 1. Gives the surface's number.
    ///
    /// # Errors
    /// Throws `binding` for arrays of another size than the mesh.
    #[wasm_bindgen(js_name = addSurface)]
    pub fn add_surface(
        &mut self,
        mesh: usize,
        positions: &[f32],
        normals: &[f32],
        shares: &[f32],
    ) -> Result<usize, JsValue> {
        let added = self.player.add_surface(mesh, positions, normals, shares);
        Ok(added.map_err(Thrown::from)?)
    }

    /// Gives a surface tangents as the engine has them, `[vertex][4]`.
    ///
    /// # Errors
    /// Throws `binding` for arrays of another size than the normals.
    #[wasm_bindgen(js_name = setTangents)]
    pub fn set_tangents(&mut self, surface: usize, tangents: &[f32]) -> Result<(), JsValue> {
        let set = self.player.set_tangents(surface, tangents);
        Ok(set.map_err(Thrown::from)?)
    }

    /// Address of a surface's positions, f32 `[vertex][3]`; 0 where there is none.
    #[wasm_bindgen(js_name = positionsPtr)]
    pub fn positions_ptr(&self, surface: usize) -> usize {
        let surface = self.player.surfaces().get(surface);
        surface.map_or(0, |surface| surface.positions().as_ptr() as usize)
    }

    /// Address of a surface's normals, f32 `[vertex][3]`; 0 where there is none.
    #[wasm_bindgen(js_name = normalsPtr)]
    pub fn normals_ptr(&self, surface: usize) -> usize {
        let surface = self.player.surfaces().get(surface);
        surface.map_or(0, |surface| surface.normals().as_ptr() as usize)
    }

    /// Address of a surface's tangents, f32 `[vertex][4]`; 0 where there is none.
    #[wasm_bindgen(js_name = tangentsPtr)]
    pub fn tangents_ptr(&self, surface: usize) -> usize {
        let surface = self.player.surfaces().get(surface);
        surface.map_or(0, |surface| surface.tangents().as_ptr() as usize)
    }

    /// Of a surface: the first vertex that moves, the one after the last, and how many move.
    pub fn moving(&self, surface: usize) -> Vec<u32> {
        let surface = self.player.surfaces().get(surface);
        surface.map_or_else(Vec::new, |surface| {
            let range = surface.moving();
            vec![range.start, range.end, surface.moving_count() as u32]
        })
    }

    /// Says whether a surface is seen; others stay as they are.
    pub fn show(&mut self, surface: usize, is_shown: bool) {
        self.player.show(surface, is_shown);
    }

    /// Leaves positions, normals and tangents of the surfaces as they are from now on, for a vertex stage that
    /// reads the changes by itself.
    #[wasm_bindgen(js_name = leaveSurfaces)]
    pub fn leave_surfaces(&mut self) {
        self.player.leave_surfaces();
    }

    /// Address of what the body's vertices that rows name have changed by, f32 `[source][8]`: metres and one
    /// unused number, of the unit normal and one unused number.
    #[wasm_bindgen(js_name = changesPtr)]
    pub fn changes_ptr(&self) -> usize {
        self.player.changes().as_ptr() as usize
    }

    /// Texels of a line of the texture that holds the changes, and its lines.
    #[wasm_bindgen(js_name = changesSize)]
    pub fn changes_size(&self) -> Vec<u32> {
        let lines = self.player.changes().len() / SOURCES_PER_LINE;
        vec![2 * SOURCES_PER_LINE as u32, lines as u32]
    }

    /// What a vertex stage needs to know of each vertex of a surface, from the first that moves to the last,
    /// f32 `[vertex][24]`: eight pairs of a place in the changes and a weight, the row's turn, the vertex's turn.
    ///
    /// # Errors
    /// Throws `binding` for a binding that has more than eight entries in a row.
    #[wasm_bindgen(js_name = vertexRows)]
    pub fn vertex_rows(&self, surface: usize) -> Result<Vec<f32>, JsValue> {
        Ok(self.player.vertex_rows(surface).map_err(Thrown::from)?)
    }

    /// From a row's offset to a surface's own unit and axes, and the same for normals: two times nine numbers,
    /// column-major.
    ///
    /// # Errors
    /// Throws `binding` for a surface that is not there.
    #[wasm_bindgen(js_name = meshFromRow)]
    pub fn mesh_from_row(&self, surface: usize) -> Result<Vec<f32>, JsValue> {
        let both = self.player.mesh_from_row(surface).map_err(Thrown::from)?;
        Ok(both.iter().flat_map(|one| one.to_cols_array()).collect())
    }

    /// Moves the avatar on by `dt_seconds` to the pose of the bones, and the surfaces with it.
    ///
    /// # Errors
    /// Throws as `CoreAvatar.step`; the surfaces then stay as they are.
    pub fn step(&mut self, avatar: &mut CoreAvatar, dt_seconds: f64) -> Result<(), JsValue> {
        self.read_bones();
        let binding = self.player.binding();
        let pose = {
            let inner = avatar.avatar.borrow();
            let size = f64::from(binding.size);
            let joints_m = inner.joints_rest_m();
            binding.rig.pose_of_bones(&self.bones, size, joints_m)
        };
        avatar.step_to(&pose, dt_seconds)?;
        self.refresh(avatar);
        Ok(())
    }

    /// Shows the avatar's present offsets.
    pub fn refresh(&mut self, avatar: &CoreAvatar) {
        let mut avatar = avatar.avatar.borrow_mut();
        avatar.update_surface();
        self.player
            .update(avatar.offsets_rest_m(), avatar.normals_rest());
    }

    /// How the bones turn for a pose of 99 numbers: quaternions in the space of the avatar's root,
    /// `[bone][4]`. Parents come before children.
    ///
    /// # Errors
    /// Throws `argument` for another length.
    #[wasm_bindgen(js_name = rotationsOf)]
    pub fn rotations_of(&self, avatar: &CoreAvatar, pose: &[f64]) -> Result<Vec<f64>, JsValue> {
        let pose = pose::from_numbers(pose)?;
        let avatar = avatar.avatar.borrow();
        let rig = &self.player.binding().rig;
        let rotations = rig.world_rotations(&pose, avatar.joints_rest_m());
        Ok(rotations.iter().flat_map(|turn| turn.to_array()).collect())
    }

    /// The bone that turns the pelvis, and how far to move it in the world so that the avatar, its bones
    /// turned and written, stands where a pose says in the space of its root (a matrix of 16 numbers).
    ///
    /// # Errors
    /// Throws `argument` for arrays of another length.
    #[wasm_bindgen(js_name = moveTo)]
    pub fn move_to(
        &mut self,
        avatar: &CoreAvatar,
        pose: &[f64],
        world_from_root: &[f64],
    ) -> Result<Vec<f64>, JsValue> {
        let pose = pose::from_numbers(pose)?;
        let Ok(root) = <&[f64; MATRIX]>::try_from(world_from_root) else {
            return Err(Thrown::argument("A matrix has 16 numbers.".to_owned()).into());
        };
        self.read_bones();
        let binding = self.player.binding();
        let avatar = avatar.avatar.borrow();
        let by = binding.rig.move_to(
            &pose,
            &self.bones,
            &DAffine3::from_mat4(DMat4::from_cols_array(root)),
            f64::from(binding.size),
            avatar.joints_rest_m(),
        );
        Ok(vec![binding.rig.pelvis_bone() as f64, by.x, by.y, by.z])
    }

    /// The pose of the bones as they were written, 99 numbers.
    ///
    /// # Errors
    /// None in practice.
    pub fn pose(&self, avatar: &CoreAvatar) -> Result<Vec<f64>, JsValue> {
        let binding = self.player.binding();
        let size = f64::from(binding.size);
        let avatar = avatar.avatar.borrow();
        let joints_m = avatar.joints_rest_m();
        let found = binding.rig.pose_of_bones(&self.bones, size, joints_m);
        let mut numbers = vec![0.0; pose::POSE_LENGTH];
        pose::to_numbers(&found, &mut numbers)?;
        Ok(numbers)
    }
}

impl CoreTissue {
    fn read_bones(&mut self) {
        let numbers = self.world_from_bone.as_chunks::<MATRIX>().0;
        for (bone, numbers) in self.bones.iter_mut().zip(numbers) {
            *bone = DAffine3::from_mat4(DMat4::from_cols_array(numbers));
        }
    }
}

impl From<BindingError> for Thrown {
    fn from(error: BindingError) -> Self {
        Self::new("binding", error.to_string())
    }
}

fn report_json(report: &Report) -> Value {
    let bones = report
        .bones
        .iter()
        .map(|(joint, bone)| json!({ "joint": joint, "bone": bone }));
    let meshes = report.meshes.iter().map(|mesh| {
        json!({
            "name": mesh.name,
            "material": mesh.material,
            "vertices": mesh.vertices,
            "moving": mesh.moving,
        })
    });
    let off = report
        .regions_off
        .iter()
        .map(|off| json!({ "region": off.region, "reason": off.reason }));
    json!({
        "bones": bones.collect::<Vec<_>>(),
        "missing": report.missing,
        "proportions": {
            "crownToShoulder": report.proportions.crown_to_shoulder,
            "hipHeight": report.proportions.hip_height,
            "statureM": report.proportions.stature_m,
        },
        "shareClose": report.share_close,
        "shareCloseBare": report.share_close_bare,
        "medianM": report.median_m,
        "vertices": report.vertices,
        "moving": report.moving,
        "meshes": meshes.collect::<Vec<_>>(),
        "regionsOff": off.collect::<Vec<_>>(),
        "doubleMotion": report.double_motion,
        "notes": report.notes,
    })
}
