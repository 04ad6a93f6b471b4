//! Pictures that are too large for the adapter's buffers are drawn tile by tile.

use crate::{Error, Result};

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    /// First column and row.
    pub start: [u32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl Tile {
    /// Number of pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// What bounds the size of a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    /// Largest texture side.
    pub side: u32,
    /// Largest storage binding, bytes.
    pub binding: u64,
    /// State of all pixels together, bytes.
    pub total: u64,
    /// Bytes of a pixel in the largest buffer.
    pub pixel_binding: u64,
    /// Bytes of a pixel in all buffers and textures.
    pub pixel_total: u64,
}

impl Budget {
    /// Most pixels of a tile. Buffers are made for padded numbers of them: see `targets`.
    pub fn pixels(self) -> u64 {
        (self.binding / self.pixel_binding).min(self.total / self.pixel_total).saturating_sub(16)
    }
}

/// Splits a picture into bands of whole rows where they fit, else into columns of bands. All tiles but those at the
/// right and lower edge have the same size.
///
/// # Errors
/// Not even one pixel fits.
pub(super) fn split(width: u32, height: u32, budget: Budget) -> Result<Vec<Tile>> {
    let most = budget.pixels();
    let columns = u64::from(width.min(budget.side)).min(most) as u32;
    if columns == 0 {
        return Err(Error::Gpu("the adapter's buffers are too small for a single pixel".to_owned()));
    }
    let rows = u64::from(height.min(budget.side)).min(most / u64::from(columns)) as u32;
    let mut tiles = Vec::new();
    for top in (0..height).step_by(rows as usize) {
        for left in (0..width).step_by(columns as usize) {
            tiles
                .push(Tile { start: [left, top], size: [columns.min(width - left), rows.min(height - top)] });
        }
    }
    Ok(tiles)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOMY: Budget =
        Budget { side: 8192, binding: 128 << 20, total: 512 << 20, pixel_binding: 64, pixel_total: 248 };

    #[test]
    fn small_pictures_are_one_tile() {
        assert_eq!(split(200, 100, ROOMY).unwrap(), [Tile { start: [0, 0], size: [200, 100] }]);
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        let tight = Budget { side: 7, total: 248 * 45, ..ROOMY };
        for (w, h) in [(1, 1), (7, 4), (8, 5), (23, 31)] {
            let tiles = split(w, h, tight).unwrap();
            let mut seen = vec![0; (w * h) as usize];
            for t in &tiles {
                assert!(t.size[0] <= 7 && t.pixels() <= 29);
                for y in t.start[1]..t.start[1] + t.size[1] {
                    (t.start[0]..t.start[0] + t.size[0]).for_each(|x| seen[(y * w + x) as usize] += 1);
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{w} {h}");
        }
    }

    #[test]
    fn nothing_fits_is_an_error() {
        assert!(split(4, 4, Budget { total: 100, ..ROOMY }).is_err());
    }
}
