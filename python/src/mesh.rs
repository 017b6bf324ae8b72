//! Meshes and grids, from files and from numpy's arrays.

use crate::{Error, raised};
use glam::{DMat3, DVec3};
use halite::field::{Component, Number, magnitude};
use halite::grid::{Grid, Lattice};
use halite::io::{DataSet, Source, Time};
use halite::memory;
use halite::mesh::cells::reads_array;
use halite::mesh::{Array, Arrays, Cells, Polyhedra, check_length};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::borrow::Cow;
use std::path::PathBuf;

/// A mesh, or a regular or rectilinear grid; it never changes. One of a file has its arrays. Those of one that Python made stay with
/// Python, but for what cells are split by.
#[pyclass(module = "halite._halite", frozen)]
pub(crate) struct Mesh(pub(crate) DataSet);

/// A name, values of points or of cells.
pub(crate) type Given<'py> = (String, Bound<'py, PyAny>);

#[pymethods]
impl Mesh {
    #[staticmethod]
    #[pyo3(signature = (path, step=None, time=None))]
    fn read(py: Python<'_>, path: PathBuf, step: Option<usize>, time: Option<f64>) -> PyResult<Self> {
        let time = match (step, time) {
            (Some(step), _) => Time::Step(step),
            (None, Some(value)) => Time::Value(value),
            (None, None) => Time::Step(0),
        };
        let read = || {
            let source = Source::open(&path)?;
            source.read_data_set(source.step(time)?, &|_| {})
        };
        py.detach(read).map(Mesh).map_err(raised)
    }

    /// Points and cells are read where they are, and copied once, into the core's own form; arrays of values are checked.
    #[staticmethod]
    fn from_arrays(
        points: &Bound<'_, PyAny>,
        connectivity: &Bound<'_, PyAny>,
        offsets: &Bound<'_, PyAny>,
        types: &Bound<'_, PyAny>,
        polyhedra: Option<[Bound<'_, PyAny>; 3]>,
        point_data: Vec<Given<'_>>,
        cell_data: Vec<Given<'_>>,
    ) -> PyResult<Self> {
        let cells = Cells {
            types: whole("types", types, |n| format!("types are VTK's, from 0 to 255, and not {n}"))?,
            offsets: counts("offsets", offsets)?,
            connectivity: indices("cells", connectivity)?,
        };
        let mut mesh = halite::mesh::Mesh::new(triples(points)?, cells, vec![], vec![]).map_err(raised)?;
        if let Some([cells, faces, points]) = polyhedra {
            let polyhedra = Polyhedra {
                cells: counts("faces of cells", &cells)?,
                faces: counts("points of faces", &faces)?,
                points: indices("faces", &points)?,
            };
            mesh.set_polyhedra(polyhedra).map_err(raised)?;
        }
        Mesh(DataSet::Mesh(mesh)).holding(point_data, cell_data)
    }

    #[staticmethod]
    fn image(
        origin: [f64; 3],
        spacing: [f64; 3],
        direction: [[f64; 3]; 3],
        first: [i64; 3],
        size: [usize; 3],
        point_data: Vec<Given<'_>>,
        cell_data: Vec<Given<'_>>,
    ) -> PyResult<Self> {
        let direction = DMat3::from_cols_array_2d(&direction).transpose();
        let lattice = Lattice { origin: origin.into(), spacing: spacing.into(), direction, first, size };
        let grid = Grid::regular(&lattice, vec![], vec![]).map_err(raised)?;
        Mesh(DataSet::Grid(grid)).holding(point_data, cell_data)
    }

    #[staticmethod]
    fn rectilinear(axes: [Vec<f64>; 3], point_data: Vec<Given<'_>>, cell_data: Vec<Given<'_>>) -> PyResult<Self> {
        let grid = Grid::rectilinear(axes, vec![], vec![]).map_err(raised)?;
        Mesh(DataSet::Grid(grid)).holding(point_data, cell_data)
    }

    #[getter]
    fn n_points(&self) -> usize {
        match &self.0 {
            DataSet::Mesh(mesh) => mesh.points().len(),
            DataSet::Grid(grid) => grid.point_count(),
        }
    }

    #[getter]
    fn n_cells(&self) -> usize {
        self.arrays().cell_count()
    }

    #[getter]
    fn is_grid(&self) -> bool {
        matches!(self.0, DataSet::Grid(_))
    }

    /// Least and greatest x, y and z of the points; those that are not finite are left out.
    #[getter]
    fn bounds(&self) -> [f64; 6] {
        let [low, high] = match &self.0 {
            DataSet::Mesh(mesh) => hull(mesh.points().iter().copied()),
            DataSet::Grid(grid) => {
                let axes = grid.axes();
                let ends = |a: usize| [axes[a][0], axes[a][axes[a].len() - 1]];
                let corner =
                    |c: usize| grid.origin() + grid.direction() * DVec3::from([0, 1, 2].map(|a| ends(a)[c >> a & 1]));
                hull((0..8).map(corner))
            }
        };
        [low.x, high.x, low.y, high.y, low.z, high.z]
    }

    /// Name, "point" or "cell", and components of each array.
    #[getter]
    fn array_list(&self) -> Vec<(String, &'static str, usize)> {
        let of = |all: &[Array], what: &'static str| {
            all.iter().map(move |a| (a.name.clone(), what, a.components)).collect::<Vec<_>>()
        };
        let mut all = of(self.arrays().point_arrays(), "point");
        all.extend(of(self.arrays().cell_arrays(), "cell"));
        all
    }

