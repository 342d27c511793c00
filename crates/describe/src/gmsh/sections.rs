//! The sections of an MSH 4.1 file.

use super::source::Source;
use super::{Raw, SAVE_AS};
use coldplate_base::error::{Error, Result};

/// Use of an element type in this reader.
enum Kind {
    /// The first four nodes are the corners; the rest are nodes of a higher order.
    Tetrahedron,
    Triangle,
    /// A volume element of another shape.
    Other(&'static str),
    /// A surface element of another shape.
    Quadrangle,
    /// Points and lines.
    Lower,
}

/// Kind and nodes of a Gmsh element type.
fn element(kind: i64) -> Option<(Kind, u64)> {
    Some(match kind {
        4 => (Kind::Tetrahedron, 4),
        11 => (Kind::Tetrahedron, 10),
        29 => (Kind::Tetrahedron, 20),
        30 => (Kind::Tetrahedron, 35),
        31 => (Kind::Tetrahedron, 56),
        2 => (Kind::Triangle, 3),
        9 => (Kind::Triangle, 6),
        20 => (Kind::Triangle, 9),
        21 => (Kind::Triangle, 10),
        22 => (Kind::Triangle, 12),
        23 | 24 => (Kind::Triangle, 15),
        25 => (Kind::Triangle, 21),
        3 => (Kind::Quadrangle, 4),
        10 => (Kind::Quadrangle, 9),
        16 => (Kind::Quadrangle, 8),
        5 => (Kind::Other("hexahedron"), 8),
        12 => (Kind::Other("hexahedron"), 27),
        17 => (Kind::Other("hexahedron"), 20),
        92 => (Kind::Other("hexahedron"), 64),
        6 => (Kind::Other("prism"), 6),
        13 => (Kind::Other("prism"), 18),
        18 => (Kind::Other("prism"), 15),
        7 => (Kind::Other("pyramid"), 5),
        14 => (Kind::Other("pyramid"), 14),
        19 => (Kind::Other("pyramid"), 13),
        15 => (Kind::Lower, 1),
        1 => (Kind::Lower, 2),
        8 => (Kind::Lower, 3),
        26 => (Kind::Lower, 4),
        27 => (Kind::Lower, 5),
        28 => (Kind::Lower, 6),
        _ => return None,
    })
}

/// Reads a file from beginning to end.
pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let mut source = Source::new(bytes);
    header(&mut source)?;
    let mut raw = Raw::default();
    let (mut nodes, mut elements) = (false, false);
    while let Some(line) = source.filled_line() {
        let Some(name) = line.strip_prefix('$') else {
            return Err(source.error("a section is wanted here").read(line).help("the file is damaged; save the mesh again"));
        };
        source.section = name.chars().take(40).collect();
        match name {
            "PhysicalNames" => names(&mut source, &mut raw)?,
            "Entities" => entities(&mut source, &mut raw)?,
            "Nodes" if !nodes => {
                nodes = true;
                read_nodes(&mut source, &mut raw)?;
            }
            "Elements" if !elements => {
                elements = true;
                read_elements(&mut source, &mut raw)?;
            }
            "Nodes" | "Elements" => return Err(source.error(format!("a second ${name}")).help("the file is damaged; save the mesh again")),
            "PartitionedEntities" => {
                return Err(source
                    .error("the mesh is partitioned")
                    .help("save it in one piece: Mesh.NbPartitions = 0, or unpartition it in Gmsh"));
            }
            _ => source.skip_section()?,
        }
    }
    for (found, name) in [(nodes, "Nodes"), (elements, "Elements")] {
        if !found {
            return Err(Error::input(format!("the file has no ${name}"))
                .help("it was cut off, or saved without its mesh; mesh in three dimensions and save it again"));
        }
    }
    Ok(raw)
}

fn header(source: &mut Source<'_>) -> Result<()> {
    let foreign = |what: &str| Error::input(what).at_line(1).help(SAVE_AS);
    // Comments may stand before the header.
    let mut first = source.filled_line();
    if first.as_deref() == Some("$Comments") {
        source.section = "Comments".into();
        source.skip_section()?;
        first = source.filled_line();
    }
    if first.as_deref() != Some("$MeshFormat") {
        return Err(foreign("this is not a Gmsh mesh: it does not begin with $MeshFormat"));
    }
    source.section = "MeshFormat".into();
    let line = source.filled_line().unwrap_or_default();
    let fields: Vec<&str> = line.split_whitespace().collect();
    let [version, kind, size] = fields[..] else {
        return Err(foreign("the format line is wanted here, \"4.1 0 8\"").read(&line));
    };
    if version != "4.1" {
        return Err(foreign("only version 4.1 of the format can be read").read(version));
    }
    if size != "8" {
        return Err(foreign("the file was written by a program with integers of another size than 8 bytes").read(size));
    }
    match kind {
        "0" => {}
        "1" => {
            source.binary = true;
            let one: [u8; 4] = source.take()?;
            if one == 1i32.to_be_bytes() {
                return Err(foreign("the file is binary with the bytes in the other order (big endian)"));
            }
            if one != 1i32.to_le_bytes() {
                return Err(foreign("the file says that it is binary, but does not continue so"));
            }
        }
        _ => return Err(foreign("the file is neither text (0) nor binary (1)").read(kind)),
    }
    source.end_section()
}

