//! Which lights get exact depths, when, and how they go from baked to exact: a state for each light and no clock of its own.
//!
//! Frame by frame a light that is wanted, stays where it is for long enough and has no depths yet waits for them; one light at a
//! time is traced, marked ones first, then those that may bring most light, as many samples as the frame's milliseconds are
//! enough for. Depths that are complete are kept until memory is needed for others: those go first that were of no use for
//! longest. Each light's share of [`super`] rises by 1 / [`Settings::fade_frames`] a frame while its depths hold, and falls as
//! fast when they do not.

mod kept;

use super::pace::Pace;
use super::report::{ExactReport, LightError, Squares};
use super::{Corrections, Depths, ExactDepths, Known};
use crate::frame::{FrameLight, LightKind};
use glam::Vec3;
use half::f16;
use kept::{Entry, Kept};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Limits of the work on exact depths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Milliseconds a frame.
    pub milliseconds: f64,
    /// Frames for which a light that is not marked must have stood still.
    pub rest_frames: u32,
    /// Frames from baked to exact depths, and back.
    pub fade_frames: u32,
    /// Bytes of complete depths, 16 for each sample and light.
    pub memory: u64,
}

impl Settings {
    /// 2 ms a frame, lights at rest for 8 frames, 16 frames from one to the other, 64 MiB.
    pub const DEFAULT: Self = Self { milliseconds: 2.0, rest_frames: 8, fade_frames: 16, memory: 64 << 20 };
}

/// Whether a light is to have exact depths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// Baked ones do.
    Baked,
    /// Once it has come to rest. The number is what it may bring; more is traced first.
    AtRest(f64),
    /// As soon as it stands still, before those that are not marked.
    Marked(f64),
    /// In this frame, whatever it takes and wherever it moves: baked depths would be wrong, not just coarse.
    AtOnce,
}

/// What a light's depths depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    directional: bool,
    /// Bits of the position or direction.
    at: [u32; 3],
}

/// Where a light is, as far as its depths mind.
pub fn place(light: &FrameLight) -> Place {
    let directional = light.kind == LightKind::Directional;
    let at: Vec3 = if directional { light.direction } else { light.position };
    // Negative zero is zero.
    Place { directional, at: at.to_array().map(|v| (v + 0.0).to_bits()) }
}

/// Depths of some samples towards a light.
#[derive(Clone, Debug, Default)]
pub struct Portion {
    /// See [`super::Depths`].
    pub depths: Vec<[f32; 2]>,
    /// See [`super::Corrections`].
    pub corrections: Vec<[f16; 4]>,
    /// What they add to the error of the baked depths.
    pub squares: Squares,
}

/// Who traces.
pub trait Work {
    /// Number of samples.
    fn samples(&self) -> usize;
    /// Depths of some samples, and the milliseconds that it took.
    fn run(&mut self, light: &FrameLight, range: Range<usize>) -> (Portion, f64);
    /// Corrections of some samples under the material as it is now, from their depths.
    fn compare(
        &mut self,
        light: &FrameLight,
        range: Range<usize>,
        depths: &[[f32; 2]],
    ) -> (Vec<[f16; 4]>, Squares);
}

/// What is known of a light of the last frame.
struct Track {
    place: Place,
    /// Frames since it moved.
    rest: u32,
    /// Share, in steps of a fade.
    steps: u32,
    using: Option<Arc<Entry>>,
}

/// A light that is being traced.
struct Job {
    light: FrameLight,
    place: Place,
    done: Portion,
    material: u64,
}

/// Part of a frame's milliseconds after which no further portion is begun: small ones are mostly waiting for threads.
const ENOUGH: f64 = 0.75;

/// The state of all lights.
pub struct Schedule {
    settings: Settings,
    tracks: Vec<Track>,
    kept: Kept,
    job: Option<Job>,
    pace: Pace,
    frame: u64,
    material: u64,
    report: ExactReport,
    busy: bool,
}

