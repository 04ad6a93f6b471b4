//! A device that goes away and one without memory: an error that says so, or another way to the picture.

use super::gpu;
use super::host::{FORMAT, host_frame};
use super::objects::ball;
use super::scenes::{outside, scene};
use diaphane_formats::asset::Asset;
use diaphane_runtime::Error;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{GpuDevice, GpuRenderer, HostFrame, Options, Renderer, SplatPath, instance};
use diaphane_runtime::placement::Placement;
use diaphane_runtime::player::{Backend, LightMode, Player};
use diaphane_runtime::wgpu::{self, TextureFormat};
use glam::DVec3;

/// A small picture of `asset`.
fn frame(asset: &Asset) -> Frame {
    Frame::new(&scene(outside()), &asset.info).unwrap()
}

#[test]
fn a_lost_device_is_an_error_that_stays() {
    let asset = ball().build();
    let Some(mut renderer) = gpu(&asset) else { return };
    let frame = frame(&asset);
    renderer.render(&frame, None).unwrap();
    renderer.device().destroy();
    for _ in 0..2 {
        let error = renderer.render(&frame, None).unwrap_err();
        assert!(matches!(error, Error::Lost(_)), "{error}");
        let line = error.to_string();
        assert!(line.contains("lost") && line.contains("CPU backend") && !line.contains('\n'), "{line}");
    }
}

#[test]
fn uploading_to_a_lost_device_is_an_error_and_no_panic() {
    let asset = ball().build();
    if gpu(&asset).is_none() {
        return;
    }
    for path in [SplatPath::Tiles, SplatPath::Quads] {
        let device = GpuDevice::open(&instance(), None).unwrap();
        device.device.destroy();
        let error = GpuRenderer::on(device, &asset, Some(path)).err().unwrap();
        assert!(matches!(error, Error::Lost(_)), "{error}");
    }
}

#[test]
fn a_player_opens_the_gpu_again_and_draws_the_same() {
    let asset = ball().build();
    if gpu(&asset).is_none() {
        return;
    }
    let frame = frame(&asset);
    let mut player = Player::new(&asset, Backend::Gpu).unwrap();
    player.set_reuse(true);
    player.edit(&Edit { extinction_scale: DVec3::splat(0.7), albedo: None }).unwrap();
    let before = player.render_anyway(&asset, &frame, LightMode::Baked).unwrap().picture;
    assert_eq!(player.take_note(), None);
    player.device().unwrap().destroy();
    let other = Frame { lights: frame.lights[..1].to_vec(), scene_lights: 1, ..frame.clone() };
    player.render_anyway(&asset, &other, LightMode::Baked).unwrap();
    let note = player.take_note().unwrap();
    assert!(note.contains("lost") && note.contains("opened again"), "{note}");
    let after = player.render_anyway(&asset, &frame, LightMode::Baked).unwrap().picture;
    assert_eq!(player.take_note(), None);
    assert_eq!(before.pixels, after.pixels);
    assert_eq!(player.describe().0, "gpu");
}

#[test]
fn a_picture_that_no_buffer_holds_is_an_error_with_its_size_and_the_next_one_is_drawn() {
    let asset = ball().build();
    if gpu(&asset).is_none() {
        return;
    }
    let GpuDevice { device, queue, .. } = GpuDevice::open(&instance(), None).unwrap();
    let mut renderer = Renderer::new(&device, Options::new(FORMAT)).unwrap();
    let id = renderer.add_asset(&device, &asset).unwrap();
    renderer.add_instance(id, Placement::IDENTITY).unwrap();
    let scene = scene(outside());
    let mut encoder = device.create_command_encoder(&Default::default());
    for size in [[0, 0], [0, 40], [1 << 20, 1 << 20]] {
        let frame = HostFrame { size, ..host_frame(&scene, None) };
        let error = renderer.prepare(&device, &queue, &mut encoder, &frame).unwrap_err().to_string();
        assert!(error.contains(&format!("{} x {}", size[0], size[1])), "{error}");
    }
    renderer.prepare(&device, &queue, &mut encoder, &host_frame(&scene, None)).unwrap();
    assert_eq!(renderer.report().drawn, 1);
}

#[test]
fn a_host_that_lost_its_device_is_not_stopped_by_a_panic() {
    let asset = ball().build();
    if gpu(&asset).is_none() {
        return;
    }
    // Nobody listens to this device: whatever reached it would end the program.
    let adapter = GpuDevice::open(&instance(), None).unwrap().adapter;
    let (device, queue) =
        pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .unwrap();
    let mut renderer = Renderer::new(&device, Options::new(TextureFormat::Rgba16Float)).unwrap();
    let id = renderer.add_asset(&device, &asset).unwrap();
    renderer.add_instance(id, Placement::IDENTITY).unwrap();
    device.destroy();
    for _ in 0..2 {
        let mut encoder = device.create_command_encoder(&Default::default());
        // Whether it says so or records into nothing is all the same: the device tells its owner.
        let _ = renderer.prepare(&device, &queue, &mut encoder, &host_frame(&scene(outside()), None));
    }
    let _ = renderer.add_asset(&device, &asset);
}
