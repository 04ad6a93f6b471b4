//! Objects somewhere else than where they were baked: turned, moved, uniformly scaled.
//!
//! Everything is drawn in the object's own coordinates, where its samples and harmonics are: the camera and the lights are
//! carried there. Scaling keeps optical depths, so that a twice as large copy looks alike and is half as dense; lengths there
//! are 1/s of the world's, and a point light's intensity 1/s² of it gives the same irradiance.

use crate::frame::{Frame, FrameLight, LEAST_DISTANCE, View, frame_light};
use crate::{Error, Result};
use diaphane_formats::asset::Info;
use diaphane_formats::scene::{Light, Surface};
use glam::{DMat4, DQuat, DVec3, Mat4, Vec3};

/// Where an object stands: x in the world is translation + rotation (scale x) of its mesh's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Where the origin of the mesh's coordinates goes, world units.
    pub translation: DVec3,
    /// A unit quaternion.
    pub rotation: DQuat,
    /// World units of a mesh unit, above 0.
    pub scale: f64,
}

impl Placement {
    /// As it was baked.
    pub const IDENTITY: Self = Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: 1.0 };

    /// # Errors
    /// Numbers that are not finite, a scale that is not above 0, a rotation that is none.
    pub fn validate(&self) -> Result<()> {
        let sound = self.translation.is_finite()
            && self.scale.is_finite()
            && self.scale > 0.0
            && (self.rotation.length() - 1.0).abs() < 1e-3;
        if sound {
            return Ok(());
        }
        Err(Error::Host(
            "a placement needs a finite translation, a unit rotation and a scale above 0".to_owned(),
        ))
    }

    /// A point of the world in coordinates relative to the asset's centre.
    fn point(&self, p: DVec3, centre: DVec3) -> DVec3 {
        self.direction(p - self.translation) / self.scale - centre
    }

    /// A direction of the world in the object's coordinates.
    fn direction(&self, d: DVec3) -> DVec3 {
        self.rotation.inverse() * d
    }

    /// The object's centre in the world.
    pub fn centre(&self, info: &Info) -> DVec3 {
        self.translation + self.rotation * (self.scale * DVec3::from(info.centre))
    }
}

/// A camera of a host program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HostCamera {
    origin: DVec3,
    forward: DVec3,
    /// Half the picture's width and height at distance 1.
    right: DVec3,
    up: DVec3,
}

impl HostCamera {
    /// From the matrices that carry the world to the eye and the eye to clip space. Any depth convention will do, reverse-z and
    /// an infinite far plane too; right-handed and left-handed eyes.
    ///
    /// # Errors
    /// A projection that is not a centred perspective, matrices that cannot be inverted.
    pub fn new(view: DMat4, projection: Mat4) -> Result<Self> {
        let p = projection;
        let ahead = -f64::from(p.z_axis.w).signum();
        let perspective =
            p.z_axis.w.abs() == 1.0 && p.w_axis.w == 0.0 && p.x_axis.x != 0.0 && p.y_axis.y != 0.0;
        if !perspective || p.z_axis.x != 0.0 || p.z_axis.y != 0.0 {
            return Err(Error::Host("the projection must be a perspective around its centre".to_owned()));
        }
        let world = view.inverse();
        if !world.is_finite() {
            return Err(Error::Host("the view matrix cannot be inverted".to_owned()));
        }
        let axis = |a: DVec3| world.transform_vector3(a).normalize_or_zero();
        Ok(Self {
            origin: world.w_axis.truncate(),
            forward: axis(DVec3::NEG_Z * ahead),
            right: axis(DVec3::X) / f64::from(p.x_axis.x),
            up: axis(DVec3::Y) / f64::from(p.y_axis.y),
        })
    }

    /// How far away a point is.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.origin.distance(p)
    }

    /// A frame in the coordinates of an object, one ray through the middle of every pixel.
    pub fn frame(
        &self,
        size: [u32; 2],
        lights: &[Light],
        environment: &[FrameLight],
        surface: Surface,
        placement: &Placement,
        info: &Info,
    ) -> Frame {
        let centre = DVec3::from(info.centre);
        let turn = |d: DVec3| placement.direction(d).as_vec3();
        let mut all: Vec<FrameLight> =
            lights.iter().map(|l| frame_light(&carried(l, placement), centre)).collect();
        all.extend(environment.iter().map(|l| FrameLight { direction: turn(l.direction.as_dvec3()), ..*l }));
        Frame {
            width: size[0],
            height: size[1],
            samples_per_pixel: 1,
            view: View {
                origin: placement.point(self.origin, centre).as_vec3(),
                forward: turn(self.forward),
                right: turn(self.right),
                up: turn(self.up),
            },
            scene_lights: lights.len(),
            lights: all,
            surface,
            least_distance: (LEAST_DISTANCE * f64::from(info.diagonal())) as f32,
        }
    }
}

/// A light in the mesh's coordinates.
fn carried(light: &Light, placement: &Placement) -> Light {
    let point = |p: DVec3| placement.point(p, DVec3::ZERO);
    let dimmed = |intensity: DVec3| intensity / placement.scale.powi(2);
    match *light {
        Light::Point { position, intensity } => {
            Light::Point { position: point(position), intensity: dimmed(intensity) }
        }
        Light::Directional { direction, irradiance } => {
            Light::Directional { direction: placement.direction(direction), irradiance }
        }
        Light::Spot { position, direction, intensity, cos_inner, cos_outer } => Light::Spot {
            position: point(position),
            direction: placement.direction(direction),
            intensity: dimmed(intensity),
            cos_inner,
            cos_outer,
        },
    }
}

