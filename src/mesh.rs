//! The mesh: points, cells and data arrays of an unstructured grid, validated once.

mod attributes;
pub mod cells;
pub mod faces;
pub mod generate;

pub use attributes::{Attributes, LeftOut, Role};

use crate::error::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// The values of a data array, in the type that the file or host holds them in. Tuples lie one after another.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "each variant is named after its element type")]
pub enum Values {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    I64(Vec<i64>),
    U64(Vec<u64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Runs `$body` with `$v` bound to the vector inside a [`Values`], whatever its type.
macro_rules! with_values {
    ($values:expr, $v:ident => $body:expr) => {
        match $values {
            $crate::mesh::Values::I8($v) => $body,
            $crate::mesh::Values::U8($v) => $body,
            $crate::mesh::Values::I16($v) => $body,
            $crate::mesh::Values::U16($v) => $body,
            $crate::mesh::Values::I32($v) => $body,
            $crate::mesh::Values::U32($v) => $body,
            $crate::mesh::Values::I64($v) => $body,
            $crate::mesh::Values::U64($v) => $body,
            $crate::mesh::Values::F32($v) => $body,
            $crate::mesh::Values::F64($v) => $body,
        }
    };
}
pub(crate) use with_values;

impl Values {
    /// Number of values (tuples times components).
    pub fn len(&self) -> usize {
        with_values!(self, v => v.len())
    }

    /// True if there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The tuples of `components` values with the numbers `at`, one after another, in the same type; zeros where there is
    /// no such tuple.
    pub(crate) fn gathered(&self, components: usize, at: &[usize]) -> Values {
        macro_rules! gather {
            ($($variant:ident),*) => {
                match self {
                    $(Values::$variant(v) => {
                        let mut all = Vec::with_capacity(at.len() * components);
                        for t in at {
                            match v.chunks_exact(components).nth(*t) {
                                Some(tuple) => all.extend_from_slice(tuple),
                                None => all.resize(all.len() + components, Default::default()),
                            }
                        }
                        Values::$variant(all)
                    })*
                }
            };
        }
        gather!(I8, U8, I16, U16, I32, U32, I64, U64, F32, F64)
    }

    /// Value `i` as f64.
    ///
    /// # Panics
    /// If `i` is not below [`Values::len`].
    #[allow(clippy::unnecessary_cast, reason = "one of the ten types is f64 already")]
    pub fn get(&self, i: usize) -> f64 {
        with_values!(self, v => v[i] as f64)
    }
}

/// A named data array of points or cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its name; several arrays of one name may exist, the first is found.
    pub name: String,
    /// Values per point or cell, at least 1.
    pub components: usize,
    /// `components` values for each point or cell.
    pub values: Values,
}

impl Array {
    /// Number of tuples: points or cells that it holds values for.
    pub fn tuples(&self) -> usize {
        self.values.len() / self.components.max(1)
    }
}

/// What has arrays of points and of cells: a [`Mesh`], or a [`crate::grid::Grid`].
pub trait Arrays {
    /// Number of cells of all types.
    fn cell_count(&self) -> usize;
    /// The arrays with a value for each point.
    fn point_arrays(&self) -> &[Array];
    /// The arrays with a value for each cell.
    fn cell_arrays(&self) -> &[Array];
    /// What is known of the arrays of points beside their values.
    fn point_attributes(&self) -> &Attributes;
    /// What is known of the arrays of cells beside their values.
    fn cell_attributes(&self) -> &Attributes;
}

/// Implements [`Arrays`] by methods of the same names.
macro_rules! has_arrays {
    ($type:ty) => {
        impl $type {
            /// The arrays with a value for each point.
            pub fn point_arrays(&self) -> &[$crate::mesh::Array] {
                &self.point_arrays
            }

            /// The arrays with a value for each cell.
            pub fn cell_arrays(&self) -> &[$crate::mesh::Array] {
                &self.cell_arrays
            }

            /// What is known of the arrays of points beside their values.
            pub fn point_attributes(&self) -> &$crate::mesh::Attributes {
                &self.point_attributes
            }

            /// What is known of the arrays of cells beside their values.
            pub fn cell_attributes(&self) -> &$crate::mesh::Attributes {
                &self.cell_attributes
            }
        }

        impl $crate::mesh::Arrays for $type {
            fn cell_count(&self) -> usize {
                self.cell_count()
            }
            fn point_arrays(&self) -> &[$crate::mesh::Array] {
                self.point_arrays()
            }
            fn cell_arrays(&self) -> &[$crate::mesh::Array] {
                self.cell_arrays()
            }
            fn point_attributes(&self) -> &$crate::mesh::Attributes {
                self.point_attributes()
            }
            fn cell_attributes(&self) -> &$crate::mesh::Attributes {
                self.cell_attributes()
            }
        }
    };
}
pub(crate) use has_arrays;

has_arrays!(Mesh);

/// The cells of a mesh, as VTK lays them out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    /// VTK's cell type of each cell (`vtkCellType.h`).
    pub types: Vec<u8>,
    /// Cell `c` has the points `connectivity[offsets[c]..offsets[c + 1]]`; one entry more than cells, the first is 0.
    pub offsets: Vec<u64>,
    /// Point indices, in VTK's order for the cell type.
    pub connectivity: Vec<u32>,
}

