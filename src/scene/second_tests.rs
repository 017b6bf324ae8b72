//! What scenes say of a second variable, light and silhouettes.

use super::*;
use crate::transfer::bivariate::{OPEN, Shape, Sine, Source, Wave};
use crate::transfer::shading::{Cone, Highlight, Light, Origin, Shade, Shading};
use crate::transfer::{Bivariate, Convention};
use glam::DVec3;

const LOOK: &str = r#""color": [[0, 0.2, 0.3, 0.8]], "opacity": [[0, 0], [1, 0.5]]"#;

/// A scene with these keys besides those that every scene has; `table.npy` of 2 rows and 3 columns lies beside it.
fn with(keys: &str) -> Result<Scene> {
    let dir = tempfile::tempdir().unwrap();
    let header = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }";
    let mut npy = header.to_vec();
    npy.resize(127, b' ');
    npy.push(b'\n');
    npy.extend((0..24).flat_map(|i| (i as f32 / 32.0).to_le_bytes()));
    std::fs::write(dir.path().join("table.npy"), npy).unwrap();
    let text = format!(
        r#"{{{keys}, "mesh": "a.vtu", "scalars": {{"name": "s"}}, "unit_distance": 0.1, "size": [3, 5],
        "camera": {{"position": [0, 0, 10], "focal_point": [0, 0, 0], "view_up": [0, 1, 0]}}}}"#
    );
    Scene::parse(&dir.path().join("scene.json"), text.as_bytes())
}

#[test]
fn widgets_are_read() {
    let scene = with(
        r#""convention": "opacity", "gradient_array": "second", "widgets": [
        {"type": "uniform", "color": [1, 0, 0], "opacity": 0.5, "s": [1, null], "g": [null, 7]},
        {"type": "gaussian", "color": [0, 1, 0], "opacity": 0.4, "center": [1, 2], "sigma": [3, 4]},
        {"type": "triangle", "color": [0, 0, 1], "opacity": 0.3, "v0": 5, "period": 2, "floor": 0.25},
        {"type": "sinusoid", "color": [0, 0, 1], "opacity": 0.2, "v0": 5, "period": 2, "axis": [1, -3], "shape": "raised"}]"#,
    )
    .unwrap();
    assert_eq!(scene.gradient_array.as_deref(), Some("second"));
    assert_eq!(scene.transfer.convention(), Convention::Opacity);
    assert!(!scene.transfer.has_knots() && scene.transfer.shading().is_none());
    let Some(Source::Widgets(widgets)) = scene.transfer.bivariate().map(Bivariate::source) else { panic!("widgets") };
    assert_eq!(widgets[0].domain, [[1.0, f64::INFINITY], [f64::NEG_INFINITY, 7.0]]);
    assert_eq!((&widgets[0].shape, widgets[0].color, widgets[0].opacity), (&Shape::Uniform, [1.0, 0.0, 0.0], 0.5));
    assert_eq!(
        (&widgets[1].shape, widgets[1].domain),
        (&Shape::Gaussian { center: [1.0, 2.0], sigma: [3.0, 4.0] }, OPEN)
    );
    let wave = Wave { axis: [1.0, 0.0], start: 5.0, period: 2.0, floor: 0.25 };
    assert_eq!(widgets[2].shape, Shape::Triangle(wave));
    let wave = Wave { axis: [1.0, -3.0], floor: 0.0, ..wave };
    assert_eq!(widgets[3].shape, Shape::Sinusoid(wave, Sine::Raised));
}

