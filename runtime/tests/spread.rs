//! Exact depths spread over frames: the picture goes from baked to exact light without a jump, and back.

mod support;

use diaphane_formats::asset::Asset;
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::Light;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::exact::Settings;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{GpuDevice, instance};
use diaphane_runtime::player::{Backend, LightMode, Player};
use diaphane_runtime::rendered::Rendered;
use glam::DVec3;
use support::{ball, point, scene};

const HERE: DVec3 = DVec3::new(3.0, 1.0, -2.0);
const SETTINGS: Settings = Settings { milliseconds: 1e3, rest_frames: 2, fade_frames: 16, memory: 64 << 20 };

fn frame(asset: &Asset, lights: Vec<Light>) -> Frame {
    Frame::new(&scene(HERE, 24, 1, lights), &asset.info).unwrap()
}

fn one_light(asset: &Asset, x: f64) -> Frame {
    frame(asset, vec![point(HERE, DVec3::new(x, 1.0, 1.0), 30.0)])
}

fn player(asset: &Asset, backend: Backend, settings: Option<Settings>) -> Player {
    let mut player = Player::new(asset, backend).unwrap();
    player.set_reuse(true);
    player.spread(asset, settings).unwrap();
    player
}

/// sqrt(Σ (a - b)²) over pixels and channels.
fn apart(a: &Rendered, b: &Rendered) -> f64 {
    let pixels = |r: &Rendered| r.picture.pixels.concat();
    pixels(a).iter().zip(pixels(b)).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt()
}

/// Frames until nothing changes any more, the last one included.
fn settle(player: &mut Player, frame: &Frame, mode: LightMode) -> Vec<Rendered> {
    let mut all = vec![player.render(frame, mode).unwrap()];
    while player.is_busy() {
        assert!(all.len() < 200, "it never settles");
        all.push(player.render(frame, mode).unwrap());
    }
    all
}

fn fades_without_a_jump(backend: Backend) {
    let asset = ball(0.12, HERE, Phase::HenyeyGreenstein { g: 0.3 });
    let here = one_light(&asset, 3.0);
    let at_once = |mode| player(&asset, backend, None).render(&here, mode).unwrap();
    let (baked, exact) = (at_once(LightMode::Baked), at_once(LightMode::Exact));
    let whole = apart(&baked, &exact);
    assert!(whole > 0.0, "there is nothing to fade");
    let mut player = player(&asset, backend, Some(SETTINGS));
    let shown = settle(&mut player, &here, LightMode::Auto);
    assert_eq!(shown[0].picture, baked.picture);
    assert_eq!(shown[shown.len() - 1].picture, exact.picture);
    let report = &shown[shown.len() - 1].exact;
    assert_eq!((report.exact, report.fading, report.baked), (1, 0, 0));
    assert!(report.errors[0].relative > 0.005 && report.errors[0].relative < 0.3, "{:?}", report.errors);
    for (k, pair) in shown.windows(2).enumerate() {
        let step = apart(&pair[0], &pair[1]);
        assert!(step <= whole / 8.0, "frame {k}: a step of {step} of {whole}");
        // Ever nearer to the exact picture.
        assert!(apart(&pair[1], &exact) <= apart(&pair[0], &exact) + 1e-6 * whole, "frame {k}");
    }
    // It moves a little and stays: the picture goes to the baked one there, and on to the exact one.
    let near = one_light(&asset, 3.001);
    let moved = settle(&mut player, &near, LightMode::Auto);
    let all: Vec<&Rendered> = shown.last().into_iter().chain(&moved).collect();
    for (k, pair) in all.windows(2).enumerate() {
        let step = apart(pair[0], pair[1]);
        assert!(step <= whole / 8.0, "frame {k} after the move: a step of {step} of {whole}");
    }
    let baked_there = Player::new(&asset, backend).unwrap().render(&near, LightMode::Baked).unwrap();
    assert!(moved.iter().any(|r| apart(r, &baked_there) < 1e-3 * whole), "baked light served meanwhile");
    let exact_there = Player::new(&asset, backend).unwrap().render(&near, LightMode::Exact).unwrap();
    assert_eq!(moved[moved.len() - 1].picture, exact_there.picture);
}

#[test]
fn pictures_fade_without_a_jump() {
    fades_without_a_jump(Backend::Cpu);
}

#[test]
fn pictures_fade_without_a_jump_on_a_gpu() {
    if let Err(e) = GpuDevice::open(&instance(), None) {
        let required = std::env::var_os("DIAPHANE_REQUIRE_GPU").is_some_and(|v| v == "1");
        assert!(!required, "a GPU is required here: {e}");
        return eprintln!("skipped: no adapter ({e})");
    }
    fades_without_a_jump(Backend::Gpu);
}

