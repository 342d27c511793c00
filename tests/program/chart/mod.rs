//! `chart` and chart definitions; how figures look is tested in crates/figures.

mod definitions;
