// The samples' kernel integrated along a ray. Twin of formats/src/kernel.rs and formats/src/hits.rs, which state the
// formulas.
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

// erf x, absolute error below 5e-7.
fn error_function(value: f32) -> f32 {
    let x = clamp(value, -3.95, 3.95);
    let s = x * x;
    var p = 3.917343e-3 + s * (2.8760142e-4 + s * 2.0117403e-6);
    p = 1.128379 + s * (0.19403625 + s * (0.053207136 + s * p));
    var q = 1.5270751e-2 + s * (1.1982075e-3 + s * 3.783973e-5);
    q = 1.0 + s * (0.50529164 + s * (0.11559099 + s * q));
    return x * p / q;
}

// The same as kernel_integral * e^-before and mean_offset in fewer steps, for kappa <= a and pieces that are not tiny.
fn mild_integral(a: f32, d2: f32, s: f32, length: f32, kappa: f32, before: f32) -> vec2f {
    let inverse = 1.0 / a;
    let half = 0.5 * kappa * inverse;
    let u0 = a * s;
    let x0 = u0 + half;
    let x1 = x0 + a * length;
    let scale = exp(half * (half + 2.0 * u0) - a * a * d2 - before);
    let y = kappa * length;
    let series = 1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0))));
    let mean = select((1.0 - exp(-y)) / max(y, 0.1), series, y < 0.2);
    let cut = CUT_OFF_VALUE * length * mean * exp(-before);
    let whole = HALF_ROOT_PI * inverse * scale * (error_function(x1) - error_function(x0));
    let u1 = u0 + a * length;
    let ends = exp(-a * a * d2 - u0 * u0 - before) - exp(-a * a * d2 - u1 * u1 - y - before);
    let offset = inverse * (0.5 * inverse * ends / max(whole, 1e-30) - half);
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

// Pieces shorter than this many kernel widths 1/a take the general form.
const LEAST_WIDTHS: f32 = 0.1;

// Weight of a kernel without its own factor w, for the extinction `kappa` of one channel, and the mean distance from
// the closest approach under it.
fn kernel_weight(a: f32, d2: f32, path: Path, kappa: f32, long: bool) -> vec2f {
    let here = kappa * path.density;
    var weight = vec2f(0.0);
    if (long && here <= a) {
        weight = mild_integral(a, d2, path.s, path.length, here, kappa * path.before);
    } else {
        let g = kernel_integral(a, d2, path.s, path.length, here);
        let mean = mean_offset(a, d2, path.s, path.length, here, g);
        weight = vec2f(exp(-kappa * path.before) * g, mean);
    }
    return vec2f(weight.x * path.scattering, weight.y);
}
