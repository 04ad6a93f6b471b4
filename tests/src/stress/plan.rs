//! The matrix: which bodies are baked, and which cells each of them serves.
//!
//! A full product of all axes would have millions of cells, nearly all of them repetitions. Here every body meets
//! every light, every view and every scattering at least twice, paired anew for each body; the plain body meets all
//! combinations of the three.

use super::axes::{
    EXTINCTIONS, LIGHTS, Lights, MOST_SAMPLES, OFFSETS, ORDERS, SAMPLES, SCALES, SCATTERINGS, SHAPES,
    Scattering, Shape, VIEWS, View,
};

/// What is baked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Boundary.
    pub shape: Shape,
    /// Factor on the mesh.
    pub scale: f64,
    /// Distance from the origin, diagonals.
    pub offset: f64,
    /// Extinction times diagonal.
    pub extinction: f64,
    /// Bands.
    pub order: usize,
    /// Stored samples.
    pub samples: usize,
    /// Index of refraction.
    pub ior: f64,
    /// Whether density and extinction vary: layers, and another extinction in each channel.
    pub uneven: bool,
}

/// What other bodies differ from in a single axis or two.
pub const PLAIN: Body = Body {
    shape: Shape::Ball,
    scale: 1.0,
    offset: 0.0,
    extinction: 16.0,
    order: 4,
    samples: 300,
    ior: 1.0,
    uneven: false,
};

impl Body {
    /// A name that says what differs from [`PLAIN`].
    pub fn name(&self) -> String {
        let mut words = vec![format!("{:?}", self.shape).to_lowercase()];
        let mut word = |differs: bool, text: String| words.extend(differs.then_some(text));
        word(self.scale != PLAIN.scale, format!("scale-{:e}", self.scale));
        word(self.offset != PLAIN.offset, format!("offset-{:e}", self.offset));
        word(self.extinction != PLAIN.extinction, format!("extinction-{:e}", self.extinction));
        word(self.order != PLAIN.order, format!("order-{}", self.order));
        word(self.samples != PLAIN.samples, format!("samples-{}", self.samples));
        word(self.ior != PLAIN.ior, format!("ior-{}", self.ior));
        word(self.uneven, "uneven".to_owned());
        words.join(" ")
    }
}

/// One case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Albedo and phase.
    pub scattering: Scattering,
    /// Lights.
    pub lights: Lights,
    /// Camera.
    pub view: View,
}

impl Cell {
    /// A name of it within its body.
    pub fn name(&self) -> String {
        let Scattering { albedo, g } = self.scattering;
        format!("albedo {albedo} g {g} light {:?} view {:?}", self.lights, self.view)
    }
}

/// Bodies with their cells.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Each body once.
    pub bodies: Vec<(Body, Vec<Cell>)>,
}

/// Cells of every body that is not plain: every light twice.
const EACH: usize = 2 * LIGHTS.len();

impl Plan {
    /// The whole matrix.
    pub fn full() -> Self {
        let mut bodies = vec![(PLAIN, all_cells())];
        bodies.extend(others().into_iter().enumerate().map(|(b, body)| (body, some_cells(b, EACH))));
        Self { bodies }
    }

    /// A part of the matrix that holds both ends of every axis except the most samples.
    pub fn subset() -> Self {
        let all = others();
        let mut chosen = vec![PLAIN];
        let extreme = |body: &&Body| {
            let one = [body.scale, body.offset].iter().zip([1.0, 0.0]).all(|(a, b)| *a == b);
            let both = body.offset != 0.0 && [1e-6, 1e6].contains(&body.scale) && body.extinction == 16.0;
            let ends = [0.0, 1e-6, 1.0, 1e6].contains(&body.extinction) || body.extinction == 16.0;
            (one && ends && [1, 4, 10].contains(&body.order) && body.samples <= 300) || both
        };
        chosen.extend(all.iter().filter(extreme));
        let bodies = chosen.into_iter().enumerate().map(|(b, body)| (body, some_cells(b, LIGHTS.len())));
        Self { bodies: bodies.collect() }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.bodies.iter().map(|(_, cells)| cells.len()).sum()
    }

