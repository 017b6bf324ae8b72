// Pre-integrated tables: what a segment does, looked up. Twins of src/integral/table, which explains the forms.
//
// The bindings and constants are declared by src/gpu/table.rs, as programs have them at different places.

/// How a table is looked up.
struct Table {
    /// Texels along its axes, and the length of the thinnest slice but 0 (of other forms and of uniform lengths, the
    /// longest).
    size: vec4f,
    /// Of a cylinder's tiles: how many are beside each other, and in a layer; the reciprocals of a layer's width and
    /// height.
    tiles: vec4f,
    /// What texels are multiplied by, and what is added; for polynomials for each power.
    span: array<vec4f, 9>,
    least: array<vec4f, 9>,
}

/// The plane around the diagonal that all segments of a cell are taken to lie on, where PLANE_PER_CELL.
var<private> cell_plane: f32;

/// Premultiplied colour and opacity of a segment, from its colour over what is seen of it and its mean extinction.
fn reconstructed(texel: vec4f, length: f32) -> vec4f {
    let depth = length * texel.w;
    var opacity = opacity_of_depth(depth);
    if LINEAR_OPACITY {
        opacity = opacity_of_depth(texel.w * table.size.w) * min(length / table.size.w, 1.0);
    }
    // Of direct emission, what is seen of the length.
    let share = select(opacity, select(length, opacity / texel.w, depth > 1e-6), DIRECT);
    return vec4f(texel.xyz * share, opacity);
}

/// Values and lengths are at the centres of texels; lengths by equation 1 of Kraus et al.
fn in_volume(ends: vec2f, length: f32) -> vec4f {
    let steps = length / table.size.w;
    let slices = select(log2(max(steps, 1.0)) + min(steps, 1.0), steps * (table.size.z - 1.0), COLORING == UNIFORM);
    let at = (vec3f(ends * (table.size.xy - 1.0), slices) + 0.5) / table.size.xyz;
    let texel = textureSampleLevel(table_volume, table_filter, at, 0.0) * table.span[0] + table.least[0];
    if COLORING != LOG_NORMALISED {
        return texel;
    }
    return reconstructed(texel, length);
}

/// The coefficients of one power.
fn coefficients(at: vec2f, power: u32) -> vec4f {
    return textureSampleLevel(table_layers, table_filter, at, power, 0.0) * table.span[power] + table.least[power];
}

/// A sum of powers of the length. Not a loop: llvmpipe leaves those early.
fn by_polynomials(ends: vec2f, length: f32) -> vec4f {
    let at = (ends * (table.size.xy - 1.0) + 0.5) / table.size.xy;
    let x = min(length / table.size.w, 1.0);
    var color = vec3f();
    if DEGREE >= 8u { color = color * x + coefficients(at, 8u).xyz; }
    if DEGREE >= 7u { color = color * x + coefficients(at, 7u).xyz; }
    if DEGREE >= 6u { color = color * x + coefficients(at, 6u).xyz; }
    if DEGREE >= 5u { color = color * x + coefficients(at, 5u).xyz; }
    if DEGREE >= 4u { color = color * x + coefficients(at, 4u).xyz; }
    if DEGREE >= 3u { color = color * x + coefficients(at, 3u).xyz; }
    if DEGREE >= 2u { color = color * x + coefficients(at, 2u).xyz; }
    color = color * x + coefficients(at, 1u).xyz;
    let first = coefficients(at, 0u);
    return reconstructed(vec4f(color * x + first.xyz, first.w), length);
}

/// Which plane around the diagonal holds a segment, in [0, 1]: a of equation 10 of Röttger & Ertl.
fn plane_of(front: f32, back: f32, length: f32) -> f32 {
    let d = (front - back) * 0.5;
    let l = min(length / table.size.w, 1.0);
    let s = max(max(abs(d), l), TINY);
    let steep = 0.25 * l / s;
    return select(select(1.0 - steep, steep, d >= 0.0), 0.5 - 0.25 * d / s, l > abs(d));
}

/// The place (s, t), in texels, on plane `k`.
fn on_plane(k: u32, place: vec2f) -> vec4f {
    let planes = u32(table.size.z);
    var tile = select(k, 0u, k == planes);
    var at = place + 0.5;
    if PACKED {
        // The triangle of one of the last planes lies on its back beside that of one of the first.
        let mirrored = 4u * k > 3u * planes;
        tile = select(k, planes - k, mirrored);
        at.x = select(at.x, table.size.x + 3.0 - at.x, mirrored);
    }
    let across = u32(table.tiles.x);
    let in_layer = u32(table.tiles.y);
    let within = tile % in_layer;
    let corner = vec2f(f32(within % across), f32(within / across));
    let width = vec2f(select(table.size.x, table.size.x + 3.0, PACKED), table.size.y);
    return textureSampleLevel(table_layers, table_filter, (at + corner * width) * table.tiles.zw, tile / in_layer, 0.0);
}

/// A segment that lies on the plane `a` around the diagonal.
fn around_diagonal(ends: vec2f, length: f32, a: f32) -> vec4f {
    let s = max(abs(ends.x - ends.y), min(length / table.size.w, 1.0));
    let place = vec2f(min(s, 1.0), ends.y) * (table.size.xy - 1.0);
    let plane = a * table.size.z;
    var texel: vec4f;
    if ONE_PLANE {
        texel = on_plane(u32(plane + 0.5), place);
    } else {
        let low = min(u32(plane), u32(table.size.z) - 1u);
        texel = mix(on_plane(low, place), on_plane(low + 1u, place), plane - f32(low));
    }
    return select(vec4f(), texel * table.span[0] + table.least[0], s > 0.0);
}

