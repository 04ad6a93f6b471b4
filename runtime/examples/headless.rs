//! Pictures of an asset from all sides, without a window: `cargo run --release -p diaphane-runtime --example headless --
//! ASSET.dph FOLDER`.

#[path = "support/picture.rs"]
mod picture;

use anyhow::{Result, anyhow};
use diaphane_formats::asset;
use diaphane_formats::scene::{Light, Surface};
use diaphane_runtime::gpu::{HostFrame, Options, Renderer};
use diaphane_runtime::placement::{HostCamera, Placement};
use diaphane_runtime::wgpu;
use glam::{DVec3, camera, dcamera};
use std::f64::consts::TAU;
use std::path::Path;

const SIZE: [u32; 2] = [320, 320];
const VIEWS: u32 = 8;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, asset, folder] = &arguments[..] else { return Err(anyhow!("usage: headless ASSET.dph FOLDER")) };
    let asset = asset::read(Path::new(asset))?;

    let (device, queue) = picture::device()?;
    let target = picture::target(&device, SIZE, wgpu::TextureFormat::Rgba16Float);
    let view = target.create_view(&Default::default());

    // diaphane: one object, a light that stays where it is, a camera that goes round.
    let mut renderer = Renderer::new(&device, Options::new(wgpu::TextureFormat::Rgba16Float))?;
    let id = renderer.add_asset(&device, &asset)?;
    renderer.add_instance(id, Placement::IDENTITY)?;
    let (centre, size) = (DVec3::from(asset.info.centre), f64::from(asset.info.diagonal()));
    let light = Light::Point {
        position: centre + size * DVec3::new(1.0, 0.8, -0.6),
        intensity: DVec3::new(9.0, 7.0, 5.0) * size * size,
    };
    let projection = camera::rh::proj::directx::perspective_infinite_reverse(0.4, 1.0, 0.01 * size as f32);
    for k in 0..VIEWS {
        let angle = TAU * f64::from(k) / f64::from(VIEWS);
        let eye = centre + 3.0 * size * DVec3::new(angle.sin(), 0.3, angle.cos());
        let frame = HostFrame {
            size: SIZE,
            camera: HostCamera::new(dcamera::rh::view::look_at_mat4(eye, centre, DVec3::Y), projection)?,
            lights: &[light],
            exact: &[],
            environment: &[],
            surface: Surface::DEFAULT,
            depth: None,
            exposure: 1.0,
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        renderer.prepare(&device, &queue, &mut encoder, &frame)?;
        renderer.render_to_texture(&mut encoder, &view, true);
        queue.submit([encoder.finish()]);

        let name = Path::new(folder).join(format!("view-{k}.png"));
        picture::save(&device, &queue, &target, &name)?;
        println!("{}: {:?}", name.display(), renderer.report());
    }
    Ok(())
}
