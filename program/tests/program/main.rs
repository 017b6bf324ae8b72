//! The program as a user meets it: what it writes, what it says, and how it exits.

#![allow(clippy::unwrap_used, reason = "a test that cannot set up its files has failed")]

mod cycles;
mod look;
mod orders;
mod refusals;
mod second;

use assert_cmd::Command;
use halite::image::Image;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::Stdio;
use tempfile::TempDir;

/// A folder with a small mesh `cube.vtu`, and a scene of it.
struct Place(TempDir);

/// What a run left: exit code, stdout, stderr.
struct Ran(Option<i32>, String, String);

impl Place {
    fn new() -> Self {
        let place = Place(TempDir::new().unwrap());
        place.write("cube.vtu", &cube());
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    /// Runs the program in the folder, with the words of `arguments`.
    fn run(&self, arguments: &str) -> Ran {
        let mut command = Command::new(env!("CARGO_BIN_EXE_halite"));
        command.current_dir(self.0.path()).env_remove("HALITE_DEVICE").args(arguments.split_whitespace());
        let output = command.output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Ran(output.status.code(), text(output.stdout), text(output.stderr))
    }

    /// A run that fails with one line.
    fn fails(&self, arguments: &str, parts: &[&str]) {
        let Ran(code, out, err) = self.run(arguments);
        assert_eq!((code, out.as_str()), (Some(1), ""), "{arguments}: {err}");
        assert!(err.starts_with("halite: ") && err.trim_end().lines().count() == 1, "{arguments}: {err}");
        assert!(parts.iter().all(|p| err.contains(p)), "{arguments}: no {parts:?} in {err}");
        assert!(err.matches("os error").count() <= 1, "{arguments}: {err}");
    }

    /// A run that is not understood.
    fn misused(&self, arguments: &str, part: &str) {
        let Ran(code, _, err) = self.run(arguments);
        assert_eq!(code, Some(2), "{arguments}: {err}");
        assert!(err.contains(part), "{arguments}: no {part} in {err}");
    }

    fn succeeds(&self, arguments: &str) -> String {
        let Ran(code, out, err) = self.run(arguments);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{arguments}");
        out
    }
}

/// Eight hexahedra and a triangle; "s" is x + y + z, "v" points along x, "c" counts cells.
fn cube() -> String {
    let lattice = |n: usize| (0..n * n * n).map(move |i| [i % n, i / n % n, i / n / n]);
    let index = |[i, j, k]: [usize; 3]| i + 3 * (j + 3 * k);
    let (mut points, mut s, mut v, mut cells) = (String::new(), String::new(), String::new(), String::new());
    for [i, j, k] in lattice(3) {
        write!(points, "{i} {j} {k} ").unwrap();
        write!(s, "{} ", i + j + k).unwrap();
        write!(v, "{i} 0 0 ").unwrap();
    }
    for [i, j, k] in lattice(2) {
        for [a, b, c] in [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]] {
            write!(cells, "{} ", index([i + a, j + b, k + c])).unwrap();
        }
    }
    format!(
        r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
        <Piece NumberOfPoints="27" NumberOfCells="9">
        <PointData>
        <DataArray type="Int64" Name="GlobalNodeId" format="ascii">{ids}</DataArray>
        <DataArray type="Float32" Name="v" NumberOfComponents="3" format="ascii">{v}</DataArray>
        <DataArray type="Float64" Name="s" format="ascii">{s}</DataArray></PointData>
        <CellData><DataArray type="Float32" Name="c" format="ascii">1 2 3 4 5 6 7 nan 9</DataArray></CellData>
        <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
        <Cells><DataArray type="Int64" Name="connectivity" format="ascii">{cells} 0 1 3</DataArray>
        <DataArray type="Int64" Name="offsets" format="ascii">8 16 24 32 40 48 56 64 67</DataArray>
        <DataArray type="UInt8" Name="types" format="ascii">12 12 12 12 12 12 12 12 5</DataArray></Cells>
        </Piece></UnstructuredGrid></VTKFile>"#,
        ids = (0..27).map(|i| i.to_string()).collect::<Vec<_>>().join(" "),
    )
}

const SCENE: &str = r#"{"mesh": "cube.vtu", "scalars": {"name": "s", "association": "point"},
    "color": [[0, 1, 0, 0], [6, 0, 0, 1]], "opacity": [[0, 0.1], [6, 1]], "unit_distance": 1,
    "camera": {"position": [1, 1, 12], "focal_point": [1, 1, 1], "view_up": [0, 1, 0], "view_angle": 15},
    "size": [12, 8]}"#;

