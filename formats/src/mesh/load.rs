//! OBJ files through tobj.

use super::{Mesh, MeshReport};
use crate::{Error, Result, files};
use glam::DVec3;
use std::path::Path;

/// Reads, merges, triangulates and repairs an OBJ file.
///
/// # Errors
/// Unreadable file, not an OBJ, no faces, non-finite vertices, indices out of range, no enclosed volume.
pub fn load_obj(path: &Path) -> Result<(Mesh, MeshReport)> {
    let bytes = files::read(path, files::Kind::Mesh)?;
    parse_obj(&bytes).map_err(|e| e.in_file(path))
}

/// As [`load_obj`], from the file's bytes.
pub fn parse_obj(bytes: &[u8]) -> Result<(Mesh, MeshReport)> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Materials are not opened: a mesh file must not make the program read others.
    let (models, _) = tobj::load_obj_buf(&mut &bytes[..], &options, |_| Ok(Default::default()))
        .map_err(|e| Error::invalid(format!("is not a usable OBJ file ({e})")))?;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let mut objects = 0;
    let mut ignored_attributes = false;
    for model in &models {
        let mesh = &model.mesh;
        if mesh.indices.is_empty() {
            continue;
        }
        objects += 1;
        ignored_attributes |=
            !mesh.texcoords.is_empty() || !mesh.normals.is_empty() || mesh.material_id.is_some();
        let base =
            u32::try_from(positions.len()).map_err(|_| Error::invalid("has more than 2^32 vertices"))?;
        positions.extend(
            mesh.positions.chunks_exact(3).map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())),
        );
        for t in mesh.indices.chunks_exact(3) {
            triangles.push([t[0], t[1], t[2]].map(|i| i.saturating_add(base)));
        }
    }
    if triangles.is_empty() {
        return Err(Error::invalid("holds no faces; a closed triangle mesh in OBJ format is needed"));
    }
    let (mesh, mut report) = Mesh::from_triangles(positions, triangles)?;
    report.objects = objects;
    report.ignored_attributes = ignored_attributes;
    Ok((mesh, report))
}
