//! Rivals against closed forms and against the reference: a comparison is only worth what its other side is.

mod support;
#[path = "support/workbench.rs"]
mod workbench;

use diaphane_formats::asset::Asset;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::kernel::sharpness;
use diaphane_formats::material::parse_material;
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::{Mesh, parse_obj};
use diaphane_formats::picture::Picture;
use diaphane_runtime::cpu::segments;
use diaphane_runtime::frame::Frame;
use glam::Vec3;
use std::path::Path;
use validation::metrics::compare;
use validation::reference::{Settings, render};
use validation::rivals::grid::{self, Blend, Grid};
use validation::rivals::march::{Light, March};
use validation::rivals::object::Object;
use validation::rivals::shadows::Shadows;
use validation::rivals::thesis::Thesis;

const LAYERS: &str =
    "\n[density]\ntype = \"layers\"\naxis = [0.6, 0.8, 0.0]\nperiod = 0.5\ndensities = [1.0, 0.2]\n";

fn medium(more: &str) -> Medium {
    parse_material(&format!("{}{more}", workbench::MATERIAL), Path::new(".")).unwrap()
}

fn ball() -> Mesh {
    parse_obj(diaphane_assets::shapes::icosphere(1.0, 2).to_obj().as_bytes()).unwrap().0
}

/// The same light everywhere, attenuated by nothing.
struct Constant;

impl Light for Constant {
    type Memory = ();
    fn enter(&self, _: Vec3, _: &mut ()) {}
    fn arriving(&self, _: Vec3, _: Vec3, _: f32, _: &mut ()) -> Vec3 {
        Vec3::ONE
    }
}

const SUN: &str = "[camera]\nposition = [1.3, 1.6, 4.6]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 30\n[image]\n\
                   width = 24\nheight = 20\nsamples_per_pixel = 1\n[surface]\nreflection = false\n[[lights]]\n\
                   type = \"directional\"\ndirection = [0, 0, -1]\nirradiance = [1, 2, 3]\n";

/// Radiance of every pixel's one ray under [`Constant`] light, by the player's own closed form of what a ray emits.
fn emitted(object: &Object<'_>, frame: &Frame) -> Vec<Vec3> {
    let mut scratch = segments::Scratch::default();
    let per_light =
        object.medium.albedo().as_vec3() * Vec3::new(1.0, 2.0, 3.0) / (4.0 * std::f32::consts::PI);
    (0..frame.width * frame.height)
        .map(|i| {
            let (x, y) = ((i % frame.width) as f32 + 0.5, (i / frame.width) as f32 + 0.5);
            let direction = frame.view.direction(x, y, frame.width, frame.height);
            let origin = frame.view.origin;
            let found = segments::trace(&object.accel, 1.0, origin, direction, &mut scratch);
            let mut sum = Vec3::ZERO;
            for p in found.pieces() {
                sum += object.ray_medium().along(origin, direction, p.start, p.end).emission(p.start, p.end);
            }
            sum * per_light
        })
        .collect()
}

fn largest_error(picture: &Picture, exact: &[Vec3]) -> f32 {
    let most = exact.iter().fold(0.0f32, |m, v| m.max(v.max_element()));
    assert!(most > 1e-9);
    picture
        .pixels
        .iter()
        .zip(exact)
        .fold(0.0f32, |m, (p, e)| m.max((Vec3::from(*p) - *e).abs().max_element()))
        / most
}

#[test]
fn constant_light_is_exact_whatever_the_steps() {
    let mesh = ball();
    for more in ["", LAYERS] {
        let medium = medium(more);
        let asset = workbench::small_asset(&medium, 60);
        let object = Object::new(&mesh, &medium, &asset).unwrap();
        let frame = Frame::new(&support::scene(SUN), &asset.info).unwrap();
        let exact = emitted(&object, &frame);
        for steps in [1, 3, 50] {
            let picture = March { object: &object, steps, light: &Constant }.draw(&frame);
            let error = largest_error(&picture, &exact);
            assert!(error < 1e-4, "{more} {steps}: {error}");
        }
    }
}

/// Relative error of a march against the reference.
fn error<L: Light>(march: &March<'_, L>, frame: &Frame, reference: &Picture) -> f64 {
    let coverage = reference.coverage.clone().unwrap();
    compare(&march.draw(frame), reference, &coverage).unwrap().rel_rmse
}

