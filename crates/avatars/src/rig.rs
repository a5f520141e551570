//! Bones as other people's rigs have them.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, Region};
use glam::{DAffine3, DQuat, DVec3, EulerRot, Vec3};

use crate::recipe::{Recipe, RestPose, RigStyle};

/// A bone: its place, its parent, what it is called.
#[derive(Clone, Debug)]
pub struct Bone {
    pub name: String,
    pub parent: Option<usize>,
    /// Metres.
    pub world: DAffine3,
    /// VRM's name of it.
    pub human: Option<&'static str>,
}

/// Bones and the weights of the body's vertices.
#[derive(Clone, Debug)]
pub struct Rig {
    pub bones: Vec<Bone>,
    /// Bones of the breasts.
    pub tissue: Vec<usize>,
    /// `[vertex][bone]`.
    pub weights: Vec<Vec<f32>>,
}

/// The pose of the body that an avatar stands in.
pub fn rest_pose(joints_m: &[Vec3; JOINT_COUNT], pose: RestPose) -> Pose {
    let mut rest = Pose::REST;
    if pose == RestPose::A {
        return rest;
    }
    let arms = [
        (
            Joint::LeftShoulder,
            Joint::LeftElbow,
            Joint::LeftWrist,
            DVec3::X,
        ),
        (
            Joint::RightShoulder,
            Joint::RightElbow,
            Joint::RightWrist,
            DVec3::NEG_X,
        ),
    ];
    for (shoulder, elbow, wrist, side) in arms {
        let at = |joint: Joint| joints_m[joint as usize].as_dvec3();
        let swing = |bone: DVec3| DQuat::from_rotation_arc(bone.normalize(), side);
        let upper = swing(at(elbow) - at(shoulder));
        let lower = swing(at(wrist) - at(elbow));
        rest.parent_from_joint[shoulder as usize] = upper;
        rest.parent_from_joint[elbow as usize] = upper.conjugate() * lower;
    }
    rest
}

impl Rig {
    /// `joints_m`: where the body's joints stand; `placed`: from the body's world to the avatar's.
    pub fn new(
        body: &BodyModel,
        recipe: &Recipe,
        joints_m: &[DVec3; JOINT_COUNT],
        positions_m: &[Vec3],
        placed: DAffine3,
    ) -> Self {
        let mut rig = Self {
            bones: Vec::new(),
            tissue: Vec::new(),
            weights: vec![Vec::new(); body.vertex_count()],
        };
        // The bone that each joint of the body is folded into.
        let mut bone_of = [0; JOINT_COUNT];
        for joint in Joint::ALL {
            let parent = joint.parent().map(|parent| bone_of[parent as usize]);
            bone_of[joint as usize] = match (parent, name(recipe, joint)) {
                (Some(parent), None) => parent,
                (_, name) => {
                    let shift = placed.transform_vector3(convention_m(joint));
                    rig.add(
                        recipe,
                        name.unwrap_or_default(),
                        parent,
                        joints_m[joint as usize] + shift,
                        human(joint),
                    )
                }
            };
        }
        if recipe.tissue_bones {
            rig.add_breasts(body, recipe, positions_m, bone_of[Joint::Spine3 as usize]);
        }
        rig.weigh(body, recipe, &bone_of);
        rig
    }

    fn add(
        &mut self,
        recipe: &Recipe,
        name: String,
        parent: Option<usize>,
        at: DVec3,
        human: Option<&'static str>,
    ) -> usize {
        let number = self.bones.len();
        // Axes that nothing tells, another for each bone.
        let turn = if recipe.turned_axes {
            let angle = |step: f64| (number as f64 * step).sin() * 3.0;
            DQuat::from_euler(EulerRot::XYZ, angle(1.7), angle(2.9), angle(0.6))
        } else {
            DQuat::IDENTITY
        };
        let name = match recipe.rig {
            RigStyle::Nameless => format!("bone_{number:02}"),
            _ => name,
        };
        self.bones.push(Bone {
            name,
            parent,
            world: DAffine3::from_rotation_translation(turn, at),
            human,
        });
        number
    }

    fn add_breasts(
        &mut self,
        body: &BodyModel,
        recipe: &Recipe,
        positions_m: &[Vec3],
        chest: usize,
    ) {
        for (side, letter) in [(1.0, "l"), (-1.0, "r")] {
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for (vertex, weight) in body.region_weights[Region::Chest as usize]
                .iter()
                .enumerate()
            {
                if body.template_m[vertex].x * side > 0.0 {
                    sum += positions_m[vertex].as_dvec3() * f64::from(*weight);
                    total += f64::from(*weight);
                }
            }
            let name = format!("breast_{letter}");
            let bone = self.add(recipe, name, Some(chest), sum / total.max(1e-9), None);
            self.tissue.push(bone);
        }
    }

    fn weigh(&mut self, body: &BodyModel, recipe: &Recipe, bone_of: &[usize; JOINT_COUNT]) {
        let chest_bone = bone_of[Joint::Spine3 as usize];
        for (vertex, skin) in body.skin.iter().enumerate() {
            let mut row = vec![0.0; self.bones.len()];
            for (joint, weight) in skin.joints.iter().zip(skin.weights) {
                row[bone_of[usize::from(*joint)]] += weight;
            }
            if let [left, right] = self.tissue[..] {
                let own = if body.template_m[vertex].x > 0.0 {
                    left
                } else {
                    right
                };
                let share = 0.7 * body.region_weights[Region::Chest as usize][vertex];
                row[own] = share * row[chest_bone];
                row[chest_bone] *= 1.0 - share;
            }
            self.weights[vertex] = row;
        }
        for _ in 0..recipe.softened {
            self.soften(body);
        }
    }

