//! Builds the C++ library, the VTK module and the plugin for ParaView, and runs their tests in real windows: all that `cmake` and `ctest` do.

#![allow(clippy::expect_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what ran")]

use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
#[ignore = "needs CMake, a C++ compiler, VTK 9.1 and its Python, NumPy and Xvfb; ./test installs them and runs this"]
fn ctest_passes() {
    let built = build("vtk", &[]);
    pass(&built, &[]);
}

#[test]
#[ignore = "needs what VTK's tests need, ParaView 5.11 with its headers and Python, and Open MPI; ./test installs them and runs this"]
fn ctest_passes_in_paraview() {
    let folder =
        std::env::var("HALITE_PARAVIEW_DIR").expect("HALITE_PARAVIEW_DIR is the folder of paraview-config.cmake");
    let built = build("paraview", &[("HALITE_VTK", "OFF"), ("HALITE_PARAVIEW", "ON"), ("ParaView_DIR", &folder)]);
    pass(&built, &["-L", "paraview"]);
}

/// Builds all of a build tree in cargo's target folder, with these settings of CMake; where the tree is.
fn build(tree: &str, settings: &[(&str, &str)]) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // <target>/<profile>/deps/this
    let this = std::env::current_exe().expect("a test knows where it is");
    let profile = this.ancestors().nth(2).expect("a profile's folder");
    let target = profile.parent().expect("the target folder");
    let name = match profile.file_name().and_then(|n| n.to_str()).expect("a profile's name") {
        "debug" => "dev",
        name => name,
    };
    let triple = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut config = cmake::Config::new(root);
    config
        .out_dir(target.join(tree))
        .host(&triple)
        .target(&triple)
        .profile("Release")
        .define("HALITE_CARGO_PROFILE", name)
        .define("HALITE_CARGO_TARGET_DIR", target)
        .build_target("all");
    for (setting, value) in settings {
        config.define(setting, value);
    }
    config.build().join("build")
}

/// Fails unless the tests that CTest is asked for pass.
fn pass(tree: &Path, which: &[&str]) {
    let passed = Command::new("ctest")
        .args(["--output-on-failure", "--no-tests=error", "--test-dir"])
        .arg(tree)
        .args(which)
        .status()
        .expect("ctest comes with CMake");
    assert!(passed.success(), "ctest failed: {passed}");
}
