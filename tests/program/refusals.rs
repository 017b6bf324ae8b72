//! What is refused, in which words; and what becomes of large pictures where there is little memory.

use super::{Place, Ran, SCENE};

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
    place.misused("bench cube.vtu --frames -1", "1..=10000");
    place.misused("render cube.vtu --out x.png --scale 1,0,1", "above 0");
    place.misused("render cube.vtu --out x.png --rgba v --scalars s", "--scalars");
    place.misused("render cube.vtu --out x.png --pair v --rgba v", "--rgba");
    place.misused("render cube.vtu --out x.npy --legend", "--legend");
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
    let (code, err) = limited(4_000_000, "render cube.vtu --out x.png --device cpu --size 64x48");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    // Whatever there is too little of: a picture, or one line.
    for kilobytes in [40_000, 60_000, 90_000, 130_000, 200_000, 300_000] {
        let (code, err) = limited(kilobytes, "render cube.vtu --out y.npy --device cpu --size 256x256 --threads 2");
        assert!(matches!(code, Some(0 | 1 | 127)), "{kilobytes}: {code:?}: {err}");
        assert!(code != Some(1) || err.contains("halite: "), "{kilobytes}: {err}");
    }
}
