//! Small good files of every kind, from which the fuzzer starts.

use diaphane_assets::shapes::{icosphere, torus};
use diaphane_bake::{Input, bake, entries, params::Params, progress::Silent};
use diaphane_formats::asset::{Asset, Level, encode};
use diaphane_formats::material::parse_material;
use diaphane_formats::mesh::{Mending, parse_obj};
use exr::prelude::*;
use std::path::Path;
use validation::hostile;

/// Reader, name and bytes of each. A name that begins with `good` is one of a file that the reader accepts.
pub fn all() -> Vec<(&'static str, String, Vec<u8>)> {
    let mut out = Vec::new();
    let mut add = |reader, name: &str, bytes: Vec<u8>| out.push((reader, name.to_owned(), bytes));
    for (name, asset) in assets() {
        let bytes = encode(&asset).unwrap();
        add("asset-sections", &format!("good-{name}"), sections(&bytes));
        add("asset", &format!("good-{name}"), bytes);
    }
    for (name, text) in MATERIALS {
        add("material", &format!("good-{name}"), text.into());
    }
    for (name, text) in SCENES {
        add("scene", &format!("good-{name}"), text.into());
    }
    add("list", "good-two", LIST.into());
    add("mesh", "good-ball", icosphere(1.0, 0).to_obj().into());
    add("mesh", "good-ring", torus(0.5, 0.2, 5, 4).to_obj().into());
    for (name, text) in MESHES {
        add("mesh", name, text.into());
    }
    for version in 1..=2 {
        add("grid", &format!("good-floats-{version}"), npy(version, "<f4", "2, 1, 2", &floats(4)));
    }
    let doubles = [0.5f64, 2.0].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
    add("grid", "good-column", npy(1, "<f8", "1, 2, 1", &doubles));
    add("coverage", "good-bytes", npy(1, "|u1", "2, 3", &[0, 1, 127, 128, 254, 255]));
    add("coverage", "good-floats", npy(1, "<f4", "2, 2", &floats(4)));
    for (name, bytes) in pictures() {
        add("picture", &format!("good-{name}"), bytes);
    }
    for (name, bytes) in cache_entries() {
        add("cache-entry", &format!("good-{name}"), bytes);
    }
    out
}

const MATERIALS: [(&str, &str); 6] = [
    (
        "plain",
        "extinction = [6.0, 6, 6]\nalbedo = [0.8, 0.8, 0.8]\nphase = { type = \"henyey-greenstein\", g = 0.3 }\nior = 1.3\n",
    ),
    (
        "layers",
        "extinction=[5,5,7]\nalbedo=[0.9,0.8,0.6]\nphase={type=\"isotropic\"}\n[density]\ntype=\"layers\"\naxis=[0.3,1,0.1]\nperiod=0.25\ndensities=[1.0,0.2]\n",
    ),
    (
        "noise",
        "extinction=[5,5,7]\nalbedo=[0.9,0.8,0.6]\n[density]\ntype=\"noise\"\nseed=3\nfrequency=2.5\noctaves=4\nrange=[0.2,1.8]\n",
    ),
    (
        "solids",
        "extinction=[2,2,2]\nalbedo=[0,0,1]\n[density]\ntype=\"shapes\"\nbase=1.0\n[[density.shapes]]\nshape=\"torus\"\ncenter=[0,0,0]\naxis=[0.2,0.3,1]\nradius=0.3\ntube=0.1\ndensity=20.0\nabsorb=true\n[[density.shapes]]\nshape=\"box\"\nmin=[-1,-1,-1]\nmax=[0,0,0]\ndensity=0.5\n[[density.shapes]]\nshape=\"sphere\"\ncenter=[0.1,0,0]\nradius=0.3\ndensity=0\n",
    ),
    (
        "mesh",
        "extinction=[2,2,2]\nalbedo=[0,0,1]\n[density]\ntype=\"shapes\"\nshapes=[{shape=\"mesh\",file=\"m.obj\",density=2}]\n",
    ),
    (
        "grid",
        "extinction=[2,2,2]\nalbedo=[0,0,1]\n[density]\ntype=\"grid\"\nfile=\"g.npy\"\nmin=[-1,-1,-1]\nmax=[1,1,1]\n",
    ),
];

