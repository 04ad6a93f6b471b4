//! Meshes of a megabyte or so that are as much work as such a file can be.

use std::fmt::Write;

/// Name and text of each, with about `count` faces.
pub fn meshes(count: usize) -> Vec<(&'static str, String)> {
    let unit =
        |i: usize, k: u64| diaphane_formats::directions::hash(i as u64, k) as f64 / 2f64.powi(64) - 0.5;
    let mut out = Vec::new();
    let mut add = |name, text: String| out.push((name, text));
    let tetrahedron = |text: &mut String, at: [f64; 3], size: f64, i: usize| {
        let [x, y, z] = at;
        for [a, b, c] in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let [a, b, c] = [a, b, c].map(|v: f64| (v - 0.25) * size);
            writeln!(text, "v {} {} {}", x + a, y + b, z + c).unwrap();
        }
        for [a, b, c] in [[1, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4]] {
            writeln!(text, "f {} {} {}", 4 * i + a, 4 * i + b, 4 * i + c).unwrap();
        }
    };

    add("one face, repeated", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(count)));
    let mut text = "v 0 0 0\nv 0 0 1\n".to_owned();
    for i in 0..count {
        writeln!(text, "v {} {} 0.5\nf 1 2 {}", (i as f64).cos(), (i as f64).sin(), i + 3).unwrap();
    }
    add("all on one edge", text);
    let mut text = String::new();
    for i in 0..count {
        writeln!(text, "v {} {} {}", unit(i, 1), unit(i, 2), unit(i, 3)).unwrap();
    }
    let corners: String = (1..=count).map(|i| format!(" {i}")).collect();
    add("one polygon", format!("{text}f{corners}\n"));
    let mut soup = text[..text.len() * 100 / count.max(100)].to_owned();
    soup.truncate(soup.rfind('\n').map_or(0, |end| end + 1));
    let vertices = soup.lines().count();
    for i in 0..count {
        let v = [1, 2, 3].map(|k| 1 + (diaphane_formats::directions::hash(i as u64, k) as usize) % vertices);
        writeln!(soup, "f {} {} {}", v[0], v[1], v[2]).unwrap();
    }
    add("soup of few vertices", soup);
    let mut text = String::new();
    for i in 0..count / 4 {
        tetrahedron(&mut text, [0.0; 3], 1.0 + i as f64, i);
    }
    add("nested", text);
    let mut text = String::new();
    for i in 0..count / 4 {
        tetrahedron(&mut text, [1, 2, 3].map(|k| 0.1 * unit(i, k)), 1.0, i);
    }
    add("all through each other", text);
    let mut text = String::new();
    for i in 0..count / 4 {
        tetrahedron(&mut text, [1, 2, 3].map(|k| 100.0 * unit(i, k)), 1e-3, i);
    }
    add("dust", text);
    let mut text = String::new();
    for i in 0..count {
        let d = [1, 2, 3].map(|k| unit(i, k));
        writeln!(
            text,
            "v {0} {1} {2}\nv -{0} -{1} -{2}\nv {0} {1} 0.1\nf {3} {4} {5}",
            d[0].abs(),
            d[1].abs(),
            d[2].abs(),
            3 * i + 1,
            3 * i + 2,
            3 * i + 3
        )
        .unwrap();
    }
    add("slivers through the middle", text);
    let mut text = String::new();
    for i in 0..count {
        let (x, far) = (i as f64 / count as f64, 1.0 + unit(i, 1));
        writeln!(
            text,
            "v {x} 0 0\nv {} 0 0\nv {x} {far} 1\nf {} {} {}",
            x + 0.5,
            3 * i + 1,
            3 * i + 2,
            3 * i + 3
        )
        .unwrap();
    }
    add("open edges on one line", text);
    let mut text = String::new();
    for i in 0..count {
        let d = [1, 2, 3].map(|k| 1e-6 * unit(i, k));
        writeln!(
            text,
            "v {} {} {}\nv {} 1 {}\nv 1 {} {}\nf {} {} {}",
            d[0],
            d[1],
            d[2],
            d[1],
            d[0],
            d[2],
            d[0],
            3 * i + 1,
            3 * i + 2,
            3 * i + 3
        )
        .unwrap();
    }
    add("nearly one face", text);
    let mut text = String::new();
    for i in 0..=count / 2 {
        let a = i as f64;
        writeln!(text, "v {} {} 0\nv {} {} 1", a.cos(), a.sin(), a.cos(), a.sin()).unwrap();
    }
    for i in 0..count / 2 {
        writeln!(
            text,
            "f {} {} {}\nf {} {} {}",
            2 * i + 1,
            2 * i + 3,
            2 * i + 2,
            2 * i + 3,
            2 * i + 4,
            2 * i + 2
        )
        .unwrap();
    }
    add("a ribbon around and around", text);
    out
}
