//! The reader of mesh files: what writers write is read as it was meant, what is damaged is refused by name.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "common/files.rs"]
mod files;

use files::{Codec, LEGACY, Mode, PLAIN, Piece, Random, Style, array, ascii, mutated, piece, styles, write};
use halite::mesh::{Mesh, Values};
use halite::{Error, Result};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Reads bytes as if they were a file of that name, and checks what `progress` is told.
fn read_as(name: &str, bytes: &[u8]) -> Result<Mesh> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let last = Mutex::new(0.0);
    let mesh = halite::io::open(&path, &|share| {
        let mut last = last.lock().unwrap();
        assert!(share >= *last && share <= 1.0, "the share went from {last} to {share}");
        *last = share;
    });
    assert!(mesh.is_err() || *last.lock().unwrap() == 1.0);
    mesh
}

fn read(bytes: &[u8]) -> Result<Mesh> {
    read_as("mesh.vtu", bytes)
}

/// The message of a damaged file, which must be of the right kind and name the file.
fn malformed(bytes: &[u8]) -> String {
    match read(bytes) {
        Err(Error::Malformed { path, what }) if path.ends_with("mesh.vtu") => what,
        other => panic!("not refused as malformed: {other:?}"),
    }
}

fn floats(values: &Values) -> Vec<f64> {
    (0..values.len()).map(|i| values.get(i)).collect()
}

fn coordinates(mesh: &Mesh) -> Vec<f64> {
    mesh.points().iter().flat_map(glam::DVec3::to_array).collect()
}

fn assert_holds(mesh: &Mesh, piece: &Piece, what: impl std::fmt::Debug) {
    assert_eq!(coordinates(mesh), floats(&piece.points), "{what:?}");
    assert_eq!(mesh.cells().types, [10, 13], "{what:?}");
    assert_eq!(mesh.cells().offsets, [0, 4, 10], "{what:?}");
    assert_eq!(mesh.cells().connectivity, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], "{what:?}");
    assert_eq!(mesh.point_arrays(), piece.point_data, "{what:?}");
    assert_eq!(mesh.cell_arrays(), piece.cell_data, "{what:?}");
}

#[test]
fn every_encoding() {
    for style in styles() {
        assert_holds(&read(&write(style, &[piece()])).unwrap(), &piece(), style);
    }
}

/// vtkio cannot read raw appended data, base64 in parts and blocks that cut numbers, and drops arrays whose last block is full. It
/// must find in the other files what Halite finds.
#[test]
fn vtkio_agrees() {
    use vtkio::model::{Attribute, DataSet, Piece::Inline, VertexNumbers};
    let read_by_both = |s: &Style| s.mode != Mode::AppendedRaw && s.block.map_or(s.together, |block| block == 1 << 15);
    for style in styles().into_iter().filter(read_by_both) {
        let bytes = write(style, &[piece()]);
        let mesh = read(&bytes).unwrap();
        let DataSet::UnstructuredGrid { pieces, .. } = vtkio::Vtk::parse_xml(&bytes[..]).unwrap().data else {
            panic!()
        };
        let Inline(other) = &pieces[0] else { panic!() };
        assert_eq!(other.points.cast_into::<f64>().unwrap(), coordinates(&mesh), "{style:?}");
        let VertexNumbers::XML { connectivity, offsets } = other.cells.cell_verts.clone() else { panic!() };
        assert_eq!(offsets, mesh.cells().offsets[1..], "{style:?}");
        assert_eq!(
            connectivity,
            mesh.cells().connectivity.iter().map(|p| u64::from(*p)).collect::<Vec<_>>(),
            "{style:?}"
        );
        for (theirs, ours) in [(&other.data.point, mesh.point_arrays()), (&other.data.cell, mesh.cell_arrays())] {
            assert_eq!(theirs.len(), ours.len(), "{style:?}");
            for (theirs, ours) in theirs.iter().zip(ours) {
                let Attribute::DataArray(theirs) = theirs else { panic!() };
                assert_eq!(theirs.name, ours.name);
                assert_eq!(theirs.data.cast_into::<f64>().unwrap(), floats(&ours.values), "{style:?}");
            }
        }
    }
}

