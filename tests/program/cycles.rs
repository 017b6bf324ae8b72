//! Cells that hide each other in a circle, in the program.

use super::{Place, Ran};
use halite::image::Image;
use halite::mesh::generate;
use serde_json::Value;
use std::fmt::Write;

/// A ring of tetrahedra as a `.vtu`, with values at points.
fn ring() -> String {
    let mesh = generate::ring(6);
    let (mut points, mut values, mut cells) = (String::new(), String::new(), String::new());
    for (i, p) in mesh.points().iter().enumerate() {
        write!(points, "{} {} {} ", p.x, p.y, p.z).unwrap();
        write!(values, "{} ", i % 4).unwrap();
    }
    mesh.cells().connectivity.iter().for_each(|p| write!(cells, "{p} ").unwrap());
    let count = mesh.cells().len();
    let offsets: String = (1..=count).map(|c| format!("{} ", 4 * c)).collect();
    format!(
        r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
        <Piece NumberOfPoints="{}" NumberOfCells="{count}">
        <PointData><DataArray type="Float64" Name="s" format="ascii">{values}</DataArray></PointData>
        <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
        <Cells><DataArray type="Int64" Name="connectivity" format="ascii">{cells}</DataArray>
        <DataArray type="Int64" Name="offsets" format="ascii">{offsets}</DataArray>
        <DataArray type="UInt8" Name="types" format="ascii">{}</DataArray></Cells>
        </Piece></UnstructuredGrid></VTKFile>"#,
        mesh.points().len(),
        "10 ".repeat(count)
    )
}

#[test]
fn circles_are_cut_or_walked() {
    let place = Place::new();
    place.write("ring.vtu", &ring());
    let look = "--size 72x64 --opacity 0:9,3:9 --unit-distance 1 --position 0.01,0.02,4 --focal-point 0,0,0 --view-up 0,1,0 --view-angle 35";
    place.succeeds(&format!("render ring.vtu --out truth.npy --device cpu --engine traverse {look}"));
    let truth = Image::open(&place.path("truth.npy")).unwrap();
    let draw = |options: &str| {
        let Ran(code, _, err) =
            place.run(&format!("render ring.vtu --out ring.npy --stats ring.json --engine project {look} {options}"));
        if code == Some(1) && err.contains("graphics device") && std::env::var_os("HALITE_REQUIRE_GPU").is_none() {
            return None;
        }
        assert_eq!((code, err.as_str()), (Some(0), ""), "{options}");
        let stats: Value = serde_json::from_slice(&std::fs::read(place.path("ring.json")).unwrap()).unwrap();
        let of = |key: &str| stats["projection"][key].as_u64().unwrap();
        let error = Image::open(&place.path("ring.npy")).unwrap().compare(&truth).unwrap().max;
        assert_eq!((of("cycles"), of("cycle_cells")), (1, 6), "{stats}");
        Some((of("walked_pixels"), error))
    };
    let (Some(unsaid), Some(walk), Some(cut)) = (draw(""), draw("--cycles walk"), draw("--cycles cut")) else { return };
    eprintln!("walked pixels and the greatest error: {unsaid:?}, {walk:?}, cut {cut:?}");
    assert_eq!(unsaid, walk);
    assert!(walk.0 > 0 && walk.1 < 2e-5 && cut.0 == 0 && cut.1 > 1e-2, "{walk:?} {cut:?}");
    place.misused("render ring.vtu --out x.npy --engine project --cycles untie", "walk");
}
