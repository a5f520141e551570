//! The graphics device: which adapter, which way of skinning, and what happens when it is lost.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use futures_channel::oneshot;

use crate::{RenderError, gpu_data::JOINT_COUNT};

/// Where skinning runs. Both ways run the same WGSL functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkinningPath {
    /// A compute pass writes skinned vertices, which are drawn and can be read back.
    Compute,
    /// The vertex stage skins (WebGL2 has no compute pass).
    VertexStage,
}

/// Why a device is gone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceLost {
    /// Whether the renderer itself was dropped, which is no failure. A device that the host destroys
    /// is lost like any other.
    pub by_dropping: bool,
    /// What the system said.
    pub message: String,
}

impl DeviceLost {
    fn dropped() -> Self {
        Self {
            by_dropping: true,
            message: "the renderer was dropped".into(),
        }
    }
}

/// A device that draws, shared by all bodies of one renderer.
#[derive(Debug)]
pub struct Gpu {
    pub(crate) adapter: wgpu::Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    skinning: SkinningPath,
    health: Arc<Mutex<Health>>,
}

#[derive(Debug, Default)]
struct Health {
    lost: Option<DeviceLost>,
    waiting: Vec<oneshot::Sender<DeviceLost>>,
    /// Whether the renderer let go of its device by itself.
    dropped: bool,
    /// The first error that no call has reported yet.
    error: Option<String>,
}

/// Storage buffers that the skinning pass binds (`shader/skin_compute.wgsl`).
const SKIN_STORAGE_BUFFERS: u32 = 6;

impl Gpu {
    /// Asks for an adapter that can draw to `surface` (any, without one) and for its device.
    ///
    /// `skinning` forces a way of skinning; by default compute shaders are used where they exist.
    ///
    /// # Errors
    ///
    /// [`RenderError::NoAdapter`], [`RenderError::NoDevice`]; and
    /// [`RenderError::ReadBackUnsupported`] where [`SkinningPath::Compute`] is forced on an adapter
    /// without compute shaders.
    pub async fn new(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        skinning: Option<SkinningPath>,
    ) -> Result<Self, RenderError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let adapter =
            instance
                .request_adapter(&options)
                .await
                .map_err(|error| RenderError::NoAdapter {
                    reason: error.to_string(),
                })?;
        Self::from_adapter(adapter, skinning).await
    }

    /// The device of an adapter that the caller chose.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub async fn from_adapter(
        adapter: wgpu::Adapter,
        skinning: Option<SkinningPath>,
    ) -> Result<Self, RenderError> {
        let can_compute = can_compute(&adapter);
        let skinning = match skinning {
            Some(SkinningPath::Compute) if !can_compute => {
                return Err(RenderError::ReadBackUnsupported);
            }
            Some(forced) => forced,
            None if can_compute => SkinningPath::Compute,
            None => SkinningPath::VertexStage,
        };
        let floor = match skinning {
            SkinningPath::Compute => wgpu::Limits::downlevel_defaults(),
            SkinningPath::VertexStage => wgpu::Limits::downlevel_webgl2_defaults(),
        };
        let mut required_limits = floor.using_resolution(adapter.limits());
        if skinning == SkinningPath::Compute {
            required_limits.max_storage_buffers_per_shader_stage = SKIN_STORAGE_BUFFERS;
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("dynaskin"),
            required_limits,
            ..Default::default()
        };
        let (device, queue) =
            adapter
                .request_device(&descriptor)
                .await
                .map_err(|error| RenderError::NoDevice {
                    adapter: adapter.get_info().name,
                    reason: error.to_string(),
                })?;
        let health = watch(&device);
        Ok(Self {
            adapter,
            device,
            queue,
            skinning,
            health,
        })
    }

    /// Where skinning runs.
    pub fn skinning(&self) -> SkinningPath {
        self.skinning
    }

    /// The device, for hosts that draw with it too.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The adapter's name, backend and kind.
    pub fn info(&self) -> wgpu::AdapterInfo {
        self.adapter.get_info()
    }

    /// Whether the processor stands in for a graphics card.
    pub fn is_software(&self) -> bool {
        self.info().device_type == wgpu::DeviceType::Cpu
    }

    /// Waits until the device is lost. Holds no borrow, so it can run beside the drawing.
    pub fn device_lost(&self) -> impl Future<Output = DeviceLost> + use<> {
        let (sender, receiver) = oneshot::channel();
        let mut health = lock(&self.health);
        match &health.lost {
            Some(lost) => drop(sender.send(lost.clone())),
            None => health.waiting.push(sender),
        }
        drop(health);
        async move { receiver.await.unwrap_or_else(|_| DeviceLost::dropped()) }
    }

    /// The loss of the device, or the first error since the last call.
    pub(crate) fn check_health(&self) -> Result<(), RenderError> {
        let mut health = lock(&self.health);
        if let Some(lost) = &health.lost {
            return Err(RenderError::DeviceLost {
                reason: lost.message.clone(),
            });
        }
        match health.error.take() {
            Some(message) => Err(RenderError::Device { message }),
            None => Ok(()),
        }
    }

    /// Four samples a pixel where the format allows it.
    pub(crate) fn sample_count(&self, format: wgpu::TextureFormat) -> u32 {
        let flags = self.adapter.get_texture_format_features(format).flags;
        let four = flags.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_X4)
            && flags.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        if four { 4 } else { 1 }
    }

    /// A buffer of `bytes` bytes fits the device.
    pub(crate) fn check_buffer_size(
        &self,
        what: &'static str,
        bytes: u64,
    ) -> Result<(), RenderError> {
        let limits = self.device.limits();
        let limit_bytes = match self.skinning {
            SkinningPath::Compute => limits
                .max_buffer_size
                .min(limits.max_storage_buffer_binding_size),
            SkinningPath::VertexStage => limits.max_buffer_size,
        };
        if bytes <= limit_bytes {
            Ok(())
        } else {
            Err(RenderError::TooLarge {
                what,
                needed_bytes: bytes,
                limit_bytes,
            })
        }
    }
}

