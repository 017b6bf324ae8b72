//! What the program reads: files, or standard input in their place.

use crate::progress;
use anyhow::{Context, Result, bail};
use halite::grid::Grid;
use halite::io::{DataSet, Source, Time};
use halite::mesh::Mesh;
use halite::scene::Scene;
use std::io::{IsTerminal, Read};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// What messages call it; files that it lists are looked for in the working directory.
const STANDARD: &str = "standard input";

/// Whether a path stands for standard input or output.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// All of standard input, which can be read once.
fn standard() -> Result<Arc<[u8]>> {
    static BYTES: OnceLock<Arc<[u8]>> = OnceLock::new();
    if let Some(bytes) = BYTES.get() {
        return Ok(Arc::clone(bytes));
    }
    let mut input = std::io::stdin().lock();
    if input.is_terminal() {
        bail!("{STANDARD} is a terminal: a mesh or a scene is expected there, such as halite info - < mesh.vtu");
    }
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).context(STANDARD)?;
    Ok(Arc::clone(BYTES.get_or_init(|| bytes.into())))
}

/// The file at `path`, opened.
pub fn source(path: &Path) -> Result<Source> {
    Ok(if is_standard(path) { Source::from_bytes(Path::new(STANDARD), standard()?)? } else { Source::open(path)? })
}

/// So many points of a grid are looked at to choose colours and a view.
const MOST_SAMPLES: usize = 1 << 16;

/// The mesh at `path`, at a time step, the first if nobody says; of a regular or rectilinear grid that itself, and a mesh
/// of some of its cells, which colours and views are chosen by.
pub fn mesh(path: &Path, time: Option<Time>) -> Result<(Mesh, Option<Grid>)> {
    match data_set(path, time)? {
        DataSet::Mesh(mesh) => Ok((mesh, None)),
        DataSet::Grid(grid) => {
            let coarse = grid.coarse(MOST_SAMPLES).and_then(Grid::into_mesh);
            Ok((coarse.with_context(|| path.display().to_string())?, Some(grid)))
        }
    }
}

fn data_set(path: &Path, time: Option<Time>) -> Result<DataSet> {
    progress::during("reading", |report| {
        let source = source(path)?;
        let step = time.map_or(Ok(0), |time| source.step(time))?;
        if let (None, [first, .., last]) = (time, source.times()) {
            let (path, count) = (path.display(), source.times().len());
            tracing::info!(
                "{path}: the first of {count} time steps is read ({first} to {last}); --time chooses another"
            );
        }
        Ok(source.read_data_set(step, report)?)
    })
}

/// The scene at `path`, if it is one and no mesh.
pub fn scene(path: &Path) -> Result<Option<Scene>> {
    if is_standard(path) {
        let bytes = standard()?;
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes).trim_ascii_start();
        return Ok(if text.first() == Some(&b'{') { Some(Scene::parse(Path::new(STANDARD), text)?) } else { None });
    }
    let is_scene = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    Ok(if is_scene { Some(Scene::open(path)?) } else { None })
}
