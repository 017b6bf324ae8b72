// Drawing by interpolation: the words and values are those of project_interpolated.wgsl.

@fragment
fn fragment(drawn: Drawn) -> @location(0) vec4f {
    let words = words_of(drawn);
    let values = values_in(words);
    cell_plane = words[3].y;
    let at = drawn.at.xy;
    let xy = sample_of(at);
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
    length = clamp(length, 0.0, words[2].z);
    front = clamp(front, values[0], values[1]);
    back = clamp(back, values[0], values[1]);
    // As far as it is within the limits.
    let t = depth * stretch;
    let limits = limits_of(at, origin_at(xy), direction / stretch, stretch);
    let start = max(limits.x - t, 0.0);
    let end = min(limits.y - t, length);
    if !(start < end) {
        discard;
    }
    let rise = back - front;
    back = select(front + rise * (end / length), back, end == length);
    front = select(front + rise * (start / length), front, start == 0.0);
    let line = Line(words[0], words[1], words[2].xy);
    return quantised(colored(front, back, end - start, u32(words[3].x), line), at, u32(words[2].w));
}
