//! What to draw and how, by options and a scene, and all that it takes.

use crate::drawn::ms;
use crate::legend::Legend;
use crate::second::Second;
use crate::{camera, input, integral, look, output, parse, progress, variant};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use glam::{DMat4, DVec3};
use halite::cast::{Reconstruction, ReconstructionOrder, Sampling};
use halite::field::{Association, Component, Field, Kind};
use halite::gpu::DeviceChoice;
use halite::grid::Grid;
use halite::integral::options::{Form, IntegrationOptions};
use halite::io::Time;
use halite::mesh::{Mesh, cells::Tetrahedra};
use halite::project::ProjectionOptions;
use halite::render::{Engine, Renderer};
use halite::scene::{Scalars, Scene, automatic, missing};
use halite::transfer::TransferFunction;
use halite::view::{Blend, Camera, ClippingPlane, Cropping, REGIONS};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What to draw, and how.
#[derive(Args, Clone)]
pub struct Request {
    /// The mesh, or the scene that describes it (.json); - is standard input, for either
    #[arg(value_name = "MESH.vtu|SCENE.json|-")]
    pub input: PathBuf,
    /// The time step: its number from 0, a time such as 2.0, or "last" [default: the first]
    #[arg(long, value_name = "STEP|TIME", value_parser = parse::time, allow_hyphen_values = true)]
    pub time: Option<Time>,
    /// Width and height in pixels [default: the scene's, or 1024x768]
    #[arg(long, value_name = "WxH", value_parser = parse::size, allow_hyphen_values = true)]
    pub size: Option<[u32; 2]>,
    /// What stands for the field of a regular or rectilinear grid between samples: itself, parabolas, lines, or rectangles
    /// by the middle, the left or the right sample [default: exact]
    #[arg(long, value_name = "ORDER")]
    reconstruction: Option<ReconstructionOrder>,
    /// Where such samples are: at faces of voxels and midway, or so many world units apart [default: voxels]
    #[arg(long, value_name = "voxels|LENGTH", value_parser = parse::sampling)]
    sampling: Option<Sampling>,
    /// Stretch the mesh, such as 1,1,50 to exaggerate heights; lengths are as they are seen then
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::factors, allow_hyphen_values = true)]
    scale: Option<DVec3>,
    /// What a .png shows behind the volume: R,G,B in 0 to 1, "black", "white", or "none" for transparency
    #[arg(long, value_name = "COLOR", value_parser = parse::background, allow_hyphen_values = true)]
    background: Option<parse::Background>,

    /// The array to draw [default: the first useful one]
    #[arg(long, value_name = "NAME", value_parser = parse::name, help_heading = "Field")]
    scalars: Option<String>,
    /// The array whose first three values are the colour, and whose fourth drives the opacity
    #[arg(long, value_name = "NAME", value_parser = parse::name, help_heading = "Field",
        conflicts_with_all = ["scalars", "component", "colormap", "range", "log", "nan_color"])]
    rgba: Option<String>,
    /// The array whose first value drives the colour, and whose second drives the opacity
    #[arg(long, value_name = "NAME", value_parser = parse::name, help_heading = "Field",
        conflicts_with_all = ["scalars", "component", "rgba", "nan_color"])]
    pair: Option<String>,
    /// Whether it belongs to points or cells [default: points first]
    #[arg(long, help_heading = "Field")]
    association: Option<Of>,
    /// What of a vector: an index from 0, or "magnitude" [default: magnitude]
    #[arg(long, value_name = "N", value_parser = parse::component, help_heading = "Field")]
    component: Option<Component>,

    /// viridis, plasma, inferno, magma, cividis, turbo, twilight, jet, "cool to warm" or grey, each with _r reversed; or a
    /// preset of ParaView: FILE.json, or FILE.json:NAME
    #[arg(long, value_name = "MAP", help_heading = "Look")]
    pub colormap: Option<String>,
    /// The scalars that colours and opacities range over
    #[arg(long, value_name = "LO:HI", value_parser = parse::range, allow_hyphen_values = true, help_heading = "Look")]
    pub range: Option<[f64; 2]>,
    /// Colours and opacities are even over the logarithm of the scalars
    #[arg(long, help_heading = "Look")]
    pub log: bool,
    /// Opacity at scalars, linear between them; a scalar may be a percentage of the range: 0%:0,40%:0.3,100%:1
    #[arg(long, value_name = "S:A,...", value_parser = parse::opacity, allow_hyphen_values = true, help_heading = "Look")]
    pub opacity: Option<automatic::Opacity>,
    /// Draw where values are missing (NaN, infinite) in a colour; an opacity may follow [default: nothing is drawn there]
    #[arg(long, value_name = "R,G,B[,A]", value_parser = parse::color_and_opacity, allow_hyphen_values = true,
        help_heading = "Look")]
    nan_color: Option<([f64; 3], Option<f64>)>,
    /// The length that opacities are meant for, in world units
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive, help_heading = "Look")]
    pub unit_distance: Option<f64>,
    /// Integrate along each ray, or show its largest value
    #[arg(long, help_heading = "Look")]
    blend: Option<Blending>,
    /// Keep what lies on the normal's side of a plane; may be given again
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = parse::plane, allow_hyphen_values = true, help_heading = "Look")]
    clip: Vec<ClippingPlane>,
    /// Draw some of the 27 regions that two planes across each axis make: the one between all of them, unless others are named
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = parse::crop, allow_hyphen_values = true, help_heading = "Look")]
    crop: Option<[[f64; 2]; 3]>,
    /// Which regions: subvolume, fence, inverted-fence, cross, inverted-cross, or bits, x + 3 y + 9 z that of region (x, y, z)
    #[arg(long, value_name = "REGIONS", value_parser = parse::regions, requires = "crop", help_heading = "Look")]
    crop_regions: Option<u32>,

    #[command(flatten)]
    second: Second,
    #[command(flatten)]
    camera: camera::Options,

    /// How frames are drawn: traverse (rays walk from cell to cell), project (cells are sorted and projected), or auto
    #[arg(long, value_name = "ENGINE", value_parser = variant::named::<Engine>, help_heading = "Engine")]
    engine: Option<Engine>,
    /// Where the work is done: auto, cpu, or a device's index, UUID or part of its name; HALITE_DEVICE overrides auto
    #[arg(long, value_name = "DEVICE", help_heading = "Engine")]
    device: Option<String>,
    #[command(flatten)]
    integral: integral::Integral,
    #[command(flatten)]
    variant: variant::Variant,
}