#[test]
fn usage() {
    let place = Place::new();
    place.misused("", "Usage: halite");
    place.misused("paint", "unrecognized subcommand");
    place.misused("render cube.vtu", "--out");
    place.misused("render cube.vtu --out x.png --colour red", "--colour");
    for size in ["640", "0x10", "axb", "10x"] {
        place.misused(&format!("render cube.vtu --out x.png --size {size}"), "--size");
    }
    place.misused("render cube.vtu --out x.png --engine warp", "traverse");
    place.misused("render cube.vtu --out x.png --integral guess", "polynomial");
    place.misused("render cube.vtu --out x.png --lengths long", "log-normalised");
    place.misused("render cube.vtu --out x.png --coloring log", "--coloring");
    place.misused("render cube.vtu --out x.png --range 1:0", "--range");
    place.misused("render cube.vtu --out x.png --background 1,2", "--background");
    place.misused("render cube.vtu --out x.png --clip 0,0,0,0,0,0", "normal");
    place.misused("render cube.vtu --out x.png --device cpu --integral volume --table 1x1x1", "at least 2");
    place.misused("render cube.vtu --out x.png --integral volume --table 256x256", "256x256x16");
    place.misused("render cube.vtu --out x.png --integral polynomial --degree 9", "--degree");
    place.misused("render cube.vtu --out x.png --engine traverse --fragments linear --dither", "--fragments, --dither");
    place.misused("study cube.vtu --out x.png --gain nan", "--gain");
    place.misused("tables cube.vtu --gain 0", "--gain");
    place.misused("study cube.vtu --out x.png --order none --lengths log", "--order, --lengths");
    place.misused("study cube.vtu --out x.png --engine traverse", "--engine");
    place.misused("study cube.vtu --out x.png --table 64x64", "64x64x16");
    assert!(place.succeeds("--version").starts_with("halite "));
    assert!(place.succeeds("render --help").contains("--unit-distance"));
}

#[test]
fn failures_are_one_line() {
    let place = Place::new();
    place.write("scene.json", SCENE);
    place.write("typo.json", &SCENE.replace("unit_distance", "unit_distanse"));
    place.write("engine.json", &SCENE.replace("\"size\"", "\"engine\": \"warp\", \"size\""));
    place.write("lost.json", &SCENE.replace("cube.vtu", "sub/lost.vtu"));
    place.fails("render none.vtu --out x.png", &["none.vtu"]);
    place.fails("info none.vtu", &["none.vtu"]);
    place.fails("render . --out x.png", &["halite: .: "]);
    for (name, text, part) in [
        ("a.vti", "<VTKFile type='ImageData'/>", "there is no <Piece>"),
        ("a.htg", "<VTKFile type='HyperTreeGrid'/>", "refined"),
        ("a.pvd", "<VTKFile type='Collection'/>", "it lists no file"),
        ("a.vtm", "<VTKFile type='vtkMultiBlockDataSet'/>", "Merge Blocks"),
        ("a.vtkhdf", "\u{7f}HDF", "a VTKHDF file"),
        ("a.ex2", "CDF", "ParaView"),
        ("a.txt", "hello", "neither a VTK XML file"),
        ("empty.vtu", "", "the file is empty"),
    ] {
        place.write(name, text);
        place.fails(&format!("info {name}"), &[name, part]);
        place.fails(&format!("render {name} --out x.png"), &[name, part]);
    }
    place.fails("render none.json --out x.png", &["none.json"]);
    place.fails("render cube.vtu --out x.png --scalars t", &["cube.vtu", "\"t\"", "\"s\"", "\"v\"", "\"c\""]);
    place.fails("render cube.vtu --out x.png --scalars v --component 3", &["component 3"]);
    place.fails("render typo.json --out x.png", &["typo.json", "unit_distanse", "unit_distance"]);
    place.fails("render engine.json --out x.png", &["engine.json", "engine", "warp", "traverse"]);
    for (name, integral, part) in [
        ("name.json", "\"table\"", "polynomial"),
        ("key.json", "{\"form\": \"volume\", \"size\": 3}", "size"),
        ("form.json", "{\"form\": \"round\"}", "round"),
    ] {
        place.write(name, &SCENE.replace("\"size\"", &format!("\"integral\": {integral}, \"size\"")));
        place.fails(&format!("render {name} --out x.png --device cpu"), &[name, "integral", part]);
    }
    place.write("list.json", &SCENE.replace("\"size\"", "\"projection\": [\"linear\"], \"size\""));
    place.fails("render list.json --out x.png --device cpu", &["list.json", "projection", "object"]);
    place.fails("study scene.json --out x.png --blend maximum", &["maximum", "--blend composite"]);
    place.fails("study scene.json --out x.png --blend maximum --integrals", &["maximum"]);
    place.fails("render cube.vtu --out x.png --size 20000x20000", &["20000x20000", "268435456"]);
    place.fails("render lost.json --out x.png", &["lost.vtu"]);
    place.fails("render scene.json --out x.gif", &["x.gif", ".png"]);
    place.fails("render scene.json --out no/x.png", &["no/x.png", "folder"]);
    place.fails("render scene.json --out x.png --stats no/x.json", &["no/x.json", "folder"]);
    place.fails("render cube.vtu --out x.png --colormap bone", &["bone", "viridis", "jet", "_r"]);
    place.fails("render cube.vtu --out x.png --colormap none.json", &["none.json"]);
    place.fails("render cube.vtu --out x.png --opacity 1:0,0:1", &["ascend"]);
    place.fails("render cube.vtu --out x.png --position 1,1,1 --focal-point 1,1,1", &["the same"]);
    place.fails("demo --out no/x.png", &["no/x.png"]);
    assert!(!place.path("x.png").exists());
}

