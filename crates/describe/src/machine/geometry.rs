//! Parts: blocks, their places, their surfaces.

use std::f64::consts::PI;
use std::path::Path;

use super::import::{Library, import};
use super::keys::bodies as keys;
use super::library::Shelf;
use super::names::{Index, Spelling, lookup, side_of};
use super::parts::{BlockShape, CoordinateAxis, Part, PartBlock, PartSurface};
use super::shape::bounds;
use super::symbols::Symbols;
use super::variables::formula;
use coldplate_base::document::{Section, Value, suggestion};
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

/// Smallest and largest size of a block, m. Chosen: catches a wrong unit, allows every real machine.
const SIZES: (f64, f64) = (1e-6, 1e3);
/// Largest distance from the origin, m. Chosen: catches a wrong unit, keeps coordinates exact to picometres.
const FARTHEST: f64 = 1e4;

/// A part while it is being read.
struct Draft<'a> {
    part: Part,
    section: Section<'a>,
    /// Whether the part's place is final; a part on another waits for the other.
    placed: bool,
}

/// Reads `[part.NAME]`.
pub(super) fn parts(root: &Section<'_>, shelf: &mut Shelf, folder: &Path, symbols: &Symbols) -> Result<Vec<Part>> {
    let mut meshes = Library::new(folder);
    let names: Vec<String> = root.sections("part")?.into_iter().map(|(name, _)| name).collect();
    let usual = surfaces(root, &names)?;
    let mut drafts: Vec<Draft<'_>> = Vec::new();
    for (name, section) in root.sections("part")? {
        check_name(&name, &section)?;
        let material = shelf.take(&section.value("material")?)?;
        let mut import = import(&section, &mut meshes)?;
        let mut blocks = if import.is_some() { Vec::new() } else { blocks(&section)? };
        if let Some(at) = section.opt_triple("at", Dimension::LENGTH)? {
            check_distance(&section, "at", &at)?;
            blocks.iter_mut().for_each(|block| shift(&mut block.shape, at));
            if let Some(import) = &mut import {
                import.at = at;
            }
        }
        if section.has("at") && section.has("on") {
            return Err(section
                .error_at("on", "'at' and 'on' exclude each other")
                .help("use 'offset' to move a part along the face it is on"));
        }
        let element_scale = keys::ELEMENT_SCALE.read(&section)?;
        if !(0.01..=100.0).contains(&element_scale) {
            return Err(section
                .error_at("element_scale", "the element scale must be between 0.01 and 100")
                .help("0.5 halves the cells of this part"));
        }
        let stated_flux_area = section.opt_positive("stated_flux_area", Dimension::AREA)?;
        let start = section.opt("start").map(|value| formula(&value, Dimension::TEMPERATURE, symbols)).transpose()?;
        let surface = usual[drafts.len()].clone();
        let part = Part { name, material, blocks, import, element_scale, surface, start, stated_flux_area };
        drafts.push(Draft { part, placed: !section.has("on"), section });
    }
    place_all(&mut drafts)?;
    let mut parts: Vec<Part> = drafts.iter().map(|draft| draft.part.clone()).collect();
    for (at, draft) in drafts.into_iter().enumerate() {
        let surface = surface(&draft.section, at, &parts, &usual[at])?;
        parts[at].surface = surface;
        draft.section.finish()?;
    }
    Ok(parts)
}

/// Longest name that a surrogate file holds, in bytes: the limit of its format.
const LONGEST_NAME: usize = coldplate_base::terms::MAX_NAME;

/// Checks that a name has none of the signs of a face such as `part[2].+z`.
pub(super) fn check_name(name: &str, section: &Section<'_>) -> Result<()> {
    if name.trim() != name || name.is_empty() || name.contains(['.', '[', ']']) {
        return Err(section.error(format!("'{name}' cannot be a name")).help("use letters, digits, spaces, _ and -"));
    }
    check_length(name, section)
}

