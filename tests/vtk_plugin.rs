//! Builds the C++ library and the VTK module, and runs their tests in real windows: all that `cmake` and `ctest` do.

#![allow(clippy::expect_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what ran")]

use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "needs CMake, a C++ compiler, VTK 9.1 and its Python, NumPy and Xvfb; ./test installs them and runs this"]
fn ctest_passes() {
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
    let built = cmake::Config::new(root)
        .out_dir(target.join("vtk"))
        .host(&triple)
        .target(&triple)
        .profile("Release")
        .define("HALITE_CARGO_PROFILE", name)
        .define("HALITE_CARGO_TARGET_DIR", target)
        .build_target("all")
        .build();
    let passed = Command::new("ctest")
        .args(["--output-on-failure", "--test-dir"])
        .arg(built.join("build"))
        .status()
        .expect("ctest comes with CMake");
    assert!(passed.success(), "ctest failed: {passed}");
}
