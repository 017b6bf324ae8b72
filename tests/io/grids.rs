//! Grids that list no cells: image data, rectilinear and structured grids, in XML and in legacy files.

use super::files::{PLAIN, Style, Written, array, styles, write_grid};
use super::floats;
use glam::{DMat3, DVec3};
use halite::grid::Grid;
use halite::io::{DataSet, Source};
use halite::mesh::{Array, Mesh, Values, cells::Tetrahedra};
use halite::{Error, Result};
use std::path::Path;

const EXTENT: &str = "WholeExtent=\"2 5 -1 1 0 4\"";
const SIZE: [usize; 3] = [4, 3, 5];

fn read_set(name: &str, bytes: &[u8]) -> Result<DataSet> {
    Source::from_bytes(Path::new(name), bytes.to_vec())?.read_data_set(0, &|_| ())
}

fn grid(name: &str, bytes: &[u8]) -> Grid {
    match read_set(name, bytes).unwrap() {
        DataSet::Grid(grid) => grid,
        DataSet::Mesh(_) => panic!("{name} is no grid"),
    }
}

fn mesh(name: &str, bytes: &[u8]) -> Mesh {
    match read_set(name, bytes).unwrap() {
        DataSet::Mesh(mesh) => mesh,
        DataSet::Grid(_) => panic!("{name} is no mesh"),
    }
}

fn refused(name: &str, bytes: &[u8]) -> String {
    match read_set(name, bytes) {
        Err(Error::Malformed { what, .. }) => what,
        other => panic!("not refused as malformed: {other:?}"),
    }
}

