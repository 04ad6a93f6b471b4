//! Weighted least squares on a fixed set of basis rows, small and dense.

/// Basis values in row-major [direction][coefficient] order.
pub(super) struct Basis {
    pub rows: usize,
    pub columns: usize,
    pub values: Vec<f32>,
}

/// Work space of one solve, reused between samples.
pub(super) struct Solver {
    scaled: Vec<f32>,
    normal: Vec<f32>,
    right: Vec<f32>,
    factor: Vec<f64>,
}

impl Solver {
    pub fn new(basis: &Basis) -> Self {
        let n = basis.columns;
        Self {
            scaled: vec![0.0; 4 * n],
            normal: vec![0.0; n * n],
            right: vec![0.0; n],
            factor: vec![0.0; n * n],
        }
    }

    /// Solves min Σ_d g_d² (Σ_k B_dk x_k - y_d)² + damping · mean(g²) · |x|² and writes x; false if it cannot.
    pub fn solve(
        &mut self,
        basis: &Basis,
        slope: &[f32],
        target: &[f32],
        damping: f64,
        x: &mut [f32],
    ) -> bool {
        let n = basis.columns;
        self.normal.fill(0.0);
        self.right.fill(0.0);
        let mut mean = 0.0f64;
        for d in (0..basis.rows).step_by(4) {
            let count = (basis.rows - d).min(4);
            self.scaled.fill(0.0);
            for q in 0..count {
                let g = slope[d + q];
                mean += f64::from(g * g);
                let row = &basis.values[(d + q) * n..(d + q + 1) * n];
                let value = g * target[d + q];
                for (k, b) in row.iter().enumerate() {
                    self.scaled[q * n + k] = g * b;
                    self.right[k] += g * b * value;
                }
            }
            // Four rank-one updates at once: the lower triangle is read and written a quarter as often.
            let (s0, rest) = self.scaled.split_at(n);
            let (s1, rest) = rest.split_at(n);
            let (s2, s3) = rest.split_at(n);
            for i in 0..n {
                let (a0, a1, a2, a3) = (s0[i], s1[i], s2[i], s3[i]);
                let out = &mut self.normal[i * n..i * n + i + 1];
                for (((o, b0), b1), (b2, b3)) in out.iter_mut().zip(s0).zip(s1).zip(s2.iter().zip(s3)) {
                    *o += a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3;
                }
            }
        }
        let ridge = damping * mean / (4.0 * std::f64::consts::PI) + 1e-30;
        self.cholesky(n, ridge, x)
    }

    fn cholesky(&mut self, n: usize, ridge: f64, x: &mut [f32]) -> bool {
        let l = &mut self.factor;
        for i in 0..n {
            for j in 0..=i {
                let (row_i, row_j) = (&l[i * n..i * n + j], &l[j * n..j * n + j]);
                let dot: f64 = row_i.iter().zip(row_j).map(|(a, b)| a * b).sum();
                let mut value = f64::from(self.normal[i * n + j]) - dot;
                if i == j {
                    value += ridge;
                    if !(value > 0.0) {
                        return false;
                    }
                    l[i * n + i] = value.sqrt();
                } else {
                    l[i * n + j] = value / l[j * n + j];
                }
            }
        }
        let mut y = [0.0f64; 128];
        for i in 0..n {
            let dot: f64 = (0..i).map(|k| l[i * n + k] * y[k]).sum();
            y[i] = (f64::from(self.right[i]) - dot) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * y[k]).sum();
            y[i] = (y[i] - dot) / l[i * n + i];
        }
        for (out, value) in x.iter_mut().zip(&y[..n]) {
            *out = *value as f32;
        }
        x.iter().all(|v| v.is_finite())
    }
}

impl Basis {
    /// Reconstructed values in every direction.
    pub fn apply(&self, x: &[f32], out: &mut [f32]) {
        for (o, row) in out.iter_mut().zip(self.values.chunks_exact(self.columns)) {
            *o = row.iter().zip(x).map(|(b, c)| b * c).sum();
        }
    }
}
