//! The program's files: time steps, lists, standard input and output, what is drawn when nobody says.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test that cannot set up its files has failed")]

use assert_cmd::Command;
use halite::image::Image;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Runs the program in a folder: exit code, stdout, stderr.
fn run(folder: &Path, arguments: &str, input: &[u8]) -> (Option<i32>, Vec<u8>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_halite"));
    command.current_dir(folder).env("HALITE_DEVICE", "cpu").args(arguments.split_whitespace());
    let output = command.write_stdin(input).output().unwrap();
    (output.status.code(), output.stdout, String::from_utf8(output.stderr).unwrap())
}

fn succeeds(folder: &Path, arguments: &str) -> String {
    let (code, out, err) = run(folder, arguments, b"");
    assert_eq!((code, err.as_str()), (Some(0), ""), "{arguments}");
    String::from_utf8(out).unwrap()
}

/// A hexahedron with two values, each at four of its corners, at each of the steps, all of them times `by`.
fn cube(by: f64, times: &str) -> String {
    let steps = times.split_whitespace().enumerate().map(|(step, _)| {
        let s = [0.0, 0.0, 1.0, 1.0].map(|v: f64| (v * (step + 1) as f64 * by).to_string()).join(" ");
        format!("<DataArray type='Float64' Name='s' TimeStep='{step}'>{s} {s}</DataArray>")
    });
    format!(
        "<VTKFile type='UnstructuredGrid'><UnstructuredGrid TimeValues='{times}'><Piece NumberOfPoints='8' NumberOfCells='1'>
        <PointData>{}</PointData><Points><DataArray type='Float64' NumberOfComponents='3'>
        0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1</DataArray></Points><Cells>
        <DataArray type='Int32' Name='connectivity'>0 1 2 3 4 5 6 7</DataArray><DataArray type='Int32' Name='offsets'>8</DataArray>
        <DataArray type='UInt8' Name='types'>12</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>",
        steps.collect::<String>()
    )
}

#[test]
fn time_steps() {
    let place = TempDir::new().unwrap();
    let folder = place.path();
    std::fs::write(folder.join("a.vtu"), cube(1.0, "0 0.5 1")).unwrap();
    let told = succeeds(folder, "info a.vtu");
    for part in ["time steps", "0  0  described here", "1  0.5\n", "2  1\n", "s  f64       0 to 1\n"] {
        assert!(told.contains(part), "no {part:?} in {told}");
    }
    assert_eq!(told.matches(" f64 ").count(), 1, "one of the three arrays: {told}");
    for (time, range) in [("1", "0 to 2"), ("0.5", "0 to 2"), ("1.0", "0 to 3"), ("last", "0 to 3"), ("2", "0 to 3")] {
        let told = succeeds(folder, &format!("info a.vtu --time {time}"));
        assert!(told.contains(&format!("{range}\n")), "{time}: {told}");
    }
    let (code, _, err) = run(folder, "render a.vtu --out x.png --time 7", b"");
    assert!(code == Some(1) && err.contains("a.vtu: there is no time step 7; it has steps 0 to 2"), "{err}");
    assert_eq!(run(folder, "render a.vtu --out x.png --time soon", b"").0, Some(2));
    assert_eq!(run(folder, "render a.vtu --out x.png --time 1 --all-times", b"").0, Some(2));
    succeeds(folder, "render a.vtu --out x.npy --size 16x12 --all-times --stats x.json");
    let picture = |name: &str| Image::open(&folder.join(name)).unwrap();
    let all = ["x_0000.npy", "x_0001.npy", "x_0002.npy"].map(picture);
    assert!(!folder.join("x.npy").exists() && !folder.join("x_0003.npy").exists());
    // One range of colours for all: each is what it is alone over that range, with the first's opacities.
    assert!(all[0] != all[1] && all[1] != all[2]);
    succeeds(folder, "render a.vtu --out y.npy --size 16x12 --range 0:3");
    assert_eq!(picture("y.npy"), all[0]);
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("x.json")).unwrap()).unwrap();
    assert_eq!(stats.as_array().map(Vec::len), Some(3), "{stats}");
    // A list of files is the same.
    let entry = |time: f64, file: &str| format!("<DataSet timestep='{time}' part='0' file='run/{file}'/>");
    std::fs::create_dir(folder.join("run")).unwrap();
    for (step, by) in [(0, 1.0), (1, 2.0), (2, 3.0)] {
        std::fs::write(folder.join(format!("run/{step}.vtu")), cube(by, "0")).unwrap();
    }
    let list = [entry(0.0, "0.vtu"), entry(0.5, "1.vtu"), entry(1.0, "2.vtu")].concat();
    let list = format!("<VTKFile type='Collection'><Collection>{list}</Collection></VTKFile>");
    std::fs::write(folder.join("a.pvd"), list).unwrap();
    assert!(succeeds(folder, "info a.pvd --time 0.5").contains("1  0.5  described here"));
    succeeds(folder, "render a.pvd --out z.npy --size 16x12 --all-times");
    for (i, image) in all.iter().enumerate() {
        assert_eq!(picture(&format!("z_000{i}.npy")), *image);
    }
}

