//! Rows below a table that hold a statistic of its columns, as spreadsheets compute them.

/// Statistic of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Statistic {
    Mean,
    Deviation,
    Least,
    Largest,
    Median,
    Sum,
    Count,
}

/// Words for statistics in the first cell of a row, in small letters.
const WORDS: [(Statistic, &[&str]); 7] = [
    (Statistic::Mean, &["mean", "average", "avg", "mittelwert", "mittel", "durchschnitt", "moyenne"]),
    (Statistic::Deviation, &["std", "stdev", "stddev", "std dev", "std. dev", "sd", "sigma", "standard deviation", "standardabweichung"]),
    (Statistic::Least, &["min", "minimum"]),
    (Statistic::Largest, &["max", "maximum"]),
    (Statistic::Median, &["median"]),
    (Statistic::Sum, &["sum", "summe", "total"]),
    (Statistic::Count, &["count", "anzahl", "n"]),
];

impl Statistic {
    /// The statistic that a first cell names.
    pub(crate) fn named(cell: &str) -> Option<Self> {
        let word = cell.trim_end_matches(['.', ':', ' ']).to_lowercase();
        WORDS.iter().find(|(_, words)| words.contains(&word.as_str())).map(|(own, _)| *own)
    }

    /// Whether a number is the statistic of some values, to the digits that are written (`digit` is the last one).
    pub(crate) fn is_of(self, values: &[f64], number: f64, digit: f64) -> bool {
        let mut values: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
        let count = values.len() as f64;
        if values.len() < 2 {
            return false;
        }
        values.sort_by(f64::total_cmp);
        let sum: f64 = values.iter().sum();
        let squares: f64 = values.iter().map(|v| (v - sum / count).powi(2)).sum();
        let middle = values.len() / 2;
        let own = match self {
            Self::Mean => vec![sum / count],
            // Programs take the values as a sample, or as all that there are.
            Self::Deviation => vec![(squares / (count - 1.0)).sqrt(), (squares / count).sqrt()],
            Self::Least => vec![values[0]],
            Self::Largest => vec![values[values.len() - 1]],
            Self::Median => vec![0.5 * (values[(values.len() - 1) / 2] + values[middle])],
            Self::Sum => vec![sum],
            Self::Count => vec![count],
        };
        own.into_iter().any(|own| (own - number).abs() <= 0.51 * digit + 1e-9 * own.abs())
    }
}

/// Last digit that is written of a number in a cell.
pub(crate) fn last_digit(cell: &str) -> f64 {
    let (digits, exponent) = cell.split_once(['e', 'E']).unwrap_or((cell, "0"));
    let decimals = digits.split_once(['.', ',']).map_or(0, |(_, decimals)| decimals.chars().filter(char::is_ascii_digit).count());
    10f64.powi(exponent.trim().parse::<i32>().unwrap_or(0) - decimals as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_told_from_tests_of_their_names() {
        let values = [20.1, 21.4, 22.0, f64::NAN];
        for (word, cell) in [("Mean", "21.17"), ("Average:", "21.2"), ("Std. Dev.", "0.97"), ("SD", "0.79"), ("max", "22.0"), ("n", "3")] {
            let own = Statistic::named(word).unwrap();
            assert!(own.is_of(&values, cell.parse().unwrap(), last_digit(cell)), "{word} {cell}");
        }
        assert!(!Statistic::Largest.is_of(&values, 21.9, 0.1) && Statistic::named("motor").is_none());
        assert_eq!((last_digit("1,25"), last_digit("1.2e-3"), last_digit("7")), (0.01, 1e-4, 1.0));
    }
}
