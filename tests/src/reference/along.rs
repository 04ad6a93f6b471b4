//! Where on a camera ray to look: positions within its stretches, drawn roughly in proportion to what the eye sees.
//!
//! Homogeneous: with s the length inside the object (0..T), a mixture of a uniform density and of one truncated
//! exponential for each channel, so that neither a dark far end lit from behind nor a channel of other extinction is
//! ever drawn much too rarely. Heterogeneous: the same mixture over short cells of the marched ray; within a cell the
//! density of the draws follows the line between the medium's densities at its ends.

use super::density::Field;
use super::rays::{Scratch, Stretch};
use diaphane_formats::medium::Density;
use diaphane_formats::visibility::Crossing;
use glam::DVec3;

/// Share of the draws that is uniform along the ray.
const UNIFORM: f64 = 0.3;

/// A position on a camera ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Ray parameter.
    pub t: f64,
    /// Probability density per unit of t.
    pub density: f64,
    /// m from the ray's start to here.
    pub view: f64,
    /// Product of boundary factors from the camera to here.
    pub boundary: f64,
}

/// Reusable memory for marching.
#[derive(Default)]
pub struct Marching {
    cells: Vec<Cell>,
    /// Ray parameters between which the field is smooth.
    pub cuts: Vec<f64>,
    /// Crossings with meshes inside the field.
    pub crossings: Vec<Crossing>,
}

struct Cell {
    start: f64,
    end: f64,
    before: f64,
    boundary: f64,
    seen: f64,
    scattering: f64,
    /// Relative density of the draws at start and end; their mean is 1.
    ends: [f64; 2],
}

/// The position of `u` (0..1) in a homogeneous medium; `None` where nothing is inside.
pub fn in_homogeneous(kappa: DVec3, rho: f64, stretches: &[Stretch], u: f64) -> Option<Position> {
    let total: f64 = stretches.iter().map(|s| s.end - s.start).sum();
    if total <= 0.0 {
        return None;
    }
    let (s, density) = invert(kappa * rho, total, u);
    let mut before = 0.0;
    for (i, stretch) in stretches.iter().enumerate() {
        let length = stretch.end - stretch.start;
        if s <= before + length || i + 1 == stretches.len() {
            let t = (stretch.start + (s - before)).min(stretch.end);
            return Some(Position { t, density, view: rho * s, boundary: stretch.reached });
        }
        before += length;
    }
    None
}

/// Inverse of the mixture's distribution function at `u`, and its density there.
fn invert(kappa: DVec3, total: f64, u: f64) -> (f64, f64) {
    let mut rates = [0.0; 3];
    let mut n = 0;
    for k in kappa.to_array() {
        // A nearly transparent channel is uniform; the uniform part stands for it.
        if k * total > 1e-3 && !rates[..n].contains(&k) {
            rates[n] = k;
            n += 1;
        }
    }
    let rates = &rates[..n];
    if rates.is_empty() {
        return (u * total, 1.0 / total);
    }
    let norms: [f64; 3] = std::array::from_fn(|i| rates.get(i).map_or(1.0, |k| -(-k * total).exp_m1()));
    let share = (1.0 - UNIFORM) / n as f64;
    // Distribution function and density at s.
    let at = |s: f64| {
        let (mut f, mut p) = (UNIFORM * s / total, UNIFORM / total);
        for (k, norm) in rates.iter().zip(&norms) {
            let e = (-k * s).exp();
            f += share * (1.0 - e) / norm;
            p += share * k * e / norm;
        }
        (f, p)
    };
    // The function is concave, so Newton's steps from the left never overshoot; bisection guards against rounding.
    let (mut low, mut high) = (0.0, total);
    let mut s = 0.0;
    for _ in 0..60 {
        let (f, p) = at(s);
        if f < u {
            low = s
        } else {
            high = s
        }
        let next = s + (u - f) / p;
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if (next - s).abs() <= 1e-12 * total {
            s = next;
            break;
        }
        s = next;
    }
    (s, at(s).1)
}

/// The position of `u` in a heterogeneous medium, whose stretches lie in `scratch`.
pub fn in_field(
    (kappa, field): (DVec3, &Field),
    origin: DVec3,
    direction: DVec3,
    scratch: &Scratch,
    march: &mut Marching,
    u: f64,
) -> Option<Position> {
    fill(kappa, field, origin, direction, &scratch.stretches, march);
    let (seen, scattering) = march.cells.iter().fold((0.0, 0.0), |(a, b), c| (a + c.seen, b + c.scattering));
    if scattering <= 0.0 {
        return None;
    }
    // Where exp(-τ) underflows for every cell, only the uniform part is left.
    let (per_seen, per_scattering) =
        if seen > 0.0 { ((1.0 - UNIFORM) / seen, UNIFORM / scattering) } else { (0.0, 1.0 / scattering) };
    let weight = |c: &Cell| c.seen * per_seen + c.scattering * per_scattering;
    let mut rest = u;
    let last = march.cells.iter().rposition(|c| weight(c) > 0.0)?;
    for (i, cell) in march.cells.iter().enumerate() {
        let w = weight(cell);
        if w > 0.0 && (rest < w || i == last) {
            let length = cell.end - cell.start;
            let (x, relative) = on_line(cell.ends, (rest / w).clamp(0.0, 1.0));
            let t = cell.start + length * x;
            let view = cell.before + field.smooth_part(origin, direction, cell.start, t);
            return Some(Position { t, density: w * relative / length, view, boundary: cell.boundary });
        }
        rest -= w;
    }
    None
}

