//! What to do when the window's surface gives no picture to draw on, and how often to begin anew when the GPU fails.

use std::time::{Duration, Instant};
use wgpu::CurrentSurfaceTexture;

/// What asking the surface for its next picture came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acquired {
    /// A picture.
    Ready,
    /// A picture that no longer suits the window quite.
    Suboptimal,
    /// The window has changed.
    Outdated,
    /// The surface is gone.
    Lost,
    /// No picture was free in time.
    Timeout,
    /// Nobody sees the window.
    Occluded,
    /// It was used wrongly, or the device is gone.
    Failed,
}

impl From<&CurrentSurfaceTexture> for Acquired {
    fn from(texture: &CurrentSurfaceTexture) -> Self {
        match texture {
            CurrentSurfaceTexture::Success(_) => Self::Ready,
            CurrentSurfaceTexture::Suboptimal(_) => Self::Suboptimal,
            CurrentSurfaceTexture::Outdated => Self::Outdated,
            CurrentSurfaceTexture::Lost => Self::Lost,
            CurrentSurfaceTexture::Timeout => Self::Timeout,
            CurrentSurfaceTexture::Occluded => Self::Occluded,
            CurrentSurfaceTexture::Validation => Self::Failed,
        }
    }
}

/// What follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Draw on it.
    Show,
    /// Draw on it, then configure the surface.
    ShowAndConfigure,
    /// Configure the surface and ask again after a while.
    Configure(Duration),
    /// Make another surface for the same window and ask again after a while.
    Recreate(Duration),
    /// Ask again after a while.
    Later(Duration),
    /// Nothing helps.
    GiveUp,
}

/// Failures in a row of a surface.
#[derive(Debug, Default)]
pub struct Health {
    failures: u32,
}

/// Failures in a row after which configuring has not helped.
const CONFIGURED: u32 = 3;
/// Failures in a row after which nothing will; most of them wait for [`SHORT`].
const HOPELESS: u32 = 50;
const SHORT: Duration = Duration::from_millis(100);
const LONG: Duration = Duration::from_millis(500);

impl Health {
    /// The next step.
    pub fn next(&mut self, acquired: Acquired) -> Next {
        match acquired {
            Acquired::Ready | Acquired::Suboptimal => self.failures = 0,
            // Neither says anything about the surface.
            Acquired::Timeout => return Next::Later(SHORT),
            Acquired::Occluded => return Next::Later(LONG),
            Acquired::Outdated | Acquired::Lost | Acquired::Failed => self.failures += 1,
        }
        let wait = if self.failures <= CONFIGURED { Duration::ZERO } else { SHORT };
        match acquired {
            Acquired::Ready => Next::Show,
            Acquired::Suboptimal => Next::ShowAndConfigure,
            _ if self.failures > HOPELESS => Next::GiveUp,
            Acquired::Outdated | Acquired::Failed if self.failures <= CONFIGURED => Next::Configure(wait),
            _ => Next::Recreate(wait),
        }
    }
}

/// Whether a window of this size can be drawn on: those that are minimised may have no size at all.
pub fn has_pixels(width: u32, height: u32) -> bool {
    width > 0 && height > 0
}

/// Beginnings anew after failures of the GPU: one that fails again at once is not worth another try.
#[derive(Debug, Default)]
pub struct Retries {
    last: Option<Instant>,
}

/// How long a GPU has to last before it is opened again.
const LASTING: Duration = Duration::from_secs(10);

impl Retries {
    /// Whether to begin anew after a failure now.
    pub fn allow(&mut self, now: Instant) -> bool {
        let soon = self.last.is_some_and(|last| now.saturating_duration_since(last) < LASTING);
        self.last = Some(now);
        !soon
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_shown_and_end_a_row_of_failures() {
        let mut health = Health::default();
        assert_eq!(health.next(Acquired::Ready), Next::Show);
        assert_eq!(health.next(Acquired::Suboptimal), Next::ShowAndConfigure);
        for _ in 0..3 * HOPELESS {
            assert_eq!(health.next(Acquired::Outdated), Next::Configure(Duration::ZERO));
            assert_eq!(health.next(Acquired::Ready), Next::Show);
        }
    }

    #[test]
    fn a_window_that_nobody_sees_is_waited_for_without_end() {
        let mut health = Health::default();
        for _ in 0..3 * HOPELESS {
            assert_eq!(health.next(Acquired::Occluded), Next::Later(LONG));
            assert_eq!(health.next(Acquired::Timeout), Next::Later(SHORT));
        }
        assert_eq!(health.next(Acquired::Ready), Next::Show);
    }

    #[test]
    fn what_configuring_does_not_help_is_made_anew_and_given_up_at_last() {
        for (kind, first) in [
            (Acquired::Outdated, Next::Configure(Duration::ZERO)),
            (Acquired::Failed, Next::Configure(Duration::ZERO)),
            (Acquired::Lost, Next::Recreate(Duration::ZERO)),
        ] {
            let mut health = Health::default();
            (0..CONFIGURED).for_each(|_| assert_eq!(health.next(kind), first));
            (CONFIGURED..HOPELESS).for_each(|_| assert_eq!(health.next(kind), Next::Recreate(SHORT)));
            assert_eq!(health.next(kind), Next::GiveUp);
        }
    }

    #[test]
    fn windows_without_size_are_not_drawn_on() {
        assert!(has_pixels(1, 1) && !has_pixels(0, 0) && !has_pixels(0, 9) && !has_pixels(9, 0));
    }

    #[test]
    fn a_gpu_that_fails_again_at_once_is_not_opened_again() {
        let start = Instant::now();
        let mut retries = Retries::default();
        assert!(retries.allow(start));
        assert!(!retries.allow(start + LASTING / 2));
        assert!(retries.allow(start + 2 * LASTING));
    }
}