#[test]
fn every_number_type() {
    let data = |n: usize| {
        vec![
            array("i8", 1, Values::I8([i8::MIN, -1, 0, i8::MAX].repeat(3)[..n].to_vec())),
            array("u8", 1, Values::U8([u8::MIN, 1, 2, u8::MAX].repeat(3)[..n].to_vec())),
            array("i16", 1, Values::I16([i16::MIN, -1, 0, i16::MAX].repeat(3)[..n].to_vec())),
            array("u16", 1, Values::U16([u16::MIN, 1, 2, u16::MAX].repeat(3)[..n].to_vec())),
            array("i32", 1, Values::I32([i32::MIN, -1, 0, i32::MAX].repeat(3)[..n].to_vec())),
            array("u32", 1, Values::U32([u32::MIN, 1, 2, u32::MAX].repeat(3)[..n].to_vec())),
            array("i64", 1, Values::I64([i64::MIN, -1, 0, i64::MAX].repeat(3)[..n].to_vec())),
            array("u64", 1, Values::U64([u64::MIN, 1, 2, u64::MAX].repeat(3)[..n].to_vec())),
            array("f32", 1, Values::F32([f32::MIN, -0.1, f32::MIN_POSITIVE, f32::INFINITY].repeat(3)[..n].to_vec())),
            array("f64", 1, Values::F64([f64::MIN, -0.1, 5e-324, f64::NEG_INFINITY].repeat(3)[..n].to_vec())),
        ]
    };
    let piece = Piece { point_data: data(10), cell_data: data(2), ..piece() };
    for style in styles() {
        assert_holds(&read(&write(style, std::slice::from_ref(&piece))).unwrap(), &piece, style);
    }
}

