//! Which node of an avatar is which joint of the body, and where it rests.

use std::collections::BTreeMap;

use dynaskin_motion::{Drive, LengthUnit, Mapping, SourceMotion, find_named};
use dynaskin_skeleton::{JOINT_COUNT, Joint};
use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::BindError;
use crate::avatar::Avatar;
use crate::bind_pose::BindPose;
use crate::nameless;

/// The most that a trunk may lean where an avatar rests.
const MOST_LEAN_DEGREES: f64 = 40.0;
/// A person who leans more than this from the ankles to the shoulders was saved with a turned pelvis.
const UPRIGHT_DEGREES: f64 = 5.0;
/// Farther than this from the origin, single precision rounds skin by more than a thousandth of a millimetre.
const NEAR_ORIGIN_M: f64 = 10.0;
/// Legs longer than this in the file's unit are in no unit that people measure in, and are no person's.
const LONGEST_LEG: f64 = 1.4;
/// Flatter than this a bone is flattened to nothing.
const LEAST_FLATNESS: f64 = 1e-4;
/// What such a leg is taken for, metres.
const USUAL_LEG_M: f64 = 0.8;

/// The person in an avatar's skeleton.
#[derive(Clone, Debug)]
pub struct Bones {
    /// What turns each joint of the body: indices of nodes.
    pub drives: [Drive; JOINT_COUNT],
    /// Where the joints of the body that one node alone turns rest, metres.
    pub places_m: [Option<DVec3>; JOINT_COUNT],
    /// The joint that each node belongs to: its own, or that of the nearest node above that has one.
    pub joint_of_node: Vec<Option<Joint>>,
    /// Where the nodes rest: metres, +Y up.
    pub bind: BindPose,
    /// The node that turns the pelvis.
    pub pelvis: usize,
    /// Whether the file's unit tells how tall the person is.
    pub knows_stature: bool,
    /// What was found other than usual.
    pub notes: Vec<String>,
}

impl Bones {
    /// Finds the person by VRM's humanoid, else by names, else by the tree and the places.
    ///
    /// `named`: names of nodes that the caller gives for joints.
    ///
    /// # Errors
    /// [`BindError::Bones`] for names that the file lacks, [`BindError::NoHumanoid`],
    /// [`BindError::NotUpright`].
    pub fn find(avatar: &Avatar, named: &[(Joint, String)]) -> Result<Self, BindError> {
        let skeleton = Skeleton::new(avatar, named)?;
        let mut notes = Vec::new();
        let mapping = match Mapping::new(&skeleton) {
            Ok(mapping) => mapping,
            Err(by_names) => {
                let found = nameless::joints(avatar, &skeleton).ok_or(by_names);
                let skeleton = skeleton.with_named(found.map_err(BindError::NoHumanoid)?);
                notes.push(
                    "the names tell nothing: bones were found by the skeleton's shape".to_owned(),
                );
                Mapping::new(&skeleton).map_err(BindError::NoHumanoid)?
            }
        };
        let bind = BindPose::new(avatar, skeleton.node(first_joint(&mapping)));
        let mut bones = Self::of_mapping(avatar, &skeleton, &mapping, bind);
        if bones.faces_back() {
            notes.push("left and right are exchanged in the file, as its feet say".to_owned());
            let bind = bones.bind;
            bones = Self::of_mapping(avatar, &skeleton, &mapping.mirrored(), bind);
        }
        bones.notes.extend(notes);
        bones.take_metres();
        bones.check_upright()?;
        bones.stand_up();
        bones.come_near();
        Ok(bones)
    }

    fn of_mapping(
        avatar: &Avatar,
        skeleton: &Skeleton<'_>,
        mapping: &Mapping,
        bind: BindPose,
    ) -> Self {
        let drives = mapping.drives.map(|drive| match drive {
            Drive::Joint(joint) => Drive::Joint(skeleton.node(joint)),
            Drive::Between(low, high, share) => {
                Drive::Between(skeleton.node(low), skeleton.node(high), share)
            }
            Drive::Parent => Drive::Parent,
        });
        let places_m = drives.map(|drive| match drive {
            Drive::Joint(node) => Some(bind.world_from_node[node].translation),
            _ => None,
        });
        let mut own: Vec<Option<Joint>> = vec![None; avatar.nodes.len()];
        for joint in &mapping.spine {
            own[skeleton.node(*joint)] = Some(Joint::Spine2);
        }
        // Of joints that one node turns, the first of the tree names it.
        for joint in Joint::ALL.into_iter().rev() {
            if let Drive::Joint(node) = drives[joint as usize] {
                own[node] = Some(joint);
            }
        }
        let joint_of_node = (0..own.len())
            .map(|node| {
                let above = std::iter::successors(Some(node), |node| avatar.nodes[*node].parent);
                above.into_iter().find_map(|node| own[node])
            })
            .collect();
        Self {
            drives,
            places_m,
            joint_of_node,
            bind,
            pelvis: skeleton.node(first_joint(mapping)),
            knows_stature: true,
            notes: Vec::new(),
        }
    }

