//! Primitives: what is drawn of each cell, as the compute stage writes it and the rasteriser's vertex stage reads it.
//!
//! A primitive has an equal part for each vertex of its triangles: what differs between vertices, and a share of the
//! *attributes* that all fragments of the cell need. The vertex buffer is bound once for each part, moved by as much, so
//! that a primitive's first vertex finds all attributes, of which triangles take the first vertex's; the others find something
//! that nobody looks at. Vertex fetch is much faster than look-ups in a storage buffer where drivers do these lane by
//! lane.

use crate::project::Fragments;

/// The attributes of a form before the line of the function, and how many values there are.
const INTERSECTED: (usize, usize) = (6, 6);
const INTERPOLATED: (usize, usize) = (4, 2);

/// A float, two or four.
fn type_of(floats: usize) -> &'static str {
    ["", "f32", "vec2f", "", "vec4f"][floats]
}

/// The primitive of a form for fields of so many components.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Its triangles; the first corner of each is the first vertex's part.
    pub(crate) triangles: &'static [u32],
    pub(crate) parts: u32,
    /// What each vertex has: name, floats, and where, in bytes.
    own: Vec<(&'static str, usize, u64)>,
    /// Attributes of four floats; of each part; and where they begin in it, in bytes.
    attributes: usize,
    share: usize,
    attributes_at: u64,
    components: usize,
    /// Whether an attribute is the number of the line that the least value is on, from which fragments look up the function; where
    /// that is or would be; the first attribute with values, and the number of values.
    has_line: bool,
    line_at: usize,
    values: (usize, usize),
    /// Whether the last attribute before the line is one that few pictures need.
    rare: bool,
    /// Whether segments are of two variables; and the attributes after the values that tell gradients.
    second: bool,
    slopes: usize,
}

/// Attributes that tell gradients.
const SLOPES: usize = 3;

impl Layout {
    /// With one attribute more that few pictures need if `rare`.
    pub(crate) fn new(form: Fragments, components: usize, has_line: bool, rare: bool) -> Self {
        Self::with(form, components, has_line, rare, false, 0)
    }

    /// Of two variables, and with the gradient if `lit`.
    pub(crate) fn of_two(form: Fragments, rare: bool, lit: bool) -> Self {
        Self::with(form, 2, false, rare, true, if lit { SLOPES } else { 0 })
    }

    fn with(form: Fragments, components: usize, has_line: bool, rare: bool, second: bool, slopes: usize) -> Self {
        let is_intersected = form == Fragments::Intersected;
        let own = match is_intersected {
            true => vec![("corner", 2)],
            false => vec![("corner", 2), ("front", components), ("back", components), ("depths", 4)],
        };
        let (triangles, (attributes, count)): (&[u32], _) = match is_intersected {
            true => (&[0, 1, 2, 0, 2, 3], INTERSECTED),
            false => (&[0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1], INTERPOLATED),
        };
        let parts = triangles.iter().fold(0, |n, &i| n.max(i + 1));
        let line_at = attributes + usize::from(rare);
        let values = (line_at + usize::from(has_line), count);
        let attributes = values.0 + (count * components).div_ceil(4) + slopes;
        let mut end = 0;
        let place = |(name, floats): (&'static str, usize)| {
            let bytes = 4 * floats as u64;
            let at = u64::next_multiple_of(end, bytes);
            end = at + bytes;
            (name, floats, at)
        };
        let own: Vec<_> = own.into_iter().map(place).collect();
        let share = attributes.div_ceil(parts as usize);
        let attributes_at = end.next_multiple_of(16);
        Layout {
            triangles,
            parts,
            own,
            attributes,
            share,
            attributes_at,
            components,
            has_line,
            line_at,
            values,
            rare,
            second,
            slopes,
        }
    }

    /// Whether segments are of two variables.
    pub(crate) fn is_of_two(&self) -> bool {
        self.second
    }

    /// Bytes of a part, and of a primitive.
    pub(crate) fn part_bytes(&self) -> u64 {
        self.attributes_at + 16 * self.share as u64
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.part_bytes() * u64::from(self.parts)
    }

    /// The attributes of each binding of the vertex buffer.
    pub(crate) fn vertex_attributes(&self) -> Vec<Vec<wgpu::VertexAttribute>> {
        let own = self.own.iter().zip(0..).map(|(&(_, floats, offset), shader_location)| {
            let format = match floats {
                1 => wgpu::VertexFormat::Float32,
                2 => wgpu::VertexFormat::Float32x2,
                _ => wgpu::VertexFormat::Float32x4,
            };
            wgpu::VertexAttribute { format, offset, shader_location }
        });
        let attribute = |i: usize| wgpu::VertexAttribute {
            format: wgpu::VertexFormat::Float32x4,
            offset: self.attributes_at + 16 * (i % self.share) as u64,
            shader_location: (self.own.len() + i) as u32,
        };
        let attributes: Vec<_> = (0..self.attributes).map(attribute).collect();
        let mut parts: Vec<_> = attributes.chunks(self.share).map(<[_]>::to_vec).collect();
        if let Some(first) = parts.first_mut() {
            first.splice(0..0, own);
        }
        parts
    }

