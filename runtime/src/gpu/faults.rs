//! What a GPU does to a program that draws with it: it goes away, or has no memory left. Both become errors here; neither may end
//! the program in a panic, which wgpu answers a lost device with in some places.

use super::device::look_again;
use crate::{Error, Result};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::{Device, DeviceLostReason, ErrorFilter, PollType};

/// The complaints of a device that reached nobody else.
#[derive(Clone, Default)]
pub(super) struct Faults(Arc<Mutex<Complaints>>);

#[derive(Default)]
struct Complaints {
    /// Why the device is gone; that stays.
    lost: Option<String>,
    /// The first one since the device was last asked.
    first: Option<Error>,
}

impl Faults {
    /// Listens to a device from now on.
    pub fn listen(device: &Device) -> Self {
        let faults = Self::default();
        let to = faults.clone();
        device.on_uncaptured_error(Arc::new(move |e| to.report(typed(&e))));
        let to = faults.clone();
        device.set_device_lost_callback(move |reason, message| to.lose(reason, &message));
        faults
    }

    fn report(&self, error: Error) {
        log::debug!("{error}");
        self.0.lock().unwrap_or_else(PoisonError::into_inner).first.get_or_insert(error);
    }

    fn lose(&self, reason: DeviceLostReason, message: &str) {
        let why = match reason {
            DeviceLostReason::Destroyed => "it was destroyed by the program".to_owned(),
            DeviceLostReason::Unknown => {
                look_again();
                first_lines(message)
            }
        };
        log::debug!("the device was lost: {why}");
        self.0.lock().unwrap_or_else(PoisonError::into_inner).lost.get_or_insert(why);
    }

    /// The device's loss, or else the first complaint since the last call.
    pub fn check(&self) -> Result<()> {
        let mut complaints = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let first = complaints.first.take();
        match (&complaints.lost, first) {
            (Some(why), _) => Err(Error::Lost(why.clone())),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(()),
        }
    }
}

/// An error of wgpu as one of ours.
fn typed(error: &wgpu::Error) -> Error {
    let cause = std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string);
    match error {
        wgpu::Error::OutOfMemory { .. } => {
            Error::GpuMemory(format!("what it was asked for ({})", first_lines(&cause)))
        }
        _ => Error::Gpu(first_lines(&error.to_string())),
    }
}

/// Errors of wgpu explain themselves over many lines; a user gets them in one.
fn first_lines(message: &str) -> String {
    message.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; ")
}

/// Makes buffers and textures, and whatever else of a device, and hears its complaints itself: those who own the device need
/// not.
///
/// # Errors
/// [`Error::GpuMemory`] with `what` when the memory does not suffice; whatever else is wrong with them, or what `make` says.
pub(super) fn allocate<T>(
    device: &Device,
    what: impl FnOnce() -> String,
    make: impl FnOnce() -> Result<T>,
) -> Result<T> {
    let invalid = device.push_error_scope(ErrorFilter::Validation);
    let memory = device.push_error_scope(ErrorFilter::OutOfMemory);
    let made = make();
    // Scopes of this program's own devices are ready at once.
    let memory = pollster::block_on(memory.pop());
    let invalid = pollster::block_on(invalid.pop());
    match (memory, invalid) {
        (Some(_), _) => Err(Error::GpuMemory(what())),
        (None, Some(error)) => made.and(Err(typed(&error))),
        (None, None) => made,
    }
}

/// Waits until a device has done all that was submitted.
///
/// # Errors
/// [`Error::Lost`] when it is gone meanwhile.
pub fn wait(device: &Device) -> Result<()> {
    guarded(|| device.poll(PollType::wait_indefinitely()))?.map(|_| ()).map_err(|e| Error::Gpu(e.to_string()))
}

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread is inside [`guarded`], so that a panic now becomes an error: for a program's panic hook, which may then
/// stay silent.
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// Calls something that panics when the device is lost under it: wgpu's `poll`, egui's upload of its triangles. Not for code of
/// this program.
///
/// # Errors
/// [`Error::Lost`] with the panic's message.
pub fn guarded<T>(call: impl FnOnce() -> T) -> Result<T> {
    let before = GUARDED.replace(true);
    let done = catch_unwind(AssertUnwindSafe(call));
    GUARDED.set(before);
    done.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
        Error::Lost(first_lines(text))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_under_guard_is_a_lost_device() {
        assert!(matches!(guarded(|| 3), Ok(3)));
        assert!(!is_guarded());
        let failed: Result<()> = guarded(|| {
            assert!(is_guarded());
            // Quiet: unwinds without the hook.
            std::panic::resume_unwind(Box::new("Error in Device::poll:\n  Parent device is lost".to_owned()))
        });
        let Err(Error::Lost(why)) = failed else { panic!("not lost") };
        assert_eq!(why, "Error in Device::poll:; Parent device is lost");
        assert!(!is_guarded());
    }

    #[test]
    fn a_loss_stays_and_other_complaints_are_told_once() {
        let faults = Faults::default();
        assert!(faults.check().is_ok());
        faults.report(Error::Gpu("first".to_owned()));
        faults.report(Error::Gpu("second".to_owned()));
        assert!(matches!(faults.check(), Err(Error::Gpu(why)) if why == "first"));
        assert!(faults.check().is_ok());
        faults.lose(DeviceLostReason::Unknown, "hung\n\n  for long");
        faults.report(Error::Gpu("third".to_owned()));
        for _ in 0..2 {
            assert!(matches!(faults.check(), Err(Error::Lost(why)) if why == "hung; for long"));
        }
    }
}