impl Schedule {
    /// Nothing is known yet.
    pub fn new(settings: Settings) -> Self {
        let settings = Settings { fade_frames: settings.fade_frames.max(1), ..settings };
        Self {
            settings,
            tracks: Vec::new(),
            kept: Kept::new(settings.memory),
            job: None,
            pace: Pace::default(),
            frame: 0,
            material: 0,
            report: ExactReport::default(),
            busy: false,
        }
    }

    /// The medium attenuates otherwise from now on. Depths hold; how far they are from the baked ones does not.
    pub fn change_material(&mut self) {
        self.material += 1;
    }

    /// Sets the milliseconds of the frames to come.
    pub fn set_milliseconds(&mut self, milliseconds: f64) {
        self.settings.milliseconds = milliseconds;
    }

    /// Sets the bytes that complete depths may take from now on; what is more goes, that which was of no use for longest first.
    pub fn set_memory(&mut self, bytes: u64) {
        self.kept.set_memory(bytes);
    }

    /// Bytes of the depths that are kept.
    pub fn kept_bytes(&self) -> u64 {
        self.kept.bytes()
    }

    /// Whether the next frames will differ from this one although nothing moves.
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Notes who traced in the last frame.
    pub fn set_on_gpu(&mut self, on_gpu: bool) {
        self.report.on_gpu = on_gpu;
    }

    /// What the last frame was like.
    pub fn report(&self) -> &ExactReport {
        &self.report
    }

    /// One frame: its lights, what they wish for (one for each; lights beyond the end are baked), and who traces. Returns what
    /// serves now.
    pub fn advance(&mut self, lights: &[FrameLight], wishes: &[Wish], work: &mut impl Work) -> ExactDepths {
        self.frame += 1;
        self.report = ExactReport::default();
        self.follow(lights);
        let wish = |i: usize| wishes.get(i).copied().unwrap_or(Wish::Baked);
        for (i, light) in lights.iter().enumerate() {
            self.fade(i, light, wish(i), work);
        }
        self.trace(lights, wish, work);
        let fade = self.settings.fade_frames;
        let moving = |(i, t): (usize, &Track)| match wish(i) {
            Wish::AtRest(_) => t.rest < self.settings.rest_frames,
            Wish::Marked(_) => t.rest == 0,
            Wish::AtOnce | Wish::Baked => false,
        };
        self.busy = self.report.waiting > 0
            || self.tracks.iter().any(|t| t.steps > 0 && t.steps < fade)
            || self.tracks.iter().enumerate().any(|(i, t)| moving((i, t)) || self.may_rise(t, wish(i)));
        ExactDepths::new(self.tracks.iter().map(|t| self.known(t)).collect())
    }

    /// Whether a light that is baked now will fade in the next frame.
    fn may_rise(&self, track: &Track, wish: Wish) -> bool {
        track.steps == 0 && wish != Wish::Baked && self.kept.contains(&track.place)
    }

    fn known(&self, track: &Track) -> Option<Known> {
        let entry = track.using.as_ref().filter(|_| track.steps > 0)?;
        Some(if track.steps >= self.settings.fade_frames && entry.place == track.place {
            Known::Exact(Arc::clone(&entry.depths))
        } else {
            let share = track.steps as f32 / self.settings.fade_frames as f32;
            Known::Corrected { by: Arc::clone(&entry.corrections), share }
        })
    }

