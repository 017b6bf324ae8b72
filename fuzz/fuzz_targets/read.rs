//! Any bytes as a mesh file: an error, or a mesh that can be split. `cargo fuzz run read -- -max_len=65536`
#![no_main]

use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let Ok(source) = halite::io::Source::from_bytes(Path::new("no such folder/mesh.vtu"), bytes) else { return };
    let last = source.times().len().saturating_sub(1);
    let Ok(mesh) = source.read(last, &|_| ()) else { return };
    // Nothing that is read may be much larger than the file, but where it is packed.
    if let Ok(tetrahedra) = Tetrahedra::new(&mesh) {
        let points = tetrahedra.points(mesh.points());
        if tetrahedra.corners.len() < 20_000 {
            Faces::new(&points, &tetrahedra.corners);
        }
    }
});