#[test]
fn cells_of_every_integer_type() {
    let whole = |values: &[u8]| {
        [
            Values::I8(values.iter().map(|v| *v as i8).collect()),
            Values::U8(values.to_vec()),
            Values::I16(values.iter().map(|v| i16::from(*v)).collect()),
            Values::U16(values.iter().map(|v| u16::from(*v)).collect()),
            Values::I32(values.iter().map(|v| i32::from(*v)).collect()),
            Values::U32(values.iter().map(|v| u32::from(*v)).collect()),
            Values::I64(values.iter().map(|v| i64::from(*v)).collect()),
            Values::U64(values.iter().map(|v| u64::from(*v)).collect()),
        ]
    };
    let connectivity = whole(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    for ((connectivity, offsets), types) in connectivity.into_iter().zip(whole(&[4, 10])).zip(whole(&[10, 13])) {
        let piece = Piece { connectivity, offsets, types, ..piece() };
        for mode in [Mode::Ascii, Mode::AppendedRaw] {
            let bytes = write(Style { mode, ..PLAIN }, std::slice::from_ref(&piece));
            assert_holds(&read(&bytes).unwrap(), &piece, mode);
        }
    }
}

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
    fails(
        &[("a.vtu", write(PLAIN, &[piece()])), ("gone.vtu", vec![])],
        &["mesh.pvtu: it lists", "gone.vtu", "cannot be read"],
    );
    fails(
        &[("a.vtu", b"<VTKFile type='PUnstructuredGrid'><PUnstructuredGrid/></VTKFile>".to_vec())],
        &["a.vtu", "no <Piece>"],
    );
    fails(&[("mesh.pvtu", vec![])], &["which is a list itself"]);
    fails(&[("a.vtu", ascii(&[piece()]).replace(" 4 10\n", " 4 11\n").into_bytes())], &["a.vtu: Cells array"]);
    fails(&[], &["no <Piece>"]);
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

#[test]
fn spellings_of_xml() {
    let text = ascii(&[piece()]);
    let same = |text: &str| assert_holds(&read(text.as_bytes()).unwrap(), &piece(), text);
    same(&text.replace('"', "'"));
    same(&text.replace("<?xml version=\"1.0\"?>\n", ""));
    same(&format!("\u{feff}{}", text.replace('\n', "\r\n")));
    same(&text.replace("<VTKFile", "<!-- <VTKFile> -->\n<VTKFile").replace("<Points>", "<!-- a > b & c --><Points>"));
    same(&text.replace(" byte_order=\"LittleEndian\" header_type=\"UInt32\"", ""));
    same(&text.replace("<Piece", "<FieldData><DataArray type='Float128' Name='x'>a & b</DataArray></FieldData><Piece"));
    same(&text.replace("<CellData>", "<CellData><DataArray type='String' Name='s' format='ascii'>65 0</DataArray>"));
    // Bits, in text and as a byte after its size.
    for bits in ["format='ascii'>1 0", "format='binary'>AQAAAIA="] {
        let with = format!("<CellData><DataArray type='Bit' Name='b' {bits}</DataArray>");
        let mesh = read(text.replace("<CellData>", &with).as_bytes()).unwrap();
        assert_eq!(mesh.cell_arrays()[0], array("b", 1, Values::U8(vec![1, 0])));
    }
    same(&text.replace("<CellData>", "<CellData><Array type='String' Name='s' format='appended' offset='7'/>"));
    same(&text.replace("\n</DataArray>", "<!-- end --><InformationKey>9 9</InformationKey></DataArray>"));
    same(&text.replace("NumberOfComponents=\"1\" format=\"ascii\"", "NumberOfComponents=\"\""));
    same(&text.replace(" 4 10\n", " 4.0e0 10.\n"));
    for mode in [Mode::AppendedBase64, Mode::AppendedRaw] {
        let with_mark = [b"\xef\xbb\xbf".to_vec(), write(Style { mode, ..PLAIN }, &[piece()])].concat();
        assert_holds(&read(&with_mark).unwrap(), &piece(), "byte order mark");
    }
    let named = |name: &str| {
        let text = text.replace("Name=\"T\"", &format!("Name=\"{name}\""));
        read(text.as_bytes()).unwrap().point_arrays()[0].name.clone()
    };
    assert_eq!(named("p &lt; q &amp;&#x20;&quot;r&quot;"), "p < q & \"r\"");
    assert_eq!(named("a<b & c"), "a<b & c", "as VTK itself writes it");
    assert_eq!(named("a > b"), "a > b");
    assert_eq!(named("Druck p/p₀"), "Druck p/p₀");
}

#[test]
fn ascii_numbers_of_other_programs() {
    let values = " nan -NaN inf -Infinity 1.#QNAN -1.#IND00 1.#INF nan(0x8) +1e3 .5\n";
    let text = ascii(&[piece()]).replace(" 0 0.125 0.25 0.375 0.5 0.625 0.75 0.875 1 1.125\n", values);
    assert!(text.contains("IND"));
    let t = floats(&read(text.as_bytes()).unwrap().point_arrays()[0].values);
    assert_eq!(t.iter().map(|v| v.is_nan()).collect::<Vec<_>>(), [1, 1, 0, 0, 1, 1, 0, 1, 0, 0].map(|b| b == 1));
    assert_eq!((t[2], t[3], t[6], t[8], t[9]), (f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, 1000.0, 0.5));
}

/// Long ascii arrays are parsed in parts, long binary ones in chunks.
#[test]
fn long_arrays() {
    let n = 40_000;
    let long = Piece {
        point_data: vec![array("f", 1, Values::F64((0..n).map(f64::from).collect()))],
        points: Values::F32((0..3 * n).map(|i| i as f32).collect()),
        ..piece()
    };
    for mode in [Mode::Ascii, Mode::Inline, Mode::AppendedBase64, Mode::AppendedRaw] {
        let mesh = read(&write(Style { mode, ..PLAIN }, std::slice::from_ref(&long))).unwrap();
        assert_holds(&mesh, &long, mode);
    }
    let packed = Style { mode: Mode::AppendedBase64, block: Some(10_001), ..PLAIN };
    assert_holds(&read(&write(packed, std::slice::from_ref(&long))).unwrap(), &long, packed);
}

/// Raw data is not XML: bytes that look like tags must not end it.
#[test]
fn raw_data_may_look_like_xml() {
    let mut piece = piece();
    let trap = b"_</AppendedData></VTKFile><Piece NumberOfPoints=\"9\"><!-- <![CDATA[ ";
    piece.cell_data.push(array("trap", 33, Values::U8(trap[..66].to_vec())));
    let bytes = write(Style { mode: Mode::AppendedRaw, ..PLAIN }, std::slice::from_ref(&piece));
    assert_holds(&read(&bytes).unwrap(), &piece, "trap");
}

#[test]
fn base64_in_lines() {
    let text = String::from_utf8(write(Style { mode: Mode::Inline, ..PLAIN }, &[piece()])).unwrap();
    let broken = |line: &str| match line.starts_with("   ") {
        true => line.as_bytes().chunks(76).map(|c| std::str::from_utf8(c).unwrap()).collect::<Vec<_>>().join("\r\n"),
        false => line.to_owned(),
    };
    let text: String = text.lines().map(broken).collect::<Vec<_>>().join("\n");
    assert_holds(&read(text.as_bytes()).unwrap(), &piece(), "lines");
}

/// GetFEM states a wrong length in its point data; VTK takes the numbers that it needs.
#[test]
fn data_with_more_bytes_than_numbers() {
    let bytes = write(Style { mode: Mode::AppendedRaw, ..PLAIN }, &[piece()]);
    let start = bytes.windows(2).position(|w| w == b" _").unwrap() + 2;
    let stated = |value: u32| [&bytes[..start], &value.to_le_bytes(), &bytes[start + 4..]].concat();
    assert_holds(&read(&stated(0x42fa_0000)).unwrap(), &piece(), "too many");
    assert!(malformed(&stated(39)).contains("PointData array \"T\": it holds 39 bytes, but its numbers need 40"));
}

#[test]
fn damage_is_named() {
    let text = ascii(&[piece()]);
    let told = |from: &str, to: &str, expected: &str| {
        assert!(text.contains(from), "{from}");
        let what = malformed(text.replacen(from, to, 1).as_bytes());
        assert!(what.contains(expected), "\"{from}\" -> \"{to}\" says: {what}");
    };
    let connectivity = " 0 1 2 3 4 5 6 7 8 9\n";
    told(connectivity, " 0 1 2 3 10 5 6 7 8 9\n", "cell 1 names point 10, but there are 10 points");
    told(connectivity, " 0 1 -2 3 4 5 6 7 8 9\n", "cell 0 names a negative point");
    told(connectivity, " 0 1 2x 3 4 5 6 7 8 9\n", "Cells array \"connectivity\": \"2x\" is not a number");
    told(connectivity, " 0 1 2.5 3 4 5 6 7 8 9\n", "\"2.5\" is not a number");
    told(connectivity, " 0 1 2 3 4 5 6 7 8\n", "\"connectivity\": it holds 9 numbers, not 10");
    told(" 4 10\n", " 4 -10\n", "offset of cell 1");
    told(" 4 10\n", " 40 10\n", "the offsets decrease at cell 1");
    told(" 4 10\n", " 4 9223372036854775807\n", "it holds 10 numbers, not 9223372036854775807");
    told(" 10 13\n", " 10 256\n", "Cells array \"types\": \"256\" is not a number of its type");
    told("NumberOfPoints=\"10\"", "NumberOfPoints=\"11\"", "numbers, not");
    told("NumberOfPoints=\"10\"", "NumberOfPoints=\"9\"", "numbers, not");
    told("NumberOfPoints=\"10\"", "NumberOfPoints=\"300000000\"", "numbers, not");
    told("NumberOfPoints=\"10\"", "NumberOfPoints=\"-1\"", "NumberOfPoints is \"-1\", not a count");
    told("NumberOfPoints=\"10\"", "", "a <Piece> has no NumberOfPoints");
    told("NumberOfCells=\"2\"", "NumberOfCells=\"3\"", "numbers, not");
    told(
        "Name=\"Points\" NumberOfComponents=\"3\"",
        "NumberOfComponents=\"2\"",
        "the Points of piece 0 have 2 components",
    );
    told("<Points>", "<Pints>", "XML");
    told("Name=\"types\"", "Name=\"typos\"", "the Cells of piece 0 have no array \"types\"");
    told("type=\"Float32\"", "type=\"Float16\"", "PointData array \"T\": its type is \"Float16\"");
    told("LittleEndian", "MiddleEndian", "byte_order is \"MiddleEndian\"");
    told("UInt32", "UInt24", "header_type is \"UInt24\"");
    told("format=\"ascii\"", "format=\"morse\"", "its format is \"morse\"");
    told("format=\"ascii\"", "format=\"appended\"", "no offset");
    told("format=\"ascii\"", "format=\"appended\" offset=\"0\"", "no <AppendedData>");
    told("<VTKFile", "<html", "<html>");
    for part in ["</Piece>", "<Piece", "<DataArray", "NumberOfComponents", "</VTKFile>"] {
        let cut = malformed(&text.as_bytes()[..text.find(part).unwrap() + 3]);
        assert!(cut.contains("cut short") || cut.contains("XML"), "{part}: {cut}");
    }
    assert!(malformed(b"").contains("empty"));
    assert!(malformed(b"\x7fELF\0\0").contains("neither"));
    assert!(malformed(b"<VTKFile type='UnstructuredGrid'><UnstructuredGrid/></VTKFile>").contains("no <Piece>"));
    let wide_types = Piece { types: Values::I16(vec![10, 256]), ..piece() };
    assert!(malformed(&write(PLAIN, &[wide_types])).contains("the type of cell 1 is not in 0..=255"));
    assert!(matches!(halite::io::open(Path::new("no/such.vtu"), &|_| ()), Err(Error::File { .. })));
    for codec in [Codec::ZLib, Codec::LZ4, Codec::Lzma] {
        let style = Style { mode: Mode::AppendedRaw, block: Some(64), codec, ..PLAIN };
        let mut bytes = write(style, &[piece()]);
        let start = bytes.windows(2).position(|w| w == b" _").unwrap() + 2 + 16;
        // What is packed is damaged in all places, one after another.
        let mut refused = 0;
        for at in start..start + 40 {
            bytes[at] ^= 0x55;
            refused += usize::from(read(&bytes).is_err());
            bytes[at] ^= 0x55;
        }
        assert!(refused > 0, "{codec:?}");
    }
}

/// No size that a file merely states may make the reader take memory, wait or panic.
#[test]
fn lies_about_sizes() {
    let style = Style { mode: Mode::AppendedRaw, wide: true, block: Some(64), ..PLAIN };
    // The first array, "T", has one block.
    let first = |word: usize, value: u64| {
        let mut bytes = write(style, &[piece()]);
        let start = bytes.windows(2).position(|w| w == b" _").unwrap() + 2 + 8 * word;
        bytes[start..start + 8].copy_from_slice(&value.to_le_bytes());
        let what = malformed(&bytes);
        assert!(what.contains("PointData array \"T\""), "{what}");
        what
    };
    assert!(first(0, 1 << 60).contains("1152921504606846976 blocks"));
    assert!(first(0, u64::MAX).contains("blocks"));
    assert!(first(0, 0).contains("it holds 0 bytes"));
    assert!(first(2, 1 << 62).contains("cannot unpack"));
    assert!(first(2, 39).contains("it holds 39 bytes"));
    assert!(first(3, 1 << 62).contains("the file ends after"));
    assert!(first(3, 3).contains("block 0 is not valid zlib"));
    let text = String::from_utf8(write(Style { mode: Mode::AppendedBase64, ..PLAIN }, &[piece()])).unwrap();
    let far = text.replace("offset=\"60\"", "offset=\"99999999\"");
    assert!(malformed(far.as_bytes()).contains("PointData array \"v\": its offset 99999999 lies past the end"));
    let counts = [(u64::MAX, 2), (10, u64::MAX), (u64::MAX / 24, 2), (u64::from(u32::MAX) - 1, u64::MAX / 8)];
    for (points, cells) in counts {
        for style in [style, Style { block: None, ..style }, Style { mode: Mode::Inline, ..style }, PLAIN] {
            let mut bytes = write(style, &[piece()]);
            let text = b"NumberOfPoints=\"10\" NumberOfCells=\"2\"";
            let at = bytes.windows(text.len()).position(|w| w == text).unwrap();
            let lie = format!("NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\"");
            bytes.splice(at..at + text.len(), lie.into_bytes());
            assert!(read(&bytes).is_err());
        }
    }
}

#[test]
fn hostile_xml() {
    let deep = format!("<VTKFile type='UnstructuredGrid'>{}", "<a>".repeat(200_000));
    assert!(malformed(deep.as_bytes()).contains("cut short"));
    let bomb = "<?xml version='1.0'?><!DOCTYPE V [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;'>]>\
        <VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='&b;' NumberOfCells='0'/>";
    assert!(malformed(bomb.as_bytes()).contains("NumberOfPoints is \"&b;\""));
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let refused = |name: &str, bytes: &[u8]| match read_as(name, bytes) {
        Err(Error::Unsupported { what, .. }) => what,
        other => panic!("{name}: {other:?}"),
    };
    let style = Style { mode: Mode::Inline, block: Some(64), ..PLAIN };
    let text = String::from_utf8(write(style, &[piece()])).unwrap();
    let what = refused("mesh.vtu", text.replace("vtkZLibDataCompressor", "vtkZstdDataCompressor").as_bytes());
    assert!(what.contains("vtkZstdDataCompressor") && what.contains("array \""), "{what}");
    let unused = ascii(&[piece()]).replace("UInt32\">", "UInt32\" compressor=\"vtkZstdDataCompressor\">");
    assert_holds(&read(unused.as_bytes()).unwrap(), &piece(), "a compressor that nothing uses");
    for kind in ["ImageData", "PolyData", "Collection", "vtkMultiBlockDataSet", "Nonsense"] {
        assert!(refused("mesh.vtu", format!("<VTKFile type='{kind}'/>").as_bytes()).contains(kind));
    }
    for extension in ["vti", "pvd", "vtm", "vtkhdf", "VTP"] {
        assert!(refused(&format!("mesh.{extension}"), b"\x89HDF").starts_with("this is "));
    }
    let points = "DATASET STRUCTURED_POINTS\nDIMENSIONS 1 1 1\nORIGIN 0 0 0\nSPACING 1 1 1\n";
    let what = refused("mesh.vtk", format!("# vtk DataFile Version 3.0\nx\nASCII\n{points}").as_bytes());
    assert!(what.contains("ImageData"), "{what}");
}

#[test]
fn legacy_files() {
    let mesh = read_as("mesh.vtk", LEGACY.as_bytes()).unwrap();
    assert_eq!((mesh.points().len(), mesh.cells().types.as_slice()), (5, &[10, 10][..]));
    assert_eq!(mesh.cells().points(1), [1, 2, 3, 4]);
    assert_eq!(mesh.cell_arrays(), [array("id", 1, Values::I32(vec![7, 8]))]);
    assert_eq!(mesh.point_arrays()[0].name, "v x");
    assert_eq!(mesh.point_arrays()[1], array("T", 1, Values::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0])));
    assert_eq!(read(LEGACY.as_bytes()).unwrap(), mesh, "the content decides, not the extension");
    let modern = "CELLS 3 8\nOFFSETS vtktypeint64\n0 4 8\nCONNECTIVITY vtktypeint64\n0 1 2 3 1 2 3 4\n";
    let modern = LEGACY.replace("CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\n", modern).replace("3.0", "5.1");
    assert_eq!(read_as("mesh.vtk", modern.as_bytes()).unwrap(), mesh);
}

