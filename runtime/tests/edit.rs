//! Another extinction or albedo at run time: what an edit changes, and that nothing of it stays behind.

mod support;

use diaphane_formats::asset::Asset;
use diaphane_formats::phase::Phase;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::Light;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{Backend, LightMode, Player};
use glam::DVec3;
use std::sync::Arc;
use support::{ball, point, scene};

const HERE: DVec3 = DVec3::new(10.0, -3.0, 7.0);

/// A change of everything that can be changed, different in every channel.
const COLOURED: Edit =
    Edit { extinction_scale: DVec3::new(0.5, 1.0, 3.0), albedo: Some(DVec3::new(0.1, 0.9, 1.0)) };

fn asset() -> Asset {
    ball(0.15, HERE, Phase::HenyeyGreenstein { g: 0.3 })
}

fn frame(asset: &Asset) -> Frame {
    let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::new(1.0, 2.0, 3.0) };
    let lights = vec![point(HERE, DVec3::new(3.0, 1.0, 1.0), 30.0), sun];
    Frame::new(&scene(HERE, 24, 2, lights), &asset.info).unwrap()
}

fn draw(player: &mut Player, edit: &Edit, frame: &Frame, mode: LightMode) -> Arc<Picture> {
    player.edit(edit).unwrap();
    player.render(frame, mode).unwrap().picture
}

#[test]
fn the_identity_brings_the_first_picture_back() {
    let asset = asset();
    let frame = frame(&asset);
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    for mode in [LightMode::Baked, LightMode::Exact] {
        let first = player.render(&frame, mode).unwrap().picture;
        assert!(first != draw(&mut player, &COLOURED, &frame, mode));
        assert_ne!(player.info().extinction, asset.info.extinction);
        assert!(first == draw(&mut player, &Edit::default(), &frame, mode));
        assert_eq!(*player.info(), asset.info);
    }
}

#[test]
fn an_edited_player_is_a_player_of_the_edited_asset() {
    let asset = asset();
    let frame = frame(&asset);
    let mut edited = asset.clone();
    // 4 · (0.5, 1, 3); the reference extinction, which gives the coefficients their meaning, stays.
    edited.info.extinction = [2.0, 4.0, 12.0];
    edited.info.albedo = [0.1, 0.9, 1.0];
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    for mode in [LightMode::Baked, LightMode::Exact] {
        let expected = Player::new(&edited, Backend::Cpu).unwrap().render(&frame, mode).unwrap().picture;
        assert!(expected == draw(&mut player, &COLOURED, &frame, mode));
    }
    assert_eq!(*player.info(), edited.info);
}

#[test]
fn radiance_is_linear_in_the_albedo() {
    let asset = asset();
    let frame = frame(&asset);
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    let first = player.render(&frame, LightMode::Baked).unwrap().picture;
    let baked = DVec3::from(asset.info.albedo);
    let mut with = |factor: DVec3| {
        let edit = Edit { albedo: Some(baked * factor), ..Edit::default() };
        draw(&mut player, &edit, &frame, LightMode::Baked)
    };
    // Powers of two shift exponents alone: every step from albedo to pixel keeps its digits.
    let half = with(DVec3::new(0.5, 1.0, 0.25));
    for (a, b) in first.pixels.iter().zip(&half.pixels) {
        assert_eq!([a[0] * 0.5, a[1], a[2] * 0.25], *b);
    }
    // Other factors round once a sample, in its value and in the ratios to its neighbours: some 2^-24 each.
    let less = with(DVec3::splat(0.7));
    for (a, b) in first.pixels.iter().flatten().zip(less.pixels.iter().flatten()) {
        assert!((0.7 * a - b).abs() <= 1e-5 * a, "{a} {b}");
    }
    assert!(with(DVec3::ZERO).pixels.iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn no_extinction_is_black_and_hides_nothing() {
    let asset = asset();
    let frame = frame(&asset);
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    let edit = Edit { extinction_scale: DVec3::new(0.0, 1.0, 1e6), ..Edit::default() };
    let picture = draw(&mut player, &edit, &frame, LightMode::Baked);
    assert!(picture.pixels.iter().all(|p| p[0] == 0.0 && p.iter().all(|v| v.is_finite())));
    assert!(picture.pixels.iter().any(|p| p[1] > 0.0));
}

#[test]
fn an_edit_ends_the_reuse_of_a_frame() {
    let asset = asset();
    let frame = frame(&asset);
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    player.set_reuse(true);
    let first = player.render(&frame, LightMode::Exact).unwrap();
    player.edit(&COLOURED).unwrap();
    let second = player.render(&frame, LightMode::Exact).unwrap();
    assert!(!second.passes.is_empty() && second.picture != first.picture);
    assert!(player.render(&frame, LightMode::Exact).unwrap().passes.is_empty());
}

#[test]
fn bad_values_are_refused_and_change_nothing() {
    let asset = asset();
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    player.edit(&COLOURED).unwrap();
    let before = player.info().clone();
    for value in [-0.1, f64::NAN, f64::INFINITY, 1.1e6] {
        let edit = Edit { extinction_scale: DVec3::new(1.0, value, 1.0), ..Edit::default() };
        let said = player.edit(&edit).unwrap_err().to_string();
        assert!(said.contains("extinction scale") && said.contains("0..1000000"), "{said}");
    }
    for value in [-0.1, f64::NAN, 1.001] {
        let edit = Edit { albedo: Some(DVec3::new(1.0, 0.5, value)), ..Edit::default() };
        let said = player.edit(&edit).unwrap_err().to_string();
        assert!(said.contains("albedo") && said.contains("0..1"), "{said}");
    }
    assert_eq!(*player.info(), before);
    let mut dense = asset;
    dense.info.extinction = [1e305; 3];
    let edit = Edit { extinction_scale: DVec3::splat(1e5), ..Edit::default() };
    assert!(edit.apply(&dense.info).unwrap_err().to_string().contains("infinite"));
}
