//! VTK's cell types by name.

/// Names and dimensions of VTK's cell types (`vtkCellType.h`).
static TYPES: &[(u8, u8, &str)] = &[
    (0, 0, "empty cell"),
    (1, 0, "vertex"),
    (2, 0, "poly-vertex"),
    (3, 1, "line"),
    (4, 1, "poly-line"),
    (5, 2, "triangle"),
    (6, 2, "triangle strip"),
    (7, 2, "polygon"),
    (8, 2, "pixel"),
    (9, 2, "quad"),
    (10, 3, "tetrahedron"),
    (11, 3, "voxel"),
    (12, 3, "hexahedron"),
    (13, 3, "wedge"),
    (14, 3, "pyramid"),
    (15, 3, "pentagonal prism"),
    (16, 3, "hexagonal prism"),
    (21, 1, "quadratic edge"),
    (22, 2, "quadratic triangle"),
    (23, 2, "quadratic quad"),
    (24, 3, "quadratic tetrahedron"),
    (25, 3, "quadratic hexahedron"),
    (26, 3, "quadratic wedge"),
    (27, 3, "quadratic pyramid"),
    (28, 2, "biquadratic quad"),
    (29, 3, "triquadratic hexahedron"),
    (30, 2, "quadratic linear quad"),
    (31, 3, "quadratic linear wedge"),
    (32, 3, "biquadratic quadratic wedge"),
    (33, 3, "biquadratic quadratic hexahedron"),
    (34, 2, "biquadratic triangle"),
    (35, 1, "cubic line"),
    (36, 2, "quadratic polygon"),
    (37, 3, "triquadratic pyramid"),
    (41, 3, "convex point set"),
    (42, 3, "polyhedron"),
    (51, 1, "parametric curve"),
    (52, 2, "parametric surface"),
    (53, 2, "parametric triangle surface"),
    (54, 2, "parametric quad surface"),
    (55, 3, "parametric tetrahedron region"),
    (56, 3, "parametric hexahedron region"),
    (60, 1, "higher-order edge"),
    (61, 2, "higher-order triangle"),
    (62, 2, "higher-order quad"),
    (63, 2, "higher-order polygon"),
    (64, 3, "higher-order tetrahedron"),
    (65, 3, "higher-order wedge"),
    (66, 3, "higher-order pyramid"),
    (67, 3, "higher-order hexahedron"),
    (68, 1, "Lagrange curve"),
    (69, 2, "Lagrange triangle"),
    (70, 2, "Lagrange quadrilateral"),
    (71, 3, "Lagrange tetrahedron"),
    (72, 3, "Lagrange hexahedron"),
    (73, 3, "Lagrange wedge"),
    (74, 3, "Lagrange pyramid"),
    (75, 1, "Bezier curve"),
    (76, 2, "Bezier triangle"),
    (77, 2, "Bezier quadrilateral"),
    (78, 3, "Bezier tetrahedron"),
    (79, 3, "Bezier hexahedron"),
    (80, 3, "Bezier wedge"),
    (81, 3, "Bezier pyramid"),
];

/// What VTK calls a cell type, in words; "unknown cell type" if it has none of that number.
pub fn name(vtk_type: u8) -> &'static str {
    TYPES.iter().find(|t| t.0 == vtk_type).map_or("unknown cell type", |t| t.2)
}

/// The dimension of a cell type, 0 to 3; `None` if VTK has none of that number.
pub fn dimension(vtk_type: u8) -> Option<u8> {
    TYPES.iter().find(|t| t.0 == vtk_type).map(|t| t.1)
}
