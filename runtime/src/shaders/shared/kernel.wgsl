// The samples' kernel integrated along a ray. Twin of formats/src/kernel.rs and formats/src/hits.rs, which state the
// formulas.
// Whether the medium is too dense over some kernel for the form without branches.
override DENSE: bool = false;

const CUT_OFF: f32 = 5.0;
const CUT_OFF_VALUE: f32 = 0.006737947;
const CUT_OFF_RADIUS: f32 = 2.236068;
const HALF_ROOT_PI: f32 = 0.88622695;

// e^(x*x) erfc(x) for x >= 0.
fn scaled_erfc(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.5 * x);
    var p = -1.135204 + t * (1.4885159 + t * (-0.8221522 + t * 0.17087277));
    p = 0.09678418 + t * (-0.18628806 + t * (0.27886807 + t * p));
    p = -1.2655122 + t * (1.0000237 + t * (0.37409196 + t * p));
    return t * exp(p);
}

// (1 - e^-y) / y for y >= 0.
fn decay_mean(y: f32) -> f32 {
    if (y < 0.02) {
        return 1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0)));
    }
    return (1.0 - exp(-y)) / y;
}

fn decay_mean3(y: vec3f) -> vec3f {
    return vec3f(decay_mean(y.x), decay_mean(y.y), decay_mean(y.z));
}

// Three-point Gauss-Legendre rule for short pieces.
fn short_integral(ad2: f32, u0: f32, a: f32, kappa: f32, length: f32) -> f32 {
    return length * (
        (5.0 / 18.0) * short_node(0.11270167 * length, ad2, u0, a, kappa)
        + (8.0 / 18.0) * short_node(0.5 * length, ad2, u0, a, kappa)
        + (5.0 / 18.0) * short_node(0.88729835 * length, ad2, u0, a, kappa));
}

fn short_node(s: f32, ad2: f32, u0: f32, a: f32, kappa: f32) -> f32 {
    let u = u0 + a * s;
    return exp(-kappa * s) * max(exp(-ad2 - u * u) - CUT_OFF_VALUE, 0.0);
}

// Integral over `length` from `s` behind the closest approach, inside the support, of e^(-kappa along) kernel.
fn kernel_integral(a: f32, d2: f32, s: f32, length: f32, kappa: f32) -> f32 {
    let u0 = a * s;
    let u1 = a * (s + length);
    let ad2 = a * a * d2;
    if (a * length < 0.5 && kappa * length < 0.5) {
        return short_integral(ad2, u0, a, kappa, length);
    }
    let half = kappa / (2.0 * a);
    let x0 = u0 + half;
    let x1 = u1 + half;
    let f0 = exp(-ad2 - u0 * u0) * scaled_erfc(abs(x0));
    let f1 = exp(-kappa * length) * exp(-ad2 - u1 * u1) * scaled_erfc(abs(x1));
    var sum = 0.0;
    if (x0 >= 0.0) {
        sum = f0 - f1;
    } else if (x1 <= 0.0) {
        sum = f1 - f0;
    } else {
        sum = 2.0 * exp(-ad2 - half * half + kappa * x0 / a) - f0 - f1;
    }
    let cut = CUT_OFF_VALUE * length * decay_mean(kappa * length);
    return max(HALF_ROOT_PI / a * sum - cut, 0.0);
}

// e^(x*x) erfc(x) for x >= 0 without an exponential. Twin of `approx::scaled_erfc`.
fn plain_scaled_erfc(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.4 * x);
    var p = 0.16864386 + t * (-0.18261535 + t * 0.05018729);
    p = 0.16857818 + t * (0.14127734 + t * (-0.005255413 + t * p));
    return t * (0.22567587 + t * (0.22566977 + t * (0.20783858 + t * p)));
}

// sinh z / z of z * z within 0..20. Twin of `hits::sinh_ratio`.
fn sinh_ratio(z2: f32) -> f32 {
    let p = 2.0039116e-4 + z2 * (2.5384886e-6 + z2 * 3.54011e-8);
    return 0.999998 + z2 * (0.16667679 + z2 * (0.008325651 + z2 * p));
}

// Integral over `length` from `s` behind the closest approach, inside the support, of e^-tau kernel, where the medium lets
// e^-before through in front of it, and the mean distance from the closest approach under it. Twin of
// `hits::attenuated_integral`; without branches, for kappa up to 2 a.
fn attenuated_integral(a: f32, d2: f32, s: f32, length: f32, kappa: f32, before: f32) -> vec2f {
    let inverse = 1.0 / a;
    let half = 0.5 * kappa * inverse;
    let u0 = a * s;
    let u1 = a * (s + length);
    let x0 = u0 + half;
    let x1 = u1 + half;
    let y = kappa * length;
    let front = a * a * d2 + before;
    let e0 = exp(-front - u0 * u0);
    let e1 = exp(-front - y - u1 * u1);
    let peak = 2.0 * exp(min(half * (u0 + x0) - front, 0.0));
    let p0 = plain_scaled_erfc(abs(x0)) * e0;
    let p1 = plain_scaled_erfc(abs(x1)) * e1;
    let between = select(0.0, peak, x0 < 0.0 && x1 > 0.0);
    let whole = HALF_ROOT_PI * inverse * (select(-p0, p0, x0 >= 0.0) - select(-p1, p1, x1 > 0.0) + between);
    let cut = CUT_OFF_VALUE * length * sinh_ratio(0.25 * y * y) * exp(-before - 0.5 * y);
    let offset = inverse * (0.5 * inverse * (e0 - e1) / max(whole, 1e-30) - half);
    return vec2f(max(whole - cut, 0.0), clamp(offset, s, s + length));
}

// Mean distance from the closest approach under the attenuated Gaussian, given the integral of the same arguments.
fn mean_offset(a: f32, d2: f32, s: f32, length: f32, kappa: f32, integral: f32) -> f32 {
    let u0 = a * s;
    let u1 = a * (s + length);
    let ad2 = a * a * d2;
    let ends = exp(-ad2 - u0 * u0) - exp(-ad2 - u1 * u1 - kappa * length);
    let whole = integral + CUT_OFF_VALUE * length * decay_mean(kappa * length);
    let offset = (0.5 / a * ends / max(whole, 1e-30) - kappa / (2.0 * a)) / a;
    return clamp(offset, s, s + length);
}

// A kernel's support along a ray, inside a piece.
struct Path {
    s: f32,             // its start, from the closest approach to the centre
    length: f32,
    before: f32,        // depth between the piece's start and the support's, at unit extinction
    density: f32,       // mean over the support
    scattering: f32,    // the same of the scattering part
}

// Weight of a kernel without its own factor w, for the extinction `kappa` of one channel, and the mean distance from
// the closest approach under it.
fn kernel_weight(a: f32, d2: f32, path: Path, kappa: f32) -> vec2f {
    let here = kappa * path.density;
    var weight = vec2f(0.0);
    if (DENSE) {
        let g = kernel_integral(a, d2, path.s, path.length, here);
        let mean = mean_offset(a, d2, path.s, path.length, here, g);
        weight = vec2f(exp(-kappa * path.before) * g, mean);
    } else {
        weight = attenuated_integral(a, d2, path.s, path.length, here, kappa * path.before);
    }
    return vec2f(weight.x * path.scattering, weight.y);
}