#[test]
fn info_tells_what_is_there() {
    let place = Place::new();
    let told = place.succeeds("info cube.vtu");
    for part in ["9 cells", "27 points", "x  0 to 2", "8  hexahedron", "1  triangle", "no volume", "48  tetrahedra"] {
        assert!(told.contains(part), "no {part} in {told}");
    }
    for part in ["3 x f32", "0 to 6", "1 to 9 (1 NaN)", "48  boundary faces", "1  components", "\"s\" if no other"] {
        assert!(told.contains(part), "no {part} in {told}");
    }
}

/// A tetrahedron, and again a little aside; others turned over, hidden, flat, with two corners at one place, with one
/// that is nowhere.
const ODD: &str = r#"<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="17" NumberOfCells="8">
    <CellData><DataArray type="UInt8" Name="vtkGhostType" format="ascii">0 0 0 1 0 0 0 0</DataArray></CellData>
    <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1
        0.1 0.1 0.1 1.1 0.1 0.1 0.1 1.1 0.1 0.1 0.1 1.1 5 0 0 6 0 0 5 1 0 5 0 1 nan 0 0 6 1 0 9 0 0 9 1 0 9 0 1</DataArray></Points>
    <Cells><DataArray type="Int64" Name="connectivity" format="ascii">
        0 1 2 3 4 5 6 7 8 10 9 11 0 1 2 3 8 9 10 13 14 14 15 16 0 1 2 12 0 1</DataArray>
    <DataArray type="Int64" Name="offsets" format="ascii">4 8 12 16 20 24 28 30</DataArray>
    <DataArray type="UInt8" Name="types" format="ascii">10 10 10 10 10 10 10 3</DataArray></Cells>
    </Piece></UnstructuredGrid></VTKFile>"#;

#[test]
fn info_tells_what_is_odd() {
    let place = Place::new();
    place.write("odd.vtu", ODD);
    let told = place.succeeds("info odd.vtu");
    for part in [
        "1 points are not finite",
        "1  line  not drawn: no volume",
        "5  cells\n",
        "1  cells left out: no volume",
        "1  cells left out: ghosts",
        "1  cells left out: a point is not finite",
        "2  tetrahedra turned inside out",
        "1  tetrahedra with two corners at one place",
        "1  tetrahedra of no volume",
        "boundary faces inside other cells: cells overlap",
        "of memory to render one scalar",
    ] {
        assert!(told.contains(part), "no {part:?} in {told}");
    }
}

#[test]
fn a_reader_that_has_seen_enough() {
    let place = Place::new();
    let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_halite"));
    program.arg("info").arg(place.path("cube.vtu"));
    let mut program = program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(program.stdout.take());
    let output = program.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
}

