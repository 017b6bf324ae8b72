// Pre-integrated tables, built: the f32 twin of src/integral/table/*.rs, which explain how.

/// A linear piece of the function, as a rising scalar passes it: extinction and colour at both ends.
struct Part {
    front: vec4f,
    back: vec4f,
    /// Its part of the interval between two values.
    share: f32,
}

/// What is known at a value: integrals up to it of extinction, and of colour times extinction (direct: of emission), as
/// sums of three; extinction and colour of a segment that has this value all along; the colour.
struct Node {
    high: vec4f,
    middle: vec4f,
    low: vec4f,
    constant: vec4f,
    colour: vec4f,
}

struct BuildJob {
    /// Values, planes (of a cylinder) or slices, and the first slice that is meant.
    size: u32,
    slices: u32,
    first: u32,
    /// What the last channel is: opacity (0), or a mean extinction, by which colours are normalised (1).
    normalised: u32,
    /// Entries of the list, samples of all texels (0: of those touched), oversampling.
    entries: u32,
    samples: u32,
    oversampling: f32,
    /// The greatest mean extinction.
    most: f32,
    longest: f32,
    degree: u32,
    /// Slices that are filled side by side.
    count: u32,
    /// Texels from one row to the next.
    pitch: u32,
    lengths: array<vec4f, 64>,
    /// Row by row, what makes coefficients of points: of a limit, and of up to four more.
    weights: array<vec4f, 10>,
}

@group(1) @binding(0) var<uniform> job: BuildJob;
@group(1) @binding(1) var<storage, read> parts: array<Part>;
/// Where the parts of each interval begin.
@group(1) @binding(2) var<storage, read> begin: array<u32>;
@group(1) @binding(3) var<storage, read> nodes: array<Node>;
@group(1) @binding(4) var<storage, read> list: array<vec4f>;
@group(1) @binding(5) var<storage, read_write> texels: array<vec4f>;
@group(1) @binding(6) var<storage, read_write> result: array<vec4f>;

const NOTHING = vec4f(0.0, 0.0, 0.0, 1.0);

fn most_work() -> u32 {
    return 0xffffffu;
}

/// Where texel (i, j) of a slice, a plane or a power is.
fn index(slice: u32, i: u32, j: u32) -> u32 {
    return (slice * job.size + j) * job.pitch + i;
}

fn length_of(slice: u32) -> f32 {
    return job.lengths[slice / 4u][slice % 4u];
}

/// Premultiplied colours and transmittances: `a` in front of `b`.
fn over(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(a.xyz + a.w * b.xyz, a.w * b.w);
}

/// What a piece `l` long does.
fn light_of(front: vec4f, back: vec4f, l: f32) -> vec4f {
    let x = front.x * l;
    let y = back.x * l;
    let p = piece(x, y);
    let scale = select(1.0, l, DIRECT);
    return vec4f((front.yzw * p.y + back.yzw * p.z) * scale, exponential(-(x + y) * 0.5));
}

/// What the `i`th interval does that a scalar passes, where one is `step` long.
fn interval(i: u32, rising: bool, step: f32) -> vec4f {
    let at = select(job.size - 2u - i, i, rising);
    let last = begin[at + 1u];
    var sum = NOTHING;
    for (var p = begin[at]; p < last; p++) {
        let part = parts[p];
        let l = part.share * step;
        if rising {
            sum = over(sum, light_of(part.front, part.back, l));
        } else {
            sum = over(light_of(part.back, part.front, l), sum);
        }
    }
    return sum;
}

fn density(i: u32, j: u32) -> f32 {
    if i == j {
        return nodes[i].constant.x;
    }
    let a = nodes[i];
    let b = nodes[j];
    let sum = (b.high.x - a.high.x) + ((b.middle.x - a.middle.x) + (b.low.x - a.low.x));
    return max(sum / (f32(j) - f32(i)), 0.0);
}

