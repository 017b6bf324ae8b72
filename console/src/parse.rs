//! The values of options. Each returns what clap shows after the option's name.

use glam::DVec3;
use halite::field::Component;
use halite::io::Time;
use halite::render::MOST_THREADS;
use halite::scene::automatic::{Opacity, Place};
use halite::transfer::shading::Shade;
use halite::view::ClippingPlane;

fn number(text: &str) -> Result<f64, String> {
    let n: f64 = text.trim().parse().map_err(|_| format!("\"{text}\" is not a number"))?;
    if n.is_finite() { Ok(n) } else { Err(format!("{text} is not finite")) }
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let list = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    list.try_into().map_err(|l: Vec<_>| format!("{} numbers, not {N} with commas between", l.len()))
}

/// `X,Y,Z`
pub fn vector(text: &str) -> Result<DVec3, String> {
    numbers(text).map(DVec3::from)
}

/// `X,Y,Z`, all above 0
pub fn factors(text: &str) -> Result<DVec3, String> {
    let factors = vector(text)?;
    if factors.cmple(DVec3::ZERO).any() {
        return Err("all three factors must be above 0".into());
    }
    if factors.cmplt(DVec3::splat(1e-30)).any() || factors.cmpgt(DVec3::splat(1e30)).any() {
        return Err("all three factors must be from 1e-30 to 1e30".into());
    }
    Ok(factors)
}

/// A whole number from 0.
pub fn count(text: &str) -> Result<usize, String> {
    text.trim().parse().map_err(|_| "it must be a whole number from 0".into())
}

/// A number of threads, 0 for one for each core.
pub fn threads(text: &str) -> Result<usize, String> {
    let threads = count(text)?;
    if threads <= MOST_THREADS { Ok(threads) } else { Err(format!("there are {MOST_THREADS} threads at most")) }
}

/// A text that is not empty.
pub fn name(text: &str) -> Result<String, String> {
    if text.trim().is_empty() { Err("the name is empty".into()) } else { Ok(text.into()) }
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|n| if n > 0.0 { Ok(n) } else { Err("it must be above 0".into()) })
}

/// A factor above 0.
pub fn gain(text: &str) -> Result<f32, String> {
    let gain = positive(text)? as f32;
    if gain > 0.0 && gain.is_finite() { Ok(gain) } else { Err(format!("{text} is beyond 32 bits")) }
}

/// A number of 0 or more.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|n| if n >= 0.0 { Ok(n) } else { Err("it must be 0 or more".into()) })
}

/// `AMBIENT,DIFFUSE,SPECULAR,POWER`, all at least 0
pub fn shade(text: &str) -> Result<Shade, String> {
    let [ambient, diffuse, specular, power] = numbers(text)?;
    if [ambient, diffuse, specular, power].iter().any(|x| *x < 0.0) {
        return Err("the shares of ambient, diffuse and specular light and the power must be 0 or more".into());
    }
    Ok(Shade { ambient, diffuse, specular, power, ..Shade::default() })
}

/// Any finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    number(text)
}

/// `WxH`
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size = parts.ok_or("the size is width x height in pixels, such as 1024x768")?;
    if size.contains(&0) { Err("it has no pixels".into()) } else { Ok(size) }
}

/// `LO:HI`
pub fn range(text: &str) -> Result<[f64; 2], String> {
    let (lo, hi) = text.split_once(':').ok_or("a range is two numbers, such as 0:1")?;
    let range = [number(lo)?, number(hi)?];
    if range[0] < range[1] { Ok(range) } else { Err("the first number must be below the second".into()) }
}

/// `0`, `1`, … or `magnitude`
pub fn component(text: &str) -> Result<Component, String> {
    match text {
        "magnitude" => Ok(Component::Magnitude),
        _ => text.parse().map(Component::Index).map_err(|_| "it must be an index from 0, or \"magnitude\"".into()),
    }
}

/// A step, from 0; a time, which has a point or an exponent; or `last`
pub fn time(text: &str) -> Result<Time, String> {
    match (text, text.trim().parse()) {
        ("last", _) => Ok(Time::Last),
        (_, Ok(step)) => Ok(Time::Step(step)),
        _ => number(text).map(Time::Value),
    }
}

/// What an 8-bit picture shows behind the volume: a colour, or nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Background {
    /// Transparency.
    None,
    /// Red, green and blue, 0 to 1.
    Color([f64; 3]),
}

/// `R,G,B`, `black`, `white` or `none`
pub fn background(text: &str) -> Result<Background, String> {
    Ok(match text {
        "none" => Background::None,
        "black" => Background::Color([0.0; 3]),
        "white" => Background::Color([1.0; 3]),
        _ => {
            let color = numbers(text)?;
            if !color.iter().all(|c| (0.0..=1.0).contains(c)) {
                return Err("red, green and blue must be from 0 to 1".into());
            }
            Background::Color(color)
        }
    })
}