/// A hexahedron with an array of `components` at each step: `values` of its lower and of its upper face.
fn steps(times: &str, components: usize, values: &[[&str; 2]]) -> String {
    let arrays = values.iter().enumerate().map(|(step, [low, high])| {
        let s = [*low; 4].into_iter().chain([*high; 4]).collect::<Vec<_>>().join(" ");
        format!(
            "<DataArray type='Float64' Name='s' NumberOfComponents='{components}' TimeStep='{step}'>{s}</DataArray>"
        )
    });
    let (before, rest) = ("<PointData>", "</PointData>");
    let cube = cube(1.0, times);
    let (head, tail) = (cube.split(before).next().unwrap_or_default(), cube.split(rest).nth(1).unwrap_or_default());
    format!("{head}{before}{}{rest}{tail}", arrays.collect::<String>())
}

/// What is drawn of all time steps is what is drawn of each, where options leave nothing to choose.
#[test]
fn all_time_steps_with_options_of_the_look() {
    let place = TempDir::new().unwrap();
    let folder = place.path();
    let picture = |name: &str| Image::open(&folder.join(name)).unwrap();
    let check = |mesh: String, options: &str, alone: &str| {
        std::fs::write(folder.join("a.vtu"), mesh).unwrap();
        succeeds(folder, &format!("render a.vtu --out x.npy --size 32x24 --all-times {options}"));
        let all: Vec<Image> = (0..3).map(|step| picture(&format!("x_000{step}.npy"))).collect();
        for (step, image) in all.iter().enumerate() {
            succeeds(folder, &format!("render a.vtu --out y.npy --size 32x24 --time {step} {options} {alone}"));
            assert!(picture("y.npy") == *image, "step {step}: {options}");
            assert!(image.pixels.iter().any(|p| p[3] > 0.2), "step {step} shows something: {options}");
        }
        assert!(all[0] != all[1] && all[1] != all[2], "{options}");
    };
    let times = "0 1 2";
    let look = "--opacity 0%:1,100%:2 --unit-distance 0.5";
    let positive = steps(times, 1, &[["1", "1000"], ["2", "2000"], ["3", "3000"]]);
    check(positive.clone(), &format!("--log {look}"), "--range 1:3000");
    check(positive, &format!("--log --nan-color 1,0,0 {look}"), "--range 1:3000");
    let missing = steps(times, 1, &[["0", "4"], ["nan", "4"], ["1", "3"]]);
    check(missing, &format!("--nan-color 0,1,0,0.5 {look}"), "--range 0:4");
    let colors = steps(times, 4, &[["1 0 0 1", "0 1 0 2"], ["0 1 0 1", "0 0 1 2"], ["0 0 1 2", "1 0 0 1"]]);
    check(colors, "--rgba s --opacity 0:0,2:2 --unit-distance 0.5", "");
    let pairs = steps(times, 2, &[["1 1", "2 2"], ["2 1", "3 2"], ["3 2", "5 1"]]);
    check(pairs, "--pair s --opacity 0:0,2:2 --unit-distance 0.5", "--range 1:5");
    // Values of both signs are told apart by colour, as in one picture: around 0, as far as any step goes.
    let signed = steps(times, 1, &[["-1", "1"], ["-2", "3"], ["-4", "1"]]);
    check(signed, look, "--range -4:4 --colormap coolwarm");
}

