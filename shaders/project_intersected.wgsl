// The form that intersects each pixel's ray with the cell: the outline only says which pixels may be met.

/// What is drawn of a cell: a quadrilateral, and the cell as fragments need it.
struct Record {
    /// Places relative to the frame's base; w of the first: six volumes, of the second: the rank.
    corners: array<vec4f, 4>,
    outline: array<vec2f, 4>,
    values: array<Value, 4>,
}

/// To pixels from the upper left corner of the image.
fn pixel_of(p: vec3f) -> vec2f {
    return (vec2f(p.x, -p.y) / p.z + vec2f(1.0 - frame.offset.x, 1.0 + frame.offset.y)) * 0.5 * frame.size;
}

/// The smallest upright rectangle around what is seen of a cell some of whose corners are beside or behind the eye.
fn box_of(p: array<vec3f, 4>) -> array<vec2f, 4> {
    var all = array<vec3f, 4>(seen(p[0]), seen(p[1]), seen(p[2]), seen(p[3]));
    var low = vec2f(FAR);
    var high = vec2f(-FAR);
    for (var i = 0u; i < 4u; i++) {
        let a = all[i];
        if a.z >= BESIDE {
            low = min(low, pixel_of(a));
            high = max(high, pixel_of(a));
        }
        for (var j = 0u; j < i; j++) {
            let b = all[j];
            if (a.z >= BESIDE) != (b.z >= BESIDE) {
                let cut = pixel_of(vec3f(mix(a.xy, b.xy, (BESIDE - a.z) / (b.z - a.z)), BESIDE));
                low = min(low, cut);
                high = max(high, cut);
            }
        }
    }
    low = clamp(low - 1.0, vec2f(-1.0), frame.size);
    high = clamp(high + 1.0, vec2f(0.0), frame.size + 1.0);
    return array<vec2f, 4>(low, vec2f(high.x, low.y), high, vec2f(low.x, high.y));
}

/// The corners `q` around an outline, of which the fourth may be the first, moved outward so that all edges are GROWTH further out.
fn grown(corners: array<vec2f, 4>) -> array<vec2f, 4> {
    var q = corners;
    var moved = q;
    let is_triangle = all(q[3] == q[0]);
    let n = select(4u, 3u, is_triangle);
    let diagonals = select((q[2].x - q[0].x) * (q[3].y - q[1].y) - (q[2].y - q[0].y) * (q[3].x - q[1].x),
        (q[1].x - q[0].x) * (q[2].y - q[0].y) - (q[1].y - q[0].y) * (q[2].x - q[0].x), is_triangle);
    let turn = select(-1.0, 1.0, diagonals > 0.0);
    var sharp = false;
    for (var i = 0u; i < n; i++) {
        let before = q[i] - q[(i + n - 1u) % n];
        let after = q[(i + 1u) % n] - q[i];
        let lengths = vec2f(length(before), length(after));
        let u = before / lengths.x;
        let v = after / lengths.y;
        // Outward normals of the edges before and after, and the way out between them.
        let out = (vec2f(u.y, -u.x) + vec2f(v.y, -v.x)) * turn;
        let reach = 1.0 + dot(u, v);
        if !(min(lengths.x, lengths.y) > 1e-6) || !(reach > 2e-4) || !(reach <= 2.001) {
            sharp = true;
        } else {
            moved[i] = q[i] + out * (GROWTH / reach);
        }
    }
    if !sharp {
        if is_triangle {
            moved[3] = moved[0];
        }
        return moved;
    }
    // A sliver: the rectangle around it, along its longest side or diagonal.
    var axis = q[1] - q[0];
    for (var i = 0u; i < 4u; i++) {
        for (var j = 0u; j < i; j++) {
            let side = q[i] - q[j];
            axis = select(axis, side, dot(side, side) > dot(axis, axis));
        }
    }
    let long = length(axis);
    let u = select(vec2f(1.0, 0.0), axis / long, long > 0.0);
    let v = vec2f(-u.y, u.x);
    var low = vec2f(0.0);
    var high = vec2f(0.0);
    for (var i = 1u; i < 4u; i++) {
        let d = vec2f(dot(q[i] - q[0], u), dot(q[i] - q[0], v));
        low = min(low, d);
        high = max(high, d);
    }
    low -= GROWTH;
    high += GROWTH;
    return array<vec2f, 4>(q[0] + u * low.x + v * low.y, q[0] + u * high.x + v * low.y, q[0] + u * high.x + v * high.y, q[0] + u * low.x + v * high.y);
}

fn record_of(p: array<vec3f, 4>, v: array<Value, 4>, piece: u32, rank: u32) -> Record {
    var shape: array<vec2f, 4>;
    let w = vec4f(seen(p[0]).z, seen(p[1]).z, seen(p[2]).z, seen(p[3]).z);
    if any(w < vec4f(frame.nearest)) {
        shape = box_of(p);
    } else {
        let around = outline(dependency(p));
        var corners = p;
        shape = grown(array<vec2f, 4>(pixel_of(seen(corners[around.x])), pixel_of(seen(corners[around.y])), pixel_of(seen(corners[around.z])), pixel_of(seen(corners[around.w]))));
    }
    let volume = abs(dot(p[1] - p[0], cross(p[2] - p[0], p[3] - p[0])));
    return Record(
        array<vec4f, 4>(vec4f(p[0], volume), vec4f(p[1], bitcast<f32>(rank)), vec4f(p[2], 0.0), vec4f(p[3], 0.0)),
        shape,
        v,
    );
}
