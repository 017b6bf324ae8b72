// Drawing by intersection: the words and values are those of project_intersected.wgsl.

/// How much nearer than the middle of a cell, at `depth` (t in a parallel view), the ray's points at `t` are.
fn nearness_at(t: vec2f, stretch: f32, depth: f32) -> vec2f {
    let along = t / stretch;
    return select(depth - along, depth / max(along + frame.forward.w, vec2f(AT_EYE)) - 1.0, frame.perspective == 1u);
}

/// Reads no uniforms unless something cuts rays off: in software each takes as long as a look-up.
@fragment
fn fragment(drawn: Drawn) -> @location(0) vec4f {
    let words = words_of(drawn);
    let values = values_in(words);
    let at = drawn.at.xy;
    let offset = at - words[3].xy;
    var limits = words[3].zw;
    if HAS_ENDS || HAS_PLANES {
        let xy = sample_of(at);
        let direction = direction_at(xy);
        let stretch = length(direction);
        let nearest = nearness_at(limits_of(at, origin_at(xy), direction / stretch, stretch), stretch, words[6].z);
        limits = vec2f(min(limits.x, nearest.x), max(limits.y, nearest.y));
    }
    let entered = (vec4u(u32(words[6].x)) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
    let near = crossing(Facets(words[0], words[1], words[2]), entered, offset, limits);
    if !(near.x > near.y) {
        discard;
    }
    // What nearnesses are divided by: see Facets.
    let divisors = 1.0 + near * words[5].w;
    let share = divisors.yx / (divisors.x * divisors.y);
    let stretch = stretch_of(words[4].xyz, words[5].xyz, offset);
    let length = min((near.x - near.y) * share.x * share.y * stretch, words[4].w);
    let here = fma(values[1], Value(offset.x), values[2] * offset.y);
    let front = clamp(fma(fma(values[3], Value(near.x), here), Value(share.x), values[0]), values[4], values[5]);
    let back = clamp(fma(fma(values[3], Value(near.y), here), Value(share.y), values[0]), values[4], values[5]);
    return quantised(colored(front, back, length, values[4], words), at, u32(words[6].y));
}
