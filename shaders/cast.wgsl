// The caster of grids: the twin of src/cast/ray.rs. One invocation follows one pixel's ray from voxel to voxel.
//
// Rays are in voxels, or, where planes are unevenly spaced, in coordinates along the axes. Places along a ray are counted
// from a base on it, which is never far and where f32 knows exactly what two of them say: places there are differences of
// planes and bases, and nothing is added up from voxel to voxel.

/// All rays of a frame: that of column x and row y starts at origin · (1, x, y) and runs along direction · (1, x, y).
struct CastUniforms {
    origin: array<DoubleSingle, 3>,
    direction: array<DoubleSingle, 3>,
    /// The direction in normalised coordinates, whose length is that of a unit of t.
    along: array<vec3f, 3>,
    /// For each component: (v − x) · y is what lines are over, or what colours are.
    maps: array<vec4f, 4>,
    /// A ray whose direction is less along an axis stays between two of its planes.
    still: vec3f,
    /// How far from their base places along a ray may be.
    reach: f32,
    /// Voxels along each axis.
    cells: vec3u,
    planes: u32,
    /// Where the planes of each axis begin in `axes`.
    axes: vec3u,
    /// Whether `ends` holds a value for each pixel of the image.
    has_ends: u32,
    /// What values are apart along y and z, and blocks.
    strides: vec4u,
    /// Width and height of the image, in pixels.
    size: vec2u,
    /// The rows that this dispatch draws.
    first_row: u32,
    rows: u32,
    /// The part of a ray that is seen, in lengths of its direction: each as a sum of two.
    near: vec2f,
    far: vec2f,
    most_work: u32,
    /// Equal steps, normalised.
    pace: f32,
    /// What stands for values that are not finite.
    missing: f32,
    /// Whether there are blocks in which nothing is seen.
    skips: u32,
}

/// What happened, over all rays: voxels passed, low and high digits.
struct Counts {
    steps: atomic<u32>,
    carry: atomic<u32>,
    unused: vec2u,
}

@group(0) @binding(3) var<uniform> frame: CastUniforms;
/// Clipping planes: dot(p, plane.xyz) + plane.w ≥ 0 is kept.
@group(0) @binding(4) var<storage, read> planes: array<vec4f>;
/// Where each ray ends, for want of something nearer.
@group(0) @binding(5) var<storage, read> ends: array<f32>;
@group(0) @binding(6) var<storage, read_write> pixels: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> counts: Counts;

alias Samples = array<f32, COMPONENTS>;

/// Values that are as far from all knots are for f64; none is farther than the second.
const HUGE = 1e18f;
const FARTHEST = 1e28f;

/// The ray: where it starts, where it runs, its speed, and its base: how far along it that is, and where.
var<private> origin: DoubleSingle;
var<private> heading: DoubleSingle;
var<private> speed: f32;
var<private> base_t: f32;
var<private> base: DoubleSingle;
/// Axes along which it does not move, and one over its direction along the others.
var<private> is_still: vec3<bool>;
var<private> slope: vec3f;
var<private> steps: u32;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.rows {
        return;
    }
    light = vec4f(0.0, 0.0, 0.0, 1.0);
    largest = vec4f(0.0, 0.0, 0.0, -FAR);
    work = 0u;
    given_up = false;
    opacity_line = 0u;
    color_line = function.color;
    trace(id.x, id.y + frame.first_row);
    let p = id.y * frame.size.x + id.x;
    if MAXIMUM {
        given_up = given_up || is_largest_doubtful();
    }
    if given_up {
        pixels[p] = vec4f(0.0, 0.0, 0.0, UNFINISHED);
    } else if MAXIMUM {
        pixels[p] = largest;
    } else {
        pixels[p] = vec4f(light.xyz, 1.0 - light.w);
    }
    let before = atomicAdd(&counts.steps, steps);
    if before + steps < before {
        atomicAdd(&counts.carry, 1u);
    }
}

/// Follows the ray of a pixel.
fn trace(column: u32, row: u32) {
    let x = f32(column);
    let y = f32(row);
    origin = affine(frame.origin, x, y);
    heading = affine(frame.direction, x, y);
    speed = length(frame.along[0] + frame.along[1] * x + frame.along[2] * y);
    is_still = abs(heading.high) < frame.still;
    slope = 1.0 / select(heading.high, vec3f(1.0), is_still);
    var last = FAR;
    if frame.has_ends != 0u {
        last = ends[row * frame.size.x + column];
    }
    // About where the ray enters; then from near there.
    base_t = 0.0;
    base = origin;
    let about = limits_of(last);
    if about.x > about.y + 0.1 {
        return;
    }
    move_base(about.x);
    let limits = limits_of(last);
    if !(limits.x < limits.y) {
        return;
    }
    if STEPPED {
        march(limits);
    } else {
        walk(limits);
    }
}

