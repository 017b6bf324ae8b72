//! Time steps: in one file, and in lists of files.

use super::files::{PLAIN, Piece, array, piece, write};
use super::floats;
use halite::Error;
use halite::io::{Source, Time};
use halite::mesh::{Mesh, Values};
use std::path::Path;

fn source(text: &str) -> halite::Result<Source> {
    Source::from_bytes(Path::new("mesh.vtu"), text.as_bytes())
}

/// Three steps of "s", of which the last is that of the second; "t" is not for the first, "u" for all.
const STEPS: &str = "<VTKFile type='UnstructuredGrid'><UnstructuredGrid TimeValues='0 0.5\n 1'><Piece NumberOfPoints='4' NumberOfCells='1'>
    <PointData><DataArray type='Float32' Name='s' TimeStep='0'>0 1 2 3</DataArray><DataArray type='Float32' Name='s' TimeStep='1 2'>0 2 4 6</DataArray>
    <DataArray type='Float64' Name='t' TimeStep='1'>1 1 1 1</DataArray><DataArray type='Int8' Name='u'>7 7 7 7</DataArray></PointData>
    <Points><DataArray type='Float64' NumberOfComponents='3' TimeStep='0'>0 0 0 1 0 0 0 1 0 0 0 1</DataArray>
    <DataArray type='Float64' NumberOfComponents='3' TimeStep='2'>0 0 0 2 0 0 0 2 0 0 0 2</DataArray></Points>
    <Cells><DataArray type='Int32' Name='connectivity'>0 1 2 3</DataArray><DataArray type='Int32' Name='offsets'>4</DataArray>
    <DataArray type='UInt8' Name='types'>10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";

fn values(mesh: &Mesh, name: &str) -> Option<f64> {
    mesh.point_arrays().iter().find(|a| a.name == name).map(|a| a.values.get(3))
}

#[test]
fn steps_in_one_file() {
    let file = source(STEPS).unwrap();
    assert_eq!(file.times(), [0.0, 0.5, 1.0]);
    for (step, s, t, x) in [(0, 3.0, None, 1.0), (1, 6.0, Some(1.0), 1.0), (2, 6.0, Some(1.0), 2.0)] {
        let mesh = file.read(step, &|_| ()).unwrap();
        assert_eq!((values(&mesh, "s"), values(&mesh, "t"), values(&mesh, "u")), (Some(s), t, Some(7.0)), "{step}");
        assert_eq!((mesh.points()[1].x, mesh.point_arrays().iter().filter(|a| a.name == "s").count()), (x, 1));
    }
    assert!(matches!(file.read(3, &|_| ()), Err(Error::Step { .. })));
    // Without times the steps that arrays name are counted.
    let bare = source(&STEPS.replace(" TimeValues='0 0.5\n 1'", "").replace("'1 2'", "'4 1000000000000'")).unwrap();
    assert_eq!(bare.times(), [0.0, 1.0, 2.0, 4.0, 1e12]);
    assert_eq!(values(&bare.read(4, &|_| ()).unwrap(), "s"), Some(6.0));
    assert!(source(&STEPS.replace("0.5\n", "soon")).err().unwrap().to_string().contains("\"soon\" is not a number"));
    let odd = source(&STEPS.replace("TimeStep='1'", "TimeStep='-1'")).unwrap().read(1, &|_| ()).unwrap();
    assert!(odd.point_attributes().why_left_out("t").unwrap().contains("TimeStep \"-1\""));
}

#[test]
fn steps_are_chosen() {
    let file = source(STEPS).unwrap();
    let step = |time| file.step(time).ok();
    assert_eq!([0, 1, 2].map(|n| step(Time::Step(n))), [Some(0), Some(1), Some(2)]);
    assert_eq!((step(Time::Step(3)), step(Time::Last)), (None, Some(2)));
    assert_eq!([0.0, 0.5, 0.500001, 0.7, 1.0].map(|t| step(Time::Value(t))), [0, 1, 1, 1, 2].map(Some));
    assert_eq!([-0.1, 1.1, f64::NAN].map(|t| step(Time::Value(t))), [None; 3]);
    let error = file.step(Time::Value(7.0)).unwrap_err().to_string();
    assert!(error.contains("mesh.vtu: there is no time 7; it has steps 0 to 2, of times 0 to 1"), "{error}");
    // Whole numbers are times where there are not as many steps.
    let hundreds = source(&STEPS.replace("0 0.5\n 1", "0 100 200")).unwrap();
    assert_eq!((hundreds.step(Time::Step(1)).unwrap(), hundreds.step(Time::Step(200)).unwrap()), (1, 2));
    let plain = String::from_utf8(write(PLAIN, &[piece()])).unwrap();
    let plain = source(&plain).unwrap();
    assert_eq!((plain.times(), plain.step(Time::Step(0)).unwrap(), plain.step(Time::Last).unwrap()), (&[][..], 0, 0));
    assert!(plain.step(Time::Step(1)).unwrap_err().to_string().contains("it has no time steps"));
}

/// A folder with files and a list of them.
fn listed(list: &str, text: &str, files: &[(&str, Vec<u8>)]) -> (tempfile::TempDir, halite::Result<Source>) {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    std::fs::write(folder.path().join(list), text).unwrap();
    let source = Source::open(&folder.path().join(list));
    (folder, source)
}

