//! The kernels that one ray meets, weighted eight at a time: the inner loop of [`crate::reconstruct`].
//!
//! [`crate::kernel::integral`] branches and takes up to seven exponentials; here is the same without branches, so that the
//! compiler turns the loop over the lanes into vector instructions. With half = κ/2a, u = a(t - tc), x = u + half, e = f(t),
//! the attenuated Gaussian at an end of the clipped support, and E(x) = e^{x²} erfc x:
//!
//!   ∫f = √π/2a [q(from) - q(to) + p],   q = sign(x) E(|x|) e,   p = 2 max f where the maximum lies between the ends, else 0
//!
//! Nothing overflows or cancels but at pieces much shorter than a kernel, where weights lose what the piece's own emission
//! lacks: the error is below 2e-6 of the whole kernel's weight. Exponential and error function are those of
//! [`crate::approx`]. Media so dense that only the rim of a kernel counts go to [`crate::kernel::integral`].

use crate::approx::{exp, scaled_erfc};
use crate::kernel::{self, CUT_OFF, CUT_OFF_VALUE};
use crate::reconstruct::{Along, PieceSum};
use crate::slopes::{MOST_EXPONENT, Source};
use glam::Vec3;

/// Kernels worked on at once.
pub const LANES: usize = 8;

/// One number for each of [`LANES`] kernels.
pub type Lanes = [f32; LANES];

/// κ/a of media that are too dense for the form without branches.
pub const DENSE: f32 = 2.0;

/// A kernel as seen from a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Ray parameter of the closest approach to the centre.
    pub tc: f32,
    /// Squared distance of the ray's line from the centre, less than C / a².
    pub d2: f32,
    /// Sharpness a.
    pub a: f32,
    /// Weight w.
    pub weight: f32,
    /// v at the kernel's centre, per channel.
    pub source: Vec3,
    /// ln of how much v grows from the centre to the ray's closest approach, per channel.
    pub rise: [f32; 3],
    /// Slope of ln v along the ray, per channel.
    pub slope: [f32; 3],
}

impl Hit {
    /// A kernel at `to_centre` from the ray's origin; `None` where the ray (unit direction) misses its support.
    #[inline]
    pub fn new(to_centre: Vec3, direction: Vec3, a: f32, weight: f32, source: &Source) -> Option<Self> {
        let tc = to_centre.dot(direction);
        let across = to_centre - direction * tc;
        let d2 = across.length_squared();
        (a * a * d2 < CUT_OFF).then(|| Self {
            tc,
            d2,
            a,
            weight,
            source: source.value,
            rise: source.slope.map(|h| -h.dot(across)),
            slope: source.slope.map(|h| h.dot(direction)),
        })
    }
}

#[derive(Clone, Copy)]
struct Chunk {
    tc: Lanes,
    d2: Lanes,
    a: Lanes,
    weight: Lanes,
    source: [Lanes; 3],
    rise: [Lanes; 3],
    slope: [Lanes; 3],
}

impl Chunk {
    /// Kernels without weight that are easy on the arithmetic.
    const EMPTY: Self = Self {
        tc: [0.0; LANES],
        d2: [0.0; LANES],
        a: [1.0; LANES],
        weight: [0.0; LANES],
        source: [[0.0; LANES]; 3],
        rise: [[0.0; LANES]; 3],
        slope: [[0.0; LANES]; 3],
    };
}

impl Chunk {
    /// v of channel `c`, averaged over each kernel's weight along the ray, whose mean lies `mean` behind the closest
    /// approach: v e^{rise + slope · mean + slope² · variance / 2}, with the weight's variance 1/2a², or length²/12
    /// where that is less.
    #[inline(always)]
    fn source_at(&self, c: usize, mean: &Lanes, length: &Lanes) -> Lanes {
        let mut out = [0.0; LANES];
        for (k, out) in out.iter_mut().enumerate() {
            let s = self.slope[c][k];
            let (whole, part) = (0.25 / (self.a[k] * self.a[k]), length[k] * length[k] * (1.0 / 24.0));
            let spread = if part < whole { part } else { whole };
            let exponent = self.rise[c][k] + s * (mean[k] + s * spread);
            *out = self.source[c][k] * exp(exponent.clamp(-MOST_EXPONENT, MOST_EXPONENT));
        }
        out
    }
}

/// The part of each lane's support inside a piece, and its weight (0 where there is none).
#[derive(Clone, Copy)]
struct Clipped {
    from: Lanes,
    length: Lanes,
    weight: Lanes,
}

/// Parts of a kernel's support where the density varies: each has its own mean density and attenuation.
pub const PARTS: usize = 4;

impl Clipped {
    /// Equal parts of every support, the nearest first.
    fn parts(&self) -> [Self; PARTS] {
        let length = self.length.map(|l| l * (1.0 / PARTS as f32));
        let mut part = Self { from: self.from, length, weight: self.weight };
        std::array::from_fn(|_| {
            let own = part;
            part.from.iter_mut().zip(&length).for_each(|(from, length)| *from += length);
            own
        })
    }
}

