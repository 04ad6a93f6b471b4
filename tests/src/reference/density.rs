//! The reference's own integral of the density along a ray, from point evaluations only.
//!
//! The ray is cut wherever the field is not smooth: at layer boundaries, at the surfaces of solids (conics in closed
//! form, the torus' quartic by isolating roots between those of its derivatives, meshes by their crossings), at
//! planes of voxel centres where the slope changes. Between cuts the field is constant or, in a grid, a polynomial along the ray: linear if one
//! axis varies (the midpoint rule is exact), else at most cubic (the two-point Gauss-Legendre rule is). Noise is cut at half the size of its finest cells.
//!
//! Checked by the tests below against fine midpoint sums of the point evaluation.

use super::polynomial;
use diaphane_formats::medium::{Density, Grid, Shapes, Solid};
use diaphane_formats::visibility::Crossing;
use glam::DVec3;

/// 1/(2√3): offset of the two Gauss points from the middle of an interval, in its length.
const GAUSS: f64 = 0.288_675_134_594_812_9;

/// A density field and where along the axes of its grid it bends.
pub struct Field<'a> {
    density: &'a Density,
    /// Voxel centres, as numbers along each axis, at which the slope changes anywhere in the grid.
    bends: [Vec<f64>; 3],
    /// The field is linear along any ray between bends.
    linear: bool,
}

impl<'a> Field<'a> {
    /// Looks through the field once.
    pub fn new(density: &'a Density) -> Self {
        let Density::Grid(grid) = density else {
            return Self { density, bends: Default::default(), linear: false };
        };
        let bends = std::array::from_fn(|axis| bends(grid, axis));
        Self { density, bends, linear: grid.size().iter().filter(|n| **n > 1).count() <= 1 }
    }

    /// The field itself.
    pub fn density(&self) -> &'a Density {
        self.density
    }

    /// Fills `cuts` with `start`, `end` and in between, in order, every ray parameter at which the field along
    /// `origin` + t `direction` is not smooth.
    pub fn cut(
        &self,
        origin: DVec3,
        direction: DVec3,
        (start, end): (f64, f64),
        cuts: &mut Vec<f64>,
        crossings: &mut Vec<Crossing>,
    ) {
        cuts.clear();
        match self.density {
            Density::Uniform(_) => {}
            Density::Layers(layers) => {
                let part = layers.period / layers.densities.len() as f64;
                planes(origin.dot(layers.axis) / part, direction.dot(layers.axis) / part, (start, end), cuts);
            }
            Density::Grid(grid) => self.cut_grid(grid, origin, direction, (start, end), cuts),
            Density::Noise(noise) => {
                let steps = ((end - start) / noise.feature()).ceil().clamp(1.0, 65_536.0);
                cuts.extend((1..steps as usize).map(|i| start + (end - start) * i as f64 / steps));
            }
            Density::Shapes(shapes) => cut_shapes(shapes, origin, direction, cuts, crossings),
        }
        cuts.retain(|t| *t > start && *t < end);
        cuts.push(start);
        cuts.push(end);
        cuts.sort_unstable_by(f64::total_cmp);
    }

    fn cut_grid(
        &self,
        grid: &Grid,
        origin: DVec3,
        direction: DVec3,
        (start, end): (f64, f64),
        cuts: &mut Vec<f64>,
    ) {
        let (low, high) = grid.bounds();
        for (axis, bends) in self.bends.iter().enumerate() {
            let per_voxel = grid.size()[axis] as f64 / (high[axis] - low[axis]);
            let (offset, slope) = ((origin[axis] - low[axis]) * per_voxel - 0.5, direction[axis] * per_voxel);
            let (a, b) = (offset + slope * start, offset + slope * end);
            let first = bends.partition_point(|n| *n < a.min(b));
            let passed = bends[first..].iter().take_while(|n| **n <= a.max(b));
            cuts.extend(passed.map(|n| (n - offset) / slope).filter(|t| t.is_finite()));
        }
    }

    /// ∫ρ dt between two neighbouring cuts.
    pub fn smooth_part(&self, origin: DVec3, direction: DVec3, start: f64, end: f64) -> f64 {
        let (middle, length) = (0.5 * (start + end), end - start);
        let at = |t: f64| self.density.value(origin + direction * t).0;
        match self.density {
            Density::Uniform(rho) => rho * length,
            Density::Layers(_) | Density::Shapes(_) => at(middle) * length,
            _ if self.linear => at(middle) * length,
            _ => 0.5 * length * (at(middle - GAUSS * length) + at(middle + GAUSS * length)),
        }
    }

    /// m = ∫ρ dt over `start`..`end`. `cuts` and `crossings` are reused memory.
    pub fn length(
        &self,
        origin: DVec3,
        direction: DVec3,
        start: f64,
        end: f64,
        (cuts, crossings): (&mut Vec<f64>, &mut Vec<Crossing>),
    ) -> f64 {
        if let Density::Uniform(rho) = self.density {
            return rho * (end - start);
        }
        self.cut(origin, direction, (start, end), cuts, crossings);
        cuts.windows(2).map(|w| self.smooth_part(origin, direction, w[0], w[1])).sum()
    }
}

