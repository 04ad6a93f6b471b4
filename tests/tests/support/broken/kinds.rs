//! The kinds of damage, what is counted of each, and what should come out.

use super::*;
use diaphane_formats::mesh::MeshReport;

/// One broken mesh.
pub struct Kind {
    pub name: &'static str,
    pub mesh: Triangles,
    /// The defect's count in the report, which must not be 0.
    pub count: fn(&MeshReport) -> usize,
    /// The shape that is meant, or words of the refusal where none is.
    pub intended: Result<Intended, &'static str>,
}

fn kind(
    name: &'static str,
    intended: Intended,
    count: fn(&MeshReport) -> usize,
    mesh: impl FnOnce(Triangles) -> Triangles,
) -> Kind {
    Kind { name, mesh: mesh(intended.shape()), count, intended: Ok(intended) }
}

fn refused(name: &'static str, says: &'static str, mesh: Triangles) -> Kind {
    Kind { name, mesh, count: |_| 0, intended: Err(says) }
}

/// All kinds, by groups.
pub fn all() -> Vec<Kind> {
    [holes(), windings(), copies(), flat_faces(), non_manifold(), crossings(), shells(), sheets()]
        .into_iter()
        .flatten()
        .collect()
}

fn holes() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.holes;
    vec![
        kind("one face missing", Ball, count, |mut t| {
            t.triangles.remove(7);
            t
        }),
        kind("all faces around a vertex missing", Ball, count, |t| without_star(t, 100)),
        kind("one face in fifty missing", Ball, count, |t| pierced(t, 0.02)),
        kind("one face in fifty of a torus missing", Torus, count, |t| pierced(t, 0.02)),
        kind("box without lid", Box, count, |t| without(t, |p| p.y > 0.62)),
        kind("box without lid and bottom", Box, count, |t| without(t, |p| p.y.abs() > 0.62)),
        kind("a corner missing", Box, count, |t| without(t, |p| p.dot(DVec3::ONE) > 1.6)),
        kind("half of a face missing", Box, count, |t| without(t, |p| p.y > 0.62 && p.x > 0.0)),
        kind("holes in both shells", Hollow, count, |t| pierced(t, 0.01)),
        kind("a tenth of the faces missing", Ball, count, |t| pierced(t, 0.1)),
        kind("a fifth of the faces missing", Ball, count, |t| pierced(t, 0.2)),
        kind("a third of the faces missing", Ball, count, |t| pierced(t, 1.0 / 3.0)),
        kind("half of the faces missing", Ball, count, |t| pierced(t, 0.5)),
        kind("a fifth of the faces of a torus missing", Torus, count, |t| pierced(t, 0.2)),
        kind("half of the faces of a torus missing", Torus, count, |t| pierced(t, 0.5)),
        kind("a third of the faces of a box missing", Box, count, |t| pierced(t, 1.0 / 3.0)),
        kind("a third of the faces of three bars missing", Jack, count, |t| pierced(t, 1.0 / 3.0)),
        kind("a fifth of the faces of both shells missing", Hollow, count, |t| pierced(t, 0.2)),
        kind("one triangle of every square missing", Torus, count, |mut t| {
            t.triangles = t.triangles.into_iter().step_by(2).collect();
            t
        }),
    ]
}

