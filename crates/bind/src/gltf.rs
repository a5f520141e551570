//! Reads an avatar from binary glTF: `.glb`, VRM 0.x and VRM 1.0.

use dynaskin_glb::{Document, GlbError, humanoid_bones, local_transform, node_parents};
use glam::{DAffine3, Mat4, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use crate::BindError;
use crate::avatar::{Avatar, Influences, MAX_INFLUENCES, MAX_VERTICES, Node, SkinnedMesh, is_face};

impl Avatar {
    /// Reads nodes and skinned meshes. Ignores morph targets, the appearance of materials and meshes without
    /// a skin.
    ///
    /// # Errors
    /// [`BindError::Glb`] if it is not a valid binary glTF 2.0 file, [`BindError::Unskinned`], and as
    /// [`Self::check`].
    pub fn from_glb(bytes: &[u8]) -> Result<Self, BindError> {
        let file = Document::parse(bytes)?;
        let nodes = nodes(&file)?;
        let mut avatar = Self {
            nodes,
            meshes: Vec::new(),
        };
        let mut vertices = 0;
        for (idx, node) in file.root.nodes.iter().enumerate() {
            let (Some(mesh), Some(skin)) = (node.mesh, node.skin) else {
                continue;
            };
            let (mesh, skin) = (mesh.value(), skin.value());
            let (joints, inverse_binds) = skin_of(&file, skin)?;
            let of_file = file.root.meshes.get(mesh);
            let of_file = of_file
                .ok_or_else(|| GlbError::new(format!("node {idx}"), "a mesh that the file has"))?;
            let name = node.name.as_ref().or(of_file.name.as_ref());
            let name = name.map_or_else(|| format!("mesh {mesh}"), Clone::clone);
            for (place, primitive) in of_file.primitives.iter().enumerate() {
                vertices += declared_vertices(&file, primitive);
                if vertices > MAX_VERTICES {
                    return Err(BindError::TooManyVertices {
                        vertices,
                        limit: MAX_VERTICES,
                    });
                }
                let name = match of_file.primitives.len() {
                    1 => name.clone(),
                    _ => format!("{name} {place}"),
                };
                let read = Reader {
                    file: &file,
                    primitive,
                    name,
                };
                if let Some(mesh) = read.mesh(&joints, &inverse_binds)? {
                    avatar.meshes.push(mesh);
                }
            }
        }
        if avatar.meshes.is_empty() {
            return Err(BindError::Unskinned {
                meshes: file.root.meshes.len(),
            });
        }
        avatar.name_parts(humanoid_bones(&file));
        avatar.check()?;
        Ok(avatar)
    }
}

/// Vertices that a primitive announces; 0 where it cannot be read.
fn declared_vertices(file: &Document<'_>, primitive: &Primitive) -> usize {
    let positions = primitive
        .attributes
        .get(&Checked::Valid(Semantic::Positions));
    let accessor = positions.and_then(|index| file.root.accessors.get(index.value()));
    accessor.map_or(0, |accessor| {
        usize::try_from(accessor.count.0)
            .unwrap_or(usize::MAX)
            .min(usize::MAX / 2)
    })
}

fn nodes(file: &Document<'_>) -> Result<Vec<Node>, BindError> {
    let parents = node_parents(file)?;
    let mut worlds: Vec<Option<DAffine3>> = vec![None; parents.len()];
    for idx in 0..parents.len() {
        // From the highest node whose place is not known downwards.
        let above = std::iter::successors(Some(idx), |node| parents[*node]);
        let mut open: Vec<usize> = above.take_while(|node| worlds[*node].is_none()).collect();
        while let Some(node) = open.pop() {
            let local = local_transform(file, node)?;
            let own = DAffine3::from_scale_rotation_translation(
                local.scale,
                local.rotation,
                local.translation,
            );
            let parent = parents[node].and_then(|parent| worlds[parent]);
            worlds[node] = Some(parent.map_or(own, |parent| parent * own));
        }
    }
    let nodes = file.root.nodes.iter().enumerate();
    Ok(nodes
        .map(|(idx, node)| Node {
            name: node.name.clone().unwrap_or_default(),
            part_name: String::new(),
            parent: parents[idx],
            world_from_node: worlds[idx].unwrap_or_default(),
        })
        .collect())
}

fn skin_of(file: &Document<'_>, index: usize) -> Result<(Vec<usize>, Vec<DAffine3>), BindError> {
    let place = || format!("skin {index}");
    let skin = file.root.skins.get(index);
    let skin = skin.ok_or_else(|| GlbError::new(place(), "a skin"))?;
    let joints: Vec<usize> = skin.joints.iter().map(|joint| joint.value()).collect();
    let matrices = match skin.inverse_bind_matrices {
        None => vec![DAffine3::IDENTITY; joints.len()],
        Some(accessor) => {
            let numbers = file.floats::<16>(accessor.value(), Type::Mat4)?;
            let matrix = |m: &[f32; 16]| Mat4::from_cols_array(m).as_dmat4();
            numbers
                .iter()
                .map(|m| DAffine3::from_mat4(matrix(m)))
                .collect()
        }
    };
    if matrices.len() < joints.len() {
        let expected = format!(
            "{} inverse bind matrices, got {}",
            joints.len(),
            matrices.len()
        );
        return Err(GlbError::new(place(), expected).into());
    }
    let matrices = matrices.into_iter().take(joints.len()).collect();
    Ok((joints, matrices))
}

/// One primitive of a skinned mesh.
struct Reader<'a> {
    file: &'a Document<'a>,
    primitive: &'a Primitive,
    name: String,
}

