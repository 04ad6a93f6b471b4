// Henyey-Greenstein's phase function, 1/sr, of light that travels along `travels` and leaves along `towards`; g = 0 is
// isotropic. Twin of `phase::henyey_greenstein_f32`.
fn henyey_greenstein(g: f32, travels: vec3f, towards: vec3f) -> f32 {
    let size = abs(g);
    let d = travels * select(-1.0, 1.0, g >= 0.0) - towards;
    let base = max((1.0 - size) * (1.0 - size) + size * dot(d, d), 1e-12);
    return (1.0 - size) * (1.0 + size) / (12.566370614 * base * sqrt(base));
}
