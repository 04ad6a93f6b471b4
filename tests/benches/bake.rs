//! Whole bakes of the bird. The time of each stage is in every bake's report: `diaphane-validate bake-speed` prints it.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Silent;
use std::hint::black_box;
use validation::range::objects::Object;
use validation::speed::bakes::{medium, timed};

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

criterion_group!(benches, bakes);
criterion_main!(benches);
