//! Spherical harmonics of a function that is known in many directions.
//!
//! [`project`]: plain least squares, min_c Σ_ω (Σ_k c_k Y_k(ω) - f(ω))².
//! [`Fitter`]: the encoded depth y with the transmittance as the goal, min_c Σ_ω (ψ(Σ c_k Y_k) - ψ)², by damped
//! Gauss-Newton (Levenberg 1944) from a linear start weighted by dψ/dy. The bake has a fit of its own; this one exists
//! so that rivals depend on nothing that the bake may change. Checked by the tests below.

use diaphane_formats::encoding::Encoding;
use diaphane_formats::sh::{coefficient_count, evaluate};
use glam::DVec3;

/// Gauss-Newton steps.
const STEPS: usize = 6;

/// Damping at the start, in parts of the mean diagonal of the normal matrix.
const DAMPING: f64 = 1e-4;

/// Basis values, row-major [direction][coefficient].
pub struct Basis {
    columns: usize,
    values: Vec<f32>,
}

impl Basis {
    /// The first `order` bands in the given directions (unit vectors).
    pub fn new(order: usize, directions: &[DVec3]) -> Self {
        let columns = coefficient_count(order);
        let mut row = vec![0.0; columns];
        let mut values = Vec::with_capacity(columns * directions.len());
        for d in directions {
            evaluate(order, d.to_array(), &mut row);
            values.extend(row.iter().map(|v| *v as f32));
        }
        Self { columns, values }
    }

    fn rows(&self) -> std::slice::ChunksExact<'_, f32> {
        self.values.chunks_exact(self.columns)
    }

    fn apply(&self, x: &[f32], out: &mut [f32]) {
        for (o, row) in out.iter_mut().zip(self.rows()) {
            *o = row.iter().zip(x).map(|(b, c)| b * c).sum();
        }
    }

    /// The normal matrix (lower triangle, row-major) and right side of min Σ g² (row · x - y)².
    fn normal(&self, slope: &[f32], target: &[f32], matrix: &mut [f32], right: &mut [f32]) {
        let n = self.columns;
        matrix.fill(0.0);
        right.fill(0.0);
        for ((row, g), y) in self.rows().zip(slope).zip(target) {
            let g2 = g * g;
            for i in 0..n {
                let scaled = g2 * row[i];
                right[i] += scaled * y;
                for (m, b) in matrix[i * n..=i * n + i].iter_mut().zip(row) {
                    *m += scaled * b;
                }
            }
        }
    }
}

/// Solves (M + ridge · I) x = b for a symmetric positive matrix given by its lower triangle (Cholesky); false if it is
/// not positive.
fn solve(n: usize, matrix: &[f32], right: &[f32], ridge: f64, factor: &mut [f64], x: &mut [f32]) -> bool {
    let mut y = vec![0.0; n];
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| factor[i * n + k] * factor[j * n + k]).sum();
            let value = f64::from(matrix[i * n + j]) - dot;
            if i > j {
                factor[i * n + j] = value / factor[j * n + j];
            } else if value + ridge > 0.0 {
                factor[i * n + i] = (value + ridge).sqrt();
            } else {
                return false;
            }
        }
        let dot: f64 = (0..i).map(|k| factor[i * n + k] * y[k]).sum();
        y[i] = (f64::from(right[i]) - dot) / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| factor[k * n + i] * y[k]).sum();
        y[i] = (y[i] - dot) / factor[i * n + i];
        x[i] = y[i] as f32;
    }
    x.iter().all(|v| v.is_finite())
}

/// Work space for fitting one function after another.
pub struct Fitter<'a> {
    basis: &'a Basis,
    encoding: Encoding,
    matrix: Vec<f32>,
    right: Vec<f32>,
    factor: Vec<f64>,
    slope: Vec<f32>,
    target: Vec<f32>,
    value: Vec<f32>,
    trial: Vec<f32>,
}

impl<'a> Fitter<'a> {
    /// A fitter for one basis and encoding.
    pub fn new(basis: &'a Basis, encoding: Encoding) -> Self {
        let (rows, n) = (basis.rows().len(), basis.columns);
        Self {
            basis,
            encoding,
            matrix: vec![0.0; n * n],
            right: vec![0.0; n],
            factor: vec![0.0; n * n],
            slope: vec![0.0; rows],
            target: vec![0.0; rows],
            value: vec![0.0; rows],
            trial: vec![0.0; n],
        }
    }

    /// ψ and dψ/dy of a stored value, the slope by a central difference of the decoder itself.
    fn decode(&self, y: f32) -> (f32, f32) {
        let psi = |y: f32| (-self.encoding.decode(y)).exp();
        let h = 1e-3 * y.abs().max(0.1);
        (psi(y), (psi(y + h) - psi(y - h)) / (2.0 * h))
    }

    /// Σ (ψ̂ - ψ)² at coefficients `x`; leaves the stored function's values behind.
    fn error(&mut self, x: &[f32], psi: &[f32]) -> f32 {
        self.basis.apply(x, &mut self.value);
        self.value.iter().zip(psi).map(|(y, p)| (self.decode(*y).0 - p).powi(2)).sum()
    }