#[test]
fn tables_and_functions_of_g_are_read() {
    let scene =
        with(r#""table2d": {"file": "table.npy", "s": [0, 3], "g": [0, 2]}, "gradient_opacity": [[1, 0], [2, 3]]"#);
    let transfer = scene.unwrap().transfer;
    let Some(Source::Table(table)) = transfer.bivariate().map(Bivariate::source) else { panic!("a table") };
    assert_eq!(table.size(), [3, 2]);
    assert_eq!(table.at([2.5, 1.5]), [20.0, 21.0, 22.0, 23.0].map(|x| x / 32.0));
    assert_eq!(transfer.bivariate().map(|b| b.factor(1.5)), Some(1.5));
    let scene = with(&format!(r#"{LOOK}, "gradient_opacity": [[1, 0.5]]"#)).unwrap();
    assert!(scene.transfer.has_knots() && !scene.transfer.is_of_one_variable());
    assert_eq!(scene.transfer.opacity_at(1.0), 0.5);
}

#[test]
fn light_is_read() {
    let scene = with(&format!(
        r#"{LOOK}, "silhouette": 2.5, "shade": {{"ambient": 0.1, "diffuse": 0.7, "specular": 0.2, "power": 20}}"#
    ));
    let transfer = scene.unwrap().transfer;
    let shading = transfer.shading().unwrap();
    assert_eq!((shading.silhouette(), shading.lights()), (Some(2.5), &[Light::default()][..]));
    let shade = Shade { ambient: 0.1, diffuse: 0.7, specular: 0.2, power: 20.0, ..Shade::default() };
    assert_eq!(shading.shade(), Some(&shade));
    let scene = with(&format!(
        r#"{LOOK}, "shade": {{"ambient": 0, "diffuse": 1, "specular": 0, "power": 1, "two_sided": false}}, "lights": [
        {{"type": "direction", "direction": [0, -1, 0], "color": [1, 0.5, 0], "intensity": 2}},
        {{"type": "position", "position": [1, 2, 3]}}, {{"type": "headlight", "intensity": 0.5}}]"#
    ));
    let transfer = scene.unwrap().transfer;
    let lights = transfer.shading().map(Shading::lights).unwrap();
    assert_eq!(
        lights[0],
        Light { origin: Origin::Direction(-DVec3::Y), color: [1.0, 0.5, 0.0], intensity: 2.0, ..Light::default() }
    );
    assert_eq!(lights[1], Light { origin: Origin::Position(DVec3::new(1.0, 2.0, 3.0)), ..Light::default() });
    assert_eq!(lights[2], Light { intensity: 0.5, ..Light::default() });
    let scene = with(&format!(
        r#"{LOOK}, "shade": {{"ambient": 0, "diffuse": 1, "specular": 0, "power": 1, "highlight": "reflected"}}, "lights": [
        {{"type": "position", "position": [1, 2, 3], "attenuation": [1, 0, 0.5],
          "cone": {{"direction": [0, 0, -1], "angle": 30, "exponent": 2}}}}]"#
    ));
    let transfer = scene.unwrap().transfer;
    let shading = transfer.shading().unwrap();
    assert_eq!(shading.shade().map(|s| s.highlight), Some(Highlight::Reflected));
    let cone = Some(Cone { axis: -DVec3::Z, angle: 30.0, exponent: 2.0 });
    let origin = Origin::Position(DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(shading.lights(), [Light { origin, attenuation: [1.0, 0.0, 0.5], cone, ..Light::default() }]);
}

#[test]
fn mistakes_are_named() {
    let shade = r#""shade": {"ambient": 0.1, "diffuse": 0.7, "specular": 0.2, "power": 20}"#;
    let wave = r#""color": [0, 0, 1], "opacity": 0.3, "v0": 5"#;
    for (keys, parts) in [
        (r#""widgets": []"#.to_owned(), vec!["widgets: there is none"]),
        (
            r#""widgets": [{"type": "blob", "color": [0, 0, 1], "opacity": 1}]"#.into(),
            vec!["widgets[0].type", "uniform"],
        ),
        (r#""widgets": [{"type": "uniform", "opacity": 1}]"#.into(), vec!["widgets[0]", "\"color\" is missing"]),
        (format!(r#""widgets": [{{"type": "triangle", {wave}}}]"#), vec!["widgets[0]: the key \"period\" is missing"]),
        (format!(r#""widgets": [{{"type": "triangle", {wave}, "period": -1}}]"#), vec!["widgets[0].period: -1"]),
        (
            format!(r#""widgets": [{{"type": "triangle", {wave}, "period": 1, "shape": "abs"}}]"#),
            vec!["widgets[0]: a widget of type \"triangle\" has no key \"shape\""],
        ),
        (
            format!(r#""widgets": [{{"type": "sinusoid", {wave}, "period": 1, "shape": "round"}}]"#),
            vec!["widgets[0].shape", "abs, positive, raised"],
        ),
        (
            format!(r#""widgets": [{{"type": "sinusoid", {wave}, "period": 1, "s": ["a", 1]}}]"#),
            vec!["widgets[0].s[0]: a number is meant"],
        ),
        (
            format!(r#""widgets": [{{"type": "sinusoid", {wave}, "period": 1, "s": null}}]"#),
            vec!["widgets[0].s", "null"],
        ),
        (r#""table2d": {"file": "table.npy", "s": [0, 3], "g": [2, 2]}"#.into(), vec!["table.npy", "range of g"]),
        (r#""table2d": {"file": "none.npy", "s": [0, 3], "g": [0, 2]}"#.into(), vec!["none.npy"]),
        (r#""table2d": {"file": "table.npy", "s": [0, 3]}"#.into(), vec!["table2d: the key \"g\" is missing"]),
        (format!(r#"{LOOK}, "gradient_opacity": [[1, 0], [0, 1]]"#), vec!["gradient_opacity", "ascend"]),
        (format!(r#"{LOOK}, "gradient_opacity": [[1, 0, 2]]"#), vec!["gradient_opacity[0]: a list of 2"]),
        (format!(r#"{LOOK}, "silhouette": -1"#), vec!["silhouette: -1"]),
        (format!(r#"{LOOK}, "shade": {{"ambient": 0.1}}"#), vec!["shade: the key \"diffuse\" is missing"]),
        (format!(r#"{LOOK}, "shade": {{"ambience": 0.1}}"#), vec!["shade: there is no key \"ambience\""]),
        (format!(r#"{LOOK}, "lights": []"#), vec!["lights", "without \"shade\""]),
        (format!(r#"{LOOK}, {shade}, "lights": [{{"type": "direction"}}]"#), vec!["lights[0]: the key \"direction\""]),
        (
            format!(r#"{LOOK}, {shade}, "lights": [{{"type": "headlight", "position": [1, 2, 3]}}]"#),
            vec!["lights[0]: a light of type \"headlight\" has no key \"position\""],
        ),
        (
            format!(r#"{LOOK}, {shade}, "lights": [{{"type": "direction", "direction": [0, 0, 0]}}]"#),
            vec!["lights[0].direction"],
        ),
        (format!(r#"{LOOK}, {shade}, "blend": "maximum""#), vec!["shade: a maximum"]),
        (format!(r#"{LOOK}, "silhouette": 1, "blend": "maximum""#), vec!["silhouette: a maximum"]),
        (
            r#""widgets": [{"type": "uniform", "color": [0, 0, 1], "opacity": 1}], "blend": "maximum""#.into(),
            vec!["widgets: a maximum"],
        ),
        (
            r#""widgets": [{"type": "uniform", "color": [0, 0, 1], "opacity": 1}],
            "table2d": {"file": "table.npy", "s": [0, 3], "g": [0, 2]}"#
                .into(),
            vec!["table2d: there are widgets"],
        ),
        (r#""gradient_array": """#.into(), vec!["gradient_array", "empty"]),
        (r#""gradient_opacity": [[0, 1]]"#.into(), vec!["neither color nor opacity"]),
    ] {
        let message = with(&keys).unwrap_err().to_string();
        assert!(parts.iter().all(|p| message.contains(p)), "{keys}: {message}");
    }
}
