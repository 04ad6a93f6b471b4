//! Which tiles are drawn together, and in which order.

use crate::gpu::lot::{Lot, MOST_VIEWS};
use crate::gpu::tiles::Tile;

/// Every tile of a lot is looked at as if it were as wide and high as the largest: with so many times its own pixels at the most,
/// or so many in all.
const PADDING: u64 = 8;
const SMALL: u64 = 64 * 64;

/// Workgroups along one axis of a dispatch that are certain.
const MOST_GROUPS: u64 = 65_535;

/// Tiles that are drawn together.
pub(super) struct Together<K> {
    pub kind: K,
    /// By their place in the list.
    pub members: Vec<usize>,
    lot: Lot,
    /// Pixels of the smallest.
    least: u64,
    /// First column and row of all, and those behind the last.
    bounds: [[u32; 2]; 2],
}

/// Puts tiles of the same kind together, up to `most` pixels, where their order allows it: of two that overlap the one that comes
/// first in the list is drawn first.
pub(super) fn arrange<K: Copy + PartialEq>(tiles: &[(K, Tile)], most: u64) -> Vec<Together<K>> {
    let mut all: Vec<Together<K>> = Vec::new();
    for (member, (kind, tile)) in tiles.iter().enumerate() {
        // Nothing that it overlaps may come later.
        let covered = |t: &Together<K>| {
            let [first, last] = t.bounds;
            overlap(*tile, Tile { start: first, size: [last[0] - first[0], last[1] - first[1]] })
                && t.members.iter().any(|m| overlap(*tile, tiles[*m].1))
        };
        let from = all.iter().rposition(covered).unwrap_or(0);
        let room = |t: &&mut Together<K>| t.kind == *kind && t.has_room(*tile, most);
        match all[from..].iter_mut().find(room) {
            Some(together) => together.add(member, *tile),
            None => {
                let mut together = Together {
                    kind: *kind,
                    members: Vec::new(),
                    lot: Lot::default(),
                    least: u64::MAX,
                    bounds: [[u32::MAX; 2], [0; 2]],
                };
                together.add(member, *tile);
                all.push(together);
            }
        }
    }
    all
}

impl<K> Together<K> {
    fn has_room(&self, tile: Tile, most: u64) -> bool {
        let mut lot = self.lot;
        lot.add(tile);
        let padded = lot.size.iter().map(|n| u64::from(*n)).product::<u64>();
        self.members.len() < MOST_VIEWS
            && lot.pixels <= most
            && padded <= SMALL.max(PADDING * self.least.min(tile.pixels()))
            && lot.tiles <= MOST_GROUPS
    }

    fn add(&mut self, member: usize, tile: Tile) {
        self.members.push(member);
        self.lot.add(tile);
        self.least = self.least.min(tile.pixels());
        let [first, last] = &mut self.bounds;
        for c in 0..2 {
            first[c] = first[c].min(tile.start[c]);
            last[c] = last[c].max(tile.start[c] + tile.size[c]);
        }
    }

    /// How much they are.
    pub fn lot(&self) -> Lot {
        self.lot
    }
}

fn overlap(a: Tile, b: Tile) -> bool {
    (0..2).all(|c| a.start[c] < b.start[c] + b.size[c] && b.start[c] < a.start[c] + a.size[c])
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::hash;

    fn some_tiles(seed: u64, count: u64) -> Vec<(u64, Tile)> {
        let number = |i: u64, k: u64, below: u64| (hash(seed, 5 * i + k) % below) as u32;
        let one = |i: u64| {
            let start = [number(i, 0, 500), number(i, 1, 500)];
            let size = [1 + number(i, 2, 60), 1 + number(i, 3, 60)];
            (u64::from(number(i, 4, 3)), Tile { start, size })
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn what_overlaps_keeps_its_order_and_everything_is_drawn_once() {
        for seed in 0..20 {
            let tiles = some_tiles(seed, 200);
            let all = arrange(&tiles, 20_000);
            let mut place = vec![None; tiles.len()];
            for (l, together) in all.iter().enumerate() {
                for (k, member) in together.members.iter().enumerate() {
                    assert_eq!(tiles[*member].0, together.kind);
                    assert_eq!(place[*member].replace((l, k)), None);
                }
                assert!(together.members.len() <= MOST_VIEWS && together.lot().pixels <= 20_000);
            }
            assert!(place.iter().all(Option::is_some));
            for a in 0..tiles.len() {
                for b in a + 1..tiles.len() {
                    assert!(!overlap(tiles[a].1, tiles[b].1) || place[a] < place[b], "{seed} {a} {b}");
                }
            }
            assert!(all.len() < 120, "{seed}: {}", all.len());
        }
    }

    #[test]
    fn what_lies_apart_is_drawn_together() {
        let tile = |x: u32, size: u32| Tile { start: [x, 0], size: [size; 2] };
        let tiles: Vec<((), Tile)> = (0..100).map(|k| ((), tile(20 * k, 16))).collect();
        let sizes: Vec<usize> = arrange(&tiles, 1 << 20).iter().map(|t| t.members.len()).collect();
        assert_eq!(sizes, [MOST_VIEWS, 100 - MOST_VIEWS]);
        // A large one would have the small ones drawn as if they were as large.
        let mixed = [((), tile(0, 500)), ((), tile(600, 8)), ((), tile(700, 9))];
        let members: Vec<Vec<usize>> = arrange(&mixed, 1 << 20).into_iter().map(|t| t.members).collect();
        assert_eq!(members, [vec![0], vec![1, 2]]);
        // One that is too large for all limits is drawn none the less.
        assert_eq!(arrange(&mixed[..1], 10).len(), 1);
    }
}
