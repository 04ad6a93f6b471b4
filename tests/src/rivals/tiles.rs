//! Balls that the rays of a tile of pixels may meet, copied together.

use super::rays::Tile;
use diaphane_runtime::frame::Frame;
use glam::Vec3;

/// Those of `balls` (centre relative to the camera, radius) that a ray through `tile` may meet, by number.
pub fn select(frame: &Frame, tile: Tile, balls: &[(Vec3, f32)], out: &mut Vec<u32>) {
    out.clear();
    let [left, top, right, bottom] = tile.map(|v| v as f32);
    let corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
        .map(|(x, y)| frame.view.direction(x, y, frame.width, frame.height));
    let axis = corners.iter().sum::<Vec3>().normalize_or_zero();
    // Slightly wider than the tile, by more than directions are rounded.
    let cosine = corners.iter().map(|c| c.dot(axis)).fold(1.0, f32::min) - 1e-6;
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    for (i, (centre, radius)) in balls.iter().enumerate() {
        let along = centre.dot(axis);
        let across = (*centre - axis * along).length();
        // A lower bound of the distance to the cone of the tile's rays; wide cones take everything.
        if cosine < 0.1 || across * cosine - along * sine <= *radius {
            out.push(i as u32);
        }
    }
}
