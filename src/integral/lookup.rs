//! Tables as engines read them: in 32 bits, with texels rounded to what a device stores.

mod components;
mod texels;

use super::options::{Alpha, Form, IntegrationOptions, Planes, Texels};
use super::second::OfTwo;
use super::table::{
    Cylindrical, Kind, Polynomial, SecondOrder, SecondOrderPolynomial, Slabs, Table, length, mix, parabola,
};
use super::{Exact, Light, opacity_of_depth, table};
use crate::error::{Error, Result};
use crate::field;
use std::borrow::Cow;
pub(crate) use texels::Range;
use texels::{between, bilinear, from_zero, greatest, trilinear, with_density, within};

/// What bounds the error of a uniform volume whose size nobody said, where a table of 256 x 256 x 128 can hold that. It
/// is the worst case, some 10 times what is seen.
const UNIFORM_ERROR: f64 = 0.02;

/// What bounds the error of other tables that are smaller than the number of knots asks for.
const SMALL_ERROR: f64 = 2e-3;

/// How far values are in a table's range, ±1, but for rounding.
const WITHIN: f32 = 1.000_001;

/// Texels of one length by which a range is chosen.
const SOME: usize = 1024;

/// A table of one of the forms.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TableData {
    Volume(Table),
    Polynomial(Polynomial),
    Cylindrical(Cylindrical),
    SecondOrder(SecondOrder),
    SecondOrderPolynomial(SecondOrderPolynomial),
}

/// The integral of segments by a table.
#[derive(Debug, Clone, PartialEq)]
pub struct PreintegratedTable {
    options: IntegrationOptions,
    stored: TableData,
    /// What texels stand for; for polynomials one for each power.
    ranges: Vec<Range>,
    direct: bool,
    /// The reciprocal of the longest length, or for volumes of the thinnest slice but 0.
    inverse: f32,
    /// Of what function a device builds it, which alone has its texels then.
    source: Option<Box<Exact<f64>>>,
}

/// What is integrated, in whatever form: the exact integral is always there.
#[derive(Debug, Clone, Copy)]
pub struct Integral<'a> {
    /// The exact integral.
    pub exact: &'a Exact<f32>,
    /// What takes its place where segments are integrated.
    pub table: Option<&'a PreintegratedTable>,
    /// What takes the place of both, of a function of two variables, or with light.
    pub(crate) second: Option<OfTwo<'a>>,
}

impl PreintegratedTable {
    /// Builds the table that `options` say, for segments of up to `longest` normalised units, on the current rayon
    /// pool.
    ///
    /// # Errors
    /// Those of [`check`].
    pub fn new(exact: &Exact<f64>, options: &IntegrationOptions, longest: f64) -> Result<Self> {
        let exact = &*tabulated(exact);
        let [front, back, depth] = sized(exact, options, longest)?;
        let stored = match options.form {
            Form::Volume => Table::closed(exact, options.lengths, [front, back, depth], longest).map(TableData::Volume),
            Form::Polynomial => Polynomial::closed(exact, options.degree, front, longest).map(TableData::Polynomial),
            Form::Cylindrical => Cylindrical::closed(exact, depth, front, longest).map(TableData::Cylindrical),
            Form::SecondOrder => {
                let in_bytes = options.texels == Texels::Unorm8;
                let build = if in_bytes { SecondOrder::published_in_bytes } else { SecondOrder::published };
                build(exact, front, longest, options.iterations).map(TableData::SecondOrder)
            }
            Form::SecondOrderPolynomial => SecondOrderPolynomial::closed(exact, options.degree, front, longest)
                .map(TableData::SecondOrderPolynomial),
            Form::Auto | Form::Exact => None,
        };
        Self::of(exact, options, stored)
    }