    fn step(&mut self, damping: f64) -> bool {
        let n = self.basis.columns;
        self.basis.normal(&self.slope, &self.target, &mut self.matrix, &mut self.right);
        let mean = (0..n).map(|i| f64::from(self.matrix[i * n + i])).sum::<f64>() / n as f64;
        solve(n, &self.matrix, &self.right, damping * mean + 1e-30, &mut self.factor, &mut self.trial)
    }

    /// Coefficients of the function that decodes to `psi` (one value for each direction), into `out`. Darkness, which
    /// no step can improve, gives zeros.
    pub fn fit(&mut self, psi: &[f32], out: &mut [f32]) {
        out.fill(0.0);
        for (d, p) in psi.iter().enumerate() {
            let tau = -f64::from(p.max(1e-30)).ln();
            self.target[d] = self.encoding.encode(tau) as f32;
            self.slope[d] = self.decode(self.target[d]).1 + 0.02;
        }
        if !self.step(DAMPING) {
            return;
        }
        out.copy_from_slice(&self.trial);
        let mut least = self.error(out, psi);
        let mut damping = DAMPING;
        for _ in 0..STEPS {
            for (d, p) in psi.iter().enumerate() {
                let y = self.value[d];
                let (now, slope) = self.decode(y);
                // Where the decoder is flat a small slope keeps a wrong value movable.
                self.slope[d] = slope.max(if (p - now).abs() > 1e-3 { 0.15 } else { 0.02 });
                self.target[d] = y + (p - now) / self.slope[d];
            }
            let solved = self.step(damping);
            let trial = std::mem::take(&mut self.trial);
            let error = if solved { self.error(&trial, psi) } else { f32::INFINITY };
            if error < least {
                out.copy_from_slice(&trial);
                let gain = least - error;
                least = error;
                damping *= 0.3;
                self.trial = trial;
                if gain < 5e-3 * least {
                    break;
                }
            } else {
                damping *= 10.0;
                self.trial = trial;
                least = self.error(out, psi);
            }
        }
    }
}

/// Plain least-squares coefficients of many functions, row-major [function][coefficient], from their values,
/// row-major [function][direction].
pub fn project(order: usize, directions: &[DVec3], values: &[f32]) -> Vec<f32> {
    use rayon::prelude::*;
    let basis = Basis::new(order, directions);
    let (n, rows) = (basis.columns, directions.len());
    let ones = vec![1.0; rows];
    let mut out = vec![0.0; values.len() / rows.max(1) * n];
    out.par_chunks_mut(n).zip(values.par_chunks(rows.max(1))).for_each_init(
        || (vec![0.0; n * n], vec![0.0; n], vec![0.0; n * n]),
        |(matrix, right, factor), (x, y)| {
            basis.normal(&ones, y, matrix, right);
            // The ridge only matters with fewer directions than coefficients.
            solve(n, matrix, right, 1e-6 * rows as f64, factor, x);
        },
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::even_directions;

    #[test]
    fn projection_recovers_a_band_limited_function() {
        let directions = even_directions(64, 5);
        // Y_0^0 and Y_1^0 by hand: 1/√4π and √(3/4π) z.
        let f: Vec<f32> = directions.iter().map(|d| (0.5 + 0.25 * d.z) as f32).collect();
        let c = project(3, &directions, &f);
        let pi = std::f32::consts::PI;
        assert!((c[0] - 0.5 * (4.0 * pi).sqrt()).abs() < 1e-4, "{c:?}");
        assert!((c[2] - 0.25 * (4.0 * pi / 3.0).sqrt()).abs() < 1e-4, "{c:?}");
        assert!(c.iter().enumerate().all(|(i, v)| i == 0 || i == 2 || v.abs() < 1e-4), "{c:?}");
    }

    #[test]
    fn the_fit_beats_its_linear_start_and_finds_what_can_be_found() {
        // A slab: τ = 2 / max(n·ω, 0) is 1/τ = clamped cosine / 2, almost within five bands.
        let directions = even_directions(200, 9);
        let psi: Vec<f32> =
            directions.iter().map(|d| if d.z > 0.0 { (-0.4 / d.z).exp() as f32 } else { 0.0 }).collect();
        let basis = Basis::new(5, &directions);
        let mut fitter = Fitter::new(&basis, Encoding::RECIPROCAL);
        let mut c = vec![0.0; 25];
        fitter.fit(&psi, &mut c);
        let rms = (fitter.error(&c, &psi) / 200.0).sqrt();
        assert!(rms < 0.03, "{rms}");
        // Five bands of ψ itself do worse.
        let plain = project(5, &directions, &psi);
        let mut values = vec![0.0; 200];
        basis.apply(&plain, &mut values);
        let plain: f32 = values.iter().zip(&psi).map(|(a, b)| (a.clamp(0.0, 1.0) - b).powi(2)).sum();
        assert!(rms < 0.7 * (plain / 200.0).sqrt(), "{rms} {plain}");
        // A constant up to the damping, a relative 1e-4; darkness is zeros.
        fitter.fit(&[0.3; 200], &mut c);
        assert!((fitter.error(&c, &[0.3; 200]) / 200.0).sqrt() < 2e-4);
        fitter.fit(&[0.0; 200], &mut c);
        assert!(fitter.error(&c, &[0.0; 200]) < 1e-8);
    }
}
