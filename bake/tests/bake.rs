//! Contracts of the bake: determinism, counts, bad parameters, cancellation, and what the samples say.

use diaphane_assets::shapes::icosphere;
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::{Progress, Silent};
use diaphane_bake::{Error, Input, bake};
use diaphane_formats::asset::{Asset, encode};
use diaphane_formats::medium::{Density, Layers, Medium, Shape, Shapes, Solid};
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::phase::Phase;
use diaphane_formats::sh;
use glam::DVec3;

fn ball() -> (Mesh, MeshReport) {
    let raw = icosphere(1.0, 4);
    Mesh::from_triangles(raw.positions, raw.triangles).unwrap()
}

fn medium(kappa: f64, ior: f64, density: Density) -> Medium {
    Medium::new(DVec3::splat(kappa), DVec3::splat(0.8), Phase::Isotropic, ior, density).unwrap()
}

fn small() -> Params {
    let draft = Params::preset(Preset::Draft);
    Params {
        samples: 1200,
        directions: 64,
        points_per_sample: 4,
        order: 4,
        extra_bands: 0,
        certificate: false,
        ..draft
    }
}

fn run(mesh: &(Mesh, MeshReport), medium: &Medium, params: &Params) -> diaphane_bake::Result<Asset> {
    let input = Input {
        mesh: &mesh.0,
        mesh_report: &mesh.1,
        medium,
        mesh_name: "mesh.obj".to_owned(),
        material_name: "m.toml".to_owned(),
    };
    bake(&input, params, &Silent).map(|(asset, _)| asset)
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let mesh = ball();
    let layers = Layers { axis: DVec3::Y, period: 0.25, densities: vec![1.0, 0.3] };
    let medium = medium(5.0, 1.2, Density::Layers(layers));
    let bytes: Vec<Vec<u8>> = [1, 2, 7]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let params = Params { certificate: true, ..small() };
            encode(&pool.install(|| run(&mesh, &medium, &params)).unwrap()).unwrap()
        })
        .collect();
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn another_seed_is_another_asset() {
    let mesh = ball();
    let medium = medium(5.0, 1.0, Density::Uniform(1.0));
    let a = run(&mesh, &medium, &small()).unwrap();
    let b = run(&mesh, &medium, &Params { seed: 2, ..small() }).unwrap();
    assert_ne!(a.samples, b.samples);
}

#[test]
fn the_count_is_met_within_five_percent() {
    let mesh = ball();
    for (samples, kappa) in [(150, 2.0), (1000, 0.5), (4000, 6.0), (4000, 40.0)] {
        let asset =
            run(&mesh, &medium(kappa, 1.0, Density::Uniform(1.0)), &Params { samples, ..small() }).unwrap();
        let error = asset.samples.len() as f64 / samples as f64 - 1.0;
        assert!(error.abs() <= 0.05, "{samples} wanted at extinction {kappa}, got {}", asset.samples.len());
    }
}

#[test]
fn samples_lie_inside_apart_and_reach_the_boundary() {
    let mesh = ball();
    let asset = run(&mesh, &medium(4.0, 1.0, Density::Uniform(1.0)), &small()).unwrap();
    let s = &asset.samples;
    let radii: Vec<f32> = s.position_radius.iter().map(|p| p[3]).collect();
    let (least, largest) = radii.iter().fold((f32::INFINITY, 0.0f32), |(a, b), r| (a.min(*r), b.max(*r)));
    // Between half and twice a mean radius.
    assert!(largest / least <= 4.0 + 1e-3, "{least} {largest}");
    let on_boundary = (0..s.len()).filter(|&i| s.position(i).length() > 0.98).count();
    assert!(on_boundary > s.len() / 10, "{on_boundary} of {}", s.len());
    for i in 0..s.len() {
        assert!(s.position(i).length() < 1.0);
        for j in 0..i {
            // Moving onto the boundary shifts a sample by at most 0.3 radii, so 0.4 radii always remain between two.
            let apart = 0.5 * (radii[i] + radii[j]);
            assert!(s.position(i).distance(s.position(j)) > 0.39 * apart, "{i} {j}");
        }
    }
}

#[test]
fn harmonics_reproduce_the_chords_of_a_ball() {
    let kappa = 4.0;
    let params = Params { order: 6, directions: 256, points_per_sample: 1, ..small() };
    let asset = run(&ball(), &medium(kappa, 1.0, Density::Uniform(1.0)), &params).unwrap();
    let mut basis = vec![0.0f32; 36];
    let depth = asset.samples.depth.decoded();
    let (mut error, mut all) = (0.0f64, 0.0f64);
    for i in 0..asset.samples.len() {
        let p = asset.samples.position(i).as_dvec3();
        for direction in diaphane_formats::directions::even_directions(50, 99) {
            let b = p.dot(direction);
            let chord = -b + (b * b + 1.0 - p.length_squared()).sqrt();
            sh::evaluate_f32(6, direction.as_vec3().to_array(), &mut basis);
            let lobe = asset.samples.lobe[i].dot(direction.as_vec3()).max(0.0);
            let value = lobe + depth.of(i).iter().zip(&basis).map(|(c, y)| c * y).sum::<f32>();
            let psi = (-f64::from(asset.info.encoding.decode(value))).exp();
            let exact = (-kappa * chord).exp();
            error += (psi - exact).powi(2);
            all += exact * exact;
        }
    }
    // Directions that the fit never saw. A point on the boundary sees a step at its horizon that six bands cannot
    // follow: a fifth of the mean square is what remains of it.
    assert!((error / all).sqrt() < 0.2, "{}", (error / all).sqrt());
}

