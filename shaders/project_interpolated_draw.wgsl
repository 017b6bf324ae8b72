// Drawing by interpolation. Positions have w = 1, so that the rasteriser interpolates linearly on the screen.

@group(3) @binding(0) var<storage, read> drawn_records: array<Record>;

struct Drawn {
    @builtin(position) at: vec4f,
    /// 1/w (depth in a parallel view) of front and back and how much they differ, and the thickness.
    @location(0) depths: vec4f,
    /// Values over w; for LINEAR, values.
    @location(1) front: Value,
    @location(2) back: Value,
    @location(3) @interpolate(flat) least: Value,
    @location(4) @interpolate(flat) greatest: Value,
    @location(5) @interpolate(flat) longest: f32,
    /// The rank, and the interval of the function that the least value is in.
    @location(6) @interpolate(flat) tags: vec2u,
    @location(7) @interpolate(flat) line_value: vec4f,
    @location(8) @interpolate(flat) line_slope: vec4f,
    @location(9) @interpolate(flat) line_ends: vec2f,
    /// Around a table's diagonal: see `plane_of`.
    @location(10) @interpolate(flat) plane: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Drawn {
    let i = index / CORNERS;
    let k = index % CORNERS;
    var at = drawn_records[i].thick;
    var drawn: Drawn;
    drawn.depths = vec4f(drawn_records[i].front_depth, drawn_records[i].back_depth, drawn_records[i].difference, drawn_records[i].thickness);
    drawn.front = drawn_records[i].front;
    drawn.back = drawn_records[i].back;
    if k < 4u {
        at = drawn_records[i].outline[k];
        let depth = drawn_records[i].depths[k];
        drawn.depths = vec4f(depth, depth, 0.0, 0.0);
        drawn.front = drawn_records[i].values[k];
        drawn.back = drawn.front;
    }
    if FORM == INTERPOLATED && frame.perspective == 1u {
        drawn.front *= drawn.depths.x;
        drawn.back *= drawn.depths.y;
    }
    drawn.at = vec4f(2.0 * at.x / frame.size.x - 1.0, 1.0 - 2.0 * at.y / frame.size.y, 0.5, 1.0);
    // Of each triangle the first corner's are taken.
    if k == 4u {
        drawn.least = drawn_records[i].least;
        drawn.greatest = drawn_records[i].greatest;
        drawn.longest = drawn_records[i].longest;
        drawn.tags = vec2u(drawn_records[i].rank, drawn_records[i].interval);
        let line = line_of(drawn.tags.y);
        drawn.line_value = line.value;
        drawn.line_slope = line.slope;
        drawn.line_ends = line.ends;
        if PLANE_PER_CELL {
            drawn.plane = plane_of(last_of(drawn_records[i].front), last_of(drawn_records[i].back), drawn_records[i].thickness);
        }
    }
    return drawn;
}

@fragment
fn fragment(drawn: Drawn) -> @location(0) vec4f {
    cell_plane = drawn.plane;
    let xy = sample_of(drawn.at.xy);
    let direction = direction_at(xy);
    let stretch = length(direction);
    let depths = drawn.depths;
    var front = drawn.front;
    var back = drawn.back;
    var deeper = depths.z;
    // From where rays start, along the view direction.
    var depth = depths.x;
    if frame.perspective == 1u {
        deeper = depths.z / (depths.x * depths.y);
        depth = 1.0 / depths.x - frame.forward.w;
        if FORM == INTERPOLATED {
            front /= depths.x;
            back /= depths.y;
        }
    }
    // |v_f| over z_f is how much longer the ray's way is than deep.
    var length = select(deeper * stretch, deeper, BY_DEPTH);
    if FORM == LINEAR {
        length = depths.w;
    }
    length = clamp(length, 0.0, drawn.longest);
    front = clamp(front, drawn.least, drawn.greatest);
    back = clamp(back, drawn.least, drawn.greatest);
    // As far as it is within the limits.
    let t = depth * stretch;
    let limits = limits_of(drawn.at.xy, origin_at(xy), direction / stretch, stretch);
    let start = max(limits.x - t, 0.0);
    let end = min(limits.y - t, length);
    if !(start < end) {
        discard;
    }
    let rise = back - front;
    back = select(front + rise * (end / length), back, end == length);
    front = select(front + rise * (start / length), front, start == 0.0);
    let line = Line(drawn.line_value, drawn.line_slope, drawn.line_ends);
    return quantised(colored(front, back, end - start, drawn.tags.y, line), drawn.at.xy, drawn.tags.x);
}
