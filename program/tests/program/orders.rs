//! Grids in the program: orders of reconstruction, tables of them, cropping, light and what is missing.

use super::{Place, Ran};
use halite::image::Image;
use std::fmt::Write;

/// Image data of n³ points, one of which may be missing.
fn image(n: usize, missing: bool) -> String {
    let mut values = String::new();
    for p in 0..n * n * n {
        let [x, y, z] = [p % n, p / n % n, p / (n * n)].map(|i| i as f64);
        let value = (0.9 * x + 0.2 * y).sin() + (0.7 * z - 0.4 * y + 0.1 * x * z).cos();
        if missing && p == n * n * (n / 2) + n * (n / 2) + n / 2 {
            values += "nan ";
        } else {
            write!(values, "{value} ").unwrap();
        }
    }
    let extent = ["0", &(n - 1).to_string()].join(" ");
    format!(
        "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\">\
         <ImageData WholeExtent=\"{extent} {extent} {extent}\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\
         <Piece Extent=\"{extent} {extent} {extent}\"><PointData Scalars=\"s\">\
         <DataArray type=\"Float32\" Name=\"s\" format=\"ascii\">{values}</DataArray></PointData><CellData/></Piece>\
         </ImageData></VTKFile>"
    )
}

fn drawn(place: &Place, input: &str, options: &str) -> Image {
    place.succeeds(&format!("render {input} --out x.npy --size 60x45 {options}"));
    Image::open(&place.path("x.npy")).unwrap()
}

#[test]
fn orders_are_studied() {
    let place = Place::new();
    place.write("neghip9.vti", &image(9, false));
    place.write("synth_bucky7.vti", &image(7, false));
    let text = place.succeeds(
        "study neghip9.vti --orders --volume synth_bucky7.vti --size 48x40 --frames 1 --out sheet.png --json study.json",
    );
    assert!(text.contains("figure 6") && text.contains("bucky7 (stand-in)") && text.contains("turn twice"), "{text}");
    assert!(std::fs::read(place.path("sheet.png")).unwrap().starts_with(b"\x89PNG"));
    let study: serde_json::Value = serde_json::from_slice(&std::fs::read(place.path("study.json")).unwrap()).unwrap();
    assert_eq!(study["stand_ins"], serde_json::json!(["bucky7"]));
    let rows = |key: &str| study[key].as_array().unwrap().clone();
    let number = |row: &serde_json::Value, key: &str| row[key].as_f64().unwrap();
    let of_orders: Vec<f64> = rows("semi_random").iter().map(|r| number(r, "deviation")).collect();
    assert!(of_orders[0] > 2.0 * of_orders[1] && of_orders[1] > 3.0 * of_orders[2], "{of_orders:?}");
    assert!(rows("voxels").iter().all(|r| number(r, "ratio") > 1.5), "{study}");
    assert!(rows("turns").iter().any(|r| number(r, "share") > 1e-3), "{study}");
    assert_eq!(rows("tables").len(), 7);
    // Two figures of the field itself and of three reconstructions, each with and without a table.
    assert_eq!(rows("pictures").len(), 14);
    assert!(rows("equal_steps").iter().all(|r| number(r, "crossed") > 0.1), "{study}");
    place.fails("study cube.vtu --orders --out sheet.png", &["cube.vtu", "rectilinear grids"]);
    place.misused("study neghip9.vti --volume neghip9.vti --out sheet.png", "--orders");
}