fn windings() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.flipped;
    vec![
        kind("one face flipped", Ball, count, |mut t| {
            t.triangles[7].swap(1, 2);
            t
        }),
        kind("a third of the faces flipped", Torus, count, |t| turned(t, 0.33)),
        kind("two thirds of the faces flipped", Torus, count, |t| turned(t, 0.67)),
        kind("a third flipped, holes", Ball, count, |t| pierced(turned(t, 0.33), 0.02)),
        kind("a third flipped, a fifth missing", Ball, count, |t| pierced(turned(t, 0.33), 0.2)),
        kind("a third flipped, a third missing", Jack, count, |t| pierced(turned(t, 0.33), 1.0 / 3.0)),
        kind("inside out, a third missing", Box, count, |t| pierced(reversed(t), 1.0 / 3.0)),
        kind("inside out", Ball, count, reversed),
        kind("inside out, holes", Torus, count, |t| pierced(reversed(t), 0.02)),
        kind("inside out without lid", Box, count, |t| without(reversed(t), |p| p.y > 0.62)),
        kind("inside out with a cavity", Hollow, count, reversed),
        kind("inside out with an island", Island, count, reversed),
        kind("one of two pieces inside out", Pair, count, |_| {
            let [a, b] = pair(0.55, 0.45);
            joined(&[a, reversed(b)])
        }),
        kind("every other of 27 pieces inside out", Lattice, count, |_| {
            let parts = lattice().into_iter().enumerate();
            joined(&parts.map(|(i, t)| if i % 2 == 0 { t } else { reversed(t) }).collect::<Vec<_>>())
        }),
    ]
}

fn copies() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.duplicate;
    vec![
        kind("every face twice", Ball, count, |t| repeated(t, 1.0, false)),
        kind("every face from both sides", Ball, count, |t| repeated(t, 1.0, true)),
        kind("some faces thrice", Torus, count, |t| repeated(repeated(t, 0.3, false), 0.3, true)),
        kind("the whole object twice", Box, count, |t| joined(&[t.clone(), t])),
        kind("the whole object twice, once inside out", Box, count, |t| joined(&[t.clone(), reversed(t)])),
        kind(
            "the whole object twice, other faces",
            Box,
            |r| r.mending.nested,
            |t| joined(&[t, cuboid([0.75, 0.625, 0.5], 5)]),
        ),
        kind("no common vertices", Ball, |r| r.welded, |t| soup(&t, 0.0)),
        kind("no common vertices, faces flipped", Torus, |r| r.welded, |t| soup(&turned(t, 0.3), 0.0)),
        kind("no common vertices, rounded apart", Ball, |r| r.mending.stitched, |t| soup(&t, 2e-6)),
        kind(
            "rounded apart, faces flipped, inside out",
            Torus,
            |r| r.mending.stitched,
            |t| soup(&reversed(turned(t, 0.3)), 2e-6),
        ),
    ]
}

fn flat_faces() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.degenerate;
    vec![
        kind(
            "sides of a box that share corners only",
            Box,
            |r| r.mending.split,
            |t| {
                let side = |cells: usize, axis: usize, way: f64| {
                    let half = [0.75, 0.625, 0.5];
                    without(cuboid(half, cells), |p| p[axis] * way < half[axis] - 1e-6)
                };
                joined(&[
                    side(8, 0, 1.0),
                    side(5, 0, -1.0),
                    side(6, 1, 1.0),
                    side(7, 1, -1.0),
                    without(t, |p| p.z.abs() < 0.49),
                ])
            },
        ),
        kind("faces that name a vertex twice", Ball, count, |t| with_slivers(t, 5)),
        kind("faces with three corners on a line", Box, count, |t| with_flat_faces(t, 5)),
        kind("edges split on one side", Box, |r| r.mending.split, |t| with_split_edges(t, 7)),
        kind("curved edges split on one side", Torus, |r| r.mending.split, |t| with_split_edges(t, 11)),
    ]
}

fn non_manifold() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.non_manifold_edges;
    vec![
        kind("fins outside", Ball, count, |t| with_fins(t, 40, 1.15)),
        kind("fins inside", Ball, count, |t| with_fins(t, 40, 0.7)),
        kind("fins on both shells, inside out", Hollow, count, |t| with_fins(reversed(t), 50, 1.1)),
        kind("fins, inside out", Torus, count, |t| with_fins(reversed(t), 60, 1.1)),
        kind("a wall across", Bar, count, |t| joined(&[t, wall()])),
        kind("a wall across, inside out", Bar, count, |t| joined(&[reversed(t), wall()])),
        kind("two cubes with a common wall", Bar, count, |_| {
            joined(&[cube([0, 0, 0], [2.0, 1.0, 1.0]), cube([1, 0, 0], [2.0, 1.0, 1.0])])
        }),
        kind(
            "a common wall, one cube inside out",
            Bar,
            |r| r.flipped,
            |_| joined(&[cube([0, 0, 0], [2.0, 1.0, 1.0]), reversed(cube([1, 0, 0], [2.0, 1.0, 1.0]))]),
        ),
        kind("the same box twice, other diagonals", Box, count, |t| joined(&[other_diagonals(t.clone()), t])),
        kind("two cubes with a common edge", EdgeToEdge, count, |t| t),
        kind("a common edge, inside out", EdgeToEdge, count, reversed),
        kind(
            "two cubes with a common corner, one inside out",
            CornerToCorner,
            |r| r.flipped,
            |_| joined(&[cube([0, 0, 0], [2.0; 3]), reversed(cube([1, 1, 1], [2.0; 3]))]),
        ),
    ]
}

