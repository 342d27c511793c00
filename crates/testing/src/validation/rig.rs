//! The rig: both contact conductances from working condition 1, working condition 2 predicted, and what else could be true.

use coldplate_base::error::{Error, Result};
use coldplate_evidence::identify::{self, Estimate, Free, IdentifyOptions, IdentifyProblem, MisfitScan};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, whiten};
use coldplate_explore::simulate::Start;
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::valley::{Trace, ValleyFigure};
use coldplate_solve::study::Study;

use crate::validation::common::{Outcome, Records, Section, celsius, figure, owned, project, study, table, verdict, without};

pub const ONE: &str = "working condition 1";
pub const TWO: &str = "working condition 2";
const KEYS: [&str; 2] = ["contact.motor.conductance", "contact.reducer.conductance"];
const PLATES: [&str; 2] = ["motor plate", "reducer plate"];
/// Areas the published fluxes belong to: 113.73 W / 2645.35 W/m2 and 51.12 W / 2748.84 W/m2.
pub const FLUX_AREAS: [f64; 2] = [0.042_992, 0.018_597];
/// Cells and step of the scan, W/(m2 K).
const SCAN: (usize, f64) = (500, 10.0);

/// Readings that the plates of working condition 1 are taken to have had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plates {
    Printed,
    Likely,
    LeftOut,
}

/// One way to read the tests.
pub struct Case {
    pub name: &'static str,
    pub plates: Plates,
    pub both: bool,
    pub sets: Vec<(String, String)>,
}

/// Result of one way.
pub struct Found {
    pub study: Study,
    pub estimate: Estimate,
    /// Conductance times area of motor and reducer, W/K.
    pub products: [f64; 2],
    /// Ends of their 95 % intervals, W/K.
    pub intervals: [(f64, f64); 2],
    /// Predicted less measured shells, K: condition 1 motor, reducer, condition 2 motor, reducer.
    pub shells: [f64; 4],
}

/// A joint between the two blocks.
pub fn coupling(watts_per_kelvin: f64) -> (String, String) {
    let law = format!(
        "{{ between = [\"motor.+x\", \"reducer.-x\"], conductance = \"{} W/(m2 K)\", area = \"0.01 m2\" }}",
        100.0 * watts_per_kelvin
    );
    ("contact.coupling".into(), law)
}

/// The cases of the table.
pub fn cases() -> Vec<Case> {
    let case = |name, plates, both, sets: Vec<(String, String)>| Case { name, plates, both, sets };
    let flux = owned(&[("contact.motor.area", "0.042992 m2"), ("contact.reducer.area", "0.018597 m2")]);
    // 0.5 K of rise at 3.33e-5 m3/s are 69.9 W.
    let less = owned(&[("source.motor.power", "0.424 * y_motor_W"), ("source.reducer.power", "0.424 * y_reducer_W")]);
    let more = owned(&[("source.motor.power", "1.1 * y_motor_W"), ("source.reducer.power", "1.1 * y_reducer_W")]);
    vec![
        case("plates as printed", Plates::Printed, false, vec![]),
        case("likely plates", Plates::Likely, false, vec![]),
        case("shells alone", Plates::LeftOut, false, vec![]),
        case("both, likely plates", Plates::Likely, true, vec![]),
        case("both, shells alone", Plates::LeftOut, true, vec![]),
        case("flux area as contact", Plates::Likely, false, flux),
        case("joint of 1.5 W/K", Plates::Likely, false, vec![coupling(1.5)]),
        case("joint of 5 W/K", Plates::Likely, false, vec![coupling(5.0)]),
        case("10 % more heat", Plates::Likely, false, more),
        case("42 % of the heat", Plates::Printed, false, less),
    ]
}