#[test]
fn a_mesh_alone() {
    let place = Place::new();
    for name in ["x.npy", "x.exr"] {
        assert_eq!(place.succeeds(&format!("render cube.vtu --out {name} --size 40x30")), "");
        let image = Image::open(&place.path(name)).unwrap();
        assert_eq!(image.size, [40, 30]);
        let opacity = |i: u32, j: u32| image.pixels[(j * 40 + i) as usize][3];
        assert!((0.2..0.999).contains(&opacity(20, 15)), "{}", opacity(20, 15));
        assert_eq!(opacity(0, 0), 0.0);
    }
    place.succeeds("render cube.vtu --out x.png --size 40x30 --background none --stats x.json --threads 2");
    let png = image::open(place.path("x.png")).unwrap();
    assert_eq!((png.width(), png.height(), png.color()), (40, 30, image::ColorType::Rgba8));
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(place.path("x.json")).unwrap()).unwrap();
    assert_eq!((&stats["cells"], &stats["tetrahedra"]), (&9.into(), &48.into()), "{stats}");
    for key in
        ["load_ms", "faces_ms", "upload_ms", "first_frame_ms", "frame_ms", "steps", "device_bytes", "retraced_rays"]
    {
        assert!(stats[key].is_number(), "{key}: {stats}");
    }
    assert!(stats["engine"].is_string() && stats["transfer_edit_ms"].is_null());
    for options in ["--scalars v", "--scalars c", "--scalars v --component 0 --blend maximum", "--clip 1,1,1,1,0,0"] {
        place.succeeds(&format!("render cube.vtu --out x.npy --size 20x20 --azimuth -30 {options}"));
    }
}

#[test]
fn a_scene_and_options() {
    let place = Place::new();
    place.write("scene.json", SCENE);
    let image = |options: &str| {
        place.succeeds(&format!("render scene.json --out x.npy {options}"));
        Image::open(&place.path("x.npy")).unwrap()
    };
    let scene = image("");
    assert_eq!(scene.size, [12, 8]);
    // Two units deep, s from 2 to 4: optical depth 2 (0.1 + 0.9 · 3/6).
    let middle = |image: &Image| image.pixels[4 * 12 + 6];
    let wanted = 1.0 - f64::exp(-2.0 * (0.1 + 0.9 * 0.5));
    assert!((f64::from(middle(&scene)[3]) - wanted).abs() < 0.05, "{:?}", middle(&scene));
    assert_eq!(image("--size 6x4").size, [6, 4]);
    assert!(middle(&image("--unit-distance 10"))[3] < 0.2);
    assert_eq!(middle(&image("--opacity 0%:0,100%:0"))[3], 0.0);
    assert_ne!(middle(&image("--colormap grey")), middle(&scene));
    assert_ne!(middle(&image("--range 0:3")), middle(&scene));
    assert!(middle(&image("--clip 1,1,1,0,0,1"))[3] < middle(&scene)[3]);
}

#[test]
fn bench_measures_every_device() {
    let place = Place::new();
    place.write("scene.json", SCENE);
    let table = place.succeeds("bench scene.json --frames 2 --json x.json");
    assert!(table.contains("12x8 pixels, 9 cells, 48 tetrahedra"), "{table}");
    let told: serde_json::Value = serde_json::from_slice(&std::fs::read(place.path("x.json")).unwrap()).unwrap();
    let others = told["runs"].as_array().unwrap();
    if std::env::var("HALITE_REQUIRE_GPU").is_ok_and(|v| v == "1") {
        assert!(!others.is_empty(), "{told}");
    }
    for run in others.iter().chain([&told]) {
        assert!(table.contains(run["adapter"].as_str().unwrap()), "{table}");
        for key in ["load_ms", "faces_ms", "upload_ms", "first_frame_ms", "frame_ms", "transfer_edit_ms", "steps"] {
            assert!(run[key].is_number(), "{key}: {run}");
        }
        assert!(run["steps"].as_u64() > Some(100), "{run}");
    }
    place.succeeds("bench cube.vtu --device cpu --size 8x8 --frames 1");
    place.misused("bench cube.vtu --frames 0", "--frames");
    place.fails("bench none.vtu", &["none.vtu"]);
}

#[test]
fn the_demo_shows_something() {
    let place = Place::new();
    assert_eq!(place.succeeds("demo").trim(), "halite-demo.png");
    let png = image::open(place.path("halite-demo.png")).unwrap().into_rgb8();
    let mut colors: Vec<_> = png.pixels().map(|p| p.0).collect();
    colors.sort_unstable();
    colors.dedup();
    assert!(colors.len() > 1000, "{} colours", colors.len());
}

