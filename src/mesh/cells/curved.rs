//! Cells of higher order: a lattice of linear cells through all their nodes.
//!
//! A hexahedron of degrees (p, q, r) becomes p · q · r linear ones, a wedge and a tetrahedron likewise (the latter
//! leaves octahedra between its small tetrahedra: Bey, Tetrahedral Grid Refinement, 1995). Nodes are numbered as VTK
//! does (`vtkHigherOrderHexahedron.h` and its likes). A lattice point that is no node of its own (the face centres of a
//! serendipity cell, all but the corners of a Bézier cell) is added where the cell's shape functions put it. Its
//! weights are the same numbers for both cells of a face, so that both put it at the same place, bit for bit.

use super::linear::{HEXAHEDRON, OCTAHEDRON, PYRAMID, Shape, TETRA, WEDGE};

/// The greatest degree: VTK's (`vtkHigherOrderHexahedron::MaxDegree`).
pub(super) const MAX_DEGREE: usize = 10;

/// How all cells of one type, degree and number of points are split.
#[derive(Debug, Default)]
pub(super) struct Recipe {
    pub(super) nodes: Vec<Node>,
    /// The linear cells, by indices into `nodes`.
    pub(super) parts: Vec<(&'static Shape, [u16; 8])>,
    /// Numbers of tetrahedra and of added points that a cell gives.
    pub(super) tetrahedra: usize,
    pub(super) added: usize,
    /// Weights of added points, all of them.
    pub(super) weights: usize,
    /// Whether the points have weights of their own (rational Bézier cells).
    pub(super) bezier: bool,
}

/// A point of the lattice.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Node {
    /// A point of the cell.
    Own(u16),
    /// The sum of the cell's points times these weights.
    Sum(Vec<(u16, f64)>),
}

/// True for the types of which a [`Recipe`] may exist.
pub(super) fn is_curved(vtk_type: u8) -> bool {
    matches!(vtk_type, 24..=27 | 29 | 31..=33 | 37 | 71..=74 | 78..=81)
}

/// True for the types whose degrees the cell array `HigherOrderDegrees` may tell.
pub(super) fn has_degrees(vtk_type: u8) -> bool {
    matches!(vtk_type, 72 | 73 | 79 | 80)
}