/// Kernels along one ray. Reused from ray to ray.
#[derive(Clone, Default)]
pub struct Hits {
    chunks: Vec<Chunk>,
    len: usize,
}

impl Hits {
    /// Forgets all kernels, keeps the memory.
    pub fn clear(&mut self) {
        self.chunks.clear();
        self.len = 0;
    }

    /// Number of kernels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a kernel.
    #[inline]
    pub fn push(&mut self, hit: Hit) {
        let lane = self.len % LANES;
        if lane == 0 {
            self.chunks.push(Chunk::EMPTY);
        }
        self.len += 1;
        if let Some(chunk) = self.chunks.last_mut() {
            chunk.tc[lane] = hit.tc;
            chunk.d2[lane] = hit.d2;
            chunk.a[lane] = hit.a;
            chunk.weight[lane] = hit.weight;
            for c in 0..3 {
                chunk.source[c][lane] = hit.source[c];
                chunk.rise[c][lane] = hit.rise[c];
                chunk.slope[c][lane] = hit.slope[c];
            }
        }
    }

    /// Radiance of one inside piece `start..end` of the ray, seen from its start.
    pub fn piece_radiance(&self, start: f32, end: f32, along: &Along) -> PieceSum {
        let kappa = match along {
            Along::Uniform(k) | Along::Profile(k, _) => *k,
        };
        let grey = kappa.x == kappa.y && kappa.y == kappa.z;
        let (mut numerator, mut denominator, mut splats) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], 0);
        for chunk in &self.chunks {
            let whole = clip(chunk, start, end);
            let count = whole.weight.iter().filter(|w| **w > 0.0).count();
            if count == 0 {
                continue;
            }
            splats += count as u32;
            let mut add_part = |clipped: &Clipped| {
                let path = Path::new(along, clipped, start);
                if grey {
                    let (w, mean) = path.weights(kappa.x, chunk, clipped);
                    add(&mut denominator[0], &w);
                    for (c, sum) in numerator.iter_mut().enumerate() {
                        add_product(sum, &w, &chunk.source_at(c, &mean, &clipped.length));
                    }
                } else {
                    for c in 0..3 {
                        let (w, mean) = path.weights(kappa[c], chunk, clipped);
                        add(&mut denominator[c], &w);
                        add_product(&mut numerator[c], &w, &chunk.source_at(c, &mean, &clipped.length));
                    }
                }
            };
            match along {
                Along::Uniform(_) => add_part(&whole),
                Along::Profile(..) => whole.parts().iter().for_each(add_part),
            }
        }
        if grey {
            denominator = [denominator[0]; 3];
        }
        let mean = |c: usize| {
            let (n, d): (f32, f32) = (numerator[c].iter().sum(), denominator[c].iter().sum());
            if d > 0.0 { n / d } else { 0.0 }
        };
        let radiance = along.emission(start, end) * Vec3::new(mean(0), mean(1), mean(2));
        PieceSum { radiance, splats }
    }
}

/// The medium over each lane's support, at unit κ: depth in front, mean density, mean scattering density and its place.
struct Path {
    before: Lanes,
    density: Lanes,
    scattering: Lanes,
    /// From each support's middle to the mean place where it scatters, as far as the density alone says.
    shift: Lanes,
}

impl Path {
    fn new(along: &Along, clipped: &Clipped, start: f32) -> Self {
        let mut path = Self {
            before: [0.0; LANES],
            density: [1.0; LANES],
            scattering: [1.0; LANES],
            shift: [0.0; LANES],
        };
        match along {
            Along::Uniform(_) => {
                for k in 0..LANES {
                    path.before[k] = clipped.from[k] - start;
                }
            }
            Along::Profile(_, profile) => {
                for k in 0..LANES {
                    if clipped.weight[k] > 0.0 {
                        let from = clipped.from[k];
                        let (first, last) = (profile.at(from), profile.at(from + clipped.length[k]));
                        let inverse = 1.0 / clipped.length[k];
                        path.before[k] = first[0];
                        path.density[k] = (last[0] - first[0]) * inverse;
                        let mass = last[1] - first[1];
                        path.scattering[k] = mass * inverse;
                        if mass > 0.0 {
                            let half = 0.5 * clipped.length[k];
                            let middle = from + half - start;
                            path.shift[k] = ((last[2] - first[2]) / mass - middle).clamp(-half, half);
                        }
                    }
                }
            }
        }
        path
    }

