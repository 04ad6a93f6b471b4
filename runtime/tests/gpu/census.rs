//! What is left out of a picture: counted alike on both backends, and never seen.

use super::gpu_with;
use super::objects::{Object, ball, torus, uneven_grid};
use super::scenes::{self, inside, level, outside, scene};
use diaphane_formats::asset::Asset;
use diaphane_formats::hits::{Hit, Hits};
use diaphane_formats::kernel::CUT_OFF_RADIUS;
use diaphane_formats::reconstruct::{Along, Cloud};
use diaphane_formats::scene::{Camera, Light};
use diaphane_runtime::cpu::CpuRenderer;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::SplatPath;
use diaphane_runtime::rendered::{Census, RayResult};
use glam::{DVec3, Vec3};

fn frame(asset: &Asset, camera: Camera) -> Frame {
    let mut scene = scene(camera);
    scene.image.samples_per_pixel = 2;
    Frame::new(&scene, &asset.info).unwrap()
}

/// Counts on the GPU, both ways, after a comparison with those of the CPU.
fn census(name: &str, asset: &Asset, frame: &Frame) -> Option<Census> {
    let mut cpu = CpuRenderer::new(asset).unwrap();
    assert_eq!(cpu.render(frame, None).counters.census, Census::default(), "nobody asked");
    cpu.set_counting(true);
    let expected = cpu.render(frame, None).counters.census;
    let mut quads = None;
    for path in [SplatPath::Tiles, SplatPath::Quads] {
        let got = gpu_with(asset, path)?.render(frame, None).unwrap().counters.census;
        println!("{name} by {}: {got:?} against {expected:?}", path.name());
        let classes = |c: &Census| {
            let other = [c.samples_apart, c.samples_hidden, c.samples_shown];
            [&[c.samples_dark, c.samples_out_of_view, c.samples_between_rays][..], &other].concat()
        };
        assert_eq!(classes(&got).iter().sum::<u64>(), 2 * asset.samples.len() as u64);
        // Rounding may turn a kernel that ends where a ray or a cell begins.
        for (a, b) in classes(&got).into_iter().zip(classes(&expected)) {
            assert!(a.abs_diff(b) <= 3, "{name}: {got:?} against {expected:?}");
        }
        let rest = |c: Census| (c.views, c.tiles, c.pieces, c.pieces_empty);
        assert_eq!(rest(got), rest(expected), "{name}");
        assert!(got.tiles_empty.abs_diff(expected.tiles_empty) <= 1, "{name}");
        let batches = 2 * asset.samples.len().div_ceil(64) as u64;
        if path == SplatPath::Quads {
            let occur = (got.pieces - got.pieces_empty) / 2;
            assert_eq!(got.batches, batches * occur);
            assert!(got.batches_drawn <= got.batches && (got.batches_drawn > 0) == (got.samples_shown > 0));
        } else {
            assert_eq!((got.batches, got.batches_drawn), (0, 0));
        }
        quads = Some(got);
    }
    quads
}

#[test]
fn samples_are_counted_alike() {
    let mut asset = ball().build();
    asset.samples.weight.iter_mut().step_by(10).for_each(|w| *w = 0.0);
    let Some(seen) = census("ball", &asset, &frame(&asset, outside())) else { return };
    assert_eq!(seen.samples_dark, 2 * asset.samples.len().div_ceil(10) as u64);
    assert_eq!((seen.samples_out_of_view, seen.samples_hidden), (0, 0));
    // 112 x 96 pixels are 7 x 6 tiles; the ball covers half of the picture and is one piece.
    assert_eq!((seen.views, seen.tiles, seen.pieces, seen.pieces_empty), (2, 84, 8, 6));
    assert!(seen.tiles_empty > 10 && seen.tiles_empty < 42, "{seen:?}");

    let near = Camera { vertical_fov_degrees: 6.0, ..outside() };
    let seen = census("a part of it", &asset, &frame(&asset, near)).unwrap();
    assert!(seen.samples_out_of_view * 2 > asset.samples.len() as u64 && seen.tiles_empty == 0, "{seen:?}");
    census("from inside", &asset, &frame(&asset, inside())).unwrap();

    let small = Camera { vertical_fov_degrees: 150.0, ..scenes::far() };
    let seen = census("a dot", &asset, &frame(&asset, small)).unwrap();
    assert!(seen.samples_between_rays > 0, "{seen:?}");

    let away = Camera { target: outside().position * 2.0 - outside().target, ..outside() };
    let seen = census("behind the camera", &asset, &frame(&asset, away)).unwrap();
    assert_eq!((seen.samples_shown, seen.pieces_empty, seen.tiles_empty), (0, seen.pieces, seen.tiles));

    let asset = torus().build();
    let seen = census("torus", &asset, &frame(&asset, level())).unwrap();
    assert_eq!(seen.pieces_empty, 4);
}

#[test]
fn a_narrow_view_draws_few_batches() {
    // Samples that follow each other must lie together, as a bake puts them.
    let mut asset = Object { spacing: 0.1, ..ball() }.build();
    let samples = &mut asset.samples;
    samples.position_radius.sort_by_key(|p| {
        let cell = |x: f32| (2.0 * (x + 1.0)) as i32;
        (cell(p[0]), cell(p[1]), cell(p[2]))
    });
    let narrow = Camera { vertical_fov_degrees: 6.0, ..outside() };
    let Some(seen) = census("narrow", &asset, &frame(&asset, narrow)) else { return };
    assert!(seen.batches_drawn * 3 < seen.batches * 2, "{seen:?}");
}