impl Recipe {
    /// How a cell of `vtk_type` with so many points is split. `degrees` are those that the file gives, 0 for none.
    /// Otherwise: what is wrong with the cell.
    pub(super) fn new(vtk_type: u8, points: usize, degrees: [usize; 3]) -> Result<Self, String> {
        let bezier = vtk_type >= 78;
        let expect = |n: usize| (points == n).then_some(()).ok_or(format!("with {points} points, but that has {n}"));
        let no_degree = || format!("with {points} points, which fits no degree up to {MAX_DEGREE}");
        let mut used = [0; 3];
        let mut recipe = match vtk_type {
            24 => expect(10).map(|()| tetrahedron(2))?,
            71 if points == 15 => tetrahedron_15(),
            71 | 78 => {
                used[0] = (1..=MAX_DEGREE).find(|p| simplex(*p) == points).ok_or_else(no_degree)?;
                tetrahedron(used[0])
            }
            25 => expect(20).map(|()| hexahedron([2; 3], 20))?,
            // GetFEM leaves out the point in the middle.
            29 if points == 26 => hexahedron([2; 3], 26),
            29 => expect(27).map(|()| hexahedron([2; 3], 27))?,
            33 => expect(24).map(|()| hexahedron([2; 3], 24))?,
            72 | 79 => {
                let count = |d: [usize; 3]| d.iter().map(|d| d + 1).product::<usize>();
                let alike = || (1..=MAX_DEGREE).map(|p| [p; 3]).find(|d| count(*d) == points).ok_or_else(no_degree);
                let fits = degrees.iter().all(|d| (1..=MAX_DEGREE).contains(d)) && count(degrees) == points;
                used = if fits { degrees } else { alike()? };
                hexahedron(used, points)
            }
            26 => expect(15).map(|()| wedge([2, 2], 15))?,
            32 => expect(18).map(|()| wedge([2, 2], 18))?,
            31 => expect(12).map(|()| wedge([2, 1], 12))?,
            73 if points == 21 => wedge_21(),
            73 | 80 => {
                let count = |[p, q]: [usize; 2]| (p + 1) * (p + 2) / 2 * (q + 1);
                let alike = || (1..=MAX_DEGREE).map(|p| [p; 2]).find(|d| count(*d) == points).ok_or_else(no_degree);
                let given = [degrees[0], degrees[2]];
                let fits = given.iter().all(|d| (1..=MAX_DEGREE).contains(d)) && count(given) == points;
                let [p, q] = if fits { given } else { alike()? };
                used = [p, p, q];
                wedge([p, q], points)
            }
            27 => expect(13).map(|()| pyramid(13))?,
            37 => expect(19).map(|()| pyramid_19())?,
            // VTK names these types, but has no class for them: only where there is no doubt about the numbering.
            74 | 81 => match points {
                5 => Recipe { nodes: own(5), parts: vec![(&PYRAMID, filled(&[0, 1, 2, 3, 4]))], ..Recipe::default() },
                13 | 14 if !bezier => pyramid(points),
                _ => return Err(format!("with {points} points, whose order VTK leaves open")),
            },
            _ => return Err("that Halite does not split".to_owned()),
        };
        if matches!(vtk_type, 78..=80) {
            recipe.nodes = bernstein(vtk_type, used);
        }
        recipe.bezier = bezier;
        recipe.tetrahedra = recipe.parts.iter().map(|(shape, _)| shape.tetrahedra).sum();
        for node in &recipe.nodes {
            if let Node::Sum(weights) = node {
                recipe.added += 1;
                recipe.weights += weights.len();
            }
        }
        Ok(recipe)
    }
}

fn own(n: usize) -> Vec<Node> {
    (0..n as u16).map(Node::Own).collect()
}

fn filled(ids: &[usize]) -> [u16; 8] {
    let mut all = [0; 8];
    all.iter_mut().zip(ids).for_each(|(to, from)| *to = *from as u16);
    all
}

/// The number of points of a tetrahedron of degree `p`.
fn simplex(p: usize) -> usize {
    (p + 1) * (p + 2) * (p + 3) / 6
}

/// The weight of a corner and of a point in the middle of an edge at the centre of a face of eight points.
const SERENDIPITY: [f64; 2] = [-0.25, 0.5];

/// The index of lattice point (i, j, k) of a hexahedron: corners, edges, faces, inside.
fn hexahedron_index([p, q, r]: [usize; 3], [i, j, k]: [usize; 3]) -> usize {
    let ends = [i == 0 || i == p, j == 0 || j == q, k == 0 || k == r];
    let (a, b, c) = (p - 1, q - 1, r - 1);
    let corner = |i: usize, j: usize| if j > 0 { if i > 0 { 2 } else { 3 } } else { usize::from(i > 0) };
    let edges = 8 + 4 * (a + b + c);
    match ends {
        [true, true, true] => corner(i, j) + if k > 0 { 4 } else { 0 },
        [false, true, true] => 8 + (i - 1) + if j > 0 { a + b } else { 0 } + if k > 0 { 2 * (a + b) } else { 0 },
        [true, false, true] => 8 + (j - 1) + if i > 0 { a } else { 2 * a + b } + if k > 0 { 2 * (a + b) } else { 0 },
        [true, true, false] => 8 + 4 * (a + b) + (k - 1) + c * corner(i, j),
        [true, false, false] => edges + (j - 1) + b * (k - 1) + if i > 0 { b * c } else { 0 },
        [false, true, false] => edges + 2 * b * c + (i - 1) + a * (k - 1) + if j > 0 { a * c } else { 0 },
        [false, false, true] => edges + 2 * b * c + 2 * a * c + (i - 1) + a * (j - 1) + if k > 0 { a * b } else { 0 },
        [false, false, false] => edges + 2 * (b * c + a * c + a * b) + (i - 1) + a * ((j - 1) + b * (k - 1)),
    }
}