fn limit(i: u32, j: u32) -> vec3f {
    if i == j {
        return nodes[i].constant.yzw;
    }
    let a = nodes[i];
    let b = nodes[j];
    let sum = (b.high - a.high) + ((b.middle - a.middle) + (b.low - a.low));
    let whole = select(sum.x, f32(j) - f32(i), DIRECT);
    if whole == 0.0 {
        return (a.colour.xyz + b.colour.xyz) * 0.5;
    }
    return max(sum.yzw / whole, vec3f());
}

/// What a texel holds of a segment from value `i` to `j`.
fn finished(i: u32, j: u32, light: vec4f, l: f32) -> vec4f {
    if job.normalised == 0u {
        return vec4f(light.xyz, 1.0 - light.w);
    }
    let rho = density(i, j);
    let depth = rho * l;
    let last = min(rho, job.most);
    if depth <= 1e-30 {
        return vec4f(limit(i, j), last);
    }
    return vec4f(light.xyz * (select(1.0, rho, DIRECT) / opacity_of_depth(depth)), last);
}

/// All runs of `d` intervals, of a slice.
fn runs(slice: u32, d: u32, rising: bool) {
    let n = job.size;
    let l = length_of(slice);
    let step = l / f32(d);
    let count = n - d;
    for (var block = 0u; block < count; block += d) {
        var end = NOTHING;
        for (var k = 0u; k < d; k++) {
            let i = block + d - 1u - k;
            end = over(interval(i, rising, step), end);
            if i < count {
                let front = select(n - 1u - i, i, rising);
                let back = select(front - d, front + d, rising);
                var texel = end;
                if i == block {
                    texel = finished(front, back, end, l);
                }
                texels[index(slice, front, back)] = texel;
            }
        }
        var beginning = NOTHING;
        let last = min(block + d, count);
        for (var i = block + 1u; i < last; i++) {
            beginning = over(beginning, interval(i + d - 1u, rising, step));
            let front = select(n - 1u - i, i, rising);
            let back = select(front - d, front + d, rising);
            let at = index(slice, front, back);
            texels[at] = finished(front, back, over(texels[at], beginning), l);
        }
    }
}

/// Closed form: a row of the sheared table, that is the texels whose value behind is as many texels on from that in
/// front.
@compute @workgroup_size(64)
fn closed(@builtin(global_invocation_id) id: vec3u) {
    let n = job.size;
    let r = id.x;
    let slice = job.first + id.y;
    if r >= n || slice >= job.slices {
        return;
    }
    if r == 0u {
        let l = length_of(slice);
        for (var i = 0u; i < n; i++) {
            let value = nodes[i].constant;
            texels[index(slice, i, i)] = finished(i, i, light_of(value, value, l), l);
        }
        return;
    }
    runs(slice, r, true);
    runs(slice, n - r, false);
}

/// Coefficients of the polynomials through the slices.
@compute @workgroup_size(64)
fn coefficients(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let j = id.y;
    if i >= job.size {
        return;
    }
    let first = limit(i, j);
    for (var c = 0u; c <= job.degree; c++) {
        let low = job.weights[2u * c];
        var sum = first * low.x;
        for (var k = 1u; k <= job.degree; k++) {
            let weight = job.weights[2u * c + k / 4u][k % 4u];
            sum += texels[index(k - 1u, i, j)].xyz * weight;
        }
        result[index(c, i, j)] = vec4f(sum, select(0.0, texels[index(0u, i, j)].w, c == 0u));
    }
}

