//! Polyhedra of any shape, thousands of them, with faces listed in any direction.

use crate::Cut;
use crate::common::draw::Random;
use crate::polyhedra::{Builder, prism};
use glam::{DMat3, DVec3, dvec3};
use halite::mesh::Mesh;
use std::collections::{BTreeMap, BTreeSet, HashMap};

pub(crate) type Solid = Vec<Vec<DVec3>>;

fn bits(p: DVec3) -> [u64; 3] {
    (p + 0.0).to_array().map(f64::to_bits)
}

/// Six times the volume that outward faces enclose; of the vector areas of warped ones.
fn enclosed(faces: &[Vec<DVec3>]) -> f64 {
    let of = |f: &Vec<DVec3>| (1..f.len() - 1).map(|i| f[0].dot(f[i].cross(f[i + 1]))).sum::<f64>();
    faces.iter().map(of).sum()
}

/// Turns and reorders faces, and starts each anywhere: what they enclose stays.
fn shuffled(mut faces: Solid, random: &mut Random) -> Solid {
    random.shuffle(&mut faces);
    for face in &mut faces {
        let by = random.below(face.len());
        face.rotate_left(by);
        if random.below(2) == 0 {
            face.reverse();
        }
    }
    faces
}

/// Checks the split of a mesh of such solids against their faces. Those of `outer` are seen from one cell only.
fn check(what: &str, mesh: &Mesh, outer: &[Vec<DVec3>], volume: Option<f64>) -> Cut {
    let cut = Cut::new(mesh);
    let t = &cut.tetrahedra;
    assert_eq!((t.skipped.total(), t.crooked.count), (0, 0), "{what}: {:?} {:?}", t.skipped, t.crooked);
    let f = &cut.faces;
    assert_eq!((f.non_manifold, f.folded, f.flat, f.degenerate), (0, 0, 0, 0), "{what}");
    assert!(f.orientation.iter().all(|o| *o == 1), "{what}: not positive");
    let volumes = cut.volumes();
    assert!(volumes.iter().all(|v| *v > 0.0), "{what}: {:?}", volumes.iter().copied().fold(1.0, f64::min));
    let sum: f64 = volumes.iter().sum();
    if let Some(volume) = volume {
        assert!((sum - volume).abs() <= 1e-9 * volume, "{what}: {sum}, not {volume}");
    }
    // The triangles outside are those of the faces: each face is covered by as many as it takes, along all its edges.
    let mut sides: HashMap<[[u64; 3]; 2], Vec<usize>> = HashMap::new();
    for (i, face) in outer.iter().enumerate() {
        for k in 0..face.len() {
            sides.entry(edge(face[k], face[(k + 1) % face.len()])).or_default().push(i);
        }
    }
    let corners: Vec<BTreeSet<[u64; 3]>> = outer.iter().map(|f| f.iter().map(|p| bits(*p)).collect()).collect();
    let mut by_point: HashMap<[u64; 3], BTreeSet<usize>> = HashMap::new();
    corners.iter().enumerate().for_each(|(i, c)| {
        c.iter().for_each(|p| {
            by_point.entry(*p).or_default().insert(i);
        });
    });
    let mut areas = vec![DVec3::ZERO; outer.len()];
    let mut counts = vec![0; outer.len()];
    let none = BTreeSet::new();
    let mut inside = 0.0;
    for face in &f.boundary {
        let [a, b, c] = f.outward(&t.corners, *face).map(|p| cut.points[p as usize]);
        inside += a.dot(b.cross(c)) / 6.0;
        let of = |p: DVec3| by_point.get(&bits(p)).unwrap_or(&none);
        let area = (b - a).cross(c - a);
        // Two faces may have three points in common, where these lie in one line or faces are folded: the nearer one.
        let fits = |i: &&usize| of(b).contains(i) && of(c).contains(i);
        let off = |i: &usize| normal(&outer[*i]).cross(area.normalize()).length();
        let i = of(a).iter().filter(fits).min_by(|i, j| off(i).total_cmp(&off(j)));
        let i = *i.unwrap_or_else(|| panic!("{what}: a face outside is none of the polyhedron's"));
        areas[i] += area;
        counts[i] += 1;
    }
    for (i, face) in outer.iter().enumerate() {
        let area =
            (0..face.len()).map(|k| (face[k] - face[0]).cross(face[(k + 1) % face.len()] - face[0])).sum::<DVec3>();
        let fits = areas[i].distance(area).min(areas[i].distance(-area)) < 1e-9 * area.length();
        assert!(fits && counts[i] == face.len() - 2, "{what}: face {i}: {} {} {area}", counts[i], areas[i]);
    }
    assert!((sum - inside).abs() <= 1e-9 * sum, "{what}: {sum}, not {inside}");
    // What is linear stays so, and nothing goes beyond the bounds.
    let linear = |p: &DVec3| p.dot(dvec3(0.3, -0.7, 0.2)) + 0.1;
    let values: Vec<f64> = mesh.points().iter().map(linear).collect();
    for (value, p) in t.values(values.into(), 1).iter().zip(&cut.points) {
        assert!((value - linear(p)).abs() < 1e-4 * p.length().max(1.0), "{what}");
    }
    assert!(t.added.weights.iter().all(|w| *w > -1e-9), "{what}: weights below 0");
    cut
}

