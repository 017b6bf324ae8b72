// Light and silhouettes in segments: the f32 twin of src/integral/second/light.rs. What the three nodes of a panel have of a
// vector is a matrix: a column for each coordinate, a row for each node.

/// Bits of `Second.looks`: both sides are lit; anything is; highlights are of reflected light, and begin at an edge; the angle
/// with the ray counts; a light has a position; the power of silhouettes is no whole number.
const TWO_SIDED = 1u;
const SHADED = 2u;
const REFLECTED = 4u;
const BEGINS = 8u;
const ON_RAY = 16u;
const POSITIONS = 32u;
const FRACTIONAL = 64u;

/// Rows of a light: colour times intensity, and what it is; where it is or the way to it, and of a cone the cosine of its angle;
/// the cone's axis and exponent; how it weakens with the distance, and the cosine by which the way to it may turn in a panel.
const LIGHT = 4u;
const HEADLIGHT = 0.0;
const DIRECTION = 1.0;
const CONE = 3.0;

/// Lengths of gradients that are as good as none.
const NONE_THERE = 1e-12;
/// By what factor the distance to a light changes in a panel.
const NEARER = 1.8;
/// The shortest panels that are halved towards the edge of a highlight.
const EDGE = 1e-4;

/// By what the colours of the nodes are multiplied, and what is added for white: a column for each channel.
struct Coming {
    diffuse: mat3x3f,
    specular: mat3x3f,
}

/// xᵖ for x from 0 to 1, or little more.
fn powers(x: vec3f, p: f32) -> vec3f {
    if p == 0.0 {
        return vec3f(1.0);
    }
    return select(vec3f(0.0), exponentials(p * logarithms(max(x, vec3f(1e-37)))), x > vec3f(0.0));
}

fn gradient_at(u: f32) -> vec3f {
    return fma(stretch.turn, vec3f(u), stretch.slope);
}

/// The directions of the gradient; zero where it is as good as none.
fn normals_at(u: vec3f) -> mat3x3f {
    let x = fma(u, vec3f(stretch.turn.x), vec3f(stretch.slope.x));
    let y = fma(u, vec3f(stretch.turn.y), vec3f(stretch.slope.y));
    let z = fma(u, vec3f(stretch.turn.z), vec3f(stretch.slope.z));
    let length = sqrt(x * x + y * y + z * z);
    let scale = select(vec3f(0.0), 1.0 / length, length > vec3f(NONE_THERE));
    return mat3x3f(x * scale, y * scale, z * scale);
}

/// How far apart the ends of the normals at both ends of the segment are.
fn turns_of_normals() -> f32 {
    let normals = normals_at(vec3f(0.0, 1.0, 1.0));
    return length(vec3f(normals[0].y - normals[0].x, normals[1].y - normals[1].x, normals[2].y - normals[2].x));
}

/// Of what comes from a position, a share at each of the nodes so far away, where the ways to it are `to`.
fn weakened(row: u32, to: mat3x3f, distance: vec3f) -> vec3f {
    let by = rows[row + 3u];
    let share = 1.0 / max(by.x + distance * (by.y + distance * by.z), vec3f(1e-37));
    if rows[row].w != CONE {
        return share;
    }
    let axis = rows[row + 2u];
    let cosine = -(to * axis.xyz);
    return select(vec3f(0.0), share * powers(max(cosine, vec3f(0.0)), axis.w), cosine >= vec3f(rows[row + 1u].w));
}

fn coming_light(u: vec3f, normal: mat3x3f, on_ray: vec3f) -> Coming {
    let ambient = vec3f(second.ambient);
    var coming = Coming(mat3x3f(ambient, ambient, ambient), mat3x3f());
    let both_sides = (second.looks & TWO_SIDED) != 0u;
    for (var i = 0u; i < second.lamps; i++) {
        work++;
        let row = second.lights + LIGHT * i;
        let lamp = rows[row];
        var share = vec3f(1.0);
        var way = rows[row + 1u].xyz;
        if lamp.w == HEADLIGHT {
            way = -stretch.along;
        }
        var to = mat3x3f(vec3f(way.x), vec3f(way.y), vec3f(way.z));
        if lamp.w > DIRECTION {
            let start = way - stretch.place;
            let t = stretch.length * u;
            let x = start.x - stretch.along.x * t;
            let y = start.y - stretch.along.y * t;
            let z = start.z - stretch.along.z * t;
            let distance = sqrt(x * x + y * y + z * z);
            let over = select(vec3f(0.0), 1.0 / distance, distance > vec3f(0.0));
            to = mat3x3f(x * over, y * over, z * over);
            share = weakened(row, to, distance);
        }
        let cosine = normal[0] * to[0] + normal[1] * to[1] + normal[2] * to[2];
        let falls = select(max(cosine, vec3f(0.0)), abs(cosine), both_sides);
        let scattered = falls * share * second.diffuse;
        coming.diffuse += mat3x3f(scattered * lamp.x, scattered * lamp.y, scattered * lamp.z);
        if second.specular == 0.0 {
            continue;
        }
        var shines = falls;
        if (second.looks & REFLECTED) != 0u {
            shines = max(to * stretch.along - 2.0 * cosine * on_ray, vec3f(0.0));
        } else if lamp.w != HEADLIGHT {
            // Half way between the light and the eye.
            let x = to[0] - stretch.along.x;
            let y = to[1] - stretch.along.y;
            let z = to[2] - stretch.along.z;
            let length = sqrt(x * x + y * y + z * z);
            let on_half = (normal[0] * x + normal[1] * y + normal[2] * z) / max(length, vec3f(1e-6));
            shines = select(max(on_half, vec3f(0.0)), abs(on_half), both_sides);
        }
        let bright = select(vec3f(0.0), powers(shines, second.power), falls > vec3f(0.0)) * share * second.specular;
        coming.specular += mat3x3f(bright * lamp.x, bright * lamp.y, bright * lamp.z);
    }
    return coming;
}