/// The logarithm of a value that is 0 in the first step, as that of many simulations is, and of meshes without values.
#[test]
fn all_time_steps_of_nothing() {
    let place = TempDir::new().unwrap();
    let folder = place.path();
    let picture = |name: &str| Image::open(&folder.join(name)).unwrap();
    let zero = steps("0 1 2", 1, &[["0", "0"], ["0", "1"], ["0.5", "2"]]);
    std::fs::write(folder.join("a.vtu"), zero).unwrap();
    succeeds(folder, "render a.vtu --out x.npy --size 32x24 --all-times --log --opacity 0%:0,100%:1");
    let opacities = ["x_0000.npy", "x_0001.npy", "x_0002.npy"]
        .map(|name| picture(name).pixels.iter().map(|p| f64::from(p[3])).sum::<f64>());
    assert!(opacities[0] == 0.0 && opacities[1] > 1.0 && opacities[2] > opacities[1], "{opacities:?}");
    let bare = steps("0", 1, &[]);
    let entry = |step: usize| format!("<DataSet timestep='{step}' file='b.vtu'/>");
    let list = format!("<VTKFile type='Collection'><Collection>{}{}</Collection></VTKFile>", entry(0), entry(1));
    std::fs::write(folder.join("b.vtu"), bare).unwrap();
    std::fs::write(folder.join("b.pvd"), list).unwrap();
    succeeds(folder, "render b.pvd --out x.npy --size 32x24 --all-times");
    succeeds(folder, "render b.vtu --out y.npy --size 32x24");
    assert!(picture("x_0000.npy") == picture("y.npy") && picture("x_0001.npy") == picture("y.npy"));
    // One step is a time, too.
    std::fs::write(folder.join("c.vtu"), cube(1.0, "2.5")).unwrap();
    let told = succeeds(folder, "info c.vtu");
    assert!(told.contains("time steps\n             0  2.5  described here\n"), "{told}");
}

/// A step whose file is missing is left out, and keeps its number; without any there is nothing to draw.
#[test]
fn steps_that_are_missing() {
    let place = TempDir::new().unwrap();
    let folder = place.path();
    for (name, by) in [("0.vtu", 1.0), ("2.vtu", 3.0)] {
        std::fs::write(folder.join(name), cube(by, "0")).unwrap();
    }
    let list = |names: [&str; 3]| {
        let entry = |(step, name): (usize, &&str)| format!("<DataSet timestep='{step}' file='{name}'/>");
        let entries = names.iter().enumerate().map(entry).collect::<String>();
        std::fs::write(
            folder.join("a.pvd"),
            format!("<VTKFile type='Collection'><Collection>{entries}</Collection></VTKFile>"),
        )
        .unwrap();
    };
    list(["0.vtu", "1.vtu", "2.vtu"]);
    let (code, _, err) = run(folder, "render a.pvd --out x.npy --size 16x12 --all-times", b"");
    assert!(code == Some(0) && err.contains("a.pvd: time step 1 is left out") && err.contains("1.vtu"), "{err}");
    assert!(folder.join("x_0000.npy").exists() && !folder.join("x_0001.npy").exists());
    let last = Image::open(&folder.join("x_0002.npy")).unwrap();
    assert!(last.pixels.iter().any(|p| p[3] > 0.2) && last.size == [16, 12]);
    let (code, _, err) = run(folder, "render a.pvd --out y.npy --size 16x12 --time 1", b"");
    assert!(code == Some(1) && err.contains("1.vtu"), "what is asked for must be there: {err}");
    list(["1.vtu", "3.vtu", "4.vtu"]);
    let (code, _, err) = run(folder, "render a.pvd --out z.npy --size 16x12 --all-times", b"");
    assert!(code == Some(1) && err.lines().last().is_some_and(|line| line.starts_with("halite: ")), "{err}");
}

#[test]
fn standard_input_and_output() {
    let place = TempDir::new().unwrap();
    let folder = place.path();
    let mesh = cube(1.0, "0 1");
    std::fs::write(folder.join("a.vtu"), &mesh).unwrap();
    succeeds(folder, "render a.vtu --out x.png --size 16x12");
    let (code, out, err) = run(folder, "render - --out - --size 16x12", mesh.as_bytes());
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out == std::fs::read(folder.join("x.png")).unwrap(), "the same picture");
    let (code, out, _) = run(folder, "render - --out - --format npy --size 16x12 --time 1", mesh.as_bytes());
    assert!(code == Some(0) && out.starts_with(b"\x93NUMPY"));
    let (code, out, err) = run(folder, "info - --time last", mesh.as_bytes());
    let told = String::from_utf8(out).unwrap();
    assert!(code == Some(0) && told.starts_with("standard input: 1 cells, 8 points") && err.is_empty(), "{told}{err}");
    let scene = r#"{"mesh": "a.vtu", "scalars": {"name": "s"}, "color": [[0, 1, 0, 0], [1, 0, 0, 1]],
        "opacity": [[0, 0.1], [1, 1]], "unit_distance": 1, "size": [12, 8],
        "camera": {"position": [1, 1, 12], "focal_point": [1, 1, 1], "view_up": [0, 1, 0], "view_angle": 15}}"#;
    std::fs::write(folder.join("s.json"), scene).unwrap();
    succeeds(folder, "render s.json --out s.npy");
    let (code, out, err) = run(folder, "render - --out - --format npy", scene.as_bytes());
    assert!(code == Some(0) && out == std::fs::read(folder.join("s.npy")).unwrap(), "{err}");
    for (input, part) in [
        ("", "standard input: the file is empty"),
        ("nothing", "standard input: this is neither"),
        ("{}", "standard input: "),
    ] {
        let (code, out, err) = run(folder, "render - --out x.png", input.as_bytes());
        assert!(code == Some(1) && out.is_empty() && err.contains(part), "{err}");
    }
    for misused in ["render - --out - --all-times", "render - --out x.png --format npy"] {
        assert_eq!(run(folder, misused, mesh.as_bytes()).0, Some(2), "{misused}");
    }
}

