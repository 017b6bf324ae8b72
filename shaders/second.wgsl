// Segments with a second variable or light: the f32 twin of src/integral/second/wide, which explains it. There the segments
// of a cell decide together; here each decides by itself. The three nodes of a panel are the components of vectors.

/// What holds for all of the function: see `Head` in src/integral/second/wide/rows.rs.
struct Second {
    /// Per normalised unit of length: optical depth at an extinction of 1, and direct emission of a white of 1.
    absorbing: f32,
    shining: f32,
    /// The number of widgets; the first rows of the function of s, of that of g, of the table and of the lights.
    widgets: u32,
    knots: u32,
    factors: u32,
    texels: u32,
    lights: u32,
    /// How many lights there are.
    lamps: u32,
    /// Lines of the function of s, and of that of g.
    lines: vec2u,
    /// Texels of the table, and the place of (s, g) among them: scale · (s, g) + offset.
    size: vec2u,
    scale: vec2f,
    offset: vec2f,
    ambient: f32,
    diffuse: f32,
    specular: f32,
    power: f32,
    /// The power of silhouettes; below 0 for none.
    silhouette: f32,
    /// The cosine of the angle by which normals may turn in a panel, and by what the way between them is panels.
    cosine: f32,
    turn: f32,
    /// Bits: see TWO_SIDED and those after it.
    looks: u32,
}

@group(2) @binding(0) var<uniform> second: Second;
/// Of each widget WIDGET rows, of each line 3, of each texel one, of each light LIGHT rows.
@group(2) @binding(1) var<storage, read> rows: array<vec4f>;

/// A segment: (s, g) in front and by how much they rise; with light, the same of the gradient, and where it begins.
struct Stretch {
    at: vec2f,
    rise: vec2f,
    length: f32,
    //#if LIT
    slope: vec3f,
    turn: vec3f,
    place: vec3f,
    along: vec3f,
    //#end
}

/// What the nodes of a panel emit and absorb: colours, by extinction or as they are if emission is direct; extinction; the
/// greatest opacity.
struct Nodes {
    red: vec3f,
    green: vec3f,
    blue: vec3f,
    tau: vec3f,
    most: vec3f,
}

var<private> stretch: Stretch;
/// Panels so far.
var<private> panels: u32;

/// Opacity of a segment that f32 is too coarse for.
const LEFT = -1.0;
/// Stands for places beyond all others.
const BEYOND = 1e30;
/// Places that are one, and phases.
const SAME = 1e-6;
const NEAR = 1e-5;
/// The greatest depth of a panel, for which short series hold.
const FAINT = 0.5;
/// By what factor the argument of a logarithm or a power changes in a panel.
const FACTOR = 1.4;
/// Transmittance of a segment below which nothing is told from nothing.
const DARK = 1e-9;
/// The shortest panels, as shares of a segment, unless they end where something turns.
const SHORTEST = 2e-6;
const MOST_PANELS = 128.0;
const MOST_STEPS = 512u;

/// eˣ for x ≤ 0, or little more.
fn exponentials(x: vec3f) -> vec3f {
    let clamped = max(x, vec3f(-87.0));
    let k = round(clamped * 1.442695);
    let r = fma(k, vec3f(2.1219444e-4), fma(k, vec3f(-0.693359375), clamped));
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))));
    let e = p * bitcast<vec3f>(vec3u(vec3i(k) + 127) << vec3u(23u));
    return select(e, vec3f(0.0), x < vec3f(-87.0));
}

/// e^{−d} for d from 0 to FAINT.
fn faded(d: vec3f) -> vec3f {
    return 1.0 - d * (1.0 - d * (0.5 - d * (1.0 / 6.0 - d * (1.0 / 24.0 - d * (1.0 / 120.0 - d * (1.0 / 720.0 - d * (1.0 / 5040.0)))))));
}

//#if LOGS
/// ln x for x > 0 that is no denormal number: `ln` in src/integral/floats.rs.
fn logarithms(x: vec3f) -> vec3f {
    let bits = bitcast<vec3u>(x);
    let exponent = bitcast<vec3i>(bits - vec3u(0x3f3504f3u)) >> vec3u(23u);
    let f = bitcast<vec3f>(bits - bitcast<vec3u>(exponent << vec3u(23u))) - 1.0;
    let k = vec3f(exponent);
    let square = f * f;
    let series = 0.33333331 + f * (-0.25 + f * (0.20000715 + f * (-0.16668058 + f * (0.14249323 + f * (-0.12420141 + f * (0.11676999 + f * (-0.1151461 + f * 0.070376836)))))));
    let y = fma(k, vec3f(-2.1219444e-4), f * square * series) - square * 0.5;
    return fma(k, vec3f(0.693359375), f + y);
}
//#end