const SCENES: [(&str, &str); 2] = [
    (
        "lights",
        "[camera]\nposition=[0,1,4]\ntarget=[0,0,0]\nup=[0,1,0]\nvertical_fov_degrees=30\n[image]\nwidth=40\nheight=32\nsamples_per_pixel=4\n[surface]\nreflection=false\nspecular=0.5\nroughness=0.3\n[[lights]]\ntype=\"point\"\nposition=[3,1,1]\nintensity=[30,20,10]\n[[lights]]\ntype=\"directional\"\ndirection=[0,-1,0]\nirradiance=[1,1,1]\n[[lights]]\ntype=\"spot\"\nposition=[0,2,0]\ndirection=[0,-1,0]\nintensity=[1,1,1]\ninner_degrees=20\nouter_degrees=30\n",
    ),
    (
        "environment",
        "[camera]\nposition=[0,1,4]\ntarget=[0,0,0]\nvertical_fov_degrees=30\n[image]\nwidth=8\nheight=8\n[environment]\nfile=\"e.exr\"\nscale=2\n",
    ),
];

const LIST: &str = "[defaults]\npreset=\"draft\"\ncache=\"kept\"\n[[bake]]\nmesh=\"a b.obj\"\nmaterial=\"m.toml\"\noutput=\"a.dph\"\nsamples=20000\nno-certificate=true\nlight-error=0.02\n[[bake]]\nmesh=\"-b.obj\"\nmaterial=\"m.toml\"\noutput=\"b.dph\"\nreport=\"r.json\"\n";

const MESHES: [(&str, &str); 5] = [
    (
        "good-quads",
        "o box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt 0 0\nvn 0 0 1\nusemtl a\nf 4/1/1 3//1 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf -8 -4 -1 -5\n",
    ),
    (
        "good-hole",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv .3 .3 0\nf 1 3 5\nf 1 5 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    ),
    (
        "good-two",
        "g a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\ng b\nv .1 .1 .1\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 5 6 7\nf 5 8 6\nf 5 7 8\nf 6 8 7\n",
    ),
    (
        "good-strip",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nv 2 1 0\nf 1 2 3\nf 2 4 3\nf 1 2 5\nf 2 1 4\nl 1 2\np 1\n",
    ),
    ("bad-index", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4294967297\n"),
];

fn floats(count: usize) -> Vec<u8> {
    (0..count).flat_map(|i| (0.5 * i as f32).to_le_bytes()).collect()
}

fn npy(version: u8, kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}\n");
    let length = (header.len() as u32).to_le_bytes();
    let length = if version == 1 { &length[..2] } else { &length[..] };
    [b"\x93NUMPY", &[version, 0][..], length, header.as_bytes(), data].concat()
}

fn baked(material: &str, params: &Params) -> Asset {
    let medium = parse_material(material, Path::new(".")).unwrap();
    let (mesh, mesh_report) = parse_obj(icosphere(1.0, 0).to_obj().as_bytes()).unwrap();
    let input = Input {
        mesh: &mesh,
        mesh_report: &mesh_report,
        medium: &medium,
        mesh_name: "m.obj".to_owned(),
        material_name: "m.toml".to_owned(),
    };
    bake(&input, params, &Silent).unwrap().0
}

const THIN: &str = "extinction=[1,1,2]\nalbedo=[0.9,0.8,0.6]\n";

/// With and without each kind of section.
fn assets() -> Vec<(&'static str, Asset)> {
    let params = hostile::params();
    let plain = baked(THIN, &params);
    let mut nested = baked(&format!("{THIN}ior=1.3\n"), &params);
    nested.levels = [8, 5, 2]
        .map(|n| Level { width_factor: 2.0, weight: nested.samples.weight[..n].to_vec(), error: Some(0.1) })
        .to_vec();
    nested.info.provenance.mesh_report.mending = Mending::from_counts([1, 2, 3, 4, 5, 6]);
    let mut varying = plain.clone();
    varying.density = Some(diaphane_formats::asset::DensityGrid {
        size: [2, 1, 2],
        min: [-1.0; 3],
        max: [1.0; 3],
        values: [0.5, 1.0, 1.5, 2.0].map(|v| [f16::from_f32(v); 2]).to_vec(),
    });
    vec![("plain", plain), ("nested", nested), ("varying", varying)]
}

