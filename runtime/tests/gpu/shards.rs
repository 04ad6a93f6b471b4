//! Assets with more samples than an adapter binds at once: devices are told to bind less than they can, and hold the renderer to it.
//! And small pictures, whose samples several workgroups share.

use super::objects::{Object, ball, torus, uneven_grid};
use super::scenes::{self, level, outside, scene};
use super::{gpu, gpu_with};
use diaphane_formats::asset::{Asset, DensityGrid};
use diaphane_formats::directions::hash;
use diaphane_runtime::exact::{DepthTracer, ExactDepths};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::{GpuDevice, GpuRenderer, SplatPath, instance};
use diaphane_runtime::rendered::Rendered;
use diaphane_runtime::{Error, Result};
use half::f16;

/// Holds the spokes of 4,681 samples.
const MEBIBYTE: u64 = 1 << 20;

fn within(binding: u64, asset: &Asset, path: SplatPath) -> Result<GpuRenderer> {
    GpuRenderer::on(GpuDevice::open(&instance(), None)?.with_binding(binding)?, asset, Some(path))
}

/// Small, so that pixels' state fits too and is not drawn in tiles, whose rays meet other faces at edges.
fn frame(asset: &Asset, change: impl Fn(&mut diaphane_formats::scene::Scene)) -> Frame {
    let mut scene = scene(outside());
    (scene.image.width, scene.image.height, scene.image.samples_per_pixel) = (40, 36, 2);
    change(&mut scene);
    Frame::new(&scene, &asset.info).unwrap()
}

/// Largest difference as a share of the peak.
fn difference(a: &Rendered, b: &Rendered) -> f32 {
    let [a, b] = [a, b].map(|r| r.picture.pixels.as_flattened());
    let peak = b.iter().fold(0.0, |p: f32, v| p.max(*v));
    assert!(peak > 0.0);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / peak
}

fn compare(name: &str, asset: &Asset, frame: &Frame, exact: Option<&ExactDepths>, bound: f32) {
    for path in [SplatPath::Quads, SplatPath::Tiles] {
        let Some(mut whole) = gpu_with(asset, path) else { return };
        let mut cut = within(MEBIBYTE, asset, path).unwrap();
        assert_eq!((whole.shards(), cut.shards()), (1, 3), "{name}: {} samples", asset.samples.len());
        whole.set_workgroups(0);
        cut.set_workgroups(0);
        let expected = whole.render(frame, exact).unwrap();
        let got = cut.render(frame, exact).unwrap();
        assert_eq!(cut.tiles(), 1);
        let worst = difference(&got, &expected);
        println!("{name} by {}: {worst:.1e} of the peak", path.name());
        assert!(worst <= bound, "{name} by {}: {worst}", path.name());
        // Batches of 64 samples are cut at other places.
        let count = |r: &Rendered| {
            let mut counters = r.counters;
            (counters.census.batches, counters.census.batches_drawn) = (0, 0);
            counters
        };
        assert_eq!(count(&got), count(&expected), "{name} by {}", path.name());
        // What is kept from shard to shard is not kept from frame to frame.
        assert!(cut.render(frame, exact).unwrap().picture == got.picture);
        if path == SplatPath::Tiles {
            let one = Frame { samples_per_pixel: 1, ..frame.clone() };
            let expected_of_one = whole.render(&one, exact).unwrap();
            for mut renderer in [whole, cut] {
                renderer.set_workgroups(256);
                for (frame, expected) in [(&one, &expected_of_one), (frame, &expected)] {
                    let sliced = renderer.render(frame, exact).unwrap();
                    let (slices, rays) = (renderer.slices(), renderer.rays_at_once());
                    // Rays side by side come first.
                    assert!(slices >= 20 || rays > 1, "{name}: {slices} slices, {rays} rays");
                    assert!(rays == 1 || frame.samples_per_pixel > 1);
                    let worst = difference(&sliced, expected);
                    println!("{name} in {slices} slices, {rays} rays at once: {worst:.1e} of the peak");
                    assert!(worst <= bound, "{name} in slices: {worst}");
                    assert_eq!(count(&sliced), count(expected), "{name} in slices");
                }
            }
        }
    }
}

#[test]
fn an_asset_in_three_shards_is_the_same_picture() {
    let fine = Object { spacing: 0.073, ..ball() };
    let asset = fine.build();
    compare("ball", &asset, &frame(&asset, |_| ()), None, 1e-6);
    let crowd = frame(&asset, |s| s.lights = scenes::crowd(300));
    compare("ball, more lights than a dispatch takes", &asset, &crowd, None, 1e-6);
    let asset =
        Object { density: Some(uneven_grid()), ior: 1.5, extinction: [2.0, 5.0, 11.0], ..fine }.build();
    compare("uneven, coloured, glassy ball", &asset, &frame(&asset, |_| ()), None, 1e-6);
    let asset = Object { spacing: 0.0445, ..torus() }.build();
    let two_pieces = frame(&asset, |s| s.camera = level());
    compare("torus", &asset, &two_pieces, None, 1e-6);
    let lit_inside = frame(&asset, scenes::put_light_inside);
    let exact = DepthTracer::new(&asset).unwrap().trace(&lit_inside, &[0, lit_inside.scene_lights - 1]);
    compare("torus with exact depths", &asset, &lit_inside, Some(&exact), 1e-6);
}

