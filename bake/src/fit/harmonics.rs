//! Spherical harmonics of the encoded optical depth, fitted to the transmittance itself.
//!
//! The stored function y(ω) = Σ c_k Y_k(ω) is decoded to ψ̂ = exp(-τ(y)) at run time, so the coefficients minimise
//! Σ_ω (ψ̂ - ψ)² by damped Gauss-Newton from a linear start whose weights are the slopes dψ/dy. The plain projection
//! minimises the error of y instead, which matters most where no light comes from.

use super::depths::Lit;
use super::gauss_newton::{Basis, Solver};
use crate::Result;
use crate::params::Params;
use crate::progress::Stage;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::sh::{coefficient_count, evaluate};
use rayon::prelude::*;

/// Coefficients of all samples, row-major [sample][coefficient].
pub(crate) struct Harmonics {
    pub depth: Vec<f32>,
    pub boundary: Vec<f32>,
}

const ITERATIONS: usize = 6;
const DAMPING: f64 = 1e-4;

pub(crate) fn harmonics(lit: &Lit, params: &Params, stage: Stage<'_>) -> Result<Harmonics> {
    let columns = coefficient_count(params.order);
    let mut values = Vec::with_capacity(lit.directions.len() * columns);
    let mut row = vec![0.0; columns];
    for d in &lit.directions {
        evaluate(params.order, d.to_array(), &mut row);
        values.extend(row.iter().map(|v| *v as f32));
    }
    let basis = Basis { rows: lit.directions.len(), columns, values };
    let n = lit.samples.len();
    stage.announce(n);
    let mut depth = vec![0.0f32; n * columns];
    let mut boundary = vec![0.0f32; if lit.boundary.is_empty() { 0 } else { n * columns }];
    let chunk = 256;
    let fit_chunk = |index: usize, depth: &mut [f32], boundary: &mut [f32]| {
        let mut fitter = Fitter::new(&basis, params.encoding);
        for (k, out) in depth.chunks_exact_mut(columns).enumerate() {
            let i = index * chunk + k;
            fitter.fit_depth(&basis, &lit.transmittance[i * basis.rows..(i + 1) * basis.rows], out);
            if let Some(out) = boundary.chunks_exact_mut(columns).nth(k) {
                fitter.fit_boundary(&basis, &lit.boundary[i * basis.rows..(i + 1) * basis.rows], out);
            }
        }
        stage.step(depth.len() / columns)
    };
    if boundary.is_empty() {
        depth.par_chunks_mut(chunk * columns).enumerate().try_for_each(|(c, d)| fit_chunk(c, d, &mut []))?;
    } else {
        depth
            .par_chunks_mut(chunk * columns)
            .zip(boundary.par_chunks_mut(chunk * columns))
            .enumerate()
            .try_for_each(|(c, (d, b))| fit_chunk(c, d, b))?;
    }
    Ok(Harmonics { depth, boundary })
}

/// Buffers for fitting one sample after another.
struct Fitter {
    encoding: Encoding,
    solver: Solver,
    psi: Vec<f32>,
    target: Vec<f32>,
    slope: Vec<f32>,
    value: Vec<f32>,
    best: Vec<f32>,
    trial: Vec<f32>,
}

impl Fitter {
    fn new(basis: &Basis, encoding: Encoding) -> Self {
        let zeros = |n: usize| vec![0.0f32; n];
        Self {
            encoding,
            solver: Solver::new(basis),
            psi: zeros(basis.rows),
            target: zeros(basis.rows),
            slope: zeros(basis.rows),
            value: zeros(basis.rows),
            best: zeros(basis.columns),
            trial: zeros(basis.columns),
        }
    }

    /// ψ̂ and dψ̂/dy.
    fn decode(&self, y: f32) -> (f32, f32) {
        match self.encoding {
            Encoding::Transmittance => (y.clamp(0.0, 1.0), 1.0),
            Encoding::Reciprocal { epsilon } => {
                if y <= 0.0 {
                    return (0.0, 0.0);
                }
                let psi = (epsilon - 1.0 / y).exp();
                if psi >= 1.0 { (1.0, 0.0) } else { (psi, psi / (y * y)) }
            }
        }
    }

    fn error(&mut self, basis: &Basis, x: &[f32]) -> f32 {
        let mut value = std::mem::take(&mut self.value);
        basis.apply(x, &mut value);
        let sum = value.iter().zip(&self.psi).map(|(y, psi)| (self.decode(*y).0 - psi).powi(2)).sum();
        self.value = value;
        sum
    }

    fn fit_depth(&mut self, basis: &Basis, transmittance: &[f32], out: &mut [f32]) {
        for (d, psi) in transmittance.iter().enumerate() {
            let tau = -psi.max(1e-30).ln();
            self.psi[d] = *psi;
            self.target[d] = self.encoding.encode(f64::from(tau)) as f32;
            let slope = match self.encoding {
                Encoding::Transmittance => 1.0,
                Encoding::Reciprocal { epsilon } => self.psi[d] * (tau + epsilon) * (tau + epsilon),
            };
            self.slope[d] = slope + 0.02;
        }
        self.best.fill(0.0);
        if !self.solver.solve(basis, &self.slope, &self.target, DAMPING, out) {
            out.fill(0.0);
            return;
        }
        if self.encoding == Encoding::Transmittance {
            return;
        }
        self.best.copy_from_slice(out);
        let mut least = self.error(basis, out);
        let mut damping = DAMPING;
        for _ in 0..ITERATIONS {
            // self.value holds y at `best`. Where ψ̂ is clamped, a small slope keeps a wrong value movable.
            for d in 0..basis.rows {
                let y = self.value[d];
                let (psi, slope) = self.decode(y);
                let residual = self.psi[d] - psi;
                let slope = slope.max(if residual.abs() > 1e-3 { 0.15 } else { 0.02 });
                self.slope[d] = slope;
                self.target[d] = y + residual / slope;
            }
            let mut trial = std::mem::take(&mut self.trial);
            let solved = self.solver.solve(basis, &self.slope, &self.target, damping, &mut trial);
            let error = if solved { self.error(basis, &trial) } else { f32::INFINITY };
            self.trial = trial;
            if error < least {
                let gain = (least - error) / least.max(1e-20);
                least = error;
                self.best.copy_from_slice(&self.trial);
                if gain < 5e-3 {
                    break;
                }
            } else {
                // A shorter step: halfway between.
                for (t, b) in self.trial.iter_mut().zip(&self.best) {
                    *t = 0.5 * (*t + b);
                }
                let trial = std::mem::take(&mut self.trial);
                let error = self.error(basis, &trial);
                self.trial = trial;
                damping *= 10.0;
                if error < least {
                    least = error;
                    self.best.copy_from_slice(&self.trial);
                } else {
                    let best = std::mem::take(&mut self.best);
                    self.error(basis, &best);
                    self.best = best;
                }
            }
        }
        out.copy_from_slice(&self.best);
    }

    /// Linear fit weighted by the transmittance of the medium: the boundary matters where light arrives.
    fn fit_boundary(&mut self, basis: &Basis, through: &[f32], out: &mut [f32]) {
        for d in 0..basis.rows {
            self.slope[d] = self.psi[d] + 0.02;
        }
        if !self.solver.solve(basis, &self.slope, through, DAMPING, out) {
            out.fill(0.0);
        }
    }
}
