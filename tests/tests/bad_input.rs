//! Meshes, materials and scenes that make no sense: exit code 2, one clear line on standard error, nothing written.

#[path = "support/workbench.rs"]
mod workbench;

use workbench::{MATERIAL, SCENE, With, Workbench};

/// Both programs that read a mesh.
fn refuses_mesh(bench: &Workbench, mesh: &str, says: &str) {
    let bake = [mesh, "--material", "m.toml", "--output", "o.dph", "--preset", "draft", "--samples", "200"];
    bench.refuses("bake", &bake, says);
    bench.refuses(
        "validate",
        &[mesh, "--material", "m.toml", "--scene", "s.toml", "--output", "o.exr"].with("reference"),
        says,
    );
}

/// Both programs that read a material.
fn refuses_material(bench: &Workbench, material: &str, says: &str) {
    let bake =
        ["ball.obj", "--material", material, "--output", "o.dph", "--preset", "draft", "--samples", "200"];
    bench.refuses("bake", &bake, says);
    let reference = ["ball.obj", "--material", material, "--scene", "s.toml", "--output", "o.exr"];
    bench.refuses("validate", &reference.with("reference"), says);
}

#[test]
fn meshes() {
    let bench = Workbench::new();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let files: [(&str, String); 8] = [
        ("noise.obj", "\u{1}\u{2}not a mesh at all\nf f f\n".to_owned()),
        ("empty.obj", String::new()),
        ("points.obj", triangle.to_owned()),
        ("lines.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 1 1 2\nf 2 2 2\n".to_owned()),
        ("nan.obj", format!("v nan 0 0\n{triangle}f 1 2 3\nf 2 3 4\n")),
        ("infinite.obj", format!("v inf 0 0\n{triangle}f 1 2 3\nf 2 3 4\n")),
        ("range.obj", format!("{triangle}f 1 2 9\n")),
        ("sheet.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n".to_owned()),
    ];
    refuses_mesh(&bench, "missing.obj", "missing.obj");
    std::fs::create_dir(bench.path("folder.obj")).unwrap();
    refuses_mesh(&bench, "folder.obj", "folder.obj");
    for (name, text) in files {
        bench.write(name, text);
        refuses_mesh(&bench, name, name);
    }
}

#[test]
fn materials() {
    let bench = Workbench::new();
    let with = |more: &str| format!("{MATERIAL}{more}");
    let grid = |file: &str, min: &str| {
        with(&format!("[density]\ntype = \"grid\"\nfile = \"{file}\"\nmin = {min}\nmax = [1, 1, 1]\n"))
    };
    // The .npy format: magic, version 1.0, length of the header, header padded with spaces to a newline.
    let npy = |kind: &str, shape: &str, data: usize| {
        let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        while (10 + head.len() + 1) % 64 != 0 {
            head.push(' ');
        }
        head.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((head.len() as u16).to_le_bytes());
        bytes.extend(head.as_bytes());
        bytes.resize(bytes.len() + data, 0);
        bytes
    };
    bench.write("good.npy", npy("<f4", "2, 2, 2", 32));
    bench.write("flat.npy", npy("<f4", "2, 4", 32));
    bench.write("whole.npy", npy("<i4", "2, 2, 2", 32));
    bench.write("short.npy", npy("<f4", "2, 2, 2", 31));
    bench.write("huge.npy", npy("<f8", "1000000, 1000000, 1000000", 32));
    bench.write("grid.txt", npy("<f4", "2, 2, 2", 32));
    bench.write("text.npy", "not numbers");
    let low = "[-1, -1, -1]";
    let cases: [(String, &str); 21] = [
        (with("colour = 3\n"), "colour"),
        (MATERIAL.replace("extinction", "extinctoin"), "did you mean 'extinction'"),
        (MATERIAL.replace("extinction = [3, 2, 1]\n", ""), "extinction"),
        (MATERIAL.replace("[3, 2, 1]", "[3, -2, 1]"), "extinction"),
        (MATERIAL.replace("[3, 2, 1]", "[3, nan, 1]"), "extinction"),
        (MATERIAL.replace("[3, 2, 1]", "[3, 1]"), "extinction"),
        (MATERIAL.replace("0.7", "1.7"), "albedo"),
        (MATERIAL.replace("0.7", "-0.7"), "albedo"),
        (MATERIAL.replace("\"isotropic\"", "\"henyey-greenstein\", g = 1.0"), "g must"),
        (MATERIAL.replace("\"isotropic\"", "\"henyey-greenstein\", g = -1.5"), "g must"),
        (MATERIAL.replace("\"isotropic\"", "\"rayleigh\""), "rayleigh"),
        (with("ior = 0.5\n"), "ior"),
        (grid("missing.npy", low), "missing.npy"),
        (grid("flat.npy", low), "flat.npy"),
        (grid("whole.npy", low), "whole.npy"),
        (grid("short.npy", low), "short.npy"),
        (grid("huge.npy", low), "huge.npy"),
        (grid("grid.txt", low), "grid.txt"),
        (grid("text.npy", low), "text.npy"),
        (grid("good.npy", "[2, -1, -1]"), "bounds"),
        ("extinction = [".to_owned(), "line 1"),
    ];
    refuses_material(&bench, "missing.toml", "missing.toml");
    for (text, says) in cases {
        bench.write("bad.toml", text);
        refuses_material(&bench, "bad.toml", says);
    }
}

#[test]
fn scenes() {
    let bench = Workbench::new();
    let cases = [
        (SCENE.replace("width = 40", "widht = 40"), "did you mean 'width'"),
        (SCENE.replace("width = 40", "width = 0"), "image.width"),
        (SCENE.replace("height = 32", "height = -3"), "image.height"),
        (SCENE.replace("[1.3, 1.6, 4.6]", "[0, 0, 0]"), "same point"),
        (SCENE.replace("fov_degrees = 30", "fov_degrees = 180"), "fov"),
        (SCENE.replace("\"point\"", "\"laser\""), "laser"),
        (SCENE.replace("[30, 20, 10]", "[30, -20, 10]"), "intensity"),
        (format!("{SCENE}[environment]\nfile = \"missing.exr\"\n"), "missing.exr"),
    ];
    let each = |scene: &str, says: &str| {
        let reference = ["ball.obj", "--material", "m.toml", "--scene", scene, "--output", "o.exr"];
        bench.refuses("validate", &reference.with("reference"), says);
        let image = ["ball.dph", "ball.obj", "--material", "m.toml", "--scene", scene, "--output-dir", "o"];
        bench.refuses("validate", &image.with("image"), says);
        let play = ["ball.dph", "--scene", scene, "--output", "o.exr", "--backend", "cpu"];
        bench.refuses("play", &play, says);
    };
    each("missing.toml", "missing.toml");
    for (text, says) in cases {
        bench.write("bad.toml", text);
        each("bad.toml", says);
    }
}