    /// `integrated`, the exact integral of a segment; `Primitive` and `store`, which fills its attributes; `VertexInput`, which is what a vertex
    /// finds of it, and `VertexOutput`, which it hands on to fragments; and what fragments take out of that again.
    pub(crate) fn wgsl(&self) -> String {
        let Layout { parts, attributes, share, has_line, line_at, values: (first, count), components, .. } = *self;
        let own = |each: &dyn Fn(usize, &str) -> String, skipped: usize| {
            let own = self.own.iter().enumerate().skip(skipped);
            own.map(|(i, (name, floats, _))| each(i, &format!("{name}: {}, ", type_of(*floats)))).collect::<String>()
        };
        let each = |of: &dyn Fn(usize) -> String| (0..attributes).map(of).collect::<String>();
        let at = self.own.len();

        let usual = line_at - usize::from(self.rare);

        // Values are packed tightly into attributes.
        let float = |i: usize| format!("[{}].{}", i / 4, ["x", "y", "z", "w"][i % 4]);
        let packed = |i: usize| match i {
            _ if i >= count * components => "0.0".into(),
            _ if components == 1 => format!("v[{i}]"),
            _ => format!("v[{}].{}", i / components, ["x", "y", "z", "w"][i % components]),
        };
        let attribute = |i: usize| match i.checked_sub(first) {
            None if i >= line_at => "vec4f(f32(line_at(low, high)), 0.0, 0.0, 0.0)".into(),
            None if i >= usual => "rare".into(),
            None => format!("attributes[{i}]"),
            _ if i >= attributes - self.slopes => format!("slope_attributes[{}]", i + self.slopes - attributes),
            Some(k) => format!("vec4f({})", (4 * k..4 * k + 4).map(packed).collect::<Vec<_>>().join(", ")),
        };
        let value = |i: usize| {
            let floats = i * components..(i + 1) * components;
            let floats: Vec<_> = floats.map(|f| format!("attributes{}", float(4 * first + f))).collect();
            format!("Value({})", floats.join(", "))
        };
        let values: Vec<_> = (0..count).map(value).collect();
        let integral = match has_line {
            _ if self.second => "return of_segment(front, back, length);".into(),
            true => format!("return by_lookups(front, back, length, u32(attributes[{line_at}].x));"),
            false => "light = vec4f(0.0, 0.0, 0.0, 1.0);
                add_segment(front, back, length);
                return vec4f(light.xyz, 1.0 - light.w);"
                .into(),
        };

        [
            format!("alias Attributes = array<vec4f, {attributes}>;"),
            format!("alias Values = array<Value, {}>;", values.len()),
            format!("fn integrated(front: Value, back: Value, length: f32, attributes: Attributes) -> vec4f {{\n{integral}\n}}"),
            format!("struct Vertex {{ {}attributes: array<vec4f, {share}> }}", own(&|_, field| field.into(), 0)),
            format!("struct Primitive {{ vertices: array<Vertex, {parts}> }}"),
            format!(
                "fn store(i: u32, attributes: array<vec4f, {usual}>, rare: vec4f, low: f32, high: f32, v: Values)
                {{ {}}}",
                each(&|w| format!("primitives[i].vertices[{}].attributes[{}] = {}; ", w / share, w % share, attribute(w)))
            ),
            format!(
                "struct VertexInput {{ {}{}}}",
                own(&|i, field| format!("@location({i}) {field}"), 0),
                each(&|w| format!("@location({}) attribute_{w}: vec4f, ", at + w))
            ),
            format!(
                "struct VertexOutput {{ @builtin(position) at: vec4f, {}{}}}",
                own(&|i, field| format!("@location({}) {field}", i - 1), 1),
                each(&|w| format!("@location({}) @interpolate(flat) attribute_{w}: vec4f, ", at - 1 + w))
            ),
            format!(
                "fn drawn_at(at: vec4f, stored: VertexInput) -> VertexOutput {{ return VertexOutput(at, {}{}); }}",
                self.own.iter().skip(1).map(|(name, ..)| format!("stored.{name}, ")).collect::<String>(),
                each(&|w| format!("stored.attribute_{w}, "))
            ),
            format!(
                "fn attributes_of(drawn: VertexOutput) -> Attributes {{ return Attributes({}); }}",
                each(&|w| format!("drawn.attribute_{w}, "))
            ),
            format!(
                "fn rare_in(attributes: Attributes) -> vec4f {{ return {}; }}",
                if self.rare { format!("attributes[{usual}]") } else { "vec4f()".into() }
            ),
            format!("fn values_in(attributes: Attributes) -> Values {{ return Values({}); }}", values.join(", ")),
            match self.slopes {
                0 => String::new(),
                n => format!(
                    "fn slopes_in(attributes: Attributes) -> array<vec4f, {n}> {{ return array<vec4f, {n}>({}); }}\n",
                    (attributes - n..attributes).map(|i| format!("attributes[{i}]")).collect::<Vec<_>>().join(", ")
                ),
            },
        ]
        .join("\n")
    }
}
