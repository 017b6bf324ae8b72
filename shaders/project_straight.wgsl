// The exact integral by the lines of the transfer function that come with a cell. `lines_between` and `through_lines`,
// which go through all of them, are written by src/project/lines.rs.

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

/// Premultiplied colour and opacity of a segment whose cell's least value is `least`, in as many equal steps from front
/// to back as keep pieces MILD.
fn by_lines(front: f32, back: f32, length: f32, least: f32, words: Words) -> vec4f {
    let ramp = ramp_of(front, back, length);
    let steps = trunc(min(words[LAST_LINE_WORD].w * length * (1.0 / MILD), 64.0)) + 1.0;
    let width = 1.0 / steps;
    var light = vec4f(0.0, 0.0, 0.0, 1.0);
    var step = 0.0;
    loop {
        let start = select(1.0 - (step + 1.0) * width, step * width, ramp.sign > 0.0);
        let sum = through_lines(ramp, start, start + width, least, words);
        light = vec4f(fma(sum.xyz, vec3f(light.w), light.xyz), light.w * sum.w);
        step += 1.0;
        work++;
        if step >= steps {
            break;
        }
    }
    return vec4f(light.xyz, 1.0 - light.w);
}
