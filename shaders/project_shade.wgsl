// From a segment of a ray to a fragment; and from a stored corner to a vertex.

/// Of each triangle the first vertex's attributes are taken. Positions have w = 1, so that all that is not flat is
/// interpolated linearly on the screen.
@vertex
fn vertex(stored: VertexInput) -> VertexOutput {
    let at = stored.corner / frame.size;
    return drawn_at(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.5, 1.0), stored);
}

fn most_work() -> u32 {
    return MOST_WORK;
}

/// Premultiplied colour and opacity of a segment of a cell.
fn colored(front: Value, back: Value, length: f32, attributes: Attributes) -> vec4f {
    work = 0u;
    if COLORING == EXACT {
        return integrated(front, back, length, attributes);
    }
    if PAIR || RGBA {
        light = vec4f(0.0, 0.0, 0.0, 1.0);
        add_tabulated(front, back, length);
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