/// Numbers of the planes of voxel centres across `axis` at which some row of voxels changes its slope; the field is
/// constant before the first centre and after the last.
fn bends(grid: &Grid, axis: usize) -> Vec<f64> {
    let size = grid.size();
    let n = size[axis];
    if n < 2 {
        return Vec::new();
    }
    let stride = [1, size[0], size[0] * size[1]][axis];
    let values = grid.values();
    let mut bent = vec![false; n];
    for (i, &here) in values.iter().enumerate() {
        let k = i / stride % n;
        let before = if k > 0 { values[i - stride] } else { here };
        let after = if k + 1 < n { values[i + stride] } else { here };
        bent[k] |= here - before != after - here;
    }
    (0..n).filter(|&k| bent[k]).map(|k| k as f64).collect()
}

/// Parameters at which offset + slope · t is a whole number, within the range.
fn planes(offset: f64, slope: f64, (start, end): (f64, f64), cuts: &mut Vec<f64>) {
    let (a, b) = (offset + slope * start, offset + slope * end);
    let mut n = a.min(b).ceil();
    while n <= a.max(b) {
        let t = (n - offset) / slope;
        if t.is_finite() {
            cuts.push(t);
        }
        n += 1.0;
    }
}

fn cut_shapes(
    shapes: &Shapes,
    origin: DVec3,
    direction: DVec3,
    cuts: &mut Vec<f64>,
    crossings: &mut Vec<Crossing>,
) {
    for shape in &shapes.shapes {
        match &shape.solid {
            Solid::Sphere { center, radius } => {
                let p = origin - *center;
                let c = [
                    p.length_squared() - radius * radius,
                    2.0 * p.dot(direction),
                    direction.length_squared(),
                ];
                polynomial::roots(&c, cuts);
            }
            Solid::Box { min, max } => {
                for k in (0..3).filter(|&k| direction[k] != 0.0) {
                    cuts.extend([(min[k] - origin[k]) / direction[k], (max[k] - origin[k]) / direction[k]]);
                }
            }
            Solid::Torus { center, axis, radius, tube } => {
                cut_torus(origin - *center, direction, *axis, *radius, *tube, cuts);
            }
            Solid::Mesh(mesh) => {
                mesh.1.crossings(origin, direction, f64::NEG_INFINITY, f64::INFINITY, crossings);
                cuts.extend(crossings.iter().map(|c| c.t));
            }
        }
    }
}

