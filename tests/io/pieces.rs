//! Pieces, lists of files, and the cells that need more than points.

use super::files::{Codec, Mode, PLAIN, Piece, Style, array, ascii, piece, write};
use super::{malformed, read};
use halite::mesh::Values;
use std::fmt::Write as _;
use std::path::PathBuf;

#[test]
fn pieces_become_one_mesh() {
    let empty = Piece {
        points: Values::F32(vec![]),
        connectivity: Values::I32(vec![]),
        offsets: Values::I32(vec![]),
        types: Values::U8(vec![]),
        point_data: vec![],
        cell_data: vec![],
    };
    let mut second = piece();
    second.point_data = vec![
        array("v", 1, Values::F64(vec![0.5; 10])),
        array("T", 1, Values::I8((0..10).collect())),
        array("only here", 1, Values::I8((0..10).collect())),
    ];
    second.cell_data.insert(0, array("id", 1, Values::I32(vec![3, 4])));
    for mode in [Mode::Ascii, Mode::AppendedRaw] {
        let style = Style { mode, ..PLAIN };
        let mesh = read(&write(style, &[empty.clone(), piece(), second.clone(), empty.clone()])).unwrap();
        assert_eq!((mesh.points().len(), mesh.cells().len()), (20, 4));
        assert_eq!(mesh.points()[..10], mesh.points()[10..]);
        assert_eq!(mesh.cells().offsets, [0, 4, 10, 14, 20]);
        assert_eq!(mesh.cells().points(2), [10, 11, 12, 13]);
        let ids = Values::I32(vec![-7, 1 << 30, 3, 4]);
        assert_eq!(mesh.cell_arrays(), [array("id", 1, ids)], "the first of the name; not every piece has a second");
        assert_eq!(mesh.point_arrays().len(), 1, "\"v\" has other components in the second piece");
        let t = &mesh.point_arrays()[0];
        assert!(matches!(t.values, Values::F64(_)), "of two types");
        assert_eq!((t.values.get(1), t.values.get(19)), (0.125, 9.0));
    }
    let nothing = read(&write(PLAIN, &[empty])).unwrap();
    assert_eq!((nothing.points().len(), nothing.cells().len()), (0, 0));
    let mut bad = second;
    bad.connectivity = Values::I8(vec![0, 1, 2, 3, 4, 5, 6, 7, 8, 10]);
    let what = malformed(&write(PLAIN, &[piece(), bad]));
    assert!(what.contains("\"connectivity\" of piece 1: cell 1 names point 10, but there are 10"), "{what}");
}

