//! How a body is shown: as it is painted, or as a sculpture; with clothes that are paint, or that span.

use crate::{BodyMesh, drape::Drape, gpu_data::MaterialUniform, paint::Paint};

/// SMPL's joint of the head.
const HEAD_JOINT: u8 = 15;

/// Plaster and dyed plaster, in linear sRGB.
const PLASTER_LINEAR: [f32; 3] = [0.56, 0.535, 0.51];
const DYED_LINEAR: [f32; 3] = [0.135, 0.175, 0.215];

/// How a body is shown; as it is painted and as its surface is unless it says otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Matt plaster in place of skin and cloth, and a head without features. Bodies that are not painted
    /// in skin and cloth keep their colours.
    pub sculpture: bool,
    /// Painted clothes span hollows and rises of the skin instead of following each. Needs some
    /// hundred thousand additions a frame.
    pub draped: bool,
}

/// What the looks of one body are made from.
#[derive(Debug)]
pub(crate) struct Looks {
    painted: MaterialUniform,
    cloth: Option<Drape>,
    cloth_and_head: Option<Drape>,
    head: Option<Drape>,
}

impl Looks {
    pub fn new(mesh: &BodyMesh<'_>, paint: &Paint) -> Self {
        let head = head_shares(mesh);
        let none = vec![0.0; mesh.vertex_count()];
        let cloth = paint.cloth_shares().unwrap_or_else(|| none.clone());
        let both: Vec<f32> = head.iter().zip(&cloth).map(|(a, b)| a.max(*b)).collect();
        Self {
            painted: paint.material,
            cloth: Drape::new(&cloth, mesh.faces),
            cloth_and_head: Drape::new(&both, mesh.faces),
            head: Drape::new(&head, mesh.faces),
        }
    }

    /// The material of a look.
    pub fn material(&self, look: Look) -> MaterialUniform {
        if !look.sculpture || self.painted.two_tone == 0 {
            return self.painted;
        }
        let first_is_skin = self.painted.first_is_skin();
        let [first_linear, second_linear] = if first_is_skin {
            [PLASTER_LINEAR, DYED_LINEAR]
        } else {
            [DYED_LINEAR, PLASTER_LINEAR]
        };
        MaterialUniform {
            first_linear,
            second_linear,
            two_tone: 2,
            ..self.painted
        }
    }

    /// What is smoothed in a look.
    pub fn drape(&self, look: Look) -> Option<&Drape> {
        match (look.sculpture, look.draped) {
            (false, false) => None,
            (false, true) => self.cloth.as_ref(),
            (true, false) => self.head.as_ref(),
            (true, true) => self.cloth_and_head.as_ref(),
        }
    }
}

/// How much of each vertex the head moves; the neck goes over into it.
fn head_shares(mesh: &BodyMesh<'_>) -> Vec<f32> {
    let joints = mesh.skin_joints.as_chunks::<4>().0;
    let weights = mesh.skin_weights.as_chunks::<4>().0;
    let of_head = |(joints, weights): (&[u8; 4], &[f32; 4])| {
        let pairs = joints.iter().zip(weights);
        let share: f32 = pairs
            .filter(|(joint, _)| **joint == HEAD_JOINT)
            .map(|(_, w)| w)
            .sum();
        ((share - 0.5) * 2.0).clamp(0.0, 1.0)
    };
    joints.iter().zip(weights).map(of_head).collect()
}
