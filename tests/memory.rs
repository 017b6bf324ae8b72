//! What the reader takes of memory: no more than the file justifies, whatever it says.
//!
//! A file justifies what an intact one of its size takes when read. So each damaged file, which has its bytes and a few
//! more, may take 1.5 times as much as the sound one at most, be it read or refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::print_stderr, reason = "a test tells what it measured")]
#![allow(unsafe_code, reason = "an allocator is unsafe by nature")]

#[path = "common/files.rs"]
mod files;

use files::{Codec, LEGACY, Mode, PLAIN, Piece, Random, Style, array, mutated, piece, write};
use halite::mesh::{Mesh, Values, generate};
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::sync::{LazyLock, Mutex};

/// Counts what is allocated, and the most at once.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn grow(bytes: usize) {
    PEAK.fetch_max(NOW.fetch_add(bytes, SeqCst) + bytes, SeqCst);
}

// SAFETY: the system's allocator does the work.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), SeqCst);
        unsafe { System.dealloc(p, layout) }
    }

    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Old and new may both be there for a while.
        grow(size);
        NOW.fetch_sub(layout.size(), SeqCst);
        unsafe { System.realloc(p, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// One test at a time, as all share the count.
static ALONE: Mutex<()> = Mutex::new(());

/// One thread reads: with more it is up to their pace how many arrays are unpacked at once.
static POOL: LazyLock<rayon::ThreadPool> =
    LazyLock::new(|| rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());

/// The most bytes that were allocated at once during `work`, above what was before.
fn peak<T>(work: impl FnOnce() -> T) -> (usize, T) {
    let before = NOW.load(SeqCst);
    PEAK.store(before, SeqCst);
    let result = work();
    (PEAK.load(SeqCst).saturating_sub(before), result)
}

fn read(path: &Path) -> (usize, halite::Result<Mesh>) {
    peak(|| POOL.install(|| halite::io::open(path, &|_| ())))
}

/// A lattice, so that arrays and not the reader's buffers make most of the memory.
fn lattice(n: usize) -> Piece {
    let mesh = generate::tetrahedra(n);
    Piece {
        points: Values::F64(mesh.points().iter().flat_map(glam::DVec3::to_array).collect()),
        connectivity: Values::I64(mesh.cells().connectivity.iter().map(|p| i64::from(*p)).collect()),
        offsets: Values::I64(mesh.cells().offsets[1..].iter().map(|o| *o as i64).collect()),
        types: Values::U8(mesh.cells().types.clone()),
        point_data: vec![array("s", 1, mesh.point_arrays()[0].values.clone())],
        cell_data: vec![array("c", 1, mesh.cell_arrays()[0].values.clone())],
    }
}

fn legacy(n: usize) -> Vec<u8> {
    let mesh = generate::tetrahedra(n);
    let (points, cells) = (mesh.points().len(), mesh.cells().len());
    let mut file =
        format!("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS {points} double\n")
            .into_bytes();
    file.extend(mesh.points().iter().flat_map(glam::DVec3::to_array).flat_map(f64::to_be_bytes));
    file.extend(format!("\nCELLS {cells} {}\n", 5 * cells).bytes());
    for c in 0..cells {
        file.extend(4u32.to_be_bytes());
        file.extend(mesh.cells().points(c).iter().flat_map(|p| p.to_be_bytes()));
    }
    file.extend(format!("\nCELL_TYPES {cells}\n").bytes());
    file.extend((0..cells).flat_map(|_| 10u32.to_be_bytes()));
    file.extend(format!("\nPOINT_DATA {points}\nSCALARS s double 1\nLOOKUP_TABLE default\n").bytes());
    file.extend((0..points).flat_map(|i| mesh.point_arrays()[0].values.get(i).to_be_bytes()));
    file
}

#[test]
fn damaged_files_take_no_more_than_sound_ones() {
    let _alone = ALONE.lock();
    let rounds = std::env::var("HALITE_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(600);
    let mut random = Random(std::env::var("HALITE_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(20_261_122));
    let mut sound = vec![LEGACY.as_bytes().to_vec(), legacy(12)];
    for mode in [Mode::Ascii, Mode::Inline, Mode::AppendedBase64, Mode::AppendedRaw] {
        let codecs = [Codec::ZLib, Codec::LZ4, Codec::Lzma];
        let packed = codecs.map(|codec| Style { mode, codec, block: Some(1 << 15), together: false, ..PLAIN });
        for style in [Style { mode, ..PLAIN }, Style { mode, wide: true, ..PLAIN }].into_iter().chain(packed) {
            sound.push(write(style, &[piece(), piece()]));
            sound.push(write(style, &[lattice(12)]));
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.vtu");
    let justified: Vec<usize> = sound
        .iter()
        .map(|bytes| {
            std::fs::write(&path, bytes).unwrap();
            // The first reading also sets up threads and buffers.
            read(&path).1.unwrap();
            read(&path).0
        })
        .collect();
    let (mut worst, mut read_well) = (0.0_f64, 0);
    for round in 0..rounds {
        let k = round % sound.len();
        // Half of them where sizes are: in the head, or at the start of what is appended.
        let bytes = if round / sound.len() % 2 == 0 {
            mutated(&sound[k], &mut random)
        } else {
            let mark = sound[k].windows(2).position(|w| w == b" _").unwrap_or(0);
            let end = sound[k].len().min(mark + 3000);
            [mutated(&sound[k][..end], &mut random), sound[k][end..].to_vec()].concat()
        };
        std::fs::write(&path, &bytes).unwrap();
        let (peak, mesh) = read(&path);
        read_well += usize::from(mesh.is_ok());
        let share = peak as f64 / justified[k] as f64;
        worst = worst.max(share);
        if share > 1.5 {
            let kept = std::env::temp_dir().join("halite-memory.vtu");
            std::fs::write(&kept, bytes).unwrap();
            panic!("round {round}: {peak} bytes, not {}, for {} ({:?})", justified[k], kept.display(), mesh.err());
        }
    }
    eprintln!("{rounds} damaged files, {read_well} read all the same: at most {worst:.2} of what the sound one takes");
}

/// The measure sees what it should, else nothing above means anything.
#[test]
fn memory_is_measured() {
    let _alone = ALONE.lock();
    assert!(peak(|| vec![1u8; 10 << 20]).0 >= 10 << 20);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.vtu");
    let own = lattice(20);
    std::fs::write(&path, write(Style { mode: Mode::AppendedRaw, ..PLAIN }, std::slice::from_ref(&own))).unwrap();
    let (bytes, mesh) = read(&path);
    let (points, cells) = (mesh.unwrap().points().len(), own.types.len());
    let kept = (24 + 8) * points + (16 + 8 + 1 + 8) * cells;
    assert!(bytes > kept && bytes < 3 * kept, "{bytes} bytes for {kept}");
}

/// Little that says it is much: refused before memory is taken.
#[test]
fn much_of_little_is_refused() {
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.vtu");
    let refused = |bytes: &[u8], most: usize, expected: &str| {
        std::fs::write(&path, bytes).unwrap();
        let (peak, mesh) = read(&path);
        // An array that is too much is left out, and where a grid needs it there is none.
        let error = mesh.map_or_else(
            |error| error.to_string(),
            |mesh| format!("{:?} {:?}", mesh.point_attributes().left_out, mesh.cell_attributes().left_out),
        );
        assert!(error.contains(expected), "{error}");
        assert!(peak < most, "{peak} bytes: {error}");
    };
    // Two thousand arrays that are one and the same.
    let style = Style { mode: Mode::AppendedRaw, ..PLAIN };
    let text = write(style, &[lattice(20)]);
    let at = text.windows(12).position(|w| w == b"</PointData>").unwrap();
    let one = r#"<DataArray type="Float64" Name="s" NumberOfComponents="1" format="appended" offset="0"/>"#;
    let many = [&text[..at], one.repeat(2000).as_bytes(), &text[at..]].concat();
    refused(&many, 16 * many.len(), "shares its bytes with so many arrays");
    // A few may.
    let few = [&text[..at], one.repeat(5).as_bytes(), &text[at..]].concat();
    std::fs::write(&path, few).unwrap();
    assert_eq!(read(&path).1.unwrap().point_arrays().len(), 6);
    // One face of many points, of which each of many polyhedra has many.
    let points = vec!["0 0 0"; 1000].join(" ");
    let ids: Vec<String> = (0..1000).map(|i| i.to_string()).collect();
    let cells = |n: usize, text: &str| vec![text; n].join(" ");
    let offsets: Vec<String> = (1..=1000).map(|c| (1000 * c).to_string()).collect();
    let part = |name: &str, kind: &str, text: &str| {
        format!(r#"<DataArray type="{kind}" Name="{name}" format="ascii">{text}</DataArray>"#)
    };
    let faces = [
        part("connectivity", "Int64", &cells(1000, "0")),
        part("offsets", "Int64", &(1..=1000).map(|c| c.to_string()).collect::<Vec<_>>().join(" ")),
        part("types", "UInt8", &cells(1000, "42")),
        part("face_connectivity", "Int64", &ids.join(" ")),
        part("face_offsets", "Int64", "1000"),
        part("polyhedron_to_faces", "Int64", &cells(1_000_000, "0")),
        part("polyhedron_offsets", "Int64", &offsets.join(" ")),
    ];
    let file = format!(
        r#"<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="1000" NumberOfCells="1000"><Points>
        <DataArray type="Float32" NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
        <Cells>{}</Cells></Piece></UnstructuredGrid></VTKFile>"#,
        faces.concat()
    );
    refused(file.as_bytes(), 16 * file.len(), "a face has two sides");
    // A tag that does not end in a file of 20 MB: it is given up after 256 KiB.
    let at = text.windows(8).position(|w| w == b"<Points>").unwrap();
    refused(&[&text[..at], b"<Points a=\"", &vec![b'x'; 20 << 20][..]].concat(), 4 << 20, "a tag has more than");
    // Sizes that nobody has, and that the file's own numbers agree on.
    let lie = |from: &str, to: &str| LEGACY.replacen(from, to, 1).into_bytes();
    for file in [
        lie("POINTS 5", "POINTS 4000000000"),
        lie("CELLS 2 10", "CELLS 2 4000000000"),
        lie("T 1 5", "T 1000000 1000000"),
    ] {
        refused(&file, 1 << 20, "at byte");
    }
    let lie = lie("ASCII", "BINARY");
    refused(&lie, 1 << 20, "at byte");
}

/// Opens a file and splits its cells, as a program does that has only so much address space, and says how that went.
#[cfg(target_os = "linux")]
fn limited_child(path: &Path) {
    // Threads take memory that nobody asks for.
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global().unwrap();
    rayon::broadcast(|_| ());
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:")).unwrap().trim();
    eprintln!("SIZE: {}", size.strip_suffix(" kB").unwrap());
    let split = halite::io::open(path, &|_| ()).and_then(|mesh| halite::mesh::cells::Tetrahedra::new(&mesh));
    match split {
        Ok(tetrahedra) => eprintln!("RESULT: {} tetrahedra", tetrahedra.corners.len()),
        Err(halite::Error::NoMemory(why)) => eprintln!("RESULT: no memory: {why}"),
        Err(error) => eprintln!("RESULT: another error: {error}"),
    }
}

/// With little memory a file is read, or there is an error: the process goes on.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_an_error() {
    const CHILD: &str = "HALITE_LIMITED_CHILD";
    if let Some(path) = std::env::var_os(CHILD) {
        limited_child(Path::new(&path));
        return;
    }
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().unwrap();
    let run = |path: &Path, kilobytes: Option<u64>| {
        let limit = kilobytes.map_or("unlimited".to_owned(), |kb| kb.to_string());
        let output = std::process::Command::new("sh")
            .args(["-c", "ulimit -v $0; exec \"$@\"", &limit])
            .arg(std::env::current_exe().unwrap())
            .args(["--exact", "memory_that_is_not_there_is_an_error", "--nocapture", "--test-threads=1"])
            .envs([("MALLOC_ARENA_MAX", "1"), (CHILD, path.to_str().unwrap())])
            .output()
            .unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{} in {limit} kB: {}, {told}", path.display(), output.status);
        let after = |key: &str| told.lines().find_map(|line| line.strip_prefix(key)).map(str::to_owned);
        (after("SIZE: ").unwrap(), after("RESULT: ").unwrap_or_else(|| panic!("{told}")))
    };
    let (own, bricks) = (lattice(34), generate::hexahedra(40));
    let bricks = Piece {
        points: Values::F32(bricks.points().iter().flat_map(|p| p.to_array().map(|x| x as f32)).collect()),
        connectivity: Values::I64(bricks.cells().connectivity.iter().map(|p| i64::from(*p)).collect()),
        offsets: Values::I64(bricks.cells().offsets[1..].iter().map(|o| *o as i64).collect()),
        types: Values::U8(bricks.cells().types.clone()),
        point_data: vec![array("s", 1, bricks.point_arrays()[0].values.clone())],
        cell_data: vec![],
    };
    let raw = Style { mode: Mode::AppendedRaw, ..PLAIN };
    let packed = |codec| Style { codec, block: Some(1 << 22), ..raw };
    let files = [
        ("raw.vtu", write(raw, std::slice::from_ref(&bricks))),
        ("pieces.vtu", write(raw, &[lattice(20), lattice(20), own.clone()])),
        ("text.vtu", write(Style { mode: Mode::Ascii, ..PLAIN }, std::slice::from_ref(&own))),
        ("zlib.vtu", write(packed(Codec::ZLib), std::slice::from_ref(&own))),
        ("lz4.vtu", write(packed(Codec::LZ4), std::slice::from_ref(&own))),
        ("binary.vtk", legacy(34)),
    ];
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let (size, result) = run(&path, None);
        assert!(result.ends_with(" tetrahedra"), "{name}: {result}");
        let size: u64 = size.parse().unwrap();
        let (mut refused, mut read) = (0, 0);
        for megabytes in [4, 10, 16, 18, 22, 26, 32, 40, 55, 150] {
            match run(&path, Some(size + megabytes * 1024)).1 {
                told if told == result => read += 1,
                told if told.starts_with("no memory: there is not enough memory for ") => refused += 1,
                told => panic!("{name} with {megabytes} MB: {told}"),
            }
        }
        eprintln!("{name}: with too little memory refused {refused} times, read {read} times");
        assert!(refused > 1 && read > 0, "{name}");
    }
}
