//! Which spring bones there are: the joint that carries each, its tip, and the vertices it moves.

use dynaskin_body::{BodyModel, Joint, Region, SHAPE_COUNT};
use dynaskin_runtime::features::INERTIAL_JOINTS;
use glam::Vec3;

use super::KIND;
use super::tuning::Spring;
use dynaskin_train::{TrainError, rest_features};

/// Half the width of the band about the midline in which a vertex follows the bones of both sides,
/// in metres.
const MIDLINE_M: f32 = 0.02;

/// Pairs of axes whose angular velocities are multiplied for the centrifugal acceleration.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// One spring bone.
#[derive(Clone, Debug)]
struct Bone {
    region: Region,
    /// Index of the carrying joint among [`INERTIAL_JOINTS`].
    joint: usize,
    /// From the carrying joint to the region's centre at rest, in metres.
    arm_m: Vec3,
    /// How far each vertex of the list follows, 0..=1.
    weights: Vec<f32>,
}

/// The spring bones of a body.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    bones: Vec<Bone>,
    /// Features of a body at rest.
    pub rest: Vec<f32>,
}

impl Rig {
    /// Places the bones of `body` over the vertex list `vertices`, at β = 0.
    ///
    /// # Errors
    /// [`TrainError::Config`] where no vertex of the list belongs to a soft region.
    pub fn of_body(body: &BodyModel, vertices: &[u32]) -> Result<Self, TrainError> {
        let mut bones = Vec::new();
        for region in Region::ALL {
            for (side, joint) in carriers(region) {
                let Some(of_region) = body.region_weights.get(region as usize) else {
                    continue;
                };
                let weights: Vec<f32> = vertices
                    .iter()
                    .map(|vertex| {
                        let at = body.template_m[*vertex as usize];
                        of_region[*vertex as usize] * share_of_side(side, at.x)
                    })
                    .collect();
                let sum: f32 = weights.iter().sum();
                if sum <= 0.0 {
                    continue;
                }
                let centre = vertices
                    .iter()
                    .zip(&weights)
                    .map(|(vertex, weight)| *weight * body.template_m[*vertex as usize])
                    .sum::<Vec3>()
                    / sum;
                let slot = INERTIAL_JOINTS.iter().position(|other| *other == joint);
                bones.push(Bone {
                    region,
                    joint: slot.unwrap_or(0),
                    arm_m: centre - body.joint_template_m[joint as usize],
                    weights,
                });
            }
        }
        if bones.is_empty() {
            return Err(TrainError::Config {
                setting: "body",
                got: format!("{} without a vertex in a soft region", body.name),
                expected: "a body with region weights over the data set's vertices".into(),
            });
        }
        Ok(Self {
            bones,
            rest: rest_features(KIND, &body.shaped(&[0.0; SHAPE_COUNT])),
        })
    }

    /// Number of bones.
    pub fn bone_count(&self) -> usize {
        self.bones.len()
    }

    /// Numbers of all tips: three a bone.
    pub fn axes(&self) -> usize {
        3 * self.bones.len()
    }

    /// The regions there are, with their bones.
    pub fn regions(&self) -> impl Iterator<Item = (Region, Vec<usize>)> {
        Region::ALL.into_iter().filter_map(|region| {
            let bones = (0..self.bones.len()).filter(|bone| self.bones[*bone].region == region);
            let bones: Vec<usize> = bones.collect();
            (!bones.is_empty()).then_some((region, bones))
        })
    }

    /// Every bone's spring, from one spring a region.
    pub fn per_bone(&self, springs: &[Spring]) -> Vec<Spring> {
        let of_bone = |bone: &Bone| springs.iter().find(|s| s.region == bone.region.name());
        self.bones.iter().filter_map(of_bone).copied().collect()
    }

    /// Sum of the squared vertex weights of a bone.
    pub fn weight_square(&self, bone: usize) -> f64 {
        let weights = self.bones[bone].weights.iter();
        weights.map(|weight| f64::from(*weight).powi(2)).sum()
    }