/// Takes for base what is nearest to `t` along the ray of places that f32 knows exactly.
fn move_base(t: f32) {
    base_t = clamp(round(t * 1024.0), -4095.0, 4095.0) / 1024.0;
    let high = shortened(heading.high);
    let first = sum(origin.high, high * base_t);
    let second = sum(first.high, (heading.high - high) * base_t);
    base = sum(second.high, (first.low + second.low) + (origin.low + heading.low * base_t));
}

/// How far behind the base plane `k` of axis `a` is.
fn gap(a: u32, k: u32) -> f32 {
    if EVEN {
        return (f32(k) - base.high[a]) - base.low[a];
    }
    let plane = axes(frame.axes[a] + k);
    return (plane.x - base.high[a]) + (plane.y - base.low[a]);
}

fn gaps(k: vec3u) -> vec3f {
    return vec3f(gap(0u, k.x), gap(1u, k.y), gap(2u, k.z));
}

/// From where to where the ray is in the grid and seen, from its base; `last` is where something opaque ends it.
fn limits_of(last: f32) -> vec2f {
    let low = gaps(vec3u());
    let high = gaps(frame.cells);
    // In a plane of the grid it belongs to the voxels behind that in index order.
    let slack = select(vec3f(), vec3f(SNAP), is_still) * (high - low) / vec3f(frame.cells);
    if any(is_still & ((low > slack) | (high <= slack))) {
        return vec2f(FAR, -FAR);
    }
    let a = select(low * slope, vec3f(-FAR), is_still);
    let b = select(high * slope, vec3f(FAR), is_still);
    let into = min(a, b);
    let out = max(a, b);
    var limits = vec2f((frame.near.x - base_t) + frame.near.y, (min(frame.far.x, last) - base_t) + frame.far.y);
    limits = vec2f(max(limits.x, max(into.x, max(into.y, into.z))), min(limits.y, min(out.x, min(out.y, out.z))));
    for (var k = 0u; k < frame.planes; k++) {
        let normal = planes[k].xyz;
        let height = (dot(base.high, normal) + planes[k].w) + dot(base.low, normal);
        let rise = dot(heading.high, normal);
        let t = -height / select(rise, 1.0, rise == 0.0);
        if rise > 0.0 {
            limits.x = max(limits.x, t);
        } else if rise < 0.0 {
            limits.y = min(limits.y, t);
        } else if height < 0.0 {
            return vec2f(FAR, -FAR);
        }
    }
    return limits;
}

/// The voxel at `t`, or the nearest to it.
fn voxel_at(t: f32) -> vec3u {
    return vec3u(voxel_along(0u, t), voxel_along(1u, t), voxel_along(2u, t));
}