fn part(t: f32, more: bool) -> Vec<u8> {
    let mut point_data = vec![array("T", 1, Values::F32(vec![t; 10]))];
    if more {
        point_data.push(array("more", 2, Values::I32(vec![3; 20])));
    }
    write(PLAIN, &[Piece { point_data, ..piece() }])
}

#[test]
fn collections() {
    let text = "<?xml version='1.0'?><VTKFile type='Collection' version='0.1'><Collection>
        <DataSet timestep='1' group='' part='0' file='run/a_1.vtu'/><DataSet timestep='0.25' group='solid' part='0' file='run/a_0.vtu'/>
        <DataSet timestep='1' group='' part='1' file='/gone/from/run/b_1.vtu'/><DataSet timestep='1' part='2' file='wall.vtp'/>
        <DataSet timestep='2' file='gone.vtu'/><DataSet timestep='3' file='self.pvd'/></Collection></VTKFile>";
    let files = [
        ("run/a_0.vtu", part(0.0, false)),
        ("run/a_1.vtu", part(1.0, true)),
        ("run/b_1.vtu", part(2.0, false)),
        ("wall.vtp", b"<VTKFile type='PolyData'/>".to_vec()),
    ];
    let (_folder, source) = listed("self.pvd", text, &files);
    let source = source.unwrap();
    assert_eq!(source.times(), [0.25, 1.0, 2.0, 3.0]);
    assert_eq!(source.step(Time::Value(1.0)).unwrap(), 1);
    let first = source.read(0, &|_| ()).unwrap();
    assert_eq!((first.points().len(), first.point_arrays().len()), (10, 1));
    let mesh = source.read(1, &|_| ()).unwrap();
    assert_eq!((mesh.points().len(), mesh.cells().types.len(), mesh.cells().points(2)), (20, 4, &[10, 11, 12, 13][..]));
    let [t, more] = mesh.point_arrays() else { panic!() };
    assert_eq!(t.values, Values::F32([[1.0; 10], [2.0; 10]].concat()));
    let more = floats(&more.values);
    assert!(more.len() == 40 && more[..20].iter().all(|v| *v == 3.0) && more[20..].iter().all(|v| v.is_nan()));
    assert_eq!(floats(&mesh.cell_arrays()[0].values), [-7.0, 1073741824.0, -7.0, 1073741824.0]);
    assert!(matches!(source.read(2, &|_| ()), Err(Error::File { .. })));
    assert!(source.read(3, &|_| ()).unwrap_err().to_string().contains("such a list itself"));
    let (_folder, empty) = listed("a.pvd", "<VTKFile type='Collection'><Collection/></VTKFile>", &[]);
    assert!(empty.err().unwrap().to_string().contains("it lists no file"));
    let series = "{\"file-series-version\": \"1.0\", \"files\": [{\"name\": \"b.vtu\", \"time\": 2}, {\"name\": \"a.vtu\", \"time\": 0.5}]}";
    let (_folder, source) = listed("a.vtu.series", series, &[("a.vtu", part(5.0, false)), ("b.vtu", part(6.0, false))]);
    let source = source.unwrap();
    assert_eq!((source.times(), values(&source.read(1, &|_| ()).unwrap(), "T")), (&[0.5, 2.0][..], Some(6.0)));
}

/// What is wrong with a list is said in its own words.
#[test]
fn broken_series() {
    for (text, part) in [
        ("{\"files\": [", "it is no JSON: line 1, column 11"),
        ("{\n\"files\": [}", "it is no JSON: line 2, column 11"),
        ("{\"file\": []}", "it holds no list \"files\""),
        ("{\"files\": [{\"time\": 1}]}", "it holds no list \"files\""),
        ("{\"files\": [{\"name\": \"a.vtu\", \"time\": \"soon\"}]}", "objects with a \"name\" and a \"time\""),
        ("{\"files\": []}", "it lists no file"),
    ] {
        let error = listed("a.vtu.series", text, &[]).1.err().unwrap().to_string();
        assert!(error.contains(part) && error.contains("a.vtu.series") && !error.contains("expected"), "{error}");
    }
}

/// Parts with and without polyhedra.
#[test]
fn polyhedra_of_several_files() {
    let cell = |kind: u8| {
        let faces = "<DataArray type='Int64' Name='faces'>4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3</DataArray><DataArray type='Int64' Name='faceoffsets'>17</DataArray>";
        let faces = if kind == 42 { faces } else { "" };
        STEPS.replace(
            "<DataArray type='UInt8' Name='types'>10</DataArray>",
            &format!("<DataArray type='UInt8' Name='types'>{kind}</DataArray>{faces}"),
        )
    };
    let list = |names: [&str; 3]| names.map(|name| format!("<DataSet timestep='0' file='{name}'/>")).concat();
    let text =
        format!("<VTKFile type='Collection'><Collection>{}</Collection></VTKFile>", list(["a.vtu", "b.vtu", "a.vtu"]));
    let (_folder, source) =
        listed("a.pvd", &text, &[("a.vtu", cell(42).into_bytes()), ("b.vtu", cell(10).into_bytes())]);
    let mesh = source.unwrap().read(0, &|_| ()).unwrap();
    let polyhedra = mesh.polyhedra().unwrap();
    assert_eq!(mesh.cells().types, [42, 10, 42]);
    assert_eq!([0, 1, 2].map(|c| polyhedra.faces(c).count()), [4, 0, 4]);
    assert_eq!(polyhedra.faces(2).next().unwrap(), [8, 10, 9]);
}
