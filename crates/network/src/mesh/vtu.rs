//! The mesh with cell fields as a VTK unstructured grid, for ParaView.

use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::Path;

use super::Mesh;
use super::draw::Drawing;
use super::grid::{Grid, LocalFrame};
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Celsius, Kelvin};
use coldplate_describe::machine::{Machine, Property};

/// VTK's number of a tetrahedron (VTK file formats).
const TETRAHEDRON: u8 = 10;

/// Writes temperature (degC), heat flux (W/m²), part number and, in the field data, part names.
/// Curved cells are drawn with straight edges, shells of spheres as facets; tetrahedra have the mean of their
/// corners. `temperatures` are those of the mesh's nodes, K.
///
/// # Errors
/// The file cannot be written; nothing is left behind under its name then.
pub fn write(path: &Path, machine: &Machine, mesh: &Mesh, temperatures: &[f64]) -> Result<()> {
    atomic_file::replace(path, |temporary| {
        let attempt = || {
            let mut file = BufWriter::new(std::fs::File::create(temporary)?);
            body(&mut file, machine, mesh, temperatures)?;
            file.flush()
        };
        attempt().map_err(|e| Error::file("write", path, e))
    })
}

fn body(file: &mut impl Write, machine: &Machine, mesh: &Mesh, temperatures: &[f64]) -> std::io::Result<()> {
    let Drawing { mut points, mut connectivity, mut offsets, mut types, owners, outward } = Drawing::new(&mesh.grids);
    let (mut celsius, mut part, mut flux) = (Vec::with_capacity(types.len()), Vec::with_capacity(types.len()), Vec::new());
    for ((g, c), outward) in owners.into_iter().zip(outward) {
        let grid = &mesh.grids[g];
        let conductivity = &machine.materials[machine.parts[grid.part].material].conductivity;
        celsius.push(Celsius::from(Kelvin(temperatures[grid.cell(c)])).0 as f32);
        part.push(grid.part as u32);
        flux.extend(heat_flux(grid, c, outward, temperatures, conductivity).map(|q| q as f32));
    }
    for tetra in &mesh.tetra {
        let first = (points.len() / 3) as u32;
        points.extend(tetra.points.iter().flatten().map(|x| *x as f32));
        let conductivity = &machine.materials[machine.parts[tetra.part].material].conductivity;
        for (t, corners) in tetra.body.tetrahedra.iter().enumerate() {
            connectivity.extend(corners.map(|c| first + c));
            offsets.push(connectivity.len() as u32);
            types.push(TETRAHEDRON);
            let at = corners.map(|c| temperatures[tetra.node(c)]);
            let mean = at.iter().sum::<f64>() / 4.0;
            celsius.push(Celsius::from(Kelvin(mean)).0 as f32);
            part.push(tetra.part as u32);
            let gradients = tetra.gradients(t);
            let slope = |d: usize| (0..4).map(|i| gradients[i][d] * at[i]).sum::<f64>();
            flux.extend([0, 1, 2].map(|d| (-conductivity[d].at(mean) * slope(d)) as f32));
        }
    }
    let names: Vec<&str> = machine.parts.iter().map(|p| p.name.as_str()).collect();

    writeln!(file, r#"<?xml version="1.0"?>"#)?;
    writeln!(file, r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#)?;
    writeln!(file, "<UnstructuredGrid>\n<FieldData>")?;
    writeln!(file, r#"<DataArray type="String" Name="part_names" NumberOfTuples="{}" format="ascii">"#, names.len())?;
    let mut codes = String::new();
    for byte in names.iter().flat_map(|n| n.bytes().chain([0])) {
        let _ = write!(codes, "{byte} ");
    }
    writeln!(file, "{codes}\n</DataArray>\n</FieldData>")?;
    writeln!(file, r#"<Piece NumberOfPoints="{}" NumberOfCells="{}">"#, points.len() / 3, types.len())?;
    writeln!(file, "<Points>")?;
    array(file, "Float32", "Points", 3, points.iter().flat_map(|x| x.to_le_bytes()))?;
    writeln!(file, "</Points>\n<Cells>")?;
    array(file, "UInt32", "connectivity", 1, connectivity.iter().flat_map(|x| x.to_le_bytes()))?;
    array(file, "UInt32", "offsets", 1, offsets.iter().flat_map(|x| x.to_le_bytes()))?;
    array(file, "UInt8", "types", 1, types.into_iter())?;
    writeln!(file, r#"</Cells>"#)?;
    writeln!(file, r#"<CellData Scalars="temperature_degC" Vectors="heat_flux_W_m2">"#)?;
    array(file, "Float32", "temperature_degC", 1, celsius.iter().flat_map(|x| x.to_le_bytes()))?;
    array(file, "Float32", "heat_flux_W_m2", 3, flux.iter().flat_map(|x| x.to_le_bytes()))?;
    array(file, "UInt32", "part", 1, part.iter().flat_map(|x| x.to_le_bytes()))?;
    writeln!(file, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// One array in VTK's inline binary form: base64 of the length and of the bytes.
fn array(file: &mut impl Write, kind: &str, name: &str, components: usize, bytes: impl Iterator<Item = u8>) -> std::io::Result<()> {
    let bytes: Vec<u8> = bytes.collect();
    writeln!(file, r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">"#)?;
    let header = (bytes.len() as u64).to_le_bytes();
    base64(file, header.iter().chain(&bytes))?;
    writeln!(file, "\n</DataArray>")
}

fn base64<'a>(file: &mut impl Write, bytes: impl Iterator<Item = &'a u8>) -> std::io::Result<()> {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = bytes.copied();
    while let Some(a) = bytes.next() {
        let (b, c) = (bytes.next(), bytes.next());
        let word = u32::from(a) << 16 | u32::from(b.unwrap_or(0)) << 8 | u32::from(c.unwrap_or(0));
        let digit = |shift: u32| ALPHABET[(word >> shift & 63) as usize];
        let quad = [digit(18), digit(12), if b.is_some() { digit(6) } else { b'=' }, if c.is_some() { digit(0) } else { b'=' }];
        file.write_all(&quad)?;
    }
    Ok(())
}

/// Heat flux in a cell, W/m², in machine coordinates: minus conductivity times the gradient of the
/// temperatures of the cell and its neighbours in the block (one-sided at the block's faces). In a sphere it
/// points along `outward`, a unit vector.
pub fn heat_flux(grid: &Grid, c: [usize; 3], outward: [f64; 3], temperatures: &[f64], conductivity: &[Property; 3]) -> [f64; 3] {
    let here = temperatures[grid.cell(c)];
    let local = [0, 1, 2].map(|d| {
        let (low, high) = (c[d].saturating_sub(1), (c[d] + 1).min(grid.n(d) - 1));
        if low == high {
            return 0.0;
        }
        let at = |i: usize| {
            let mut other = c;
            other[d] = i;
            temperatures[grid.cell(other)]
        };
        let scale = if d == 1 && grid.is_cylindrical() { grid.centre(0, c[0]) } else { 1.0 };
        -conductivity[d].at(here) * (at(high) - at(low)) / ((grid.centre(d, high) - grid.centre(d, low)) * scale)
    });
    match grid.frame {
        LocalFrame::Cartesian => local,
        LocalFrame::Spherical { .. } => outward.map(|e| e * local[0]),
        LocalFrame::Cylindrical { axis, .. } => {
            let (sin, cos) = grid.centre(1, c[1]).sin_cos();
            let [u, v] = LocalFrame::normals(axis);
            let mut flux = [0.0; 3];
            flux[axis.index()] = local[2];
            flux[u] = local[0] * cos - local[1] * sin;
            flux[v] = local[0] * sin + local[1] * cos;
            flux
        }
    }
}
