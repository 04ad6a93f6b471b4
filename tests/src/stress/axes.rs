//! The axes of the matrix as data.

use diaphane_formats::phase::Phase;

/// A boundary mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// An icosphere.
    Ball,
    /// A cuboid: flat faces, right edges.
    Box,
    /// A ring: light leaves and enters again.
    Ring,
    /// A ball drawn out to 200 times its width: every triangle is a needle.
    Needle,
    /// A plate of a hundredth of its width, with rows of triangles 1e-5 as wide as long along an edge.
    Sliver,
    /// Two boxes with a face in common: triangles that coincide and face each other.
    Coincident,
}

/// Meshes beside the ball.
pub const SHAPES: [Shape; 5] = [Shape::Box, Shape::Ring, Shape::Needle, Shape::Sliver, Shape::Coincident];

/// Factors on the mesh.
pub const SCALES: [f64; 5] = [1e-6, 1e-3, 1.0, 1e3, 1e6];

/// Distances of the mesh from the origin, diagonals.
pub const OFFSETS: [f64; 2] = [0.0, 1e4];

/// Extinction times diagonal.
pub const EXTINCTIONS: [f64; 7] = [0.0, 1e-6, 1e-3, 1.0, 16.0, 1e3, 1e6];

/// Bands of spherical harmonics.
pub const ORDERS: [usize; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];

/// Stored samples, apart from [`MOST_SAMPLES`].
pub const SAMPLES: [usize; 4] = [1, 2, 16, 5_000];

/// The most stored samples of a body.
pub const MOST_SAMPLES: usize = 1_000_000;

/// What a bake does not depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// Albedo of all channels.
    pub albedo: f64,
    /// Mean cosine of the phase function.
    pub g: f64,
}

impl Scattering {
    /// The phase function.
    pub fn phase(self) -> Phase {
        if self.g == 0.0 { Phase::Isotropic } else { Phase::HenyeyGreenstein { g: self.g } }
    }
}

/// Both ends of albedo and phase.
pub const SCATTERINGS: [Scattering; 6] = [
    Scattering { albedo: 1.0, g: 0.0 },
    Scattering { albedo: 1.0, g: 0.99 },
    Scattering { albedo: 1.0, g: -0.99 },
    Scattering { albedo: 0.0, g: 0.0 },
    Scattering { albedo: 0.5, g: 0.7 },
    Scattering { albedo: 0.0, g: 0.99 },
];

/// What lights a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lights {
    /// A point light one and a half diagonals away.
    Point,
    /// A directional light.
    Directional,
    /// A spot whose cone covers a part of the object.
    Spot,
    /// A point light on the surface.
    OnSurface,
    /// A point light in the medium.
    Inside,
    /// A point light at a sample's centre.
    AtSample,
    /// A point light 1e6 diagonals away, as bright on the object as the others.
    Distant,
    /// The same radiance from everywhere: the furnace.
    Furnace,
    /// Forty directional lights: folded into one vector where the phase function allows it.
    Forty,
    /// A point light without intensity.
    Dark,
    /// A point light of intensity 1e30 outside.
    Glaring,
    /// A point light of intensity 1e30 in the medium.
    GlaringInside,
}

/// All of them.
pub const LIGHTS: [Lights; 12] = [
    Lights::Point,
    Lights::OnSurface,
    Lights::Furnace,
    Lights::Inside,
    Lights::Glaring,
    Lights::Directional,
    Lights::AtSample,
    Lights::Distant,
    Lights::Spot,
    Lights::GlaringInside,
    Lights::Forty,
    Lights::Dark,
];

/// Where a cell looks from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From outside, the object fills the picture.
    Whole,
    /// On the surface, looking in.
    OnSurface,
    /// In the medium.
    Inside,
    /// At a sample's centre.
    AtSample,
    /// From 1e3 diagonals away through a field of view that fits.
    Far,
    /// From outside, looking away.
    Away,
    /// As from outside, a single pixel.
    OnePixel,
    /// As from outside, 8192 pixels in one row.
    Panorama,
    /// As from outside through 0.1 degrees.
    Narrow,
    /// As from outside through 179 degrees.
    Wide,
}

/// All of them.
pub const VIEWS: [View; 10] = [
    View::Whole,
    View::Inside,
    View::OnSurface,
    View::Far,
    View::AtSample,
    View::Narrow,
    View::Wide,
    View::OnePixel,
    View::Away,
    View::Panorama,
];
