// The ray-segment integral: the f32 twin of src/integral.rs, which explains it.

/// A knot of the transfer function: extinction and colour from it on, how they rise up to the next knot, and where both
/// are.
struct Knot {
    value: vec4f,
    slope: vec4f,
    ends: vec2f,
}

/// Where the knots of the functions are, and how colours are scaled.
struct Function {
    /// The first knot of the function of opacity and of the function of colour (of pairs), and the end of both.
    opacity: u32,
    color: u32,
    end: u32,
    /// The components of an RGBA field times this are the colour.
    scale: f32,
}

@group(0) @binding(0) var<uniform> function: Function;
@group(0) @binding(1) var<storage, read> knots: array<Knot>;
/// For each of BUCKETS equal parts of [−1, 1], the interval that its lower end lies in; first for opacity, then for
/// colour.
@group(0) @binding(2) var<storage, read> buckets: array<u32>;

/// One linear value along a segment, the interval of its function that it is in, and how far it has come: whether this is
/// one of the segment's ends or a knot, and not computed.
struct Track {
    first: u32,
    last: u32,
    i: u32,
    front: f32,
    rise: f32,
    at: f32,
    known: bool,
}

/// Iterations of loops so far, at least; each loop counts once more when it ends.
var<private> work: u32;

/// Light gathered from front to back: premultiplied colour, and how much of what lies behind comes through.
var<private> light: vec4f;

/// What a piece of an optical depth up to SERIES_DEPTH does that is `rise` denser at its back than at its front: its opacity,
/// the weights of its emission, both ends together and the back alone, and how much comes through. See `Piece::by_series`
/// in src/integral.rs.
fn by_series(depth: f32, rise: f32) -> vec4f {
    let square = depth * depth;
    let h = depth * -0.5;
    let powers = fma(h, fma(h, fma(h, fma(h, fma(h, fma(h, fma(h, 1.0 / 40320.0, 1.0 / 5040.0), 1.0 / 720.0), 1.0 / 120.0), 1.0 / 24.0), 1.0 / 6.0), 0.5), 1.0);
    let q = -h * powers;
    let e = 1.0 - q;
    let even = square * fma(square, fma(square, 1.0 / 322560.0, 1.0 / 1920.0), 1.0 / 24.0);
    let once = fma(square, fma(square, 1.0 / 53760.0, 1.0 / 480.0), 1.0 / 12.0);
    let twice = fma(square, 1.0 / 13440.0, 1.0 / 240.0);
    let thrice = fma(rise, 1.0 / 241920.0, fma(square, 1.0 / 483840.0, 1.0 / 6720.0));
    let bent = fma(rise, fma(rise, thrice, twice), once);
    let uneven = fma(rise, bent, even);
    if DIRECT {
        let seen = 1.0 + uneven;
        return vec4f(q + q * e, e * seen, e * (0.5 * seen - depth * bent), e * e);
    }
    return vec4f(q + q * e, q + q * e, e * (q + uneven), e * e);
}

/// What a piece of the optical depths at its two ends does: its opacity and the weights of the emission there. What is below
/// 0 is rounding, much of it beside great depths.
fn piece(first_depth: f32, last_depth: f32) -> vec3f {
    let x = max(first_depth, 0.0);
    let y = max(last_depth, 0.0);
    // Beyond T(u) = OPAQUE_DEPTH nothing is seen: x u + (y − x) u²/2 = OPAQUE_DEPTH.
    var end = 1.0;
    if x + y > 2.0 * OPAQUE_DEPTH {
        end = min(2.0 * OPAQUE_DEPTH / (x + sqrt(max(x * x + 2.0 * OPAQUE_DEPTH * (y - x), 0.0))), 1.0);
    }
    let steps = f32(u32(min(max(x, x + (y - x) * end) * end * (1.0 / SERIES_DEPTH), 64.0))) + 1.0;
    let width = end / steps;
    var start = 0.0;
    var transmittance = 1.0;
    var sum = vec3f();
    loop {
        let first = (x + (y - x) * start) * width;
        let rise = (y - x) * width * width;
        let p = by_series(first + 0.5 * rise, rise);
        sum += transmittance * vec3f(p.x, select(1.0, width, DIRECT) * vec2f(p.y, start * p.y + width * p.z));
        transmittance *= p.w;
        start += width;
        work++;
        if start > end - 0.5 * width {
            break;
        }
    }
    let back = min(sum.z, sum.y);
    return vec3f(sum.x, sum.y - back, back);
}

fn track(first: u32, last: u32, bucket: u32, front: f32, back: f32) -> Track {
    let b = u32(clamp((front + 1.0) * (f32(BUCKETS) / 2.0), 0.0, f32(BUCKETS - 1u)));
    var i = buckets[bucket + b];
    var above = last - 1u;
    if b + 1u < BUCKETS {
        above = buckets[bucket + b + 1u] + 1u;
    }
    work += 4u;
    while above > i + 1u {
        let middle = (i + above) / 2u;
        if knots[middle].ends.x <= front {
            i = middle;
        } else {
            above = middle;
        }
        work++;
    }
    // Where rounding chose the bucket beside.
    while i > first && knots[i].ends.x > front {
        i--;
    }
    while i + 2u < last && knots[i].ends.y <= front {
        i++;
    }
    let rise = back - front;
    if rise == 0.0 {
        // A constant that is opaque as a single value is opaque all along.
        while i > first && knots[i - 1u].ends.x == front && knots[i - 1u].value.x >= OPAQUE && knots[i].value.x < OPAQUE {
            i--;
        }
    }
    return Track(first, last, i, front, rise, front, true);
}

