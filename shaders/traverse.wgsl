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

/// All rays of a frame: that of column x and row y starts at origin · (1, x, y) and runs along direction · (1, x, y);
/// coordinates are the mesh's normalised ones.
struct RayUniforms {
    origin: array<DoubleSingle, 3>,
    direction: array<DoubleSingle, 3>,
    /// Width and height of the image, in pixels.
    size: vec2u,
    /// The rows that this dispatch draws.
    first_row: u32,
    rows: u32,
    /// The part of a ray that is seen, in lengths of its direction.
    near: f32,
    far: f32,
    planes: u32,
    /// Whether `ends` holds a value for each pixel of the image.
    has_ends: u32,
    /// Number of leaves of the hierarchy, of faces, of steps that no walk exceeds, and of loop iterations that no ray
    /// may.
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
    retraced: atomic<u32>,
    /// Panels that segments of two variables, or with light, were summed up in.
    panels: atomic<u32>,
}

@group(0) @binding(3) var<uniform> frame: RayUniforms;
/// Clipping planes: dot(p, plane.xyz) + plane.w ≥ 0 is kept.
@group(0) @binding(4) var<storage, read> planes: array<vec4f>;
/// Where each ray ends, for want of something nearer.
@group(0) @binding(5) var<storage, read> ends: array<f32>;
@group(0) @binding(6) var<storage, read_write> pixels: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> counts: Counts;

/// A boundary face that the ray enters through, and where.
struct Entry {
    t: f32,
    face: u32,
}

/// Entries found ahead of the walk, in order: a search that has to start again costs as much as finding several.
var<private> ahead: array<Entry, AHEAD>;
var<private> known: u32;

/// The largest values along a ray; the last of them at −FAR if there are none.
var<private> largest: Value;
var<private> steps: u32;
/// Whether all of the ray was walked: llvmpipe leaves loops after 65,535 iterations of all loops of 8 rays together, so
/// that rays which take much work are given up before, and the CPU draws them.
var<private> finished: bool;
/// Whether the ray may pass edges of the boundary as closely as it does.
var<private> accept_grazing: bool;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.rows {
        return;
    }
    let column = f32(id.x);
    let row = id.y + frame.first_row;
    let direction = affine(frame.direction, column, f32(row));
    let straight = ray_along(affine(frame.origin, column, f32(row)), direction);
    var limits = vec2f(frame.near, frame.far);
    if frame.has_ends != 0u {
        limits.y = min(limits.y, ends[row * frame.size.x + id.x]);
    }
    for (var k = 0u; k < frame.planes; k++) {
        let height = dot(straight.origin.high, planes[k].xyz) + planes[k].w;
        limits = clipped(limits, height, dot(direction.high, planes[k].xyz));
    }
    steps = 0u;
    work = 0u;
    trace(straight, limits);
    //#if SECOND
    finished = finished && !is_coarse;
    atomicAdd(&counts.panels, panels);
    //#end
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

/// Follows a ray. One that passes too close to an edge of the boundary is followed again beside its place: where faces
/// of the boundary touch without sharing their corners, rounding could let it slip through, or see some of it twice. No
/// ray gets lost in theory; should one, the same is done.
fn trace(straight: Ray, limits: vec2f) {
    var ray = straight;
    for (var attempt = 1u; attempt <= 3u; attempt++) {
        light = vec4f(0.0, 0.0, 0.0, 1.0);
        largest = Value(-FAR);
        finished = false;
        accept_grazing = attempt == 3u;
        follow(ray, limits);
        if finished || work > frame.most_work {
            return;
        }
        let perturbation = PERTURBATION * f32(attempt);
        ray.origin.low = straight.origin.low + (straight.right + straight.up * 0.618) * perturbation;
        atomicAdd(&counts.retraced, select(0u, 1u, attempt == 1u));
    }
}

/// Whether nothing behind can be seen.
fn is_terminated() -> bool {
    return light.w < LEAST_TRANSMITTANCE;
}

