//! Regular and rectilinear grids: axes and arrays, without a list of cells.
//!
//! A structured (curvilinear) grid is no such grid, but a [`Mesh`] of hexahedra.

use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::cells::ghosts;
use crate::mesh::{Array, Attributes, Cells, Mesh, Values, check_array, has_arrays};
use glam::{DMat3, DMat4, DVec3};

/// VTK's cell types of grids by the number of axes along which there is more than one point: in a regular or
/// rectilinear grid.
pub(crate) const STRAIGHT: [u8; 4] = [1, 3, 8, 11];

/// The same in a structured grid.
pub(crate) const BENT: [u8; 4] = [1, 3, 9, 12];

/// Regular grids (image data) and rectilinear grids: a value of this type cannot be malformed.
///
/// Point (i, j, k) is at `origin + direction · (x[i], y[j], z[k])`, with `axes` = [x, y, z], each strictly ascending or
/// descending. Points and cells are counted with i fastest, then j.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    axes: [Vec<f64>; 3],
    origin: DVec3,
    direction: DMat3,
    /// Whether its points are evenly spaced by construction: image data.
    regular: bool,
    point_arrays: Vec<Array>,
    cell_arrays: Vec<Array>,
    point_attributes: Attributes,
    cell_attributes: Attributes,
}

/// Where the points of image data are: index (i, j, k) is at origin + direction · (spacing · (i, j, k)), each axis by
/// itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// World coordinates of index 0.
    pub origin: DVec3,
    /// World units from one index to the next along each axis; not 0.
    pub spacing: DVec3,
    /// The directions of the axes, as columns.
    pub direction: DMat3,
    /// The first index along each axis.
    pub first: [i64; 3],
    /// Points along each axis, at least 1.
    pub size: [usize; 3],
}

has_arrays!(Grid);

impl Default for Lattice {
    fn default() -> Self {
        Lattice { origin: DVec3::ZERO, spacing: DVec3::ONE, direction: DMat3::IDENTITY, first: [0; 3], size: [1; 3] }
    }
}

impl Grid {
    /// Image data.
    ///
    /// # Errors
    /// [`Error::Mesh`] if a number is not finite, two points would share a place, directions are linearly dependent, or
    /// an array's length is not components × points (or cells); [`Error::NoMemory`].
    pub fn regular(lattice: &Lattice, point_arrays: Vec<Array>, cell_arrays: Vec<Array>) -> Result<Self> {
        let Lattice { origin, spacing, direction, first, size } = *lattice;
        // Where axes are not turned the origin belongs to the coordinates, so that these are as VTK computes them.
        let straight = direction == DMat3::IDENTITY;
        let mut axes = [const { Vec::new() }; 3];
        for (a, axis) in axes.iter_mut().enumerate() {
            let start = if straight { origin[a] } else { 0.0 };
            memory::reserve(format!("the {} points along an axis of a grid", size[a]), axis, size[a])?;
            axis.extend((0..size[a]).map(|i| start + spacing[a] * first[a].saturating_add(i as i64) as f64));
        }
        let origin = if straight { DVec3::ZERO } else { origin };
        Self::new(axes, origin, direction, true, [point_arrays, cell_arrays])
    }

    /// A rectilinear grid, whose points are at all triples of these coordinates.
    ///
    /// # Errors
    /// [`Error::Mesh`] if an axis has no coordinate, or one that is not finite, or neither ascends nor descends
    /// throughout, or if an array's length is not components × points (or cells).
    pub fn rectilinear(axes: [Vec<f64>; 3], point_arrays: Vec<Array>, cell_arrays: Vec<Array>) -> Result<Self> {
        Self::new(axes, DVec3::ZERO, DMat3::IDENTITY, false, [point_arrays, cell_arrays])
    }

