//! Which bodies the GPU draws.

use super::axes::SCATTERINGS;
use diaphane_formats::asset::Asset;
use diaphane_runtime::gpu::{GpuDevice, GpuRenderer, instance};
use diaphane_runtime::{Error, Result};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Why a software adapter leaves most cells out.
const SOFTWARE: &str = "a software adapter draws one scattering of every fourth body";

/// A software adapter draws every so manieth body.
const EVERY: usize = 4;

/// The adapter, as far as it is known.
pub struct Gpu {
    wanted: bool,
    /// Whether the adapter is a program itself, or why there is none.
    software: OnceLock<std::result::Result<bool, String>>,
    /// One for each scattering, whose renderers follow each other.
    devices: [Mutex<Option<GpuDevice>>; SCATTERINGS.len()],
    body: AtomicUsize,
}

impl Gpu {
    /// A GPU that is `wanted` or not.
    pub fn new(wanted: bool) -> Self {
        Self { wanted, software: OnceLock::new(), devices: Default::default(), body: 0.into() }
    }

    /// Body number `b` is next.
    pub fn next_body(&self, b: usize) {
        self.body.store(b, Ordering::Relaxed);
    }

    /// Why cells were not drawn.
    pub fn why_not(&self) -> String {
        match self.software.get() {
            Some(Err(reason)) => format!("no adapter: {reason}"),
            Some(Ok(true)) => SOFTWARE.to_owned(),
            _ => "no ray passes the object".to_owned(),
        }
    }

    /// The renderer of an asset under scattering number `s` of its body; `None` where it is not to be drawn.
    ///
    /// # Errors
    /// An adapter that fails, or that is gone after it was there.
    pub fn renderer(&self, asset: &Asset, s: usize) -> Result<Option<GpuRenderer>> {
        if !self.wanted {
            return Ok(None);
        }
        let look = || match GpuDevice::open(&instance(), None) {
            Ok(device) => Ok(device.is_software()),
            Err(e) => Err(e.to_string()),
        };
        let some = s == 0 && self.body.load(Ordering::Relaxed).is_multiple_of(EVERY);
        match self.software.get_or_init(look) {
            Ok(software) if some || !software => {
                GpuRenderer::on(self.device(s % self.devices.len())?, asset, None).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// A device that stays, opened again when it was lost.
    fn device(&self, s: usize) -> Result<GpuDevice> {
        let mut known = self.devices[s].lock().unwrap_or_else(PoisonError::into_inner);
        let lost = |d: &GpuDevice| matches!(d.check(), Err(Error::Lost(_)));
        if let Some(device) = known.as_ref().filter(|d| !lost(d)) {
            return Ok(device.clone());
        }
        let device = GpuDevice::open(&instance(), None)?;
        *known = Some(device.clone());
        Ok(device)
    }
}
