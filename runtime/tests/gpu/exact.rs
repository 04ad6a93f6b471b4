//! Exact depths of a host's lights.

use super::host::{FORMAT, Host, device, host_frame, peak};
use super::objects::{Object, ball, torus};
use super::scenes::{outside, put_light_inside, scene};
use diaphane_formats::asset::Asset;
use diaphane_formats::scene::{Light, Scene};
use diaphane_runtime::exact::{DepthTracer, Settings};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{GpuDepths, GpuDevice, Options};
use diaphane_runtime::placement::Placement;
use diaphane_runtime::player::{Backend, LightMode, Player};
use glam::{DVec3, Vec3};

/// All depths of a frame in that frame.
const QUICK: Settings = Settings { milliseconds: 1e6, ..Settings::DEFAULT };

/// One light, close to the object: baked depths of the few bands here are coarse.
fn near_light() -> Scene {
    let mut scene = scene(outside());
    scene.lights.truncate(1);
    scene
}

fn host(device: &GpuDevice, exact: Option<Settings>) -> Host {
    let options = Options { exact, ..Options::new(FORMAT) };
    Host::with(device.device.clone(), device.queue.clone(), options)
}

/// One ray through the middle of every pixel, with all lights exact.
fn expected(asset: &Asset, scene: &Scene) -> Vec<[f32; 3]> {
    let mut player = Player::new(asset, Backend::Gpu).unwrap();
    let frame = Frame::new(scene, &asset.info).unwrap();
    player.render(&frame, LightMode::Exact).unwrap().picture.pixels.clone()
}

