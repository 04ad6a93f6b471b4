//! Small objects that are drawn together.

use super::host::{FORMAT, Host, clear, device, host_frame, peak, projection, texture};
use super::objects::{Object, ball};
use super::scenes::{outside, scene};
use diaphane_formats::asset::Asset;
use diaphane_formats::directions::even_directions;
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::{Light, Scene};
use diaphane_runtime::detail::Fineness;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::gpu::{GpuDevice, HostDepth, Options, SplatPath};
use diaphane_runtime::placement::Placement;
use diaphane_runtime::wgpu;
use glam::{DQuat, DVec3, Vec3};

fn options(path: SplatPath) -> Options {
    let fineness = Fineness { kernel_pixels: 0.0, ..Fineness::DEFAULT };
    Options { path: Some(path), fineness, ..Options::new(FORMAT) }
}

/// Twelve objects side by side as the camera of `scene` sees them, `apart` from each other, some turned.
fn places(scene: &Scene, asset: &Asset, apart: f64) -> Vec<Placement> {
    let camera = &scene.camera;
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let one = |k: u32| {
        let (column, row) = (f64::from(k % 4) - 1.5, f64::from(k / 4) - 1.0);
        let scale = 0.16 + 0.006 * f64::from(k);
        let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.4 * f64::from(k));
        let centre = camera.target + apart * (column * right + row * up) + 0.05 * f64::from(k % 5) * forward;
        let translation = centre - rotation * (scale * DVec3::from(asset.info.centre));
        Placement { translation, rotation, scale }
    };
    (0..12).map(one).collect()
}

fn kinds() -> [Object; 3] {
    [
        Object { spacing: 0.3, ..ball() },
        Object { spacing: 0.3, ior: 1.3, phase: Phase::HenyeyGreenstein { g: 0.4 }, ..ball() },
        Object { spacing: 0.3, density: Some(super::uneven_grid()), extinction: [2.0, 4.0, 8.0], ..ball() },
    ]
}

#[test]
fn what_is_drawn_together_looks_as_if_drawn_alone() {
    let Some(gpu) = device() else { return };
    let software = gpu.is_software();
    let GpuDevice { device, queue, .. } = gpu;
    for (k, object) in kinds().into_iter().enumerate() {
        let (asset, mut scene) = (object.build(), scene(outside()));
        scene.surface.reflection = true;
        if k != 1 {
            // So many that they are folded.
            let sun = |d: DVec3| Light::Directional { direction: d, irradiance: DVec3::splat(0.05) };
            scene.lights.extend(even_directions(64, 3).into_iter().map(sun));
        }
        // An opaque wall through the middle of some.
        let wall = texture(&device, wgpu::TextureFormat::Depth32Float);
        let view = wall.create_view(&Default::default());
        let projection = projection(&scene.camera);
        let distance = scene.camera.position.distance(scene.camera.target) as f32;
        let clip = projection * Vec3::new(0.0, 0.0, -distance).extend(1.0);
        let mut encoder = device.create_command_encoder(&Default::default());
        clear(&mut encoder, None, Some((&view, clip.z / clip.w)));
        queue.submit([encoder.finish()]);
        let depth = (k > 0).then_some(HostDepth { view: &view, projection });

        let places = places(&scene, &asset, 0.52);
        let mut host = Host::with(device.clone(), queue.clone(), options(SplatPath::Tiles));
        let id = host.renderer.add_asset(&device, &asset).unwrap();
        for place in &places {
            host.renderer.add_instance(id, *place).unwrap();
        }
        let got = host.draw(&host_frame(&scene, depth));
        let report = host.renderer.report();
        assert_eq!((report.drawn, report.lit, report.draws), (12, 12, 1));

        let mut expected = vec![[0.0f32; 4]; got.len()];
        let mut alone = Host::with(device.clone(), queue.clone(), options(SplatPath::Tiles));
        let id = alone.renderer.add_asset(&device, &asset).unwrap();
        let mut shown = 0;
        for place in &places {
            let instance = alone.renderer.add_instance(id, *place).unwrap();
            let one = alone.draw(&host_frame(&scene, depth));
            assert_eq!(alone.renderer.report().draws, 1);
            shown += usize::from(peak(&one) > 0.0);
            alone.renderer.remove_instance(instance);
            for (sum, pixel) in expected.iter_mut().zip(&one) {
                (0..4).for_each(|c| sum[c] += pixel[c]);
            }
        }
        // Some are behind the wall.
        assert!(shown >= 9, "kind {k}: {shown}");
        let worst = got.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
        let worst = worst.fold(0.0, f32::max) / peak(&got);
        // Where workgroups share tiles, as many as keep hardware busy, fewer tiles are cut into more slices; targets are half floats.
        assert!(worst <= if software { 0.0 } else { 1e-3 }, "kind {k}: {worst}");
    }
}

#[test]
fn what_overlaps_is_composed_in_order_and_only_what_changes_is_lit() {
    let Some(GpuDevice { device, queue, .. }) = device() else { return };
    let (asset, scene) = (Object { extinction: [1.0, 2.0, 4.0], ..ball() }.build(), scene(outside()));
    let places = places(&scene, &asset, 0.2);
    let picture = |path: SplatPath| {
        let mut host = Host::with(device.clone(), queue.clone(), options(path));
        let id = host.renderer.add_asset(&device, &asset).unwrap();
        let ids: Vec<_> = places.iter().map(|p| host.renderer.add_instance(id, *p).unwrap()).collect();
        let all = host.draw(&host_frame(&scene, None));
        let draws = host.renderer.report().draws;
        // One gets a material of its own, another leaves, a third moves.
        let edit = Edit { albedo: Some(DVec3::new(0.2, 0.9, 0.2)), ..Edit::default() };
        host.renderer.edit(ids[3], &edit).unwrap();
        host.renderer.remove_instance(ids[7]);
        let moved = Placement { translation: places[5].translation + 0.1 * DVec3::Y, ..places[5] };
        host.renderer.place(ids[5], moved).unwrap();
        let changed = host.draw(&host_frame(&scene, None));
        assert_eq!((host.renderer.report().lit, host.renderer.report().drawn), (2, 11));
        (draws, all, changed)
    };
    let (together, all, changed) = picture(SplatPath::Tiles);
    let (singly, expected, changed_singly) = picture(SplatPath::Quads);
    assert_eq!((together, singly), (1, 12));
    assert!(all != changed);
    for (a, b) in [(all, expected), (changed, changed_singly)] {
        let worst = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs());
        // Both are rounded to sixteen bits.
        assert!(worst.fold(0.0, f32::max) <= 2e-3 * peak(&a));
    }
}
