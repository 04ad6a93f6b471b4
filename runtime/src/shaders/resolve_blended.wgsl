// Sums that quads blended.
@group(1) @binding(5) var numerators: texture_2d<f32>;
@group(1) @binding(6) var denominators: texture_2d<f32>;

fn sums_at(pixel: vec2u, index: u32, piece: u32) -> Sums {
    let numerator = textureLoad(numerators, pixel, 0);
    return Sums(numerator.xyz, u32(numerator.w), textureLoad(denominators, pixel, 0).xyz);
}
