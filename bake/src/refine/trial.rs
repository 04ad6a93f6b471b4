//! Ray integrals of placed samples under exact light.

use super::Bench;
use crate::Result;
use crate::fit::{Cells, Light, boundary_order, buried, nearest, weights};
use crate::measure::exact;
use crate::measure::play::Player;
use crate::measure::truth::{Nodes, Radiance};
use crate::measure::views::{View, views};
use crate::pack::{Stand, pack};
use crate::progress::Stage;
use crate::samples::Placed;
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::slopes::CELL_RADIUS;
use glam::{DVec3, Vec3};

/// Directions of view.
const VIEWS: usize = 24;
/// Directions of light, a multiple of the channels.
const LIGHTS: usize = 12;
/// Points of a cell.
const POINTS: usize = 4;

/// Rays and lights with their truth.
pub(super) struct Trial {
    views: Vec<View>,
    lights: Vec<DVec3>,
    pub nodes: Nodes,
    truth: Vec<Radiance>,
}

/// What samples make of the rays.
pub(super) struct Measured {
    /// Squared error of each ray over all lights; noise may leave less than 0.
    pub rays: Vec<f64>,
    /// Sum of squared truth.
    square: f64,
}

impl Measured {
    /// Relative root mean square error; infinite where no light leaves the object.
    pub fn error(&self) -> f64 {
        let error = self.rays.iter().sum::<f64>().max(0.0) / self.square;
        if error.is_finite() { error.sqrt() } else { f64::INFINITY }
    }
}

impl Trial {
    /// Draws views and lights from the seed, others than the certificate's.
    pub fn new(bench: &Bench<'_>, stage: Stage<'_>) -> Result<Self> {
        let stream = hash(bench.params.seed, 89);
        stage.announce(VIEWS + LIGHTS);
        let views = views(bench.shape, bench.medium.medium.ior(), VIEWS, hash(stream, 1), stage)?;
        let lights = even_directions(LIGHTS, hash(stream, 2));
        let nodes = Nodes::new(&views, bench.medium, hash(stream, 3));
        let truth = nodes.radiance(bench.shape, bench.medium, &lights, stage)?;
        Ok(Self { views, lights, nodes, truth })
    }

    /// Plays `placed` with kernels of this width.
    pub fn measure(
        &self,
        bench: &Bench<'_>,
        placed: &Placed,
        width_factor: f32,
        stage: Stage<'_>,
    ) -> Result<Measured> {
        let medium = bench.medium.medium;
        let seed = hash(bench.params.seed, 97);
        let near = nearest(bench.shape, &placed.samples, f64::from(CELL_RADIUS));
        let buried = buried(&placed.samples, &near);
        let cells = Cells::new(bench.shape, medium, &placed.samples, &buried, (POINTS, POINTS), seed)?;
        let middle = bench.shape.mesh.centre();
        let weight = weights(&placed.samples, middle, &placed.probes, width_factor, stage)?;
        let params = &crate::params::Params { width_factor, ..bench.params.clone() };
        let offset = cells.offsets(&placed.samples);
        let stand = Stand { samples: &placed.samples, offset, discarded: 0 };
        let light = Light::none(placed.samples.len(), boundary_order(medium.ior(), params.order));
        let asset =
            pack(bench.input, bench.medium.sampled.as_ref(), params, stand, light, (weight, Vec::new()))?;
        let player = Player::new(&asset, &self.views);
        stage.announce(LIGHTS);
        let lights: Vec<(DVec3, usize)> = self.lights.iter().enumerate().map(|(l, d)| (*d, l % 3)).collect();
        let arriving = exact::means(bench.shape, bench.medium, &cells, &lights, stage)?;
        let played = player.radiance(LIGHTS, |i, l| arriving[l][i], Vec3::ONE, stage)?;
        let mut rays = vec![0.0; self.nodes.rays()];
        let mut square = 0.0;
        for (played, truth) in played.iter().zip(&self.truth) {
            for ((ray, played), truth) in rays.iter_mut().zip(played).zip(truth) {
                let [a, b] = truth.map(f64::from);
                *ray += (f64::from(*played) - a) * (f64::from(*played) - b);
                square += a * b;
            }
        }
        Ok(Measured { rays, square })
    }
}
