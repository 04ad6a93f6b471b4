//! The governor against simulated renderers whose frames take a + b n milliseconds, n the samples drawn.

use super::*;
use crate::detail::Detail;

/// Samples by level.
const SAMPLES: [u64; 4] = [50_000, 12_500, 3_125, 781];

/// A renderer of one object.
struct Simulated {
    governor: Governor,
    /// Milliseconds a frame, and a sample.
    fixed: f64,
    per_sample: f64,
    /// Times are up to so much longer or shorter.
    noise: f64,
    /// Whether levels are drawn on top of each other while they fade.
    fades: bool,
    pixels: f32,
    frame: u64,
}

impl Simulated {
    fn new(budget: f64, fixed: f64, per_sample: f64) -> Self {
        let governor = Governor::new(Fineness::DEFAULT, budget);
        Self { governor, fixed, per_sample, noise: 0.0, fades: false, pixels: 400.0, frame: 0 }
    }

    fn time(&self, samples: u64) -> f64 {
        self.fixed + self.per_sample * samples as f64
    }

    /// Level and samples of a fineness.
    fn drawn(&self, fineness: Fineness) -> (usize, u64) {
        let detail = |k: usize| Detail { reach: 0.02 * 1.587f32.powi(k as i32), error: None };
        let levels: Vec<Detail> = (0..4).map(detail).collect();
        let choice = fineness.choose(&levels, self.pixels, false);
        let coarser = if self.fades && choice.coarser > 0.0 { SAMPLES[choice.level + 1] } else { 0 };
        (choice.level, SAMPLES[choice.level] + coarser)
    }

    /// Draws a frame; the level that it had.
    fn draw(&mut self) -> usize {
        let (level, samples) = self.drawn(self.governor.fineness());
        self.frame += 1;
        // Fractions of multiples of the golden section are spread evenly.
        let random = 2.0 * (self.frame as f64 * 0.618_033_988_749_895).fract() - 1.0;
        self.governor.learn(self.time(samples) * (1.0 + self.noise * random), samples);
        level
    }

    fn draw_many(&mut self, frames: usize) -> Vec<usize> {
        (0..frames).map(|_| self.draw()).collect()
    }
}

