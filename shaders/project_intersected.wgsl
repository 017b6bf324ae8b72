// The form that intersects each pixel's ray with the cell: the outline only says which pixels may be met.

// The attributes of a primitive:
// 0–2  the cell's facets, counted from the middle of a pixel amid it;
// 3    that middle, nothing, and bits: which facets are entered, and, of 16, whether the last is the reference that the
//      others count from;
// 4–5  the stretch of rays around it, times the cell's depth; and the longest edge;
// then, where anything cuts rays off or is dithered, the inverse depths between which they are seen, the cell's depth (t in a
// parallel view) and the rank; and the line of the function that the least value is on.
// The values: in the middle; how it rises from pixel to pixel to the right and down, and towards the eye; the least and
// the greatest.

/// To pixels from the upper left corner of the image.
fn pixel_of(p: vec3f) -> vec2f {
    return (vec2f(p.x, -p.y) / p.z + vec2f(1.0 - frame.offset.x, 1.0 + frame.offset.y)) * 0.5 * frame.size;
}

/// The smallest upright rectangle around what is seen of a cell some of whose corners are beside or behind the eye.
fn box_of(corners: array<vec3f, 4>) -> array<vec2f, 4> {
    var all = corners;
    var low = vec2f(FAR);
    var high = vec2f(-FAR);
    for (var i = 0u; i < 4u; i++) {
        let a = all[i];
        if a.z >= BESIDE {
            low = min(low, pixel_of(a));
            high = max(high, pixel_of(a));
        }
        for (var j = 0u; j < i; j++) {
            let b = all[j];
            if (a.z >= BESIDE) != (b.z >= BESIDE) {
                let cut = pixel_of(vec3f(mix(a.xy, b.xy, (BESIDE - a.z) / (b.z - a.z)), BESIDE));
                low = min(low, cut);
                high = max(high, cut);
            }
        }
    }
    low = clamp(low - 1.0, vec2f(-1.0), frame.size);
    high = clamp(high + 1.0, vec2f(0.0), frame.size + 1.0);
    return array<vec2f, 4>(low, vec2f(high.x, low.y), high, vec2f(low.x, high.y));
}

/// The corners (x, y) around an outline, of which the fourth may be the first, moved outward so that all edges are
/// GROWTH further out.
fn grown(x: vec4f, y: vec4f) -> array<vec2f, 4> {
    let is_triangle = x.w == x.x && y.w == y.x;
    let turn = select(-1.0, 1.0, (x.z - x.x) * (y.w - y.y) - (y.z - y.x) * (x.w - x.y) > 0.0);
    // Directions of the edges after each corner and before it; a triangle has no fourth.
    let across = x.yzwx - x;
    let down = y.yzwx - y;
    let after = sqrt(across * across + down * down);
    let after_x = across / after;
    let after_y = down / after;
    let before = vec4f(select(after.w, after.z, is_triangle), after.xyz);
    let before_x = vec4f(select(after_x.w, after_x.z, is_triangle), after_x.xyz);
    let before_y = vec4f(select(after_y.w, after_y.z, is_triangle), after_y.xyz);
    let reach = 1.0 + before_x * after_x + before_y * after_y;
    let blunt = (min(before, after) > vec4f(1e-6)) & (reach > vec4f(2e-4)) & (reach <= vec4f(2.001));
    if all(blunt.xyz) && (blunt.w || is_triangle) {
        // Outward normals of the edges before and after, and the way out between them.
        let out = turn * GROWTH / reach;
        let moved_x = x + (before_y + after_y) * out;
        let moved_y = y - (before_x + after_x) * out;
        if is_triangle {
            return pairs_of(moved_x.xyzx, moved_y.xyzx);
        }
        return parted(moved_x, moved_y);
    }
    // A sliver: the rectangle around it, along its longest side or diagonal.
    let q = array<vec2f, 4>(vec2f(x.x, y.x), vec2f(x.y, y.y), vec2f(x.z, y.z), vec2f(x.w, y.w));
    let axis = longer(longer(longer(q[1] - q[0], q[2] - q[0]), longer(q[2] - q[1], q[3] - q[0])), longer(q[3] - q[1], q[3] - q[2]));
    let long = length(axis);
    let u = select(vec2f(1.0, 0.0), axis / long, long > 0.0);
    let v = vec2f(-u.y, u.x);
    let along = (x - x.x) * u.x + (y - y.x) * u.y;
    let aside = (x - x.x) * v.x + (y - y.x) * v.y;
    let low = vec2f(least_of(along), least_of(aside)) - GROWTH;
    let high = vec2f(greatest_of(along), greatest_of(aside)) + GROWTH;
    return array<vec2f, 4>(q[0] + u * low.x + v * low.y, q[0] + u * high.x + v * low.y, q[0] + u * high.x + v * high.y, q[0] + u * low.x + v * high.y);
}

