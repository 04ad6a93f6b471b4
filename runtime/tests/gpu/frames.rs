//! Frame after frame on the GPU: what comes back goes through buffers and pictures that are kept.

use crate::objects::{Object, ball};
use crate::scenes::{far, level, outside, scene};
use crate::{gpu, gpu_with};
use diaphane_formats::asset::Asset;
use diaphane_formats::scene::Camera;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{GpuDevice, GpuRenderer, SplatPath};
use diaphane_runtime::player::{Backend, LightMode, Player};
use diaphane_runtime::rendered::Rendered;
use diaphane_runtime::wgpu;
use glam::DVec3;

/// Of several sizes, numbers of rays and areas; the last one sees nothing.
fn frames(asset: &Asset) -> Vec<Frame> {
    let beside = Camera { target: DVec3::new(90.0, -20.0, 5.0), ..outside() };
    let views = [
        (outside(), [112, 96], 1),
        (Camera { vertical_fov_degrees: 80.0, ..far() }, [112, 96], 1),
        (level(), [112, 96], 3),
        (level(), [31, 17], 1),
        (far(), [64, 200], 2),
        (beside, [112, 96], 1),
    ];
    let frame = |(camera, [width, height], rays): (Camera, [u32; 2], u32)| {
        let mut scene = scene(camera);
        (scene.image.width, scene.image.height, scene.image.samples_per_pixel) = (width, height, rays);
        Frame::new(&scene, &asset.info).unwrap()
    };
    views.map(frame).into()
}

fn without_times(rendered: Rendered) -> Rendered {
    Rendered { passes: Vec::new(), ..rendered }
}

#[test]
fn frames_in_kept_buffers_are_those_of_a_new_renderer() {
    let asset = Object { spacing: 0.3, ..ball() }.build();
    for path in [SplatPath::Quads, SplatPath::Tiles] {
        let Some(mut kept) = gpu_with(&asset, path) else { return };
        let frames = frames(&asset);
        let anew: Vec<Rendered> = frames
            .iter()
            .map(|f| without_times(gpu_with(&asset, path).unwrap().render(f, None).unwrap()))
            .collect();
        assert!(anew[0].counters.rays_hit > 0 && anew[5].counters.rays_hit == 0);
        for k in 0..3 * frames.len() {
            let view = k * 5 % 6;
            let rendered = without_times(kept.render(&frames[view], None).unwrap());
            assert!(rendered == anew[view], "frame {k}, view {view}, by {}", path.name());
        }
        // Single rays with their pieces in between.
        let rays = kept.trace_rays(&frames[3], None, [0.5; 2]).unwrap();
        assert!(rays == gpu_with(&asset, path).unwrap().trace_rays(&frames[3], None, [0.5; 2]).unwrap());
        assert!(without_times(kept.render(&frames[2], None).unwrap()) == anew[2]);
    }
}

#[test]
fn a_frame_makes_no_buffers_that_stay() {
    let asset = Object { spacing: 0.3, ..ball() }.build();
    if gpu(&asset).is_none() {
        return;
    }
    // One of its own: all others share the process's.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle().with_env());
    let device = GpuDevice::open(&instance, None).unwrap();
    let mut renderer = GpuRenderer::on(device, &asset, Some(SplatPath::Quads)).unwrap();
    let frames = frames(&asset);
    let alive = || instance.generate_report().unwrap().hub.buffers.num_allocated;
    let mut after = Vec::new();
    for _ in 0..4 {
        frames.iter().for_each(|f| drop(renderer.render(f, None).unwrap()));
        after.push(alive());
    }
    assert!(after[0] > 10 && after[1..].iter().all(|n| *n == after[1]), "{after:?}");
}

#[test]
fn a_player_says_why_it_sums_kernels_in_its_way() {
    let asset = Object { spacing: 0.3, ..ball() }.build();
    if gpu(&asset).is_none() {
        return;
    }
    let mut asked = Player::with_path(&asset, Backend::Gpu, Some(SplatPath::Tiles)).unwrap();
    assert_eq!((asked.path(), asked.why_path()), (Some(SplatPath::Tiles), Some("asked for")));
    let player = Player::new(&asset, Backend::Gpu).unwrap();
    let software = player.describe().1.ends_with("software)");
    assert_eq!(player.why_path().unwrap().contains("software"), software);
    let frame = &frames(&asset)[0];
    let timed = asked.has_clock().unwrap();
    let rendered = asked.render(frame, LightMode::Baked).unwrap();
    assert_eq!(rendered.passes.iter().any(|(name, _)| *name == "frame"), !timed);
    let cpu = Player::new(&asset, Backend::Cpu).unwrap();
    assert_eq!((cpu.path(), cpu.why_path(), cpu.has_clock()), (None, None, None));
}