/// What [`hostile`]'s reader of sections reads.
fn sections(file: &[u8]) -> Vec<u8> {
    let number = |at: usize, width: usize| {
        let mut word = [0; 8];
        word[..width].copy_from_slice(&file[at..at + width]);
        u64::from_le_bytes(word) as usize
    };
    let mut out = Vec::new();
    for entry in (0..number(12, 4)).map(|i| 32 + 24 * i) {
        let (start, length) = (number(entry + 8, 8), number(entry + 16, 8));
        out.extend([file[entry], file[entry + 2]]);
        out.extend(u16::try_from(length).unwrap().to_le_bytes());
        out.extend(&file[start..start + length]);
    }
    out
}

/// One of each compression, as lines and as tiles.
fn pictures() -> Vec<(String, Vec<u8>)> {
    let compressions = [
        ("plain", Compression::Uncompressed),
        ("rle", Compression::RLE),
        ("zip1", Compression::ZIP1),
        ("zip16", Compression::ZIP16),
        ("piz", Compression::PIZ),
        ("pxr24", Compression::PXR24),
        ("b44", Compression::B44),
        ("b44a", Compression::B44A),
        ("dwaa", Compression::DWAA(None)),
    ];
    let mut out = Vec::new();
    for (name, compression) in compressions {
        let mut write = |kind: &str, blocks, halves: bool| {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let at = |p: Vec2<usize>| (0.25 * p.x() as f32, (p.y() % 3) as f32, 1.0, 1.0);
            let half = |p: Vec2<usize>| {
                let (r, g, b, a) = at(p);
                (f16::from_f32(r), f16::from_f32(g), f16::from_f32(b), f16::from_f32(a))
            };
            let mut bytes = std::io::Cursor::new(Vec::new());
            if halves {
                let image = Image::from_encoded_channels((9, 7), encoding, SpecificChannels::rgba(half));
                image.write().non_parallel().to_buffered(&mut bytes).unwrap();
            } else {
                let image = Image::from_encoded_channels((5, 6), encoding, SpecificChannels::rgba(at));
                image.write().non_parallel().to_buffered(&mut bytes).unwrap();
            }
            out.push((format!("{name}-{kind}"), bytes.into_inner()));
        };
        write("lines", Blocks::ScanLines, false);
        write("tiles", Blocks::Tiles(Vec2(4, 4)), true);
    }
    out
}

/// Those that a bake keeps.
fn cache_entries() -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let params = Params { cache: Some(folder.path().to_owned()), ..hostile::params() };
    let samples = u8::try_from(baked(THIN, &params).samples.len()).unwrap();
    let stage = |name: &str| entries::STAGES.iter().position(|s| *s == name).unwrap() as u8;
    let mut out = Vec::new();
    for (i, name) in entries::STAGES.iter().enumerate() {
        let start = format!("{}-", name.replace(' ', "-"));
        for entry in std::fs::read_dir(folder.path()).unwrap() {
            let path = entry.unwrap().path();
            if path.file_name().unwrap().to_string_lossy().starts_with(&start) {
                let whole = std::fs::read(path).unwrap();
                // Grids are too large for seeds.
                if whole.len() < 10_000 {
                    out.push((name.replace(' ', "-"), [&[i as u8, samples], &whole[48..]].concat()));
                    if i == 0 {
                        out.push(("whole".to_owned(), [&[128 + i as u8, samples], &whole[..]].concat()));
                    }
                }
            }
        }
    }
    // A distance grid of 2 x 3 x 4 nodes.
    let mut grid = vec![stage("distance field"), samples];
    [2u64, 3, 4].iter().for_each(|n| grid.extend(n.to_le_bytes()));
    [-1.0f64, -1.0, -1.0, 0.5].iter().for_each(|v| grid.extend(v.to_le_bytes()));
    grid.extend(24u64.to_le_bytes());
    grid.extend(floats(24));
    grid.extend(5u64.to_le_bytes());
    out.push(("distance-field".to_owned(), grid));
    out
}