//#if LOGARITHMIC
/// What is left of 1 by an opacity, as far as f32 tells it: places where a function is as good as 1 are no longer than that.
const LEAST_LEFT = 2e-7;
/// By what factor what is left of 1 changes in a panel: its logarithm is off by 5e-6 of the panel's length then.
const EVEN = 2.0;
/// Extinction times the unit distance of what is opaque.
const SOLID = 1e8;
/// Lengths of panels, over the unit distance and as shares of a segment, in which logarithms may do what they will.
const THIN_PANEL = vec2f(5e-5, 8e-6);

/// −ln(1 − a), or what stands for infinity.
fn depths_of(a: vec3f) -> vec3f {
    let left = max(1.0 - a, vec3f(LEAST_LEFT));
    // What 1 − a rounds off counts where a is small.
    return select(((left - 1.0) + min(a, vec3f(1.0 - LEAST_LEFT))) / left - logarithms(left), vec3f(SOLID), a >= vec3f(1.0));
}
//#end

/// The sooner of `next` and `place`, if that is beyond `u`.
fn nearer(next: f32, place: f32, u: f32) -> f32 {
    return select(next, min(next, place), place > u + SAME);
}

/// The sooner of `next` and where beyond `u` a whole number from limits.x to limits.y is passed.
fn next_whole(next: f32, at: f32, rise: f32, limits: vec2f, u: f32) -> f32 {
    if rise == 0.0 {
        return next;
    }
    let now = fma(rise, u, at);
    var whole = floor(now + NEAR) + 1.0;
    if rise > 0.0 {
        whole = max(whole, limits.x);
    } else {
        whole = min(ceil(now - NEAR) - 1.0, limits.y);
    }
    if whole < limits.x || whole > limits.y {
        return next;
    }
    let over = 1.0 / rise;
    var place = (whole - at) * over;
    // What is as good as here is followed by the next.
    if !(place > u + SAME) {
        place += abs(over);
    }
    return nearer(next, place, u);
}

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

/// What is at the places `u` of a panel, in the middle of which is `middle`.
fn nodes_at(u: vec3f, middle: f32) -> Nodes {
    let s = fma(vec3f(stretch.rise.x), u, vec3f(stretch.at.x));
    let g = fma(vec3f(stretch.rise.y), u, vec3f(stretch.at.y));
    var n = Nodes();
    var white = vec3f(0.0);
    //#if WIDGETS
    var rest = shown;
    while rest != 0u {
        let k = firstTrailingBit(rest);
        rest &= rest - 1u;
        work++;
        if (boxed >> k & 1u) == 1u {
            let ends = clip(k);
            if !(ends.x < middle && middle < ends.y) {
                continue;
            }
        }
        var a = heights(k, s, g) * rows[WIDGET * k].y;
        //#if LOGARITHMIC
        if rows[WIDGET * k].x != CONSTANT {
            // A peak is that high at a point only.
            a = min(a, vec3f(1.0 - 6e-8));
        }
        n.most = max(n.most, a);
        a = depths_of(a);
        //#end
        let q = select(a, vec3f(1.0), DIRECT);
        let color = rows[WIDGET * k + 1u];
        n.red += q * color.x;
        n.green += q * color.y;
        n.blue += q * color.z;
        n.tau += a;
        white += q;
    }
    //#end
    //#if SCALAR
    let line = line_of_row(second.knots + 3u * knot);
    let beyond = s - line.start;
    n.tau = channel(beyond, line.value.x, line.slope.x);
    n.red = channel(beyond, line.value.y, line.slope.y);
    n.green = channel(beyond, line.value.z, line.slope.z);
    n.blue = channel(beyond, line.value.w, line.slope.w);
    //#end
    //#if TEXELS
    let last = vec2f(second.size) - 1.0;
    let x = clamp(fma(s, vec3f(second.scale.x), vec3f(second.offset.x)), vec3f(0.0), vec3f(last.x)) - texel.x;
    let y = clamp(fma(g, vec3f(second.scale.y), vec3f(second.offset.y)), vec3f(0.0), vec3f(last.y)) - texel.y;
    n.red = texel_channel(x, y, texel_values[0].x, texel_values[1].x, texel_values[2].x, texel_values[3].x);
    n.green = texel_channel(x, y, texel_values[0].y, texel_values[1].y, texel_values[2].y, texel_values[3].y);
    n.blue = texel_channel(x, y, texel_values[0].z, texel_values[1].z, texel_values[2].z, texel_values[3].z);
    n.tau = texel_channel(x, y, texel_values[0].w, texel_values[1].w, texel_values[2].w, texel_values[3].w);
    //#end
    //#if ONE_EACH
    //#if LOGARITHMIC
    n.most = n.tau;
    n.tau = depths_of(n.tau);
    //#end
    white = vec3f(1.0);
    if !DIRECT {
        n.red *= n.tau;
        n.green *= n.tau;
        n.blue *= n.tau;
        white = n.tau;
    }
    //#end
    var factor = vec3f(1.0);
    //#if FACTOR
    let of_g = line_of_row(second.factors + 3u * factor_knot);
    factor = channel(g - of_g.start, of_g.value.x, of_g.slope.x);
    //#end
    //#if LIT
    let normal = normals_at(u);
    let on_ray = normal * stretch.along;
    if second.silhouette >= 0.0 {
        factor *= powers(max(1.0 - abs(on_ray), vec3f(0.0)), second.silhouette);
    }
    if (second.looks & SHADED) != 0u {
        let coming = coming_light(u, normal, on_ray);
        n.red = n.red * coming.diffuse[0] + coming.specular[0] * white;
        n.green = n.green * coming.diffuse[1] + coming.specular[1] * white;
        n.blue = n.blue * coming.diffuse[2] + coming.specular[2] * white;
    }
    //#end
    if !DIRECT {
        n.red *= factor;
        n.green *= factor;
        n.blue *= factor;
    }
    n.tau *= factor;
    return n;
}

