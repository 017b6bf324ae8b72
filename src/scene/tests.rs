use super::*;
use crate::transfer::{Convention, Emission};
use crate::view::Projection;

const SCENE: &str = r#"{
    "mesh": "sub/ball.vtu", "scalars": {"name": "s", "component": 1, "association": "cell"},
    "color": [[0, 0.2, 0.3, 0.8], [1, 0.9, 0.3, 0.1]], "opacity": [[0, 0], [1, 0.5]], "unit_distance": 0.1,
    "camera": {"position": [0, 0, 10], "focal_point": [0, 0, 0], "view_up": [0, 1, 0]},
    "size": [3, 5]
}"#;

/// [`SCENE`] with `from` replaced by `to`.
fn open(from: &str, to: &str) -> Result<Scene> {
    open_in(&tempfile::tempdir().unwrap(), from, to)
}

/// What opening [`SCENE`] with `from` replaced by `to` is refused with, without the name of the folder, which is random
/// and so may contain any short word.
fn refusal(from: &str, to: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let message = open_in(&dir, from, to).unwrap_err().to_string();
    message.replace(dir.path().to_str().unwrap(), "")
}

fn open_in(dir: &tempfile::TempDir, from: &str, to: &str) -> Result<Scene> {
    assert!(SCENE.contains(from), "{from}");
    let depths = (0..15).flat_map(|i| (i as f32).to_le_bytes());
    let header = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (5, 3), }";
    let mut npy = header.to_vec();
    npy.resize(127, b' ');
    npy.push(b'\n');
    npy.extend(depths);
    std::fs::write(dir.path().join("depth.npy"), npy).unwrap();
    let path = dir.path().join("scene.json");
    std::fs::write(&path, SCENE.replace(from, to)).unwrap();
    let scene = Scene::open(&path)?;
    assert_eq!(scene.mesh, dir.path().join("sub/ball.vtu"));
    Ok(scene)
}

/// [`SCENE`] with more keys.
fn with(keys: &str) -> Result<Scene> {
    open("\"mesh\"", &format!("{keys}, \"mesh\""))
}

#[test]
fn defaults() {
    let scene = open("", "").unwrap();
    let component = Some(Component::Index(1));
    let scalars = Scalars { name: "s".into(), association: Some(Association::Cell), component };
    assert_eq!(scene.scalars, scalars);
    assert_eq!(scene.camera.projection, Projection::Perspective { view_angle: 30.0 });
    assert_eq!((scene.transfer.convention(), scene.transfer.emission()), Default::default());
    assert!(scene.transfer.clamp());
    let (view, backdrop) = scene.view().unwrap();
    assert_eq!((view.size(), view.blend(), backdrop), ([3, 5], Blend::Composite, None));
    assert_eq!(view.ray(1, 2).t_max, f64::INFINITY);
}

#[test]
fn every_key_is_known() {
    let scene = with(
        r#""cells": "tets", "clamp": false, "convention": "opacity", "emission": "direct", "emission_scale": 0.3,
        "gradient_array": "g", "pixel_offset": [0.1, 0.2], "clipping_range": [0.5, 50], "blend": "maximum",
        "clipping_planes": [{"origin": [0, 0, 1], "normal": [0, 0, -1]}], "background": [0, 0.5, 1], "tol": 1e-9,
        "truth_of": "x", "engine": "traverse", "device": "cpu", "integral": {"form": "exact"}, "projection": {},
        "depth": {"file": "depth.npy", "kind": "ray"}, "opaque": []"#,
    )
    .unwrap();
    assert_eq!(scene.transfer.emission(), Emission::Direct { scale: 0.3 });
    assert_eq!(scene.transfer.convention(), Convention::Opacity);
    assert!(!scene.transfer.clamp());
    assert_eq!(scene.engine, Some(Engine::Traverse));
    let (view, _) = scene.view().unwrap();
    assert_eq!(view.blend(), Blend::Maximum);
    let ray = view.ray(2, 4);
    assert_eq!(ray.t_max, 14.0);
    assert!((ray.t_min * -ray.direction.z - 9.0).abs() < 1e-12);
    let parallel = open("\"camera\": {", "\"camera\": {\"projection\": \"parallel\", \"parallel_scale\": 2, ").unwrap();
    assert_eq!(parallel.camera.projection, Projection::Parallel { parallel_scale: 2.0 });
}

