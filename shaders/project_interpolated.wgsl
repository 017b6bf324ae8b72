// The forms that interpolate between the corners of a cell's projection and the point where it is thickest.
//
// Kraus, Qiao & Ebert 2004, section 2: of a linear function f only f/w and 1/w are linear on the screen, on the front and on
// the back; their quotient is what a fragment needs.

/// What is drawn of a cell: a fan of triangles around its thickest point.
struct Record {
    /// In pixels: around the outline, and of the thickest point.
    outline: array<vec2f, 4>,
    thick: vec2f,
    /// The rank, and the longest edge.
    rank: u32,
    longest: f32,
    /// Of the outline's corners: 1/w, or depth in a parallel view.
    depths: array<f32, 4>,
    /// The same of the front and the back of the thickest point, and how much they differ.
    front_depth: f32,
    back_depth: f32,
    difference: f32,
    /// Of the thickest point: how long the ray's way is.
    thickness: f32,
    /// The interval of the function that the least value is in.
    interval: u32,
    unused: u32,
    /// Of the outline's corners, and of the front and the back of the thickest point.
    values: array<Value, 4>,
    front: Value,
    back: Value,
    /// The range of the corners' values.
    least: Value,
    greatest: Value,
}

/// To pixels from the upper left corner of the image.
fn pixel_of(p: vec3f) -> vec2f {
    return (vec2f(p.x, -p.y) / p.z + vec2f(1.0 - frame.offset.x, 1.0 + frame.offset.y)) * 0.5 * frame.size;
}

/// 1/w, or depth in a parallel view.
fn reach_of(p: vec3f) -> f32 {
    let along = dot(p, frame.forward.xyz);
    return select(along, 1.0 / (along + frame.forward.w), frame.perspective == 1u);
}

/// A piece of a cell, its corners and values; false if it is none.
struct Piece {
    p: array<vec3f, 4>,
    v: array<Value, 4>,
    exists: bool,
}

/// A record of nothing.
fn nothing(p: array<vec3f, 4>, v: array<Value, 4>, rank: u32) -> Record {
    let at = array<vec2f, 4>(vec2f(-9.0), vec2f(-9.0), vec2f(-9.0), vec2f(-9.0));
    return Record(at, vec2f(-9.0), rank, 0.0, array<f32, 4>(1.0, 1.0, 1.0, 1.0), 1.0, 1.0, 0.0, 0.0, 0u, 0u, v, v[0], v[0], v[0], v[0]);
}

/// The piece of a cell that lies behind the plane at the depth `frame.nearest`. With one corner behind it, the first piece is all;
/// with two or three, a wedge is left, which is three tetrahedra.
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
    if first == 4u || first == 0u {
        return Piece(p, v, first == 4u && piece == 0u);
    }
    // The six corners of what is left: those behind the plane, and where edges cross it.
    var corners: array<vec3f, 6>;
    var values: array<Value, 6>;
    var n = 0u;
    for (var i = 0u; i < first; i++) {
        for (var j = first; j < 4u; j++) {
            let a = behind[i];
            let b = behind[j];
            let share = depths[a] / (depths[a] - depths[b]);
            corners[n] = p[a] + (p[b] - p[a]) * share;
            values[n] = v[a] + (v[b] - v[a]) * share;
            n++;
        }
    }
    var at = vec4u(0u, 1u, 2u, 3u);
    if first == 1u {
        if piece > 0u {
            return Piece(p, v, false);
        }
        corners[3] = p[behind[0]];
        values[3] = v[behind[0]];
    } else {
        if first == 2u {
            // Two triangles: a corner behind and its two crossings; the crossings are 0, 1 and 2, 3.
            corners[4] = p[behind[0]];
            values[4] = v[behind[0]];
            corners[5] = p[behind[1]];
            values[5] = v[behind[1]];
            at = select(select(vec4u(4u, 0u, 1u, 5u), vec4u(0u, 1u, 5u, 2u), piece == 1u), vec4u(1u, 5u, 2u, 3u), piece == 2u);
        } else {
            // Two triangles: the crossings 0, 1, 2 and the corners behind, 3, 4, 5.
            for (var i = 0u; i < 3u; i++) {
                corners[3u + i] = p[behind[i]];
                values[3u + i] = v[behind[i]];
            }
            at = select(select(vec4u(0u, 1u, 2u, 3u), vec4u(1u, 2u, 3u, 4u), piece == 1u), vec4u(2u, 3u, 4u, 5u), piece == 2u);
        }
    }
    for (var i = 0u; i < 4u; i++) {
        p[i] = corners[at[i]];
        v[i] = values[at[i]];
    }
    return Piece(p, v, true);
}

/// The corners of an outline so that it turns anticlockwise. Where rounding puts the thickest point outside, one triangle of the fan turns
/// the other way: it lies on the others, and is not drawn.
fn anticlockwise(corners: array<vec3f, 4>, around: vec4u) -> vec4u {
    var p = corners;
    let a = pixel_of(seen(p[around.z])) - pixel_of(seen(p[around.x]));
    let b = pixel_of(seen(p[around.w])) - pixel_of(seen(p[around.y]));
    return select(around, around.xwzy, a.x * b.y - a.y * b.x > 0.0);
}

fn record_of(whole: Solid, values: array<Value, 4>, piece: u32, rank: u32) -> Record {
    let corners = whole.p;
    var p = corners;
    var v = values;
    if frame.perspective == 1u {
        let left = cut(p, v, piece);
        if !left.exists {
            return nothing(corners, values, rank);
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
        return nothing(corners, values, rank);
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
    let difference = select(deeper, deeper * front_depth * back_depth, frame.perspective == 1u);
    let inside = seen(front + (back - front) * 0.5);
    let low = min(min(v[0], v[1]), min(v[2], v[3]));
    let high = max(max(v[0], v[1]), max(v[2], v[3]));
    let longest = max(max(max(length(edges[0]), length(edges[1])), max(length(edges[2]), distance(p[1], p[2]))), max(distance(p[1], p[3]), distance(p[2], p[3])));
    return Record(
        array<vec2f, 4>(pixel_of(seen(p[around.x])), pixel_of(seen(p[around.y])), pixel_of(seen(p[around.z])), pixel_of(seen(p[around.w]))),
        pixel_of(inside),
        rank,
        longest,
        array<f32, 4>(reach_of(p[around.x]), reach_of(p[around.y]), reach_of(p[around.z]), reach_of(p[around.w])),
        front_depth,
        back_depth,
        difference,
        length(apart),
        interval_of(last_of(low)),
        0u,
        array<Value, 4>(v[around.x], v[around.y], v[around.z], v[around.w]),
        v[0] * one.x + v[1] * one.y + v[2] * one.z + v[3] * one.w,
        v[0] * other.x + v[1] * other.y + v[2] * other.z + v[3] * other.w,
        low,
        high,
    );
}