#[derive(Clone, Copy, ValueEnum)]
enum Of {
    Point,
    Cell,
}

#[derive(Clone, Copy, ValueEnum)]
enum Blending {
    Composite,
    Maximum,
}

/// What is the same for all time steps, once the first is known.
#[derive(Default)]
pub struct Steps {
    /// The step that is drawn.
    pub time: Option<Time>,
    /// The range of all.
    pub values: Option<[f64; 2]>,
    /// The array.
    pub scalars: Option<Scalars>,
    /// Colours and opacities, and the view.
    pub look: Option<(TransferFunction, Camera)>,
}

/// Everything that a picture takes, and how long it took to get.
pub struct Job {
    /// What is drawn; of a grid, some of its cells.
    pub mesh: Mesh,
    /// What is drawn in place of the mesh.
    pub grid: Option<Grid>,
    /// Its tetrahedra.
    pub tetrahedra: Tetrahedra,
    /// The array that is drawn.
    pub field: Field,
    /// How, and from where.
    pub scene: Scene,
    /// What a legend tells, where values have colours of a map.
    pub legend: Option<Legend>,
    /// What reading the mesh took.
    pub load_ms: f64,
    /// What splitting it took.
    pub split_ms: f64,
}

/// Reads the mesh that `options` name, or the scene `given` by them, and chooses what neither says.
///
/// # Errors
/// Files that cannot be read, and what does not fit the mesh.
pub fn prepare(options: &Request, given: Option<Scene>) -> Result<Job> {
    prepare_step(options, given, &mut Steps { time: options.time, ..Steps::default() })
}

