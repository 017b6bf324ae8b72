// The exact integral by the lines of the transfer function that come with a cell. Values count from the cell's least one.

/// What of the function comes with a part of a cell: for each of its LINES value and slope, then where the second and the
/// third begin and between which values the part is; and the greatest extinction.
struct Lines {
    words: array<vec4f, 2u * LINES + 1u>,
    steepest: f32,
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
    var line = line_of(i);
    let start = max(low, line.ends.x);
    var lines: Lines;
    lines.words[0] = line.value + line.slope * (start - line.ends.x);
    lines.words[1] = line.slope;
    lines.steepest = extinction_between(line, low, high);
    var begin = vec2f(FAR);
    if LINES > 1u {
        begin.x = line.ends.y - low;
        line = line_of(i + 1u);
        lines.words[2u % (2u * LINES)] = line.value;
        lines.words[3u % (2u * LINES)] = line.slope;
        lines.steepest = max(lines.steepest, extinction_between(line, low, high));
    }
    if LINES > 2u {
        begin.y = line.ends.y - low;
        line = line_of(i + 2u);
        lines.words[4u % (2u * LINES)] = line.value;
        lines.words[5u % (2u * LINES)] = line.slope;
        lines.steepest = max(lines.steepest, extinction_between(line, low, high));
    }
    lines.words[2u * LINES] = vec4f(begin, start - low, select(line.ends.y - low, FAR, part + 1u == parts));
    return lines;
}

/// The greatest extinction of a line between two values; 0 if it is not between them.
fn extinction_between(line: Line, low: f32, high: f32) -> f32 {
    let a = max(low, line.ends.x);
    let b = min(high, line.ends.y);
    let ends = line.value.x + line.slope.x * (vec2f(a, b) - line.ends.x);
    return select(0.0, max(ends.x, ends.y), a <= b);
}

/// The part of `ramp` from `start` to `end`, which is on one line: values are `a` to `b` above where `value` and `slope`
/// say what the function is. Its colour, and how much comes through.
fn on_line(ramp: Ramp, start: f32, end: f32, value: vec4f, slope: vec4f, a: f32, b: f32) -> vec4f {
    let l = (end - start) * ramp.length;
    let middle = (a + b) * 0.5;
    let rise = (b - a) * ramp.sign;
    let p = mild(fma(slope.x, middle, value.x) * l, slope.x * rise * l);
    // The weighted mean of the colours at both ends is that of one place.
    let place = fma(middle, p.y, rise * (p.z - 0.5 * p.y));
    return vec4f(fma(slope.yzw, vec3f(place), value.yzw * p.y) * select(1.0, l, DIRECT), p.w);
}

/// Premultiplied colour and opacity of what of a segment is in the part of the cell that is drawn: piece by piece, each on
/// one line and MILD, from the least value upward.
fn by_lines(front: f32, back: f32, length: f32, words: Words) -> vec4f {
    let ramp = ramp_of(front, back, length);
    let places = words[LINES_AT + 2u * LINES];
    // Where it is at these values: the last two are its ends.
    let at = clamp((places - ramp.low) * ramp.share, vec4f(0.0), vec4f(1.0));
    let width = MILD / max(words[STEEPEST_AT].w * length, MILD / 64.0);
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    var start = at.z;
    loop {
        var value = words[LINES_AT];
        var slope = words[LINES_AT + 1u];
        var begin = places.z;
        var end = at.w;
        if LINES > 1u {
            let is_beyond = start >= at.x;
            value = select(value, words[LINES_AT + 2u % (2u * LINES)], is_beyond);
            slope = select(slope, words[LINES_AT + 3u % (2u * LINES)], is_beyond);
            begin = select(begin, places.x, is_beyond);
            end = select(at.x, at.w, is_beyond);
        }
        if LINES > 2u {
            let is_beyond = start >= at.y;
            value = select(value, words[LINES_AT + 4u % (2u * LINES)], is_beyond);
            slope = select(slope, words[LINES_AT + 5u % (2u * LINES)], is_beyond);
            begin = select(begin, places.y, is_beyond);
            end = select(select(end, at.y, start >= at.x), at.w, is_beyond);
        }
        end = min(min(end, at.w), start + width);
        let a = fma(ramp.range, start, ramp.low) - begin;
        let b = fma(ramp.range, end, ramp.low) - begin;
        sum = joined(ramp, sum, on_line(ramp, start, end, value, slope, a, b));
        start = end;
        if !(start < at.w) {
            break;
        }
    }
    return vec4f(sum.xyz, 1.0 - sum.w);
}
