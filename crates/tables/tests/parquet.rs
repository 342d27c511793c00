//! Round trips, and files that are not what they should be.

use coldplate_tables::{read_parquet, write_parquet};

fn sample() -> Vec<u8> {
    let mut file = Vec::new();
    let texts = ["table 7".to_string(), "ü, \"x\"".to_string(), String::new()];
    let flow = [0.1 + 0.2, f64::MIN_POSITIVE, -1.0e308];
    let temperature = [20.5, f64::NAN, 1.0 / 3.0];
    let metadata = [("coldplate.machine".to_string(), "rig".to_string()), ("coldplate.unit.flow".to_string(), "L/min".to_string())];
    write_parquet(&mut file, &[("group", &texts)], &[("flow", &flow), ("motor [degC]", &temperature)], &metadata).unwrap();
    file
}

#[test]
fn every_bit_comes_back() {
    let frame = read_parquet(sample()).unwrap();
    assert_eq!(frame.texts.len(), 1);
    assert_eq!(frame.texts[0].1, ["table 7", "ü, \"x\"", ""]);
    assert_eq!(frame.numbers[0].0, "flow");
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&frame.numbers[0].1), bits(&[0.1 + 0.2, f64::MIN_POSITIVE, -1.0e308]));
    assert_eq!(frame.numbers[1].0, "motor [degC]");
    assert_eq!((frame.numbers[1].1[0], frame.numbers[1].1[2]), (20.5, 1.0 / 3.0));
    assert!(frame.numbers[1].1[1].is_nan());
    assert_eq!(frame.metadata[1], ("coldplate.unit.flow".to_string(), "L/min".to_string()));
}

#[test]
fn the_same_table_gives_the_same_bytes() {
    assert_eq!(sample(), sample());
}

#[test]
fn an_empty_table_comes_back_empty() {
    let mut file = Vec::new();
    write_parquet(&mut file, &[], &[("flow", &[])], &[]).unwrap();
    let frame = read_parquet(file).unwrap();
    assert_eq!((frame.numbers.len(), frame.numbers[0].1.len()), (1, 0));
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let file = sample();
    for length in 0..file.len() {
        assert!(read_parquet(file[..length].to_vec()).is_err(), "cut to {length} bytes");
    }
}

#[test]
fn columns_that_do_not_fit_are_refused() {
    let mut file = Vec::new();
    assert!(write_parquet(&mut file, &[], &[("a", &[1.0]), ("b", &[1.0, 2.0])], &[]).is_err());
    assert!(write_parquet(&mut file, &[], &[("a", &[1.0]), ("a", &[2.0])], &[]).is_err());
}
