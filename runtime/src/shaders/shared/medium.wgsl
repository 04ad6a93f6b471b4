// The asset's medium: mirrors `MediumUniform` in gpu/uniforms.rs.
struct Medium {
    kappa: vec3f,           // extinction along a ray, per unit of profile density, or absolute without a profile
    cell_variance: f32,     // of the cell that a sample's values are the mean of, in units of 1 / sharpness^2
    extinction: vec3f,      // per unit of density length
    samples: u32,           // at hand: those of a shard
    ratio: vec3f,           // extinction over the reference extinction
    encoding: u32,          // 0: transmittance, 1: reciprocal, 2: depth
    albedo: vec3f,
    epsilon: f32,           // of the reciprocal encoding
    grid_min: vec3f,
    mean_cosine: f32,       // of the phase function
    grid_max: vec3f,
    ior: f32,
    grid_size: vec3u,
    grid_layers: u32,       // of a slab of the grid, along z
    means: vec3f,           // s of formats/src/slopes.rs for baked light
    most_extinction: f32,   // the largest channel's, at density 1
    steepest: f32,          // largest slope per unit of sharpness
    first: u32,             // of `samples` samples, among `total`
    total: u32,
    sight: f32,             // length of medium behind which nothing is seen in single precision
}

@group(0) @binding(1) var<uniform> medium: Medium;
