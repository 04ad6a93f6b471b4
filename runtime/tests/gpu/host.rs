//! Objects in a host program's frame.

use super::objects::{Object, ball, torus};
use super::scenes::{outside, scene};
use super::{gpu, tell};
use diaphane_formats::asset::{Asset, Level};
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::{Camera, Light, Scene};
use diaphane_runtime::detail::{Fineness, details, pixels_at_nearest};
use diaphane_runtime::edit::Edit;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{
    GpuDevice, HostDepth, HostFrame, HostReport, Options, Renderer, instance, read_texture,
};
use diaphane_runtime::placement::{HostCamera, Placement};
use diaphane_runtime::wgpu;
use glam::{DQuat, DVec3, Mat4, Vec3, camera, dcamera};
use half::f16;

const SIZE: [u32; 2] = [112, 96];
pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

pub fn projection(camera: &Camera) -> Mat4 {
    let fov = camera.vertical_fov_degrees.to_radians() as f32;
    camera::rh::proj::directx::perspective_infinite_reverse(fov, SIZE[0] as f32 / SIZE[1] as f32, 0.1)
}

fn host_camera(camera: &Camera) -> HostCamera {
    let view = dcamera::rh::view::look_at_mat4(camera.position, camera.target, camera.up);
    HostCamera::new(view, projection(camera)).unwrap()
}

pub fn host_frame<'a>(scene: &'a Scene, depth: Option<HostDepth<'a>>) -> HostFrame<'a> {
    HostFrame {
        size: SIZE,
        camera: host_camera(&scene.camera),
        lights: &scene.lights,
        exact: &scene.exact,
        environment: &[],
        surface: scene.surface,
        depth,
        exposure: 1.0,
    }
}

/// A device and queue, or `None` after saying why.
pub fn device() -> Option<GpuDevice> {
    gpu(&ball().build()).map(|_| GpuDevice::open(&instance(), None).unwrap())
}

pub fn texture(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

/// A host with one target that starts as an even colour.
pub struct Host {
    pub device: wgpu::Device,
    queue: wgpu::Queue,
    pub renderer: Renderer,
    background: f64,
}

impl Host {
    fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        Self::with(device, queue, Options::new(FORMAT))
    }

    pub fn with(device: wgpu::Device, queue: wgpu::Queue, options: Options) -> Self {
        let renderer = Renderer::new(&device, options).unwrap();
        Self { device, queue, renderer, background: 0.0 }
    }

    pub fn put(&mut self, asset: &Asset, placement: Placement) -> diaphane_runtime::gpu::InstanceId {
        let id = self.renderer.add_asset(&self.device, asset).unwrap();
        self.renderer.add_instance(id, placement).unwrap()
    }

    /// Colours and alpha, row by row.
    pub fn draw(&mut self, frame: &HostFrame<'_>) -> Vec<[f32; 4]> {
        let target = texture(&self.device, FORMAT);
        let view = target.create_view(&Default::default());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let grey = self.background;
        clear(&mut encoder, Some((&view, wgpu::Color { r: grey, g: grey, b: grey, a: grey })), None);
        self.renderer.prepare(&self.device, &self.queue, &mut encoder, frame).unwrap();
        self.renderer.render_to_texture(&mut encoder, &view, false);
        self.queue.submit([encoder.finish()]);
        let bytes = read_texture(&self.device, &self.queue, &target).unwrap();
        let half = |b: &[u8]| f16::from_le_bytes([b[0], b[1]]).to_f32();
        bytes.chunks_exact(8).map(|t| [0, 2, 4, 6].map(|k| half(&t[k..]))).collect()
    }
}

pub fn clear(
    encoder: &mut wgpu::CommandEncoder,
    colour: Option<(&wgpu::TextureView, wgpu::Color)>,
    depth: Option<(&wgpu::TextureView, f32)>,
) {
    let colour = colour.map(|(view, value)| wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(value), store: wgpu::StoreOp::Store },
    });
    let depth = depth.map(|(view, value)| wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(value), store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: colour.as_ref().map_or(&[], |_| std::slice::from_ref(&colour)),
        depth_stencil_attachment: depth,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
}

