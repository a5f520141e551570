//! Where the body is soft, and how thick its soft tissue is.

use glam::Vec3;

use dynaskin_body::vertex_normals;
use dynaskin_body::{Joint, REGION_COUNT, Region, Sex, SkinWeights};

/// Thickness in metres that even the lean body has over bone and muscle, by region (skin and the
/// fat that no weight slider removes). Chosen so that the average body meets the measured
/// thicknesses: distal thigh 16.7 mm (women) and 6.5 mm (men), gluteal fat about 40 mm at a body
/// mass index of 24.
fn lean_thickness_m(sex: Sex, region: Region) -> f32 {
    match (sex, region) {
        (Sex::Female, Region::Chest) => 0.016,
        (Sex::Male, Region::Chest) => 0.008,
        (_, Region::Belly) => 0.012,
        (Sex::Female, Region::Buttocks) => 0.026,
        (Sex::Male, Region::Buttocks) => 0.022,
        (Sex::Female, Region::Thighs) => 0.013,
        (Sex::Male, Region::Thighs) => 0.006,
        (_, Region::Calves) => 0.005,
        (Sex::Female, Region::UpperArms) => 0.008,
        (Sex::Male, Region::UpperArms) => 0.005,
    }
}

/// How much of what weight adds to the body is fat rather than muscle. On the limbs the weight
/// slider grows both; the shares bring the distal thigh of the average body to the measured
/// thickness.
fn fat_share(sex: Sex, region: Region) -> f32 {
    match (sex, region) {
        (Sex::Female, Region::Thighs | Region::Calves | Region::UpperArms) => 0.7,
        (Sex::Male, Region::Thighs | Region::Calves | Region::UpperArms) => 0.4,
        _ => 1.0,
    }
}

/// Thickness where no region claims the skin, in metres.
const BARE_THICKNESS_M: f32 = 0.004;

/// Tissue thickness of one body: how far its skin stands out from the same body without fat,
/// smoothed over the surface, plus what the lean body carries by region.
pub(super) fn thickness_m(
    sex: Sex,
    positions_m: &[Vec3],
    lean_m: &[Vec3],
    faces: &[[u32; 3]],
    region_weights: &[Vec<f32>],
    neighbours: &[Vec<u32>],
) -> Vec<f32> {
    let normals = vertex_normals(lean_m, faces);
    let mut fat_m: Vec<f32> = (0..positions_m.len())
        .map(|v| (positions_m[v] - lean_m[v]).dot(normals[v]).max(0.0))
        .collect();
    smooth(&mut fat_m, neighbours, 4);
    fat_m
        .iter()
        .enumerate()
        .map(|(vertex, &fat)| {
            let by_region = |change: &dyn Fn(Region) -> f32| -> f32 {
                let weighted =
                    |&region: &Region| region_weights[region as usize][vertex] * change(region);
                Region::ALL.iter().map(weighted).sum()
            };
            let lean = by_region(&|region| lean_thickness_m(sex, region) - BARE_THICKNESS_M);
            let share = 1.0 + by_region(&|region| fat_share(sex, region) - 1.0);
            BARE_THICKNESS_M + lean + share * fat
        })
        .collect()
}

