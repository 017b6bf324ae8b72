// Drawing by intersection: the attributes and values are those of project_intersected.wgsl.

/// The faces of a tetrahedron for all rays of a picture: for each, how much nearer than the middle it is met, in a
/// pixel from which places count, and how that rises from pixel to pixel to the right and down. In a perspective view
/// "nearer by x" is the depth d / (1 + x), d being that of the middle: reciprocals of depths are linear on the screen
/// (Kraus, Qiao & Ebert 2004, section 2.1). Where the last is the reference, the others count from that.
struct Facets {
    at: vec4f,
    right: vec4f,
    down: vec4f,
}

/// Where a ray enters and leaves, as inverse depths that count from `reference`; it misses if the first is not greater.
struct Crossing {
    near: vec2f,
    reference: f32,
}

/// The crossing of the ray of the pixel `offset` away, within `limits`. Which faces are entered is the same for all rays
/// that meet the tetrahedron.
fn crossing(facets: Facets, is_reference: bool, entered: vec4<bool>, offset: vec2f, limits: vec2f) -> Crossing {
    var inverse_depth = fma(facets.down, vec4f(offset.y), fma(facets.right, vec4f(offset.x), facets.at));
    let reference = select(0.0, inverse_depth.w, is_reference);
    inverse_depth.w = select(inverse_depth.w, 0.0, is_reference);
    let first = select(vec4f(limits.x - reference), inverse_depth, entered);
    let last = select(inverse_depth, vec4f(limits.y - reference), entered);
    let near = vec2f(min(min(first.x, first.y), min(first.z, first.w)), max(max(last.x, last.y), max(last.z, last.w)));
    return Crossing(near, reference);
}

/// How much nearer than the middle of a cell, at `depth` (t in a parallel view), the ray's points at `t` are.
fn inverse_depth_at(t: vec2f, stretch: f32, depth: f32) -> vec2f {
    let along = t / stretch;
    return select(depth - along, depth / max(along + frame.forward.w, vec2f(AT_EYE)) - 1.0, PERSPECTIVE);
}

@fragment
fn fragment(drawn: VertexOutput) -> Fragment {
    let attributes = attributes_of(drawn);
    let values = values_in(attributes);
    let at = drawn.at.xy;
    let offset = at - attributes[3].xy;
    let rare = rare_in(attributes);
    var limits = select(select(vec2f(FAR, -FAR), vec2f(1.0 / AT_EYE, -1.0), PERSPECTIVE), rare.xy, IS_CLIPPED);
    if HAS_ENDS || HAS_PLANES {
        let xy = sample_of(at);
        let direction = direction_at(xy);
        let stretch = length(direction);
        let nearest = inverse_depth_at(limits_of(at, origin_at(xy), direction / stretch, stretch), stretch, rare.z);
        limits = vec2f(min(limits.x, nearest.x), max(limits.y, nearest.y));
    }
    let bits = u32(attributes[3].w);
    let entered = (vec4u(bits) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
    let met = crossing(Facets(attributes[0], attributes[1], attributes[2]), (bits & 16u) != 0u, entered, offset, limits);
    let near = met.near;
    let is_met = near.x > near.y;
    if !is_met {
        discard;
    }
    // What inverse depths are divided by: see Facets.
    let divisors = select(vec2f(1.0), (1.0 + met.reference) + near, PERSPECTIVE);
    let share = divisors.yx * (1.0 / (divisors.x * divisors.y));
    let stretch = stretch_of(attributes[4].xyz, attributes[5].xyz, offset);
    // What misses is computed all the same, but in few steps.
    let length = select(0.0, min((near.x - near.y) * share.x * share.y * stretch, attributes[4].w), is_met);
    let here = fma(values[1], Value(offset.x), values[2] * offset.y);
    let front = clamp(fma(fma(values[3], Value(near.x), here), Value(share.x), values[0]), values[4], values[5]);
    let back = select(front, clamp(fma(fma(values[3], Value(near.y), here), Value(share.y), values[0]), values[4], values[5]), is_met);
    //#if LIT
    let t = select(rare.z - (met.reference + near.x), rare.z * share.x - frame.forward.w, PERSPECTIVE);
    lit_from(slopes_in(attributes), near, share, offset, sample_of(at), t);
    //#end
    return fragment_of(front, back, length, attributes, at, u32(rare.w));
}