/// Where beyond `u` the segment next turns or jumps, or ends; and finds the lines of functions that it is on until then.
fn next_break(u: f32, breaks: bool) -> f32 {
    var next = 1.0;
    //#if SCALAR
    let way = way_on(second.knots, second.lines.x, knot, stretch.at.x, stretch.rise.x, u);
    knot = way.i;
    next = nearer(next, way.next, u);
    //#end
    //#if FACTOR
    let factor_way = way_on(second.factors, second.lines.y, factor_knot, stretch.at.y, stretch.rise.y, u);
    factor_knot = factor_way.i;
    next = nearer(next, factor_way.next, u);
    //#end
    //#if TEXELS
    let place = fma(stretch.at, second.scale, second.offset);
    let slope = stretch.rise * second.scale;
    let last = vec2f(second.size) - 1.0;
    next = next_whole(next, place.x, slope.x, vec2f(0.0, last.x), u);
    next = next_whole(next, place.y, slope.y, vec2f(0.0, last.y), u);
    //#end
    if !breaks {
        return next;
    }
    //#if WIDGETS
    var rest = boxed | turning;
    while rest != 0u {
        let k = firstTrailingBit(rest);
        rest &= rest - 1u;
        work++;
        if (boxed >> k & 1u) == 1u {
            let ends = clip(k);
            next = nearer(nearer(next, ends.x, u), ends.y, u);
        }
        if (turning >> k & 1u) == 1u {
            let form = rows[WIDGET * k + 2u];
            let turns = rows[WIDGET * k + 5u];
            let count = rows[WIDGET * k + 1u].w;
            let p = fma(stretch.at.x, form.x, fma(stretch.at.y, form.y, form.z));
            let d = fma(stretch.rise.x, form.x, stretch.rise.y * form.y);
            let far = vec2f(-BEYOND, BEYOND);
            next = next_whole(next, p - turns.x, d, far, u);
            if count > 1.0 {
                next = next_whole(next, p - turns.y, d, far, u);
            }
            if count > 2.0 {
                next = next_whole(next, p - turns.z, d, far, u);
            }
            if count > 3.0 {
                next = next_whole(next, p - turns.w, d, far, u);
            }
        }
    }
    //#end
    //#if LIT
    next = next_turn_of_light(next, u);
    //#end
    return next;
}

