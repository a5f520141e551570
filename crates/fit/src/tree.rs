//! Which joints move a vertex.

use dynaskin_body::{JOINT_COUNT, Joint, SkinWeights};

/// Per joint the chain from it up to the pelvis, itself first.
pub fn chain(joint: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(Joint::ALL[joint]), |joint| joint.parent())
        .map(|joint| joint as usize)
}

/// The joints whose rotation moves a vertex: those it hangs on, and their ancestors; as bits.
pub fn moving_joints(skin: &SkinWeights) -> u32 {
    let mut bits = 0;
    for (&joint, &weight) in skin.joints.iter().zip(&skin.weights) {
        if weight > 0.0 {
            for joint in chain(usize::from(joint)) {
                bits |= 1 << joint;
            }
        }
    }
    bits
}

/// The indices of the bits that are set.
pub fn joints_of(bits: u32) -> impl Iterator<Item = usize> {
    (0..JOINT_COUNT).filter(move |joint| bits & (1 << joint) != 0)
}
