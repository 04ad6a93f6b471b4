// Camera, tile and frame parameters of one object's ray: mirrors `ViewUniform` in gpu/uniforms.rs.
struct View {
    origin: vec3f,          // centre of projection, relative to the asset's centre
    width: u32,             // of the whole picture, pixels
    forward: vec3f,         // unit
    height: u32,
    right: vec3f,           // half the image plane's width at distance 1
    light_count: u32,       // lights that are evaluated at the samples: the first ones
    up: vec3f,              // half the image plane's height at distance 1
    scene_lights: u32,      // lights that make highlights; the others stand for an environment
    tile_start: vec2u,      // column and row of the tile's first pixel
    tile_size: vec2u,       // columns and rows of the tile
    offset: vec2f,          // position of this ray inside its pixel, each in (0, 1)
    pixel: vec2f,           // 2 / width and 2 / height: divisions round differently from driver to driver
    near: f32,              // surface nearer than this is not seen
    least_distance: f32,    // where the inverse square law is clamped
    specular: f32,          // 0: no highlights
    alpha: f32,             // squared roughness
    rays: u32,              // rays of each pixel drawn so far, this one included
    means: f32,             // share of the lights whose values are means over a sample's cell
    first_scene_light: u32, // of those that make highlights
    share: f32,             // of a level of detail in an object that fades into the next; below 0: more of it follows
    environment: u32,       // lights in front that stand for an environment
    negligible: f32,        // what a sample may leave out of a portion of lights, as a part of what it has; 0: nothing
    viewport: vec2u,        // columns and rows of the largest tile that is drawn together with this one
    first_pixel: u32,       // of the tile, where all tiles drawn together keep their pixels
    first_cell: u32,        // the same of its squares of 8 x 8 pixels
    first_tile: u32,        // and of 16 x 16
    slot: u32,              // of the object among those with the same samples: which part of their values and sources it has
    first_light: u32,       // of its lights among those of all
    first_ambient: u32,     // of what its folded lights send, likewise
    per_unit: f32,          // the object's units of a world unit
    slices: u32,            // that the samples are cut into, each of which sums for itself
    pixels: u32,            // of all tiles that are drawn together
    sharers: u32,           // workgroups of the gather pass for each square of 16 x 16 pixels
    unused: array<vec4u, 4>,
}

// Views that are drawn together at the most: of several objects, or rays of one.
const MOST_VIEWS: u32 = 64u;

@group(0) @binding(0) var<uniform> views: array<View, MOST_VIEWS>;

// The object at hand: every entry point picks it first.
var<private> view: View;

// Unit direction of the ray through `pixel` of the tile.
fn ray_direction(pixel: vec2u) -> vec3f {
    let at = vec2f(view.tile_start + pixel) + view.offset;
    let sx = at.x * view.pixel.x - 1.0;
    let sy = 1.0 - at.y * view.pixel.y;
    let d = view.forward + view.right * sx + view.up * sy;
    // Spelt out, so that it rounds as on the CPU where the driver does as it is told.
    return d * (1.0 / sqrt(d.x * d.x + d.y * d.y + d.z * d.z));
}

// Where a pixel keeps its state.
fn pixel_index(pixel: vec2u) -> u32 {
    return view.first_pixel + pixel.y * view.tile_size.x + pixel.x;
}

// Clip coordinates in the viewport, whose first pixels are the tile's, such that the ray of this pass through a pixel meets the pixel's centre.
// `plane` holds the coordinates along `right` and `up` of a point at distance `depth` along `forward`.
// The constant z puts the near plane at w = near and the far plane nowhere.
fn tile_clip(plane: vec2f, depth: f32) -> vec4f {
    let size = vec2f(view.viewport);
    let full = vec2f(f32(view.width), f32(view.height));
    let shift = (vec2f(0.5) - view.offset) - vec2f(view.tile_start);
    let column = (plane.x + depth) * 0.5 * full.x + shift.x * depth;
    let row = (depth - plane.y) * 0.5 * full.y + shift.y * depth;
    return vec4f(2.0 * column / size.x - depth, depth - 2.0 * row / size.y, view.near, depth);
}