#[test]
fn marching_converges_to_the_reference() {
    let mesh = ball();
    for (more, limit) in [("", 0.012), (LAYERS, 0.03)] {
        let medium = medium(more);
        let scene = support::scene(workbench::SCENE);
        let asset: Asset = workbench::small_asset(&medium, 60);
        let object = Object::new(&mesh, &medium, &asset).unwrap();
        let frame = Frame::new(&scene, &asset.info).unwrap();
        let settings = Settings { tolerance: 0.008, ..Settings::default() };
        let reference = render(&mesh, &medium, &scene, &settings, &|_| ()).unwrap().picture;
        let light = Shadows::new(&object);
        let of = |steps: usize| error(&March { object: &object, steps, light: &light }, &frame, &reference);
        let (one, four, many) = (of(1), of(4), of(24));
        // 24 steps leave the reference's own noise (and, in layers, the density grid that the player sees).
        assert!(many < limit && four < one && many <= 1.2 * four, "{one} {four} {many}");
    }
}

fn fit(object: &Object<'_>, nodes: usize, order: usize) -> Grid {
    let settings = grid::Settings { nodes, order, encoding: Encoding::RECIPROCAL, directions: 96 };
    Grid::new(object, settings).unwrap()
}

#[test]
fn a_grid_of_constant_light_is_exact() {
    // A medium so thin that ψ = 1 everywhere.
    let thin =
        "extinction = [3e-6, 2e-6, 1e-6]\nalbedo = [0.8, 0.7, 0.6]\nphase = { type = \"isotropic\" }\n";
    let (mesh, medium) = (ball(), parse_material(thin, Path::new(".")).unwrap());
    let asset = workbench::small_asset(&medium, 60);
    let object = Object::new(&mesh, &medium, &asset).unwrap();
    let frame = Frame::new(&support::scene(SUN), &asset.info).unwrap();
    let exact = emitted(&object, &frame);
    for nodes in [8, 100] {
        let mut grid = fit(&object, nodes, 3);
        assert!(grid.stored <= nodes && grid.stored > nodes / 4, "{} of {nodes}", grid.stored);
        for blend in [Blend::Values, Blend::Logarithms] {
            grid.blend = blend;
            let picture = March { object: &object, steps: 2, light: &grid }.draw(&frame);
            let error = largest_error(&picture, &exact);
            assert!(error < 1e-3, "{nodes} {blend:?}: {error}");
        }
    }
}

#[test]
fn more_nodes_are_better() {
    let (mesh, medium) = (ball(), medium(""));
    let scene = support::scene(workbench::SCENE);
    let asset = workbench::small_asset(&medium, 60);
    let object = Object::new(&mesh, &medium, &asset).unwrap();
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let light = Shadows::new(&object);
    let mut exact = March { object: &object, steps: 8, light: &light }.draw(&frame);
    let coverage = exact.pixels.iter().map(|p| f32::from(u8::from(p[0] > 0.0))).collect();
    exact.coverage = Some(coverage);
    let of = |nodes: usize| {
        let grid = fit(&object, nodes, 6);
        error(&March { object: &object, steps: 8, light: &grid }, &frame, &exact)
    };
    let (few, many) = (of(30), of(1500));
    assert!(many < 0.1 && many < 0.3 * few, "{few} {many}");
}

#[test]
fn the_recipe_is_the_sum_over_all_samples() {
    let (mesh, medium) = (ball(), medium(""));
    let asset = workbench::small_asset(&medium, 150);
    let object = Object::new(&mesh, &medium, &asset).unwrap();
    let frame = Frame::new(&support::scene(SUN), &asset.info).unwrap();
    let thesis = Thesis::new(&object, &asset, 64);
    let sources = thesis.sources(&frame);
    let factor = 1.1;
    let drawn = thesis.splat(&frame, &sources, factor).picture;
    let mut scratch = segments::Scratch::default();
    let mut seen = 0;
    for i in 0..frame.width * frame.height {
        let (x, y) = ((i % frame.width) as f32 + 0.5, (i / frame.width) as f32 + 0.5);
        let direction = frame.view.direction(x, y, frame.width, frame.height);
        let hit = segments::trace(&object.accel, 1.0, frame.view.origin, direction, &mut scratch).count > 0;
        let mut sum = Vec3::ZERO;
        for k in (0..asset.samples.len()).filter(|_| hit) {
            let a = sharpness(asset.samples.position_radius[k][3], factor);
            let to = asset.samples.position(k) - frame.view.origin;
            let x = a * a * to.cross(direction).length_squared();
            // Cut where the kernel falls to 1e-6.
            if x < 6.0 * std::f32::consts::LN_10 {
                sum += sources[k] * (std::f32::consts::PI.sqrt() / a * (-x).exp());
            }
        }
        seen += usize::from(hit);
        let error = (Vec3::from(drawn.pixels[i as usize]) - sum).length();
        assert!(error <= 1e-4 * sum.length() + 1e-7, "{i}: {error} of {sum}");
    }
    assert!(seen > 50);
}
