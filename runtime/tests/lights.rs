//! Many lights: what is folded comes out as if evaluated one by one, what reaches nothing is left out, and lighting runs
//! only where it must.

mod support;

use diaphane_formats::asset::Asset;
use diaphane_formats::directions::even_directions;
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::Light;
use diaphane_runtime::cpu::lighting::Lighting;
use diaphane_runtime::fold::{MOST_SINGLE, Plan};
use diaphane_runtime::frame::{Frame, LightKind};
use diaphane_runtime::player::{Backend, LightMode, Player};
use diaphane_runtime::rendered::Rendered;
use glam::{DVec3, Vec3};
use support::{ball, point, scene};

const HERE: DVec3 = DVec3::new(3.0, 1.0, -2.0);

/// Suns in even directions, each of another colour, brighter from one side.
fn suns(count: usize) -> Vec<Light> {
    let sun = |(k, d): (usize, DVec3)| Light::Directional {
        direction: d,
        irradiance: DVec3::new(1.5 + d.x, 1.0 + 0.5 * d.y, (k % 3) as f64) / count as f64,
    };
    even_directions(count, 2).into_iter().enumerate().map(sun).collect()
}

fn render(phase: Phase, lights: Vec<Light>) -> Rendered {
    let asset = ball(0.15, HERE, phase);
    let mut scene = scene(HERE, 32, 1, lights);
    // Far enough away to see the object from nearly the same side everywhere.
    scene.camera.position = HERE + 5.0 * (scene.camera.position - HERE);
    scene.camera.vertical_fov_degrees /= 5.0;
    let frame = Frame::new(&scene, &asset.info).unwrap();
    Player::new(&asset, Backend::Cpu).unwrap().render(&frame, LightMode::Baked).unwrap()
}

/// Root mean square difference of two pictures over that of the second.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let square = |f: &dyn Fn(usize) -> f32| (0..a.len()).map(|i| f(i) * f(i)).sum::<f32>();
    let (off, all) =
        (square(&|i| Vec3::from(a[i]).distance(b[i].into())), square(&|i| Vec3::from(b[i]).length()));
    (off / all).sqrt()
}

/// The sum of pictures under few lights each, none of which is folded.
fn one_by_one(phase: Phase, lights: &[Light]) -> Vec<[f32; 3]> {
    let mut sum: Vec<[f32; 3]> = Vec::new();
    for part in lights.chunks(MOST_SINGLE) {
        let rendered = render(phase, part.to_vec());
        assert_eq!(rendered.lights.folded, 0);
        sum.resize(rendered.picture.pixels.len(), [0.0; 3]);
        for (sum, own) in sum.iter_mut().zip(&rendered.picture.pixels) {
            (0..3).for_each(|c| sum[c] += own[c]);
        }
    }
    sum
}

#[test]
fn folded_lights_shine_as_each_alone() {
    // A picture is not quite linear in its lights (slopes are logarithmic), hence the second bound.
    let phases = [(Phase::Isotropic, 0.01), (Phase::HenyeyGreenstein { g: 0.3 }, 0.02)];
    for (phase, bound) in phases {
        let lights = suns(2 * MOST_SINGLE);
        let folded = render(phase, lights.clone());
        assert_eq!((folded.lights.single, folded.lights.folded), (0, lights.len()));
        assert!(folded.lights.fold_error > 0.0 && folded.lights.fold_error < 0.1);
        let error = difference(&folded.picture.pixels, &one_by_one(phase, &lights));
        assert!(error < bound, "{phase:?}: {error}");
        assert!(error > 1e-7, "nothing was folded");
    }
}

#[test]
fn a_narrow_phase_function_seen_from_near_is_not_folded() {
    let rendered = render(Phase::HenyeyGreenstein { g: 0.9 }, suns(2 * MOST_SINGLE));
    assert_eq!((rendered.lights.single, rendered.lights.folded), (2 * MOST_SINGLE, 0));
}

