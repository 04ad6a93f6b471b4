//! The GPU against its CPU twin, on synthetic assets. Without an adapter the tests say "skipped" and pass, unless
//! DIAPHANE_REQUIRE_GPU=1 asks them to fail.

mod census;
mod edits;
mod endurance;
mod exact;
mod faults;
mod frames;
mod host;
mod objects;
mod scenes;
mod shards;
mod side_by_side;
mod together;

use diaphane_formats::asset::Asset;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::Light;
use diaphane_runtime::Error;
use diaphane_runtime::cpu::CpuRenderer;
use diaphane_runtime::exact::{DepthTracer, ExactDepths};
use diaphane_runtime::fold::Plan;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{GpuDevice, GpuRenderer, PictureRenderer, Request, SplatPath, instance};
use diaphane_runtime::rendered::RayResult;
use objects::{Object, ball, torus, uneven_grid};
use scenes::{inside, level, outside, scene};
use wgpu::TextureFormat;

/// A renderer, or `None` after saying why.
fn gpu(asset: &Asset) -> Option<GpuRenderer> {
    gpu_with(asset, SplatPath::Tiles)
}

/// The same that sums kernels along `path`.
fn gpu_with(asset: &Asset, path: SplatPath) -> Option<GpuRenderer> {
    match GpuRenderer::new(asset, Some(path)) {
        Ok(gpu) => Some(gpu),
        Err(e @ Error::NoAdapter(_)) if std::env::var_os("DIAPHANE_REQUIRE_GPU").is_none_or(|v| v != "1") => {
            tell(&format!("skipped: no adapter ({e})"));
            None
        }
        Err(e) => panic!("{e}"),
    }
}

/// Whether two rays have the same pieces: their ends within 1e-5 diagonals, and met the same faces at an edge (seen by
/// the boundary's transmittance where that is not 1).
fn same_pieces(a: &RayResult, b: &RayResult, diagonal: f32) -> bool {
    let near = |x: f32, y: f32| (x - y).abs() <= 1e-5 * diagonal;
    let same = |k: usize| {
        let (p, q) = (a.pieces[k], b.pieces[k]);
        near(p.0, q.0) && near(p.1, q.1) && (a.boundary[k] - b.boundary[k]).abs() <= 1e-5
    };
    a.count == b.count && (0..a.count as usize).all(same)
}

/// One ray of every pixel on both backends: largest difference 1e-4 of the peak where the pieces agree to 1e-5
/// diagonals, and they do on 99.5 % of the rays.
fn compare_rays(name: &str, asset: &Asset, frame: &Frame, exact: Option<&ExactDepths>) {
    for path in [SplatPath::Quads, SplatPath::Tiles] {
        compare_path(&format!("{name} by {}", path.name()), path, asset, frame, exact);
    }
}

fn compare_path(name: &str, path: SplatPath, asset: &Asset, frame: &Frame, exact: Option<&ExactDepths>) {
    let Some(mut gpu) = gpu_with(asset, path) else { return };
    let cpu = CpuRenderer::new(asset).unwrap();
    let sources = cpu.sources(frame, exact);
    let (mut rays, mut agreeing, mut hits) = (0usize, 0usize, 0usize);
    let (mut worst, mut peak, mut elsewhere) = (0.0f32, 0.0f32, 0.0f32);
    for offset in [[0.5, 0.5], [0.125, 0.875]] {
        let expected = cpu.trace_rays(frame, &sources, offset);
        let got = gpu.trace_rays(frame, exact, offset).unwrap();
        assert_eq!(got.len(), expected.len());
        for (a, b) in got.iter().zip(&expected) {
            let difference = (0..3).map(|c| (a.radiance[c] - b.radiance[c]).abs()).fold(0.0, f32::max);
            assert!(a.radiance.iter().all(|v| v.is_finite()));
            peak = b.radiance.iter().fold(peak, |p, v| p.max(*v));
            rays += 1;
            hits += usize::from(b.count > 0);
            if same_pieces(a, b, asset.info.diagonal()) {
                agreeing += 1;
                worst = worst.max(difference);
            } else {
                elsewhere = elsewhere.max(difference);
            }
        }
    }
    let relative = worst / peak;
    println!(
        "{name} on {}: {} samples, {rays} rays, {hits} hit, {} disagree in their pieces; largest difference \
         {relative:.1e} of the peak {peak:.3} ({:.1e} on the others)",
        gpu.adapter(),
        asset.samples.len(),
        rays - agreeing,
        elsewhere / peak
    );
    assert!(peak > 0.0 && hits * 5 > rays, "{name} shows nothing");
    assert!(rays - agreeing <= hits / 200, "{name}: {} of {hits} rays disagree", rays - agreeing);
    assert!(relative <= 1e-4, "{name}: {relative}");
}