fn case(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/cases").join(name);
    if path.exists() {
        return path.canonicalize().ok();
    }
    eprintln!("skipped in part: there is no {}", path.display());
    None
}

#[test]
fn cases_of_users() {
    let place = TempDir::new().unwrap();
    let folder = place.path();
    for (name, array, range) in [
        ("k7_active_scalars.vtu", "b", "from -7 to -0"),
        ("k7_ids_before_int_cells.vtu", "temperature", "from 0 to 70"),
        ("k9_array_too_long.vtu", "s", "from 0 to 7"),
        ("k10_three_time_steps.vtu", "s", "from 0 to 7"),
        ("k11_unused_point_value_1000.vtu", "s", "from 0.1 to 3.6"),
    ] {
        let Some(path) = case(name) else { continue };
        let (code, _, log) = run(folder, &format!("render -v {} --out x.png --size 16x12", path.display()), b"");
        assert_eq!(code, Some(0), "{log}");
        for part in [format!("array \"{array}\" of "), format!("drawing \"{array}\" {range}")] {
            assert!(log.contains(&part), "{name}: no {part} in {log}");
        }
        let left_out = log.contains("PointData array \"t2\": it holds 40 numbers, not 27; it is left out");
        assert_eq!(left_out, name.starts_with("k9"), "{log}");
        let told = run(folder, &format!("info {}", path.display()), b"").1;
        let told = String::from_utf8(told).unwrap();
        assert!(told.lines().any(|line| line.contains(&format!("\"{array}\" if no other"))), "{told}");
    }
    if let Some(path) = case("k9_array_too_long.vtu") {
        let (code, _, err) = run(folder, &format!("render {} --out x.png --scalars t2", path.display()), b"");
        assert!(code == Some(1) && err.contains("it holds 40 numbers, not 27"), "{err}");
    }
    if let Some(path) = case("k10_three_time_steps.vtu") {
        let told = succeeds(folder, &format!("info {}", path.display()));
        assert!(["0  0  ", "1  0.5\n", "2  1\n"].iter().all(|part| told.contains(part)), "{told}");
        assert!(succeeds(folder, &format!("info {} --time 0.5", path.display())).contains("0 to 14"));
    }
    if let Some(path) = case("k8_point_data_26_of_27.vtk") {
        let (code, out, err) = run(folder, &format!("info {}", path.display()), b"");
        assert!(code == Some(1) && out.is_empty() && err.lines().count() == 1, "{err}");
        assert!(err.contains("POINT_DATA has 26 tuples where there are 27 points"), "{err}");
    }
}

/// What `examples/` shows draws pictures; cargo builds it with all tests.
#[test]
fn examples_draw() {
    let built = std::env::current_exe().unwrap().ancestors().nth(2).unwrap().join("examples");
    let place = TempDir::new().unwrap();
    let folder = place.path();
    std::fs::write(folder.join("a.vtu"), cube(1.0, "0")).unwrap();
    for (name, arguments) in [("file_to_png", &["a.vtu", "a.png"][..]), ("mesh_from_arrays", &["b.png"])] {
        let program = built.join(name);
        if !program.exists() {
            eprintln!("skipped in part: there is no {}", program.display());
            continue;
        }
        let mut command = Command::new(program);
        let output = command.current_dir(folder).args(arguments).env("HALITE_DEVICE", "cpu").output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let picture = image::open(folder.join(arguments[arguments.len() - 1])).unwrap().into_rgb8();
        let differ = picture.pixels().filter(|p| *p != picture.get_pixel(0, 0)).count();
        assert!(differ > 10_000, "{name}: {differ} pixels show something");
        assert!(!Command::new(built.join(name)).output().unwrap().status.success(), "{name} without arguments");
    }
}
