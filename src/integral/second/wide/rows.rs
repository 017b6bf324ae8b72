//! A function of two variables, or with light, as `shaders/second.wgsl` reads it: what holds for all of it, and rows of
//! numbers.

use super::panel::SHARE;
use super::{Form, Source, Wide};
use crate::integral::Knots;
use crate::integral::options::{Method, Two, Weights};
use crate::integral::second::Second;
use crate::integral::second::closed::{Profile, Turn};
use crate::integral::second::light::{ANGLES, angle, begins};
use crate::integral::second::panel::STEP;
use crate::transfer::bivariate::{self, Shape, Sine, Widget};
use crate::transfer::shading::{Highlight, Light, Origin, Shade, Shading};
use crate::transfer::{Bivariate, Convention, TransferFunction};
use bytemuck::{Pod, Zeroable};

/// Widgets that shaders have a bit for.
const MOST_WIDGETS: usize = 32;
/// Lights that shaders go through: as many as are left of the loops that devices in software make.
const MOST_LAMPS: usize = 32;
/// The opacity under the opacity convention beyond which shaders do not tell the logarithm of a round peak well enough.
const ROUND_PEAK: f64 = 0.99999;
/// Stands for infinity, which arithmetic on devices need not know.
const BEYOND: f32 = 1e30;

/// What programs are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Forms {
    pub(crate) source: Kind,
    /// There is a function of g besides.
    pub(crate) factor: bool,
    pub(crate) logarithmic: bool,
    /// Emission is not multiplied by extinction.
    pub(crate) direct: bool,
    /// Light or silhouettes: gradients are read.
    pub(crate) lit: bool,
    /// Segments are integrated in equal pieces.
    pub(crate) pieces: bool,
    /// Silhouettes are of whole segments.
    pub(crate) whole: bool,
}

/// What says colour and opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Scalar,
    Widgets,
    Texels,
}

/// `Second` in the shader.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Head {
    pub(crate) absorbing: f32,
    pub(crate) shining: f32,
    pub(crate) widgets: u32,
    pub(crate) knots: u32,
    pub(crate) factors: u32,
    pub(crate) texels: u32,
    pub(crate) lights: u32,
    pub(crate) lamps: u32,
    pub(crate) lines: [u32; 2],
    pub(crate) size: [u32; 2],
    pub(crate) scale: [f32; 2],
    pub(crate) offset: [f32; 2],
    pub(crate) ambient: f32,
    pub(crate) diffuse: f32,
    pub(crate) specular: f32,
    pub(crate) power: f32,
    pub(crate) silhouette: f32,
    pub(crate) cosine: f32,
    pub(crate) turn: f32,
    pub(crate) looks: u32,
    pub(crate) whole: f32,
    pub(crate) pieces: u32,
}

/// The function.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    pub(crate) forms: Forms,
    pub(crate) panels: Panels,
    pub(crate) head: Head,
    pub(crate) rows: Vec<[f32; 4]>,
}

/// The rule of a panel, and by what widgets' bends are multiplied to be panels, as constants of the shader.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Panels {
    pub(crate) nodes: [f32; 3],
    pub(crate) weights: [f32; 3],
    pub(crate) to_node: [[f32; 3]; 3],
    /// Of Gaussians and of sines.
    pub(crate) bends: [f64; 2],
}

/// What shaders do not draw of `transfer`, integrated as `two` says; none if they draw all of it.
pub(crate) fn lacks(transfer: &TransferFunction, two: &Two) -> Option<&'static str> {
    let shading = transfer.shading();
    let widgets = match transfer.bivariate().map(Bivariate::source) {
        Some(bivariate::Source::Widgets(all)) => all.as_slice(),
        _ => &[],
    };
    let is_round = |widget: &Widget| matches!(widget.shape, Shape::Gaussian { .. } | Shape::Sinusoid(..));
    if two.method == Method::Analytic {
        return Some("segments in closed form");
    }
    if two.method == Method::Segmented && two.weights == Weights::Texture {
        return Some("pieces of segments by a texture");
    }
    if widgets.len() > MOST_WIDGETS {
        return Some("more than 32 widgets");
    }
    if transfer.convention() == Convention::Opacity
        && widgets.iter().any(|widget| is_round(widget) && widget.opacity > ROUND_PEAK)
    {
        return Some("round peaks of opacity 1 under the opacity convention");
    }
    if shading.is_some_and(|s| s.lights().len() > MOST_LAMPS) {
        return Some("more than 32 lights");
    }
    None
}

