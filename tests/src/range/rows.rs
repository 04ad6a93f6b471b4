//! The table's rows.

use super::lights::Lights;
use super::materials::{Field, Material};
use super::objects::{Object, Placed};
use super::views::View;
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::{ImageSize, Scene, Surface};

/// What is baked: rows that share it share the bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// The mesh.
    pub object: Object,
    /// The material as far as a bake depends on it.
    pub material: Material,
}

/// One case.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Unique name of words joined by hyphens.
    pub name: String,
    /// The mesh.
    pub object: Object,
    /// What fills it.
    pub material: Material,
    /// Where the camera stands.
    pub view: View,
    /// What lights it.
    pub lights: Lights,
}

/// Extinction times diagonal from here on is reported but not judged: the mean free path is far shorter than any
/// spacing of samples that a bake can afford.
pub const UNJUDGED_EXTINCTION: f64 = 256.0;

/// Sub-pixel rays of the player.
const SAMPLES_PER_PIXEL: u32 = 9;

impl Row {
    /// What has to be baked for it.
    pub fn body(&self) -> Body {
        Body { object: self.object, material: self.material.baked() }
    }

    /// Whether its error counts.
    pub fn is_judged(&self) -> bool {
        self.material.extinction.iter().all(|e| *e < UNJUDGED_EXTINCTION)
    }

    /// The scene for a picture of `size` × `size` pixels.
    pub fn scene(&self, placed: &Placed, size: u32) -> Scene {
        let mut scene = Scene {
            camera: self.view.camera(placed),
            image: ImageSize { width: size, height: size, samples_per_pixel: SAMPLES_PER_PIXEL },
            surface: Surface { reflection: false, specular: 0.5, roughness: 0.3 },
            environment: None,
            lights: Vec::new(),
            exact: Vec::new(),
        };
        self.lights.place(placed, &mut scene);
        scene
    }
}

/// The whole table. Rows that share a bake need not stand together.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for object in [Object::Bird, Object::Torus, Object::Cube] {
        for extinction in [1.0, 4.0, 16.0, 64.0, 256.0] {
            let name = format!("extinction-{extinction}-{}", object.name());
            rows.push(Row { name, object, ..base(Material::grey(extinction)) });
        }
    }
    rows.extend(media());
    rows.extend(lights());
    rows.extend(views());
    rows
}

/// The bird lit from the side: what most rows change one thing of.
fn base(material: Material) -> Row {
    Row { name: String::new(), object: Object::Bird, material, view: View::Whole, lights: Lights::Side }
}

/// The base at a middling extinction.
const MIDDLE: Material = Material::grey(16.0);

fn media() -> Vec<Row> {
    let row = |name: &str, material: Material| Row { name: name.to_owned(), ..base(material) };
    let forward = |g: f64| Material { phase: Phase::HenyeyGreenstein { g }, ..MIDDLE };
    let grey = |albedo: f64| Material { albedo: [albedo; 3], ..MIDDLE };
    let filled = |extinction: f64, field: Field| Material { field, ..Material::grey(extinction) };
    vec![
        row("albedo-0.05", grey(0.05)),
        row("albedo-0.5", grey(0.5)),
        row("albedo-0.99", grey(0.99)),
        row("albedo-rgb", Material { albedo: [0.95, 0.5, 0.1], ..MIDDLE }),
        row("extinction-rgb-4-16-64", Material { extinction: [4.0, 16.0, 64.0], ..MIDDLE }),
        row("phase-g-0.5-backward", forward(-0.5)),
        row("phase-g-0.5", forward(0.5)),
        row("phase-g-0.9", forward(0.9)),
        Row { lights: Lights::Back, ..row("phase-g-0.9-back", forward(0.9)) },
        row("ior-1.3", Material { ior: 1.3, ..MIDDLE }),
        row("ior-1.5", Material { ior: 1.5, ..MIDDLE }),
        Row { object: Object::Cube, ..row("layers-cube", filled(24.0, Field::Layers)) },
        row("noise-bird", filled(16.0, Field::Noise)),
        Row {
            object: Object::Cube,
            lights: Lights::Back,
            ..row("absorbing-ring-cube", filled(4.0, Field::Ring))
        },
        Row { object: Object::Torus, ..row("grid-torus", filled(12.0, Field::Grid)) },
    ]
}

fn lights() -> Vec<Row> {
    let row = |name: &str, lights: Lights| Row { name: name.to_owned(), lights, ..base(MIDDLE) };
    vec![
        row("light-at-0.05", Lights::At(0.05)),
        row("light-at-0.5", Lights::At(0.5)),
        row("light-at-50", Lights::At(50.0)),
        Row { object: Object::Torus, ..row("light-at-0.05-torus", Lights::At(0.05)) },
        row("lights-8", Lights::Many(8)),
        row("lights-64", Lights::Many(64)),
        row("light-spot", Lights::Spot),
        row("light-directional", Lights::Directional),
        row("light-environment", Lights::Environment),
    ]
}

fn views() -> Vec<Row> {
    let mut rows = Vec::new();
    for object in [Object::Bird, Object::Torus, Object::Cube] {
        for (name, lights) in [("front", Lights::Front), ("back", Lights::Back)] {
            let name = format!("lit-{name}-{}", object.name());
            rows.push(Row { name, object, lights, ..base(MIDDLE) });
        }
    }
    let row =
        |name: &str, material: Material, view: View| Row { name: name.to_owned(), view, ..base(material) };
    rows.extend([
        Row { lights: Lights::Back, ..row("lit-back-bird-64", Material::grey(64.0), View::Whole) },
        row("camera-inside-4", Material::grey(4.0), View::Inside),
        row("camera-inside-16", MIDDLE, View::Inside),
        row("camera-near", MIDDLE, View::Near),
        Row { lights: Lights::Back, ..row("camera-near-back", MIDDLE, View::Near) },
        Row { object: Object::Torus, ..row("camera-inside-4-torus", Material::grey(4.0), View::Inside) },
    ]);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_are_unique_and_bakes_are_shared() {
        let rows = rows();
        let names: HashSet<&str> = rows.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names.len(), rows.len());
        let mut bodies: Vec<Body> = Vec::new();
        rows.iter().map(Row::body).for_each(|b| {
            if !bodies.contains(&b) {
                bodies.push(b);
            }
        });
        assert!(2 * bodies.len() < rows.len() + 1, "{} bakes for {} rows", bodies.len(), rows.len());
        assert_eq!(rows.iter().filter(|r| !r.is_judged()).count(), 3);
    }

    #[test]
    fn scenes_are_lit_and_make_rays() {
        let placed = [Object::Bird, Object::Torus, Object::Cube].map(|o| o.place().unwrap());
        for row in rows() {
            let object = placed.iter().find(|p| p.object == row.object).unwrap();
            let scene = row.scene(object, 16);
            assert!(scene.ray_frame().is_ok(), "{}", row.name);
            assert!(!scene.lights.is_empty() || scene.environment.is_some(), "{}", row.name);
        }
    }
}