/// The knot that the value moves to.
fn ahead_of(t: Track) -> f32 {
    let ends = knots[t.i].ends;
    return select(ends.x, ends.y, t.rise > 0.0);
}

/// Where in [0, 1] the value leaves the interval; above 1 if it does not.
fn end_of(t: Track) -> f32 {
    if t.rise == 0.0 {
        return 2.0;
    }
    return (ahead_of(t) - t.front) / t.rise;
}

/// The value at `u`, which is not beyond `end`.
fn value_at(t: Track, u: f32, end: f32, back: f32) -> f32 {
    if u >= 1.0 {
        return back;
    }
    let ends = knots[t.i].ends;
    return select(clamp(t.front + t.rise * u, ends.x, ends.y), ahead_of(t), end <= u);
}

/// The function at `s`, by the line of the interval.
fn line_of(t: Track, s: f32) -> vec4f {
    return knots[t.i].value + knots[t.i].slope * (s - knots[t.i].ends.x);
}

/// Whether there is an interval beyond that of `t`.
fn has_next(t: Track) -> bool {
    return select(t.i > t.first, t.i + 2u < t.last, t.rise > 0.0);
}

fn next_of(t: Track) -> u32 {
    return select(t.i - 1u, t.i + 1u, t.rise > 0.0);
}

/// Adds one piece of length `l` with extinction and colour `f` in front and `b` behind.
fn add_piece(f: vec4f, b: vec4f, l: f32) {
    if !DIRECT && f.x + b.x <= 0.0 {
        return;
    }
    let p = piece(f.x * l, b.x * l);
    let emitted = select(light.w, light.w * l, DIRECT);
    light = vec4f(light.xyz + emitted * (f.yzw * p.y + b.yzw * p.z), light.w * (1.0 - p.x));
}

/// Adds a segment of `length` whose field is `front` where the ray enters and `back` where it leaves. Pieces are measured by
/// values, not by shares of the segment: see `Track` in src/integral/knots.rs.
fn add_segment(front: Value, back: Value, length: f32) {
    if PAIR {
        add_pair(front, back, length);
        return;
    }
    var t = track(function.opacity, function.end, 0u, last_of(front), last_of(back));
    let stop = last_of(back);
    loop {
        let ahead = ahead_of(t);
        let is_last = select(t.rise == 0.0 || ahead <= stop, ahead >= stop, t.rise > 0.0);
        let to = select(ahead, stop, is_last);
        var share = 1.0;
        if t.rise != 0.0 {
            share = (to - t.at) / t.rise;
        }
        if share > 0.0 {
            var f = line_of(t, t.at);
            var b = line_of(t, to);
            if RGBA {
                var u = vec2f(0.0, 1.0);
                if t.rise != 0.0 {
                    u = (vec2f(t.at, to) - t.front) / t.rise;
                }
                let rise = color_of(back) - color_of(front);
                f = vec4f(f.x, (color_of(front) + rise * u.x) * function.scale);
                b = vec4f(b.x, (color_of(front) + rise * u.y) * function.scale);
            }
            add_piece(f, b, share * length);
        }
        work++;
        if is_last || light.w <= 0.0 || work > most_work() || !has_next(t) {
            return;
        }
        t.at = to;
        t.i = next_of(t);
    }
}

/// The same where two values are on functions of their own.
fn add_pair(front: Value, back: Value, length: f32) {
    var opacity = track(function.opacity, function.color, 0u, last_of(front), last_of(back));
    var color = track(function.color, function.end, BUCKETS, first_of(front), first_of(back));
    var u = 0.0;
    loop {
        let opacity_end = end_of(opacity);
        let color_end = end_of(color);
        let next = max(min(min(opacity_end, color_end), 1.0), u);
        let opacity_to = value_at(opacity, next, opacity_end, last_of(back));
        let color_to = value_at(color, next, color_end, first_of(back));
        let opacity_known = next >= 1.0 || opacity_end <= next;
        let color_known = next >= 1.0 || color_end <= next;
        var share = next - u;
        if opacity.known && opacity_known && opacity.rise != 0.0 {
            share = (opacity_to - opacity.at) / opacity.rise;
        } else if color.known && color_known && color.rise != 0.0 {
            share = (color_to - color.at) / color.rise;
        }
        let f = vec4f(line_of(opacity, opacity.at).x, line_of(color, color.at).yzw);
        let b = vec4f(line_of(opacity, opacity_to).x, line_of(color, color_to).yzw);
        add_piece(f, b, share * length);
        work++;
        if next >= 1.0 || light.w <= 0.0 || work > most_work() {
            return;
        }
        opacity.at = opacity_to;
        opacity.known = opacity_known;
        color.at = color_to;
        color.known = color_known;
        if opacity_end <= next {
            if !has_next(opacity) {
                return;
            }
            opacity.i = next_of(opacity);
        }
        if color_end <= next {
            if !has_next(color) {
                return;
            }
            color.i = next_of(color);
        }
        u = next;
    }
}