    /// Finds each light's track: the one in its place, else the one of its number, which then has moved. Lights that were
    /// removed do not move those behind them.
    fn follow(&mut self, lights: &[FrameLight]) {
        let mut old: Vec<Option<Track>> = std::mem::take(&mut self.tracks).into_iter().map(Some).collect();
        let places: Vec<Place> = lights.iter().map(place).collect();
        let mut found: Vec<Option<Track>> = Vec::with_capacity(lights.len());
        for (i, here) in places.iter().enumerate() {
            let same = old.get(i).and_then(Option::as_ref).is_some_and(|t| t.place == *here);
            found.push(if same { old[i].take() } else { None });
        }
        if found.iter().any(Option::is_none) {
            let left = old.iter().enumerate().filter_map(|(i, t)| Some((t.as_ref()?.place, i)));
            let mut by_place: HashMap<Place, usize> = left.collect();
            for (here, track) in places.iter().zip(&mut found).filter(|(_, t)| t.is_none()) {
                *track = by_place.remove(here).and_then(|i| old[i].take());
            }
        }
        let follow = |(i, (track, place)): (usize, (Option<Track>, Place))| match track {
            Some(track) => Track { rest: track.rest.saturating_add(1), ..track },
            None => match old.get_mut(i).and_then(Option::take) {
                Some(moved) => Track { place, rest: 0, ..moved },
                None => Track { place, rest: 0, steps: 0, using: None },
            },
        };
        self.tracks = found.into_iter().zip(places).enumerate().map(follow).collect();
    }

    /// Moves a light's share by a step.
    fn fade(&mut self, i: usize, light: &FrameLight, wish: Wish, work: &mut impl Work) {
        let (place, rest, steps) = (self.tracks[i].place, self.tracks[i].rest, self.tracks[i].steps);
        let using = self.tracks[i].using.take();
        let holds = using.as_ref().is_some_and(|e| e.place == place);
        let entry = match wish {
            Wish::Baked => None,
            Wish::AtOnce if holds => using.clone(),
            Wish::AtOnce => Some(self.find(place).unwrap_or_else(|| self.at_once(light, work))),
            Wish::AtRest(_) | Wish::Marked(_) => {
                let kept = self.find(place);
                // Another correction than the one that is on its way out would be a jump.
                kept.filter(|_| steps == 0 || holds)
            }
        };
        // A light that is new needs no fade: there was no picture of it.
        let new = rest == 0 && using.is_none() && wish == Wish::AtOnce;
        let (using, steps) = match entry {
            Some(entry) => {
                let steps = if new { self.settings.fade_frames } else { steps + 1 };
                (Some(entry), steps.min(self.settings.fade_frames))
            }
            None => (using.filter(|_| steps > 1), steps.saturating_sub(1)),
        };
        // Depths serve by themselves, corrections only under the material that they are for.
        let fading = steps < self.settings.fade_frames;
        let using = using.map(|e| if fading { self.renewed(e, work) } else { e });
        self.tracks[i] = Track { place, rest, steps, using };
    }

    /// Depths that are kept for a place; they count as used.
    fn find(&mut self, place: Place) -> Option<Arc<Entry>> {
        self.kept.find(place, self.frame)
    }

    /// All depths of a light, in this frame. They are not kept for others: such lights may move in every frame.
    fn at_once(&mut self, light: &FrameLight, work: &mut impl Work) -> Arc<Entry> {
        let samples = work.samples();
        let (portion, milliseconds) = work.run(light, 0..samples);
        self.report.milliseconds += milliseconds;
        self.report.rays += samples as u64;
        Arc::new(complete(light, portion, self.material))
    }

    /// The same depths with corrections for the material as it is.
    fn renewed(&mut self, entry: Arc<Entry>, work: &mut impl Work) -> Arc<Entry> {
        if entry.material == self.material {
            return entry;
        }
        let depths = entry.depths.values();
        let (corrections, squares) = work.compare(&entry.light, 0..depths.len(), depths);
        let renewed = Arc::new(Entry {
            light: entry.light,
            place: entry.place,
            depths: Arc::clone(&entry.depths),
            corrections: Arc::new(Corrections::new(corrections)),
            error: squares.relative(),
            material: self.material,
        });
        self.kept.renew(&renewed);
        renewed
    }