/// Point (i, j, k) of the whole, with i fastest.
fn indices(size: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [nx, ny, nz] = size;
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

/// A value of each point, which tells which it is.
fn code([i, j, k]: [usize; 3]) -> u16 {
    (i + 10 * j + 100 * k) as u16
}

fn point_data(low: [usize; 3], size: [usize; 3]) -> Vec<Array> {
    let at = |p: [usize; 3]| [0, 1, 2].map(|a| p[a] + low[a]);
    let codes = indices(size).map(|p| code(at(p))).collect();
    let vectors = indices(size).flat_map(|p| at(p).map(|x| x as f64 * 0.5)).collect();
    vec![array("code", 1, Values::U16(codes)), array("v", 3, Values::F64(vectors))]
}

fn cell_data(low: [usize; 3], size: [usize; 3]) -> Vec<Array> {
    let cells = size.map(|n| n - 1);
    let codes = indices(cells).map(|p| i32::from(code([0, 1, 2].map(|a| p[a] + low[a])))).collect();
    vec![array("cell", 1, Values::I32(codes))]
}

/// A piece of the whole from point `low` on.
fn piece(low: [usize; 3], size: [usize; 3], more: Vec<(&'static str, Vec<Array>)>) -> Written {
    let first = [2, -1, 0];
    let ends = [0, 1, 2].map(|a| {
        let start = first[a] + low[a] as i64;
        format!("{start} {}", start + size[a] as i64 - 1)
    });
    let mut sections = vec![("PointData", point_data(low, size)), ("CellData", cell_data(low, size))];
    sections.extend(more);
    (format!("Extent=\"{}\"", ends.join(" ")), sections)
}

const X: [f64; 4] = [-3.0, -2.5, 0.125, 7.0];
const Y: [f64; 3] = [5.0, 4.0, -1.0];
const Z: [f64; 5] = [0.0, 1.0, 1.5, 1.75, 3.0];

fn coordinates(low: [usize; 3], size: [usize; 3]) -> (&'static str, Vec<Array>) {
    let axes = [&X[..], &Y, &Z];
    let axis = |a: usize| array("c", 1, Values::F64(axes[a][low[a]..low[a] + size[a]].to_vec()));
    ("Coordinates", vec![axis(0), axis(1), axis(2)])
}

/// Where a point of a bent grid is.
fn bent([i, j, k]: [usize; 3]) -> DVec3 {
    let angle = 0.2 * i as f64;
    DVec3::new((2.0 + j as f64) * angle.cos(), (2.0 + j as f64) * angle.sin(), 0.5 * k as f64 + 0.1 * i as f64)
}

fn points(low: [usize; 3], size: [usize; 3]) -> (&'static str, Vec<Array>) {
    let all = indices(size).flat_map(|p| bent([0, 1, 2].map(|a| p[a] + low[a])).to_array()).collect();
    ("Points", vec![array("Points", 3, Values::F64(all))])
}

fn written(style: Style, kind: &str, pieces: &[([usize; 3], [usize; 3])]) -> Vec<u8> {
    let more = |low, size| match kind {
        "ImageData" => vec![],
        "RectilinearGrid" => vec![coordinates(low, size)],
        _ => vec![points(low, size)],
    };
    let pieces: Vec<Written> = pieces.iter().map(|&(low, size)| piece(low, size, more(low, size))).collect();
    let attributes = match kind {
        "ImageData" => format!("{EXTENT} Origin=\"10 20 30\" Spacing=\"0.5 2 0.25\" Direction=\"0 -1 0 1 0 0 0 0 1\""),
        _ => EXTENT.to_owned(),
    };
    write_grid(style, kind, &attributes, &pieces)
}

const WHOLE: [([usize; 3], [usize; 3]); 1] = [([0; 3], SIZE)];

/// Files of every kind, for tests that damage them.
pub(crate) fn seeds(style: Style) -> Vec<Vec<u8>> {
    ["ImageData", "RectilinearGrid", "StructuredGrid"].map(|kind| written(style, kind, &PIECES)).to_vec()
}

#[test]
fn every_encoding_of_every_kind() {
    for style in styles() {
        let image = grid("a.vti", &written(style, "ImageData", &WHOLE));
        assert_eq!((image.size(), image.is_regular()), (SIZE, true), "{style:?}");
        assert_eq!(image.point_arrays(), point_data([0; 3], SIZE), "{style:?}");
        assert_eq!(image.cell_arrays(), cell_data([0; 3], SIZE), "{style:?}");
        let uneven = grid("a.vtr", &written(style, "RectilinearGrid", &WHOLE));
        assert_eq!(uneven.axes(), &[X.to_vec(), Y.to_vec(), Z.to_vec()], "{style:?}");
        assert_eq!(uneven.point_arrays(), point_data([0; 3], SIZE), "{style:?}");
        let mesh = mesh("a.vts", &written(style, "StructuredGrid", &WHOLE));
        assert_eq!(mesh.points(), indices(SIZE).map(bent).collect::<Vec<_>>(), "{style:?}");
        assert_eq!(mesh.cell_arrays(), cell_data([0; 3], SIZE), "{style:?}");
    }
}

#[test]
fn images_are_turned_and_start_anywhere() {
    let image = grid("a.vti", &written(PLAIN, "ImageData", &WHOLE));
    // Row by row, the matrix turns x to y and y to −x.
    assert_eq!(image.direction(), DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z));
    for p in indices(SIZE) {
        let [i, j, k] = [0, 1, 2].map(|a| [2.0, -1.0, 0.0][a] + p[a] as f64);
        assert_eq!(image.point(p), DVec3::new(10.0 - 2.0 * j, 20.0 + 0.5 * i, 30.0 + 0.25 * k));
    }
    assert_eq!(image.spacing(), Some(DVec3::new(0.5, 2.0, 0.25)));
    let as_mesh = image.clone().into_mesh().unwrap();
    assert_eq!(as_mesh.points(), indices(SIZE).map(|p| image.point(p)).collect::<Vec<_>>());
    assert_eq!((as_mesh.cells().len(), image.cell_count()), (24, 24));
    assert!(as_mesh.cells().types.iter().all(|t| *t == 11));
    assert_eq!(as_mesh.cells().points(0), [0, 1, 4, 5, 12, 13, 16, 17]);
    assert_eq!(as_mesh.point_arrays(), image.point_arrays());
    assert_eq!(Tetrahedra::new(&as_mesh).unwrap().cells, 24);
}

/// The blocks of a whole that is cut at i = 2 and at k = 1.
const PIECES: [([usize; 3], [usize; 3]); 4] =
    [([2, 0, 1], [2, 3, 4]), ([0, 0, 0], [3, 3, 2]), ([0, 0, 1], [3, 3, 4]), ([2, 0, 0], [2, 3, 2])];

#[test]
fn pieces_become_one() {
    for kind in ["ImageData", "RectilinearGrid", "StructuredGrid"] {
        let [whole, joined] = [&WHOLE[..], &PIECES].map(|p| read_set("a", &written(PLAIN, kind, p)).unwrap());
        assert_eq!(whole, joined, "{kind}");
    }
}

#[test]
fn lists_of_pieces() {
    for (kind, extension) in [("ImageData", "vti"), ("RectilinearGrid", "vtr"), ("StructuredGrid", "vts")] {
        let folder = tempfile::tempdir().unwrap();
        let mut list = format!("<VTKFile type=\"P{kind}\"><P{kind} {EXTENT}>");
        for (n, piece) in PIECES.iter().enumerate() {
            let name = format!("p{n}.{extension}");
            std::fs::write(folder.path().join(&name), written(PLAIN, kind, &[*piece])).unwrap();
            list += &format!("<Piece Source=\"{name}\"/>");
        }
        let path = folder.path().join(format!("a.p{extension}"));
        std::fs::write(&path, list + &format!("</P{kind}></VTKFile>")).unwrap();
        let joined = Source::open(&path).unwrap().read_data_set(0, &|_| ()).unwrap();
        assert_eq!(joined, read_set("a", &written(PLAIN, kind, &WHOLE)).unwrap(), "{kind}");
        // A series of one file is what that is.
        let series = folder.path().join("a.pvd");
        let text =
            format!("<VTKFile type='Collection'><Collection><DataSet file='a.p{extension}'/></Collection></VTKFile>");
        std::fs::write(&series, text).unwrap();
        assert_eq!(Source::open(&series).unwrap().read_data_set(0, &|_| ()).unwrap(), joined, "{kind}");
    }
}

/// A piece that is missing leaves a hole of hidden cells; what two pieces have is taken from that which owns it.
#[test]
fn holes_and_ghosts_of_pieces() {
    let holed = grid("a.vti", &written(PLAIN, "ImageData", &PIECES[..3]));
    assert_eq!(holed.size(), SIZE);
    let ghosts = holed.cell_arrays().iter().find(|a| a.name == "vtkGhostType").unwrap();
    let missing = |p: [usize; 3]| p[0] >= 2 && p[2] == 0;
    let expected: Vec<u8> = indices([3, 2, 4]).map(|p| if missing(p) { 32 } else { 0 }).collect();
    assert_eq!(ghosts.values, Values::U8(expected));
    let split = Tetrahedra::new(&holed.into_mesh().unwrap()).unwrap();
    assert_eq!((split.cells, split.skipped.ghost), (22, 2));

    let overlapping = |ghost: [u8; 2]| {
        let own = |low: usize, value: f32, marks: [u8; 2]| {
            let sections = vec![
                ("PointData", vec![]),
                (
                    "CellData",
                    vec![
                        array("s", 1, Values::F32(vec![value; 2])),
                        array("vtkGhostType", 1, Values::U8(marks.to_vec())),
                    ],
                ),
            ];
            (format!("Extent=\"{low} {} 0 1 0 1\"", low + 2), sections)
        };
        let pieces = [own(0, 1.0, [0, ghost[0]]), own(1, 2.0, [ghost[1], 0])];
        grid("a.vti", &write_grid(PLAIN, "ImageData", "WholeExtent=\"0 3 0 1 0 1\"", &pieces))
    };
    for (ghost, expected, marks) in [
        ([1, 0], [1.0, 2.0, 2.0], [0.0; 3]),
        ([0, 1], [1.0, 1.0, 2.0], [0.0; 3]),
        ([1, 1], [1.0, 1.0, 2.0], [0.0, 1.0, 0.0]),
    ] {
        let joined = overlapping(ghost);
        assert_eq!(floats(&joined.cell_arrays()[0].values), expected);
        assert_eq!(floats(&joined.cell_arrays()[1].values), marks);
    }
}

/// A structured grid is the mesh of its hexahedra.
#[test]
fn structured_grids_are_hexahedra() {
    let mesh = mesh("a.vts", &written(PLAIN, "StructuredGrid", &WHOLE));
    assert!(mesh.cells().types.iter().all(|t| *t == 12));
    let corner = |p: [usize; 3]| (p[0] + SIZE[0] * (p[1] + SIZE[1] * p[2])) as u32;
    for (c, [i, j, k]) in indices([3, 2, 4]).enumerate() {
        let around = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let layer = |k: usize| around.map(|[x, y]| corner([i + x, j + y, k]));
        assert_eq!(mesh.cells().points(c), [layer(k), layer(k + 1)].concat());
    }
    let flat = write_grid(
        PLAIN,
        "StructuredGrid",
        "WholeExtent=\"0 3 0 0 0 4\"",
        &[("Extent=\"0 3 0 0 0 4\"".to_owned(), vec![points([0; 3], [4, 1, 5])])],
    );
    let flat = self::mesh("a.vts", &flat);
    assert_eq!(flat.cells().types, [9; 12]);
    assert_eq!(flat.cells().points(0), [0, 1, 5, 4]);
}

#[test]
fn legacy_grids() {
    let head = |kind: &str| format!("# vtk DataFile Version 3.0\nt\nASCII\nDATASET {kind}\nDIMENSIONS 4 3 5\n");
    let text = |values: &[f64]| values.iter().map(|v| format!("{v} ")).collect::<String>();
    let data = "POINT_DATA 60\nSCALARS code unsigned_short 1\nLOOKUP_TABLE default\n".to_owned()
        + &indices(SIZE).map(|p| format!("{} ", code(p))).collect::<String>()
        + "\nCELL_DATA 24\nFIELD FieldData 1\ncell 1 24 int\n"
        + &indices([3, 2, 4]).map(|p| format!("{} ", code(p))).collect::<String>();
    let image = head("STRUCTURED_POINTS") + "ASPECT_RATIO 0.5 2 0.25\nORIGIN 11 18 30\n" + &data;
    let image = grid("a.vtk", image.as_bytes());
    assert_eq!(image.point([3, 2, 4]), DVec3::new(12.5, 22.0, 31.0));
    let axes = [("X", &X[..]), ("Y", &Y), ("Z", &Z)];
    let axes: String = axes.iter().map(|(a, c)| format!("{a}_COORDINATES {} double\n{}\n", c.len(), text(c))).collect();
    let uneven = grid("a.vtk", (head("RECTILINEAR_GRID") + &axes + &data).as_bytes());
    assert_eq!(uneven.axes(), &[X.to_vec(), Y.to_vec(), Z.to_vec()]);
    let places: Vec<f64> = indices(SIZE).flat_map(|p| bent(p).to_array()).collect();
    let curved = head("STRUCTURED_GRID") + "POINTS 60 double\n" + &text(&places) + "\n" + &data;
    let curved = mesh("a.vtk", curved.as_bytes());
    assert_eq!(curved.points(), indices(SIZE).map(bent).collect::<Vec<_>>());
    for arrays in [image.point_arrays(), uneven.point_arrays(), curved.point_arrays()] {
        assert_eq!(arrays, &point_data([0; 3], SIZE)[..1]);
    }
    for arrays in [image.cell_arrays(), uneven.cell_arrays(), curved.cell_arrays()] {
        assert_eq!(arrays, &cell_data([0; 3], SIZE));
    }
    let binary =
        b"# vtk DataFile Version 5.1\nt\nBINARY\nDATASET STRUCTURED_POINTS\nEXTENT 1 2 0 1 5 5\nSPACING 1 1 2\n\
        ORIGIN 0 0 0\nPOINT_DATA 4\nSCALARS s short\nLOOKUP_TABLE default\n\0\x01\0\x02\x01\0\xff\xff\n";
    let binary = grid("a.vtk", binary);
    assert_eq!((binary.size(), binary.point([0, 0, 0])), ([2, 2, 1], DVec3::new(1.0, 0.0, 10.0)));
    assert_eq!(binary.point_arrays()[0].values, Values::I16(vec![1, 2, 256, -1]));
    assert!(!binary.has_volume());
}

#[test]
fn damaged_grids_are_refused_by_name() {
    let image = String::from_utf8(written(PLAIN, "ImageData", &WHOLE)).unwrap();
    for (from, to, part) in [
        ("Extent=\"2 5", "Extent=\"2 x", "Extent is \"2 x"),
        ("Spacing=\"0.5 2", "Spacing=\"0.5 0", "along y"),
        ("Origin=\"10", "Origin=\"nan", "not finite"),
        ("Direction=\"0 -1", "Direction=\"0 0", "lie in a plane"),
        ("Direction=\"0 -1 0", "Direction=\"0 -1", "Direction is"),
        ("<Piece Extent=\"2 5 -1 1 0 4\"", "<Piece Extent=\"0 2000000000 0 2000000000 0 2000000000\"", "than can be"),
    ] {
        assert!(image.contains(from), "{from}");
        let what = refused("a.vti", image.replace(from, to).as_bytes());
        assert!(what.contains(part), "{part}: {what}");
    }
    let uneven = String::from_utf8(written(PLAIN, "RectilinearGrid", &WHOLE)).unwrap();
    for (from, to, part) in
        [("-2.5", "-3.5", "along x"), ("Coordinates>", "Coordinate>", "are missing"), (" 7\n", "\n", "holds 3")]
    {
        let what = refused("a.vtr", uneven.replace(from, to).as_bytes());
        assert!(what.contains(part), "{part}: {what}");
    }
    let far = written(PLAIN, "ImageData", &[([0; 3], [2, 2, 2]), ([900, 900, 900], [2, 2, 2])]);
    assert!(refused("a.vti", &far).contains("far apart"));
    let legacy = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\n";
    for (rest, part) in [
        ("POINTS 1 float\n0 0 0\n", "DIMENSIONS"),
        ("DIMENSIONS 2 1 1\nPOINTS 1 float\n0 0 0\n", "2 x 1 x 1"),
        ("DIMENSIONS 2 1\n", "number of points"),
        ("DIMENSIONS 1 1 1\nPOINTS 1 float\n0 0 0\nPOINT_DATA 2\n", "2 tuples"),
    ] {
        let what = refused("a.vtk", (legacy.to_owned() + rest).as_bytes());
        assert!(what.contains(part), "{part}: {what}");
    }
    let list = "<VTKFile type='ImageData'><ImageData WholeExtent='0 1 0 1 0 1'><Piece/></ImageData></VTKFile>";
    assert_eq!(grid("a.vti", list.as_bytes()).cell_count(), 1);
}
