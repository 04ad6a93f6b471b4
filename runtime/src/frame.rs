//! One frame as plain data: camera and lights relative to the asset's centre, in f32, the same for both backends.

use crate::Result;
use crate::exact::ExactDepths;
use diaphane_formats::asset::Info;
use diaphane_formats::directions::even_directions;
use diaphane_formats::scene::{Environment, Light, Scene, Surface};
use diaphane_formats::sh;
use glam::{DVec3, Vec3};

/// Directions that stand for an environment: each becomes one directional light.
pub const ENVIRONMENT_DIRECTIONS: usize = 256;

/// Bands that an environment is reduced to: what [`ENVIRONMENT_DIRECTIONS`] can carry.
const ENVIRONMENT_ORDER: usize = 10;

/// A light's distance is clamped from below at this fraction of the diagonal.
pub const LEAST_DISTANCE: f64 = 1e-3;

/// An environment's directions are 13 degrees apart. A phase function with a narrower peak would see gaps and spikes
/// between them (at g = 0.99 up to 78 times the radiance that is there), so that its mean cosine is limited to this for
/// them: then their sum is within 3.2 % of the integral.
pub const ENVIRONMENT_MEAN_COSINE: f32 = 0.7;

/// Irradiance is limited to this, per light and channel, so that sums over lights, samples and rays stay within single
/// precision.
pub const MOST_IRRADIANCE: f32 = 1e30;

/// Camera, lights and surface of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Sub-pixel rays.
    pub samples_per_pixel: u32,
    /// Camera axes.
    pub view: View,
    /// Lights, those of the environment last.
    pub lights: Vec<FrameLight>,
    /// How many of `lights` came from the scene's list; the rest stand for the environment.
    pub scene_lights: usize,
    /// Surface reflection.
    pub surface: Surface,
    /// Distance at which the inverse square law is clamped.
    pub least_distance: f32,
}

/// Camera axes relative to the asset's centre: a ray through column x, row y (pixels, fractional) has the direction
/// normalize(forward + right (2x/width - 1) + up (1 - 2y/height)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Centre of projection.
    pub origin: Vec3,
    /// Unit vector towards the target.
    pub forward: Vec3,
    /// Half the image plane's width at distance 1, times the right axis.
    pub right: Vec3,
    /// Half the image plane's height at distance 1, times the up axis.
    pub up: Vec3,
}

impl View {
    /// Unit direction of a ray; `x` and `y` in pixels from the top left corner.
    pub fn direction(&self, x: f32, y: f32, width: u32, height: u32) -> Vec3 {
        // Times the size of a pixel: graphics drivers round divisions differently, and these rays must be theirs.
        let (sx, sy) = (x * (2.0 / width as f32) - 1.0, 1.0 - y * (2.0 / height as f32));
        (self.forward + self.right * sx + self.up * sy).normalize()
    }
}

/// A light relative to the asset's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameLight {
    /// What kind of light.
    pub kind: LightKind,
    /// Position of point and spot lights.
    pub position: Vec3,
    /// Unit vector, the way light travels, of directional and spot lights.
    pub direction: Vec3,
    /// Intensity (point, spot) or irradiance (directional). Entries that stand for an environment may be negative
    /// where its spherical harmonics ring.
    pub colour: Vec3,
    /// Cosine of a spot's inner half angle.
    pub cos_inner: f32,
    /// Cosine of a spot's outer half angle.
    pub cos_outer: f32,
    /// Mean cosines of phase functions are limited to this, up and down, for light from here; 1 but for lights that
    /// stand for an environment ([`ENVIRONMENT_MEAN_COSINE`]).
    pub most_cosine: f32,
    /// Whether the scene marks it: its depths are to be exact.
    pub exact: bool,
}

/// Kinds of lights, numbered as the shaders number them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LightKind {
    /// All directions from a point.
    Point = 0,
    /// One direction.
    Directional = 1,
    /// A cone from a point.
    Spot = 2,
}

impl FrameLight {
    /// Unit direction from `x` to the light, distance (infinite for directional lights) and unattenuated irradiance.
    pub fn at(&self, x: Vec3, least: f32) -> (Vec3, f32, Vec3) {
        if self.kind == LightKind::Directional {
            return (-self.direction, f32::INFINITY, limited(self.colour));
        }
        let d = self.position - x;
        let distance = d.length();
        let to = if distance > 0.0 { d / distance } else { Vec3::Y };
        let clamped = distance.max(least);
        let mut irradiance = limited(self.colour / (clamped * clamped));
        if self.kind == LightKind::Spot {
            irradiance *= cone(self.cos_outer, self.cos_inner, -to.dot(self.direction));
        }
        (to, distance, irradiance)
    }
}

fn limited(irradiance: Vec3) -> Vec3 {
    irradiance.clamp(Vec3::splat(-MOST_IRRADIANCE), Vec3::splat(MOST_IRRADIANCE))
}

