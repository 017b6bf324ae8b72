// From a segment of a ray to a fragment; and from a stored corner to a vertex.

/// Of each triangle the first vertex's words are taken. Positions have w = 1, so that all that is not flat is
/// interpolated linearly on the screen.
@vertex
fn vertex(stored: Stored) -> Drawn {
    let at = stored.corner / frame.size;
    return drawn_at(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.5, 1.0), stored);
}

fn most_work() -> u32 {
    return MOST_WORK;
}

/// The intervals of the function, LINES_ACROSS in a row: value, slope, and ends below each other. A texture, as drivers
/// in software look buffers up lane by lane.
@group(0) @binding(10) var lines: texture_2d<f32>;

/// A line of the function of the last component, and between which values it is that.
struct Line {
    value: vec4f,
    slope: vec4f,
    ends: vec2f,
}

/// The interval of the function that begins at the knot `i`.
fn line_of(i: u32) -> Line {
    let at = vec2u(i % LINES_ACROSS, 3u * (i / LINES_ACROSS));
    let ends = textureLoad(lines, at + vec2u(0u, 2u), 0).xy;
    return Line(textureLoad(lines, at, 0), textureLoad(lines, at + vec2u(0u, 1u), 0), ends);
}

/// The interval that a constant `s` is in.
fn interval_of(s: f32) -> u32 {
    return track(function.opacity, select(function.end, function.color, PAIR), 0u, s, s).i;
}

/// Premultiplied colour and opacity of a segment, by the exact integral; `line` is that of the interval `i`, in which
/// the lesser value is or one below it. Intervals are taken from the lesser value to the greater, whichever is in
/// front, so that the first is the same for all fragments of a cell and comes with it.
fn integrated(front: Value, back: Value, length: f32, first: u32, first_line: Line) -> vec4f {
    let rises = last_of(front) <= last_of(back);
    let low = min(last_of(front), last_of(back));
    let range = abs(last_of(back) - last_of(front));
    let share = select(0.0, 1.0 / range, range > 0.0);
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    var i = first;
    var line = first_line;
    var u = 0.0;
    loop {
        let is_last = low + range < line.ends.y || i + 2u >= function.end;
        let next = select(clamp((line.ends.y - low) * share, u, 1.0), 1.0, is_last);
        let a = line.value + line.slope * (clamp(low + range * u, line.ends.x, line.ends.y) - line.ends.x);
        let b = line.value + line.slope * (clamp(low + range * next, line.ends.x, line.ends.y) - line.ends.x);
        var f = select(b, a, rises);
        var r = select(a, b, rises);
        if RGBA {
            let ends = select(vec2f(1.0 - next, 1.0 - u), vec2f(u, next), rises);
            f = vec4f(f.x, mix(color_of(front), color_of(back), ends.x) * function.scale);
            r = vec4f(r.x, mix(color_of(front), color_of(back), ends.y) * function.scale);
        }
        let l = (next - u) * length;
        let p = piece(f.x * l, r.x * l);
        let emitted = (f.yzw * p.y + r.yzw * p.z) * select(1.0, l, DIRECT);
        // In front of what there is, or behind it.
        sum = vec4f(select(emitted + (1.0 - p.x) * sum.xyz, sum.xyz + sum.w * emitted, rises), sum.w * (1.0 - p.x));
        work++;
        if is_last || work > most_work() {
            break;
        }
        i++;
        line = line_of(i);
        u = next;
    }
    return vec4f(sum.xyz, 1.0 - sum.w);
}

/// Premultiplied colour and opacity of a segment.
fn colored(front: Value, back: Value, length: f32, i: u32, line: Line) -> vec4f {
    work = 0u;
    if COLORING == EXACT && !PAIR {
        return integrated(front, back, length, i, line);
    }
    if COLORING == EXACT {
        light = vec4f(0.0, 0.0, 0.0, 1.0);
        add_segment(front, back, length);
        return vec4f(light.xyz, 1.0 - light.w);
    }
    return tabulated(last_of(front), last_of(back), length);
}

/// Jarzynski & Olano's hash of three numbers, pcg3d (2020).
fn hash(v: vec3u) -> vec3u {
    var h = v * 1664525u + 1013904223u;
    h.x += h.y * h.z;
    h.y += h.z * h.x;
    h.z += h.x * h.y;
    h ^= h >> vec3u(16u);
    h.x += h.y * h.z;
    h.y += h.z * h.x;
    h.z += h.x * h.y;
    return h;
}

/// As the target holds it: with dithering, opacity (or, where cells only add up, colour) is rounded up with the
/// probability of its fraction, and the colour follows the opacity.
fn quantised(color: vec4f, at: vec2f, rank: u32) -> vec4f {
    if !DITHERED {
        return color;
    }
    let chances = vec3f(hash(vec3u(vec2u(at), rank)) >> vec3u(8u)) * (1.0 / 16777216.0);
    if ADDITIVE {
        let whole = color.xyz * 255.0;
        return vec4f((floor(whole) + select(vec3f(0.0), vec3f(1.0), fract(whole) > chances)) / 255.0, color.w);
    }
    let whole = color.w * 255.0;
    let opacity = (floor(whole) + select(0.0, 1.0, fract(whole) > chances.x)) / 255.0;
    return vec4f(color.xyz * select(0.0, opacity / color.w, color.w > 0.0), opacity);
}
