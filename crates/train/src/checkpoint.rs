//! Training state on disk, written after every epoch, so that a run can go on where it stopped.

use std::fs;
use std::path::{Path, PathBuf};

use burn::module::Module;
use burn::optim::{ModuleOptimizer, OptimizerRecord};
use burn::store::{ModuleRecord, RecordError};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::TrainError;

/// Losses and time of one epoch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpochRecord {
    /// The epoch, from 1.
    pub epoch: usize,
    /// Mean training loss, in millimetres unless the network says otherwise.
    pub training_loss: f32,
    /// Mean validation loss in the same unit.
    pub validation_loss: f32,
    /// Validation loss divided by that of zero offsets.
    pub validation_ratio: f32,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// A folder with the training state.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    dir: PathBuf,
    /// Fingerprint of the data ([`crate::DataSet::fingerprint`]), where it is known.
    data: Option<String>,
}

/// What `state.json` holds: settings `C`, the data's fingerprint, and one record `R` an epoch.
#[derive(Serialize, Deserialize)]
struct State<C, R> {
    config: C,
    data: Option<String>,
    history: Vec<R>,
}

impl Checkpoint {
    /// Keeps training state in the folder `dir`, which is made if need be.
    ///
    /// # Errors
    /// [`TrainError::Io`].
    pub fn new(dir: &Path) -> Result<Self, TrainError> {
        fs::create_dir_all(dir).map_err(TrainError::io(dir, "making the folder"))?;
        Ok(Self {
            dir: dir.to_owned(),
            data: None,
        })
    }

    /// The same, for training on data of this fingerprint: a run on other data is not taken up.
    #[must_use]
    pub fn for_data(self, fingerprint: String) -> Self {
        Self {
            data: Some(fingerprint),
            ..self
        }
    }

    fn state(&self) -> PathBuf {
        self.dir.join("state.json")
    }

    fn weights(&self) -> PathBuf {
        self.dir.join("weights.bpk")
    }

    fn optimizer(&self) -> PathBuf {
        self.dir.join("optimizer.bpk")
    }

    fn best(&self) -> PathBuf {
        self.dir.join("best.bpk")
    }

    /// Whether the folder holds a run, finished or not.
    pub fn holds_run(&self) -> bool {
        self.state().exists()
    }

    /// Forgets an earlier run.
    pub fn clear(&self) -> Result<(), TrainError> {
        let path = self.state();
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(TrainError::io(&path, "removing")(error))
            }
            _ => Ok(()),
        }
    }

    /// Writes the state after an epoch. `state.json` comes last and by renaming: a run that is
    /// killed in between leaves the weights of one epoch more than the history tells, no less.
    pub fn save<M: Module>(
        &self,
        model: &M,
        optimizer: &ModuleOptimizer,
        config: &impl Serialize,
        history: &[impl Serialize],
        best: bool,
    ) -> Result<(), TrainError> {
        let replace = |path: PathBuf, save: &dyn Fn(&Path) -> Result<(), RecordError>| {
            let part = path.with_extension("part");
            save(&part).map_err(|error| unusable(&part, error.to_string()))?;
            let synced = fs::File::open(&part).and_then(|file| file.sync_all());
            synced.map_err(TrainError::io(&part, "writing"))?;
            fs::rename(&part, &path).map_err(TrainError::io(&path, "renaming"))
        };
        let plain = model.valid();
        if best {
            replace(self.best(), &|part| plain.clone().into_record().save(part))?;
        }
        replace(self.weights(), &|part| {
            plain.clone().into_record().save(part)
        })?;
        replace(self.optimizer(), &|part| optimizer.to_record().save(part))?;
        let failed = |error: serde_json::Error| unusable(&self.state(), error.to_string());
        let history = history.iter().map(serde_json::to_value);
        let state = State {
            config: serde_json::to_value(config).map_err(failed)?,
            data: self.data.clone(),
            history: history.collect::<Result<Vec<_>, _>>().map_err(failed)?,
        };
        self.write_losses(&state.history)?;
        let state = serde_json::to_string_pretty(&state).map_err(failed)?;
        Ok(dynaskin_files::replace(&self.state(), state.as_bytes())?)
    }

    /// One line an epoch, with the fields of its record.
    fn write_losses(&self, history: &[Value]) -> Result<(), TrainError> {
        let records = history.iter().filter_map(Value::as_object);
        let mut csv = String::new();
        for (index, record) in records.enumerate() {
            if index == 0 {
                let names: Vec<&str> = record.keys().map(String::as_str).collect();
                csv = names.join(",") + "\n";
            }
            let fields: Vec<String> = record.values().map(Value::to_string).collect();
            csv += &(fields.join(",") + "\n");
        }
        let path = self.dir.join("losses.csv");
        Ok(dynaskin_files::replace(&path, csv.as_bytes())?)
    }

    /// Takes up an earlier run, if `same` finds its settings to be those of this one.
    pub fn load<M: Module, C: DeserializeOwned, R: DeserializeOwned>(
        &self,
        model: M,
        optimizer: &mut ModuleOptimizer,
        same: impl FnOnce(C) -> bool,
    ) -> Result<(M, Vec<R>), TrainError> {
        let path = self.state();
        let state: State<C, R> = self.read_state()?;
        if !same(state.config) {
            return Err(unusable(&path, "it was made with other settings".into()));
        }
        if state.data != self.data {
            let reason = "it was made with other clips or another split".into();
            return Err(unusable(&path, reason));
        }
        let model = load_weights(&self.weights(), model)?;
        let path = self.optimizer();
        let record =
            OptimizerRecord::load(&path).map_err(|error| unusable(&path, error.to_string()))?;
        *optimizer = optimizer.clone().load_record(record);
        Ok((model, state.history))
    }

    /// Seconds of training so far, over all runs that were resumed.
    ///
    /// # Errors
    /// [`TrainError::Io`], [`TrainError::Checkpoint`].
    pub fn seconds(&self) -> Result<f64, TrainError> {
        let state: State<Value, Value> = self.read_state()?;
        let seconds = |epoch: &Value| epoch.get("seconds").and_then(Value::as_f64);
        Ok(state.history.iter().filter_map(seconds).sum())
    }

    fn read_state<C: DeserializeOwned, R: DeserializeOwned>(
        &self,
    ) -> Result<State<C, R>, TrainError> {
        let path = self.state();
        let text = fs::read_to_string(&path).map_err(TrainError::io(&path, "reading"))?;
        serde_json::from_str(&text).map_err(|error| unusable(&path, error.to_string()))
    }

    /// The weights of the best epoch.
    pub fn load_best<M: Module>(&self, model: M) -> Result<M, TrainError> {
        load_weights(&self.best(), model)
    }
}

fn load_weights<M: Module>(path: &Path, model: M) -> Result<M, TrainError> {
    let record = ModuleRecord::load(path).map_err(|error| unusable(path, error.to_string()))?;
    model
        .try_load_record(record)
        .map_err(|error| unusable(path, error.to_string()))
}

fn unusable(path: &Path, reason: String) -> TrainError {
    TrainError::Checkpoint {
        path: path.to_owned(),
        reason,
    }
}
