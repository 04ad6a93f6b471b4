//! Which bodies the GPU draws.

use diaphane_formats::asset::Asset;
use diaphane_runtime::gpu::GpuRenderer;
use diaphane_runtime::{Error, Result};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Why a software adapter leaves most cells out.
pub const SOFTWARE: &str = "a software adapter draws one scattering of every fourth body";

/// A software adapter draws every so manieth body.
const EVERY: usize = 4;

/// The adapter, as far as it is known.
pub struct Gpu {
    wanted: bool,
    missing: AtomicBool,
    software: AtomicBool,
    body: AtomicUsize,
}

impl Gpu {
    /// A GPU that is `wanted` or not.
    pub fn new(wanted: bool) -> Self {
        let (missing, software, body) = (false.into(), false.into(), 0.into());
        Self { wanted, missing, software, body }
    }

    /// Body number `b` is next.
    pub fn next_body(&self, b: usize) {
        self.body.store(b, Ordering::Relaxed);
    }

    /// Whether one was looked for in vain.
    pub fn is_missing(&self) -> bool {
        self.missing.load(Ordering::Relaxed)
    }

    /// Whether it is a program itself.
    pub fn is_software(&self) -> bool {
        self.software.load(Ordering::Relaxed)
    }

    /// The renderer of an asset under scattering number `s` of its body; `None` where it is not to be drawn.
    ///
    /// # Errors
    /// An adapter that fails.
    pub fn renderer(&self, asset: &Asset, s: usize) -> Result<Option<GpuRenderer>> {
        let some = s == 0 && self.body.load(Ordering::Relaxed).is_multiple_of(EVERY);
        if !self.wanted || self.is_missing() || (self.is_software() && !some) {
            return Ok(None);
        }
        match GpuRenderer::new(asset, None) {
            Ok(renderer) => {
                let software = renderer.adapter().ends_with("software)");
                self.software.store(software, Ordering::Relaxed);
                Ok((some || !software).then_some(renderer))
            }
            Err(Error::NoAdapter(_)) => {
                self.missing.store(true, Ordering::Relaxed);
                Ok(None)
            }
            Err(e) => Err(e),
        }
    }
}