    fn new(
        axes: [Vec<f64>; 3],
        origin: DVec3,
        direction: DMat3,
        regular: bool,
        [point_arrays, cell_arrays]: [Vec<Array>; 2],
    ) -> Result<Self> {
        let fail = |what: String| Err(Error::Mesh(what));
        for (axis, name) in axes.iter().zip(["x", "y", "z"]) {
            let ascends = axis.last() > axis.first();
            let step = |w: &[f64]| if ascends { w[0] < w[1] } else { w[0] > w[1] };
            if axis.is_empty() || !axis.iter().all(|c| c.is_finite()) || !axis.windows(2).all(step) {
                return fail(format!("its coordinates along {name} do not ascend, nor descend, from point to point"));
            }
        }
        if !origin.is_finite() || !direction.is_finite() || !direction.inverse().is_finite() {
            return fail("the directions of its axes are not finite, or lie in a plane".into());
        }
        let (points, cells) = (product(size_of_points(&axes)), product(size_of_cells(&axes)));
        let (Some(points), Some(cells)) = (points, cells) else {
            return fail("it has more points than can be counted".into());
        };
        point_arrays.iter().try_for_each(|a| check_array("point", a, points))?;
        cell_arrays.iter().try_for_each(|a| check_array("cell", a, cells))?;
        let [point_attributes, cell_attributes] = Default::default();
        Ok(Grid { axes, origin, direction, regular, point_arrays, cell_arrays, point_attributes, cell_attributes })
    }

    /// Sets what is known of its arrays beside their values: of points, and of cells.
    pub fn set_attributes(&mut self, of_points: Attributes, of_cells: Attributes) {
        (self.point_attributes, self.cell_attributes) = (of_points, of_cells);
    }

    /// Points along each axis, at least 1.
    pub fn size(&self) -> [usize; 3] {
        size_of_points(&self.axes)
    }

    /// Cells along each axis; 1 along one of a single point, where they have no volume.
    pub fn cells(&self) -> [usize; 3] {
        size_of_cells(&self.axes)
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.size().iter().product()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells().iter().product()
    }

    /// Whether cells have a volume: whether there are two points or more along each axis.
    pub fn has_volume(&self) -> bool {
        self.size().iter().all(|n| *n > 1)
    }

    /// Whether it is image data.
    pub fn is_regular(&self) -> bool {
        self.regular
    }

    /// Coordinates along each axis, before they are turned and moved.
    pub fn axes(&self) -> &[Vec<f64>; 3] {
        &self.axes
    }

    /// What is added to turned coordinates, in world units.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The directions of the axes in the world, as columns.
    pub fn direction(&self) -> DMat3 {
        self.direction
    }

    /// Distance of the points along each axis, if it is image data; negative where an axis descends, 0 along one of a
    /// single point.
    pub fn spacing(&self) -> Option<DVec3> {
        let step = |a: &Vec<f64>| if a.len() > 1 { (a[a.len() - 1] - a[0]) / (a.len() - 1) as f64 } else { 0.0 };
        self.regular.then(|| DVec3::from_array([0, 1, 2].map(|a| step(&self.axes[a]))))
    }

    /// World coordinates of point (i, j, k).
    ///
    /// # Panics
    /// If there is no such point.
    pub fn point(&self, index: [usize; 3]) -> DVec3 {
        let along = DVec3::from_array([0, 1, 2].map(|a| self.axes[a][index[a]]));
        if self.direction == DMat3::IDENTITY { self.origin + along } else { self.origin + self.direction * along }
    }

    /// Adds an array with a value for each point.
    ///
    /// # Errors
    /// [`Error::Mesh`] if its length is not components × points.
    pub fn add_point_array(&mut self, array: Array) -> Result<()> {
        check_array("point", &array, self.point_count())?;
        self.point_arrays.push(array);
        Ok(())
    }

    /// Adds an array with a value for each cell.
    ///
    /// # Errors
    /// [`Error::Mesh`] if its length is not components × cells.
    pub fn add_cell_array(&mut self, array: Array) -> Result<()> {
        check_array("cell", &array, self.cell_count())?;
        self.cell_arrays.push(array);
        Ok(())
    }