    /// The same, in the memory of `old` where that fits, which need not be had anew: where pages are small, that takes
    /// half of the time.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn renewed(old: Self, exact: &Exact<f64>, options: &IntegrationOptions, longest: f64) -> Result<Self> {
        let exact = &*tabulated(exact);
        let fits = old.options == *options && old.longest() == longest && old.source.is_none();
        if !fits || old.size() != sized(exact, options, longest)? {
            return Self::new(exact, options, longest);
        }
        let stored = match old.stored {
            TableData::Volume(mut t) => {
                t.rebuild(exact);
                TableData::Volume(t)
            }
            TableData::Polynomial(mut t) => {
                t.rebuild(exact);
                TableData::Polynomial(t)
            }
            TableData::SecondOrder(mut t) => {
                t.rebuild(exact);
                TableData::SecondOrder(t)
            }
            TableData::SecondOrderPolynomial(mut t) => {
                t.rebuild(exact);
                TableData::SecondOrderPolynomial(t)
            }
            TableData::Cylindrical(_) => return Self::new(exact, options, longest),
        };
        Self::of(exact, options, Some(stored))
    }

    /// The same table, without texels: those are for a device to build.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn outline(exact: &Exact<f64>, options: &IntegrationOptions, longest: f64) -> Result<Self> {
        let exact = &*tabulated(exact);
        let [front, back, depth] = sized(exact, options, longest)?;
        let (direct, kind, degree) = (exact.direct, options.lengths, options.degree);
        let stored = match options.form {
            Form::Volume => Some(TableData::Volume(Table {
                kind,
                size: [front, back, depth],
                longest,
                direct,
                texels: vec![].into(),
            })),
            Form::Polynomial => {
                let texels = vec![vec![]; degree as usize + 1];
                Some(TableData::Polynomial(Polynomial { degree, size: front, longest, direct, texels }))
            }
            Form::Cylindrical => {
                Some(TableData::Cylindrical(Cylindrical { planes: depth, size: front, longest, texels: vec![] }))
            }
            Form::Auto | Form::Exact | Form::SecondOrder | Form::SecondOrderPolynomial => None,
        };
        let options = IntegrationOptions { texels: Texels::Float, ..*options };
        Ok(PreintegratedTable { source: Some(Box::new(exact.clone())), ..Self::of(exact, &options, stored)? })
    }

    fn of(exact: &Exact<f64>, options: &IntegrationOptions, stored: Option<TableData>) -> Result<Self> {
        let stored = stored.ok_or_else(|| Error::Render("the exact integral has no table".into()))?;
        let unit = match &stored {
            TableData::Volume(t) if t.kind != Kind::Uniform => length(t.kind, t.size[2], t.longest, 1),
            TableData::Volume(Table { longest, .. })
            | TableData::Polynomial(Polynomial { longest, .. })
            | TableData::SecondOrder(SecondOrder { length: longest, .. })
            | TableData::SecondOrderPolynomial(SecondOrderPolynomial { longest, .. })
            | TableData::Cylindrical(Cylindrical { longest, .. }) => *longest,
        };
        let inverse = (1.0 / unit) as f32;
        let mut table = PreintegratedTable {
            options: *options,
            ranges: vec![],
            stored,
            direct: exact.direct,
            inverse,
            source: None,
        };
        table.round();
        Ok(table)
    }

    /// Rounds texels to what they are stored as.
    fn round(&mut self) {
        let levels = match self.options.texels {
            Texels::Float => 0.0,
            Texels::Unorm16 => 65535.0,
            Texels::Unorm8 => 255.0,
        };
        let density = if levels > 0.0 { self.density_span(f64::from(levels)) } else { None };
        let parts: Vec<(Range, &mut [[f32; 4]])> = match &mut self.stored {
            TableData::Volume(t) => {
                let [r, g, b, most] = t.greatest();
                vec![(from_zero([r, g, b, density.unwrap_or(most)]), &mut t.texels)]
            }
            TableData::Cylindrical(t) => {
                let [r, g, b, _] = greatest(&t.texels);
                let colour = r.max(g).max(b);
                vec![(from_zero([colour, colour, colour, 1.0]), &mut t.texels)]
            }
            TableData::SecondOrder(SecondOrder { texels: Slabs::Float(texels), .. }) => {
                let of = if levels > 0.0 { greatest(texels) } else { [1.0; 4] };
                vec![(from_zero([of[0], of[1], of[2], 1.0]), &mut texels[..])]
            }
            // Bytes are what they are.
            TableData::SecondOrder(_) => vec![],
            // Coefficients may be negative.
            TableData::Polynomial(t) => {
                with_density(t.texels.iter_mut().map(|t| (within(t), &mut t[..])).collect(), density)
            }
            TableData::SecondOrderPolynomial(t) => {
                with_density(t.texels.iter_mut().map(|t| (within(t), &mut t[..])).collect(), density)
            }
        };
        for (range, texels) in parts {
            if levels == 0.0 {
                self.ranges.push(Range { least: [0.0; 4], span: [1.0; 4] });
                continue;
            }
            for texel in texels {
                *texel = range.value(range.share(*texel).map(|v| (v * levels).round() / levels));
            }
            self.ranges.push(range);
        }
    }

    /// The greatest mean extinction that texels of so many levels are to tell; none for tables that hold opacities.
    /// What is opaque has no greatest one, and all others would share the few levels that it leaves. So it is that with
    /// which the opacities of some texels are off by least (their root mean square, where all lengths up to the longest
    /// are as frequent): what is beyond is not wholly opaque in the shortest segments.
    fn density_span(&self, levels: f64) -> Option<f32> {
        // With direct emission colours are over what is seen of the length, and would change with it.
        if self.direct {
            return None;
        }
        // Mean extinctions and lengths.
        let mut some: Vec<[f64; 2]> = vec![];
        let mut take = |texels: &[[f32; 4]], l: f64| {
            some.extend(texels.iter().step_by((texels.len() / SOME) | 1).map(|t| [f64::from(t[3]), l]));
        };
        let (longest, greatest) = (
            self.longest(),
            match &self.stored {
                TableData::Volume(t) if t.kind == Kind::LogNormalised => {
                    let slices = t.texels.chunks_exact(t.size[0] as usize * t.size[1] as usize);
                    (0..).zip(slices).skip(1).for_each(|(k, s)| take(s, length(t.kind, t.size[2], t.longest, k)));
                    t.greatest()[3]
                }
                TableData::Polynomial(Polynomial { longest, .. })
                | TableData::SecondOrderPolynomial(SecondOrderPolynomial { longest, .. }) => {
                    let first = match &self.stored {
                        TableData::Polynomial(t) => &t.texels.first()?[..],
                        TableData::SecondOrderPolynomial(t) => &t.texels.first()?[..],
                        _ => return None,
                    };
                    (0..8).for_each(|k| take(first, longest * f64::from(-k).exp2()));
                    greatest(first)[3]
                }
                _ => return None,
            },
        );
        let error = |span: f32| {
            let span = f64::from(span);
            let errors = some.iter().map(|[density, l]| {
                let rounded = ((density / span).min(1.0) * levels).round() / levels * span;
                l * ((-l * rounded).exp() - (-l * density).exp()).powi(2)
            });
            errors.sum::<f64>()
        };
        let spans = (0..).map(|k| greatest * (-k as f32).exp2());
        let spans = spans.take_while(|s| f64::from(*s) * longest > 1.0 || *s == greatest);
        spans.map(|s| (error(s), s)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, span)| span)
    }

    /// What was chosen.
    pub fn options(&self) -> &IntegrationOptions {
        &self.options
    }

    /// The function of which a device builds the texels, if these are not here.
    pub(crate) fn source(&self) -> Option<&Exact<f64>> {
        self.source.as_deref()
    }

    pub(crate) fn stored(&self) -> &TableData {
        &self.stored
    }

    pub(crate) fn ranges(&self) -> &[Range] {
        &self.ranges
    }

    /// Texels along each axis.
    pub fn size(&self) -> [u32; 3] {
        match &self.stored {
            TableData::Volume(t) => t.size,
            TableData::Polynomial(t) => [t.size, t.size, t.degree + 1],
            TableData::Cylindrical(t) => [t.size, t.size, t.planes],
            TableData::SecondOrder(SecondOrder { size, .. })
            | TableData::SecondOrderPolynomial(SecondOrderPolynomial { size, .. }) => [*size; 3],
        }
    }

    /// Bytes of its texels, as they are held here or on a device of 32-bit floats.
    pub fn bytes(&self) -> u64 {
        match &self.stored {
            TableData::SecondOrder(t) => t.bytes(),
            TableData::SecondOrderPolynomial(t) => t.bytes(),
            _ => IntegrationOptions::bytes(self.size()),
        }
    }

    /// The longest segment, in normalised units.
    pub fn longest(&self) -> f64 {
        match &self.stored {
            TableData::Volume(t) => t.longest,
            TableData::Polynomial(t) => t.longest,
            TableData::Cylindrical(t) => t.longest,
            TableData::SecondOrder(t) => t.length,
            TableData::SecondOrderPolynomial(t) => t.longest,
        }
    }

    /// Premultiplied colour and opacity of a segment, in normalised units: the twin of `tabulated` in
    /// `shaders/table.wgsl`.
    pub fn look_up(&self, front: f32, back: f32, length: f32) -> [f32; 4] {
        let (f, b) = (front * 0.5 + 0.5, back * 0.5 + 0.5);
        match &self.stored {
            TableData::Volume(t) => {
                let [w, h, n] = t.size;
                let steps = length * self.inverse;
                let slices = match t.kind {
                    Kind::Uniform => steps * (n - 1) as f32,
                    _ => steps.max(1.0).log2() + steps.min(1.0),
                };
                let (slice, share) = between(slices / (n - 1) as f32, n);
                let (i, j, area) = (between(f, w), between(b, h), w as usize * h as usize);
                let slices = &t.texels[slice * area..];
                let texel = mix(bilinear(slices, w, i, j), bilinear(&slices[area..], w, i, j), share);
                if t.kind == Kind::LogNormalised { self.reconstructed(texel, length) } else { texel }
            }
            TableData::Polynomial(t) => {
                let (i, j) = (between(f, t.size), between(b, t.size));
                let x = (length * self.inverse).min(1.0);
                let mut sum = [0.0; 4];
                for texels in t.texels.iter().rev() {
                    let c = bilinear(texels, t.size, i, j);
                    sum = [sum[0] * x + c[0], sum[1] * x + c[1], sum[2] * x + c[2], c[3]];
                }
                self.reconstructed(sum, length)
            }
            TableData::Cylindrical(t) => {
                let l = (length * self.inverse).min(1.0);
                let (d, s) = (f - b, (f - b).abs().max(l));
                if s <= 0.0 {
                    return [0.0; 4];
                }
                let steep = 0.25 * l / s;
                let a = if l > d.abs() {
                    0.5 - 0.25 * d / s
                } else if d >= 0.0 {
                    steep
                } else {
                    1.0 - steep
                };
                let at = a * t.planes as f32;
                let (i, j, area) = (between(s, t.size), between(b, t.size), (t.size * t.size) as usize);
                let plane = |k: usize| bilinear(&t.texels[k % t.planes as usize * area..], t.size, i, j);
                if self.options.planes == Planes::One {
                    return plane((at + 0.5) as usize);
                }
                let low = (at as usize).min(t.planes as usize - 1);
                mix(plane(low), plane(low + 1), at - low as f32)
            }
            // A line is the parabola through its middle.
            TableData::SecondOrder(_) | TableData::SecondOrderPolynomial(_) => {
                self.look_up_slab([front, (front + back) * 0.5, back], length)
            }
        }
    }

    /// The same of a slab along which the value is the parabola through three samples, by a table of such; of its one
    /// length, or of a line from end to end by other tables.
    pub fn look_up_slab(&self, samples: [f32; 3], length: f32) -> [f32; 4] {
        let [front, _, back] = samples;
        match &self.stored {
            TableData::SecondOrder(t) => trilinear(|i| t.texels.get(i), t.size, samples),
            TableData::SecondOrderPolynomial(t) => {
                let x = (length * self.inverse).min(1.0);
                let mut sum = [0.0; 4];
                for texels in t.texels.iter().rev() {
                    let c = trilinear(|i| texels[i], t.size, samples);
                    sum = [sum[0] * x + c[0], sum[1] * x + c[1], sum[2] * x + c[2], c[3]];
                }
                self.reconstructed(sum, length)
            }
            _ => self.look_up(front, back, length),
        }
    }

    /// Premultiplied colour and opacity of a slab as [`Self::look_up_slab`]; beyond ±1, as it is integrated.
    pub(crate) fn slab(&self, exact: &Exact<f64>, samples: [f64; 3], length: f64) -> [f32; 4] {
        let narrow = samples.map(|s| s as f32);
        if narrow.iter().all(|s| s.abs() <= WITHIN) {
            return self.look_up_slab(narrow, length as f32);
        }
        parabola(exact, samples, length).map(|v| v as f32)
    }

    /// Colour and opacity of a segment, from its colour over what is seen of it and its mean extinction.
    fn reconstructed(&self, [r, g, b, density]: [f32; 4], length: f32) -> [f32; 4] {
        let alpha = match self.options {
            IntegrationOptions { form: Form::Polynomial, alpha: Alpha::Linear, .. } => {
                opacity_of_depth(density / self.inverse) * (length * self.inverse).min(1.0)
            }
            _ => opacity_of_depth(density * length),
        };
        let seen = if !self.direct {
            alpha
        } else if density * length > 1e-6 {
            alpha / density
        } else {
            length
        };
        [r * seen, g * seen, b * seen, alpha]
    }

    /// Adds a segment of `length`, of a field of one component, to `light`. Values that are not finite make it invisible. Beyond ±1 the
    /// function is constant: that part of a segment is integrated exactly.
    #[inline]
    pub fn add(&self, exact: &Exact<f32>, front: f32, back: f32, length: f32, light: &mut Light<f32>) {
        if !(front.is_finite() && back.is_finite()) {
            return;
        }
        if front.abs().max(back.abs()) <= WITHIN {
            let [r, g, b, alpha] = self.look_up(front, back, length);
            return light.add([r, g, b], alpha);
        }
        let (near, far) = (front.clamp(-1.0, 1.0), back.clamp(-1.0, 1.0));
        if near == far {
            return exact.add(&[front], &[back], length, light);
        }
        let part = |from: f32, to: f32| (to - from) / (back - front) * length;
        if front != near {
            exact.add(&[front], &[near], part(front, near), light);
        }
        let [r, g, b, alpha] = self.look_up(near, far, part(near, far));
        light.add([r, g, b], alpha);
        if back != far {
            exact.add(&[far], &[back], part(far, back), light);
        }
    }
}

