// Drawing by intersection.

@group(3) @binding(0) var<storage, read> drawn_records: array<Record>;

struct Drawn {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) facets: vec4f,
    @location(1) @interpolate(flat) facets_right: vec4f,
    @location(2) @interpolate(flat) facets_down: vec4f,
    @location(3) @interpolate(flat) middle: vec4f,
    @location(4) @interpolate(flat) extent: vec4f,
    @location(5) @interpolate(flat) tags: vec4u,
    @location(6) @interpolate(flat) value: Value,
    @location(7) @interpolate(flat) value_right: Value,
    @location(8) @interpolate(flat) value_down: Value,
    @location(9) @interpolate(flat) value_near: Value,
    @location(10) @interpolate(flat) least: Value,
    @location(11) @interpolate(flat) greatest: Value,
    @location(12) @interpolate(flat) line_value: vec4f,
    @location(13) @interpolate(flat) line_slope: vec4f,
    @location(14) @interpolate(flat) line_ends: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Drawn {
    let i = index / CORNERS;
    let corner = drawn_records[i].outline[index % CORNERS];
    var drawn: Drawn;
    drawn.at = vec4f(2.0 * corner.x / frame.size.x - 1.0, 1.0 - 2.0 * corner.y / frame.size.y, 0.5, 1.0);
    // Of each triangle the first corner's are taken.
    if index % CORNERS == 0u {
        drawn.facets = drawn_records[i].facets.at;
        drawn.facets_right = drawn_records[i].facets.right;
        drawn.facets_down = drawn_records[i].facets.down;
        drawn.middle = drawn_records[i].middle;
        drawn.extent = drawn_records[i].extent;
        drawn.tags = drawn_records[i].tags;
        drawn.value = drawn_records[i].values[0];
        drawn.value_right = drawn_records[i].values[1];
        drawn.value_down = drawn_records[i].values[2];
        drawn.value_near = drawn_records[i].values[3];
        drawn.least = drawn_records[i].values[4];
        drawn.greatest = drawn_records[i].values[5];
        let line = line_of(drawn.tags.z);
        drawn.line_value = line.value;
        drawn.line_slope = line.slope;
        drawn.line_ends = line.ends;
    }
    return drawn;
}

/// How much nearer than the middle of a cell the ray's point at `t` is.
fn nearness_at(t: vec2f, stretch: f32, extent: vec4f) -> vec2f {
    let along = t / stretch;
    return select(extent.y - along, extent.x / max(along + frame.forward.w, vec2f(AT_EYE)) - 1.0, frame.perspective == 1u);
}

@fragment
fn fragment(drawn: Drawn) -> @location(0) vec4f {
    let offset = drawn.at.xy - drawn.middle.xy;
    let xy = sample_of(drawn.at.xy);
    let direction = direction_at(xy);
    let stretch = length(direction);
    var limits = drawn.middle.zw;
    if HAS_ENDS || HAS_PLANES {
        let nearest = nearness_at(limits_of(drawn.at.xy, origin_at(xy), direction / stretch, stretch), stretch, drawn.extent);
        limits = vec2f(min(limits.x, nearest.x), max(limits.y, nearest.y));
    }
    let entered = (vec4u(drawn.tags.y) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
    let near = crossing(Facets(drawn.facets, drawn.facets_right, drawn.facets_down), entered, offset, limits);
    if !(near.x > near.y) {
        discard;
    }
    // What nearnesses are divided by: see Facets.
    let divisors = select(vec2f(1.0), 1.0 + near, frame.perspective == 1u);
    let share = divisors.yx / (divisors.x * divisors.y);
    let length = min((near.x - near.y) * share.x * share.y * drawn.extent.x * stretch, drawn.extent.z);
    let here = drawn.value_right * offset.x + drawn.value_down * offset.y;
    let front = clamp(drawn.value + (here + drawn.value_near * near.x) * share.x, drawn.least, drawn.greatest);
    let back = clamp(drawn.value + (here + drawn.value_near * near.y) * share.y, drawn.least, drawn.greatest);
    let line = Line(drawn.line_value, drawn.line_slope, drawn.line_ends);
    return quantised(colored(front, back, length, drawn.tags.z, line), drawn.at.xy, drawn.tags.x);
}
