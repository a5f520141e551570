//! A made-up model and its avatars, on which accepted files are tried.

use std::cell::RefCell;
use std::sync::{Arc, OnceLock};

use dynaskin_body::{BodyModel, Pose};
use dynaskin_runtime::{
    Avatar, Bundle, Controls, Detail, LoweredNetworks, Model, RuntimeError, Skinning, lower,
};
use glam::Vec3;

use crate::made_up;

/// As small as a body and networks can be that have everything.
pub const TINY: made_up::Size = made_up::Size {
    rings: 12,
    segments: 3,
    cells: 2,
    latents: 2,
};

/// Ticks of an avatar that an accepted file is tried for.
pub const TICKS: usize = 24;

/// Length of a tick in seconds.
pub const TICK_SECONDS: f64 = 1.0 / 60.0;

/// The made-up body.
pub fn body() -> &'static Arc<BodyModel> {
    static BODY: OnceLock<Arc<BodyModel>> = OnceLock::new();
    BODY.get_or_init(|| Arc::new(made_up::body_of(TINY)))
}

/// Its networks: predictor and decoder.
pub fn networks() -> &'static (Vec<u8>, Vec<u8>) {
    static NETWORKS: OnceLock<(Vec<u8>, Vec<u8>)> = OnceLock::new();
    NETWORKS.get_or_init(|| (made_up::predictor_of(TINY), made_up::decoder_of(TINY)))
}

/// The same, lowered.
pub fn lowered() -> &'static LoweredNetworks {
    static LOWERED: OnceLock<LoweredNetworks> = OnceLock::new();
    LOWERED.get_or_init(|| {
        let (predictor, decoder) = networks();
        let lowered = lower(&bundle(), predictor, decoder);
        lowered.expect("the made-up networks can be lowered")
    })
}

/// What belongs together.
pub fn bundle() -> Bundle {
    let (predictor, decoder) = networks();
    made_up::bundle_of(TINY, predictor, decoder)
}

/// The model of them.
pub fn model() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| made_up::model_of(TINY))
}

fn avatar() -> Avatar {
    let avatar = Avatar::new(Arc::clone(model()), &[0.0; 10]);
    avatar.expect("the average shape is a shape")
}

thread_local! {
    /// For motions; reset before each.
    static ACTOR: RefCell<Avatar> = RefCell::new(avatar());
    /// For saved states, and its own state to go back to.
    static KEEPER: RefCell<(Avatar, Vec<u8>)> = RefCell::new({
        let avatar = avatar();
        let state = avatar.save();
        (avatar, state)
    });
}

/// Plays poses on the made-up model.
///
/// # Panics
/// Where one is refused, or the surface is not finite.
pub fn play(pose_at_tick: impl Fn(usize) -> Pose) {
    ACTOR.with_borrow_mut(|avatar| {
        avatar.reset();
        for tick in 0..TICKS {
            let stepped = avatar.step(&pose_at_tick(tick), TICK_SECONDS);
            stepped.expect("an accepted pose can be stepped to");
        }
        assert_finite(avatar);
    });
}

/// Restores an avatar, saves it, restores that and steps it. Whether the state was accepted; whether a refused
/// one changed something is looked at only where `is_watched`.
///
/// # Panics
/// Where an accepted state cannot be gone on from, and where a refused one changed the avatar.
pub fn try_state(state: &[u8], is_watched: bool) -> bool {
    KEEPER.with_borrow_mut(|(avatar, own)| {
        if avatar.restore(state).is_err() {
            if is_watched {
                assert_eq!(&avatar.save(), own, "a refused state changes nothing");
            }
            return false;
        }
        assert_finite(avatar);
        let saved = avatar.save();
        avatar.restore(&saved).expect("what was saved is a state");
        assert_eq!(avatar.save(), saved, "a state is saved as it was restored");
        for tick in 0..TICKS {
            let stepped = avatar.step(&pose_at(tick), TICK_SECONDS);
            // A state may hold finite numbers that the networks make infinite ones of.
            if let Err(error) = stepped {
                assert!(matches!(error, RuntimeError::NonFinite { .. }), "{error}");
            }
            assert_finite(avatar);
        }
        avatar.restore(own).expect("its own state is a state");
        true
    })
}

/// A pose of the made-up motion.
pub fn pose_at(tick: usize) -> Pose {
    made_up::pose_at(tick as f64 * TICK_SECONDS)
}

/// # Panics
/// Where something that a host shows is not finite.
pub fn assert_finite(avatar: &mut Avatar) {
    let finite = |vectors: &[Vec3]| vectors.iter().all(|v| v.is_finite());
    assert!(finite(avatar.offsets_rest_m()), "finite offsets");
    assert!(finite(avatar.positions_rest_m()), "finite positions");
    assert!(finite(avatar.normals_rest()), "finite normals");
    assert!(
        avatar.skin_matrices().iter().all(|m| m.is_finite()),
        "finite skin matrices"
    );
    let skinning = avatar.skinning();
    for each in [Skinning::DualQuaternion, Skinning::Linear, skinning] {
        avatar.set_skinning(each);
        let (positions, normals) = avatar.skin();
        assert!(
            finite(positions) && finite(normals),
            "a finite surface, {each:?}"
        );
    }
}

/// States of avatars in every situation that is saved.
pub fn states() -> Vec<Vec<u8>> {
    let mut states = Vec::new();
    let mut avatar = avatar();
    states.push(avatar.save());
    let step = |avatar: &mut Avatar, tick: usize| {
        let stepped = avatar.step(&pose_at(tick), TICK_SECONDS);
        stepped.expect("a made-up pose can be stepped to");
    };
    for tick in 0..9 {
        step(&mut avatar, tick);
    }
    states.push(avatar.save());
    let controls = avatar.set_controls(&Controls::calm_clothes());
    controls.expect("a preset is valid");
    avatar.set_scale(2.0).expect("a scale in range");
    for tick in 9..15 {
        step(&mut avatar, tick);
    }
    states.push(avatar.save());
    // In the middle of a fade.
    let mut far = pose_at(15);
    far.root_translation_m.x += 9.0;
    let cut = avatar.step(&far, TICK_SECONDS);
    cut.expect("a cut can be stepped over");
    states.push(avatar.save());
    avatar.set_detail(Detail::Asleep);
    step(&mut avatar, 16);
    states.push(avatar.save());
    avatar.set_enabled(false);
    step(&mut avatar, 17);
    states.push(avatar.save());
    states
}