#[test]
fn legacy_files_with_field_data_and_polyhedra() {
    let plain = read_as("mesh.vtk", LEGACY.as_bytes()).unwrap();
    for field in [
        "FIELD FieldData 2\nTIME 1 1 double\n1.5\nCYCLE 1 1 int\n7\n",
        "FIELD FieldData 1\nTimeValue 1 1 double\n1.5\nMETADATA\nINFORMATION 0\n\n",
        "FIELD FieldData 1\nwords 1 2 string\nPOINTS of view\nsecond\n",
    ] {
        let with = LEGACY.replace("POINTS 5", &format!("{field}POINTS 5"));
        assert_eq!(read_as("mesh.vtk", with.as_bytes()).unwrap(), plain, "{field}");
    }
    // The tetrahedron 0 1 2 3 by its faces.
    let stream = "4 3 0 1 2 3 0 1 3 3 1 2 3 3 2 0 3";
    let with =
        LEGACY.replace("CELLS 2 10\n4 0 1 2 3\n", &format!("CELLS 2 23\n17 {stream}\n")).replace("10 10\n", "42 10\n");
    let mesh = read_as("mesh.vtk", with.as_bytes()).unwrap();
    assert_eq!((mesh.cells().points(0), mesh.cells().points(1)), (&[0, 1, 2, 3][..], &[1, 2, 3, 4][..]));
    assert_eq!(mesh.polyhedra().unwrap().faces(0).collect::<Vec<_>>(), [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
    let error = read_as("mesh.vtk", with.replace(stream, "4 3 0 1 2 3 0 1 3 3 1 2 3 9 2 0 3").as_bytes());
    assert!(error.unwrap_err().to_string().contains("the faces of polyhedron 0 do not fit"));
}

#[test]
fn legacy_arrays_of_every_kind() {
    let base = LEGACY.split("CELL_DATA").next().unwrap();
    let with = |text: &str| read_as("mesh.vtk", format!("{base}{text}").as_bytes()).unwrap();
    let mesh = with(
        "POINT_DATA 5\nSCALARS s unsigned_short\n0 1 65535 3 4\nGLOBAL_IDS g vtkIdType\n5 6 7 8 9000000000\n\
        PEDIGREE_IDS names string\na\nb c\n\nPOINTS\nd\nTENSORS6 t float\n1 1 1 1 1 1 2 2 2 2 2 2 3 3 3 3 3 3 4 4 4 4 4 4 5 5 5 5 5 5\n\
        METADATA\nINFORMATION 0\n\nLOOKUP_TABLE own 1\n1 0 0.5 1\nSCALARS c float 1\nLOOKUP_TABLE own\nnan -inf 1e2 -nan(ind) 1.#INF\n\
        CELL_DATA 2\nFIELD FieldData 3\nb 1 2 bit\n1 0\nwords 1 2 string\nx\ny\nNULL_ARRAY\nCOLOR_SCALARS rgb 3\n0 0.5 1 1 1 1\n",
    );
    let names: Vec<&str> = mesh.point_arrays().iter().map(|a| &a.name[..]).collect();
    assert_eq!(names, ["s", "g", "t", "c"]);
    assert_eq!(mesh.point_arrays()[0].values, Values::U16(vec![0, 1, 65535, 3, 4]));
    assert_eq!(mesh.point_arrays()[1].values, Values::I64(vec![5, 6, 7, 8, 9_000_000_000]));
    assert_eq!(mesh.point_arrays()[2].components, 6);
    let Values::F32(c) = &mesh.point_arrays()[3].values else { panic!() };
    assert!(c[0].is_nan() && c[1] == f32::NEG_INFINITY && c[2] == 100.0 && c[3].is_nan() && c[4] == f32::INFINITY);
    let [bits, rgb] = mesh.cell_arrays() else { panic!() };
    assert_eq!((&bits.name[..], &bits.values), ("b", &Values::U8(vec![1, 0])));
    assert_eq!((rgb.components, &rgb.values), (3, &Values::U8(vec![0, 128, 255, 255, 255, 255])));
    // Points that are whole numbers, and everything on one line.
    let mesh = read_as(
        "mesh.vtk",
        LEGACY.replace("5 float\n", "5 int ").replace("CELL_TYPES 2\n", "CELL_TYPES 2 ").as_bytes(),
    );
    assert_eq!(mesh.unwrap().points()[4], glam::DVec3::ONE);
}

#[test]
fn binary_legacy_files() {
    let be = |list: &[i32]| -> Vec<u8> { list.iter().flat_map(|i| i.to_be_bytes()).collect() };
    let floats = |list: &[f32]| -> Vec<u8> { list.iter().flat_map(|x| x.to_be_bytes()).collect() };
    let mut file = b"# vtk DataFile Version 4.2\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n\
        FIELD FieldData 2\nTIME 1 1 double\n........\nlog 1 2 string\n\xc2hi\x80\x05POINT\nPOINTS 4 float\n"
        .to_vec();
    file.extend(floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]));
    for (head, body) in [
        ("\nCELLS 1 5\n", be(&[4, 0, 1, 2, 3])),
        ("\nCELL_TYPES 1\n", be(&[10])),
        ("\nPOINT_DATA 4\nSCALARS us unsigned_short 1\nLOOKUP_TABLE default\n", vec![0, 1, 255, 255, 0, 3, 0, 10]),
        // Bytes that are blanks must not be taken for such.
        ("\nGLOBAL_IDS g vtkIdType\n", be(&[0x0a0a_2020, 1, 2, 0x2020_0a0a])),
        ("\nFIELD FieldData 2\nb 1 4 bit\n", vec![0b1011_0000]),
        ("\nu 1 4 unsigned_char\n", b"\n\n  ".to_vec()),
        ("\nMETADATA\nINFORMATION 0\n\nLOOKUP_TABLE own 1\n", vec![10, 32, 10, 32]),
    ] {
        file.extend(head.bytes());
        file.extend(body);
    }
    let mesh = read_as("mesh.vtk", &file).unwrap();
    assert_eq!((mesh.points()[3], mesh.cells().points(0)), (glam::DVec3::Z, &[0, 1, 2, 3][..]));
    let [us, g, b, u] = mesh.point_arrays() else { panic!("{mesh:?}") };
    assert_eq!(us.values, Values::U16(vec![1, 65535, 3, 10]));
    assert_eq!(g.values, Values::I64(vec![0x0a0a_2020, 1, 2, 0x2020_0a0a]));
    assert_eq!((&b.values, &u.values), (&Values::U8(vec![1, 0, 1, 1]), &Values::U8(b"\n\n  ".to_vec())));
    for cut in 1..file.len() {
        // Whatever is missing, it is an error, or all of the arrays that are there.
        let _ = read_as("mesh.vtk", &file[..cut]);
    }
}