impl Reader<'_> {
    /// None for lines, points, and what has no weights.
    fn mesh(
        &self,
        joints: &[usize],
        inverse_binds: &[DAffine3],
    ) -> Result<Option<SkinnedMesh>, BindError> {
        let Some(positions) = self.attribute(Semantic::Positions) else {
            return Ok(None);
        };
        let positions: Vec<Vec3> = self
            .file
            .floats::<3>(positions, Type::Vec3)?
            .into_iter()
            .map(Vec3::from_array)
            .collect();
        let (Some(faces), Some(influences)) = (
            self.faces(positions.len())?,
            self.influences(positions.len())?,
        ) else {
            return Ok(None);
        };
        let material = self
            .primitive
            .material
            .and_then(|material| self.file.root.materials.get(material.value())?.name.clone());
        Ok(Some(SkinnedMesh {
            name: self.name.clone(),
            material: material.unwrap_or_default(),
            positions,
            influences,
            faces,
            joints: joints.to_vec(),
            inverse_binds: inverse_binds.to_vec(),
        }))
    }

    fn attribute(&self, semantic: Semantic) -> Option<usize> {
        let accessor = self.primitive.attributes.get(&Checked::Valid(semantic))?;
        Some(accessor.value())
    }

    fn faces(&self, vertex_count: usize) -> Result<Option<Vec<[u32; 3]>>, BindError> {
        let indices: Vec<u32> = match self.primitive.indices {
            Some(accessor) => {
                let indices = self.file.integers::<1>(accessor.value(), Type::Scalar)?;
                indices.into_iter().map(|[index]| index).collect()
            }
            None => (0..u32::try_from(vertex_count).unwrap_or(u32::MAX)).collect(),
        };
        let corners = |at: usize| [indices[at], indices[at + 1], indices[at + 2]];
        let starts = 0..indices.len().saturating_sub(2);
        let faces: Vec<[u32; 3]> = match self.primitive.mode {
            Checked::Valid(Mode::Triangles) => starts.step_by(3).map(corners).collect(),
            Checked::Valid(Mode::TriangleStrip) => starts
                .map(|at| {
                    let [a, b, c] = corners(at);
                    if at % 2 == 0 { [a, b, c] } else { [b, a, c] }
                })
                .collect(),
            Checked::Valid(Mode::TriangleFan) => starts
                .map(|at| [indices[0], indices[at + 1], indices[at + 2]])
                .collect(),
            _ => return Ok(None),
        };
        Ok(Some(faces.into_iter().filter(is_face).collect()))
    }

    fn influences(&self, vertex_count: usize) -> Result<Option<Vec<Influences>>, BindError> {
        let mut all = vec![Influences::default(); vertex_count];
        for set in 0..MAX_INFLUENCES / 4 {
            let set_idx = set as u32;
            let (Some(joints), Some(weights)) = (
                self.attribute(Semantic::Joints(set_idx)),
                self.attribute(Semantic::Weights(set_idx)),
            ) else {
                if set == 0 {
                    return Ok(None);
                }
                break;
            };
            let joints = self.joints(joints)?;
            let weights = self.file.floats::<4>(weights, Type::Vec4)?;
            if joints.len() != vertex_count || weights.len() != vertex_count {
                let place = format!("mesh `{}`, skin", self.name);
                let expected = "joints and weights for every vertex";
                return Err(GlbError::new(place, expected).into());
            }
            for (vertex, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
                for slot in 0..4 {
                    all[vertex].joints[4 * set + slot] = joints[slot];
                    all[vertex].weights[4 * set + slot] = weights[slot];
                }
            }
        }
        all.iter_mut().for_each(Influences::normalise);
        Ok(Some(all))
    }

    /// Joint indices; some exporters write them as floats.
    fn joints(&self, accessor: usize) -> Result<Vec<[u16; 4]>, BindError> {
        if self.file.component_type(accessor)? == ComponentType::F32 {
            let floats = self.file.floats::<4>(accessor, Type::Vec4)?;
            return Ok(floats
                .into_iter()
                .map(|row| row.map(|x| x as u16))
                .collect());
        }
        let integers = self.file.integers::<4>(accessor, Type::Vec4)?;
        let narrow = |joint: u32| u16::try_from(joint).unwrap_or(u16::MAX);
        Ok(integers.into_iter().map(|row| row.map(narrow)).collect())
    }
}