    /// The least and the greatest finite value of an array: of a component, or of the length of its tuples.
    fn range(&self, name: &str, of_cells: bool, component: Option<usize>) -> PyResult<[f64; 2]> {
        let array = self.array(name, of_cells)?;
        let n = array.components;
        let value = |t: usize| match component {
            Some(k) => array.values.get(n * t + k.min(n - 1)),
            None if n == 1 => array.values.get(t),
            None => (0..n).map(|k| array.values.get(n * t + k).powi(2)).sum::<f64>().sqrt(),
        };
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let values = (0..array.tuples()).map(value).filter(|v| v.is_finite());
        Ok(values.fold(none, |[lo, hi], v| [lo.min(v), hi.max(v)]))
    }
}

impl Mesh {
    /// Checks arrays of the mesh, and takes copies of those that it needs whatever is drawn.
    fn holding(mut self, of_points: Vec<Given<'_>>, of_cells: Vec<Given<'_>>) -> PyResult<Self> {
        for (all, is_cells) in [(of_points, false), (of_cells, true)] {
            let count = if is_cells { self.n_cells() } else { self.n_points() };
            for (name, given) in all {
                let (components, length) = layout(&name, &given)?;
                let kind = if is_cells { "cell" } else { "point" };
                check_length(kind, &name, components, length, count).map_err(raised)?;
                if reads_array(&name) {
                    self.0 = with_array(self.0, array(name, &given)?, is_cells)?;
                }
            }
        }
        Ok(self)
    }

    /// The mesh itself, or, with copies of these arrays besides its own, one that shares its points and cells.
    pub(crate) fn with_arrays(
        &self,
        of_points: Vec<Given<'_>>,
        of_cells: Vec<Given<'_>>,
    ) -> PyResult<Cow<'_, DataSet>> {
        if of_points.is_empty() && of_cells.is_empty() {
            return Ok(Cow::Borrowed(&self.0));
        }
        let mut all = self.0.clone();
        for (arrays, is_cells) in [(of_points, false), (of_cells, true)] {
            for (name, given) in arrays.into_iter().filter(|(name, _)| !reads_array(name)) {
                all = with_array(all, array(name, &given)?, is_cells)?;
            }
        }
        Ok(Cow::Owned(all))
    }

    pub(crate) fn arrays(&self) -> &dyn Arrays {
        match &self.0 {
            DataSet::Mesh(mesh) => mesh,
            DataSet::Grid(grid) => grid,
        }
    }

    pub(crate) fn array(&self, name: &str, of_cells: bool) -> PyResult<&Array> {
        let (all, what) = match of_cells {
            true => (self.arrays().cell_arrays(), "cells"),
            false => (self.arrays().point_arrays(), "points"),
        };
        let known = || all.iter().map(|a| format!("\"{}\"", a.name)).collect::<Vec<_>>().join(", ");
        all.iter()
            .find(|a| a.name == name)
            .ok_or_else(|| Error::new_err(format!("no array of {what} is called \"{name}\"; there are {}", known())))
    }
}

fn hull(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.filter(|p| p.is_finite()).fold(none, |[low, high], p| [low.min(p), high.max(p)])
}

/// Points of an array of shape (n, 3), of doubles or floats.
fn triples(given: &Bound<'_, PyAny>) -> PyResult<Vec<DVec3>> {
    fn of<T: Element + Copy + Into<f64>>(given: &PyReadonlyArrayDyn<'_, T>) -> PyResult<Vec<DVec3>> {
        let &[n, 3] = given.shape() else {
            let what = format!("points have the shape {}, and not (n, 3)", shape(given.shape()));
            return Err(Error::new_err(what));
        };
        let mut points = vec![];
        memory::reserve("points", &mut points, n).map_err(raised)?;
        let (triples, _) = given.as_slice()?.as_chunks();
        points.extend(triples.iter().map(|p: &[T; 3]| DVec3::from_array(p.map(Into::into))));
        Ok(points)
    }
    if let Ok(points) = given.cast::<PyArrayDyn<f64>>() {
        return of(&points.try_readonly()?);
    }
    match given.cast::<PyArrayDyn<f32>>() {
        Ok(points) => of(&points.try_readonly()?),
        Err(_) => Err(Error::new_err("points are neither doubles nor floats")),
    }
}