/// A cube of the lattice whose box has this size, of edge 0.75.
fn cube(cell: [i32; 3], of: [f64; 3]) -> Triangles {
    cells_around(&[cell], 0.75, 4, 0.5 * DVec3::from_array(of))
}

/// The square between the cubes of the bar.
fn wall() -> Triangles {
    without(cube([0, 0, 0], [2.0, 1.0, 1.0]), |p| p.x < -1e-6)
}

fn crossings() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.self_intersections;
    // Their faces lie in common planes and meet in common vertices: no edge passes through a face.
    let common = |r: &MeshReport| r.non_manifold_edges;
    vec![
        kind("two balls through each other", Peanut, count, |_| joined(&pair(0.35, 0.6))),
        kind("two balls through each other, one inside out", Peanut, count, |_| {
            let [a, b] = pair(0.35, 0.6);
            joined(&[reversed(a), b])
        }),
        kind("two balls through each other, holes", Peanut, count, |_| {
            pierced(joined(&pair(0.35, 0.6)), 0.01)
        }),
        kind("a torus through itself", Apple, count, |_| torus(0.4, 0.55, 48, 32)),
        kind("a torus through itself, inside out", Apple, count, |_| reversed(torus(0.4, 0.55, 48, 32))),
        kind(
            "pieces that overlap in common planes",
            Bar,
            |r| r.mending.overlapping,
            |_| joined(&[moved(bar(), -0.25 * DVec3::X), moved(bar(), 0.25 * DVec3::X)]),
        ),
        kind("three bars through each other", Jack, common, |_| jack()),
        kind("bars through each other, inside out", Jack, common, |_| reversed(jack())),
        kind("bars through each other, holes", Jack, common, |_| pierced(jack(), 0.01)),
    ]
}

/// The bar of two cubes, shorter by a half, in other squares.
fn bar() -> Triangles {
    cuboid([0.5, 0.375, 0.375], 5)
}

fn jack() -> Triangles {
    let bar = |x: f64, y: f64, z: f64| cuboid([x, y, z], 6);
    joined(&[bar(0.75, 0.25, 0.25), bar(0.25, 0.75, 0.25), bar(0.25, 0.25, 0.75)])
}

fn shells() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.mending.nested;
    vec![
        kind("a ball in a ball", Ball, count, |t| joined(&[t, icosphere(0.5, 3)])),
        kind("two balls side by side in a ball", Ball, count, |t| {
            let [a, b] = pair(0.4, 0.3);
            joined(&[a, t, b])
        }),
        kind("three balls in each other", Ball, count, |t| {
            joined(&[icosphere(0.3, 2), t, icosphere(0.6, 3)])
        }),
        kind("a ball in a ball, inside out", Ball, count, |t| reversed(joined(&[t, icosphere(0.5, 3)]))),
        kind("two shells a hair apart", Ball, count, |t| joined(&[scaled(t.clone(), 0.9999), t])),
        kind("a shell that touches the outer one", Box, count, |t| {
            joined(&[t, moved(scaled(cuboid([0.5; 3], 5), 0.5), DVec3::new(0.5, 0.0, 0.0))])
        }),
        kind("a cube on a slab", Step, |r| r.components - 1, |_| step()),
        kind("a cube on a slab, inside out", Step, |r| r.components - 1, |_| reversed(step())),
        kind("27 pieces", Lattice, |r| r.components - 1, |t| t),
        kind("an island in a cavity", Island, |r| r.components - 1, |t| t),
    ]
}

