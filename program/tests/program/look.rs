//! What pictures look like that nobody described: framing, colours, opacities; and the options that change them.

use super::{ODD, Place, Ran, SCENE, cube};
use halite::image::Image;

/// The rows and columns of a picture that show the mesh, as shares of its height and width.
fn span(image: &Image) -> [f64; 2] {
    let [w, h] = image.size.map(|n| n as usize);
    let seen = |x: usize, y: usize| image.pixels[y * w + x][3] > 0.0;
    let columns: Vec<usize> = (0..w).filter(|&x| (0..h).any(|y| seen(x, y))).collect();
    let rows: Vec<usize> = (0..h).filter(|&y| (0..w).any(|x| seen(x, y))).collect();
    let share = |of: &[usize], n: usize| of.last().map_or(0.0, |last| (last - of[0] + 1) as f64 / n as f64);
    [share(&columns, w), share(&rows, h)]
}

fn drawn(place: &Place, input: &str, options: &str) -> Image {
    place.succeeds(&format!("render {input} --out x.npy --device cpu --size 80x60 {options}"));
    Image::open(&place.path("x.npy")).unwrap()
}

fn mean_opacity(image: &Image) -> f64 {
    let seen: Vec<f64> = image.pixels.iter().map(|p| f64::from(p[3])).filter(|a| *a > 0.0).collect();
    seen.iter().sum::<f64>() / seen.len() as f64
}

#[test]
fn a_mesh_fills_its_picture() {
    let place = Place::new();
    for options in [
        "",
        "--azimuth 70",
        "--elevation -50",
        "--scale 1,1,50",
        "--scale 30,1,1",
        "--view-angle 80",
        "--view-up 1,0,0",
    ] {
        let [wide, high] = span(&drawn(&place, "cube.vtu", options));
        assert!(wide.max(high) > 0.85 && wide < 1.0 && high < 1.0, "{options}: {wide} x {high}");
    }
    let [wide, high] = span(&drawn(&place, "cube.vtu", "--zoom 0.5"));
    assert!(wide.max(high) < 0.6);
    let opacity = mean_opacity(&drawn(&place, "cube.vtu", ""));
    assert!((0.45..0.8).contains(&opacity), "{opacity}");
}

/// A stretched mesh is as thick as it looks.
#[test]
fn lengths_are_those_that_are_seen() {
    let place = Place::new();
    let look =
        "--opacity 0:1,6:1 --unit-distance 4 --position 1,1,50 --focal-point 1,1,1 --view-up 0,1,0 --view-angle 3";
    let middle =
        |options: &str| f64::from(drawn(&place, "cube.vtu", &format!("{look} {options}")).pixels[30 * 80 + 40][3]);
    assert!((middle("") - (1.0 - (-0.5_f64).exp())).abs() < 1e-4);
    assert!((middle("--scale 1,1,5") - (1.0 - (-2.5_f64).exp())).abs() < 1e-4);
}

#[test]
fn a_mesh_without_arrays_is_drawn_in_one_color() {
    let place = Place::new();
    place.write("bare.vtu", &ODD.replace("CellData", "Nothing").replace("nan", "7"));
    let image = drawn(&place, "bare.vtu", "");
    let hue = |p: &[f32; 4]| [p[0] / p[3], p[1] / p[3], p[2] / p[3]];
    let seen: Vec<_> = image.pixels.iter().filter(|p| p[3] > 0.01).collect();
    assert!(seen.len() > 100);
    assert!(seen.iter().all(|p| (0..3).all(|k| (hue(p)[k] - hue(seen[0])[k]).abs() < 1e-3)));
    place.fails("render bare.vtu --out x.png --scalars s", &["\"s\"", "there is none"]);
    place.fails("render bare.vtu --out x.png --association cell", &["no array of cells"]);
    place.fails("render bare.vtu --out x.png --legend", &["--legend"]);
}