fn apart(a: &[[f32; 4]], b: &[[f32; 3]]) -> f32 {
    let off = |(a, b): (&[f32; 4], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    a.iter().zip(b).map(off).fold(0.0, f32::max) / peak(a)
}

#[test]
fn lights_at_rest_become_exact_without_a_jump_and_lose_it_when_anything_moves() {
    let Some(gpu) = device() else { return };
    let (asset, mut scene) = (Object { order: 3, ..ball() }.build(), near_light());
    let exact = expected(&asset, &scene);
    let mut baked = host(&gpu, None);
    baked.put(&asset, Placement::IDENTITY);
    let without = baked.draw(&host_frame(&scene, None));
    let whole = apart(&without, &exact);
    assert!(whole > 0.01, "{whole}");

    let mut host = host(&gpu, Some(QUICK));
    let id = host.put(&asset, Placement::IDENTITY);
    let mut frames = vec![host.draw(&host_frame(&scene, None))];
    assert_eq!(frames[0], without);
    while host.renderer.is_busy() && frames.len() < 100 {
        frames.push(host.draw(&host_frame(&scene, None)));
    }
    let report = host.renderer.report();
    assert_eq!((report.exact, report.waiting), (1, 0));
    let expected_frames = (Settings::DEFAULT.rest_frames + Settings::DEFAULT.fade_frames) as usize;
    assert!(frames.len().abs_diff(expected_frames) <= 2, "{}", frames.len());
    // Ever nearer, in steps; targets are half floats.
    let steps: Vec<f32> = frames.iter().map(|f| apart(f, &exact)).collect();
    assert!(steps[steps.len() - 1] < 2e-3, "{steps:?}");
    for pair in steps.windows(2) {
        assert!(pair[1] <= pair[0] + 2e-3 && pair[0] - pair[1] < 0.2 * whole + 2e-3, "{steps:?}");
    }
    // Nothing moves: nothing is recorded.
    assert_eq!(host.draw(&host_frame(&scene, None)), frames[frames.len() - 1]);
    assert!(host.renderer.report().reused && host.renderer.report().exact == 1);

    // The object moves: the light is elsewhere in its coordinates.
    host.renderer.place(id, Placement { translation: 0.05 * DVec3::X, ..Placement::IDENTITY }).unwrap();
    host.draw(&host_frame(&scene, None));
    assert_eq!(host.renderer.report().exact, 0);
    assert!(host.renderer.is_busy());

    // Out of sight nobody waits for it.
    let away = Placement {
        translation: 100.0 * (scene.camera.position - scene.camera.target),
        ..Placement::IDENTITY
    };
    host.renderer.place(id, away).unwrap();
    host.draw(&host_frame(&scene, None));
    assert!(host.renderer.report().culled == 1 && !host.renderer.is_busy());
    host.draw(&host_frame(&scene, None));
    assert!(host.renderer.report().reused);
    host.renderer.place(id, Placement::IDENTITY).unwrap();

    // A marked light needs no rest.
    let Some(Light::Point { position, .. }) = scene.lights.first_mut() else { panic!("no point light") };
    *position += 0.3 * DVec3::Y;
    scene.mark_exact(0, true);
    host.draw(&host_frame(&scene, None));
    host.draw(&host_frame(&scene, None));
    assert_eq!(host.renderer.report().rays, asset.samples.len() as u64);
}

#[test]
fn objects_share_the_time_of_a_frame() {
    let Some(gpu) = device() else { return };
    let (asset, mut scene) = (Object { spacing: 0.1, ..ball() }.build(), near_light());
    scene.mark_exact(0, true);
    let mut host = host(&gpu, Some(Settings { milliseconds: 1e-6, ..Settings::DEFAULT }));
    let id = host.renderer.add_asset(&host.device, &asset).unwrap();
    for x in [-0.5, 0.0, 0.5] {
        let placement = Placement { translation: x * DVec3::X, ..Placement::IDENTITY };
        host.renderer.add_instance(id, placement).unwrap();
    }
    host.draw(&host_frame(&scene, None));
    host.draw(&host_frame(&scene, None));
    let report = host.renderer.report();
    // The first portion of the first object takes all of it.
    assert_eq!((report.exact, report.waiting), (0, 3));
    assert!(report.rays > 0 && report.rays <= 256, "{report:?}");
}

#[test]
fn a_gpu_traces_the_depths_that_the_cpu_traces() {
    let glassy = Object { ior: 1.4, spacing: 0.12, ..ball() };
    for (name, object) in [("torus", Object { spacing: 0.08, ..torus() }), ("glassy ball", glassy)] {
        let mut asset = object.build();
        asset.info.uniform_density = 0.7;
        let Some(gpu) = device() else { return };
        let mut cpu = DepthTracer::new(&asset).unwrap();
        let mut other = DepthTracer::new(&asset).unwrap();
        assert!(other.use_gpu(&gpu), "{name}");
        let mut scene = scene(outside());
        put_light_inside(&mut scene);
        let frame = Frame::new(&scene, &asset.info).unwrap();
        let all: Vec<usize> = (0..frame.lights.len()).collect();
        let (expected, got) = (cpu.trace(&frame, &all), other.trace(&frame, &all));
        assert!(other.report().on_gpu && !cpu.report().on_gpu);
        for light in all {
            let (expected, got) = (expected.light(light).unwrap(), got.light(light).unwrap());
            let mut off: Vec<[f32; 2]> =
                expected.iter().zip(got).map(|(a, b)| [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()]).collect();
            off.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let (most, longest) = (off[off.len() - 1][0], expected.iter().map(|d| d[0]).fold(0.0, f32::max));
            println!("{name}, light {light}: {most:.1e} of {longest:.2}");
            assert!(longest > 0.1 && most < 2e-5 * longest, "{name}, light {light}: {most}");
            // Through an edge a ray meets either face.
            let other_face = off.iter().filter(|d| d[1] > 1e-4).count();
            assert!(other_face * 200 < off.len(), "{name}, light {light}: {other_face}");
        }
    }
}

#[test]
fn a_gpu_that_cannot_trace_leaves_it_to_the_cpu() {
    let Some(gpu) = device() else { return };
    let uneven = Object { density: Some(super::uneven_grid()), spacing: 0.3, ..ball() }.build();
    assert!(!DepthTracer::new(&uneven).unwrap().use_gpu(&gpu));
    let asset = Object { spacing: 0.3, ..ball() }.build();
    let mut tracer = DepthTracer::new(&asset).unwrap();
    assert!(tracer.use_gpu(&gpu));
    let frame = Frame::new(&near_light(), &asset.info).unwrap();
    // One sample's depths alone are one.
    let places: Vec<Vec3> = (0..asset.samples.len()).map(|i| asset.samples.centroid(i)).collect();
    let depths = GpuDepths::new(&gpu, &asset.mesh().unwrap(), &asset.info, &places).unwrap();
    let all = depths.trace(&frame.lights[0], 0..places.len()).unwrap();
    assert_eq!(depths.trace(&frame.lights[0], 3..4).unwrap(), all[3..4]);
    gpu.device.destroy();
    let traced = tracer.trace(&frame, &[0]);
    assert!(!tracer.is_on_gpu());
    let expected = DepthTracer::new(&asset).unwrap().trace(&frame, &[0]);
    assert_eq!(traced.light(0), expected.light(0));
}

#[test]
fn a_picture_with_depths_from_the_gpu_is_the_same() {
    let asset = Object { order: 3, ..ball() }.build();
    if device().is_none() {
        return;
    }
    let scene = near_light();
    let exact = expected(&asset, &scene);
    let mut player = Player::new(&asset, Backend::Gpu).unwrap();
    assert!(player.trace_on_gpu());
    let frame = Frame::new(&scene, &asset.info).unwrap();
    let rendered = player.render(&frame, LightMode::Exact).unwrap();
    assert!(rendered.exact.on_gpu);
    let peak = exact.iter().flatten().fold(0.0, |m: f32, v| m.max(*v));
    let off = exact.iter().flatten().zip(rendered.picture.pixels.iter().flatten());
    assert!(off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < 1e-4 * peak);
}
