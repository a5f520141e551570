//! Many avatars at once.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use dynaskin_body::Pose;
use dynaskin_runtime::{Avatar, Crowd, CrowdReport, LevelOfDetail};
use wasm_bindgen::prelude::*;

use crate::avatar::{CoreAvatar, now_ms};
use crate::error::Thrown;
use crate::model::CoreModel;
use crate::pose::{self, POSE_LENGTH};

/// Avatars of one model that are stepped together.
#[wasm_bindgen]
pub struct CoreCrowd {
    crowd: Crowd,
    avatars: Vec<Rc<RefCell<Avatar>>>,
    /// The poses as JavaScript writes them, [`POSE_LENGTH`] numbers an avatar.
    numbers: Vec<f64>,
    poses: Vec<Pose>,
    report: CrowdReport,
}

#[wasm_bindgen]
impl CoreCrowd {
    /// A crowd without avatars.
    ///
    /// # Errors
    /// Throws `network` where the networks cannot be set up.
    #[wasm_bindgen(constructor)]
    pub fn new(model: &CoreModel) -> Result<CoreCrowd, JsValue> {
        Ok(Self {
            crowd: Crowd::new(Arc::clone(&model.model)).map_err(Thrown::from)?,
            avatars: Vec::new(),
            numbers: Vec::new(),
            poses: Vec::new(),
            report: CrowdReport::default(),
        })
    }

    /// Adds an avatar at the end.
    ///
    /// # Errors
    /// Throws `argument` for an avatar that is in it.
    pub fn add(&mut self, avatar: &CoreAvatar) -> Result<(), JsValue> {
        let is_in = |member: &Rc<RefCell<Avatar>>| Rc::ptr_eq(member, &avatar.avatar);
        if self.avatars.iter().any(is_in) {
            let message = "The avatar is in the crowd already.".to_owned();
            return Err(Thrown::argument(message).into());
        }
        self.avatars.push(Rc::clone(&avatar.avatar));
        self.numbers.resize(POSE_LENGTH * self.avatars.len(), 0.0);
        self.poses.resize(self.avatars.len(), Pose::REST);
        Ok(())
    }

    /// Takes the avatar number `index` out; those after it move up.
    ///
    /// # Errors
    /// Throws `argument` where there is none.
    pub fn remove(&mut self, index: usize) -> Result<(), JsValue> {
        if index >= self.avatars.len() {
            return Err(Thrown::argument(format!("There is no avatar {index}.")).into());
        }
        self.avatars.remove(index);
        self.numbers.truncate(POSE_LENGTH * self.avatars.len());
        self.poses.truncate(self.avatars.len());
        Ok(())
    }

    /// Address of the poses to be written before a step: f64, `[avatar][99]`. Good until an avatar
    /// is added.
    #[wasm_bindgen(js_name = posesPtr)]
    pub fn poses_ptr(&mut self) -> usize {
        self.numbers.as_mut_ptr() as usize
    }

    /// Moves all avatars on by `dt_seconds` to the poses at [`Self::poses_ptr`].
    ///
    /// # Errors
    /// Throws `argument`, `pose`: all avatars stay as they were.
    #[wasm_bindgen(js_name = stepAll)]
    pub fn step_all(&mut self, dt_seconds: f64) -> Result<(), JsValue> {
        let numbers = self.numbers.chunks_exact(POSE_LENGTH);
        for (pose, numbers) in self.poses.iter_mut().zip(numbers) {
            *pose = pose::from_numbers(numbers)?;
        }
        let mut borrowed: Vec<_> = self.avatars.iter().map(|a| a.borrow_mut()).collect();
        let mut avatars: Vec<&mut Avatar> = borrowed.iter_mut().map(|a| &mut **a).collect();
        let stopwatch = &mut || 1e-3 * now_ms();
        let stepped = self
            .crowd
            .step_all(&mut avatars, &self.poses, dt_seconds, stopwatch);
        self.report = stepped.map_err(Thrown::from)?;
        Ok(())
    }

    /// Sets by what avatars get less detail: metres from the camera, and milliseconds per tick, NaN
    /// for no such limit.
    ///
    /// # Errors
    /// Throws `argument` for numbers that contradict each other.
    #[wasm_bindgen(js_name = setLevelOfDetail)]
    pub fn set_level_of_detail(
        &mut self,
        half_beyond_m: f64,
        asleep_beyond_m: f64,
        budget_ms: f64,
    ) -> Result<(), JsValue> {
        let mut level_of_detail = LevelOfDetail::default();
        level_of_detail.half_beyond_m = half_beyond_m;
        level_of_detail.asleep_beyond_m = asleep_beyond_m;
        level_of_detail.budget_seconds = (!budget_ms.is_nan()).then_some(1e-3 * budget_ms);
        let set = self.crowd.set_level_of_detail(Some(level_of_detail));
        Ok(set.map_err(Thrown::from)?)
    }

    /// Leaves the avatars the detail they have.
    ///
    /// # Errors
    /// None in practice.
    #[wasm_bindgen(js_name = clearLevelOfDetail)]
    pub fn clear_level_of_detail(&mut self) -> Result<(), JsValue> {
        let set = self.crowd.set_level_of_detail(None);
        Ok(set.map_err(Thrown::from)?)
    }

    /// Distances by default, in metres: half beyond, asleep beyond.
    #[wasm_bindgen(js_name = defaultDistances)]
    pub fn default_distances() -> Vec<f64> {
        let default = LevelOfDetail::default();
        vec![default.half_beyond_m, default.asleep_beyond_m]
    }

    /// Of the last step: avatars at full detail, at half, and asleep or out of sight; then
    /// milliseconds for features, predict, decode, apply and skin matrices, of all together.
    pub fn report(&self) -> Vec<f64> {
        let CrowdReport {
            full,
            half,
            asleep,
            seconds,
            ..
        } = self.report;
        vec![
            full as f64,
            half as f64,
            asleep as f64,
            1e3 * seconds.features,
            1e3 * seconds.predict,
            1e3 * seconds.decode,
            1e3 * seconds.apply,
            1e3 * seconds.skin,
        ]
    }
}
