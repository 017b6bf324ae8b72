//! Options of a second variable and light, and the histogram by which widgets are placed.

use super::{Place, Ran, SCENE, cube};
use halite::image::Image;

fn drawn(place: &Place, arguments: &str) -> Image {
    place.succeeds(&format!("render {arguments} --out x.npy --device cpu"));
    Image::open(&place.path("x.npy")).unwrap()
}

/// Options say what keys of scenes do.
#[test]
fn options_are_the_keys_of_scenes() {
    let place = Place::new();
    place.write("plain.json", SCENE);
    let plain = drawn(&place, "plain.json");
    for (options, keys) in [
        ("--shade=0.1,0.6,0.4,12", r#""shade": {"ambient": 0.1, "diffuse": 0.6, "specular": 0.4, "power": 12}"#),
        ("--shade", r#""shade": {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "power": 20}"#),
        ("--silhouette 2", r#""silhouette": 2"#),
        // The gradient is (1, 1, 1) everywhere.
        ("--gradient-opacity 1:0,2:1", r#""gradient_opacity": [[1, 0], [2, 1]]"#),
        (
            "--gradient-array v --gradient-opacity 0%:0,100%:1",
            r#""gradient_array": "v", "gradient_opacity": [[0, 0], [2, 1]]"#,
        ),
        (
            "--widget gaussian:center=3,1.7:sigma=1,0.5:color=1,0,0:opacity=0.8 --widget uniform:s=*,2:color=0,1,0:opacity=0.3",
            r#""widgets": [{"type": "gaussian", "center": [3, 1.7], "sigma": [1, 0.5], "color": [1, 0, 0], "opacity": 0.8},
            {"type": "uniform", "s": [null, 2], "color": [0, 1, 0], "opacity": 0.3}]"#,
        ),
    ] {
        place.write("keys.json", &SCENE.replace("\"size\"", &format!("{keys}, \"size\"")));
        let (by_option, by_key) = (drawn(&place, &format!("plain.json {options}")), drawn(&place, "keys.json"));
        assert!(by_option.compare(&by_key).unwrap().max < 1e-6, "{options}");
        assert!(by_option.compare(&plain).unwrap().max > 1e-3, "{options} changes something");
    }
    // Without a scene, too: a widget of its own colour and opacity.
    let mesh = drawn(&place, "cube.vtu --size 40x30 --widget triangle:v0=0:period=2:axis=1,0");
    assert!(mesh.pixels.iter().any(|p| p[3] > 0.1));
}

#[test]
fn what_cannot_be_is_refused() {
    let place = Place::new();
    place.write("scene.json", SCENE);
    for (options, part) in [
        ("--shade=1,2", "2 numbers"),
        ("--shade=0,-1,0,1", "0 or more"),
        ("--silhouette -1", "0 or more"),
        ("--gradient-opacity 1", "scalar:opacity"),
        ("--widget blob", "\"blob\" is not known here; there is uniform"),
        ("--widget gaussian:center=1,2", "\"sigma\" is missing"),
        ("--widget uniform:center=1,2", "no key \"center\""),
        ("--widget triangle:v0=0:period=-2", "period: -2"),
        ("--widget uniform:opacity", "not KEY=VALUE"),
        ("--widget uniform:opacity=1:opacity=2", "twice"),
    ] {
        place.misused(&format!("render scene.json --out x.png {options}"), part);
    }
    place.fails("render scene.json --out x.png --device cpu --gradient-array v", &["--gradient-array", "--widget"]);
    place.fails("render scene.json --out x.png --device cpu --shade --blend maximum", &["a maximum along rays"]);
    place.fails("render cube.vtu --out x.png --device cpu --scalars c --shade", &["values of cells have no gradient"]);
    place.fails(
        "render scene.json --out x.png --device cpu --gradient-opacity 0:1 --gradient-array none",
        &["\"none\""],
    );
    let widget = "--widget uniform:opacity=0.5 --range 0:1";
    place.succeeds(&format!("render cube.vtu --out x.png --device cpu --size 8x8 {widget}"));
}

#[test]
fn a_histogram_shows_where_values_are() {
    let place = Place::new();
    let draw = |options: &str| {
        place.succeeds(&format!("histogram cube.vtu --size 60x40 --gradient-array v --out h.npy {options}"));
        Image::open(&place.path("h.npy")).unwrap()
    };
    // Scalars of 0 to 6 over lengths of 0 to 2: these are x, and x is at most the scalar.
    let plain = draw("");
    let [w, h] = plain.size;
    assert!(w > 60 && h > 40);
    let [left, top] = [56, 16];
    let at = |image: &Image, x: f64, y: f64| {
        let (i, j) = ((x * 60.0) as u32, ((1.0 - y) * 40.0) as u32);
        image.pixels[((top + j) * w + left + i) as usize]
    };
    let around = |x: f64, y: f64| {
        let near = (0..81).map(|i| [f64::from(i % 9 - 4) / 60.0, f64::from(i / 9 - 4) / 40.0]);
        near.map(|[i, j]| at(&plain, x + i, y + j)[0]).fold(0.0, f32::max)
    };
    assert!(around(0.5, 0.5) > 0.3, "much of it has the middle of both");
    assert_eq!(around(0.1, 0.85), 0.0, "nothing is longer than it is large");
    // A widget is drawn on it in its colour, where it is.
    let marked = draw("--widget uniform:s=0,3:g=1,2:color=1,0,0");
    let pixel = at(&marked, 0.1, 0.9);
    assert!(pixel[0] > 0.4 && pixel[1] == 0.0, "{pixel:?}");
    assert_eq!(at(&marked, 0.9, 0.9), at(&plain, 0.9, 0.9));
    place.succeeds("histogram cube.vtu --out h.png");
    let Ran(code, _, err) = place.run("histogram cube.vtu --out h.txt");
    assert!(code == Some(1) && err.contains(".png"), "{err}");
    place.fails("histogram cube.vtu --scalars c --out h.png", &["cube.vtu", "no gradient"]);
}

#[test]
fn info_says_how_long_the_gradient_is() {
    let told = Place::new().succeeds("info cube.vtu");
    assert!(told.contains("its gradient is 1.73205 to 1.73205 long"), "{told}");
}

/// Table 1 and the figures of Song et al., of a mesh whose name the paper has and of another.
#[test]
fn functions_of_two_variables_are_studied() {
    let place = Place::new();
    place.write("bluntfin_tet.vtu", &cube());
    let text = place.succeeds(
        "study bluntfin_tet.vtu --bivariate --also cube.vtu --out sheet.png --json study.json --frames 1 --size 48x40",
    );
    for part in ["1.27 0.16 0.91", "analytic", "10 pieces, texture", "silhouettes, published", "cube "] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(std::fs::read(place.path("sheet.png")).unwrap().starts_with(b"\x89PNG"));
    let study: serde_json::Value = serde_json::from_slice(&std::fs::read(place.path("study.json")).unwrap()).unwrap();
    let meshes = study["meshes"].as_array().unwrap();
    assert_eq!(meshes.len(), 2);
    let number = |row: &serde_json::Value, key: &str| row[key].as_f64().unwrap();
    for mesh in meshes {
        let [one, adaptive, analytic, texture, closed, ..] = mesh["variants"].as_array().unwrap().as_slice() else {
            panic!("{mesh}")
        };
        for exact in [one, adaptive, analytic] {
            assert!(number(exact, "max") < 1e-4, "{exact}");
        }
        assert!([texture, closed].iter().all(|pieces| number(pieces, "max") > 2.0 * number(adaptive, "max")), "{mesh}");
    }
    let figures = study["figures"].as_array().unwrap();
    let (off, exact): (Vec<_>, Vec<_>) = figures.iter().partition(|f| {
        let name = f["figure"].as_str().unwrap();
        name.contains("pieces") || name.contains("published")
    });
    assert_eq!((off.len(), exact.len()), (3, 13));
    assert!(exact.iter().all(|f| number(f, "max") < 1e-4), "{study}");
    assert!(off.iter().all(|f| number(f, "max") > 1e-5), "{study}");
    place.fails("study cube.vtu --bivariate --scalars c --out sheet.png", &["no gradient"]);
    place.misused("study cube.vtu --also cube.vtu --out sheet.png", "--bivariate");
}
