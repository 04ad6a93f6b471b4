//! Arrays in NumPy's .npy format, versions 1 to 3: magic, version, length of the header (u16, from version 2 on u32), the
//! header as a Python dictionary, the values. Read here and not by a parser of Python, whose nesting a file could drive
//! as deep as it likes.

use crate::{Error, Result};

pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";
/// NumPy's own headers of plain arrays stay far below.
const LONGEST_HEADER: usize = 4096;
/// Dimensions at the most, NumPy's own limit before version 2.
const MOST_DIMENSIONS: usize = 32;

/// What the values were before they became f32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stored {
    /// float32 or float64.
    Floats,
    /// uint8.
    Bytes,
}

/// An array in C order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Array {
    pub shape: Vec<usize>,
    pub stored: Stored,
    pub values: Vec<f32>,
}

/// Reads a file's bytes; the values must fill them exactly.
///
/// # Errors
/// Not such a file, another type or order, a size that does not match the header.
pub(crate) fn parse(bytes: &[u8]) -> Result<Array> {
    let bad = |m: &str| Error::invalid(format!("is not a usable .npy file: {m}"));
    let (header, data) = split(bytes).ok_or_else(|| bad("its header is damaged"))?;
    let header = Header::parse(header).ok_or_else(|| bad("its header is damaged"))?;
    if header.fortran {
        return Err(bad("it is in Fortran order; save it in C order"));
    }
    let size = match header.kind {
        "<f4" => 4,
        "<f8" => 8,
        "|u1" => 1,
        other => {
            return Err(bad(&format!("its type is {other}; use little-endian float32 or float64")));
        }
    };
    let count = header.shape.iter().try_fold(1usize, |a, &n| a.checked_mul(n));
    if count.and_then(|c| c.checked_mul(size)) != Some(data.len()) {
        return Err(bad(&format!(
            "its header promises {:?} values of {size} bytes but {} bytes follow",
            header.shape,
            data.len()
        )));
    }
    let values = match size {
        4 => data.as_chunks().0.iter().map(|c| f32::from_le_bytes(*c)).collect(),
        8 => data.as_chunks().0.iter().map(|c| f64::from_le_bytes(*c) as f32).collect(),
        _ => data.iter().map(|b| f32::from(*b)).collect(),
    };
    let stored = if size == 1 { Stored::Bytes } else { Stored::Floats };
    Ok(Array { shape: header.shape, stored, values })
}

/// Header and data.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let ([major, _], rest) = rest.split_first_chunk()?;
    let (length, rest) = match major {
        1 => rest.split_first_chunk().map(|(l, rest)| (usize::from(u16::from_le_bytes(*l)), rest))?,
        2 | 3 => rest.split_first_chunk().map(|(l, rest)| (u32::from_le_bytes(*l) as usize, rest))?,
        _ => return None,
    };
    let (header, data) = rest.split_at_checked(length).filter(|_| length <= LONGEST_HEADER)?;
    Some((str::from_utf8(header).ok()?, data))
}

/// `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }`: each key once, in any order.
struct Header<'a> {
    kind: &'a str,
    fortran: bool,
    shape: Vec<usize>,
}

impl<'a> Header<'a> {
    fn parse(text: &'a str) -> Option<Self> {
        let mut rest = Rest(text.trim());
        let (mut kind, mut fortran, mut shape) = (None, None, None);
        rest.token("{")?;
        while rest.token("}").is_none() {
            let key = rest.quoted()?;
            rest.token(":")?;
            let again = match key {
                "descr" => kind.replace(rest.quoted()?).is_some(),
                "fortran_order" => fortran.replace(rest.truth()?).is_some(),
                "shape" => shape.replace(rest.sizes()?).is_some(),
                _ => true,
            };
            if again || (rest.token(",").is_none() && !rest.0.starts_with('}')) {
                return None;
            }
        }
        rest.0.is_empty().then_some(Self { kind: kind?, fortran: fortran?, shape: shape? })
    }
}