#[test]
fn folded_lights_take_fewer_bands_where_their_table_does_not_fit() {
    let asset = Object { spacing: 0.073, ..ball() }.build();
    let suns = frame(&asset, |s| {
        s.camera = scenes::far();
        scenes::add_suns(s, 40);
    });
    // Seven bands instead of ten; of a wrong sample's they would be another picture.
    compare("folded lights", &asset, &suns, None, 0.02);
}

#[test]
fn materials_reach_all_shards() {
    let asset = Object { spacing: 0.073, ..ball() }.build();
    let Some(mut whole) = gpu(&asset) else { return };
    let mut cut = within(MEBIBYTE, &asset, SplatPath::Tiles).unwrap();
    let info = diaphane_formats::asset::Info { extinction: [2.0, 5.0, 8.0], ..asset.info.clone() };
    whole.set_material(&info);
    cut.set_material(&info);
    let frame = frame(&asset, |_| ());
    let (got, expected) = (cut.render(&frame, None).unwrap(), whole.render(&frame, None).unwrap());
    assert!(difference(&got, &expected) <= 1e-6);
}

#[test]
fn a_mesh_in_parts_is_the_same_picture() {
    let plain = Object { spacing: 0.15, ..torus() };
    let glassy = Object { spacing: 0.3, ior: 1.4, ..ball() };
    for (name, object) in [("torus", plain), ("glassy ball", glassy)] {
        let asset = object.build();
        let frame = frame(&asset, |s| {
            s.surface.reflection = true;
            s.camera = level();
        });
        let Some(mut whole) = gpu(&asset) else { return };
        // Holds the four pieces of all pixels.
        let mut cut = within(96 << 10, &asset, whole.path()).unwrap();
        [&mut whole, &mut cut].into_iter().for_each(|r| r.set_workgroups(0));
        let expected = whole.render(&frame, None).unwrap();
        let got = cut.render(&frame, None).unwrap();
        assert_eq!((cut.tiles(), whole.mesh_parts()), (1, 1), "{name}");
        assert!(cut.mesh_parts() >= 2, "{name}: {} parts", cut.mesh_parts());
        println!("{name}: {} parts", cut.mesh_parts());
        assert!(got.picture == expected.picture && got.counters == expected.counters, "{name}");
    }
}

#[test]
fn a_grid_in_slabs_is_the_same_picture() {
    let size = [72u32, 70, 80];
    let value = |i: u64| {
        let density = 0.3 + 1.6 * (hash(11, i) >> 40) as f32 / (1u64 << 24) as f32;
        [f16::from_f32(density), f16::from_f32(0.7 * density)]
    };
    let values = (0..size.iter().map(|n| u64::from(*n)).product()).map(value).collect();
    let density = Some(DensityGrid { size, min: [-1.1; 3], max: [1.1; 3], values });
    let asset = Object { spacing: 0.25, density, ..ball() }.build();
    let Some(mut whole) = gpu(&asset) else { return };
    let frame = frame(&asset, |_| ());
    // A slab of 52 layers, and the rest.
    let mut cut = within(MEBIBYTE, &asset, whole.path()).unwrap();
    [&mut whole, &mut cut].into_iter().for_each(|r| r.set_workgroups(0));
    assert_eq!((whole.grid_slabs(), cut.grid_slabs(), cut.tiles(), cut.shards()), (1, 2, 0, 1));
    let (got, expected) = (cut.render(&frame, None).unwrap(), whole.render(&frame, None).unwrap());
    assert_eq!(cut.tiles(), 1);
    // The two programs differ by a choice of buffer; a compiler of hardware's may round each its own way.
    let bound = if whole.adapter().contains("software") { 0.0 } else { 1e-6 };
    let off = difference(&got, &expected);
    println!("slabs: {off:e} of the peak");
    assert!(off <= bound && got.counters == expected.counters, "{off:e}");
}

#[test]
fn what_cannot_be_cut_is_refused_with_the_limit_and_the_way_out() {
    let asset = Object { spacing: 0.3, ..ball() }.build();
    if gpu(&asset).is_none() {
        return;
    }
    // Samples: the neighbours of 64 of them are 14 kB.
    let error = within(8 << 10, &asset, SplatPath::Tiles).err().unwrap();
    let line = error.to_string();
    assert!(matches!(error, Error::Gpu(_)), "{line}");
    for part in ["samples", "max_storage_buffer_binding_size", "CPU backend"] {
        assert!(line.contains(part), "{line}");
    }
    assert!(!line.contains('\n'), "{line}");
}
