//! One-dimensional problems on an unstructured box of 100 mm x 40 mm x 30 mm.

use crate::tetra::bench::{Tets, check, extrapolate, order, solve};

const STEEL: &str = "[material.m]\nconductivity = \"16.3 W/(m K)\"\n";

/// A linear field is reproduced to rounding, from every kind of file; a given temperature is met, the balance closes.
#[test]
fn a_linear_field_is_exact() {
    for file in ["box.msh", "box_binary.msh", "box_curved.msh"] {
        let text = format!(
            "{STEEL}
            [part.box]
            material = \"m\"
            mesh = \"{file}\"
            [boundary.cold]
            faces = [\"box.low x\"]
            temperature = \"20 degC\"
            [boundary.hot]
            faces = [\"box.high x\"]
            temperature = \"120 degC\"
            [sensor.cold]
            face = \"box.low x\"
            [sensor.point]
            in = \"box\"
            point = [\"37.7 mm\", \"11 mm\", \"23 mm\"]
            [sensor.mean]
            part = \"box\"
            [sensor.top]
            face = \"box.high z\"
            "
        );
        let run = solve(&text, 1);
        for (sensor, wanted) in [("cold", 20.0), ("point", 57.7), ("mean", 70.0), ("top", 70.0)] {
            check(&format!("{file}, {sensor}"), run.celsius(sensor), wanted, 100.0, 1e-11);
        }
        let q = 16.3 * 0.04 * 0.03 * 100.0 / 0.1;
        check(&format!("{file}, heat"), run.heat_in("hot"), q, q, 1e-11);
        check(&format!("{file}, heat out"), run.heat_in("cold"), -q, q, 1e-11);
    }
}

/// Three conductivities act along x, y and z, also where they are tables.
#[test]
fn three_conductivities_act_along_their_axes() {
    for table in [false, true] {
        let k = |value: f64| {
            if table {
                format!("[[\"0 degC\", \"{value} W/(m K)\"], [\"500 degC\", \"{value} W/(m K)\"]]")
            } else {
                format!("\"{value} W/(m K)\"")
            }
        };
        for (axis, value, length, area) in [("x", 5.0, 0.1, 0.04 * 0.03), ("y", 20.0, 0.04, 0.1 * 0.03), ("z", 80.0, 0.03, 0.1 * 0.04)] {
            let text = format!(
                "[material.m]\nconductivity = [{}, {}, {}]
                [part.box]
                material = \"m\"
                mesh = \"box.msh\"
                [boundary.cold]
                faces = [\"box.low {axis}\"]
                temperature = \"20 degC\"
                [boundary.hot]
                faces = [\"box.high {axis}\"]
                temperature = \"30 degC\"
                ",
                k(5.0),
                k(20.0),
                k(80.0)
            );
            let q = value * area * 10.0 / length;
            check(&format!("heat along {axis}"), solve(&text, 1).heat_in("hot"), q, q, 1e-10);
        }
    }
}

/// A flux at one end radiates from the other: sigma eps (T⁴ - Ta⁴) = q, and the field between is linear.
#[test]
fn a_radiating_face_is_exact() {
    let text = format!(
        "{STEEL}
        [part.box]
        material = \"m\"
        mesh = \"box.msh\"
        [part.box.surface]
        effective_emissivity = 0.8
        excluded = [\"high x\", \"low y\", \"high y\", \"low z\", \"high z\"]
        [boundary.hot]
        faces = [\"box.high x\"]
        heat_flux = \"2000 W/m2\"
        [sensor.cold]
        face = \"box.low x\"
        [sensor.hot]
        face = \"box.high x\"
        "
    );
    let run = solve(&text, 1);
    let cold = (2000.0 / (0.8 * 5.670374419e-8) + 293.15f64.powi(4)).powf(0.25) - 273.15;
    check("cold end", run.celsius("cold"), cold, cold, 1e-10);
    check("hot end", run.celsius("hot"), cold + 2000.0 * 0.1 / 16.3, cold, 1e-10);
}

/// k = k0 + k1 T (Ansys VM93): by Kirchhoff's transformation theta = k0 T + k1 T²/2 is linear. Second order.
#[test]
fn conductivity_of_temperature_is_of_second_order() {
    let (k0, k1) = (10.0, 0.2);
    let theta = |t: f64| k0 * t + k1 * t * t / 2.0;
    let middle = {
        let target = f64::midpoint(theta(20.0), theta(320.0));
        ((k0 * k0 + 2.0 * k1 * target).sqrt() - k0) / k1
    };
    let heat = (theta(320.0) - theta(20.0)) / 0.1 * 0.04 * 0.03;
    let mut mesh = Tets::read("box.msh");
    let mut errors = Vec::new();
    for level in 0..3 {
        let file = mesh.write(&format!("k_of_t_{level}.msh"));
        let text = format!(
            "[material.m]
            conductivity = [[\"0 degC\", \"10 W/(m K)\"], [\"500 degC\", \"110 W/(m K)\"]]
            [part.box]
            material = \"m\"
            mesh = \"{}\"
            [boundary.cold]
            faces = [\"box.low x\"]
            temperature = \"20 degC\"
            [boundary.hot]
            faces = [\"box.high x\"]
            temperature = \"320 degC\"
            [sensor.middle]
            in = \"box\"
            point = [\"50 mm\", \"20 mm\", \"15 mm\"]
            ",
            file.display()
        );
        let run = solve(&text, 1);
        println!("level {level}: {:.6} degC, {:.6} W", run.celsius("middle"), run.heat_in("hot"));
        errors.push((run.heat_in("hot") - heat, run.celsius("middle") - middle));
        mesh = mesh.refined(|_, p| p);
    }
    let slope = order(errors[1].0, errors[2].0);
    println!("order of the heat {slope:.2}");
    assert!(slope > 1.8, "order {slope}");
    check("heat, extrapolated", heat + extrapolate([errors[0].0, errors[1].0, errors[2].0]), heat, heat, 1e-4);
    check("T in the middle, extrapolated", extrapolate([errors[0].1, errors[1].1, errors[2].1]), 0.0, 300.0, 2e-4);
}
