//! Rays of a small picture that are drawn side by side, as tiles of their own.

use crate::gpu_with;
use crate::objects::{Object, ball, torus, uneven_grid};
use crate::scenes::{far, level, outside, scene};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::SplatPath;
use diaphane_runtime::rendered::Rendered;

fn difference(a: &Rendered, b: &Rendered) -> f32 {
    let [a, b] = [a, b].map(|r| r.picture.pixels.as_flattened());
    let peak = b.iter().fold(0.0, |p: f32, v| p.max(*v));
    assert!(peak > 0.0);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / peak
}

#[test]
fn rays_side_by_side_make_the_same_picture() {
    let glassy = Object { ior: 1.4, ..ball() };
    let uneven = Object { density: Some(uneven_grid()), ..ball() };
    let objects = [("torus", torus()), ("glassy", glassy), ("uneven", uneven)];
    for (name, object) in objects {
        let asset = Object { spacing: 0.25, ..object }.build();
        let Some(mut renderer) = gpu_with(&asset, SplatPath::Tiles) else { return };
        // All at once; four, four and one; as many as before, with other slices; too many pixels for two of them.
        let views = [(far(), 5, 64, 5), (level(), 9, 4, 4), (outside(), 16, 400, 12), (outside(), 3, 0, 1)];
        for (camera, rays, times, at_once) in views {
            let mut scene = scene(camera);
            scene.surface.reflection = true;
            scene.image.samples_per_pixel = rays;
            let frame = Frame::new(&scene, &asset.info).unwrap();
            renderer.set_workgroups(0);
            let expected = renderer.render(&frame, None).unwrap();
            assert_eq!(renderer.rays_at_once(), 1);
            renderer.set_workgroups(42 * times);
            let got = renderer.render(&frame, None).unwrap();
            let off = difference(&got, &expected);
            println!("{name}: {rays} rays, {} at once, {off:e} of the peak", renderer.rays_at_once());
            assert!(
                renderer.rays_at_once() >= at_once.min(rays as usize),
                "{name}: {}",
                renderer.rays_at_once()
            );
            assert!(off <= 1e-6, "{name}: {off:e}");
            assert_eq!(got.picture.coverage, expected.picture.coverage, "{name}");
            assert_eq!(got.counters, expected.counters, "{name}");
        }
    }
}