#[test]
fn ball_from_outside() {
    let asset = ball().build();
    compare_rays("ball", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
}

#[test]
fn coloured_extinction_and_forward_phase() {
    let phase = Phase::HenyeyGreenstein { g: 0.6 };
    let asset = Object { extinction: [2.0, 5.0, 11.0], phase, order: 7, ..ball() }.build();
    compare_rays("coloured ball", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
}

#[test]
fn stored_transmittance_at_low_and_high_order() {
    for order in [1, 10] {
        let asset = Object { encoding: Encoding::Transmittance, order, spacing: 0.3, ..ball() }.build();
        compare_rays("transmittance", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
    }
}

#[test]
fn folded_lights() {
    for (phase, extinction) in
        [(Phase::Isotropic, [4.0; 3]), (Phase::HenyeyGreenstein { g: 0.25 }, [2.0, 5.0, 11.0])]
    {
        let asset = Object { extinction, phase, ..ball() }.build();
        let mut scene = scene(scenes::far());
        scenes::add_suns(&mut scene, 40);
        let frame = Frame::new(&scene, &asset.info).unwrap();
        assert_eq!(Plan::new(&frame, &asset.info, None).folded.len(), 41);
        compare_rays("folded lights", &asset, &frame, None);
    }
}

#[test]
fn thousands_of_lights_one_by_one() {
    // A sample of ten bands takes about 70 rounds of loops a light: more than a software adapter does at once.
    let asset = Object { order: 10, spacing: 0.3, ..ball() }.build();
    let mut scene = scene(outside());
    scene.lights = scenes::crowd(4097);
    let frame = Frame::new(&scene, &asset.info).unwrap();
    assert_eq!(Plan::new(&frame, &asset.info, None).single.len(), 4097);
    compare_rays("4,097 lights", &asset, &frame, None);
}

#[test]
fn samples_leave_out_the_same_lights() {
    // Two portions; one light of sixteen is bright, the others bring a few millionths of its light each.
    let asset = Object { phase: Phase::HenyeyGreenstein { g: 0.5 }, spacing: 0.2, ..ball() }.build();
    let mut scene = scene(outside());
    scene.lights = scenes::crowd(400);
    for light in scene.lights.iter_mut().enumerate().filter(|(k, _)| k % 16 > 0).map(|(_, l)| l) {
        if let Light::Point { intensity, .. } = light {
            *intensity *= 2e-6;
        }
    }
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let lights = CpuRenderer::new(&asset).unwrap().render(&frame, None).lights;
    assert!(lights.single > 300 && lights.negligible_share.unwrap() > 0.3, "{lights:?}");
    compare_rays("dim lights", &asset, &frame, None);
}

#[test]
fn lighting_is_reused_while_the_camera_moves() {
    for path in [SplatPath::Quads, SplatPath::Tiles] {
        let asset = ball().build();
        let Some(mut gpu) = gpu_with(&asset, path) else { return };
        gpu.set_reuse(true);
        let frame = Frame::new(&scene(outside()), &asset.info).unwrap();
        let moved = Frame::new(&scene(level()), &asset.info).unwrap();
        gpu.render(&frame, None).unwrap();
        let kept = gpu.render(&moved, None).unwrap();
        assert!(
            kept.passes.iter().all(|(name, _)| *name != "lighting" && *name != "slopes"),
            "{:?}",
            kept.passes
        );
        let anew = gpu_with(&asset, path).unwrap().render(&moved, None).unwrap();
        assert_eq!(kept.picture, anew.picture);
    }
}

#[test]
fn density_grid() {
    let asset = Object { density: Some(uneven_grid()), ..ball() }.build();
    compare_rays("uneven ball", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
    let asset = Object { density: Some(uneven_grid()), extinction: [2.0, 5.0, 11.0], ..torus() }.build();
    compare_rays("uneven torus", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
}

#[test]
fn refracting_boundary() {
    let asset = Object { ior: 1.5, ..ball() }.build();
    compare_rays("glassy ball", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
    let asset = Object { ior: 1.3, ..torus() }.build();
    compare_rays("glassy torus", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
}

#[test]
fn camera_inside() {
    for object in [ball(), Object { density: Some(uneven_grid()), ior: 1.5, ..ball() }] {
        let asset = object.build();
        compare_rays("ball from inside", &asset, &Frame::new(&scene(inside()), &asset.info).unwrap(), None);
    }
}

#[test]
fn two_pieces_of_a_torus() {
    let asset = torus().build();
    let frame = Frame::new(&scene(level()), &asset.info).unwrap();
    compare_rays("torus", &asset, &frame, None);
    let Some(mut gpu) = gpu(&asset) else { return };
    let rays = gpu.trace_rays(&frame, None, [0.5; 2]).unwrap();
    assert!(rays.iter().filter(|r| r.count == 2).count() > 500, "the view runs through both sides");
}

#[test]
fn exact_depths() {
    let asset = Object { ior: 1.5, ..ball() }.build();
    let mut scene = scene(outside());
    scenes::put_light_inside(&mut scene);
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let exact = DepthTracer::new(&asset).unwrap().trace(&frame, &[0, frame.scene_lights - 1]);
    compare_rays("exact depths", &asset, &frame, Some(&exact));
}

#[test]
fn whole_pictures_agree() {
    // Every ray counts here, also those whose pieces differ: the bound is on the mean.
    for object in [ball(), Object { ior: 1.5, ..torus() }] {
        let asset = object.build();
        let Some(mut gpu) = gpu(&asset) else { return };
        let mut scene = scene(outside());
        scene.surface.reflection = true;
        scene.image.samples_per_pixel = 5;
        let frame = Frame::new(&scene, &asset.info).unwrap();
        let a = gpu.render(&frame, None).unwrap();
        let b = CpuRenderer::new(&asset).unwrap().render(&frame, None);
        assert_eq!((a.picture.width, a.picture.height), (b.picture.width, b.picture.height));
        let flat = |r: &diaphane_runtime::rendered::Rendered| -> Vec<f64> {
            r.picture.pixels.as_flattened().iter().map(|v| f64::from(*v)).collect()
        };
        let (x, y) = (flat(&a), flat(&b));
        let square: f64 = y.iter().map(|v| v * v).sum();
        let error: f64 = x.iter().zip(&y).map(|(p, q)| (p - q) * (p - q)).sum();
        println!(
            "picture: relative error {:.1e}, {:?}, {:?} against {:?}",
            (error / square).sqrt(),
            a.passes,
            a.counters,
            b.counters
        );
        assert!((error / square).sqrt() < 1e-3);
        let near = |p: u64, q: u64| p.abs_diff(q) as f64 <= 1e-3 * q as f64 + 2.0;
        let (p, q) = (a.counters, b.counters);
        assert!(
            p.rays == q.rays && p.samples_drawn == q.samples_drawn && p.pieces_dropped == q.pieces_dropped
        );
        assert!(near(p.rays_hit, q.rays_hit) && near(p.splats, q.splats) && near(p.uncovered, q.uncovered));
        let coverage = a.picture.coverage.as_ref().unwrap().iter().zip(b.picture.coverage.as_ref().unwrap());
        assert!(coverage.filter(|(p, q)| (**p - **q).abs() > 0.01).count() < 20);
    }
}

#[test]
fn same_bits_every_time() {
    let asset = torus().build();
    let frame = Frame::new(&scene(outside()), &asset.info).unwrap();
    for path in [SplatPath::Quads, SplatPath::Tiles] {
        let Some(mut first) = gpu_with(&asset, path) else { return };
        let picture = first.render(&frame, None).unwrap().picture;
        assert!(picture == first.render(&frame, None).unwrap().picture);
        assert!(picture == gpu_with(&asset, path).unwrap().render(&frame, None).unwrap().picture);
    }
}

#[test]
fn size_and_lights_may_change() {
    let asset = ball().build();
    let Some(mut gpu) = gpu(&asset) else { return };
    let mut scene = scene(outside());
    let full = gpu.render(&Frame::new(&scene, &asset.info).unwrap(), None).unwrap();
    scene.lights.clear();
    (scene.image.width, scene.image.height) = (17, 31);
    let dark = gpu.render(&Frame::new(&scene, &asset.info).unwrap(), None).unwrap();
    assert!(dark.picture.pixels.iter().all(|p| *p == [0.0; 3]) && dark.counters.rays_hit > 0);
    let again = gpu.render(&Frame::new(&scenes::scene(outside()), &asset.info).unwrap(), None).unwrap();
    assert!(full.picture == again.picture);
}

#[test]
fn tiles_make_the_same_picture() {
    let asset = Object { ior: 1.5, density: Some(uneven_grid()), ..torus() }.build();
    let Some(mut gpu) = gpu(&asset) else { return };
    let frame = Frame::new(&scene(level()), &asset.info).unwrap();
    let whole = gpu.render(&frame, None).unwrap();
    assert_eq!(gpu.tiles(), 1);
    gpu.limit_memory(2 << 20);
    let tiled = gpu.render(&frame, None).unwrap();
    assert!(gpu.tiles() > 2, "{}", gpu.tiles());
    // Tiles round the corners of triangles differently: a ray in ten thousand may see another face of an edge.
    let peak = whole.picture.pixels.as_flattened().iter().fold(0.0, |a: f32, b| a.max(*b));
    let pairs = whole.picture.pixels.as_flattened().iter().zip(tiled.picture.pixels.as_flattened());
    let differing = pairs.filter(|(a, b)| (**a - **b).abs() > 1e-5 * peak).count();
    assert!(differing <= 3, "{differing}");
}

#[test]
fn a_host_program_gets_the_same_picture() {
    let asset = Object { ior: 1.5, ..ball() }.build();
    let Some(mut gpu) = gpu(&asset) else { return };
    let mut scene = scene(outside());
    scene.image.samples_per_pixel = 4;
    scene.surface.reflection = true;
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let expected = gpu.render(&frame, None).unwrap();
    let host = GpuDevice::open(&instance(), None).unwrap();
    let (device, queue) = (&host.device, &host.queue);
    let mut renderer = PictureRenderer::new(device, queue, &asset, TextureFormat::Rgba8Unorm).unwrap();
    // One ray first, then the other three on top.
    for rays in [0..1, 1..4] {
        let mut encoder = device.create_command_encoder(&Default::default());
        let request = Request { frame: &frame, exact: None, rays, exposure: 1.0 };
        renderer.prepare(device, queue, &mut encoder, &request).unwrap();
        queue.submit([encoder.finish()]);
        renderer.statistics();
    }
    let picture = renderer.read_picture(device, queue).unwrap();
    let peak = expected.picture.pixels.as_flattened().iter().fold(0.0, |a: f32, b| a.max(*b));
    let pairs = picture.pixels.as_flattened().iter().zip(expected.picture.pixels.as_flattened());
    assert!(pairs.clone().all(|(a, b)| (a - b).abs() <= 1e-6 * peak));
    assert_eq!(picture.coverage, expected.picture.coverage);
    host.check().unwrap();
}

#[test]
fn no_samples_no_light() {
    let mut object = ball();
    object.inside = |_| false;
    let asset = object.build();
    let Some(mut gpu) = gpu(&asset) else { return };
    let rendered = gpu.render(&Frame::new(&scene(outside()), &asset.info).unwrap(), None).unwrap();
    assert!(rendered.picture.pixels.iter().all(|p| *p == [0.0; 3]));
    assert_eq!(rendered.counters.uncovered, rendered.counters.rays_hit);
}

/// Says why a test does nothing, past the test runner's capture of the print macros.
fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
