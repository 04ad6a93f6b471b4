//! `diaphane-validate sweep`: run time against error, with rivals.

mod arguments;
mod bench;
mod fingerprint;
mod outputs;
mod run;

pub use arguments::Arguments;

use super::output::{say, tell, warn};
use super::progress::Steps;
use super::{Inputs, check_folder, make_folder};
use anyhow::Context;
use arguments::Checked;
use diaphane_formats::{files, mesh};
use run::Sweep;
use std::time::Instant;
use validation::sweep::case::Case;
use validation::sweep::store::Store;

/// Measures and writes what came out.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    let checked = a.check()?;
    let begun = Instant::now();
    check_folder(&a.output_dir)?;
    let own = own_cases(a, &checked)?;
    make_folder(&a.output_dir)?;
    make_folder(&a.output_dir.join("references"))?;
    let mut cases = built_in_cases(a, &checked)?;
    cases.extend(own);
    let (store, damaged) = Store::open(&a.output_dir.join("measurements.jsonl"))?;
    warn(&damaged);
    let mut sweep = Sweep::new(a, &checked, store)?;
    let (total, pending) = sweep.count(&cases);
    if pending < total {
        tell(&format!("{} of {total} measurements are there already", total - pending));
    }
    let display = Steps::new(pending);
    let mut records = Vec::new();
    for case in &cases {
        records.extend(sweep.case(case, &display).with_context(|| format!("case '{}'", case.name))?);
        outputs::write(&a.output_dir, &records, &checked, a.backend)?;
    }
    display.finish();
    say(&outputs::text(&records, checked.axes.base));
    say(&format!(
        "{} measurements ({pending} new) in {:.0} s; see {}",
        records.len(),
        begun.elapsed().as_secs_f64(),
        a.output_dir.join("sweep.csv").display()
    ));
    let broken = records.iter().filter(|r| r.outcome.non_finite > 0).count();
    if broken > 0 {
        tell(&format!("check failed: {broken} pictures hold values that are not finite"));
    }
    Ok(broken == 0)
}

/// The objects of `--case`, named after their meshes.
fn own_cases(a: &Arguments, checked: &Checked) -> anyhow::Result<Vec<Case>> {
    let mut cases: Vec<Case> = Vec::new();
    for files in a.case.chunks_exact(3) {
        let inputs = Inputs { mesh: files[0].clone(), material: files[1].clone(), scene: files[2].clone() };
        let stem = files[0].file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let taken =
            |name: &str| cases.iter().any(|c| c.name == name) || checked.built_in.iter().any(|c| c == name);
        let name = (1..)
            .map(|i| if i == 1 { stem.clone() } else { format!("{stem}-{i}") })
            .find(|name| !taken(name))
            .unwrap_or(stem.clone());
        cases.push(load(&inputs, name, checked)?);
    }
    Ok(cases)
}

fn built_in_cases(a: &Arguments, checked: &Checked) -> anyhow::Result<Vec<Case>> {
    if checked.built_in.is_empty() {
        return Ok(Vec::new());
    }
    let written = diaphane_assets::write_all(&a.output_dir.join("inputs"))?;
    let wanted = |name: &String| written.iter().find(|w| w.name == name);
    checked
        .built_in
        .iter()
        .filter_map(wanted)
        .map(|w| {
            let inputs =
                Inputs { mesh: w.mesh.clone(), material: w.material.clone(), scene: w.scene.clone() };
            load(&inputs, w.name.to_owned(), checked)
        })
        .collect()
}

fn load(inputs: &Inputs, name: String, checked: &Checked) -> anyhow::Result<Case> {
    let loaded = inputs.load()?;
    warn(&loaded.warnings);
    if loaded.scene.environment.is_some() {
        tell(&format!("warning: {}: the environment is left out of a sweep", inputs.scene.display()));
    }
    // The report goes into the asset; the mesh is read twice, which costs little.
    let (_, report) = mesh::parse_obj(&files::read(&inputs.mesh, files::Kind::Mesh)?)?;
    Ok(Case::new(name, (loaded.mesh, report), loaded.medium, loaded.scene, checked.size))
}
