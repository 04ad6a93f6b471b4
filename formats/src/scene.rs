//! Scenes (`*.scene.toml`): camera, image, surface, environment, lights. Right-handed, image row 0 on top.

use crate::picture::Picture;
use crate::toml_keys::{Reader, parse, type_of, unknown_type};
use crate::{Error, Result, files, picture};
use glam::DVec3;
use std::path::Path;
use toml::Table;

/// Everything that a picture depends on apart from the object.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Where from.
    pub camera: Camera,
    /// Size and sampling of the picture.
    pub image: ImageSize,
    /// Reflection at the surface.
    pub surface: Surface,
    /// Light from all around; lights the object, is not seen behind it.
    pub environment: Option<Environment>,
    /// Any number of lights.
    pub lights: Vec<Light>,
    /// Whether light i is marked `exact`: its optical depths are to be computed, not taken from the bake. Lights beyond the
    /// end are not marked. Keep it in step with `lights` through [`Scene::mark_exact`] and [`Scene::remove_light`].
    pub exact: Vec<bool>,
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection.
    pub position: DVec3,
    /// A point in the middle of the image.
    pub target: DVec3,
    /// Roughly upwards.
    pub up: DVec3,
    /// Field of view over the whole image height, degrees.
    pub vertical_fov_degrees: f64,
}

/// Size of the picture in pixels and rays in each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Sub-pixel rays, box filter.
    pub samples_per_pixel: u32,
}

/// Reflection at the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Whether it is drawn.
    pub reflection: bool,
    /// Strength, scaled by Fresnel's F.
    pub specular: f64,
    /// Roughness in (0, 1].
    pub roughness: f64,
}

/// A latitude-longitude picture of the surroundings: a direction (x,y,z) is read at u = 0.5 + atan2(x,-z)/2π,
/// v = acos(y)/π.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Radiance.
    pub picture: Picture,
    /// Factor on the radiance.
    pub scale: f64,
}

/// A light. RGB triples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Shines from a point in all directions.
    Point {
        /// Where.
        position: DVec3,
        /// W/sr.
        intensity: DVec3,
    },
    /// Shines from infinity.
    Directional {
        /// Unit vector, the way the light travels.
        direction: DVec3,
        /// W/m² across the direction.
        irradiance: DVec3,
    },
    /// A point light within a cone.
    Spot {
        /// Where.
        position: DVec3,
        /// Unit vector, the way the light travels on the axis.
        direction: DVec3,
        /// W/sr on the axis.
        intensity: DVec3,
        /// Cosine of the half angle of full intensity.
        cos_inner: f64,
        /// Cosine of the half angle of no intensity.
        cos_outer: f64,
    },
}

impl Light {
    /// Direction from `x` towards the light, distance (infinite for a directional light), and irradiance at `x`
    /// without any medium. The distance is clamped from below at `least` for the inverse square law.
    pub fn at(&self, x: DVec3, least: f64) -> (DVec3, f64, DVec3) {
        match *self {
            Self::Directional { direction, irradiance } => (-direction, f64::INFINITY, irradiance),
            Self::Point { position, intensity } => {
                let (to, distance) = towards(position - x);
                (to, distance, intensity / distance.max(least).powi(2))
            }
            Self::Spot { position, direction, intensity, cos_inner, cos_outer } => {
                let (to, distance) = towards(position - x);
                let cone = smoothstep(cos_outer, cos_inner, -to.dot(direction));
                (to, distance, intensity * cone / distance.max(least).powi(2))
            }
        }
    }

    /// Position of a point or spot light.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }
}

fn towards(d: DVec3) -> (DVec3, f64) {
    let length = d.length();
    if length > 0.0 { (d / length, length) } else { (DVec3::Y, 0.0) }
}

fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    if high <= low {
        return f64::from(u8::from(x >= high));
    }
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The camera's axes, ready to make rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayFrame {
    /// Centre of projection.
    pub origin: DVec3,
    /// Towards the target, unit.
    pub forward: DVec3,
    /// Half the image plane's width at distance 1, times the right axis.
    pub right: DVec3,
    /// Half the image plane's height at distance 1, times the up axis.
    pub up: DVec3,
}

impl RayFrame {
    /// Unit direction through the image at column `x` of `width` and row `y` of `height` (pixels, fractional).
    pub fn direction(&self, x: f64, y: f64, width: f64, height: f64) -> DVec3 {
        (self.forward + self.right * (2.0 * x / width - 1.0) + self.up * (1.0 - 2.0 * y / height)).normalize()
    }
}

