//! What the tests of the engines share: the engines, scenes to draw, and a report that shows what differs.

#![allow(dead_code, reason = "each test uses a part")]
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

pub(crate) mod draw;
pub(crate) mod shared;

use halite::field::{Association, Component, Field};
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Array, Mesh};
use halite::reference;
use halite::render::{self, Renderer};
use halite::transfer::TransferFunction;
use halite::view::View;
use std::path::{Path, PathBuf};

/// What draws an image.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Engine {
    /// The traverse engine on the CPU, on so many threads.
    Twin { threads: usize },
    /// The projection engine on the CPU, on so many threads.
    Sweep { threads: usize },
    /// An engine on the device to test: see [`on_device`]. Draws nothing if there is none.
    Device(render::Engine),
    /// The reference itself, for the tests that know the answer without it.
    Reference,
}

/// The engines under test.
pub(crate) const ENGINES: &[Engine] = &[Engine::Twin { threads: 2 }, Engine::Sweep { threads: 2 }];

/// What is drawn, but for the view.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) mesh: Mesh,
    pub(crate) tetrahedra: Tetrahedra,
    pub(crate) field: Field,
    pub(crate) transfer: TransferFunction,
}

impl Scene {
    /// All components of `array`, the only one of `mesh`; `transfer` is told the field, whose range it may need.
    pub(crate) fn new(
        mesh: &Mesh,
        array: Array,
        association: Association,
        transfer: impl FnOnce(&Field) -> TransferFunction,
    ) -> Self {
        let field = Field::from_array(&array, association, Component::All).unwrap();
        let (at_points, at_cells) = match association {
            Association::Point => (vec![array], vec![]),
            Association::Cell => (vec![], vec![array]),
        };
        let mesh = Mesh::new(mesh.points().to_vec(), mesh.cells().clone(), at_points, at_cells).unwrap();
        Scene { tetrahedra: Tetrahedra::new(&mesh).unwrap(), transfer: transfer(&field), mesh, field }
    }

    /// The array that the field was made of.
    pub(crate) fn array(&self) -> &Array {
        self.mesh.point_arrays().iter().chain(self.mesh.cell_arrays()).next().unwrap()
    }
}

impl Engine {
    /// One image for each of `views`; none if there is no device to test.
    pub(crate) fn draw(self, scene: &Scene, views: &[View]) -> Vec<Image> {
        let Scene { mesh, tetrahedra, field, transfer } = scene;
        match self {
            Engine::Twin { threads } => {
                let walk = render::Engine::Traverse;
                let mut renderer = Renderer::with_engine(threads, DeviceChoice::Cpu, walk).unwrap();
                set(&mut renderer, scene);
                views.iter().map(|view| renderer.render(view, &|_| ()).unwrap()).collect()
            }
            Engine::Sweep { threads } => {
                let mut renderer = Renderer::with_engine(threads, DeviceChoice::Cpu, render::Engine::Project).unwrap();
                set(&mut renderer, scene);
                views.iter().map(|view| renderer.render(view, &|_| ()).unwrap()).collect()
            }
            Engine::Device(engine) => {
                let Some(mut renderer) = on_device(engine) else { return vec![] };
                set(&mut renderer, scene);
                views.iter().map(|view| renderer.render(view, &|_| ()).unwrap()).collect()
            }
            Engine::Reference => {
                let draw = |view| reference::render(mesh, tetrahedra, field, transfer, view).unwrap();
                views.iter().map(draw).collect()
            }
        }
    }

    /// One image.
    pub(crate) fn image(self, scene: &Scene, view: &View) -> Image {
        self.draw(scene, std::slice::from_ref(view)).remove(0)
    }
}

