// What says colour and opacity along segments: functions of one variable, a table, widgets. The f32 twin of `Form` in
// src/integral/second/wide and of src/integral/second/closed.rs.

//#if KNOTS
/// A line of a function of one variable: where it is that, and how it goes.
struct OneLine {
    value: vec4f,
    slope: vec4f,
    start: f32,
}

/// The line, of `count` from row `first` on, that `x` lies in, where `known` is where one before it was.
fn line_with(first: u32, count: u32, known: u32, x: f32) -> u32 {
    let ends = rows[first + 3u * known + 2u];
    if ends.x <= x && x < ends.y {
        return known;
    }
    var low = 0u;
    var high = count;
    while high > low + 1u {
        let middle = (low + high) / 2u;
        if rows[first + 3u * middle + 2u].x <= x {
            low = middle;
        } else {
            high = middle;
        }
        work++;
    }
    return low;
}

/// The line that a value is on beyond `u`, from the line `i` on, and where it leaves that.
struct Way {
    i: u32,
    next: f32,
}

fn way_on(first: u32, count: u32, known: u32, at: f32, rise: f32, u: f32) -> Way {
    var i = known;
    var next = BEYOND;
    if rise == 0.0 {
        return Way(i, next);
    }
    loop {
        let ends = rows[first + 3u * i + 2u];
        let place = (select(ends.x, ends.y, rise > 0.0) - at) / rise;
        work++;
        let has_next = select(i > 0u, i + 1u < count, rise > 0.0);
        next = select(BEYOND, place, has_next);
        if next > u + SAME || work > most_work() {
            break;
        }
        i = select(i - 1u, i + 1u, rise > 0.0);
    }
    return Way(i, next);
}

fn line_of_row(row: u32) -> OneLine {
    return OneLine(rows[row], rows[row + 1u], rows[row + 2u].x);
}

/// A channel, not below 0: what is, is rounding.
fn channel(x: vec3f, value: f32, slope: f32) -> vec3f {
    return max(fma(x, vec3f(slope), vec3f(value)), vec3f(0.0));
}
//#end

//#if SCALAR
var<private> knot: u32;
//#end
//#if FACTOR
var<private> factor_knot: u32;
//#end

//#if TEXELS
/// Four texels: the value at the first, how it rises along either axis, and along both; and its place.
var<private> texel_values: array<vec4f, 4>;
var<private> texel: vec2f;

/// Finds the texels that (s, g) is between.
fn hold_texels(at: vec2f) {
    let last = vec2f(second.size) - 1.0;
    let place = clamp(fma(at, second.scale, second.offset), vec2f(0.0), last);
    texel = min(floor(place), max(last - 1.0, vec2f(0.0)));
    let first = second.texels + u32(texel.x) + second.size.x * u32(texel.y);
    let right = select(0u, 1u, second.size.x > 1u);
    let up = select(0u, second.size.x, second.size.y > 1u);
    let a = rows[first];
    let b = rows[first + right];
    let c = rows[first + up];
    texel_values[0] = a;
    texel_values[1] = b - a;
    texel_values[2] = c - a;
    texel_values[3] = (rows[first + right + up] - c) - texel_values[1];
}

fn texel_channel(x: vec3f, y: vec3f, start: f32, right: f32, up: f32, both: f32) -> vec3f {
    return max(fma(y, fma(x, vec3f(both), vec3f(up)), fma(x, vec3f(right), vec3f(start))), vec3f(0.0));
}
//#end

//#if WIDGETS
/// Bits for each widget: it may be seen along the segment; its box ends there; and its wave turns there.
var<private> shown: u32;
var<private> boxed: u32;
var<private> turning: u32;

const CONSTANT = 0.0;
const GAUSSIAN = 1.0;
const TRIANGLE = 2.0;
const ABSOLUTE = 3.0;
const POSITIVE = 4.0;
const RAISED = 5.0;
/// Rows of a widget: its form, greatest opacity, floor and 1/(1 − floor); red, green, blue and at how many phases it turns; what
/// the form says; its box, in s and in g; and where it is seen; the phases at which it turns; of a wave above its floor, the
/// phases between which it is that, and its integral to the first and over a period.
const WIDGET = 7u;
/// The greatest phase: f32 tells 1e-5 of it.
const FARTHEST = 200.0;
/// Periods from which on waves are integrated in closed form.
const LONG = 0.5;
const PI = 3.14159265;

/// sin πz for |z| ≤ ½.
fn sines(z: vec3f) -> vec3f {
    let x = z * PI;
    let q = x * x;
    return x * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362880.0 - q * (1.0 / 39916800.0))))));
}

