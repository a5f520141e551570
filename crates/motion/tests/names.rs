//! Naming conventions: one skeleton under the names, and with the joints in between and beside, that
//! suites, engines and trackers give.

mod common;

use common::conventions::{CONVENTIONS, Convention};
use common::female_joints_m;
use dynaskin_body::Joint;
use dynaskin_motion::{SourceMotion, retarget};
use glam::{DQuat, DVec3};

/// A skeleton that stands still; parents first.
struct Skeleton {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    places: Vec<DVec3>,
}

impl SourceMotion for Skeleton {
    fn joint_count(&self) -> usize {
        self.names.len()
    }

    fn name(&self, joint: usize) -> &str {
        &self.names[joint]
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        self.parents[joint]
    }

    fn bone_end(&self, _joint: usize) -> Option<DVec3> {
        None
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        self.places.clone()
    }

    fn frame_count(&self) -> usize {
        2
    }

    fn frame_seconds(&self) -> f64 {
        1.0 / 60.0
    }

    fn world_joints(&self, _frame: usize) -> Vec<(DQuat, DVec3)> {
        self.places
            .iter()
            .map(|place| (DQuat::IDENTITY, *place))
            .collect()
    }
}

impl Skeleton {
    fn add(&mut self, name: &str, parent: Option<usize>, place: DVec3) -> usize {
        self.names.push(name.to_owned());
        self.parents.push(parent);
        self.places.push(place);
        self.names.len() - 1
    }

    fn of(convention: &Convention) -> (Self, Vec<(Joint, String)>) {
        let rest = female_joints_m().map(|joint| joint.as_dvec3());
        let at = |joint: Joint| rest[joint as usize];
        let mut skeleton = Self {
            names: Vec::new(),
            parents: Vec::new(),
            places: Vec::new(),
        };
        let mut expected = Vec::new();
        let trunk: Vec<&str> = convention.trunk.split_whitespace().collect();
        let [pelvis, spine @ .., head] = &trunk[..] else {
            panic!("{}: a trunk", convention.what);
        };
        let fork = skeleton.add(pelvis, None, at(Joint::Pelvis));
        expected.push((Joint::Pelvis, (*pelvis).to_owned()));
        expected.push((Joint::Head, (*head).to_owned()));
        let (spine, neck) = match spine {
            [spine @ .., "-"] => (spine, None),
            [spine @ .., neck] => {
                expected.push((Joint::Neck, (*neck).to_owned()));
                (spine, Some(neck))
            }
            [] => (spine, None),
        };
        let mut chest = fork;
        for (idx, name) in spine.iter().enumerate() {
            let way = (idx + 1) as f64 / spine.len() as f64;
            let place = at(Joint::Pelvis).lerp(at(Joint::Spine3), way);
            chest = skeleton.add(name, Some(chest), place);
        }
        let below_head = neck.map_or(chest, |neck| {
            skeleton.add(neck, Some(chest), at(Joint::Neck))
        });
        skeleton.add(head, Some(below_head), at(Joint::Head));
        let leg = [
            Joint::LeftHip,
            Joint::LeftKnee,
            Joint::LeftAnkle,
            Joint::LeftFoot,
        ];
        let arm = [
            Joint::LeftCollar,
            Joint::LeftShoulder,
            Joint::LeftElbow,
            Joint::LeftWrist,
            Joint::LeftHand,
        ];
        for (side, word) in convention.sides.iter().enumerate() {
            for (names, joints, from) in [
                (convention.leg, &leg[..], fork),
                (convention.arm, &arm[..], chest),
            ] {
                let mut parent = from;
                for (name, joint) in names.split_whitespace().zip(joints) {
                    if name == "-" {
                        continue;
                    }
                    let joint = if side == 0 { *joint } else { joint.mirrored() };
                    let name = name.replace("{}", word);
                    parent = skeleton.add(&name, Some(parent), at(joint));
                    expected.push((joint, name));
                }
            }
        }
        for other in convention.others.split_whitespace() {
            if other.contains("{}") {
                for word in convention.sides {
                    skeleton.add_other(&other.replace("{}", word), convention);
                }
            } else {
                skeleton.add_other(other, convention);
            }
        }
        (skeleton.sorted(), expected)
    }

    fn add_other(&mut self, other: &str, convention: &Convention) {
        let (at, how) = other
            .char_indices()
            .find(|(_, c)| "<>=".contains(*c))
            .unwrap_or_else(|| panic!("{}: {other}", convention.what));
        let (name, beside) = (&other[..at], &other[at + 1..]);
        let beside = self
            .names
            .iter()
            .position(|known| known == beside)
            .unwrap_or_else(|| panic!("{}: no joint {beside}", convention.what));
        let place = self.places[beside];
        let above = self.parents[beside];
        match how {
            '<' => {
                self.add(name, Some(beside), place + DVec3::new(0.0, -0.02, 0.05));
            }
            '>' => {
                let added = self.add(name, above, place);
                self.parents[beside] = Some(added);
            }
            _ => {
                let from = above.map_or(place, |above| self.places[above]);
                let added = self.add(name, above, from.midpoint(place));
                self.parents[beside] = Some(added);
            }
        }
    }

    /// Parents first, each branch in one piece, as files have them.
    fn sorted(self) -> Self {
        let mut order: Vec<usize> = Vec::new();
        let mut open: Vec<usize> = (0..self.names.len())
            .rev()
            .filter(|joint| self.parents[*joint].is_none())
            .collect();
        while let Some(joint) = open.pop() {
            order.push(joint);
            let children = (0..self.names.len()).rev();
            open.extend(children.filter(|child| self.parents[*child] == Some(joint)));
        }
        let place_of = |joint: usize| order.iter().position(|other| *other == joint);
        Self {
            names: order
                .iter()
                .map(|joint| self.names[*joint].clone())
                .collect(),
            parents: order
                .iter()
                .map(|joint| self.parents[*joint].and_then(place_of))
                .collect(),
            places: order.iter().map(|joint| self.places[*joint]).collect(),
        }
    }
}

#[test]
fn every_convention_gives_the_same_joints() {
    let mut wrong = Vec::new();
    for convention in CONVENTIONS {
        let (skeleton, expected) = Skeleton::of(convention);
        let report = match retarget(&skeleton, &female_joints_m()) {
            Ok((_, report)) => report,
            Err(error) => {
                wrong.push(format!("{}: {error}", convention.what));
                continue;
            }
        };
        for (joint, name) in expected {
            let found = report.mapped.iter().find(|(mapped, _)| *mapped == joint);
            let found = found.map_or("none", |(_, found)| found);
            if found != name {
                wrong.push(format!(
                    "{}: {} is {found}, not {name}",
                    convention.what,
                    joint.name()
                ));
            }
        }
    }
    assert!(CONVENTIONS.len() >= 40, "{}", CONVENTIONS.len());
    assert_eq!(wrong, [] as [String; 0], "{}", wrong.join("\n"));
}