fn largest_difference(a: &[[f32; 4]], b: &[[f32; 3]]) -> f32 {
    let off = |(a, b): (&[f32; 4], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    a.iter().zip(b).map(off).fold(0.0, f32::max)
}

pub fn peak(a: &[[f32; 4]]) -> f32 {
    a.iter().flat_map(|p| &p[..3]).fold(0.0, |m, v| m.max(*v))
}

/// What the renderer of pictures makes of the same: one ray through the middle of each pixel.
fn expected(asset: &Asset, scene: &Scene) -> Vec<[f32; 3]> {
    let frame = Frame::new(scene, &asset.info).unwrap();
    gpu(asset).unwrap().trace_rays(&frame, None, [0.5; 2]).unwrap().iter().map(|r| r.radiance).collect()
}

#[test]
fn one_object_is_the_picture_of_it() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let (asset, scene) = (Object { extinction: [2.0, 5.0, 11.0], ..ball() }.build(), scene(outside()));
    let mut host = Host::new(device, queue);
    host.put(&asset, Placement::IDENTITY);
    let got = host.draw(&host_frame(&scene, None));
    assert!(peak(&got) > 0.1 && largest_difference(&got, &expected(&asset, &scene)) < 1e-3 * peak(&got));
}

/// A device without any feature and with the limits that every adapter has.
#[test]
fn the_simplest_device_draws_the_same() {
    let Some(GpuDevice { device, queue, adapter, .. }) = device() else { return };
    let simple = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
    for object in [ball(), Object { density: Some(super::uneven_grid()), ior: 1.3, ..ball() }] {
        let (asset, scene) = (object.build(), scene(outside()));
        let mut host = Host::new(device.clone(), queue.clone());
        host.put(&asset, Placement::IDENTITY);
        let full = host.draw(&host_frame(&scene, None));
        assert!(simple.0.features().is_empty());
        let mut host = Host::new(simple.0.clone(), simple.1.clone());
        host.put(&asset, Placement::IDENTITY);
        let plain = host.draw(&host_frame(&scene, None));
        let colours: Vec<[f32; 3]> = full.iter().map(|p| [p[0], p[1], p[2]]).collect();
        assert!(peak(&plain) > 0.01 && largest_difference(&plain, &colours) <= 2e-3 * peak(&plain));
    }
}

#[test]
fn moving_all_together_changes_nothing() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let asset = Object { phase: Phase::HenyeyGreenstein { g: 0.5 }, ..torus() }.build();
    let here = scene(outside());
    let placement = Placement {
        translation: DVec3::new(30.0, -5.0, 8.0),
        rotation: DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.8),
        scale: 2.5,
    };
    let point = |p: DVec3| placement.translation + placement.rotation * (placement.scale * p);
    let square = placement.scale * placement.scale;
    let mut there = here.clone();
    there.camera = Camera {
        position: point(here.camera.position),
        target: point(here.camera.target),
        up: placement.rotation * here.camera.up,
        ..here.camera
    };
    for light in &mut there.lights {
        match light {
            Light::Point { position, intensity } => {
                (*position, *intensity) = (point(*position), *intensity * square);
            }
            Light::Directional { direction, .. } => *direction = placement.rotation * *direction,
            Light::Spot { position, direction, intensity, .. } => {
                (*position, *intensity) = (point(*position), *intensity * square);
                *direction = placement.rotation * *direction;
            }
        }
    }
    let mut host = Host::new(device, queue);
    host.put(&asset, placement);
    let got = host.draw(&host_frame(&there, None));
    // Rays through edges may take either face.
    let expected = expected(&asset, &here);
    let off = |k: usize| (0..3).map(|c| (got[k][c] - expected[k][c]).abs()).fold(0.0, f32::max);
    let wrong = (0..got.len()).filter(|k| off(*k) > 2e-3 * peak(&got)).count();
    assert!(peak(&got) > 0.1 && wrong < 20, "{wrong}");
}

