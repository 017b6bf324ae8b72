// Drawing by intersection: the words and values are those of project_intersected.wgsl.

/// How much nearer than the middle of a cell the ray's point at `t` is.
fn nearness_at(t: vec2f, stretch: f32, extent: vec4f) -> vec2f {
    let along = t / stretch;
    return select(extent.y - along, extent.x / max(along + frame.forward.w, vec2f(AT_EYE)) - 1.0, frame.perspective == 1u);
}

@fragment
fn fragment(drawn: Drawn) -> @location(0) vec4f {
    let words = words_of(drawn);
    let values = values_in(words);
    let at = drawn.at.xy;
    let offset = at - words[3].xy;
    let xy = sample_of(at);
    let direction = direction_at(xy);
    let stretch = length(direction);
    var limits = words[3].zw;
    if HAS_ENDS || HAS_PLANES {
        let nearest = nearness_at(limits_of(at, origin_at(xy), direction / stretch, stretch), stretch, words[4]);
        limits = vec2f(min(limits.x, nearest.x), max(limits.y, nearest.y));
    }
    let entered = (vec4u(u32(words[7].w)) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
    let near = crossing(Facets(words[0], words[1], words[2]), entered, offset, limits);
    if !(near.x > near.y) {
        discard;
    }
    // What nearnesses are divided by: see Facets.
    let divisors = select(vec2f(1.0), 1.0 + near, frame.perspective == 1u);
    let share = divisors.yx / (divisors.x * divisors.y);
    let length = min((near.x - near.y) * share.x * share.y * words[4].x * stretch, words[4].z);
    let here = values[1] * offset.x + values[2] * offset.y;
    let front = clamp(values[0] + (here + values[3] * near.x) * share.x, values[4], values[5]);
    let back = clamp(values[0] + (here + values[3] * near.y) * share.y, values[4], values[5]);
    let line = Line(words[5], words[6], words[7].xy);
    return quantised(colored(front, back, length, u32(words[4].w), line), at, u32(words[7].z));
}
