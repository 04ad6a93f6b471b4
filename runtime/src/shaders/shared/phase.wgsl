// Henyey-Greenstein's phase function, 1/sr; g = 0 is isotropic. Twin of `phase::henyey_greenstein`.
fn henyey_greenstein(g: f32, cosine: f32) -> f32 {
    let base = max((1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine), 1e-12);
    return (1.0 - g * g) / (12.566370614 * base * sqrt(base));
}