/// A slab, and a cube that stands on it with vertices of its own.
fn step() -> Triangles {
    let slab: Vec<[i32; 3]> = (0..9).map(|i| [i % 3, 0, i / 3]).collect();
    let middle = DVec3::new(1.5, 1.0, 1.5);
    joined(&[cells_around(&slab, 0.5, 4, middle), cells_around(&[[1, 1, 1]], 0.5, 3, middle)])
}

fn sheets() -> Vec<Kind> {
    use Intended::*;
    let count = |r: &MeshReport| r.mending.sheets;
    let says = "open sheet";
    let wave = |x: f64, z: f64| 0.2 * (5.0 * x).sin() * (4.0 * z).cos();
    let apart_faces = soup(&icosphere(1.0, 2), 0.05);
    let both = joined(&[sheet(1.0, 8, |_, _| 0.0), reversed(sheet(1.0, 8, |_, _| 0.0))]);
    let apart = joined(&[sheet(1.0, 4, |_, _| 0.0), moved(sheet(1.0, 4, |_, _| 0.0), DVec3::Y)]);
    let one = Triangles { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]] };
    let flat = Triangles { triangles: vec![[0, 1, 1], [0, 0, 2]], ..one.clone() };
    let missing = Triangles { triangles: vec![[0, 1, 7]], ..one.clone() };
    let infinite = Triangles { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y / 0.0], ..one.clone() };
    vec![
        kind("a sheet beside a ball", Ball, count, |t| {
            joined(&[t, moved(sheet(0.6, 6, |_, _| 0.0), DVec3::new(0.0, -1.1, 0.0))])
        }),
        kind("a ball with holes over a sheet of more faces", Ball, count, |t| {
            joined(&[pierced(t, 0.01), moved(sheet(0.6, 60, |_, _| 0.0), DVec3::new(0.0, -1.1, 0.0))])
        }),
        kind("a leaf at a vertex of a ball with holes", Ball, count, |t| {
            let bump = |x: f64, z: f64| 0.8 * (0.25 - x * x) * (1.0 - 4.0 * z * z);
            let leaf = sheet(1.0, 12, bump);
            let (stalk, tip) = (t.positions[0], leaf.positions[leaf.positions.len() - 1]);
            joined(&[pierced(t, 0.01), moved(leaf, stalk - tip)])
        }),
        kind("a wavy sheet inside a ball", Ball, count, |t| joined(&[t, scaled(sheet(1.0, 12, wave), 0.5)])),
        kind(
            "a Möbius band beside a torus",
            Torus,
            |r| r.mending.one_sided,
            |t| joined(&[t, moved(scaled(band(40, 1), 0.3), DVec3::new(0.0, 0.5, 0.0))]),
        ),
        refused("a flat sheet", says, sheet(1.0, 6, |_, _| 0.0)),
        refused("a wavy sheet", says, sheet(1.0, 16, wave)),
        refused("a slightly bent sheet", says, sheet(1.0, 8, |x, z| 0.1 * (x * x + z * z))),
        refused("a ribbon", says, band(40, 2)),
        refused("two sheets", says, apart),
        refused("a sheet from both sides", says, both),
        refused("faces apart", says, apart_faces),
        refused("two cubes with a common edge, a third missing", "torn", pierced(EdgeToEdge.shape(), 0.33)),
        refused("two thirds of a ball missing", says, pierced(Ball.shape(), 2.0 / 3.0)),
        refused("four fifths of a box missing", "torn", pierced(Box.shape(), 0.8)),
        refused("a single face", says, one),
        refused("a Möbius band", "one-sided", band(40, 1)),
        refused("only faces without area", "without area", flat),
        refused("a face names a missing vertex", "vertex", missing),
        refused("an infinite coordinate", "vertex 3 is not finite", infinite),
        refused("no faces", "no faces", Triangles::default()),
    ]
}
