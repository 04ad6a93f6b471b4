//! Pictures of linear radiance: EXR in and out, PNG to look at, coverage masks.

use crate::{Error, Result, files, medium};
use std::io::Cursor;
use std::path::Path;

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
    parse_exr(&files::read(path)?).map_err(|e| e.in_file(path))
}

/// As [`read_exr`], from the file's bytes.
pub fn parse_exr(bytes: &[u8]) -> Result<Picture> {
    use exr::prelude::*;
    let bad = |e: String| crate::Error::invalid(format!("is not a usable EXR picture: {e}"));
    // A header can promise any size; what compression can unfold is bounded by 1:1000 or so.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| bad(e.to_string()))?;
    let budget = bytes.len().saturating_mul(4096).max(1 << 20);
    for header in &meta.headers {
        if header.max_pixel_file_bytes() > budget {
            return Err(bad("its header promises more pixels than the file can hold".to_owned()));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| bad(e.to_string()))?;
    let size = image.layer_data.size;
    let channels = &image.layer_data.channel_data.list;
    let find = |name: &str| channels.iter().find(|c| c.name.to_string().eq_ignore_ascii_case(name));
    let values =
        |channel: &AnyChannel<FlatSamples>| -> Vec<f32> { channel.sample_data.values_as_f32().collect() };
    let rgb = match (find("R"), find("G"), find("B")) {
        (Some(r), Some(g), Some(b)) => [values(r), values(g), values(b)],
        _ => match channels.iter().find(|c| !c.name.to_string().eq_ignore_ascii_case("A")) {
            Some(grey) => [values(grey), values(grey), values(grey)],
            None => return Err(bad("it has no colour channel".to_owned())),
        },
    };
    let count = size.width() * size.height();
    if rgb.iter().any(|c| c.len() != count) {
        return Err(bad("its channels are subsampled".to_owned()));
    }
    Ok(Picture {
        width: size.width(),
        height: size.height(),
        pixels: (0..count).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]]).collect(),
        coverage: find("A").map(values),
    })
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
    if path.extension().and_then(|e| e.to_str()) == Some("npy") {
        let bytes = files::read(path)?;
        let (shape, kind, mut values) = medium::read_npy(&bytes).map_err(|e| e.in_file(path))?;
        let [height, width] = shape[..] else {
            return Err(Error::file(path, "a coverage mask has two dimensions (rows, columns)"));
        };
        if kind == medium::NpyKind::Bytes {
            values.iter_mut().for_each(|v| *v /= 255.0);
        }
        return Ok((width, height, values));
    }
    let picture = read_exr(path)?;
    let values = picture.coverage.unwrap_or_else(|| picture.pixels.iter().map(|p| p[0]).collect());
    Ok((picture.width, picture.height, values))
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