fn voxel_along(a: u32, t: f32) -> u32 {
    let x = select(heading.high[a] * t, 0.0, is_still[a]);
    if EVEN {
        let snap = select(0.0, SNAP, is_still[a]);
        let place = base.high[a] + (base.low[a] + x + snap);
        return u32(clamp(floor(place), 0.0, f32(frame.cells[a] - 1u)));
    }
    let snap = select(0.0, SNAP, is_still[a]) * (gap(a, frame.cells[a]) - gap(a, 0u)) / f32(frame.cells[a]);
    var low = 0u;
    var high = frame.cells[a];
    while high > low + 1u {
        work++;
        let middle = (low + high) / 2u;
        if gap(a, middle) <= x + snap {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/// Goes from voxel to voxel.
fn walk(limits: vec2f) {
    var t = limits.x;
    var end = limits.y;
    var at = voxel_at(t);
    let grows = heading.high > vec3f();
    loop {
        work++;
        if work > frame.most_work {
            given_up = true;
        }
        if given_up {
            return;
        }
        if abs(t) > frame.reach {
            let before = base_t;
            move_base(base_t + t);
            t -= base_t - before;
            end -= base_t - before;
        }
        var low = at;
        var high = at + 1u;
        let seen = frame.skips == 0u || is_seen(at);
        if !seen {
            low = at & vec3u(~(BLOCK - 1u));
            high = min(low + BLOCK, frame.cells);
        }
        let behind = gaps(low);
        let ahead = gaps(high);
        let next = select(select(behind, ahead, grows) * slope, vec3f(FAR), is_still);
        let to = max(min(min(next.x, next.y), min(next.z, end)), t);
        if seen {
            steps++;
            if to > t {
                voxel(at, behind, ahead, t, to);
                if light.w < LEAST_TRANSMITTANCE {
                    return;
                }
            }
        }
        if to >= end {
            return;
        }
        let leaves = (next <= vec3f(to)) & !is_still;
        if any(leaves & select(low == vec3u(), high == frame.cells, grows)) {
            return;
        }
        t = to;
        at = select(at, select(low - 1u, high, grows), leaves);
        if !seen {
            // Along the others it may have come to another voxel of the block.
            let there = clamp(voxel_at(t), low, high - 1u);
            at = select(there, at, leaves | is_still);
        }
    }
}

fn is_seen(at: vec3u) -> bool {
    let b = at / BLOCK;
    let block = b.z * frame.strides.w + b.y * frame.strides.z + b.x;
    return (seen(block >> 5u) >> (block & 31u) & 1u) != 0u;
}

fn is_hidden(at: vec3u) -> bool {
    if !HIDES {
        return false;
    }
    let c = (at.z * frame.cells.y + at.y) * frame.cells.x + at.x;
    return (hidden(c >> 5u) >> (c & 31u) & 1u) != 0u;
}

/// Adds what lies in a voxel from `t` to `to`; its planes are so far behind and ahead of the base.
fn voxel(at: vec3u, behind: vec3f, ahead: vec3f, t: f32, to: f32) {
    if is_hidden(at) {
        return;
    }
    let speeds = select(heading.high, vec3f(), is_still);
    let inverse = select(1.0 / (ahead - behind), vec3f(1.0), vec3<bool>(EVEN));
    let p = clamp((speeds * t - behind) * inverse, vec3f(), vec3f(1.0));
    let q = clamp(p + speeds * (to - t) * inverse, vec3f(), vec3f(1.0));
    if !read_cubics(at, p, q - p) {
        return;
    }
    let length = (to - t) * speed;
    if ORDER == EXACT {
        add_voxel(length);
        return;
    }
    var front: Samples;
    var middle: Samples;
    var back: Samples;
    for (var k = 0u; k < COMPONENTS; k++) {
        front[k] = cubics[k].x;
        middle[k] = value_of(cubics[k], 0.5);
        back[k] = value_of(cubics[k], 1.0);
    }
    add_slab(front, middle, back, vec3<bool>(true), length);
}

/// Takes the values of a voxel along the line from `p` in its unit cube to `p` + `e`; false if nothing is to be seen.
fn read_cubics(at: vec3u, p: vec3f, e: vec3f) -> bool {
    work += COMPONENTS + 1u;
    let first = (at.z * frame.strides.y + at.y * frame.strides.x + at.x) * COMPONENTS;
    for (var k = 0u; k < COMPONENTS; k++) {
        cubics[k] = cubic_of(first + k, k, p, e);
        let bounds = bounds_of(cubics[k]);
        if bounds.x <= -HUGE || bounds.y >= HUGE {
            // What is so far from all knots is for f64; what is not finite is not seen.
            given_up = given_up || max(-bounds.x, bounds.y) < 1e36;
            return false;
        }
    }
    return true;
}

/// The values of component `k` along a line in a voxel, whose first one is `i`.
fn cubic_of(i: u32, k: u32, p: vec3f, e: vec3f) -> vec4f {
    let x = COMPONENTS;
    let y = frame.strides.x * COMPONENTS;
    let z = frame.strides.y * COMPONENTS;
    if OF_CELLS {
        let v = raw(i);
        return vec4f(select(mapped(v, k), unseen(), abs(v) >= 1e38), 0.0, 0.0, 0.0);
    }
    let front = vec4f(raw(i), raw(i + y), raw(i + z), raw(i + y + z));
    let back = vec4f(raw(i + x), raw(i + x + y), raw(i + x + z), raw(i + x + y + z));
    if any(abs(front) >= vec4f(1e38)) || any(abs(back) >= vec4f(1e38)) {
        return vec4f(unseen(), 0.0, 0.0, 0.0);
    }
    let map = frame.maps[k];
    let rise = clamp((back - front) * map.y, vec4f(-FARTHEST), vec4f(FARTHEST));
    let a = rise * p.x + clamp((front - map.x) * map.y, vec4f(-FARTHEST), vec4f(FARTHEST));
    let b = rise * e.x;
    let u = bilinear(a.x, a.y, b.x, b.y, p.y, e.y);
    let v = bilinear(a.z, a.w, b.z, b.w, p.y, e.y);
    let h = v - u;
    return vec4f(h.x * p.z + u.x, h.x * e.z + (h.y * p.z + u.y), h.y * e.z + (h.z * p.z + u.z), h.z * e.z);
}

fn mapped(v: f32, k: u32) -> f32 {
    return clamp((v - frame.maps[k].x) * frame.maps[k].y, -FARTHEST, FARTHEST);
}

/// What is linear, p + q u, at both ends of an axis, where the place along it is x + e u.
fn bilinear(p0: f32, p1: f32, q0: f32, q1: f32, x: f32, e: f32) -> vec3f {
    let p = p1 - p0;
    let q = q1 - q0;
    return vec3f(p * x + p0, p * e + (q * x + q0), q * e);
}

/// What stands for values that are not finite: above all if nothing does.
fn unseen() -> f32 {
    return frame.missing;
}

/// Goes in equal steps, two a slab.
fn march(limits: vec2f) {
    let step = frame.pace / speed;
    var t = limits.x;
    var end = limits.y;
    var is_there = read_samples(t);
    var front = samples_here();
    while t < end {
        work++;
        if work > frame.most_work {
            given_up = true;
        }
        if given_up {
            return;
        }
        if abs(t) > frame.reach {
            let before = base_t;
            move_base(base_t + t);
            t -= base_t - before;
            end -= base_t - before;
        }
        let to = min(t + 2.0 * step, end);
        let has_middle = read_samples(t + (to - t) * 0.5);
        let middle = samples_here();
        let has_back = read_samples(to);
        let back = samples_here();
        steps++;
        add_slab(front, middle, back, vec3<bool>(is_there, has_middle, has_back), (to - t) * speed);
        if light.w < LEAST_TRANSMITTANCE || to <= t {
            return;
        }
        t = to;
        front = back;
        is_there = has_back;
    }
}

/// Takes the values at `t`; false if the field is left out there.
fn read_samples(t: f32) -> bool {
    let at = voxel_at(t);
    if is_hidden(at) {
        return false;
    }
    let behind = gaps(at);
    let speeds = select(heading.high, vec3f(), is_still);
    let p = clamp((speeds * t - behind) / (gaps(at + 1u) - behind), vec3f(), vec3f(1.0));
    return read_cubics(at, p, vec3f());
}

fn samples_here() -> Samples {
    var here: Samples;
    for (var k = 0u; k < COMPONENTS; k++) {
        here[k] = cubics[k].x;
    }
    return here;
}

/// Adds what stands for the field between the samples of a slab; `known` says which there are.
fn add_slab(front: Samples, middle: Samples, back: Samples, known: vec3<bool>, length: f32) {
    for (var part = 0u; part < PARTS; part++) {
        var is_known = all(known);
        if ORDER == MIDPOINT {
            is_known = known.y;
        } else if ORDER == ONE {
            is_known = known.y && select(known.z, known.x, part == 0u);
        } else if ORDER == LEFT {
            is_known = select(known.y, known.x, part == 0u);
        } else if ORDER == RIGHT {
            is_known = select(known.z, known.y, part == 0u);
        }
        if !is_known {
            continue;
        }
        for (var k = 0u; k < COMPONENTS; k++) {
            let a = select(middle[k], front[k], part == 0u);
            let b = select(back[k], middle[k], part == 0u);
            if ORDER == TWO {
                let bend = (front[k] - middle[k]) + (back[k] - middle[k]);
                cubics[k] = vec4f(front[k], (back[k] - front[k]) - 2.0 * bend, 2.0 * bend, 0.0);
            } else if ORDER == ONE {
                cubics[k] = vec4f(a, b - a, 0.0, 0.0);
            } else if ORDER == MIDPOINT {
                cubics[k] = vec4f(middle[k], 0.0, 0.0, 0.0);
            } else {
                cubics[k] = vec4f(select(b, a, ORDER == LEFT), 0.0, 0.0, 0.0);
            }
        }
        add_voxel(length / f32(PARTS));
    }
}