fn edge(a: DVec3, b: DVec3) -> [[u64; 3]; 2] {
    let [a, b] = [bits(a), bits(b)];
    if a < b { [a, b] } else { [b, a] }
}

fn normal(face: &[DVec3]) -> DVec3 {
    (0..face.len()).map(|k| (face[k] - face[0]).cross(face[(k + 1) % face.len()] - face[0])).sum::<DVec3>().normalize()
}

fn one(what: &str, faces: Solid, planar: bool, random: &mut Random) -> Cut {
    let volume = enclosed(&faces) / 6.0;
    assert!(volume > 0.0, "{what}: the case itself is inside out");
    let faces = shuffled(faces, random);
    let mut build = Builder::new();
    build.polyhedron(&faces);
    check(what, &build.mesh(), &faces, planar.then_some(volume))
}

/// A map that keeps planes, nearly: rounded.
fn affine(random: &mut Random) -> impl Fn(DVec3) -> DVec3 + Copy + use<> {
    let m = loop {
        let m = DMat3::from_cols(random.point(1.0), random.point(1.0), random.point(1.0));
        if m.determinant() > 0.1 {
            break m;
        }
    };
    let (by, scale) = (random.point(3.0), 10f64.powf(random.within(-3.0, 3.0)));
    move |p| (m * p + by) * scale
}

/// A map that bends faces, by `strength` over a length of 1.
fn warp(strength: f64, random: &mut Random) -> impl Fn(DVec3) -> DVec3 + Copy + use<> {
    let [a, b, c] = [(); 3].map(|()| random.direction() * random.within(1.0, 2.5));
    let phase = random.point(3.0);
    move |p| p + strength * dvec3((a.dot(p) + phase.x).sin(), (b.dot(p) + phase.y).sin(), (c.dot(p) + phase.z).sin())
}

fn mapped(faces: Solid, mut to: impl FnMut(DVec3) -> DVec3) -> Solid {
    faces.into_iter().map(|f| f.into_iter().map(&mut to).collect()).collect()
}

/// What is left of a cube behind random planes.
fn convex(random: &mut Random) -> Solid {
    let mut faces = voxels(&BTreeSet::from([[0, 0, 0]]))
        .into_iter()
        .map(|f| f.into_iter().map(|p| p - 0.5).collect())
        .collect::<Solid>();
    for _ in 0..random.below(14) {
        let (normal, far) = (random.direction(), random.within(0.2, 0.7));
        let depth = |p: DVec3| far - normal.dot(p);
        if faces.iter().flatten().any(|p| depth(*p).abs() < 1e-3) {
            continue;
        }
        let cross = |p: DVec3, q: DVec3| {
            let [p, q] = if bits(p) < bits(q) { [p, q] } else { [q, p] };
            p.lerp(q, depth(p) / (depth(p) - depth(q)))
        };
        let mut next: BTreeMap<[u64; 3], DVec3> = BTreeMap::new();
        let mut left = vec![];
        for face in &faces {
            let n = face.len();
            let (mut kept, mut ends) = (vec![], [None, None]);
            for k in 0..n {
                let (p, q) = (face[k], face[(k + 1) % n]);
                if depth(p) > 0.0 {
                    kept.push(p);
                }
                if (depth(p) > 0.0) != (depth(q) > 0.0) {
                    let m = cross(p, q);
                    kept.push(m);
                    ends[usize::from(depth(q) > 0.0)] = Some(m);
                }
            }
            if let [Some(leaves), Some(enters)] = ends {
                // The new face runs the other way.
                next.insert(bits(enters), leaves);
            }
            if !kept.is_empty() {
                left.push(kept);
            }
        }
        if let Some(&first) = next.values().next() {
            let mut cap = vec![first];
            while cap.len() <= next.len() {
                let to = next[&bits(cap[cap.len() - 1])];
                if to == first {
                    break;
                }
                cap.push(to);
            }
            left.push(cap);
        }
        faces = left;
    }
    faces
}