/// A folder with a list of files, and these.
fn list_of(files: &[(&str, Vec<u8>)]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mut list = String::from("<VTKFile type='PUnstructuredGrid' version='0.1'><PUnstructuredGrid GhostLevel='1'>\n");
    list += "<PPointData><PDataArray type='Float32' Name='T'/></PPointData>";
    list += "<PPoints><PDataArray type='Float64' Name='Points' NumberOfComponents='3'/></PPoints>\n";
    for (name, bytes) in files {
        std::fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
        if !bytes.is_empty() {
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        writeln!(list, "<Piece Source='{name}'/>").unwrap();
    }
    let path = folder.path().join("mesh.pvtu");
    std::fs::write(&path, list + "</PUnstructuredGrid></VTKFile>").unwrap();
    (folder, path)
}

#[test]
fn lists_of_files() {
    let style = Style { mode: Mode::AppendedRaw, block: Some(64), codec: Codec::LZ4, big_endian: true, ..PLAIN };
    let (_folder, path) =
        list_of(&[("a.vtu", write(PLAIN, &[piece()])), ("sub/b & c.vtu", write(style, &[piece(), piece()]))]);
    let mesh = halite::io::open(&path, &|_| ()).unwrap();
    assert_eq!((mesh.points().len(), mesh.cells().len()), (30, 6));
    assert_eq!(mesh.cells().points(4), [20, 21, 22, 23]);
    assert_eq!(mesh.points()[..10], mesh.points()[20..]);
    assert_eq!(mesh.point_arrays().iter().map(|a| &*a.name).collect::<Vec<_>>(), ["T", "v"]);
    let fails = |files: &[(&str, Vec<u8>)], parts: &[&str]| {
        let (_folder, path) = list_of(files);
        let error = halite::io::open(&path, &|_| ()).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    fails(&[("gone.vtu", vec![]), ("sub/gone.vtu", vec![])], &["mesh.pvtu: it lists", "gone.vtu", "cannot be read"]);
    fails(
        &[("a.vtu", b"<VTKFile type='PUnstructuredGrid'><PUnstructuredGrid/></VTKFile>".to_vec())],
        &["a.vtu", "no <Piece>"],
    );
    fails(&[("mesh.pvtu", vec![])], &["which is a list itself"]);
    fails(&[("a.vtu", ascii(&[piece()]).replace(" 4 10\n", " 4 11\n").into_bytes())], &["a.vtu: Cells array"]);
    fails(&[], &["no <Piece>"]);
}

/// Files that are missing are left out; those that were moved are found beside the list.
#[test]
fn missing_and_moved_files() {
    let (folder, path) = list_of(&[("a.vtu", write(PLAIN, &[piece()])), ("gone.vtu", vec![])]);
    assert_eq!(halite::io::open(&path, &|_| ()).unwrap().points().len(), 10);
    std::fs::create_dir_all(folder.path().join("out/parts")).unwrap();
    let there = folder.path().join("out/parts/b.vtu");
    std::fs::write(&there, write(PLAIN, &[piece(), piece()])).unwrap();
    let moved = |source: &str| {
        let list = folder.path().join("out/mesh.pvtu");
        let text = format!(
            "<VTKFile type='PUnstructuredGrid'><PUnstructuredGrid><Piece Source='{source}'/></PUnstructuredGrid></VTKFile>"
        );
        std::fs::write(&list, text).unwrap();
        halite::io::open(&list, &|_| ()).map(|mesh| mesh.points().len()).ok()
    };
    let absolute = there.display().to_string();
    for source in [
        "parts/b.vtu",
        "./parts/b.vtu",
        "parts\\b.vtu",
        &absolute,
        "/home/somebody/run/parts/b.vtu",
        "C:\\Users\\somebody\\run\\parts\\b.vtu",
        "../../elsewhere/parts/b.vtu",
        "old/parts/b.vtu",
    ] {
        assert_eq!(moved(source), Some(20), "{source}");
    }
    assert_eq!(moved("parts/c.vtu"), None);
    std::fs::copy(&there, folder.path().join("out/b.vtu")).unwrap();
    assert_eq!(moved("/home/somebody/elsewhere/b.vtu"), Some(20));
}

/// A pyramid as a polyhedron, a tetrahedron, and another pyramid on the first one's base.
const FACES: [&[&[u32]]; 3] = [
    &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
    &[],
    &[&[0, 1, 2, 3], &[1, 0, 5], &[2, 1, 5], &[3, 2, 5], &[0, 3, 5]],
];

#[test]
fn polyhedra_of_both_layouts() {
    let points = "0 0 0 1 0 0 1 1 0 0 1 0 .5 .5 1 .5 .5 -1";
    let numbers = |list: &[u32]| list.iter().map(|n| format!(" {n}")).collect::<String>();
    let ends = |lengths: Vec<usize>| -> Vec<u32> {
        let mut at = 0;
        lengths
            .iter()
            .map(|n| {
                at += *n as u32;
                at
            })
            .collect()
    };
    let (mut stream, mut stream_ends, mut faces) = (vec![], vec![], vec![]);
    for cell in FACES {
        if cell.is_empty() {
            stream_ends.push(-1);
            continue;
        }
        stream.push(cell.len() as u32);
        for face in cell {
            stream.push(face.len() as u32);
            stream.extend(*face);
            faces.push(*face);
        }
        stream_ends.push(stream.len() as i32);
    }
    let stream_ends: String = stream_ends.iter().map(|n| format!(" {n}")).collect();
    let old = format!(
        "<DataArray type='Int64' Name='faces'>{}</DataArray><DataArray type='Int64' Name='faceoffsets'>{stream_ends}</DataArray>",
        numbers(&stream)
    );
    // The newer layout may list faces in any order, and share them.
    faces.reverse();
    let listed: Vec<u32> = (0..faces.len() as u32).rev().collect();
    let new = format!(
        "<DataArray type='Int32' Name='face_connectivity'>{}</DataArray><DataArray type='Int32' Name='face_offsets'>{}</DataArray>\
         <DataArray type='Int32' Name='polyhedron_to_faces'>{}</DataArray><DataArray type='Int32' Name='polyhedron_offsets'>{}</DataArray>",
        numbers(&faces.concat()),
        numbers(&ends(faces.iter().map(|f| f.len()).collect())),
        numbers(&listed),
        numbers(&ends(FACES.iter().map(|c| c.len()).collect()))
    );
    let file = |layout: &str, pieces: usize| {
        let piece = format!(
            "<Piece NumberOfPoints='6' NumberOfCells='3'><Points><DataArray type='Float64' NumberOfComponents='3'>{points}</DataArray></Points>\
             <Cells><DataArray type='Int64' Name='connectivity'>0 1 2 3 4 0 1 2 4 0 1 2 3 5</DataArray>\
             <DataArray type='Int64' Name='offsets'>5 9 14</DataArray><DataArray type='UInt8' Name='types'>42 10 42</DataArray>{layout}</Cells></Piece>"
        );
        format!(
            "<VTKFile type='UnstructuredGrid'><UnstructuredGrid>{}</UnstructuredGrid></VTKFile>",
            piece.repeat(pieces)
        )
    };
    for layout in [&old, &new] {
        let mesh = read(file(layout, 2).as_bytes()).unwrap();
        let polyhedra = mesh.polyhedra().unwrap();
        for (c, base) in [(0, 0), (1, 0), (2, 0), (3, 6), (4, 6), (5, 6)] {
            let found: Vec<Vec<u32>> = polyhedra.faces(c).map(|f| f.iter().map(|p| p - base).collect()).collect();
            assert_eq!(found, FACES[c % 3], "cell {c}");
        }
    }
    let told = |layout: &str, from: &str, to: &str, expected: &str| {
        assert!(layout.contains(from), "{layout}");
        let what = malformed(file(&layout.replacen(from, to, 1), 1).as_bytes());
        assert!(what.contains(expected), "{what}");
    };
    told(&old, " 5 4 0 3", " 5 4 9 3", "polyhedron 0 names point 9, but there are 6 points");
    told(&old, " 5 4 0 3", " 6 4 0 3", "the faces of polyhedron 0 do not fit its offset");
    told(&old, " 5 4 0 3", " 4294967295 4 0 3", "do not fit its offset");
    told(&old, " 5 4 0 3", " 5 400 0 3", "do not fit its offset");
    told(&old, "-1", "-1 -1", "numbers, not 3");
    told(&new, " 5 5 10", " 5 5 11", "do not fit together");
    told(&new, " 9 8 7", " 99 8 7", "names face 99, but there are 10 faces");
    told(&new, "'polyhedron_offsets'", "'x'", "no arrays that tell their faces");
}

/// Before version 2.1, two upright edges of a Lagrange hexahedron were listed the other way round.
#[test]
fn lagrange_hexahedra_of_old_files() {
    let ids: String = (0..27).map(|i| format!(" {i}")).collect();
    let points = " 0 0 0".repeat(27);
    let text = |version: &str| {
        format!(
            "<VTKFile type='UnstructuredGrid' version='{version}'><UnstructuredGrid><Piece NumberOfPoints='27' NumberOfCells='1'><Points>\
         <DataArray type='Float32' NumberOfComponents='3'>{points}</DataArray></Points><Cells><DataArray type='Int32' Name='connectivity'>{ids}</DataArray>\
         <DataArray type='Int32' Name='offsets'>27</DataArray><DataArray type='UInt8' Name='types'>72</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let edges = |version| read(text(version).as_bytes()).unwrap().cells().connectivity[16..21].to_vec();
    assert_eq!(edges("2.2"), [16, 17, 18, 19, 20]);
    assert_eq!(edges("0.1"), [16, 17, 19, 18, 20]);
}
