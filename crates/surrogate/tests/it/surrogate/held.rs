//! Variables that were held while a surrogate was made: stored, shown, and binding.

use coldplate_runtime::{OpenError, format};
use coldplate_surrogate::fit::file::{decode, encode, open};
use coldplate_surrogate::fit::model::{FollowedSpec, FollowedVariable, Interaction, SurrogateSpec, Transform};
use coldplate_surrogate::verdict::{Acceptability, Inverse, condition, free, query, stated};

use crate::surrogate::examples::*;

fn pairs(given: &[(&str, &str)]) -> Vec<(String, String)> {
    given.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect()
}

#[test]
fn a_condition_may_state_the_held_value_and_another_is_outside() {
    let bytes = encode(&at_one_speed()).unwrap();
    let file = open(&bytes).unwrap();
    let three = [("coolant_flow", "8 L/min"), ("coolant_temperature", "20 degC"), ("ambient_temperature", "21 degC")];
    let answer = |speed: Option<&str>| {
        let given: Vec<_> = three.iter().copied().chain(speed.map(|speed| ("motor_speed", speed))).collect();
        query(&file, &condition(&file, &pairs(&given)).unwrap()).unwrap()
    };
    let silent = answer(None);
    assert_eq!((silent.verdict, silent.in_domain, silent.condition.last()), (Acceptability::Acceptable, true, Some(&2500.0)));
    for same in ["2500 rpm", "261.79938779914943 rad/s"] {
        assert_eq!(answer(Some(same)), silent, "{same}");
    }
    let other = answer(Some("1000 rpm"));
    assert_eq!((other.verdict, other.in_domain), (Acceptability::Uncertain, false));
    assert_eq!((other.outside[0].name.as_str(), other.outside[0].value, other.outside[0].low), ("motor_speed", 1000.0, 2500.0));
    // The inverse question, too.
    let at = |speed: f64| free(&file, &[0.0, 20.0, 21.0, speed], 0).unwrap();
    assert!(matches!(at(2500.0), Inverse::Found { .. }));
    assert!(matches!(at(1000.0), Inverse::OutsideRange(outside) if outside[0].name == "motor_speed"));
    assert!(free(&file, &[8.0, 20.0, 21.0, 0.0], 3).unwrap_err().to_string().contains("was held at 2500 rpm"));
}

/// A file of version 1 has the held values in its provenance only.
#[test]
fn old_files_hold_what_their_provenance_says() {
    let mut surrogate = small();
    surrogate.provenance.push(("held motor_speed".into(), "2500 rpm".into()));
    let mut bytes = encode(&surrogate).unwrap();
    assert_eq!(decode(&bytes).unwrap().held, []);
    bytes[8] = 1;
    fix_checksum(&mut bytes);
    let held = decode(&bytes).unwrap().held;
    assert_eq!((held[0].name.as_str(), held[0].unit.as_str(), held[0].value), ("motor_speed", "rpm", 2500.0));
}

