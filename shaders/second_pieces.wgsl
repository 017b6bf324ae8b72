// The light of a segment: by panels (second.wgsl), or as published by Song et al. (2009), in equal pieces that are classified at their
// ends; and silhouettes of whole segments.

//#if PIECES
/// What is at the place `u` alone: red, green and blue, by extinction or as they are if emission is direct, and extinction.
fn classified(u: f32) -> vec4f {
    let at = fma(stretch.rise, vec2f(u), stretch.at);
    //#if WIDGETS
    let all = shown;
    let ending = boxed;
    var rest = boxed;
    while rest != 0u {
        let k = firstTrailingBit(rest);
        rest &= rest - 1u;
        let box = rows[WIDGET * k + 3u];
        if at.x < box.x || at.x > box.y || at.y < box.z || at.y > box.w {
            shown &= ~(1u << k);
        }
    }
    boxed = 0u;
    //#end
    //#if SCALAR
    knot = line_with(second.knots, second.lines.x, knot, at.x);
    //#end
    //#if FACTOR
    factor_knot = line_with(second.factors, second.lines.y, factor_knot, at.y);
    //#end
    //#if TEXELS
    hold_texels(at);
    //#end
    let n = nodes_at(vec3f(u), u);
    //#if WIDGETS
    shown = all;
    boxed = ending;
    //#end
    return vec4f(n.red.x, n.green.x, n.blue.x, n.tau.x);
}

/// Colour and opacity of the segment in equal pieces: `Second::add_segmented`.
fn of_pieces() -> vec4f {
    //#if WIDGETS
    if find_widgets() < 0.0 {
        return vec4f(0.0, 0.0, 0.0, LEFT);
    }
    if shown == 0u {
        return vec4f();
    }
    //#end
    let share = 1.0 / f32(second.pieces);
    let absorbing = second.absorbing * stretch.length * share;
    let shining = second.shining * stretch.length * share;
    var front = classified(0.0);
    var sum = vec4f();
    var through = 1.0;
    for (var i = 1u; i <= second.pieces; i++) {
        work++;
        if work > most_work() {
            return vec4f(0.0, 0.0, 0.0, LEFT);
        }
        let back = classified(f32(i) * share);
        let weights = piece(front.w * absorbing, back.w * absorbing);
        var color = (front.xyz * weights.y + back.xyz * weights.z) * shining;
        if !DIRECT {
            // Where nothing is absorbed, the colour is that of the other end.
            let of_front = front.xyz / max(front.w, 1e-37);
            let of_back = back.xyz / max(back.w, 1e-37);
            color = select(of_back, of_front, front.w > 0.0) * weights.y + select(of_front, of_back, back.w > 0.0) * weights.z;
        }
        sum += through * vec4f(color, weights.x);
        through -= through * weights.x;
        front = back;
    }
    panels += second.pieces;
    return sum;
}
//#end

/// Colour and opacity of the segment in `stretch`; the opacity LEFT where f32 is too coarse for it.
fn of_stretch() -> vec4f {
    //#if PIECES
    var light = of_pieces();
    //#end
    //#if PANELS
    var light = of_panels();
    //#end
    //#if WHOLE
    if light.w > 0.0 {
        let normal = fma(stretch.turn, vec3f(0.5), stretch.slope);
        let size = length(normal);
        let on_ray = select(0.0, abs(dot(normal, stretch.along)) / size, size > NONE_THERE);
        light *= powers(vec3f(max(1.0 - on_ray, 0.0)), second.whole).x;
    }
    //#end
    return light;
}