/// `R,G,B` or `R,G,B,A`: a colour in 0 to 1, and an opacity
pub fn color_and_opacity(text: &str) -> Result<([f64; 3], Option<f64>), String> {
    let list = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    let (color, opacity) = match list[..] {
        [r, g, b] => ([r, g, b], None),
        [r, g, b, a] => ([r, g, b], Some(a)),
        _ => return Err(format!("{} numbers, not red, green, blue and perhaps an opacity", list.len())),
    };
    if !color.iter().all(|c| (0.0..=1.0).contains(c)) {
        return Err("red, green and blue must be from 0 to 1".into());
    }
    if opacity.is_some_and(|a| a < 0.0) { Err("the opacity must be 0 or more".into()) } else { Ok((color, opacity)) }
}

/// `X,Y,Z,NX,NY,NZ`
pub fn plane(text: &str) -> Result<ClippingPlane, String> {
    let [x, y, z, a, b, c] = numbers(text)?;
    let (origin, normal) = (DVec3::new(x, y, z), DVec3::new(a, b, c));
    if normal == DVec3::ZERO { Err("the normal is zero".into()) } else { Ok(ClippingPlane { origin, normal }) }
}

/// `X0,X1,Y0,Y1,Z0,Z1`
pub fn crop(text: &str) -> Result<[[f64; 2]; 3], String> {
    let [a, b, c, d, e, f] = numbers(text)?;
    Ok([[a, b], [c, d], [e, f]])
}

/// Cropping regions by their name, with hyphens for blanks, or by their bits, such as 0x2000.
pub fn regions(text: &str) -> Result<u32, String> {
    let bits = text.strip_prefix("0x").map_or_else(|| text.parse(), |hex| u32::from_str_radix(hex, 16));
    bits.or_else(|_| halite::scene::regions(&text.replace('-', " ")))
}

/// `S:A,S:A,…`
pub fn opacity(text: &str) -> Result<Opacity, String> {
    let knot = |k: &str| {
        let (s, a) = k.split_once(':').ok_or("knots are scalar:opacity, such as 0:0,50%:0.2,1:1")?;
        let place = match s.strip_suffix('%') {
            Some(percent) => Place::Share(number(percent)? / 100.0),
            None => Place::Scalar(number(s)?),
        };
        Ok((place, number(a)?))
    };
    text.split(',').map(knot).collect::<Result<_, String>>().map(Opacity)
}

/// Where samples are taken along rays.
pub fn sampling(text: &str) -> Result<halite::cast::Sampling, String> {
    if text == "voxels" {
        return Ok(halite::cast::Sampling::Voxels);
    }
    let step = text.parse().ok().filter(|step: &f64| *step > 0.0 && step.is_finite());
    step.map(halite::cast::Sampling::Steps).ok_or_else(|| "\"voxels\", or a length above 0".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(range("-1:2.5"), Ok([-1.0, 2.5]));
        assert_eq!(
            (time("2"), time("2.0"), time("-1e3")),
            (Ok(Time::Step(2)), Ok(Time::Value(2.0)), Ok(Time::Value(-1e3)))
        );
        assert!(time("last") == Ok(Time::Last) && time("soon").is_err() && time("nan").is_err());
        assert_eq!(component("2"), Ok(Component::Index(2)));
        assert_eq!(vector("1,-2, 3"), Ok(DVec3::new(1.0, -2.0, 3.0)));
        assert_eq!(background("0,0.5,1"), Ok(Background::Color([0.0, 0.5, 1.0])));
        assert_eq!(opacity("1:0,50%:0.25").unwrap().over([2.0, 4.0]), [(1.0, 0.0), (3.0, 0.25)]);
        for wrong in ["640", "x", "0x4", "-1x4", "640x480x3"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        assert!(gain("nan").is_err() && gain("-1").is_err() && gain("1e60").is_err() && gain("0.5") == Ok(0.5));
        assert_eq!(factors("1,1,50"), Ok(DVec3::new(1.0, 1.0, 50.0)));
        assert!(factors("1,0,1").is_err() && factors("2").is_err() && count("-1").is_err() && name(" ").is_err());
        assert_eq!(color_and_opacity("1,0,0.5"), Ok(([1.0, 0.0, 0.5], None)));
        assert_eq!(color_and_opacity("1,0,0,2"), Ok(([1.0, 0.0, 0.0], Some(2.0))));
        assert!(["1,0", "2,0,0", "1,0,0,-1"].iter().all(|wrong| color_and_opacity(wrong).is_err()));
        assert!(shade("0.1,0.7,0.2,20").is_ok_and(|s| s.power == 20.0 && s.two_sided));
        assert!(shade("0.1,0.7").is_err() && shade("0,-1,0,1").is_err() && not_negative("-0.1").is_err());
        assert!(range("2:1").is_err() && range("nan:1").is_err() && vector("1,2").is_err());
        assert!(background("0,0,255").is_err() && plane("0,0,0,0,0,0").is_err() && positive("0").is_err());
    }
}