/// A shape as Python writes it.
pub(crate) fn shape(lengths: &[usize]) -> String {
    match lengths {
        [n] => format!("({n},)"),
        _ => format!("({})", lengths.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn counts(what: &str, numbers: &Bound<'_, PyAny>) -> PyResult<Vec<u64>> {
    whole(what, numbers, |n| format!("{what}: {n} is negative"))
}

fn indices(what: &str, numbers: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    whole(what, numbers, |n| format!("{n} is the number of no point"))
}

/// Whole numbers of any type in another, which has room for all of them.
fn whole<T>(what: &str, given: &Bound<'_, PyAny>, wrong: impl Fn(String) -> String) -> PyResult<Vec<T>>
where
    T: TryFrom<i64> + TryFrom<i32> + TryFrom<i16> + TryFrom<i8>,
    T: TryFrom<u64> + TryFrom<u32> + TryFrom<u16> + TryFrom<u8>,
{
    macro_rules! of {
        ($($type:ty),*) => {
            $(if let Ok(array) = given.cast::<PyArrayDyn<$type>>() {
                let array = array.try_readonly()?;
                let given = array.as_slice()?;
                let mut whole = vec![];
                memory::reserve(what, &mut whole, given.len()).map_err(raised)?;
                for &n in given {
                    whole.push(T::try_from(n).map_err(|_| Error::new_err(wrong(n.to_string())))?);
                }
                return Ok(whole);
            })*
        };
    }
    of!(i64, i32, u8, u32, u64, i16, u16, i8);
    Err(Error::new_err(format!("{what} are no whole numbers of 8 to 64 bits")))
}

fn with_array(mut all: DataSet, array: Array, is_cells: bool) -> PyResult<DataSet> {
    match (&mut all, is_cells) {
        (DataSet::Mesh(mesh), false) => mesh.add_point_array(array),
        (DataSet::Mesh(mesh), true) => mesh.add_cell_array(array),
        (DataSet::Grid(grid), false) => grid.add_point_array(array),
        (DataSet::Grid(grid), true) => grid.add_cell_array(array),
    }
    .map_err(raised)?;
    Ok(all)
}

/// Runs `$body` with `$array` bound to the array of numpy `$given`, whatever its type, or fails.
macro_rules! with_numbers {
    ($name:expr, $given:expr, $array:ident => $body:expr) => {
        with_numbers!(@ $name, $given, $array => $body; f64, f32, u8, i8, u16, i16, u32, i32, u64, i64)
    };
    (@ $name:expr, $given:expr, $array:ident => $body:expr; $($type:ty),*) => {
        'found: {
            $(if let Ok($array) = $given.cast::<PyArrayDyn<$type>>() {
                let done = $body;
                break 'found done;
            })*
            Err(Error::new_err(format!("the array \"{}\" is none of integers or floats of 8 to 64 bits", $name)))
        }
    };
}

/// The components and the numbers of an array of shape (n,) or (n, components).
fn layout(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(usize, usize)> {
    with_numbers!(name, given, array => {
        match array.shape().get(1..).map_or(1, |s| s.iter().product()) {
            0 => Err(Error::new_err(format!("the array \"{name}\" has no components"))),
            n => Ok((n, array.len())),
        }
    })
}

/// An array of shape (n,) or (n, components), in its own type of number.
fn array(name: String, given: &Bound<'_, PyAny>) -> PyResult<Array> {
    let (components, _) = layout(&name, given)?;
    with_numbers!(name, given, array => {
        let values = memory::copied(format!("the array \"{name}\""), array.try_readonly()?.as_slice()?);
        Ok(Array { name, components, values: Number::values(values.map_err(raised)?) })
    })
}

/// What is drawn of such an array, and no more of it: the only copy that is made; and which component of that it is.
pub(crate) fn drawn(name: String, given: &Bound<'_, PyAny>, component: Component) -> PyResult<(Array, Component)> {
    let (n, _) = layout(&name, given)?;
    let component = if component == Component::Magnitude && n == 1 { Component::Index(0) } else { component };
    let what = || format!("what is drawn of the array \"{name}\"");
    let values = match component {
        Component::Index(k) if k < n && n > 1 => with_numbers!(name, given, array => {
            picked(what(), &array.try_readonly()?, n, |tuple| tuple[k]).map(Number::values)
        }),
        Component::Magnitude => with_numbers!(name, given, array => {
            picked(what(), &array.try_readonly()?, n, magnitude).map(Number::values)
        }),
        _ => return Ok((array(name, given)?, component)),
    };
    values.map(|values| (Array { name, components: 1, values }, Component::Index(0)))
}

/// One number of each tuple of `n`.
fn picked<T: Element, U>(
    what: String,
    array: &PyReadonlyArrayDyn<'_, T>,
    n: usize,
    of: impl Fn(&[T]) -> U,
) -> PyResult<Vec<U>> {
    let numbers = array.as_slice()?;
    let mut all = vec![];
    memory::reserve(what, &mut all, numbers.len() / n).map_err(raised)?;
    all.extend(numbers.chunks_exact(n).map(of));
    Ok(all)
}
