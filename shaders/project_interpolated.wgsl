// The forms that interpolate between the corners of a cell's projection and the point where it is thickest.
//
// Kraus, Qiao & Ebert 2004, section 2: of a linear function f only f/w and 1/w are linear on the screen, on the front
// and on the back; their quotient is what a fragment needs.

// A primitive is a fan of triangles around the thickest point, which is the first vertex; the outline follows. Each vertex
// has the values on the front and on the back (for INTERPOLATED, over w), 1/w (depth in a parallel view) of both, how
// much they differ, and how long the ray's way is. The attributes of a primitive:
// 0    the middle of a pixel at the thickest point, and the depths between which rays are seen (t in a parallel view);
// 1–2  the stretch of rays around it; and the longest edge;
// 3    the rank, and which plane of a cylindrical table holds the thickest point;
// then the line of the function that the least value is on.
// The values: the least and the greatest.

/// To pixels from the upper left corner of the image.
fn pixel_of(p: vec3f) -> vec2f {
    return (vec2f(p.x, -p.y) / p.z + vec2f(1.0 - frame.offset.x, 1.0 + frame.offset.y)) * 0.5 * frame.size;
}

/// 1/w, or depth in a parallel view.
fn reach_of(p: vec3f) -> f32 {
    let along = dot(p, frame.forward.xyz);
    return select(along, 1.0 / (along + frame.forward.w), PERSPECTIVE);
}

/// A piece of a cell, its corners and values; false if it is none.
struct Piece {
    p: array<vec3f, 4>,
    v: array<Value, 4>,
    exists: bool,
}

/// A primitive of nothing.
fn write_nothing(i: u32) {
    for (var k = 0u; k < 5u; k++) {
        primitives[i].vertices[k].corner = vec2f(-9.0);
    }
}

fn write_vertex(i: u32, k: u32, corner: vec2f, front: Value, back: Value, depths: vec4f) {
    let is_over_w = FORM == INTERPOLATED && PERSPECTIVE;
    primitives[i].vertices[k].corner = corner;
    primitives[i].vertices[k].front = front * select(1.0, depths.x, is_over_w);
    primitives[i].vertices[k].back = back * select(1.0, depths.y, is_over_w);
    primitives[i].vertices[k].depths = depths;
}

/// Whether the eye and `apex` are on the same side of a face.
fn is_before(face: array<vec3f, 3>, apex: vec3f) -> bool {
    let n = cross(face[1] - face[0], face[2] - face[0]);
    let eye = -frame.direction[0].xyz * frame.forward.w;
    return dot(eye - face[0], n) * dot(apex - face[0], n) > 0.0;
}

/// The piece of a cell that lies behind the plane at the depth `frame.nearest`; the first is the farthest. With one
/// corner behind the plane, the first piece is all; with two or three, a wedge is left, which is three tetrahedra.
fn cut(whole: array<vec3f, 4>, whole_values: array<Value, 4>, piece: u32) -> Piece {
    // Corners behind the plane first.
    var behind = array<u32, 4>(0u, 1u, 2u, 3u);
    var depths = array<f32, 4>(0.0, 0.0, 0.0, 0.0);
    var first = 0u;
    var last = 4u;
    var p = whole;
    var v = whole_values;
    for (var i = 0u; i < 4u; i++) {
        depths[i] = seen(p[i]).z - frame.nearest;
        if depths[i] >= 0.0 {
            behind[first] = i;
            first++;
        } else {
            last--;
            behind[last] = i;
        }
    }
    if first == 4u || first == 0u || (first == 1u && piece > 0u) {
        return Piece(p, v, first == 4u && piece == 0u);
    }
    // The six corners of the wedge: those behind the plane, and where edges cross it. One triangle of it is 0, 1, 2;
    // the edges to the other end in 3, 4, 5. Any four in sequence are a tetrahedron. With two corners behind, either
    // has a triangle with its two crossings; with three, one triangle is the crossings.
    var corners: array<vec3f, 6>;
    var values: array<Value, 6>;
    for (var i = 0u; i < first; i++) {
        let a = behind[i];
        let own = select(3u + i, 3u * i, first == 2u);
        corners[own] = p[a];
        values[own] = v[a];
        for (var j = first; j < 4u; j++) {
            let b = behind[j];
            let share = depths[a] / (depths[a] - depths[b]);
            let n = select(select(j - 1u, own + j - 1u, first == 2u), i, first == 3u);
            corners[n] = p[a] + (p[b] - p[a]) * share;
            values[n] = v[a] + (v[b] - v[a]) * share;
        }
    }
    // The first and the last tetrahedron are each cut off by a plane: they are before or behind both of the others.
    var at = 0u;
    if first > 1u {
        let first_before = is_before(array<vec3f, 3>(corners[1], corners[2], corners[3]), corners[0]);
        let last_before = is_before(array<vec3f, 3>(corners[2], corners[3], corners[4]), corners[5]);
        let sequence = select(
            select(vec3u(0u, 2u, 1u), vec3u(0u, 1u, 2u), last_before),
            select(vec3u(2u, 1u, 0u), vec3u(1u, 0u, 2u), last_before),
            first_before,
        );
        at = sequence[piece];
    }
    for (var i = 0u; i < 4u; i++) {
        p[i] = corners[at + i];
        v[i] = values[at + i];
    }
    return Piece(p, v, true);
}

