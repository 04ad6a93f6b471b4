//! Materials (`*.material.toml`).

use crate::medium::{Density, Grid, Layers, Medium, Noise, Shape, Shapes, Solid};
use crate::mesh::load_obj;
use crate::phase::Phase;
use crate::toml_keys::{Reader, parse, type_of, unknown_type};
use crate::visibility::Accel;
use crate::{Error, Result, files};
use std::path::Path;
use toml::{Table, Value};

/// Meshes that a material may name: each line of it may cost as much as the largest mesh.
const MOST_MESHES: usize = 64;

/// Reads a material file and the files that it names (relative to its own folder).
///
/// # Errors
/// Unreadable files, unknown keys (with the nearest known one), values out of range.
pub fn load(path: &Path) -> Result<Medium> {
    let text = files::read_text(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    parse_material(&text, folder).map_err(|e| e.in_file(path))
}

/// As [`load`], from text; `folder` is where relative file names start.
pub fn parse_material(text: &str, folder: &Path) -> Result<Medium> {
    let table = parse(text)?;
    let r = Reader::new(&table, "", &["extinction", "albedo", "phase", "ior", "density"])?;
    let phase = r.table("phase")?.map_or(Ok(Phase::Isotropic), parse_phase)?;
    let density = r.table("density")?.map_or(Ok(Density::Uniform(1.0)), |t| parse_density(t, folder))?;
    Medium::new(
        r.required_vector("extinction")?,
        r.required_vector("albedo")?,
        phase,
        r.number_or("ior", 1.0)?,
        density,
    )
}

fn parse_phase(table: &Table) -> Result<Phase> {
    match type_of(table, "phase")? {
        "isotropic" => Reader::new(table, "phase", &["type"]).map(|_| Phase::Isotropic),
        "henyey-greenstein" => {
            let r = Reader::new(table, "phase", &["type", "g"])?;
            Ok(Phase::HenyeyGreenstein { g: r.required_number("g")? })
        }
        other => Err(unknown_type("phase", other, &["isotropic", "henyey-greenstein"])),
    }
}

fn parse_density(table: &Table, folder: &Path) -> Result<Density> {
    const PLACE: &str = "density";
    match type_of(table, PLACE)? {
        "grid" => {
            let r = Reader::new(table, PLACE, &["type", "file", "min", "max"])?;
            let path = folder.join(r.required_text("file")?);
            Grid::load_npy(&path, r.required_vector("min")?, r.required_vector("max")?).map(Density::Grid)
        }
        "layers" => {
            let r = Reader::new(table, PLACE, &["type", "axis", "period", "densities"])?;
            let densities = r.numbers("densities")?.unwrap_or_default();
            let period = r.required_size("period")?;
            if densities.is_empty() || densities.len() > 64 || densities.iter().any(|d| *d < 0.0) {
                return Err(Error::invalid(
                    "'density.densities' must list 1 to 64 values that are not negative",
                ));
            }
            Ok(Density::Layers(Layers { axis: r.required_direction("axis")?, period, densities }))
        }
        "noise" => {
            let r = Reader::new(table, PLACE, &["type", "seed", "frequency", "octaves", "range"])?;
            let frequency = r.required_size("frequency")?;
            let range = r.numbers("range")?.unwrap_or(vec![0.0, 1.0]);
            let [low, high] = range[..] else {
                return Err(Error::invalid("'density.range' must be a list of two numbers"));
            };
            if low < 0.0 || high < low {
                return Err(Error::invalid("'density.range' must hold 0 <= low <= high"));
            }
            let seed = r.integer("seed", 0..=i64::MAX)?.unwrap_or(0) as u64;
            let octaves = r.integer("octaves", 1..=12)?.unwrap_or(1) as u32;
            Ok(Density::Noise(Noise { seed, frequency, octaves, range: [low, high] }))
        }
        "shapes" => {
            let r = Reader::new(table, PLACE, &["type", "base", "shapes"])?;
            let base = r.number_or("base", 1.0)?;
            if base < 0.0 {
                return Err(Error::invalid("'density.base' must not be negative"));
            }
            let tables = r.tables("shapes")?;
            let meshes = tables.iter().filter(|t| t.get("shape").and_then(Value::as_str) == Some("mesh"));
            if meshes.count() > MOST_MESHES {
                return Err(Error::invalid(format!(
                    "'density.shapes' names more than {MOST_MESHES} meshes; join them in one file"
                )));
            }
            let shapes = tables.into_iter().map(|t| parse_shape(t, folder)).collect::<Result<_>>()?;
            Ok(Density::Shapes(Shapes { base, shapes }))
        }
        other => Err(unknown_type(PLACE, other, &["grid", "layers", "noise", "shapes"])),
    }
}

fn parse_shape(table: &Table, folder: &Path) -> Result<Shape> {
    const PLACE: &str = "density.shapes";
    let kind = table.get("shape").and_then(|v| v.as_str()).unwrap_or_default();
    let mut known = vec!["shape", "density", "absorb"];
    known.extend_from_slice(match kind {
        "sphere" => &["center", "radius"],
        "box" => &["min", "max"],
        "torus" => &["center", "axis", "radius", "tube"],
        "mesh" => &["file"],
        other => {
            return Err(Error::invalid(format!(
                "'{PLACE}.shape' is '{other}'; use one of: sphere, box, torus, mesh"
            )));
        }
    });
    let r = Reader::new(table, PLACE, &known)?;
    let solid = match kind {
        "sphere" => {
            Solid::Sphere { center: r.required_vector("center")?, radius: r.required_size("radius")? }
        }
        "box" => {
            let (min, max) = (r.required_vector("min")?, r.required_vector("max")?);
            if !min.cmplt(max).all() {
                return Err(Error::invalid(format!("'{PLACE}': min must lie below max on every axis")));
            }
            Solid::Box { min, max }
        }
        "torus" => Solid::Torus {
            center: r.required_vector("center")?,
            axis: r.required_direction("axis")?,
            radius: r.required_size("radius")?,
            tube: r.required_size("tube")?,
        },
        _ => {
            let (mesh, _) = load_obj(&folder.join(r.required_text("file")?))?;
            let accel = Accel::new(&mesh);
            Solid::Mesh(Box::new((mesh, accel)))
        }
    };
    let density = r.required_number("density")?;
    if density < 0.0 {
        return Err(Error::invalid(format!("'{PLACE}.density' must not be negative")));
    }
    Ok(Shape { solid, density, absorb: r.flag_or("absorb", false)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        parse_material(text, Path::new(".")).unwrap_err().to_string()
    }

    #[test]
    fn mistakes_are_named() {
        let good = "extinction = [1, 2, 3.5]\nalbedo = [0.5, 0.5, 0.5]\n";
        assert!(parse_material(good, Path::new(".")).is_ok());
        assert!(message("extinctoin = [1,1,1]\nalbedo=[0,0,0]").contains("did you mean 'extinction'?"));
        assert!(message("albedo=[0,0,0]").contains("'extinction' is missing"));
        assert!(message("extinction=[1,-1,1]\nalbedo=[0,0,0]").contains("not negative"));
        assert!(message("extinction=[1,nan,1]\nalbedo=[0,0,0]").contains("finite"));
        assert!(message("extinction=[1,1,1]\nalbedo=[0,2,0]").contains("0..1"));
        assert!(message(&format!("{good}phase={{type='henyey-greenstein', g=1.0}}")).contains("g must lie"));
        assert!(message(&format!("{good}[density]\ntype='layer'")).contains("layers"));
        assert!(message(&format!("{good}[density]\ntype='noise'\nfrequncy=2")).contains("'frequency'"));
        assert!(message("a = [").contains("line 1"));
    }
}