#[test]
fn damaged_legacy_files() {
    let told = |from: &str, to: &str, expected: &str| {
        assert!(LEGACY.contains(from), "{from}");
        let error = read_as("mesh.vtk", LEGACY.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains("mesh.vtk") && error.contains(expected), "{error}");
    };
    told("4 1 2 3 4\n", "4 1 2 3 5\n", "cell 1 names point 5");
    told("4 1 2 3 4\n", "5 1 2 3 4\n", "cell 1 has more points");
    told("SCALARS id int 1\n", "SCALARS id int 2\n", "array \"id\", at byte 172: \"POINT_DATA\" is not a number");
    told(
        "SCALARS id int 1\nLOOKUP_TABLE default\n7 8\n",
        "SCALARS id quad 1\n7 8\n",
        "there is no number type \"quad\"",
    );
    told("FIELD FieldData", "FOUNTAIN FieldData", "FOUNTAIN, at byte 278: Halite does not know such a section");
    told("T 1 5", "T 1 6", "array \"T\", at byte 278: it holds 5 numbers, not 6");
    told("T 1 5", "T 1 18446744073709551615", "it holds 5 numbers");
    told("T 1 5", "T 2 18446744073709551615", "more values than any file can hold");
    told("POINTS 5", "POINTS 4000000000", "POINTS, at byte 65: \"CELLS\" is not a number");
    told("CELL_DATA 2", "CELLS_DATA 2", "CELLS_DATA, at byte");
    told("ASCII", "EBCDIC", "its third line is \"EBCDIC\"");
    told("ASCII", "BINARY", ", at byte");
    told("DATASET", "DATA", "no data set");
    told("1 2 3 4 5\n", "1 2 3 4 5\n1e\n", "1E, at byte");
}

