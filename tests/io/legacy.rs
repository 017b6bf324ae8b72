//! Legacy .vtk files.

use super::files::{LEGACY, array};
use super::{read, read_as};
use halite::mesh::Values;

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
    let at = file.windows(6).position(|w| w == b"CELLS ").unwrap() + "CELLS 1 5\n".len();
    let mut turned = file.clone();
    turned[at..at + 20].chunks_exact_mut(4).for_each(<[u8]>::reverse);
    let error = read_as("mesh.vtk", &turned).unwrap_err().to_string();
    assert!(error.contains("the lowest byte seems to be first"), "{error}");
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
    told("CELLS 2 10", "CELLS 3 10", "it says 3 cells, and its 10 numbers are 2");
    told("CELLS 2 10", "CELLS 2 11", "CELLS, at byte 110: it holds 10 numbers, not 11: CELL_TYPES follows");
    told("CELLS 2 10", "CELLS 2 9", "cell 1 has more points");
    told("CELLS 2 10", "CELLS 18446744073709551615 10", "it says 18446744073709551615 cells, and lists 10 numbers");
    told("CELL_TYPES 2\n", "CELL_TYPES 18446744073709551615\n", "it holds 2 numbers, not 18446744073709551615");
    told("CELL_TYPES 2\n10 10\n", "CELL_TYPES 1\n10\n", "CELL_TYPES has 1 types where there are 2 CELLS");
    told("CELL_TYPES 2\n10 10\n", "CELL_TYPES 2\n10 10 10\n", "it holds more numbers than it says");
    told("POINTS 5", "POINTS 4000000000", "POINTS, at byte 65: it holds 15 numbers, not 12000000000: CELLS follows");
    told("POINTS 5", "POINTS 4", "POINTS, at byte 65: it holds more numbers than it says");
    told("POINT_DATA 5", "POINT_DATA 4", "POINT_DATA has 4 tuples where there are 5 points");
    told("CELL_DATA 2", "CELL_DATA 3", "CELL_DATA has 3 tuples where there are 2 cells");
    told("ASCII", "EBCDIC", "its third line is \"EBCDIC\"");
    told("ASCII", "BINARY", ", at byte");
    told("DATASET", "DATA", "no data set");
}

/// What is wrong with data is left out by name, and the rest is read.
#[test]
fn damaged_data_of_legacy_files() {
    let whole = read_as("mesh.vtk", LEGACY.as_bytes()).unwrap();
    let arrays = |mesh: &halite::mesh::Mesh| -> Vec<String> {
        mesh.cell_arrays().iter().chain(mesh.point_arrays()).map(|a| a.name.clone()).collect()
    };
    assert_eq!(arrays(&whole), ["id", "v x", "T"]);
    let told = |from: &str, to: &str, kept: &[&str], lost: &str, expected: &str| {
        assert!(LEGACY.contains(from), "{from}");
        let mesh = read_as("mesh.vtk", LEGACY.replacen(from, to, 1).as_bytes()).unwrap();
        assert_eq!(arrays(&mesh), kept, "{from} -> {to}");
        for array in mesh.cell_arrays().iter().chain(mesh.point_arrays()) {
            assert!(whole.cell_arrays().contains(array) || whole.point_arrays().contains(array), "{from} -> {to}");
        }
        let why = [mesh.point_attributes(), mesh.cell_attributes()]
            .iter()
            .find_map(|a| a.why_left_out(lost).map(str::to_owned));
        assert!(lost.is_empty() || why.as_ref().is_some_and(|why| why.contains(expected)), "{from} -> {to}: {why:?}");
        let asked = halite::field::Field::new(&mesh, lost, None, halite::field::Component::Index(0));
        assert!(lost.is_empty() || asked.unwrap_err().to_string().contains(expected), "{from} -> {to}");
    };
    told("SCALARS id int 1", "SCALARS id int 2", &["v x", "T"], "id", "2 numbers, not 4: POINT_DATA follows");
    told("SCALARS id int 1", "SCALARS id quad 1", &["v x", "T"], "id", "there is no number type \"quad\"");
    told("7 8\n", "7\n", &["v x", "T"], "id", "1 numbers, not 2");
    told("7 8\n", "7 8 9\n", &["v x", "T"], "id", "more numbers");
    told("7 8\n", "7 x\n", &["v x", "T"], "id", "\"x\" is not a number");
    told("VECTORS v%20x double", "VECTORS v%20x single", &["id", "T"], "v x", "there is no number type");
    told("1 1 2 2 2\n", "1 1 2 2\n", &["id", "T"], "v x", "14 numbers, not 15: FIELD follows");
    told("FIELD FieldData", "FOUNTAIN FieldData", &["id", "v x"], "", "");
    told("T 1 5", "T 1 6", &["id", "v x"], "T", "it holds 5 numbers, not 6");
    told("4 5\n", "4 5 6\n", &["id", "v x"], "T", "more numbers");
    told("T 1 5", "T 1 4", &["id", "v x"], "T", "4 tuples of 1 numbers where 5 are needed");
    told("T 1 5", "T 1 18446744073709551615", &["id", "v x"], "T", "it holds 5 numbers");
    told("T 1 5", "T 2 18446744073709551615", &["id", "v x"], "T", "more values than any file can hold");
    told("CELL_DATA 2", "EDGE_DATA 2", &["v x", "T"], "id", "before POINT_DATA or CELL_DATA");
    told("1 2 3 4 5\n", "1 2 3 4 5\n1e\n", &["id", "v x", "T"], "", "");
    told("1 2 3 4 5\n", "1 2 3 4 5\nNOTES 3\nof somebody\n", &["id", "v x", "T"], "", "");
    let two = "FIELD FieldData 3\nT2 1 5 float\n1 2 3 4\nP7 1 5 int\n1 2 3 4 5 6\nT 1 5 float";
    told("FIELD FieldData 1\nT 1 5 float", two, &["id", "v x", "T"], "T2", "\"P7\" is not a number");
    told("FIELD FieldData 1\nT 1 5 float", two, &["id", "v x", "T"], "P7", "more numbers");
    told("FIELD FieldData 1", "FIELD FieldData 7", &["id", "v x", "T"], "", "");
}