/// Region weights `[region][vertex]`, smooth, symmetric, summing to at most 1.
pub(super) fn region_weights(
    positions_m: &[Vec3],
    joints_m: &[Vec3; 24],
    faces: &[[u32; 3]],
    skin: &[SkinWeights],
    breast: &[f32],
    mirror: &[usize],
    neighbours: &[Vec<u32>],
) -> Vec<Vec<f32>> {
    let normals = vertex_normals(positions_m, faces);
    let joint = |j: Joint| joints_m[j as usize];
    let mut regions = vec![vec![0.0_f32; positions_m.len()]; REGION_COUNT];
    for (vertex, &position) in positions_m.iter().enumerate() {
        let weight = |joints: &[Joint]| -> f32 {
            skin[vertex]
                .joints
                .iter()
                .zip(&skin[vertex].weights)
                .filter(|(joint, _)| joints.iter().any(|j| *j as u8 == **joint))
                .map(|(_, weight)| weight)
                .sum()
        };
        // Fraction of the way along a bone, by projection; the nearer side decides.
        let along = |left: (Joint, Joint), right: (Joint, Joint)| -> f32 {
            let (from, to) = if position.x >= 0.0 { left } else { right };
            let bone = joint(to) - joint(from);
            (position - joint(from)).dot(bone) / bone.length_squared()
        };
        let normal = normals[vertex];
        let hip_y = joint(Joint::LeftHip).y;
        let leg = weight(&[Joint::LeftHip, Joint::RightHip]);
        let trunk = weight(&[Joint::Pelvis, Joint::Spine1, Joint::Spine2, Joint::Spine3]);
        let chest = breast[vertex].min(1.0).powf(0.6);
        let behind =
            ramp(-normal.z, -0.25, 0.35) * ramp(joint(Joint::Pelvis).z - position.z, -0.02, 0.04);
        let seat = ramp(position.y, hip_y - 0.15, hip_y - 0.06)
            * (1.0 - ramp(position.y, hip_y + 0.10, hip_y + 0.19));
        let buttock = behind * seat * (leg + trunk).min(1.0);
        let on_thigh = along(
            (Joint::LeftHip, Joint::LeftKnee),
            (Joint::RightHip, Joint::RightKnee),
        );
        let on_calf = along(
            (Joint::LeftKnee, Joint::LeftAnkle),
            (Joint::RightKnee, Joint::RightAnkle),
        );
        let on_arm = along(
            (Joint::LeftShoulder, Joint::LeftElbow),
            (Joint::RightShoulder, Joint::RightElbow),
        );
        let waist = ramp(position.y, hip_y - 0.02, hip_y + 0.06)
            * (1.0
                - ramp(
                    position.y,
                    joint(Joint::Spine3).y - 0.14,
                    joint(Joint::Spine3).y - 0.02,
                ));
        let front = ramp(normal.z, -0.75, -0.1);
        let thigh = leg * ramp(on_thigh, 0.02, 0.22) * (1.0 - ramp(on_thigh, 0.72, 0.93));
        let calf = weight(&[Joint::LeftKnee, Joint::RightKnee])
            * ramp(on_calf, 0.04, 0.18)
            * (1.0 - ramp(on_calf, 0.55, 0.82));
        let arm = weight(&[Joint::LeftShoulder, Joint::RightShoulder])
            * ramp(on_arm, 0.12, 0.35)
            * (1.0 - ramp(on_arm, 0.70, 0.95));
        regions[Region::Chest as usize][vertex] = chest;
        regions[Region::Buttocks as usize][vertex] = buttock;
        regions[Region::Belly as usize][vertex] =
            trunk * waist * front * (1.0 - chest) * (1.0 - buttock);
        regions[Region::Thighs as usize][vertex] = thigh * (1.0 - buttock);
        regions[Region::Calves as usize][vertex] = calf;
        regions[Region::UpperArms as usize][vertex] = arm;
    }
    for weights in &mut regions {
        smooth(weights, neighbours, 3);
        symmetrise(weights, mirror);
        // What smoothing leaves at the rim is skin that should not move at all.
        weights
            .iter_mut()
            .for_each(|w| *w = ((*w - 0.02) / 0.96).clamp(0.0, 1.0));
    }
    for vertex in 0..positions_m.len() {
        let sum: f32 = regions.iter().map(|weights| weights[vertex]).sum();
        if sum > 1.0 {
            regions
                .iter_mut()
                .for_each(|weights| weights[vertex] /= sum);
        }
    }
    regions
}

/// Neighbours of each vertex along the triangles' edges.
pub(super) fn neighbours(n_vertices: usize, faces: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); n_vertices];
    for &[a, b, c] in faces {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            // Each edge of a closed surface is walked once in each direction.
            neighbours[from as usize].push(to);
        }
    }
    neighbours
}

fn smooth(values: &mut Vec<f32>, neighbours: &[Vec<u32>], rounds: usize) {
    for _ in 0..rounds {
        *values = neighbours
            .iter()
            .enumerate()
            .map(|(vertex, around)| {
                let sum: f32 = around.iter().map(|&n| values[n as usize]).sum();
                0.5 * values[vertex] + 0.5 * sum / around.len() as f32
            })
            .collect();
    }
}

fn symmetrise(values: &mut [f32], mirror: &[usize]) {
    for vertex in 0..values.len() {
        let twin = mirror[vertex];
        let mean = 0.5 * (values[vertex] + values[twin]);
        values[vertex] = mean;
        values[twin] = mean;
    }
}

/// 0 below `low`, 1 above `high`, smooth between.
fn ramp(x: f32, low: f32, high: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
