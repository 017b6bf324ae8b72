//! Any bytes as a mesh file: an error, or a mesh that can be split. `cargo fuzz run read -- -max_len=65536`
#![no_main]

use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use libfuzzer_sys::fuzz_target;
use std::path::PathBuf;
use std::sync::LazyLock;

/// In memory where there is such a place: each round writes it.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = PathBuf::from("/dev/shm");
    let folder = if folder.is_dir() { folder } else { std::env::temp_dir() };
    folder.join(format!("halite-fuzz-{}.vtu", std::process::id()))
});

fuzz_target!(|bytes: &[u8]| {
    if std::fs::write(&*FILE, bytes).is_err() {
        return;
    }
    let Ok(mesh) = halite::io::open(&FILE, &|_| ()) else { return };
    // Nothing that is read may be much larger than the file, but where it is packed.
    if let Ok(tetrahedra) = Tetrahedra::new(&mesh) {
        let points = tetrahedra.points(mesh.points());
        if tetrahedra.corners.len() < 20_000 {
            Faces::new(&points, &tetrahedra.corners);
        }
    }
});