    /// Where a joint rests, metres.
    pub fn place_m(&self, joint: Joint) -> Option<DVec3> {
        self.places_m[joint as usize]
    }

    /// The way from the right hip to the left, level with the floor; +X where both stand at one place.
    pub fn left(&self) -> DVec3 {
        let across = |left: Joint| Some(self.place_m(left)? - self.place_m(left.mirrored())?);
        let level = |way: DVec3| way.reject_from(DVec3::Y).try_normalize();
        let hips = across(Joint::LeftHip).and_then(level);
        hips.or_else(|| across(Joint::LeftShoulder).and_then(level))
            .unwrap_or(DVec3::X)
    }

    /// Whether both feet point to where left and right, as named, have the back.
    fn faces_back(&self) -> bool {
        let ahead = self.left().cross(DVec3::Y);
        let points_back = |ankle: Joint, foot: Joint| {
            let way = self.place_m(foot)? - self.place_m(ankle)?;
            let way = way.reject_from(DVec3::Y);
            Some(way.dot(ahead) < -0.5 * way.length() && way.length() > 0.0)
        };
        [
            (Joint::LeftAnkle, Joint::LeftFoot),
            (Joint::RightAnkle, Joint::RightFoot),
        ]
        .into_iter()
        .all(|(ankle, foot)| points_back(ankle, foot) == Some(true))
    }

    /// The leg from hip to knee to ankle, metres.
    pub fn leg(&self) -> f64 {
        let [hip, knee, ankle] = [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle]
            .map(|joint| self.place_m(joint).unwrap_or_default());
        hip.distance(knee) + knee.distance(ankle)
    }

    /// Scales files in centimetres and the like to metres.
    fn take_metres(&mut self) {
        let leg = self.leg();
        let unit = LengthUnit::of_leg(leg);
        let metres = match unit {
            LengthUnit::Inch => 0.0254,
            LengthUnit::Centimetre => 0.01,
            LengthUnit::Millimetre => 0.001,
            // Shorter legs may be those of somebody small, whose stature counts.
            LengthUnit::Other if leg > LONGEST_LEG && leg.is_finite() => USUAL_LEG_M / leg,
            _ => return,
        };
        self.notes.push(match unit {
            LengthUnit::Other => format!(
                "legs of {leg:.1} are in no known unit: taken as {USUAL_LEG_M} m, which says nothing of \
                 the stature"
            ),
            unit => format!("the file seems to be in {}: taken as such", unit.name()),
        });
        self.move_all(DAffine3::from_scale(DVec3::splat(metres)));
        self.bind.metres_per_unit = metres;
        self.knows_stature = unit != LengthUnit::Other;
    }

    /// Moves everything, as it rests.
    fn move_all(&mut self, by: DAffine3) {
        for world in &mut self.bind.world_from_node {
            *world = by * *world;
        }
        self.places_m = self
            .places_m
            .map(|place| place.map(|place| by.transform_point3(place)));
    }

    /// Sets upright who was saved with a turned pelvis. The skin hangs on the pelvis as it was bound, so
    /// that legs and trunk lean alike.
    fn stand_up(&mut self) {
        let (Some(ankles), Some(shoulders), Some(pelvis)) = (
            self.middle_m(Joint::LeftAnkle),
            self.middle_m(Joint::LeftShoulder),
            self.place_m(Joint::Pelvis),
        ) else {
            return;
        };
        let Some(up) = (shoulders - ankles).try_normalize() else {
            return;
        };
        let lean_degrees = up.angle_between(DVec3::Y).to_degrees();
        if lean_degrees <= UPRIGHT_DEGREES {
            return;
        }
        self.notes.push(format!(
            "the file's pelvis leans by {lean_degrees:.0} degrees: taken as upright"
        ));
        let turn = DAffine3::from_quat(DQuat::from_rotation_arc(up, DVec3::Y));
        let about = DAffine3::from_translation(pelvis);
        self.move_all(about * turn * about.inverse());
    }

    /// Brings who stands far away to the origin.
    fn come_near(&mut self) {
        let place_m = self.place_m(Joint::Pelvis).unwrap_or_default();
        if place_m.length() > NEAR_ORIGIN_M {
            self.move_all(DAffine3::from_translation(-place_m));
        }
    }

