//! What networks are trained on.

use burn::tensor::{Device, Tensor, TensorData};

use crate::TrainError;

/// What networks are trained on. Weights, checkpoints and files are the same for all.
///
/// A seed gives the same weights again on one device for one training at a time: burn's random
/// numbers belong to the process, and two trainings in it would take them from each other.
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
        let device = found.ok_or_else(|| {
            self.missing("no such device was found; is its driver installed?".into())
        })?;
        check(&device).map_err(|reason| self.missing(reason))?;
        Ok(device)
    }

    #[cfg_attr(all(feature = "cuda", feature = "vulkan"), allow(dead_code))]
    fn missing(self, reason: String) -> TrainError {
        TrainError::Device {
            device: self.name(),
            reason,
        }
    }
}

/// Whether a device multiplies and sums as it should. Drivers that draw in software were seen to sum
/// to zero: losses of zero, and weights that nobody should keep.
#[cfg_attr(not(any(feature = "cuda", feature = "vulkan", test)), allow(dead_code))]
fn check(device: &Device) -> Result<(), String> {
    const SIDE: usize = 96;
    // Whole numbers small enough that sums are exact in single precision.
    let value = |row: usize, column: usize| ((3 * row + 7 * column) % 5) as f32 - 2.0;
    let numbers: Vec<f32> = (0..SIDE * SIDE)
        .map(|idx| value(idx / SIDE, idx % SIDE))
        .collect();
    let expected: f32 = (0..SIDE)
        .flat_map(|row| (0..SIDE).map(move |column| (row, column)))
        .map(|(row, column)| {
            let product: f32 = (0..SIDE).map(|k| value(row, k) * value(k, column)).sum();
            product.abs()
        })
        .sum();
    let data = TensorData::new(numbers, [SIDE, SIDE]);
    let matrix = Tensor::<2>::from_data(data, device);
    let got = matrix
        .clone()
        .matmul(matrix)
        .abs()
        .sum()
        .into_scalar::<f32>();
    if (got / expected - 1.0).abs() < 1e-3 {
        Ok(())
    } else {
        Err(format!(
            "it computes wrongly: a sum of products is {got} instead of {expected}; use another driver"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_always_there_and_names_come_back() {
        let processor = Compute::default().device().expect("the processor");
        assert_eq!(check(&processor), Ok(()));
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
