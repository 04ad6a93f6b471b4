//! Scalar grids: voxel i's centre lies at min + (i + ½)(max - min)/n; trilinear between centres, clamped outside
//! them; an axis of length 1 is constant.

use super::field::march;
use crate::npy::{self, Stored};
use crate::{Error, Result, files};
use glam::DVec3;
use std::path::Path;

/// A scalar field on a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    size: [usize; 3],
    min: DVec3,
    max: DVec3,
    values: Vec<f32>,
    /// The axis along which alone the values vary, with its antiderivative at the centres.
    column: Option<(usize, Vec<f64>)>,
}

impl Grid {
    /// `values` in [z][y][x] order for `size` = [x, y, z].
    ///
    /// # Errors
    /// Sizes that do not match, bounds that are not finite or reversed, negative or non-finite values.
    pub fn new(size: [usize; 3], min: DVec3, max: DVec3, values: Vec<f32>) -> Result<Self> {
        let count = size.iter().try_fold(1usize, |a, &n| a.checked_mul(n));
        if count != Some(values.len()) || values.is_empty() {
            return Err(Error::invalid(format!(
                "a grid of {size:?} voxels does not fit {} values",
                values.len()
            )));
        }
        if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
            return Err(Error::invalid(format!(
                "grid bounds must be finite with min below max, not {min} .. {max}"
            )));
        }
        if let Some(bad) = values.iter().find(|v| !v.is_finite() || **v < 0.0) {
            return Err(Error::invalid(format!("grid values must be finite and not negative, found {bad}")));
        }
        let mut grid = Self { size, min, max, values, column: None };
        let varying: Vec<usize> = (0..3).filter(|&k| size[k] > 1).collect();
        if let [axis] = varying[..] {
            grid.column = Some((axis, grid.column_antiderivative(axis)));
        }
        Ok(grid)
    }

    /// Reads a three-dimensional .npy file (float32 or float64, C order, [z][y][x]).
    ///
    /// # Errors
    /// Unreadable file, other type, order or dimension, size that does not match the header, bad values or bounds.
    pub fn load_npy(path: &Path, min: DVec3, max: DVec3) -> Result<Self> {
        if path.extension().and_then(|e| e.to_str()) != Some("npy") {
            return Err(Error::file(path, "density grids are .npy files"));
        }
        let bytes = files::read(path, files::Kind::Npy)?;
        Self::parse_npy(&bytes, min, max).map_err(|e| e.in_file(path))
    }

    /// As [`Self::load_npy`], from the file's bytes.
    ///
    /// # Errors
    /// As [`Self::load_npy`].
    pub fn parse_npy(bytes: &[u8], min: DVec3, max: DVec3) -> Result<Self> {
        let array = npy::parse(bytes)?;
        if array.stored == Stored::Bytes {
            return Err(Error::invalid("holds 8-bit integers; save the densities as float32 or float64"));
        }
        let [nz, ny, nx] = array.shape[..] else {
            return Err(Error::invalid(format!(
                "has {} dimensions; a density grid has 3 ([z][y][x])",
                array.shape.len()
            )));
        };
        Self::new([nx, ny, nz], min, max, array.values)
    }

    /// Whether the values vary along one axis only, so that integrals have a closed form.
    pub fn is_column(&self) -> bool {
        self.column.is_some()
    }

    /// Voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Bounds of the whole grid.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.min, self.max)
    }

    /// Values in [z][y][x] order.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Half the smallest voxel edge among the axes that vary.
    pub fn feature(&self) -> f64 {
        let edge = (self.max - self.min).to_array();
        (0..3)
            .filter(|&k| self.size[k] > 1)
            .map(|k| edge[k] / self.size[k] as f64)
            .fold(f64::INFINITY, f64::min)
    }

    /// Trilinear value.
    pub fn value(&self, x: DVec3) -> f64 {
        let unit = (x - self.min) / (self.max - self.min);
        let mut cell = [(0usize, 0usize, 0.0f64); 3];
        for (k, c) in cell.iter_mut().enumerate() {
            let n = self.size[k];
            let s = (unit[k] * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
            let i = s as usize;
            *c = (i, (i + 1).min(n - 1), s - i as f64);
        }
        let at =
            |i: usize, j: usize, k: usize| f64::from(self.values[(k * self.size[1] + j) * self.size[0] + i]);
        let [(x0, x1, fx), (y0, y1, fy), (z0, z1, fz)] = cell;
        let lerp = |a: f64, b: f64, f: f64| a + (b - a) * f;
        let plane = |z: usize| {
            lerp(lerp(at(x0, y0, z), at(x1, y0, z), fx), lerp(at(x0, y1, z), at(x1, y1, z), fx), fy)
        };
        if fz == 0.0 { plane(z0) } else { lerp(plane(z0), plane(z1), fz) }
    }

    pub(super) fn integral(&self, origin: DVec3, direction: DVec3, start: f64, end: f64) -> f64 {
        if let Some((axis, table)) = &self.column {
            let slope = direction[*axis];
            let width = self.max[*axis] - self.min[*axis];
            if (slope * (end - start)).abs() > 1e-7 * width {
                let at = |t: f64| self.column_integral(*axis, table, origin[*axis] + slope * t);
                return (at(end) - at(start)) / slope;
            }
            return self.value(origin + direction * (0.5 * (start + end))) * (end - start);
        }
        march(origin, direction, start, end, self.feature(), |x| self.value(x))
    }

    /// ∫ρ from the first centre to each centre: the trapezoid rule is exact for a piecewise linear field.
    fn column_antiderivative(&self, axis: usize) -> Vec<f64> {
        let step = (self.max[axis] - self.min[axis]) / self.size[axis] as f64;
        let mut sum = 0.0;
        let mut table = vec![0.0];
        for pair in self.values.windows(2) {
            sum += 0.5 * (f64::from(pair[0]) + f64::from(pair[1])) * step;
            table.push(sum);
        }
        table
    }

    fn column_integral(&self, axis: usize, table: &[f64], x: f64) -> f64 {
        let n = self.size[axis];
        let step = (self.max[axis] - self.min[axis]) / n as f64;
        let s = (x - self.min[axis]) / step - 0.5;
        let (first, last) = (f64::from(self.values[0]), f64::from(self.values[n - 1]));
        if s <= 0.0 {
            return s * step * first;
        }
        if s >= (n - 1) as f64 {
            return table[n - 1] + (s - (n - 1) as f64) * step * last;
        }
        let i = s as usize;
        let f = s - i as f64;
        let (a, b) = (f64::from(self.values[i]), f64::from(self.values[i + 1]));
        table[i] + step * f * (a + 0.5 * f * (b - a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn column_matches_quadrature() {
        let values: Vec<f32> = (0..16).map(|i| ((i * 7) % 5) as f32).collect();
        let grid = Grid::new([1, 16, 1], DVec3::splat(-1.0), DVec3::splat(1.0), values).unwrap();
        let (origin, direction) = (DVec3::new(0.1, -1.3, 0.2), DVec3::new(0.6, 0.8, 0.0));
        let exact = grid.integral(origin, direction, 0.0, 3.3);
        let fine = march(origin, direction, 0.0, 3.3, 1e-3, |x| grid.value(x));
        assert!((exact - fine).abs() < 1e-5, "{exact} {fine}");
    }

    #[test]
    fn trilinear_reproduces_linear_functions() {
        let n = [4, 5, 6];
        let (min, max) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 4.0));
        let centre = |i: usize, j: usize, k: usize| {
            min + (DVec3::new(i as f64, j as f64, k as f64) + 0.5) * (max - min) / DVec3::new(4.0, 5.0, 6.0)
        };
        let f = |p: DVec3| 10.0 + p.x + 2.0 * p.y - p.z;
        let mut values = Vec::new();
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    values.push(f(centre(i, j, k)) as f32);
                }
            }
        }
        let grid = Grid::new(n, min, max, values).unwrap();
        let p = DVec3::new(0.2, 1.1, 3.0);
        assert!((grid.value(p) - f(p)).abs() < 1e-5);
        assert!((grid.value(DVec3::new(-9.0, 1.5, 3.0)) - f(DVec3::new(-0.75, 1.5, 3.0))).abs() < 1e-5);
    }

    #[test]
    fn integers_are_no_densities() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let mut header = b"\x93NUMPY\x01\x00".to_vec();
        let text = "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 1, 2), }\n";
        header.extend((text.len() as u16).to_le_bytes());
        header.extend(text.bytes());
        header.extend([1, 2]);
        std::fs::write(&path, header).unwrap();
        let error = Grid::load_npy(&path, DVec3::ZERO, DVec3::ONE).unwrap_err().to_string();
        assert!(error.contains("float32"), "{error}");
    }

    #[test]
    fn bad_grids_are_refused() {
        assert!(Grid::new([2, 2, 2], DVec3::ZERO, DVec3::ONE, vec![1.0; 7]).is_err());
        assert!(Grid::new([1, 1, 1], DVec3::ONE, DVec3::ZERO, vec![1.0]).is_err());
        assert!(Grid::new([1, 1, 1], DVec3::ZERO, DVec3::ONE, vec![f32::NAN]).is_err());
    }
}