/// A renderer with `engine` on `HALITE_TEST_DEVICE`, or the first device. Without any there is none, which is said
/// loudly; with `HALITE_REQUIRE_GPU=1` that is a failure.
pub(crate) fn on_device(engine: render::Engine) -> Option<Renderer> {
    let name = std::env::var("HALITE_TEST_DEVICE").unwrap_or_else(|_| "0".into());
    match Renderer::with_engine(2, DeviceChoice::Named(name), engine) {
        Ok(renderer) => Some(renderer),
        Err(e) if std::env::var("HALITE_REQUIRE_GPU").is_ok_and(|v| v == "1") => panic!("{e}"),
        Err(e) => {
            eprintln!("skipped: there is no device to test: {e}");
            None
        }
    }
}

/// Has `renderer` draw `scene`.
pub(crate) fn set(renderer: &mut Renderer, scene: &Scene) {
    renderer.set_tetrahedra(&scene.mesh, scene.tetrahedra.clone());
    renderer.set_field(&scene.field).unwrap();
    renderer.set_transfer(&scene.transfer);
}

/// Rounds of randomised tests: `normal`, or twenty times as many with HALITE_LONG=1.
pub(crate) fn rounds(normal: usize) -> usize {
    let long = std::env::var("HALITE_LONG").is_ok_and(|v| v == "1");
    if long { 20 * normal } else { normal }
}

/// Holds images to their bounds, and fails once, at the end, with all that missed.
#[derive(Default)]
pub(crate) struct Report {
    cases: usize,
    worst: Option<(f64, String)>,
    failures: Vec<String>,
}

impl Report {
    /// Notes whether `got` is within `bound` of `expected` in every channel of every pixel.
    pub(crate) fn hold(&mut self, case: &str, got: &Image, expected: &Image, bound: f64) {
        let Some(d) = got.compare(expected) else {
            return self.measure(case, f64::INFINITY, bound, || format!("{:?} for {:?}", got.size, expected.size));
        };
        self.measure(case, d.max, bound, || {
            let [i, j] = d.at;
            let at = |image: &Image| image.pixels[(j * image.size[0] + i) as usize];
            let files = write_out(case, got, expected, (0.5 / d.max.max(bound)) as f32);
            format!("pixel ({i}, {j}) is {:?}, not {:?}: see {}", at(got), at(expected), files.display())
        });
    }

    /// Notes whether `error` is at most `bound`; `tell` says more if it is not.
    pub(crate) fn measure(&mut self, case: &str, error: f64, bound: f64, tell: impl FnOnce() -> String) {
        self.cases += 1;
        if self.worst.as_ref().is_none_or(|w| error > w.0) {
            self.worst = Some((error, case.to_owned()));
        }
        // A NaN is no success.
        if !matches!(error.partial_cmp(&bound), Some(o) if o.is_le()) {
            self.failures.push(format!("{case}: {error:.2e} > {bound:.0e}; {}", tell()));
        }
    }

    /// Fails if anything missed its bound, or nothing was held to one.
    #[track_caller]
    pub(crate) fn finish(self, test: &str) {
        let (error, case) = self.worst.expect("a test measures something");
        eprintln!("{test}: {} cases, the worst {error:.2e} ({case})", self.cases);
        let (missed, of) = (self.failures.len(), self.cases);
        assert!(missed == 0, "{missed} of {of} cases missed their bound:\n{}", self.failures.join("\n"));
    }
}

/// Writes both images and their difference times `gain`; returns their path up to the last part of the name.
fn write_out(case: &str, got: &Image, expected: &Image, gain: f32) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/out");
    std::fs::create_dir_all(&folder).unwrap();
    let name: String = case.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let difference = got.difference(expected, gain).unwrap();
    for (what, image) in [("got", got), ("expected", expected), ("difference", &difference)] {
        image.save(&folder.join(format!("{name}.{what}.png")), Backdrop::Color([0.0; 3])).unwrap();
    }
    got.save(&folder.join(format!("{name}.got.npy")), Backdrop::Transparent).unwrap();
    expected.save(&folder.join(format!("{name}.expected.npy")), Backdrop::Transparent).unwrap();
    folder.join(format!("{name}.*"))
}
