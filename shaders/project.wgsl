// What all programs of the projection share: the frame, its rays, and what limits them.

/// All rays of a frame, as in traverse.wgsl, but seen from `base`: the place where the middle one starts. Coordinates
/// are the mesh's normalised ones, relative to it.
struct ViewUniforms {
    /// The base as the sum of two numbers, the second much smaller.
    base: vec4f,
    base_low: vec4f,
    /// dot(across[k], p) over the depth of p is its place in the image, in [−1, 1].
    across: array<vec4f, 2>,
    /// The view direction, of unit length; w: the depth of the base, in perspective views.
    forward: vec4f,
    /// The ray at (x, y) starts at x origin[0] + y origin[1] and runs along direction · (1, x, y).
    origin: array<vec4f, 2>,
    direction: array<vec4f, 3>,
    /// The same by columns and rows, in the mesh's own coordinates: see `affine`.
    starts: array<DoubleSingle, 3>,
    ways: array<DoubleSingle, 3>,
    /// Width and height of the image, in pixels.
    size: vec2f,
    /// From a pixel's centre to its sample, in units of x and y.
    offset: vec2f,
    /// The part of a ray that is seen, in lengths of its direction.
    near: f32,
    far: f32,
    /// Cells with a corner that is not this deep are special, in perspective views.
    nearest: f32,
    planes: u32,
    /// From one pixel to the next, in units of x and y.
    pixel: vec2f,
    unused: vec2f,
}

@group(0) @binding(3) var<uniform> frame: ViewUniforms;
/// Clipping planes: dot(p, plane.xyz) + plane.w ≥ 0 is kept.
@group(0) @binding(4) var<storage, read> planes: array<vec4f>;
/// Where each ray ends, for want of something nearer.
@group(0) @binding(5) var<storage, read> ends: array<f32>;

/// Place in the image times depth, and depth: (x w, y w, w).
fn seen(p: vec3f) -> vec3f {
    let depth = fma(p.x, frame.forward.x, fma(p.y, frame.forward.y, fma(p.z, frame.forward.z, frame.forward.w)));
    let x = fma(p.x, frame.across[0].x, fma(p.y, frame.across[0].y, p.z * frame.across[0].z));
    let y = fma(p.x, frame.across[1].x, fma(p.y, frame.across[1].y, p.z * frame.across[1].z));
    return vec3f(x, y, select(1.0, depth, PERSPECTIVE));
}

/// Where in the image, in [−1, 1] from its middle to its edges, the pixel with the centre `at` has its sample.
fn sample_of(at: vec2f) -> vec2f {
    return fma(at, frame.pixel, vec2f(-1.0, 1.0) + frame.offset);
}

fn direction_at(xy: vec2f) -> vec3f {
    return fma(frame.direction[2].xyz, vec3f(xy.y), fma(frame.direction[1].xyz, vec3f(xy.x), frame.direction[0].xyz));
}

/// The square of the length of a ray's direction times `scale`, `offset` pixels from one whose direction is `way`, is
/// stretch[0] · (1, x, y) + stretch[1] · (x², xy, y²).
fn stretch_around(way: vec3f, scale: f32) -> array<vec3f, 2> {
    let v = way * scale;
    let x = by_column(frame.ways) * scale;
    let y = by_row(frame.ways) * scale;
    return array<vec3f, 2>(vec3f(dot(v, v), 2.0 * dot(v, x), 2.0 * dot(v, y)), vec3f(dot(x, x), 2.0 * dot(x, y), dot(y, y)));
}

fn stretch_of(linear: vec3f, square: vec3f, offset: vec2f) -> f32 {
    let right = fma(offset.x, square.x, fma(offset.y, square.y, linear.y));
    return sqrt(fma(offset.x, right, fma(offset.y, fma(offset.y, square.z, linear.z), linear.x)));
}

/// How what is by columns and rows differs from one pixel to the next on the right, and below.
fn by_column(v: array<DoubleSingle, 3>) -> vec3f {
    return v[1].high + v[1].low;
}

fn by_row(v: array<DoubleSingle, 3>) -> vec3f {
    return v[2].high + v[2].low;
}

fn origin_at(xy: vec2f) -> vec3f {
    return fma(frame.origin[1].xyz, vec3f(xy.y), frame.origin[0].xyz * xy.x);
}

/// The part of a ray that is seen: of the pixel with the centre `at`, from `origin` along a unit vector of which the
/// frame's directions are `stretch` lengths.
fn limits_of(at: vec2f, origin: vec3f, along: vec3f, stretch: f32) -> vec2f {
    var limits = vec2f(frame.near, frame.far) * stretch;
    if HAS_ENDS {
        limits.y = min(limits.y, ends[u32(at.y) * u32(frame.size.x) + u32(at.x)]);
    }
    if !HAS_PLANES {
        return limits;
    }
    for (var k = 0u; k < frame.planes; k++) {
        let height = dot(origin, planes[k].xyz) + planes[k].w;
        let slope = dot(along, planes[k].xyz);
        let t = -height / slope;
        if slope > 0.0 {
            limits.x = max(limits.x, t);
        } else if slope < 0.0 {
            limits.y = min(limits.y, t);
        } else if height < 0.0 {
            limits.y = -FAR;
        }
    }
    return limits;
}
