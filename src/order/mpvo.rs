//! Order of a whole mesh by its faces: of all rays of a view at once.
//!
//! Williams' meshed polyhedra visibility order (1992) by Kahn's algorithm, with the edges of XMPVO (Silva, Mitchell & Williams 1998)
//! where rays leave the mesh and enter it again. Along each pixel's ray consecutive cells share a face or such a gap, so the order is
//! right for all pixels, unless cells overlap or hide each other in a circle; both are found, and told.

use super::facing::Source;
use super::gaps::Rays;
use super::graph::{Edge, Graph};
use super::screen::Lens;
use super::{MOST_PARTS, PART, Provenance, VisibilityOrder, convex, cycles, published};
use crate::geometry::TetMesh;
use crate::mesh::faces::OUTWARD;
use crate::order::depth::HIDDEN;
use crate::view::View;
use rayon::prelude::*;

/// The most columns or rows of an image in which rays are asked: places are kept in 16 bits.
const MOST_PIXELS: u32 = 1 << 15;

/// How the order of a mesh is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Kahn's algorithm over shared faces and gaps, nearest first, cut where the fewest pixels see it.
    Mpvo,
    /// The same over shared faces alone: right for convex meshes, to which it is the same.
    Faces,
    /// Depth first over shared faces (Williams 1992): right for convex meshes.
    Convex,
    /// The same from the farthest cell without one before it on, by the distances of their centres (Williams' MPVONC, 1992).
    Nonconvex,
    /// The same with gaps (Silva, Mitchell & Williams 1998).
    Xmpvo,
    /// By the distances of their centres alone.
    Depth,
}

/// The cells of a mesh in the order of a view.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sequence {
    /// All cells, from front to back.
    pub cells: Vec<u32>,
    /// Groups of cells that hide each other in a circle, and how many cells these are.
    pub cycles: u32,
    /// See [`Self::cycles`].
    pub cycle_cells: u64,
    /// Neighbours, and cells with a gap between them, that are in the wrong sequence, as the circles had to be cut.
    pub cuts: u64,
    /// Pixels whose rays are in several cells at a time, so that these have no order, or of which rounding makes this; none are
    /// looked for in a convex mesh.
    pub overlapping: u64,
    /// The pixels, row by row and ascending, that see [`Self::cuts`]: their cells are not in order.
    pub disordered: Vec<u32>,
}

/// Finds orders; keeps what it learned of the mesh.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mpvo {
    convex: Option<bool>,
}

impl Mpvo {
    /// Whether the last mesh was found to be convex, by an order that asked.
    pub fn is_convex(&self) -> bool {
        self.convex == Some(true)
    }

    /// The order of a mesh whose cells know their neighbours, on the current rayon pool. The result does not depend on its number of
    /// threads.
    pub fn sequence(&mut self, geometry: &TetMesh, view: &View, rule: Rule) -> Sequence {
        let source = Source::new(geometry, view);
        if rule == Rule::Depth {
            return Sequence { cells: published::by_depth(geometry, source), ..Sequence::default() };
        }
        let asks_rays = matches!(rule, Rule::Mpvo | Rule::Xmpvo)
            && view.size().iter().all(|&n| n <= MOST_PIXELS)
            && !*self.convex.get_or_insert_with(|| convex::is_convex(geometry));
        let lens = Lens::new(geometry, view);
        let rays = lens.as_ref().filter(|_| asks_rays).map(|lens| Rays::new(geometry, lens));
        let (gaps, overlapping) = rays.as_ref().map(Rays::gaps).unwrap_or_default();
        let mut graph = Graph::new(geometry, source, gaps);
        if !matches!(rule, Rule::Mpvo | Rule::Faces) {
            let cells = published::depth_first(&graph, geometry, source, rule);
            return Sequence { cells, overlapping: overlapping.len() as u64, ..Sequence::default() };
        }
        let n = geometry.cells.len() as u32;
        let mut cells = Vec::with_capacity(n as usize);
        graph.sweep(0..n, &mut cells);
        let mut found = cycles::Cycles::default();
        let mut disordered = vec![];
        if cells.len() < n as usize {
            let waiting: Vec<u32> = (0..n).filter(|&c| graph.waits(c)).collect();
            // Faces are seen by pixels in convex meshes too.
            let own = rays.is_none().then(|| lens.as_ref().map(|lens| Rays::new(geometry, lens))).flatten();
            let rays = rays.as_ref().or(own.as_ref());
            let pixels_of = |face: (u32, u8)| {
                let corners = OUTWARD[face.1 as usize].map(|k| geometry.cells[face.0 as usize].corners[k]);
                rays.map_or(vec![], |rays| rays.pixels_of_face(corners))
            };
            found = cycles::untie(&mut graph, &waiting, |graph, edge| match edge {
                Edge::Face(cell, k) => pixels_of((cell, k)).len() as u32,
                Edge::Gap(gap) => graph.gaps[gap as usize].pixels,
            });
            graph.sweep(waiting.into_iter(), &mut cells);
            for edge in &found.cut {
                if let Edge::Face(cell, k) = *edge {
                    disordered.extend(pixels_of((cell, k)));
                }
            }
            if graph.gaps.iter().any(|g| g.is_cut) {
                disordered.extend(rays.map(|rays| rays.pixels_of_cut(&graph.gaps)).unwrap_or_default());
            }
            disordered.sort_unstable();
            disordered.dedup();
        }
        Sequence {
            cells,
            cycles: found.parts,
            cycle_cells: found.cells,
            cuts: found.cut.len() as u64,
            overlapping: overlapping.len() as u64,
            disordered,
        }
    }
}

impl Sequence {
    /// The order of the cells that `keys` do not hide, as many parts of each as they say: see [`super::depth`].
    pub fn order(&self, keys: &[u32]) -> VisibilityOrder {
        let block = self.cells.len().div_ceil(4 * rayon::current_num_threads()).max(1 << 14);
        let entries = |cells: &[u32]| {
            let mut entries = Vec::with_capacity(cells.len());
            for &cell in cells.iter().rev() {
                let key = keys[cell as usize];
                if key != HIDDEN {
                    (0..=key % MOST_PARTS).for_each(|part| entries.push(cell | part << PART));
                }
            }
            entries
        };
        let blocks: Vec<Vec<u32>> = self.cells.par_chunks(block).map(entries).collect();
        let entries = blocks.into_iter().rev().flatten().collect();
        VisibilityOrder { entries, provenance: Provenance::Mesh }
    }
}
