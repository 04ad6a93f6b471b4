//! Which bodies the GPU draws.

use super::axes::SCATTERINGS;
use diaphane_formats::asset::Asset;
use diaphane_runtime::Result;
use diaphane_runtime::gpu::{GpuDevice, GpuRenderer, instance};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Why a software adapter leaves most cells out.
const SOFTWARE: &str = "a software adapter draws one scattering of every fourth body";

/// A software adapter draws every so manieth body.
const EVERY: usize = 4;

/// The adapter, as far as it is known.
pub struct Gpu {
    wanted: bool,
    /// One for each scattering, whose renderers follow each other, or why there is none.
    devices: [OnceLock<std::result::Result<GpuDevice, String>>; SCATTERINGS.len()],
    body: AtomicUsize,
}

impl Gpu {
    /// A GPU that is `wanted` or not.
    pub fn new(wanted: bool) -> Self {
        Self { wanted, devices: Default::default(), body: 0.into() }
    }

    /// Body number `b` is next.
    pub fn next_body(&self, b: usize) {
        self.body.store(b, Ordering::Relaxed);
    }

    /// Why cells were not drawn.
    pub fn why_not(&self) -> String {
        let known = || self.devices.iter().filter_map(OnceLock::get);
        let software = || known().flatten().any(GpuDevice::is_software);
        match known().find_map(|d| d.as_ref().err()) {
            Some(reason) => format!("no adapter: {reason}"),
            None if software() => SOFTWARE.to_owned(),
            None => "no ray passes the object".to_owned(),
        }
    }

    /// The renderer of an asset under scattering number `s` of its body; `None` where it is not to be drawn.
    ///
    /// # Errors
    /// An adapter that fails.
    pub fn renderer(&self, asset: &Asset, s: usize) -> Result<Option<GpuRenderer>> {
        if !self.wanted {
            return Ok(None);
        }
        let open = || GpuDevice::open(&instance(), None).map_err(|e| e.to_string());
        let Ok(device) = self.devices[s % self.devices.len()].get_or_init(open) else {
            return Ok(None);
        };
        let some = s == 0 && self.body.load(Ordering::Relaxed).is_multiple_of(EVERY);
        if device.is_software() && !some {
            return Ok(None);
        }
        GpuRenderer::on(device.clone(), asset, None).map(Some)
    }
}
