//! However numbers are written, they are read as they were meant.

use super::files::{Mode, PLAIN, Piece, Style, array, ascii, piece, styles, write};
use super::{assert_holds, coordinates, floats, read};
use halite::mesh::Values;

#[test]
fn every_encoding() {
    for style in styles() {
        assert_holds(&read(&write(style, &[piece()])).unwrap(), &piece(), style);
    }
}

/// vtkio cannot read raw appended data, base64 in parts and blocks that cut numbers, and drops arrays whose last block
/// is full. It must find in the other files what Halite finds.
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
    let short = read(&stated(39)).unwrap();
    let why = short.point_attributes().why_left_out("T").unwrap();
    assert!(why.contains("PointData array \"T\": it holds 39 bytes, but its numbers need 40"), "{why}");
}
