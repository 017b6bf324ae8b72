// The exact integral by the lines of the transfer function that come with a cell. Values count from the cell's least one.

/// What of the function comes with a part of a cell: for each of its LINES value and slope, then where the second and the
/// third begin and between which values the part is; and how many pieces a length of one is at least, twice.
struct Lines {
    words: array<vec4f, 2u * LINES + 1u>,
    pieces: f32,
}

/// In how many parts a cell is drawn whose values are between two: as `keys.rs` says.
fn parts_of(low: f32, high: f32) -> u32 {
    let lines = bins[min(end_below(high) + 3, i32(BINS))].y - bins[end_below(low)].y;
    return min(lines / LINES + 1u, MOST_PARTS);
}

/// Of the `piece` of a cell that is drawn at this turn, the whole being between two values, and at `eye` if it reached to
/// there.
fn lines_between(low: f32, high: f32, eye: f32, piece: u32) -> Lines {
    var i = line_at(low, high);
    let parts = parts_of(low, high);
    // From back to front: the parts above that of the eye from above, those below it from below, and last its own.
    var own = 0u;
    for (var k = 1u; k < parts; k++) {
        own += select(0u, 1u, ends_of(i + LINES * k).x <= eye);
    }
    let above = parts - 1u - own;
    let part = select(select(piece - above, own, piece == parts - 1u), parts - 1u - piece, piece < above);
    i += LINES * part;
    var line = line_at_number(i);
    let start = max(low, line.ends.x);
    var lines: Lines;
    lines.words[0] = line.value + line.slope * (start - line.ends.x);
    lines.words[1] = line.slope;
    var steepest = extinction_between(line, low, high);
    var begin = vec2f(FAR);
    if LINES > 1u {
        begin.x = line.ends.y - low;
        line = line_at_number(i + 1u);
        lines.words[2u % (2u * LINES)] = line.value;
        lines.words[3u % (2u * LINES)] = line.slope;
        steepest = max(steepest, extinction_between(line, low, high));
    }
    if LINES > 2u {
        begin.y = line.ends.y - low;
        line = line_at_number(i + 2u);
        lines.words[4u % (2u * LINES)] = line.value;
        lines.words[5u % (2u * LINES)] = line.slope;
        steepest = max(steepest, extinction_between(line, low, high));
    }
    lines.words[2u * LINES] = vec4f(begin, start - low, select(line.ends.y - low, FAR, part + 1u == parts));
    lines.pieces = steepest * (2.0 / GREATEST);
    return lines;
}

/// The greatest extinction of a line between two values; 0 if it is not between them.
fn extinction_between(line: Line, low: f32, high: f32) -> f32 {
    let a = max(low, line.ends.x);
    let b = min(high, line.ends.y);
    let ends = line.value.x + line.slope.x * (vec2f(a, b) - line.ends.x);
    return select(0.0, max(ends.x, ends.y), a <= b);
}

/// What a piece of an optical depth up to GREATEST does that is `rise` denser at its back than at its front: its opacity,
/// the weight of its emission as in the middle, that of how much more it is at the back than at the front, and how much
/// comes through. See `mild`, which goes further.
fn piece_of(depth: f32, rise: f32) -> vec4f {
    if !SLIGHT {
        let p = mild(depth, rise);
        return vec4f(p.x, p.y, p.z - 0.5 * p.y, p.w);
    }
    let h = depth * -0.5;
    let h_square = h * h;
    let square = depth * depth;
    // In short chains: processors wait for results longer than they compute them.
    let powers = fma(fma(h_square, 1.0 / 120.0, fma(h, 1.0 / 24.0, 1.0 / 6.0)), h_square, fma(h, 0.5, 1.0));
    let q = -h * powers;
    let e = 1.0 - q;
    let even = fma(square, 1.0 / 1920.0, 1.0 / 24.0) * square;
    let once = fma(square, 1.0 / 480.0, 1.0 / 12.0);
    let twice = fma(square, 1.0 / 13440.0, 1.0 / 240.0);
    let bent = fma(rise, fma(rise, 1.0 / 6720.0, twice), once);
    let uneven = fma(rise, bent, even);
    let opacity = q + q * e;
    if DIRECT {
        return vec4f(opacity, e + e * uneven, -e * (depth * bent), e * e);
    }
    return vec4f(opacity, opacity, fma(e, uneven, -0.5 * q * q), e * e);
}

/// Premultiplied colour and opacity of what of a segment is in the part of the cell that is drawn: piece by piece, each on
/// one line and of a depth up to GREATEST, from the least value upward.
fn by_lines(front: f32, back: f32, length: f32, words: Words) -> vec4f {
    let low = min(front, back);
    let rises = front <= back;
    let range = max(abs(back - front), FLAT);
    let per_value = length / range;
    // From the segment's least value.
    let places = words[LINES_AT + 2u * LINES] - low;
    // It is parted into a power of two, by the exponent: without a division.
    let pieces = fma(words[PIECES_AT].w, length, 1.0);
    let step = range * bitcast<f32>((254u - min(bitcast<u32>(pieces) >> 23u, 139u)) << 23u);
    var at = max(places.z, 0.0);
    let stop = max(min(places.w, range), at);
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    loop {
        var value = words[LINES_AT];
        var slope = words[LINES_AT + 1u];
        var begin = places.z;
        var end = stop;
        if LINES > 1u {
            let is_beyond = at >= places.x;
            value = select(value, words[LINES_AT + 2u % (2u * LINES)], is_beyond);
            slope = select(slope, words[LINES_AT + 3u % (2u * LINES)], is_beyond);
            begin = select(begin, places.x, is_beyond);
            end = select(min(end, places.x), end, is_beyond);
        }
        if LINES > 2u {
            let is_beyond = at >= places.y;
            value = select(value, words[LINES_AT + 4u % (2u * LINES)], is_beyond);
            slope = select(slope, words[LINES_AT + 5u % (2u * LINES)], is_beyond);
            begin = select(begin, places.y, is_beyond);
            end = select(min(end, places.y), select(end, stop, is_beyond), is_beyond);
        }
        end = min(end, at + step);
        let l = (end - at) * per_value;
        let middle = (at + end) * 0.5 - begin;
        let rise = select(at - end, end - at, rises);
        // Greater ones are opaque all the same, and less than 0 is rounding.
        let depth = clamp(fma(slope.x, middle, value.x) * l, 0.0, GREATEST);
        let p = piece_of(depth, clamp(slope.x * rise * l, -2.0 * depth, 2.0 * depth));
        // The weighted mean of the colours at both ends is that of one place.
        let place = fma(middle, p.y, rise * p.z);
        let color = fma(slope.yzw, vec3f(place), value.yzw * p.y) * select(1.0, l, DIRECT);
        sum = vec4f(fma(color, vec3f(select(1.0, sum.w, rises)), sum.xyz * select(p.w, 1.0, rises)), sum.w * p.w);
        at = end;
        if !(at < stop) {
            break;
        }
    }
    return vec4f(sum.xyz, 1.0 - sum.w);
}