fn can_compute(adapter: &wgpu::Adapter) -> bool {
    let flags = adapter.get_downlevel_capabilities().flags;
    flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        && adapter.limits().max_storage_buffers_per_shader_stage >= SKIN_STORAGE_BUFFERS
}

/// Keeps what the device reports by itself: wgpu would panic on errors otherwise.
fn watch(device: &wgpu::Device) -> Arc<Mutex<Health>> {
    let health = Arc::new(Mutex::new(Health::default()));
    let on_error = Arc::clone(&health);
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        lock(&on_error).error.get_or_insert(error.to_string());
    }));
    let on_lost = Arc::clone(&health);
    device.set_device_lost_callback(move |_reason, message| {
        let mut health = lock(&on_lost);
        let lost = if health.dropped {
            DeviceLost::dropped()
        } else {
            DeviceLost {
                by_dropping: false,
                message,
            }
        };
        health.tell(lost);
    });
    health
}

impl Health {
    fn tell(&mut self, lost: DeviceLost) {
        for waiting in self.waiting.drain(..) {
            // Whoever stopped waiting does not care.
            let _ = waiting.send(lost.clone());
        }
        self.lost.get_or_insert(lost);
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        let mut health = lock(&self.health);
        health.dropped = true;
        health.tell(DeviceLost::dropped());
    }
}

/// A panic elsewhere leaves the record readable.
fn lock(health: &Mutex<Health>) -> MutexGuard<'_, Health> {
    health.lock().unwrap_or_else(PoisonError::into_inner)
}

const _: () = assert!(
    JOINT_COUNT * 64 <= 16 << 10,
    "WebGL2 takes uniform blocks up to 16 KiB"
);
