//! Answers to many rows: chosen columns beside all columns.

use coldplate_base::progress::Silent;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::verdict::stream::{AnswerForm, Tally, answer};

use crate::surrogate::examples::*;

/// Columns that need no bands are answered without them: every cell, and the count of the verdicts, is that of the whole table. So
/// it is at a confidence for which the verdict alone is not enough.
#[test]
fn chosen_columns_have_the_cells_of_the_whole_table() {
    for spec in [uncertain(), uncertain_together(), ten_uncertain()] {
        let bytes = encode(&spec).unwrap();
        let surrogate = open(&bytes).unwrap();
        let header: Vec<String> = surrogate.variables().map(|v| format!("{} [{}]", v.name, v.unit)).collect();
        let mut csv = header.join(",");
        for row in 0..200 {
            let share = |v: usize| (0.618_033_988_749_895 * (v + 1) as f64 * f64::from(row)) % 1.0 * 1.2 - 0.1;
            let cells: Vec<String> =
                surrogate.variables().enumerate().map(|(v, x)| (x.low + share(v) * (x.high - x.low)).to_string()).collect();
            csv += &format!("\n{}", cells.join(","));
        }
        let table = |columns: &[&str], confidence: f64| -> (Vec<Vec<String>>, Tally) {
            let columns = columns.iter().map(|c| (*c).to_owned()).collect();
            let (form, mut text) = (AnswerForm { columns, confidence, ..AnswerForm::default() }, Vec::new());
            let tally = answer(&surrogate, csv.as_bytes(), &[], &form, None, &Silent, |piece| text.extend(piece)).unwrap();
            let text = String::from_utf8(text).unwrap();
            (text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect(), tally)
        };
        for confidence in [0.95, 0.8] {
            let (whole, tally) = table(&[], confidence);
            assert_eq!(tally.rows, 200);
            for columns in [&["temperatures"][..], &["margins", "verdict", "binding"], &["bands"], &["probability", "in_domain"]] {
                let (chosen, own) = table(columns, confidence);
                assert_eq!(own, tally);
                let places: Vec<usize> = chosen[0].iter().map(|name| whole[0].iter().position(|own| own == name).unwrap()).collect();
                for (line, all) in chosen.iter().zip(&whole) {
                    assert!(line.iter().zip(&places).all(|(cell, place)| *cell == all[*place]), "{columns:?}: {line:?}");
                }
            }
        }
    }
}
