//! Spherical harmonics of many functions in few bytes.
//!
//! Every function has its own order (number of bands) and scale; a coefficient of band l is one small integer q with
//! [`bits`]`(l)` bits, and stands for
//!
//!   c = scale · profile_l · sign q · (|q| / Q_l)^(3/2),   Q_l = 2^(bits-1) - 1
//!
//! The profile tells how large the bands typically are, once for all functions; the power spends more codes on small
//! values, of which there are many. Precision is cheap and order is not, so high bands
//! have few bits.
//!
//! Layout of `codes`: functions one after the other, each starting at a byte; within one, coefficients in the order
//! l(l+1)+m, two's complement, lowest bits first.

use crate::sh::{MAX_ORDER, coefficient_count};
use crate::{Error, Result};
use half::f16;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::sync::LazyLock;

/// Bits of a coefficient of `band`.
pub const fn bits(band: usize) -> u32 {
    match band {
        0 => 8,
        1 | 2 => 6,
        3 => 5,
        4..=6 => 4,
        _ => 3,
    }
}

/// Bits in front of a band's coefficients.
pub const fn bits_before(band: usize) -> u32 {
    let (mut sum, mut l) = (0, 0);
    while l < band {
        sum += bits(l) * (2 * l as u32 + 1);
        l += 1;
    }
    sum
}

/// Bytes of a function with `order` bands.
pub const fn bytes(order: usize) -> usize {
    bits_before(order).div_ceil(8) as usize
}

/// Largest |q| of a band.
fn most(band: usize) -> f32 {
    ((1i32 << (bits(band) - 1)) - 1) as f32
}

/// Smallest profile that is stored: no band divides by zero.
const LEAST_PROFILE: f32 = 1e-5;
/// The scales that are tried, in units of the one that fits the largest coefficient.
const CLIPS: [f32; 4] = [1.0, 0.85, 0.7, 0.55];

/// Quantised coefficients of many functions. Parallel arrays: one order and scale a function.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Harmonics {
    /// Bands, 0..=[`MAX_ORDER`].
    pub order: Vec<u8>,
    /// Value of the largest code at profile 1.
    pub scale: Vec<f16>,
    /// Typical size of a band's coefficients relative to band 0; as many as the highest order.
    pub profile: Vec<f32>,
    /// See the module's head.
    pub codes: Vec<u8>,
}

/// Coefficients of many functions as plain numbers, one function after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Bands of each function.
    pub order: Vec<u8>,
    /// Where each function's `order`² values start.
    pub start: Vec<usize>,
    /// All values.
    pub values: Vec<f32>,
}

impl Coefficients {
    /// Functions without values yet, of the given orders.
    pub fn zeros(order: Vec<u8>) -> Self {
        let mut sum = 0;
        let start = order
            .iter()
            .map(|k| {
                let at = sum;
                sum += coefficient_count(usize::from(*k));
                at
            })
            .collect();
        Self { order, start, values: vec![0.0; sum] }
    }

    /// Coefficients of function `i`.
    pub fn of(&self, i: usize) -> &[f32] {
        &self.values[self.start[i]..self.start[i] + coefficient_count(usize::from(self.order[i]))]
    }

