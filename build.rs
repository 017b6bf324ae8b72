//! Compiles the C++ half of the bridge, with the feature `ffi`. Nothing else needs a C++ compiler.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "ffi")]
    {
        cxx_build::bridge("src/ffi.rs").include("cpp/core").std("c++17").compile("halite_bridge");
        println!("cargo:rerun-if-changed=src/ffi.rs");
        println!("cargo:rerun-if-changed=cpp/core/progress.h");
    }
}