    fn soften(&mut self, body: &BodyModel) {
        let before = self.weights.clone();
        let mut counts = vec![1.0_f32; before.len()];
        for face in &body.faces {
            for (corner, next) in [(0, 1), (1, 2), (2, 0)] {
                let (own, other) = (face[corner] as usize, face[next] as usize);
                counts[own] += 1.0;
                for (sum, weight) in self.weights[own].iter_mut().zip(&before[other]) {
                    *sum += weight;
                }
            }
        }
        for (row, count) in self.weights.iter_mut().zip(counts) {
            row.iter_mut().for_each(|weight| *weight /= count);
        }
    }
}

/// How far rigs place a joint from where the body has it, metres: by their own conventions.
fn convention_m(joint: Joint) -> DVec3 {
    let side = match joint.name().starts_with("right") {
        true => -1.0,
        false => 1.0,
    };
    match joint {
        Joint::LeftHip | Joint::RightHip => DVec3::new(side * 0.01, -0.015, 0.005),
        Joint::LeftShoulder | Joint::RightShoulder => DVec3::new(side * 0.008, 0.01, 0.0),
        Joint::Pelvis => DVec3::new(0.0, 0.02, 0.0),
        _ => DVec3::ZERO,
    }
}

/// VRM's name of a joint's bone.
fn human(joint: Joint) -> Option<&'static str> {
    Some(match joint {
        Joint::Pelvis => "hips",
        Joint::LeftHip => "leftUpperLeg",
        Joint::RightHip => "rightUpperLeg",
        Joint::Spine1 => "spine",
        Joint::LeftKnee => "leftLowerLeg",
        Joint::RightKnee => "rightLowerLeg",
        Joint::Spine2 => "chest",
        Joint::LeftAnkle => "leftFoot",
        Joint::RightAnkle => "rightFoot",
        Joint::Spine3 => "upperChest",
        Joint::LeftFoot => "leftToes",
        Joint::RightFoot => "rightToes",
        Joint::Neck => "neck",
        Joint::LeftCollar => "leftShoulder",
        Joint::RightCollar => "rightShoulder",
        Joint::Head => "head",
        Joint::LeftShoulder => "leftUpperArm",
        Joint::RightShoulder => "rightUpperArm",
        Joint::LeftElbow => "leftLowerArm",
        Joint::RightElbow => "rightLowerArm",
        Joint::LeftWrist => "leftHand",
        Joint::RightWrist => "rightHand",
        Joint::LeftHand | Joint::RightHand => return None,
    })
}

/// A joint's name in a rig; none for what the rig lacks.
fn name(recipe: &Recipe, joint: Joint) -> Option<String> {
    let is_left_out = match joint {
        Joint::LeftHand | Joint::RightHand => true,
        Joint::Spine3 => recipe.spine_bones < 3,
        Joint::Spine2 => recipe.spine_bones < 2,
        _ => false,
    };
    if is_left_out {
        return None;
    }
    let side = match joint.name().split_once('_') {
        Some(("left", _)) => ["Left", "_l", "L_", ".L"],
        Some(("right", _)) => ["Right", "_r", "R_", ".R"],
        _ => ["", "", "C_", ""],
    };
    // Mixamo, Unreal, VRoid, Rigify.
    let words = match joint {
        Joint::Pelvis => ["Hips", "pelvis", "Hips", "spine"],
        Joint::LeftHip | Joint::RightHip => ["UpLeg", "thigh", "UpperLeg", "thigh"],
        Joint::Spine1 => ["Spine", "spine_01", "Spine", "spine.001"],
        Joint::LeftKnee | Joint::RightKnee => ["Leg", "calf", "LowerLeg", "shin"],
        Joint::Spine2 => ["Spine1", "spine_02", "Chest", "spine.002"],
        Joint::LeftAnkle | Joint::RightAnkle => ["Foot", "foot", "Foot", "foot"],
        Joint::Spine3 => ["Spine2", "spine_03", "UpperChest", "spine.003"],
        Joint::LeftFoot | Joint::RightFoot => ["ToeBase", "ball", "ToeBase", "toe"],
        Joint::Neck => ["Neck", "neck_01", "Neck", "spine.004"],
        Joint::LeftCollar | Joint::RightCollar => ["Shoulder", "clavicle", "Shoulder", "shoulder"],
        Joint::Head => ["Head", "head", "Head", "spine.006"],
        Joint::LeftShoulder | Joint::RightShoulder => ["Arm", "upperarm", "UpperArm", "upper_arm"],
        Joint::LeftElbow | Joint::RightElbow => ["ForeArm", "lowerarm", "LowerArm", "forearm"],
        _ => ["Hand", "hand", "Hand", "hand"],
    };
    Some(match recipe.rig {
        RigStyle::Mixamo | RigStyle::Nameless => format!("mixamorig:{}{}", side[0], words[0]),
        RigStyle::Unreal => format!("{}{}", words[1], side[1]),
        RigStyle::VRoid => format!("J_Bip_{}{}", side[2], words[2]),
        RigStyle::Rigify => format!("DEF-{}{}", words[3], side[3]),
    })
}