/// Colour and opacity of the segment in `stretch`; the opacity LEFT where f32 is too coarse for it.
fn of_stretch() -> vec4f {
    var bend = 0.0;
    var breaks = false;
    //#if WIDGETS
    bend = find_widgets();
    if bend < 0.0 {
        return vec4f(0.0, 0.0, 0.0, LEFT);
    }
    if shown == 0u {
        return vec4f();
    }
    //#if CLOSED
    if (shown & (shown - 1u)) == 0u {
        let whole = closed();
        if whole.w > 1.5 * LEFT {
            return whole;
        }
    }
    //#end
    breaks = (boxed | turning) != 0u;
    //#end
    //#if SCALAR
    knot = line_with(second.knots, second.lines.x, knot, stretch.at.x);
    //#end
    //#if FACTOR
    factor_knot = line_with(second.factors, second.lines.y, factor_knot, stretch.at.y);
    //#end
    //#if LIT
    bend = max(bend, turns_of_normals() * second.turn);
    breaks = breaks || light_turns();
    //#end
    //#if LOGARITHMIC
    // A logarithm of what bends bends more.
    bend *= FACTOR;
    //#end
    if bend > MOST_PANELS {
        return vec4f(0.0, 0.0, 0.0, LEFT);
    }
    let absorbing = second.absorbing * stretch.length;
    let shining = second.shining * stretch.length;
    let longest = 1.0 / max(bend, 1.0);
    var sum = vec4f(0.0);
    var through = 1.0;
    var u = 0.0;
    var h = longest;
    var end = next_break(0.0, breaks);
    for (var step = 0u; step < MOST_STEPS; step++) {
        work++;
        if work > most_work() {
            break;
        }
        let rest = end - u;
        // No sliver is left to the last.
        if rest < h * (1.0 + NEAR) {
            h = rest;
        } else if rest < h * 2.0 {
            h = rest * 0.5;
        }
        //#if LIT
        // In the shortest panels it makes no difference where a normal turns.
        if h > SHORTEST && !is_evenly_lit(u, h) {
            h *= 0.5;
            continue;
        }
        //#end
        let is_all = h >= rest;
        let middle = fma(h, 0.5, u);
        //#if TEXELS
        hold_texels(fma(stretch.rise, vec2f(middle), stretch.at));
        //#end
        let n = nodes_at(fma(GAUSS_NODES, vec3f(h), vec3f(u)), middle);
        let depths = n.tau * (absorbing * h);
        let depth = dot(GAUSS_WEIGHTS, depths);
        let fits = depth <= FAINT;
        var tame = fits;
        //#if LOGARITHMIC
        let most = max(max(n.most.x, n.most.y), n.most.z);
        let least = min(min(n.most.x, n.most.y), n.most.z);
        // Gauss's rule is off by 5 % of the unit of depth where a logarithm is infinite at an end of a panel.
        let ratio = max(1.0 - least, LEAST_LEFT) / max(1.0 - most, LEAST_LEFT);
        tame = tame && (ratio <= EVEN || h <= max(THIN_PANEL.x / absorbing, THIN_PANEL.y));
        if min(min(n.tau.x, n.tau.y), n.tau.z) > 1e-2 * SOLID {
            // Nothing is seen of it but its front.
            let front = nodes_at(vec3f(u), middle);
            let color = vec3f(front.red.x, front.green.x, front.blue.x) / max(front.tau.x, 1e-37);
            return sum + through * vec4f(select(color, vec3f(0.0), DIRECT), 1.0);
        }
        //#end
        if tame {
            panels++;
            let before = TO_NODES * depths;
            let visible = faded(before) * GAUSS_WEIGHTS;
            var color = vec3f(dot(visible, n.red), dot(visible, n.green), dot(visible, n.blue));
            let alpha = depth * (1.0 - depth * (0.5 - depth * (1.0 / 6.0 - depth * (1.0 / 24.0 - depth * (1.0 / 120.0 - depth * (1.0 / 720.0 - depth * (1.0 / 5040.0)))))));
            if DIRECT {
                color *= shining * h;
            } else {
                // What one colour emits is that times the opacity, whatever the nodes miss of it.
                let absorbed = dot(visible, n.tau);
                color *= select(0.0, alpha / absorbed, absorbed > 1e-37);
            }
            sum += through * vec4f(color, alpha);
            through -= through * alpha;
            u = select(u + h, end, is_all);
            if u >= 1.0 - SAME || through < DARK {
                return sum;
            }
            var growth = 2.0;
            //#if LOGARITHMIC
            // Towards where a logarithm is infinite, panels get shorter.
            growth = select(2.0, 0.5, ratio > FACTOR && n.most.z > n.most.x);
            //#end
            h = select(min(growth * h, longest), longest, is_all);
            if is_all {
                end = next_break(u, breaks);
            }
        } else {
            h *= select(clamp(1.0 / depth, 0.02, 1.0) * 0.45, 0.5, fits);
            if h < SHORTEST {
                break;
            }
        }
    }
    return vec4f(0.0, 0.0, 0.0, LEFT);
}
