//! How much light may arrive from each light: which ones reach nothing, and in which order the others are best taken.
//!
//! Light l scatters at most E_l p_l towards the camera from any sample, where E_l is its irradiance and p_l the phase function;
//! both are bounded from below and above over the sphere around the object. Lights whose upper bounds add up to no more than
//! [`DARK`] of the sum of all lower bounds (the largest channel's) are left out, the dimmest first.
//!
//! Attenuation is not part of these bounds. What is bright outside may be dark where it arrives, so that more can be left out
//! only where it is known what does: at each sample. There a baked light is skipped, its harmonics unevaluated, if its own E p
//! and those skipped before add up to no more than [`NEGLIGIBLE`] of what has arrived by then (the largest channels' of
//! both). All terms are positive, so that a sample loses at most that part of its light, wherever it is. Lights are taken in
//! portions of [`PORTION`] as on a GPU, each with an equal part of the allowance; the bright ones come first, those that are
//! dim together from the dimmest on.

use super::{MOST_SINGLE, may_fold};
use crate::frame::{Frame, FrameLight, LightKind, MOST_IRRADIANCE};
use diaphane_formats::asset::Info;
use diaphane_formats::phase::henyey_greenstein;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Light that may be left out for the whole object, as a part of all light at its surface.
const DARK: f64 = 1e-6;

/// Light that a sample may leave out, as a part of all light that it scatters towards the camera.
pub const NEGLIGIBLE: f64 = 1e-4;

/// Fewest lights evaluated one by one for which samples leave any out.
pub const CULL_FROM: usize = 32;

/// Lights that are evaluated in one go. Mesa's software adapter (22.3.6) ends the loops of a thread after 65,535 rounds
/// altogether: a light of fourteen bands takes up to 130.
pub const PORTION: usize = 256;

/// Lights that together bring less than this part of the upper bounds are taken last, the dimmest first.
const DIM: f64 = 1e-2;

/// What a frame's lights may bring.
#[derive(Clone, Debug)]
pub struct Reach {
    /// Lights that matter, by index.
    pub lit: Vec<usize>,
    /// Whether there are so many directional lights that they are folded where they may be.
    pub many: bool,
    /// Whether the camera and the phase function allow folding.
    pub may_fold: bool,
    /// Upper bound of E p, W/m²/sr, the largest channel's.
    most: Vec<f64>,
    scene_lights: usize,
}

/// Bounds all lights of a frame of an asset.
pub fn reach(frame: &Frame, info: &Info) -> Reach {
    let sphere = Sphere {
        radius: 0.5 * f64::from(info.diagonal()),
        camera: frame.view.origin.as_dvec3(),
        least_distance: f64::from(frame.least_distance),
    };
    let g = info.phase.mean_cosine();
    let bounds: Vec<(DVec3, f64)> = frame.lights.iter().map(|l| sphere.bounds(l, g)).collect();
    let most: Vec<f64> = bounds.iter().map(|(_, most)| *most).collect();
    let least: DVec3 = bounds.iter().map(|(least, _)| *least).sum();
    let lit = lit(&most, DARK * least.max_element());
    let directional =
        |i: &&usize| frame.lights[**i].kind == LightKind::Directional && **i < frame.scene_lights;
    let may_fold = may_fold(frame, info);
    let many = may_fold && lit.iter().filter(directional).count() > MOST_SINGLE;
    Reach { lit, many, may_fold, most, scene_lights: frame.scene_lights }
}

/// All but the dimmest, whose sum is no more than `allowed`.
fn lit(most: &[f64], allowed: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..most.len()).collect();
    order.sort_by(|a, b| most[*a].total_cmp(&most[*b]));
    let mut sum = 0.0;
    let dark = order
        .iter()
        .take_while(|i| {
            sum += most[**i];
            sum <= allowed
        })
        .count();
    let mut lit = order.split_off(dark);
    lit.sort_unstable();
    lit
}

impl Reach {
    /// Upper bound of what light `index` scatters towards the camera anywhere, albedo aside.
    pub fn most(&self, index: usize) -> f64 {
        self.most.get(index).copied().unwrap_or(0.0)
    }

    /// Whether light `index` matters.
    pub fn is_lit(&self, index: usize) -> bool {
        self.lit.binary_search(&index).is_ok()
    }