#[test]
fn damaged_data_of_binary_legacy_files() {
    let floats = |count: usize| -> Vec<u8> { (0..count).flat_map(|i| (i as f32 + 0.5).to_be_bytes()).collect() };
    let file = |stated: &str, count: usize| {
        let mut file = b"# vtk DataFile Version 4.2\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n".to_vec();
        file.extend([0f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.].iter().flat_map(|x| x.to_be_bytes()));
        file.extend(b"\nCELLS 1 5\n");
        file.extend([4i32, 0, 1, 2, 3].iter().flat_map(|x| x.to_be_bytes()));
        file.extend(b"\nCELL_TYPES 1\n\0\0\0\n\nPOINT_DATA 4\n");
        file.extend(format!("SCALARS a {stated} 1\nLOOKUP_TABLE default\n").bytes());
        file.extend(floats(count));
        file.extend(b"\nVECTORS v float\n");
        file.extend(floats(12));
        file.extend(format!("\nFIELD FieldData 2\nb 1 4 {stated}\n").bytes());
        file.extend(floats(count));
        file.extend(b"\nc 1 4 float\n");
        file.extend(floats(4));
        file.extend(b"\n");
        file
    };
    let names = |bytes: &[u8]| -> Vec<String> {
        let mesh = read_as("mesh.vtk", bytes).unwrap();
        mesh.point_arrays().iter().map(|a| a.name.clone()).collect()
    };
    assert_eq!(names(&file("float", 4)), ["a", "v", "b", "c"]);
    for (stated, count) in [("float", 3), ("float", 6), ("double", 4), ("unsigned_char", 4), ("quad", 4), ("float", 0)]
    {
        assert_eq!(names(&file(stated, count)), ["v", "c"], "{stated} {count}");
    }
    // What programs leave at the end of files does no harm, nor does a section that nobody knows.
    for end in [&b"\0\0"[..], b"EXTRA_DATA 3\n\x01\x02\x03", b"\x1a"] {
        let mut bytes = file("float", 4);
        bytes.extend(end);
        assert_eq!(names(&bytes)[..3], ["a", "v", "b"], "{end:?}");
    }
}

/// Lines that end as on old Macs, and on others.
#[test]
fn line_ends() {
    let whole = read_as("mesh.vtk", LEGACY.as_bytes()).unwrap();
    for end in ["\r", "\r\n"] {
        assert_eq!(read_as("mesh.vtk", LEGACY.replace('\n', end).as_bytes()).unwrap(), whole, "{end:?}");
        // Numbers that are line ends are numbers.
        let mut file = "# vtk DataFile Version 4.2\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 int\n"
            .replace('\n', end)
            .into_bytes();
        file.extend([10, 13, 10, 13, 13, 13, 10, 10, 10, 0, 0, 13]);
        file.extend(format!("{end}CELLS 1 2{end}\0\0\0\x01\0\0\0\0{end}CELL_TYPES 1{end}\0\0\0\x01{end}").bytes());
        file.extend(format!("POINT_DATA 1{end}SCALARS s char 1{end}LOOKUP_TABLE default{end}\r{end}").bytes());
        let mesh = read_as("mesh.vtk", &file).unwrap();
        assert_eq!(mesh.points()[0].z, f64::from(i32::from_be_bytes([10, 0, 0, 13])), "{end:?}");
        assert_eq!(mesh.point_arrays()[0].values, Values::I8(vec![13]), "{end:?}");
    }
}

#[test]
fn sections_of_data_in_any_sequence() {
    let (base, _) = LEGACY.split_once("CELL_DATA").unwrap();
    let a = "CELL_DATA 2\nSCALARS a int\nLOOKUP_TABLE default\n1 2\n";
    let b = "CELL_DATA 2\nVECTORS b float\n1 2 3 4 5 6\nFIELD f 1\nd 1 2 int\n5 6\n";
    let p = "POINT_DATA 5\nSCALARS p float\nLOOKUP_TABLE default\n1 2 3 4 5\n";
    let q = "POINT_DATA 5\nCOLOR_SCALARS q 3\n0 0 0 1 1 1 0.5 0.2 0.4 0 0 0 0 0 0\n";
    for order in [[a, p, b, q], [p, a, q, b], [a, b, p, q], [q, p, b, a], [p, b, a, q]] {
        let mesh = read_as("mesh.vtk", format!("{base}{}", order.concat()).as_bytes()).unwrap();
        let mut names: Vec<&str> = mesh.cell_arrays().iter().chain(mesh.point_arrays()).map(|a| &*a.name).collect();
        names.sort_unstable();
        assert_eq!(names, ["a", "b", "d", "p", "q"]);
        let q = mesh.point_arrays().iter().find(|a| a.name == "q").unwrap();
        let Values::U8(bytes) = &q.values else { panic!("{q:?}") };
        assert_eq!((q.components, &bytes[..9]), (3, &[0, 0, 0, 255, 255, 255, 128, 51, 102][..]));
        assert_eq!(mesh.cell_attributes().role("a"), Some(halite::mesh::Role::Scalars));
    }
}
