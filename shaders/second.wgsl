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
    /// The power of silhouettes of whole segments; and the number of equal pieces.
    whole: f32,
    pieces: u32,
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

//#if PANELS
/// Colour and opacity of the segment in `stretch`; the opacity LEFT where f32 is too coarse for it.
fn of_panels() -> vec4f {
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
//#end