    /// Keeps the cells whose body's and own name, joined by ": ", hold `text`.
    pub fn filter(&mut self, text: &str) {
        for (body, cells) in &mut self.bodies {
            let name = body.name();
            cells.retain(|cell| format!("{name}: {}", cell.name()).contains(text));
        }
        self.bodies.retain(|(_, cells)| !cells.is_empty());
    }
}

fn all_cells() -> Vec<Cell> {
    let mut cells = Vec::new();
    for scattering in SCATTERINGS {
        for lights in LIGHTS {
            cells.extend(VIEWS.map(|view| Cell { scattering, lights, view }));
        }
    }
    cells
}

/// `count` cells of body number `b`: the lights in turn, with views and scatterings that move on from body to body.
fn some_cells(b: usize, count: usize) -> Vec<Cell> {
    let cell = |k: usize| Cell {
        lights: LIGHTS[k % LIGHTS.len()],
        view: VIEWS[(k + 3 * b + k / LIGHTS.len()) % VIEWS.len()],
        scattering: SCATTERINGS[(k + b + k / LIGHTS.len()) % SCATTERINGS.len()],
    };
    (0..count).map(cell).collect()
}

/// All bodies but the plain one.
fn others() -> Vec<Body> {
    let mut bodies = Vec::new();
    for scale in SCALES {
        for offset in OFFSETS {
            bodies.extend(EXTINCTIONS.map(|extinction| Body { scale, offset, extinction, ..PLAIN }));
        }
    }
    for shape in SHAPES {
        bodies.extend([1e-6, 16.0, 1e6].map(|extinction| Body { shape, extinction, ..PLAIN }));
        bodies.push(Body { shape, scale: 1e-6, offset: 1e4, ..PLAIN });
        bodies.push(Body { shape, scale: 1e6, offset: 1e4, ..PLAIN });
    }
    bodies.extend(ORDERS.map(|order| Body { order, ..PLAIN }));
    bodies.extend(SAMPLES.map(|samples| Body { samples, ..PLAIN }));
    bodies.push(Body { samples: 1, shape: Shape::Ring, extinction: 1.0, ..PLAIN });
    bodies.push(Body { samples: 2, shape: Shape::Box, extinction: 1e3, ..PLAIN });
    bodies.push(Body { samples: MOST_SAMPLES, order: 1, ..PLAIN });
    for extinction in [1e-6, 16.0, 1e6] {
        bodies.push(Body { ior: 1.5, extinction, ..PLAIN });
        bodies.push(Body { uneven: true, extinction, ..PLAIN });
    }
    bodies.retain(|body| *body != PLAIN);
    bodies
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn the_matrix_is_large_and_its_names_are_unique() {
        let full = Plan::full();
        assert!(full.cells() >= 2_000, "{}", full.cells());
        let subset = Plan::subset().cells();
        assert!((200..600).contains(&subset), "{subset}");
        let names: HashSet<String> = full.bodies.iter().map(|(body, _)| body.name()).collect();
        assert_eq!(names.len(), full.bodies.len());
    }

    #[test]
    fn every_body_meets_every_light_view_and_scattering() {
        for (body, cells) in Plan::full().bodies {
            let count = |same: &dyn Fn(&Cell) -> bool| cells.iter().filter(|c| same(c)).count();
            assert!(LIGHTS.iter().all(|l| count(&|c| c.lights == *l) >= 2), "{}", body.name());
            assert!(VIEWS.iter().all(|v| count(&|c| c.view == *v) >= 2), "{}", body.name());
            assert!(SCATTERINGS.iter().all(|s| count(&|c| c.scattering == *s) >= 2), "{}", body.name());
        }
    }

    #[test]
    fn the_filter_keeps_what_it_names() {
        let mut plan = Plan::full();
        plan.filter("ring: albedo 1 g 0 ");
        assert_eq!(plan.bodies.len(), 1);
        assert!(plan.cells() > 0 && plan.cells() < EACH);
    }
}
