//! A body moved by hand.

use dynaskin_body::JOINT_COUNT;
use dynaskin_motion::{Grip, Puppet};
use glam::{DVec3, Vec3};
use wasm_bindgen::prelude::*;

use crate::error::Thrown;
use crate::pose;

/// A standing body of which a part can be held and pulled.
#[wasm_bindgen]
pub struct CorePuppet {
    puppet: Puppet,
}

impl CorePuppet {
    pub(crate) fn new(joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Self, Thrown> {
        Ok(Self {
            puppet: Puppet::new(joints_rest_m)?,
        })
    }
}

#[wasm_bindgen]
impl CorePuppet {
    /// Names of the parts that can be held.
    #[wasm_bindgen(js_name = gripNames)]
    pub fn grip_names() -> Vec<String> {
        Grip::ALL.map(|grip| grip.name().to_owned()).into()
    }

    /// Holds a part and pulls it from its place in the standing body, in metres.
    ///
    /// # Errors
    /// Throws `argument` for an unknown part, `motion` for a pull that is not finite.
    pub fn hold(&mut self, grip: &str, x: f64, y: f64, z: f64) -> Result<(), JsValue> {
        let pull_m = DVec3::new(x, y, z);
        Ok(self
            .puppet
            .hold(part(grip)?, pull_m)
            .map_err(Thrown::from)?)
    }

    /// Lets go.
    pub fn release(&mut self) {
        self.puppet.release();
    }

    /// Name of the part that is held.
    #[wasm_bindgen(getter)]
    pub fn held(&self) -> Option<String> {
        self.puppet.held().map(|grip| grip.name().to_owned())
    }

    /// Moves on by `dt_seconds` and writes the pose into the 99 numbers of `out`.
    ///
    /// # Errors
    /// Throws `argument` for an array of another length or a step that is not finite.
    pub fn step(&mut self, dt_seconds: f64, out: &mut [f64]) -> Result<(), JsValue> {
        if !dt_seconds.is_finite() {
            let message = format!("The step is {dt_seconds} s; give a finite number.");
            return Err(Thrown::argument(message).into());
        }
        Ok(pose::to_numbers(&self.puppet.step(dt_seconds), out)?)
    }

    /// Where a part is now: x, y, z in metres, world.
    ///
    /// # Errors
    /// Throws `argument` for an unknown part.
    #[wasm_bindgen(js_name = placeOf)]
    pub fn place_of(&self, grip: &str) -> Result<Vec<f64>, JsValue> {
        Ok(self.puppet.place_m(part(grip)?).to_array().into())
    }
}

fn part(name: &str) -> Result<Grip, Thrown> {
    Grip::from_name(name).ok_or_else(|| {
        let names = Grip::ALL.map(Grip::name).join(", ");
        Thrown::argument(format!("`{name}` cannot be held; there are {names}."))
    })
}