/// Walks from each entry to the next.
fn follow(ray: Ray, limits: vec2f) {
    let along = ray.along * ray.length;
    let inverse = 1.0 / select(along, vec3f(1e-20), abs(along) < vec3f(1e-20));
    let inside = span(boxes(0u), ray, inverse);
    if inside.x > inside.y || inside.y < limits.x || inside.x > limits.y || limits.x >= limits.y {
        finished = true;
        return;
    }
    var entry = Entry(-FAR, 0u);
    loop {
        if !find_entries(ray, inverse, entry, limits.y) {
            return;
        }
        for (var k = 0u; k < known && work <= frame.most_work; k++) {
            work++;
            entry = ahead[k];
            if !walk(ray, entry, limits) {
                return;
            }
            if is_terminated() {
                known = 0u;
            }
        }
        if known < AHEAD {
            finished = work <= frame.most_work;
            return;
        }
    }
}

/// Where a ray enters and leaves a box.
fn span(b: Box, ray: Ray, inverse: vec3f) -> vec2f {
    let low = (b.low - ray.origin.high) * inverse;
    let high = (b.high - ray.origin.high) * inverse;
    let near = min(low, high);
    let far = max(low, high);
    return vec2f(max(max(near.x, near.y), near.z) - SLACK, min(min(far.x, far.y), far.z) + SLACK);
}