impl Camera {
    /// The camera's axes for a picture of `width` by `height`.
    ///
    /// # Errors
    /// Position on the target, `up` along the view, field of view outside 0..180, size of zero.
    pub fn frame(&self, width: u32, height: u32) -> Result<RayFrame> {
        let forward = (self.target - self.position)
            .try_normalize()
            .ok_or_else(|| Error::invalid("'camera': position and target are the same point"))?;
        let right = forward
            .cross(self.up)
            .try_normalize()
            .ok_or_else(|| Error::invalid("'camera.up' must not point along the view"))?;
        if !(self.vertical_fov_degrees > 0.0 && self.vertical_fov_degrees < 180.0) {
            return Err(Error::invalid("'camera.vertical_fov_degrees' must lie between 0 and 180"));
        }
        if width == 0 || height == 0 {
            return Err(Error::invalid("'image': width and height must be at least 1"));
        }
        let half = (0.5 * self.vertical_fov_degrees.to_radians()).tan();
        let aspect = f64::from(width) / f64::from(height);
        Ok(RayFrame {
            origin: self.position,
            forward,
            right: right * half * aspect,
            up: right.cross(forward) * half,
        })
    }
}

impl Scene {
    /// The rays' frame of this scene's camera and image.
    pub fn ray_frame(&self) -> Result<RayFrame> {
        self.camera.frame(self.image.width, self.image.height)
    }

    /// Whether a light is marked exact.
    pub fn is_exact(&self, light: usize) -> bool {
        light < self.lights.len() && self.exact.get(light).copied().unwrap_or(false)
    }

    /// Marks a light, or takes its mark away. Does nothing where there is no such light.
    pub fn mark_exact(&mut self, light: usize, exact: bool) {
        if light < self.lights.len() {
            self.exact.resize(self.lights.len(), false);
            self.exact[light] = exact;
        }
    }

    /// Takes a light away, with its mark.
    pub fn remove_light(&mut self, light: usize) {
        if light < self.lights.len() {
            self.lights.remove(light);
        }
        if light < self.exact.len() {
            self.exact.remove(light);
        }
    }
}