/// How far values are in the table's range, ±1, but for rounding.
const WITHIN = 1.000001;

/// Premultiplied colour and opacity of a segment. Beyond ±1 the function is constant: that part of a segment is exact.
fn tabulated(front: f32, back: f32, length: f32) -> vec4f {
    if max(abs(front), abs(back)) <= WITHIN {
        return looked_up(front, back, length);
    }
    let inner = clamp(vec2f(front, back), vec2f(-1.0), vec2f(1.0));
    if inner.x == inner.y {
        return outside(front, length);
    }
    let parts = vec3f(inner.x - front, inner.y - inner.x, back - inner.y) * (length / (back - front));
    return joined(joined(outside(front, parts.x), looked_up(inner.x, inner.y, parts.y)), outside(back, parts.z));
}

/// A segment where values are beyond the table's range, on the side of `s`.
fn outside(s: f32, length: f32) -> vec4f {
    let value = knots[select(function.opacity, function.color - 1u, s > 0.0)].value;
    let p = piece(value.x * length, value.x * length);
    return vec4f(value.yzw * ((p.y + p.z) * select(1.0, length, DIRECT)), p.x);
}

/// `front` before `back`.
fn joined(front: vec4f, back: vec4f) -> vec4f {
    let transmittance = 1.0 - front.w;
    return vec4f(front.xyz + transmittance * back.xyz, 1.0 - transmittance * (1.0 - back.w));
}

/// A segment of values within ±1.
fn looked_up(front: f32, back: f32, length: f32) -> vec4f {
    let ends = clamp(vec2f(front, back) * 0.5 + 0.5, vec2f(0.0), vec2f(1.0));
    if COLORING == POLYNOMIAL {
        return by_polynomials(ends, length);
    }
    if COLORING == CYLINDRICAL {
        if PLANE_PER_CELL {
            return around_diagonal(ends, length, cell_plane);
        }
        return around_diagonal(ends, length, plane_of(front, back, length));
    }
    return in_volume(ends, length);
}

/// What tables of colours with components of their own tell, and what a part of constant extinction does, in the same way: the weight
/// of the colour behind, that of the colour in front, and the opacity.
struct Weights {
    behind: f32,
    before: f32,
    opacity: f32,
}

fn table_weights(front: f32, back: f32, length: f32) -> Weights {
    let texel = looked_up(front, back, length);
    return Weights(texel.x, texel.y, texel.w);
}

fn outer_weights(s: f32, length: f32) -> Weights {
    let extinction = knots[select(function.opacity, function.color - 1u, s > 0.0)].value.x;
    let p = piece(extinction * length, extinction * length);
    let unit = select(1.0, length, DIRECT);
    return Weights(p.z * unit, p.y * unit, p.x);
}

fn add_weighted(weights: Weights, first: vec3f, last: vec3f) {
    let emitted = first * weights.before + last * weights.behind;
    light = vec4f(light.xyz + light.w * emitted, light.w * (1.0 - weights.opacity));
}

/// Adds a segment whose colours are linear from `first` to `last`: see src/integral/lookup/components.rs.
fn add_linear(front: f32, back: f32, first: vec3f, last: vec3f, length: f32) {
    if max(abs(front), abs(back)) <= WITHIN {
        add_weighted(table_weights(front, back, length), first, last);
        return;
    }
    let inner = clamp(vec2f(front, back), vec2f(-1.0), vec2f(1.0));
    if inner.x == inner.y {
        add_weighted(outer_weights(front, length), first, last);
        return;
    }
    let over = 1.0 / (back - front);
    let parts = vec3f(inner.x - front, inner.y - inner.x, back - inner.y) * (over * length);
    let enter = first + (last - first) * ((inner.x - front) * over);
    let leave = first + (last - first) * ((inner.y - front) * over);
    add_weighted(outer_weights(front, parts.x), first, enter);
    add_weighted(table_weights(inner.x, inner.y, parts.y), enter, leave);
    add_weighted(outer_weights(back, parts.z), leave, last);
}

/// Adds a segment to the light, as `add_segment` does.
fn add_tabulated(front: Value, back: Value, length: f32) {
    if RGBA {
        add_linear(last_of(front), last_of(back), color_of(front) * function.scale, color_of(back) * function.scale, length);
        return;
    }
    if PAIR {
        add_tabulated_pair(front, back, length);
        return;
    }
    let segment = tabulated(last_of(front), last_of(back), length);
    light = vec4f(light.xyz + light.w * segment.xyz, light.w * (1.0 - segment.w));
}

/// The same where colours are on a function of their own: a part for each of its lines.
fn add_tabulated_pair(front: Value, back: Value, length: f32) {
    var color = track(function.color, function.end, BUCKETS, first_of(front), first_of(back));
    let stop = first_of(back);
    let rise = last_of(back) - last_of(front);
    var value = last_of(front);
    loop {
        let ahead = ahead_of(color);
        let is_last = select(color.rise == 0.0 || ahead <= stop, ahead >= stop, color.rise > 0.0);
        let to = select(ahead, stop, is_last);
        var share = 1.0;
        var so_far = 1.0;
        if color.rise != 0.0 {
            share = (to - color.at) / color.rise;
            so_far = (to - color.front) / color.rise;
        }
        if share > 0.0 {
            let end = select(last_of(front) + rise * so_far, last_of(back), is_last);
            add_linear(value, end, line_of(color, color.at).yzw, line_of(color, to).yzw, share * length);
            value = end;
        }
        work++;
        if is_last || light.w <= 0.0 || work > most_work() || !has_next(color) {
            return;
        }
        color.at = to;
        color.i = next_of(color);
    }
}
