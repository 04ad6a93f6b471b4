//! ψ̂ of many fitted values at once: the loops of the fits, compiled for AVX2 as well and chosen at run time.
//!
//! Sums run in [`LANES`] partial sums whatever the machine, so that they are the same everywhere.

use diaphane_formats::approx::exp;
use diaphane_formats::encoding::Encoding;
use pulp::Arch;

/// Partial sums of [`sum`].
pub(super) const LANES: usize = 16;

/// Least |dψ̂/dy| where ψ̂ is clamped: small where it is right, larger where a wrong value must be able to move.
pub(super) const SLOPE_RIGHT: f32 = 0.02;
const SLOPE_WRONG: f32 = 0.15;
/// See [`importance`].
const DARK_COUNTS: f32 = 1.0;
/// See [`sensitivities`].
const BLUR: f32 = 0.1;

/// How much a squared error counts where the fit says ψ̂, 1 at ψ̂ = 0.3: between absolute and relative error, because a
/// scene that is lit through dark parts is looked at as bright as others. It is taken at the fit, not at ψ itself, which
/// carries the noise of few rays: weights that follow the noise would pull the fit down.
#[inline(always)]
fn importance(psi: f32) -> f32 {
    (0.3 + DARK_COUNTS) / (psi + DARK_COUNTS)
}

/// One encoding, without branches.
trait Decode: Copy {
    /// Sign of dψ̂/dy.
    const SIGN: f32;
    /// ψ̂ and |dψ̂/dy|; the slope is 0 where ψ̂ is clamped.
    fn at(self, y: f32) -> (f32, f32);
}

#[derive(Clone, Copy)]
struct Transmittance;

impl Decode for Transmittance {
    const SIGN: f32 = 1.0;
    #[inline(always)]
    fn at(self, y: f32) -> (f32, f32) {
        (y.clamp(0.0, 1.0), 1.0)
    }
}

#[derive(Clone, Copy)]
struct Depth;

impl Decode for Depth {
    const SIGN: f32 = -1.0;
    #[inline(always)]
    fn at(self, y: f32) -> (f32, f32) {
        let psi = exp(-y.max(0.0));
        (psi, if y > 0.0 { psi } else { 0.0 })
    }
}

/// Holds ε.
#[derive(Clone, Copy)]
struct Reciprocal(f32);

impl Decode for Reciprocal {
    const SIGN: f32 = 1.0;
    #[inline(always)]
    fn at(self, y: f32) -> (f32, f32) {
        // What is smaller is dark beyond the range of numbers.
        let tau = 1.0 / y.max(1e-3);
        let psi = exp((self.0 - tau).min(0.0));
        (psi, if tau > self.0 { psi * tau * tau } else { 0.0 })
    }
}

/// The widest vectors that pay for loops over some hundred values: 256 bits. (Vectors of 512 left much of them to what comes
/// after the last full one; rounding took a sixth longer.)
pub(super) fn narrow() -> Arch {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return Arch::V3(simd);
    }
    Arch::new()
}

/// A loop for any encoding.
trait Work {
    type Out;
    fn run<D: Decode>(self, decode: D) -> Self::Out;
}

fn dispatch<W: Work>(encoding: Encoding, work: W) -> W::Out {
    let arch = narrow();
    match encoding {
        Encoding::Transmittance => arch.dispatch(
            #[inline(always)]
            || work.run(Transmittance),
        ),
        Encoding::Depth => arch.dispatch(
            #[inline(always)]
            || work.run(Depth),
        ),
        Encoding::Reciprocal { epsilon } | Encoding::Lobe { epsilon } => arch.dispatch(
            #[inline(always)]
            || work.run(Reciprocal(epsilon)),
        ),
    }
}

/// Σ f over elements of equally long slices.
macro_rules! sum {
    (|$($x:ident),+| $value:expr) => {{
        let mut sums = [0.0f32; LANES];
        let mut rest = 0.0f32;
        let count = [$($x.len()),+].into_iter().min().unwrap_or(0);
        let whole = count / LANES * LANES;
        let mut at = 0;
        while at < whole {
            $(let $x = &$x[at..at + LANES];)+
            for lane in 0..LANES {
                $(let $x = $x[lane];)+
                sums[lane] += $value;
            }
            at += LANES;
        }
        for at in whole..count {
            $(let $x = $x[at];)+
            rest += $value;
        }
        sums.into_iter().sum::<f32>() + rest
    }};
}
pub(super) use sum;

/// Sums and differences of both halves.
pub(super) fn butterfly(values: &mut [f32]) {
    let (left, right) = values.split_at_mut(values.len() / 2);
    narrow().dispatch(
        #[inline(always)]
        || left.iter_mut().zip(right).for_each(|(a, b)| (*a, *b) = (*a + *b, *a - *b)),
    );
}

/// Multiplies by the squares of the weights.
pub(super) fn times_square(values: &mut [f32], weight: &[f32]) {
    narrow().dispatch(
        #[inline(always)]
        || values.iter_mut().zip(weight).for_each(|(v, w)| *v *= w * w),
    );
}

/// What a step of the fit needs of one function.
pub(super) struct Linear<'a> {
    /// √c dψ̂/dy, c being the [`importance`]; at least the floors.
    pub weight: &'a mut [f32],
    /// √c (ψ - ψ̂).
    pub right: &'a mut [f32],
    /// c.
    pub counts: &'a mut [f32],
}

