//! What stretches along which the value is a cubic emit and absorb, as shaders have it: `shaders/stretch.wgsl`, behind constants
//! taken from Rust.

use super::rays::FAR;
use super::shader::{self, ShaderVariant};
use crate::field::Kind;
use crate::integral::MOST_OF_PART;
use crate::integral::cubic::stretch;
use crate::integral::lines::{BUCKETS, OFF};
use std::fmt::Write;

pub(crate) const STRETCH: &str = include_str!("../../shaders/stretch.wgsl");

/// Values that differ by less, along a ray through a voxel, meet a step of the function where f32 cannot say.
const FLAT: f32 = 1e-3;

/// How near to a knot a root is, and after how short a step of Newton's what is left is about its square.
const NEAR: f32 = 2e-7;
const SHORT: f32 = 1e-3;

/// What a program with stretches is compiled for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StretchVariant {
    /// The field's values.
    pub(crate) kind: Kind,
    /// Emission is not multiplied by extinction.
    pub(crate) direct: bool,
    /// Extinction may be the logarithm of a line.
    pub(crate) are_curved: bool,
    /// The largest values are sought, and nothing is summed up.
    pub(crate) is_maximum: bool,
    /// It may ask for means along stretches.
    pub(crate) has_means: bool,
    /// The transmittance below which a ray ends.
    pub(crate) least: f32,
}

/// Constants, and what differs between the kinds of fields.
pub(crate) fn prelude(variant: &StretchVariant) -> String {
    let StretchVariant { kind, direct, are_curved, is_maximum, has_means, least } = *variant;
    let text = shader::prelude(&ShaderVariant { kind, direct });
    // BUCKETS of other integrals.
    let lines = text.lines().filter(|line| !line.starts_with("const BUCKETS"));
    let mut text = lines.fold(String::new(), |text, line| text + line + "\n");
    for (name, value) in [
        ("FAR", FAR),
        ("FLAT", FLAT),
        ("OFF", OFF),
        ("NEAR", NEAR),
        ("SHORT", SHORT),
        ("LEAST_TRANSMITTANCE", least),
        ("DEEPEST", stretch::DEEPEST),
        ("MOST", stretch::MOST),
        ("MOST_BENT", stretch::MOST_BENT),
        ("END", stretch::END),
        ("BENDING", (1.0 / (1.0 - MOST_OF_PART)) as f32),
    ] {
        let _ = writeln!(text, "const {name} = {value:?}f;");
    }
    let column = |k: usize| stretch::UP_TO.map(|row| row[k]);
    for (name, [x, y, z]) in [
        ("NODES", stretch::NODES),
        ("WEIGHTS", stretch::WEIGHTS),
        ("UP_TO_FRONT", column(0)),
        ("UP_TO_A", column(1)),
        ("UP_TO_B", column(2)),
        ("UP_TO_C", column(3)),
        ("UP_TO_BACK", column(4)),
    ] {
        let _ = writeln!(text, "const {name} = vec3f({x:?}f, {y:?}f, {z:?}f);");
    }
    for (name, value) in [("MAXIMUM", is_maximum), ("CURVED", are_curved), ("MEANS", has_means)] {
        let _ = writeln!(text, "const {name} = {value};");
    }
    let components = kind.components();
    let _ = writeln!(text, "const BUCKETS = {BUCKETS}u;\nconst COMPONENTS = {components}u;");
    let mut series = String::from("0.0");
    for c in stretch::LOGARITHM.iter().rev() {
        series = format!("({c:?}f + w * {series})");
    }
    let _ = writeln!(text, "fn logarithm(w: f32) -> f32 {{ return {series}; }}");
    text + emission(components)
}

/// What colours are functions of: a value of the same or another component, or components themselves.
fn emission(components: usize) -> &'static str {
    match components {
        1 => {
            "alias Moment = f32;
fn emitting(color: u32, own: vec4f, u: f32, h: f32) -> array<Moment, 4> {
    return array<Moment, 4>(own.x, own.y, own.z, own.w);
}
fn shown_by(line: Line, color: u32, sum: f32, moment: Moment) -> vec3f {
    return line.value.yzw * sum + line.slope.yzw * moment;
}
fn values_at(u: f32) -> vec4f { return vec4f(); }
"
        }
        2 => {
            "alias Moment = f32;
fn emitting(color: u32, own: vec4f, u: f32, h: f32) -> array<Moment, 4> {
    let e = part_of(cubics[0], u, h);
    return array<Moment, 4>(e.x - lines[color].start, e.y, e.z, e.w);
}
fn shown_by(line: Line, color: u32, sum: f32, moment: Moment) -> vec3f {
    return lines[color].value.yzw * sum + lines[color].slope.yzw * moment;
}
fn values_at(u: f32) -> vec4f { return vec4f(value_of(cubics[0], u), 0.0, 0.0, 0.0); }
"
        }
        _ => {
            "alias Moment = vec3f;
fn emitting(color: u32, own: vec4f, u: f32, h: f32) -> array<Moment, 4> {
    let r = part_of(cubics[0], u, h);
    let g = part_of(cubics[1], u, h);
    let b = part_of(cubics[2], u, h);
    return array<Moment, 4>(vec3f(r.x, g.x, b.x), vec3f(r.y, g.y, b.y), vec3f(r.z, g.z, b.z), vec3f(r.w, g.w, b.w));
}
fn shown_by(line: Line, color: u32, sum: f32, moment: Moment) -> vec3f { return moment * function.scale; }
fn values_at(u: f32) -> vec4f {
    return vec4f(value_of(cubics[0], u), value_of(cubics[1], u), value_of(cubics[2], u), 0.0);
}
"
        }
    }
}