/// What a table is of: the function, or the weights of the colours at a segment's ends.
fn tabulated(exact: &Exact<f64>) -> Cow<'_, Exact<f64>> {
    exact.weights().map_or(Cow::Borrowed(exact), Cow::Owned)
}

/// Texels along the axes of the table that `options` say: where nobody said how many, by the bounds of its error.
fn sized(exact: &Exact<f64>, options: &IntegrationOptions, longest: f64) -> Result<[u32; 3]> {
    let mut size = options.size(exact.opacity.len());
    check(options, size, exact.kind)?;
    if options.table.is_none() {
        let [front, _, depth] = size;
        // Fewer values than the knots ask for, where that is known to be enough.
        let fewer = match (options.form, options.lengths) {
            (Form::Polynomial, _) => {
                table::values_of_polynomial(exact, options.degree, longest, SMALL_ERROR, front / 2)
            }
            (Form::Volume, Kind::LogNormalised) => {
                table::values_of_normalised(exact, depth, longest, SMALL_ERROR, front / 2)
            }
            _ => None,
        };
        size = match (options.form, options.lengths, fewer) {
            (Form::Volume, Kind::Uniform, _) => table::size(exact, longest, UNIFORM_ERROR).unwrap_or(size),
            (_, _, Some(fewer)) => [fewer, fewer, depth],
            _ => size,
        };
    }
    Ok(size)
}

/// Whether `options` can be drawn with, of that size and for fields of this kind.
///
/// # Errors
/// Those of [`IntegrationOptions::check`]; [`Error::Render`] for a table of parabolas of fields of several components.
pub fn check(options: &IntegrationOptions, size: [u32; 3], kind: field::Kind) -> Result<()> {
    if kind != field::Kind::Scalar && options.form.is_of_second_order() {
        return Err(Error::Render(
            "tables of parabolas are for fields of one component; use the exact integral".into(),
        ));
    }
    options.check(size)
}

#[cfg(test)]
pub(crate) mod tests;
