// A ray and a tetrahedron: the f32 twin of src/cell.rs, which says why this never gets lost.

/// A place or direction as the sum of two vectors: one float tells places to 1e-7 only, and a steep transfer function
/// shows that.
struct DoubleSingle {
    high: vec3f,
    low: vec3f,
}

fn single(v: vec3f) -> DoubleSingle {
    return DoubleSingle(v, vec3f());
}

/// A ray's own coordinates: two axes across it, of unit length, and one along it, in lengths of its direction.
struct Ray {
    origin: DoubleSingle,
    /// The high part has 12 digits.
    direction: DoubleSingle,
    /// Its length.
    length: f32,
    /// A unit vector.
    along: vec3f,
    right: vec3f,
    up: vec3f,
}

/// The face that a ray passes through: three projected corners, counter-clockwise around the origin, and twice the
/// areas of the triangles (origin, next corner, last corner).
struct Face {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    areas: vec3f,
}

/// Which corner a step drops (NOWHERE: none, which only a broken device can do), and the areas of the new face.
struct Step {
    dropped: u32,
    areas: vec3f,
}

const NOWHERE = 3u;

/// The sum of two vectors, with what its rounding left (Knuth 1969, 4.2.2 B).
fn sum(a: vec3f, b: vec3f) -> DoubleSingle {
    let s = computed(a + b);
    let v = computed(s - a);
    return DoubleSingle(s, (a - (s - v)) + (b - v));
}

/// `v`. Compilers may take (a + b) - a for b, and Mesa's does, but not across this.
fn computed(v: vec3f) -> vec3f {
    return max(v, vec3f(-3e38));
}

/// `v` rounded toward zero to 12 digits, so that products of two such numbers are exact whether or not fma is fused.
fn shortened(v: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(v) & vec3u(0xfffff000u));
}

/// v[0] + x v[1] + y v[2], for whole numbers x and y of 14 digits and high parts of v[1] and v[2] of 10.
fn affine(v: array<DoubleSingle, 3>, x: f32, y: f32) -> DoubleSingle {
    let first = sum(v[0].high, v[1].high * x);
    let second = sum(first.high, v[2].high * y);
    return sum(second.high, (first.low + second.low) + (v[0].low + (v[1].low * x + v[2].low * y)));
}

/// The frame of the ray from `origin` along `direction` (Duff et al. 2017).
fn ray_along(origin: DoubleSingle, direction: DoubleSingle) -> Ray {
    let high = shortened(direction.high);
    let low = (direction.high - high) + direction.low;
    let size = length(direction.high);
    let n = direction.high / size;
    let side = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (side + n.z);
    let b = n.x * n.y * a;
    let right = vec3f(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    let up = vec3f(b, side + n.y * n.y * a, -n.y);
    return Ray(origin, DoubleSingle(high, low), size, n, right, up);
}

/// `p` in the coordinates of the ray: two across it, and the two parts of one along it. What lies along the ray is
/// taken off before the axes across it are asked, so that the places across it are as accurate as they are small. Every
/// fma is written out, so that a point gets the same bits for each of its cells; tiny coordinates become 0, so that no
/// product of two underflows.
fn project(ray: Ray, p: DoubleSingle) -> vec4f {
    let q = sum(p.high, -ray.origin.high);
    let t = shortened(vec3f(dot_fma(q.high, ray.along) / ray.length));
    let low = q.low + (p.low - ray.origin.low);
    let aside = (q.high - t * ray.direction.high) + fma(-t, ray.direction.low, low);
    let x = dot_fma(aside, ray.right);
    let y = dot_fma(aside, ray.up);
    let rest = dot_fma(aside, ray.along) / ray.length;
    return vec4f(select(x, 0.0, abs(x) < TINY), select(y, 0.0, abs(y) < TINY), t.x, rest);
}

fn dot_fma(a: vec3f, b: vec3f) -> f32 {
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

/// Twice the area of the triangle (origin, a, b): positive if it turns counter-clockwise. Products are taken with what
/// their rounding leaves (Dekker 1971), as faces seen edge-on are nothing but that.
fn orient2d(a: vec4f, b: vec4f) -> f32 {
    let c = b.yx;
    let p = rounded(a.xy * c);
    let a_high = shortened_pair(a.xy);
    let c_high = shortened_pair(c);
    let a_low = a.xy - a_high;
    let c_low = c - c_high;
    let rest = (((a_high * c_high - p) + a_high * c_low) + a_low * c_high) + a_low * c_low;
    return (p.x - p.y) + (rest.x - rest.y);
}

/// `v` rounded to f32: a product that is not fused with what follows, as [`computed`] has it.
fn rounded(v: vec2f) -> vec2f {
    return max(v, vec2f(-3e38));
}

fn shortened_pair(v: vec2f) -> vec2f {
    return bitcast<vec2f>(bitcast<vec2u>(v) & vec2u(0xfffff000u));
}

/// Whether the origin lies to the left of the line from `a` to `b`, whose `orient2d` is `twice`. Exact, and never the same
/// for (b, a) unless the two coincide.
fn is_left(a: vec4f, b: vec4f, twice: f32) -> bool {
    if abs(twice) > DOUBT * (abs(a.x * b.y) + abs(a.y * b.x)) {
        return twice > 0.0;
    }
    return is_left_exactly(a, b);
}

fn is_left_exactly(a: vec4f, b: vec4f) -> bool {
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
fn areas_of(a: vec4f, b: vec4f, c: vec4f) -> vec3f {
    return vec3f(orient2d(b, c), orient2d(c, a), orient2d(a, b));
}

/// Whether the triangle (a, b, c) with these areas turns counter-clockwise around the origin.
fn holds(a: vec4f, b: vec4f, c: vec4f, areas: vec3f) -> bool {
    // Most triangles are missed clearly.
    if is_left(b, c, areas.x) {
        if is_left(c, a, areas.y) {
            return is_left(a, b, areas.z);
        }
    }
    return false;
}

/// Walks through the cell that has this face and the further corner `apex`, to the other face that holds the origin.
fn step(face: Face, apex: vec4f) -> Step {
    let to = vec3f(orient2d(apex, face.a), orient2d(apex, face.b), orient2d(apex, face.c));
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

/// Where along the ray the point of the face with these weights is, in two parts: differences of such are as accurate
/// as they are small.
fn depth_of(face: Face, weights: vec3f) -> vec2f {
    let b = depth_between(face.a.zw, face.b.zw);
    let c = depth_between(face.a.zw, face.c.zw);
    return vec2f(face.a.z, face.a.w + (weights.y * b + weights.z * c));
}

/// From `a` to `b`, both in two parts.
fn depth_between(a: vec2f, b: vec2f) -> f32 {
    return (b.x - a.x) + (b.y - a.y);
}
