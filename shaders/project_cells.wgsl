// The compute stages: which cells are seen and how deep (`classify`), and what is drawn of each (`project`).

/// A part of the cells, or of the order.
struct Part {
    first: u32,
    count: u32,
    /// Invocations of one row of the dispatch.
    row: u32,
    /// The place of the first in the whole order.
    rank: u32,
}

@group(2) @binding(0) var<uniform> part: Part;
/// For each end of the BINS equal bins of the values' range: in how many below it something may be seen, and its line.
@group(2) @binding(1) var<storage, read> bins: array<vec2u>;
@group(2) @binding(2) var<storage, read_write> keys: array<u32>;
/// Cells from back to front, and, from bit PART on, how many parts of the cell came before.
@group(2) @binding(3) var<storage, read> order: array<u32>;
@group(2) @binding(4) var<storage, read_write> primitives: array<Primitive>;

/// Relative to the frame's base.
fn place(p: Point) -> vec3f {
    return (high_of(p) - frame.base.xyz) + (low_of(p) - frame.base_low.xyz);
}

fn double_single_of(p: Point) -> DoubleSingle {
    return DoubleSingle(high_of(p), low_of(p));
}

/// A tetrahedron: its corners relative to the frame's base, and in the mesh's own coordinates.
struct Solid {
    p: array<vec3f, 4>,
    corners: array<DoubleSingle, 4>,
}

fn solid_of(cell: vec4u) -> Solid {
    let a = points(cell.x);
    let b = points(cell.y);
    let c = points(cell.z);
    let d = points(cell.w);
    return Solid(
        array<vec3f, 4>(place(a), place(b), place(c), place(d)),
        array<DoubleSingle, 4>(double_single_of(a), double_single_of(b), double_single_of(c), double_single_of(d)),
    );
}

fn values_of(cell: u32, corners: vec4u) -> array<Value, 4> {
    if ASSOCIATION == POINT {
        return array<Value, 4>(values(corners.x), values(corners.y), values(corners.z), values(corners.w));
    } else if ASSOCIATION == CORNER {
        return array<Value, 4>(values(4u * cell), values(4u * cell + 1u), values(4u * cell + 2u), values(4u * cell + 3u));
    }
    let v = values(cell);
    return array<Value, 4>(v, v, v, v);
}

fn least_of(v: vec4f) -> f32 {
    return min(min(v.x, v.y), min(v.z, v.w));
}

fn greatest_of(v: vec4f) -> f32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}

/// What a number of f32 is off by, of itself.
const ROUNDING = 6e-8;

/// The end of a bin below `s`, one further than needed: rounding.
fn end_below(s: f32) -> i32 {
    return max(i32(clamp((s + 1.0) * (f32(BINS) / 2.0), 0.0, f32(BINS))) - 1, 0);
}

/// Whether the function shows anything of a cell whose values are between two.
fn shows(low: f32, high: f32) -> bool {
    return bins[min(end_below(high) + 3, i32(BINS))].x > bins[end_below(low)].x;
}

/// The line of the least of a cell's values.
fn line_at(low: f32, high: f32) -> u32 {
    var i = bins[end_below(low)].y;
    var ends = ends_of(i);
    loop {
        // No knot is above 1, but this ends whatever is one.
        if ends.y > min(low, 2.0) {
            break;
        }
        i++;
        ends = ends_of(i);
    }
    return select(i, u32(ends.z), low == high && low == ends.x && ends.z != 0.0);
}

