//! The work of a picture cut into dispatches that no driver loses patience with.

use super::uniforms::Part;
use std::ops::Range;

/// What a dispatch may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// Shadow rays of all its threads.
    pub rays: u64,
    /// Shadow rays of one thread.
    pub thread: u32,
}

impl Patience {
    /// Of an adapter, for an object with a density grid or without. Mesa's software adapter (22.3.6) ends the loops of a
    /// thread after 65,535 rounds altogether, about one a box.
    pub fn of(software: bool, heterogeneous: bool) -> Self {
        let rays = if heterogeneous { 1 << 20 } else { 1 << 24 };
        let thread = match (software, heterogeneous) {
            (false, _) => u32::MAX,
            (true, false) => 64,
            (true, true) => 16,
        };
        Self { rays, thread }
    }

    /// Parts of `places` places (in multiples of 8), each `row` threads wide, with so many steps and lights. All places come
    /// before the next steps, all steps before the next lights.
    pub fn cut(self, places: u32, row: u32, steps: u32, lights: u32) -> Vec<Part> {
        let lights_each = lights.clamp(1, self.thread);
        let steps_each = (self.thread / lights_each).clamp(1, steps.max(1));
        let ray_count = u64::from(row.max(1)) * u64::from(lights_each) * u64::from(steps_each);
        let places_each = (self.rays / ray_count).max(8).next_multiple_of(8).min(1 << 31) as u32;
        let mut parts = Vec::new();
        for lights in ranges(lights, lights_each) {
            for steps in ranges(steps, steps_each) {
                let one = |places| Part { places, steps: steps.clone(), lights: lights.clone() };
                parts.extend(ranges(places, places_each).map(one));
            }
        }
        parts
    }
}

/// `0..total` in pieces of `size`; one empty piece of nothing, so that pictures without lights are drawn as well.
fn ranges(total: u32, size: u32) -> impl Iterator<Item = Range<u32>> {
    let size = size.max(1);
    (0..total.div_ceil(size).max(1)).map(move |k| k * size..total.min((k + 1).saturating_mul(size)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ray_is_in_one_part_and_no_part_is_too_long() {
        for (places, row, steps, lights) in [(40, 32, 7, 3), (9, 1, 1, 4096), (256, 256, 64, 1), (5, 5, 3, 0)]
        {
            for patience in [Patience { rays: 5000, thread: 6 }, Patience::of(false, false)] {
                let parts = patience.cut(places, row, steps, lights);
                let size = |r: &Range<u32>| u64::from(r.end - r.start);
                let rays = |p: &Part| size(&p.places) * size(&p.steps) * size(&p.lights);
                let all: u64 = parts.iter().map(rays).sum();
                assert_eq!(all, u64::from(places) * u64::from(steps) * u64::from(lights));
                for (i, p) in parts.iter().enumerate() {
                    assert!(size(&p.steps) * size(&p.lights) <= u64::from(patience.thread));
                    assert!(
                        size(&p.places) <= 8
                            || rays(p) * u64::from(row) <= patience.rays + 8 * 6 * u64::from(row)
                    );
                    assert!(parts[..i].iter().all(|q| q != p));
                }
            }
        }
    }
}