#[test]
fn weights_sum_to_one_inside() {
    let asset = run(&ball(), &medium(2.0, 1.0, Density::Uniform(1.0)), &small()).unwrap();
    let cloud = diaphane_formats::reconstruct::Cloud::new(&asset.samples, asset.info.width_factor);
    let mut errors = 0.0f64;
    let points = diaphane_formats::directions::even_directions(400, 3);
    for (k, direction) in points.iter().enumerate() {
        let p = (*direction * (0.85 * (k as f64 / 400.0).cbrt())).as_vec3();
        let mut sum = 0.0f32;
        cloud.for_each_near_point(p, |i| {
            let d2 = (cloud.centre[i] - p).length_squared();
            sum += cloud.weight[i] * diaphane_formats::kernel::value(cloud.sharpness[i], d2);
        });
        errors += f64::from(sum - 1.0).powi(2);
    }
    let rms = (errors / 400.0).sqrt();
    assert!(rms < 0.2, "{rms}");
}

#[test]
fn nothing_is_placed_where_nothing_scatters() {
    let core =
        Shape { solid: Solid::Sphere { center: DVec3::ZERO, radius: 0.5 }, density: 5.0, absorb: true };
    let medium = medium(2.0, 1.0, Density::Shapes(Shapes { base: 1.0, shapes: vec![core] }));
    let asset = run(&ball(), &medium, &small()).unwrap();
    let inside = (0..asset.samples.len()).filter(|&i| asset.samples.position(i).length() < 0.5).count();
    assert_eq!(inside, 0);
    let grid = asset.density.unwrap();
    assert_eq!(grid.value(glam::Vec3::ZERO), [5.0, 0.0]);
}

#[test]
fn bad_parameters_are_refused() {
    let mesh = ball();
    let medium = medium(2.0, 1.0, Density::Uniform(1.0));
    for params in [
        Params { samples: 0, ..small() },
        Params { directions: 0, ..small() },
        Params { order: 0, ..small() },
        Params { order: 15, ..small() },
    ] {
        assert!(matches!(run(&mesh, &medium, &params), Err(Error::Parameter(_))), "{params:?}");
    }
}

#[test]
fn extremes_bake_or_say_why() {
    let mesh = ball();
    for kappa in [0.0, 1e-6, 300.0, 1e5] {
        let medium = medium(kappa, 1.0, Density::Uniform(1.0));
        for samples in [1, 2, 300] {
            match run(&mesh, &medium, &Params { samples, ..small() }) {
                Ok(asset) => assert!(!asset.samples.is_empty()),
                Err(error) => assert!(matches!(error, Error::NoRoom(_)), "{kappa} {samples}: {error}"),
            }
        }
    }
}

/// Thinner than a cell of the distance grid, no node of which lies inside: needles and sheets bake none the less.
#[test]
fn thin_objects_bake() {
    for stretch in [DVec3::new(1.0, 0.005, 0.005), DVec3::new(1.0, 1.0, 0.003)] {
        let mut raw = icosphere(1.0, 2);
        raw.positions.iter_mut().for_each(|p| *p *= stretch);
        let mesh = Mesh::from_triangles(raw.positions, raw.triangles).unwrap();
        let params = Params { samples: 300, certificate: true, ..small() };
        let asset = run(&mesh, &medium(8.0, 1.0, Density::Uniform(1.0)), &params).unwrap();
        assert!((200..400).contains(&asset.samples.len()), "{stretch}: {}", asset.samples.len());
        let certificate = asset.info.certificate.unwrap();
        assert!(format!("{certificate:?}").find("NaN").is_none(), "{stretch}: {certificate:?}");
    }
}

struct StopAtOnce;

impl Progress for StopAtOnce {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn cancelling_is_an_error_of_its_own() {
    let (mesh, report) = ball();
    let medium = medium(2.0, 1.0, Density::Uniform(1.0));
    let input = Input {
        mesh: &mesh,
        mesh_report: &report,
        medium: &medium,
        mesh_name: String::new(),
        material_name: String::new(),
    };
    assert!(matches!(bake(&input, &small(), &StopAtOnce), Err(Error::Cancelled)));
}
