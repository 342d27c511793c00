//! What the engineer writes: the machine file with its schema, and meshes imported from CAD.

pub mod gmsh;
pub mod machine;
pub mod schema;