    /// W_i of every lane for the extinction `kappa` of one channel, and the mean of t - tc under it. The closed form takes
    /// the density as even over the support; what is uneven moves the mean.
    fn weights(&self, kappa: f32, chunk: &Chunk, clipped: &Clipped) -> (Lanes, Lanes) {
        let (mut out, mut mean) = ([0.0; LANES], [0.0; LANES]);
        let dense = (0..LANES).fold(false, |any, k| any | (kappa * self.density[k] > DENSE * chunk.a[k]));
        let lane = |k: usize| {
            let s = clipped.from[k] - chunk.tc[k];
            (chunk.a[k], chunk.d2[k], s, clipped.length[k], kappa * self.density[k], kappa * self.before[k])
        };
        for k in 0..LANES {
            let (a, d2, s, length, here, before) = lane(k);
            let (w, m) = attenuated_integral(a, d2, s, length, here, before);
            out[k] = w * (clipped.weight[k] * self.scattering[k]);
            mean[k] = m;
        }
        for k in (0..LANES).filter(|_| dense) {
            let (a, d2, s, length, here, before) = lane(k);
            let (w, m) = dense_integral(a, d2, s, length, here, before);
            out[k] = w * (clipped.weight[k] * self.scattering[k]);
            mean[k] = m;
        }
        for (k, mean) in mean.iter_mut().enumerate() {
            let low = clipped.from[k] - chunk.tc[k];
            let high = low + clipped.length[k];
            let moved = *mean + self.shift[k];
            let moved = if moved > low { moved } else { low };
            *mean = if moved < high { moved } else { high };
        }
        (out, mean)
    }
}

fn add(sum: &mut Lanes, x: &Lanes) {
    for k in 0..LANES {
        sum[k] += x[k];
    }
}

fn add_product(sum: &mut Lanes, x: &Lanes, y: &Lanes) {
    for k in 0..LANES {
        sum[k] += x[k] * y[k];
    }
}

fn clip(chunk: &Chunk, start: f32, end: f32) -> Clipped {
    let mut clipped = Clipped { from: [0.0; LANES], length: [0.0; LANES], weight: [0.0; LANES] };
    for k in 0..LANES {
        let h2 = CUT_OFF / (chunk.a[k] * chunk.a[k]) - chunk.d2[k];
        let reach = h2.max(0.0).sqrt();
        let (low, high) = (chunk.tc[k] - reach, chunk.tc[k] + reach);
        let from = if low > start { low } else { start };
        let to = if high < end { high } else { end };
        let length = to - from;
        clipped.from[k] = from;
        clipped.length[k] = if length > 0.0 { length } else { 0.0 };
        clipped.weight[k] = if length > 0.0 { chunk.weight[k] } else { 0.0 };
    }
    clipped
}

/// W of [`crate::reconstruct`] without w, and the mean of t - tc (see [`crate::kernel::mean_offset`]); `s` = from - tc,
/// `before` is the optical depth in front of the support.
#[inline(always)]
fn attenuated_integral(a: f32, d2: f32, s: f32, length: f32, kappa: f32, before: f32) -> (f32, f32) {
    const HALF_ROOT_PI: f32 = 0.886_226_95;
    let inverse = 1.0 / a;
    let half = 0.5 * kappa * inverse;
    let (u0, u1) = (a * s, a * (s + length));
    let (x0, x1) = (u0 + half, u1 + half);
    let y = kappa * length;
    let front = a * a * d2 + before;
    let (e0, e1) = (exp(-front - u0 * u0), exp(-front - y - u1 * u1));
    // The maximum is never more than 1 where it counts.
    let peak = half * (u0 + x0) - front;
    let peak = 2.0 * exp(if peak < 0.0 { peak } else { 0.0 });
    let (p0, p1) = (scaled_erfc(x0.abs()) * e0, scaled_erfc(x1.abs()) * e1);
    let q0 = if x0 >= 0.0 { p0 } else { -p0 };
    let q1 = if x1 > 0.0 { p1 } else { -p1 };
    let between = if x0 < 0.0 && x1 > 0.0 { peak } else { 0.0 };
    let whole = HALF_ROOT_PI * inverse * (q0 - q1 + between);
    let w = whole - CUT_OFF_VALUE * length * sinh_ratio(0.25 * y * y) * exp(-before - 0.5 * y);
    let whole = if whole > 1e-30 { whole } else { 1e-30 };
    let mean = inverse * (0.5 * inverse * (e0 - e1) / whole - half);
    let mean = if mean > s { mean } else { s };
    let mean = if mean < s + length { mean } else { s + length };
    (if w > 0.0 { w } else { 0.0 }, mean)
}

/// sinh z / z of z² within 0..20, relative error below 3e-6: what e^{-y/2} lacks of the decay's mean over a depth y = 2z.
#[inline(always)]
fn sinh_ratio(z2: f32) -> f32 {
    let p = 2.003_911_6e-4 + z2 * (2.538_488_6e-6 + z2 * 3.540_11e-8);
    0.999_998 + z2 * (0.166_676_79 + z2 * (0.008_325_651 + z2 * p))
}

/// The same by the general form.
fn dense_integral(a: f32, d2: f32, s: f32, length: f32, kappa: f32, before: f32) -> (f32, f32) {
    if length <= 0.0 {
        return (0.0, s);
    }
    let g = kernel::integral(a, d2, 0.0, kappa, s, s + length);
    (g * (-before).exp(), kernel::mean_offset(a, d2, 0.0, kappa, s, s + length, g))
}

#[cfg(test)]
mod tests;