fn fix_checksum(bytes: &mut [u8]) {
    let end = bytes.len() - format::TRAILER;
    let crc = format::crc32(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
}

/// A file with one more section behind its text.
fn with_section(surrogate: &SurrogateSpec, tag: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut bytes = encode(surrogate).unwrap();
    bytes.truncate(bytes.len() - format::TRAILER);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes.extend(tag);
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.extend(content);
    bytes[30] += 1;
    bytes.extend([0; format::TRAILER]);
    let length = bytes.len() as u32;
    bytes[12..16].copy_from_slice(&length.to_le_bytes());
    fix_checksum(&mut bytes);
    bytes
}

#[test]
fn unknown_sections_are_passed_over_or_refused_by_their_first_letter() {
    for surrogate in [small(), at_one_speed()] {
        assert_eq!(decode(&with_section(&surrogate, b"noTE", b"anything")).unwrap(), surrogate);
        assert_eq!(decode(&with_section(&surrogate, b"noTE", b"")).unwrap(), surrogate);
        let reason = |tag| open(&with_section(&surrogate, tag, b"anything")).unwrap_err().to_string();
        assert!(reason(b"NEED").contains("'NEED'"), "{}", reason(b"NEED"));
        assert!(reason(b"no 1").contains("'no 1'"));
    }
    // Twice, or out of order.
    let again = with_section(&at_one_speed(), b"HELD", b"");
    assert_eq!(coldplate_runtime::Surrogate::open(&again).unwrap_err(), OpenError::Section(*b"HELD"));
    let before = with_section(&at_one_speed(), b"ABCD", b"");
    assert_eq!(coldplate_runtime::Surrogate::open(&before).unwrap_err(), OpenError::Section(*b"ABCD"));
}

/// A file that follows its held variable.
fn following() -> SurrogateSpec {
    let (points, variables) = (at_one_speed().points.len(), at_one_speed().variables.len());
    let terms: Vec<Vec<u8>> = (0..=variables).map(|i| (0..variables).map(|v| u8::from(v + 1 == i)).collect()).collect();
    let variable = FollowedVariable {
        held: 0,
        low: 500.0,
        high: 3000.0,
        coefficients: vec![vec![[1.5, -0.25]; terms.len()]; points],
        errors: vec![0.01; points],
    };
    let interactions = vec![Interaction { point: 0, of: 0, by: 0, factor: 0.5 }];
    let transforms = vec![Transform::Identity; variables];
    let followed =
        FollowedSpec { transforms, terms, variables: vec![variable], interactions, errors: vec![1.0; points], limits: vec![(0, 0)] };
    SurrogateSpec { followed: Some(followed), ..at_one_speed() }
}

/// Whatever stands in the section: it is read as written, or refused.
#[test]
fn the_section_of_followed_variables_survives_and_refuses_damage() {
    let surrogate = following();
    let bytes = encode(&surrogate).unwrap();
    assert_eq!(decode(&bytes).unwrap(), surrogate);
    let start = bytes.windows(4).rposition(|tag| *tag == format::FOLLOWED).unwrap();
    let mut refused = 0;
    for at in start + 8..bytes.len() - format::TRAILER {
        for value in [0, 1, 0x7f, 0xff] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            fix_checksum(&mut damaged);
            match decode(&damaged) {
                Ok(read) => assert!(encode(&read).is_ok(), "byte {at}"),
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 50, "{refused}");
    let to = [("motor_speed".to_string(), "2000 rpm".to_string())];
    let (moved, rest) = stated::with_moved(&bytes, &to).unwrap();
    let (moved, file) = (decode(&moved).unwrap(), open(&moved).unwrap());
    assert!(rest.is_empty() && moved.followed.is_none() && moved.held[0].value == 2000.0);
    // t = -0.2: every term adds (1.5 + 0.05) * -0.2 at the centre, where only the constant is not zero.
    let centre: Vec<f64> = moved.variables.iter().map(|v| 0.5 * (v.low + v.high)).collect();
    let (before, after) = (open(&bytes).unwrap().evaluate_point(&centre, 1).unwrap(), file.evaluate_point(&centre, 1).unwrap());
    assert!((after - before + 0.31).abs() < 1e-12, "{}", after - before);
    assert_eq!(moved.limits[0].maximum, surrogate.limits[0].maximum - 500.0);
}

#[test]
fn held_variables_that_cannot_be_are_refused() {
    let refuse = |name: &str, unit: &str, value: f64, needle: &str| {
        let mut surrogate = at_one_speed();
        surrogate.held.push(held(name, unit, value));
        let error = encode(&surrogate).unwrap_err().to_string();
        assert!(error.contains(needle), "{needle}: {error}");
    };
    refuse("motor_speed", "rpm", 1.0, "name of a held variable");
    refuse("coolant_flow", "L/min", 1.0, "name of a held variable");
    refuse("", "rpm", 1.0, "name of a held variable");
    refuse("load", "k\tg", 1.0, "unit of a held variable");
    refuse("load", "kg", f64::NAN, "value of a held variable");
    let mut many = at_one_speed();
    many.held = (0..65).map(|i| held(&format!("v{i}"), "1", 0.0)).collect();
    assert!(encode(&many).unwrap_err().to_string().contains("at most 64 held"));
}
