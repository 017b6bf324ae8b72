//! What is damaged, or not read, is refused by name; files of other programs.

use super::files::{Codec, LEGACY, Mode, PLAIN, Piece, Random, Style, ascii, mutated, piece, write};
use super::shared::{files_in, meshes_in};
use super::{assert_holds, malformed, read, read_as};
use halite::Error;
use halite::mesh::Values;
use std::path::Path;

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
    told("LittleEndian", "MiddleEndian", "byte_order is \"MiddleEndian\"");
    told("UInt32", "UInt24", "header_type is \"UInt24\"");
    let points = "Name=\"Points\" NumberOfComponents=\"3\" format=";
    told(&format!("{points}\"ascii\""), &format!("{points}\"morse\""), "its format is \"morse\"");
    told(&format!("{points}\"ascii\""), &format!("{points}\"appended\""), "no offset");
    told(&format!("{points}\"ascii\""), &format!("{points}\"appended\" offset=\"0\""), "no <AppendedData>");
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
            refused += usize::from(read(&bytes).is_ok_and(|mesh| !mesh.point_attributes().left_out.is_empty()));
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
        let mesh = read(&bytes).unwrap();
        let what = mesh.point_attributes().why_left_out("T").unwrap();
        assert!(what.contains("PointData array \"T\""), "{what}");
        assert_eq!(mesh.point_arrays(), &piece().point_data[1..], "what is whole is read");
        what.to_owned()
    };
    assert!(first(0, 1 << 60).contains("1152921504606846976 blocks"));
    assert!(first(0, u64::MAX).contains("blocks"));
    assert!(first(0, 0).contains("it holds 0 bytes"));
    assert!(first(2, 1 << 62).contains("cannot unpack"));
    assert!(first(2, 39).contains("it holds 39 bytes"));
    assert!(first(3, 1 << 62).contains("the file ends after"));
    assert!(first(3, 3).contains("block 0 is not valid zlib"));
    // Of what the head says of all arrays' headers.
    let text = String::from_utf8(write(Style { mode: Mode::Inline, ..PLAIN }, &[piece()])).unwrap();
    let what = malformed(text.replace("LittleEndian", "BigEndian").as_bytes());
    assert!(what.contains("the file's byte_order seems to be wrong"), "{what}");
    let mut moved = piece();
    let Values::F64(points) = &mut moved.points else { panic!("points are f64") };
    points[0] = 1.0 / 3.0;
    let moved = String::from_utf8(write(Style { mode: Mode::Inline, ..PLAIN }, &[moved])).unwrap();
    let what = malformed(moved.replace("UInt32", "UInt64").as_bytes());
    assert!(what.contains("the file's header_type seems to be wrong"), "{what}");
    let text = String::from_utf8(write(Style { mode: Mode::AppendedBase64, ..PLAIN }, &[piece()])).unwrap();
    let far = text.replace("offset=\"60\"", "offset=\"99999999\"");
    let mesh = read(far.as_bytes()).unwrap();
    let what = mesh.point_attributes().why_left_out("v").unwrap();
    assert!(what.contains("PointData array \"v\": its offset 99999999 lies past the end"), "{what}");
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
    for kind in ["HyperTreeGrid", "PolyData", "vtkMultiBlockDataSet", "Nonsense"] {
        assert!(refused("mesh.vtu", format!("<VTKFile type='{kind}'/>").as_bytes()).contains(kind));
    }
    for extension in ["htg", "vtm", "vtkhdf", "VTP"] {
        assert!(refused(&format!("mesh.{extension}"), b"\x89HDF").starts_with("this is "));
    }
    let what = refused("mesh.vtk", b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n");
    assert!(what.contains("PolyData"), "{what}");
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
        .flat_map(|style| [vec![write(style, &[piece(), piece()])], super::grids::seeds(style)].concat())
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

#[test]
fn files_of_other_programs() {
    let folders =
        ["data/corner/gen", "data/corner/real", "data/corner/writers", "data/tools", "data/papers", "reference/meshes"];
    let all = ["vtu", "pvtu", "vti", "vtr", "vts"];
    for path in folders.iter().flat_map(|folder| files_in(folder, &all)) {
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
    // Damage in field data, which is not read, an unknown type of cell, and a name that is not well-formed XML do no
    // harm. Where an array of data is damaged, the rest is read.
    let harmless = [
        "bad_base64.vtu",
        "huge_block_length.vtu",
        "offset_past_end.vtu",
        "unknown_array_type.vtu",
        "zlib_block_count_huge.vtu",
        "types_unknown.vtu",
        "xml_unescaped_name.vtu",
    ];
    for path in meshes_in("data/corner/bad") {
        let name = path.file_name().unwrap().to_str().unwrap();
        let mesh = halite::io::open(&path, &|_| ());
        let harmless = harmless.contains(&name);
        match mesh {
            Ok(mesh) => {
                let lost = mesh.point_attributes().left_out.len() + mesh.cell_attributes().left_out.len();
                assert!(harmless || lost > 0, "{name}");
            }
            Err(error) => assert!(!harmless, "{error}"),
        }
    }
}