/// A hexahedron of which the first `points` lattice points exist; the others are those of a quadratic one in the middle
/// of faces and of the cell.
fn hexahedron(degrees: [usize; 3], points: usize) -> Recipe {
    let [p, q, r] = degrees;
    let at = |i, j, k| hexahedron_index(degrees, [i, j, k]);
    let mut recipe = Recipe { nodes: own((p + 1) * (q + 1) * (r + 1)), ..Recipe::default() };
    if points < recipe.nodes.len() {
        let mut middle = vec![0.0; points];
        for axis in 0..3 {
            for side in [0, 2] {
                let place = |u, v| match axis {
                    0 => at(side, u, v),
                    1 => at(u, side, v),
                    _ => at(u, v, side),
                };
                let centre = square(place);
                let face = place(1, 1);
                if face >= points {
                    recipe.nodes[face] = Node::Sum(centre.clone());
                }
                // Half of all faces' centres, less a quarter of the edges', and an eighth of the corners (Gordon & Hall
                // 1973).
                let parts = if face < points { vec![(face as u16, 1.0)] } else { centre };
                parts.iter().for_each(|(i, w)| middle[*i as usize] += 0.5 * w);
            }
        }
        (0..8).for_each(|i| middle[i] += 0.125);
        (8..20).for_each(|i| middle[i] -= 0.25);
        recipe.nodes[26] = Node::Sum((0..points as u16).zip(middle).filter(|(_, w)| *w != 0.0).collect());
    }
    for [i, j, k] in boxes(p, q, r) {
        let corner = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        let ids = corner.map(|[a, b, c]| at(i + a, j + b, k + c));
        recipe.parts.push((&HEXAHEDRON, filled(&ids)));
    }
    recipe
}

/// The centre of the face with eight points at `place(u, v)`, u and v in 0..=2.
fn square(place: impl Fn(usize, usize) -> usize) -> Vec<(u16, f64)> {
    let [corner, edge] = SERENDIPITY;
    let corners = [(0, 0), (2, 0), (2, 2), (0, 2)].map(|(u, v)| (place(u, v) as u16, corner));
    let edges = [(1, 0), (2, 1), (1, 2), (0, 1)].map(|(u, v)| (place(u, v) as u16, edge));
    [corners, edges].concat()
}

fn boxes(p: usize, q: usize, r: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..p * q * r).map(move |n| [n % p, n / p % q, n / (p * q)])
}

/// The index of lattice point (i, j, k), i + j ≤ p, of a wedge: corners, edges, triangles, quads, inside.
fn wedge_index([p, q]: [usize; 2], [i, j, k]: [usize; 3]) -> usize {
    let (left, front, slope, end) = (i == 0, j == 0, i + j == p, k == 0 || k == q);
    let (a, c) = (p - 1, q - 1);
    let column = if left && front {
        Some(0)
    } else if front && slope {
        Some(1)
    } else if left && slope {
        Some(2)
    } else {
        None
    };
    // Inside a triangle, row by row.
    let row = || (j - 1) * a - (j - 1) * j / 2 + i - 1;
    let triangle = a * a.saturating_sub(1) / 2;
    let edges = 6 + 6 * a + 3 * c;
    match (column, end) {
        (Some(column), true) => column + if k > 0 { 3 } else { 0 },
        (Some(column), false) => 6 + 6 * a + (k - 1) + column * c,
        (None, true) if left || front || slope => {
            let along = if front {
                i - 1
            } else if slope {
                a + j - 1
            } else {
                2 * a + (p - j - 1)
            };
            6 + along + if k > 0 { 3 * a } else { 0 }
        }
        (None, true) => edges + row() + if k > 0 { triangle } else { 0 },
        (None, false) if left || front || slope => {
            let along = if front {
                i - 1
            } else if slope {
                a * c + (p - i - 1)
            } else {
                2 * a * c + (p - j - 1)
            };
            edges + 2 * triangle + along + a * (k - 1)
        }
        (None, false) => edges + 2 * triangle + 3 * a * c + row() + triangle * (k - 1),
    }
}

