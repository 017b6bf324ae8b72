// The ray-segment integral: the f32 twin of src/integral.rs, which explains it.

/// A knot of the transfer function: extinction and colour from it on, how they rise up to the next knot, and where both are.
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
/// For each of BUCKETS equal parts of [−1, 1], the interval that its lower end lies in; first for opacity, then for colour.
@group(0) @binding(2) var<storage, read> buckets: array<u32>;

/// One linear value along a segment, and the interval of its function that it is in.
struct Track {
    first: u32,
    last: u32,
    i: u32,
    front: f32,
    rise: f32,
}

/// Iterations of loops so far, at least; each loop counts once more when it ends.
var<private> work: u32;

/// Light gathered from front to back: premultiplied colour, and how much of what lies behind comes through.
var<private> light: vec4f;

/// eˣ for x ≤ 0, as src/real.rs has it, but not below e^−87: the built-in function may be off by more.
fn exponential(x: f32) -> f32 {
    let clamped = max(x, -87.0);
    let k = round(clamped * 1.442695);
    let r = fma(k, 2.1219444e-4, fma(k, -0.693359375, clamped));
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))));
    return p * bitcast<f32>(u32(i32(k) + 127) << 23u);
}

/// 1 − e^{−depth}, accurate relative to itself.
fn opacity_of_depth(d: f32) -> f32 {
    if d < 0.25 {
        return d * (1.0 - d / 2.0 * (1.0 - d / 3.0 * (1.0 - d / 4.0 * (1.0 - d / 5.0 * (1.0 - d / 6.0)))));
    }
    return 1.0 - exponential(-d);
}

/// One node's share of ∫ T′(u) e^{−T(u)} du, ∫ u T′(u) e^{−T(u)} du, ∫ e^{−T(u)} du and ∫ u e^{−T(u)} du, as far as they are asked for.
fn node(x: f32, y: f32, start: f32, width: f32, at: vec2f) -> vec3f {
    let u = start + width * at.x;
    let rise = (y - x) * u;
    let e = width * at.y * exponential(-(x + rise * 0.5) * u);
    let absorbed = (x + rise) * e;
    if DIRECT {
        return vec3f(absorbed, e, u * e);
    }
    return vec3f(absorbed, u * absorbed, 0.0);
}

/// What a piece of optical depths `x` and `y` does: its opacity and the weights of the emission at its two ends.
fn piece(x: f32, y: f32) -> vec3f {
    // Beyond T(u) = DEEP nothing is seen: x u + (y − x) u²/2 = DEEP.
    var end = 1.0;
    if x + y > 2.0 * DEEP {
        end = min(2.0 * DEEP / (x + sqrt(max(x * x + 2.0 * DEEP * (y - x), 0.0))), 1.0);
    }
    // Three nodes at a time: all of a shallow piece, or half a panel's. So drivers that take both ways of every decision
    // compute no more than three for most pieces.
    let is_shallow = max(x, y) <= SHALLOW;
    let panels = f32(u32(min(max(x, x + (y - x) * end) * end / PANEL, 64.0))) + 1.0;
    let width = end / panels;
    var start = 0.0;
    var second = false;
    var sum = vec3f();
    loop {
        sum += node(x, y, start, width, select(select(GAUSS_6_0, GAUSS_6_3, second), GAUSS_3_0, is_shallow));
        sum += node(x, y, start, width, select(select(GAUSS_6_1, GAUSS_6_4, second), GAUSS_3_1, is_shallow));
        sum += node(x, y, start, width, select(select(GAUSS_6_2, GAUSS_6_5, second), GAUSS_3_2, is_shallow));
        start = select(start, start + width, second);
        second = !second;
        work++;
        if is_shallow || start > end - 0.5 * width {
            break;
        }
    }
    let alpha = select(sum.x, 1.0 - exponential(-(x + y) * 0.5), max(x, y) > PANEL);
    if DIRECT {
        return vec3f(alpha, sum.y - sum.z, sum.z);
    }
    let beta = min(sum.y, alpha);
    return vec3f(alpha, alpha - beta, beta);
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
    return Track(first, last, i, front, rise);
}

/// Where in [0, 1] the value leaves the interval; above 1 if it does not.
fn end_of(t: Track) -> f32 {
    if t.rise == 0.0 {
        return 2.0;
    }
    let ends = knots[t.i].ends;
    return (select(ends.x, ends.y, t.rise > 0.0) - t.front) / t.rise;
}

/// The function's value at `u`, by the line of the interval.
fn value_at(t: Track, u: f32) -> vec4f {
    let ends = knots[t.i].ends;
    let offset = clamp(t.front + t.rise * u, ends.x, ends.y) - ends.x;
    return knots[t.i].value + knots[t.i].slope * offset;
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

/// Adds a segment of `length` whose field is `front` where the ray enters and `back` where it leaves.
fn add_segment(front: Value, back: Value, length: f32) {
    var opacity = track(function.opacity, select(function.end, function.color, PAIR), 0u, last_of(front), last_of(back));
    var color = opacity;
    if PAIR {
        color = track(function.color, function.end, BUCKETS, first_of(front), first_of(back));
    }
    var u = 0.0;
    loop {
        let opacity_end = end_of(opacity);
        var color_end = 2.0;
        if PAIR {
            color_end = end_of(color);
        }
        let next = max(min(min(opacity_end, color_end), 1.0), u);
        var f = value_at(opacity, u);
        var b = value_at(opacity, next);
        if PAIR {
            f = vec4f(f.x, value_at(color, u).yzw);
            b = vec4f(b.x, value_at(color, next).yzw);
        }
        if RGBA {
            let rise = color_of(back) - color_of(front);
            f = vec4f(f.x, (color_of(front) + rise * u) * function.scale);
            b = vec4f(b.x, (color_of(front) + rise * next) * function.scale);
        }
        add_piece(f, b, (next - u) * length);
        work++;
        if next >= 1.0 || light.w <= 0.0 || work > most_work() {
            return;
        }
        if opacity_end <= next {
            if !has_next(opacity) {
                return;
            }
            opacity.i = next_of(opacity);
        }
        if PAIR && color_end <= next {
            if !has_next(color) {
                return;
            }
            color.i = next_of(color);
        }
        u = next;
    }
}
