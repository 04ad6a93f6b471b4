// The samples' kernel integrated along a ray. Twin of formats/src/kernel.rs, which states the formulas.
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

// Integral over t in start..end (inside the support) of e^(-kappa (t-start)) kernel(t).
fn kernel_integral(a: f32, d2: f32, tc: f32, kappa: f32, start: f32, end: f32) -> f32 {
    let length = end - start;
    let u0 = a * (start - tc);
    let u1 = a * (end - tc);
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
