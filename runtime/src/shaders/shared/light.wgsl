// Lights: mirrors `LightRecord` in gpu/uniforms.rs, twin of `FrameLight::at`.
struct Light {
    position: vec3f,
    kind: u32,              // 0 point, 1 directional, 2 spot
    direction: vec3f,       // the way light travels
    cos_inner: f32,
    colour: vec3f,
    cos_outer: f32,
    table: u32,             // which exact depth table replaces the spherical harmonics; NO_TABLE: none
}

const NO_TABLE: u32 = 0xffffffffu;

struct Incident {
    towards: vec3f,         // unit, from the point to the light
    irradiance: vec3f,      // unattenuated
}

fn incident(light: Light, x: vec3f) -> Incident {
    if (light.kind == 1u) {
        return Incident(-light.direction, light.colour);
    }
    let d = light.position - x;
    let distance = length(d);
    var to = vec3f(0.0, 1.0, 0.0);
    if (distance > 0.0) {
        to = d / distance;
    }
    let clamped = max(distance, view.least_distance);
    var irradiance = light.colour / (clamped * clamped);
    if (light.kind == 2u) {
        irradiance *= cone(light.cos_outer, light.cos_inner, -dot(to, light.direction));
    }
    return Incident(to, irradiance);
}

// smoothstep(outer, inner, cosine), a step where both angles are equal.
fn cone(outer: f32, inner: f32, cosine: f32) -> f32 {
    if (inner <= outer) {
        return select(0.0, 1.0, cosine >= inner);
    }
    let t = clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}