/// The surface of unit cubes, outward, each side of one a face.
fn voxels(cubes: &BTreeSet<[i32; 3]>) -> Solid {
    let mut faces = vec![];
    for cube in cubes {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut beyond = *cube;
                beyond[axis] += 2 * side - 1;
                if cubes.contains(&beyond) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |i: i32, j: i32| {
                    let mut at = *cube;
                    at[axis] += side;
                    at[u] += i;
                    at[v] += j;
                    DVec3::from(at.map(f64::from))
                };
                let mut face = vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if side == 0 {
                    face.reverse();
                }
                faces.push(face);
            }
        }
    }
    faces
}

/// Whether no two cubes of the set, or of what is around it, touch in an edge or corner only.
fn is_manifold(cubes: &BTreeSet<[i32; 3]>) -> bool {
    let connected = |near: &[[i32; 3]]| {
        let mut seen = vec![];
        let mut waiting: Vec<[i32; 3]> = near.first().copied().into_iter().collect();
        while let Some(at) = waiting.pop() {
            if !seen.contains(&at) {
                seen.push(at);
                waiting.extend(near.iter().filter(|n| (0..3).map(|k| (n[k] - at[k]).abs()).sum::<i32>() == 1));
            }
        }
        seen.len() == near.len()
    };
    cubes.iter().flat_map(|c| (0..8).map(|o| [c[0] + (o & 1), c[1] + (o >> 1 & 1), c[2] + (o >> 2)])).all(|p| {
        let near = (0..8).map(|o| [p[0] - (o & 1), p[1] - (o >> 1 & 1), p[2] - (o >> 2)]);
        let (own, other): (Vec<_>, Vec<_>) = near.partition(|c| cubes.contains(c));
        connected(&own) && connected(&other)
    })
}

/// So many cubes that hang together.
fn heap(count: usize, size: i32, random: &mut Random) -> BTreeSet<[i32; 3]> {
    loop {
        let mut cubes = BTreeSet::from([[size / 2; 3]]);
        for _ in 0..40 * count {
            if cubes.len() < count {
                let from = *cubes.iter().nth(random.below(cubes.len())).unwrap();
                let mut to = from;
                to[random.below(3)] += 2 * random.below(2) as i32 - 1;
                if to.iter().all(|x| (0..size).contains(x)) {
                    cubes.insert(to);
                }
            }
        }
        if is_manifold(&cubes) {
            return cubes;
        }
    }
}

/// The outline of squares that hang together and have no hole, counter-clockwise; with or without points on its straight
/// sides.
fn outline(squares: &BTreeSet<[i32; 2]>, all: bool) -> Option<Vec<[f64; 2]>> {
    let mut next: BTreeMap<[i32; 2], [i32; 2]> = BTreeMap::new();
    for &[x, y] in squares {
        for (dx, dy, from, to) in [
            (0, -1, [x, y], [x + 1, y]),
            (1, 0, [x + 1, y], [x + 1, y + 1]),
            (0, 1, [x + 1, y + 1], [x, y + 1]),
            (-1, 0, [x, y + 1], [x, y]),
        ] {
            // A corner that is passed twice.
            if !squares.contains(&[x + dx, y + dy]) && next.insert(from, to).is_some() {
                return None;
            }
        }
    }
    let first = *next.keys().next()?;
    let mut around = vec![first];
    while next[around.last()?] != first {
        around.push(next[around.last()?]);
    }
    if around.len() < next.len() {
        return None;
    }
    let n = around.len();
    let bends = |i: usize| {
        let [p, q, r] = [around[(i + n - 1) % n], around[i], around[(i + 1) % n]];
        (q[0] - p[0]) * (r[1] - q[1]) != (q[1] - p[1]) * (r[0] - q[0])
    };
    Some((0..n).filter(|i| all || bends(*i)).map(|i| around[i].map(f64::from)).collect())
}

