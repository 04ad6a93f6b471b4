// Real spherical harmonics by recurrence, as in formats/src/sh.rs. The including shader declares
// `recurrence`: for each l * 14 + m the constants (a, b), or the diagonal where l = m.
const SH_MAX_ORDER: u32 = 14u;

// Sine and cosine parts of one basis pair: x belongs to +m, y to -m (0 for m = 0).
struct ShWalk {
    before: f32,
    current: f32,
    cos_m: f32,
    sin_m: f32,
}

fn sh_start(m: u32, cos_m: f32, sin_m: f32) -> ShWalk {
    return ShWalk(0.0, recurrence[m * SH_MAX_ORDER + m].x, cos_m, sin_m);
}

// The next band for the same m.
fn sh_next(walk: ShWalk, l: u32, m: u32, z: f32) -> ShWalk {
    let c = recurrence[l * SH_MAX_ORDER + m].xy;
    return ShWalk(walk.current, c.x * (z * walk.current - c.y * walk.before), walk.cos_m, walk.sin_m);
}