/// Side of the squares in which pixels are skipped.
pub(crate) const SQUARE: u32 = 32;

/// Columns and rows (first and behind the last) that an object may cover in a frame in its coordinates; `None` where it is out
/// of sight.
pub fn covered(frame: &Frame, info: &Info) -> Option<[[u32; 2]; 2]> {
    let view = &frame.view;
    let near = 1e-4 * info.diagonal();
    let (low, high) = (Vec3::from(info.bounds[0]), Vec3::from(info.bounds[1]));
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        Vec3::new(pick(0), pick(1), pick(2)) - view.origin
    };
    let depths = (0..8).map(|k| corner(k).dot(view.forward));
    let (ahead, size) = (depths.clone().filter(|d| *d > near).count(), [frame.width, frame.height]);
    if ahead == 0 {
        return None;
    }
    if ahead < 8 {
        return Some([[0; 2], size]);
    }
    let (mut first, mut last) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for (k, depth) in depths.enumerate() {
        let q = corner(k) / depth;
        let x = q.dot(view.right) / view.right.length_squared();
        let y = q.dot(view.up) / view.up.length_squared();
        let at = [0.5 * (1.0 + x) * size[0] as f32, 0.5 * (1.0 - y) * size[1] as f32];
        (0..2).for_each(|c| {
            first[c] = first[c].min(at[c]);
            last[c] = last[c].max(at[c]);
        });
    }
    // A pixel more on each side for rounding; casts saturate.
    let low = [0, 1].map(|c| (first[c] - 1.0) as u32);
    let high = [0, 1].map(|c| ((last[c] + 2.0) as u32).min(size[c]));
    (low[0] < high[0] && low[1] < high[1]).then_some([low, high])
}

/// Columns and rows as [`covered`] finds them, in whole squares of [`SQUARE`] pixels as far as the picture goes.
pub(crate) fn covered_squares(frame: &Frame, info: &Info) -> Option<[[u32; 2]; 2]> {
    let [low, high] = covered(frame, info)?;
    let size = [frame.width, frame.height];
    let high = [0, 1].map(|c| high[c].next_multiple_of(SQUARE).min(size[c]));
    Some([low.map(|l| l / SQUARE * SQUARE), high])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{camera, dcamera};

    #[test]
    fn cameras_look_where_their_matrices_do() {
        let (eye, target) = (DVec3::new(1.0, 2.0, 5.0), DVec3::new(0.0, 1.0, 0.0));
        let right = dcamera::rh::view::look_at_mat4(eye, target, DVec3::Y);
        let left = dcamera::lh::view::look_at_mat4(eye, target, DVec3::Y);
        for (view, projection) in [
            (right, camera::rh::proj::directx::perspective(0.8, 1.5, 0.1, 100.0)),
            (right, camera::rh::proj::directx::perspective_infinite_reverse(0.8, 1.5, 0.1)),
            (left, camera::lh::proj::directx::perspective(0.8, 1.5, 0.1, 100.0)),
        ] {
            let camera = HostCamera::new(view, projection).unwrap();
            assert!(camera.origin.distance(eye) < 1e-12);
            assert!(camera.forward.distance((target - eye).normalize()) < 1e-12);
            // The corner of the picture goes to the corner of clip space.
            let there = eye + 3.0 * (camera.forward + camera.right + camera.up);
            let clip = projection * view.transform_point3(there).as_vec3().extend(1.0);
            assert!((clip.x / clip.w - 1.0).abs() < 1e-5 && (clip.y / clip.w - 1.0).abs() < 1e-5);
        }
        assert!(
            HostCamera::new(right, camera::rh::proj::directx::orthographic(-1.0, 1.0, -1.0, 1.0, 0.1, 9.0))
                .is_err()
        );
        assert!(
            HostCamera::new(DMat4::ZERO, camera::rh::proj::directx::perspective(0.8, 1.5, 0.1, 9.0)).is_err()
        );
    }

    #[test]
    fn carried_lights_bring_the_same_irradiance() {
        let placement = Placement {
            translation: DVec3::new(3.0, -1.0, 2.0),
            rotation: DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.1),
            scale: 4.0,
        };
        placement.validate().unwrap();
        let world = Light::Point { position: DVec3::new(5.0, 6.0, 7.0), intensity: DVec3::splat(9.0) };
        let local = frame_light(&carried(&world, &placement), DVec3::ZERO);
        let p = DVec3::new(0.2, 0.1, -0.3);
        let there = placement.translation + placement.rotation * (placement.scale * p);
        let (to, _, irradiance) = local.at(p.as_vec3(), 1e-6);
        let expected = 9.0 / DVec3::new(5.0, 6.0, 7.0).distance_squared(there);
        assert!((f64::from(irradiance.x) / expected - 1.0).abs() < 1e-5);
        let turned = placement.rotation * to.as_dvec3();
        assert!(turned.distance((DVec3::new(5.0, 6.0, 7.0) - there).normalize()) < 1e-5);
    }
}
