//! Which triangle lies across each edge of a mesh.

use std::collections::HashMap;

/// Neighbours across the edges 0-1, 1-2 and 2-0 of every triangle; the triangle itself where there is none. Where
/// more than two meet at an edge any of them is named.
pub(super) fn neighbours(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut owner = HashMap::with_capacity(3 * triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            owner.insert((t[k], t[(k + 1) % 3]), i as u32);
        }
    }
    let across =
        |i: usize, t: &[u32; 3], k: usize| *owner.get(&(t[(k + 1) % 3], t[k])).unwrap_or(&(i as u32));
    triangles.iter().enumerate().map(|(i, t)| [0, 1, 2].map(|k| across(i, t, k))).collect()
}

#[cfg(test)]
mod tests {
    use super::neighbours;

    #[test]
    fn tetrahedron_and_open_edge() {
        let triangles = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        assert_eq!(neighbours(&triangles), [[1, 2, 3], [3, 2, 0], [1, 3, 0], [2, 1, 0]]);
        assert_eq!(neighbours(&triangles[..2]), [[1, 0, 0], [1, 1, 0]]);
    }
}
