//! Optical depths along one direction and its opposite by both methods, on the same mesh and points, one thread.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use diaphane_formats::visibility::{Accel, project, project_with, trace};
use glam::DVec3;
use std::hint::black_box;
use validation::range::objects::Object;
use validation::speed::bakes::medium;
use validation::speed::visibility::points_inside;

fn visibility(c: &mut Criterion) {
    let mesh = Object::Bird.place().expect("the bird is sound").mesh;
    let accel = Accel::new(&mesh);
    let even = medium(&mesh, false).expect("an even medium");
    let uneven = medium(&mesh, true).expect("a grid");
    let axis = DVec3::new(0.3, 0.5, 0.8).normalize();
    let mut group = c.benchmark_group("visibility");
    group.sample_size(10);
    for count in [1_000, 10_000, 100_000] {
        let points = points_inside(&mesh, &accel, count, 0.0, 1);
        group.throughput(Throughput::Elements(2 * count as u64));
        group.bench_function(BenchmarkId::new("project", count), |b| {
            b.iter(|| black_box(project(&mesh, &even, &points, axis)));
        });
        group.bench_function(BenchmarkId::new("project a grid", count), |b| {
            b.iter(|| black_box(project_with(&mesh, &uneven, None, &points, axis)));
        });
        group.bench_function(BenchmarkId::new("trace", count), |b| {
            b.iter(|| black_box(trace(&accel, &even, None, &points, axis)));
        });
    }
    group.finish();
}

criterion_group!(benches, visibility);
criterion_main!(benches);