#[test]
fn damage_never_panics() {
    let mut random = Random(20_240_607);
    let rounds = std::env::var("HALITE_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(900);
    let seeds: Vec<Vec<u8>> = [Mode::Ascii, Mode::Inline, Mode::AppendedBase64, Mode::AppendedRaw]
        .iter()
        .flat_map(|mode| {
            [PLAIN, Style { block: Some(64), wide: true, ..PLAIN }].map(|style| Style { mode: *mode, ..style })
        })
        .map(|style| write(style, &[piece(), piece()]))
        .chain([LEGACY.as_bytes().to_vec()])
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.vtu");
    for round in 0..rounds {
        let bytes = mutated(&seeds[round % seeds.len()], &mut random);
        std::fs::write(&path, &bytes).unwrap();
        if std::panic::catch_unwind(|| halite::io::open(&path, &|_| ())).is_err() {
            let kept = std::env::temp_dir().join("halite-io-panic.vtu");
            std::fs::write(&kept, bytes).unwrap();
            panic!("round {round} panicked; the file is {}", kept.display());
        }
    }
}

/// Files of other programs, where they are at hand.
fn shared(folder: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "vtu" || e == "pvtu") {
                files.push(path);
            }
        }
    }
    files
}

#[test]
fn files_of_other_programs() {
    let folders =
        ["data/corner/gen", "data/corner/real", "data/corner/writers", "data/tools", "data/papers", "reference/meshes"];
    for path in folders.iter().flat_map(|folder| shared(folder)) {
        // One was cut short, the other lists a file that is not there.
        let broken =
            ["petsc_tet4_mat_vertex_t10.vtu", "dolfinx_hex_p1000000.pvtu"].iter().any(|name| path.ends_with(name));
        match halite::io::open(&path, &|_| ()) {
            Ok(_) => assert!(!broken, "{}", path.display()),
            Err(error) => assert!(broken, "{error}"),
        }
    }
}

#[test]
fn damaged_files_of_other_programs() {
    // Damage in field data, which is not read, an unknown type of cell, and a name that is not well-formed XML do no harm.
    let harmless = [
        "bad_base64.vtu",
        "huge_block_length.vtu",
        "offset_past_end.vtu",
        "unknown_array_type.vtu",
        "zlib_block_count_huge.vtu",
        "types_unknown.vtu",
        "xml_unescaped_name.vtu",
    ];
    for path in shared("data/corner/bad") {
        let name = path.file_name().unwrap().to_str().unwrap();
        let mesh = halite::io::open(&path, &|_| ());
        assert_eq!(mesh.is_ok(), harmless.contains(&name), "{name}: {:?}", mesh.err());
    }
}