impl Cells {
    /// Number of cells of all types.
    pub fn len(&self) -> usize {
        self.types.len()
    }

    /// True if there is no cell.
    pub fn is_empty(&self) -> bool {
        self.types.is_empty()
    }

    /// The point indices of cell `c`.
    ///
    /// # Panics
    /// If `c` is not below [`Cells::len`].
    pub fn points(&self, c: usize) -> &[u32] {
        &self.connectivity[self.offsets[c] as usize..self.offsets[c + 1] as usize]
    }
}

/// VTK's cell type of a polyhedron.
pub const POLYHEDRON: u8 = 42;

/// The faces of the polyhedra among the cells of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polyhedra {
    /// Cell `c` has the faces `cells[c]..cells[c + 1]`, none if it is no polyhedron; one entry more than cells, the
    /// first is 0.
    pub cells: Vec<u64>,
    /// Face `f` has the points `points[faces[f]..faces[f + 1]]`; one entry more than faces, the first is 0.
    pub faces: Vec<u64>,
    /// Point indices, around each face.
    pub points: Vec<u32>,
}

impl Polyhedra {
    /// The faces of cell `c`, each a list of points.
    ///
    /// # Panics
    /// If `c` is no cell.
    pub fn faces(&self, c: usize) -> impl Iterator<Item = &[u32]> {
        let face = |f: u64| &self.points[self.faces[f as usize] as usize..self.faces[f as usize + 1] as usize];
        (self.cells[c]..self.cells[c + 1]).map(face)
    }
}

/// An unstructured grid: a value of this type cannot be malformed. Point coordinates may still be NaN or infinite:
/// cells that touch such a point are left out when the cells are split. Clones share points and cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    points: Arc<Vec<DVec3>>,
    cells: Arc<Cells>,
    polyhedra: Option<Arc<Polyhedra>>,
    point_arrays: Vec<Array>,
    cell_arrays: Vec<Array>,
    point_attributes: Attributes,
    cell_attributes: Attributes,
}

/// What a mesh is made of.
pub(crate) struct MeshParts {
    pub(crate) points: Vec<DVec3>,
    pub(crate) cells: Cells,
    pub(crate) polyhedra: Option<Polyhedra>,
    /// Arrays of points, and of cells.
    pub(crate) arrays: [Vec<Array>; 2],
    /// What is known of either.
    pub(crate) attributes: [Attributes; 2],
}

impl Mesh {
    /// Checks the parts and makes a mesh of them.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there are more than 2³² − 2 points, if offsets do not start at 0, decrease or pass the end of
    /// the connectivity, if a cell names a point that does not exist, or if an array's length is not
    /// components × points (or cells).
    pub fn new(points: Vec<DVec3>, cells: Cells, point_arrays: Vec<Array>, cell_arrays: Vec<Array>) -> Result<Self> {
        let fail = |what: String| Err(Error::Mesh(what));
        if points.len() >= u32::MAX as usize {
            return fail(format!("{} points are more than Halite can index (2^32 - 2)", points.len()));
        }
        let n = cells.types.len();
        if cells.offsets.len() != n + 1 || cells.offsets[0] != 0 {
            return fail(format!("{n} cells need {} offsets, the first of them 0", n + 1));
        }
        if let Some(c) = cells.offsets.windows(2).position(|w| w[1] < w[0]) {
            return fail(format!("the offsets decrease at cell {c}"));
        }
        if cells.offsets[n] != cells.connectivity.len() as u64 {
            return fail(format!(
                "the offsets end at {}, but the connectivity has {} entries",
                cells.offsets[n],
                cells.connectivity.len()
            ));
        }
        if let Some(i) = cells.connectivity.iter().position(|&p| p as usize >= points.len()) {
            let c = cells.offsets.partition_point(|&o| o <= i as u64) - 1;
            let (p, count) = (cells.connectivity[i], points.len());
            return fail(format!("cell {c} names point {p}, but there are {count} points"));
        }
        point_arrays.iter().try_for_each(|a| check_array("point", a, points.len()))?;
        cell_arrays.iter().try_for_each(|a| check_array("cell", a, n))?;
        let [point_attributes, cell_attributes] = Default::default();
        let (points, cells) = (Arc::new(points), Arc::new(cells));
        Ok(Mesh { points, cells, polyhedra: None, point_arrays, cell_arrays, point_attributes, cell_attributes })
    }