    /// Whether a light is folded as long as its depths are baked.
    pub fn folds(&self, light: &FrameLight) -> bool {
        self.many && light.kind == LightKind::Directional
    }

    /// The order in which lights are evaluated that must be, how many of them stand for an environment, and what each portion
    /// may leave out ([`super::Plan::negligible`]).
    pub(super) fn order(&self, single: &[usize]) -> (Vec<usize>, usize, f32) {
        let scene = single.partition_point(|i| *i < self.scene_lights);
        let (scene, environment) = single.split_at(scene);
        let mut order = environment.to_vec();
        order.extend_from_slice(scene);
        if scene.len() < CULL_FROM {
            return (order, environment.len(), 0.0);
        }
        let lights = &mut order[environment.len()..];
        lights.sort_by(|a, b| self.most[*b].total_cmp(&self.most[*a]).then(a.cmp(b)));
        let dim = DIM * lights.iter().map(|i| self.most[*i]).sum::<f64>();
        let mut sum = 0.0;
        let tail = lights
            .iter()
            .rev()
            .take_while(|i| {
                sum += self.most[**i];
                sum <= dim
            })
            .count();
        let bright = lights.len() - tail;
        lights[bright..].reverse();
        let portions = order.len().div_ceil(PORTION) as f64;
        (order, environment.len(), (NEGLIGIBLE / portions) as f32)
    }
}

/// The object's bounding sphere, around the origin, and the camera.
struct Sphere {
    radius: f64,
    camera: DVec3,
    least_distance: f64,
}

impl Sphere {
    /// E p of a light at every point of the sphere: at least, per channel, and at most, the largest channel's.
    fn bounds(&self, light: &FrameLight, g: f64) -> (DVec3, f64) {
        let (dimmest, brightest) = self.irradiance(light);
        let limit = f64::from(light.most_cosine);
        let (least, most) = self.phase(light, g.clamp(-limit, limit));
        let colour = light.colour.as_dvec3();
        let most_irradiance = DVec3::splat(f64::from(MOST_IRRADIANCE));
        let over = |factor: f64| (colour.abs() * factor).min(most_irradiance);
        let positive = DVec3::select(colour.cmpgt(DVec3::ZERO), over(dimmest), DVec3::ZERO);
        (positive * least, over(brightest).max_element() * most)
    }

    /// Least and greatest factor from a light's colour to its irradiance.
    fn irradiance(&self, light: &FrameLight) -> (f64, f64) {
        if light.kind == LightKind::Directional {
            return (1.0, 1.0);
        }
        let distance = light.position.as_dvec3().length();
        let over = |d: f64| d.max(self.least_distance).powi(-2);
        let (least, greatest) = (over(distance + self.radius), over(distance - self.radius));
        if light.kind == LightKind::Spot {
            return (0.0, if self.is_missed(light, distance) { 0.0 } else { greatest });
        }
        (least, greatest)
    }

    /// Whether a spot's cone passes the sphere by.
    fn is_missed(&self, light: &FrameLight, distance: f64) -> bool {
        if distance <= self.radius {
            return false;
        }
        let to_centre = -light.position.as_dvec3() / distance;
        let off_axis = angle(to_centre, light.direction.as_dvec3());
        off_axis - (self.radius / distance).asin() > f64::from(light.cos_outer).clamp(-1.0, 1.0).acos() + 1e-3
    }

    /// Least and greatest value of the phase function: it falls or rises all the way from straight on to straight back.
    fn phase(&self, light: &FrameLight, g: f64) -> (f64, f64) {
        if g == 0.0 {
            return (0.25 / PI, 0.25 / PI);
        }
        let (travels, light_spread) = match light.kind {
            LightKind::Directional => (light.direction.as_dvec3(), 0.0),
            LightKind::Point | LightKind::Spot => self.seen_from(light.position),
        };
        let (away, camera_spread) = self.seen_from(self.camera.as_vec3());
        // From the object towards the camera.
        let turn = angle(travels, -away);
        let spread = light_spread + camera_spread + 1e-3;
        let ends = [(turn - spread).max(0.0), (turn + spread).min(PI)].map(|a| henyey_greenstein(g, a.cos()));
        (ends[0].min(ends[1]), ends[0].max(ends[1]))
    }