/// `$PhysicalNames`, always text.
fn names(source: &mut Source<'_>, raw: &mut Raw) -> Result<()> {
    let count = source.filled_line().unwrap_or_default();
    let count: u64 = count.parse().map_err(|_| source.error("a count is wanted here").read(&count))?;
    for _ in 0..source.expect(count, 5, 5, "names")? {
        let line = source.filled_line().unwrap_or_default();
        let mut fields = line.splitn(3, char::is_whitespace);
        let mut next = || fields.next().unwrap_or_default().trim().to_string();
        let (dimension, tag, name) = (next().parse(), next().parse(), next());
        let quoted = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
        let (Ok(dimension), Ok(tag), Some(name)) = (dimension, tag, quoted) else {
            return Err(source.error("dimension, number and quoted name of a physical group are wanted here").read(line));
        };
        raw.names.insert((dimension, tag), name.to_string());
    }
    source.end_section()
}

/// `$Entities`: the physical groups of each surface and volume.
fn entities(source: &mut Source<'_>, raw: &mut Raw) -> Result<()> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = source.size()?;
    }
    for (dimension, count) in counts.into_iter().enumerate() {
        let (doubles, bounded) = if dimension == 0 { (3, false) } else { (6, true) };
        for _ in 0..source.expect(count, 10, 36, "entities")? {
            let tag = source.int()?;
            for _ in 0..doubles {
                source.double()?;
            }
            let groups = source.size()?;
            let groups = source.expect(groups, 2, 4, "physical groups")?;
            let mut physical = Vec::with_capacity(groups.min(64));
            for _ in 0..groups {
                physical.push(source.int()?);
            }
            if bounded {
                let bounds = source.size()?;
                for _ in 0..source.expect(bounds, 2, 4, "bounding entities")? {
                    source.int()?;
                }
            }
            if dimension >= 2 && !physical.is_empty() {
                raw.physical.insert((dimension as i64, tag), physical);
            }
        }
    }
    source.end_section()
}

fn read_nodes(source: &mut Source<'_>, raw: &mut Raw) -> Result<()> {
    let (blocks, count) = (source.size()?, source.size()?);
    // Smallest and largest tag are of no use.
    source.size()?;
    source.size()?;
    let count = source.expect(count, 8, 32, "nodes")?;
    raw.node_tags.reserve(count);
    raw.points.reserve(count);
    for _ in 0..source.expect(blocks, 8, 20, "blocks of nodes")? {
        let (dimension, _) = (source.int()?, source.int()?);
        let parametric = match source.int()? {
            0 => 0,
            1 if (0..=3).contains(&dimension) => dimension,
            other => return Err(source.error("a block of nodes is parametric (1) or not (0)").read(other)),
        };
        let nodes = source.size()?;
        let nodes = source.expect(nodes, 8, 32, "nodes")?;
        for _ in 0..nodes {
            let tag = source.size()?;
            raw.node_tags.push(tag);
        }
        for _ in 0..nodes {
            raw.points.push([source.double()?, source.double()?, source.double()?]);
            for _ in 0..parametric {
                source.double()?;
            }
        }
    }
    if raw.points.len() != count {
        return Err(source
            .error(format!("{count} nodes are announced, {} are there", raw.points.len()))
            .help("the file is damaged; save the mesh again"));
    }
    source.end_section()
}

fn read_elements(source: &mut Source<'_>, raw: &mut Raw) -> Result<()> {
    let (blocks, count) = (source.size()?, source.size()?);
    // Smallest and largest tag are of no use.
    source.size()?;
    source.size()?;
    source.expect(count, 4, 16, "elements")?;
    let mut read = 0u64;
    for _ in 0..source.expect(blocks, 8, 20, "blocks of elements")? {
        let (dimension, entity) = (source.int()?, source.int()?);
        let number = source.int()?;
        let Some((kind, nodes)) = element(number) else {
            return Err(source
                .error(format!("elements of type {number} are not known"))
                .help("mesh with tetrahedra of first or second order"));
        };
        let elements = source.size()?;
        let elements = source.expect(elements, 2 * (nodes + 1), 8 * (nodes + 1), "elements")?;
        read += elements as u64;
        let wanted = match kind {
            Kind::Tetrahedron | Kind::Other(_) => 3,
            Kind::Triangle | Kind::Quadrangle => 2,
            Kind::Lower => dimension,
        };
        if dimension != wanted {
            return Err(source
                .error(format!("elements of type {number} in an entity of dimension {dimension}"))
                .help("the file is damaged; save the mesh again"));
        }
        let (tets, tris) = (raw.tetrahedra.len(), raw.triangles.len());
        for _ in 0..elements {
            let tag = source.size()?;
            let mut corners = [0; 4];
            for i in 0..nodes {
                let node = source.size()?;
                if let Some(corner) = corners.get_mut(i as usize) {
                    *corner = node;
                }
            }
            match kind {
                Kind::Tetrahedron => {
                    raw.tetrahedra.push(corners);
                    raw.tags.push(tag);
                }
                Kind::Triangle => {
                    raw.triangles.push([corners[0], corners[1], corners[2]]);
                    raw.triangle_tags.push(tag);
                }
                Kind::Other(name) => {
                    raw.others.entry(entity).or_insert((name, tag));
                }
                Kind::Quadrangle | Kind::Lower => {}
            }
        }
        match kind {
            Kind::Tetrahedron => {
                raw.curved += if nodes > 4 { elements } else { 0 };
                raw.volume_runs.push((entity, tets..raw.tetrahedra.len()));
            }
            Kind::Triangle => raw.surface_runs.push((entity, tris..raw.triangles.len())),
            _ => {}
        }
        raw.has_surface_elements |= wanted == 2;
    }
    if read != count {
        return Err(source
            .error(format!("{count} elements are announced, {read} are there"))
            .help("the file is damaged; save the mesh again"));
    }
    source.end_section()
}
