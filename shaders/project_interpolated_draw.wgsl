// Drawing by interpolation: the attributes and values are those of project_interpolated.wgsl.

@fragment
fn fragment(drawn: VertexOutput) -> Fragment {
    let attributes = attributes_of(drawn);
    let values = values_in(attributes);
    cell_plane = attributes[3].y;
    let at = drawn.at.xy;
    let stretch = stretch_of(attributes[1].xyz, attributes[2].xyz, at - attributes[0].xy);
    let depths = drawn.depths;
    var front = drawn.front;
    var back = drawn.back;
    var deeper = depths.z;
    var depth = depths.x;
    if PERSPECTIVE {
        deeper = depths.z / (depths.x * depths.y);
        depth = 1.0 / depths.x;
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
    length = clamp(length, 0.0, attributes[1].w);
    front = clamp(front, values[0], values[1]);
    back = clamp(back, values[0], values[1]);
    // As far as it is within the limits.
    var limits = (attributes[0].zw - depth) * stretch;
    if HAS_ENDS || HAS_PLANES {
        let xy = sample_of(at);
        limits = limits_of(at, origin_at(xy), direction_at(xy) / stretch, stretch) - (depth - frame.forward.w) * stretch;
    }
    let start = max(limits.x, 0.0);
    let end = min(limits.y, length);
    if !(start < end) {
        discard;
    }
    let rise = back - front;
    back = select(front + rise * (end / length), back, end == length);
    front = select(front + rise * (start / length), front, start == 0.0);
    return fragment_of(front, back, end - start, attributes, at, u32(attributes[3].x));
}