fn pairs_of(x: vec4f, y: vec4f) -> array<vec2f, 4> {
    return array<vec2f, 4>(vec2f(x.x, y.x), vec2f(x.y, y.y), vec2f(x.z, y.z), vec2f(x.w, y.w));
}

/// `v` from component `by` on.
fn turned(v: vec4f, by: u32) -> vec4f {
    let once = select(v, v.yzwx, (by & 1u) != 0u);
    return select(once, once.zwxy, (by & 2u) != 0u);
}

/// The four corners of an outline so that the first and the third part it into triangles. Rasterisers do blocks of pixels,
/// and those on the diagonal twice: the shorter one is taken; or one triangle around all, where that is less.
fn parted(x: vec4f, y: vec4f) -> array<vec2f, 4> {
    let across = x.yzwx - x;
    let down = y.yzwx - y;
    // Without a side, those before and after it meet beyond it, and add twice this area, if they do, and not far away.
    let turns = abs(across * down.yzwx - down * across.yzwx);
    let one = vec2f(x.z - x.x, y.z - y.x);
    let other = vec2f(x.w - x.y, y.w - y.y);
    let squares = vec2f(dot(one, one), dot(other, other));
    let meet = (across.wxyz * down.yzwx - down.wxyz * across.yzwx) * sign(one.x * other.y - one.y * other.x);
    let added = select(vec4f(FAR), turns.wxyz * turns / meet, meet > max(turns * 0.25, vec4f(1e-3)));
    let least = least_of(added);
    if least * least > DOUBLED * DOUBLED * min(squares.x, squares.y) {
        let by = select(0u, 1u, squares.y < squares.x);
        return pairs_of(turned(x, by), turned(y, by));
    }
    let by = select(select(select(3u, 2u, added.z == least), 1u, added.y == least), 0u, added.x == least);
    let u = turned(x, by);
    let v = turned(y, by);
    // The side from the first to the second corner is left out.
    let a = vec2f(u.x - u.w, v.x - v.w);
    let b = vec2f(u.y - u.x, v.y - v.x);
    let c = vec2f(u.z - u.y, v.z - v.y);
    let apex = vec2f(u.x, v.x) + a * ((b.x * c.y - b.y * c.x) / (a.x * c.y - a.y * c.x));
    return pairs_of(vec4f(apex.x, u.zw, apex.x), vec4f(apex.y, v.zw, apex.y));
}

fn longer(a: vec2f, b: vec2f) -> vec2f {
    return select(a, b, dot(b, b) > dot(a, a));
}

/// Depths that are as good as none.
const AT_EYE = 1e-18;

/// A cell is flat if rays pass through it over less than this share of its longest edge. Of thicker cells nothing cancels.
const THIN = 0.25;

/// Faces that are inclined less than this to the rays are taken for seen edge-on: where rays cross them f32 can't tell.
const EDGE_ON = 1e-5;

/// How far rays are moved from pixels' centres when such faces are asked on which side they are, in pixels: of two
/// cells that share one, a ray that lies in it meets exactly one. Less than outlines are grown by.
const PERTURBATION = vec2f(4e-4, 1.7e-4);

/// From `p` to the point at `t` of a ray from `start` along `way`: as accurate as it is short, as faces that rays graze
/// ask for that. `t` has 12 digits.
fn way_to(start: DoubleSingle, way: DoubleSingle, t: f32, p: DoubleSingle) -> vec3f {
    let high = shortened(way.high);
    let low = (way.high - high) + way.low;
    let q = sum(p.high, -start.high);
    return (t * high - q.high) + (t * low - (q.low + (p.low - start.low)));
}

fn added(a: DoubleSingle, b: DoubleSingle) -> DoubleSingle {
    let s = sum(a.high, b.high);
    return sum(s.high, s.low + (a.low + b.low));
}

fn negated(a: DoubleSingle) -> DoubleSingle {
    return DoubleSingle(-a.high, -a.low);
}

