// What the walk has besides of functions of two variables, and of light: values are (s, g).

/// Whether the ray met a segment that f32 is too coarse for: the CPU follows it then.
var<private> is_coarse: bool;

/// Whether the function shows anything of a cell.
fn may_be_seen(cell: u32) -> bool {
    return (shown_cells(cell >> 5u) >> (cell & 31u) & 1u) == 1u;
}

fn add(front: Value, back: Value, length: f32) {
    stretch.at = front;
    stretch.rise = back - front;
    stretch.length = length;
    //#if LIT
    if !(all(abs(stretch.slope) < vec3f(1e37)) && all(abs(stretch.turn) < vec3f(1e37))) {
        return;
    }
    //#end
    let own = of_stretch();
    if own.w < 0.0 {
        is_coarse = true;
        light.w = 0.0;
        return;
    }
    light = vec4f(light.xyz + light.w * own.xyz, light.w * (1.0 - own.w));
}

//#if LIT
/// Gradients at the corners of a face.
struct Slopes {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}

/// Those of the face that the ray is at, where it enters the cell and leaves it, and of the cell's further corner.
var<private> slopes: Slopes;
var<private> slope_front: vec3f;
var<private> slope_back: vec3f;
var<private> slope_apex: vec3f;

fn slope_of(i: u32) -> vec3f {
    let v = gradients(i);
    return vec3f(v.x, v.y, v.z);
}

fn slope_at(weights: vec3f) -> vec3f {
    return slopes.a + ((slopes.b - slopes.a) * weights.y + (slopes.c - slopes.a) * weights.z);
}

fn slope_of_corner(cell: u32, corners: vec4u, id: u32) -> vec3f {
    let at = vec4u(id) == corners;
    return slope_of(4u * cell + select(select(select(3u, 2u, at.z), 1u, at.y), 0u, at.x));
}

/// The ray enters through the face of these corners.
fn enter_lit(ids: vec3u, weights: vec3f) {
    slopes = Slopes(slope_of(ids.x), slope_of(ids.y), slope_of(ids.z));
    slope_front = slope_at(weights);
}

/// It is in a cell.
fn meet_lit(cell: u32, corners: vec4u, ids: vec3u, apex: u32, weights: vec3f) {
    if ASSOCIATION == POINT {
        slope_apex = slope_of(apex);
    } else {
        slopes = Slopes(slope_of_corner(cell, corners, ids.x), slope_of_corner(cell, corners, ids.y), slope_of_corner(cell, corners, ids.z));
        slope_apex = slope_of_corner(cell, corners, apex);
        slope_front = slope_at(weights);
    }
}

/// It leaves the cell through the face that has the further corner in the place of the one that drops.
fn leave_lit(drops: vec3<bool>, weights: vec3f) {
    slopes.a = select(slopes.a, slope_apex, drops.x);
    slopes.b = select(slopes.b, slope_apex, drops.y);
    slopes.c = select(slopes.c, slope_apex, drops.z);
    slope_back = slope_at(weights);
}

/// Light falls on the part `share` (from, to) of the segment in the cell, which begins at `t` along the ray.
fn light_from(ray: Ray, t: f32, share: vec2f) {
    let rise = slope_back - slope_front;
    stretch.slope = slope_front + rise * share.x;
    stretch.turn = rise * (share.y - share.x);
    stretch.along = ray.along;
    stretch.place = ray.origin.high + ray.along * t;
}
//#end