/// Numeric integration of one texel.
@compute @workgroup_size(64)
fn sampled(@builtin(global_invocation_id) id: vec3u) {
    let n = job.size;
    let i = id.x;
    let j = id.y;
    let slice = id.z;
    if i >= n {
        return;
    }
    let most = f32(job.entries - 1u);
    let scale = most / f32(n - 1u);
    let rise = (f32(j) - f32(i)) * scale;
    var count = job.samples;
    if count == 0u {
        let apart = abs(f32(j) - f32(i)) / f32(n - 1u);
        count = max(u32(ceil(job.oversampling * f32(job.entries) * apart - 1e-3)), 1u);
    }
    let step = length_of(slice) / f32(count);
    var sum = NOTHING;
    for (var k = 0u; k < count; k++) {
        let at = clamp(f32(i) * scale + rise * ((f32(k) + 0.5) / f32(count)), 0.0, most);
        let low = min(u32(at), job.entries - 2u);
        let entry = mix(list[low], list[low + 1u], at - f32(low));
        let depth = entry.w * step;
        let alpha = opacity_of_depth(depth);
        var seen = alpha;
        if DIRECT {
            seen = select(step, alpha / entry.w, depth > 1e-6);
        }
        sum = over(sum, vec4f(entry.xyz * seen, 1.0 - alpha));
    }
    texels[index(slice, i, j)] = vec4f(sum.xyz, 1.0 - sum.w);
}

/// What is in front of `behind`, both with opacities.
fn before(front: vec4f, behind: vec4f) -> vec4f {
    return front + (1.0 - front.w) * behind;
}

fn texel(slice: u32, i: u32, j: u32) -> vec4f {
    return texels[index(slice, i, j)];
}

/// A texel of slice `first`: a segment of slice `slab` before one of the slice before, which meet between two values.
fn join(i: u32, j: u32, slab: u32, low: u32, high: u32, share: f32) {
    let previous = job.first - 1u;
    let front = mix(texel(slab, i, low), texel(slab, i, high), share);
    let rest = mix(texel(previous, low, j), texel(previous, high, j), share);
    texels[index(job.first, i, j)] = before(front, rest);
}

/// Slice `first` of twice the length of the one before.
@compute @workgroup_size(64)
fn doubled(@builtin(global_invocation_id) id: vec3u) {
    let sum = id.x + id.y;
    if id.x < job.size {
        join(id.x, id.y, job.first - 1u, sum / 2u, (sum + 1u) / 2u, 0.5);
    }
}

/// Slice `first`, which is a slab longer than the one before.
@compute @workgroup_size(64)
fn longer(@builtin(global_invocation_id) id: vec3u) {
    let middle = f32(id.x) + (f32(id.y) - f32(id.x)) / f32(job.first);
    let low = min(u32(middle), job.size - 2u);
    if id.x < job.size {
        join(id.x, id.y, 1u, low, low + 1u, middle - f32(low));
    }
}

/// Equation 9 of Röttger & Ertl (2002): the scalar in front and the length, both in [0, 1].
fn place(a: f32, s: f32, t: f32) -> vec2f {
    if a <= 0.25 {
        return vec2f(t + s, 4.0 * a * s);
    }
    if a <= 0.5 {
        return vec2f(t + 4.0 * (0.5 - a) * s, s);
    }
    if a <= 0.75 {
        return vec2f(t - 4.0 * (a - 0.5) * s, s);
    }
    return vec2f(t - s, 4.0 * (1.0 - a) * s);
}

/// A row of a cylinder's plane: each texel is the one before behind a slab.
@compute @workgroup_size(64)
fn cylinder(@builtin(global_invocation_id) id: vec3u) {
    let n = job.size;
    let plane = id.y;
    if id.x >= n {
        return;
    }
    let a = f32(plane) / f32(job.slices);
    let t = f32(id.x) / f32(n - 1u);
    var front = 2.0 * t - 1.0;
    var length = 0.0;
    var sum = NOTHING;
    for (var i = 0u; i < n; i++) {
        let next = place(a, f32(i) / f32(n - 1u), t);
        let value = 2.0 * next.x - 1.0;
        light = NOTHING;
        work = 0u;
        add_segment(value, front, (next.y - length) * job.longest);
        sum = over(light, sum);
        front = value;
        length = next.y;
        texels[index(plane, i, id.x)] = vec4f(sum.xyz, 1.0 - sum.w);
    }
}
