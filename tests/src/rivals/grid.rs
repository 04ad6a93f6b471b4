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
use super::march::Light;
use super::object::Object;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::sh::{MAX_ORDER, coefficient_count, evaluate_f32};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::time::Instant;

/// Distance of the outermost nodes from the box, in diagonals.
const INSET: f64 = 1e-3;

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

/// Nodes of a lattice and which of them are inside.
struct Lattice {
    size: [usize; 3],
    low: DVec3,
    step: DVec3,
    inside: Vec<bool>,
}

impl Lattice {
    /// About `side` nodes along the longest edge.
    fn new(object: &Object<'_>, side: f64) -> Self {
        let (low, high) = object.mesh.bounds();
        let inset = INSET * object.mesh.diagonal();
        let (low, extent) = (low + inset, (high - low - 2.0 * inset).max(DVec3::splat(inset)));
        let step = extent.max_element() / (side - 1.0).max(1.0);
        let size = (extent / step).round().to_array().map(|n| n as usize + 1);
        let step = extent / DVec3::from(size.map(|n| (n.max(2) - 1) as f64));
        let mut lattice = Self { size, low, step, inside: Vec::new() };
        lattice.inside = (0..size[1] * size[2])
            .into_par_iter()
            .flat_map_iter(|row| lattice.row(object, row % size[1], row / size[1]))
            .collect();
        lattice
    }

    fn place(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        self.low + self.step * DVec3::new(i as f64, j as f64, k as f64)
    }

    /// Whether the nodes of one row along x are inside, by the crossings of a single ray.
    fn row(&self, object: &Object<'_>, j: usize, k: usize) -> Vec<bool> {
        let mut crossings = Vec::new();
        let start = self.place([0, j, k]) - object.centre - DVec3::X * self.step.x;
        object.accel.crossings(start, DVec3::X, f64::NEG_INFINITY, f64::INFINITY, &mut crossings);
        let winding = |t: f64| crossings.iter().filter(|c| c.t > t).map(|c| c.sign).sum::<i32>();
        (0..self.size[0]).map(|i| winding((i + 1) as f64 * self.step.x) > 0).collect()
    }

    fn count(&self) -> usize {
        self.inside.iter().filter(|i| **i).count()
    }

    /// For every node the number (among the nodes inside) of the nearest one inside, breadth first.
    fn serves(&self) -> Vec<u32> {
        let [nx, ny, nz] = self.size;
        let mut serves = vec![u32::MAX; self.inside.len()];
        let mut queue: VecDeque<usize> = (0..serves.len()).filter(|&i| self.inside[i]).collect();
        for (number, &i) in queue.iter().enumerate() {
            serves[i] = number as u32;
        }
        while let Some(i) = queue.pop_front() {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
            let steps = [
                (x > 0, i.wrapping_sub(1)),
                (x + 1 < nx, i + 1),
                (y > 0, i.wrapping_sub(nx)),
                (y + 1 < ny, i + nx),
                (z > 0, i.wrapping_sub(nx * ny)),
                (z + 1 < nz, i + nx * ny),
            ];
            for (_, next) in steps.into_iter().filter(|(exists, _)| *exists) {
                if serves[next] == u32::MAX {
                    serves[next] = serves[i];
                    queue.push_back(next);
                }
            }
        }
        serves
    }
}

/// The finest lattice with at most `nodes` nodes inside; the coarsest with any where there is none.
fn lattice(object: &Object<'_>, nodes: usize) -> Option<Lattice> {
    let mut best: Option<Lattice> = None;
    // The number grows with the side's cube, though not evenly: bisection, then what was found to fit.
    let (mut low, mut high) = (2.0f64, 4.0 * (nodes as f64).cbrt() + 8.0);
    for _ in 0..18 {
        let side = 0.5 * (low + high);
        let lattice = Lattice::new(object, side);
        let count = lattice.count();
        if count <= nodes {
            low = side;
        } else {
            high = side;
        }
        let better = match best.as_ref().map(Lattice::count) {
            None | Some(0) => true,
            Some(known) if known > nodes => count > 0 && count < known,
            Some(known) => count <= nodes && count > known,
        };
        if better {
            best = Some(lattice);
        }
    }
    best.filter(|l| l.count() > 0)
}

impl Grid {
    /// Fits a grid; `None` where no lattice has a node inside the object.
    pub fn new(object: &Object<'_>, settings: Settings) -> Option<Self> {
        let begun = Instant::now();
        let lattice = lattice(object, settings.nodes)?;
        let [nx, ny, _] = lattice.size;
        let places: Vec<DVec3> = (0..lattice.inside.len())
            .filter(|&i| lattice.inside[i])
            .map(|i| lattice.place([i % nx, i / nx % ny, i / (nx * ny)]))
            .collect();
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
