//! A body moved by hand.

mod common;

use common::female_joints_m;
use dynaskin_body::{Joint, Pose};
use dynaskin_motion::{Grip, MotionError, Puppet};
use glam::DVec3;
use proptest::prelude::*;

fn standing() -> Puppet {
    Puppet::new(&female_joints_m()).expect("a standing person")
}

fn place_m(pose: &Pose, joint: Joint) -> DVec3 {
    pose.world_joints(&female_joints_m()).position_m[joint as usize]
}

/// Steps for some seconds at 60 Hz; the poses on the way.
fn stepped(puppet: &mut Puppet, seconds: f64) -> Vec<Pose> {
    (0..(60.0 * seconds) as usize)
        .map(|_| puppet.step(1.0 / 60.0))
        .collect()
}

#[test]
fn untouched_it_stands_still_with_its_feet_on_the_floor() {
    let mut puppet = standing();
    let first = puppet.pose();
    assert!(first.is_valid());
    for pose in stepped(&mut puppet, 1.0) {
        assert_eq!(pose, first);
    }
    let rest_m = female_joints_m();
    for joint in [Joint::LeftFoot, Joint::RightFoot] {
        let off = place_m(&first, joint).distance(rest_m[joint as usize].as_dvec3());
        assert!(off < 1e-3, "{} is off by {off} m", joint.name());
    }
}

#[test]
fn the_pelvis_follows_the_hand_and_the_feet_stay() {
    let mut puppet = standing();
    let [pelvis, chest] = Grip::ALL.map(|grip| puppet.place_m(grip));
    let before = puppet.pose();
    let pull_m = DVec3::new(0.1, -0.05, 0.04);
    puppet
        .hold(Grip::Pelvis, pull_m)
        .expect("a pull within reach");
    assert_eq!(puppet.held(), Some(Grip::Pelvis));
    let after = stepped(&mut puppet, 2.0).pop().expect("poses");
    let moved = puppet.place_m(Grip::Pelvis) - pelvis;
    assert!(moved.distance(pull_m) < 0.02, "{moved}");
    let chest_x = (puppet.place_m(Grip::Chest) - chest).x;
    assert!((0.02..0.08).contains(&chest_x), "{chest_x}");
    for joint in [Joint::LeftFoot, Joint::RightFoot] {
        let slid = place_m(&after, joint).distance(place_m(&before, joint));
        assert!(slid < 0.01, "{} slid {slid} m", joint.name());
    }
}

#[test]
fn the_chest_leans_towards_the_hand_and_takes_the_pelvis_along() {
    let mut puppet = standing();
    let [pelvis, chest] = Grip::ALL.map(|grip| puppet.place_m(grip));
    puppet
        .hold(Grip::Chest, DVec3::new(0.0, 0.0, 0.15))
        .expect("finite");
    stepped(&mut puppet, 2.0);
    let chest_z = (puppet.place_m(Grip::Chest) - chest).z;
    let pelvis_z = (puppet.place_m(Grip::Pelvis) - pelvis).z;
    assert!((0.08..0.16).contains(&chest_z), "{chest_z}");
    assert!(pelvis_z > 0.02 && pelvis_z < 0.7 * chest_z, "{pelvis_z}");
}

#[test]
fn pulled_up_it_leaves_the_floor_and_let_go_it_swings_back() {
    let mut puppet = standing();
    let rest = puppet.pose();
    let pelvis = puppet.place_m(Grip::Pelvis);
    puppet.hold(Grip::Pelvis, 0.6 * DVec3::Y).expect("finite");
    let up = stepped(&mut puppet, 2.0).pop().expect("poses");
    let lift_m = place_m(&up, Joint::LeftFoot).y - place_m(&rest, Joint::LeftFoot).y;
    assert!((0.1..0.4).contains(&lift_m), "{lift_m}");
    puppet.release();
    assert_eq!(puppet.held(), None);
    let back = stepped(&mut puppet, 4.0);
    let lowest = back
        .iter()
        .map(|pose| place_m(pose, Joint::Pelvis).y - pelvis.y)
        .fold(f64::INFINITY, f64::min);
    assert!((-0.2..-0.03).contains(&lowest), "{lowest}");
    let off = puppet.place_m(Grip::Pelvis).distance(pelvis);
    assert!(off < 1e-3, "still {off} m off after four seconds");
}

#[test]
fn the_path_does_not_depend_on_the_display_rate() {
    let at = |rate_hz: f64| {
        let mut puppet = standing();
        puppet
            .hold(Grip::Chest, DVec3::new(-0.15, 0.05, 0.1))
            .expect("finite");
        let mut places = Vec::new();
        for frame in 1..=(1.5 * rate_hz) as usize {
            if frame == (0.5 * rate_hz) as usize + 1 {
                puppet.release();
            }
            puppet.step(1.0 / rate_hz);
            if frame % (rate_hz / 10.0) as usize == 0 {
                places.push(Grip::ALL.map(|grip| puppet.place_m(grip)));
            }
        }
        places
    };
    let reference = at(240.0);
    for rate_hz in [30.0, 60.0, 120.0] {
        let places = at(rate_hz);
        assert_eq!(places.len(), reference.len());
        let pairs = reference.iter().flatten().zip(places.iter().flatten());
        let largest = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(largest < 1e-3, "{rate_hz} Hz: off by {largest} m");
    }
}

#[test]
fn a_pull_that_is_no_number_is_refused_and_odd_steps_do_no_harm() {
    let mut puppet = standing();
    let refused = puppet.hold(Grip::Pelvis, DVec3::new(0.0, f64::NAN, 0.0));
    assert!(matches!(
        refused,
        Err(MotionError::Parameter { name: "pull_m", .. })
    ));
    assert_eq!(puppet.held(), None);
    puppet.hold(Grip::Pelvis, DVec3::X).expect("finite");
    for seconds in [f64::NAN, -1.0, 0.0] {
        assert_eq!(puppet.step(seconds), standing().pose());
    }
    assert!(puppet.step(f64::INFINITY).is_valid());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn whatever_is_pulled_the_pose_is_one_and_stays_near(
        pulls in prop::collection::vec((0..2usize, prop::array::uniform3(-1e200..1e200f64), 0.0..0.3f64), 1..20),
        scale in -200..0i32,
    ) {
        let mut puppet = standing();
        let start = puppet.place_m(Grip::Pelvis);
        for (grip, pull, seconds) in pulls {
            let pull_m = DVec3::from(pull) * 10f64.powi(scale);
            puppet.hold(Grip::ALL[grip], pull_m).expect("finite");
            let pose = puppet.step(seconds);
            prop_assert!(pose.is_valid());
            prop_assert!(place_m(&pose, Joint::Pelvis).distance(start) < 1.0);
        }
    }
}