/// As [`prepare`], of one of several time steps.
pub fn prepare_step(options: &Request, given: Option<Scene>, steps: &mut Steps) -> Result<Job> {
    let mut map = options.colormap.as_deref().map(look::color_map).transpose()?;
    let from_file = given.is_some();
    let start = Instant::now();
    let path = given.as_ref().map_or(options.input.clone(), |scene| scene.mesh.clone());
    let (mut mesh, mut grid) = input::mesh(&path, steps.time)?;
    if grid.is_none() && options.reconstruction.is_some() && !mesh.cells().is_empty() {
        bail!("{}: --reconstruction is for regular and rectilinear grids, and this is a mesh", path.display());
    }
    if let Some(by) = options.scale {
        mesh = mesh.scaled(by).with_context(|| path.display().to_string())?;
        grid = grid.map(|grid| grid.scaled(by)).transpose()?;
    }
    let load_ms = ms(start);
    let start = Instant::now();
    let split = progress::during("splitting", |p| Tetrahedra::with_progress(&mesh, p));
    let mut tetrahedra = split.with_context(|| path.display().to_string())?;
    let split_ms = ms(start);
    tetrahedra.log();

    let solid = given.is_none() && options.has_no_choice(&mesh);
    let of_scene = given.as_ref().and_then(|scene| scene.gradient_array.as_deref());
    let second = options.second.gradient_array.clone().or(of_scene.map(str::to_owned));
    let (scalars, mut field) = if solid {
        tracing::info!("{}: it has no array of points or cells, and is drawn in one colour", path.display());
        let (field, color) = automatic::solid(&mesh)?;
        map.get_or_insert(color);
        (Scalars { name: String::new(), association: None, component: None }, field)
    } else {
        let scalars = match &steps.scalars {
            Some(scalars) => scalars.clone(),
            None => options.scalars(given.as_ref(), &mesh)?,
        };
        steps.scalars = Some(scalars.clone());
        let field = scalars.field_with(&mesh, second.as_deref()).with_context(|| path.display().to_string())?;
        options.check(&field)?;
        (scalars, field)
    };
    // The field of all of a grid is drawn, and that of some of it looked at.
    let whole = match &mut grid {
        Some(grid) if solid => Some(automatic::solid(grid)?.0),
        Some(grid) => Some(scalars.taken_of(grid, second.as_deref()).with_context(|| path.display().to_string())?),
        None => None,
    };
    let mut scene = match given {
        Some(scene) => look::restyled(options, scene, map)?,
        None => {
            let size = options.size.unwrap_or(automatic::SIZE);
            let seen = options.nan_color.is_none().then_some(&field);
            let first = automatic::camera(&mesh, &tetrahedra, seen, size);
            let framed = |camera| automatic::framed(&mesh, &tetrahedra, seen, camera, size);
            let wishes = automatic::Wishes::default()
                .with_range(options.range)
                .with_values(steps.values)
                .with_map(map)
                .with_opacity(options.opacity.clone())
                .with_unit_distance(options.unit_distance)
                .with_logarithmic(options.log)
                .with_blend(options.blend().unwrap_or_default())
                .with_size(Some(size))
                .with_camera(Some(options.camera.framed(first, framed)));
            let mut scene = automatic::scene(&mesh, &tetrahedra, scalars.clone(), &field, wishes)?;
            let look = steps.look.get_or_insert_with(|| (scene.transfer.clone(), scene.camera));
            (scene.transfer, scene.camera) = look.clone();
            scene
        }
    };
    if options.second.is_given() {
        scene.transfer = options.second.apply(scene.transfer, &mesh, &tetrahedra, &field)?;
    }
    scene.size = options.size.unwrap_or(scene.size);
    if from_file {
        scene.camera = options.camera.apply(scene.camera);
    }
    scene.blend = options.blend().unwrap_or(scene.blend);
    scene.clipping_planes.extend(&options.clip);
    if let Some(planes) = options.crop {
        let regions = options.crop_regions.unwrap_or(REGIONS[0].1);
        scene.cropping = Some(Cropping::new(planes, regions, DMat4::IDENTITY)?);
    }
    scene.background = match options.background {
        Some(parse::Background::Color(c)) => Some(c),
        Some(parse::Background::None) => None,
        None if from_file => Some(scene.background.unwrap_or_default()),
        None => scene.background,
    };
    let legend = if solid { None } else { Legend::new(&scalars, &field, &scene.transfer, options.log) };
    if let Some(whole) = whole {
        field = whole;
    }
    if options.nan_color.is_some() && !scene.transfer.is_of_one_variable() {
        bail!("--nan-color: the scene has a second variable or light, of which missing values have none");
    }
    if let (Some(_), Some((color, opacity)), false) = (&grid, options.nan_color, solid) {
        let shown = missing::shown_of_grid(&field, &scene.transfer, scene.blend, color, opacity)?;
        if let Some((value, transfer)) = shown {
            (field, scene.transfer) = (field.with_missing(value), transfer);
        }
    } else if let (Some((color, opacity)), false) = (options.nan_color, solid) {
        let (transfer, blend) = (&scene.transfer, scene.blend);
        let shown = missing::shown(&mesh, &tetrahedra, &scalars, transfer, blend, color, opacity)?;
        if let Some(shown) = shown {
            (field, scene.transfer) = (shown.field, shown.transfer);
            if let Some((own, split)) = shown.mesh {
                (mesh, tetrahedra) = (own, split);
            }
        }
    }
    Ok(Job { mesh, grid, tetrahedra, field, scene, legend, load_ms, split_ms })
}