#[test]
fn variants_of_the_projection_engine() {
    let place = Place::new();
    place.misused("render cube.vtu --out a.png --engine project --fragments round", "round");
    place.misused("render cube.vtu --out a.png --integral volume --table 4", "--table");
    let Ran(code, out, err) =
        place.run("study cube.vtu --table 32x32x8 --out sheet.png --json study.json --frames 1 --size 24x16");
    if code == Some(1) && err.contains("graphics device") && std::env::var_os("HALITE_REQUIRE_GPU").is_none() {
        return;
    }
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.contains("intersected, exact") && out.contains("alpha dithering"), "{out}");
    let study: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("study.json")).unwrap()).unwrap();
    let variants = study["variants"].as_array().unwrap();
    let exact = variants.iter().find(|v| v["variant"] == "intersected, exact").unwrap();
    assert!(variants.len() > 12 && exact["rmse"].as_f64().unwrap() < 1e-2, "{study}");
    // What a scene asks for can be switched off.
    let options = r#""engine": "project", "projection": {"target": "rgba8", "dither": true}, "size""#;
    place.write("dithered.json", &SCENE.replace("\"size\"", options));
    let draw = |options: &str| {
        place.succeeds(&format!("render dithered.json --out a.npy {options}"));
        std::fs::read(place.path("a.npy")).unwrap()
    };
    assert!(draw("") == draw("--dither") && draw("--dither=false") != draw(""));
    let Ran(code, _, err) = place.run("study dithered.json --out sheet.png --frames 1");
    assert!(code == Some(0) && err.contains("projection"), "{err}");
    let Ran(code, out, err) = place.run(
        "study cube.vtu --integrals --table 64x64x32 --out forms.png --json forms.json --frames 1 --size 24x16 \
            --opacity 0:0.01,6:0.05 --unit-distance 1",
    );
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.contains("polynomial, degree 2") && out.contains("plane per cell"), "{out}");
    place.write("bucky.vtu", &cube());
    let Ran(code, out, err) = place.run(
        "study cube.vtu --orders-of-cells --out o.png --json o.json --frames 1 --size 24x16 --also bucky.vtu cube.vtu",
    );
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.contains("MPVONC") && out.contains("XMPVO") && out.contains("0 cycles"), "{out}");
    // A name that the paper has comes with its figures.
    assert!(out.contains("1.12 1.20, 1.06 1.12") && out.matches("cube ").count() == 2, "{out}");
    let study: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("o.json")).unwrap()).unwrap();
    assert_eq!(study["also"].as_array().unwrap().len(), 2);
    let [.., ours] = study["orders"].as_array().unwrap().as_slice() else { panic!("{study}") };
    assert!(ours["inversions"] == 0 && ours["pairs"].as_u64() > Some(0) && ours["max"].as_f64() < Some(1e-4), "{ours}");
    let forms: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("forms.json")).unwrap()).unwrap();
    let forms = forms["forms"].as_array().unwrap();
    let sizes = forms.iter().map(|f| f["table_bytes"].as_u64().unwrap());
    assert!(sizes.max() == Some(64 * 64 * 64 * 8));
    assert!(forms.len() > 30, "{forms:?}");
    // Of a mean opacity of some hundredths; what is published with fewer planes or entries is farther off.
    for form in forms {
        let (name, rmse) = (form["form"].as_str().unwrap(), form["rmse"].as_f64().unwrap());
        let bound = match name.split(" on ").last().unwrap_or(name) {
            name if name.contains("linear alpha") => 8e-4,
            name if name.contains("volume, log") && !name.contains("normalised") => 1.5e-3,
            name if name.contains("one plane") => 3e-4,
            name if name.contains("plane per cell") => 6e-5,
            name if name.contains("cylindrical") => 2e-5,
            name if name.contains("volume") || name.contains("polynomial") => 6e-6,
            _ => 1e-6,
        };
        assert!(rmse <= bound, "{name}: {rmse:.1e}");
    }
    let sheet = std::fs::read(place.path("sheet.png")).unwrap();
    assert!(sheet.len() > 1000 && sheet.starts_with(b"\x89PNG"));
}