fn polyomino(random: &mut Random) -> Vec<[f64; 2]> {
    loop {
        let flat: BTreeSet<[i32; 2]> = {
            let count = 3 + random.below(14);
            let mut squares = BTreeSet::from([[3, 3]]);
            while squares.len() < count {
                let [x, y] = *squares.iter().nth(random.below(squares.len())).unwrap();
                let [dx, dy] = [[0, 1], [1, 0], [0, -1], [-1, 0]][random.below(4)];
                squares.insert([x + dx, y + dy]);
            }
            squares
        };
        if let Some(outline) = outline(&flat, random.below(3) == 0) {
            return outline;
        }
    }
}

/// A tube of `sides` along a curve that bends.
fn tube(random: &mut Random) -> Solid {
    let (rings, sides) = (2 + random.below(9), 3 + random.below(5));
    let (turn, rise) = (random.within(0.15, 0.5), random.within(0.0, 0.3));
    let ring = |k: usize| {
        let (s, c) = (turn * k as f64).sin_cos();
        let out = dvec3(c, s, 0.0);
        (0..sides)
            .map(|i| {
                let (s, c) = (std::f64::consts::TAU * i as f64 / sides as f64).sin_cos();
                out * (3.0 + 0.6 * c) + DVec3::Z * (0.6 * s + rise * k as f64)
            })
            .collect::<Vec<_>>()
    };
    let all: Vec<Vec<DVec3>> = (0..=rings).map(ring).collect();
    let mut faces: Solid = vec![all[0].clone(), all[rings].iter().rev().copied().collect()];
    for pair in all.windows(2) {
        faces.extend(
            (0..sides).map(|i| vec![pair[0][i], pair[1][i], pair[1][(i + 1) % sides], pair[0][(i + 1) % sides]]),
        );
    }
    if enclosed(&faces) < 0.0 {
        faces.iter_mut().for_each(|f| f.reverse());
    }
    faces
}

/// A ball with hills: the sides of a cube, cut into squares, each point at a distance of its own.
fn hills(random: &mut Random) -> Solid {
    let n = 1 + random.below(3) as i32;
    let cubes: BTreeSet<[i32; 3]> = (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n]).collect();
    let mut radius: HashMap<[u64; 3], f64> = HashMap::new();
    mapped(voxels(&cubes), |p| {
        let r = *radius.entry(bits(p)).or_insert_with(|| random.within(0.5, 1.0));
        (p - f64::from(n) / 2.0).normalize() * r
    })
}

#[test]
fn convex_polyhedra_with_faces_listed_in_any_direction() {
    let mut random = Random::of("convex");
    for round in 0..1200 {
        let to = affine(&mut random);
        one(&format!("convex {round}"), mapped(convex(&mut random), to), true, &mut random);
    }
}

#[test]
fn polyhedra_that_a_point_sees_whole() {
    let mut random = Random::of("hills");
    for round in 0..800 {
        let to = affine(&mut random);
        one(&format!("hills {round}"), mapped(hills(&mut random), to), false, &mut random);
    }
    for round in 0..200 {
        // Stars with up to 150 corners.
        let n = if round % 20 == 0 { 75 } else { 3 + random.below(30) };
        let polygon: Vec<[f64; 2]> = (0..2 * n)
            .map(|i| {
                let (s, c) = (std::f64::consts::PI * i as f64 / n as f64).sin_cos();
                let r = if i % 2 == 0 { 1.0 } else { random.within(0.4, 0.95) };
                [r * c, r * s]
            })
            .collect();
        let to = affine(&mut random);
        one(&format!("star {round}"), mapped(prism(&polygon), to), true, &mut random);
    }
}

#[test]
fn polyhedra_that_no_point_sees_whole() {
    let mut random = Random::of("winding");
    for round in 0..1200 {
        let height = random.within(0.3, 3.0);
        let faces = mapped(prism(&polyomino(&mut random)), |p| p * dvec3(1.0, 1.0, height));
        let to = affine(&mut random);
        one(&format!("prism {round}"), mapped(faces.clone(), to), true, &mut random);
        if round % 3 == 0 {
            let bend = warp(0.06, &mut random);
            one(&format!("warped prism {round}"), mapped(mapped(faces, bend), to), false, &mut random);
        }
    }
    for round in 0..400 {
        let faces = tube(&mut random);
        let to = affine(&mut random);
        one(&format!("tube {round}"), mapped(faces, to), false, &mut random);
    }
}

