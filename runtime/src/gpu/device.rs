//! Finding an adapter that can draw measured pictures, and catching what the driver complains about.

use super::faults::Faults;
use super::host::Renderer;
use crate::{Error, Result};
use std::sync::{Mutex, PoisonError};
use wgpu::{
    Adapter, Backends, Device, DeviceDescriptor, DeviceType, DownlevelFlags, Features, Instance,
    InstanceDescriptor, Queue, Surface,
};

/// A device with its queue, and the complaints that reached nobody else. Clones are the same device.
#[derive(Clone)]
pub struct GpuDevice {
    /// The device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// Where it comes from.
    pub adapter: Adapter,
    faults: Faults,
}

/// What is used where an adapter has it; times of passes too.
const WANTED: Features = Renderer::FEATURES.union(Features::TIMESTAMP_QUERY);

/// What a full adapter has and the simplest do not.
const NEEDED_FLAGS: DownlevelFlags = DownlevelFlags::COMPUTE_SHADERS
    .union(DownlevelFlags::FRAGMENT_WRITABLE_STORAGE)
    .union(DownlevelFlags::VERTEX_STORAGE)
    .union(DownlevelFlags::INDIRECT_EXECUTION);

/// The process's instances, of which the last is in use. They stay: NVIDIA's driver 580 is not found any more after it was let go
/// of and loaded again some thirty times.
static INSTANCES: Mutex<Instances> = Mutex::new(Instances { all: Vec::new(), stale: false });

struct Instances {
    all: Vec<Instance>,
    /// A device was lost since the last one was made, which may know adapters that are gone.
    stale: bool,
}

/// The process's instance with all backends of this platform, a new one when a device was lost; the environment variables that wgpu
/// knows apply.
pub fn instance() -> Instance {
    let mut known = INSTANCES.lock().unwrap_or_else(PoisonError::into_inner);
    match known.all.last() {
        Some(last) if !known.stale => last.clone(),
        _ => {
            let new = Instance::new(InstanceDescriptor::new_without_display_handle().with_env());
            known.all.push(new.clone());
            known.stale = false;
            new
        }
    }
}

/// Has the next instance look for adapters anew.
pub(super) fn look_again() {
    INSTANCES.lock().unwrap_or_else(PoisonError::into_inner).stale = true;
}

impl GpuDevice {
    /// The best adapter that can draw, hardware before software, and able to show on `surface` if one is given.
    ///
    /// # Errors
    /// [`Error::NoAdapter`], which says what was found and what it lacks.
    pub fn open(instance: &Instance, surface: Option<&Surface<'_>>) -> Result<Self> {
        let mut adapters = pollster::block_on(instance.enumerate_adapters(Backends::all()));
        if adapters.is_empty() {
            return Err(Error::NoAdapter("no Vulkan, Metal or DirectX 12 driver was found".to_owned()));
        }
        adapters.sort_by_key(|a| rank(a.get_info().device_type));
        let mut refused = Vec::new();
        for adapter in adapters {
            if let Some(reason) = lacking(&adapter, surface) {
                refused.push(format!("{} {reason}", adapter.get_info().name));
                continue;
            }
            match Self::request(adapter, u64::MAX) {
                Err(Error::NoAdapter(reason)) => refused.push(reason),
                done => return done,
            }
        }
        Err(Error::NoAdapter(refused.join(", ")))
    }

    /// The same adapter's device once more, whose buffers shaders may see at most `binding` bytes of at once: as little as another
    /// adapter may have.
    ///
    /// # Errors
    /// [`Error::NoAdapter`].
    pub fn with_binding(self, binding: u64) -> Result<Self> {
        Self::request(self.adapter, binding)
    }

    fn request(adapter: Adapter, binding: u64) -> Result<Self> {
        let required_features = adapter.features() & WANTED;
        let name = adapter.get_info().name;
        let mut limits = adapter.limits();
        limits.max_storage_buffer_binding_size = limits.max_storage_buffer_binding_size.min(binding);
        let (device, queue) = pollster::block_on(adapter.request_device(&DeviceDescriptor {
            label: Some("diaphane"),
            required_features,
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|e| Error::NoAdapter(format!("{name} gives no device ({e})")))?;
        let faults = Faults::listen(&device);
        Ok(Self { device, queue, adapter, faults })
    }

    /// The adapter's name, its backend, and whether it is software.
    pub fn describe(&self) -> String {
        let info = self.adapter.get_info();
        let software = if self.is_software() { ", software" } else { "" };
        format!("{} ({}{software})", info.name, info.backend)
    }

    /// Whether the adapter is a program itself.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == DeviceType::Cpu
    }

    /// The first complaint since the last call, as an error; [`Error::Lost`] from the device's loss on.
    ///
    /// # Errors
    /// What the driver said, or that the device was lost.
    pub fn check(&self) -> Result<()> {
        self.faults.check()
    }
}

fn rank(kind: DeviceType) -> u32 {
    match kind {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// Why an adapter cannot be used.
fn lacking(adapter: &Adapter, surface: Option<&Surface<'_>>) -> Option<&'static str> {
    if !adapter.get_downlevel_capabilities().flags.contains(NEEDED_FLAGS) {
        return Some("cannot write storage buffers from all shaders");
    }
    if surface.is_some_and(|s| !adapter.is_surface_supported(s)) {
        return Some("cannot show pictures in this window");
    }
    None
}