    /// As [`Self::of`], to be written.
    pub fn of_mut(&mut self, i: usize) -> &mut [f32] {
        &mut self.values[self.start[i]..self.start[i] + coefficient_count(usize::from(self.order[i]))]
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Quantises, every coefficient to the nearest code. Values that are not finite count as 0.
    pub fn quantised(&self) -> Harmonics {
        let Ok(out) = self.quantised_by(|_, _, _| Ok::<(), Infallible>(()));
        out
    }

    /// Quantises; `choose` gets each function's index, its code book and the nearest codes, and may take others.
    ///
    /// # Errors
    /// The first of `choose`, which ends it.
    pub fn quantised_by<E: Send>(
        &self,
        choose: impl Fn(usize, &CodeBook<'_>, &mut [i32]) -> std::result::Result<(), E> + Sync,
    ) -> std::result::Result<Harmonics, E> {
        let profile = self.profile();
        let one = |i: usize| {
            let (scale, mut q) = quantise(self.of(i), &profile);
            choose(i, &CodeBook { scale: scale.to_f32(), profile: &profile }, &mut q)?;
            Ok((scale, q))
        };
        let all: Vec<(f16, Vec<i32>)> = (0..self.len())
            .into_par_iter()
            .with_min_len(64)
            .map(one)
            .collect::<std::result::Result<_, E>>()?;
        let mut out = Harmonics { order: self.order.clone(), ..Harmonics::default() };
        for (scale, q) in all {
            out.scale.push(scale);
            put(&q, &mut out.codes);
        }
        out.profile = profile;
        Ok(out)
    }

    /// Root mean square of each band's coefficients, functions normalised, relative to band 0.
    fn profile(&self) -> Vec<f32> {
        let highest = usize::from(self.order.iter().copied().max().unwrap_or(0));
        let mut sums = vec![(0.0f64, 0.0f64); highest];
        for i in 0..self.len() {
            let c = self.of(i);
            let energy: f64 = c.iter().map(|v| f64::from(*v).powi(2)).sum();
            if !(energy > 0.0 && energy.is_finite()) {
                continue;
            }
            for (l, sum) in sums.iter_mut().enumerate().take(usize::from(self.order[i])) {
                let band: f64 = c[l * l..(l + 1) * (l + 1)].iter().map(|v| f64::from(*v).powi(2)).sum();
                sum.0 += band / (energy * (2 * l + 1) as f64);
                sum.1 += 1.0;
            }
        }
        let rms: Vec<f64> = sums.iter().map(|(s, n)| (s / n.max(1.0)).sqrt()).collect();
        let first = rms.first().copied().unwrap_or(1.0).max(1e-12);
        rms.iter().map(|r| ((r / first) as f32).clamp(LEAST_PROFILE, 1.0 / LEAST_PROFILE)).collect()
    }
}

impl Harmonics {
    /// Number of functions.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// First byte of each function in `codes`.
    pub fn starts(&self) -> Vec<usize> {
        let mut sum = 0;
        self.order
            .iter()
            .map(|k| {
                let at = sum;
                sum += bytes(usize::from(*k));
                at
            })
            .collect()
    }

    /// The functions of these numbers, in this order; numbers of functions that are not there are left out.
    pub fn picked(&self, numbers: impl IntoIterator<Item = usize>) -> Self {
        let starts = self.starts();
        let mut out = Self { profile: self.profile.clone(), ..Self::default() };
        for i in numbers {
            let (Some(order), Some(scale), Some(start)) =
                (self.order.get(i), self.scale.get(i), starts.get(i))
            else {
                continue;
            };
            if let Some(codes) = self.codes.get(*start..start + bytes(usize::from(*order))) {
                out.order.push(*order);
                out.scale.push(*scale);
                out.codes.extend_from_slice(codes);
            }
        }
        out
    }

    /// Coefficients as plain numbers.
    pub fn decoded(&self) -> Coefficients {
        let mut out = Coefficients::zeros(self.order.clone());
        let starts = self.starts();
        for (i, start) in starts.into_iter().enumerate() {
            let order = usize::from(self.order[i]);
            let scale = self.scale[i].to_f32();
            let codes = &self.codes[start..start + bytes(order)];
            let values = out.of_mut(i);
            for (value, place) in values.iter_mut().zip(places(order)) {
                *value =
                    scale * self.profile[place.band] * expanded(get(codes, place.at, place.bits), place.band);
            }
        }
        out
    }

    /// Checks that the arrays fit together.
    ///
    /// # Errors
    /// What does not, named by `what`.
    pub fn validate(&self, count: usize, highest: usize, what: &str) -> Result<()> {
        let fail = || Err(Error::invalid(format!("the asset's {what} do not fit together")));
        if self.order.len() != count || self.scale.len() != count || self.profile.len() > MAX_ORDER {
            return fail();
        }
        let most = usize::from(self.order.iter().copied().max().unwrap_or(0));
        if most > highest || most > self.profile.len() {
            return fail();
        }
        let total: usize = self.order.iter().map(|k| bytes(usize::from(*k))).sum();
        let finite = self.profile.iter().all(|p| p.is_finite()) && self.scale.iter().all(|s| s.is_finite());
        if total != self.codes.len() || !finite { fail() } else { Ok(()) }
    }
}

/// What the codes of one function stand for.
pub struct CodeBook<'a> {
    scale: f32,
    profile: &'a [f32],
}

impl CodeBook<'_> {
    /// The coefficient that code `q` of `band` stands for.
    #[inline]
    pub fn value(&self, band: usize, q: i32) -> f32 {
        self.scale * self.profile[band] * expanded(q, band)
    }

    /// The code whose value is nearest to a finite `value`.
    #[inline]
    pub fn nearest(&self, band: usize, value: f32) -> i32 {
        let unit = self.scale * self.profile[band];
        if unit <= 0.0 {
            return 0;
        }
        let u = (value.abs() / unit).min(1.0);
        let q = MIDDLES[bits(band) as usize].partition_point(|middle| u > *middle) as i32;
        if value < 0.0 { -q } else { q }
    }
}

/// For each number of bits: what lies in the middle between the values of neighbouring codes, upwards from 0.
static MIDDLES: LazyLock<[Vec<f32>; 9]> = LazyLock::new(|| {
    let mut all = [const { Vec::new() }; 9];
    for band in 0..MAX_ORDER {
        let middle = |q: i32| 0.5 * (expanded(q, band) + expanded(q + 1, band));
        all[bits(band) as usize] = (0..most(band) as i32).map(middle).collect();
    }
    all
});

