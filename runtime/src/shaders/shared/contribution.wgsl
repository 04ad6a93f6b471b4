// What one kernel adds to the sums of one ray's piece. Twin of `reconstruct::piece_radiance`. The including shader
// declares `profile`.
override GREY: bool = true;             // all channels have the same extinction
override HETEROGENEOUS: bool = false;   // the medium has a density profile

const MOST_EXPONENT: f32 = 4.0;
const PARTS: u32 = 4u;

// A sample as the camera sees it.
struct Kernel {
    centre: vec3f,      // from the camera
    a: f32,             // sharpness
    source: vec4f,      // v, weight
    slope_r: vec3f,
    slope_g: vec3f,
    slope_b: vec3f,
}

struct Contribution {
    numerator: vec3f,   // v * w * W per channel
    met: bool,          // whether the kernel's support meets the piece
    denominator: vec3f, // w * W per channel
}

// Where a kernel's support meets a ray.
struct Meeting {
    d2: f32,            // squared distance of the closest approach
    tc: f32,            // its place
    rise: vec3f,        // of the logarithm of the source from the kernel's centre to there
    slope: vec3f,       // along the ray
}

// What a part of the support, `size` long, adds.
fn part_of(kernel: Kernel, at: Meeting, path: Path, shift: f32) -> Contribution {
    let a = kernel.a;
    let red = kernel_weight(a, at.d2, path, medium.kappa.x);
    var w = vec3f(red.x);
    var mean = vec3f(red.y);
    if (!GREY) {
        let green = kernel_weight(a, at.d2, path, medium.kappa.y);
        let blue = kernel_weight(a, at.d2, path, medium.kappa.z);
        w = vec3f(red.x, green.x, blue.x);
        mean = vec3f(red.y, green.y, blue.y);
    }
    if (HETEROGENEOUS) {
        mean = clamp(mean + shift, vec3f(path.s), vec3f(path.s + path.length));
    }
    w *= kernel.source.w;
    // The source's mean under the weight: it grows exponentially from the kernel's centre.
    let spread = min(0.25 / (a * a), path.length * path.length * (1.0 / 24.0));
    let exponent = at.rise + at.slope * (mean + spread * at.slope);
    let source = kernel.source.xyz * exp(clamp(exponent, vec3f(-MOST_EXPONENT), vec3f(MOST_EXPONENT)));
    return Contribution(source * w, true, w);
}

// Of a kernel along the ray of pixel `index` through the piece `whole` (start, end). Without branches as far as it may be:
// they cost more than they save where neighbours share a kernel.
fn contribution(kernel: Kernel, index: u32, direction: vec3f, whole: vec2f) -> Contribution {
    let tc = dot(kernel.centre, direction);
    let across = kernel.centre - direction * tc;
    let d2 = dot(across, across);
    let h2 = CUT_OFF / (kernel.a * kernel.a) - d2;
    let h = sqrt(max(h2, 0.0));
    let ends = vec2f(max(whole.x, tc - h), min(whole.y, tc + h));
    let met = h2 > 0.0 && kernel.source.w > 0.0 && ends.x < ends.y;
    let long = max(ends.y - ends.x, 0.0);
    let at = Meeting(d2, tc,
        -vec3f(dot(kernel.slope_r, across), dot(kernel.slope_g, across), dot(kernel.slope_b, across)),
        vec3f(dot(kernel.slope_r, direction), dot(kernel.slope_g, direction), dot(kernel.slope_b, direction)));
    var sums = Contribution(vec3f(0.0), met, vec3f(0.0));
    if (HETEROGENEOUS) {
        // Each part of the support has its own density.
        let size = long / f32(PARTS);
        let per_size = 1.0 / max(size, 1e-30);
        for (var part = 0u; part < PARTS; part++) {
            let near = ends.x + f32(part) * size;
            // Attenuation in front from the profile; inside the part it is taken as linear.
            let first = profile_at(index, near - whole.x, whole.y - whole.x);
            let last = profile_at(index, near + size - whole.x, whole.y - whole.x);
            let change = last - first;
            let path = Path(near - tc, size, first.x, change.x * per_size, change.y * per_size);
            // The closed form takes the density as even over the part; what is uneven moves the mean.
            let middle = near + 0.5 * size - whole.x;
            let moved = clamp(change.z / max(change.y, 1e-30) - middle, -0.5 * size, 0.5 * size);
            let one = part_of(kernel, at, path, select(0.0, moved, change.y > 0.0));
            sums.numerator += one.numerator;
            sums.denominator += one.denominator;
        }
    } else {
        sums = part_of(kernel, at, Path(ends.x - tc, long, ends.x - whole.x, 1.0, 1.0), 0.0);
    }
    return Contribution(select(vec3f(0.0), sums.numerator, met), met, select(vec3f(0.0), sums.denominator, met));
}