/// A ball of 80 mean free paths, lit from behind: the brightest samples are hidden.
fn dense() -> (Object, Frame) {
    let object = Object { extinction: [40.0, 60.0, 90.0], ..ball() };
    let asset = object.build();
    let mut scene = scene(outside());
    let behind = scene.camera.target * 2.0 - scene.camera.position;
    scene.lights =
        vec![Light::Point { position: behind + DVec3::new(0.0, 1.5, 0.0), intensity: DVec3::splat(30.0) }];
    (object, Frame::new(&scene, &asset.info).unwrap())
}

#[test]
fn what_is_hidden_is_not_seen() {
    let (object, frame) = dense();
    let asset = object.build();
    let cpu = CpuRenderer::new(&asset).unwrap();
    let sources = cpu.sources(&frame, None);
    let seen = cpu.trace_rays(&frame, &sources, [0.5; 2]);
    // All kernels of every ray, whatever is in front of them.
    let cloud = Cloud::new(&asset.samples, asset.info.width_factor);
    let along = Along::Uniform(DVec3::from(asset.info.extinction).as_vec3());
    let mut hits = Hits::default();
    let pixels = (0..frame.height).flat_map(|y| (0..frame.width).map(move |x| (x, y)));
    let expected: Vec<Vec3> = pixels
        .zip(&seen)
        .map(|((x, y), ray)| {
            let direction = frame.view.direction(x as f32 + 0.5, y as f32 + 0.5, frame.width, frame.height);
            hits.clear();
            for (i, source) in sources.iter().enumerate() {
                let centre = cloud.centre[i] - frame.view.origin;
                let hit = Hit::new(centre, direction, cloud.sharpness[i], cloud.weight[i], source);
                hit.into_iter().for_each(|hit| hits.push(hit));
            }
            let (start, end) = ray.pieces[0];
            if ray.count == 0 { Vec3::ZERO } else { hits.piece_radiance(start, end, &along).radiance }
        })
        .collect();
    let peak = expected.iter().map(|v| v.max_element()).fold(0.0, f32::max);
    let worst = |got: &[Vec3]| {
        let far = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element();
        got.iter().zip(&expected).map(far).fold(0.0, f32::max) / peak
    };
    let got: Vec<Vec3> = seen.iter().map(|r| r.radiance.into()).collect();
    println!("CPU: {:.1e} of the peak", worst(&got));
    assert!(peak > 0.0 && worst(&got) <= 1e-6, "{}", worst(&got));

    for path in [SplatPath::Quads, SplatPath::Tiles] {
        let Some(mut gpu) = gpu_with(&asset, path) else { return };
        let rays = gpu.trace_rays(&frame, None, [0.5; 2]).unwrap();
        let same = |(got, cpu): (&RayResult, &RayResult)| {
            // Where the backends meet different faces at an edge there is nothing to compare.
            if got.pieces[0] == cpu.pieces[0] { got.radiance.into() } else { Vec3::NAN }
        };
        let got: Vec<Vec3> = rays.iter().zip(&seen).map(same).collect();
        let met = got.iter().filter(|v| !v.is_nan()).count();
        println!("{} on {met} rays: {:.1e} of the peak", path.name(), worst(&got));
        // What the backends may differ by.
        assert!(met * 2 > got.len() && worst(&got) <= 1e-4, "{}: {}", path.name(), worst(&got));
        // What the hidden ones are good for, on the same adapter.
        gpu.set_sight(false);
        let with_hidden = gpu.trace_rays(&frame, None, [0.5; 2]).unwrap();
        let off = |(a, b): (&RayResult, &RayResult)| {
            (Vec3::from(a.radiance) - Vec3::from(b.radiance)).abs().max_element()
        };
        let hidden = rays.iter().zip(&with_hidden).map(off).fold(0.0, f32::max) / peak;
        println!("{}: hidden samples bring {hidden:.1e} of the peak", path.name());
        assert!(hidden <= 2e-6, "{}: {hidden}", path.name());
        let counts = gpu.render(&frame, None).unwrap().counters;
        assert_eq!(counts.census.samples_hidden, 0);
    }
    let Some(counts) = census("dense ball", &asset, &frame_of_two(&frame)) else { return };
    assert!(counts.samples_hidden * 5 > 2 * asset.samples.len() as u64, "{counts:?}");
}

/// The same with two rays a pixel.
fn frame_of_two(frame: &Frame) -> Frame {
    Frame { samples_per_pixel: 2, ..frame.clone() }
}

#[test]
fn a_medium_of_varying_density_hides_by_its_least() {
    let (object, frame) = dense();
    let asset = Object { density: Some(uneven_grid()), ..object }.build();
    let least = asset.density.as_ref().unwrap().values.iter().map(|v| v[0].to_f32()).fold(1e9, f32::min);
    let Some(counts) = census("uneven dense ball", &asset, &frame_of_two(&frame)) else { return };
    assert!(counts.samples_hidden > 0, "{counts:?}");
    // Nearer than 16 depths of the least density nothing is: how many kernels there are at most behind so much of the ball.
    let sight = 16.0 / (40.0 * least);
    let behind = |p: &[f32; 4]| {
        let centre = Vec3::new(p[0], p[1], p[2]) - frame.view.origin;
        let reach = CUT_OFF_RADIUS / diaphane_formats::kernel::sharpness(p[3], asset.info.width_factor);
        centre.length() - reach > frame.view.origin.length() - 1.0 + sight
    };
    let most = asset.samples.position_radius.iter().filter(|p| behind(p)).count() as u64;
    assert!(counts.samples_hidden <= 2 * most, "{counts:?}, {most}");
}