#[test]
fn opaque_objects_end_rays() {
    let scene = with(
        r#""background": [0.5, 0.5, 0.5], "depth": {"file": "depth.npy", "kind": "eye"}, "opaque": [
        {"type": "plane", "point": [0, 0, -2], "normal": [0, 0, 3], "color": [0, 0, 1]},
        {"type": "sphere", "center": [0, 0, 0], "radius": 1, "color": [1, 0, 0]}]"#,
    )
    .unwrap();
    let (view, backdrop) = scene.view().unwrap();
    let (mut sphere, backdrop) = (scene.clone(), backdrop.unwrap());
    // Depth 7, before the sphere; 14, behind the plane at 12.
    assert_eq!((view.ray(1, 2).t_max, backdrop[7]), (7.0, [0.5; 3]));
    let ray = view.ray(2, 4);
    assert!((ray.t_max * -ray.direction.z - 12.0).abs() < 1e-12);
    assert_eq!(backdrop[14], [0.0, 0.0, 1.0]);
    sphere.depth = None;
    let (view, backdrop) = sphere.view().unwrap();
    assert!((view.ray(1, 2).t_max - 9.0).abs() < 1e-12);
    assert_eq!(backdrop.unwrap()[7], [1.0, 0.0, 0.0]);
    // From inside, its far side.
    sphere.camera.position.z = 0.5;
    assert!((sphere.view().unwrap().0.ray(1, 2).t_max - 1.5).abs() < 1e-12);
}

