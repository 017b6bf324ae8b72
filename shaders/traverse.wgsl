// The walk: the twin of src/traverse/cpu.rs. One invocation follows one pixel's ray through the mesh.

/// A tetrahedron: `neighbours[k]` lies beyond the face opposite to corner k.
struct Cell {
    corners: vec4u,
    neighbours: vec4u,
}

/// A face of the boundary, counter-clockwise as seen from outside, and the cell behind it.
struct Outer {
    points: vec3u,
    cell: u32,
}

/// A node of the boundary's hierarchy, rounded outward; empty if `low.x > high.x`.
struct Box {
    low: vec3f,
    high: vec3f,
}

/// All rays of a frame. At (x, y), each in [−1, 1] across the image, the ray starts at origin · (1, x, y) and runs along
/// direction · (1, x, y); coordinates are the mesh's normalised ones.
struct Frame {
    origin: array<vec4f, 3>,
    direction: array<vec4f, 3>,
    /// Width and height of the image, in pixels.
    size: vec2u,
    /// The rows that this dispatch draws.
    first_row: u32,
    rows: u32,
    /// From a pixel's centre to its sample, in units of x and y.
    offset: vec2f,
    /// The part of a ray that is seen, in lengths of its direction.
    near: f32,
    far: f32,
    planes: u32,
    /// Whether `ends` holds a value for each pixel of the image.
    has_ends: u32,
    /// Number of leaves of the hierarchy, of faces, of steps that no walk exceeds, and of loop iterations that no ray may.
    leaves: u32,
    faces: u32,
    most_steps: u32,
    most_work: u32,
}

/// What happened, over all rays.
struct Counts {
    /// Tetrahedra visited: low and high digits.
    steps: atomic<u32>,
    carry: atomic<u32>,
    /// Rays that were traced again beside their place.
    repaired: atomic<u32>,
    unused: u32,
}

@group(0) @binding(3) var<uniform> frame: Frame;
/// Clipping planes: dot(p, plane.xyz) + plane.w ≥ 0 is kept.
@group(0) @binding(4) var<storage, read> planes: array<vec4f>;
/// Where each ray ends, for want of something nearer.
@group(0) @binding(5) var<storage, read> ends: array<f32>;
@group(0) @binding(6) var<storage, read_write> pixels: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> counts: Counts;

/// Where a ray enters the mesh.
struct Entry {
    t: f32,
    index: u32,
    cell: u32,
    points: vec3u,
    face: Face,
}

/// The largest values along a ray; the last of them at −FAR if there are none.
var<private> largest: Value;
var<private> steps: u32;
/// Whether all of the ray was walked: llvmpipe leaves loops after 65,535 iterations of all loops of 8 rays together, so that
/// rays which take much work are given up before, and the CPU draws them.
var<private> finished: bool;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.rows {
        return;
    }
    let column = i32(id.x);
    let row = i32(id.y + frame.first_row);
    let size = vec2i(frame.size);
    let x = f32(2 * column + 1 - size.x) / f32(size.x) + frame.offset.x;
    let y = f32(size.y - 2 * row - 1) / f32(size.y) + frame.offset.y;
    let origin = fma(frame.origin[2].xyz, vec3f(y), fma(frame.origin[1].xyz, vec3f(x), frame.origin[0].xyz));
    let direction = fma(frame.direction[2].xyz, vec3f(y), fma(frame.direction[1].xyz, vec3f(x), frame.direction[0].xyz));
    let along = length(direction);
    let straight = ray_along(origin, direction / along);
    var limits = vec2f(frame.near, frame.far) * along;
    if frame.has_ends != 0u {
        limits.y = min(limits.y, ends[u32(row) * frame.size.x + id.x]);
    }
    for (var k = 0u; k < frame.planes; k++) {
        limits = clipped(limits, dot(origin, planes[k].xyz) + planes[k].w, dot(straight.along, planes[k].xyz));
    }
    steps = 0u;
    work = 0u;
    trace(straight, limits);
    if !finished {
        pixels[id.y * frame.size.x + id.x] = vec4f(0.0, 0.0, 0.0, UNFINISHED);
    } else if MAXIMUM {
        pixels[id.y * frame.size.x + id.x] = padded(largest);
    } else {
        pixels[id.y * frame.size.x + id.x] = vec4f(light.xyz, 1.0 - light.w);
    }
    let before = atomicAdd(&counts.steps, steps);
    if before + steps < before {
        atomicAdd(&counts.carry, 1u);
    }
}

