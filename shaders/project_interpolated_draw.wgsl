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
    @location(6) @interpolate(flat) rank: u32,
    /// Around a table's diagonal: see `plane_of`.
    @location(7) @interpolate(flat) plane: f32,
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
    if PLANE_PER_CELL {
        drawn.plane = plane_of(last_of(drawn.front), last_of(drawn.back), drawn_records[i].thickness);
    }
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
    drawn.least = drawn_records[i].least;
    drawn.greatest = drawn_records[i].greatest;
    drawn.longest = drawn_records[i].longest;
    drawn.rank = drawn_records[i].rank;
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
    let limits = limits_of(drawn.at.xy, origin_at(xy), direction / stretch, stretch);
    return shaded(drawn.at.xy, drawn.rank, front, back, depth * stretch, length, limits);
}
