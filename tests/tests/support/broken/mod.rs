//! Meshes broken on purpose: kinds of damage done to clean shapes by code, and what should come of each.

mod cells;
mod damage;
mod kinds;

pub use kinds::{Kind, all};

use cells::{cells, cells_around};
use damage::*;
use diaphane_assets::shapes::{Triangles, cuboid, icosphere, isosurface, torus};
use glam::DVec3;

/// The clean shape that a broken mesh stands for, made without any repair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intended {
    Ball,
    Torus,
    Box,
    /// A ball with a round cavity.
    Hollow,
    /// A hollow ball with a ball in its cavity.
    Island,
    /// Two balls apart.
    Pair,
    /// Two balls that overlap, as one surface.
    Peanut,
    /// The outer surface of a torus whose tube is wider than its ring.
    Apple,
    /// A bar of two cubes.
    Bar,
    /// Two cubes with a common edge.
    EdgeToEdge,
    /// Two cubes with a common corner.
    CornerToCorner,
    /// Three bars through each other.
    Jack,
    /// A slab with a cube on top.
    Step,
    /// 27 boxes in a lattice.
    Lattice,
}

impl Intended {
    pub const ALL: [Self; 14] = [
        Self::Ball,
        Self::Torus,
        Self::Box,
        Self::Hollow,
        Self::Island,
        Self::Pair,
        Self::Peanut,
        Self::Apple,
        Self::Bar,
        Self::EdgeToEdge,
        Self::CornerToCorner,
        Self::Jack,
        Self::Step,
        Self::Lattice,
    ];

    /// The shape, within about one unit of the origin.
    pub fn shape(self) -> Triangles {
        match self {
            Self::Ball => icosphere(1.0, 3),
            Self::Torus => torus(0.7, 0.3, 48, 24),
            Self::Box => cuboid([0.75, 0.625, 0.5], 8),
            Self::Hollow => joined(&[icosphere(1.0, 3), reversed(icosphere(0.5, 3))]),
            Self::Island => joined(&[Self::Hollow.shape(), icosphere(0.3, 2)]),
            Self::Pair => joined(&pair(0.55, 0.45)),
            Self::Peanut => surface(|p| {
                let reach = |x: f64| (p - DVec3::new(x, 0.0, 0.0)).length() - 0.6;
                reach(-0.35).min(reach(0.35))
            }),
            Self::Apple => {
                surface(|p| DVec3::new((p.x * p.x + p.z * p.z).sqrt() - 0.4, p.y, 0.0).length() - 0.55)
            }
            Self::Bar => cells(&[[0, 0, 0], [1, 0, 0]], 0.75, 4),
            Self::EdgeToEdge => cells(&[[0, 0, 0], [1, 1, 0]], 0.75, 4),
            Self::CornerToCorner => cells(&[[0, 0, 0], [1, 1, 1]], 0.75, 4),
            Self::Jack => cells(
                &[[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]],
                0.5,
                4,
            ),
            Self::Step => {
                let slab = (0..9).map(|i| [i % 3, 0, i / 3]);
                cells(&slab.chain([[1, 1, 1]]).collect::<Vec<_>>(), 0.5, 4)
            }
            Self::Lattice => joined(&lattice()),
        }
    }
}

/// Two balls of this radius at ± this distance along x.
pub fn pair(distance: f64, radius: f64) -> [Triangles; 2] {
    [-distance, distance].map(|x| moved(icosphere(radius, 3), DVec3::new(x, 0.0, 0.0)))
}

/// 27 small boxes apart.
pub fn lattice() -> Vec<Triangles> {
    let at = |i: usize| DVec3::new((i % 3) as f64, (i / 3 % 3) as f64, (i / 9) as f64) - 1.0;
    (0..27).map(|i| moved(scaled(cuboid([0.5; 3], 2), 0.4), 0.6 * at(i))).collect()
}

fn surface(value: impl Fn(DVec3) -> f64) -> Triangles {
    isosurface(DVec3::splat(-1.1), DVec3::splat(1.1), 36, value)
}
