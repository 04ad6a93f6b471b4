//! A thousand frames with changing cameras, lights, sizes and assets: nothing that was made for one frame is kept. What the
//! device's objects are is counted, not the memory of the process: software drivers keep some for every dispatch.

use super::gpu;
use super::host::{FORMAT, host_frame, texture};
use super::objects::{Object, ball, torus};
use super::scenes::{add_suns, outside, scene};
use diaphane_formats::scene::Camera;
use diaphane_runtime::gpu::{GpuDevice, HostFrame, Options, Renderer};
use diaphane_runtime::placement::Placement;
use diaphane_runtime::wgpu;
use glam::DVec3;

const FRAMES: usize = 1000;
/// Frames after which each half of the rest is looked at: the first ones find out how much drivers keep.
const WARM: usize = 300;

/// Buffers, textures, groups, pipelines and the like that are alive.
fn alive(instance: &wgpu::Instance) -> usize {
    let hub = instance.generate_report().unwrap().hub;
    [
        hub.buffers,
        hub.textures,
        hub.texture_views,
        hub.bind_groups,
        hub.bind_group_layouts,
        hub.pipeline_layouts,
        hub.shader_modules,
        hub.render_pipelines,
        hub.compute_pipelines,
        hub.command_buffers,
    ]
    .map(|kind| kind.num_allocated)
    .iter()
    .sum()
}

#[test]
fn a_thousand_frames_keep_no_more_than_a_few() {
    if gpu(&ball().build()).is_none() {
        return;
    }
    // One of its own: all others share the process's.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle().with_env());
    let GpuDevice { device, queue, .. } = GpuDevice::open(&instance, None).unwrap();
    let mut renderer = Renderer::new(&device, Options::new(FORMAT)).unwrap();
    let view = texture(&device, FORMAT).create_view(&Default::default());
    let assets = [ball().build(), torus().build(), Object { ior: 1.3, ..ball() }.build()];
    let mut shown = Vec::new();
    let mut most = [0; 2];
    for k in 0..FRAMES {
        if k % 100 == 0 {
            // One asset goes, another one comes.
            let id = renderer.add_asset(&device, &assets[k / 100 % 3]).unwrap();
            renderer.add_instance(id, Placement::IDENTITY).unwrap();
            shown.push(id);
            if shown.len() > 2 {
                renderer.remove_asset(shown.remove(0));
            }
        }
        let turn = 0.05 * k as f64;
        let position = DVec3::new(3.0 * turn.sin(), 0.5, 3.0 * turn.cos());
        let mut scene = scene(Camera { position, target: DVec3::ZERO, ..outside() });
        add_suns(&mut scene, k % 40);
        let size = [40 + 8 * (k as u32 / 10 % 4), 40];
        let frame = HostFrame { size, ..host_frame(&scene, None) };
        let mut encoder = device.create_command_encoder(&Default::default());
        renderer.prepare(&device, &queue, &mut encoder, &frame).unwrap();
        renderer.render_to_texture(&mut encoder, &view, true);
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        if k >= WARM {
            let half = usize::from(k >= WARM.midpoint(FRAMES));
            most[half] = most[half].max(alive(&instance));
        }
    }
    println!("{} objects of the device, then {}", most[0], most[1]);
    assert!(most[0] > 20 && most[1] <= most[0], "{} objects of the device, then {}", most[0], most[1]);
}