/// Linearises around `y`.
pub(super) fn linearise(encoding: Encoding, y: &[f32], psi: &[f32], out: Linear<'_>) {
    struct Loop<'a>(&'a [f32], &'a [f32], Linear<'a>);
    impl Work for Loop<'_> {
        type Out = ();
        #[inline(always)]
        fn run<D: Decode>(self, decode: D) {
            let Self(y, psi, Linear { weight, right, counts }) = self;
            for ((((y, psi), w), r), c) in y.iter().zip(psi).zip(weight).zip(right).zip(counts) {
                let (value, slope) = decode.at(*y);
                let residual = psi - value;
                let floor = if residual.abs() > 1e-3 { SLOPE_WRONG } else { SLOPE_RIGHT };
                *c = importance(value);
                let root = c.sqrt();
                *w = D::SIGN * root * slope.max(floor);
                *r = root * residual;
            }
        }
    }
    dispatch(encoding, Loop(y, psi, out));
}

/// Σ c (ψ̂(y + length · moved) - ψ)².
pub(super) fn error_along(
    encoding: Encoding,
    [y, moved]: [&[f32]; 2],
    length: f32,
    psi: &[f32],
    counts: &[f32],
) -> f32 {
    struct Loop<'a>([&'a [f32]; 4], f32);
    impl Work for Loop<'_> {
        type Out = f32;
        #[inline(always)]
        fn run<D: Decode>(self, decode: D) -> f32 {
            let Self([y, moved, psi, counts], length) = self;
            sum!(|y, moved, psi, counts| {
                let error = decode.at(y + length * moved).0 - psi;
                counts * error * error
            })
        }
    }
    dispatch(encoding, Loop([y, moved, psi, counts], length))
}

/// Σ (ψ̂(y) - ψ)², weighted by [`importance`].
pub(super) fn error(encoding: Encoding, y: &[f32], psi: &[f32]) -> f32 {
    struct Loop<'a>(&'a [f32], &'a [f32]);
    impl Work for Loop<'_> {
        type Out = f32;
        #[inline(always)]
        fn run<D: Decode>(self, decode: D) -> f32 {
            let Self(y, psi) = self;
            sum!(|y, psi| {
                let value = decode.at(y).0;
                importance(value) * (value - psi) * (value - psi)
            })
        }
    }
    dispatch(encoding, Loop(y, psi))
}

/// Replaces every y by |dψ̂/dy|, which is 0 where ψ̂ is clamped.
pub(super) fn slopes(encoding: Encoding, y: &mut [f32]) {
    struct Loop<'a>(&'a mut [f32]);
    impl Work for Loop<'_> {
        type Out = ();
        #[inline(always)]
        fn run<D: Decode>(self, decode: D) {
            self.0.iter_mut().for_each(|y| *y = decode.at(*y).1);
        }
    }
    dispatch(encoding, Loop(y));
}

/// Replaces every y by the squared change of ψ̂, weighted by [`importance`], that a unit change of y makes around it: mean
/// over y and what is `BLUR` less and more, because errors are large enough to reach brighter places. Never 0, so that
/// clamped values stay clamped.
pub(super) fn sensitivities(encoding: Encoding, y: &mut [f32]) {
    struct Loop<'a>(&'a mut [f32]);
    impl Work for Loop<'_> {
        type Out = ();
        #[inline(always)]
        fn run<D: Decode>(self, decode: D) {
            for y in self.0 {
                let (psi, slope) = decode.at(*y);
                let square = |slope: f32| slope.max(SLOPE_RIGHT) * slope.max(SLOPE_RIGHT);
                let around = square(decode.at(*y - BLUR).1) + square(slope) + square(decode.at(*y + BLUR).1);
                *y = importance(psi) * around / 3.0;
            }
        }
    }
    dispatch(encoding, Loop(y));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_agree_with_the_encodings() {
        for encoding in [Encoding::Transmittance, Encoding::Depth, Encoding::Reciprocal { epsilon: 0.2 }] {
            // No multiple of the lanes, so that the rest is there too.
            let y: Vec<f32> = (0..1003).map(|i| -2.0 + 0.01 * i as f32).collect();
            let psi: Vec<f32> = (0..1003).map(|i| (i as f32 / 1003.0).powi(2)).collect();
            let value = |y: f32| f64::from((-encoding.decode(y)).exp());
            let (mut w, mut r, mut c) = (vec![0.0; 1003], vec![0.0; 1003], vec![0.0; 1003]);
            let out = Linear { weight: &mut w, right: &mut r, counts: &mut c };
            linearise(encoding, &y, &psi, out);
            let mut sum = 0.0;
            for i in 0..1003 {
                let exact = value(y[i]) - f64::from(psi[i]);
                let root = f64::from(c[i]).sqrt();
                assert!((f64::from(r[i]) + root * exact).abs() < 1e-5, "{encoding:?} {}: {}", y[i], r[i]);
                let slope = (value(y[i] + 1e-3) - value(y[i] - 1e-3)) / 2e-3;
                let clamped = (value(y[i]) == 0.0 || value(y[i]) == 1.0) || slope.abs() < 0.2;
                assert!(
                    clamped || (f64::from(w[i]) / root / slope - 1.0).abs() < 0.02,
                    "{encoding:?} {}",
                    y[i]
                );
                sum += f64::from(c[i]) * exact * exact;
            }
            assert!((f64::from(error(encoding, &y, &psi)) / sum - 1.0).abs() < 1e-4);
            let still = vec![0.0; 1003];
            let along = error_along(encoding, [&y, &still], 0.7, &psi, &c);
            assert!((f64::from(along) / sum - 1.0).abs() < 1e-4);
        }
    }
}
