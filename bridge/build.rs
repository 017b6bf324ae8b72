//! Compiles the C++ half of the bridge.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/lib.rs");
    println!("cargo:rerun-if-changed=../cpp/core/progress.h");
    cxx_build::bridge("src/lib.rs").include("../cpp/core").std("c++17").compile("halite_bridge");
}