/// Where in 0..1 the integral of the line from `a` to `b` (mean 1) is `u`, and the line's value there.
fn on_line([a, b]: [f64; 2], u: f64) -> (f64, f64) {
    // Root of a x + (b-a) x²/2 = u without cancellation.
    let x = (2.0 * u / (a + (a * a + 2.0 * (b - a) * u).max(0.0).sqrt())).min(1.0);
    (x, a + (b - a) * x)
}

/// Cuts the stretches into cells on which the field is smooth and little light is lost.
fn fill(
    kappa: DVec3,
    field: &Field,
    origin: DVec3,
    direction: DVec3,
    stretches: &[Stretch],
    march: &mut Marching,
) {
    let value = |t: f64| field.density().value(origin + direction * t);
    let total: f64 = stretches.iter().map(|s| s.end - s.start).sum();
    let scatters = |start: f64, end: f64, mass: f64| match field.density() {
        Density::Shapes(_) => value(0.5 * (start + end)).1 * (end - start),
        _ => mass,
    };
    let grey = kappa.x == kappa.y && kappa.y == kappa.z;
    let sloped = matches!(field.density(), Density::Grid(_) | Density::Noise(_));
    let Marching { cells, cuts, crossings } = march;
    cells.clear();
    let mut before = 0.0;
    for stretch in stretches {
        field.cut(origin, direction, (stretch.start, stretch.end), cuts, crossings);
        for pair in cuts.windows(2) {
            let (start, length) = (pair[0], pair[1] - pair[0]);
            let mass = field.smooth_part(origin, direction, pair[0], pair[1]);
            let parts = (mass * kappa.max_element() / 0.5).max(16.0 * length / total).ceil().clamp(1.0, 64.0);
            for i in 0..parts as usize {
                let (a, b) = (start + length * i as f64 / parts, start + length * (i + 1) as f64 / parts);
                let own = if parts > 1.0 { field.smooth_part(origin, direction, a, b) } else { mass };
                let scattering = scatters(a, b, own);
                let middle = before + 0.5 * own;
                let eye = if grey {
                    (-kappa.x * middle).exp()
                } else {
                    (-kappa * middle).exp().element_sum() / 3.0
                };
                let mut ends = [1.0; 2];
                if sloped {
                    // A tenth of the mean everywhere: the field between the ends need not follow the line.
                    let floor = 0.1 * own / (b - a);
                    let [x, y] = [a, b].map(|t| value(t).0 + floor);
                    if x + y > 0.0 {
                        ends = [x, y].map(|v| 2.0 * v / (x + y));
                    }
                }
                let boundary = stretch.reached;
                cells.push(Cell {
                    start: a,
                    end: b,
                    before,
                    boundary,
                    seen: scattering * eye,
                    scattering,
                    ends,
                });
                before += own;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn homogeneous_draws_follow_their_density() {
        let stretches = [
            Stretch { start: 1.0, end: 1.5, reached: 0.9, leaving: 1.0 },
            Stretch { start: 2.0, end: 4.0, reached: 0.7, leaving: 1.0 },
        ];
        for kappa in [DVec3::splat(3.0), DVec3::new(0.0, 1.0, 20.0), DVec3::ZERO, DVec3::splat(400.0)] {
            // The mean of 1/density is the length that the draws cover, and of t/density the first moment.
            let n = 200_000;
            let (mut length, mut moment) = (0.0, 0.0);
            for i in 0..n {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                let p = in_homogeneous(kappa, 1.0, &stretches, u).unwrap();
                length += 1.0 / p.density;
                moment += p.t / p.density;
                let s = if p.t <= 1.5 { p.t - 1.0 } else { p.t - 1.5 };
                assert!((p.view - s).abs() < 1e-9);
            }
            assert!((length / f64::from(n) - 2.5).abs() < 1e-3, "{kappa}: {length}");
            assert!((moment / f64::from(n) - (0.625 + 6.0)).abs() < 4e-3, "{kappa}: {moment}");
        }
    }

    #[test]
    fn fields_are_drawn_where_they_scatter() {
        use diaphane_formats::medium::{Shape, Shapes, Solid};
        let solid = Solid::Sphere { center: DVec3::ZERO, radius: 0.25 };
        let shapes = Shapes { base: 2.0, shapes: vec![Shape { solid, density: 5.0, absorb: true }] };
        let density = Density::Shapes(shapes);
        let field = Field::new(&density);
        let mut scratch = Scratch::default();
        scratch.stretches.push(Stretch { start: 1.0, end: 3.0, reached: 1.0, leaving: 1.0 });
        let mut march = Marching::default();
        let n = 20_000;
        let mut length = 0.0;
        for i in 0..n {
            let u = (f64::from(i) + 0.5) / f64::from(n);
            let origin = DVec3::new(0.0, 0.0, -2.0);
            let p = in_field((DVec3::ONE, &field), origin, DVec3::Z, &scratch, &mut march, u).unwrap();
            assert!((p.t - 2.0).abs() > 0.25 - 1e-9, "{}", p.t);
            let expected = if p.t < 2.0 { 2.0 * (p.t - 1.0) } else { 1.5 + 2.5 + 2.0 * (p.t - 2.25) };
            assert!((p.view - expected).abs() < 1e-9);
            length += 1.0 / p.density;
        }
        assert!((length / f64::from(n) - 1.5).abs() < 1e-3);
    }
}
