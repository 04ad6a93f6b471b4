//! A hundred objects of one asset, one of them filling the view, against that one alone:
//! `cargo run --release -p diaphane-runtime --example crowd -- ASSET.dph PICTURE.png [quads|tiles]`.

#[path = "support/picture.rs"]
mod picture;

use anyhow::{Result, anyhow};
use diaphane_formats::asset;
use diaphane_formats::directions::even_directions;
use diaphane_formats::scene::{Light, Surface};
use diaphane_runtime::gpu::{HostFrame, Options, Renderer, SplatPath};
use diaphane_runtime::placement::{HostCamera, Placement};
use diaphane_runtime::wgpu;
use glam::{DQuat, DVec3, camera, dcamera};
use std::path::Path;
use std::time::Instant;

const SIZE: [u32; 2] = [800, 800];
const FRAMES: u32 = 5;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let (asset, output, path) = match &arguments[..] {
        [_, asset, output] => (asset, output, None),
        [_, asset, output, path] if path == "quads" => (asset, output, Some(SplatPath::Quads)),
        [_, asset, output, path] if path == "tiles" => (asset, output, Some(SplatPath::Tiles)),
        _ => return Err(anyhow!("usage: crowd ASSET.dph PICTURE.png [quads|tiles]")),
    };
    let asset = asset::read(Path::new(asset))?;
    let (device, queue) = picture::device()?;
    let target = picture::target(&device, SIZE, wgpu::TextureFormat::Rgba16Float);
    let view = target.create_view(&Default::default());
    let options = Options { path, ..Options::new(wgpu::TextureFormat::Rgba16Float) };
    let mut renderer = Renderer::new(&device, options)?;
    let id = renderer.add_asset(&device, &asset)?;
    let scale = 1.0 / f64::from(asset.info.diagonal());
    let put = |place: DVec3, turn: f64| {
        let rotation = DQuat::from_rotation_y(turn);
        Placement {
            translation: place - rotation * (scale * DVec3::from(asset.info.centre)),
            rotation,
            scale,
        }
    };
    renderer.add_instance(id, put(DVec3::ZERO, 0.0))?;

    let projection = camera::rh::proj::directx::perspective_infinite_reverse(0.6, 1.0, 0.01);
    let time = |renderer: &mut Renderer| -> Result<f64> {
        let mut times = Vec::new();
        for k in 0..=FRAMES {
            // Camera and light move in every frame.
            let turn = 0.02 * f64::from(k);
            let eye = DVec3::new(1.25 * turn.sin(), 0.23, 1.25 * turn.cos());
            let lights = [Light::Point {
                position: DVec3::new(2.0, 2.0 + turn, -1.5),
                intensity: DVec3::new(60.0, 45.0, 30.0),
            }];
            let frame = HostFrame {
                size: SIZE,
                camera: HostCamera::new(
                    dcamera::rh::view::look_at_mat4(eye, DVec3::ZERO, DVec3::Y),
                    projection,
                )?,
                lights: &lights,
                exact: &[],
                environment: &[],
                surface: Surface::DEFAULT,
                depth: None,
                exposure: 1.0,
            };
            let started = Instant::now();
            let mut encoder = device.create_command_encoder(&Default::default());
            renderer.prepare(&device, &queue, &mut encoder, &frame)?;
            renderer.render_to_texture(&mut encoder, &view, true);
            queue.submit([encoder.finish()]);
            device.poll(wgpu::PollType::wait_indefinitely())?;
            times.push(started.elapsed().as_secs_f64() * 1e3);
        }
        // The first frame makes buffers.
        times.remove(0);
        times.sort_by(f64::total_cmp);
        println!("{:?}", renderer.report());
        Ok(times[times.len() / 2])
    };
    let alone = time(&mut renderer)?;
    for (k, direction) in even_directions(99, 4).into_iter().enumerate() {
        // Rings behind the first one, and some beside and behind the camera.
        let place = DVec3::new(9.0 * direction.x, 4.0 * direction.y, 14.0 * direction.z - 5.0);
        renderer.add_instance(id, put(place, k as f64))?;
    }
    let crowd = time(&mut renderer)?;
    println!("alone {alone:.1} ms, with 99 more {crowd:.1} ms: {:.2}", crowd / alone);
    picture::save(&device, &queue, &target, Path::new(output))
}