/// A key that falls as the depth rises, and ends with one less than the number of parts that the cell is drawn in; HIDDEN if
/// nothing of the cell is seen.
fn key_of(cell: u32) -> u32 {
    let corners = cells(cell);
    let v = values_of(cell, corners);
    if !(is_visible(v[0]) && is_visible(v[1]) && is_visible(v[2]) && is_visible(v[3])) {
        return HIDDEN;
    }
    //#if SECOND
    if !may_be_seen(cell) {
        return HIDDEN;
    }
    //#end
    //#if LIT
    hold_slopes(cell, corners);
    if !has_slopes() {
        return HIDDEN;
    }
    //#end
    let s = vec4f(last_of(v[0]), last_of(v[1]), last_of(v[2]), last_of(v[3]));
    if !SHOWS_ALL && !shows(least_of(s), greatest_of(s)) {
        return HIDDEN;
    }
    let p = solid_of(corners).p;
    let a = seen(p[0]);
    let b = seen(p[1]);
    let c = seen(p[2]);
    let d = seen(p[3]);
    let x = vec4f(a.x, b.x, c.x, d.x);
    let y = vec4f(a.y, b.y, c.y, d.y);
    let w = vec4f(a.z, b.z, c.z, d.z);
    // Beside the image, behind the eye, or cut off. Of a picture that shows a millionth of the mesh f32 tells no places.
    let away = max(max(dot(p[0], p[0]), dot(p[1], p[1])), max(dot(p[2], p[2]), dot(p[3], p[3])));
    let slack = 4.0 * ROUNDING * sqrt(away) * max(length(frame.across[0].xyz), length(frame.across[1].xyz)) / least_of(max(w, vec4f(1e-6)));
    let edge = vec2f(1.0 + slack) + abs(frame.offset) + 4.0 / frame.size;
    let z = vec4f(dot(p[0], frame.forward.xyz), dot(p[1], frame.forward.xyz), dot(p[2], frame.forward.xyz), dot(p[3], frame.forward.xyz));
    if all(x > edge.x * w) || all(x < -edge.x * w) || all(y > edge.y * w) || all(y < -edge.y * w)
        || all(w <= vec4f(0.0)) || all(z < vec4f(frame.near)) || all(z > vec4f(frame.far)) {
        return HIDDEN;
    }
    for (var k = 0u; HAS_PLANES && k < frame.planes; k++) {
        let n = planes[k].xyz;
        if all(vec4f(dot(p[0], n), dot(p[1], n), dot(p[2], n), dot(p[3], n)) + planes[k].w < vec4f(0.0)) {
            return HIDDEN;
        }
    }
    if all(w >= vec4f(frame.nearest)) {
        // Between the centres of pixels.
        let left = (x / w - frame.offset.x + 1.0) * (0.5 * frame.size.x);
        let down = (1.0 + frame.offset.y - y / w) * (0.5 * frame.size.y);
        let grown = 2.0 * GROWTH + slack * 0.5 * frame.size;
        let low = ceil(vec2f(least_of(left), least_of(down)) - 0.5 - grown);
        let high = floor(vec2f(greatest_of(left), greatest_of(down)) - 0.5 + grown);
        if any(low > high) {
            return HIDDEN;
        }
    }
    // Of the squared distance from the eye; its digits are kept where the eye is far.
    let middle = (p[0] + p[1] + p[2] + p[3]) * 0.25;
    var depth = dot(middle, frame.forward.xyz);
    if PERSPECTIVE {
        depth = (dot(middle, middle) + 2.0 * frame.forward.w * depth) / max(2.0 * frame.forward.w, 1.0);
    }
    let bits = bitcast<u32>(depth);
    let ascending = select(bits | 0x80000000u, ~bits, (bits >> 31u) == 1u);
    // Forms that interpolate draw what is left of a cell around the eye as up to three tetrahedra. No finite depth gives
    // HIDDEN.
    let parts = select(1u, 3u, FORM != INTERSECTED && any(w < vec4f(frame.nearest)));
    return (~ascending & ~(MOST_PARTS - 1u)) | (parts - 1u);
}

@compute @workgroup_size(64)
fn classify(@builtin(global_invocation_id) id: vec3u) {
    let i = id.y * part.row + id.x;
    if i < part.count {
        keys[i] = key_of(part.first + i);
    }
}

@compute @workgroup_size(64)
fn project_all(@builtin(global_invocation_id) id: vec3u) {
    let i = id.y * part.row + id.x;
    if i >= part.count {
        return;
    }
    let entry = order[part.first + i];
    let cell = entry & ((1u << PART) - 1u);
    let corners = cells(cell);
    //#if LIT
    hold_slopes(cell, corners);
    //#end
    write_primitive(i, solid_of(corners), values_of(cell, corners), entry >> PART, part.rank + i);
}

/// How the four directions from the eye to the corners depend on each other: Σ a p = 0, the sum of a being six volumes.
/// For a parallel view, of the projected corners. (Kraus, Qiao & Ebert 2004 call for the thick vertex; this is it, for
/// all cases.)
fn dependency(p: array<vec3f, 4>) -> vec4f {
    let b = p[1] - p[0];
    let c = p[2] - p[0];
    let d = p[3] - p[0];
    let normals = array<vec3f, 3>(cross(c, d), cross(d, b), cross(b, c));
    let from_eye = select(frame.direction[0].xyz, p[0] + frame.direction[0].xyz * frame.forward.w, PERSPECTIVE);
    let rest = -vec3f(dot(from_eye, normals[0]), dot(from_eye, normals[1]), dot(from_eye, normals[2]));
    let volume = select(0.0, dot(b, normals[0]), PERSPECTIVE);
    return vec4f(volume - rest.x - rest.y - rest.z, rest);
}

/// The corners on the outline of a cell with this dependency, in sequence around it; three have the first again as
/// fourth.
fn outline(a: vec4f) -> vec4u {
    // The side of fewer corners first: one is inside the outline, two are opposite corners of it.
    let positive = a > vec4f(0.0);
    let count = u32(positive.x) + u32(positive.y) + u32(positive.z) + u32(positive.w);
    let few = select(positive, !positive, vec4<bool>(count > 2u));
    if count == 2u {
        let i = select(select(select(3u, 2u, few.z), 1u, few.y), 0u, few.x);
        let j = select(select(select(0u, 1u, few.y), 2u, few.z), 3u, few.w);
        let others = 6u - i - j;
        // The other two: the smallest index that is free, and the rest.
        let k = select(select(2u, 1u, i != 1u && j != 1u), 0u, i != 0u && j != 0u);
        return vec4u(i, k, j, others - k);
    }
    let inside = select(select(select(3u, 2u, few.z), 1u, few.y), 0u, few.x);
    return select(select(select(vec4u(0u, 1u, 2u, 0u), vec4u(0u, 1u, 3u, 0u), inside == 2u), vec4u(0u, 2u, 3u, 0u), inside == 1u), vec4u(1u, 2u, 3u, 1u), inside == 0u);
}
