//! From a described machine to the thermal network: cells and faces, then nodes, conductors and sources.

pub mod elastic;
pub mod mesh;
pub mod network;