fn most_work() -> u32 {
    return frame.most_work;
}

/// What a plane at this height over the ray's start leaves of it.
fn clipped(limits: vec2f, height: f32, slope: f32) -> vec2f {
    let t = -height / slope;
    if slope > 0.0 {
        return vec2f(max(limits.x, t), limits.y);
    }
    if slope < 0.0 {
        return vec2f(limits.x, min(limits.y, t));
    }
    return vec2f(limits.x, select(limits.y, -FAR, height < 0.0));
}

/// Follows a ray. No ray gets lost in theory; should one, it is followed again beside its place.
fn trace(straight: Ray, limits: vec2f) {
    var ray = straight;
    for (var attempt = 1u; attempt <= 3u; attempt++) {
        light = vec4f(0.0, 0.0, 0.0, 1.0);
        largest = Value(-FAR);
        finished = false;
        follow(ray, limits);
        if finished || work > frame.most_work {
            return;
        }
        let aside = ASIDE * f32(attempt);
        ray.origin = straight.origin + (straight.right + straight.up * 0.618) * aside;
        atomicAdd(&counts.repaired, select(0u, 1u, attempt == 1u));
    }
}

/// Walks from each entry to the next.
fn follow(ray: Ray, limits: vec2f) {
    let inverse = 1.0 / select(ray.along, vec3f(1e-20), abs(ray.along) < vec3f(1e-20));
    let inside = span(boxes(0u), ray, inverse);
    if inside.x > inside.y || inside.y < limits.x || inside.x > limits.y || limits.x >= limits.y {
        finished = true;
        return;
    }
    var entry: Entry;
    entry.t = -FAR;
    entry.index = 0u;
    loop {
        entry = next_entry(ray, inverse, entry.t, entry.index, limits.y);
        if entry.index == NONE {
            finished = work <= frame.most_work;
            return;
        }
        if !walk(ray, entry, limits) {
            return;
        }
        if light.w < NEGLIGIBLE {
            finished = work <= frame.most_work;
            return;
        }
    }
}

/// Where a ray enters and leaves a box.
fn span(b: Box, ray: Ray, inverse: vec3f) -> vec2f {
    let low = (b.low - ray.origin) * inverse;
    let high = (b.high - ray.origin) * inverse;
    let near = min(low, high);
    let far = max(low, high);
    return vec2f(max(max(near.x, near.y), near.z) - SLACK, min(min(far.x, far.y), far.z) + SLACK);
}

/// The first face that the ray enters through after (`after`, `index`) and before `limit`.
fn next_entry(ray: Ray, inverse: vec3f, after: f32, index: u32, limit: f32) -> Entry {
    var best: Entry;
    best.t = limit;
    best.index = NONE;
    // The children of node n are 2n and 2n + 1; the root is node 1.
    var n = 1u;
    loop {
        work++;
        if work > frame.most_work {
            break;
        }
        let b = boxes(n - 1u);
        let inside = span(b, ray, inverse);
        let meets = b.low.x <= b.high.x && inside.x <= inside.y && inside.x <= best.t && inside.y >= after;
        if meets && n < frame.leaves {
            n *= 2u;
            continue;
        }
        if meets {
            let first = (n - frame.leaves) * LEAF;
            work += LEAF;
            for (var k = first; k < min(first + LEAF, frame.faces); k++) {
                let outer = faces(k);
                // Seen along a ray that enters, the face turns clockwise: its mirror image does not.
                let ids = outer.points.xzy;
                let a = project(ray, position(ids.x));
                let b = project(ray, position(ids.y));
                let c = project(ray, position(ids.z));
                let areas = areas_of(a, b, c);
                if !holds(a, b, c, areas) {
                    continue;
                }
                let t = dot(weights_of(areas), vec3f(a.z, b.z, c.z));
                let is_later = t > after || (t == after && k > index) || after == -FAR;
                if is_later && (t < best.t || (t == best.t && k < best.index)) {
                    best = Entry(t, k, outer.cell, ids, Face(a, b, c, areas));
                }
            }
        }
        // The next subtree: up from each right child, then to the right.
        n += 1u;
        n >>= countTrailingZeros(n);
        if n == 1u {
            break;
        }
    }
    return best;
}

fn position(i: u32) -> vec3f {
    let p = points(i);
    return vec3f(p.x, p.y, p.z);
}

