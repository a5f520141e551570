//! From places of pelvis and soles and angles of the arms to a pose: inverse kinematics.

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DMat3, DQuat, DVec3, Vec3};

use crate::MotionError;

/// Up to this fraction of its length a leg stretches before the heel begins to rise; on a standing
/// and on a springing body. The first leaves some bend for standing, the second lets the knee come
/// to rest gently.
const HEEL_DOWN_REACH: [f64; 2] = [0.985, 0.9];
/// Fraction that a leg never stretches beyond: at full stretch the knee would snap.
const FULL_REACH: [f64; 2] = [0.995, 0.993];
/// Largest angle between sole and floor with the ball on it, in radians.
const MAX_HEEL_RISE: f64 = 1.2;

/// Left and right.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sides<T> {
    pub left: T,
    pub right: T,
}

/// Where a sole is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sole {
    /// Displacement of the flat sole from its place in the rest pose, in metres.
    pub shift_m: DVec3,
    /// Angle by which the toes point down, in radians; the sole turns about the ball. Below zero
    /// they point up and it turns about the heel.
    pub pitch: f64,
    /// From 0, heel down until the leg is nearly straight, to 1, heel lifting early.
    pub spring: f64,
}

/// Angles of an arm away from hanging at the side of the trunk, in radians.
#[derive(Clone, Copy, Debug, Default)]
pub struct Arm {
    /// Swing to the front.
    pub ahead: f64,
    /// Lift to the side.
    pub aside: f64,
    /// Bend of the elbow beyond the rest pose's.
    pub bend: f64,
}

/// What the body does at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stance {
    /// Displacement of the pelvis from its place in the rest pose, in metres.
    pub pelvis_shift_m: DVec3,
    /// Turn of the pelvis: about x (leaning ahead is positive), y (to the left), z (left side up).
    pub pelvis_turn: DVec3,
    /// Turn of the chest against the pelvis, spread over the spine; axes as above.
    pub chest_turn: DVec3,
    pub soles: Sides<Sole>,
    pub arms: Sides<Arm>,
}

/// What the body does at a time in seconds.
pub type StanceAt<'a> = Box<dyn Fn(f64) -> Stance + 'a>;

/// Inverse kinematics over a body's measures in the rest pose.
pub struct IkSolver {
    rest_m: [DVec3; JOINT_COUNT],
    /// Length of thigh and shin of the left leg, in metres.
    pub leg_m: f64,
    /// How far the pelvis of the standing body is below the rest pose, in metres: the knees are
    /// not locked.
    pub stand_drop_m: f64,
}

impl IkSolver {
    pub fn new(rest_m: &[Vec3; JOINT_COUNT]) -> Result<Self, MotionError> {
        let rest_m = rest_m.map(|joint| joint.as_dvec3());
        let [hip, knee, ankle, ball] = [
            Joint::LeftHip,
            Joint::LeftKnee,
            Joint::LeftAnkle,
            Joint::LeftFoot,
        ]
        .map(|joint| rest_m[joint as usize]);
        let leg_m = hip.distance(knee) + knee.distance(ankle);
        let stands = rest_m.iter().all(|joint| joint.is_finite())
            && hip.y > knee.y
            && knee.y > ankle.y
            && ankle.y > ball.y
            && ball.z > ankle.z
            && (0.2..5.0).contains(&leg_m);
        if !stands {
            return Err(MotionError::Degenerate {
                skeleton: "target",
                problem: "expected a standing person in metres, +Y up, facing +Z".to_owned(),
            });
        }
        let mut solver = Self {
            rest_m,
            leg_m,
            stand_drop_m: 0.0,
        };
        solver.stand_drop_m = solver.drop_for(0.0);
        Ok(solver)
    }

    /// How far the pelvis has to sink below the rest pose for a leg to stay within the reach of a
    /// flat sole, in metres; the sole stands this far aside (or ahead) of its rest place.
    pub fn drop_for(&self, sole_aside_m: f64) -> f64 {
        let leg_m = self.rest_m[Joint::LeftHip as usize] - self.rest_m[Joint::LeftAnkle as usize];
        let across_m = DVec3::new(leg_m.x - sole_aside_m, 0.0, leg_m.z).length();
        let reach_m = HEEL_DOWN_REACH[0] * self.leg_m;
        leg_m.y - (reach_m * reach_m - across_m * across_m).max(0.0).sqrt()
    }

    /// How far the pelvis can rise above the standing height with the balls on the floor and the
    /// heels lifted by about 30 degrees, in metres.
    pub fn tiptoe_rise_m(&self) -> f64 {
        let lever_m =
            self.rest_m[Joint::LeftFoot as usize] - self.rest_m[Joint::LeftAnkle as usize];
        0.45 * lever_m.z
    }