/// A wedge of which the first `points` lattice points exist; the others are the centres of a quadratic one's quads.
fn wedge(degrees: [usize; 2], points: usize) -> Recipe {
    let [p, q] = degrees;
    let at = |i, j, k| wedge_index(degrees, [i, j, k]);
    let mut recipe = Recipe { nodes: own((p + 1) * (p + 2) / 2 * (q + 1)), ..Recipe::default() };
    if points < recipe.nodes.len() {
        let around = [[0, 0], [1, 0], [2, 0], [1, 1], [0, 2], [0, 1], [0, 0]];
        for side in around.windows(3).step_by(2) {
            let place = |u: usize, v: usize| at(side[u][0], side[u][1], v);
            recipe.nodes[place(1, 1)] = Node::Sum(square(place));
        }
    }
    for k in 0..q {
        for (i, j) in (0..p).flat_map(|j| (0..p - j).map(move |i| (i, j))) {
            let prism = |t: [[usize; 2]; 3]| {
                let layer = |k: usize| t.map(|[i, j]| at(i, j, k));
                filled(&[layer(k), layer(k + 1)].concat())
            };
            recipe.parts.push((&WEDGE, prism([[i, j], [i + 1, j], [i, j + 1]])));
            if i + j + 2 <= p {
                recipe.parts.push((&WEDGE, prism([[i + 1, j], [i + 1, j + 1], [i, j + 1]])));
            }
        }
    }
    recipe
}

/// Barycentric indices of a tetrahedron's lattice points, in VTK's order: corners, edges, faces, and inside again like
/// that.
fn tetrahedron_points(p: usize) -> Vec<[usize; 4]> {
    // Corner n has all of p at place n, with the last place first.
    let corner = |n: usize, p: usize| {
        let mut b = [0; 4];
        b[(n + 3) % 4] = p;
        b
    };
    let between = |a: [usize; 4], b: [usize; 4], p: usize| {
        (1..p).map(move |k| std::array::from_fn(|i| (a[i] * (p - k) + b[i] * k) / p))
    };
    let mut all = Vec::new();
    let (mut inset, mut left) = (0, p);
    loop {
        let inner = |b: [usize; 4]| b.map(|x| x + inset);
        if left == 0 {
            all.push(inner([0; 4]));
            return all;
        }
        let corners = [0, 1, 2, 3].map(|n| corner(n, left));
        all.extend(corners.map(inner));
        for [a, b] in [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]] {
            all.extend(between(corners[a], corners[b], left).map(inner));
        }
        for face in [[0, 1, 3], [2, 3, 1], [0, 3, 2], [0, 2, 1]] {
            all.extend(triangle_inside(face.map(|n| corners[n]), left).into_iter().map(inner));
        }
        if left < 4 {
            return all;
        }
        (inset, left) = (inset + 1, left - 4);
    }
}

