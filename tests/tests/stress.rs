//! A fixed part of the numerical stress suite: both ends of every axis.

use diaphane_bake::progress::Silent;
use validation::stress::{Plan, Settings, run};

/// Whether a GPU must be there.
fn gpu_is_required() -> bool {
    std::env::var_os("DIAPHANE_REQUIRE_GPU").is_some_and(|v| v == "1")
}

#[test]
fn every_bound_of_the_subset_holds() {
    let plan = Plan::subset();
    assert!(plan.cells() >= 200);
    // A software adapter takes minutes for what a GPU does at once: only where one is asked for.
    let gpu = gpu_is_required();
    if !gpu {
        tell("skipped: the GPU's part of the stress suite; DIAPHANE_REQUIRE_GPU=1 runs it");
    }
    let report = run(&plan, Settings { gpu }, &Silent, &|_, _| ());
    println!("{}", report.text());
    assert_eq!(report.lines.len(), plan.cells());
    assert_eq!(report.failed(), 0, "{}", report.text());
    let seen: usize = report.lines.iter().map(|l| l.findings.compared).sum();
    assert!(seen > 20 * plan.cells(), "only {seen} rays were compared with double precision");
    let drawn: usize = report.lines.iter().map(|l| l.findings.gpu_rays).sum();
    assert_eq!(drawn > 0, gpu, "rays of the GPU that were compared");
}

/// Says why a test does less, past the test runner's capture of the print macros.
fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