#[test]
fn lights_that_reach_nothing_are_left_out() {
    let bright = point(HERE, DVec3::new(2.0, 1.0, 2.0), 10.0);
    let away = Light::Spot {
        position: HERE + DVec3::new(0.0, 4.0, 0.0),
        direction: DVec3::Y,
        intensity: DVec3::splat(1e3),
        cos_inner: 0.9,
        cos_outer: 0.8,
    };
    let far = point(HERE, DVec3::new(3e4, 0.0, 0.0), 10.0);
    let off = point(HERE, DVec3::new(0.0, 3.0, 0.0), 0.0);
    let alone = render(Phase::Isotropic, vec![bright]);
    let all = render(Phase::Isotropic, vec![away, bright, far, off]);
    assert_eq!((all.lights.single, all.lights.dark, alone.lights.dark), (1, 3, 0));
    assert!(difference(&all.picture.pixels, &alone.picture.pixels) < 1e-6);
}

#[test]
fn a_dark_scene_is_black() {
    let rendered = render(Phase::Isotropic, vec![point(HERE, DVec3::Y * 3.0, 0.0)]);
    assert!(rendered.picture.pixels.iter().flatten().all(|v| *v == 0.0));
    assert_eq!(rendered.lights.single, 0);
}

#[test]
fn lighting_runs_where_lights_change_and_not_where_the_camera_does() {
    let asset = ball(0.2, HERE, Phase::Isotropic);
    let lights = vec![point(HERE, DVec3::new(2.0, 1.0, 2.0), 10.0)];
    let frame = Frame::new(&scene(HERE, 16, 1, lights), &asset.info).unwrap();
    let mut moved = frame.clone();
    moved.view.origin.x += 0.1;
    let mut relit = moved.clone();
    relit.lights[0].position.y += 0.1;
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    player.set_reuse(true);
    let mut lit = |frame: &Frame| {
        let rendered = player.render(frame, LightMode::Baked).unwrap();
        let expected = Player::new(&asset, Backend::Cpu).unwrap().render(frame, LightMode::Baked).unwrap();
        assert_eq!(rendered.picture, expected.picture);
        rendered.passes.iter().any(|(name, _)| *name == "lighting")
    };
    assert_eq!([lit(&frame), lit(&moved), lit(&relit), lit(&moved)], [true, false, true, true]);
}

#[test]
fn plans_name_every_light_once() {
    let asset = ball(0.4, HERE, Phase::Isotropic);
    let mut lights = suns(40);
    lights.push(point(HERE, DVec3::new(2.0, 1.0, 2.0), 10.0));
    let frame = Frame::new(&scene(HERE, 16, 1, lights), &asset.info).unwrap();
    let plan = Plan::new(&frame, &asset.info, None);
    assert_eq!((plan.single.as_slice(), plan.folded.len(), plan.dark), (&[40][..], 40, 0));
    assert!(plan.folded.iter().all(|l| frame.lights[*l].kind == LightKind::Directional));
}

/// A few lights around the object, and many that are dim in different ways.
fn mostly_dim(count: usize, dim: f64) -> Vec<Light> {
    let directions = even_directions(count, 5);
    let place = |(k, d): (usize, DVec3)| match k % 32 {
        0 => point(HERE, d * 2.5, 20.0),
        // As dim as others that are far.
        k if k % 2 == 0 => point(HERE, d * 3.0, 9.0 * dim),
        _ => point(HERE, d * 300.0, 9e4 * dim),
    };
    directions.into_iter().enumerate().map(place).collect()
}

