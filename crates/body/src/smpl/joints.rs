//! The joints of SMPL, SMPL-H and SMPL-X as SMPL's 24.
//!
//! All three begin with the same 22 joints. SMPL ends with two hands; SMPL-H has fifteen finger joints
//! on each wrist instead, and SMPL-X a jaw and two eyes on the head as well.

use std::io::{Read, Seek};

use dynaskin_npz::Archive;

use super::wrong;
use crate::{BodyError, JOINT_COUNT, Joint};

/// Joints that all layouts share, in the same order.
const SHARED: usize = Joint::LeftHand as usize;

/// Which body of the family a file holds, by its number of joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SmplLayout {
    /// SMPL: 24 joints.
    Smpl,
    /// SMPL-H: 52 joints, fifteen for the fingers of each hand.
    SmplH,
    /// SMPL-X: 55 joints, a jaw and two eyes more.
    SmplX,
}

impl SmplLayout {
    /// Its name as the papers write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Smpl => "SMPL",
            Self::SmplH => "SMPL-H",
            Self::SmplX => "SMPL-X",
        }
    }

    /// Number of joints.
    pub const fn joint_count(self) -> usize {
        match self {
            Self::Smpl => JOINT_COUNT,
            Self::SmplH => 52,
            Self::SmplX => 55,
        }
    }

    fn of_joints(count: usize) -> Option<Self> {
        let all = [Self::Smpl, Self::SmplH, Self::SmplX];
        all.into_iter().find(|layout| layout.joint_count() == count)
    }
}

/// What becomes of each joint of a file.
#[derive(Clone, Debug)]
pub(super) struct Joints {
    pub layout: SmplLayout,
    /// The joint whose skin each joint of the file moves, `[joint of the file]`.
    pub moved_by: Vec<Joint>,
    /// The joints of the file whose mean place each joint has.
    pub placed_by: [Vec<usize>; JOINT_COUNT],
}

impl Joints {
    /// Reads the kinematic tree, which must be SMPL's, or joints would turn about the wrong parents.
    ///
    /// # Errors
    /// [`BodyError::Npz`] for another number of joints or another tree.
    pub fn read<R: Read + Seek>(file: &mut Archive<R>) -> Result<Self, BodyError> {
        let count = file.shape("kintree_table")?.get(1).copied().unwrap_or(0);
        let layout = SmplLayout::of_joints(count).ok_or_else(|| {
            let expected = "24, 52 or 55 joints (SMPL, SMPL-H, SMPL-X)";
            wrong("kintree_table", expected, format!("{count} joints"))
        })?;
        let table = file.integers("kintree_table", &[Some(2), Some(count)])?;
        let parents: Vec<f64> = (0..count).map(|joint| table.at(&[0, joint])).collect();
        let mut joints = Self {
            layout,
            moved_by: Joint::ALL[..SHARED].to_vec(),
            placed_by: std::array::from_fn(|joint| {
                if joint < SHARED || layout == SmplLayout::Smpl {
                    vec![joint]
                } else {
                    Vec::new()
                }
            }),
        };
        let own = match layout {
            SmplLayout::Smpl => JOINT_COUNT,
            SmplLayout::SmplH | SmplLayout::SmplX => SHARED,
        };
        for joint in &Joint::ALL[1..own] {
            let expected = joint.parent().map_or(0, |parent| parent as usize);
            let got = parents[*joint as usize];
            if got != expected as f64 {
                return Err(not_the_tree(
                    format!("{} hangs on joint {expected}", joint.name()),
                    got,
                ));
            }
        }
        if layout == SmplLayout::Smpl {
            joints.moved_by = Joint::ALL.to_vec();
            return Ok(joints);
        }
        for (joint, parent) in parents.iter().enumerate().skip(SHARED) {
            joints.fold(joint, *parent)?;
        }
        if joints.placed_by.iter().any(Vec::is_empty) {
            let expected = "fingers on both wrists".to_owned();
            return Err(wrong("kintree_table", expected, "a wrist without any"));
        }
        Ok(joints)
    }

    /// Gives a joint beyond those that are shared to the hand or head that it hangs on.
    fn fold(&mut self, joint: usize, parent: f64) -> Result<(), BodyError> {
        let above = (0..joint).find(|above| *above as f64 == parent);
        let refused = || {
            let expected = format!("joint {joint} hangs on head, wrist or a finger before it");
            not_the_tree(expected, parent)
        };
        let above = above.ok_or_else(refused)?;
        let moved_by = match self.moved_by[above] {
            Joint::LeftWrist => Joint::LeftHand,
            Joint::RightWrist => Joint::RightHand,
            hand_or_head @ (Joint::LeftHand | Joint::RightHand | Joint::Head) => hand_or_head,
            _ => return Err(refused()),
        };
        // SMPL's hand stands at the knuckles, which the fingers' first joints surround.
        if above < SHARED && moved_by != Joint::Head {
            self.placed_by[moved_by as usize].push(joint);
        }
        self.moved_by.push(moved_by);
        Ok(())
    }

    /// Number of joints in the file.
    pub fn count(&self) -> usize {
        self.moved_by.len()
    }

    /// Joints of the file that became part of a hand or of the head, by that joint.
    pub fn folded(&self) -> Vec<(Joint, usize)> {
        if self.layout == SmplLayout::Smpl {
            return Vec::new();
        }
        [Joint::LeftHand, Joint::RightHand, Joint::Head]
            .into_iter()
            .map(|target| {
                let extra = self.moved_by[SHARED..].iter();
                (target, extra.filter(|joint| **joint == target).count())
            })
            .filter(|(_, count)| *count > 0)
            .collect()
    }

    /// Pose corrective fields of the file, and how many of them SMPL's joints have: the first.
    pub fn pose_dir_counts(&self) -> (usize, usize) {
        let kept = match self.layout {
            SmplLayout::Smpl => JOINT_COUNT,
            SmplLayout::SmplH | SmplLayout::SmplX => SHARED,
        };
        (9 * (self.count() - 1), 9 * (kept - 1))
    }
}

fn not_the_tree(expected: String, got: f64) -> BodyError {
    wrong(
        "kintree_table",
        format!("SMPL's tree: {expected}"),
        format!("joint {got}"),
    )
}
