//! A plump bird on a round plinth: ellipsoids and cones blended smoothly.
//!
//! Distances are approximate (exact for round cones, first order for ellipsoids); blends are the polynomial smooth
//! minimum. Both after Quilez' notes on distance functions.

use super::{Triangles, isosurface};
use glam::{DMat3, DVec3};

/// The bird, 1.5 long and 1.3 high, around the origin, looking towards +x.
pub fn bird() -> Triangles {
    let (low, high) = (DVec3::new(-1.06, -0.88, -0.56), DVec3::new(0.86, 0.78, 0.56));
    let mut bird = isosurface(low, high, 60, distance);
    bird.positions.iter_mut().for_each(|p| *p *= 0.8);
    bird
}

fn distance(p: DVec3) -> f64 {
    // Left and right are the same.
    let side = DVec3::new(p.x, p.y, p.z.abs());
    let body = ellipsoid(p, DVec3::new(-0.03, 0.0, 0.0), DVec3::new(0.52, 0.37, 0.36), 28.0);
    let head = (p - DVec3::new(0.36, 0.42, 0.0)).length() - 0.25;
    let beak = cone(p, DVec3::new(0.55, 0.42, 0.0), DVec3::new(0.77, 0.36, 0.0), 0.1, 0.03);
    let tail = ellipsoid(p, DVec3::new(-0.66, -0.27, 0.0), DVec3::new(0.36, 0.07, 0.17), 20.0);
    let wing = ellipsoid(side, DVec3::new(-0.16, 0.02, 0.33), DVec3::new(0.44, 0.2, 0.1), 24.0);
    let eye = (side - DVec3::new(0.455, 0.49, 0.205)).length() - 0.05;
    let leg = cone(side, DVec3::new(0.02, -0.3, 0.15), DVec3::new(0.06, -0.68, 0.16), 0.085, 0.06);
    let plinth = plinth(p - DVec3::new(0.0, -0.76, 0.0), 0.5, 0.09, 0.04);
    let mut d = blend(body, head, 0.2);
    d = blend(d, tail, 0.14);
    d = blend(d, wing, 0.05);
    d = blend(d, beak, 0.05);
    d = blend(d, eye, 0.015);
    d = blend(d, leg, 0.08);
    blend(d, plinth, 0.06)
}

/// The smaller of two distances, rounded off over `width`.
fn blend(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - 0.25 * h * h * width
}

/// An ellipsoid whose long axis is raised by `degrees` from x towards y.
fn ellipsoid(p: DVec3, centre: DVec3, radii: DVec3, degrees: f64) -> f64 {
    let q = DMat3::from_rotation_z(-degrees.to_radians()) * (p - centre);
    let k0 = (q / radii).length();
    let k1 = (q / (radii * radii)).length();
    if k1 > 0.0 { k0 * (k0 - 1.0) / k1 } else { -radii.min_element() }
}

/// The hull of two balls.
fn cone(p: DVec3, a: DVec3, b: DVec3, radius_a: f64, radius_b: f64) -> f64 {
    let axis = b - a;
    let length = axis.length();
    let y = (p - a).dot(axis) / length;
    let x = ((p - a).length_squared() - y * y).max(0.0).sqrt();
    // The tangent's slope: its sine is the difference of radii over the distance of the centres.
    let sin = (radius_a - radius_b) / length;
    let cos = (1.0 - sin * sin).sqrt();
    let along = y * cos - x * sin;
    if along < 0.0 {
        x.hypot(y) - radius_a
    } else if along > length * cos {
        x.hypot(y - length) - radius_b
    } else {
        x * cos + y * sin - radius_a
    }
}

/// A disk of half height `half` with rounded rims, around the y axis.
fn plinth(p: DVec3, radius: f64, half: f64, rounding: f64) -> f64 {
    let (dx, dy) = (p.x.hypot(p.z) - radius + rounding, p.y.abs() - half + rounding);
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0) - rounding
}