    /// Distance of the left sole from the midline in the rest pose, in metres.
    pub fn sole_aside_m(&self) -> f64 {
        self.rest_m[Joint::LeftAnkle as usize].x
    }

    /// The pose of a stance.
    pub fn pose(&self, stance: &Stance) -> Pose {
        let mut world = [DQuat::IDENTITY; JOINT_COUNT];
        let pelvis = turn(stance.pelvis_turn);
        let pelvis_m = self.rest_m[0] + stance.pelvis_shift_m;
        world[Joint::Pelvis as usize] = pelvis;
        let spine = [Joint::Spine1, Joint::Spine2, Joint::Spine3];
        for (idx, joint) in spine.into_iter().enumerate() {
            world[joint as usize] = pelvis * turn(stance.chest_turn * ((idx + 1) as f64 / 3.0));
        }
        let chest = world[Joint::Spine3 as usize];
        // The eyes keep to the horizon, so neck and head undo most of the trunk's turn.
        let head = chest.slerp(DQuat::IDENTITY, 0.7);
        world[Joint::Neck as usize] = chest.slerp(head, 0.4);
        world[Joint::Head as usize] = head;
        self.pose_arm(&mut world, chest, Joint::LeftShoulder, &stance.arms.left);
        self.pose_arm(&mut world, chest, Joint::RightShoulder, &stance.arms.right);
        self.pose_leg(&mut world, pelvis_m, Joint::LeftHip, &stance.soles.left);
        self.pose_leg(&mut world, pelvis_m, Joint::RightHip, &stance.soles.right);

        let mut pose = Pose::REST;
        pose.root_translation_m = stance.pelvis_shift_m;
        for joint in Joint::ALL {
            let parent = joint
                .parent()
                .map_or(DQuat::IDENTITY, |parent| world[parent as usize]);
            pose.parent_from_joint[joint as usize] =
                (parent.inverse() * world[joint as usize]).normalize();
        }
        pose
    }

    /// Arms turn about the axes of the chest: first aside, then ahead; a part of the lift to the
    /// side is the collar's. The elbow bends in the plane in which the rest pose bends it.
    fn pose_arm(&self, world: &mut [DQuat; JOINT_COUNT], chest: DQuat, shoulder: Joint, arm: &Arm) {
        let (collar, elbow, wrist, hand, sign) = match shoulder {
            Joint::LeftShoulder => (
                Joint::LeftCollar,
                Joint::LeftElbow,
                Joint::LeftWrist,
                Joint::LeftHand,
                1.0,
            ),
            _ => (
                Joint::RightCollar,
                Joint::RightElbow,
                Joint::RightWrist,
                Joint::RightHand,
                -1.0,
            ),
        };
        let bone = |from: Joint, to: Joint| self.rest_m[to as usize] - self.rest_m[from as usize];
        let lift = |angle: f64| DQuat::from_rotation_z(sign * angle);
        let upper = bone(shoulder, elbow);
        let hinge = upper.cross(bone(elbow, wrist)).normalize_or(DVec3::X);
        let collar_lift = COLLAR_SHARE * arm.aside;
        world[collar as usize] = chest * lift(collar_lift);
        let hang = upper.y.atan2(upper.x.abs()) + HANG_ANGLE;
        let upper_arm = chest * DQuat::from_rotation_x(-arm.ahead) * lift(arm.aside - hang);
        world[shoulder as usize] = upper_arm;
        let forearm = upper_arm * DQuat::from_axis_angle(hinge, arm.bend);
        for joint in [elbow, wrist, hand] {
            world[joint as usize] = forearm;
        }
    }

    /// Two-bone inverse kinematics from the hip to the ankle.
    fn pose_leg(&self, world: &mut [DQuat; JOINT_COUNT], pelvis_m: DVec3, hip: Joint, sole: &Sole) {
        let (knee, ankle, foot) = match hip {
            Joint::LeftHip => (Joint::LeftKnee, Joint::LeftAnkle, Joint::LeftFoot),
            _ => (Joint::RightKnee, Joint::RightAnkle, Joint::RightFoot),
        };
        let rest = |joint: Joint| self.rest_m[joint as usize];
        let pelvis = world[Joint::Pelvis as usize];
        let hip_m = pelvis_m + pelvis * (rest(hip) - rest(Joint::Pelvis));
        let (pitch, ankle_m) = self.place_foot(hip_m, rest(ankle), rest(foot), sole);

        let (thigh, shin) = (rest(knee) - rest(hip), rest(ankle) - rest(knee));
        let to_ankle = ankle_m - hip_m;
        let distance = to_ankle
            .length()
            .clamp(1e-6, 0.999 * (thigh.length() + shin.length()));
        let along = to_ankle.normalize_or(DVec3::NEG_Y);
        // The knee moves in the plane of the leg and the way ahead of the pelvis.
        let hinge = along.cross(pelvis * DVec3::Z).normalize_or(DVec3::NEG_X);
        let (a, b) = (thigh.length(), shin.length());
        let cos_hip =
            ((a * a + distance * distance - b * b) / (2.0 * a * distance)).clamp(-1.0, 1.0);
        let thigh_world = DQuat::from_axis_angle(hinge, cos_hip.acos()) * along;
        let shin_world = (distance * along - a * thigh_world).normalize_or(along);
        world[hip as usize] = bone_rotation(thigh, thigh_world, hinge);
        world[knee as usize] = bone_rotation(shin, shin_world, hinge);
        world[ankle as usize] = DQuat::from_rotation_x(pitch);
        // Toes stay on the floor while the heel lifts; in the air they hang on the foot.
        let in_air = super::track::smooth_step(sole.shift_m.y / 0.15);
        world[foot as usize] = DQuat::from_rotation_x(pitch.min(0.0) + in_air * pitch.max(0.0));
    }

