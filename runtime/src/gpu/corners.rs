//! The mesh as it is drawn: few vertices, each of which tells what triangle it begins.

/// Vertex `i` of the drawing begins triangle `i`, so that the rasteriser's flat interpolation, which takes a triangle's first
/// vertex, names triangles without a feature of the device and without three vertices for each of them.
#[derive(Debug, PartialEq)]
pub(super) struct Corners {
    /// The mesh's vertex that each of the drawing's stands for; those behind the last triangle begin none.
    pub vertices: Vec<u32>,
    /// Three of the drawing's vertices for every triangle, turned so that its own comes first.
    pub indices: Vec<u32>,
}

impl Corners {
    /// Of a mesh with so many vertices.
    pub fn new(triangles: &[[u32; 3]], vertex_count: usize) -> Self {
        const NONE: u32 = u32::MAX;
        // A vertex of the drawing for every vertex of the mesh: where it can be, one that begins a triangle.
        let mut copy = vec![NONE; vertex_count];
        let mut turned = Vec::with_capacity(triangles.len());
        for (i, t) in (0..).zip(triangles) {
            let first = (0..3).find(|&k| copy[t[k] as usize] == NONE).unwrap_or(0);
            let t = [t[first], t[(first + 1) % 3], t[(first + 2) % 3]];
            copy[t[0] as usize] = i;
            turned.push(t);
        }
        let mut vertices: Vec<u32> = turned.iter().map(|t| t[0]).collect();
        let mut indices = Vec::with_capacity(3 * turned.len());
        for (i, t) in (0..).zip(&turned) {
            // Copies made a moment ago are the ones that caches still hold.
            copy[t[0] as usize] = i;
            indices.push(i);
            for &v in &t[1..] {
                if copy[v as usize] == NONE {
                    copy[v as usize] = vertices.len() as u32;
                    vertices.push(v);
                }
                indices.push(copy[v as usize]);
            }
        }
        Self { vertices, indices }
    }
}

#[cfg(test)]
mod tests {
    use super::Corners;

    #[test]
    fn every_triangle_keeps_its_corners_and_turning_and_begins_with_its_own_vertex() {
        // A tetrahedron, an open fan whose hub begins one triangle at most, a triangle with a corner twice.
        let mut triangles = vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        triangles.extend((5..40).map(|k| [4, k, k + 1]));
        triangles.push([3, 3, 1]);
        let corners = Corners::new(&triangles, 41);
        assert_eq!(corners.indices.len(), 3 * triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            let drawn: [u32; 3] = std::array::from_fn(|k| corners.indices[3 * i + k]);
            assert_eq!(drawn[0], i as u32);
            let drawn = drawn.map(|c| corners.vertices[c as usize]);
            let turns = [[t[0], t[1], t[2]], [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
            assert!(turns.contains(&drawn), "{t:?} became {drawn:?}");
        }
        // As many as triangles, and the few that begin none.
        assert!(corners.vertices.len() <= triangles.len() + 2, "{}", corners.vertices.len());
    }

    #[test]
    fn nothing_is_nothing() {
        assert_eq!(Corners::new(&[], 0), Corners { vertices: vec![], indices: vec![] });
    }
}
