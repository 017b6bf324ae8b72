//! Cells that hide each other in a circle, in the program.

use super::{Place, Ran};
use glam::{DVec3, dvec3};
use halite::image::Image;
use halite::mesh::generate;
use serde_json::{Value, json};
use std::fmt::Write;

/// Tetrahedra as a `.vtu`, with values at points.
fn vtu(all: &[DVec3], corners: &[u32]) -> String {
    let (mut points, mut values, mut cells) = (String::new(), String::new(), String::new());
    for (i, p) in all.iter().enumerate() {
        write!(points, "{} {} {} ", p.x, p.y, p.z).unwrap();
        write!(values, "{} ", i % 4).unwrap();
    }
    corners.iter().for_each(|p| write!(cells, "{p} ").unwrap());
    let count = corners.len() / 4;
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
        all.len(),
        "10 ".repeat(count)
    )
}

/// What the projection on a device says that it did; none without a device.
fn projected(place: &Place, options: &str) -> Option<Value> {
    let Ran(code, _, err) =
        place.run(&format!("render {options} --out out.npy --stats out.json --engine project {LOOK}"));
    if code == Some(1) && err.contains("graphics device") && std::env::var_os("HALITE_REQUIRE_GPU").is_none() {
        return None;
    }
    assert_eq!((code, err.as_str()), (Some(0), ""), "{options}");
    let stats: Value = serde_json::from_slice(&std::fs::read(place.path("out.json")).unwrap()).unwrap();
    Some(stats["projection"].clone())
}

const LOOK: &str = "--size 72x64 --opacity 0:9,3:9 --unit-distance 1 --position 0.01,0.02,4 --focal-point 0,0,0 --view-up 0,1,0 \
                    --view-angle 35";

#[test]
fn circles_are_cut_or_walked() {
    let place = Place::new();
    let ring = generate::ring(6);
    place.write("ring.vtu", &vtu(ring.points(), &ring.cells().connectivity));
    place.succeeds(&format!("render ring.vtu --out truth.npy --device cpu --engine traverse {LOOK}"));
    let truth = Image::open(&place.path("truth.npy")).unwrap();
    let draw = |options: &str| {
        let stats = projected(&place, &format!("ring.vtu {options}"))?;
        let error = Image::open(&place.path("out.npy")).unwrap().compare(&truth).unwrap().max;
        assert_eq!((&stats["cycles"], &stats["cycle_cells"]), (&json!(1), &json!(6)), "{stats}");
        Some((stats["walked_pixels"].as_u64().unwrap(), error))
    };
    let (Some(unsaid), Some(walk), Some(cut)) = (draw(""), draw("--cycles walk"), draw("--cycles cut")) else { return };
    assert_eq!(unsaid, walk);
    assert!(walk.0 > 0 && walk.1 < 2e-5 && cut.0 == 0 && cut.1 > 1e-2, "{walk:?} {cut:?}");
    place.misused("render ring.vtu --out x.npy --engine project --cycles untie", "walk");
}

/// Two cells that are in each other have no order, which is said; two that touch have one.
#[test]
fn pixels_of_overlapping_cells_are_counted() {
    let place = Place::new();
    let corners = [dvec3(-0.6, -0.5, 0.0), dvec3(0.6, -0.5, 0.0), dvec3(0.0, 0.6, 0.0), dvec3(0.0, 0.0, 0.8)];
    for (name, away, is_overlap) in [("in", 0.3, true), ("behind", 0.8, false)] {
        let points: Vec<_> = corners.into_iter().chain(corners.map(|p| p - DVec3::Z * away)).collect();
        place.write(&format!("{name}.vtu"), &vtu(&points, &[0, 1, 2, 3, 4, 5, 6, 7]));
        let Some(stats) = projected(&place, &format!("{name}.vtu")) else { return };
        assert_eq!(stats["overlapping_pixels"].as_u64().unwrap() > 20, is_overlap, "{name}: {stats}");
        assert_eq!(stats["order"], "mpvo", "{name}");
    }
}