/// What is left of a phase by the nearest whole one.
fn fractions(p: vec3f) -> vec3f {
    return p - round(p);
}

/// Shares of the greatest opacity at (s, g), whether in the widget's box or not.
fn heights(k: u32, s: vec3f, g: vec3f) -> vec3f {
    let head = rows[WIDGET * k];
    if head.x == CONSTANT {
        return vec3f(1.0);
    }
    let form = rows[WIDGET * k + 2u];
    if head.x == GAUSSIAN {
        let x = fma(s, vec3f(form.x), vec3f(form.z));
        let y = fma(g, vec3f(form.y), vec3f(form.w));
        return exponentials((x * x + y * y) * -0.5);
    }
    let z = fractions(fma(s, vec3f(form.x), fma(g, vec3f(form.y), vec3f(form.z))));
    var height = abs(z) * 2.0;
    if head.x != TRIANGLE {
        // sin 2πz is a sine that runs twice as fast, folded back.
        let twice = z * 2.0;
        let folded = max(min(twice, 1.0 - twice), vec3f(0.0));
        let sine = sines(select(z, folded, head.x == POSITIVE));
        height = select(abs(sine), sine * sine, head.x == RAISED);
    }
    if head.z > 0.0 {
        height = max((height - head.z) * head.w, vec3f(0.0));
    }
    return height;
}

fn clip_by(ends: vec2f, at: f32, rise: f32, box: vec2f) -> vec2f {
    if rise == 0.0 {
        return select(ends, vec2f(BEYOND, -BEYOND), at < box.x || at > box.y);
    }
    let a = (box.x - at) / rise;
    let b = (box.y - at) / rise;
    return vec2f(max(ends.x, min(a, b)), min(ends.y, max(a, b)));
}

/// Where along the segment the box of a widget is.
fn clip(k: u32) -> vec2f {
    let box = rows[WIDGET * k + 3u];
    let ends = clip_by(vec2f(-BEYOND, BEYOND), stretch.at.x, stretch.rise.x, box.xy);
    return clip_by(ends, stretch.at.y, stretch.rise.y, box.zw);
}

/// Finds which widgets may be seen along the segment, and how many panels their bends ask for; LEFT if phases are too great for f32.
fn find_widgets() -> f32 {
    shown = 0u;
    boxed = 0u;
    turning = 0u;
    var bend = 0.0;
    let back = stretch.at + stretch.rise;
    let low = min(stretch.at, back);
    let high = max(stretch.at, back);
    for (var k = 0u; k < second.widgets; k++) {
        work++;
        let support = rows[WIDGET * k + 4u];
        if low.x > support.y || high.x < support.x || low.y > support.w || high.y < support.z {
            continue;
        }
        let bit = 1u << k;
        shown |= bit;
        let box = rows[WIDGET * k + 3u];
        if low.x < box.x || high.x > box.y || low.y < box.z || high.y > box.w {
            boxed |= bit;
        }
        let kind = rows[WIDGET * k].x;
        if kind == CONSTANT {
            continue;
        }
        let form = rows[WIDGET * k + 2u];
        if kind == GAUSSIAN {
            bend = max(bend, length(stretch.rise * form.xy) * BENDS.x);
            continue;
        }
        let p = fma(stretch.at.x, form.x, fma(stretch.at.y, form.y, form.z));
        let d = fma(stretch.rise.x, form.x, stretch.rise.y * form.y);
        let least = min(p, p + d) - NEAR;
        let most = max(p, p + d) + NEAR;
        let turns = rows[WIDGET * k + 5u];
        let count = rows[WIDGET * k + 1u].w;
        if any((ceil(vec4f(least) - turns) <= vec4f(most) - turns) & (vec4f(0.0, 1.0, 2.0, 3.0) < vec4f(count))) {
            turning |= bit;
        }
        if max(abs(least), abs(most)) > FARTHEST && !(CLOSED_FORMS && abs(d) > LONG) {
            return LEFT;
        }
        bend = max(bend, abs(d) * form.w * BENDS.y);
    }
    return bend;
}

//#if CLOSED
/// erf x, to 5e-7 (Abramowitz & Stegun, 7.1.26).
fn error_function(x: f32) -> f32 {
    let t = 1.0 / fma(abs(x), 0.3275911, 1.0);
    let series = t * (0.2548296 + t * (-0.28449674 + t * (1.4214137 + t * (-1.453152 + t * 1.0614054))));
    return sign(x) * (1.0 - series * exponential(-x * x));
}