/// In single precision, whose range it does not leave.
fn narrowed(colour: DVec3) -> Vec3 {
    let most = DVec3::splat(f64::from(f32::MAX));
    colour.clamp(-most, most).as_vec3()
}

/// smoothstep(cos outer, cos inner, cosine), a step where both angles are equal.
fn cone(cos_outer: f32, cos_inner: f32, cosine: f32) -> f32 {
    if cos_inner <= cos_outer {
        return if cosine >= cos_inner { 1.0 } else { 0.0 };
    }
    let t = ((cosine - cos_outer) / (cos_inner - cos_outer)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl Frame {
    /// A scene as seen from an asset.
    ///
    /// # Errors
    /// A camera that makes no rays.
    pub fn new(scene: &Scene, info: &Info) -> Result<Self> {
        let centre = DVec3::from(info.centre);
        let rays = scene.ray_frame()?;
        let mut lights: Vec<FrameLight> = scene.lights.iter().map(|l| frame_light(l, centre)).collect();
        lights.iter_mut().enumerate().for_each(|(i, light)| light.exact = scene.is_exact(i));
        let scene_lights = lights.len();
        if let Some(environment) = &scene.environment {
            lights.extend(environment_lights(environment));
        }
        Ok(Self {
            width: scene.image.width,
            height: scene.image.height,
            samples_per_pixel: scene.image.samples_per_pixel,
            view: View {
                origin: (rays.origin - centre).as_vec3(),
                forward: rays.forward.as_vec3(),
                right: rays.right.as_vec3(),
                up: rays.up.as_vec3(),
            },
            lights,
            scene_lights,
            surface: scene.surface,
            least_distance: (LEAST_DISTANCE * f64::from(info.diagonal())) as f32,
        })
    }

    /// v of a sample is limited to this. Its variation over a kernel multiplies it by e^8 at the most (see
    /// [`diaphane_formats::slopes`]), and weights along a ray add up to about ten diagonals: sums stay below 3e37.
    pub fn most_source(&self) -> f32 {
        1e33 / (self.least_distance * 1000.0).max(1.0)
    }

    /// Share of the lights that the baked means serve, 0..1: the others have exact depths at the centroids. Lights on their way
    /// from one to the other count in part.
    pub fn share_of_means(&self, exact: Option<&ExactDepths>) -> f32 {
        let count = self.lights.len();
        let baked: f32 = (0..count).map(|i| 1.0 - exact.map_or(0.0, |e| e.share(i))).sum();
        baked / count.max(1) as f32
    }

    /// The scene's lights that are marked exact, by index.
    pub fn lights_marked(&self) -> Vec<usize> {
        (0..self.scene_lights).filter(|&i| self.lights[i].exact).collect()
    }

    /// Point and spot lights inside the asset's bounding box, by index: their baked depth runs past them.
    pub fn lights_inside(&self, info: &Info) -> Vec<usize> {
        let (low, high) = (Vec3::from(info.bounds[0]), Vec3::from(info.bounds[1]));
        let inside = |l: &FrameLight| {
            l.kind != LightKind::Directional && l.position.cmpgt(low).all() && l.position.cmplt(high).all()
        };
        (0..self.scene_lights).filter(|&i| inside(&self.lights[i])).collect()
    }
}

pub(crate) fn frame_light(light: &Light, centre: DVec3) -> FrameLight {
    let local = |p: DVec3| (p - centre).as_vec3();
    let base = FrameLight {
        kind: LightKind::Point,
        position: Vec3::ZERO,
        direction: Vec3::NEG_Y,
        colour: Vec3::ZERO,
        cos_inner: -1.0,
        cos_outer: -1.0,
        most_cosine: 1.0,
        exact: false,
    };
    match *light {
        Light::Point { position, intensity } => {
            FrameLight { position: local(position), colour: narrowed(intensity), ..base }
        }
        Light::Directional { direction, irradiance } => FrameLight {
            kind: LightKind::Directional,
            direction: direction.as_vec3(),
            colour: narrowed(irradiance),
            ..base
        },
        Light::Spot { position, direction, intensity, cos_inner, cos_outer } => FrameLight {
            kind: LightKind::Spot,
            position: local(position),
            direction: direction.as_vec3(),
            colour: narrowed(intensity),
            cos_inner: cos_inner as f32,
            cos_outer: cos_outer as f32,
            ..base
        },
    }
}

/// The environment projected to [`ENVIRONMENT_ORDER`] bands of spherical harmonics, then evaluated in even directions, each a
/// directional light with irradiance radiance × 4π / count.
pub fn environment_lights(environment: &Environment) -> Vec<FrameLight> {
    let coefficients = project_environment(environment);
    let directions = even_directions(ENVIRONMENT_DIRECTIONS, 0);
    let solid_angle = 4.0 * std::f64::consts::PI / directions.len() as f64;
    let mut basis = [0.0; ENVIRONMENT_ORDER * ENVIRONMENT_ORDER];
    directions
        .into_iter()
        .map(|towards| {
            sh::evaluate(ENVIRONMENT_ORDER, towards.to_array(), &mut basis);
            let radiance: DVec3 = coefficients.iter().zip(&basis).map(|(c, y)| *c * *y).sum();
            FrameLight {
                kind: LightKind::Directional,
                position: Vec3::ZERO,
                direction: -towards.as_vec3(),
                colour: narrowed(radiance * solid_angle),
                cos_inner: -1.0,
                cos_outer: -1.0,
                most_cosine: ENVIRONMENT_MEAN_COSINE,
                exact: false,
            }
        })
        .collect()
}

/// Spherical-harmonics coefficients of the environment's radiance, each pixel weighted by its solid angle.
fn project_environment(environment: &Environment) -> Vec<DVec3> {
    use std::f64::consts::{PI, TAU};
    let picture = &environment.picture;
    let mut sum = vec![DVec3::ZERO; ENVIRONMENT_ORDER * ENVIRONMENT_ORDER];
    let mut basis = [0.0; ENVIRONMENT_ORDER * ENVIRONMENT_ORDER];
    for row in 0..picture.height {
        let theta = PI * (row as f64 + 0.5) / picture.height as f64;
        // Exact solid angle of the row's band, shared by its pixels.
        let (top, bottom) =
            (PI * row as f64 / picture.height as f64, PI * (row + 1) as f64 / picture.height as f64);
        let solid_angle = TAU / picture.width as f64 * (top.cos() - bottom.cos());
        for column in 0..picture.width {
            let phi = TAU * ((column as f64 + 0.5) / picture.width as f64 - 0.5);
            let direction = [theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()];
            sh::evaluate(ENVIRONMENT_ORDER, direction, &mut basis);
            let p = picture.pixels[row * picture.width + column];
            let radiance =
                DVec3::new(p[0].into(), p[1].into(), p[2].into()) * environment.scale * solid_angle;
            for (s, y) in sum.iter_mut().zip(&basis) {
                *s += radiance * *y;
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::phase::henyey_greenstein_f32;
    use diaphane_formats::picture::Picture;

    #[test]
    fn a_white_environment_has_irradiance_four_pi() {
        let mut picture = Picture::new(64, 32);
        picture.pixels.fill([1.0, 2.0, 0.0]);
        let lights = environment_lights(&Environment { picture, scale: 0.5 });
        let sum: Vec3 = lights.iter().map(|l| l.colour).sum();
        let expected = 2.0 * std::f32::consts::PI;
        assert!(
            (sum.x / expected - 1.0).abs() < 1e-3 && (sum.y / (2.0 * expected) - 1.0).abs() < 1e-3,
            "{sum}"
        );
        assert_eq!(sum.z, 0.0);
    }

    #[test]
    fn a_white_environment_is_white_through_every_phase_function() {
        // ∫ p dω = 1: what is scattered out of light from everywhere is that light, up to the sum's 3.2 %.
        let mut picture = Picture::new(64, 32);
        picture.pixels.fill([1.0; 3]);
        let lights = environment_lights(&Environment { picture, scale: 1.0 });
        for g in [-0.99f32, -0.7, 0.0, 0.5, 0.99] {
            for towards in even_directions(500, 7) {
                let from = |l: &FrameLight| {
                    let g = g.clamp(-l.most_cosine, l.most_cosine);
                    l.colour.x * henyey_greenstein_f32(g, l.direction, towards.as_vec3()).0
                };
                let sum: f32 = lights.iter().map(from).sum();
                assert!((sum - 1.0).abs() < 0.033, "g {g} towards {towards}: {sum}");
            }
        }
    }

    #[test]
    fn light_beyond_single_precision_is_limited() {
        let light = Light::Point { position: DVec3::X, intensity: DVec3::splat(1e200) };
        let light = frame_light(&light, DVec3::ZERO);
        for x in [Vec3::ZERO, Vec3::X, Vec3::splat(1e12)] {
            let (to, _, irradiance) = light.at(x, 1e-9);
            assert!(to.is_finite() && irradiance.max_element() <= MOST_IRRADIANCE, "{irradiance}");
        }
    }

    #[test]
    fn a_bright_patch_comes_from_its_side() {
        // Pixels around u = 0.75: atan2(x, -z) = π/2, so +x.
        let mut picture = Picture::new(64, 32);
        for row in 12..20 {
            for column in 44..52 {
                picture.pixels[row * 64 + column] = [1.0; 3];
            }
        }
        let lights = environment_lights(&Environment { picture, scale: 1.0 });
        let brightest = lights.iter().max_by(|a, b| a.colour.x.total_cmp(&b.colour.x)).unwrap();
        assert!(brightest.direction.x < -0.9, "{:?}", brightest.direction);
    }
}