#[test]
fn objects_attenuate_what_is_behind_them() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let asset = Object { extinction: [0.3, 0.6, 1.2], ..ball() }.build();
    let mut scene = scene(outside());
    // So far away that both are seen and lit alike.
    scene.camera.position = scene.camera.target + DVec3::new(0.0, 0.0, 4e3);
    scene.camera.vertical_fov_degrees = 0.05;
    scene.lights.retain(|l| matches!(l, Light::Directional { .. }));
    let mut host = Host::new(device, queue);
    host.put(&asset, Placement::IDENTITY);
    let alone = host.draw(&host_frame(&scene, None));
    host.background = 1.0;
    let over = host.draw(&host_frame(&scene, None));
    host.background = 0.0;
    let id = host.put(&asset, Placement { translation: DVec3::new(0.0, 0.0, -3.0), ..Placement::IDENTITY });
    let both = host.draw(&host_frame(&scene, None));
    let middle = (SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize;
    let through = [0, 1, 2].map(|c| over[middle][c] - alone[middle][c]);
    for (c, kappa) in [0.3f32, 0.6, 1.2].into_iter().enumerate() {
        assert!((through[c] - (-2.0 * kappa).exp()).abs() < 0.01, "{through:?}");
        let expected = alone[middle][c] * (1.0 + through[c]);
        assert!((both[middle][c] / expected - 1.0).abs() < 0.01, "{:?}", both[middle]);
    }
    // Outside, the host's colours stay, and alpha says what is covered.
    assert_eq!((over[0], alone[0]), ([1.0; 4], [0.0; 4]));
    assert!((alone[middle][3] - (1.0 - through.iter().sum::<f32>() / 3.0)).abs() < 0.01);
    host.renderer.remove_instance(id);
    assert_eq!(host.draw(&host_frame(&scene, None)), alone);
}

#[test]
fn opaque_surfaces_hide_what_is_behind_them() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let (asset, scene) = (ball().build(), scene(outside()));
    let mut host = Host::new(device, queue);
    host.put(&asset, Placement::IDENTITY);
    host.background = 0.5;
    let free = host.draw(&host_frame(&scene, None));
    let depth = texture(&host.device, wgpu::TextureFormat::Depth32Float);
    let view = depth.create_view(&Default::default());
    let projection = projection(&scene.camera);
    let mut with_wall = |distance: f32| {
        let clip = projection * Vec3::new(0.0, 0.0, -distance).extend(1.0);
        let mut encoder = host.device.create_command_encoder(&Default::default());
        clear(&mut encoder, None, Some((&view, clip.z / clip.w)));
        host.queue.submit([encoder.finish()]);
        host.draw(&host_frame(&scene, Some(HostDepth { view: &view, projection })))
    };
    let middle = (SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize;
    let centre = scene.camera.position.distance(scene.camera.target) as f32;
    // Behind the object, in front of it, through its middle.
    assert_eq!(with_wall(centre + 2.0), free);
    assert_eq!(with_wall(centre - 1.5), vec![[0.5; 4]; free.len()]);
    let half = with_wall(centre)[middle];
    let (kappa, through) = (4.0f32, 0.5 * (-4.0f32).exp());
    // Attenuation over one radius, and most of the light, for little comes from deeper.
    assert!(half[0] > 0.5 * free[middle][0] && half[0] < 1.1 * free[middle][0] + through, "{half:?}");
    assert!((half[3] - (0.5 * (-kappa).exp() + 1.0 - (-kappa).exp())).abs() < 0.02, "{half:?}");
}

#[test]
fn nothing_is_done_twice_and_nothing_out_of_sight() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let (asset, mut scene) = (ball().build(), scene(outside()));
    let mut host = Host::new(device, queue);
    let id = host.put(&asset, Placement::IDENTITY);
    let behind = scene.camera.position + 9.0 * (scene.camera.position - scene.camera.target);
    host.put(&asset, Placement { translation: behind, ..Placement::IDENTITY });
    let first = host.draw(&host_frame(&scene, None));
    let samples = asset.samples.len() as u64;
    let all =
        HostReport { drawn: 1, culled: 1, lit: 1, tiles: 1, draws: 1, samples, ..HostReport::default() };
    assert_eq!(host.renderer.report(), all);
    assert_eq!(host.draw(&host_frame(&scene, None)), first);
    assert_eq!(
        host.renderer.report(),
        HostReport { lit: 0, tiles: 0, draws: 0, samples: 0, reused: true, ..all }
    );
    scene.camera.position.x += 0.1;
    host.draw(&host_frame(&scene, None));
    assert_eq!(host.renderer.report(), HostReport { lit: 0, ..all });
    host.renderer.edit(id, &Edit { albedo: Some(DVec3::ZERO), ..Edit::default() }).unwrap();
    let black = host.draw(&host_frame(&scene, None));
    assert_eq!(host.renderer.report(), all);
    assert_eq!(peak(&black), 0.0);
    host.renderer.place(id, Placement { scale: 0.0, ..Placement::IDENTITY }).unwrap_err();
    host.renderer.remove_instance(id);
    tell(&host.renderer.place(id, Placement::IDENTITY).unwrap_err().to_string());
}

