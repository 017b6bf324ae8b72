// A ray and a tetrahedron: the f32 twin of src/cell.rs, which says why this never gets lost.

/// A ray's own coordinates: two axes across it and one along it.
struct Ray {
    origin: vec3f,
    right: vec3f,
    up: vec3f,
    along: vec3f,
}

/// The face that a ray passes through: three projected corners, counter-clockwise around the origin, and twice the areas
/// of the triangles (origin, next corner, last corner).
struct Face {
    a: vec3f,
    b: vec3f,
    c: vec3f,
    areas: vec3f,
}

/// Which corner a step drops (NOWHERE: none, which only a broken device can do), and the areas of the new face.
struct Step {
    dropped: u32,
    areas: vec3f,
}

const NOWHERE = 3u;

/// The frame of the ray from `origin` along the unit vector `along` (Duff et al. 2017).
fn ray_along(origin: vec3f, along: vec3f) -> Ray {
    let side = select(-1.0, 1.0, along.z >= 0.0);
    let a = -1.0 / (side + along.z);
    let b = along.x * along.y * a;
    let right = vec3f(1.0 + side * along.x * along.x * a, side * b, -side * along.x);
    let up = vec3f(b, side + along.y * along.y * a, -along.y);
    return Ray(origin, right, up, along);
}

/// `p` in the coordinates of the ray. Every fma is written out, so that a point gets the same bits for each of its cells;
/// tiny coordinates become 0, so that no product of two underflows.
fn project(ray: Ray, p: vec3f) -> vec3f {
    let q = p - ray.origin;
    let x = fma(q.x, ray.right.x, fma(q.y, ray.right.y, q.z * ray.right.z));
    let y = fma(q.x, ray.up.x, fma(q.y, ray.up.y, q.z * ray.up.z));
    let t = fma(q.x, ray.along.x, fma(q.y, ray.along.y, q.z * ray.along.z));
    return vec3f(select(x, 0.0, abs(x) < TINY), select(y, 0.0, abs(y) < TINY), t);
}

/// Twice the area of the triangle (origin, a, b): positive if it turns counter-clockwise.
fn area(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

/// Whether the origin lies to the left of the line from `a` to `b`, whose area is `twice`. Exact, and never the same for
/// (b, a) unless the two coincide.
fn is_left(a: vec3f, b: vec3f, twice: f32) -> bool {
    if abs(twice) > DOUBT * (abs(a.x * b.y) + abs(a.y * b.x)) {
        return twice > 0.0;
    }
    return is_left_exactly(a, b);
}

fn is_left_exactly(a: vec3f, b: vec3f) -> bool {
    let p = product(a.x, b.y);
    let q = product(a.y, b.x);
    if any(p != q) {
        // Signed numbers in sign and magnitude: the exponent counts first, then the high and the low digits.
        if p.x != q.x {
            return p.x > q.x;
        }
        let greater = select(select(p.w > q.w, p.z > q.z, p.z != q.z), p.y > q.y, p.y != q.y);
        return greater == (p.x > 0);
    }
    // The origin moves to (ε, ε²).
    return select(b.x > a.x, a.y > b.y, a.y != b.y);
}

/// The exact product of two numbers that are 0 or normal: sign, exponent, and two digits of 24 bits.
fn product(a: f32, b: f32) -> vec4i {
    if a == 0.0 || b == 0.0 {
        return vec4i(0);
    }
    let m = bitcast<u32>(a);
    let n = bitcast<u32>(b);
    let x = (m & 0x7fffffu) | 0x800000u;
    let y = (n & 0x7fffffu) | 0x800000u;
    let middle = (x >> 12u) * (y & 0xfffu) + (x & 0xfffu) * (y >> 12u);
    var low = (x & 0xfffu) * (y & 0xfffu) + ((middle & 0xfffu) << 12u);
    var high = (x >> 12u) * (y >> 12u) + (middle >> 12u) + (low >> 24u);
    low &= 0xffffffu;
    var exponent = i32((m >> 23u) & 0xffu) + i32((n >> 23u) & 0xffu);
    if high < 0x800000u {
        high = (high << 1u) | (low >> 23u);
        low = (low << 1u) & 0xffffffu;
        exponent -= 1;
    }
    return vec4i(select(1, -1, ((m ^ n) >> 31u) == 1u), exponent, i32(high), i32(low));
}

/// The areas of the triangle (a, b, c).
fn areas_of(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return vec3f(area(b, c), area(c, a), area(a, b));
}

/// Whether the triangle (a, b, c) with these areas turns counter-clockwise around the origin.
fn holds(a: vec3f, b: vec3f, c: vec3f, areas: vec3f) -> bool {
    // Most triangles are missed clearly.
    if is_left(b, c, areas.x) {
        if is_left(c, a, areas.y) {
            return is_left(a, b, areas.z);
        }
    }
    return false;
}

/// Walks through the cell that has this face and the further corner `apex`, to the other face that holds the origin.
fn step(face: Face, apex: vec3f) -> Step {
    let to = vec3f(area(apex, face.a), area(apex, face.b), area(apex, face.c));
    let a = is_left(apex, face.a, to.x);
    let b = is_left(apex, face.b, to.y);
    let c = is_left(apex, face.c, to.z);
    if b && !c {
        return Step(0u, vec3f(face.areas.x, -to.z, to.y));
    }
    if c && !a {
        return Step(1u, vec3f(to.z, face.areas.y, -to.x));
    }
    if a && !b {
        return Step(2u, vec3f(-to.y, to.x, face.areas.z));
    }
    return Step(NOWHERE, vec3f());
}

/// Barycentric coordinates of the point where the ray passes through the face with these areas.
fn weights_of(areas: vec3f) -> vec3f {
    let sum = areas.x + areas.y + areas.z;
    // A face that is seen edge-on: any of its points is as good as another.
    return select(vec3f(1.0, 0.0, 0.0), areas / sum, sum > 0.0);
}
