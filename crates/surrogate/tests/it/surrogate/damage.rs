//! Damaged files: a million of them, none of which may cause a panic or pass unnoticed.

use coldplate_runtime::{OpenError, Surrogate, format};
use coldplate_surrogate::fit::file::encode;
use coldplate_surrogate::fit::model::Kernel;

use crate::surrogate::examples::*;

fn fix_checksum(bytes: &mut [u8]) {
    if let Some(end) = bytes.len().checked_sub(format::TRAILER) {
        let crc = format::crc32(&bytes[..end]);
        bytes[end..].copy_from_slice(&crc.to_le_bytes());
    }
}

fn fix_length(bytes: &mut [u8]) {
    let length = bytes.len() as u32;
    if let Some(field) = bytes.get_mut(12..16) {
        field.copy_from_slice(&length.to_le_bytes());
    }
}

/// One random change.
fn mutate(bytes: &mut Vec<u8>, donor: &[u8], random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(9) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => bytes.truncate(at),
        3 => {
            let end = (at + random.below(40)).min(bytes.len());
            bytes.drain(at..end);
        }
        4 => {
            let from = random.below(donor.len());
            let part = &donor[from..(from + random.below(64)).min(donor.len())];
            bytes.splice(at..at, part.iter().copied());
        }
        5 => {
            // overwrite with a piece of another file, at the same place or elsewhere
            let from = if random.below(2) == 0 { at.min(donor.len()) } else { random.below(donor.len()) };
            let length = random.below(64).min(donor.len() - from).min(bytes.len() - at);
            bytes[at..at + length].copy_from_slice(&donor[from..from + length]);
        }
        6 => {
            // a count or place in the header or the records
            let field = 2 * random.below(bytes.len().min(400) / 2);
            let value = [0, 1, 2, 255, 256, 257, 0x7fff, 0xffff, random.next() as u16][random.below(9)];
            if let Some(place) = bytes.get_mut(field..field + 2) {
                place.copy_from_slice(&value.to_le_bytes());
            }
        }
        7 => {
            let strange = [f64::NAN, f64::INFINITY, -0.0, 1e308, -1e308, 5e-324, 1e-300, -1.0, 3.0];
            let field = 8 * random.below(bytes.len() / 8);
            if let Some(place) = bytes.get_mut(field..field + 8) {
                place.copy_from_slice(&strange[random.below(strange.len())].to_le_bytes());
            }
        }
        _ => {
            let other = random.below(bytes.len());
            bytes.swap(at, other);
        }
    }
}

/// What was opened must answer anything without a panic.
fn exercise(surrogate: &Surrogate<'_>, random: &mut Random) {
    let mut x: Vec<f64> = surrogate.variables().map(|v| v.low + 0.5 * (1.0 + random.signed()) * (v.high - v.low)).collect();
    if random.below(4) == 0 {
        let v = random.below(x.len());
        x[v] = [f64::NAN, f64::INFINITY, 0.0, -1e300][random.below(4)];
    }
    let mut values = vec![0.0; surrogate.point_count()];
    let verdict = surrogate.query(&x, &mut values).unwrap();
    assert!(verdict.in_domain || verdict.state == coldplate_runtime::Acceptability::Uncertain);
    let mut gradient = vec![0.0; x.len()];
    surrogate.gradient(&x, random.below(values.len()), &mut gradient).unwrap();
    let names = surrogate.points().map(|p| p.name.len()).sum::<usize>() + surrogate.provenance().count() + surrogate.limits().count();
    assert!(names > 0);
}

/// Every single-bit error, and every truncation, of a file that uses the whole format.
#[test]
fn every_flipped_bit_and_every_truncation_is_noticed() {
    let bytes = encode(&mixed()).unwrap();
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Surrogate::open(&damaged).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        let mut damaged = bytes[..length].to_vec();
        assert!(Surrogate::open(&damaged).is_err(), "length {length}");
        fix_length(&mut damaged);
        fix_checksum(&mut damaged);
        assert!(Surrogate::open(&damaged).is_err(), "length {length}, with a good checksum");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert_eq!(Surrogate::open(&longer).unwrap_err(), OpenError::Length);
}

#[test]
fn a_million_mutations_without_a_panic() {
    let files = [small(), mixed(), ten_radial(Kernel::Gaussian, true)].map(|s| encode(&s).unwrap());
    let mut random = Random(1_000_000);
    let (mut opened, mut deep) = (0, 0);
    for round in 0..1_000_000 {
        // Mostly the small files, which reach every check soonest.
        let which = if round % 500 == 0 { 2 } else { round % 2 };
        let donor = &files[random.below(3)];
        let mut bytes = files[which].clone();
        for _ in 0..=random.below(3) {
            if bytes.is_empty() {
                break;
            }
            mutate(&mut bytes, donor, &mut random);
        }
        // Without the checksum and length mended nothing deeper than those is reached.
        if random.below(8) != 0 {
            fix_length(&mut bytes);
            fix_checksum(&mut bytes);
        }
        match Surrogate::open(&bytes) {
            Ok(surrogate) => {
                opened += 1;
                exercise(&surrogate, &mut random);
            }
            Err(OpenError::NotASurrogate | OpenError::Version(_) | OpenError::Length | OpenError::Checksum) => {}
            Err(_) => deep += 1,
        }
    }
    // The mutations must reach the checks behind the checksum, and some must be harmless.
    assert!(deep > 200_000 && opened > 10_000, "{deep} refused late, {opened} opened");
}