    /// The grid turned, or sheared, and moved.
    ///
    /// # Errors
    /// [`Error::Mesh`] if `matrix` is not affine, not finite or singular.
    pub fn transformed(mut self, matrix: DMat4) -> Result<Self> {
        if !matrix.is_finite() || matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(Error::Mesh("the matrix of the grid is not affine, or not finite".into()));
        }
        if matrix != DMat4::IDENTITY {
            self.origin = matrix.transform_point3(self.origin);
            self.direction = DMat3::from_mat4(matrix) * self.direction;
            if !self.direction.inverse().is_finite() {
                return Err(Error::Mesh("the matrix of the grid is singular".into()));
            }
        }
        Ok(self)
    }

    /// The grid stretched about the world's origin, by a factor for each of the world's axes.
    ///
    /// # Errors
    /// [`Error::Mesh`] if a factor is 0 or not finite.
    pub fn scaled(mut self, by: DVec3) -> Result<Self> {
        if !by.is_finite() || by.cmpeq(DVec3::ZERO).any() {
            return Err(Error::Mesh(format!("it cannot be stretched by {by}")));
        }
        self.origin *= by;
        if self.direction == DMat3::IDENTITY {
            for (axis, by) in self.axes.iter_mut().zip(by.to_array()) {
                axis.iter_mut().for_each(|c| *c *= by);
            }
        } else {
            self.direction = DMat3::from_diagonal(by) * self.direction;
        }
        Ok(self)
    }

    /// Takes the array called `name` of points, or of cells, out of the grid.
    pub fn take_array(&mut self, name: &str, of_cells: bool) -> Option<Array> {
        let arrays = if of_cells { &mut self.cell_arrays } else { &mut self.point_arrays };
        let at = arrays.iter().position(|a| a.name == name)?;
        Some(arrays.remove(at))
    }

    /// A bit for each cell that is not to be drawn: it is marked as duplicate, refined or hidden, or one of its points as
    /// hidden. None if there is none.
    pub fn hidden(&self) -> Option<Vec<u64>> {
        let ([nx, ny, _], points, [x, y, z]) = (self.size(), ghosts::of_points(&self.point_arrays), self.cells());
        let cells = ghosts::of_cells(&self.cell_arrays);
        if points.is_none() && cells.is_none() {
            return None;
        }
        let mut bits = vec![0_u64; (x * y * z).div_ceil(64)];
        let corners = [0, 1, nx, nx + 1].map(|p| [p, p + nx * ny]);
        for c in 0..x * y * z {
            let first = (c / (x * y) * ny + c / x % y) * nx + c % x;
            let hidden = cells.as_ref().is_some_and(|of| of(c))
                || points.as_ref().is_some_and(|of| corners.as_flattened().iter().any(|p| of(first + p)));
            bits[c / 64] |= u64::from(hidden) << (c % 64);
        }
        bits.iter().any(|word| *word != 0).then_some(bits)
    }

    /// The grid itself if it has at most `most` points; else one of every so many points along each axis, and of the
    /// last ones, with the values of those and of the cells behind them: enough to choose colours and a view by.
    ///
    /// # Errors
    /// None in practice: those of [`Self::rectilinear`].
    pub fn coarse(&self, most: usize) -> Result<Self> {
        let size = self.size();
        let kept = |step: usize, n: usize| (n - 1).div_ceil(step) + 1;
        let step = (1..).find(|step| size.iter().map(|n| kept(*step, *n)).product::<usize>() <= most.max(8));
        let step = step.unwrap_or(1);
        if step == 1 {
            return Ok(self.clone());
        }
        let index = size.map(|n| (0..kept(step, n)).map(|i| (i * step).min(n - 1)).collect::<Vec<_>>());
        let axes = [0, 1, 2].map(|a| index[a].iter().map(|i| self.axes[a][*i]).collect());
        // The cell behind each but the last point of an axis.
        let cells = [0, 1, 2].map(|a| index[a][..index[a].len().saturating_sub(1).max(1)].to_vec());
        let gather = |arrays: &[Array], [x, y, z]: &[Vec<usize>; 3], [nx, ny, _]: [usize; 3]| {
            let at = z.iter().flat_map(|k| y.iter().flat_map(move |j| x.iter().map(move |i| (k * ny + j) * nx + i)));
            let at: Vec<usize> = at.collect();
            let own = |a: &Array| Array { values: a.values.gathered(a.components, &at), ..named(a) };
            arrays.iter().map(own).collect::<Vec<_>>()
        };
        let arrays = [gather(&self.point_arrays, &index, size), gather(&self.cell_arrays, &cells, self.cells())];
        let mut coarse = Self::new(axes, self.origin, self.direction, false, arrays)?;
        coarse.set_attributes(self.point_attributes.clone(), self.cell_attributes.clone());
        Ok(coarse)
    }

    /// The grid as a mesh of voxels (or pixels, lines, a vertex), on the same points and with the same arrays.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there are more than 2³² − 2 points; [`Error::NoMemory`].
    pub fn into_mesh(self) -> Result<Mesh> {
        let size = self.size();
        let cells = cells(size, STRAIGHT)?;
        let index = |p: usize| [p % size[0], p / size[0] % size[1], p / (size[0] * size[1])];
        let points = (0..self.point_count()).map(|p| self.point(index(p))).collect();
        let mut mesh = Mesh::new(points, cells, self.point_arrays, self.cell_arrays)?;
        mesh.set_attributes(self.point_attributes, self.cell_attributes);
        Ok(mesh)
    }
}

