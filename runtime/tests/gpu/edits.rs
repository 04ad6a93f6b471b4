//! Edits of the material on the GPU.

use crate::objects::{Object, ball, torus, uneven_grid};
use crate::scenes::{outside, scene};
use crate::{compare_rays, gpu};
use diaphane_runtime::edit::Edit;
use diaphane_runtime::frame::Frame;
use glam::DVec3;

/// From grey to coloured: the splat pass is another one then.
const COLOURED: Edit =
    Edit { extinction_scale: DVec3::new(0.5, 1.0, 3.0), albedo: Some(DVec3::new(0.1, 0.9, 1.0)) };

#[test]
fn edited_assets_agree_with_the_twin() {
    for object in [ball(), Object { density: Some(uneven_grid()), ..torus() }] {
        let mut asset = object.build();
        asset.info = COLOURED.apply(&asset.info).unwrap();
        compare_rays("edited", &asset, &Frame::new(&scene(outside()), &asset.info).unwrap(), None);
    }
}

#[test]
fn edits_come_and_go_to_the_bit() {
    for object in [ball(), Object { density: Some(uneven_grid()), ..torus() }] {
        let asset = object.build();
        let Some(mut player) = gpu(&asset) else { return };
        let frame = Frame::new(&scene(outside()), &asset.info).unwrap();
        let first = player.render(&frame, None).unwrap().picture;
        let mut edited = asset.clone();
        edited.info = COLOURED.apply(&asset.info).unwrap();
        player.set_material(&edited.info);
        let expected = gpu(&edited).unwrap().render(&frame, None).unwrap().picture;
        assert!(expected == player.render(&frame, None).unwrap().picture);
        assert!(expected != first);
        player.set_material(&Edit::default().apply(&asset.info).unwrap());
        assert!(first == player.render(&frame, None).unwrap().picture);
    }
}
