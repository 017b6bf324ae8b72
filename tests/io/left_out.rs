//! Arrays that are not whole are left out, what the file says of others is kept; the cases of users.

use super::files::{Mode, PLAIN, Piece, Style, array, ascii, piece, write};
use super::{floats, read};
use halite::field::{Component, Field};
use halite::mesh::{Mesh, Role, Values};
use halite::scene::automatic;
use std::path::Path;

#[test]
fn arrays_that_are_not_whole() {
    let text = ascii(&[piece()]);
    let told = |from: &str, to: &str, expected: &str| {
        assert!(text.contains(from), "{from}");
        let mesh = read(text.replacen(from, to, 1).as_bytes()).unwrap();
        assert_eq!(mesh.point_arrays(), &piece().point_data[1..], "{from} -> {to}");
        assert_eq!(mesh.cell_arrays(), piece().cell_data, "{from} -> {to}");
        let why = mesh.point_attributes().why_left_out("T").unwrap();
        assert!(why.contains("PointData array \"T\": ") && why.contains(expected), "{why}");
        let asked = Field::new(&mesh, "T", None, Component::Index(0)).unwrap_err().to_string();
        assert!(asked.contains(expected), "{asked}");
    };
    told(" 0 0.125 0.25", " 0 0.25", "it holds 9 numbers, not 10");
    told(" 0 0.125 0.25", " 0 0.125 0.25 0.25", "it holds 11 numbers, not 10");
    told(" 0 0.125 0.25", " 0 o.125 0.25", "\"o.125\" is not a number");
    told("type=\"Float32\"", "type=\"Float16\"", "its type is \"Float16\"");
    told("type=\"Float32\"", "type=\"String\"", "its type is \"String\"");
    told("NumberOfComponents=\"1\"", "NumberOfComponents=\"one\"", "NumberOfComponents is \"one\"");
    told("NumberOfComponents=\"1\"", "NumberOfComponents=\"4000000000\"", "it holds 10 numbers");
    told("format=\"ascii\"", "format=\"morse\"", "its format is \"morse\"");
    told("format=\"ascii\"", "format=\"appended\"", "no offset");
    told("format=\"ascii\"", "format=\"appended\" offset=\"0\"", "no <AppendedData>");
    // What follows the file is no part of it, and elements that nobody knows hold nothing.
    let mesh = read(format!("{text}<<garbage").as_bytes()).unwrap();
    assert_eq!(mesh.point_arrays(), piece().point_data);
    let odd = text.replace("<PointData>", "<Notes><DataArray type='Float99'>x</DataArray></Notes><PointData>");
    assert_eq!(read(odd.as_bytes()).unwrap().point_arrays(), piece().point_data);
    // A file that was cut short has all that was written before.
    let style = Style { mode: Mode::AppendedRaw, ..PLAIN };
    let last = Piece { point_data: vec![], cell_data: piece().cell_data, ..piece() };
    let bytes = write(style, &[last]);
    let cut = read(&bytes[..bytes.len() - 40]);
    assert!(cut.is_err(), "the cells are cut");
}

#[test]
fn pieces_of_which_one_is_damaged() {
    let text = ascii(&[piece(), piece()]);
    let at = text.rfind(" 0 0.125 0.25").unwrap();
    let damaged = format!("{} 0 0.125{}", &text[..at], &text[at + " 0 0.125 0.25".len()..]);
    let mesh = read(damaged.as_bytes()).unwrap();
    assert_eq!((mesh.points().len(), mesh.point_arrays().len()), (20, 1));
    assert!(mesh.point_attributes().why_left_out("T").unwrap().contains("of piece 1: it holds 9 numbers, not 10"));
}

#[test]
fn roles_of_arrays() {
    let text = ascii(&[piece()]).replace("<PointData>", "<PointData Scalars=\"T\" Tensors=\"v\" Normals=\"\">");
    let mesh = read(text.replace("<CellData>", "<CellData GlobalIds=\"id\">").as_bytes()).unwrap();
    let roles =
        (mesh.point_attributes().role("T"), mesh.point_attributes().role("v"), mesh.cell_attributes().role("id"));
    assert_eq!(roles, (Some(Role::Scalars), Some(Role::Tensors), Some(Role::GlobalIds)));
    assert_eq!(mesh.point_attributes().roles.len(), 2);
    let two =
        Piece { point_data: vec![array("a", 1, Values::F32(vec![0.5; 10])), piece().point_data[0].clone()], ..piece() };
    let text = ascii(&[two]);
    let of = |text: String| automatic::scalars(&read(text.as_bytes()).unwrap(), None).unwrap().name;
    assert_eq!(of(text.clone()), "T", "it varies");
    assert_eq!(of(text.replace("<PointData>", "<PointData Scalars=\"a\">")), "a");
}

/// The case of that name; none where the cases are not at hand.
#[allow(clippy::print_stderr, reason = "a test says what it skips")]
fn case(name: &str) -> Option<halite::Result<Mesh>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/cases").join(name);
    if !path.exists() {
        eprintln!("skipped in part: there is no {}", path.display());
        return None;
    }
    Some(halite::io::open(&path, &|_| ()))
}

fn drawn(mesh: &Mesh) -> String {
    automatic::scalars(mesh, None).unwrap().name
}

#[test]
fn cases_of_users() {
    if let Some(mesh) = case("k4_cell_point_cell.vtk").map(Result::unwrap) {
        let [a, b] = mesh.cell_arrays() else { panic!("{:?}", mesh.cell_arrays()) };
        assert_eq!((&*a.name, &*b.name, &*mesh.point_arrays()[0].name), ("a", "b", "p"));
        let mut values = floats(&b.values);
        values.sort_by(f64::total_cmp);
        assert_eq!(values, [0., 1., 2., 3., 4., 5., 6., 7.]);
    }
    if let Some(mesh) = case("k5_color_scalars_points.vtk").map(Result::unwrap) {
        let [rgba] = mesh.point_arrays() else { panic!("{:?}", mesh.point_arrays()) };
        let Values::U8(bytes) = &rgba.values else { panic!("{rgba:?}") };
        let range = |k: usize| {
            let of = || bytes.iter().skip(k).step_by(4);
            (*of().min().unwrap(), *of().max().unwrap())
        };
        assert_eq!([0, 1, 2, 3].map(range), [(0, 252), (3, 255), (6, 238), (13, 245)]);
    }
    if let Some(mesh) = case("k7_active_scalars.vtu") {
        assert_eq!(drawn(&mesh.unwrap()), "b");
    }
    if let Some(mesh) = case("k7_ids_before_int_cells.vtu") {
        assert_eq!(drawn(&mesh.unwrap()), "temperature");
    }
    if let Some(mesh) = case("k8_point_data_26_of_27.vtk") {
        let error = mesh.unwrap_err().to_string();
        assert!(error.ends_with("POINT_DATA has 26 tuples where there are 27 points"), "{error}");
    }
    if let Some(mesh) = case("k9_array_too_long.vtu").map(Result::unwrap) {
        assert_eq!((mesh.point_arrays().len(), drawn(&mesh)), (1, "s".into()));
        assert!(mesh.point_attributes().why_left_out("t2").unwrap().contains("40 numbers, not 27"));
    }
    if let Some(mesh) = case("k13_cr_line_ends.vtk").map(Result::unwrap) {
        assert_eq!((mesh.points().len(), mesh.cells().len()), (27, 8));
        assert!(!mesh.point_arrays().is_empty() || !mesh.cell_arrays().is_empty());
    }
}
