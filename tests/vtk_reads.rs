//! What Halite reads from a file is what VTK reads, value by value: from files that VTK writes here, and from others
//! where they are at hand. Needs a Python with VTK 9; with HALITE_REQUIRE_VTK=1 it fails where there is none.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr, reason = "tests")]

#[path = "vtk/random.rs"]
mod random;

use glam::DVec3;
use halite::mesh::{Array, Mesh, POLYHEDRON, Values};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Each Python that has a VTK of its own, and where that is.
fn pythons() -> Vec<(PathBuf, String)> {
    let named = std::env::var_os("HALITE_PYTHON").map(PathBuf::from);
    let candidates = named.into_iter().chain(["python3", "/usr/bin/python3"].map(PathBuf::from));
    let mut found: Vec<(PathBuf, String)> = vec![];
    for python in candidates {
        let output = Command::new(&python).args(["-c", "import vtk; print(vtk.__file__)"]).output();
        let Some(output) = output.ok().filter(|o| o.status.success()) else { continue };
        let vtk = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        if found.iter().all(|f| f.1 != vtk) {
            found.push((python, vtk));
        }
    }
    found
}

fn script(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vtk/files.py"));
    command
}

/// Numbers as VTK dumped them.
fn numbers(kind: &str, bytes: &[u8]) -> Vec<f64> {
    macro_rules! read {
        ($($name:literal $T:ident),*) => {
            match kind {
                $($name => bytes.chunks_exact(size_of::<$T>()).map(|b| $T::from_ne_bytes(b.try_into().unwrap()) as f64).collect(),)*
                _ => panic!("a kind \"{kind}\""),
            }
        };
    }
    read!("i1" i8, "u1" u8, "i2" i16, "u2" u16, "i4" i32, "u4" u32, "i8" i64, "u8" u64, "f4" f32, "f8" f64)
}

fn kind(values: &Values) -> &'static str {
    match values {
        Values::I8(_) => "i1",
        Values::U8(_) => "u1",
        Values::I16(_) => "i2",
        Values::U16(_) => "u2",
        Values::I32(_) => "i4",
        Values::U32(_) => "u4",
        Values::I64(_) => "i8",
        Values::U64(_) => "u8",
        Values::F32(_) => "f4",
        Values::F64(_) => "f8",
    }
}

/// VTK's reader of ascii numbers loses the sign of −inf.
fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()) || (a.is_infinite() && b.is_infinite()))
}

/// Points of images are computed, and so may be rounded otherwise.
fn near(a: &[f64], b: &[f64], slack: f64) -> bool {
    same(a, b) || a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= slack * 4e3)
}

fn floats(values: &Values) -> Vec<f64> {
    (0..values.len()).map(|i| values.get(i)).collect()
}

/// What differs between a mesh and a file's part of the dump. Unless `exact`, there may be more arrays: VTK keeps one
/// of those with one name, and of lists of pieces only what the list names.
fn differences(mesh: &Mesh, dump: &[(Vec<String>, Vec<u8>)], exact: bool) -> Vec<String> {
    let mut wrong = vec![];
    let mut check = |what: &str, ok: bool| {
        if !ok {
            wrong.push(what.to_owned());
        }
    };
    let cells = mesh.cells();
    let ids = |bytes: &[u8]| numbers("i8", bytes);
    let mut named = [vec![], vec![]];
    for (i, (words, bytes)) in dump.iter().enumerate() {
        match words[0].as_str() {
            "points" => {
                let ours: Vec<f64> = mesh.points().iter().flat_map(DVec3::to_array).collect();
                check(
                    "points",
                    near(&ours, &numbers(&words[1], bytes), if cells.types.contains(&11) { 1e-15 } else { 0.0 }),
                );
            }
            "types" => check("types", cells.types == *bytes),
            "ends" => {
                check("offsets", same(&cells.offsets[1..].iter().map(|o| *o as f64).collect::<Vec<_>>(), &ids(bytes)));
            }
            "connectivity" => {
                check(
                    "connectivity",
                    same(&cells.connectivity.iter().map(|p| f64::from(*p)).collect::<Vec<_>>(), &ids(bytes)),
                );
            }
            "faces" => {
                let mut stream = vec![];
                for c in (0..cells.len()).filter(|c| cells.types[*c] == POLYHEDRON) {
                    let faces: Vec<&[u32]> = mesh.polyhedra().unwrap().faces(c).collect();
                    stream.push(faces.len() as f64);
                    for face in faces {
                        stream.push(face.len() as f64);
                        stream.extend(face.iter().map(|p| f64::from(*p)));
                    }
                }
                check("faces", same(&stream, &ids(bytes)));
            }
            of @ ("point" | "cell") => {
                let (name, values) = (String::from_utf8_lossy(bytes), &dump[i + 1].1);
                let at_points = of == "point";
                let arrays = if at_points { mesh.point_arrays() } else { mesh.cell_arrays() };
                let fits = |a: &Array| {
                    a.name == name
                        && a.components.to_string() == words[2]
                        && kind(&a.values) == words[1]
                        && same(&floats(&a.values), &numbers(&words[1], values))
                };
                check(&format!("{of} array \"{name}\" ({})", words[1]), arrays.iter().any(fits));
                named[usize::from(at_points)].push(name.into_owned());
            }
            _ => {}
        }
    }
    if exact {
        for (arrays, named) in [(mesh.cell_arrays(), &named[0]), (mesh.point_arrays(), &named[1])] {
            for array in arrays {
                check(&format!("array \"{}\", which VTK does not have", array.name), named.contains(&array.name));
            }
        }
    }
    wrong
}

