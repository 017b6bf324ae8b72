// What stretches of rays emit and absorb along which the value is a cubic: the twin of src/cast/lanes/cut.rs and
// src/integral/cubic/stretch.rs, which explain it.

/// A line of the transfer function, over values that are counted in the spread of its knots.
struct Line {
    /// Extinction and colour (or emission) at the value `start`, and what they grow by.
    value: vec4f,
    slope: vec4f,
    /// Between which values it holds.
    low: f32,
    high: f32,
    start: f32,
    /// Where extinction is the logarithm of a line: the share of what passes at the start that is lost by unit of the
    /// value; else 0.
    curve: f32,
    /// Between these a value is on it whatever f32 is off by; nowhere if that is too much.
    inner: vec2f,
    /// Of this line and those before it: how many show, are too narrow for f32, and begin with a step.
    shown: u32,
    narrow: u32,
    steps: u32,
    flags: u32,
    unused: vec2u,
}

const SHOWS = 1u;
const NARROW = 2u;

/// Where the lines of opacity, and, of pairs, of colour begin and end, and how colours of the field's own are scaled.
struct Lines {
    color: u32,
    end: u32,
    scale: f32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> function: Lines;
@group(0) @binding(1) var<storage, read> lines: array<Line>;
/// For each of BUCKETS equal parts of [−1, 1], the line that its lower end is on; first for opacity, then for colour.
@group(0) @binding(2) var<storage, read> buckets: array<u32>;

/// Light gathered from front to back: premultiplied colour, and how much of what lies behind comes through.
var<private> light: vec4f;
/// The largest values along the ray; the last of them at −FAR if there are none.
var<private> largest: vec4f;
/// Iterations of loops so far.
var<private> work: u32;
/// Whether f32, or the device's loops, have not enough for the ray: the CPU draws it.
var<private> given_up: bool;
/// The values along a voxel, as polynomials of the place in it: from the constant on.
var<private> cubics: array<vec4f, COMPONENTS>;
/// The lines that the ray was on last.
var<private> opacity_line: u32;
var<private> color_line: u32;

/// The line that a value is on: of colour or opacity.
fn line_at(s: f32, of_color: bool) -> u32 {
    let first = select(0u, function.color, of_color);
    let end = select(function.color, function.end, of_color);
    let b = u32(clamp((s + 1.0) * (f32(BUCKETS) / 2.0), 0.0, f32(BUCKETS - 1u)));
    var i = buckets[select(b, b + BUCKETS, of_color)];
    while i + 1u < end && lines[i].high <= s {
        i++;
        work++;
    }
    while i > first && lines[i].low > s {
        i--;
        work++;
    }
    return i;
}

/// What a polynomial is at `u`.
fn value_of(a: vec4f, u: f32) -> f32 {
    return a.x + u * (a.y + u * (a.z + u * a.w));
}

/// The part of a polynomial that is `h` long, from `u` on.
fn part_of(a: vec4f, u: f32, h: f32) -> vec4f {
    let bend = a.z + 3.0 * u * a.w;
    return vec4f(value_of(a, u), h * (a.y + u * (a.z + bend)), h * h * bend, h * h * h * a.w);
}

/// What a polynomial is not below and not above in [0, 1].
fn bounds_of(a: vec4f) -> vec2f {
    let b = a.x + a.y / 3.0;
    let c = a.x + (2.0 * a.y + a.z) / 3.0;
    let d = a.x + a.y + (a.z + a.w);
    return vec2f(min(min(a.x, b), min(c, d)), max(max(a.x, b), max(c, d)));
}

/// Where in ]0, 1[ a polynomial turns, ascending; 1 in place of what is not there.
fn turns_of(a: vec4f) -> vec2f {
    // Its derivative's Bernstein coefficients.
    let p = a.y;
    let q = a.y + a.z;
    let r = a.y + 2.0 * a.z + 3.0 * a.w;
    let square = q * q - p * r;
    if square < 0.0 {
        return vec2f(1.0);
    }
    let h = -(q + select(-sqrt(square), sqrt(square), q >= 0.0));
    let u = share_of(h, r);
    let v = share_of(p, h);
    return vec2f(min(u, v), max(u, v));
}

fn share_of(above: f32, below: f32) -> f32 {
    let both = above + below;
    let u = above / select(both, 1.0, both == 0.0);
    return select(1.0, u, both != 0.0 && u > 0.0 && u < 1.0);
}

/// A value along a voxel, on the way from line to line: from a place `u` where it is `s`, which may be a knot, by what it
/// grows. So short pieces between near knots are as long as they are, and not as roots of the whole are apart.
struct Track {
    a: vec4f,
    turns: vec2f,
    line: u32,
    of_color: bool,
    u: f32,
    s: f32,
    growth: vec3f,
    /// Where its monotone part ends, and what it grows by up to there.
    end: f32,
    rise: f32,
    /// How long it is on its line yet, and whether it leaves that then.
    h: f32,
    leaves: bool,
}

fn track_of(a: vec4f, of_color: bool) -> Track {
    var t: Track;
    t.a = a;
    t.turns = turns_of(a);
    t.line = line_at(a.x, of_color);
    t.of_color = of_color;
    t.s = a.x;
    return begun(t);
}

/// Begins a monotone part.
fn begun(before: Track) -> Track {
    var t = before;
    t.end = select(select(1.0, t.turns.y, t.turns.y > t.u), t.turns.x, t.turns.x > t.u);
    return aimed(t);
}

/// What it grows by in `h`.
fn grown(growth: vec3f, h: f32) -> f32 {
    return h * (growth.x + h * (growth.y + h * growth.z));
}

/// Finds where it leaves the line that it is on.
fn aimed(before: Track) -> Track {
    var t = before;
    let bend = 3.0 * t.u * t.a.w;
    t.growth = vec3f(t.a.y + t.u * (2.0 * t.a.z + bend), t.a.z + bend, t.a.w);
    t.h = t.end - t.u;
    t.rise = grown(t.growth, t.h);
    let rises = t.rise > 0.0;
    let gap = select(lines[t.line].low, lines[t.line].high, rises) - t.s;
    t.leaves = select((t.rise < gap), (t.rise > gap), rises);
    if t.leaves {
        t.h = root(t, gap, rises);
    }
    return t;
}

/// Goes on behind the line, or the monotone part.
fn passed(before: Track) -> Track {
    var t = before;
    work++;
    if !t.leaves {
        t.s += t.rise;
        t.u = t.end;
        return begun(t);
    }
    t.u += t.h;
    if t.rise > 0.0 {
        t.s = lines[t.line].high;
        t.line = min(t.line + 1u, select(function.color, function.end, t.of_color) - 1u);
    } else {
        t.s = lines[t.line].low;
        t.line = max(t.line, select(0u, function.color, t.of_color) + 1u) - 1u;
    }
    return aimed(t);
}

/// How far ahead in its monotone part a value has grown by `gap`, by Newton's steps, and by halves where these leave the
/// bracket.
fn root(t: Track, gap: f32, rises: bool) -> f32 {
    var low = 0.0;
    var high = t.h;
    var x = high * clamp(gap / t.rise, 0.0, 1.0);
    for (var left = 40u; left > 0u; left--) {
        work++;
        let off = grown(t.growth, x) - gap;
        if abs(off) <= NEAR * abs(gap) {
            return x;
        }
        if (off < 0.0) == rises {
            low = x;
        } else {
            high = x;
        }
        let slope = t.growth.x + x * (2.0 * t.growth.y + x * 3.0 * t.growth.z);
        let newton = x - off / select(slope, 1.0, slope == 0.0);
        let inside = slope != 0.0 && newton >= low && newton <= high;
        let next = select((low + high) * 0.5, newton, inside);
        // After a step this short, what is left is about its square.
        let settled = inside && abs(next - x) <= SHORT * next;
        x = next;
        if settled {
            return x;
        }
    }
    return x;
}

/// What a stretch does: opacity, what is absorbed (chromatic) or comes through (direct), and the emitting values' integral
/// over that.
struct Sums {
    alpha: f32,
    sum: f32,
    moment: Moment,
}

/// Extinction at the value `offset` above where the line begins, times `length`.
fn depth_at(line: Line, offset: f32, length: f32) -> f32 {
    let w = line.curve * offset;
    return max((line.slope.x * offset * logarithm(w) + line.value.x) * length, 0.0);
}

/// Whether the polynomial through five points is not the logarithm that extinction is along `s`.
fn is_bent(line: Line, s: vec4f) -> bool {
    let share = abs(line.curve) * BENDING;
    let bent = share * (abs(s.z) + abs(s.w));
    let all = share * abs(s.y) + bent;
    return all > MOST || all * all * bent > MOST_BENT;
}

/// The optical depth of a stretch `length` long along which the value is `s` above where the line begins; about that where
/// extinction is a logarithm.
fn depth_of_stretch(line: Line, s: vec4f, length: f32) -> f32 {
    if CURVED && line.curve != 0.0 {
        let middle = depth_at(line, value_of(s, 0.5), length);
        let ends = depth_at(line, s.x, length) + depth_at(line, s.x + s.y + (s.z + s.w), length);
        return (ends + 4.0 * middle) / 6.0;
    }
    let mean = s.x + (s.y / 2.0 + s.z / 3.0 + s.w / 4.0);
    return (line.slope.x * mean + line.value.x) * length;
}

/// The integral of a stretch of little depth, by the Gauss–Lobatto rule of five points; `e` are the emitting values.
fn integral_of(line: Line, s: vec4f, e: array<Moment, 4>, length: f32) -> Sums {
    var before: vec3f;
    var depth: f32;
    if CURVED && line.curve != 0.0 {
        let front = depth_at(line, s.x, length);
        let a = depth_at(line, value_of(s, NODES.x), length);
        let b = depth_at(line, value_of(s, NODES.y), length);
        let c = depth_at(line, value_of(s, NODES.z), length);
        let back = depth_at(line, s.x + s.y + (s.z + s.w), length);
        depth = END * (front + back) + (WEIGHTS.x * a + WEIGHTS.y * b + WEIGHTS.z * c);
        before = UP_TO_FRONT * front + (UP_TO_A * a + UP_TO_B * b + UP_TO_C * c) + UP_TO_BACK * back;
    } else {
        let scaled = length * line.slope.x;
        let t = vec4f(scaled * s.x + length * line.value.x, scaled * s.y / 2.0, scaled * s.z / 3.0, scaled * s.w / 4.0);
        depth = max(t.x + t.y + (t.z + t.w), 0.0);
        before = NODES * (t.x + NODES * (t.y + NODES * (t.z + NODES * t.w)));
    }
    before = max(before, vec3f());
    let alpha = opacity_of_depth(depth);
    let lost = WEIGHTS * vec3f(opacity_of_depth(before.x), opacity_of_depth(before.y), opacity_of_depth(before.z));
    let rise = e[1] + (e[2] + e[3]);
    if DIRECT {
        let through = WEIGHTS - lost;
        let last = END * (1.0 - alpha);
        let sum = (through.x + through.y + through.z) + (END + last);
        let moment = through.x * risen(e, NODES.x) + through.y * risen(e, NODES.y) + through.z * risen(e, NODES.z) + last * rise;
        return Sums(alpha, sum * length, (e[0] * sum + moment) * length);
    }
    let slopes = lost.x * slope_of(e, NODES.x) + lost.y * slope_of(e, NODES.y) + lost.z * slope_of(e, NODES.z);
    let moment = (e[0] + rise) * alpha - (slopes + END * alpha * (e[1] + 2.0 * e[2] + 3.0 * e[3]));
    return Sums(alpha, alpha, moment);
}

fn risen(e: array<Moment, 4>, u: f32) -> Moment {
    return u * (e[1] + u * (e[2] + u * e[3]));
}

fn slope_of(e: array<Moment, 4>, u: f32) -> Moment {
    return e[1] + u * (2.0 * e[2] + u * 3.0 * e[3]);
}

/// Whether means are asked for in the place of light: of extinction, and of colour by extinction and by length.
var<private> takes_means: bool;
var<private> mean_depth: f32;
var<private> mean_by_depth: vec3f;
var<private> mean_by_length: vec3f;

/// Adds to means what lies along a part that is `size` long, on one line: all that is asked for is a polynomial of degree 6,
/// for which the rule of five points is exact.
fn add_means(line: Line, s: vec4f, size: f32) {
    let places = array<f32, 5>(0.0, NODES.x, NODES.y, NODES.z, 1.0);
    let weights = array<f32, 5>(END, WEIGHTS.x, WEIGHTS.y, WEIGHTS.z, END);
    for (var k = 0u; k < 5u; k++) {
        let offset = value_of(s, places[k]);
        let depth = depth_at(line, offset, 1.0);
        let color = line.value.yzw + line.slope.yzw * offset;
        let weight = weights[k] * size;
        mean_depth += weight * depth;
        mean_by_depth += weight * depth * color;
        mean_by_length += weight * color;
    }
}

/// Adds the part of a voxel that is `size` long from `u` on, on which its value is on one line of opacity and one of
/// colour, and begins with `s`; the voxel is `length` long.
fn add_part(u: f32, size: f32, opacity: u32, color: u32, s: f32, length: f32) {
    let line = lines[opacity];
    let a = cubics[COMPONENTS - 1u];
    if MEANS && takes_means {
        var own = part_of(a, u, size);
        own.x = s - line.start;
        add_means(line, own, size);
        return;
    }
    if (line.flags & SHOWS) == 0u {
        return;
    }
    var at = u;
    var rest = size;
    var value = s;
    for (var left = 400u; left > 0u; left--) {
        work += 3u;
        var h = rest;
        var own = part_of(a, at, h);
        own.x = value - line.start;
        // Parts of small depth.
        var is_cut = false;
        for (var tries = 30u; tries > 0u; tries--) {
            let depth = depth_of_stretch(line, own, length * h);
            let bent = CURVED && line.curve != 0.0 && is_bent(line, own);
            if !bent && depth <= DEEPEST {
                break;
            }
            // Right at once where extinction grows from 0; where it is even, in some such steps.
            let share = sqrt(0.8 * DEEPEST / max(depth, 1e-6));
            h *= select(share, min(share, 0.5), bent);
            let offset = own.x;
            own = part_of(a, at, h);
            own.x = offset;
            is_cut = true;
            work++;
        }
        let e = emitting(color, own, at, h);
        if is_cut && at + h <= at {
            // What has no length that f32 could tell, and yet is deep, shows what it begins with.
            if !DIRECT {
                light = vec4f(light.xyz + light.w * shown_by(line, color, 1.0, e[0]), 0.0);
            }
            light.w = 0.0;
            return;
        }
        let sums = integral_of(line, own, e, length * h);
        light = vec4f(light.xyz + light.w * shown_by(line, color, sums.sum, sums.moment), light.w * (1.0 - sums.alpha));
        if !is_cut || light.w < LEAST_TRANSMITTANCE {
            return;
        }
        at += h;
        rest -= h;
        value = value_of(a, at);
    }
    given_up = true;
}

/// Adds what lies along a voxel, `length` long, in which the values are `cubics`.
fn add_voxel(length: f32) {
    let a = cubics[COMPONENTS - 1u];
    let bounds = bounds_of(a);
    if MAXIMUM {
        raise(a, bounds.y);
        return;
    }
    // While the ray stays on its lines, nothing is looked up.
    let inner = lines[opacity_line].inner;
    var stays = bounds.x >= inner.x && bounds.y <= inner.y;
    if PAIR && stays {
        let colors = bounds_of(cubics[0]);
        let inside = lines[color_line].inner;
        stays = colors.x >= inside.x && colors.y <= inside.y;
    }
    if stays {
        add_part(0.0, 1.0, opacity_line, color_line, a.x, length);
        return;
    }
    let first = line_at(bounds.x - OFF, false);
    let last = line_at(bounds.y + OFF, false);
    opacity_line = line_at(a.x + a.y + (a.z + a.w), false);
    if PAIR {
        color_line = line_at(value_of(cubics[0], 1.0), true);
    }
    let shown = lines[last].shown - lines[first].shown + (lines[first].flags & SHOWS);
    if shown == 0u && !(MEANS && takes_means) {
        return;
    }
    if is_doubtful(first, last, bounds) {
        given_up = true;
        return;
    }
    var t = track_of(a, false);
    var c: Track;
    if PAIR {
        let colors = bounds_of(cubics[0]);
        if is_doubtful(line_at(colors.x - OFF, true), line_at(colors.y + OFF, true), colors) {
            given_up = true;
            return;
        }
        c = track_of(cubics[0], true);
    }
    var u = 0.0;
    for (var left = 4096u; left > 0u; left--) {
        work++;
        var size = t.h;
        var s = t.s;
        var to = 1.0;
        if PAIR {
            to = max(min(t.u + t.h, c.u + c.h), u);
            size = to - u;
            s = value_of(a, u);
        } else {
            u = t.u;
        }
        if size > 0.0 {
            add_part(u, size, t.line, c.line, s, length);
        }
        let ends = t.end >= 1.0 && !t.leaves && (!PAIR || (c.end >= 1.0 && !c.leaves));
        if ends || light.w < LEAST_TRANSMITTANCE || given_up {
            return;
        }
        if !PAIR || t.u + t.h <= to {
            t = passed(t);
        }
        if PAIR && c.u + c.h <= to {
            c = passed(c);
        }
        u = to;
    }
    given_up = true;
}

/// Whether values between these bounds, on lines from one to another, are for f64: on lines too narrow for f32, or nearly
/// constant where there is a step.
fn is_doubtful(first: u32, last: u32, bounds: vec2f) -> bool {
    let narrow = lines[last].narrow - lines[first].narrow + select(0u, 1u, (lines[first].flags & NARROW) != 0u);
    return narrow > 0u || (lines[last].steps > lines[first].steps && bounds.y - bounds.x < FLAT);
}

/// Takes the largest value of a voxel, and the others there, if it is larger than all before.
fn raise(a: vec4f, most: f32) {
    if most <= largest.w {
        return;
    }
    let turns = turns_of(a);
    let places = vec4f(0.0, turns, 1.0);
    for (var k = 0u; k < 4u; k++) {
        let s = value_of(a, places[k]);
        if s > largest.w {
            largest = values_at(places[k]);
            largest.w = s;
        }
    }
}

/// Whether f64 may see the largest values on the other side of a step.
fn is_largest_doubtful() -> bool {
    let bounds = vec2f(largest.w);
    if largest.w <= -FAR {
        return false;
    }
    if is_doubtful(line_at(largest.w - OFF, false), line_at(largest.w + OFF, false), bounds) {
        return true;
    }
    return PAIR && is_doubtful(line_at(largest.x - OFF, true), line_at(largest.x + OFF, true), bounds);
}
