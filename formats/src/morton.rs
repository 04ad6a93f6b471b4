//! Points along a space-filling curve (Morton 1966), so that neighbours in a list are neighbours in space and whatever walks the list finds
//! what it needs in the cache.

use glam::DVec3;

/// Cells along an axis, as a power of two.
const BITS: u32 = 21;

/// Number of the cell that holds `point` on the curve through the box from `low` to `high`.
pub fn code(point: DVec3, low: DVec3, high: DVec3) -> u64 {
    let longest = (high - low).max_element();
    let cells = f64::from(1u32 << BITS);
    let place = |k: usize| ((point[k] - low[k]) / longest * cells).clamp(0.0, cells - 1.0) as u64;
    spread(place(0)) | spread(place(1)) << 1 | spread(place(2)) << 2
}

/// The numbers of `points` in the order of the curve.
pub fn order(points: impl Iterator<Item = DVec3>, low: DVec3, high: DVec3) -> Vec<u32> {
    let mut keys: Vec<(u64, u32)> = points.zip(0..).map(|(p, i)| (code(p, low, high), i)).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, i)| i).collect()
}

/// Two zeros between the bits of `x`.
fn spread(mut x: u64) -> u64 {
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_take_turns() {
        for bit in 0..BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << BITS) - 1), 0x1249_2492_4924_9249);
    }

    #[test]
    fn neighbours_follow_each_other() {
        let side = 16usize;
        let at = |i: usize| DVec3::new((i % side) as f64, (i / side % side) as f64, (i / side / side) as f64);
        let points: Vec<DVec3> = (0..side.pow(3)).map(|i| at(i * 1_237 % side.pow(3))).collect();
        let order = order(points.iter().copied(), DVec3::ZERO, DVec3::splat(side as f64));
        let way: f64 = order.windows(2).map(|w| points[w[0] as usize].distance(points[w[1] as usize])).sum();
        assert!(way < 1.7 * points.len() as f64, "{way}");
        let mut numbers = order.clone();
        numbers.sort_unstable();
        assert!(numbers.iter().copied().eq(0..points.len() as u32));
    }

    #[test]
    fn flat_and_outside_points_have_a_place() {
        assert_eq!(code(DVec3::ONE, DVec3::ONE, DVec3::ONE), 0);
        assert!(
            code(DVec3::splat(9.0), DVec3::ZERO, DVec3::ONE) > code(DVec3::ZERO, DVec3::ZERO, DVec3::ONE)
        );
    }
}