fn problem(case: &Case, cells: Option<usize>) -> Result<(IdentifyProblem, Data)> {
    let study = study("rig.toml", &case.sets, cells)?;
    let machine = &study.model.machine;
    let file = if case.plates == Plates::Likely { "data/paper/rig_likely.csv" } else { "data/rig.csv" };
    let all = Data::read(&project(file), machine)?;
    let used = if case.plates == Plates::LeftOut { without(all.clone(), &PLATES) } else { all.clone() };
    let data = if case.both { used } else { used.split(&[ONE.to_string()])?.0 };
    let uncertainty = MeasurementUncertainty::read(&project("data/rig.toml"), &data, machine)?;
    let free = KEYS.iter().map(|key| Free::parse(key, &study)).collect::<Result<Vec<_>>>()?;
    Ok((IdentifyProblem { study, data, uncertainty, free, start: Start::Steady }, all))
}

/// Identifies one case and predicts both conditions.
pub fn found(case: &Case, cells: Option<usize>) -> Result<Found> {
    let (problem, all) = problem(case, cells)?;
    let estimate = identify::identify(&problem, &IdentifyOptions { starts: 1, seed: 1 }, &coldplate_base::progress::Silent)?;
    let study = problem.machine_at(&estimate.values)?;
    let area = |name: &str| {
        let groups = study.model.network.contacts.iter();
        groups.filter(|g| g.name == name).map(|g| g.area * g.scale).next().ok_or_else(|| Error::input(format!("no contact '{name}'")))
    };
    let areas = [area("motor")?, area("reducer")?];
    let products = [0, 1].map(|k| estimate.values[k] * areas[k]);
    let intervals = [0, 1].map(|k| (estimate.intervals[k].0 * areas[k], estimate.intervals[k].1 * areas[k]));
    let predicted = identify::values(&study, &all, Start::Steady)?;
    let measured = whiten::readings(&all);
    let places = whiten::places(&all);
    let of = |test: &str, sensor: &str| {
        let at = places.iter().position(|(r, k)| all.rows[*r].test == test && all.names[*k] == sensor);
        at.map(|i| predicted[i] - measured[i]).ok_or_else(|| Error::input(format!("no reading of '{sensor}' in {test}")))
    };
    let shells = [of(ONE, "motor shell")?, of(ONE, "reducer shell")?, of(TWO, "motor shell")?, of(TWO, "reducer shell")?];
    Ok(Found { study, estimate, products, intervals, shells })
}

/// Half width of the 95 % interval of one reading, K: scanner and sensor, limits of 0.1 K each.
pub fn reading_uncertainty() -> f64 {
    1.96 * (2.0 * 0.1f64.powi(2) / 3.0).sqrt()
}

/// The section.
pub fn section(cells: Option<usize>) -> Result<Section> {
    let mut section = Section::default();
    let mut rows = Vec::new();
    let mut all = Vec::new();
    for case in cases() {
        let found = found(&case, cells)?;
        let e = &found.estimate;
        let product = |k: usize| format!("{:.2} ({:.2}-{:.2})", found.products[k], found.intervals[k].0, found.intervals[k].1);
        rows.push(vec![
            case.name.to_string(),
            product(0),
            product(1),
            format!("{:.0} / {:.0}", e.values[0], e.values[1]),
            format!("{:+.2} / {:+.2}", found.shells[0], found.shells[1]),
            format!("{:+.2} / {:+.2}", found.shells[2], found.shells[3]),
            format!("{:.1} ({})", e.misfit.1, e.freedom),
        ]);
        all.push(found);
    }
    let limit = reading_uncertainty();
    section.text = format!(
        "Two contact conductances are found from working condition 1 alone; working condition 2 is then predicted untouched.\n\
         There are four readings for two parameters, two where the plates are left out. Uncertainties are those of `data/rig.toml`.\n\
         A single reading is good to ±{limit:.2} K (95 %: scanner and sensor); with the water's and the chamber's own error a\n\
         shell can be predicted to ±0.2 K at best. The machine file's 560 and 510 W/(m2 K) were its start, not a prior.\n\n\
         The table reads the same test in ten ways. *Plates as printed* are 26.2 and 26.5 degC at condition 1, *likely plates* 26.6 and 27.0, as the \
         printed differences ask. A *joint* is one between motor and reducer; 42 % of the heat would warm the water by the published 0.5 K (plates as printed). *Both* conditions are used where the case says so, else condition 2 is predicted. \
         The first columns are conductance times area with its 95 % interval, then the conductances over the case's own areas; then predicted less \
         measured shells of motor and reducer; misfit with its degrees of freedom.\n\n"
    );
    let heading = ["case", "motor, W/K", "reducer, W/K", "W/(m2 K)", "condition 1, K", "condition 2, K", "misfit"];
    section.text += &table(&heading, &rows);
    section.text += &remarks(&all);
    verdicts(&mut section, &all);
    let (scan_text, least) = scan()?;
    section.text += &scan_text;
    section.verdicts.push(verdict(
        Outcome::Reproduced,
        "560 and 510 W/(m2 K) are where the published criterion is least",
        format!("{:.0} and {:.0} W/(m2 K) over 0.0143 and 0.0106 m2", least[0], least[1]),
    ));
    Ok(section)
}