/// (|p|² + R² - r²)² = 4R² (|p|² - (p·a)²) along the ray. The polynomial starts at the point of the ray nearest to
/// the centre, where it is best conditioned.
fn cut_torus(p: DVec3, direction: DVec3, axis: DVec3, radius: f64, tube: f64, cuts: &mut Vec<f64>) {
    let shift = -p.dot(direction) / direction.length_squared();
    let q = p + direction * shift;
    if q.length() > radius + tube {
        return;
    }
    let (qq, dd) = (q.length_squared(), direction.length_squared());
    let (qa, da) = (q.dot(axis), direction.dot(axis));
    let qd = q.dot(direction);
    let k = qq + radius * radius - tube * tube;
    let four = 4.0 * radius * radius;
    let coefficients = [
        k * k - four * (qq - qa * qa),
        4.0 * qd * k - 2.0 * four * (qd - qa * da),
        2.0 * dd * k + 4.0 * qd * qd - four * (dd - da * da),
        4.0 * qd * dd,
        dd * dd,
    ];
    let before = cuts.len();
    polynomial::roots(&coefficients, cuts);
    cuts[before..].iter_mut().for_each(|t| *t += shift);
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::medium::{Layers, Noise, Shape};

    fn check(field: &Density, tolerance: f64) {
        let origin = DVec3::new(-0.91, -0.13, 0.27);
        for direction in [DVec3::X, DVec3::new(0.48, -0.6, 0.64), DVec3::new(0.8, 0.0, -0.6), DVec3::Y] {
            let n = 1_000_000;
            let h = 1.7 / f64::from(n);
            let middle = |i: u32| origin + direction * (0.1 + (f64::from(i) + 0.5) * h);
            let fine: f64 = (0..n).map(|i| field.value(middle(i)).0).sum::<f64>() * h;
            let got =
                Field::new(field).length(origin, direction, 0.1, 1.8, (&mut Vec::new(), &mut Vec::new()));
            assert!((got - fine).abs() < tolerance, "{direction}: {got} and {fine}");
        }
    }

    #[test]
    fn layers() {
        let axis = DVec3::new(0.6, 0.8, 0.0);
        // Each of about 20 jumps of at most 2.8 is misplaced by at most half a step of 1.7e-6 in the sum.
        check(&Density::Layers(Layers { axis, period: 0.25, densities: vec![1.0, 0.2, 3.0] }), 5e-5);
    }

    #[test]
    fn grids() {
        let values = |n: usize| (0..n).map(|i| ((i * 7 + i / 5) % 11) as f32).collect();
        let (low, high) = (DVec3::splat(-1.0), DVec3::new(0.5, 1.0, 0.8));
        check(&Density::Grid(Grid::new([5, 6, 7], low, high, values(210)).unwrap()), 1e-6);
        check(&Density::Grid(Grid::new([1, 16, 1], low, high, values(16)).unwrap()), 1e-6);
        let steps = (0..24).map(|i| if i / 4 % 2 == 0 { 3.0 } else { 18.0 }).collect();
        check(&Density::Grid(Grid::new([1, 1, 24], low, high, steps).unwrap()), 1e-6);
    }

    #[test]
    fn solids() {
        let solid = |solid, density| Shape { solid, density, absorb: false };
        let ring =
            Solid::Torus { center: DVec3::new(0.1, 0.0, 0.2), axis: DVec3::Y, radius: 0.5, tube: 0.15 };
        let shapes = vec![
            solid(ring, 40.0),
            solid(Solid::Sphere { center: DVec3::ZERO, radius: 0.4 }, 2.0),
            solid(Solid::Box { min: DVec3::splat(-0.3), max: DVec3::splat(0.1) }, 7.0),
        ];
        // Up to 10 jumps of at most 40 times half a step.
        check(&Density::Shapes(Shapes { base: 0.2, shapes }), 4e-4);
    }

    #[test]
    fn noise() {
        // Kinks in the second derivative at cell faces limit the two-point rule; 2e-4 of a mean of about 1.
        check(&Density::Noise(Noise { seed: 1, frequency: 3.0, octaves: 4, range: [0.2, 1.8] }), 2e-4);
    }
}
