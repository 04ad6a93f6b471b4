//! A translucent object among a host's own opaque geometry, hidden by it and hiding it as far as it lets light through:
//! `cargo run --release -p diaphane-runtime --example host_scene -- ASSET.dph PICTURE.png`.

#[path = "support/boxes.rs"]
mod boxes;
#[path = "support/picture.rs"]
mod picture;

use anyhow::{Result, anyhow};
use boxes::Boxes;
use diaphane_formats::asset;
use diaphane_formats::scene::{Light, Surface};
use diaphane_runtime::gpu::{HostDepth, HostFrame, Options, Renderer};
use diaphane_runtime::placement::{HostCamera, Placement};
use diaphane_runtime::wgpu;
use glam::{DQuat, DVec3, camera, dcamera};
use std::path::Path;

const SIZE: [u32; 2] = [640, 480];
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, asset, output] = &arguments[..] else {
        return Err(anyhow!("usage: host_scene ASSET.dph PICTURE.png"));
    };
    let asset = asset::read(Path::new(asset))?;
    let (device, queue) = picture::device()?;
    let (colour, depth) = (picture::target(&device, SIZE, COLOUR), picture::target(&device, SIZE, DEPTH));
    let (colour_view, depth_view) =
        (colour.create_view(&Default::default()), depth.create_view(&Default::default()));

    // The host's camera, reverse-z, and its boxes.
    let eye = DVec3::new(1.5, 0.9, 2.2);
    let view = dcamera::rh::view::look_at_mat4(eye, DVec3::new(0.15, 0.0, 0.0), DVec3::Y);
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let projection = camera::rh::proj::directx::perspective_infinite_reverse(0.6, aspect, 0.1);
    let boxes = Boxes::new(&device, COLOUR, DEPTH, projection * view.as_mat4());

    // diaphane: the object twice, fitted into a ball of radius 1/2, and two lights.
    let mut renderer = Renderer::new(&device, Options { depth: Some(DEPTH), ..Options::new(COLOUR) })?;
    let id = renderer.add_asset(&device, &asset)?;
    let scale = 1.0 / f64::from(asset.info.diagonal());
    for (place, turn) in [(DVec3::new(0.0, 0.0, 0.2), 0.3), (DVec3::new(0.7, 0.0, -0.9), 2.6)] {
        let rotation = DQuat::from_rotation_y(turn);
        let translation = place - rotation * (scale * DVec3::from(asset.info.centre));
        renderer.add_instance(id, Placement { translation, rotation, scale })?;
    }
    let lights = [
        Light::Point { position: DVec3::new(-1.5, 1.5, -1.2), intensity: DVec3::new(70.0, 45.0, 20.0) },
        Light::Directional {
            direction: DVec3::new(-0.6, -0.7, -0.4).normalize(),
            irradiance: DVec3::new(2.0, 3.0, 5.0),
        },
    ];
    let frame = HostFrame {
        size: SIZE,
        camera: HostCamera::new(view, projection)?,
        lights: &lights,
        exact: &[],
        environment: &[],
        surface: Surface::DEFAULT,
        depth: Some(HostDepth { view: &depth_view, projection }),
        exposure: 1.0,
    };
    let mut encoder = device.create_command_encoder(&Default::default());
    boxes.draw(&mut encoder, &colour_view, &depth_view);
    renderer.prepare(&device, &queue, &mut encoder, &frame)?;
    {
        let mut pass = boxes::pass(&mut encoder, &colour_view, &depth_view, false);
        renderer.render(&mut pass);
    }
    queue.submit([encoder.finish()]);
    println!("{:?}", renderer.report());
    picture::save(&device, &queue, &colour, Path::new(output))
}
