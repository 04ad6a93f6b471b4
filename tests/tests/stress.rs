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
    let report = run(&plan, Settings { gpu: true }, &Silent, &|_, _| ());
    println!("{}", report.text());
    assert_eq!(report.lines.len(), plan.cells());
    assert_eq!(report.failed(), 0, "{}", report.text());
    let seen: usize = report.lines.iter().map(|l| l.findings.compared).sum();
    assert!(seen > 20 * plan.cells(), "only {seen} rays were compared with double precision");
    let drawn: usize = report.lines.iter().map(|l| l.findings.gpu_rays).sum();
    if drawn == 0 {
        assert!(!gpu_is_required(), "no ray of a GPU was compared");
        tell("skipped: no adapter, the GPU's part of the stress suite");
    }
}

/// Says why a test does less, past the test runner's capture of the print macros.
fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