/// What VTK says of a file: lines of words, each with its bytes.
type Dump = Vec<(Vec<String>, Vec<u8>)>;

/// The dump of each file.
fn dumps(bytes: &[u8]) -> Vec<(PathBuf, Dump)> {
    let mut all: Vec<(PathBuf, Dump)> = vec![];
    let mut at = 0;
    while at < bytes.len() {
        let end = at + bytes[at..].iter().position(|b| *b == b'\n').unwrap();
        let mut words: Vec<String> =
            std::str::from_utf8(&bytes[at..end]).unwrap().split(' ').map(str::to_owned).collect();
        let length: usize = words.pop().unwrap().parse().unwrap();
        let data = bytes[end + 1..end + 1 + length].to_vec();
        at = end + 1 + length;
        if words[0] == "file" {
            all.push((PathBuf::from(String::from_utf8(data).unwrap()), vec![]));
        } else {
            all.last_mut().unwrap().1.push((words, data));
        }
    }
    all
}

const EXTENSIONS: [&str; 9] = ["vtu", "pvtu", "vtk", "vti", "pvti", "vtr", "pvtr", "vts", "pvts"];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| EXTENSIONS.iter().any(|x| e == *x)) {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
fn vtk_reads_the_same() {
    let pythons = pythons();
    if pythons.is_empty() {
        assert!(std::env::var_os("HALITE_REQUIRE_VTK").is_none_or(|v| v != "1"), "there is no Python with VTK");
        eprintln!("skipped: there is no Python with VTK");
    }
    for (python, vtk) in &pythons {
        reads_the_same(python, vtk);
    }
}

fn reads_the_same(python: &Path, vtk: &str) {
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("written");
    std::fs::create_dir(&written).unwrap();
    assert!(script(python).arg("write").arg(&written).status().unwrap().success());
    let mut paths = vec![];
    files(&written, &mut paths);
    assert!(paths.len() > 80, "VTK wrote {} files", paths.len());
    // Large files take Python long.
    let small =
        |path: &PathBuf| path.metadata().is_ok_and(|m| m.len() < if rounds_are_long() { u64::MAX } else { 200_000 });
    let mut others = vec![];
    for shared in ["gen", "real", "writers"] {
        files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/corner").join(shared), &mut others);
    }
    if rounds_are_long() {
        files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/tools"), &mut others);
    }
    paths.extend(others.into_iter().filter(small));
    let dump = folder.path().join("dump");
    assert!(script(python).arg("dump").arg(&dump).args(&paths).status().unwrap().success());
    let (mut wrong, mut equal) = (vec![], 0);
    for (path, dump) in dumps(&std::fs::read(&dump).unwrap()) {
        if dump.iter().any(|(words, _)| words[0] == "error") {
            continue;
        }
        match halite::io::open(&path, &|_| ()) {
            Err(error) if path.starts_with(&written) => wrong.push(error.to_string()),
            Err(error) => eprintln!("refused: {error}"),
            Ok(mesh) => {
                let exact = path.starts_with(&written)
                    && path.extension().is_some_and(|e| !e.to_string_lossy().starts_with('p'));
                let differs = differences(&mesh, &dump, exact);
                equal += usize::from(differs.is_empty());
                if !differs.is_empty() {
                    wrong.push(format!("{}: {}", path.display(), differs.join(", ")));
                }
            }
        }
    }
    eprintln!("{equal} files are read as {vtk} reads them");
    assert!(wrong.is_empty(), "{}: {} of {} differ:\n{}", vtk, wrong.len(), paths.len(), wrong.join("\n"));
}

fn rounds_are_long() -> bool {
    std::env::var("HALITE_LONG").is_ok_and(|v| v == "1")
}
