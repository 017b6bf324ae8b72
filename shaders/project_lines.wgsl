// The lines of the transfer function, and the exact integral by those that a segment is on, one after the other.

/// The lines of the function, LINES_ACROSS in a row: below each other value, slope, and the two ends with the number of the
/// line of a single value. An image, as drivers in software look buffers up lane by lane, and sample slowly.
@group(0) @binding(10) var lines: texture_storage_2d<rgba32float, read>;

/// A line of the function, and between which values it is that.
struct Line {
    value: vec4f,
    slope: vec4f,
    ends: vec2f,
}

fn line_of(i: u32) -> Line {
    let at = vec2u(i % LINES_ACROSS, 3u * (i / LINES_ACROSS));
    return Line(textureLoad(lines, at), textureLoad(lines, at + vec2u(0u, 1u)), ends_of(i).xy);
}

/// The ends of a line, and the number of the line of its least value as a single one, if that is another; else 0.
fn ends_of(i: u32) -> vec4f {
    return textureLoad(lines, vec2u(i % LINES_ACROSS, 3u * (i / LINES_ACROSS) + 2u));
}

/// A segment from its lesser value to its greater, whichever is in front. Places along it are shares of it, from 0 to 1.
struct Ramp {
    low: f32,
    range: f32,
    /// Its reciprocal.
    share: f32,
    length: f32,
    /// 1 if the lesser value is in front, −1 if the greater one is.
    sign: f32,
}

fn ramp_of(front: f32, back: f32, length: f32) -> Ramp {
    let range = abs(back - front);
    return Ramp(min(front, back), range, 1.0 / max(range, FLAT), length, select(-1.0, 1.0, front <= back));
}

/// Differences of values that are as good as none.
const FLAT = 1e-30;

/// Two parts of a ramp, the one of lesser values first: premultiplied colour, and how much of what lies behind comes
/// through.
fn joined(ramp: Ramp, one: vec4f, other: vec4f) -> vec4f {
    let rises = ramp.sign > 0.0;
    let color = fma(other.xyz, vec3f(select(1.0, one.w, rises)), one.xyz * select(other.w, 1.0, rises));
    return vec4f(color, one.w * other.w);
}

/// Premultiplied colour and opacity of a segment, by lines that are looked up one by one; the lesser value is in the
/// line `first` or above it.
fn by_lookups(front: Value, back: Value, length: f32, first: u32) -> vec4f {
    let ramp = ramp_of(last_of(front), last_of(back), length);
    let rises = ramp.sign > 0.0;
    let high = ramp.low + ramp.range;
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    var i = first;
    var u = 0.0;
    loop {
        let line = line_of(i);
        let is_last = high < line.ends.y;
        let next = select(clamp((line.ends.y - ramp.low) * ramp.share, u, 1.0), 1.0, is_last);
        let a = line.value + line.slope * (clamp(ramp.low + ramp.range * u, line.ends.x, line.ends.y) - line.ends.x);
        let b = line.value + line.slope * (clamp(ramp.low + ramp.range * next, line.ends.x, line.ends.y) - line.ends.x);
        var f = select(b, a, rises);
        var r = select(a, b, rises);
        if RGBA {
            let ends = select(vec2f(1.0 - next, 1.0 - u), vec2f(u, next), rises);
            f = vec4f(f.x, mix(color_of(front), color_of(back), ends.x) * function.scale);
            r = vec4f(r.x, mix(color_of(front), color_of(back), ends.y) * function.scale);
        }
        let l = (next - u) * length;
        let p = piece(f.x * l, r.x * l);
        sum = joined(ramp, sum, vec4f((f.yzw * p.y + r.yzw * p.z) * select(1.0, l, DIRECT), 1.0 - p.x));
        work++;
        if is_last || work > most_work() {
            break;
        }
        i++;
        u = next;
    }
    return vec4f(sum.xyz, 1.0 - sum.w);
}