    /// Takes it apart.
    pub(crate) fn into_parts(self) -> MeshParts {
        MeshParts {
            points: Arc::unwrap_or_clone(self.points),
            cells: Arc::unwrap_or_clone(self.cells),
            polyhedra: self.polyhedra.map(Arc::unwrap_or_clone),
            arrays: [self.point_arrays, self.cell_arrays],
            attributes: [self.point_attributes, self.cell_attributes],
        }
    }

    /// Sets what is known of its arrays beside their values: of points, and of cells.
    pub fn set_attributes(&mut self, of_points: Attributes, of_cells: Attributes) {
        (self.point_attributes, self.cell_attributes) = (of_points, of_cells);
    }

    /// The same mesh, with the faces of its polyhedra; without, they are not drawn.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there are not as many entries as cells need, if they do not start at 0, decrease or pass the
    /// end of the next list, or if a face names a point that does not exist.
    pub fn with_polyhedra(mut self, polyhedra: Polyhedra) -> Result<Self> {
        self.set_polyhedra(polyhedra)?;
        Ok(self)
    }

    /// As [`Self::with_polyhedra`], of this mesh.
    ///
    /// # Errors
    /// Likewise.
    pub fn set_polyhedra(&mut self, polyhedra: Polyhedra) -> Result<()> {
        let Polyhedra { cells, faces, points } = &polyhedra;
        let fits = |starts: &[u64], end: usize| {
            starts.first() == Some(&0) && starts.is_sorted() && starts.last() == Some(&(end as u64))
        };
        if cells.len() != self.cells.len() + 1
            || !fits(cells, faces.len().saturating_sub(1))
            || !fits(faces, points.len())
        {
            return Err(Error::Mesh("the lists of its polyhedra's faces do not fit together".to_owned()));
        }
        if let Some(p) = points.iter().find(|p| **p as usize >= self.points.len()) {
            let count = self.points.len();
            return Err(Error::Mesh(format!("the face of a polyhedron names point {p}, but there are {count} points")));
        }
        self.polyhedra = Some(Arc::new(polyhedra));
        Ok(())
    }

    /// Adds an array with a value for each point.
    ///
    /// # Errors
    /// [`Error::Mesh`] if its length is not components × points.
    pub fn add_point_array(&mut self, array: Array) -> Result<()> {
        check_array("point", &array, self.points.len())?;
        self.point_arrays.push(array);
        Ok(())
    }

    /// Adds an array with a value for each cell.
    ///
    /// # Errors
    /// [`Error::Mesh`] if its length is not components × cells.
    pub fn add_cell_array(&mut self, array: Array) -> Result<()> {
        check_array("cell", &array, self.cells.len())?;
        self.cell_arrays.push(array);
        Ok(())
    }

    /// The mesh stretched about the origin, by a factor for each axis.
    ///
    /// # Errors
    /// [`Error::Mesh`] if a factor is 0 or not finite.
    pub fn scaled(mut self, by: DVec3) -> Result<Self> {
        if !by.is_finite() || by.cmpeq(DVec3::ZERO).any() {
            return Err(Error::Mesh(format!("it cannot be stretched by {by}")));
        }
        Arc::make_mut(&mut self.points).par_iter_mut().for_each(|p| *p *= by);
        Ok(self)
    }

    /// Bytes that its points, cells and arrays take.
    pub(crate) fn bytes(&self) -> u64 {
        let values = |array: &Array| with_values!(&array.values, v => size_of_val(&**v));
        let arrays: usize = self.point_arrays.iter().chain(&self.cell_arrays).map(values).sum();
        let Cells { types, offsets, connectivity } = &*self.cells;
        let cells = size_of_val(&**types) + size_of_val(&**offsets) + size_of_val(&**connectivity);
        let faces = |p: &Polyhedra| size_of_val(&*p.cells) + size_of_val(&*p.faces) + size_of_val(&*p.points);
        (size_of_val(&*self.points) + arrays + cells + self.polyhedra.as_deref().map_or(0, faces)) as u64
    }

    /// The points, in world coordinates.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The cells, of every type that the file has.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Number of cells of all types.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// The faces of its polyhedra.
    pub fn polyhedra(&self) -> Option<&Polyhedra> {
        self.polyhedra.as_deref()
    }
}

pub(crate) fn check_array(kind: &str, a: &Array, count: usize) -> Result<()> {
    check_length(kind, &a.name, a.components, a.values.len(), count)
}

/// Checks that an array called `name` of points or cells, which `kind` says, has `components` values for each of `count` of them.
///
/// # Errors
/// [`Error::Mesh`] if its `length` is another.
pub fn check_length(kind: &str, name: &str, components: usize, length: usize, count: usize) -> Result<()> {
    if components > 0 && count.checked_mul(components) == Some(length) {
        return Ok(());
    }
    Err(Error::Mesh(format!(
        "{kind} array \"{name}\" has {length} values, not {components} components for each of {count} {kind}s"
    )))
}
