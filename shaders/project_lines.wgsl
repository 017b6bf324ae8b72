// The lines of the transfer function, and the exact integral by those that a segment is on, looked up one by one.

/// The lines of the function, LINES_ACROSS in a row: below each other value, slope, and the two ends with the number of the
/// line of a single value.
@group(0) @binding(10) var lines: texture_storage_2d<rgba32float, read>;

/// A line of the function, and between which values it is that.
struct Line {
    value: vec4f,
    slope: vec4f,
    ends: vec2f,
}

fn line_at_number(i: u32) -> Line {
    let at = vec2u(i % LINES_ACROSS, 3u * (i / LINES_ACROSS));
    return Line(textureLoad(lines, at), textureLoad(lines, at + vec2u(0u, 1u)), ends_of(i).xy);
}

/// The ends of a line, and the number of the line of its least value as a single one, if that is another; else 0.
fn ends_of(i: u32) -> vec4f {
    return textureLoad(lines, vec2u(i % LINES_ACROSS, 3u * (i / LINES_ACROSS) + 2u));
}

/// Differences of values that are as good as none.
const FLAT = 1e-30;

/// Premultiplied colour and opacity of a segment, by lines that are looked up one by one from the least value upward,
/// which is on the line `first` or above it. Pieces are measured by values.
fn by_lookups(front: Value, back: Value, length: f32, first: u32) -> vec4f {
    let low = min(last_of(front), last_of(back));
    let high = max(last_of(front), last_of(back));
    let rises = last_of(front) <= last_of(back);
    let range = high - low;
    let share = 1.0 / select(range, 1.0, range == 0.0);
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    var i = first;
    var start = low;
    loop {
        let line = line_at_number(i);
        let is_last = high < line.ends.y;
        let to = select(clamp(line.ends.y, start, high), high, is_last);
        let part = select((to - start) * share, select(0.0, 1.0, is_last), range == 0.0);
        let a = line.value + line.slope * (clamp(start, line.ends.x, line.ends.y) - line.ends.x);
        let b = line.value + line.slope * (clamp(to, line.ends.x, line.ends.y) - line.ends.x);
        var f = select(b, a, rises);
        var r = select(a, b, rises);
        if RGBA {
            let u = (start - low) * share;
            let next = select((to - low) * share, 1.0, is_last);
            let ends = select(vec2f(1.0 - next, 1.0 - u), vec2f(u, next), rises);
            f = vec4f(f.x, mix(color_of(front), color_of(back), ends.x) * function.scale);
            r = vec4f(r.x, mix(color_of(front), color_of(back), ends.y) * function.scale);
        }
        let l = part * length;
        let p = piece(f.x * l, r.x * l);
        let color = (f.yzw * p.y + r.yzw * p.z) * select(1.0, l, DIRECT);
        let transmittance = 1.0 - p.x;
        sum = vec4f(fma(color, vec3f(select(1.0, sum.w, rises)), sum.xyz * select(transmittance, 1.0, rises)), sum.w * transmittance);
        work++;
        if is_last || work > most_work() {
            break;
        }
        i++;
        start = to;
    }
    return vec4f(sum.xyz, 1.0 - sum.w);
}