/// The options, a scene's object and its defaults say the same.
#[test]
fn integrals_are_chosen() {
    let place = Place::new();
    let form = |scene: &str, options: &str| {
        place.write("scene.json", scene);
        place.succeeds(&format!("render scene.json --out a.npy --device cpu --stats stats.json {options}"));
        let stats = std::fs::read_to_string(place.path("stats.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&stats).unwrap();
        (stats["integral"].as_str().unwrap().to_owned(), stats["table_bytes"].as_u64().unwrap())
    };
    assert_eq!(form(SCENE, ""), ("exact".into(), 0));
    assert_eq!(form(SCENE, "--integral volume --table 16x16x8"), ("volume".into(), 16 * 16 * 16 * 8));
    assert_eq!(form(SCENE, "--integral polynomial --table 32x32 --degree 4"), ("polynomial".into(), 16 * 32 * 32 * 5));
    let cylinder = ("cylindrical".to_owned(), 16 * 16 * 16 * 8);
    assert_eq!(form(SCENE, "--integral cylindrical --table 16x16x8 --planes packed --texels unorm8"), cylinder);
    let own = r#""integral": {"form": "cylindrical", "table": [16, 16, 8], "planes": "one"}, "size""#;
    assert_eq!(form(&SCENE.replace("\"size\"", own), ""), cylinder);
    let named = SCENE.replace("\"size\"", "\"integral\": \"auto\", \"size\"");
    assert_eq!(form(&named, ""), ("exact".into(), 0));
    assert_eq!(form(&named, "--integral exact"), ("exact".into(), 0));
    let own = r#""integral": {"form": "polynomial", "table": [32, 32, 0], "build": "host"}, "size""#;
    assert_eq!(form(&SCENE.replace("\"size\"", own), "--build device"), ("polynomial".into(), 16 * 32 * 32 * 3));
    place.misused("render cube.vtu --out a.png --build there", "there");
}

#[test]
fn tables_are_compared() {
    let place = Place::new();
    place.misused("tables cube.vtu --values 1", "--values");
    place.misused("tables cube.vtu --values 1024", "--values");
    place.misused("tables cube.vtu --values 32 --error 0.1", "--error");
    // No form is left out where the numbers are odd.
    let Ran(_, out, _) = place.run("tables cube.vtu --values 7 --segments 1 --device cpu");
    assert_eq!(out.lines().count(), 44, "{out}");
    let Ran(code, out, err) =
        place.run("tables cube.vtu --values 32 --segments 2000 --out sheet.png --tiles tiles.png --json tables.json");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.contains("log-normalised") && out.contains("cylindrical"), "{out}");
    let tables: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("tables.json")).unwrap()).unwrap();
    let rms = |form: &str, construction: &str| {
        let rows = tables["tables"].as_array().unwrap();
        let row = rows.iter().find(|t| t["form"] == form && t["construction"] == construction);
        row.unwrap()["rms"].as_f64().unwrap()
    };
    for construction in ["f64", "closed"] {
        assert!(rms("volume, log-normalised", construction) < 0.02, "{tables}");
        assert!(rms("polynomial, degree 2", construction) < 0.02, "{tables}");
    }
    // What has a bound keeps it.
    let number = |row: &serde_json::Value, key: &str| row[key].as_f64();
    let bounded: Vec<_> = tables["tables"].as_array().unwrap().iter().filter(|t| !t["bound"].is_null()).collect();
    assert!(bounded.iter().any(|t| t["form"] == "polynomial, degree 4") && bounded.len() > 9, "{tables}");
    assert!(
        bounded.iter().filter(|t| t["construction"] == "closed").all(|t| number(t, "max") <= number(t, "bound")),
        "{tables}"
    );
    assert!(rms("second order, 1 length", "64 steps") < rms("second order, 1 length", "8 steps"), "{tables}");
    assert!(rms("second order, 1 length", "256 steps, 8 bits") < rms("second order, 1 length", "8 steps"), "{tables}");
    assert!(["f64", "closed"].iter().all(|how| rms("second order, degree 2", how) < 0.1), "{tables}");
    assert!(rms("second order, lengths", "f64") < 0.1, "{tables}");
    assert!(rms("polynomial, degree 2", "closed, 16 bits") < rms("linear opacity", "closed"), "{tables}");
    assert!(rms("volume, uniform", "incremental") < 0.05 && rms("volume, log", "sliced") < 0.1, "{tables}");
    for picture in ["sheet.png", "tiles.png"] {
        assert!(std::fs::read(place.path(picture)).unwrap().starts_with(b"\x89PNG"));
    }
}
