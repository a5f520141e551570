//! What networks are trained on.

use burn::tensor::Device;

use crate::TrainError;

/// What networks are trained on. Weights, checkpoints and files are the same for all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compute {
    /// The processor.
    #[default]
    Cpu,
    /// The first NVIDIA card, through CUDA; needs the cargo feature `cuda`.
    Cuda,
    /// The first card that Vulkan knows; needs the cargo feature `vulkan`.
    Vulkan,
}

impl Compute {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Cpu, Self::Cuda, Self::Vulkan];

    /// Name in commands, and of the cargo feature.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Cuda => "cuda",
            Self::Vulkan => "vulkan",
        }
    }

    /// The one called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|compute| compute.name() == name)
    }

    /// Its first device.
    ///
    /// # Errors
    /// [`TrainError::Device`] if there is none or the program was built without it.
    pub fn device(self) -> Result<Device, TrainError> {
        match self {
            Self::Cpu => Ok(Device::flex()),
            #[cfg(feature = "cuda")]
            Self::Cuda => self.first(burn::tensor::DeviceType::Cuda),
            #[cfg(feature = "vulkan")]
            Self::Vulkan => self.first(burn::tensor::DeviceType::Vulkan),
            #[cfg(not(all(feature = "cuda", feature = "vulkan")))]
            _ => Err(self.missing(format!(
                "this program was built without it: build with `--features {}`",
                self.name()
            ))),
        }
    }

    #[cfg(any(feature = "cuda", feature = "vulkan"))]
    fn first(self, kind: burn::tensor::DeviceType) -> Result<Device, TrainError> {
        let found = Device::enumerate(kind).into_iter().next();
        found.ok_or_else(|| {
            self.missing("no such device was found; is its driver installed?".into())
        })
    }

    #[cfg_attr(all(feature = "cuda", feature = "vulkan"), allow(dead_code))]
    fn missing(self, reason: String) -> TrainError {
        TrainError::Device {
            device: self.name(),
            reason,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_always_there_and_names_come_back() {
        Compute::default().device().expect("the processor");
        for compute in Compute::ALL {
            assert_eq!(Compute::from_name(compute.name()), Some(compute));
        }
        assert_eq!(Compute::from_name("abacus"), None);
    }

    #[cfg(not(feature = "cuda"))]
    #[test]
    fn what_was_not_built_in_is_refused_by_name() {
        let error = Compute::Cuda
            .device()
            .expect_err("not built in")
            .to_string();
        assert!(error.contains("--features cuda"), "{error}");
    }
}
