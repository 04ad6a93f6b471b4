//! Tiles that are drawn together: one dispatch or draw of every pass for all of them, whose state lies one behind the other in the
//! same buffers. What takes a GPU long about small objects is not their pixels but the passes, one after the other.

use super::tiles::Tile;

/// Tiles of one lot at the most; `MOST_VIEWS` of view.wgsl.
pub(super) const MOST_VIEWS: usize = 64;

/// How much state some tiles have together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lot {
    /// Columns and rows of a tile that covers each of them.
    pub size: [u32; 2],
    /// How many.
    pub count: u32,
    /// Their pixels.
    pub pixels: u64,
    /// Their squares of 8 × 8 pixels.
    pub cells: u64,
    /// And of 16 × 16.
    pub tiles: u64,
    /// That the samples are cut into, each of which sums for itself.
    pub slices: u32,
    /// Workgroups that share a square of 16 × 16 pixels: for every slice one or, where sums are kept for slices alone, one for
    /// each half of the square.
    pub sharers: u32,
    /// Sums that are kept of all pixels: from shard to shard, of every slice and of every piece that is drawn at once.
    pub sums: u64,
}

/// Where a tile's state begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub first_pixel: u32,
    pub first_cell: u32,
    pub first_tile: u32,
}

impl Default for Lot {
    /// Nothing.
    fn default() -> Self {
        Self { size: [0; 2], count: 0, pixels: 0, cells: 0, tiles: 0, slices: 1, sharers: 1, sums: 0 }
    }
}

impl Lot {
    /// Adds a tile, and says where it is.
    pub fn add(&mut self, tile: Tile) -> Place {
        let place = Place {
            first_pixel: self.pixels as u32,
            first_cell: self.cells as u32,
            first_tile: self.tiles as u32,
        };
        let squares = |side: u32| tile.size.iter().map(|n| u64::from(n.div_ceil(side))).product::<u64>();
        self.size = [0, 1].map(|c| self.size[c].max(tile.size[c]));
        self.count += 1;
        self.pixels += tile.pixels();
        self.cells += squares(8);
        self.tiles += squares(16);
        place
    }

    /// Enough for either.
    pub fn or(self, other: Self) -> Self {
        Self {
            size: [0, 1].map(|c| self.size[c].max(other.size[c])),
            count: self.count.max(other.count),
            pixels: self.pixels.max(other.pixels),
            cells: self.cells.max(other.cells),
            tiles: self.tiles.max(other.tiles),
            slices: self.slices.max(other.slices),
            sharers: self.sharers.max(other.sharers),
            sums: self.sums.max(other.sums),
        }
    }

    /// Whether what is made for it is enough for another.
    pub fn holds(self, other: Self) -> bool {
        let size = |lot: Self| Self { count: 0, slices: 1, sharers: 1, ..lot };
        size(self.or(other)) == size(self)
    }

    /// Cut into as many slices as make `wanted` workgroups of its tiles, where there are `clusters` of samples, `pieces` are drawn
    /// at once and at most so many sums can be kept.
    pub fn sliced(self, wanted: u32, clusters: u32, pieces: u64, most_sums: u64) -> Self {
        let most = u64::from(clusters).min(most_sums / (pieces * self.pixels).max(1));
        let most = most.min(u64::from(MOST_SHARERS / SHARED_HALVES));
        let slices = (u64::from(wanted) / self.tiles.max(1)).min(most).max(1) as u32;
        if slices == 1 {
            return self;
        }
        let sums = self.pixels * pieces * u64::from(slices);
        Self { slices, sharers: slices * SHARED_HALVES, sums, ..self }
    }

    /// The same where samples are several shards.
    pub fn kept(self) -> Self {
        Self { sums: self.pixels * u64::from(self.slices), sharers: self.slices, ..self }
    }
}

/// Halves of a square of pixels, each of which has a workgroup where samples are cut into slices alone.
const SHARED_HALVES: u32 = 2;
/// Workgroups that a dispatch has along one axis.
const MOST_SHARERS: u32 = 65_535;

impl From<Tile> for Lot {
    fn from(tile: Tile) -> Self {
        let mut lot = Self::default();
        lot.add(tile);
        lot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_lie_one_behind_the_other() {
        let mut lot = Lot::default();
        let sizes = [[17, 9], [3, 40], [8, 8]];
        let places = sizes.map(|size| lot.add(Tile { start: [5, 6], size }));
        assert_eq!(places[0], Place::default());
        assert_eq!(places[1], Place { first_pixel: 153, first_cell: 6, first_tile: 2 });
        assert_eq!(places[2], Place { first_pixel: 273, first_cell: 11, first_tile: 5 });
        assert_eq!(lot, Lot { size: [17, 40], count: 3, pixels: 337, cells: 12, tiles: 6, ..Lot::default() });
        assert!(lot.holds(Tile { start: [0; 2], size: [17, 9] }.into()));
        assert!(!lot.holds(Tile { start: [0; 2], size: [18, 1] }.into()));
    }

    #[test]
    fn few_tiles_are_cut_into_slices() {
        let lot = Lot::from(Tile { start: [0; 2], size: [45, 45] });
        let sliced = |wanted, clusters| lot.sliced(wanted, clusters, 4, 1 << 20);
        let slices = |wanted, clusters| sliced(wanted, clusters).slices;
        assert_eq!([slices(0, 100), slices(9, 100), slices(1024, 100), slices(1024, 3)], [1, 1, 100, 3]);
        assert_eq!((sliced(90, 100).sums, sliced(9, 100).sums, lot.kept().sums), (81_000, 0, 2025));
        assert_eq!(
            [sliced(90, 100).sharers, sliced(9, 100).sharers, sliced(90, 100).kept().sharers],
            [20, 1, 10]
        );
        assert!(!lot.holds(sliced(90, 100)) && sliced(90, 100).holds(lot.kept()));
        assert_eq!(lot.sliced(1024, 100, 4, 40_000).slices, 4);
    }
}