#[test]
fn heaps_of_cubes() {
    let mut random = Random::of("heaps");
    for round in 0..800 {
        let count = 3 + random.below(10);
        let cubes = heap(count, 4, &mut random);
        let to = affine(&mut random);
        let bend = warp([0.0, 0.05][round % 2], &mut random);
        one(&format!("heap {round}"), mapped(mapped(voxels(&cubes), bend), to), round % 2 == 0, &mut random);
    }
}

#[test]
fn polyhedra_with_holes_and_hollows() {
    let mut random = Random::of("holes");
    for round in 0..400 {
        let [x, y, z] = [3, 3, 1 + random.below(3) as i32];
        let mut cubes: BTreeSet<[i32; 3]> = (0..x * y * z).map(|i| [i % x, i / x % y, i / x / y]).collect();
        // One in the middle of three layers is a hollow.
        for layer in 0..z {
            if z < 3 || layer == 1 || round % 3 == 0 {
                cubes.remove(&[1, 1, layer]);
            }
        }
        let to = affine(&mut random);
        let bend = warp([0.0, 0.05][round % 2], &mut random);
        one(&format!("hole {round}"), mapped(mapped(voxels(&cubes), bend), to), round % 2 == 0, &mut random);
    }
    for round in 0..200 {
        // A ring whose ends meet in a slit: faces that go along one edge there and back.
        let n = 3 + random.below(6);
        let circle = |r: f64| {
            (0..n).map(move |i| {
                let (s, c) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                [r * c, r * s]
            })
        };
        let (outer, inner) = (circle(2.0).collect::<Vec<_>>(), circle(0.9).collect::<Vec<_>>());
        let at = |p: [f64; 2], z: f64| dvec3(p[0], p[1], z);
        let cap = |z: f64| {
            let mut cap: Vec<DVec3> = outer.iter().chain([&outer[0]]).map(|p| at(*p, z)).collect();
            cap.extend(std::iter::once(&inner[0]).chain(inner.iter().rev()).map(|p| at(*p, z)));
            cap
        };
        let mut faces: Solid = vec![cap(1.0), cap(0.0).into_iter().rev().collect()];
        for i in 0..n {
            let j = (i + 1) % n;
            faces.push(vec![at(outer[i], 0.0), at(outer[j], 0.0), at(outer[j], 1.0), at(outer[i], 1.0)]);
            faces.push(vec![at(inner[j], 0.0), at(inner[i], 0.0), at(inner[i], 1.0), at(inner[j], 1.0)]);
        }
        let to = affine(&mut random);
        one(&format!("slit {round}"), mapped(faces, to), true, &mut random);
    }
}

/// A block in random parts, each a polyhedron: what is between them is cut alike from both sides.
#[test]
fn groups_of_polyhedra_fit() {
    let mut random = Random::of("groups");
    for round in 0..250 {
        let size = 3;
        let all: BTreeSet<[i32; 3]> =
            (0..size * size * size).map(|i| [i % size, i / size % size, i / size / size]).collect();
        let parts = loop {
            // Parts grow from seeds.
            let mut part: BTreeMap<[i32; 3], usize> = BTreeMap::new();
            let count = 2 + random.below(4);
            for k in 0..count {
                part.insert(*all.iter().nth(random.below(27)).unwrap(), k);
            }
            while part.len() < all.len() {
                let (from, k) = part.iter().nth(random.below(part.len())).map(|(c, k)| (*c, *k)).unwrap();
                let mut to = from;
                to[random.below(3)] += 2 * random.below(2) as i32 - 1;
                if all.contains(&to) {
                    part.entry(to).or_insert(k);
                }
            }
            let of = |k: usize| part.iter().filter(|p| *p.1 == k).map(|p| *p.0).collect::<BTreeSet<_>>();
            let parts: Vec<BTreeSet<[i32; 3]>> = (0..count).map(of).filter(|p| !p.is_empty()).collect();
            if parts.iter().all(is_manifold) {
                break parts;
            }
        };
        let bend = warp([0.0, 0.04][round % 2], &mut random);
        let to = affine(&mut random);
        let mut build = Builder::new();
        for part in &parts {
            let faces = mapped(mapped(voxels(part), bend), to);
            build.polyhedron(&shuffled(faces, &mut random));
        }
        let outer = mapped(mapped(voxels(&all), bend), to);
        let volume = (round % 2 == 0).then(|| enclosed(&outer) / 6.0);
        let cut = check(&format!("group {round}"), &build.mesh(), &outer, volume);
        assert_eq!(cut.faces.components(), 1, "{round}");
    }
}
