// Drawing by intersection.

@group(3) @binding(0) var<storage, read> drawn_records: array<Record>;

struct Drawn {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) a: vec4f,
    @location(1) @interpolate(flat) b: vec4f,
    @location(2) @interpolate(flat) c: vec4f,
    @location(3) @interpolate(flat) d: vec4f,
    @location(4) @interpolate(flat) value_a: Value,
    @location(5) @interpolate(flat) value_b: Value,
    @location(6) @interpolate(flat) value_c: Value,
    @location(7) @interpolate(flat) value_d: Value,
    @location(8) @interpolate(flat) rank: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Drawn {
    let i = index / CORNERS;
    let corner = drawn_records[i].outline[index % CORNERS];
    var drawn: Drawn;
    drawn.at = vec4f(2.0 * corner.x / frame.size.x - 1.0, 1.0 - 2.0 * corner.y / frame.size.y, 0.5, 1.0);
    drawn.a = drawn_records[i].corners[0];
    drawn.b = drawn_records[i].corners[1];
    drawn.c = drawn_records[i].corners[2];
    drawn.d = drawn_records[i].corners[3];
    drawn.value_a = drawn_records[i].values[0];
    drawn.value_b = drawn_records[i].values[1];
    drawn.value_c = drawn_records[i].values[2];
    drawn.value_d = drawn_records[i].values[3];
    drawn.rank = bitcast<u32>(drawn_records[i].corners[1].w);
    return drawn;
}

/// A corner in the coordinates of the ray. Places of one cell need not be told as those of a whole walk: they are relative to the
/// frame's base, and lengths come from volumes.
fn placed(ray: Ray, p: vec3f) -> vec4f {
    let q = p - ray.origin.high;
    let x = dot_fma(q, ray.right);
    let y = dot_fma(q, ray.up);
    return vec4f(select(x, 0.0, abs(x) < TINY), select(y, 0.0, abs(y) < TINY), dot_fma(q, ray.along), 0.0);
}

/// As `is_left`: the sign of an area that keeps what its rounding left is exact, and needs no digits of integers, which
/// drivers that take both ways of a decision would always count out.
fn is_left_of(a: vec4f, b: vec4f, twice: f32) -> bool {
    return select(twice > 0.0, select(b.x > a.x, a.y > b.y, a.y != b.y), twice == 0.0);
}

/// Weights of the four corners where the ray meets the face whose own are not 0.
fn share(areas: vec4f) -> vec4f {
    let sum = areas.x + areas.y + areas.z + areas.w;
    return select(vec4f(), areas / sum, sum != 0.0);
}

@fragment
fn fragment(drawn: Drawn) -> @location(0) vec4f {
    let xy = sample_of(drawn.at.xy);
    let direction = direction_at(xy);
    let stretch = length(direction);
    let ray = ray_along(single(origin_at(xy)), single(direction / stretch));
    let a = placed(ray, drawn.a.xyz);
    let b = placed(ray, drawn.b.xyz);
    let c = placed(ray, drawn.c.xyz);
    let d = placed(ray, drawn.d.xyz);
    let ab = area(a, b);
    let ac = area(a, c);
    let ad = area(a, d);
    let bc = area(b, c);
    let bd = area(b, d);
    let cd = area(c, d);
    let left_ab = is_left_of(a, b, ab);
    let left_ac = is_left_of(a, c, ac);
    let left_ad = is_left_of(a, d, ad);
    let left_bc = is_left_of(b, c, bc);
    let left_bd = is_left_of(b, d, bd);
    let left_cd = is_left_of(c, d, cd);
    // Whether the ray passes through the face opposite to each corner: two of them, or none.
    let through = vec4<bool>(
        left_bc == left_cd && left_bc != left_bd,
        left_ac == left_cd && left_ac != left_ad,
        left_ab == left_bd && left_ab != left_ad,
        left_ab == left_bc && left_ab != left_ac,
    );
    if !any(through) {
        discard;
    }
    let opposite_a = vec4f(0.0, cd, -bd, bc);
    let opposite_b = vec4f(cd, 0.0, -ad, ac);
    let opposite_c = vec4f(bd, -ad, 0.0, ab);
    let opposite_d = vec4f(bc, -ac, ab, 0.0);
    let first_areas = select(select(select(opposite_d, opposite_c, through.z), opposite_b, through.y), opposite_a, through.x);
    let last_areas = select(select(select(opposite_a, opposite_b, through.y), opposite_c, through.z), opposite_d, through.w);
    let first_weights = share(first_areas);
    let last_weights = share(last_areas);
    let depths = vec4f(a.z, b.z, c.z, d.z);
    let first_t = dot(first_weights, depths);
    let last_t = dot(last_weights, depths);
    // The corner that the first face lacks is this far from it along the ray; the last one is at its share of that.
    let rise = drawn.a.w / max(abs(first_areas.x + first_areas.y + first_areas.z + first_areas.w), TINY);
    let apex = select(select(select(last_weights.w, last_weights.z, through.z), last_weights.y, through.y), last_weights.x, through.x);
    let ahead = abs(last_t - first_t);
    let length = clamp(rise * apex, max(ahead - SHARP, 0.0), ahead + SHARP);
    let first = drawn.value_a * first_weights.x + drawn.value_b * first_weights.y + drawn.value_c * first_weights.z + drawn.value_d * first_weights.w;
    let last = drawn.value_a * last_weights.x + drawn.value_b * last_weights.y + drawn.value_c * last_weights.z + drawn.value_d * last_weights.w;
    let in_sequence = first_t <= last_t;
    return shaded(drawn.at.xy, drawn.rank, select(last, first, in_sequence), select(first, last, in_sequence),
        min(first_t, last_t), length, limits_of(drawn.at.xy, ray.origin.high, ray.along, stretch));
}
