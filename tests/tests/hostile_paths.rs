//! What a file may make the programs open: a material and a scene regular files of the expected kind, an asset and a mesh
//! nothing.

#[path = "support/workbench.rs"]
mod workbench;

use std::fs::File;
use std::time::{Duration, Instant};
use workbench::{MATERIAL, SCENE, Workbench};

/// Names that lead to no usable file.
fn traps(bench: &Workbench) -> Vec<&'static str> {
    std::fs::create_dir(bench.path("folder.npy")).unwrap();
    File::create(bench.path("huge.npy")).unwrap().set_len(100 << 30).unwrap();
    bench.write("text.npy", "these are words");
    let mut traps = vec!["folder.npy", "huge.npy", "text.npy", "missing.npy"];
    if cfg!(unix) {
        let pipe = std::process::Command::new("mkfifo").arg(bench.path("pipe.npy")).status().unwrap();
        assert!(pipe.success());
        traps.extend(["pipe.npy", "/dev/zero"]);
        #[cfg(unix)]
        std::os::unix::fs::symlink("/dev/zero", bench.path("link.npy")).unwrap();
        traps.push("link.npy");
    }
    traps
}

#[test]
fn a_path_in_a_material_or_scene_opens_a_regular_file_of_its_kind_only() {
    let bench = Workbench::new();
    let traps = traps(&bench);
    let started = Instant::now();
    for trap in &traps {
        for density in [
            format!("type=\"grid\"\nfile=\"{trap}\"\nmin=[0,0,0]\nmax=[1,1,1]\n"),
            format!("type=\"shapes\"\nshapes=[{{shape=\"mesh\",file=\"{trap}\",density=1}}]\n"),
        ] {
            bench.write("trap.toml", format!("{MATERIAL}[density]\n{density}"));
            let error = diaphane_formats::material::load(&bench.path("trap.toml")).unwrap_err().to_string();
            assert!(error.contains(trap), "{trap}: {error}");
        }
        bench.write("trap.toml", format!("{SCENE}[environment]\nfile=\"{trap}\"\n"));
        let error = diaphane_formats::scene::load(&bench.path("trap.toml")).unwrap_err().to_string();
        assert!(error.contains(trap), "{trap}: {error}");
    }
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
}

#[test]
fn an_asset_and_a_mesh_refer_to_no_file() {
    let bench = Workbench::new();
    // Alone in a folder, the asset is what it was beside mesh and material.
    let alone = tempfile::tempdir().unwrap();
    let whole = diaphane_formats::asset::read(&bench.path("ball.dph")).unwrap();
    std::fs::copy(bench.path("ball.dph"), alone.path().join("ball.dph")).unwrap();
    assert_eq!(diaphane_formats::asset::read(&alone.path().join("ball.dph")).unwrap(), whole);
    // And names that its provenance holds are names, wherever they would lead.
    let mut renamed = whole.clone();
    for name in ["/dev/zero", "../../x"] {
        renamed.info.provenance.mesh_name = name.to_owned();
        renamed.info.provenance.material_name = name.to_owned();
        let bytes = diaphane_formats::asset::encode(&renamed).unwrap();
        assert_eq!(diaphane_formats::asset::parse(&bytes).unwrap().samples, whole.samples);
    }
    let mesh = std::fs::read_to_string(bench.path("ball.obj")).unwrap();
    let named = format!("mtllib /dev/zero\nmtllib missing.mtl\nusemtl m\n{mesh}");
    let parse = |text: &str| diaphane_formats::mesh::parse_obj(text.as_bytes()).unwrap().0;
    assert_eq!(parse(&named), parse(&mesh));
}
