//! Wrong parameters, outputs, assets and pictures: exit code 2, one clear line on standard error, nothing written.

#[path = "support/workbench.rs"]
mod workbench;

use workbench::{MATERIAL, SCENE, With, Workbench};

#[test]
fn parameters() {
    let bench = Workbench::new();
    for (option, value) in [
        ("--samples", "0"),
        ("--directions", "0"),
        ("--sh-order", "0"),
        ("--sh-order", "15"),
        ("--threads", "0"),
    ] {
        bench.refuses(
            "bake",
            &["ball.obj", "--material", "m.toml", "--output", "o.dph", option, value],
            option,
        );
    }
    for value in ["0", "-1", "nan", "inf", "little"] {
        let tolerance = format!("--tolerance={value}");
        let reference =
            ["ball.obj", "--material", "m.toml", "--scene", "s.toml", "--output", "o.exr", &tolerance];
        bench.refuses("validate", &reference.with("reference"), "tolerance");
        let image = ["ball.dph", "ball.obj", "--material", "m.toml", "--scene", "s.toml", "--max-error=-1"];
        bench.refuses("validate", &image.with("image"), "--max-error");
    }
    for (option, value, says) in [
        ("--extinction-scale", "nan", "extinction scale must lie"),
        ("--extinction-scale", "1,2", "one number or three"),
        ("--albedo", "1.5", "albedo must lie within 0..1"),
    ] {
        let image = ["ball.dph", "ball.obj", "--material", "m.toml", "--scene", "s.toml", option, value];
        bench.refuses("validate", &image.with("image"), says);
    }
    bench.refuses("validate", &["refrence"], "refrence");
    bench.refuses("validate", &[], "--help");
    bench.refuses(
        "validate",
        &["reference", "ball.obj", "--scene", "s.toml", "--output", "o.exr"],
        "--material",
    );
    bench.refuses("validate", &["compare", "a.exr", "b.exr", "--loudly"], "--loudly");
}

#[test]
fn outputs() {
    let bench = Workbench::new();
    std::fs::create_dir(bench.path("folder.exr")).unwrap();
    std::fs::create_dir(bench.path("folder.dph")).unwrap();
    bench.write("m.exr", MATERIAL);
    bench.write("s.exr", SCENE);
    bench.write("file", "in the way");
    let reference = |material: &str, scene: &str, output: &str, says: &str| {
        let arguments = ["ball.obj", "--material", material, "--scene", scene, "--output", output];
        bench.refuses("validate", &arguments.with("reference"), says);
    };
    reference("m.toml", "s.toml", "nowhere/o.exr", "nowhere/o.exr");
    reference("m.toml", "s.toml", "folder.exr", "is a folder");
    reference("m.toml", "s.toml", "o.png", ".exr");
    reference("m.exr", "s.toml", "m.exr", "both input and output");
    reference("m.toml", "s.exr", "./s.exr", "both input and output");
    for (output, says) in [
        ("nowhere/o.dph", "nowhere/o.dph"),
        ("folder.dph", "is a folder"),
        ("ball.obj", "both input and output"),
        ("./m.toml", "both input and output"),
    ] {
        bench.refuses("bake", &["ball.obj", "--material", "m.toml", "--output", output], says);
    }
    for (output, says) in
        [("nowhere/o.exr", "nowhere/o.exr"), ("o.gif", "o.gif"), ("s.exr", "both input and output")]
    {
        bench.refuses(
            "play",
            &["ball.dph", "--scene", "s.exr", "--output", output, "--backend", "cpu"],
            says,
        );
    }
    let image =
        ["ball.dph", "ball.obj", "--material", "m.toml", "--scene", "s.toml", "--output-dir", "file/o"];
    bench.refuses("validate", &image.with("image"), "file/o");
    bench.refuses("validate", &["demo", "--output-dir", "file/o"], "file/o");
}

#[test]
fn assets() {
    let bench = Workbench::new();
    let good = std::fs::read(bench.path("ball.dph")).unwrap();
    let mut future = good.clone();
    // The version is the number after the eight bytes of magic.
    future[8..12].copy_from_slice(&99u32.to_le_bytes());
    let mut damaged = good.clone();
    let middle = good.len() / 2;
    damaged[middle] ^= 1;
    bench.write("future.dph", future);
    bench.write("damaged.dph", damaged);
    bench.write("cut.dph", &good[..good.len() - 1]);
    bench.write("foreign.dph", "PK\u{3}\u{4} another kind of file");
    bench.write("empty.dph", "");
    for name in ["missing.dph", "future.dph", "damaged.dph", "cut.dph", "foreign.dph", "empty.dph"] {
        bench.refuses("play", &[name, "--scene", "s.toml", "--output", "o.exr", "--backend", "cpu"], name);
        bench.refuses("bake", &["inspect", name], name);
        let image = [name, "ball.obj", "--material", "m.toml", "--scene", "s.toml", "--output-dir", "o"];
        bench.refuses("validate", &image.with("image"), name);
    }
    bench.refuses("bake", &["inspect", "future.dph"], "version");
}

#[test]
fn pictures() {
    use diaphane_formats::picture::{Picture, write_exr};
    let bench = Workbench::new();
    write_exr(&bench.path("small.exr"), &Picture::new(4, 3)).unwrap();
    write_exr(&bench.path("large.exr"), &Picture::new(5, 3)).unwrap();
    bench.write("text.exr", "not a picture");
    for (arguments, says) in [
        (vec!["compare", "missing.exr", "small.exr"], "missing.exr"),
        (vec!["compare", "text.exr", "small.exr"], "text.exr"),
        (vec!["compare", "small.exr", "large.exr"], "differ in size"),
        (vec!["compare", "small.exr", "small.exr", "--coverage", "large.exr"], "large.exr"),
        (vec!["compare", "small.exr", "small.exr"], "nothing to compare"),
    ] {
        bench.refuses("validate", &arguments, says);
    }
}