#[test]
fn random_bytes_are_no_surrogate() {
    let mut random = Random(9);
    for length in 0..2000 {
        let mut bytes: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
        assert!(Surrogate::open(&bytes).is_err());
        let header = [&format::MAGIC[..], &format::VERSION.to_le_bytes()].concat();
        bytes.iter_mut().zip(header).for_each(|(b, h)| *b = h);
        fix_length(&mut bytes);
        fix_checksum(&mut bytes);
        assert!(Surrogate::open(&bytes).is_err());
    }
}

/// Each check on its own, by a change to one field of a good file with its checksum mended.
#[test]
fn each_check_gives_its_own_reason() {
    let good = encode(&small()).unwrap();
    let reason = |at: usize, value: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        fix_checksum(&mut bytes);
        Surrogate::open(&bytes).err()
    };
    // Records: 3 variables and 2 points of 8 bytes, 4 limits of 16, 1 polynomial of 28, 2 provenance entries of 8.
    let (points, limits) = (48 + 3 * 8, 48 + 5 * 8);
    let polynomial = limits + 4 * 16;
    let numbers = (polynomial + 28 + 2 * 8_usize).next_multiple_of(8);
    assert_eq!(reason(0, b"\x89"), None);
    assert_eq!(reason(0, b"P"), Some(OpenError::NotASurrogate));
    assert_eq!(reason(8, &3u16.to_le_bytes()), Some(OpenError::Version(3)));
    assert_eq!(reason(8, &0u16.to_le_bytes()), Some(OpenError::Version(0)));
    assert_eq!(reason(10, &0u16.to_le_bytes()), Some(OpenError::Count("variables")));
    assert_eq!(reason(10, &9u16.to_le_bytes()), Some(OpenError::Count("variables")));
    assert_eq!(reason(16, &257u16.to_le_bytes()), Some(OpenError::Count("points")));
    assert_eq!(reason(28, &0u16.to_le_bytes()), Some(OpenError::Count("self-tests")));
    assert_eq!(reason(28, &1u16.to_le_bytes()), Some(OpenError::Length));
    assert_eq!(reason(30, &1u16.to_le_bytes()), Some(OpenError::Length));
    assert_eq!(reason(30, &65u16.to_le_bytes()), Some(OpenError::Count("further sections")));
    assert_eq!(reason(32, &u32::MAX.to_le_bytes()), Some(OpenError::Length));
    assert_eq!(reason(points, &0u32.to_le_bytes()), Some(OpenError::Place("texts")));
    assert_eq!(reason(points + 4, &0u16.to_le_bytes()), Some(OpenError::Text("name of a point")));
    assert_eq!(reason(limits + 6, &[4]), Some(OpenError::Index("kind of limit")));
    assert_eq!(reason(limits + 7, &[1]), Some(OpenError::Reserved));
    assert_eq!(reason(polynomial, &[3]), Some(OpenError::Transform));
    assert_eq!(reason(polynomial + 3, &[1]), Some(OpenError::Reserved));
    assert_eq!(reason(polynomial + 8, &1025u16.to_le_bytes()), Some(OpenError::Count("terms")));
    assert_eq!(reason(polynomial + 12, &3u16.to_le_bytes()), Some(OpenError::Degree));
    assert_eq!(reason(polynomial + 16, &1u32.to_le_bytes()), Some(OpenError::Place("exponents")));
    assert_eq!(reason(polynomial + 24, &1u32.to_le_bytes()), Some(OpenError::Place("numbers")));
    assert_eq!(reason(numbers, &13.0_f64.to_le_bytes()), Some(OpenError::Range));
    assert_eq!(reason(numbers, &0.0_f64.to_le_bytes()), Some(OpenError::Transform)); // 1/0
    assert_eq!(reason(numbers, &f64::NAN.to_le_bytes()), Some(OpenError::Number("number")));
    assert_eq!(reason(numbers + 6 * 8, &(-1.0_f64).to_le_bytes()), Some(OpenError::Number("half width of a point")));
    // The first coefficient, behind 6 range ends, 2 half widths, 4 maxima: the self-test notices.
    assert_eq!(reason(numbers + 12 * 8, &26.001_f64.to_le_bytes()), Some(OpenError::SelfTest { vector: 0, point: 0 }));
}