/// Walks from an entry until the ray leaves the mesh or ends; false if it got lost.
fn walk(ray: Ray, entry: Entry, limits: vec2f) -> bool {
    var face = entry.face;
    var ids = entry.points;
    var cell = entry.cell;
    var t = entry.t;
    // How far along the ray nothing is to be gathered yet.
    var behind = max(limits.x - t, 0.0);
    var weights = weights_of(face.areas);
    var corners: Corners;
    var front: Value;
    if ASSOCIATION == POINT {
        corners = Corners(values(ids.x), values(ids.y), values(ids.z));
        front = interpolated(corners, weights);
    }
    for (var left = frame.most_steps; left > 0u; left--) {
        steps++;
        work++;
        if work > frame.most_work {
            return false;
        }
        let c = cells(cell);
        let apex = c.corners.x ^ c.corners.y ^ c.corners.z ^ c.corners.w ^ ids.x ^ ids.y ^ ids.z;
        let p = project(ray, position(apex));
        let stepped = step(face, p);
        if stepped.dropped == NOWHERE {
            return false;
        }
        let drops = vec3u(stepped.dropped) == vec3u(0u, 1u, 2u);
        var apex_value: Value;
        if ASSOCIATION == POINT {
            apex_value = values(apex);
        } else if ASSOCIATION == CORNER {
            let own = array<Value, 4>(values(4u * cell), values(4u * cell + 1u), values(4u * cell + 2u), values(4u * cell + 3u));
            corners = Corners(of_corner(own, c.corners, ids.x), of_corner(own, c.corners, ids.y), of_corner(own, c.corners, ids.z));
            apex_value = of_corner(own, c.corners, apex);
            front = interpolated(corners, weights);
        } else {
            front = values(cell);
        }
        // The apex is this far above the face that the ray entered through, measured along the ray.
        let rise = volumes(cell) / max(face.areas.x + face.areas.y + face.areas.z, TINY);

        let left_behind = select(select(ids.z, ids.y, drops.y), ids.x, drops.x);
        ids = select(ids, vec3u(apex), drops);
        face = Face(select(face.a, p, drops.x), select(face.b, p, drops.y), select(face.c, p, drops.z), stepped.areas);
        weights = weights_of(face.areas);
        var back = front;
        if ASSOCIATION != CELL {
            corners.a = select(corners.a, apex_value, drops.x);
            corners.b = select(corners.b, apex_value, drops.y);
            corners.c = select(corners.c, apex_value, drops.z);
            back = interpolated(corners, weights);
        }

        // The exact length of the segment comes from the volume, relative to itself; where it ends, from the corners.
        let share = dot(weights, select(vec3f(), vec3f(1.0), drops));
        let ahead = dot(weights, vec3f(face.a.z, face.b.z, face.c.z)) - t;
        let length = clamp(rise * share, ahead - SHARP, ahead + SHARP);
        if length <= behind {
            behind -= length;
        } else {
            let end = min(length, limits.y - t);
            if behind < end {
                gather(front, back, vec2f(behind, end) / length, end - behind);
            }
            behind = 0.0;
            if end < length || light.w < NEGLIGIBLE {
                return true;
            }
        }
        t += length;
        front = back;
        let beyond = vec4u(left_behind) == c.corners;
        cell = select(select(select(c.neighbours.w, c.neighbours.z, beyond.z), c.neighbours.y, beyond.y), c.neighbours.x, beyond.x);
        if cell == NONE {
            return true;
        }
    }
    return false;
}

/// The values at the corners of a face.
struct Corners {
    a: Value,
    b: Value,
    c: Value,
}

fn of_corner(own: array<Value, 4>, ids: vec4u, id: u32) -> Value {
    let at = vec4u(id) == ids;
    return select(select(select(own[3], own[2], at.z), own[1], at.y), own[0], at.x);
}

fn interpolated(corners: Corners, weights: vec3f) -> Value {
    let v = corners.a * weights.x + corners.b * weights.y + corners.c * weights.z;
    let seen = is_visible(corners.a) && is_visible(corners.b) && is_visible(corners.c);
    return select(Value(INVISIBLE), v, seen);
}

/// Adds the part `share` (from, to) of a segment, `length` long.
fn gather(front: Value, back: Value, share: vec2f, length: f32) {
    if !(is_visible(front) && is_visible(back)) {
        return;
    }
    let f = select(front + (back - front) * share.x, front, share.x == 0.0);
    let b = select(front + (back - front) * share.y, back, share.y == 1.0);
    if MAXIMUM {
        largest = select(largest, f, last_of(f) > last_of(largest));
        largest = select(largest, b, last_of(b) > last_of(largest));
    } else {
        add_segment(f, b, length);
    }
}