/// Finds the first faces that the ray enters through after `last` and before `limit`; false if it is too close to an
/// edge of any.
fn find_entries(ray: Ray, inverse: vec3f, last: Entry, limit: f32) -> bool {
    known = 0u;
    var clear = true;
    var farthest = limit;
    // The children of node n are 2n and 2n + 1; the root is node 1.
    var n = 1u;
    loop {
        work++;
        if work > frame.most_work {
            break;
        }
        let b = boxes(n - 1u);
        let inside = span(b, ray, inverse);
        let meets = b.low.x <= b.high.x && inside.x <= inside.y && inside.x <= farthest && inside.y >= last.t;
        if meets && n < frame.leaves {
            n *= 2u;
            continue;
        }
        if meets {
            let first = (n - frame.leaves) * LEAF;
            work += LEAF + 1u;
            for (var k = first; k < min(first + LEAF, frame.faces); k++) {
                let face = face_of(ray, entering(faces(k).points));
                if !holds(face.a, face.b, face.c, face.areas) {
                    continue;
                }
                let depth = depth_of(face, weights_of(face.areas));
                let entry = Entry(depth.x + depth.y, k);
                if entry.t < limit && (last.t == -FAR || is_before(last, entry)) {
                    insert(entry);
                    clear = clear && is_clear(face);
                    farthest = select(limit, ahead[AHEAD - 1u].t, known == AHEAD);
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
    return clear;
}

/// Whether a ray passes a face of the boundary beside its edges, as far as places across it can tell.
fn is_clear(face: Face) -> bool {
    if accept_grazing {
        return true;
    }
    let across = max(max(abs(face.a.xy), abs(face.b.xy)), abs(face.c.xy));
    let edges = vec3f(distance(face.b.xy, face.c.xy), distance(face.c.xy, face.a.xy), distance(face.a.xy, face.b.xy));
    return all(face.areas > CLOSE * max(across.x, across.y) * edges);
}

fn is_before(a: Entry, b: Entry) -> bool {
    return a.t < b.t || (a.t == b.t && a.face < b.face);
}

/// Puts an entry into its place among those known; the last one goes if there are too many.
fn insert(entry: Entry) {
    var k = min(known, AHEAD - 1u);
    if known == AHEAD && !is_before(entry, ahead[k]) {
        return;
    }
    known = min(known + 1u, AHEAD);
    while k > 0u && is_before(entry, ahead[k - 1u]) {
        work++;
        ahead[k] = ahead[k - 1u];
        k--;
    }
    ahead[k] = entry;
}

/// Seen along a ray that enters, a face turns clockwise: its mirror image does not.
fn entering(points: vec3u) -> vec3u {
    return points.xzy;
}

fn face_of(ray: Ray, ids: vec3u) -> Face {
    let a = project(ray, position(ids.x));
    let b = project(ray, position(ids.y));
    let c = project(ray, position(ids.z));
    return Face(a, b, c, areas_of(a, b, c));
}

fn position(i: u32) -> DoubleSingle {
    let p = points(i);
    return DoubleSingle(high_of(p), low_of(p));
}

/// Walks from an entry until the ray leaves the mesh or ends; false if it got lost.
fn walk(ray: Ray, entry: Entry, limits: vec2f) -> bool {
    let outer = faces(entry.face);
    var ids = entering(outer.points);
    var face = face_of(ray, ids);
    var cell = outer.cell;
    // How far along the ray nothing is to be gathered yet.
    var behind = max(limits.x - entry.t, 0.0) * ray.length;
    var weights = weights_of(face.areas);
    var entered = depth_of(face, weights);
    var corners: Corners;
    var front: Value;
    if ASSOCIATION == POINT {
        corners = Corners(values(ids.x), values(ids.y), values(ids.z));
        front = interpolated(corners, weights);
        //#if LIT
        enter_lit(ids, weights);
        //#end
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
        //#if LIT
        meet_lit(cell, c.corners, ids, apex, weights);
        //#end
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
        //#if LIT
        leave_lit(drops, weights);
        //#end

        // The length comes from the volume, which is right in the thinnest cell. But in one that is seen edge-on the
        // areas are not, and the depths of the corners are.
        let share = dot(weights, select(vec3f(), vec3f(1.0), drops));
        let left_at = depth_of(face, weights);
        let ahead = depth_between(entered, left_at) * ray.length;
        let doubt = BLUR * extent(face, p);
        let length = clamp(rise * share, ahead - doubt, ahead + doubt);
        if length <= behind {
            behind -= length;
        } else {
            let end = min(length, (limits.y - (entered.x + entered.y)) * ray.length);
            if behind < end {
                //#if LIT
                light_from(ray, (entered.x + entered.y) * ray.length + behind, vec2f(behind, end) / length);
                //#end
                //#if SECOND
                if may_be_seen(cell) {
                //#end
                gather(front, back, vec2f(behind, end) / length, end - behind);
                //#if SECOND
                }
                //#end
            }
            behind = 0.0;
            if end < length || is_terminated() {
                return true;
            }
        }
        entered = left_at;
        front = back;
        //#if LIT
        slope_front = slope_back;
        //#end
        let beyond = vec4u(left_behind) == c.corners;
        cell = select(select(select(c.neighbours.w, c.neighbours.z, beyond.z), c.neighbours.y, beyond.y), c.neighbours.x, beyond.x);
        if cell == NONE {
            return is_clear(face);
        }
    }
    return false;
}

/// How far the corners of a face, and `p`, are from the ray and from each other along it, at most and about.
fn extent(face: Face, p: vec4f) -> f32 {
    let across = max(max(abs(face.a.xy), abs(face.b.xy)), max(abs(face.c.xy), abs(p.xy)));
    let b = depth_between(face.a.zw, face.b.zw);
    let c = depth_between(face.a.zw, face.c.zw);
    return max(max(across.x, across.y), max(abs(b), abs(c)));
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
    // Differences to one corner, which are small: weights that are off by 1e-7 must not shift a value by as much. It is that
    // of the least size: those that function and values are about are near 0, and differences to an outlier lose them.
    let b_is_least = abs(last_of(corners.b)) < abs(last_of(corners.a)) && abs(last_of(corners.b)) <= abs(last_of(corners.c));
    let c_is_least = abs(last_of(corners.c)) < abs(last_of(corners.a)) && abs(last_of(corners.c)) < abs(last_of(corners.b));
    let base = select(select(corners.a, corners.b, b_is_least), corners.c, c_is_least);
    let v = base + (((corners.a - base) * weights.x + (corners.b - base) * weights.y) + (corners.c - base) * weights.z);
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
        add(f, b, length);
    }
}