    /// Unit direction from a point to the centre, and the largest angle by which that to another point of the sphere differs.
    fn seen_from(&self, point: Vec3) -> (DVec3, f64) {
        let distance = point.as_dvec3().length();
        if distance <= self.radius {
            return (DVec3::Y, PI);
        }
        (-point.as_dvec3() / distance, (self.radius / distance).asin())
    }
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.dot(b).clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::even_directions;

    fn light(kind: LightKind, position: Vec3, colour: f32) -> FrameLight {
        FrameLight {
            kind,
            position,
            direction: -position.normalize_or(Vec3::Y),
            colour: Vec3::splat(colour),
            cos_inner: 0.99,
            cos_outer: 0.98,
            most_cosine: 1.0,
            exact: false,
        }
    }

    fn sphere(camera: DVec3) -> Sphere {
        Sphere { radius: 1.0, camera, least_distance: 1e-3 }
    }

    #[test]
    fn bounds_hold_on_and_in_the_sphere() {
        for (kind, colour) in [(LightKind::Point, 3.0), (LightKind::Spot, 2.0), (LightKind::Directional, 1.0)]
        {
            for distance in [0.5, 1.5, 20.0] {
                let light = light(kind, Vec3::new(0.3, -0.2, 1.0).normalize() * distance, colour);
                for (camera, g) in [(4.0, 0.0), (4.0, 0.6), (0.5, 0.6), (30.0, -0.8)] {
                    let sphere = sphere(DVec3::new(0.5, 0.1, -0.7).normalize() * camera);
                    let (least, most) = sphere.bounds(&light, g);
                    for (k, d) in even_directions(400, 1).into_iter().enumerate() {
                        let x = d * (1.0 - (k % 4) as f64 / 4.0);
                        let (to, _, here) = light.at(x.as_vec3(), 1e-3);
                        let cosine = -to.as_dvec3().dot((sphere.camera - x).normalize());
                        let here = f64::from(here.x) * henyey_greenstein(g, cosine);
                        let bounded = here >= least.x * 0.999 && here <= most * 1.001;
                        assert!(bounded, "{kind:?} {distance} {camera} {g}: {least} {here} {most}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_spot_that_looks_away_misses() {
        let mut spot = light(LightKind::Spot, Vec3::X * 5.0, 1.0);
        let sphere = sphere(DVec3::Z * 5.0);
        assert!(!sphere.is_missed(&spot, 5.0));
        spot.direction = Vec3::Y;
        assert!(sphere.is_missed(&spot, 5.0));
        assert!(!sphere.is_missed(&spot, 0.5));
        assert_eq!(sphere.bounds(&spot, 0.3).1, 0.0);
    }

    #[test]
    fn light_beyond_single_precision_is_bounded() {
        let glaring = light(LightKind::Point, Vec3::X * 2.0, f32::MAX);
        let (least, most) = sphere(DVec3::Z * 5.0).bounds(&glaring, 0.9);
        assert!(least.is_finite() && (1e26..1e32).contains(&most));
    }

    #[test]
    fn the_dimmest_go_while_their_sum_is_allowed() {
        assert_eq!(lit(&[3.0, 1.0, 0.5, 0.0], 1.0), [0, 1]);
        assert_eq!(lit(&[3.0, 1.0, 0.5, 0.0], 1.5), [0]);
        assert_eq!(lit(&[0.0, 0.0], 0.0), [0; 0]);
        assert_eq!(lit(&[], 0.0), [0; 0]);
    }

    #[test]
    fn bright_lights_come_first_and_dim_ones_from_the_dimmest_on() {
        let mut most = vec![1e-3, 5e-4, 2e-4];
        most.extend((0..40).map(|k| 100.0 + f64::from(k)));
        let reach = Reach { lit: (0..43).collect(), many: false, may_fold: true, most, scene_lights: 43 };
        let (order, environment, negligible) = reach.order(&reach.lit);
        assert_eq!((environment, order[0], order[39], &order[40..]), (0, 42, 3, &[2, 1, 0][..]));
        assert_eq!(negligible, 1e-4);
        let few: Vec<usize> = (0..CULL_FROM - 1).collect();
        assert_eq!(reach.order(&few), (few.clone(), 0, 0.0));
    }
}