/// The lattice points inside a triangle with these corners: again corners, edges, inside.
fn triangle_inside(corners: [[usize; 4]; 3], p: usize) -> Vec<[usize; 4]> {
    let mut all = Vec::new();
    if p < 3 {
        return all;
    }
    // Each corner moves inwards by one step towards both others.
    let unit = corners.map(|c| c.map(|x| x / p));
    let base: [usize; 4] = std::array::from_fn(|i| unit[0][i] + unit[1][i] + unit[2][i]);
    let left = p - 3;
    let point = |n: [usize; 3]| -> [usize; 4] {
        std::array::from_fn(|i| base[i] + n[0] * unit[0][i] + n[1] * unit[1][i] + n[2] * unit[2][i])
    };
    if left == 0 {
        all.push(point([0; 3]));
        return all;
    }
    all.extend([[left, 0, 0], [0, left, 0], [0, 0, left]].map(point));
    for k in 1..left {
        all.push(point([left - k, k, 0]));
    }
    for k in 1..left {
        all.push(point([0, left - k, k]));
    }
    for k in 1..left {
        all.push(point([k, 0, left - k]));
    }
    let inner = triangle_inside([[left, 0, 0, 0], [0, left, 0, 0], [0, 0, left, 0]], left);
    all.extend(inner.into_iter().map(|[a, b, c, _]| point([a, b, c])));
    all
}

fn tetrahedron(p: usize) -> Recipe {
    let points = tetrahedron_points(p);
    let at = |b: [usize; 4]| points.iter().position(|q| *q == b).unwrap_or(0);
    let plus = |b: [usize; 4], steps: &[usize]| {
        let mut b = b;
        steps.iter().for_each(|&i| b[i] += 1);
        at(b)
    };
    let below = |sum: usize| {
        points.iter().copied().filter_map(move |b| b[3].checked_sub(p - sum).map(|w| [b[0], b[1], b[2], w]))
    };
    let mut recipe = Recipe { nodes: own(points.len()), ..Recipe::default() };
    for b in below(p - 1) {
        recipe.parts.push((&TETRA, filled(&[3, 0, 1, 2].map(|i| plus(b, &[i])))));
    }
    if p >= 2 {
        for b in below(p - 2) {
            // Opposite corners of the octahedron: (0, 5), (1, 4), (2, 3).
            let ids = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]].map(|pair| plus(b, &pair));
            recipe.parts.push((&OCTAHEDRON, filled(&ids)));
        }
    }
    if p >= 3 {
        for b in below(p - 3) {
            recipe.parts.push((&TETRA, filled(&[[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]].map(|t| plus(b, &t)))));
        }
    }
    recipe
}

/// A quadratic pyramid of 13 points, or with the centre of its base as a fourteenth.
fn pyramid(points: usize) -> Recipe {
    let mut nodes = own(14);
    if points == 13 {
        let base = [[0, 5, 1], [8, 13, 6], [3, 7, 2]];
        nodes[13] = Node::Sum(square(|u, v| base[v][u]));
    }
    let corners = [[0, 5, 13, 8, 9], [1, 6, 13, 5, 10], [2, 7, 13, 6, 11], [3, 8, 13, 7, 12]];
    let others = [[9, 10, 11, 12, 4], [9, 12, 11, 10, 13]];
    let pyramids = corners.iter().chain(&others).map(|p| (&PYRAMID, filled(p)));
    let edges = [[5, 10, 9], [6, 11, 10], [7, 12, 11], [8, 9, 12]];
    let tetrahedra = edges.iter().map(|[m, a, b]| (&TETRA, filled(&[13, *m, *a, *b])));
    Recipe { nodes, parts: pyramids.chain(tetrahedra).collect(), ..Recipe::default() }
}

/// A cell whose last point lies in its middle, and others in the middle of its faces: triangles of six points around a
/// centre, quads of eight.
fn centred(points: usize, triangles: &[(usize, [usize; 6])], quads: &[(usize, [usize; 8])]) -> Recipe {
    let middle = points - 1;
    let mut recipe = Recipe { nodes: own(points), ..Recipe::default() };
    for (centre, around) in triangles {
        for i in 0..6 {
            recipe.parts.push((&TETRA, filled(&[*centre, around[i], around[(i + 1) % 6], middle])));
        }
    }
    for (centre, around) in quads {
        for i in [0, 2, 4, 6] {
            let quad = [around[(i + 7) % 8], around[i], around[i + 1], *centre];
            recipe.parts.push((&PYRAMID, filled(&[quad[0], quad[1], quad[2], quad[3], middle])));
        }
    }
    recipe
}

