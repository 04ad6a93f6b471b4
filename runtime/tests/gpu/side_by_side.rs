//! Rays of a small picture that are drawn side by side, as tiles of their own.

use crate::gpu_with;
use crate::objects::{Object, ball, torus, uneven_grid};
use crate::scenes::{far, inside, level, scene};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::SplatPath;
use diaphane_runtime::rendered::Rendered;

fn difference(a: &Rendered, b: &Rendered) -> f32 {
    let [a, b] = [a, b].map(|r| r.picture.pixels.as_flattened());
    let peak = b.iter().fold(0.0, |p: f32, v| p.max(*v));
    assert!(peak > 0.0);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / peak
}

/// Squares of 16 × 16 pixels of the pictures, 112 × 96 pixels.
const SQUARES: u32 = 42;

#[test]
fn rays_side_by_side_make_the_same_picture() {
    let glassy = Object { ior: 1.4, ..ball() };
    let uneven = Object { density: Some(uneven_grid()), ..ball() };
    let objects = [("torus", torus()), ("glassy", glassy), ("uneven", uneven)];
    for (name, object) in objects {
        let asset = Object { spacing: 0.25, ..object }.build();
        let Some(mut renderer) = gpu_with(&asset, SplatPath::Tiles) else { return };
        // All at once; some, and the rest; as many as 131,072 pixels hold.
        for (camera, rays, workgroups) in [(far(), 5, 64), (level(), 9, 4), (inside(), 16, 400)] {
            let mut scene = scene(camera);
            scene.surface.reflection = true;
            scene.image.samples_per_pixel = rays;
            let frame = Frame::new(&scene, &asset.info).unwrap();
            renderer.set_workgroups(0);
            let expected = renderer.render(&frame, None).unwrap();
            assert_eq!(renderer.rays_at_once(), 1);
            renderer.set_workgroups(SQUARES * workgroups);
            let got = renderer.render(&frame, None).unwrap();
            let (off, at_once) = (difference(&got, &expected), renderer.rays_at_once());
            println!("{name}: {rays} rays, {at_once} at once, {off:e} of the peak");
            match rays {
                5 => assert_eq!(at_once, 5, "{name}"),
                9 => assert!((4..9).contains(&at_once), "{name}: {at_once}"),
                _ => assert_eq!(at_once, (1 << 17) / (112 * 96), "{name}"),
            }
            same(name, &got, &expected);
            assert_eq!(got.counters, expected.counters, "{name}");
        }
    }
}

#[test]
fn little_memory_draws_fewer_side_by_side() {
    let asset = Object { spacing: 0.15, ..ball() }.build();
    let Some(mut renderer) = gpu_with(&asset, SplatPath::Tiles) else { return };
    let mut scene = scene(inside());
    scene.image.samples_per_pixel = 5;
    let frame = Frame::new(&scene, &asset.info).unwrap();
    renderer.set_workgroups(0);
    let expected = renderer.render(&frame, None).unwrap();
    renderer.set_workgroups(SQUARES * 64);
    let mut seen = Vec::new();
    for kibibytes in [64 << 10, 6 << 10, 1 << 10, 256] {
        renderer.limit_memory(kibibytes << 10);
        let got = renderer.render(&frame, None).unwrap();
        seen.push((renderer.tiles(), renderer.rays_at_once(), renderer.slices()));
        same("ball", &got, &expected);
        assert_eq!(got.counters.splats, expected.counters.splats);
    }
    println!("tiles, rays, slices: {seen:?}");
    assert!(seen[0].0 == 1 && seen[0].1 == 5 && seen[0].2 > 1, "{seen:?}");
    assert!(seen[1].0 == 1 && (1..5).contains(&seen[1].1), "{seen:?}");
    assert!(seen[3].0 > seen[2].0 && seen[2].0 > 1, "{seen:?}");
}

fn same(name: &str, got: &Rendered, expected: &Rendered) {
    let off = difference(got, expected);
    assert!(off <= 1e-6, "{name}: {off:e}");
    assert_eq!(got.picture.coverage, expected.picture.coverage, "{name}");
}
