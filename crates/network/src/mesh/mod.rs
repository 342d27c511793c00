//! Parts become cells: one structured grid per block, joined wherever faces touch. Imported parts bring their
//! tetrahedra.

mod draw;
pub mod grid;
pub mod hottest;
pub mod hull;
pub mod overlap;
pub mod path;
pub mod ray;
pub mod sight;
pub mod tetra;
pub mod vtu;

use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{BlockShape, Face, Machine, Side};
use grid::{Grid, divisions};
use overlap::{Overlap, overlaps};
use tetra::Tetra;
use tetra::touch::{self, Other, Touch};

/// Open share of a face beside an imported part that still counts as rounding, dimensionless. Chosen: true gaps against slivers.
const LEAST_OPEN: f64 = 1e-3;

/// Two faces that touch.
#[derive(Debug, Clone)]
pub struct TouchingFaces {
    /// Index of the first grid, and its side.
    pub a: (usize, Side),
    /// Index of the second grid, and its side.
    pub b: (usize, Side),
    /// Every pair of cells that share area.
    pub overlaps: Vec<Overlap>,
}

impl TouchingFaces {
    /// Shared area, m².
    pub fn area(&self) -> f64 {
        self.overlaps.iter().map(|o| o.area).sum()
    }
}

/// Cells, the faces they share between blocks, and the faces that stay open.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// One grid per block, in the order of parts and blocks.
    pub grids: Vec<Grid>,
    /// Resolved nodes in total: the cells of all grids, then the vertices of all imported parts.
    pub cells: usize,
    /// Touching faces.
    pub interfaces: Vec<TouchingFaces>,
    /// Imported parts, in the order of the parts.
    pub tetra: Vec<Tetra>,
    /// Touching areas of imported parts with blocks and with each other.
    pub touches: Vec<Touch>,
    /// Element size that was used, m (times each part's own scale).
    pub element_size: f64,
    /// Open area of each boundary cell face: `open[grid][side]` in the order of [`Grid::side_cells`], m².
    open: Vec<[Vec<f64>; 6]>,
}

impl Mesh {
    /// A mesh of about `target` cells: the element size is the smallest that does not exceed it. Imported parts
    /// keep their elements and are not counted.
    ///
    /// # Errors
    /// The target is zero, or more than 1e9 cells, the limit of the numbering.
    pub fn with_cells(machine: &Machine, target: usize) -> Result<Self> {
        Self::with_size(machine, Self::size_for(machine, target)?)
    }

    /// The element size (m) of a mesh of about `target` cells.
    ///
    /// # Errors
    /// Errors of [`Mesh::with_cells`].
    pub fn size_for(machine: &Machine, target: usize) -> Result<f64> {
        if target > 1_000_000_000 {
            return Err(Error::input("more cells than can be numbered").at_key("cells").read(target).help("ask for at most 1e9 cells"));
        }
        if target == 0 {
            return Err(Error::input("a mesh needs at least one cell")
                .at_key("cells")
                .read(target)
                .help("leave --cells out for the default"));
        }
        if machine.parts.iter().all(|p| p.blocks.is_empty()) {
            return Ok(1.0); // there is nothing to cut
        }
        let (mut fine, mut coarse) = (1e-5, 10.0);
        for _ in 0..60 {
            let middle = f64::sqrt(fine * coarse);
            if Self::count(machine, middle) > target as f64 { fine = middle } else { coarse = middle }
        }
        Ok(coarse)
    }

    /// How many cells an element size (m) gives; those of imported parts are not counted.
    pub fn count(machine: &Machine, size: f64) -> f64 {
        let blocks = machine.parts.iter().flat_map(|p| p.blocks.iter().map(move |b| (p, b)));
        blocks.map(|(part, block)| divisions(block, size * part.element_scale).iter().map(|n| *n as f64).product::<f64>()).sum()
    }

    /// A mesh with a given element size (m).
    ///
    /// # Errors
    /// The size is not positive, or gives more cells than can be numbered.
    pub fn with_size(machine: &Machine, size: f64) -> Result<Self> {
        if size.is_nan() || size <= 0.0 {
            return Err(Error::input("the element size must be positive").at_key("element_size").read(size));
        }
        Self::with_divisions(machine, &Self::divisions_at(machine, size), size)
    }

    /// Cell counts of each block, in the order of parts and blocks, that an element size (m) gives.
    pub fn divisions_at(machine: &Machine, size: f64) -> Vec<[usize; 3]> {
        let blocks = machine.parts.iter().flat_map(|p| p.blocks.iter().map(move |b| (p, b)));
        blocks.map(|(part, block)| divisions(block, size * part.element_scale)).collect()
    }