/// What is left of the text, without blanks in front.
struct Rest<'a>(&'a str);

impl<'a> Rest<'a> {
    fn token(&mut self, token: &str) -> Option<()> {
        self.0 = self.0.strip_prefix(token)?.trim_start();
        Some(())
    }

    fn quoted(&mut self) -> Option<&'a str> {
        let quote = self.0.chars().next().filter(|c| ['\'', '"'].contains(c))?;
        let (inside, rest) = self.0[1..].split_once(quote)?;
        self.0 = rest.trim_start();
        Some(inside)
    }

    fn truth(&mut self) -> Option<bool> {
        if self.token("True").is_some() { Some(true) } else { self.token("False").map(|()| false) }
    }

    /// `()`, `(3,)`, `(2, 3)`; Python 2 put an L behind large numbers.
    fn sizes(&mut self) -> Option<Vec<usize>> {
        let mut sizes = Vec::new();
        self.token("(")?;
        while self.token(")").is_none() {
            let end = self.0.find(|c: char| !c.is_ascii_digit())?;
            let (digits, rest) = self.0.split_at(end);
            self.0 = rest.trim_start_matches('L').trim_start();
            sizes.push(digits.parse().ok().filter(|_| sizes.len() < MOST_DIMENSIONS)?);
            if self.token(",").is_none() && !self.0.starts_with(')') {
                return None;
            }
        }
        Some(sizes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let length = (header.len() as u32).to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        [MAGIC, &[version, 0], length, header.as_bytes(), data].concat()
    }

    fn message(header: &str, data: &[u8]) -> String {
        parse(&file(1, header, data)).unwrap_err().to_string()
    }

    #[test]
    fn what_numpy_writes_is_read() {
        let numbers = [1.0f32, -2.5];
        let data: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        for version in 1..=3 {
            for header in [
                "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }          \n",
                "{\"shape\":(1L,2L),\"descr\":\"<f4\",\"fortran_order\":False}",
            ] {
                let array = parse(&file(version, header, &data)).unwrap();
                assert_eq!(
                    array,
                    Array { shape: vec![1, 2], stored: Stored::Floats, values: numbers.into() }
                );
            }
        }
        let bytes = "{'descr': '|u1', 'fortran_order': False, 'shape': (3,)}";
        assert_eq!(parse(&file(1, bytes, &[0, 7, 255])).unwrap().values, [0.0, 7.0, 255.0]);
        let doubles = "{'descr': '<f8', 'fortran_order': False, 'shape': ()}";
        assert_eq!(parse(&file(1, doubles, &0.25f64.to_le_bytes())).unwrap().values, [0.25]);
    }

    #[test]
    fn what_cannot_be_used_is_refused_in_words() {
        let with = |shape: &str| format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        assert!(message(&with("(2,)"), &[0; 7]).contains("7 bytes follow"));
        assert!(message(&with("(4294967296, 4294967296, 4)"), &[0; 8]).contains("8 bytes follow"));
        assert!(message(&with("(99999999999999999999,)"), &[]).contains("header"));
        assert!(message(&with("(2, 3"), &[]).contains("header"));
        assert!(message(&with("((2))"), &[]).contains("header"));
        assert!(message(&with(&"(".repeat(4000)), &[]).contains("header"));
        assert!(message("{'shape': (1,), 'shape': (1,)}", &[]).contains("header"));
        assert!(message("", &[]).contains("header"));
        assert!(message(&with("(1,)").replace("False", "True"), &[0; 4]).contains("Fortran"));
        assert!(message(&with("(1,)").replace("<f4", ">f4"), &[0; 4]).contains("type is >f4"));
        // A header that claims four gigabytes is not waited for.
        assert!(parse(b"\x93NUMPY\x02\x00\xff\xff\xff\xff").is_err());
        assert!(parse(b"").is_err());
    }
}
