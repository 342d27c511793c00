//! What the engineer writes: the machine file, and meshes imported from CAD.

pub mod gmsh;
pub mod machine;
