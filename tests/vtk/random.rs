//! Random legacy files, whose sections come in any sequence: Halite reads what was written, and what VTK reads.

use super::{differences, dumps, pythons, script};
use halite::mesh::{Array, Values};
use std::fmt::Write as _;
use std::path::Path;

#[path = "../common/files.rs"]
mod files;
use files::Random;

/// Cell types and their points.
const KINDS: [(u8, usize); 9] = [(1, 1), (3, 2), (5, 3), (9, 4), (10, 4), (11, 8), (12, 8), (13, 6), (14, 5)];

const TYPES: [&str; 12] = [
    "char",
    "unsigned_char",
    "short",
    "unsigned_short",
    "int",
    "unsigned_int",
    "vtktypeint64",
    "vtktypeuint64",
    "float",
    "double",
    "bit",
    "vtkIdType",
];

/// A file being written, and what it holds.
struct Writer<'r> {
    random: &'r mut Random,
    binary: bool,
    bytes: Vec<u8>,
    /// Arrays of points and cells.
    arrays: [Vec<Array>; 2],
    names: usize,
}

impl Writer<'_> {
    fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.random.below(list.len())]
    }

    fn chance(&mut self, of: usize) -> bool {
        self.random.below(of) == 0
    }

    fn line(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
        self.bytes.push(b'\n');
    }

    /// Keywords in small letters, now and then.
    fn keyword(&mut self, text: &str) {
        let text = if self.chance(8) { text.to_ascii_lowercase() } else { text.to_owned() };
        self.bytes.extend(text.bytes());
    }

    /// Writes small numbers of a type, and returns them.
    fn numbers(&mut self, kind: &str, count: usize) -> Values {
        let numbers: Vec<u8> = (0..count).map(|_| self.random.below(100) as u8).collect();
        macro_rules! values {
            ($variant:ident $T:ty, $unit:expr) => {
                Values::$variant(numbers.iter().map(|n| <$T>::from(*n as i8) * $unit).collect())
            };
        }
        let values = match kind {
            "char" => values!(I8 i8, 1),
            "unsigned_char" => Values::U8(numbers),
            "short" => values!(I16 i16, 300),
            "unsigned_short" => Values::U16(numbers.iter().map(|n| u16::from(*n) * 600).collect()),
            "int" => values!(I32 i32, -70_000),
            "unsigned_int" => Values::U32(numbers.iter().map(|n| u32::from(*n) * 40_000_000).collect()),
            "vtktypeint64" => values!(I64 i64, -7_000_000_000),
            "vtktypeuint64" => Values::U64(numbers.iter().map(|n| u64::from(*n) << 44).collect()),
            "float" => values!(F32 f32, -0.125),
            "double" => values!(F64 f64, 0.0625),
            "bit" => Values::U8(numbers.iter().map(|n| n % 2).collect()),
            _ => values!(I64 i64, 3),
        };
        self.write(kind, &values);
        values
    }

    fn write(&mut self, kind: &str, values: &Values) {
        let per_line = 1 + self.random.below(12);
        if !self.binary {
            let mut text = String::new();
            for i in 0..values.len() {
                write!(text, "{}{}", values.get(i), if (i + 1) % per_line == 0 { "\n" } else { " " }).unwrap();
            }
            self.line(&text);
            return;
        }
        let (_, bytes, _) = files::told(values, true);
        match kind {
            "bit" => {
                for bits in bytes.chunks(8) {
                    self.bytes.push((0..8).fold(0, |byte, i| byte << 1 | bits.get(i).copied().unwrap_or(0)));
                }
            }
            // Files hold these in 32 bits.
            "vtkIdType" => self.bytes.extend(bytes.chunks_exact(8).flat_map(|word| word[4..].to_vec())),
            _ => self.bytes.extend(bytes),
        }
        self.bytes.push(b'\n');
    }

    fn name(&mut self) -> String {
        self.names += 1;
        let start = self.one_of(&["a", "Temp", "x_1", "p'", "CELLS", "nan"]);
        format!("{start}{}", self.names)
    }

    fn description(&mut self) {
        if self.chance(6) {
            self.line("METADATA\nINFORMATION 1\nNAME UNITS_LABEL LOCATION vtkDataArray\nDATA m\n");
        }
    }

    fn keep(&mut self, of: usize, name: String, components: usize, values: Values) {
        self.arrays[of].push(Array { name, components, values });
        self.description();
    }

    /// A field of arrays; of points (0) or cells (1), or of the file, which nobody keeps.
    fn field(&mut self, of: Option<usize>, tuples: usize) {
        let count = 1 + self.random.below(3);
        self.keyword("FIELD ");
        self.line(&format!("FieldData {count}"));
        for _ in 0..count {
            let (name, components, kind) = (self.name(), self.one_of(&[1, 1, 2, 3, 4, 7]), self.one_of(&TYPES));
            let tuples = if of.is_none() { self.random.below(4) + 1 } else { tuples };
            self.line(&format!("{name} {components} {tuples} {kind}"));
            let values = self.numbers(kind, components * tuples);
            match of {
                Some(of) => self.keep(of, name, components, values),
                None => self.description(),
            }
        }
    }

    /// Data of points (0) or cells (1): as many arrays as come.
    fn data(&mut self, of: usize, tuples: usize) {
        self.keyword(["POINT_DATA ", "CELL_DATA "][of]);
        self.line(&tuples.to_string());
        for _ in 0..self.random.below(4) {
            let name = self.name();
            let kind = self.one_of(&TYPES);
            let keyword = self.one_of(&[
                "SCALARS",
                "SCALARS",
                "VECTORS",
                "TENSORS",
                "COLOR_SCALARS",
                "NORMALS",
                "TEXTURE_COORDINATES",
                "FIELD",
                "GLOBAL_IDS",
                "TENSORS6",
            ]);
            if keyword == "FIELD" {
                self.field(Some(of), tuples);
                continue;
            }
            self.keyword(keyword);
            let (kind, components) = match keyword {
                "SCALARS" => {
                    let components = self.random.below(4) + 1;
                    let said = if components == 1 && self.chance(2) { String::new() } else { format!(" {components}") };
                    self.line(&format!(" {name} {kind}{said}"));
                    let table = if self.chance(4) { "own" } else { "default" };
                    self.line(&format!("LOOKUP_TABLE {table}"));
                    let values = self.numbers(kind, tuples * components);
                    self.keep(of, name, components, values);
                    if table == "own" {
                        self.line("LOOKUP_TABLE own 2");
                        let shares = if self.binary { "unsigned_char" } else { "float" };
                        let colors = if self.binary {
                            Values::U8(vec![0, 10, 32, 255, 1, 2, 3, 4])
                        } else {
                            Values::F32(vec![0.5; 8])
                        };
                        self.write(shares, &colors);
                    }
                    continue;
                }
                "COLOR_SCALARS" => {
                    let components = self.random.below(4) + 1;
                    self.line(&format!(" {name} {components}"));
                    let bytes: Vec<u8> = (0..tuples * components).map(|_| self.random.below(256) as u8).collect();
                    if self.binary {
                        self.write("unsigned_char", &Values::U8(bytes.clone()));
                    } else {
                        self.write(
                            "float",
                            &Values::F64(bytes.iter().map(|b| (f64::from(*b) + 1e-6) / 255.0).collect()),
                        );
                    }
                    self.keep(of, name, components, Values::U8(bytes));
                    continue;
                }
                "TEXTURE_COORDINATES" => {
                    let components = self.random.below(3) + 1;
                    self.line(&format!(" {name} {components} {kind}"));
                    (kind, components)
                }
                _ => {
                    let kind = if keyword == "GLOBAL_IDS" { "vtkIdType" } else { kind };
                    self.line(&format!(" {name} {kind}"));
                    (
                        kind,
                        match keyword {
                            "GLOBAL_IDS" => 1,
                            "TENSORS" => 9,
                            "TENSORS6" => 6,
                            _ => 3,
                        },
                    )
                }
            };
            let values = self.numbers(kind, tuples * components);
            self.keep(of, name, components, values);
        }
    }
}

