// Pre-integrated tables: what a segment does, looked up. Twins of src/integral/table, which explains the forms.
//
// The bindings are declared by src/gpu/table.rs, as programs have them at different places.

/// How a table is looked up.
struct Table {
    /// Its size, and the length of the thinnest slice but 0 (or, if lengths are uniform, of the last).
    size: vec4f,
    /// What its texels are multiplied by.
    scale: vec4f,
}

/// Premultiplied colour and opacity of a segment, from its colour over what is seen of it and its mean extinction.
fn reconstructed(texel: vec4f, length: f32) -> vec4f {
    let depth = length * texel.w;
    let opacity = opacity_of_depth(depth);
    // Of direct emission, what is seen of the length.
    let share = select(opacity, select(length, opacity / texel.w, depth > 1e-6), DIRECT);
    return vec4f(texel.xyz * share, opacity);
}

/// Premultiplied colour and opacity of a segment.
fn tabulated(front: f32, back: f32, length: f32) -> vec4f {
    // Values and lengths to the centres of texels; the last by equation 1.
    let steps = length / table.size.w;
    let slices = select(log2(max(steps, 1.0)) + min(steps, 1.0), steps * (table.size.z - 1.0), COLORING == UNIFORM);
    let ends = (vec2f(front, back) * 0.5 + 0.5) * (table.size.xy - 1.0);
    let at = (vec3f(ends, slices) + 0.5) / table.size.xyz;
    let texel = textureSampleLevel(table_volume, table_filter, at, 0.0) * table.scale;
    if COLORING != LOG_NORMALISED {
        return texel;
    }
    return reconstructed(texel, length);
}