/// An array without values, called as another.
fn named(array: &Array) -> Array {
    Array { name: array.name.clone(), components: array.components, values: Values::U8(vec![]) }
}

fn size_of_points(axes: &[Vec<f64>; 3]) -> [usize; 3] {
    [0, 1, 2].map(|a| axes[a].len())
}

fn size_of_cells(axes: &[Vec<f64>; 3]) -> [usize; 3] {
    size_of_points(axes).map(cells_along)
}

/// Cells along an axis of so many points.
fn cells_along(points: usize) -> usize {
    points.saturating_sub(1).max(1)
}

fn product(size: [usize; 3]) -> Option<usize> {
    size.iter().try_fold(1_usize, |product, n| product.checked_mul(*n))
}

/// The cells of a grid with so many points along each axis, none if there is none, in VTK's order; of these types, by the number of
/// axes with more than one point.
///
/// # Errors
/// [`Error::Mesh`] if there are more than 2³² − 2 points; [`Error::NoMemory`].
pub(crate) fn cells(size: [usize; 3], types: [u8; 4]) -> Result<Cells> {
    let Some(points) = product(size).filter(|points| *points < u32::MAX as usize) else {
        let [x, y, z] = size;
        return Err(Error::Mesh(format!("{x} x {y} x {z} points are more than Halite can index (2^32 - 2)")));
    };
    let along: Vec<usize> = (0..3).filter(|a| size[*a] > 1).collect();
    let vtk_type = types[along.len()];
    let stride = [1, size[0], size[0] * size[1]];
    // The corners of a cell: the first axis fastest, but around a quadrilateral in bent cells.
    let mut corners: Vec<u32> = vec![0];
    for &a in &along {
        let step = stride[a] as u32;
        let mut far: Vec<u32> = corners.iter().map(|c| c + step).collect();
        if types == BENT && corners.len() == 2 {
            far.reverse();
        }
        corners.extend(far);
    }
    let of_axis = if points > 0 { size.map(cells_along) } else { [0; 3] };
    let count: usize = of_axis.iter().product();
    let bytes = (count * (corners.len() * 4 + 9) + points * size_of::<DVec3>()) as u64;
    memory::check(&format!("{count} cells of a grid"), bytes)?;
    let mut connectivity = Vec::with_capacity(count * corners.len());
    for k in 0..of_axis[2] {
        for j in 0..of_axis[1] {
            let row = (k * stride[2] + j * stride[1]) as u32;
            for first in row..row + of_axis[0] as u32 {
                connectivity.extend(corners.iter().map(|c| first + c));
            }
        }
    }
    let offsets = (0..=count as u64).map(|c| c * corners.len() as u64).collect();
    Ok(Cells { types: vec![vtk_type; count], offsets, connectivity })
}
