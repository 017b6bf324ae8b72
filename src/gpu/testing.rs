//! What tests of all engines need of a device.

use super::buffers::Chunks;
use super::{DeviceChoice, Gpu};
use crate::error::Result;
use wgpu::naga;

/// The device to test: `HALITE_TEST_DEVICE`, or the first. Without any, tests are skipped, loudly; with
/// `HALITE_REQUIRE_GPU=1` they fail.
pub(crate) fn choice() -> Option<DeviceChoice> {
    let name = std::env::var("HALITE_TEST_DEVICE").unwrap_or_else(|_| "0".into());
    let choice = DeviceChoice::Named(name);
    match Gpu::open(&choice) {
        Ok(_) => Some(choice),
        Err(e) if std::env::var("HALITE_REQUIRE_GPU").is_ok_and(|v| v == "1") => panic!("{e}"),
        Err(e) => {
            eprintln!("skipped: there is no GPU to test: {e}");
            None
        }
    }
}

pub(crate) fn gpu() -> Option<Gpu> {
    Gpu::open(&choice()?).unwrap()
}

/// How many bindings arrays have; none if the device does not hold them.
pub(crate) fn bindings<const N: usize>(chunks: Result<[&Chunks; N]>) -> Vec<usize> {
    chunks.map_or(vec![], |all| all.iter().map(|c| c.buffers.len()).collect())
}

pub(crate) fn validated(source: &str) -> naga::Module {
    let module = match naga::front::wgsl::parse_str(source) {
        Ok(module) => module,
        Err(e) => panic!("{}", e.emit_to_string(source)),
    };
    let flags = naga::valid::ValidationFlags::all();
    match naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&module) {
        Ok(_) => module,
        Err(e) => panic!("{}", e.emit_to_string(source)),
    }
}
