//! SMPL's 24 joints and their tree.

/// Number of joints of the skeleton.
pub const JOINT_COUNT: usize = 24;

/// A joint of the skeleton, in SMPL's order: `joint as usize` indexes every per-joint array.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Joint {
    Pelvis,
    LeftHip,
    RightHip,
    Spine1,
    LeftKnee,
    RightKnee,
    Spine2,
    LeftAnkle,
    RightAnkle,
    Spine3,
    LeftFoot,
    RightFoot,
    Neck,
    LeftCollar,
    RightCollar,
    Head,
    LeftShoulder,
    RightShoulder,
    LeftElbow,
    RightElbow,
    LeftWrist,
    RightWrist,
    LeftHand,
    RightHand,
}

impl Joint {
    /// All joints, in SMPL's order. Parents come before their children.
    pub const ALL: [Self; JOINT_COUNT] = [
        Self::Pelvis,
        Self::LeftHip,
        Self::RightHip,
        Self::Spine1,
        Self::LeftKnee,
        Self::RightKnee,
        Self::Spine2,
        Self::LeftAnkle,
        Self::RightAnkle,
        Self::Spine3,
        Self::LeftFoot,
        Self::RightFoot,
        Self::Neck,
        Self::LeftCollar,
        Self::RightCollar,
        Self::Head,
        Self::LeftShoulder,
        Self::RightShoulder,
        Self::LeftElbow,
        Self::RightElbow,
        Self::LeftWrist,
        Self::RightWrist,
        Self::LeftHand,
        Self::RightHand,
    ];

    const NAMES: [&str; JOINT_COUNT] = [
        "pelvis",
        "left_hip",
        "right_hip",
        "spine1",
        "left_knee",
        "right_knee",
        "spine2",
        "left_ankle",
        "right_ankle",
        "spine3",
        "left_foot",
        "right_foot",
        "neck",
        "left_collar",
        "right_collar",
        "head",
        "left_shoulder",
        "right_shoulder",
        "left_elbow",
        "right_elbow",
        "left_wrist",
        "right_wrist",
        "left_hand",
        "right_hand",
    ];

    /// SMPL's kinematic tree (`kintree_table`): each joint's parent; the pelvis names itself.
    const PARENTS: [u8; JOINT_COUNT] = [
        0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
    ];

    /// SMPL's name of the joint, such as `left_hip`.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The joint with SMPL's name `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|joint| joint.name() == name)
    }

    /// The parent, or none for the pelvis.
    pub const fn parent(self) -> Option<Self> {
        match self {
            Self::Pelvis => None,
            _ => Some(Self::ALL[Self::PARENTS[self as usize] as usize]),
        }
    }

    /// The joint mirrored to the other side of the body (x to -x); itself on the midline.
    pub const fn mirrored(self) -> Self {
        let idx = self as usize;
        let name = Self::NAMES[idx].as_bytes();
        // Every left joint is followed at once by its right twin.
        if name[0] == b'l' && name[1] == b'e' {
            Self::ALL[idx + 1]
        } else if name[0] == b'r' && name[1] == b'i' {
            Self::ALL[idx - 1]
        } else {
            self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_come_first_and_names_round_trip() {
        for joint in Joint::ALL {
            assert_eq!(Joint::from_name(joint.name()), Some(joint));
            if let Some(parent) = joint.parent() {
                assert!((parent as usize) < joint as usize);
            }
            assert_eq!(joint.mirrored().mirrored(), joint);
        }
        assert_eq!(Joint::LeftHip.mirrored(), Joint::RightHip);
        assert_eq!(Joint::Head.mirrored(), Joint::Head);
    }
}
