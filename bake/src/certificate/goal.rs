//! What to change about a bake whose certificate exceeds the wanted error.

use crate::params::Params;
use crate::{Error, Result};
use diaphane_formats::asset::{Certificate, CertifiedError};
use diaphane_formats::sh::{MAX_ORDER, coefficient_count};

/// Most samples that are tried.
const MOST_SAMPLES: usize = 1_000_000;
/// Interpolation error falls about as this power of the number of samples.
const RATE: f64 = 0.4;
/// A step must leave less than this part of the error that it is to reduce, or the next such step is not taken.
const PROGRESS: f64 = 0.97;

/// What can be changed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Knob {
    Samples,
    Bands,
}

/// Follows the bakes on the way to an error.
#[derive(Default)]
pub(crate) struct Goal {
    /// The last change, and the error before it.
    last: Option<(Knob, f64)>,
    /// Changes that no longer helped.
    stuck: Vec<Knob>,
}

impl Goal {
    /// Parameters of the next bake, or `None` where `certificate` satisfies `params`.
    ///
    /// # Errors
    /// [`Error::TooInaccurate`] where nothing more can be done, saying what was reached and what limits it.
    pub fn next(&mut self, params: &Params, certificate: Option<&Certificate>) -> Result<Option<Params>> {
        let Some(most) = params.max_error else { return Ok(None) };
        let Some(error) = certificate.and_then(|c| c.error) else {
            return Err(Error::TooInaccurate(
                "no light leaves the object, so its error cannot be measured and --max-error not be checked"
                    .to_owned(),
            ));
        };
        if error.rel_rmse <= most {
            return Ok(None);
        }
        if let Some((knob, before)) = self.last
            && error.rel_rmse > PROGRESS * before
        {
            self.stuck.push(knob);
        }
        let ranked = if error.interpolation >= error.representation {
            [(Knob::Samples, error.interpolation), (Knob::Bands, error.representation)]
        } else {
            [(Knob::Bands, error.representation), (Knob::Samples, error.interpolation)]
        };
        for (knob, share) in ranked {
            if let Some(next) = self.turn(knob, params, &error, most) {
                self.last = Some((knob, error.rel_rmse));
                return Ok(Some(next));
            }
            if share > most {
                break;
            }
        }
        Err(Error::TooInaccurate(sentence(params, &error, most, ranked[0].0)))
    }

    fn turn(&self, knob: Knob, params: &Params, error: &CertifiedError, most: f64) -> Option<Params> {
        if self.stuck.contains(&knob) {
            return None;
        }
        let mut next = params.clone();
        match knob {
            Knob::Bands => {
                let step = if error.rel_rmse > 1.5 * most { 2 } else { 1 };
                next.order = (params.order + step).min(MAX_ORDER);
                next.light_error = params.light_error.min(0.2 * most);
                // The fit needs a few directions for each coefficient.
                next.directions = params.directions.max(5 * coefficient_count(next.order));
            }
            Knob::Samples => {
                let room =
                    (most * most - error.representation * error.representation).max(0.25 * most * most);
                let factor = (error.interpolation / room.sqrt()).powf(1.0 / RATE).clamp(1.3, 4.0);
                let wanted = (params.samples as f64 * factor).ceil() as usize;
                next.samples = wanted.min(MOST_SAMPLES.max(params.samples));
            }
        }
        (next != *params).then_some(next)
    }
}

fn sentence(params: &Params, error: &CertifiedError, most: f64, knob: Knob) -> String {
    let limit = match knob {
        Knob::Samples => "the interpolation between samples",
        Knob::Bands => "the representation of light by spherical harmonics",
    };
    format!(
        "the certificate is {:.2} % with {} samples and {} bands, above --max-error {:.2} %: {limit} limits it \
         (interpolation {:.2} %, representation {:.2} %); nothing was written",
        100.0 * error.rel_rmse,
        params.samples,
        params.order,
        100.0 * most,
        100.0 * error.interpolation,
        100.0 * error.representation
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn certificate(interpolation: f64, representation: f64) -> Certificate {
        let error = CertifiedError {
            rel_rmse: interpolation.hypot(representation),
            psnr_db: 30.0,
            bias: 0.0,
            interpolation,
            representation,
        };
        Certificate { error: Some(error), rays: 1, views: 1, lights: 1, seed: 1 }
    }

    fn params(max_error: f64) -> Params {
        Params { max_error: Some(max_error), ..Params::default() }
    }

    #[test]
    fn the_larger_share_is_reduced_first() {
        let p = params(0.02);
        let next = Goal::default().next(&p, Some(&certificate(0.05, 0.01))).unwrap().unwrap();
        assert!(next.samples > p.samples && next.order == p.order);
        let next = Goal::default().next(&p, Some(&certificate(0.01, 0.05))).unwrap().unwrap();
        assert!(next.samples == p.samples && next.order > p.order);
        assert!(Goal::default().next(&p, Some(&certificate(0.01, 0.01))).unwrap().is_none());
        assert!(Goal::default().next(&Params::default(), Some(&certificate(1.0, 1.0))).unwrap().is_none());
    }

    #[test]
    fn it_gives_up_where_nothing_helps() {
        // A representation error that no number of bands changes.
        let (mut goal, mut p) = (Goal::default(), params(0.02));
        let error = loop {
            match goal.next(&p, Some(&certificate(0.01, 0.05))) {
                Ok(next) => p = next.unwrap(),
                Err(error) => break error,
            }
            assert!(p.order <= MAX_ORDER);
        };
        assert!(matches!(&error, Error::TooInaccurate(text) if text.contains("spherical harmonics limits")));
        // An error that cannot be measured.
        let dark = Certificate { error: None, ..certificate(0.0, 0.0) };
        assert!(matches!(Goal::default().next(&p, Some(&dark)), Err(Error::TooInaccurate(_))));
    }

    #[test]
    fn samples_stop_at_the_most() {
        let (mut goal, mut p, mut share) = (Goal::default(), params(1e-6), 0.05);
        let error = loop {
            match goal.next(&p, Some(&certificate(share, 0.001))) {
                Ok(next) => p = next.unwrap(),
                Err(error) => break error,
            }
            share *= 0.8;
        };
        assert_eq!(p.samples, MOST_SAMPLES);
        assert!(error.to_string().contains("the interpolation between samples limits"));
    }
}