/// The corners of an outline so that it turns anticlockwise. Where rounding puts the thickest point outside, one
/// triangle of the fan turns the other way: it lies on the others, and is not drawn.
fn anticlockwise(corners: array<vec3f, 4>, around: vec4u) -> vec4u {
    var p = corners;
    let a = pixel_of(seen(p[around.z])) - pixel_of(seen(p[around.x]));
    let b = pixel_of(seen(p[around.w])) - pixel_of(seen(p[around.y]));
    return select(around, around.xwzy, a.x * b.y - a.y * b.x > 0.0);
}

fn write_primitive(i: u32, whole: Solid, values: array<Value, 4>, piece: u32, rank: u32) {
    let corners = whole.p;
    var p = corners;
    var v = values;
    if PERSPECTIVE {
        let left = cut(p, v, piece);
        if !left.exists {
            write_nothing(i);
            return;
        }
        p = left.p;
        v = left.v;
    }
    let a = dependency(p);
    let around = anticlockwise(p, outline(a));
    // Both sides of Σ a p = 0 give the same pixel: the front and the back of the thickest point.
    let positive = max(a, vec4f(0.0));
    let negative = max(-a, vec4f(0.0));
    let sums = vec2f(positive.x + positive.y + positive.z + positive.w, negative.x + negative.y + negative.z + negative.w);
    if !(sums.x > 0.0 && sums.y > 0.0) {
        write_nothing(i);
        return;
    }
    var one = positive / sums.x;
    var other = negative / sums.y;
    let edges = array<vec3f, 3>(p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let between = other - one;
    let apart = edges[0] * between.y + edges[1] * between.z + edges[2] * between.w;
    let is_behind = dot(apart, frame.forward.xyz) >= 0.0;
    if !is_behind {
        let swapped = one;
        one = other;
        other = swapped;
    }
    let front = p[0] + edges[0] * one.y + edges[1] * one.z + edges[2] * one.w;
    let back = p[0] + edges[0] * other.y + edges[1] * other.z + edges[2] * other.w;
    let front_depth = reach_of(front);
    let back_depth = reach_of(back);
    let deeper = abs(dot(apart, frame.forward.xyz));
    let difference = select(deeper, deeper * front_depth * back_depth, PERSPECTIVE);
    let inside = seen(front + (back - front) * 0.5);
    let low = min(min(v[0], v[1]), min(v[2], v[3]));
    let high = max(max(v[0], v[1]), max(v[2], v[3]));
    let longest = max(max(max(length(edges[0]), length(edges[1])), max(length(edges[2]), distance(p[1], p[2]))), max(distance(p[1], p[3]), distance(p[2], p[3])));
    let front_value = v[0] * one.x + v[1] * one.y + v[2] * one.z + v[3] * one.w;
    let back_value = v[0] * other.x + v[1] * other.y + v[2] * other.z + v[3] * other.w;
    let thickness = length(apart);
    write_vertex(i, 0u, pixel_of(inside), front_value, back_value, vec4f(front_depth, back_depth, difference, thickness));
    for (var k = 0u; k < 4u; k++) {
        let c = around[k];
        let reach = reach_of(p[c]);
        write_vertex(i, k + 1u, pixel_of(seen(p[c])), v[c], v[c], vec4f(reach, reach, 0.0, 0.0));
    }
    var plane = 0.0;
    if PLANE_PER_CELL {
        plane = plane_of(last_of(front_value), last_of(back_value), thickness);
    }
    var attributes: array<vec4f, 4>;
    let centre = floor(clamp(pixel_of(inside), vec2f(0.0), frame.size - 1.0)) + 0.5;
    let stretch = stretch_around(direction_at(sample_of(centre)), 1.0);
    attributes[0] = vec4f(centre, vec2f(frame.near, frame.far) + frame.forward.w);
    attributes[1] = vec4f(stretch[0], longest);
    attributes[2] = vec4f(stretch[1], 0.0);
    attributes[3] = vec4f(f32(rank & 0xffffffu), plane, 0.0, 0.0);
    store(i, attributes, vec4f(), last_of(low), last_of(high), Values(low, high));
}
