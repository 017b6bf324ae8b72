//! Shader assembly: fragments of WGSL joined into programs, after a prelude of what Rust knows.

use crate::field::Kind;
use crate::integral::{BUCKETS, OPAQUE_DEPTH, OPAQUE_EXTINCTION, SERIES_DEPTH};
use std::fmt::Write;

pub(crate) const CELL: &str = include_str!("../../shaders/cell.wgsl");
pub(crate) const REAL: &str = include_str!("../../shaders/real.wgsl");
pub(crate) const INTEGRAL: &str =
    concat!(include_str!("../../shaders/real.wgsl"), "\n", include_str!("../../shaders/integral.wgsl"));

/// What a program is compiled for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ShaderVariant {
    /// The field's values.
    pub(crate) kind: Kind,
    /// Emission is not multiplied by extinction.
    pub(crate) direct: bool,
}

/// An array of the mesh's size, as a shader sees it: `name(i)` is its element i.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ShaderArray {
    pub(crate) name: &'static str,
    pub(crate) element: &'static str,
    /// Number of bindings that it is spread over, and the logarithm of the elements in each.
    pub(crate) chunks: usize,
    pub(crate) shift: u32,
}

/// Constants of the integral, and what differs between the kinds of fields.
pub(crate) fn prelude(variant: &ShaderVariant) -> String {
    let mut text = String::new();
    let number = |x: f64| format!("{x:?}f");
    let mut constant = |name: &str, value: String| text += &format!("const {name} = {value};\n");
    for (name, value) in [("OPAQUE_DEPTH", OPAQUE_DEPTH), ("SERIES_DEPTH", SERIES_DEPTH), ("OPAQUE", OPAQUE_EXTINCTION)]
    {
        constant(name, number(value));
    }
    // Four units in the last place, as in cell.rs; and what is as good as 0 but far above the smallest f32.
    constant("DOUBT", number(4.0 * f64::from(f32::EPSILON)));
    constant("TINY", number(1e-18));
    constant("BUCKETS", format!("{BUCKETS}u"));
    constant("DIRECT", variant.direct.to_string());
    constant("PAIR", (variant.kind == Kind::Pair).to_string());
    constant("RGBA", (variant.kind == Kind::Rgba).to_string());
    let [value, first, last, color, padded, least] = match variant.kind {
        Kind::Scalar => ["f32", "v", "v", "vec3f(v)", "vec4f(0.0, 0.0, 0.0, v)", "abs(v) < 1e38"],
        Kind::Pair => ["vec2f", "v.x", "v.y", "vec3f(v.x)", "vec4f(v.x, 0.0, 0.0, v.y)", "all(abs(v) < vec2f(1e38))"],
        Kind::Rgba => ["vec4f", "v.x", "v.w", "v.xyz", "v", "all(abs(v) < vec4f(1e38))"],
    };
    text += &format!("alias Value = {value};\n");
    for (name, result, body) in [
        ("first_of", "f32", first),
        ("last_of", "f32", last),
        ("color_of", "vec3f", color),
        ("padded", "vec4f", padded),
        ("is_visible", "bool", least),
    ] {
        text += &format!("fn {name}(v: Value) -> {result} {{ return {body}; }}\n");
    }
    text
}

/// `text` without the lines between `//#if NAME` and its `//#end` of names that are not `defined`, nor these lines themselves.
pub(crate) fn with(text: &str, defined: &[&str]) -> String {
    let (mut kept, mut open) = (String::with_capacity(text.len()), vec![]);
    for line in text.lines() {
        let word = line.trim_start();
        if let Some(name) = word.strip_prefix("//#if ") {
            open.push(defined.contains(&name.trim_end()));
        } else if word.starts_with("//#end") {
            open.pop();
        } else if open.iter().all(|&is| is) {
            kept += line;
            kept.push('\n');
        }
    }
    kept
}

/// Bindings of `arrays` in group 1, and the functions that look elements up in them.
pub(crate) fn accessors(arrays: &[ShaderArray]) -> String {
    let (mut text, mut binding) = (String::new(), 0);
    for ShaderArray { name, element, chunks, shift } in arrays {
        for c in 0..*chunks {
            let place = format!("@group(1) @binding({binding})");
            text += &format!("{place} var<storage, read> {name}_{c}: array<{element}>;\n");
            binding += 1;
        }
        text += &format!("fn {name}(i: u32) -> {element} {{\n");
        if *chunks > 1 {
            let mask = (1u64 << shift) - 1;
            let _ = writeln!(text, "    switch i >> {shift}u {{");
            for c in 1..*chunks {
                let _ = writeln!(text, "        case {c}u: {{ return {name}_{c}[i & {mask}u]; }}");
            }
            text += &format!("        default: {{ return {name}_0[i & {mask}u]; }}\n    }}\n}}\n");
        } else {
            text += &format!("    return {name}_0[i];\n}}\n");
        }
    }
    text
}