    /// A mesh with given cell counts for each block, in the order of parts and blocks (those that are missing get
    /// one cell along each axis); `size` (m) is noted as its element size. With the counts of another machine's
    /// mesh the cells keep their numbers while the geometry moves a little.
    ///
    /// # Errors
    /// More cells than can be numbered.
    pub fn with_divisions(machine: &Machine, counts: &[[usize; 3]], size: f64) -> Result<Self> {
        let mut grids: Vec<Grid> = Vec::new();
        let mut cells = 0;
        for (p, part) in machine.parts.iter().enumerate() {
            for (b, block) in part.blocks.iter().enumerate() {
                let grid = Grid::new(p, b, block, counts.get(grids.len()).copied().unwrap_or([1; 3]), cells);
                cells += grid.len();
                if cells > 1_000_000_000 {
                    return Err(Error::input("more cells than can be numbered").at_key(format!("part.{}", part.name)));
                }
                grids.push(grid);
            }
        }
        let interfaces = find_interfaces(machine, &grids);
        let mut open: Vec<[Vec<f64>; 6]> =
            grids.iter().map(|g| Side::ALL.map(|side| g.side_cells(side).map(|c| g.face_area(c, side)).collect())).collect();
        for interface in &interfaces {
            for o in &interface.overlaps {
                for ((g, side), cell) in [(interface.a, o.a), (interface.b, o.b)] {
                    let left = &mut open[g][side as usize][side_index(&grids[g], side, cell)];
                    // Rounding must not leave a sliver that radiates, nor a negative area.
                    *left = if *left - o.area < 1e-9 * *left { 0.0 } else { *left - o.area };
                }
            }
        }
        let mut tetra = Vec::new();
        for (p, import) in machine.parts.iter().enumerate().filter_map(|(p, part)| Some((p, part.import.as_ref()?))) {
            let imported = Tetra::new(p, import, cells);
            cells += imported.points.len();
            tetra.push(imported);
        }
        let mut mesh = Self { grids, cells, interfaces, tetra, touches: Vec::new(), element_size: size, open };
        mesh.touches = find_touches(machine, &mesh);
        mesh.cover();
        Ok(mesh)
    }

    /// Subtracts the areas between imported parts and blocks from the open areas of both.
    fn cover(&mut self) {
        for touch in &self.touches {
            for piece in &touch.pieces {
                let own = &mut self.tetra[touch.tetra].open[piece.face as usize];
                (0..3).for_each(|i| own[i] -= piece.covered[i]);
                match touch.other {
                    Other::Grid(g, side) => {
                        let cell = piece.other as usize;
                        self.open[g][side as usize][side_index(&self.grids[g], side, cell)] -= piece.area();
                    }
                    Other::Tetra(t) => {
                        let far = &mut self.tetra[t].open[piece.other as usize];
                        (0..3).for_each(|j| far[j] -= (0..3).map(|i| piece.shared[i][j]).sum::<f64>());
                    }
                }
            }
        }
        // Rounding, and the difference between a facet and the curved face it stands for, must not radiate.
        let grids = &self.grids;
        for touch in &self.touches {
            if let Other::Grid(g, side) = touch.other {
                for (left, c) in self.open[g][side as usize].iter_mut().zip(grids[g].side_cells(side)) {
                    if *left < LEAST_OPEN * grids[g].face_area(c, side) {
                        *left = 0.0;
                    }
                }
            }
        }
        for tetra in &mut self.tetra {
            for face in 0..tetra.open.len() {
                let third = tetra.face_area(face) / 3.0;
                for open in tetra.open[face].iter_mut().filter(|open| **open < LEAST_OPEN * third) {
                    *open = 0.0;
                }
            }
        }
    }

    /// The imported volume of a part.
    pub fn tetra_of(&self, part: usize) -> Option<&Tetra> {
        self.tetra.iter().find(|t| t.part == part)
    }

    /// Cell counts of each block, in the order of parts and blocks.
    pub fn divisions(&self) -> Vec<[usize; 3]> {
        self.grids.iter().map(|g| [0, 1, 2].map(|d| g.n(d))).collect()
    }

    /// The grids of a part.
    pub fn grids_of(&self, part: usize) -> impl Iterator<Item = (usize, &Grid)> {
        self.grids.iter().enumerate().filter(move |(_, g)| g.part == part)
    }

