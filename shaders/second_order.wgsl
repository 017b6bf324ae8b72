// The published second-order table, built: the twin of src/integral/table/second_order/slices.rs.

struct SlabJob {
    /// Texels along each axis, the layer that is filled first, and how many are.
    size: u32,
    first: u32,
    layers: u32,
    /// Steps in which slabs are summed.
    iterations: u32,
    /// Entries from texel to texel, from the least value to that of the first texel, and in all.
    between: u32,
    before: u32,
    entries: u32,
    /// What 255 stands for in colours.
    span: f32,
}

@group(0) @binding(0) var<uniform> job: SlabJob;
/// What slices do by their value: premultiplied colour and opacity.
@group(0) @binding(1) var<storage, read> entries: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> texels: array<Texel>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= job.size || id.z >= job.layers {
        return;
    }
    // Whole numbers of entries: nothing is rounded.
    let front = f32(id.x * job.between);
    let middle = f32(id.y * job.between);
    let back = f32((id.z + job.first) * job.between);
    let second = 2.0 * front - 4.0 * middle + 2.0 * back;
    let first = 4.0 * middle - 3.0 * front - back;
    let start = front + f32(job.before);
    let most = f32(job.entries - 1u);
    let over = 1.0 / f32(job.iterations);
    var sum = vec4f();
    for (var step = job.iterations; step > 0u; step--) {
        let u = (f32(step) - 0.5) * over;
        let at = clamp((second * u + first) * u + start, 0.0, most);
        let slice = entries[u32(round(at))];
        sum = slice + (1.0 - slice.w) * sum;
    }
    texels[(id.z * job.size + id.y) * job.size + id.x] = stored(sum);
}