impl Job {
    /// The job, if it draws a mesh: `command` knows no grids.
    pub fn of_mesh(self, command: &str) -> Result<Self> {
        if self.grid.is_some() {
            bail!("halite {command} is for meshes, and this is a regular or rectilinear grid");
        }
        Ok(self)
    }

    /// What a legend tells.
    ///
    /// # Errors
    /// Where the colours are the array's own, or one.
    pub fn legend(&self) -> Result<Legend> {
        self.legend.clone().context("--legend: the colours here are not those of a colour map over a range of values")
    }
}

impl Request {
    /// The scene that the input is, if it is one.
    pub fn scene(&self) -> Result<Option<Scene>> {
        input::scene(&self.input)
    }

    /// The same of another mesh.
    pub fn of(&self, input: PathBuf) -> Self {
        Request { input, ..self.clone() }
    }

    /// Refuses a picture that there is no memory for, before a mesh is read.
    pub fn check_room(&self, scene: Option<&Scene>) -> Result<()> {
        let [w, h] = self.size.or(scene.map(|s| s.size)).unwrap_or(automatic::SIZE);
        // Beyond this, the view says what is wrong.
        let pixels = u64::from(w) * u64::from(h);
        Ok(halite::memory::check(&format!("a picture of {w}x{h} pixels"), pixels.min(1 << 28) * 16)?)
    }

    /// The device that was asked for.
    pub fn device(&self, scene: Option<&Scene>) -> DeviceChoice {
        let of_scene = || scene.map_or(DeviceChoice::Auto, |s| s.device.clone());
        self.device.as_deref().map_or_else(of_scene, DeviceChoice::parse)
    }

    /// A renderer on `device`, with the engine and the options of projection that were asked for.
    pub fn renderer(&self, threads: usize, scene: Option<&Scene>, device: DeviceChoice) -> Result<Renderer> {
        let engine = self.engine.or(scene.and_then(|s| s.engine)).unwrap_or_default();
        let others = self.variant.given().join(", ");
        if !others.is_empty() && !matches!(engine, Engine::Project) {
            if self.engine.is_some() {
                return Err(output::misuse(format!(
                    "{others}: only the projection engine has this; add --engine project"
                )));
            }
            tracing::warn!(
                "{others}: only the projection engine has this, and another engine draws; add --engine project"
            );
        }
        let mut renderer = Renderer::with_engine(threads, device, engine)?;
        let of_scene = scene.and_then(|s| s.reconstruction).unwrap_or_default();
        let order = self.reconstruction.unwrap_or(of_scene.order);
        let sampling = self.sampling.unwrap_or(of_scene.sampling);
        if order == ReconstructionOrder::Exact && self.sampling.is_some_and(|s| s != Sampling::Voxels) {
            return Err(output::misuse(
                "--sampling: the exact reconstruction takes no samples; --reconstruction 2 does",
            ));
        }
        renderer.set_reconstruction(Reconstruction { order, sampling });
        renderer.set_projection(self.variant.apply(scene.map(|s| s.projection).unwrap_or_default()));
        renderer.set_integral(self.choice(scene)?);
        Ok(renderer)
    }

