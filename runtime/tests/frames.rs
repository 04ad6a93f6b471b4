//! Frame after frame on the CPU: pictures are drawn on again and shared, and nobody sees it.

mod support;

use diaphane_formats::phase::Phase;
use diaphane_formats::scene::Scene;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{Backend, LightMode, Player};
use glam::DVec3;
use std::sync::Arc;

const HERE: DVec3 = DVec3::new(3.0, -2.0, 7.0);

/// Near, small in the middle, small at the edge, out of sight, from within.
fn views() -> Vec<Scene> {
    let near = support::scene(HERE, 96, 1, vec![support::point(HERE, DVec3::new(3.0, 1.0, 1.0), 30.0)]);
    let view = |away: DVec3, aside: DVec3| {
        let mut scene = near.clone();
        scene.camera.position = HERE + away;
        scene.camera.target = HERE + aside;
        scene
    };
    let away = DVec3::new(0.4, 0.6, 46.0);
    vec![
        near.clone(),
        view(away, DVec3::ZERO),
        view(away, DVec3::new(9.0, 7.0, 0.0)),
        view(away, DVec3::new(0.0, 0.0, 90.0)),
        view(DVec3::new(0.1, 0.2, 0.3), DVec3::ZERO),
    ]
}

#[test]
fn frames_on_old_pictures_are_those_of_a_new_player() {
    let asset = support::ball(0.3, HERE, Phase::Isotropic);
    let frames: Vec<Frame> = views().iter().map(|s| Frame::new(s, &asset.info).unwrap()).collect();
    let draw = |player: &mut Player, frame: &Frame| player.render(frame, LightMode::Baked).unwrap();
    let anew: Vec<_> =
        frames.iter().map(|f| draw(&mut Player::new(&asset, Backend::Cpu).unwrap(), f)).collect();
    assert!(anew[0].picture != anew[1].picture && anew[3].counters.rays_hit == 0);
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    let mut shown = None;
    for k in 0..5 * 5 {
        // One after the other between others; each frame is held while the next one is drawn.
        let view = if k % 2 == 0 { k / 2 % 5 } else { k * 3 % 5 };
        let rendered = draw(&mut player, &frames[view]);
        assert_eq!(rendered.picture, anew[view].picture, "frame {k}, view {view}");
        assert_eq!(rendered.counters, anew[view].counters, "frame {k}, view {view}");
        if let Some((old, before)) = shown.replace((rendered, view)) {
            assert_eq!(old.picture, anew[before].picture, "frame {k} drew on one that is held");
        }
    }
}

#[test]
fn an_unchanged_frame_is_shared_and_not_copied() {
    let asset = support::ball(0.3, HERE, Phase::Isotropic);
    let views = views();
    let [first, second] = [0, 1].map(|k| Frame::new(&views[k], &asset.info).unwrap());
    let mut player = Player::new(&asset, Backend::Cpu).unwrap();
    let mut draw = |reuse, frame| {
        player.set_reuse(reuse);
        player.render(frame, LightMode::Baked).unwrap()
    };
    let one = draw(true, &first);
    let same = draw(true, &first);
    assert!(Arc::ptr_eq(&one.picture, &same.picture));
    assert!(!Arc::ptr_eq(&one.picture, &draw(true, &second).picture));
    let anew = draw(false, &first);
    assert!(!Arc::ptr_eq(&one.picture, &anew.picture) && one.picture == anew.picture);
}