/// Whether the gradient turns its other side to something along the segment.
fn turns_to(way: vec3f) -> bool {
    let front = dot(stretch.slope, way);
    return front * (front + dot(stretch.turn, way)) < 0.0;
}

/// Whether the segment may pass a place where a face of the light turns away, or the side of a cone.
fn light_turns() -> bool {
    if (second.looks & POSITIONS) != 0u || ((second.looks & ON_RAY) != 0u && turns_to(stretch.along)) {
        return true;
    }
    for (var i = 0u; i < second.lamps; i++) {
        work++;
        let row = second.lights + LIGHT * i;
        if rows[row].w == DIRECTION && turns_to(rows[row + 1u].xyz) {
            return true;
        }
    }
    return false;
}

/// The sooner of `next` and where beyond `u` a x² + b x + c is 0.
fn next_root(next: f32, a: f32, b: f32, c: f32, u: f32) -> f32 {
    let d = b * b - 4.0 * a * c;
    if d < 0.0 {
        return next;
    }
    let q = -0.5 * (b + select(-1.0, 1.0, b >= 0.0) * sqrt(d));
    return nearer(nearer(next, q / a, u), c / q, u);
}

fn next_turn_of_light(before: f32, u: f32) -> f32 {
    var next = before;
    if (second.looks & ON_RAY) != 0u {
        next = nearer(next, -dot(stretch.slope, stretch.along) / dot(stretch.turn, stretch.along), u);
    }
    for (var i = 0u; i < second.lamps; i++) {
        work++;
        let row = second.lights + LIGHT * i;
        let kind = rows[row].w;
        let origin = rows[row + 1u];
        if kind == DIRECTION {
            next = nearer(next, -dot(stretch.slope, origin.xyz) / dot(stretch.turn, origin.xyz), u);
        } else if kind > DIRECTION {
            let to = origin.xyz - stretch.place;
            let step = stretch.along * -stretch.length;
            next = next_root(next, dot(stretch.turn, step), dot(stretch.slope, step) + dot(stretch.turn, to), dot(stretch.slope, to), u);
            if kind == CONE {
                let axis = rows[row + 2u].xyz;
                let square = origin.w * origin.w;
                let p = dot(to, axis);
                let q = dot(step, axis);
                if origin.w < 1e-6 {
                    next = nearer(next, -p / q, u);
                } else {
                    next = next_root(next, q * q - square * dot(step, step), 2.0 * (p * q - square * dot(to, step)), p * p - square * dot(to, to), u);
                }
            }
        }
    }
    return next;
}

/// Whether reflected light shines towards the eye at `u`, where the way to the light is `to`.
fn is_shining(u: f32, to: vec3f) -> bool {
    let normal = gradient_at(u);
    return dot(to, stretch.along) * dot(normal, normal) > 2.0 * dot(normal, to) * dot(normal, stretch.along);
}

/// Whether what lights do changes little enough in a panel of length `h` at `u`.
fn is_evenly_lit(u: f32, h: f32) -> bool {
    let a = gradient_at(u);
    let b = gradient_at(u + h);
    let lengths = length(a) * length(b);
    if min(length(a), length(b)) > NONE_THERE && dot(a, b) < second.cosine * lengths {
        return false;
    }
    if (second.looks & FRACTIONAL) != 0u {
        let on_ray = normals_at(fma(GAUSS_NODES, vec3f(h), vec3f(u))) * stretch.along;
        let edges = max(1.0 - abs(on_ray), vec3f(1e-5));
        if max(max(edges.x, edges.y), edges.z) > FACTOR * min(min(edges.x, edges.y), edges.z) {
            return false;
        }
    }
    if (second.looks & (POSITIONS | BEGINS)) == 0u {
        return true;
    }
    for (var i = 0u; i < second.lamps; i++) {
        work++;
        let row = second.lights + LIGHT * i;
        let kind = rows[row].w;
        var first = rows[row + 1u].xyz;
        if kind == HEADLIGHT {
            first = -stretch.along;
        }
        var step = vec3f(0.0);
        if kind > DIRECTION {
            step = stretch.along * -stretch.length;
            first += step * u - stretch.place;
            let last = first + step * h;
            let near = length(first);
            let far = length(last);
            if dot(first, last) < rows[row + 3u].w * near * far || max(near, far) > NEARER * min(near, far) {
                return false;
            }
        }
        if (second.looks & BEGINS) != 0u && h > EDGE {
            let shines = is_shining(u, first);
            for (var k = 1u; k <= 4u; k++) {
                work++;
                let share = f32(k) * 0.25 * h;
                if is_shining(u + share, first + step * share) != shines {
                    return false;
                }
            }
        }
    }
    return true;
}
