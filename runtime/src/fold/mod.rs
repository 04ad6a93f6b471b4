//! Many directional lights at the cost of one: which lights are evaluated one by one, which go into one vector of
//! spherical harmonics, and which reach nothing.
//!
//! Light from far away arrives at a sample as ∫ψβ(ω) E(ω) p dω. Where the transmittance ψβ is itself expanded,
//! ψβ = Σ_k t_k Y_k ([`linear`]), this is Σ_k t_k F_k with F_k = Σ_l E_l p Y_k(ω_l) over the lights ([`ambient`]), whatever
//! their number. What the baked coefficients represent is not linear in them, so t is a copy made when a frame first
//! asks for it; its error is reported. An environment always goes that way, a scene's own directional lights where there
//! are more than [`MOST_SINGLE`].

pub mod ambient;
pub mod linear;
mod reach;

pub use ambient::Ambient;
pub use linear::Linear;
pub use reach::{CULL_FROM, NEGLIGIBLE, PORTION, Reach, reach};

use crate::exact::ExactDepths;
use crate::frame::{Frame, FrameLight, LightKind};
use diaphane_formats::asset::Info;
use glam::Vec3;
use serde::Serialize;

/// Directional lights that are evaluated one by one at most.
pub const MOST_SINGLE: usize = 32;

/// Largest deviation of the direction towards the camera, over (1 - |g|)², for which a phase function is folded.
const MOST_PARALLAX: f32 = 0.25;

/// What becomes of a frame's lights: indices into [`Frame::lights`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Evaluated at every sample.
    pub single: Vec<usize>,
    /// Part of the ambient vector.
    pub folded: Vec<usize>,
    /// Those of `single` in the order of evaluation: an environment's, then the scene's. Where the samples leave out what brings
    /// them next to nothing, the brightest come first.
    pub order: Vec<usize>,
    /// How many of `order` stand for an environment.
    pub environment: usize,
    /// Too dim, too far or turned away.
    pub dark: usize,
    /// What a sample may leave out of each portion of `order`, as a part of what it has by then; 0 where it must take all.
    pub negligible: f32,
}

/// What the samples' values depend on beside the material: where nothing of it changes they are not computed again.
#[derive(Clone, Debug, PartialEq)]
pub struct LightingKey {
    lights: Vec<FrameLight>,
    scene_lights: usize,
    exact: Option<ExactDepths>,
    least_distance: f32,
    /// Where the camera makes a difference.
    origin: Option<Vec3>,
}

impl LightingKey {
    /// Of a frame of an asset.
    pub fn new(frame: &Frame, info: &Info, exact: Option<&ExactDepths>) -> Self {
        Self {
            lights: frame.lights.clone(),
            scene_lights: frame.scene_lights,
            exact: exact.filter(|e| !e.is_empty()).cloned(),
            least_distance: frame.least_distance,
            origin: (info.phase.mean_cosine() != 0.0).then_some(frame.view.origin),
        }
    }
}

/// Numbers of a [`Plan`], for reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LightCounts {
    /// Lights evaluated at every sample.
    pub single: usize,
    /// Lights in one vector.
    pub folded: usize,
    /// Lights that reach nothing, left out for the whole object.
    pub dark: usize,
    /// Share of the samples times lights evaluated one by one that was left out because it would have brought next to nothing,
    /// 0..1; `None` on a GPU, which does not count it.
    pub negligible_share: Option<f32>,
    /// Error of the transmittance that folded lights see, root mean square over samples and directions; 0 where none is
    /// folded.
    pub fold_error: f32,
}

impl Plan {
    /// For a frame of an asset, some of whose lights have exact depths or are on their way to or from them. A directional light
    /// on its way may be among those that are folded and among those that are evaluated: there its correction alone.
    pub fn new(frame: &Frame, info: &Info, exact: Option<&ExactDepths>) -> Self {
        let share = |i: usize| exact.map_or(0.0, |e| e.share(i));
        let reach = reach(frame, info);
        let folds = |i: &usize| share(*i) < 1.0 && reach.folds(&frame.lights[*i]);
        let far = |i: &usize| frame.lights[*i].kind == LightKind::Directional && share(*i) < 1.0;
        let folded: Vec<usize> = if reach.many {
            reach.lit.iter().copied().filter(folds).collect()
        } else if reach.may_fold {
            reach.lit.iter().copied().filter(|i| *i >= frame.scene_lights && far(i)).collect()
        } else {
            Vec::new()
        };
        let mut plan = Self { folded, dark: frame.lights.len() - reach.lit.len(), ..Self::default() };
        plan.single = reach.lit.iter().copied().filter(|i| !plan.is_folded(*i) || share(*i) > 0.0).collect();
        plan.arrange(&reach);
        plan
    }

    /// Whether a light is part of the ambient vector.
    pub fn is_folded(&self, light: usize) -> bool {
        self.folded.binary_search(&light).is_ok()
    }

    /// Evaluates all lights one by one.
    pub fn unfold(&mut self, frame: &Frame, info: &Info) {
        self.single.append(&mut self.folded);
        self.single.sort_unstable();
        self.single.dedup();
        self.arrange(&reach(frame, info));
    }

    fn arrange(&mut self, reach: &Reach) {
        (self.order, self.environment, self.negligible) = reach.order(&self.single);
    }

    /// What is reported, with the error of what is folded.
    pub fn counts(&self, fold_error: f32, negligible_share: Option<f32>) -> LightCounts {
        let fold_error = if self.folded.is_empty() { 0.0 } else { fold_error };
        let (single, folded, dark) = (self.single.len(), self.folded.len(), self.dark);
        LightCounts { single, folded, dark, negligible_share, fold_error }
    }
}

/// Whether the direction towards the camera is nearly the same all over the object, as far as the phase function minds.
fn may_fold(frame: &Frame, info: &Info) -> bool {
    let g = info.phase.mean_cosine().abs() as f32;
    let parallax = 0.5 * info.diagonal() / frame.view.origin.length();
    g == 0.0 || parallax <= MOST_PARALLAX * (1.0 - g).powi(2)
}

/// Deviation of the direction towards the camera at `place` from that at the origin.
pub(crate) fn parallax(origin: Vec3, place: Vec3) -> Vec3 {
    (origin - place).normalize_or_zero() - origin.normalize_or_zero()
}