#[test]
fn backends_agree_while_lights_fade() {
    if GpuDevice::open(&instance(), None).is_err() {
        return;
    }
    let asset = ball(0.15, HERE, Phase::Isotropic);
    // Forty suns are folded but for those that are marked; a point light is not.
    let sun = |d: DVec3| Light::Directional { direction: d, irradiance: DVec3::splat(0.05) };
    let directions = diaphane_formats::directions::even_directions(40, 2);
    let mut lights: Vec<Light> = directions.into_iter().map(sun).collect();
    lights.push(point(HERE, DVec3::new(2.0, 1.0, 2.0), 10.0));
    let mut scene = scene(HERE, 24, 1, lights);
    scene.mark_exact(3, true);
    scene.mark_exact(7, true);
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let settings = Some(Settings { fade_frames: 4, ..SETTINGS });
    let [mut cpu, mut gpu] = [Backend::Cpu, Backend::Gpu].map(|b| player(&asset, b, settings));
    let mut fading = 0;
    for _ in 0..12 {
        let [a, b] = [&mut cpu, &mut gpu].map(|p| p.render(&frame, LightMode::Auto).unwrap());
        let size = a.picture.pixels.concat().iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
        assert!(apart(&a, &b) < 1e-3 * size, "{} of {size}", apart(&a, &b));
        assert_eq!((a.exact.exact, a.exact.fading), (b.exact.exact, b.exact.fading));
        fading += usize::from(a.exact.fading > 0);
        assert_eq!(a.lights.folded, b.lights.folded);
    }
    assert!(fading > 2 && !cpu.is_busy() && !gpu.is_busy());
}

#[test]
fn suns_leave_the_folded_ones_without_a_jump() {
    let asset = ball(0.15, HERE, Phase::Isotropic);
    let directions = diaphane_formats::directions::even_directions(40, 2);
    let sun = |d: DVec3| Light::Directional { direction: d, irradiance: DVec3::splat(0.05) };
    let mut scene = scene(HERE, 24, 1, directions.into_iter().map(sun).collect());
    scene.mark_exact(5, true);
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let shown = settle(&mut player(&asset, Backend::Cpu, Some(SETTINGS)), &frame, LightMode::Auto);
    let (first, last) = (&shown[0], &shown[shown.len() - 1]);
    assert_eq!((first.lights.folded, last.lights.folded, last.lights.single), (40, 39, 1));
    let whole = apart(first, last);
    for pair in shown.windows(2) {
        assert!(apart(&pair[0], &pair[1]) <= whole / 8.0 + 1e-6, "{} of {whole}", apart(&pair[0], &pair[1]));
    }
}

#[test]
fn the_material_may_change_meanwhile() {
    let asset = ball(0.15, HERE, Phase::Isotropic);
    let here = one_light(&asset, 3.0);
    let edit = Edit { extinction_scale: DVec3::new(0.5, 1.0, 2.0), albedo: None };
    let mut player = player(&asset, Backend::Cpu, Some(SETTINGS));
    (0..8).for_each(|_| drop(player.render(&here, LightMode::Auto).unwrap()));
    player.edit(&edit).unwrap();
    let shown = settle(&mut player, &here, LightMode::Auto);
    let mut plain = Player::new(&asset, Backend::Cpu).unwrap();
    plain.edit(&edit).unwrap();
    let exact = plain.render(&here, LightMode::Exact).unwrap();
    assert_eq!(shown[shown.len() - 1].picture, exact.picture);
    // A light that leaves goes on from there: the first step is no larger than any other.
    let baked = plain.render(&here, LightMode::Baked).unwrap();
    let near = one_light(&asset, 3.0005);
    let first = player.render(&near, LightMode::Auto).unwrap();
    assert!(apart(&first, &exact) <= apart(&baked, &exact) / 8.0);
}

#[test]
fn the_error_of_baked_light_is_told_for_lights_traced_at_once() {
    let asset = ball(0.12, HERE, Phase::Isotropic);
    let here = one_light(&asset, 3.0);
    let mut at_once = Player::new(&asset, Backend::Cpu).unwrap();
    let rendered = at_once.render(&here, LightMode::Exact).unwrap();
    let spread = settle(&mut player(&asset, Backend::Cpu, Some(SETTINGS)), &here, LightMode::Exact);
    let (some, all) = (rendered.exact.worst(), spread[spread.len() - 1].exact.worst());
    // One tells it from a sixteenth of the samples.
    assert!(all > 0.0 && (some / all - 1.0).abs() < 0.3, "{some} {all}");
    assert_eq!(rendered.exact.rays, asset.samples.len() as u64);
    let baked = at_once.render(&here, LightMode::Baked).unwrap();
    assert_eq!((baked.exact.exact, baked.exact.baked, baked.exact.errors.len()), (0, 1, 0));
}

#[test]
fn marked_lights_are_exact_in_a_single_picture() {
    let asset = ball(0.2, HERE, Phase::Isotropic);
    let lights =
        vec![point(HERE, DVec3::new(3.0, 1.0, 1.0), 30.0), point(HERE, DVec3::new(-3.0, 1.0, 1.0), 30.0)];
    let mut scene = scene(HERE, 16, 1, lights);
    scene.mark_exact(1, true);
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let rendered = Player::new(&asset, Backend::Cpu).unwrap().render(&frame, LightMode::Auto).unwrap();
    assert_eq!(rendered.exact.errors.iter().map(|e| e.light).collect::<Vec<_>>(), [1]);
}