/// The largest difference of two pictures over the brightest value of the second.
fn of_peak(a: &Rendered, b: &Rendered) -> f32 {
    let values = |r: &Rendered| r.picture.pixels.concat();
    let peak = values(b).into_iter().fold(0.0, f32::max);
    values(a).iter().zip(values(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / peak
}

/// Lights one portion of fewer than `CULL_FROM` after the other, which leaves nothing out, summed sample by sample.
fn every_value(asset: &Asset, lights: &[Light]) -> Vec<Vec3> {
    let lighting = Lighting::new(&asset.info, &asset.samples);
    let mut sum = vec![Vec3::ZERO; asset.samples.len()];
    for few in lights.chunks(16) {
        let frame = Frame::new(&scene(HERE, 8, 1, few.to_vec()), &asset.info).unwrap();
        let all: Vec<usize> = (0..few.len()).collect();
        let plan = Plan { single: all.clone(), order: all, ..Plan::default() };
        let (values, skipped) = lighting.values(&asset.samples, &frame, None, &plan);
        assert_eq!(skipped, 0.0);
        sum.iter_mut().zip(values).for_each(|(s, v)| *s += v);
    }
    sum
}

#[test]
fn samples_leave_out_what_brings_them_next_to_nothing() {
    for phase in [Phase::Isotropic, Phase::HenyeyGreenstein { g: 0.6 }] {
        let asset = ball(0.15, HERE, phase);
        let lighting = Lighting::new(&asset.info, &asset.samples);
        // Two portions; the dim ones together bring 5e-5 of the light, or too much to leave any out.
        for (dim, some) in [(2e-6, true), (1e-3, false)] {
            let lights = mostly_dim(512, dim);
            let frame = Frame::new(&scene(HERE, 8, 1, lights.clone()), &asset.info).unwrap();
            let plan = Plan::new(&frame, &asset.info, None);
            let (values, skipped) = lighting.values(&asset.samples, &frame, None, &plan);
            assert_eq!(skipped > 0.3, some, "{phase:?} {dim}: {skipped}");
            // Beside those that are left out for the whole object.
            let lit: Vec<Light> = plan.single.iter().map(|l| lights[*l]).collect();
            let expected = every_value(&asset, &lit);
            for (got, expected) in values.iter().zip(&expected) {
                // Rounding of 512 terms beside the bound. Never more light.
                let (least, most) = (*expected * (1.0 - 1.1e-4), *expected * (1.0 + 1e-5));
                assert!(got.cmpge(least).all() && got.cmple(most).all(), "{phase:?} {dim}: {got} {expected}");
            }
        }
    }
}

#[test]
fn pictures_with_and_without_dim_lights_left_out_agree() {
    let lights = mostly_dim(256, 2e-6);
    let bright: Vec<Light> = lights.iter().copied().step_by(32).collect();
    let (all, without) = (render(Phase::Isotropic, lights), render(Phase::Isotropic, bright));
    assert!(all.lights.negligible_share.unwrap() > 0.3, "{:?}", all.lights);
    assert!(of_peak(&without, &all) < 1e-4, "{}", of_peak(&without, &all));
    assert_eq!(without.lights.negligible_share, Some(0.0));
}

#[test]
fn dim_lights_count_where_bright_ones_do_not_arrive() {
    // A light behind the object is bright outside and dark on the side that is seen. Those in front, a ten thousandth of it
    // together at the surface, must not be left out there.
    let mut asset = ball(0.15, HERE, Phase::Isotropic);
    asset.info.extinction = [24.0; 3];
    let seen_from = DVec3::new(0.4, 0.6, 4.6).normalize();
    let mut lights = vec![point(HERE, -3.0 * seen_from, 100.0)];
    lights.extend((0..64).map(|k| point(HERE, (3.0 + 0.01 * k as f64) * seen_from, 100.0 * 1e-4 / 64.0)));
    let lighting = Lighting::new(&asset.info, &asset.samples);
    let frame = Frame::new(&scene(HERE, 8, 1, lights.clone()), &asset.info).unwrap();
    let plan = Plan::new(&frame, &asset.info, None);
    assert_eq!(plan.dark, 0);
    let (values, skipped) = lighting.values(&asset.samples, &frame, None, &plan);
    let (all, front) = (every_value(&asset, &lights), every_value(&asset, &lights[1..]));
    let depends = all.iter().zip(&front).filter(|(all, front)| front.x > 0.1 * all.x).count();
    assert!(depends > 50 && skipped > 0.0, "{depends} {skipped}");
    for (got, expected) in values.iter().zip(&all) {
        assert!((got.x / expected.x - 1.0).abs() < 1.2e-4 || *got == *expected, "{got} {expected}");
    }
}

#[test]
fn glaring_and_dark_lights_among_many_stay_finite() {
    let asset = ball(0.2, HERE, Phase::HenyeyGreenstein { g: 0.8 });
    let mut lights = mostly_dim(300, 1e-5);
    lights[40] = point(HERE, DVec3::Y * 2.0, 1e30);
    lights[41] = point(HERE, DVec3::new(0.1, 0.2, 0.0), 1e30);
    lights[42] = point(HERE, DVec3::Y * 2.0, 0.0);
    let frame = Frame::new(&scene(HERE, 12, 1, lights), &asset.info).unwrap();
    let rendered = Player::new(&asset, Backend::Cpu).unwrap().render(&frame, LightMode::Baked).unwrap();
    let values = rendered.picture.pixels.concat();
    assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0) && values.iter().any(|v| *v > 1e20));
    assert!(rendered.lights.dark > 0);
}
