//! Interpolation between two colours in the spaces that VTK's colour functions know, as VTK does it. Colours in and out
//! are RGB in [0, 1], gamma-encoded as sRGB.

use std::f64::consts::{PI, TAU};

/// The space that colours are interpolated in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Space {
    Rgb,
    /// Hue goes from one to the other as numbers do, so from blue to red by green; or, as a wheel, the short way round.
    Hsv {
        wrap: bool,
    },
    Lab,
    /// Through white if the ends differ in hue (Moreland, "Diverging Color Maps for Scientific Visualization", 2009).
    Diverging,
    /// The upper colour all the way.
    Step,
}

impl Space {
    /// The colour at `u` in [0, 1] on the way from `a` to `b`.
    pub(super) fn mix(self, a: [f64; 3], b: [f64; 3], u: f64) -> [f64; 3] {
        match self {
            Space::Rgb => lerp(a, b, u),
            Space::Hsv { wrap } => {
                let (mut a, mut b) = (hsv(a), hsv(b));
                if wrap && (a[0] - b[0]).abs() > 0.5 {
                    if a[0] > b[0] { a[0] -= 1.0 } else { b[0] -= 1.0 }
                }
                rgb_of_hsv(lerp(a, b, u))
            }
            Space::Lab => rgb_of_lab(lerp(lab(a), lab(b), u)),
            Space::Diverging => diverging(a, b, u),
            Space::Step => b,
        }
    }
}

fn lerp(a: [f64; 3], b: [f64; 3], u: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * u)
}

/// Hue (a turn is 1), saturation, value.
fn hsv([r, g, b]: [f64; 3]) -> [f64; 3] {
    let (hi, lo) = (r.max(g).max(b), r.min(g).min(b));
    let d = hi - lo;
    if d <= 0.0 {
        return [0.0, 0.0, hi];
    }
    let sextant = if hi == r {
        (g - b) / d
    } else if hi == g {
        2.0 + (b - r) / d
    } else {
        4.0 + (r - g) / d
    };
    [(sextant / 6.0).rem_euclid(1.0), d / hi, hi]
}

fn rgb_of_hsv([h, s, v]: [f64; 3]) -> [f64; 3] {
    [5.0, 3.0, 1.0].map(|n: f64| {
        let k = (n + 6.0 * h).rem_euclid(6.0);
        v - v * s * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// The D65 white that VTK uses.
const WHITE: [f64; 3] = [0.9505, 1.0, 1.089];

/// CIE L*a*b*.
fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = rgb.map(|c| if c > 0.04045 { ((c + 0.055) / 1.055).powf(2.4) } else { c / 12.92 });
    let xyz = [
        0.4124 * r + 0.3576 * g + 0.1805 * b,
        0.2126 * r + 0.7152 * g + 0.0722 * b,
        0.0193 * r + 0.1192 * g + 0.9505 * b,
    ];
    let [x, y, z] = std::array::from_fn(|k| {
        let c: f64 = xyz[k] / WHITE[k];
        if c > 0.008856 { c.cbrt() } else { 7.787 * c + 16.0 / 116.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_of_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
    let y = (l + 16.0) / 116.0;
    let c = [a / 500.0 + y, y, y - b / 200.0];
    let [x, y, z] = std::array::from_fn(|k| {
        let cube = c[k].powi(3);
        WHITE[k] * if cube > 0.008856 { cube } else { (c[k] - 16.0 / 116.0) / 7.787 }
    });
    let rgb = [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ]
    .map(|c: f64| if c > 0.0031308 { 1.055 * c.powf(1.0 / 2.4) - 0.055 } else { 12.92 * c });
    // VTK keeps the hue of colours that are too bright for RGB.
    let brightest = rgb[0].max(rgb[1]).max(rgb[2]).max(1.0);
    rgb.map(|c| (c / brightest).max(0.0))
}

/// Moreland's Msh: the polar form (radius, inclination, hue) of L*a*b*.
fn msh(rgb: [f64; 3]) -> [f64; 3] {
    let [l, a, b] = lab(rgb);
    let m = (l * l + a * a + b * b).sqrt();
    let s = if m > 0.001 { (l / m).clamp(-1.0, 1.0).acos() } else { 0.0 };
    [m, s, if s > 0.001 { b.atan2(a) } else { 0.0 }]
}

fn diverging(a: [f64; 3], b: [f64; 3], mut u: f64) -> [f64; 3] {
    let (mut p, mut q) = (msh(a), msh(b));
    let turn = (p[2] - q[2]).abs() % TAU;
    if p[1] > 0.05 && q[1] > 0.05 && turn.min(TAU - turn) > 0.33 * PI {
        let white = [p[0].max(q[0]).max(88.0), 0.0, 0.0];
        if u < 0.5 {
            (q, u) = (white, 2.0 * u);
        } else {
            (p, u) = (white, 2.0 * u - 1.0);
        }
    }
    if p[1] < 0.05 && q[1] > 0.05 {
        p[2] = spun_hue(q, p[0]);
    } else if q[1] < 0.05 && p[1] > 0.05 {
        q[2] = spun_hue(p, q[0]);
    }
    let [m, s, h] = lerp(p, q, u);
    rgb_of_lab([m * s.cos(), m * s.sin() * h.cos(), m * s.sin() * h.sin()])
}

/// The hue for an unsaturated end of radius `m`, so that the way from `saturated` changes evenly to the eye.
fn spun_hue(saturated: [f64; 3], m: f64) -> f64 {
    let [radius, s, hue] = saturated;
    if radius >= m - 0.1 {
        return hue;
    }
    let spin = s * (m * m - radius * radius).sqrt() / (radius * s.sin());
    // Away from purple.
    if hue > -0.3 * PI { hue + spin } else { hue - spin }
}
