//! Bakes of the bird, whole and by stage.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Silent;
use std::hint::black_box;
use std::time::Duration;
use validation::range::objects::Object;
use validation::speed::bakes::{medium, seconds, timed};

fn bakes(c: &mut Criterion) {
    let mesh = Object::Bird.place().expect("the bird is sound").mesh;
    let mut group = c.benchmark_group("bake");
    group.sample_size(10);
    for (name, uneven) in [("even", false), ("grid", true)] {
        let medium = medium(&mesh, uneven).expect("a sound medium");
        for samples in [1_000, 4_000] {
            let params = Params { samples, ..Params::preset(Preset::Draft) };
            group.bench_function(BenchmarkId::new(name, samples), |b| {
                b.iter(|| black_box(timed(&mesh, &medium, &params, &Silent).expect("a bake")));
            });
        }
    }
    group.finish();
}

/// Stages with the time that their bake's report tells.
const STAGES: [&str; 12] = [
    "mesh",
    "distance field",
    "density",
    "samples",
    "cells",
    "optical depth",
    "held-out light",
    "harmonics",
    "more bands",
    "rounding",
    "weights",
    "certificate",
];

fn stages(c: &mut Criterion) {
    let mesh = Object::Bird.place().expect("the bird is sound").mesh;
    let medium = medium(&mesh, false).expect("a sound medium");
    let params = Params { samples: 4_000, ..Params::preset(Preset::Draft) };
    let mut group = c.benchmark_group("stage");
    group.sample_size(10);
    for stage in STAGES {
        let once = || timed(&mesh, &medium, &params, &Silent).expect("a bake");
        group.bench_function(BenchmarkId::from_parameter(stage), |b| {
            b.iter_custom(|n| (0..n).map(|_| Duration::from_secs_f64(seconds(&once(), stage))).sum());
        });
    }
    group.finish();
}

criterion_group!(benches, bakes, stages);
criterion_main!(benches);