fn changes(levels: &[usize]) -> usize {
    levels.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// The finest level in the budget, or the coarsest.
fn fitting(s: &Simulated) -> usize {
    SAMPLES.iter().position(|n| s.time(*n) <= SLOW * s.governor.budget()).unwrap_or(3)
}

#[test]
fn it_comes_to_rest_at_the_finest_level_that_fits() {
    for fades in [false, true] {
        for (fixed, per_sample) in [(0.5, 1e-3), (4.0, 2e-4), (0.0, 4e-3)] {
            for budget in [0.3, 1.0, 2.0, 4.5, 9.0, 14.0, 16.7, 30.0, 60.0, 300.0] {
                let mut s = Simulated { fades, ..Simulated::new(budget, fixed, per_sample) };
                s.draw_many(150);
                let rest = s.draw_many(2000);
                assert_eq!(changes(&rest), 0, "{fades} {fixed} {per_sample} {budget}");
                assert_eq!(rest[0], fitting(&s), "{fades} {fixed} {per_sample} {budget}");
            }
        }
    }
}

#[test]
fn noise_makes_no_flicker() {
    for budget in [2.0, 4.0, 8.0, 13.5, 16.7, 40.0, 51.0, 60.0] {
        let mut s = Simulated { noise: 0.3, ..Simulated::new(budget, 0.5, 1e-3) };
        s.draw_many(150);
        let rest = s.draw_many(3000);
        assert!(changes(&rest) <= 2, "{budget}: {}", changes(&rest));
        assert!(rest[2999].abs_diff(fitting(&s)) <= 1, "{budget}");
    }
}

#[test]
fn it_recovers_when_there_is_time_again() {
    for fades in [false, true] {
        let mut s = Simulated { fades, ..Simulated::new(26.0, 2.0, 3e-4) };
        assert_eq!(s.draw_many(200)[199], 0);
        // From as much as four times the load to more than any level can bear, and half way back.
        for slower in [4.0, 16.0, 1000.0] {
            s.per_sample = 3e-4 * slower;
            assert_eq!(s.draw_many(200)[199], fitting(&s), "{slower}");
            s.per_sample = 3e-4;
            assert_eq!(s.draw_many(200)[199], 0, "back from {slower}");
            assert_eq!(s.governor.fineness(), Fineness::DEFAULT, "{:?}", s.governor);
        }
        // All the time that is lost beside the samples.
        s.fixed = 25.0;
        assert!(s.draw_many(200)[199] > 0);
        s.fixed = 2.0;
        assert_eq!(s.draw_many(300)[299], 0);
    }
}

#[test]
fn an_object_that_comes_nearer_is_kept_in_the_budget() {
    let mut s = Simulated { pixels: 20.0, ..Simulated::new(10.0, 1.0, 1e-3) };
    s.draw_many(50);
    for _ in 0..200 {
        s.pixels *= 1.02;
        s.draw();
    }
    let rest = s.draw_many(300);
    assert_eq!((changes(&rest[150..]), rest[299]), (0, fitting(&s)));
}

#[test]
fn an_object_that_goes_away_has_the_levels_that_its_size_asks_for() {
    let mut s = Simulated { pixels: 400.0, ..Simulated::new(16.0, 1.0, 1e-3) };
    assert_eq!(s.draw_many(200)[199], 1);
    for _ in 0..60 {
        s.pixels *= 0.98;
        s.draw();
    }
    // Level 1 fits as before, wherever x had to be for it.
    assert_eq!(s.drawn(Fineness::DEFAULT).0, 0);
    assert_eq!(s.draw_many(200)[199], 1);
}

#[test]
fn steps_are_bounded_and_nothing_is_finer_than_asked_for() {
    let mut s = Simulated { noise: 0.5, ..Simulated::new(1.0, 0.1, 1e-3) };
    let (mut before, mut most) = (s.governor.fineness().kernel_pixels, 0.0f32);
    for k in 0..2000 {
        s.per_sample = if k / 100 % 2 == 0 { 1e-2 } else { 1e-6 };
        s.draw();
        let now = s.governor.fineness().kernel_pixels;
        assert!((Fineness::DEFAULT.kernel_pixels..=1.001 * LAST_REACH).contains(&now));
        assert!((now / before).log2().abs() <= COARSER + 1e-5, "{before} {now}");
        (before, most) = (now, most.max(now));
    }
    assert!(most > 10.0 * Fineness::DEFAULT.kernel_pixels);
}

#[test]
fn one_slow_frame_and_times_that_are_none_change_nothing() {
    let mut governor = Governor::new(Fineness::DEFAULT, 16.0);
    for k in 0..200 {
        let milliseconds = match k % 5 {
            0 => 500.0,
            1 => [f64::NAN, f64::INFINITY, -1.0, 0.0][k / 5 % 4],
            _ => 15.0,
        };
        assert_eq!(governor.learn(milliseconds, 50_000), Fineness::DEFAULT, "frame {k}");
        // Nothing was drawn.
        governor.learn(99.0, 0);
    }
}

#[test]
fn all_samples_are_the_start_where_they_are_asked_for() {
    let all = Fineness { kernel_pixels: 0.0, ..Fineness::DEFAULT };
    let mut s = Simulated { governor: Governor::new(all, 10.0), ..Simulated::new(10.0, 1.0, 1e-3) };
    assert_eq!(s.draw(), 0);
    assert_eq!(s.draw_many(200)[199], 2);
    s.per_sample = 1e-5;
    assert_eq!(s.draw_many(300)[299], 0);
    assert_eq!(s.governor.fineness(), all);
}

#[test]
fn what_the_coarsest_level_needs_is_enough() {
    let mut s = Simulated::new(1.0, 5.0, 1e-3);
    s.governor.set_coarsest(20.0);
    assert_eq!(s.draw_many(200)[199], 1);
    assert!(s.governor.is_coarsest() && s.governor.fineness().kernel_pixels <= 20.0 * 1.001);
    // Less than there is from the start: nothing to govern.
    s.governor.set_coarsest(1.0);
    assert_eq!((s.governor.fineness(), s.governor.is_coarsest()), (Fineness::DEFAULT, true));
    s.governor.set_coarsest(f32::NAN);
    s.draw_many(10);
    assert!(s.governor.fineness().kernel_pixels <= LAST_REACH);
}
