// The second-order table of all lengths, built: the twin of SecondOrderPolynomial::new in src/integral/table/second_order.rs.

struct ParabolaJob {
    /// Texels along each axis, the layer that is filled first, how many are, and the degree of polynomials.
    size: u32,
    first: u32,
    layers: u32,
    degree: u32,
    longest: f32,
    /// (v − mid) · factor is what lines are over.
    mid: f32,
    factor: f32,
    unused: u32,
    /// Row by row, what makes coefficients of points: of a limit, and of up to four more.
    weights: array<vec4f, 10>,
}

@group(1) @binding(0) var<uniform> job: ParabolaJob;
@group(1) @binding(1) var<storage, read_write> texels: array<vec4f>;

fn sample_of(i: u32) -> f32 {
    return (2.0 * f32(i) / f32(job.size - 1u) - 1.0 - job.mid) * job.factor;
}

fn most_work() -> u32 {
    return 0xffffffu;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= job.size || id.z >= job.layers {
        return;
    }
    let front = sample_of(id.x);
    let middle = sample_of(id.y);
    let back = sample_of(id.z + job.first);
    let bend = (front - middle) + (back - middle);
    cubics[0] = vec4f(front, (back - front) - 2.0 * bend, 2.0 * bend, 0.0);
    light = vec4f(0.0, 0.0, 0.0, 1.0);
    takes_means = true;
    add_voxel(1.0);
    takes_means = false;
    let by_depth = mean_by_depth / max(mean_depth, 1e-37);
    let limit = select(mean_by_length, by_depth, !DIRECT && mean_depth > 0.0);
    var points: array<vec3f, 5>;
    points[0] = limit;
    for (var i = 1u; i <= job.degree; i++) {
        let length = job.longest * f32(i) / f32(job.degree);
        light = vec4f(0.0, 0.0, 0.0, 1.0);
        add_voxel(length);
        var seen = opacity_of_depth(mean_depth * length);
        if DIRECT {
            seen = select(length, seen / max(mean_depth, 1e-37), mean_depth > 0.0);
        }
        points[i] = select(limit, light.xyz / max(seen, 1e-37), seen > 0.0);
    }
    for (var i = 0u; i <= job.degree; i++) {
        var sum = vec3f();
        for (var p = 0u; p <= job.degree; p++) {
            let at = 8u * i + p;
            sum += points[p] * job.weights[at / 4u][at % 4u];
        }
        // What f32 is not enough for is marked by an extinction below 0.
        let depth = select(0.0, select(mean_depth, -1.0, given_up), i == 0u);
        texels[((i * job.layers + id.z) * job.size + id.y) * job.size + id.x] = vec4f(sum, depth);
    }
}