/// The products of components (Dekker 1971).
fn multiplied(a: DoubleSingle, b: DoubleSingle) -> DoubleSingle {
    let p = computed(a.high * b.high);
    let a_high = shortened(a.high);
    let b_high = shortened(b.high);
    let a_low = a.high - a_high;
    let b_low = b.high - b_high;
    let rest = (((a_high * b_high - p) + a_high * b_low) + a_low * b_high) + a_low * b_low;
    return DoubleSingle(p, rest + (a.high * b.low + a.low * b.high));
}

fn crossed(a: DoubleSingle, b: DoubleSingle) -> DoubleSingle {
    let p = multiplied(DoubleSingle(a.high.yzx, a.low.yzx), DoubleSingle(b.high.zxy, b.low.zxy));
    let q = multiplied(DoubleSingle(a.high.zxy, a.low.zxy), DoubleSingle(b.high.yzx, b.low.yzx));
    return added(p, negated(q));
}

fn dotted(a: DoubleSingle, b: DoubleSingle) -> f32 {
    let p = multiplied(a, b);
    let whole = added(added(p, DoubleSingle(p.high.yzx, p.low.yzx)), DoubleSingle(p.high.zxy, p.low.zxy));
    return whole.high.x;
}

/// The corners of a cell in a sequence that turns the same way and ends with corner `last`.
fn ending_with(last: u32) -> vec4u {
    let halves = select(vec4u(0u, 1u, 2u, 3u), vec4u(2u, 3u, 0u, 1u), last < 2u);
    return select(halves, halves.yxwz, (last & 1u) == 0u);
}

