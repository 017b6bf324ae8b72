//! The scenes of `../shared/reference`, whose images another program drew in f64: where that folder is not, the meshes
//! of the other tests stand alone.

#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod common;

use common::{ENGINES, Report, Scene, rounds};
use halite::image::Image;
use halite::mesh::cells::Tetrahedra;
use halite::reference::Reference;
use halite::scene;
use halite::view::View;
use std::path::{Path, PathBuf};

/// What the engines must reach is 5e-4; the twin is better than this.
const BOUND: f64 = 2e-5;

/// The same where a second variable or light has steps and singular places that f32 values blur.
const SHARP: [(&str, f64); 3] = [("bivariate_opacity", 1e-4), ("light_inside90", 1e-4), ("table2d_", 5e-4)];

/// Scenes of work that is not done: curved cells as they are, regular grids.
const LATER: [&str; 5] = ["curved_", "rectilinear_", "regular_", "structured_annulus", "structured_terrain"];

/// Scenes of few cells, in which the reference itself is checked: each a different feature.
const CHECKED: [&str; 18] = [
    "bivariate_oblique",
    "bivariate_sinusoid_direct",
    "coarse_bands",
    "discontinuous",
    "gradient_array",
    "gradient_mixed",
    "gradient_wedges",
    "holes",
    "huge_neighbour",
    "layers_wall",
    "light_position",
    "linear_hexes",
    "linear_polyhedra",
    "linear_pyramids",
    "linear_quadratic",
    "linear_wedges",
    "opacity_one",
    "table2d_smooth",
];

/// The scene files that `check.py` draws too; none if the folder is not there.
fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reference");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: there is no {}", folder.display());
        return vec![];
    };
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("a folder that can be read").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json") && !LATER.iter().any(|l| stem(f).starts_with(l)));
    files.sort();
    assert!(files.len() >= 20, "{} has {} scenes only", folder.display(), files.len());
    files
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// What `file` says to draw; an error if its cells cannot be.
fn open(file: &Path) -> halite::Result<(Scene, View)> {
    let scene = scene::Scene::open(file)?;
    let mesh = halite::io::open(&scene.mesh, &|_| ())?;
    let (field, (view, _)) = (scene.field(&mesh)?, scene.view()?);
    Ok((Scene { tetrahedra: Tetrahedra::new(&mesh)?, mesh, field, transfer: scene.transfer }, view))
}

/// Anything that the generated scenes do not have: files, real meshes, another author's idea of the conventions.
#[test]
fn the_engines_draw_what_the_oracle_drew() {
    let mut report = Report::default();
    for file in files() {
        let name = stem(&file);
        let (scene, view) = open(&file).expect("a scene that can be drawn");
        let truth = Image::open(&file.with_extension("npy")).expect("the truth beside the scene");
        let bound = SHARP.iter().find(|(of, _)| name.starts_with(of)).map_or(BOUND, |sharp| sharp.1);
        // One engine draws all that is not of one variable.
        let engines = if scene.transfer.is_of_one_variable() { ENGINES } else { &ENGINES[..1] };
        for engine in engines {
            report.hold(&format!("{engine:?}, {name}"), &engine.image(&scene, &view), &truth, bound);
        }
    }
    if !files().is_empty() {
        report.finish("scenes");
    }
}

/// A reference that shares the engines' errors would let them pass.
#[test]
fn the_judge_agrees_with_the_oracle() {
    let mut report = Report::default();
    for file in files() {
        let name = stem(&file);
        if !CHECKED.contains(&name.as_str()) {
            continue;
        }
        let (scene, view) = open(&file).expect("a scene that can be drawn");
        let truth = Image::open(&file.with_extension("npy")).expect("the truth beside the scene");
        let reference = Reference::new(&scene.mesh, &scene.tetrahedra, &scene.field, &scene.transfer).expect("a scene");
        let w = view.size()[0];
        // Primes divide no width: all columns come up.
        for (i, expected) in truth.pixels.iter().enumerate().step_by(if rounds(1) > 1 { 17 } else { 67 }) {
            let at = [i as u32 % w, i as u32 / w];
            let got = reference.ray(&view.ray(at[0], at[1]), view.blend());
            let error = got.iter().zip(expected).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
            report.measure(&name, error, 1e-6, || format!("pixel {at:?} is {got:?}, not {expected:?}"));
        }
    }
    if !files().is_empty() {
        report.finish("reference");
    }
}
