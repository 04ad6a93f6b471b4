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
    let (geometry, ignored_attributes) = geometry(bytes);
    let (models, _) = tobj::load_obj_buf(&mut &geometry[..], &options, |_| Ok(Default::default()))
        .map_err(|e| Error::invalid(format!("is not a usable OBJ file ({e})")))?;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let mut objects = 0;
    for model in &models {
        let mesh = &model.mesh;
        if mesh.indices.is_empty() {
            continue;
        }
        objects += 1;
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

/// The lines of an OBJ file that say where vertices and faces are, without anything else that they hold, and whether there
/// were normals or texture coordinates. What is not used cannot be wrong, and no other file is named.
fn geometry(bytes: &[u8]) -> (Vec<u8>, bool) {
    let mut out = Vec::new();
    let mut attributes = false;
    for line in bytes.split(|b| *b == b'\n') {
        let mut words = line.split(|b| b.is_ascii_whitespace()).filter(|word| !word.is_empty());
        let Some(first) = words.next() else { continue };
        match first {
            b"v" => append(&mut out, first, words.take(3)),
            b"f" => {
                append(&mut out, first, words.map(|word| word.split(|b| *b == b'/').next().unwrap_or(word)))
            }
            b"o" | b"g" => append(&mut out, first, [&b"-"[..]].into_iter()),
            b"vt" | b"vn" => attributes = true,
            _ => {}
        }
    }
    (out, attributes)
}

fn append<'a>(out: &mut Vec<u8>, first: &[u8], words: impl Iterator<Item = &'a [u8]>) {
    out.extend(first);
    for word in words {
        out.push(b' ');
        out.extend(word);
    }
    out.push(b'\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    #[test]
    fn what_is_not_used_is_not_read() {
        let (plain, report) = parse_obj(TETRAHEDRON.as_bytes()).unwrap();
        assert!(!report.ignored_attributes);
        // Normals that no number names, a material library, colours, a comment that is not UTF-8.
        let odd = TETRAHEDRON
            .replace("f 1 3 2", "vn 0 0 1\nmtllib /dev/zero\nusemtl a\nf 1/9/-6148914691236517205 3//99999999999999999999 2/x")
            .replace("v 0 0 1", "v 0 0 1 red 2 3");
        let (mesh, report) = parse_obj(&[b"# \xff\xfe\n", odd.as_bytes()].concat()).unwrap();
        assert_eq!(mesh, plain);
        assert!(report.ignored_attributes);
    }

    #[test]
    fn indices_out_of_range_are_refused() {
        for index in ["0", "5", "-5", "4294967297", "9223372036854775807", "-9223372036854775808", "1e3"] {
            let text = TETRAHEDRON.replace("f 1 3 2", &format!("f 1 3 {index}"));
            assert!(parse_obj(text.as_bytes()).is_err(), "{index}");
        }
    }
}
