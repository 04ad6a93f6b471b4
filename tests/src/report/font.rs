//! A tiny font for the numbers at a colour bar: three by five dots.

/// Width and height of a character in dots.
pub const SIZE: [usize; 2] = [3, 5];

/// Rows of a character, most significant of three bits on the left; blank if unknown.
fn rows(c: char) -> [u8; 5] {
    match c {
        '0' => [7, 5, 5, 5, 7],
        '1' => [2, 6, 2, 2, 7],
        '2' => [7, 1, 7, 4, 7],
        '3' => [7, 1, 7, 1, 7],
        '4' => [5, 5, 7, 1, 1],
        '5' => [7, 4, 7, 1, 7],
        '6' => [7, 4, 7, 5, 7],
        '7' => [7, 1, 2, 2, 2],
        '8' => [7, 5, 7, 5, 7],
        '9' => [7, 5, 7, 1, 7],
        '.' => [0, 0, 0, 0, 2],
        '-' => [0, 0, 7, 0, 0],
        '+' => [0, 2, 7, 2, 0],
        '%' => [5, 1, 2, 4, 5],
        _ => [0; 5],
    }
}

/// Calls `dot` with column and row of every dot of `text`; characters are one dot apart.
pub fn dots(text: &str, mut dot: impl FnMut(usize, usize)) {
    for (i, c) in text.chars().enumerate() {
        for (y, row) in rows(c).into_iter().enumerate() {
            for x in (0..SIZE[0]).filter(|x| row >> (SIZE[0] - 1 - x) & 1 == 1) {
                dot(i * (SIZE[0] + 1) + x, y);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_one_has_eight_dots_within_its_cell() {
        let mut seen = Vec::new();
        dots("1", |x, y| seen.push((x, y)));
        assert_eq!(seen.len(), 8);
        assert!(seen.iter().all(|(x, y)| *x < SIZE[0] && *y < SIZE[1]));
    }
}
