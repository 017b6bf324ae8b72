// Drawing by intersection: the words and values are those of project_intersected.wgsl.

/// How much nearer than the middle of a cell, at `depth` (t in a parallel view), the ray's points at `t` are.
fn nearness_at(t: vec2f, stretch: f32, depth: f32) -> vec2f {
    let along = t / stretch;
    return select(depth - along, depth / max(along + frame.forward.w, vec2f(AT_EYE)) - 1.0, PERSPECTIVE);
}

/// Reads no uniforms unless something cuts rays off: in software each takes as long as a look-up.
@fragment
fn fragment(drawn: Drawn) -> Fragment {
    let words = words_of(drawn);
    let values = values_in(words);
    let at = drawn.at.xy;
    let offset = at - words[3].xy;
    let rare = rare_in(words);
    var limits = select(select(vec2f(FAR, -FAR), vec2f(1.0 / AT_EYE, -1.0), PERSPECTIVE), rare.xy, IS_CLIPPED);
    if HAS_ENDS || HAS_PLANES {
        let xy = sample_of(at);
        let direction = direction_at(xy);
        let stretch = length(direction);
        let nearest = nearness_at(limits_of(at, origin_at(xy), direction / stretch, stretch), stretch, rare.z);
        limits = vec2f(min(limits.x, nearest.x), max(limits.y, nearest.y));
    }
    let entered = (vec4u(u32(words[3].w)) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
    let near = crossing(Facets(words[0], words[1], words[2]), entered, offset, limits);
    let is_met = near.x > near.y;
    if !is_met {
        discard;
    }
    // What nearnesses are divided by: see Facets.
    let divisors = select(vec2f(1.0), 1.0 + near, PERSPECTIVE);
    let share = divisors.yx * (1.0 / (divisors.x * divisors.y));
    let stretch = stretch_of(words[4].xyz, words[5].xyz, offset);
    // What misses is computed all the same, but in few steps.
    let length = select(0.0, min((near.x - near.y) * share.x * share.y * stretch, words[4].w), is_met);
    let here = fma(values[1], Value(offset.x), values[2] * offset.y);
    let front = clamp(fma(fma(values[3], Value(near.x), here), Value(share.x), values[0]), values[4], values[5]);
    let back = select(front, clamp(fma(fma(values[3], Value(near.y), here), Value(share.y), values[0]), values[4], values[5]), is_met);
    return fragment_of(front, back, length, words, at, u32(rare.w));
}