    /// The middle between a joint of the left and its twin, metres.
    fn middle_m(&self, left: Joint) -> Option<DVec3> {
        Some(0.5 * (self.place_m(left)? + self.place_m(left.mirrored())?))
    }

    fn check_upright(&self) -> Result<(), BindError> {
        let (Some(hips), Some(shoulders)) = (
            self.middle_m(Joint::LeftHip),
            self.middle_m(Joint::LeftShoulder),
        ) else {
            return Ok(());
        };
        let pelvis = self
            .bind
            .world_from_node
            .get(self.pelvis)
            .map_or(0.0, |world| flatness(world.matrix3));
        if !matches!(pelvis, LEAST_FLATNESS..) {
            return Err(BindError::NoFit(
                "its pelvis is scaled to nothing in some direction",
            ));
        }
        let Some(up) = (shoulders - hips).try_normalize() else {
            return Err(BindError::NoFit(
                "as it was bound, its joints stand at one place: export the avatar with its inverse \
                 bind matrices",
            ));
        };
        let lean_degrees = up.angle_between(DVec3::Y).to_degrees();
        if lean_degrees <= MOST_LEAN_DEGREES {
            Ok(())
        } else {
            Err(BindError::NotUpright { lean_degrees })
        }
    }
}

/// The volume that a matrix makes of a cube, over the cube of its longest edge.
fn flatness(matrix: DMat3) -> f64 {
    let edges = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
    let longest = edges.into_iter().fold(0.0, f64::max);
    (matrix.determinant() / longest.powi(3)).abs()
}

/// The joint of the skeleton that turns the pelvis.
fn first_joint(mapping: &Mapping) -> usize {
    mapping.source(Joint::Pelvis).unwrap_or(0)
}

/// The nodes of an avatar as `motion` wants them: parents before their children, at rest.
pub struct Skeleton<'a> {
    avatar: &'a Avatar,
    /// Nodes in an order with parents first.
    order: Vec<usize>,
    /// Place of each node in that order.
    place: Vec<usize>,
    /// Place of the node that the caller named for each joint.
    named: [Option<usize>; JOINT_COUNT],
}

impl<'a> Skeleton<'a> {
    fn new(avatar: &'a Avatar, named: &[(Joint, String)]) -> Result<Self, BindError> {
        let depth = |node: usize| {
            std::iter::successors(Some(node), |node| avatar.nodes[*node].parent).count()
        };
        let mut order: Vec<usize> = (0..avatar.nodes.len()).collect();
        order.sort_by_cached_key(|node| (depth(*node), *node));
        let mut place = vec![0; order.len()];
        for (at, node) in order.iter().enumerate() {
            place[*node] = at;
        }
        let mut skeleton = Self {
            avatar,
            order,
            place,
            named: [None; JOINT_COUNT],
        };
        let nodes = skeleton.order.iter().map(|node| &avatar.nodes[*node]);
        let names: Vec<&str> = nodes.map(|node| node.name.as_str()).collect();
        skeleton.named = find_named(named, &names).map_err(BindError::Bones)?;
        Ok(skeleton)
    }

    /// The same with the nodes of `joints` named, where the caller named none.
    fn with_named(&self, joints: BTreeMap<usize, usize>) -> Self {
        let mut named = self.named;
        for (joint, node) in joints {
            named[joint] = named[joint].or(Some(self.place[node]));
        }
        Self {
            avatar: self.avatar,
            order: self.order.clone(),
            place: self.place.clone(),
            named,
        }
    }

    /// The node at a place of the order.
    pub fn node(&self, place: usize) -> usize {
        self.order[place]
    }
}

impl SourceMotion for Skeleton<'_> {
    fn joint_count(&self) -> usize {
        self.order.len()
    }

    fn name(&self, joint: usize) -> &str {
        &self.avatar.nodes[self.order[joint]].part_name
    }

    fn named_by_caller(&self, joint: Joint) -> Option<usize> {
        self.named[joint as usize]
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        let parent = self.avatar.nodes[self.order[joint]].parent?;
        Some(self.place[parent])
    }

    fn bone_end(&self, _joint: usize) -> Option<DVec3> {
        None
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        let nodes = self.order.iter().map(|node| &self.avatar.nodes[*node]);
        nodes.map(|node| node.world_from_node.translation).collect()
    }

    fn frame_count(&self) -> usize {
        1
    }

    fn frame_seconds(&self) -> f64 {
        1.0
    }

    fn world_joints(&self, _frame: usize) -> Vec<(DQuat, DVec3)> {
        let places = self.rest_positions();
        places
            .into_iter()
            .map(|place| (DQuat::IDENTITY, place))
            .collect()
    }
}
