//! What a file says of a mesh's arrays beside their values.

/// What an array is for, as VTK's `vtkDataSetAttributes` tells them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The active scalars: what is drawn unless somebody says otherwise.
    Scalars,
    /// The active vectors.
    Vectors,
    /// The active tensors.
    Tensors,
    /// Unit vectors across surfaces.
    Normals,
    /// Unit vectors along surfaces.
    Tangents,
    /// Places in a picture that is laid over a surface.
    TextureCoordinates,
    /// A number for each point or cell that no other has, also among other meshes.
    GlobalIds,
    /// A name of each point or cell in what it was made from.
    PedigreeIds,
    /// Which edges of polygons are drawn.
    EdgeFlags,
    /// Weights of the nodes of Bézier cells.
    RationalWeights,
    /// The degrees of Lagrange and Bézier cells along their axes.
    HigherOrderDegrees,
}

impl Role {
    /// All roles, each with the attribute of `PointData` and `CellData` in VTK's XML files that names its array.
    pub const ALL: [(Role, &'static str); 11] = [
        (Role::Scalars, "Scalars"),
        (Role::Vectors, "Vectors"),
        (Role::Tensors, "Tensors"),
        (Role::Normals, "Normals"),
        (Role::Tangents, "Tangents"),
        (Role::TextureCoordinates, "TCoords"),
        (Role::GlobalIds, "GlobalIds"),
        (Role::PedigreeIds, "PedigreeIds"),
        (Role::EdgeFlags, "EdgeFlag"),
        (Role::RationalWeights, "RationalWeights"),
        (Role::HigherOrderDegrees, "HigherOrderDegrees"),
    ];
}

/// An array that a file has, but that is not in the mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// What is wrong with it.
    pub why: String,
}

/// What is known of the arrays of points, or of those of cells.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Attributes {
    /// Arrays that the file says the role of.
    pub roles: Vec<(Role, String)>,
    /// Arrays that are not whole, or of a kind that is not read.
    pub left_out: Vec<LeftOut>,
}

impl Attributes {
    /// What the array of that name is for, if the file says so.
    pub fn role(&self, name: &str) -> Option<Role> {
        self.roles.iter().find(|(_, of)| of == name).map(|(role, _)| *role)
    }

    /// Why the array of that name was left out, if it was.
    pub fn why_left_out(&self, name: &str) -> Option<&str> {
        self.left_out.iter().find(|array| array.name == name).map(|array| &*array.why)
    }

    /// Notes what an array is for, unless another has this role.
    pub(crate) fn add_role(&mut self, role: Role, name: &str) {
        if !name.is_empty() && self.roles.iter().all(|known| known.0 != role) {
            self.roles.push((role, name.to_owned()));
        }
    }
}
