//! Imported tetrahedral meshes: exact solutions and the order of convergence, contacts with blocks and with each other,
//! another program's solution of the same geometry, and files that are damaged.
//!
//! The meshes are Gmsh's own (scripts/make-meshes); `bench` halves their edges for convergence.

mod bad;
mod bench;
mod bracket;
mod contact;
mod enclosure;
mod exact;
mod sphere;