/// What a file holds: points, types, points of cells, and arrays of points and cells.
struct Held(Values, Vec<u8>, Vec<u32>, [Vec<Array>; 2]);

/// A random file. `usual` is whether points and cells come in the sequence of VTK's writer, as its reader may ask.
fn random(random: &mut Random) -> (Vec<u8>, Held) {
    let binary = random.below(2) == 0;
    let modern = random.below(3) == 0;
    let mut w = Writer { random, binary, bytes: vec![], arrays: [vec![], vec![]], names: 0 };
    let version = if modern { "5.1" } else { w.one_of(&["2.0", "3.0", "4.2"]) };
    w.line(&format!("# vtk DataFile Version {version}\nrandom\n{}", if binary { "BINARY" } else { "ASCII" }));
    w.line("DATASET UNSTRUCTURED_GRID");
    let (points, cells) = (8 + w.random.below(12), 1 + w.random.below(9));
    let (mut types, mut lists) = (vec![], vec![]);
    for _ in 0..cells {
        let (kind, n) = w.one_of(&KINDS);
        types.push(kind);
        lists.push((0..n).map(|_| w.random.below(points) as i32).collect::<Vec<_>>());
    }
    if w.chance(3) {
        w.field(None, 0);
    }
    let kind = w.one_of(&["float", "double"]);
    w.keyword("POINTS ");
    w.line(&format!("{points} {kind}"));
    let coordinates = w.numbers(kind, 3 * points);
    w.description();
    let connectivity: Vec<i32> = lists.concat();
    if modern {
        w.line(&format!("CELLS {} {}\nOFFSETS vtktypeint64", cells + 1, connectivity.len()));
        let mut ends = vec![0i64];
        ends.extend(lists.iter().scan(0, |end, list| {
            *end += list.len() as i64;
            Some(*end)
        }));
        w.write("", &Values::I64(ends));
        w.line("CONNECTIVITY vtktypeint64");
        w.write("", &Values::I64(connectivity.iter().map(|p| i64::from(*p)).collect()));
    } else {
        let list: Vec<i32> = lists.iter().flat_map(|list| [vec![list.len() as i32], list.clone()].concat()).collect();
        w.keyword("CELLS ");
        w.line(&format!("{cells} {}", list.len()));
        w.write("", &Values::I32(list));
    }
    w.line(&format!("CELL_TYPES {cells}"));
    w.write("", &Values::I32(types.iter().map(|kind| i32::from(*kind)).collect()));
    for _ in 0..w.random.below(5) {
        let of = w.random.below(2);
        w.data(of, [points, cells][of]);
    }
    let connectivity = connectivity.iter().map(|p| *p as u32).collect();
    (w.bytes, Held(coordinates, types, connectivity, w.arrays))
}

