//! A first estimate of a pose without any before it: each body part's rigid motion by itself.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, ShapedBody};
use glam::{DQuat, DVec3, Vec3};
use nalgebra::{Matrix3, Rotation3};

/// A vertex belongs to a joint's part where at least this much of its weight is the joint's.
const OWN_WEIGHT: f32 = 0.6;
/// A part of fewer vertices has no rotation of its own.
const LEAST_VERTICES: usize = 12;

/// The vertices of each joint's part.
pub(crate) struct Parts([Vec<usize>; JOINT_COUNT]);

impl Parts {
    pub fn new(body: &BodyModel) -> Self {
        let mut parts: [Vec<usize>; JOINT_COUNT] = std::array::from_fn(|_| Vec::new());
        for (vertex, skin) in body.skin.iter().enumerate() {
            if skin.weights[0] >= OWN_WEIGHT {
                parts[usize::from(skin.joints[0])].push(vertex);
            }
        }
        Self(parts)
    }
}

/// The pose whose parts lie best on the scan's, down the chain: the rotation of each joint in the
/// world is that of its part (Kabsch 1976), or its parent's where the part is too small. The root
/// is where the pelvis' part puts it.
pub(crate) fn pose_by_parts(
    shaped: &ShapedBody,
    scan_m: &[Vec3],
    weights: &[f64],
    parts: &Parts,
) -> Pose {
    let mut pose = Pose::REST;
    let mut world = [DQuat::IDENTITY; JOINT_COUNT];
    for joint in Joint::ALL {
        let own = joint as usize;
        let parent = joint.parent().map(|parent| parent as usize);
        let above = parent.map_or(DQuat::IDENTITY, |parent| world[parent]);
        // The pelvis falls back on the whole body.
        let all: Vec<usize>;
        let mut part = &parts.0[own];
        if joint == Joint::Pelvis && part.len() < LEAST_VERTICES {
            all = (0..scan_m.len()).collect();
            part = &all;
        }
        world[own] = above;
        if part.len() >= LEAST_VERTICES {
            let pairs = Pairs::new(part, &shaped.positions_m, scan_m, weights);
            if let Some(rotation) = pairs.rotation() {
                world[own] = rotation;
            }
            if joint == Joint::Pelvis {
                let pelvis_m = shaped.joints_m[0].as_dvec3();
                let position_m = pairs.to_m + world[own] * (pelvis_m - pairs.from_m);
                pose.root_translation_m = position_m - pelvis_m;
            }
        }
        pose.parent_from_joint[own] = (above.conjugate() * world[own]).normalize();
    }
    pose
}

/// Where a movement from a pose to the next one leads in the same time again.
pub(crate) fn continued(before: &Pose, last: &Pose) -> Pose {
    let mut next = last.clone();
    next.root_translation_m += last.root_translation_m - before.root_translation_m;
    let turns = next.parent_from_joint.iter_mut();
    for (turn, before) in turns.zip(&before.parent_from_joint) {
        *turn = (*turn * (before.conjugate() * *turn)).normalize();
    }
    next
}

/// The rotation of the trunk from rest to a scan in any unit; none where its points span no space.
pub(crate) fn trunk_rotation(body: &BodyModel, scan: &[Vec3]) -> Option<DQuat> {
    let trunk = [Joint::Pelvis, Joint::Spine1, Joint::Spine2, Joint::Spine3].map(|j| j as usize);
    let part: Vec<usize> = (0..body.vertex_count().min(scan.len()))
        .filter(|&vertex| {
            trunk.contains(&usize::from(body.skin[vertex].joints[0])) && scan[vertex].is_finite()
        })
        .collect();
    let weights = vec![1.0; scan.len()];
    (part.len() >= LEAST_VERTICES)
        .then(|| Pairs::new(&part, &body.template_m, scan, &weights).rotation())
        .flatten()
}

/// Corresponding points about their centres.
struct Pairs {
    from_m: DVec3,
    to_m: DVec3,
    covariance: Matrix3<f64>,
}

impl Pairs {
    fn new(part: &[usize], from_m: &[Vec3], to_m: &[Vec3], weights: &[f64]) -> Self {
        let (mut sum, mut from, mut to) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for &vertex in part {
            // Soft skin says something, too: a belly has no bones to look at.
            let weight = weights[vertex].max(1e-3);
            sum += weight;
            from += weight * from_m[vertex].as_dvec3();
            to += weight * to_m[vertex].as_dvec3();
        }
        let (from, to) = (from / sum, to / sum);
        let mut covariance = Matrix3::zeros();
        for &vertex in part {
            let weight = weights[vertex].max(1e-3);
            let a = (from_m[vertex].as_dvec3() - from) * weight;
            let b = to_m[vertex].as_dvec3() - to;
            covariance += nalgebra::Vector3::from(a.to_array())
                * nalgebra::Vector3::from(b.to_array()).transpose();
        }
        Self {
            from_m: from,
            to_m: to,
            covariance,
        }
    }

    /// The rotation that takes the first points nearest to the second; none where they lie on a
    /// line.
    fn rotation(&self) -> Option<DQuat> {
        let svd = self.covariance.svd(true, true);
        let (u, v) = (svd.u?, svd.v_t?.transpose());
        let mut order = svd.singular_values;
        order.as_mut_slice().sort_by(f64::total_cmp);
        if order[1] < 1e-9 * order[2].max(f64::MIN_POSITIVE) {
            return None;
        }
        let sign = (v * u.transpose()).determinant().signum();
        let smallest = svd.singular_values.imin();
        let mut mirror = Matrix3::identity();
        mirror[(smallest, smallest)] = sign;
        let rotation = Rotation3::from_matrix_unchecked(v * mirror * u.transpose());
        let q = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation);
        Some(DQuat::from_xyzw(q.i, q.j, q.k, q.w).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_and_moved_part_is_found() {
        let from: Vec<Vec3> = (0..20)
            .map(|i| {
                let t = i as f32;
                Vec3::new((t * 1.3).sin(), (t * 0.7).cos(), (t * 2.1).sin() * 0.2)
            })
            .collect();
        let turn = DQuat::from_scaled_axis(DVec3::new(1.0, -2.0, 0.5));
        let to: Vec<Vec3> = from
            .iter()
            .map(|p| (turn * p.as_dvec3() + DVec3::new(3.0, 1.0, -2.0)).as_vec3())
            .collect();
        let part: Vec<usize> = (0..20).collect();
        let pairs = Pairs::new(&part, &from, &to, &[1.0; 20]);
        let found = pairs.rotation().expect("points that span the space");
        assert!(found.dot(turn).abs() > 1.0 - 1e-9, "{found} {turn}");
        // On a line any turn about it is as good.
        let line: Vec<Vec3> = (0..20).map(|i| Vec3::X * i as f32).collect();
        assert!(
            Pairs::new(&part, &line, &line, &[1.0; 20])
                .rotation()
                .is_none()
        );
    }
}
