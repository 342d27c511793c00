//! Sobol' indices of functions whose indices are known in closed form.

use coldplate_runtime::NINETY_FIVE;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::fit::model::*;
use coldplate_surrogate::verdict::indices::{SobolIndex, SobolIndices, indices};

use crate::surrogate::examples::*;

fn of(found: &SobolIndices, quantity: &str, factor: &str) -> SobolIndex {
    let place = found.factors.iter().position(|own| own.name == factor).unwrap();
    found.quantities.iter().find(|own| own.name == quantity).unwrap().indices[place]
}

fn near(found: SobolIndex, first: f64, total: f64) {
    assert!((found.first_order - first).abs() < 1e-6 && (found.total - total).abs() < 1e-6, "{found:?}, {first} and {total} expected");
}

/// T = 30 + 2 u + 3 u w, with u and w even from -1 to 1: variances 4/3, 0 and 9/9.
#[test]
fn products_have_total_indices_larger_than_first_order_ones() {
    let transforms = [Transform::Identity, Transform::Identity];
    let model = PointModel::Polynomial(polynomial(&transforms, &[&[0, 0], &[1, 0], &[1, 1]], &[30.0, 2.0, 3.0]));
    let half_width = 1.0;
    let surrogate = SurrogateSpec {
        variables: vec![variable("coolant_flow", "L/min", 2.0, 12.0), variable("ambient_temperature", "degC", 10.0, 30.0)],
        points: vec![point("motor", model, half_width)],
        limits: vec![limit("motor over room", LimitKind::Rise { point: 0, variable: 1 }, 20.0)],
        ..Default::default()
    };
    let bytes = encode(&surrogate).unwrap();
    let file = open(&bytes).unwrap();
    let found = indices(&file, &[None, None]).unwrap();
    let fit = (half_width / NINETY_FIVE).powi(2);
    let whole = 4.0 / 3.0 + 1.0 + fit;
    near(of(&found, "motor", "coolant_flow"), 4.0 / 3.0 / whole, (4.0 / 3.0 + 1.0) / whole);
    near(of(&found, "motor", "ambient_temperature"), 0.0, 1.0 / whole);
    near(of(&found, "motor", "fit"), fit / whole, fit / whole);
    assert!((found.quantities[0].deviation / whole.sqrt() - 1.0).abs() < 1e-6);
    // The rise over a room from 10 to 30 degC varies with that too: variance 100/3.
    let rise = whole + 100.0 / 3.0;
    near(of(&found, "motor over room", "ambient_temperature"), 100.0 / 3.0 / rise, (100.0 / 3.0 + 1.0) / rise);
    assert!(found.error < 1e-6, "{}", found.error);
    // What has a value does not vary: at w = 0 only u is left.
    let held = indices(&file, &[None, Some(20.0)]).unwrap();
    assert!(held.factors.iter().all(|own| own.name != "ambient_temperature"));
    near(of(&held, "motor", "coolant_flow"), 4.0 / 3.0 / (4.0 / 3.0 + fit), 4.0 / 3.0 / (4.0 / 3.0 + fit));
    assert!(indices(&file, &[Some(5.0), Some(20.0)]).unwrap_err().to_string().contains("nothing varies"));
}

/// At one condition the value is linear in the parameters: the indices are the shares of the variance.
#[test]
fn parameters_have_the_shares_of_the_verdict() {
    let own = uncertain();
    let bytes = encode(&own).unwrap();
    let file = open(&bytes).unwrap();
    let x = [5.0, 17.0, 24.0];
    let found = indices(&file, &x.map(Some)).unwrap();
    let slopes = own.uncertainty.as_ref().unwrap().slopes_at(&own, 0, &x);
    let (mut values, mut bands) = ([0.0; 2], [coldplate_runtime::Band::default(); 2]);
    file.bands(&x, None, &mut values, &mut bands).unwrap();
    let whole = bands[0].total.powi(2);
    for (name, slope) in ["contact.foot.conductance", "all heats"].into_iter().zip(&slopes) {
        near(of(&found, "motor", name), slope * slope / whole, slope * slope / whole);
    }
    near(of(&found, "motor", "what the model misses"), bands[0].misses.powi(2) / whole, bands[0].misses.powi(2) / whole);
    // Of what goes together there are no indices one by one.
    let bytes = encode(&uncertain_together()).unwrap();
    let found = indices(&open(&bytes).unwrap(), &[None; 3]).unwrap();
    assert!(found.factors.iter().any(|own| own.name == "contact.foot.conductance and all heats" && !own.is_assumed));
    assert_eq!(found, indices(&open(&bytes).unwrap(), &[None; 3]).unwrap(), "the same in every run");
}

/// 30 + 1.5 u + w and 30 - 1.5 u + w, with u and w even from -1 to 1; a spread has a kink where the hottest point changes.
#[test]
fn kinks_are_followed_and_what_does_nothing_has_indices_of_zero() {
    let transforms = [Transform::Identity; 3];
    let names = ["coolant_flow", "motor_speed", "ambient_temperature"];
    let points = [3.0, -3.0].map(|slope| {
        let exponents: [&[u8]; 3] = [&[0, 0, 0], &[1, 0, 0], &[0, 1, 0]];
        PointModel::Polynomial(polynomial(&transforms, &exponents, &[30.0, 0.5 * slope, 1.0]))
    });
    let [near_side, far_side] = points;
    let surrogate = SurrogateSpec {
        variables: names.map(|name| variable(name, "1", 2.0, 12.0)).into(),
        points: vec![point("near", near_side, 0.0), point("far", far_side, 0.0)],
        limits: vec![limit("spread", LimitKind::Spread(vec![0, 1]), 20.0)],
        ..Default::default()
    };
    let bytes = encode(&surrogate).unwrap();
    let found = indices(&open(&bytes).unwrap(), &[None; 3]).unwrap();
    let zero = SobolIndex { first_order: 0.0, total: 0.0 };
    for quantity in ["near", "far", "spread"] {
        assert_eq!(of(&found, quantity, "ambient_temperature"), zero);
    }
    let whole = 2.25 / 3.0 + 1.0 / 3.0;
    near(of(&found, "near", "coolant_flow"), 0.75 / whole, 0.75 / whole);
    near(of(&found, "near", "motor_speed"), 1.0 / 3.0 / whole, 1.0 / 3.0 / whole);
    // The spread is |3 u|, of which w is no part: all of it is the flow's.
    let spread = of(&found, "spread", "coolant_flow");
    assert!((spread.first_order - 1.0).abs() < 0.002 && (spread.total - 1.0).abs() < 0.002, "{spread:?}");
    let none = of(&found, "spread", "motor_speed");
    assert!(none.first_order < 1e-5 && none.total < 1e-5, "{none:?}");
    assert!(found.error < 0.002, "{}", found.error);
}
