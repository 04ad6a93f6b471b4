// Lights: mirrors `LightRecord` in gpu/uniforms.rs, twin of `FrameLight::at`.
struct Light {
    position: vec3f,
    kind: u32,              // 0 point, 1 directional, 2 spot
    direction: vec3f,       // the way light travels
    cos_inner: f32,
    colour: vec3f,
    cos_outer: f32,
    table: u32,             // which table replaces or corrects the spherical harmonics; NO_TABLE: none
    most_cosine: f32,       // limit of the phase function's mean cosine, up and down
    share: f32,             // 1: the table holds exact depths; below 1: corrections, of which so much is added
    baked: u32,             // 0: the baked light is folded and only the correction counts
}

const NO_TABLE: u32 = 0xffffffffu;

// Twins of `frame::MOST_IRRADIANCE` and `Frame::most_source`.
const MOST_IRRADIANCE: f32 = 1e30;

fn most_source() -> f32 {
    return 1e33 / max(1000.0 * view.least_distance, 1.0);
}

struct Incident {
    towards: vec3f,         // unit, from the point to the light
    irradiance: vec3f,      // unattenuated
}

fn incident(light: Light, x: vec3f) -> Incident {
    let most = vec3f(MOST_IRRADIANCE);
    if (light.kind == 1u) {
        return Incident(-light.direction, clamp(light.colour, -most, most));
    }
    let d = light.position - x;
    let distance = length(d);
    var to = vec3f(0.0, 1.0, 0.0);
    if (distance > 0.0) {
        to = d / distance;
    }
    let clamped = max(distance, view.least_distance);
    // In two steps: the quotient must not leave single precision before it is limited.
    let reach = MOST_IRRADIANCE * min(clamped * clamped, 1e8);
    var irradiance = clamp(light.colour, vec3f(-reach), vec3f(reach)) / (clamped * clamped);
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
