//! A hundred bakes in one process: memory stays.
#![cfg(target_os = "linux")]

use diaphane_assets::shapes::icosphere;
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Silent;
use diaphane_bake::{Input, bake};
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::phase::Phase;
use glam::DVec3;

/// Bytes that the process has in memory.
fn resident() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    4096.0 * text.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
}

#[test]
fn a_hundred_bakes_take_the_memory_of_a_few() {
    let raw = icosphere(1.0, 3);
    let (mesh, mesh_report) = Mesh::from_triangles(raw.positions, raw.triangles).unwrap();
    let draft = Params::preset(Preset::Draft);
    let mut most = [0.0f64; 2];
    for k in 0..100u32 {
        let medium = Medium::new(
            DVec3::splat(4.0 + 0.1 * f64::from(k % 7)),
            DVec3::splat(0.8),
            Phase::Isotropic,
            1.0,
            Density::Uniform(1.0),
        )
        .unwrap();
        let params = Params {
            samples: 1000 + 100 * (k as usize % 5),
            directions: 32,
            order: 4,
            seed: u64::from(k),
            ..draft.clone()
        };
        let input = Input {
            mesh: &mesh,
            mesh_report: &mesh_report,
            medium: &medium,
            mesh_name: String::new(),
            material_name: String::new(),
        };
        bake(&input, &params, &Silent).unwrap();
        // The first ones find out how much the allocator keeps.
        if k >= 30 {
            let half = usize::from(k >= 65);
            most[half] = most[half].max(resident());
        }
    }
    let growth = most[1] / most[0] - 1.0;
    println!("from {:.1} MB by {:.2} %", most[0] / 1e6, 100.0 * growth);
    assert!(growth <= 0.02, "from {:.1} MB by {:.2} %", most[0] / 1e6, 100.0 * growth);
}