    /// The form of the integral that was asked for.
    pub fn choice(&self, scene: Option<&Scene>) -> Result<IntegrationOptions> {
        let choice = self.integral.apply(scene.map(|s| s.integral).unwrap_or_default());
        self.integral.check(&choice)?;
        Ok(choice)
    }

    /// What a study of all variants takes of this: the size of tables, if it was said.
    ///
    /// # Errors
    /// Options that a study has no place for, and a scene that is no study's.
    pub fn studied(&self, scene: Option<&Scene>) -> Result<Option<[u32; 3]>> {
        let engine = self.engine.map(|_| "--engine");
        let given: Vec<_> = engine.into_iter().chain(self.variant.given()).chain(self.integral.given()).collect();
        if !given.is_empty() {
            let given = given.join(", ");
            return Err(output::misuse(format!("{given}: study draws all variants, so none can be chosen")));
        }
        let choice = self.integral.apply(scene.map(|s| s.integral).unwrap_or_default());
        self.integral.check(&choice.with_form(Form::Volume))?;
        let left: Vec<_> = scene.map_or(vec![], |s| {
            let said = [
                ("projection", s.projection != ProjectionOptions::default()),
                ("integral", s.integral != IntegrationOptions::default()),
            ];
            said.into_iter().filter_map(|(key, said)| said.then_some(key)).collect()
        });
        if !left.is_empty() {
            let left = left.join(" and ");
            tracing::warn!("study draws all variants, whatever the scene's {left} ask for; tables are of its size");
        }
        if self.blend().or(scene.map(|s| s.blend)) == Some(Blend::Maximum) {
            bail!("a maximum along rays has no variants to compare: --blend composite draws the scene's integral");
        }
        Ok(choice.table)
    }

    /// What was asked for, for messages.
    pub fn name(&self) -> &Path {
        &self.input
    }

    /// Whether no array is asked for, and there is none to choose.
    pub fn has_no_choice(&self, mesh: &Mesh) -> bool {
        let asked = self.scalars.is_some() || self.rgba.is_some() || self.pair.is_some();
        let wanted = asked || self.association.is_some() || self.component.is_some();
        !wanted && mesh.point_arrays().is_empty() && mesh.cell_arrays().is_empty()
    }

    /// Refuses options of two variables and light that the scene has no place for.
    ///
    /// # Errors
    /// Misuse, by the name of the option.
    pub fn check_second(&self, scene: Option<&Scene>) -> Result<()> {
        self.second.check(scene)
    }

    /// Refuses an array that is not what it was asked for as.
    fn check(&self, field: &Field) -> Result<()> {
        for (name, kind, many) in [(&self.rgba, Kind::Rgba, "four"), (&self.pair, Kind::Pair, "two")] {
            if let (Some(name), true) = (name, field.kind() != kind) {
                let n = field.kind().components();
                bail!("{}: array \"{name}\" has {n} components, and not {many}", self.input.display());
            }
        }
        Ok(())
    }

    /// The array that was asked for, or that is useful.
    ///
    /// # Errors
    /// Where there is none.
    pub fn scalars(&self, scene: Option<&Scene>, mesh: &Mesh) -> Result<Scalars> {
        let association = self.association.map(|a| match a {
            Of::Point => Association::Point,
            Of::Cell => Association::Cell,
        });
        let named = self.rgba.as_ref().or(self.pair.as_ref());
        let mut scalars = match (self.scalars.as_ref().or(named), scene) {
            (Some(name), _) => {
                Scalars { name: name.clone(), association: None, component: named.map(|_| Component::All) }
            }
            (None, Some(scene)) => scene.scalars.clone(),
            (None, None) => automatic::scalars(mesh, association).with_context(|| self.input.display().to_string())?,
        };
        scalars.association = association.or(scalars.association);
        scalars.component = self.component.or(scalars.component);
        Ok(scalars)
    }

    fn blend(&self) -> Option<Blend> {
        self.blend.map(|b| match b {
            Blending::Composite => Blend::Composite,
            Blending::Maximum => Blend::Maximum,
        })
    }
}