    /// The open cell faces on a side of a grid: (cell indices, open area m²), closed ones left out.
    pub fn open_faces(&self, grid: usize, side: Side) -> impl Iterator<Item = ([usize; 3], f64)> + '_ {
        let areas = &self.open[grid][side as usize];
        self.grids[grid].side_cells(side).zip(areas).filter(|(_, area)| **area > 0.0).map(|(c, area)| (c, *area))
    }

    /// Every open cell face of a machine face: (grid, cell indices, area m²).
    pub(crate) fn open_cells(&self, face: Face) -> Vec<(usize, [usize; 3], f64)> {
        self.grids_of(face.part)
            .filter(|(_, g)| face.block.is_none_or(|b| b == g.block))
            .flat_map(|(i, _)| self.open_faces(i, face.side).map(move |(c, area)| (i, c, area)))
            .collect()
    }

    /// Every cell of a machine face, open or not: (grid, cell indices, area m²). A face of a whole part leaves out areas joined to
    /// other blocks of this part.
    pub fn face_cells(&self, face: Face) -> Vec<(usize, [usize; 3], f64)> {
        let mut found = Vec::new();
        for (i, g) in self.grids_of(face.part).filter(|(_, g)| face.block.is_none_or(|b| b == g.block)) {
            let mut areas: Vec<f64> = g.side_cells(face.side).map(|c| g.face_area(c, face.side)).collect();
            for interface in &self.interfaces {
                for (me, other, first) in [(interface.a, interface.b, true), (interface.b, interface.a, false)] {
                    if me == (i, face.side) && self.grids[other.0].part == face.part {
                        for o in &interface.overlaps {
                            let cell = if first { o.a } else { o.b };
                            areas[side_index(g, face.side, cell)] -= o.area;
                        }
                    }
                }
            }
            found.extend(g.side_cells(face.side).zip(areas).filter(|(_, a)| *a > 1e-12).map(|(c, a)| (i, c, a)));
        }
        found
    }

    /// The grid of a part that holds a point (m), or the nearest one within `tolerance`.
    pub fn grid_at(&self, part: usize, point: [f64; 3], tolerance: f64) -> Option<usize> {
        self.grids_of(part).find(|(_, g)| g.contains(point, tolerance)).map(|(i, _)| i)
    }

    /// Volume of a part, m³.
    pub fn volume(&self, part: usize) -> f64 {
        if let Some(tetra) = self.tetra_of(part) {
            return tetra.volume();
        }
        self.grids_of(part).map(|(_, g)| g.cells().map(|c| g.volume(c)).sum::<f64>()).sum()
    }
}

/// Place of a boundary cell in the order of [`Grid::side_cells`].
fn side_index(grid: &Grid, side: Side, cell: usize) -> usize {
    let c = grid.indices(cell);
    let [p, q] = grid::tangents(side.axis());
    c[p] + grid.n(p) * c[q]
}

/// The box around a block, m.
pub fn bounds(shape: &BlockShape) -> ([f64; 3], [f64; 3]) {
    match shape {
        BlockShape::Box { min, max } => (*min, *max),
        BlockShape::Cylinder { axis, base, length, outer, .. } => {
            let (mut low, mut high) = (base.map(|x| x - outer), base.map(|x| x + outer));
            low[axis.index()] = base[axis.index()];
            high[axis.index()] = base[axis.index()] + length;
            (low, high)
        }
        BlockShape::Sphere { centre, outer, .. } => (centre.map(|x| x - outer), centre.map(|x| x + outer)),
    }
}

/// Touching areas of imported parts with blocks and with each other.
fn find_touches(machine: &Machine, mesh: &Mesh) -> Vec<Touch> {
    let mut found = Vec::new();
    let mut push = |tetra: usize, other: Other, pieces: Vec<touch::SharedArea>| {
        if !pieces.is_empty() {
            found.push(Touch { tetra, other, pieces });
        }
    };
    for (t, tetra) in mesh.tetra.iter().enumerate() {
        let (low, high) = tetra.bounds();
        let slack = 1e-3 * (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
        for (g, grid) in mesh.grids.iter().enumerate() {
            let (low_g, high_g) = bounds(&machine.parts[grid.part].blocks[grid.block].shape);
            if (0..3).any(|d| low[d] - slack > high_g[d] || high[d] + slack < low_g[d]) {
                continue;
            }
            for side in Side::ALL {
                push(t, Other::Grid(g, side), touch::with_grid(tetra, grid, side));
            }
        }
        for (o, other) in mesh.tetra.iter().enumerate().skip(t + 1) {
            push(t, Other::Tetra(o), touch::with_tetra(tetra, other));
        }
    }
    found
}

fn find_interfaces(machine: &Machine, grids: &[Grid]) -> Vec<TouchingFaces> {
    let bounds: Vec<_> = grids.iter().map(|g| bounds(&machine.parts[g.part].blocks[g.block].shape)).collect();
    let near = |a: usize, b: usize| {
        (0..3).all(|d| bounds[a].0[d] <= bounds[b].1[d] + overlap::TOUCHING && bounds[b].0[d] <= bounds[a].1[d] + overlap::TOUCHING)
    };
    let mut found = Vec::new();
    for a in 0..grids.len() {
        for b in (a + 1..grids.len()).filter(|b| near(a, *b)) {
            for side_a in Side::ALL {
                for side_b in Side::ALL {
                    let overlaps = overlaps(&grids[a], side_a, &grids[b], side_b);
                    if !overlaps.is_empty() {
                        found.push(TouchingFaces { a: (a, side_a), b: (b, side_b), overlaps });
                    }
                }
            }
        }
    }
    found
}
