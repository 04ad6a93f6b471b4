//! What this build bakes and draws, in a few letters: measurements of a build that gives other results are not reused.
//!
//! A small block is baked and drawn; the bytes of asset and picture are hashed. Times are not part of it, except that
//! the number of threads is.

use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Silent;
use diaphane_bake::{Input, bake};
use diaphane_formats::asset;
use diaphane_formats::{material::parse_material, mesh::parse_obj, scene::parse_scene};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{Backend, LightMode, Player};
use std::path::Path;

const MATERIAL: &str =
    "extinction = [3, 4, 5]\nalbedo = [0.8, 0.7, 0.6]\nphase = { type = \"henyey-greenstein\", g = 0.2 }\n";

const SCENE: &str = "[camera]\nposition = [1.3, 1.6, 4.6]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 20\n\
                     [image]\nwidth = 24\nheight = 24\nsamples_per_pixel = 1\n[surface]\nreflection = false\n\
                     [[lights]]\ntype = \"point\"\nposition = [3, 1, -1]\nintensity = [30, 20, 10]\n";

/// The letters.
///
/// # Errors
/// The probe cannot be baked or drawn.
pub fn fingerprint() -> anyhow::Result<String> {
    let (mesh, mesh_report) =
        parse_obj(diaphane_assets::shapes::cuboid([0.5, 0.4, 0.3], 4).to_obj().as_bytes())?;
    let medium = parse_material(MATERIAL, Path::new("."))?;
    let scene = parse_scene(SCENE, Path::new("."))?;
    let input = Input {
        mesh: &mesh,
        mesh_report: &mesh_report,
        medium: &medium,
        mesh_name: String::new(),
        material_name: String::new(),
    };
    let params = Params { samples: 200, directions: 32, order: 4, ..Params::preset(Preset::Draft) };
    let (baked, _) = bake(&input, &params, &Silent)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&asset::encode(&baked)?);
    let mut player = Player::new(&baked, Backend::Cpu)?;
    let drawn = player.render(&Frame::new(&scene, &baked.info)?, LightMode::Baked)?;
    for value in drawn.picture.pixels.iter().flatten() {
        hasher.update(&value.to_le_bytes());
    }
    let hash = hasher.finalize().to_hex();
    Ok(format!("{}-{}-{}t", env!("CARGO_PKG_VERSION"), &hash[..12], rayon::current_num_threads()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_same_twice() {
        let a = super::fingerprint().unwrap();
        assert_eq!(a, super::fingerprint().unwrap());
        assert!(a.ends_with('t') && a.len() > 16, "{a}");
    }
}