/// Reads a scene file and the environment that it names.
///
/// # Errors
/// Unreadable files, unknown keys (with the nearest known one), values out of range.
pub fn load(path: &Path) -> Result<Scene> {
    let text = files::read_text(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    parse_scene(&text, folder).map_err(|e| e.in_file(path))
}

/// As [`load`], from text; `folder` is where relative file names start.
pub fn parse_scene(text: &str, folder: &Path) -> Result<Scene> {
    let table = parse(text)?;
    let r = Reader::new(&table, "", &["camera", "image", "surface", "environment", "lights"])?;
    let lights = r.tables("lights")?.into_iter().map(parse_light).collect::<Result<Vec<_>>>()?;
    let scene = Scene {
        camera: parse_camera(r.required_table("camera")?)?,
        image: parse_image(r.required_table("image")?)?,
        surface: r.table("surface")?.map_or(Ok(Surface::DEFAULT), parse_surface)?,
        environment: r.table("environment")?.map(|t| parse_environment(t, folder)).transpose()?,
        exact: lights.iter().map(|(_, exact)| *exact).collect(),
        lights: lights.into_iter().map(|(light, _)| light).collect(),
    };
    scene.ray_frame()?;
    Ok(scene)
}

impl Surface {
    /// What a scene without the table `surface` has.
    pub const DEFAULT: Self = Self { reflection: true, specular: 0.5, roughness: 0.3 };
}

fn parse_camera(table: &Table) -> Result<Camera> {
    let r = Reader::new(table, "camera", &["position", "target", "up", "vertical_fov_degrees"])?;
    Ok(Camera {
        position: r.required_vector("position")?,
        target: r.required_vector("target")?,
        up: r.vector("up")?.unwrap_or(DVec3::Y),
        vertical_fov_degrees: r.required_number("vertical_fov_degrees")?,
    })
}

fn parse_image(table: &Table) -> Result<ImageSize> {
    let r = Reader::new(table, "image", &["width", "height", "samples_per_pixel"])?;
    let side = |key: &str| {
        let value = r.integer(key, 1..=32768)?;
        value.map(|v| v as u32).ok_or_else(|| Error::invalid(format!("'image.{key}' is missing")))
    };
    let samples = r.integer("samples_per_pixel", 1..=4096)?.unwrap_or(1);
    Ok(ImageSize { width: side("width")?, height: side("height")?, samples_per_pixel: samples as u32 })
}

fn parse_surface(table: &Table) -> Result<Surface> {
    let r = Reader::new(table, "surface", &["reflection", "specular", "roughness"])?;
    let d = Surface::DEFAULT;
    let surface = Surface {
        reflection: r.flag_or("reflection", d.reflection)?,
        specular: r.number_or("specular", d.specular)?,
        roughness: r.number_or("roughness", d.roughness)?,
    };
    if surface.specular < 0.0 || !(surface.roughness > 0.0 && surface.roughness <= 1.0) {
        return Err(Error::invalid("'surface': specular must not be negative and roughness lie within 0..1"));
    }
    Ok(surface)
}

fn parse_environment(table: &Table, folder: &Path) -> Result<Environment> {
    let r = Reader::new(table, "environment", &["file", "scale"])?;
    let path = folder.join(r.required_text("file")?);
    let scale = r.number_or("scale", 1.0)?;
    if scale < 0.0 {
        return Err(Error::invalid("'environment.scale' must not be negative"));
    }
    let picture = picture::read_exr(&path)?;
    if picture.pixels.iter().flatten().any(|v| !v.is_finite() || *v < 0.0) {
        return Err(Error::file(&path, "an environment must hold finite radiance that is not negative"));
    }
    Ok(Environment { picture, scale })
}

/// A light, and whether it is marked exact.
fn parse_light(table: &Table) -> Result<(Light, bool)> {
    const PLACE: &str = "lights";
    let known: &[&str] = match type_of(table, PLACE)? {
        "point" => &["type", "exact", "position", "intensity"],
        "directional" => &["type", "exact", "direction", "irradiance"],
        "spot" => &["type", "exact", "position", "direction", "intensity", "inner_degrees", "outer_degrees"],
        other => return Err(unknown_type(PLACE, other, &["point", "directional", "spot"])),
    };
    let r = Reader::new(table, PLACE, known)?;
    let colour = |key: &str| {
        let v = r.required_vector(key)?;
        if v.min_element() < 0.0 {
            return Err(Error::invalid(format!("'{PLACE}.{key}' must not be negative")));
        }
        Ok(v)
    };
    let light = match type_of(table, PLACE)? {
        "point" => Light::Point { position: r.required_vector("position")?, intensity: colour("intensity")? },
        "directional" => Light::Directional {
            direction: r.required_direction("direction")?,
            irradiance: colour("irradiance")?,
        },
        _ => {
            let (inner, outer) = (r.required_number("inner_degrees")?, r.required_number("outer_degrees")?);
            if !(0.0 <= inner && inner <= outer && outer <= 180.0) {
                return Err(Error::invalid("'lights': 0 <= inner_degrees <= outer_degrees <= 180 must hold"));
            }
            Light::Spot {
                position: r.required_vector("position")?,
                direction: r.required_direction("direction")?,
                intensity: colour("intensity")?,
                cos_inner: inner.to_radians().cos(),
                cos_outer: outer.to_radians().cos(),
            }
        }
    };
    Ok((light, r.flag_or("exact", false)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str =
        "[camera]\nposition=[0,0,4]\ntarget=[0,0,0]\nvertical_fov_degrees=30\n[image]\nwidth=8\nheight=4\n";

    fn message(text: &str) -> String {
        parse_scene(text, Path::new(".")).unwrap_err().to_string()
    }

    #[test]
    fn image_corners() {
        let scene = parse_scene(GOOD, Path::new(".")).unwrap();
        let frame = scene.ray_frame().unwrap();
        let d = frame.direction(0.0, 0.0, 8.0, 4.0);
        // Top left looks left and up; the height spans the field of view.
        assert!(d.x < 0.0 && d.y > 0.0 && d.z < 0.0);
        assert!((d.y / -d.z - 15f64.to_radians().tan()).abs() < 1e-12);
        assert!((d.x / d.y + 2.0).abs() < 1e-12);
    }

    #[test]
    fn mistakes_are_named() {
        assert!(message(&GOOD.replace("target=[0,0,0]", "target=[0,0,4]")).contains("same point"));
        assert!(message(&GOOD.replace("width=8", "width=0")).contains("image.width"));
        assert!(message(&GOOD.replace("height", "hieght")).contains("'height'"));
        assert!(message(&format!("{GOOD}[[lights]]\ntype='spott'")).contains("spot"));
        assert!(message(&format!("{GOOD}[[lights]]\ntype='point'\nposition=[0,0,0]")).contains("intensity"));
    }

    #[test]
    fn lights_are_marked_exact_one_by_one() {
        let light = |key: &str| {
            format!("[[lights]]\ntype='directional'\n{key}\ndirection=[0,0,1]\nirradiance=[1,1,1]\n")
        };
        let text = format!("{GOOD}{}{}{}", light(""), light("exact=true"), light("exact=false"));
        let mut scene = parse_scene(&text, Path::new(".")).unwrap();
        assert_eq!(scene.exact, [false, true, false]);
        scene.lights.push(scene.lights[0]);
        assert!(scene.is_exact(1) && !scene.is_exact(3) && !scene.is_exact(4));
        scene.remove_light(0);
        scene.mark_exact(2, true);
        scene.mark_exact(7, true);
        assert_eq!((scene.lights.len(), scene.exact), (3, vec![true, false, true]));
        assert!(
            message(&format!("{GOOD}{}", light("exact=1"))).contains("'lights.exact' must be true or false")
        );
        assert!(message(&format!("{GOOD}{}", light("exakt=true"))).contains("did you mean 'exact'"));
    }

    #[test]
    fn spot_cone() {
        let spot = Light::Spot {
            position: DVec3::new(0.0, 2.0, 0.0),
            direction: -DVec3::Y,
            intensity: DVec3::ONE,
            cos_inner: 20f64.to_radians().cos(),
            cos_outer: 30f64.to_radians().cos(),
        };
        assert!((spot.at(DVec3::ZERO, 1e-3).2.x - 0.25).abs() < 1e-12);
        assert_eq!(spot.at(DVec3::new(2.0, 0.0, 0.0), 1e-3).2.x, 0.0);
    }
}