/// Where a coefficient's code is.
struct Place {
    band: usize,
    at: u32,
    bits: u32,
}

/// Places of all coefficients of `order` bands, in their order.
fn places(order: usize) -> impl Iterator<Item = Place> {
    (0..order).flat_map(|band| {
        let (before, bits) = (bits_before(band), bits(band));
        (0..2 * band as u32 + 1).map(move |k| Place { band, at: before + k * bits, bits })
    })
}

/// sign q (|q|/Q)^(3/2).
fn expanded(q: i32, band: usize) -> f32 {
    let u = (q as f32).abs() / most(band);
    (u * u.sqrt()).copysign(q as f32)
}

/// Scale and codes of one function: of a few scales the one with the least squared error.
fn quantise(c: &[f32], profile: &[f32]) -> (f16, Vec<i32>) {
    let order = c.len().isqrt();
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    let largest = c
        .iter()
        .zip(places(order))
        .fold(0.0f32, |a, (v, place)| a.max(finite(*v).abs() / profile[place.band]));
    let mut best = (f32::INFINITY, f16::ZERO, vec![0; c.len()]);
    for clip in CLIPS {
        let scale = f16::from_f32((clip * largest).min(65504.0));
        let book = CodeBook { scale: scale.to_f32(), profile };
        if book.scale <= 0.0 {
            continue;
        }
        let mut error = 0.0;
        let mut q = vec![0; c.len()];
        for ((q, v), place) in q.iter_mut().zip(c).zip(places(order)) {
            let v = finite(*v);
            *q = book.nearest(place.band, v);
            error += (book.value(place.band, *q) - v).powi(2);
        }
        if error < best.0 {
            best = (error, scale, q);
        }
    }
    (best.1, best.2)
}

fn put(q: &[i32], codes: &mut Vec<u8>) {
    let order = q.len().isqrt();
    let base = codes.len();
    codes.resize(base + bytes(order), 0);
    for (q, place) in q.iter().zip(places(order)) {
        let word = ((*q as u32) & ((1 << place.bits) - 1)) << (place.at % 8);
        let byte = base + (place.at / 8) as usize;
        codes[byte] |= word as u8;
        if word > 0xff {
            codes[byte + 1] |= (word >> 8) as u8;
        }
    }
}

fn get(codes: &[u8], at: u32, width: u32) -> i32 {
    let byte = (at / 8) as usize;
    let high = codes.get(byte + 1).copied().unwrap_or(0);
    let word = (u32::from(codes[byte]) | u32::from(high) << 8) >> (at % 8);
    // Sign extension from the field's top bit.
    ((word << (32 - width)) as i32) >> (32 - width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(i: u64, n: u64) -> f32 {
        crate::directions::hash(i, n) as f32 / 2f32.powi(63) - 1.0
    }

    fn falling(count: usize) -> Coefficients {
        let mut c = Coefficients::zeros((0..count).map(|i| (i % (MAX_ORDER + 1)) as u8).collect());
        for i in 0..count {
            for (k, v) in c.of_mut(i).iter_mut().enumerate() {
                let l = k.isqrt() as f32;
                *v = 10f32.powf(3.0 * unit(i as u64, 999)) * unit(i as u64, k as u64) / (1.0 + l * l);
            }
        }
        c
    }

    #[test]
    fn error_is_small_and_decoding_is_stable() {
        let exact = falling(400);
        let packed = exact.quantised();
        packed.validate(400, MAX_ORDER, "harmonics").unwrap();
        let read = packed.decoded();
        for i in 0..400 {
            let (a, b) = (exact.of(i), read.of(i));
            let size: f32 = a.iter().map(|v| v * v).sum();
            let error: f32 = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum();
            assert!(error <= 0.01 * size, "function {i}: {}", (error / size).sqrt());
        }
        // What is read packs to itself, so that a file survives being read and written.
        assert_eq!(packed.clone().decoded(), read);
    }

    #[test]
    fn sizes() {
        assert_eq!((bytes(0), bytes(1), bytes(2), bytes(10)), (0, 1, 4, 47));
        let packed = falling(50).quantised();
        assert_eq!(
            packed.starts().last().unwrap() + bytes(usize::from(packed.order[49])),
            packed.codes.len()
        );
    }

    #[test]
    fn zero_codes_are_zero_and_odd_values_harmless() {
        let mut c = Coefficients::zeros(vec![3, 2]);
        c.values.fill(f32::NAN);
        assert!(c.quantised().decoded().values.iter().all(|v| *v == 0.0));
        let mut packed = falling(30).quantised();
        packed.codes.fill(0);
        assert!(packed.decoded().values.iter().all(|v| *v == 0.0));
        packed.codes.push(0);
        assert!(packed.validate(30, MAX_ORDER, "harmonics").is_err());
    }
}
