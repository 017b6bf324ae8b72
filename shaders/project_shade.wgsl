// From a segment of a ray to a fragment.

fn most_work() -> u32 {
    return MOST_WORK;
}

/// The fragment of a segment that starts at `t` and is `length` long, as far as it is within the limits.
fn shaded(at: vec2f, rank: u32, front: Value, back: Value, t: f32, length: f32, limits: vec2f) -> vec4f {
    let start = max(limits.x - t, 0.0);
    let end = min(limits.y - t, length);
    if !(start < end) {
        discard;
    }
    let rise = back - front;
    let f = select(front + rise * (start / length), front, start == 0.0);
    let b = select(front + rise * (end / length), back, end == length);
    return quantised(colored(f, b, end - start), at, rank);
}

/// Premultiplied colour and opacity of a segment.
fn colored(front: Value, back: Value, length: f32) -> vec4f {
    if COLORING == EXACT {
        light = vec4f(0.0, 0.0, 0.0, 1.0);
        work = 0u;
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

/// As the target holds it: with dithering, opacity (or, where cells only add up, colour) is rounded up with the probability of its
/// fraction, and the colour follows the opacity.
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