    /// The tips' positions that explain offsets best, bone by bone: `[frame][slot][xyz]` in metres
    /// to `[frame][bone][xyz]` in metres.
    pub fn follow(&self, offsets_m: &[f32]) -> Vec<f32> {
        let slots = self.bones[0].weights.len();
        let mut tips = Vec::with_capacity(offsets_m.len() / (3 * slots) * self.axes());
        let squares: Vec<f64> = (0..self.bones.len())
            .map(|bone| self.weight_square(bone))
            .collect();
        for frame in offsets_m.chunks_exact(3 * slots) {
            for (bone, square) in self.bones.iter().zip(&squares) {
                let mut sum = [0.0f64; 3];
                for (weight, offset) in bone.weights.iter().zip(frame.chunks_exact(3)) {
                    for axis in 0..3 {
                        sum[axis] += f64::from(*weight) * f64::from(offset[axis]);
                    }
                }
                tips.extend(sum.map(|x| (x / square) as f32));
            }
        }
        tips
    }

    /// Proper acceleration of every region's centre beyond that at rest, in its joint's frame:
    /// `[frame][feature]` to `[frame][bone][xyz]` in m/s².
    pub fn drive(&self, features: &[f32]) -> Vec<f32> {
        let count = KIND.count();
        let (linear, products) = (self.linear(), self.quadratic());
        let (firsts, seconds) = self.factors();
        let axes = self.axes();
        let mut drive = Vec::with_capacity(features.len() / count * axes);
        for frame in features.chunks_exact(count) {
            let start = drive.len();
            drive.resize(start + axes, 0.0f32);
            let target = &mut drive[start..];
            let mut add = |value: f32, row: &[f32]| {
                for (target, weight) in target.iter_mut().zip(row) {
                    *target += value * weight;
                }
            };
            for (feature, row) in linear.chunks_exact(axes).enumerate() {
                let value = frame[feature] - self.rest[feature];
                if value != 0.0 {
                    add(value, row);
                }
            }
            for ((first, second), row) in firsts.iter().zip(&seconds).zip(products.chunks(axes)) {
                add(frame[*first] * frame[*second], row);
            }
        }
        drive
    }

    /// What is linear in the features, `[feature][axis]`: the joint's acceleration, and the angular
    /// one times the arm.
    pub fn linear(&self) -> Vec<f32> {
        let axes = self.axes();
        let mut matrix = vec![0.0; KIND.count() * axes];
        for (index, bone) in self.bones.iter().enumerate() {
            let (first, r) = (9 * bone.joint, bone.arm_m.to_array());
            for axis in 0..3 {
                let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                let column = 3 * index + axis;
                matrix[(first + axis) * axes + column] = 1.0;
                // (α × r) along `axis`.
                matrix[(first + 6 + next) * axes + column] = r[last];
                matrix[(first + 6 + last) * axes + column] = -r[next];
            }
        }
        matrix
    }

    /// The features that are multiplied with each other, [`PAIRS`] of each bone's angular velocity.
    pub fn factors(&self) -> (Vec<usize>, Vec<usize>) {
        let velocity = |bone: &Bone| 9 * bone.joint + 3;
        let pairs = self.bones.iter().flat_map(move |bone| {
            let first = velocity(bone);
            PAIRS.map(|(a, b)| (first + a, first + b))
        });
        pairs.unzip()
    }

    /// The centrifugal acceleration `ω (ω · r) - r |ω|²`, `[product][axis]`.
    pub fn quadratic(&self) -> Vec<f32> {
        let axes = self.axes();
        let mut matrix = vec![0.0; self.bones.len() * PAIRS.len() * axes];
        for (index, bone) in self.bones.iter().enumerate() {
            let r = bone.arm_m.to_array();
            for (pair, (a, b)) in PAIRS.into_iter().enumerate() {
                let row = (index * PAIRS.len() + pair) * axes + 3 * index;
                if a == b {
                    for axis in (0..3).filter(|axis| *axis != a) {
                        matrix[row + axis] = -r[axis];
                    }
                } else {
                    matrix[row + a] = r[b];
                    matrix[row + b] = r[a];
                }
            }
        }
        matrix
    }

