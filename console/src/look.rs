//! Colours and opacities that options ask for.

use crate::request::Request;
use anyhow::{Result, bail};
use halite::scene::Scene;
use halite::transfer::Axis;
use halite::transfer::colormap::ColorMap;
use std::path::Path;

/// How far knots may be off on a logarithmic axis; opacities, of the largest.
const TOLERANCE: f64 = 1e-4;

/// A colour map by name, or from `FILE.json` or `FILE.json:NAME`; with `_r` behind the name, reversed.
pub fn color_map(text: &str) -> Result<ColorMap> {
    let (file, preset) = match text.split_once(".json:") {
        Some((stem, preset)) => (format!("{stem}.json"), Some(preset)),
        None => (text.to_owned(), None),
    };
    if !file.ends_with(".json") {
        return Ok(ColorMap::named(text)?);
    }
    let (file, reversed) = (Path::new(&file), preset.and_then(|preset| preset.strip_suffix("_r")));
    match (ColorMap::open(file, preset), reversed) {
        (Err(e), Some(name)) => ColorMap::open(file, Some(name)).map(|map| map.reversed()).map_err(|_| e.into()),
        (map, _) => Ok(map?),
    }
}

/// `scene`, with the transfer function that the options ask for.
pub fn restyled(options: &Request, mut scene: Scene, map: Option<ColorMap>) -> Result<Scene> {
    let old = scene.transfer.with_unit_distance(options.unit_distance.unwrap_or(scene.transfer.unit_distance()))?;
    let asked = [
        ("--colormap", map.is_some()),
        ("--range", options.range.is_some()),
        ("--log", options.log),
        ("--opacity", options.opacity.is_some()),
    ];
    if let (false, Some((option, _))) = (old.has_knots(), asked.iter().find(|(_, asked)| *asked)) {
        bail!("{option}: widgets or a table say colour and opacity here, and there are none over the scalar alone");
    }
    let (first, last) = (old.color()[0].0, old.color()[old.color().len() - 1].0);
    let range = options.range.unwrap_or([first, last]);
    let axis = match &map {
        _ if options.log => Axis::logarithmic(range)?,
        Some(map) => map.axis(range),
        None => Axis::linear(range),
    };
    // A range, or logarithms, move both functions; opacity knots may lie outside the range of the colours.
    let moves = last > first && (options.log || options.range.is_some());
    let place = |s: f64| (s - first) / (last - first);
    let most = |knots: &[(f64, f64)]| TOLERANCE * knots.iter().fold(0.0, |most, k| k.1.max(most));
    let opacity = match (&options.opacity, map.as_ref().and_then(|map| map.opacity_on(&axis))) {
        (Some(o), _) => o.on(&axis, TOLERANCE),
        (None, Some(knots)) => knots,
        (None, None) if moves => {
            let places: Vec<_> = old.opacity().iter().map(|&(s, a)| (place(s), a)).collect();
            axis.knots(&places, most(&places))
        }
        (None, None) => old.opacity().to_vec(),
    };
    let color = match map {
        Some(map) => map.on(&axis),
        None if moves => {
            let places: Vec<_> = old.color().iter().map(|&(s, c)| (place(s), c)).collect();
            axis.knots(&places, TOLERANCE)
        }
        None => old.color().to_vec(),
    };
    scene.transfer = old.with_knots(color, opacity)?;
    Ok(scene)
}
