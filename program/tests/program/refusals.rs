//! What is refused, in which words; and what becomes of large pictures where there is little memory.

use super::{Place, Ran, SCENE};
use assert_cmd::Command;

/// `-1` is a value of every option that takes one, and is refused as such.
#[test]
fn minus_one_is_a_number() {
    let place = Place::new();
    for (option, part) in [
        ("--unit-distance", "above 0"),
        ("--zoom", "above 0"),
        ("--view-angle", "above 0"),
        ("--parallel-scale", "above 0"),
        ("--size", "width x height"),
        ("--threads", "whole number from 0"),
        ("--component", "index from 0"),
        ("--range", "two numbers"),
        ("--background", "1 numbers, not 3"),
        ("--scale", "1 numbers, not 3"),
        ("--nan-color", "1 numbers"),
        ("--degree", "-1 is not in 1..=8"),
        ("--table", "two or three numbers"),
        ("--opacity", "scalar:opacity"),
        ("--blend", "composite"),
        ("--engine", "traverse"),
        ("--integral", "polynomial"),
    ] {
        place.misused(&format!("render cube.vtu --out x.png {option} -1"), part);
        let Ran(_, _, err) = place.run(&format!("render cube.vtu --out x.png {option} -1"));
        assert!(err.contains("'-1'") && err.contains(option), "{option}: {err}");
        assert!(!err.contains("invalid digit") && !err.contains("expected one of"), "{option}: {err}");
    }
    // Nor are lists that start with it taken for options.
    for (option, part) in [
        ("--size -1x5", "width x height"),
        ("--background -1,0,0", "red, green and blue must be from 0 to 1"),
        ("--nan-color -1,0,0", "red, green and blue must be from 0 to 1"),
        ("--scale -1,1,1", "above 0"),
        ("--scale 1,1,1e40", "1e-30 to 1e30"),
        ("--shade=-1,1,1,1", "0 or more"),
        ("--threads 100000", "4096 threads at most"),
    ] {
        place.misused(&format!("render cube.vtu --out x.png {option}"), part);
    }
    place.misused("bench cube.vtu --frames -1", "1..=10000");
    place.misused("render cube.vtu --out x.png --scale 1,0,1", "above 0");
    place.misused("render cube.vtu --out x.png --rgba v --scalars s", "--scalars");
    place.misused("render cube.vtu --out x.png --pair v --rgba v", "--rgba");
    place.misused("render cube.vtu --out x.npy --legend", "--legend");
    // A grid without cells is no mesh, and there is nothing to draw of it.
    let empty = "<VTKFile type='ImageData'><ImageData WholeExtent='0 -1 0 -1 0 -1'>\
        <Piece Extent='0 -1 0 -1 0 -1'/></ImageData></VTKFile>";
    place.write("empty.vti", empty);
    for options in ["", "--reconstruction 1"] {
        let Ran(code, _, err) = place.run(&format!("render empty.vti --out x.png {options}"));
        assert!(code == Some(1) && err.contains("empty.vti") && err.contains("cell"), "{options}: {err}");
        assert!(!err.contains("this is a mesh"), "{options}: {err}");
    }
    place.fails("render cube.vtu --out x.png --reconstruction 1", &["cube.vtu", "this is a mesh"]);
}

