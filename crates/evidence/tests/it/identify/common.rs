//! Studies, tables and noise, shared by the tests.

use coldplate_base::document::Document;
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify::{Free, IdentifyProblem};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use statrs::distribution::{Binomial, DiscreteCDF};

/// A machine from text on about `cells` cells.
pub fn study(text: &str, cells: Option<usize>) -> Study {
    Study::new(Document::parse(text, "twin.toml").unwrap(), cells).unwrap()
}

/// A condition in L/min, degC, rpm, degC.
pub fn condition(study: &Study, [flow, coolant, speed, ambient]: [f64; 4]) -> Condition {
    let values = [format!("{flow} L/min"), format!("{coolant} degC"), format!("{speed} rpm"), format!("{ambient} degC")];
    let names = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"];
    let pairs: Vec<(&str, &str)> = names.into_iter().zip(values.iter().map(String::as_str)).collect();
    study.model.machine.condition(&pairs).unwrap()
}

/// Steady readings (K) of some sensors.
pub fn table(study: &Study, sensors: &[&str], rows: &[(Condition, Vec<Option<f64>>)]) -> Data {
    let of = |(n, (condition, readings)): (usize, &(Condition, Vec<Option<f64>>))| ReadingRow {
        test: format!("test {}", n + 1),
        time: None,
        condition: condition.clone(),
        readings: readings.clone(),
        line: None,
    };
    let place = |name: &&str| study.model.machine.sensors.iter().position(|s| s.name == *name).unwrap();
    Data {
        source: "twin".into(),
        sensors: sensors.iter().map(place).collect(),
        names: sensors.iter().map(ToString::to_string).collect(),
        rows: rows.iter().enumerate().map(of).collect(),
        ..Data::default()
    }
}

pub fn problem(study: Study, data: Data, uncertainty: MeasurementUncertainty, free: &[&str]) -> IdentifyProblem {
    let free = free.iter().map(|text| Free::parse(text, &study).unwrap()).collect();
    IdentifyProblem { study, data, uncertainty, free, start: Start::Steady }
}

/// Normal numbers (SplitMix64, Steele et al. 2014; Box and Muller 1958).
pub struct Normal(pub u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    pub fn next(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Whether `hits` of `trials` is what a chance of `rate` may well give: neither tail below 0.0005.
pub fn is_likely(hits: usize, trials: usize, rate: f64) -> bool {
    let all = Binomial::new(rate, trials as u64).unwrap();
    let (below, above) = (all.cdf(hits as u64), if hits == 0 { 1.0 } else { all.sf(hits as u64 - 1) });
    below > 5e-4 && above > 5e-4
}
