//! Pictures of linear radiance: EXR in and out, PNG to look at, coverage masks.

use crate::npy::{self, Stored};
use crate::{Error, Result, files};
use std::io::Cursor;
use std::path::Path;

/// How every EXR file begins.
pub(crate) const EXR_MAGIC: &[u8] = &[0x76, 0x2f, 0x31, 0x01];

/// Linear RGB, row 0 on top, with an optional coverage (0..1) per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Radiance, `width` × `height` values, rows one after the other.
    pub pixels: Vec<[f32; 3]>,
    /// Fraction of each pixel that the object covers, if known.
    pub coverage: Option<Vec<f32>>,
}

impl Picture {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width * height], coverage: None }
    }
}

/// Reads an EXR file with R, G, B (or only one channel, taken as grey) and perhaps A.
///
/// # Errors
/// Unreadable file, not an EXR, missing channels, size that its bytes cannot back.
pub fn read_exr(path: &Path) -> Result<Picture> {
    parse_exr(&files::read(path, files::Kind::Exr)?).map_err(|e| e.in_file(path))
}

/// As [`read_exr`], from the file's bytes.
///
/// # Errors
/// As [`read_exr`].
pub fn parse_exr(bytes: &[u8]) -> Result<Picture> {
    use exr::prelude::*;
    let bad = |e: &str| crate::Error::invalid(format!("is not a usable EXR picture: {e}"));
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| bad(&e.to_string()))?;
    for header in &meta.headers {
        check_promises(header, bytes.len()).map_err(bad)?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| bad(&e.to_string()))?;
    let size = image.layer_data.size;
    let count = size.width() * size.height();
    let channels = &image.layer_data.channel_data.list;
    let find = |name: &str| channels.iter().find(|c| c.name.to_string().eq_ignore_ascii_case(name));
    let [r, g, b] = match (find("R"), find("G"), find("B")) {
        (Some(r), Some(g), Some(b)) => [r, g, b],
        _ => match channels.iter().find(|c| !c.name.to_string().eq_ignore_ascii_case("A")) {
            Some(grey) => [grey; 3],
            None => return Err(bad("it has no colour channel")),
        },
    };
    let alpha = find("A");
    if [r, g, b].into_iter().chain(alpha).any(|c| c.sample_data.len() != count) {
        return Err(bad("its channels are subsampled"));
    }
    let [r, g, b] = [r, g, b].map(|c| c.sample_data.values_as_f32());
    let pixels = r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
    let coverage = alpha.map(|alpha| alpha.sample_data.values_as_f32().collect());
    Ok(Picture { width: size.width(), height: size.height(), pixels, coverage })
}

/// Bytes that one compressed byte unfolds to at the most: Deflate's longest match of 258 bytes in two bits, and a third
/// more where PXR24 adds the lowest byte of every float.
const MOST_UNFOLDED: u128 = 1032 * 4 / 3;
/// Sides of a tile at the most.
const MOST_TILE: usize = 1 << 14;

/// A header can promise any size, and memory for it is taken before its data are read: refuses promises that a file of
/// `length` bytes cannot keep.
fn check_promises(
    header: &exr::meta::header::Header,
    length: usize,
) -> std::result::Result<(), &'static str> {
    use exr::meta::BlockDescription;
    if header.deep {
        return Err("it holds deep data");
    }
    if let BlockDescription::Tiles(tiles) = header.blocks
        && tiles.tile_size.width().max(tiles.tile_size.height()) > MOST_TILE
    {
        return Err("its tiles are too large");
    }
    let area = header.layer_size.width() as u128 * header.layer_size.height() as u128;
    let channels = header.channels.list.iter();
    let bytes: u128 = channels.map(|c| area * c.sample_type.bytes_per_sample() as u128).sum();
    let chunks = 8 * header.chunk_count as u128;
    let length = length as u128;
    if chunks > length || bytes > length * MOST_UNFOLDED {
        return Err("its header promises more pixels than the file can hold");
    }
    Ok(())
}

/// Writes an EXR file with 32-bit floats; coverage goes to alpha.
///
/// # Errors
/// The file cannot be written.
pub fn write_exr(path: &Path, picture: &Picture) -> Result<()> {
    use exr::prelude::*;
    let size = (picture.width, picture.height);
    let at = |p: Vec2<usize>| p.y() * picture.width + p.x();
    let mut bytes = Cursor::new(Vec::new());
    let written = match &picture.coverage {
        Some(alpha) => Image::from_channels(
            size,
            SpecificChannels::rgba(|p| {
                let [r, g, b] = picture.pixels[at(p)];
                (r, g, b, alpha[at(p)])
            }),
        )
        .write()
        .non_parallel()
        .to_buffered(&mut bytes),
        None => Image::from_channels(
            size,
            SpecificChannels::rgb(|p| {
                let [r, g, b] = picture.pixels[at(p)];
                (r, g, b)
            }),
        )
        .write()
        .non_parallel()
        .to_buffered(&mut bytes),
    };
    written.map_err(|e| crate::Error::file(path, format!("cannot encode the EXR picture: {e}")))?;
    files::write_atomically(path, bytes.get_ref())
}