    /// Spends the frame's milliseconds on depths, and counts.
    fn trace(&mut self, lights: &[FrameLight], wish: impl Fn(usize) -> Wish, work: &mut impl Work) {
        let mut queue = self.queue(lights, &wish);
        if self.job.as_ref().is_some_and(|job| !queue.iter().any(|i| self.tracks[*i].place == job.place)) {
            // It moved, or nobody wants it any more.
            self.job = None;
        }
        let samples = work.samples();
        let mut spent = 0.0;
        while spent < ENOUGH * self.settings.milliseconds {
            if self.job.is_none() {
                let Some(&next) = queue.first() else { break };
                if !self.kept.make_room(samples, self.frame) {
                    break;
                }
                let (light, place) = (lights[next], self.tracks[next].place);
                self.job = Some(Job { light, place, done: Portion::default(), material: self.material });
            }
            let Some(job) = &mut self.job else { break };
            let start = job.done.depths.len();
            let count = self.pace.samples(self.settings.milliseconds - spent).min(samples - start);
            let (portion, milliseconds) = work.run(&job.light, start..start + count);
            spent += milliseconds;
            self.pace.learn(count, milliseconds);
            self.report.rays += count as u64;
            job.done.depths.extend(portion.depths);
            job.done.corrections.extend(portion.corrections);
            job.done.squares = job.done.squares.plus(portion.squares);
            if start + count == samples
                && let Some(job) = self.job.take()
            {
                queue.retain(|i| self.tracks[*i].place != job.place);
                let entry = Arc::new(complete(&job.light, job.done, job.material));
                self.kept.insert(entry, self.frame);
            } else if count == 0 {
                break;
            }
        }
        self.report.milliseconds += spent;
        self.count(queue.len(), samples);
    }

    /// Lights that wait for depths, the first to be traced in front.
    fn queue(&self, lights: &[FrameLight], wish: impl Fn(usize) -> Wish) -> Vec<usize> {
        let rank = |i: usize| match wish(i) {
            Wish::Marked(most) if self.tracks[i].rest > 0 => Some((true, most)),
            Wish::AtRest(most) if self.tracks[i].rest >= self.settings.rest_frames => Some((false, most)),
            _ => None,
        };
        let waits = |i: &usize| !self.kept.contains(&self.tracks[*i].place);
        let ranked = (0..lights.len()).filter(waits).filter_map(|i| Some((rank(i)?, i)));
        let mut queue: Vec<((bool, f64), usize)> = ranked.collect();
        queue.sort_by(|((a, x), i), ((b, y), j)| b.cmp(a).then(y.total_cmp(x)).then(i.cmp(j)));
        queue.into_iter().map(|(_, i)| i).collect()
    }

    fn count(&mut self, waiting: usize, samples: usize) {
        let fade = self.settings.fade_frames;
        let room = self.job.is_some() || self.kept.may_fit(samples, self.frame);
        let report = &mut self.report;
        (report.waiting, report.crowded) = match (waiting, room) {
            (0, _) => (0, 0),
            (_, true) => (waiting, 0),
            (_, false) => (0, waiting),
        };
        for (i, track) in self.tracks.iter().enumerate() {
            let holds = track.using.as_ref().filter(|e| e.place == track.place && track.steps == fade);
            match holds {
                Some(entry) => {
                    report.exact += 1;
                    report.errors.push(LightError { light: i, relative: entry.error });
                }
                None => report.fading += usize::from(track.steps > 0),
            }
        }
        report.baked = self.tracks.len().saturating_sub(report.exact + report.fading + waiting);
        report.rays_per_second = self.pace.per_second();
        report.bytes = self.kept.bytes();
        report.evicted = self.kept.evicted;
    }
}

fn complete(light: &FrameLight, portion: Portion, material: u64) -> Entry {
    Entry {
        light: *light,
        place: place(light),
        error: portion.squares.relative(),
        depths: Arc::new(Depths::new(portion.depths)),
        corrections: Arc::new(Corrections::new(portion.corrections)),
        material,
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