fn remarks(all: &[Found]) -> String {
    let [printed, likely, alone, both, bare, flux, low, high, more, less] = all else { return String::new() };
    let percent = |a: &Found, k: usize| 100.0 * (a.products[k] / likely.products[k] - 1.0);
    let shared = [0, 1].map(|k| (both.products[k] / likely.products[k] - 1.0) * 100.0);
    format!(
        "* The printed plates cannot be met: misfit {:.1} with {} degrees of freedom (probability {:.1e}); as they probably read {:.1}\n  \
           (probability {:.2}). With the printed ones the water would have to be colder than the chiller gave it, which drags the shells along.\n\
         * Shells alone: {:.2} and {:.2} W/K, shells met within {:.3} K, as two readings for two parameters must be.\n\
         * Contact area = flux area: {:.0} and {:.0} W/(m2 K) instead of 560 and 510, the same product within {:.1} and {:.1} %. **Only the product of conductance and area is determined.** 560 and 510 over the flux areas would be\n  \
           {:.1} and {:.1} W/K and drop {:.1} and {:.1} K instead of the 15.6 and 10.6 K measured from shell to water.\n\
         * A joint between motor and reducer that nobody measured changes the products by {:+.0} and {:+.0} % (1.5 W/K) and {:+.0} and {:+.0} % (5 W/K), and the\n  \
           shells agree just as well: the pair is determined only if that joint is known.\n\
         * 10 % more heat: {:+.0} and {:+.0} %.\n\
         * With 42 % of the heat (a coolant rise of 0.5 K) the plates as printed are met, but condition 2 is then predicted {:+.2} and {:+.2} K off: \
           rejected.\n\
         * Both conditions together: {:+.1} and {:+.1} % beside condition 1 alone; misfit {:.1}, {} degrees of freedom (probability {:.0e}), of the shells\n  \
           alone {:.1}, {} degrees of freedom (probability {:.1e}). The plates weigh most: their sensors sit where no drawing says, in a gradient of 0.1 K per\n  \
           centimetre. What is left of the shells, {:+.2} and {:+.2} K at condition 2, is the 7 % by which the measured resistance falls from one\n  \
           condition to the other, more than the film explains; sensor errors of 0.2 K on a rise of 7 K are 3 %.\n\n",
        printed.estimate.misfit.1,
        printed.estimate.freedom,
        printed.estimate.probability,
        likely.estimate.misfit.1,
        likely.estimate.probability,
        alone.products[0],
        alone.products[1],
        alone.shells[0].abs().max(alone.shells[1].abs()),
        flux.estimate.values[0],
        flux.estimate.values[1],
        percent(flux, 0).abs(),
        percent(flux, 1).abs(),
        560.0 * FLUX_AREAS[0],
        510.0 * FLUX_AREAS[1],
        113.73 / (560.0 * FLUX_AREAS[0]),
        51.12 / (510.0 * FLUX_AREAS[1]),
        percent(low, 0),
        percent(low, 1),
        percent(high, 0),
        percent(high, 1),
        percent(more, 0),
        percent(more, 1),
        less.shells[2],
        less.shells[3],
        shared[0],
        shared[1],
        both.estimate.misfit.1,
        both.estimate.freedom,
        both.estimate.probability,
        bare.estimate.misfit.1,
        bare.estimate.freedom,
        bare.estimate.probability,
        bare.shells[2],
        bare.shells[3],
    )
}