    /// What each tip does to the vertices, `[axis of tip][3 · slot + axis]`.
    pub fn skin(&self) -> Vec<f32> {
        let coordinates = 3 * self.bones[0].weights.len();
        let mut matrix = vec![0.0; self.axes() * coordinates];
        for (index, bone) in self.bones.iter().enumerate() {
            for (slot, weight) in bone.weights.iter().enumerate() {
                for axis in 0..3 {
                    matrix[(3 * index + axis) * coordinates + 3 * slot + axis] = *weight;
                }
            }
        }
        matrix
    }
}

/// Side (1 left, -1 right, 0 both) and joint of a region's bones.
fn carriers(region: Region) -> Vec<(f32, Joint)> {
    match region {
        Region::Chest => vec![(1.0, Joint::Spine3), (-1.0, Joint::Spine3)],
        Region::Belly => vec![(0.0, Joint::Spine1)],
        Region::Buttocks => vec![(1.0, Joint::Pelvis), (-1.0, Joint::Pelvis)],
        Region::Thighs => vec![(1.0, Joint::LeftHip), (-1.0, Joint::RightHip)],
        Region::Calves => vec![(1.0, Joint::LeftKnee), (-1.0, Joint::RightKnee)],
        Region::UpperArms => vec![(1.0, Joint::LeftShoulder), (-1.0, Joint::RightShoulder)],
    }
}

/// How much of a vertex at `x_m` belongs to a side; the two sides sum to 1.
fn share_of_side(side: f32, x_m: f32) -> f32 {
    if side == 0.0 {
        return 1.0;
    }
    (0.5 + 0.5 * side * x_m / MIDLINE_M).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use dynaskin_body::Pose;
    use dynaskin_runtime::features::MotionFeatures;
    use glam::{DQuat, DVec3};

    use super::*;
    use dynaskin_train::fixture;

    #[test]
    fn a_spinning_body_pulls_its_regions_as_rigid_mechanics_says() {
        let body = fixture::symmetric_body(4);
        let vertices: Vec<u32> = (0..8).collect();
        let rig = Rig::of_body(&body, &vertices).expect("a rig");
        assert_eq!(rig.bone_count(), 1, "the figure is all belly");
        // A steady spin about y through the pelvis at the origin.
        let (rate, dt) = (4.0, 1.0 / 60.0);
        let mut features = MotionFeatures::new(KIND, &body.joint_template_m, &[0.0; SHAPE_COUNT]);
        let pelvis = body.joint_template_m[0].as_dvec3();
        let mut last = Vec::new();
        for tick in 0..8 {
            let mut pose = Pose::REST;
            let turn = DQuat::from_axis_angle(DVec3::Y, rate * dt * f64::from(tick));
            pose.parent_from_joint[0] = turn;
            pose.root_translation_m = -pelvis;
            last = features.push(&pose).to_vec();
        }
        let drive = rig.drive(&last);
        // The belly's centre is 0.1 m in front of the axis: pulled back with ω² r.
        let centre = rig.bones[0].arm_m + body.joint_template_m[Joint::Spine1 as usize];
        let expected = -rate * rate * f64::from(centre.z);
        assert!((f64::from(drive[2]) - expected).abs() < 0.03, "{drive:?}");
        assert!(drive[1].abs() < 1e-3, "{drive:?}");
    }

    #[test]
    fn offsets_that_a_tip_makes_give_the_tip_back() {
        let body = fixture::symmetric_body(4);
        let rig = Rig::of_body(&body, &(0..8).collect::<Vec<u32>>()).expect("a rig");
        let skin = rig.skin();
        let tip = [0.01f32, -0.02, 0.03];
        let offsets: Vec<f32> = (0..24)
            .map(|c| (0..3).map(|axis| tip[axis] * skin[axis * 24 + c]).sum())
            .collect();
        for (got, expected) in rig.follow(&offsets).iter().zip(tip) {
            assert!((got - expected).abs() < 1e-7);
        }
    }
}