    /// Pitch of the sole and position of the ankle. The heel lifts as far as the leg needs it to.
    fn place_foot(&self, hip_m: DVec3, ankle: DVec3, ball: DVec3, sole: &Sole) -> (f64, DVec3) {
        let heel = DVec3::new(ball.x, 0.0, ball.z + 1.25 * (ankle.z - ball.z));
        let place = |pitch: f64| {
            // Toes lie flat while the heel lifts, so the joint of the ball is what stays in place.
            let pivot = if pitch < 0.0 { heel } else { ball };
            pivot + sole.shift_m + DQuat::from_rotation_x(pitch) * (ankle - pivot)
        };
        let distance = |pitch: f64| hip_m.distance(place(pitch)) / self.leg_m;
        let wanted = distance(sole.pitch);
        let allowed = softened_reach(wanted, sole.spring);
        if wanted <= allowed {
            return (sole.pitch, place(sole.pitch));
        }
        if sole.pitch < 0.0 {
            // A foot that strikes with its heel is ahead of the hip: lifting the heel would not
            // bring the ankle nearer. It strikes a little early instead.
            let ankle_m = hip_m.lerp(place(sole.pitch), allowed / wanted);
            return (sole.pitch, ankle_m);
        }
        let (mut low, mut high) = (sole.pitch, MAX_HEEL_RISE.max(sole.pitch));
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if distance(middle) > allowed {
                low = middle;
            } else {
                high = middle;
            }
        }
        (high, place(high))
    }
}

/// The stretch of a leg, as a fraction of its length, for a `wanted` one.
///
/// The knee's distance from the line between hip and ankle goes with η = √(1 - r²), whose slope
/// over r has no bound at r = 1. From the reach r₀ on, η leaves that course with equal value, slope
/// and curvature and decays to that of the full reach, as `(1 + a x) exp(-b x)`.
fn softened_reach(wanted: f64, spring: f64) -> f64 {
    let between = |ends: [f64; 2]| ends[0] + (ends[1] - ends[0]) * spring;
    let start = between(HEEL_DOWN_REACH);
    if wanted <= start {
        return wanted;
    }
    let bend = |reach: f64| (1.0 - reach * reach).sqrt();
    let (start_bend, least_bend) = (bend(start), bend(between(FULL_REACH)));
    let fall = start_bend - least_bend;
    let x = (wanted - start) * start / (start_bend * fall);
    let b = 1.0 + (1.0 + fall / (start_bend * start * start)).sqrt();
    let bend = least_bend + fall * (1.0 + (b - 1.0) * x) * (-b * x).exp();
    (1.0 - bend * bend).sqrt()
}

/// Share of the collar in lifting the arm.
const COLLAR_SHARE: f64 = 0.15;
/// Angle of the hanging upper arm below the horizontal: clear of the hips, in radians.
const HANG_ANGLE: f64 = 1.2;

/// Rotation by the angles about x, y and z: first z, then x, then y.
fn turn(angles: DVec3) -> DQuat {
    DQuat::from_rotation_y(angles.y)
        * DQuat::from_rotation_x(angles.x)
        * DQuat::from_rotation_z(angles.z)
}

/// Rotation that takes a rest bone to `to` and the body's side-to-side axis to the hinge.
fn bone_rotation(rest: DVec3, to: DVec3, hinge: DVec3) -> DQuat {
    let frame = |bone: DVec3, side: DVec3| {
        let y = bone.normalize_or(DVec3::NEG_Y);
        let x = side.reject_from_normalized(y).normalize_or(DVec3::X);
        DMat3::from_cols(x, y, x.cross(y))
    };
    DQuat::from_mat3(&(frame(to, hinge) * frame(rest, DVec3::NEG_X).transpose())).normalize()
}
