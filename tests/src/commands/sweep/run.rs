//! The measurements of a sweep, case by case, those that are known already left out.

use super::arguments::{Arguments, Checked, SweepBackend};
use super::bench::Bench;
use super::fingerprint::fingerprint;
use crate::commands::output::warn;
use crate::commands::progress::Steps;
use diaphane_bake::progress::Silent;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::PathBuf;
use validation::reference::Settings;
use validation::rivals::object::Object;
use validation::rivals::thesis;
use validation::sweep::case::Case;
use validation::sweep::measure::make;
use validation::sweep::plan::{Baked, Drawing, Job};
use validation::sweep::record::{Key, Method, Record};
use validation::sweep::references::{self, Known};
use validation::sweep::store::Store;

/// A sweep under way.
pub struct Sweep<'a> {
    checked: &'a Checked,
    backend: SweepBackend,
    seed: u64,
    folder: PathBuf,
    version: String,
    store: Store,
}

/// A measurement to be made, unless it is known.
pub struct Wanted {
    /// How.
    pub drawing: Drawing,
    /// On the GPU.
    pub gpu: bool,
    /// What identifies it.
    pub key: Key,
}

impl<'a> Sweep<'a> {
    /// A sweep into the measurements of `store`.
    pub fn new(a: &Arguments, checked: &'a Checked, store: Store) -> anyhow::Result<Self> {
        Ok(Self {
            checked,
            backend: a.backend,
            seed: a.seed,
            folder: a.output_dir.join("references"),
            version: fingerprint()?,
            store,
        })
    }

    /// Number of measurements in all, and of those still to be made.
    pub fn count(&self, cases: &[Case]) -> (usize, usize) {
        let all: Vec<Wanted> =
            cases.iter().flat_map(|c| self.plan(c)).flat_map(|(_, wanted)| wanted).collect();
        (all.len(), all.iter().filter(|w| self.store.get(&w.key).is_none()).count())
    }

    /// The assets of a case and what is drawn from each.
    fn plan(&self, case: &Case) -> Vec<(Job, Vec<Wanted>)> {
        let more = format!("{:?} {} {}", self.checked.size, self.checked.tolerance, self.seed);
        let inputs = case.hash(&more);
        let of_job = |job: &Job| -> Vec<Wanted> {
            let mut wanted = Vec::new();
            for drawing in &job.drawings {
                let gpu_too = drawing.method == Method::Splats && self.backend == SweepBackend::Gpu;
                for &lights in &self.checked.axes.lights {
                    for gpu in [false, true].into_iter().take(1 + usize::from(gpu_too)) {
                        let key = self.key(case, &inputs, &job.baked, *drawing, lights, gpu);
                        wanted.push(Wanted { drawing: *drawing, gpu, key });
                    }
                }
            }
            wanted
        };
        let jobs = self.checked.axes.jobs();
        jobs.into_iter().map(|job| (of_job(&job), job)).map(|(wanted, job)| (job, wanted)).collect()
    }

    fn key(&self, case: &Case, inputs: &str, b: &Baked, drawing: Drawing, lights: usize, gpu: bool) -> Key {
        let key = Key {
            case: case.name.clone(),
            inputs: inputs.to_owned(),
            version: self.version.clone(),
            method: drawing.method,
            samples: b.samples,
            order: b.order,
            encoding: b.encoding.name().to_owned(),
            directions: b.directions,
            preset: b.preset.name().to_owned(),
            steps: drawing.steps,
            lights,
            backend: if gpu { "gpu" } else { "cpu" }.to_owned(),
        };
        let none = || "-".to_owned();
        match drawing.method {
            Method::Splats | Method::Grid => key,
            Method::Thesis => Key { order: thesis::ORDER, encoding: "transmittance".to_owned(), ..key },
            Method::March => {
                Key { samples: 0, order: 0, directions: 0, encoding: none(), preset: none(), ..key }
            }
        }
    }

    /// Makes what is missing of a case and returns all its measurements.
    pub fn case(&mut self, case: &Case, display: &Steps) -> anyhow::Result<Vec<Record>> {
        let mut known = BTreeMap::new();
        let mut object: Option<Object<'_>> = None;
        let mut records = Vec::new();
        for (job, wanted) in self.plan(case) {
            let missing: Vec<&Wanted> = wanted.iter().filter(|w| self.store.get(&w.key).is_none()).collect();
            if !missing.is_empty() {
                display.note(&format!("{}: baking {} samples", case.name, job.baked.samples));
                let made = make(case, &job.baked, self.seed, &Silent)?;
                let object = match &mut object {
                    Some(object) => object,
                    empty => empty.insert(Object::new(&case.mesh, &case.medium, &made.asset)?),
                };
                let mut bench = Bench::new((case, self.seed), &made, job.baked, object, self.checked.frames);
                for w in missing {
                    let scene = case.scene(w.key.lights, self.seed);
                    let reference = match known.entry(w.key.lights) {
                        Entry::Occupied(there) => there.into_mut(),
                        Entry::Vacant(free) => free.insert(self.reference(case, w.key.lights, display)?),
                    };
                    display.note(&describe(&w.key));
                    let outcome = bench.measure(w, &scene, reference)?;
                    display.done(&format!(
                        "{}: {:.2} %, {:.1} ms",
                        describe(&w.key),
                        100.0 * outcome.rel_rmse,
                        outcome.frame_ms[1]
                    ));
                    self.store.add(Record { key: w.key.clone(), outcome })?;
                }
            }
            records.extend(wanted.iter().filter_map(|w| self.store.get(&w.key).cloned()));
        }
        Ok(records)
    }

    fn reference(&self, case: &Case, lights: usize, display: &Steps) -> anyhow::Result<Known> {
        let scene = case.scene(lights, self.seed);
        let settings = Settings { tolerance: self.checked.tolerance, seed: self.seed, ..Settings::default() };
        let hash = case.hash(&format!("{:?} {settings:?}", scene.lights));
        let name = format!("{}-{lights}-{hash}", case.name);
        let wanted = references::Wanted { mesh: &case.mesh, medium: &case.medium, scene: &scene, settings };
        display.note(&format!("{}: reference, lights: {lights}", case.name));
        let (known, warning) = references::obtain(&self.folder, &name, &wanted, &|_| ())?;
        warn(warning.as_slice());
        Ok(known)
    }
}

/// A measurement in a few words.
fn describe(key: &Key) -> String {
    let setting = match key.method {
        Method::March => format!("{} steps", key.steps),
        _ => format!("{} samples, {} bands, {}", key.samples, key.order, key.encoding),
    };
    format!("{} {} ({setting}), lights: {}", key.case, key.method.name(), key.lights)
}
