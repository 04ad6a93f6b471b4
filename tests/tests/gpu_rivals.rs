//! The rivals on the GPU against shadow rays in double precision on the CPU. Without an adapter the tests say "skipped" and
//! pass, unless DIAPHANE_REQUIRE_GPU=1 asks them to fail.

mod support;
#[path = "support/workbench.rs"]
mod workbench;

use diaphane_formats::asset::Asset;
use diaphane_formats::material::parse_material;
use diaphane_formats::picture::Picture;
use diaphane_runtime::Error;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::rivals::{Rivals, Settings};
use std::path::Path;
use validation::metrics::compare;
use validation::rivals::march::March;
use validation::rivals::object::Object;
use validation::rivals::shadows::Shadows;

const FORWARD: &str = "extinction = [3, 2, 1]\nalbedo = [0.8, 0.7, 0.6]\n\
                       phase = { type = \"henyey-greenstein\", g = 0.4 }\n";
const LAYERS: &str =
    "\n[density]\ntype = \"layers\"\naxis = [0.6, 0.8, 0.0]\nperiod = 0.5\ndensities = [1.0, 0.2]\n";

const VIEW: &str = "[camera]\nposition = [1.3, 1.6, 4.6]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 30\n[image]\n\
                    width = 40\nheight = 32\nsamples_per_pixel = 1\n[surface]\nreflection = false\n";
/// Light of every kind.
const LIGHTS: &str = "[[lights]]\ntype = \"point\"\nposition = [3, 1, 1]\nintensity = [30, 20, 10]\n\
                      [[lights]]\ntype = \"directional\"\ndirection = [0.3, -1, 0.2]\nirradiance = [1, 2, 3]\n\
                      [[lights]]\ntype = \"spot\"\nposition = [-2, 2, 2]\ndirection = [1, -1, -1]\n\
                      intensity = [9, 9, 9]\ninner_degrees = 5\nouter_degrees = 9\n";
const WITHIN: &str =
    "[[lights]]\ntype = \"point\"\nposition = [0.2, 0.1, 0.1]\nintensity = [0.3, 0.2, 0.5]\n";

/// The rivals, or `None` after saying why.
fn rivals(asset: &Asset) -> Option<Rivals> {
    match Rivals::new(asset) {
        Ok(rivals) => Some(rivals),
        Err(e @ Error::NoAdapter(_)) if std::env::var_os("DIAPHANE_REQUIRE_GPU").is_none_or(|v| v != "1") => {
            support::tell(&format!("skipped: no adapter ({e})"));
            None
        }
        Err(e) => panic!("{e}"),
    }
}

fn asset(material: &str) -> Asset {
    workbench::small_asset(&parse_material(material, Path::new(".")).unwrap(), 60)
}

/// By shadow rays in f64 through what the asset carries.
fn truth(asset: &Asset, frame: &Frame, steps: usize) -> Picture {
    let (mesh, medium) = (asset.mesh().unwrap(), asset.medium().unwrap());
    let object = Object::new(&mesh, &medium, asset).unwrap();
    March { object: &object, steps, light: &Shadows::new(&object) }.draw(frame)
}

fn error(picture: &Picture, truth: &Picture) -> f64 {
    compare(picture, truth, picture.coverage.as_ref().unwrap()).unwrap().rel_rmse
}

/// Errors of marches of so many steps, and of one that takes the same points as the truth; the last is under all lights and one
/// more within the object.
fn marched(asset: &Asset, rivals: &Rivals, stride: f32, steps: &[u32], exact: usize) -> (Vec<f64>, f64) {
    let draw = |frame: &Frame, steps| {
        let drawn = rivals.march(frame, Settings { steps, stride }).unwrap();
        assert!(drawn.picture.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        drawn.picture
    };
    let frame = |parts: &[&str]| Frame::new(&support::scene(&parts.concat()), &asset.info).unwrap();
    let all = frame(&[VIEW, LIGHTS, WITHIN]);
    let same = error(&draw(&all, 24), &truth(asset, &all, 24));
    let frame = frame(&[VIEW, LIGHTS]);
    let truth = truth(asset, &frame, exact);
    (steps.iter().map(|n| error(&draw(&frame, *n), &truth)).collect(), same)
}

#[test]
fn marches_agree_with_shadow_rays_in_double_precision() {
    let asset = asset(FORWARD);
    let Some(rivals) = rivals(&asset) else { return };
    let (errors, same) = marched(&asset, &rivals, 1.0, &[4, 8, 16, 32, 256], 512);
    // Measured: 1.2e-6, then 2.3e-2, 9.6e-3, 4.3e-3, 1.9e-3, 7e-5. A spot's edge keeps steps from converging faster than
    // with their number.
    assert!(same < 1e-5, "{same}");
    assert!(errors[4] < 1e-3 && errors.windows(2).all(|e| e[1] < 0.6 * e[0]), "{errors:?}");
}

#[test]
fn marches_through_a_density_grid_agree() {
    let asset = asset(&format!("{FORWARD}{LAYERS}"));
    let Some(rivals) = rivals(&asset) else { return };
    let (errors, same) = marched(&asset, &rivals, 0.5, &[8, 64], 64);
    // The CPU's camera rays see the density through 32 cells a piece, the GPU's through lookups every half voxel, and layers
    // have edges: measured 2.7e-3 and 1.1e-3.
    assert!(same < 4e-3 && errors[1] < 3e-3 && errors[1] < 0.5 * errors[0], "{same} {errors:?}");
}

#[test]
fn grids_approach_the_march() {
    let asset = asset(FORWARD);
    let Some(mut rivals) = rivals(&asset) else { return };
    let frame = Frame::new(&support::scene(&[VIEW, LIGHTS].concat()), &asset.info).unwrap();
    let settings = Settings { steps: 64, stride: 1.0 };
    assert!(rivals.grid(&frame, settings).unwrap_err().to_string().contains("no grid"));
    let truth = rivals.march(&frame, settings).unwrap().picture;
    let errors = [8, 16, 32, 64].map(|side| {
        let lit = rivals.set_grid(side).unwrap();
        assert!(lit as u32 <= side.pow(3) && lit > 8);
        error(&rivals.grid(&frame, settings).unwrap().picture, &truth)
    });
    // Measured: 0.13, 0.045, 0.014, 0.005. Every node that a march looks up was lit, or pixels would be dark.
    assert!(errors.windows(2).all(|e| e[1] < 0.5 * e[0]) && errors[3] < 0.01, "{errors:?}");
}

#[test]
fn what_the_rivals_do_not_know_is_refused_in_one_line() {
    let refused = Rivals::new(&asset(&format!("{FORWARD}ior = 1.3\n"))).err().unwrap().to_string();
    assert!(refused.contains("ior is not 1") && refused.lines().count() == 1, "{refused}");
    let mut overlapping = asset(FORWARD);
    overlapping.info.provenance.mesh_report.mending.overlapping = 1;
    assert!(Rivals::new(&overlapping).err().unwrap().to_string().contains("overlapping shells"));
}
