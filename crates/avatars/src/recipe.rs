//! What avatars are made of.

use dynaskin_body::SHAPE_COUNT;

/// How a skeleton is named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigStyle {
    /// `mixamorig:LeftUpLeg`.
    Mixamo,
    /// `thigh_l`.
    Unreal,
    /// `J_Bip_L_UpperLeg`.
    VRoid,
    /// `DEF-thigh.L`.
    Rigify,
    /// `bone_07`.
    Nameless,
}

/// How the avatar stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestPose {
    /// Arms sideways.
    T,
    /// Arms hanging, as the body's own.
    A,
}

/// What lengths are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metres,
    /// Everything 100 times as large.
    Centimetres,
    /// Centimetres under an armature of scale 0.01.
    Armature,
}

/// The kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// Plain binary glTF.
    Glb,
    /// VRM 0.x, which faces -Z.
    Vrm0,
    /// VRM 1.0.
    Vrm1,
}

/// A recipe for an avatar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// Name of the file without its ending.
    pub name: &'static str,
    /// β of the body, standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    /// How bones are named.
    pub rig: RigStyle,
    /// How it stands.
    pub pose: RestPose,
    /// What lengths are in.
    pub unit: Unit,
    /// The kind of file.
    pub container: Container,
    /// Whether a suit is worn over trunk, arms and legs.
    pub garment: bool,
    /// Whether sportswear and shoes are worn, with no skin below them.
    pub sportswear: bool,
    /// Whether each face of the body is four.
    pub fine: bool,
    /// Whether vertices are split where limbs meet, and legs are a mesh of their own.
    pub seams: bool,
    /// Whether positions are 16-bit integers and weights 8-bit ones.
    pub quantised: bool,
    /// Whether attributes are interleaved in one buffer view.
    pub interleaved: bool,
    /// Whether bones have axes of their own.
    pub turned_axes: bool,
    /// Bones of the spine, 1 to 3.
    pub spine_bones: u8,
    /// Whether breasts have bones, with springs where the container knows them.
    pub tissue_bones: bool,
    /// Rounds in which weights are smoothed over the mesh, as other painters do.
    pub softened: u8,
}

const PLAIN: Recipe = Recipe {
    name: "plain",
    shape: [0.0; SHAPE_COUNT],
    rig: RigStyle::Mixamo,
    pose: RestPose::A,
    unit: Unit::Metres,
    container: Container::Glb,
    garment: false,
    sportswear: false,
    fine: false,
    seams: false,
    quantised: false,
    interleaved: false,
    turned_axes: false,
    spine_bones: 3,
    tissue_bones: false,
    softened: 0,
};

/// The avatars that `dynaskin avatars` writes.
pub const RECIPES: [Recipe; 9] = [
    Recipe {
        name: "mixamo-t",
        shape: [0.3, 1.2, -0.8, 0.5, 0.0, 0.6, 0.0, 0.0, -0.4, 0.0],
        pose: RestPose::T,
        turned_axes: true,
        softened: 2,
        ..PLAIN
    },
    Recipe {
        name: "unreal-a-garment",
        shape: [-0.5, -1.0, 0.6, 0.0, 0.8, 0.0, -0.5, 0.0, 0.0, 0.3],
        rig: RigStyle::Unreal,
        garment: true,
        interleaved: true,
        softened: 3,
        ..PLAIN
    },
    Recipe {
        name: "vrm0-t",
        shape: [0.0, 0.8, 0.8, -0.6, 0.0, 0.0, 0.5, 0.4, 0.0, 0.0],
        rig: RigStyle::VRoid,
        pose: RestPose::T,
        container: Container::Vrm0,
        tissue_bones: true,
        seams: true,
        ..PLAIN
    },
    Recipe {
        name: "vrm1-t-garment",
        shape: [0.2, -0.6, -0.9, 0.9, 0.4, 0.0, 0.0, 0.0, 0.6, 0.0],
        rig: RigStyle::VRoid,
        pose: RestPose::T,
        container: Container::Vrm1,
        garment: true,
        tissue_bones: true,
        spine_bones: 2,
        softened: 2,
        ..PLAIN
    },
    Recipe {
        name: "quantised-seams",
        shape: [0.6, 1.6, 0.2, 0.0, -0.7, 0.3, 0.0, 0.0, 0.0, 0.0],
        rig: RigStyle::Unreal,
        quantised: true,
        interleaved: true,
        seams: true,
        turned_axes: true,
        softened: 1,
        ..PLAIN
    },
    Recipe {
        name: "centimetres-t",
        shape: [0.0, -0.9, 0.0, 0.7, 0.0, 0.0, 0.6, 0.0, 0.0, 0.0],
        pose: RestPose::T,
        unit: Unit::Centimetres,
        turned_axes: true,
        spine_bones: 2,
        softened: 1,
        ..PLAIN
    },
    Recipe {
        name: "armature-garment",
        shape: [0.4, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        rig: RigStyle::Rigify,
        unit: Unit::Armature,
        garment: true,
        quantised: true,
        turned_axes: true,
        softened: 2,
        ..PLAIN
    },
    Recipe {
        name: "nameless-t",
        shape: [0.0, 0.4, -0.4, 0.0, 0.0, 0.9, 0.0, 0.0, 0.0, 0.5],
        rig: RigStyle::Nameless,
        pose: RestPose::T,
        turned_axes: true,
        spine_bones: 1,
        ..PLAIN
    },
    Recipe {
        name: "fine-t-garment",
        shape: [0.2, 1.0, -0.5, 0.4, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
        pose: RestPose::T,
        garment: true,
        fine: true,
        turned_axes: true,
        softened: 4,
        ..PLAIN
    },
];

/// Dressed avatars to show: what the demo page ships, of the female and of the male body.
pub const EXAMPLES: [Recipe; 2] = [
    Recipe {
        name: "runner",
        shape: [0.2, 0.9, -0.3, 0.4, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0],
        rig: RigStyle::VRoid,
        container: Container::Vrm1,
        pose: RestPose::T,
        sportswear: true,
        quantised: true,
        softened: 1,
        ..PLAIN
    },
    Recipe {
        name: "lifter",
        shape: [0.3, 1.2, 0.4, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        rig: RigStyle::Mixamo,
        sportswear: true,
        quantised: true,
        turned_axes: true,
        softened: 1,
        ..PLAIN
    },
];
