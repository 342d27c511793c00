//! The teaching machines by hand.

use super::{Solved, USUAL};

/// 40 W over 0.008 m² of joint, less what the block radiates.
#[test]
fn slab() {
    let slab = Solved::new("slab.toml", &[], &USUAL, None);
    let joint = slab.contact("joint");
    assert!((joint.area - 0.008).abs() < 1e-12);
    assert!((joint.drop - joint.heat / 8.0).abs() < 1e-9);
    // Top of the block over the plate: joint, then a uniform source above an insulated top, q L / 2 k.
    let over = slab.read("block") - slab.read("plate");
    let by_hand = joint.heat / 8.0 + joint.heat / 0.008 * 0.040 / (2.0 * 60.5);
    assert!((over - by_hand).abs() < 0.25, "{over} {by_hand}");
    // 80 cm² of top and 144 cm² of sides of emissivity 0.8.
    let radiated = 40.0 - joint.heat;
    let area = 0.1 * 0.08 + 2.0 * (0.1 + 0.08) * 0.04;
    let top = slab.read("block") + 273.15;
    let most = 0.8 * 5.670374e-8 * area * (top.powi(4) - 296.15f64.powi(4));
    assert!(radiated > 0.8 * most && radiated < most, "{radiated} {most}");
}

#[test]
fn spindle() {
    let spindle = Solved::new("spindle.toml", &[], &USUAL, None);
    let streams = &spindle.state.solution.streams;
    let flow: f64 = streams.iter().map(|s| s.flow).sum();
    // Volume at each channel's own mean temperature; the mass is what was fed.
    assert!((flow / (4e-3 / 60.0) - 1.0).abs() < 1e-3, "{flow}");
    assert!((streams[0].pressure_drop / streams[1].pressure_drop - 1.0).abs() < 1e-6, "parallel channels share a pressure drop");
    assert!(streams[0].flow > 1.3 * streams[1].flow, "the short channel takes more");
    // The screen touches nothing: what warms it above the wall came across the gap.
    assert!(spindle.read("screen") > 23.0 + 0.05 * (spindle.read("tool") - 23.0), "{}", spindle.read("screen"));
    assert!(spindle.read("screen") < spindle.read("tool"));
    // 12 W of grease at 2000 rpm, falling with the power 1.6.
    assert!((spindle.power("bearing") - 12.0 * 0.5f64.powf(1.6)).abs() < 1e-9);
    // Rough foot by Cooper, Mikic and Yovanovich: 1.25 k m/sigma (p/H)^0.95 with k the mean of 15.0 and 167.
    let foot = spindle.contact("foot");
    let k: f64 = 2.0 * 15.0 * 167.0 / (15.0 + 167.0);
    let spots = 1.25 * k * 0.15 / 2.3e-6 * (2e6f64 / 1.3e9).powf(0.95);
    assert!((foot.conductance / foot.area / spots - 1.0).abs() < 0.02, "{} {spots}", foot.conductance / foot.area);
}

#[test]
fn enclosure() {
    let hood = Solved::new("enclosure.toml", &[], &USUAL, None);
    let views = &hood.model.network.enclosures[0];
    // A convex body under a hood: everything it sends out arrives somewhere, and it does not see itself.
    assert!(views.view_factors[0][0] == 0.0 && (views.view_factors[0].iter().sum::<f64>() + views.chamber[0] - 1.0).abs() < 1e-12);
    assert!((views.view_factors[0][2] - views.view_factors[0][3]).abs() < 2e-3, "the hood is its own mirror image");
    assert!((views.areas[0] - std::f64::consts::PI * (0.1 * 0.2 + 2.0 * 0.05 * 0.05)).abs() < 1e-9);
    // 10 W, less what the feet carry, by radiation: less than to black surroundings at the temperature of the water,
    // more than across one grey surface of its own area and emissivity 0.25 at the roof's temperature.
    let radiated = 10.0 - hood.contact("feet").heat;
    let t4 = |t: f64| (t + 273.15).powi(4);
    let most = 0.8 * 5.670374e-8 * views.areas[0] * (t4(hood.read("motor")) - t4(20.5));
    let least = 5.670374e-8 * views.areas[0] / (1.0 / 0.8 + 3.0) * (t4(hood.read("motor")) - t4(hood.read("roof")));
    assert!(radiated < most && radiated > least, "{least} {radiated} {most}");
}