/// Checks that a name fits into a surrogate file, so that the error shows here, not after a sweep; and that it differs
/// from other names where a reader sees it: no spaces at its ends, no characters without a shape, no accents of their own.
pub(super) fn check_length(name: &str, section: &Section<'_>) -> Result<()> {
    let unseen = |c: char| matches!(c, '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    // Combining accents of Latin, Greek and Cyrillic letters, which have composed forms.
    let accent = |c: char| ('\u{300}'..='\u{36f}').contains(&c);
    let odd = name.chars().find(|c| unseen(*c) || accent(*c));
    if let Some(odd) = odd.or_else(|| (name.trim() != name).then_some(' ')) {
        let what = match odd {
            ' ' => "a name neither begins nor ends with a space".to_string(),
            odd if accent(odd) => format!("this name has an accent apart from its letter, U+{:04X}", u32::from(odd)),
            odd => format!("this name has a character that cannot be seen, U+{:04X}", u32::from(odd)),
        };
        return Err(section.error(what).read(format!("{name:?}")).help("two names that look alike would be two things: write it anew"));
    }
    if name.len() <= LONGEST_NAME && !name.chars().any(char::is_control) {
        return Ok(());
    }
    Err(section
        .error(format!("a name has at most {LONGEST_NAME} bytes, and no line ends or tabs"))
        .read(format!("{} bytes", name.len()))
        .help("shorten it"))
}

fn check_distance(section: &Section<'_>, key: &str, at: &[f64]) -> Result<()> {
    if at.iter().any(|x| x.abs() > FARTHEST) {
        return Err(section.error_at(key, "this is more than 10 km away").help("check the unit"));
    }
    Ok(())
}

/// Moves a shape.
fn shift(shape: &mut BlockShape, by: [f64; 3]) {
    let points: Vec<&mut [f64; 3]> = match shape {
        BlockShape::Box { min, max } => vec![min, max],
        BlockShape::Cylinder { base, .. } => vec![base],
        BlockShape::Sphere { centre, .. } => vec![centre],
    };
    for point in points {
        for (x, d) in point.iter_mut().zip(by) {
            *x += d;
        }
    }
}

/// The blocks of a part in its own coordinates.
fn blocks(section: &Section<'_>) -> Result<Vec<PartBlock>> {
    let help = "give box = [\"0.2 m\", \"0.1 m\", \"20 mm\"], cylinder = { axis = \"z\", outer = \"50 mm\", length = \"0.2 m\" }, sphere = { outer = \"50 mm\" }, blocks = [{...}, ...], or mesh = \"part.msh\"";
    match section.one_of(&["box", "cylinder", "sphere", "blocks"])? {
        None => Err(section.error("this part has no shape").help(help)),
        Some("blocks") => {
            if section.has("cells") {
                return Err(section.error_at("cells", "cells belong to a block").help("move 'cells' into the blocks"));
            }
            let mut blocks = Vec::new();
            for block in section.tables("blocks")? {
                if block.one_of(&["box", "cylinder", "sphere"])?.is_none() {
                    return Err(block.error("this block has no shape").help("give box = [...], cylinder = {...} or sphere = {...}"));
                }
                let mut one = single(&block)?;
                if let Some(at) = block.opt_triple("at", Dimension::LENGTH)? {
                    check_distance(&block, "at", &at)?;
                    shift(&mut one.shape, at);
                }
                block.finish()?;
                blocks.push(one);
            }
            if blocks.is_empty() { Err(section.error_at("blocks", "there is no block in the list").help(help)) } else { Ok(blocks) }
        }
        Some(_) => Ok(vec![single(section)?]),
    }
}

/// A box with its smallest corner, a cylinder with the centre of its base, or a sphere with its centre at the origin.
fn single(section: &Section<'_>) -> Result<PartBlock> {
    let shape = if section.has("box") {
        let sizes = section.value("box")?;
        let max = sizes.triple(Dimension::LENGTH)?;
        for (size, entry) in max.iter().zip(sizes.list()?) {
            check_size(*size, &entry)?;
        }
        BlockShape::Box { min: [0.0; 3], max }
    } else if section.has("sphere") {
        sphere(section.section("sphere")?)?
    } else {
        cylinder(section.section("cylinder")?)?
    };
    let mut cells = [None; 3];
    if let Some(list) = section.opt_list("cells")? {
        if list.len() != 3 {
            let help = "write [4, 0, 2] along x, y, z (cylinders: r, theta, z); 0 lets the mesh choose";
            return Err(section.error_at("cells", format!("three numbers are wanted here, not {}", list.len())).help(help));
        }
        for (cell, value) in cells.iter_mut().zip(&list) {
            let count = value.integer(0)?;
            if count > 10_000 {
                return Err(value.error("more than 10000 cells along one axis").help("use fewer"));
            }
            *cell = (count > 0).then_some(count);
        }
    }
    if let BlockShape::Sphere { .. } = shape
        && cells[1..].iter().any(|n| n.is_some_and(|n| n > 1))
    {
        return Err(section.error_at("cells", "a sphere has cells along its radius alone").help("write for example [20, 0, 0]"));
    }
    Ok(PartBlock { shape, cells })
}

fn check_size(size: f64, value: &Value<'_>) -> Result<()> {
    if size <= 0.0 {
        return Err(value.error("a size must be larger than zero").help("write for example \"20 mm\""));
    }
    if !(SIZES.0..=SIZES.1).contains(&size) {
        return Err(value.error("sizes between 1 um and 1 km can be used").help("check the unit"));
    }
    Ok(())
}

/// Inner (0 if none is given) and outer radius of a cylinder or sphere.
fn radii(section: &Section<'_>) -> Result<(f64, f64)> {
    let radius = |radius: &str, diameter: &str| -> Result<Option<f64>> {
        match section.one_of(&[radius, diameter])? {
            None => Ok(None),
            Some(key) => {
                let size = section.quantity(key, Dimension::LENGTH)?;
                Ok(Some(if key == radius { size } else { size / 2.0 }))
            }
        }
    };
    let outer = radius("outer", "outer_diameter")?.ok_or_else(|| {
        section.error_at("outer", "the outer radius is missing").help("give outer = \"50 mm\" or outer_diameter = \"100 mm\"")
    })?;
    check_size(outer, &section.value(if section.has("outer") { "outer" } else { "outer_diameter" })?)?;
    let inner = match radius("inner", "inner_diameter")? {
        Some(inner) => inner,
        None => keys::INNER.read(section)?,
    };
    let inner_key = if section.has("inner") { "inner" } else { "inner_diameter" };
    if !(0.0..=outer - SIZES.0).contains(&inner) {
        return Err(section
            .error_at(inner_key, "the inner radius must lie between zero and the outer one")
            .help("inner and outer are radii; there are inner_diameter and outer_diameter too"));
    }
    Ok((inner, outer))
}

fn sphere(section: Section<'_>) -> Result<BlockShape> {
    let (inner, outer) = radii(&section)?;
    section.finish()?;
    Ok(BlockShape::Sphere { centre: [0.0; 3], inner, outer })
}

fn cylinder(section: Section<'_>) -> Result<BlockShape> {
    let axis = [CoordinateAxis::X, CoordinateAxis::Y, CoordinateAxis::Z][keys::AXIS.read_word(&section)?];
    let (inner, outer) = radii(&section)?;
    let length = section.quantity("length", Dimension::LENGTH)?;
    check_size(length, &section.value("length")?)?;
    let turn = section.opt_range("turn", Dimension::ANGLE)?.unwrap_or((0.0, 2.0 * PI));
    let span = turn.1 - turn.0;
    if !(1e-4..=2.0 * PI * (1.0 + 1e-12)).contains(&span) || turn.0.abs() > 2.0 * PI {
        return Err(section
            .error_at("turn", "a turn goes from one angle to a larger one, by at most 360 deg")
            .help("write turn = [\"0 deg\", \"90 deg\"]"));
    }
    // 360 deg in floating point is the full turn exactly, which has no cuts.
    let turn = if (span - 2.0 * PI).abs() < 1e-9 { (0.0, 2.0 * PI) } else { turn };
    section.finish()?;
    Ok(BlockShape::Cylinder { axis, base: [0.0; 3], length, inner, outer, turn })
}

/// Puts parts on the faces of others, in an order in which every other part is placed first.
fn place_all(drafts: &mut [Draft<'_>]) -> Result<()> {
    loop {
        let mut progress = false;
        let mut waiting = None;
        for at in 0..drafts.len() {
            if drafts[at].placed {
                continue;
            }
            let value = drafts[at].section.value("on")?;
            let spelling = Spelling::of(&value)?;
            let Some(target) = drafts.iter().position(|draft| draft.part.name == spelling.name) else {
                let known: Vec<&str> = drafts.iter().map(|draft| draft.part.name.as_str()).collect();
                return Err(value.error(format!("there is no part '{}'", spelling.name)).help(suggestion(&spelling.name, &known)));
            };
            if !drafts[target].placed {
                waiting = Some(value);
                continue;
            }
            let by = offset(&drafts[at], &drafts[target].part, &value, &spelling)?;
            drafts[at].part.blocks.iter_mut().for_each(|block| shift(&mut block.shape, by));
            if let Some(import) = &mut drafts[at].part.import {
                import.at = by;
            }
            drafts[at].placed = true;
            progress = true;
        }
        match waiting {
            None => return Ok(()),
            Some(value) if !progress => {
                return Err(value.error("these parts are placed on one another in a circle").help("place one of them with 'at'"));
            }
            Some(_) => {}
        }
    }
}

/// Displacement of a part that puts it on the face of another.
fn offset(draft: &Draft<'_>, target: &Part, value: &Value<'_>, spelling: &Spelling) -> Result<[f64; 3]> {
    let section = &draft.section;
    let Some(side) = spelling.side.as_deref() else {
        return Err(value.error("the face of a part is wanted here").help(format!("write for example \"{}.+z\"", target.name)));
    };
    if target.import.is_some() {
        return Err(value.error("a part cannot be put on an imported mesh").help("place it with 'at', in the coordinates of the mesh"));
    }
    // The index checks block and side; then follows the axis normal to the face.
    let face = Index { parts: std::slice::from_ref(target), nodes: &[], channels: &[] }.side(value, 0, spelling.block, side)?;
    let shapes: Vec<&BlockShape> = target
        .blocks
        .iter()
        .enumerate()
        .filter(|(i, block)| face.block.is_none_or(|wanted| wanted == *i) && side_of(&block.shape, side).is_some())
        .map(|(_, block)| &block.shape)
        .collect();
    let normal = match shapes[0] {
        BlockShape::Box { .. } => face.side.axis(),
        BlockShape::Cylinder { axis, .. } if face.side.axis() == 2 => axis.index(),
        BlockShape::Cylinder { .. } | BlockShape::Sphere { .. } => {
            return Err(value
                .error("a part can be placed on plane faces only")
                .help("use the start or end of the cylinder, or place the part with 'at'"));
        }
    };
    let (low, high) = hull(shapes.into_iter());
    let (own_low, own_high) = match &draft.part.import {
        Some(import) => import.body.bounds(),
        None => hull(draft.part.blocks.iter().map(|block| &block.shape)),
    };
    let gap = keys::GAP.read(section)?;
    let centred = keys::ALIGN.read_word(section)? == 0;
    let along = section.opt_quantities("offset", Dimension::LENGTH, Some(2))?.unwrap_or_else(|| vec![0.0; 2]);
    check_distance(section, "offset", &along)?;
    check_distance(section, "gap", &[gap])?;
    if gap < 0.0 {
        return Err(section.error_at("gap", "a gap cannot be negative").help("leave it out to touch the face"));
    }
    let mut along = along.into_iter();
    Ok(std::array::from_fn(|axis| {
        if axis == normal {
            return if face.side.is_high() { high[axis] + gap - own_low[axis] } else { low[axis] - gap - own_high[axis] };
        }
        let aligned = if centred { (low[axis] + high[axis] - own_low[axis] - own_high[axis]) / 2.0 } else { low[axis] - own_low[axis] };
        aligned + along.next().unwrap_or(0.0)
    }))
}

fn hull<'a>(shapes: impl Iterator<Item = &'a BlockShape>) -> ([f64; 3], [f64; 3]) {
    let mut hull = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for shape in shapes {
        let (low, high) = bounds(shape);
        for axis in 0..3 {
            hull.0[axis] = hull.0[axis].min(low[axis]);
            hull.1[axis] = hull.1[axis].max(high[axis]);
        }
    }
    hull
}

/// A surface that does not radiate.
fn none() -> PartSurface {
    PartSurface { emissivity: 0.0, effective: true, area: None, excluded: Vec::new() }
}

/// Reads `[surfaces]` with its groups: the default surface of every part, in the order of `parts`.
fn surfaces(root: &Section<'_>, parts: &[String]) -> Result<Vec<PartSurface>> {
    let Some(section) = root.opt_section("surfaces")? else { return Ok(vec![none(); parts.len()]) };
    let mut found = vec![radiation(&section)?.unwrap_or_else(none); parts.len()];
    let mut grouped: Vec<Option<String>> = vec![None; parts.len()];
    for (name, group) in section.sections("group")? {
        let Some(surface) = radiation(&group)? else {
            return Err(group.error("this group has no emissivity").help("give emissivity = 0.8, or effective_emissivity"));
        };
        for value in group.list("parts")? {
            let part = lookup(&value, parts, "part")?;
            if let Some(other) = grouped[part].replace(name.clone()) {
                return Err(value.error(format!("this part is in the group '{other}' already")).help("name it in one group"));
            }
            found[part] = surface.clone();
        }
        group.finish()?;
    }
    section.finish()?;
    Ok(found)
}

/// Emissivity or effective emissivity, if one is given.
fn radiation(section: &Section<'_>) -> Result<Option<PartSurface>> {
    let Some(key) = section.one_of(&["emissivity", "effective_emissivity"])? else { return Ok(None) };
    Ok(Some(PartSurface { emissivity: emissivity(&section.value(key)?)?, effective: key == "effective_emissivity", ..none() }))
}

/// A number above 0 and at most 1.
pub(super) fn emissivity(value: &Value<'_>) -> Result<f64> {
    let number = value.number()?;
    if number > 0.0 && number <= 1.0 {
        return Ok(number);
    }
    Err(value.error("an emissivity lies above 0 and at most at 1").help("machined steel 0.15..0.35, anodised aluminium 0.8"))
}

/// Two emissivities in a list.
pub(super) fn two_emissivities(value: &Value<'_>) -> Result<[f64; 2]> {
    let list = value.list()?;
    let [first, second] = list.as_slice() else {
        return Err(value.error("two emissivities are wanted here").help("write emissivity = [0.2, 0.3]"));
    };
    Ok([emissivity(first)?, emissivity(second)?])
}

/// Reads `[part.NAME.surface]` or `surface = "none"`; without either the default surface.
fn surface(section: &Section<'_>, part: usize, parts: &[Part], usual: &PartSurface) -> Result<PartSurface> {
    let Some(value) = section.opt("surface") else { return Ok(usual.clone()) };
    if value.is_text() {
        value.choice(&["none"]).map_err(|error| error.help("write surface = \"none\" or [part.NAME.surface] with an emissivity"))?;
        return Ok(none());
    }
    let section = value.section()?;
    let mut surface = radiation(&section)?.unwrap_or_else(|| usual.clone());
    if surface.emissivity <= 0.0 {
        return Err(section
            .error_at("emissivity", "'emissivity' is missing")
            .help("or give effective_emissivity, or [surfaces] for all parts"));
    }
    surface.area = section.opt_positive("area", Dimension::AREA)?;
    let index = Index { parts, nodes: &[], channels: &[] };
    for value in section.opt_list("excluded")?.unwrap_or_default() {
        let text = value.text()?;
        // "-z" for the whole part, "[2].-z" for one block.
        let (block, side) = match text.strip_prefix('[').and_then(|rest| rest.split_once("].")) {
            Some((number, side)) => {
                let number =
                    number.trim().parse::<usize>().map_err(|_| value.error("this names no block").help("write for example \"[2].-z\""))?;
                (Some(number), side.trim())
            }
            None => (None, text.trim()),
        };
        surface.excluded.push(index.side(&value, part, block, side)?);
    }
    section.finish()?;
    Ok(surface)
}