fn tetrahedron_15() -> Recipe {
    let faces =
        [(10, [0, 6, 2, 5, 1, 4]), (11, [0, 4, 1, 8, 3, 7]), (12, [1, 5, 2, 9, 3, 8]), (13, [2, 6, 0, 7, 3, 9])];
    centred(15, &faces, &[])
}

fn wedge_21() -> Recipe {
    let triangles = [(15, [0, 8, 2, 7, 1, 6]), (16, [3, 9, 4, 10, 5, 11])];
    let quads =
        [(17, [0, 6, 1, 13, 4, 9, 3, 12]), (18, [1, 7, 2, 14, 5, 10, 4, 13]), (19, [2, 8, 0, 12, 3, 11, 5, 14])];
    centred(21, &triangles, &quads)
}

fn pyramid_19() -> Recipe {
    let sides =
        [(14, [0, 5, 1, 10, 4, 9]), (15, [1, 6, 2, 11, 4, 10]), (16, [2, 7, 3, 12, 4, 11]), (17, [3, 8, 0, 9, 4, 12])];
    centred(19, &sides, &[(13, [0, 8, 3, 7, 2, 6, 1, 5])])
}

/// The lattice points of a cell, each as groups of barycentric indices; the indices of a group add up to a degree.
fn groups(vtk_type: u8, degrees: [usize; 3]) -> Vec<Vec<Vec<usize>>> {
    let [p, q, r] = degrees;
    match vtk_type {
        78 => tetrahedron_points(p).into_iter().map(|b| vec![b.to_vec()]).collect(),
        79 => {
            let mut all = vec![vec![]; (p + 1) * (q + 1) * (r + 1)];
            for [i, j, k] in boxes(p + 1, q + 1, r + 1) {
                all[hexahedron_index(degrees, [i, j, k])] = vec![vec![i, p - i], vec![j, q - j], vec![k, r - k]];
            }
            all
        }
        _ => {
            let mut all = vec![vec![]; (p + 1) * (p + 2) / 2 * (r + 1)];
            for [i, j, k] in boxes(p + 1, p + 1, r + 1).filter(|[i, j, _]| i + j <= p) {
                all[wedge_index([p, r], [i, j, k])] = vec![vec![i, j, p - i - j], vec![k, r - k]];
            }
            all
        }
    }
}

/// Where Bézier control points put the lattice points: each with the weight of its Bernstein polynomial.
fn bernstein(vtk_type: u8, degrees: [usize; 3]) -> Vec<Node> {
    let points = groups(vtk_type, degrees);
    let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
    let weight = |at: &[Vec<usize>], control: &[Vec<usize>]| {
        let mut factors = Vec::new();
        for (at, control) in at.iter().zip(control) {
            let degree: usize = at.iter().sum();
            factors.push(factorial(degree) / control.iter().map(|c| factorial(*c)).product::<f64>());
            factors.extend(at.iter().zip(control).map(|(a, c)| (*a as f64 / degree as f64).powi(*c as i32)));
        }
        // In an order that is the same for both cells of a face.
        factors.sort_by(f64::total_cmp);
        factors.iter().product::<f64>()
    };
    let node = |at: &Vec<Vec<usize>>| {
        let weights = points.iter().enumerate().map(|(i, control)| (i as u16, weight(at, control)));
        let weights: Vec<(u16, f64)> = weights.filter(|(_, w)| *w != 0.0).collect();
        if let [(own, _)] = weights[..] { Node::Own(own) } else { Node::Sum(weights) }
    };
    points.iter().map(node).collect()
}
