//! Pictures that callers have let go of, drawn on again: what stays black is neither allocated nor cleared anew. A picture of 800 x
//! 800 pixels takes 10 MB, which a small object in it hardly touches.

use diaphane_formats::picture::Picture;
use std::sync::Arc;

/// First column and row, and those behind the last.
pub(crate) type Area = [[u32; 2]; 2];

/// An area without pixels.
pub(crate) const NOWHERE: Area = [[0; 2]; 2];

/// As many as a caller holds who shows one frame while the next one is drawn.
const KEPT: usize = 2;

/// The last pictures.
#[derive(Default)]
pub(crate) struct Canvas {
    kept: Vec<Drawn>,
}

/// A picture, and where it is not black.
struct Drawn {
    picture: Arc<Picture>,
    area: Area,
}

impl Canvas {
    /// A picture that is black and uncovered outside `area`, every pixel of which is to be written: an old one if there is one of
    /// this size that nobody else holds.
    pub fn take(&mut self, width: u32, height: u32, area: Area) -> Picture {
        let (columns, rows) = (width as usize, height as usize);
        self.kept.retain(|old| old.picture.width == columns && old.picture.height == rows);
        let free = self.kept.iter().position(|old| Arc::strong_count(&old.picture) == 1);
        let old = free.map(|at| self.kept.swap_remove(at));
        match old.map(|old| (Arc::try_unwrap(old.picture), old.area)) {
            Some((Ok(mut picture), drawn)) => {
                clear(&mut picture, drawn, area);
                picture
            }
            _ => blank(columns, rows),
        }
    }

    /// Shares a picture that was taken for `area`, and keeps it.
    pub fn share(&mut self, picture: Picture, area: Area) -> Arc<Picture> {
        let picture = Arc::new(picture);
        if self.kept.len() == KEPT {
            self.kept.remove(0);
        }
        self.kept.push(Drawn { picture: Arc::clone(&picture), area });
        picture
    }
}

fn blank(width: usize, height: usize) -> Picture {
    Picture { coverage: Some(vec![0.0; width * height]), ..Picture::new(width, height) }
}

/// Clears what is in `drawn` and not in `next`.
fn clear(picture: &mut Picture, drawn: Area, next: Area) {
    let [left, right] = [drawn[0][0], drawn[1][0]];
    let [first, last] = [next[0][0], next[1][0]].map(|column| column.clamp(left, right));
    for row in drawn[0][1]..drawn[1][1] {
        let beside = if (next[0][1]..next[1][1]).contains(&row) {
            [left..first, last..right]
        } else {
            [left..right, right..right]
        };
        let start = row as usize * picture.width;
        for columns in beside {
            let columns = start + columns.start as usize..start + columns.end as usize;
            picture.pixels[columns.clone()].fill([0.0; 3]);
            if let Some(coverage) = &mut picture.coverage {
                coverage[columns].fill(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fills `area` as a renderer does.
    fn paint(picture: &mut Picture, [low, high]: Area, value: f32) {
        for y in low[1]..high[1] {
            for x in low[0]..high[0] {
                let at = y as usize * picture.width + x as usize;
                picture.pixels[at] = [value; 3];
                picture.coverage.as_mut().unwrap()[at] = value;
            }
        }
    }

    #[test]
    fn an_old_picture_is_as_good_as_a_new_one() {
        let areas = [
            [[0, 0], [7, 5]],
            NOWHERE,
            [[2, 1], [5, 4]],
            [[3, 2], [7, 5]],
            [[0, 0], [1, 5]],
            [[5, 0], [7, 2]],
            [[0, 3], [7, 4]],
        ];
        // Every area after every other.
        for first in areas {
            for second in areas {
                let mut canvas = Canvas::default();
                let mut picture = canvas.take(7, 5, first);
                paint(&mut picture, first, 1.0);
                let place = picture.pixels.as_ptr();
                drop(canvas.share(picture, first));
                let mut picture = canvas.take(7, 5, second);
                assert_eq!(picture.pixels.as_ptr(), place, "drawn on again");
                paint(&mut picture, second, 2.0);
                let mut anew = blank(7, 5);
                paint(&mut anew, second, 2.0);
                assert_eq!(picture, anew, "{first:?}, {second:?}");
            }
        }
    }

    #[test]
    fn what_somebody_holds_stays() {
        let mut canvas = Canvas::default();
        let mut shown: Vec<Arc<Picture>> = Vec::new();
        for k in 0..5 {
            let mut picture = canvas.take(3, 2, [[0; 2], [3, 2]]);
            assert!(shown.iter().all(|old| old.pixels.as_ptr() != picture.pixels.as_ptr()));
            paint(&mut picture, [[0; 2], [3, 2]], k as f32);
            shown.push(canvas.share(picture, [[0; 2], [3, 2]]));
        }
        let values: Vec<f32> = shown.iter().map(|p| p.pixels[5][0]).collect();
        assert_eq!(values, [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(canvas.kept.len(), KEPT);
    }

    #[test]
    fn another_size_keeps_no_old_picture() {
        let mut canvas = Canvas::default();
        let picture = canvas.take(3, 2, NOWHERE);
        drop(canvas.share(picture, NOWHERE));
        let picture = canvas.take(2, 3, NOWHERE);
        assert_eq!((picture, canvas.kept.len()), (blank(2, 3), 0));
    }
}