/// The coarser level has a quarter of the samples.
fn ball_of_two_levels() -> Asset {
    let mut asset = ball().build();
    let weight = vec![1.0; asset.samples.len() / 4];
    asset.levels.push(Level { width_factor: 1.6 * asset.info.width_factor, weight, error: None });
    asset
}

#[test]
fn a_level_fades_into_the_next() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let (asset, scene) = (ball_of_two_levels(), scene(outside()));
    let reach = details(&asset)[1].reach;
    let pixels = pixels_at_nearest(&Frame::new(&scene, &asset.info).unwrap(), &asset.info);
    // The coarse level reaches so many times as far as it may.
    let at = |excess: f32| {
        let fineness = Fineness { kernel_pixels: reach * pixels / excess, ..Fineness::DEFAULT };
        let options = Options { fineness, ..Options::new(FORMAT) };
        let mut host = Host::with(device.clone(), queue.clone(), options);
        host.put(&asset, Placement::IDENTITY);
        (host.draw(&host_frame(&scene, None)), host.renderer.report())
    };
    let ((fine, all), (coarse, few)) = (at(1.3), at(0.9));
    assert_eq!((all.samples, all.fading), (asset.samples.len() as u64, 0));
    assert_eq!((few.samples, few.fading), (asset.samples.len() as u64 / 4, 0));
    let apart = |a: &[[f32; 4]], b: &[[f32; 4]]| {
        let off = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
        a.iter().zip(b).map(off).fold(0.0, f32::max) / peak(&fine)
    };
    let whole = apart(&fine, &coarse);
    assert!(whole > 0.01, "{whole}");
    for share in [0.25f32, 0.5, 0.75] {
        let (both, report) = at(1.25 - 0.25 * share);
        assert_eq!((report.fading, report.lit, report.samples), (1, 2, all.samples + few.samples));
        let mix = |(f, c): (&[f32; 4], &[f32; 4])| {
            let mut mixed = *f;
            (0..3).for_each(|k| mixed[k] += share * (c[k] - f[k]));
            mixed
        };
        let expected: Vec<[f32; 4]> = fine.iter().zip(&coarse).map(mix).collect();
        // Targets are half floats.
        assert!(apart(&both, &expected) < 2e-3, "{share}: {}", apart(&both, &expected));
    }
}

#[test]
fn fineness_may_change_from_frame_to_frame() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let (asset, scene) = (ball_of_two_levels(), scene(outside()));
    let coarsest = Fineness { kernel_pixels: 1e3, ..Fineness::DEFAULT };
    let finest = Fineness { kernel_pixels: 0.0, ..Fineness::DEFAULT };
    let with = |fineness| {
        let options = Options { fineness, ..Options::new(FORMAT) };
        let mut host = Host::with(device.clone(), queue.clone(), options);
        host.put(&asset, Placement::IDENTITY);
        host
    };
    let frame = host_frame(&scene, None);
    let mut host = with(finest);
    for fineness in [finest, coarsest, coarsest, finest, coarsest] {
        host.renderer.set_fineness(fineness);
        assert_eq!(host.draw(&frame), with(fineness).draw(&frame), "{fineness:?}");
    }
    // Nothing is drawn anew where nothing is said.
    host.renderer.set_fineness(coarsest);
    host.draw(&frame);
    assert!(host.renderer.report().reused);
}