impl Wide {
    /// The function for shaders, of which nothing is [lacking](lacks).
    pub(crate) fn rows(&self, second: &Second) -> Rows {
        let shading = second.shading.as_ref();
        let mut rows = vec![];
        let mut head = Head {
            absorbing: self.absorbing,
            shining: self.shining.unwrap_or(0.0),
            silhouette: self.silhouette.unwrap_or(-1.0),
            cosine: self.cosines[0],
            turn: self.turn,
            whole: second.published.unwrap_or(-1.0) as f32,
            pieces: second.two.pieces,
            ..Head::default()
        };
        let first = |rows: &Vec<[f32; 4]>| rows.len() as u32;
        let source = match &self.source {
            Source::Widgets(all) => {
                head.widgets = all.len() as u32;
                all.iter().for_each(|widget| rows.extend(of_widget(widget)));
                Kind::Widgets
            }
            Source::Scalar(knots) => {
                (head.knots, head.lines[0]) = (first(&rows), knots.len() as u32 - 1);
                of_lines(knots, &mut rows);
                Kind::Scalar
            }
            Source::Texels(texels) => {
                head.texels = first(&rows);
                rows.extend_from_slice(&texels.all);
                head.size = texels.size.map(|n| n as u32);
                (head.scale, head.offset) = (texels.scale, texels.offset);
                Kind::Texels
            }
        };
        if let Some(factor) = &self.factor {
            (head.factors, head.lines[1]) = (first(&rows), factor.len() as u32 - 1);
            of_lines(factor, &mut rows);
        }
        if let Some(shade) = shading.and_then(Shading::shade) {
            (head.lights, head.lamps) = (first(&rows), second.lights.len() as u32);
            second.lights.iter().for_each(|light| rows.extend(of_light(light, shade, second.scale)));
            [head.ambient, head.diffuse, head.specular, head.power] =
                [shade.ambient, shade.diffuse, shade.specular, shade.power].map(|x| x as f32);
        }
        head.looks = self.looks(second);
        let forms = Forms {
            source,
            factor: self.factor.is_some(),
            logarithmic: self.is_logarithmic,
            direct: self.shining.is_some(),
            lit: shading.is_some_and(Shading::needs_normals) || second.published.is_some(),
            pieces: second.two.method == Method::Segmented,
            whole: second.published.is_some(),
        };
        Rows { forms, panels: self.panels(), head, rows }
    }

    /// The bits of the shader's `looks`.
    fn looks(&self, second: &Second) -> u32 {
        let shade = second.shading.as_ref().and_then(Shading::shade);
        let bits = [
            shade.is_some_and(|s| s.two_sided),
            shade.is_some(),
            shade.is_some_and(|s| s.highlight == Highlight::Reflected),
            shade.is_some_and(begins),
            self.on_ray,
            second.lights.iter().any(|l| matches!(l.origin, Origin::Position(_))),
            self.silhouette.is_some_and(|p| p.fract() != 0.0),
        ];
        (0..).zip(bits).map(|(k, bit)| u32::from(bit) << k).sum()
    }

    /// The rule of panels.
    fn panels(&self) -> Panels {
        let bends = STEP.map(|step| 1.0 / step / SHARE);
        let (nodes, weights, to_node) = self.rules[0].parts();
        Panels { nodes, weights, to_node, bends }
    }
}

/// The rows of a widget.
fn of_widget(widget: &super::Widget) -> [[f32; 4]; 7] {
    let [r, g, b] = widget.color;
    let bound = |[lo, hi]: [f32; 2]| [lo.clamp(-BEYOND, BEYOND), hi.clamp(-BEYOND, BEYOND)];
    let pair = |of: [[f32; 2]; 2]| {
        let [[a, b], [c, d]] = of.map(bound);
        [a, b, c, d]
    };
    let mut rows = [[0.0; 4]; 7];
    rows[0][1] = widget.opacity;
    rows[1] = [r, g, b, 0.0];
    match &widget.form {
        Form::Uniform => {}
        Form::Gaussian { scale, offset } => {
            rows[0][0] = 1.0;
            rows[2] = [scale[0], scale[1], offset[0], offset[1]];
        }
        Form::Wave { axis, start, profile } => {
            rows[0][0] = number(profile);
            (rows[0][2], rows[0][3]) = (profile.floor as f32, (1.0 / (1.0 - profile.floor)) as f32);
            rows[1][3] = profile.turns().len() as f32;
            rows[2] = [axis[0], axis[1], *start, profile.turn.radians() as f32];
            for (to, &turn) in rows[5].iter_mut().zip(profile.turns()) {
                *to = turn as f32;
            }
            rows[6] = profile.told().map(|x| x as f32);
        }
    }
    (rows[3], rows[4]) = (pair(widget.domain), pair(widget.support));
    rows
}

/// What the shader calls a wave.
fn number(profile: &Profile) -> f32 {
    match profile.turn {
        Turn::Triangle => 2.0,
        Turn::Sine(Sine::Abs) => 3.0,
        Turn::Sine(Sine::Positive) => 4.0,
        Turn::Sine(Sine::Raised) => 5.0,
    }
}

/// The rows of the lines between knots.
fn of_lines(knots: &Knots<f32>, rows: &mut Vec<[f32; 4]>) {
    for (i, ends) in knots.s.windows(2).enumerate() {
        rows.extend([knots.value[i], knots.slope[i], [ends[0], ends[1], 0.0, 0.0]]);
    }
}

/// The rows of a light, on a mesh whose coordinates are world units times `scale`.
fn of_light(light: &Light, shade: &Shade, scale: f64) -> [[f32; 4]; 4] {
    let [r, g, b] = light.color.map(|c| (c * light.intensity) as f32);
    let (mut kind, mut way) = (0.0, [0.0; 3]);
    let mut cone = ([0.0; 4], 0.0);
    let exponent = light.cone.map_or(1.0, |c| c.exponent);
    match light.origin {
        Origin::Headlight => {}
        Origin::Direction(to) => (kind, way) = (1.0, to.to_array()),
        Origin::Position(at) => (kind, way) = (2.0, at.to_array()),
    }
    if let Some(of) = &light.cone {
        kind = 3.0;
        let [x, y, z] = of.axis.normalize().to_array();
        // Of 90 degrees f64 makes 6e-17.
        cone = ([x, y, z, of.exponent].map(|x| x as f32), of.angle.to_radians().cos() as f32);
    }
    let [x, y, z] = way.map(|x| x as f32);
    let [a, b_world, c_world] = light.attenuation;
    let turn = angle(shade).min(ANGLES[1] / exponent.max(1.0).sqrt()) * SHARE;
    [
        [r, g, b, kind],
        [x, y, z, cone.1],
        cone.0,
        [a, b_world / scale, c_world / (scale * scale), turn.cos()].map(|x| x as f32),
    ]
}
