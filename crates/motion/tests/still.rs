//! Files in which nobody moves, as programs save them that show the rest pose at that time.

mod common;

use common::{MIXAMO, female_joints_m, source_bvh};
use dynaskin_motion::MotionFile;

fn notes(frames: &[Vec<f64>]) -> Vec<String> {
    let text = source_bvh(&MIXAMO, 1.0, frames);
    let file = MotionFile::parse(text.as_bytes()).expect("a BVH file");
    file.clip(&female_joints_m()).expect("a person").notes
}

fn says_still(frames: &[Vec<f64>]) -> bool {
    notes(frames)
        .iter()
        .any(|note| note.contains("nothing moves"))
}

#[test]
fn a_file_in_which_nothing_moves_says_so() {
    assert!(says_still(&vec![vec![]; 20]));
}

#[test]
fn a_pose_alone_and_whatever_moves_say_nothing() {
    assert!(!says_still(&[vec![]]));
    let mut frames = vec![vec![]; 20];
    // The pelvis rises by a millimetre, or turns by a tenth of a degree.
    frames[7] = vec![0.0, 0.1];
    assert!(!says_still(&frames));
    frames[7] = vec![0.0, 0.0, 0.0, 0.1];
    assert!(!says_still(&frames));
}