#[test]
fn mistakes_are_named() {
    for (from, to, parts) in [
        ("\"mesh\"", "\"mash\"", vec!["mash", "no key", "mesh, scalars"]),
        ("\"view_up\"", "\"up\"", vec!["camera: there is no key \"up\""]),
        ("[1, 0.9, 0.3, 0.1]", "[1, 0.9, 0.3]", vec!["color[1]: a list of 4 is meant, and not of 3"]),
        ("[1, 0.9, 0.3, 0.1]", "[1, 0.9, 0.3, 0.1, 1]", vec!["color[1]: a list of 4 is meant, and not of 5"]),
        ("[1, 0.9, 0.3, 0.1]", "[1, 230, 0.3, 0.1]", vec!["color[1]", "0 to 1", "230"]),
        ("[1, 0.9, 0.3, 0.1]", "[1, -0.9, 0.3, 0.1]", vec!["color[1]", "-0.9"]),
        ("[1, 0.9, 0.3, 0.1]", "7", vec!["color[1]: a list of 4 is meant, and not 7"]),
        ("[[0, 0], [1, 0.5]]", "true", vec!["opacity: a list is meant, and not true"]),
        ("[[0, 0], [1, 0.5]]", "[[0, \"a\"], [1, 0.5]]", vec!["opacity[0][1]: a number is meant, and not \"a\""]),
        ("\"s\"", "7", vec!["scalars.name: a text is meant, and not 7"]),
        ("\"s\"", "\"\"", vec!["scalars.name", "empty"]),
        ("\"sub/ball.vtu\"", "\" \"", vec!["mesh", "empty"]),
        ("\"size\"", "\"device\": \"\", \"size\"", vec!["device", "empty"]),
        ("\"size\"", "\"device\": [1], \"size\"", vec!["device: the name or the index", "a list"]),
        ("\"size\"", "\"integral\": {\"kind\": 1}, \"size\"", vec!["integral: there is no key \"kind\""]),
        ("\"size\"", "\"projection\": 1, \"size\"", vec!["projection: an object is meant"]),
        ("\"size\"", "\"depth\": {\"file\": \"\"}, \"size\"", vec!["depth.file", "empty"]),
        ("\"component\": 1", "\"component\": \"x\"", vec!["scalars.component", "magnitude"]),
        ("\"cell\"", "\"edge\"", vec!["scalars.association", "edge", "point"]),
        (", \"opacity\": [[0, 0], [1, 0.5]]", "", vec!["color but no opacity"]),
        ("\"color\": [[0, 0.2, 0.3, 0.8], [1, 0.9, 0.3, 0.1]],", "", vec!["opacity but no color"]),
        ("\"unit_distance\": 0.1,", "", vec!["the key \"unit_distance\" is missing"]),
        ("\"unit_distance\": 0.1", "\"unit_distance\": 0", vec!["unit distance"]),
        ("[[0, 0], [1, 0.5]]", "[[1, 0], [0, 0.5]]", vec!["ascend"]),
        ("[3, 5]", "[0, 5]", vec!["0x5"]),
        ("[3, 5]", "[3.5, 5]", vec!["size[0]: a whole number from 0 is meant, and not 3.5"]),
        ("[3, 5]", "[3, -5]", vec!["size[1]: a whole number from 0 is meant, and not -5"]),
        ("\"view_up\": [0, 1, 0]", "\"view_up\": [0, 0, 1]", vec!["view up"]),
        ("\"size\"", "\"engine\": 1, \"size\"", vec!["engine"]),
        ("\"size\"", "\"emission_scale\": 1, \"size\"", vec!["emission_scale"]),
        ("\"size\"", "\"background\": [0, 0, 255], \"size\"", vec!["background", "255"]),
        ("\"size\"", "\"clipping_range\": [0, 1], \"size\"", vec!["clipping range"]),
        ("\"size\"", "\"depth\": {\"file\": \"no.npy\"}, \"size\"", vec!["no.npy"]),
        ("\"size\"", "\"opaque\": [{\"type\": \"cone\"}], \"size\"", vec!["opaque[0]", "cone"]),
        ("\"size\"", "\"opaque\": [{\"type\": \"sphere\", \"radius\": 1}], \"size\"", vec!["opaque[0]", "center"]),
        (
            "\"size\"",
            "\"opaque\": [{\"type\": \"sphere\", \"center\": [0, 0, 0]}], \"size\"",
            vec!["opaque[0]", "radius"],
        ),
        (
            "\"size\"",
            "\"opaque\": [{\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": \"x\"}], \"size\"",
            vec!["opaque[0].radius: a number is meant"],
        ),
        (
            "\"size\"",
            "\"opaque\": [{\"type\": \"plane\", \"point\": [0, 0, 0], \"normal\": [0, 0, 1], \"radius\": 1}], \"size\"",
            vec!["opaque[0]: a plane has no key \"radius\""],
        ),
        (
            "\"size\"",
            "\"opaque\": [{\"type\": \"plane\", \"point\": [0, 0, 0], \"normal\": [0, 0, 1], \"color\": [2, 0, 0]}], \"size\"",
            vec!["opaque[0].color", "2"],
        ),
        (
            "\"camera\": {",
            "\"camera\": {\"projection\": \"parallel\", \"parallel_scale\": -2, ",
            vec!["camera.parallel_scale", "-2"],
        ),
        (
            "\"camera\": {",
            "\"camera\": {\"projection\": \"parallel\", \"parallel_scale\": 0, ",
            vec!["camera.parallel_scale: 0"],
        ),
        ("\"camera\": {", "\"camera\": {\"parallel_scale\": 0, ", vec!["camera.parallel_scale: 0"]),
        ("\"camera\": {", "\"camera\": {\"view_angle\": 180, ", vec!["camera.view_angle: 180"]),
        (
            "\"camera\": {",
            "\"camera\": {\"projection\": \"fish\", ",
            vec!["camera.projection", "fish", "perspective, parallel"],
        ),
        ("\"size\"", "\"clamp\": 1, \"size\"", vec!["clamp: true or false is meant, and not 1"]),
        ("\"size\"", "\"blend\": 1, \"size\"", vec!["blend: one of composite, maximum is meant, and not 1"]),
        ("\"size\"", "\"mesh\": \"a\", \"size\"", vec!["line 5", "\"mesh\" is there twice"]),
        ("[3, 5]\n}", "[3, 5]\n} x", vec!["line 6, column 3", "after the scene"]),
        ("[3, 5]\n}", "[3, 5]", vec!["line 5, column", "the file ends"]),
        ("[3, 5]\n}", "[3, 5],\n}", vec!["line 6, column 1", "\",\" with nothing after it"]),
        ("\"unit_distance\": 0.1", "\"unit_distance\": ,", vec!["line 3, column", "a value is missing"]),
        ("\"unit_distance\": 0.1", "\"unit_distance\" 0.1", vec!["line 3, column", "\":\""]),
        ("\"unit_distance\": 0.1", "unit_distance: 0.1", vec!["line 3, column", "double quotes"]),
        ("\"unit_distance\": 0.1", "\"unit_distance\": nan", vec!["line 3, column", "no value"]),
        ("\"unit_distance\": 0.1", "\"unit_distance\": 1e999", vec!["line 3, column", "too large"]),
    ] {
        let message = refusal(from, to);
        assert!(parts.iter().all(|p| message.contains(p)), "{parts:?}: {message}");
        // One of the keys has a strange word in it.
        let message = message.replace("reconstruction", "");
        for strange in ["expected", "f64", "u32", "struct", "enum", "variant", "field", "invalid", "?:", "`", "JSON"] {
            assert!(!message.contains(strange), "{strange}: {message}");
        }
    }
    let mut scene = with(r#""depth": {"file": "depth.npy", "kind": "ray"}"#).unwrap();
    scene.size = [5, 3];
    assert!(scene.view().unwrap_err().to_string().contains("3x5"));
}

#[test]
fn lists_are_no_objects_and_null_is_no_value() {
    let refused = |keys: &str, parts: &[&str]| {
        let message = refusal("\"mesh\"", &format!("{keys}, \"mesh\""));
        assert!(parts.iter().all(|p| message.contains(p)), "{keys}: {message}");
    };
    refused(r#""projection": []"#, &["projection", "object", "list"]);
    refused(r#""projection": ["linear", "distance", "none"]"#, &["projection", "list"]);
    refused(r#""projection": null"#, &["projection", "null"]);
    refused(r#""integral": ["volume"]"#, &["integral", "list", "name"]);
    refused(r#""integral": {"form": "volume", "table": null}"#, &["integral.table", "null"]);
    refused(r#""clipping_planes": [[[0, 0, 1], [0, 0, 1]]]"#, &["clipping_planes[0]", "object"]);
    refused(r#""opaque": [["sphere", [0, 0, 0], 1, [1, 1, 1]]]"#, &["opaque[0]"]);
    refused(r#""depth": ["depth.npy", "ray"]"#, &["depth", "object"]);
    refused(r#""background": null"#, &["background", "null"]);
    let list = open(r#"{"name": "s", "component": 1, "association": "cell"}"#, r#"["s", "cell", 1]"#);
    assert!(list.unwrap_err().to_string().contains("scalars: an object"));
    with(r#""tol": null, "integral": "exact""#).unwrap();
}
