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