#[test]
fn tables_of_slabs_are_options() {
    let place = Place::new();
    place.write("a.vti", &image(8, false));
    let exact = drawn(&place, "a.vti", "");
    let plain = drawn(&place, "a.vti", "--reconstruction 2");
    let table = drawn(&place, "a.vti", "--reconstruction 2 --integral second-order-polynomial");
    let published = drawn(
        &place,
        "a.vti",
        "--reconstruction 2 --sampling 0.1 --integral second-order --iterations 32 --table 64x64",
    );
    let lines = drawn(&place, "a.vti", "--reconstruction 1 --integral volume");
    for (name, image, bound) in
        [("2", &plain, 0.1), ("table", &table, 0.1), ("published", &published, 0.15), ("1", &lines, 0.2)]
    {
        let error = image.compare(&exact).unwrap();
        assert!(error.max > 0.0 && error.max < bound, "{name}: {:.1e}", error.max);
    }
    place.fails("render a.vti --out x.png --reconstruction 2 --integral second-order", &["--sampling LENGTH"]);
    place.fails("render a.vti --out x.png --integral volume", &["--integral exact"]);
    place.fails("render cube.vtu --out x.png --integral second-order", &["grids"]);
    place.misused("render a.vti --out x.png --sampling 0.2", "--reconstruction 2");
    // A scene says the same.
    let scene = |more: &str| {
        format!(
            r#"{{"mesh": "a.vti", "scalars": {{"name": "s"}}, "color": [[-2, 1, 0, 0], [2, 0, 0, 1]],
            "opacity": [[-2, 0], [2, 0.6]], "unit_distance": 1, "size": [40, 30], {more}
            "camera": {{"position": [3, -20, 8], "focal_point": [3.5, 3.5, 3.5], "view_up": [0, 0, 1]}}}}"#
        )
    };
    place.write("one.json", &scene(""));
    place.write(
        "two.json",
        &scene(
            r#""reconstruction": "2", "sampling": 0.3, "integral": {"form": "second-order", "table": [32, 32, 32]},"#,
        ),
    );
    let [one, two] = ["one.json", "two.json"].map(|s| {
        place.succeeds(&format!("render {s} --out y.npy"));
        Image::open(&place.path("y.npy")).unwrap()
    });
    let error = two.compare(&one).unwrap();
    // Up to 0.6 of a ray, behind its last whole slab, is left out.
    assert!(error.max > 1e-4 && error.max < 0.35, "{:.1e}", error.max);
    for (more, part) in [
        (r#""reconstruction": "7","#, "0-left"),
        (r#""sampling": 2,"#, "reconstruction"),
        (r#""reconstruction": "1", "sampling": -2,"#, "sampling"),
        (r#""cropping": {"planes": [[0, 1], [0, 1], [0, 1]], "regions": "moat"},"#, "inverted fence"),
        (r#""cropping": {"planes": [[0, 1], [0, 1], [0, 1]], "regions": 999999999},"#, "27"),
    ] {
        place.write("wrong.json", &scene(more));
        place.fails("render wrong.json --out y.npy", &["wrong.json", part]);
    }
}

#[test]
fn regions_are_cropped() {
    let place = Place::new();
    place.write("a.vti", &image(8, false));
    for input in ["a.vti", "cube.vtu"] {
        let planes = if input == "a.vti" { "2,5,1,4,2.5,6" } else { "0.5,1.2,0.3,1.5,0.6,1.4" };
        let whole = drawn(&place, input, "");
        let part = drawn(&place, input, &format!("--crop {planes}"));
        let fence = drawn(&place, input, &format!("--crop {planes} --crop-regions fence"));
        let bits = drawn(&place, input, &format!("--crop {planes} --crop-regions 0x2ebfeba"));
        assert_eq!(fence.pixels, bits.pixels);
        let sum = |image: &Image| image.pixels.iter().map(|p| f64::from(p[3])).sum::<f64>();
        assert!(sum(&part) > 0.0 && sum(&part) < 0.7 * sum(&fence) && sum(&fence) < sum(&whole), "{input}");
    }
    place.misused("render a.vti --out x.png --crop 1,2,3", "--crop");
    place.misused("render a.vti --out x.png --crop 0,1,0,1,0,1 --crop-regions moat", "inverted fence");
}

#[test]
fn what_is_missing_of_a_grid_has_a_colour() {
    let place = Place::new();
    place.write("whole.vti", &image(8, false));
    place.write("gap.vti", &image(8, true));
    let options = "--opacity 0%:0,100%:0.02 --unit-distance 1 --range -2:2";
    let without = drawn(&place, "gap.vti", options);
    let with = drawn(&place, "gap.vti", &format!("{options} --nan-color 0,1,0,0.9"));
    let green = |image: &Image| image.pixels.iter().filter(|p| p[1] > 0.4 && p[0] < 0.1 && p[2] < 0.1).count();
    assert!(green(&without) == 0 && green(&with) > 20, "{} {}", green(&without), green(&with));
    // Where nothing is missing it has no say.
    let [plain, named] = ["", "--nan-color 0,1,0"].map(|nan| drawn(&place, "whole.vti", &format!("{options} {nan}")));
    assert_eq!(plain.pixels, named.pixels);
    let steps =
        format!("{options} --nan-color 0,1,0,0.9 --reconstruction 2 --sampling 0.2 --integral second-order-polynomial");
    assert!(green(&drawn(&place, "gap.vti", &steps)) > 20);
}

#[test]
fn grids_are_lit_described_and_counted() {
    let place = Place::new();
    place.write("a.vti", &image(8, false));
    let plain = drawn(&place, "a.vti", "");
    let lit = drawn(&place, "a.vti", "--shade");
    let error = lit.compare(&plain).unwrap();
    assert!(error.max > 0.05, "{:.1e}", error.max);
    let Ran(code, out, err) = place.run("info a.vti");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    for part in [
        "image data, 343 cells, 8 x 8 x 8 points",
        "spacing  1 1 1",
        "x  0 to 7",
        "f32",
        "343  cells",
        "\"s\" if no other",
    ] {
        assert!(out.contains(part), "no {part} in {out}");
    }
    place.succeeds("histogram a.vti --out h.png --size 64x48");
    assert!(std::fs::read(place.path("h.png")).unwrap().starts_with(b"\x89PNG"));
}