/// The mean height of a Gaussian along all of a segment.
fn gaussian_mean(form: vec4f, at: vec2f, rise: vec2f) -> f32 {
    let d = rise * form.xy;
    // In the middle.
    let m = fma(d, vec2f(0.5), fma(at, form.xy, form.zw));
    let slope = dot(m, d);
    let s = slope * slope;
    let c = dot(d, d);
    if s < 0.25 && c < 0.1 {
        let two = (s - c) * 0.5;
        let four = s * (s * (1.0 / 24.0) - c * 0.25) + c * c * 0.125;
        let six = s * (s * (s * (1.0 / 720.0) - c * (1.0 / 48.0)) + c * c * (1.0 / 16.0)) - c * c * c * (1.0 / 48.0);
        return exponential(-0.5 * dot(m, m)) * (1.0 + two * (1.0 / 12.0) + four * (1.0 / 80.0) + six * (1.0 / 448.0));
    }
    // |x|²/2 is (A t + B)² + C₀ for t from −½ to ½.
    let steep = sqrt(c * 0.5);
    let before = slope * 0.5 / steep;
    let aside = m.x * d.y - m.y * d.x;
    let ends = error_function(fma(steep, 0.5, before)) - error_function(fma(steep, -0.5, before));
    return exponential(aside * aside * -0.25 / (steep * steep)) * ends / steep * (0.5 * sqrt(PI));
}

/// sin πx and cos πx for any x.
fn sine_cosine(x: f32) -> vec2f {
    let f = x - 2.0 * round(x * 0.5);
    let s = select(f, sign(f) - f, abs(f) > 0.5);
    let c = 0.5 - abs(f);
    return sines(vec3f(s, c, 0.0)).xy;
}

/// The integral of a wave without a floor from the start of a period to the share `f` of it.
fn plain_part(kind: f32, f: f32) -> f32 {
    if kind == TRIANGLE {
        return select(f * f, 0.5 - (1.0 - f) * (1.0 - f), f >= 0.5);
    }
    if kind == ABSOLUTE {
        return (1.0 - sine_cosine(f).y) / PI;
    }
    let both = sine_cosine(2.0 * f);
    if kind == POSITIVE {
        return select((1.0 - both.y) / (2.0 * PI), 1.0 / PI, f >= 0.5);
    }
    return 0.5 * f - both.x / (4.0 * PI);
}

/// The mean height of a wave along all of a segment that is LONG.
fn wave_mean(k: u32, at: vec2f, rise: vec2f) -> f32 {
    let head = rows[WIDGET * k];
    let form = rows[WIDGET * k + 2u];
    let above = rows[WIDGET * k + 6u];
    let p = fma(at.x, form.x, fma(at.y, form.y, form.z));
    let d = fma(rise.x, form.x, rise.y * form.y);
    let q = p + d;
    let begun = vec2f(floor(p), floor(q));
    var ends = vec2f(p, q) - begun;
    if head.z > 0.0 {
        ends = clamp(ends, vec2f(above.x), vec2f(above.y));
    }
    var parts = vec2f(plain_part(head.x, ends.x), plain_part(head.x, ends.y));
    if head.z > 0.0 {
        parts = (parts - above.z - head.z * (ends - above.x)) * head.w;
    }
    return ((begun.y - begun.x) * above.w + (parts.y - parts.x)) / d;
}

/// Colour and opacity where one widget alone is seen, if that has a closed form; else an opacity below LEFT.
fn closed() -> vec4f {
    let k = firstTrailingBit(shown);
    let head = rows[WIDGET * k];
    var ends = vec2f(0.0, 1.0);
    if boxed != 0u {
        let own = clip(k);
        ends = vec2f(max(own.x, 0.0), min(own.y, 1.0));
        if !(ends.x < ends.y) {
            return vec4f();
        }
    }
    let share = ends.y - ends.x;
    let at = fma(stretch.rise, vec2f(ends.x), stretch.at);
    let rise = stretch.rise * share;
    var mean = 1.0;
    if head.x == GAUSSIAN {
        mean = gaussian_mean(rows[WIDGET * k + 2u], at, rise);
    } else if head.x != CONSTANT {
        let form = rows[WIDGET * k + 2u];
        if abs(fma(rise.x, form.x, rise.y * form.y)) < LONG {
            return vec4f(0.0, 0.0, 0.0, 2.0 * LEFT);
        }
        mean = wave_mean(k, at, rise);
    }
    let depth = max(mean * head.y * second.absorbing * share * stretch.length, 0.0);
    let alpha = opacity_of_depth(depth);
    return vec4f(rows[WIDGET * k + 1u].xyz * alpha, alpha);
}
//#end
//#end
