// Unpolarised Fresnel transmittance, angle measured outside. Twin of `fresnel::transmittance`.
fn fresnel_transmittance(cosine: f32, ior: f32) -> f32 {
    let outside = min(abs(cosine), 1.0);
    let inside = sqrt(max(1.0 - (1.0 - outside * outside) / (ior * ior), 0.0));
    let s = (outside - ior * inside) / (outside + ior * inside);
    let p = (ior * outside - inside) / (ior * outside + inside);
    return clamp(1.0 - 0.5 * (s * s + p * p), 0.0, 1.0);
}