/// A cell is drawn as a whole: there is no `piece` but the first.
fn write_primitive(i: u32, solid: Solid, own_values: array<Value, 4>, piece: u32, rank: u32) {
    let p = solid.p;
    var around: array<vec2f, 4>;
    let corners = array<vec3f, 4>(seen(p[0]), seen(p[1]), seen(p[2]), seen(p[3]));
    let w = vec4f(corners[0].z, corners[1].z, corners[2].z, corners[3].z);
    let is_special = any(w < vec4f(frame.nearest));
    let centroid = (p[0] + p[1] + p[2] + p[3]) * 0.25;
    var centre = pixel_of(seen(centroid));
    if is_special {
        around = box_of(corners);
        centre = (around[0] + around[2]) * 0.5;
    }
    // The corner opposite to the face that is seen largest comes last: other faces count from that one.
    let shown = abs(dependency(p));
    let largest = greatest_of(shown);
    let last = select(select(select(3u, 2u, shown.z == largest), 1u, shown.y == largest), 0u, shown.x == largest);
    let to = ending_with(last);
    var own = solid.corners;
    let at = array<DoubleSingle, 4>(own[to.x], own[to.y], own[to.z], own[to.w]);
    var given = own_values;
    let v = array<Value, 4>(given[to.x], given[to.y], given[to.z], given[to.w]);
    //#if LIT
    let q = array<vec3f, 4>(own_slopes[to.x], own_slopes[to.y], own_slopes[to.z], own_slopes[to.w]);
    let leans = array<vec3f, 3>(q[1] - q[0], q[2] - q[0], q[3] - q[0]);
    var lean: array<vec3f, 3>;
    //#end
    let ab = added(at[1], negated(at[0]));
    let ac = added(at[2], negated(at[0]));
    let ad = added(at[3], negated(at[0]));
    let bc = added(at[2], negated(at[1])).high;
    let b = ab.high;
    let c = ac.high;
    let d = ad.high;
    centre = floor(clamp(centre, vec2f(0.0), frame.size - 1.0)) + 0.5;
    let pixel = centre - 0.5;
    let start = affine(frame.starts, pixel.x, pixel.y);
    let way = affine(frame.ways, pixel.x, pixel.y);
    let longest = max(max(max(length(b), length(c)), max(length(d), length(bc))), max(distance(b, d), distance(c, d)));
    // Where the pixel's ray is as deep as the cell's middle, how far that is from one pixel to the next, and from the
    // eye.
    var t = dot(centroid, frame.forward.xyz);
    if PERSPECTIVE {
        // Around the eye, as far as the cell goes: inverse depths of what is much farther cancel.
        t = max(t, max(frame.nearest, 0.5 * longest) - frame.forward.w);
    }
    // Few digits, so that products with it are exact.
    t = shortened(vec3f(t)).x;
    let depth = select(1.0, t + frame.forward.w, PERSPECTIVE);
    let right = fma(by_column(frame.ways), vec3f(t), by_column(frame.starts));
    let down = fma(by_row(frame.ways), vec3f(t), by_row(frame.starts));
    let out = way.high * depth;
    let away = way_to(start, way, t, at[0]);
    // Inward normals, but for the sign of the volume, of the faces opposite to each corner. They are pairs of floats: edges
    // that are rounded to one float do not tell the normals of a flat cell.
    let normal_b = crossed(ac, ad);
    let normal_c = crossed(ad, ab);
    let normal_d = crossed(ab, ac);
    let normal_a = negated(added(added(normal_b, normal_c), normal_d));
    let volume = dotted(ab, normal_b);
    let n = array<vec3f, 4>(normal_a.high, normal_b.high, normal_c.high, normal_d.high);
    // From the eye to corners a and b; the same everywhere in a parallel view.
    let seen_a = select(out, out - away, PERSPECTIVE);
    let seen_b = select(out, seen_a + b, PERSPECTIVE);
    let away_b = away - b;
    let slopes = vec4f(dot(seen_b, n[0]), dot(seen_a, n[1]), dot(seen_a, n[2]), dot(seen_a, n[3]));
    if !is_special {
        // From the pixel to the corners, as accurate as the cell is small; from the areas of its faces the outline.
        let ndc = select(vec2f(0.0), sample_of(centre), PERSPECTIVE);
        let across_image = array<vec3f, 2>(frame.across[0].xyz - ndc.x * frame.forward.xyz, frame.across[1].xyz - ndc.y * frame.forward.xyz);
        let corner = array<vec3f, 4>(-away, -away_b, c - away, d - away);
        let x = vec4f(dot(corner[0], across_image[0]), dot(corner[1], across_image[0]), dot(corner[2], across_image[0]), dot(corner[3], across_image[0]));
        let y = vec4f(dot(corner[0], across_image[1]), dot(corner[1], across_image[1]), dot(corner[2], across_image[1]), dot(corner[3], across_image[1]));
        let deep = depth + vec4f(dot(corner[0], frame.forward.xyz), dot(corner[1], frame.forward.xyz), dot(corner[2], frame.forward.xyz), dot(corner[3], frame.forward.xyz));
        let per = 0.5 / select(vec4f(1.0), deep, PERSPECTIVE);
        let left = centre.x + x * per * frame.size.x;
        let under = centre.y - y * per * frame.size.y;
        let o = outline(slopes);
        around = grown(vec4f(left[o.x], left[o.y], left[o.z], left[o.w]), vec4f(under[o.x], under[o.y], under[o.z], under[o.w]));
    }
    var heights = vec4f(dot(away_b, n[0]), dot(away, n[1]), dot(away, n[2]), dot(away, n[3]));
    let across = vec4f(dot(right, n[0]), dot(right, n[1]), dot(right, n[2]), dot(right, n[3]));
    let along_rows = vec4f(dot(down, n[0]), dot(down, n[1]), dot(down, n[2]), dot(down, n[3]));
    let low = min(min(v[0], v[1]), min(v[2], v[3]));
    let high = max(max(v[0], v[1]), max(v[2], v[3]));
    let rises = array<Value, 3>(v[1] - v[0], v[2] - v[0], v[3] - v[0]);
    var middle = v[0];
    var to_right: Value;
    var to_below: Value;
    var towards_eye: Value;
    // Inverse depths of a flat cell's faces differ by little, and their differences by their common edges do not cancel:
    // n_j × n_d is an edge, times the volume.
    let reference = vec3f(heights.w, across.w, along_rows.w) / slopes.w;
    let thickness = volume / slopes.w;
    let is_thin = abs(thickness) * select(1.0, depth, PERSPECTIVE) < THIN * longest;
    let is_measured = is_thin && !is_special && abs(reference.x) < select(FAR, 0.5, PERSPECTIVE) && all(abs(reference.yz) < vec2f(FAR));
    let size = vec4f(length(n[0]), length(n[1]), length(n[2]), length(n[3])) * length(out);
    let edge_on = (abs(slopes) <= EDGE_ON * size) & vec4<bool>(vec3<bool>(true), !is_measured);
    let entered = (select(slopes, vec4f(FLAT), edge_on) > vec4f(0.0)) == vec4<bool>(volume > 0.0);
    var facets: array<vec4f, 3>;
    if is_measured {
        let turns = array<vec3f, 3>(cross(away, out), cross(right, seen_a), cross(down, seen_a));
        let turns_b = array<vec3f, 3>(cross(away_b, out), cross(right, seen_b), cross(down, seen_b));
        var rise: array<Value, 3>;
        for (var k = 0u; k < 3u; k++) {
            let of_c = dot(c, turns[k]);
            let of_b = dot(b, turns[k]);
            let edges = vec3f(dot(bc, turns_b[k]), -of_c, of_b);
            facets[k] = vec4f(thickness * (edges / slopes.xyz), reference[k]);
            rise[k] = (rises[1] * of_b - rises[0] * of_c) / slopes.w;
            //#if LIT
            lean[k] = (leans[1] * of_b - leans[0] * of_c) / slopes.w;
            //#end
        }
        // The value where the pixel's ray meets the reference, and how values change from there. Fragments divide the change by
        // the depth, so what that would add to the first value is taken off.
        let first = rise[0] / select(1.0, 1.0 + reference.x, PERSPECTIVE);
        let taken = select(Value(), first, PERSPECTIVE);
        middle += first;
        to_right = rise[1] - taken * reference.y;
        to_below = rise[2] - taken * reference.z;
        towards_eye = -(rises[0] * slopes.y + rises[1] * slopes.z + rises[2] * slopes.w) / volume - taken;
        //#if LIT
        let first_lean = lean[0] / select(1.0, 1.0 + reference.x, PERSPECTIVE);
        let off = select(vec3f(), first_lean, PERSPECTIVE);
        let eye_lean = -(leans[0] * slopes.y + leans[1] * slopes.z + leans[2] * slopes.w) / volume - off;
        hold_lit(q[0] + first_lean, lean[1] - off * reference.y, lean[2] - off * reference.z, eye_lean);
        //#end
    } else {
        let share = array<Value, 3>(rises[0] / volume, rises[1] / volume, rises[2] / volume);
        middle += share[0] * heights.y + share[1] * heights.z + share[2] * heights.w;
        to_right = share[0] * across.y + share[1] * across.z + share[2] * across.w;
        to_below = share[0] * along_rows.y + share[1] * along_rows.z + share[2] * along_rows.w;
        towards_eye = -(share[0] * dot(out, n[1]) + share[1] * dot(out, n[2]) + share[2] * dot(out, n[3]));
        facets = array<vec4f, 3>(heights / slopes, across / slopes, along_rows / slopes);
        //#if LIT
        let parts = array<vec3f, 3>(leans[0] / volume, leans[1] / volume, leans[2] / volume);
        hold_lit(
            q[0] + parts[0] * heights.y + parts[1] * heights.z + parts[2] * heights.w,
            parts[0] * across.y + parts[1] * across.z + parts[2] * across.w,
            parts[0] * along_rows.y + parts[1] * along_rows.z + parts[2] * along_rows.w,
            -(parts[0] * dot(out, n[1]) + parts[1] * dot(out, n[2]) + parts[2] * dot(out, n[3])),
        );
        //#end
    }
    heights += PERTURBATION.x * across + PERTURBATION.y * along_rows;
    var attributes: array<vec4f, 6>;
    attributes[0] = select(facets[0], heights / FLAT, edge_on);
    attributes[1] = select(facets[1], across / FLAT, edge_on);
    attributes[2] = select(facets[2], along_rows / FLAT, edge_on);
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), entered);
    if !(abs(volume) > FLAT) {
        around = array<vec2f, 4>(vec2f(-9.0), vec2f(-9.0), vec2f(-9.0), vec2f(-9.0));
    }
    attributes[3] = vec4f(centre, 0.0, f32(bits.x | bits.y | bits.z | bits.w | select(0u, 16u, is_measured)));
    let stretch = stretch_around(way.high, depth);
    attributes[4] = vec4f(stretch[0], longest);
    attributes[5] = vec4f(stretch[1], 0.0);
    var limits = vec2f(t - frame.near, t - frame.far);
    if PERSPECTIVE {
        limits = depth / max(vec2f(frame.near, frame.far) + frame.forward.w, vec2f(AT_EYE)) - 1.0;
    }
    let rare = vec4f(limits, select(t, depth, PERSPECTIVE), f32(rank & 0xffffffu));
    store(i, attributes, rare, last_of(low), last_of(high), Values(middle, to_right, to_below, towards_eye, low, high));
    primitives[i].vertices[0].corner = around[0];
    primitives[i].vertices[1].corner = around[1];
    primitives[i].vertices[2].corner = around[2];
    primitives[i].vertices[3].corner = around[3];
}