/// An array of four values is colours and opacities, one of two drives one by each.
#[test]
fn arrays_of_several_values_are_drawn_directly() {
    let place = Place::new();
    let more = |name: &str, n: usize, value: &dyn Fn(usize, usize) -> String| {
        let list: Vec<String> = (0..27 * n).map(|i| value(i / n, i % n)).collect();
        format!(
            "<DataArray type=\"UInt8\" Name=\"{name}\" NumberOfComponents=\"{n}\" format=\"ascii\">{}</DataArray>",
            list.join(" ")
        )
    };
    let rgba = more("tint", 4, &|_, k| [255, 51, 0, 102][k].to_string());
    let pair = more("two", 2, &|i, k| if k == 0 { (i % 3).to_string() } else { "5".into() });
    place.write("cube.vtu", &cube().replace("</PointData>", &format!("{rgba}{pair}</PointData>")));
    let image = drawn(&place, "cube.vtu", "--rgba tint");
    let middle = image.pixels[30 * 80 + 40];
    assert!(
        (middle[0] - middle[3]).abs() < 1e-4 && (middle[1] - 0.2 * middle[3]).abs() < 1e-4 && middle[2] < 1e-4,
        "{middle:?}"
    );
    assert!((0.45..0.9).contains(&mean_opacity(&image)), "{}", mean_opacity(&image));
    let image = drawn(&place, "cube.vtu", "--pair two --colormap grey --azimuth -30 --elevation -25");
    let at = |x: usize| image.pixels[30 * 80 + x][0] / image.pixels[30 * 80 + x][3];
    assert!(at(25) < 0.35 && at(55) > 0.65, "{} {}", at(25), at(55));
    place.fails("render cube.vtu --out x.png --rgba two", &["\"two\"", "2 components", "four"]);
    place.fails("render cube.vtu --out x.png --pair s", &["\"s\"", "two"]);
    place.fails("render cube.vtu --out x.png --rgba v", &["\"v\"", "3 components"]);
}

/// Where values are missing, a colour of its own stands in their place.
#[test]
fn missing_values_have_a_color() {
    let place = Place::new();
    let red =
        |image: &Image| image.pixels.iter().filter(|p| p[3] > 0.05 && p[0] > 0.9 * p[3] && p[1] < 0.1 * p[3]).count();
    for (input, options) in [("cube.vtu", "--scalars c"), ("holes.vtu", "--scalars s")] {
        // The corner point farthest along x, y and z has no value; nor has the eighth cell.
        let values = cube().rsplit_once(" 6 </DataArray>").map(|(a, b)| format!("{a} nan </DataArray>{b}"));
        place.write("holes.vtu", &values.unwrap());
        let options = format!("{options} --colormap grey --clip 1.5,1.5,1.5,1,1,1");
        let without = drawn(&place, input, &options);
        let with = drawn(&place, input, &format!("{options} --nan-color 1,0,0,20"));
        assert!(red(&without) == 0 && red(&with) > 50, "{input}: {}", red(&with));
        let blend = drawn(&place, input, &format!("{options} --nan-color 1,0,0,20 --blend maximum"));
        assert!(red(&blend) > 20);
    }
    assert_eq!(drawn(&place, "cube.vtu", "--scalars s --nan-color 1,0,0"), drawn(&place, "cube.vtu", "--scalars s"));
}

/// Colours and opacities over the logarithm.
#[test]
fn logarithms() {
    let place = Place::new();
    place.write("scene.json", SCENE);
    let look = "--log --range 0.01:100 --colormap grey --opacity 0%:5,100%:5";
    let middle = |options: &str| {
        let image = drawn(&place, "scene.json", &format!("--scalars s {options}"));
        let [r, _, _, a] = image.pixels[30 * 80 + 40];
        f64::from(r / a)
    };
    // Near the camera s is 4, of 4 decades from 0.01 up.
    let wanted = (4_f64.log10() + 2.0) / 4.0;
    assert!((middle(look) - wanted).abs() < 0.02, "{} {wanted}", middle(look));
    drawn(&place, "cube.vtu", "--log");
    place.fails("render cube.vtu --out x.png --log --range -1:1", &["logarithmic", "above 0"]);
}

#[test]
fn a_legend_is_drawn() {
    let place = Place::new();
    place.write("scene.json", SCENE);
    let read = |options: &str| {
        place.succeeds(&format!("render {options} --out x.png --device cpu --size 400x300"));
        image::open(place.path("x.png")).unwrap().into_rgb8()
    };
    for options in
        ["cube.vtu", "scene.json", "cube.vtu --log", "cube.vtu --background white", "cube.vtu --colormap jet_r"]
    {
        let (without, with) = (read(options), read(&format!("{options} --legend")));
        let differs = |x: u32, y: u32| without.get_pixel(x, y) != with.get_pixel(x, y);
        let count = (0..300).flat_map(|y| (0..400).map(move |x| (x, y))).filter(|&(x, y)| differs(x, y)).count();
        assert!((1000..60_000).contains(&count), "{options}: {count}");
        assert!((0..300).all(|y| (0..200).all(|x| !differs(x, y))), "{options}");
    }
    let Ran(code, _, err) = place.run("render cube.vtu --out x.png --device cpu --size 9x7 --legend");
    assert_eq!((code, err.as_str()), (Some(0), ""));
}