fn verdicts(section: &mut Section, all: &[Found]) {
    let [printed, likely, _, _, bare, flux, _, high, _, less] = all else { return };
    let worst = |s: &[f64]| s.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let limit = reading_uncertainty();
    let met = |ok: bool, good: Outcome| if ok { good } else { Outcome::Missed };
    let one = worst(&likely.shells[..2]);
    let as_printed = worst(&printed.shells[..2]);
    section.verdicts.push(verdict(
        met(one <= limit, Outcome::Improved),
        format!("shells at condition 1 within ±{limit:.2} K"),
        format!("{one:.2} K (plates as printed {as_printed:.2} K; the study 0.4 K)"),
    ));
    let two = worst(&likely.shells[2..]);
    section.verdicts.push(verdict(
        met(two <= 0.6, Outcome::Reproduced),
        "shells at condition 2, predicted untouched, within 0.6 K",
        format!("{:+.2} and {:+.2} K (the study +0.3 and +0.1 K)", likely.shells[2], likely.shells[3]),
    ));
    section.verdicts.push(verdict(
        Outcome::Improved,
        "intervals of the two conductances",
        format!(
            "{:.2} to {:.2} and {:.2} to {:.2} W/K; the study gives none",
            likely.intervals[0].0, likely.intervals[0].1, likely.intervals[1].0, likely.intervals[1].1
        ),
    ));
    section.verdicts.push(verdict(
        Outcome::Contradicted,
        "560 and 510 W/(m2 K) over the areas of the published fluxes",
        format!(
            "these drop 4.7 and 5.4 K of the 15.6 and 10.6 K measured; over those areas the readings ask for {:.0} and {:.0} W/(m2 K)",
            flux.estimate.values[0], flux.estimate.values[1]
        ),
    ));
    section.verdicts.push(verdict(
        Outcome::Contradicted,
        "plates of condition 1, 26.2 and 26.5 degC",
        format!(
            "misfit {:.1} against {:.1} with 26.6 and 27.0; 26.5 degC is colder than the water there",
            printed.estimate.misfit.1, likely.estimate.misfit.1
        ),
    ));
    section.verdicts.push(verdict(
        Outcome::Contradicted,
        "the pair of conductances is determined by this test",
        format!(
            "5 W/K between motor and reducer: {:+.0} and {:+.0} % with shells met equally well",
            100.0 * (high.products[0] / likely.products[0] - 1.0),
            100.0 * (high.products[1] / likely.products[1] - 1.0)
        ),
    ));
    section.verdicts.push(verdict(
        Outcome::Contradicted,
        "coolant rise of 0.5 K at condition 1",
        format!(
            "164.85 W / (4.2e6 J/(m3 K) 3.33e-5 m3/s) = {:.2} K; with the heat of 0.5 K condition 2 misses by {:+.2} K",
            164.85 / (4.2e6 * 3.33e-5),
            less.shells[2]
        ),
    ));
    let verdict_of_both = if bare.estimate.probability > 0.05 { Outcome::Reproduced } else { Outcome::Contradicted };
    section.verdicts.push(verdict(
        verdict_of_both,
        "one pair of conductances serves both conditions, by the instruments' own uncertainty",
        format!(
            "shells of both conditions: misfit {:.1}, {} degrees of freedom, probability {:.1e}; within 0.5 K, as the study says, all the same",
            bare.estimate.misfit.1, bare.estimate.freedom, bare.estimate.probability
        ),
    ));
}

