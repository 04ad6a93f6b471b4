//! The cells of the axes: what each draws, and how long it will take.

use super::Row;
use diaphane_formats::asset::Asset;
use diaphane_formats::directions::even_directions;
use diaphane_formats::scene::{Light, Scene};
use diaphane_runtime::framing::default_scene;
use glam::{DQuat, DVec3};
use serde::Serialize;
use std::f64::consts::TAU;

/// Numbers of lights.
const LIGHTS: [usize; 7] = [1, 4, 16, 64, 256, 1024, 4096];
const SIZES: [[u32; 2]; 6] = [[256, 256], [512, 512], [800, 800], [1024, 1024], [1920, 1080], [3840, 2160]];
/// Of the cells that vary something else.
const SIZE: [u32; 2] = [800, 800];

/// What a cell draws.
#[derive(Clone, Copy, Serialize)]
pub struct Cell {
    pub axis: &'static str,
    pub lights: usize,
    pub directional: bool,
    /// 0: the asset; then those of `--also`.
    pub asset: usize,
    pub level: usize,
    pub size: [u32; 2],
}

impl Cell {
    /// Point lights in a picture.
    pub fn of(lights: usize, size: [u32; 2]) -> Self {
        Self { axis: "", lights, directional: false, asset: 0, level: 0, size }
    }
}

/// All cells, those of an axis in rising order of cost; levels of detail and other assets last, because each needs a player of
/// its own.
pub fn cells(levels: usize, assets: usize) -> Vec<Cell> {
    let base = Cell::of(1, SIZE);
    let point = LIGHTS.map(|lights| Cell { axis: "point lights", lights, ..base });
    let suns = LIGHTS.map(|lights| Cell { axis: "directional lights", lights, directional: true, ..base });
    let sizes = SIZES.map(|size| Cell { axis: "resolution", size, ..base });
    let levels = (0..levels).map(|level| Cell { axis: "level of detail", level, ..base });
    let samples =
        (0..if assets > 1 { assets } else { 0 }).map(|asset| Cell { axis: "samples", asset, ..base });
    point.into_iter().chain(suns).chain(sizes).chain(levels).chain(samples).collect()
}

/// Seconds of a frame, from the cell before on the same axis: all of it grows with the pixels, lighting with the lights.
pub fn predicted(rows: &[Row], cell: &Cell) -> f64 {
    let pixels = |c: &Cell| f64::from(c.size[0]) * f64::from(c.size[1]);
    let Some(before) = rows.last().filter(|r| r.cell.axis == cell.axis) else { return 0.0 };
    let larger = (pixels(cell) / pixels(&before.cell)).max(1.0);
    // Clocks of software adapters miss parts of a pass.
    let light = before.lighting_ms().max(0.02 * before.frame_ms);
    let more = cell.lights as f64 / before.cell.lights as f64 - 1.0;
    1e-3 * (before.frame_ms * larger + light * more.max(0.0))
}

/// The default view, turned by a part of a circle; lights in even directions turn the other way, so that they move in every
/// frame. Their sum stays the same.
pub fn scene(asset: &Asset, cell: Cell, turn: f64) -> Scene {
    let mut scene = default_scene(&asset.info);
    let centre = DVec3::from(asset.info.centre);
    let around = DQuat::from_rotation_y(TAU * turn);
    scene.camera.position = centre + around * (scene.camera.position - centre);
    scene.image.samples_per_pixel = 1;
    [scene.image.width, scene.image.height] = cell.size;
    let distance = 1.5 * f64::from(asset.info.diagonal());
    let share = DVec3::splat(4.0 / cell.lights as f64);
    let light = |d: DVec3| {
        let d = around.inverse() * d;
        if cell.directional {
            Light::Directional { direction: -d, irradiance: share }
        } else {
            Light::Point { position: centre + distance * d, intensity: share * distance * distance }
        }
    };
    scene.lights = even_directions(cell.lights.max(2), 0).into_iter().take(cell.lights).map(light).collect();
    scene
}
