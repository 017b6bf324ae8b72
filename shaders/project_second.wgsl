// What the projection has besides of functions of two variables, and of light: values are (s, g).

/// Whether the function shows anything of a cell.
fn may_be_seen(cell: u32) -> bool {
    return (shown_cells(cell >> 5u) >> (cell & 31u) & 1u) == 1u;
}

/// Premultiplied colour and opacity of a segment. Where f32 is too coarse for it, the opacity is such that no fragment before
/// it but an opaque one hides that: the CPU draws the pixel.
fn of_segment(front: Value, back: Value, length: f32) -> vec4f {
    stretch.at = front;
    stretch.rise = back - front;
    stretch.length = length;
    let own = of_stretch();
    return select(own, vec4f(0.0, 0.0, 0.0, COARSE), own.w < 0.0);
}

//#if LIT
/// The gradients at the corners of the cell, as the mesh has them.
var<private> own_slopes: array<vec3f, 4>;
/// What fragments know of the gradient: what it is in the middle, and how it changes from pixel to pixel to the right and
/// down, and towards the eye; all of that in three attributes.
var<private> slope_attributes: array<vec4f, 3>;

fn slope_of(i: u32) -> vec3f {
    let v = gradients(i);
    return vec3f(v.x, v.y, v.z);
}

fn hold_slopes(cell: u32, corners: vec4u) {
    let at = select(vec4u(4u * cell) + vec4u(0u, 1u, 2u, 3u), corners, ASSOCIATION == POINT);
    own_slopes[0] = slope_of(at.x);
    own_slopes[1] = slope_of(at.y);
    own_slopes[2] = slope_of(at.z);
    own_slopes[3] = slope_of(at.w);
}

/// Whether the gradients at a cell's corners are numbers.
fn has_slopes() -> bool {
    let most = max(max(abs(own_slopes[0]), abs(own_slopes[1])), max(abs(own_slopes[2]), abs(own_slopes[3])));
    return all(most < vec3f(1e37));
}

fn hold_lit(middle: vec3f, to_right: vec3f, to_below: vec3f, towards_eye: vec3f) {
    slope_attributes[0] = vec4f(middle, to_right.x);
    slope_attributes[1] = vec4f(to_right.yz, to_below.xy);
    slope_attributes[2] = vec4f(to_below.z, towards_eye);
}

/// Light falls on the segment of the ray at `xy`, which begins at `t`, where the inverse depths at both ends are `near` and
/// the values there are weighted by `share`.
fn lit_from(packed: array<vec4f, 3>, near: vec2f, share: vec2f, offset: vec2f, xy: vec2f, t: f32) {
    let here = vec3f(packed[0].w, packed[1].xy) * offset.x + vec3f(packed[1].zw, packed[2].x) * offset.y;
    let front = packed[0].xyz + (packed[2].yzw * near.x + here) * share.x;
    let back = packed[0].xyz + (packed[2].yzw * near.y + here) * share.y;
    let way = direction_at(xy);
    stretch.slope = front;
    stretch.turn = back - front;
    stretch.along = normalize(way);
    stretch.place = frame.base.xyz + (origin_at(xy) + way * t);
}
//#end