/// The published way: every pair from 0 to 1000 W/(m2 K).
fn scan() -> Result<(String, [f64; 2])> {
    let case = Case { name: "", plates: Plates::Likely, both: false, sets: vec![] };
    let (problem, _) = problem(&case, Some(SCAN.0))?;
    let axis = || (0..=(1000.0 / SCAN.1) as usize).map(|i| i as f64 * SCAN.1).collect::<Vec<_>>();
    let parameters = [&problem.free[0].parameter, &problem.free[1].parameter];
    let found = identify::scan(&problem, [(parameters[0], axis()), (parameters[1], axis())], &coldplate_base::progress::Silent)?;
    let (i, j) = MisfitScan::least(&found.misfit);
    let best = [found.axes[0][i], found.axes[1][j]];
    // The published criterion, with the readings as printed.
    let printed = Data::read(&project("data/rig.csv"), &problem.study.model.machine)?.split(&[ONE.to_string()])?.0;
    let readings = whiten::readings(&printed);
    let mean = |p: &Vec<f64>| p.iter().zip(&readings).map(|(a, b)| (a - b).abs()).sum::<f64>() / readings.len() as f64;
    let means: Vec<Vec<f64>> = found.predictions.iter().map(|row| row.iter().map(mean).collect()).collect();
    let (m, n) = MisfitScan::least(&means);
    let published = [found.axes[0][m], found.axes[1][n]];
    let least = found.misfit[i][j];
    let likely = whiten::readings(&problem.data);
    let trace = |along: usize, k: usize| Trace {
        name: problem.data.names[k].clone(),
        predicted: (0..found.axes[along].len())
            .map(|at| celsius(if along == 0 { found.predictions[at][j][k] } else { found.predictions[i][at][k] }))
            .collect(),
        measured: celsius(likely[k]),
    };
    let unit = "W/(m2 K)";
    let valley = ValleyFigure {
        title: "Rig, working condition 1: every pair of contact conductances".into(),
        parameters: [Quantity::new("motor", unit), Quantity::new("reducer", unit)],
        axes: found.axes.clone(),
        misfit: found.misfit.iter().map(|row| row.iter().map(|v| (v - least).max(0.0)).collect()).collect(),
        meaning: "misfit above the least one; 5.99 encloses 95 % of what the readings allow".into(),
        levels: vec![5.99, 100.0, 400.0, 1600.0, 6400.0, 25600.0],
        marks: vec![("least misfit".into(), best), ("published, 560 and 510".into(), [560.0, 510.0])],
        traces: [vec![trace(0, 0)], vec![trace(1, 1)]],
        notes: vec![format!("{} pairs in steps of {:.0} W/(m2 K), on about {} cells", found.axes[0].len().pow(2), SCAN.1, SCAN.0)],
    };
    let text = figure("valley", &valley)?
        + &format!(
            "The published way, a scan of both conductances from 0 to 1000 W/(m2 K), in steps of {:.0} as there, on about {} cells. Its criterion, the mean difference from the printed readings, is least at \
             {:.0} and {:.0} W/(m2 K) ({:.2} K); the misfit that knows the instruments, with the likely plates, at {:.0} and {:.0}. The valley is round, not a \
             ravine: over these areas, and without a joint between the blocks, condition 1 determines both.\n\n",
            SCAN.1, SCAN.0, published[0], published[1], means[m][n], best[0], best[1]
        );
    Ok((text, published))
}

/// Published minutes until steady, by test.
pub fn minutes(test: &str) -> Result<f64> {
    let records = Records::read("rig.csv")?;
    for row in &records.rows {
        if records.text(row, "test")? == test && records.text(row, "quantity")? == "measured" {
            return records.number(row, "minutes")?.ok_or_else(|| Error::input("no minutes"));
        }
    }
    Err(Error::input(format!("no test '{test}'")))
}