/// What scenes have wrong is said by key, or by line and column, and never in the words of the program's own types.
#[test]
fn scenes_are_spoken_of() {
    let place = Place::new();
    for (i, (from, to, parts)) in [
        (
            "\"size\"",
            "\"integral\": {\"form\": \"volume\", \"table\": [1, 2]}, \"size\"",
            vec!["integral: table: a list of 3"],
        ),
        ("\"size\"", "\"integral\": {\"form\": 3}, \"size\"", vec!["integral: form: one of auto, exact"]),
        ("\"size\"", "\"integral\": {\"degree\": -1}, \"size\"", vec!["integral: degree: a whole number from 0", "-1"]),
        ("\"size\"", "\"integral\": 3, \"size\"", vec!["integral: an object is meant, or the name of a form"]),
        ("\"size\"", "\"projection\": {\"dither\": 1}, \"size\"", vec!["projection: dither: true or false"]),
        (
            "\"size\"",
            "\"projection\": {\"dithering\": true}, \"size\"",
            vec!["projection: there is no key \"dithering\""],
        ),
        (
            "\"size\"",
            "\"blend\": \"add\", \"size\"",
            vec!["blend: \"add\" is not known here; there is composite, maximum"],
        ),
        ("\"size\": [12, 8]", "\"size\": [12, 8,]", vec!["line 4, column", "\",\" with nothing after it"]),
        ("\"name\": \"s\"", "\"name\": \"\\q\"", vec!["line 1, column", "this is no escape"]),
        ("\"name\": \"s\"", "\"name\": \"\\ud800\"", vec!["line 1, column", "half of a character"]),
        ("\"size\": [12, 8]", "\"size\": 12", vec!["size: a list of 2 is meant, and not 12"]),
        ("\"name\": \"s\"", "\"name\": \"\"", vec!["scalars.name: the name is empty"]),
        ("[0, 1, 0, 0]", "[0, 255, 0, 0]", vec!["color[0]: red, green and blue are 0 to 1, and one is 255"]),
        (
            "\"view_angle\": 15",
            "\"projection\": \"parallel\", \"parallel_scale\": -1",
            vec!["camera.parallel_scale: -1"],
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let name = format!("wrong{i}.json");
        assert!(SCENE.contains(from));
        place.write(&name, &SCENE.replace(from, to));
        let parts: Vec<&str> = parts.into_iter().chain([name.as_str()]).collect();
        place.fails(&format!("render {name} --out x.png --device cpu"), &parts);
        let Ran(_, _, err) = place.run(&format!("render {name} --out x.png --device cpu"));
        for strange in ["expected", "f64", "u32", "struct", "variant", "invalid", "?:", "`"] {
            assert!(!err.contains(strange), "{strange}: {err}");
        }
    }
}

/// Where memory is short, the program says so and ends; it never aborts.
#[cfg(target_os = "linux")]
#[test]
fn memory_runs_out_with_a_word() {
    let place = Place::new();
    let limited = |kilobytes: u32, arguments: &str| {
        let program = env!("CARGO_BIN_EXE_halite");
        let mut shell = std::process::Command::new("sh");
        let line = format!("ulimit -v {kilobytes}; exec {program} {arguments}");
        let output =
            shell.arg("-c").arg(line).current_dir(place.path("")).env_remove("HALITE_DEVICE").output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, err) = limited(4_000_000, "render cube.vtu --out x.png --device cpu --size 16384x16384");
    assert!(code == Some(1) && err.starts_with("halite: ") && err.lines().count() == 1, "{code:?}: {err}");
    assert!(err.contains("16384x16384") && err.contains("memory") && err.contains("GB"), "{err}");
    assert!(!place.path("x.png").exists());
    // Grids whose extents nobody can hold.
    let extent = "-2147483648 2147483647 0 0 0 0";
    let grid = |kind: &str, inner: &str| {
        format!(
            "<VTKFile type='{kind}'><{kind} WholeExtent='{extent}'><Piece Extent='{extent}'>{inner}</Piece></{kind}></VTKFile>"
        )
    };
    let axis = |numbers: &str| format!("<DataArray type='Float64' format='ascii'>{numbers}</DataArray>");
    place.write("long.vti", &grid("ImageData", ""));
    place.write("long.vtr", &grid("RectilinearGrid", &format!("<Coordinates>{}</Coordinates>", axis("0 1").repeat(3))));
    place.write("long.vts", &grid("StructuredGrid", &format!("<Points>{}</Points>", axis("0 1 2"))));
    let dimensions = "DATASET STRUCTURED_POINTS\nDIMENSIONS 4294967296 1 1\n";
    place.write("long.vtk", &format!("# vtk DataFile Version 3.0\nlong\nASCII\n{dimensions}"));
    for (file, part) in [
        ("long.vti", "not enough memory for the 4294967296 points"),
        ("long.vtr", "2 numbers, not 4294967296"),
        ("long.vts", "long.vts: "),
        ("long.vtk", "not enough memory for the 4294967296 points"),
    ] {
        let (code, err) = limited(4_000_000, &format!("info {file}"));
        assert!(code == Some(1) && err.starts_with("halite: ") && err.lines().count() == 1, "{code:?}: {err}");
        assert!(err.contains(part), "{err}");
    }
    let (code, err) = limited(4_000_000, "render cube.vtu --out x.png --device cpu --size 64x48");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    // Whatever there is too little of: a picture, or one line.
    for kilobytes in [40_000, 60_000, 90_000, 130_000, 200_000, 300_000] {
        let (code, err) = limited(kilobytes, "render cube.vtu --out y.npy --device cpu --size 256x256 --threads 2");
        assert!(matches!(code, Some(0 | 1 | 127)), "{kilobytes}: {code:?}: {err}");
        assert!(code != Some(1) || err.contains("halite: "), "{kilobytes}: {err}");
    }
}

/// Mesa's selection of devices complains where there is no desktop session, or none that it can find.
#[cfg(target_os = "linux")]
#[test]
fn nothing_is_said_where_no_desktop_is() {
    for folder in [None, Some(""), Some("relative"), Some("/nowhere")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_halite"));
        command.args(["info", "--devices"]).env_remove("HALITE_DEVICE");
        // Cargo's configuration sets this one for tests.
        command.env_remove("NODEVICE_SELECT").env_remove("XDG_RUNTIME_DIR");
        if let Some(folder) = folder {
            command.env("XDG_RUNTIME_DIR", folder);
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{folder:?}");
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "", "{folder:?}");
    }
}
