//! Light for a march from a regular grid: the samples' bytes spent on nodes of a trilinear lattice instead.
//!
//! The lattice spans the object's bounding box (its outermost nodes lie just inside the faces). Only nodes inside the
//! object are stored and counted, each with the harmonics of the same encoded depth and order as a sample of the
//! asset; which nodes are inside, and all precision beyond the asset's bytes, comes free. A node outside, which points
//! near the boundary need, shares the values of the nearest node inside (in steps along the lattice).
//!
//! Two ways to interpolate, see [`Blend`]; neither is better everywhere, so the caller may try both.

use super::depths::transmittances;
use super::fit::{Basis, Fitter};
use super::lattice::Lattice;
use super::march::Light;
use super::object::Object;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::sh::{MAX_ORDER, coefficient_count, evaluate_f32};
use glam::Vec3;
use rayon::prelude::*;
use std::time::Instant;

/// Depths above this are black whatever their value; it keeps ln ψ of a dark node finite.
const BLACK: f32 = 20.0;

/// What is interpolated between nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// The coefficients, decoded once for each light. Better where the medium is homogeneous.
    Values,
    /// ln ψ, decoded at all eight nodes for each light. Better where the medium is not.
    Logarithms,
}

/// What is stored at the nodes.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// At most this many nodes inside the object (at least one is made).
    pub nodes: usize,
    /// Bands of spherical harmonics.
    pub order: usize,
    /// Meaning of the coefficients.
    pub encoding: Encoding,
    /// Directions that the harmonics are fitted to.
    pub directions: usize,
}

/// A grid of harmonics.
pub struct Grid {
    size: [usize; 3],
    /// First node relative to the object's centre, and nodes per mesh unit.
    low: Vec3,
    per_unit: Vec3,
    /// For every node of the lattice the stored node that serves it.
    serves: Vec<u32>,
    /// Row-major [stored node][coefficient].
    coefficients: Vec<f32>,
    order: usize,
    encoding: Encoding,
    ratio: Vec3,
    /// What is interpolated.
    pub blend: Blend,
    /// Stored nodes.
    pub stored: usize,
    /// Seconds that it took to make.
    pub seconds: f64,
}

impl Grid {
    /// Fits a grid; `None` where no lattice has a node inside the object.
    pub fn new(object: &Object<'_>, settings: Settings) -> Option<Self> {
        let begun = Instant::now();
        let lattice = Lattice::finest(object, settings.nodes)?;
        let places = lattice.places();
        let psi = transmittances(object, &places, settings.directions);
        let basis = Basis::new(settings.order, &psi.directions);
        let columns = coefficient_count(settings.order);
        let mut coefficients = vec![0.0; places.len() * columns];
        coefficients
            .par_chunks_mut(columns)
            .zip(psi.values.par_chunks(psi.directions.len()))
            .with_min_len(16)
            .for_each_init(
                || Fitter::new(&basis, settings.encoding),
                |fitter, (out, psi)| fitter.fit(psi, out),
            );
        Some(Self {
            size: lattice.size,
            low: (lattice.low - object.centre).as_vec3(),
            per_unit: (1.0 / lattice.step).as_vec3(),
            serves: lattice.serves(),
            stored: places.len(),
            coefficients,
            order: settings.order,
            encoding: settings.encoding,
            ratio: object.channel_ratio(),
            seconds: begun.elapsed().as_secs_f64(),
            blend: Blend::Values,
        })
    }

    /// Coefficients of a stored node.
    fn node(&self, node: usize) -> &[f32] {
        let columns = coefficient_count(self.order);
        &self.coefficients[node * columns..(node + 1) * columns]
    }

    /// The stored node and weight of the eight corners around a place.
    fn corners(&self, place: Vec3) -> [(usize, f32); 8] {
        let unit = (place - self.low) * self.per_unit;
        let mut first = [0; 3];
        let mut part = [0.0; 3];
        for axis in 0..3 {
            let last = self.size[axis].saturating_sub(2);
            first[axis] = (unit[axis].max(0.0) as usize).min(last);
            part[axis] = (unit[axis] - first[axis] as f32).clamp(0.0, 1.0);
        }
        std::array::from_fn(|corner| {
            let mut index = 0;
            let mut weight = 1.0;
            for axis in (0..3).rev() {
                let far = corner >> axis & 1;
                let at = (first[axis] + far).min(self.size[axis] - 1);
                index = index * self.size[axis] + at;
                weight *= if far == 1 { part[axis] } else { 1.0 - part[axis] };
            }
            (self.serves[index] as usize, weight)
        })
    }
}

/// What is known of a place, and a basis.
pub struct Interpolated {
    corners: [(usize, f32); 8],
    coefficients: [f32; MAX_ORDER * MAX_ORDER],
    basis: [f32; MAX_ORDER * MAX_ORDER],
}

impl Default for Interpolated {
    fn default() -> Self {
        let zeros = [0.0; MAX_ORDER * MAX_ORDER];
        Self { corners: [(0, 0.0); 8], coefficients: zeros, basis: zeros }
    }
}

impl Light for Grid {
    type Memory = Interpolated;

    fn enter(&self, place: Vec3, memory: &mut Interpolated) {
        memory.corners = self.corners(place);
        if self.blend == Blend::Values {
            let out = &mut memory.coefficients[..coefficient_count(self.order)];
            out.fill(0.0);
            for (node, weight) in memory.corners {
                for (o, c) in out.iter_mut().zip(self.node(node)) {
                    *o += weight * c;
                }
            }
        }
    }

    fn arriving(&self, _: Vec3, towards: Vec3, _: f32, memory: &mut Interpolated) -> Vec3 {
        evaluate_f32(self.order, towards.to_array(), &mut memory.basis);
        let basis = &memory.basis[..coefficient_count(self.order)];
        let tau = |c: &[f32]| self.encoding.decode(c.iter().zip(basis).map(|(c, y)| c * y).sum()).min(BLACK);
        let tau = match self.blend {
            Blend::Values => tau(&memory.coefficients),
            Blend::Logarithms => memory.corners.iter().map(|(n, weight)| weight * tau(self.node(*n))).sum(),
        };
        if tau >= BLACK { Vec3::ZERO } else { (-self.ratio * tau).exp() }
    }
}
