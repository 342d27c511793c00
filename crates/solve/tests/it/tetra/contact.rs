//! Imported volumes in contact with blocks and with each other.

use std::f64::consts::PI;

use crate::tetra::bench::{Tets, check, order, solve};

const MATERIALS: &str = "[material.a]\nconductivity = \"16.3 W/(m K)\"\n[material.b]\nconductivity = \"50 W/(m K)\"\n";

/// The imported box between x = 0 and 100 mm and `beyond` on its far side, 50 mm long; 20 and 120 degC at the ends.
fn slab(beyond: &str, far: &str, contact: &str) -> String {
    format!(
        "{MATERIALS}
        [part.box]
        material = \"a\"
        mesh = \"box.msh\"
        surface = \"none\"
        {beyond}
        {contact}
        [boundary.cold]
        faces = [\"box.low x\"]
        temperature = \"20 degC\"
        [boundary.hot]
        faces = [\"{far}\"]
        temperature = \"120 degC\"
        [sensor.before]
        face = \"box.high x\"
        "
    )
}

const BLOCK: &str =
    "[part.block]\nmaterial = \"b\"\nbox = [\"50 mm\", \"40 mm\", \"30 mm\"]\nat = [\"100 mm\", \"0 mm\", \"0 mm\"]\nsurface = \"none\"";

/// Heat through 100 mm of a, a contact and 50 mm of b: exact, for the flux is uniform.
#[test]
fn a_slab_with_a_block_behind_a_contact_is_exact() {
    let area = 0.04 * 0.03;
    for (law, resistance) in
        [("conductance = \"500 W/(m2 K)\"", 1.0 / 500.0), ("bonded = true", 0.0), ("total_conductance = \"0.6 W/K\"", 1.0 / 500.0)]
    {
        for between in ["[\"box.high x\", \"block.-x\"]", "[\"block\", \"box\"]"] {
            let text = slab(BLOCK, "block.+x", &format!("[contact.seam]\nbetween = {between}\n{law}"));
            for cells in [200, 1500] {
                let run = solve(&text, cells);
                let q = 100.0 * area / (0.1 / 16.3 + 0.05 / 50.0 + resistance);
                check(&format!("{law}: heat"), run.heat_in("hot"), q, q, 1e-9);
                check(&format!("{law}: T before the contact"), run.celsius("before"), 20.0 + q / area * 0.1 / 16.3, 100.0, 1e-9);
                let (found, conductance, heat) = run.contact("seam");
                check(&format!("{law}: area"), found, area, area, 1e-12);
                check(&format!("{law}: heat through the contact"), heat.abs(), q, q, 1e-9);
                if resistance > 0.0 {
                    check(&format!("{law}: hA"), conductance, area / resistance, area / resistance, 1e-12);
                }
            }
        }
    }
}

/// Two volumes of one file share their nodes; matching triangles make a bond of next to nothing (1e-4 of an edge), or
/// a contact.
#[test]
fn two_volumes_of_one_mesh_are_bonded_or_in_contact() {
    let area = 0.04 * 0.03;
    for (contact, resistance, tolerance) in
        [("", 0.0, 2e-5), ("[contact.seam]\nbetween = [\"left.seam\", \"right.seam\"]\nconductance = \"500 W/(m2 K)\"", 1.0 / 500.0, 1e-10)]
    {
        let text = format!(
            "{MATERIALS}
            [part.left]
            material = \"a\"
            mesh = \"pair.msh\"
            volume = \"left\"
            unit = \"mm\"
            [part.right]
            material = \"b\"
            mesh = \"pair.msh\"
            volume = \"right\"
            unit = \"mm\"
            {contact}
            [boundary.cold]
            faces = [\"left.cold\"]
            temperature = \"20 degC\"
            [boundary.hot]
            faces = [\"right.hot\"]
            temperature = \"120 degC\""
        );
        let run = solve(&text, 1);
        let q = 100.0 * area / (0.05 / 16.3 + 0.03 / 50.0 + resistance);
        check("heat of the pair", run.heat_in("hot"), q, q, tolerance);
        let name = if contact.is_empty() { "left | right" } else { "seam" };
        let (found, _, heat) = run.contact(name);
        check("area of the pair", found, area, area, 1e-12);
        check("heat between the pair", heat.abs(), q, q, tolerance);
    }
}

/// Two meshes whose triangles do not match: area and heat of a contact are exact, a bond is of second order.
#[test]
fn meshes_that_do_not_match() {
    let area = 0.04 * 0.03;
    let second = |file: &str| {
        format!("[part.second]\nmaterial = \"b\"\nmesh = \"{file}\"\nat = [\"100 mm\", \"0 mm\", \"0 mm\"]\nsurface = \"none\"")
    };
    let text =
        slab(&second("box_curved.msh"), "second.high x", "[contact.seam]\nbetween = [\"box\", \"second\"]\nconductance = \"500 W/(m2 K)\"");
    let run = solve(&text, 1);
    let q = 100.0 * area / (0.1 / 16.3 + 0.1 / 50.0 + 1.0 / 500.0);
    check("area", run.contact("seam").0, area, area, 1e-9);
    check("heat", run.heat_in("hot"), q, q, 1e-9);

    let q = 100.0 * area / (0.1 / 16.3 + 0.1 / 50.0);
    let (mut mesh, mut other) = (Tets::read("box.msh"), Tets::read("box_curved.msh"));
    let mut errors = Vec::new();
    for level in 0..3 {
        let files = [mesh.write(&format!("unmatched_a{level}.msh")), other.write(&format!("unmatched_b{level}.msh"))];
        let beyond = second(&files[1].display().to_string());
        let text = slab(&beyond, "second.high x", "[contact.seam]\nbetween = [\"box\", \"second\"]\nbonded = true");
        errors.push(solve(&text.replace("\"box.msh\"", &format!("\"{}\"", files[0].display())), 1).heat_in("hot") / q - 1.0);
        (mesh, other) = (mesh.refined(|_, p| p), other.refined(|_, p| p));
    }
    println!("a bond of meshes that do not match: {errors:?}");
    assert!(order(errors[1], errors[2]) > 1.8 && errors[2].abs() < 1e-3, "{errors:?}");
}

/// Heat that also flows along the interface: an imported box half as wide as the block it is bonded to, heated at one
/// edge. The solution with blocks alone, extrapolated, is the reference.
#[test]
fn a_bond_with_heat_along_it_agrees_with_blocks() {
    let part = |shape: &str| {
        format!(
            "{MATERIALS}
            [part.box]
            material = \"a\"
            {shape}
            surface = \"none\"
            [part.block]
            material = \"b\"
            box = [\"100 mm\", \"40 mm\", \"30 mm\"]
            at = [\"0 mm\", \"0 mm\", \"30 mm\"]
            surface = \"none\"
            [contact.seam]
            between = [\"box\", \"block\"]
            bonded = true
            "
        )
    };
    let rest = |low: &str| {
        format!(
            "[boundary.cold]
            faces = [\"block.+x\"]
            film = \"1000 W/(m2 K)\"
            fluid_temperature = \"20 degC\"
            [boundary.hot]
            faces = [\"{low}\"]
            film = \"1000 W/(m2 K)\"
            fluid_temperature = \"120 degC\"
            "
        )
    };
    let blocks = |cells: usize| solve(&(part("box = [\"100 mm\", \"40 mm\", \"30 mm\"]") + &rest("box.-x")), cells).heat_in("hot");
    // Cells of 5, 2.5 and 1.25 mm. The film ends where the seam begins, which costs the blocks some of their order:
    // the extrapolation takes what they show.
    let [a, b, c] = [20 * 8 * 12, 40 * 16 * 24, 80 * 32 * 48].map(blocks);
    let reference = c + (c - b) * (c - b) / ((b - a) - (c - b));
    let of_blocks = [a, b, c].map(|q| (q / reference - 1.0).abs());
    println!("blocks: {a:.6} {b:.6} {c:.6}, order {:.2}, extrapolated {reference:.6} W: {of_blocks:?}", order(b - a, c - b));
    let mut mesh = Tets::read("box.msh");
    let mut errors = Vec::new();
    for (level, cells) in [120, 960, 7680].into_iter().enumerate() {
        let file = mesh.write(&format!("along_{level}.msh"));
        let run = solve(&(part(&format!("mesh = \"{}\"", file.display())) + &rest("box.low x")), cells);
        errors.push(run.heat_in("hot") / reference - 1.0);
        mesh = mesh.refined(|_, p| p);
    }
    println!("with an imported half: {errors:?}");
    assert!(errors[2].abs() < 2e-3 && errors[2].abs() < 0.4 * errors[1].abs(), "{errors:?}");
}

/// A tube of facets around a shaft of cells: the contact has the true area of the cylinder.
#[test]
fn a_bore_meets_a_cylinder() {
    let text = format!(
        "{MATERIALS}
        [part.shaft]
        material = \"b\"
        cylinder = {{ outer = \"20 mm\", length = \"40 mm\" }}
        surface = \"none\"
        [part.tube]
        material = \"a\"
        mesh = \"tube.msh\"
        surface = \"none\"
        [contact.fit]
        between = [\"shaft.outer\", \"tube.bore\"]
        conductance = \"2000 W/(m2 K)\"
        [source.heat]
        in = [\"shaft\"]
        power = \"100 W\"
        [boundary.mantle]
        faces = [\"tube.mantle\"]
        temperature = \"20 degC\"
        [sensor.bore]
        face = \"tube.bore\"
        "
    );
    let run = solve(&text, 2000);
    let area = 2.0 * PI * 0.02 * 0.04;
    let (found, conductance, heat) = run.contact("fit");
    check("area of the fit", found, area, area, 1e-9);
    check("hA of the fit", conductance, 2000.0 * area, 2000.0 * area, 1e-9);
    check("heat of the fit", heat, 100.0, 100.0, 1e-8);
    // ln(3/2) / (2 pi k l) with facets of 9 mm on a bore of 20 mm: a percent.
    let rise = 100.0 * 1.5f64.ln() / (2.0 * PI * 16.3 * 0.04);
    check("T of the bore", run.celsius("bore"), 20.0 + rise, rise, 0.03);
}

/// Lumped nodes join an imported face by area, and radiate to it by a link.
#[test]
fn lumped_nodes_join_an_imported_face() {
    let text = format!(
        "{MATERIALS}
        [part.box]
        material = \"a\"
        mesh = \"box.msh\"
        surface = \"none\"
        [node.motor]
        [node.wall]
        temperature = \"20 degC\"
        [contact.motor]
        between = [\"motor\", \"box.high x\"]
        conductance = \"800 W/(m2 K)\"
        area = \"12 cm2\"
        [radiation_link.wall]
        between = [\"box.low x\", \"wall\"]
        view_factor = 1.0
        emissivity = [0.8, 0.9]
        [source.heat]
        in = [\"motor\"]
        power = \"2 W\"
        [sensor.motor]
        node = \"motor\"
        "
    );
    let run = solve(&text, 1);
    // Grey plates: q = sigma (T1^4 - T2^4) / (1/e1 + 1/e2 - 1).
    let q = 2.0 / (0.04 * 0.03);
    let cold = (293.15f64.powi(4) + q / 5.670374419e-8 * (1.0 / 0.8 + 1.0 / 0.9 - 1.0)).powf(0.25);
    let motor = cold + q * 0.1 / 16.3 + q / 800.0 - 273.15;
    check("T of the motor", run.celsius("motor"), motor, 300.0, 1e-9);
}