#[test]
fn random_legacy_files() {
    const FILES: usize = 1500;
    let folder = tempfile::tempdir().unwrap();
    let mut generator = Random(17_171_717);
    let (mut paths, mut wrong) = (vec![], vec![]);
    for i in 0..FILES {
        let (bytes, held) = random(&mut generator);
        let path = folder.path().join(format!("{i}.vtk"));
        std::fs::write(&path, &bytes).unwrap();
        match halite::io::open(&path, &|_| ()) {
            Err(error) => wrong.push(error.to_string()),
            Ok(mesh) => {
                let points: Vec<f64> = mesh.points().iter().flat_map(glam::DVec3::to_array).collect();
                let Held(coordinates, types, connectivity, arrays) = held;
                let geometry = points == super::floats(&coordinates)
                    && mesh.cells().types == types
                    && mesh.cells().connectivity == connectivity;
                let found = [mesh.point_arrays(), mesh.cell_arrays()];
                if !geometry || arrays != found {
                    let own = found.iter().flat_map(|own| own.iter()).collect::<Vec<_>>();
                    let lost = arrays.iter().flatten().filter(|array| !own.contains(array)).collect::<Vec<_>>();
                    let known = [mesh.point_attributes(), mesh.cell_attributes()];
                    let why = known.map(|known| format!("{:?}", known.left_out)).concat();
                    let what = format!("{i}.vtk is not read as it was written: geometry {geometry}, {lost:?}, {why}");
                    wrong.push(what.chars().take(600).collect());
                }
            }
        }
        paths.push(path);
    }
    for (python, vtk) in pythons() {
        let (mut equal, dump) = (0, folder.path().join("dump"));
        assert!(script(&python).arg("dump").arg(&dump).args(&paths).status().unwrap().success());
        for (path, dump) in dumps(&std::fs::read(&dump).unwrap()) {
            if dump.iter().any(|(words, _)| words[0] == "error") {
                continue;
            }
            let mesh = halite::io::open(&path, &|_| ()).unwrap();
            let differs = differences(&mesh, &dump, false);
            equal += usize::from(differs.is_empty());
            if !differs.is_empty() {
                wrong.push(format!("{}, {vtk}: {}", name(&path), differs.join(", ")));
            }
        }
        eprintln!("{equal} of {FILES} random legacy files are read as {vtk} reads them");
        assert!(equal > FILES / 2, "{vtk} reads few of them");
    }
    assert!(wrong.is_empty(), "{} differ:\n{}", wrong.len(), wrong[..wrong.len().min(30)].join("\n"));
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