/// How radiance becomes display values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Factor on the radiance before anything else.
    pub exposure: f32,
}

impl Display {
    /// Exposure that brings the 99th percentile of the picture's channels near white.
    pub fn automatic(picture: &Picture) -> Self {
        let mut values: Vec<f32> =
            picture.pixels.iter().flatten().copied().filter(|v| v.is_finite() && *v > 0.0).collect();
        if values.is_empty() {
            return Self { exposure: 1.0 };
        }
        let at = (values.len() - 1) * 99 / 100;
        let (_, peak, _) = values.select_nth_unstable_by(at, f32::total_cmp);
        Self { exposure: 0.9 / *peak }
    }

    /// sRGB-encoded bytes; radiance above 1 after exposure is clipped.
    pub fn encode(self, rgb: [f32; 3]) -> [u8; 3] {
        rgb.map(|v| {
            let x = (v * self.exposure).clamp(0.0, 1.0);
            let s = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            (s * 255.0 + 0.5) as u8
        })
    }
}

/// Writes an 8-bit PNG of already encoded pixels.
///
/// # Errors
/// The file cannot be written.
pub fn write_png_bytes(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<()> {
    let bytes = encode_png(width, height, rgb)?;
    files::write_atomically(path, &bytes)
}

/// An 8-bit RGB PNG in memory.
///
/// # Errors
/// `rgb` does not hold 3 · `width` · `height` bytes.
pub fn encode_png(width: usize, height: usize, rgb: &[u8]) -> Result<Vec<u8>> {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(rgb, width as u32, height as u32, image::ExtendedColorType::Rgb8)
        .map_err(|e| Error::invalid(format!("cannot encode the PNG picture: {e}")))?;
    Ok(bytes)
}

/// Writes a PNG to look at, with the given or an automatic exposure.
///
/// # Errors
/// The file cannot be written.
pub fn write_png(path: &Path, picture: &Picture, display: Display) -> Result<()> {
    let rgb: Vec<u8> = picture.pixels.iter().flat_map(|p| display.encode(*p)).collect();
    write_png_bytes(path, picture.width, picture.height, &rgb)
}

/// Reads a coverage mask: .npy (H×W; bytes are taken as 0..255) or .exr (alpha, else the first channel).
///
/// # Errors
/// Unreadable file, wrong type or dimensions.
pub fn read_coverage(path: &Path) -> Result<(usize, usize, Vec<f32>)> {
    let mask = if path.extension().and_then(|e| e.to_str()) == Some("npy") {
        parse_coverage_npy(&files::read(path, files::Kind::Npy)?).map_err(|e| e.in_file(path))?
    } else {
        let picture = read_exr(path)?;
        let values = picture.coverage.unwrap_or_else(|| picture.pixels.iter().map(|p| p[0]).collect());
        (picture.width, picture.height, values)
    };
    if mask.2.iter().all(|v| v.is_finite()) {
        Ok(mask)
    } else {
        Err(Error::file(path, "holds values that are not finite"))
    }
}

/// Columns, rows and values of a coverage mask, from the bytes of an .npy file (H×W; bytes are taken as 0..255).
///
/// # Errors
/// Not such a file, wrong type or dimensions.
pub fn parse_coverage_npy(bytes: &[u8]) -> Result<(usize, usize, Vec<f32>)> {
    let mut array = npy::parse(bytes)?;
    let [height, width] = array.shape[..] else {
        return Err(Error::invalid("a coverage mask has two dimensions (rows, columns)"));
    };
    if array.stored == Stored::Bytes {
        array.values.iter_mut().for_each(|v| *v /= 255.0);
    }
    Ok((width, height, array.values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exr_round_trip_with_coverage() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut picture = Picture::new(3, 2);
        for (i, p) in picture.pixels.iter_mut().enumerate() {
            *p = [i as f32, 0.5 * i as f32, 1e-6];
        }
        picture.coverage = Some(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0]);
        write_exr(&path, &picture).unwrap();
        assert_eq!(read_exr(&path).unwrap(), picture);
    }

    #[test]
    fn damaged_exr_is_refused() {
        assert!(parse_exr(b"").is_err());
        assert!(parse_exr(b"v/1\x01 nothing else").is_err());
    }
}
