//! The page over time in Chromium and Firefox: what it draws and says is the runtime's.

use std::net::TcpListener;
use std::path::Path;

use coldplate_export::{Target, export};
use coldplate_runtime::{State, Surrogate};

use crate::browser::{browsers, told};
use crate::{folder, worst};

const SAMPLES: usize = 200;
/// What the limit is moved to, degC, so that the run breaks it.
const LIMIT: f64 = 25.2;

const ACTS: &str = r##"
<script>
(async () => {
  const told = [];
  const tell = (key, value) => told.push(`${key}: ${String(value).replace(/\s+/g, " ").trim()}`);
  const byId = (id) => document.getElementById(id);
  const change = async (act) => {
    byId("when").textContent = "";
    act();
    for (let k = 0; k < 200 && byId("when").textContent === ""; k += 1) await new Promise((done) => setTimeout(done, 20));
  };
  const cells = () => [...byId("reached").tBodies[0].rows[0].cells].map((cell) => cell.textContent).join(" | ");
  try {
    await change(() => byId("duration").dispatchEvent(new Event("input")));
    tell("cold", byId("when").textContent);
    tell("row", cells());
    tell("curves", document.querySelectorAll("#pictures svg path.curve").length);
    tell("limits", document.querySelectorAll("#pictures svg line.limit").length);
    tell("title", document.querySelector("#pictures svg title").textContent);
    tell("spoken", byId("duration").getAttribute("aria-valuetext"));
    const s = JSON.parse(byId("surrogate").textContent);
    const answers = coldplate(s);
    const motion = coldplateInTime(s, answers);
    const x = s.variables.map((v) => 0.5 * (v.low + v.high));
    const run = follow(s, motion, answers, [{ from: x, to: x, until: 7200 }], motion.atTemperature(x[3]), 200);
    let one = run.next();
    while (!one.done) one = run.next();
    const cold = x.map((value, i) => (s.variables[i].name === "motor_speed" ? s.variables[i].low : value));
    const staged = follow(s, motion, answers, [{ from: cold, to: x, until: 1800 }, { from: x, to: x, until: 5400 }, { from: cold, to: cold, until: 7200 }], motion.atRest(cold), 200);
    let own = staged.next();
    while (!own.done) own = staged.next();
    tell("staged", own.value.samples.flatMap((sample) => sample.values).join(" "));
    tell("numbers", [one.value.broken[0], one.value.settled ?? -1, ...one.value.samples.flatMap((sample) => sample.values)].join(" "));
    await change(() => byId("begin-here").click());
    tell("rest", byId("when").textContent);
    await change(() => { byId("slider0").value = s.variables[0].low; byId("slider0").dispatchEvent(new Event("input")); });
    tell("begun", byId("begun").textContent);
    tell("warmer", cells());
    await change(() => { byId("duration").value = "0"; byId("duration").dispatchEvent(new Event("input")); });
    tell("short", byId("lasts").textContent);
    await change(() => { byId("duration").value = "200"; byId("ramped").value = "30"; byId("stopped").value = "45"; byId("stopped").dispatchEvent(new Event("change")); });
    tell("stages", byId("stages").textContent);
    const nameless = [...document.querySelectorAll("#course input, #course select, #course button")].filter((own) => !(own.labels && own.labels.length) && !own.ariaLabel && !own.textContent.trim());
    tell("nameless", nameless.length);
    tell("failed", byId("failed").hidden);
  } catch (error) { tell("error", `${error} ${error.stack}`); }
  location = `http://ADDRESS/?${encodeURIComponent(told.join("\n"))}`;
})();
</script>
"##;

/// The moment from which on something holds that does not hold at the state yet, by halving a step of this length.
fn since(surrogate: &Surrogate<'_>, state: &State, x: &[f64], length: f64, holds: impl Fn(&[f64]) -> bool) -> f64 {
    let (mut early, mut late) = (0.0, length);
    for _ in 0..40 {
        let middle = 0.5 * (early + late);
        let mut there = *state;
        surrogate.step(&mut there, middle, x).expect("the numbers are finite");
        if holds(&values(surrogate, &there, x)) { late = middle } else { early = middle }
    }
    late
}

fn values(surrogate: &Surrogate<'_>, state: &State, x: &[f64]) -> Vec<f64> {
    let mut values = vec![0.0; surrogate.point_count()];
    surrogate.read(state, x, &mut values).expect("the shapes fit");
    values
}

/// When the limit is broken, when all has settled (-1: not), and all values, as `follow` gives them.
fn numbers(surrogate: &Surrogate<'_>, x: &[f64], mut state: State, duration: f64) -> Vec<f64> {
    let length = duration / SAMPLES as f64;
    let mut states = vec![state];
    for _ in 0..SAMPLES {
        surrogate.step(&mut state, length, x).expect("the numbers are finite");
        states.push(state);
    }
    let all: Vec<Vec<f64>> = states.iter().map(|state| values(surrogate, state, x)).collect();
    let moment = |k: usize, holds: &dyn Fn(&[f64]) -> bool| {
        if k == 0 {
            return 0.0;
        }
        duration * (k - 1) as f64 / SAMPLES as f64 + since(surrogate, &states[k - 1], x, length, holds)
    };
    let is_broken = |values: &[f64]| values[0] > LIMIT;
    let broken = all.iter().position(|values| is_broken(values)).map_or(-1.0, |k| moment(k, &is_broken));
    let mut steady = vec![0.0; surrogate.point_count()];
    surrogate.evaluate(x, &mut steady).expect("the shapes fit");
    let own = surrogate.in_time().expect("the file moves");
    let near: Vec<f64> = steady.iter().zip(&all[0]).enumerate().map(|(p, (s, v))| (0.05 * (v - s).abs()).max(own.error(p))).collect();
    let is_settled = |values: &[f64]| values.iter().zip(&steady).zip(&near).all(|((value, steady), near)| (value - steady).abs() <= *near);
    let k = all.iter().rposition(|values| !is_settled(values)).map_or(0, |k| k + 1);
    let settled = if k == all.len() { -1.0 } else { moment(k, &is_settled) };
    let mut found = vec![broken, settled];
    found.extend(all.concat());
    found
}

/// All values along a ramp of half an hour, an hour at the condition and half an hour at the one that the ramp begins at: a step holds
/// the condition of its middle.
fn staged(surrogate: &Surrogate<'_>, cold: &[f64], x: &[f64]) -> Vec<f64> {
    let mut state = surrogate.at_rest(cold).expect("the file moves");
    let mut found = values(surrogate, &state, cold);
    let between = |share: f64| cold.iter().zip(x).map(|(from, to)| from + (to - from) * share).collect::<Vec<f64>>();
    for (steps, at) in [(50, None), (100, Some(x)), (50, Some(cold))] {
        for k in 1..=steps {
            let share = |own: f64| at.map_or_else(|| between(own / f64::from(steps)), <[f64]>::to_vec);
            surrogate.step(&mut state, 36.0, &share(f64::from(k) - 0.5)).expect("the numbers are finite");
            found.extend(values(surrogate, &state, &share(f64::from(k))));
        }
    }
    found
}

#[test]
fn a_page_follows_the_machine_over_time() {
    let folder = folder("over-time");
    let bytes = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/fixtures/moving.cps")).expect("it is there");
    let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
    let file = export(&surrogate, Target::Html, "moving").expect("the name is one").swap_remove(0);
    let page = String::from_utf8(file.content).expect("a page is text");
    assert!(page.contains("\"maximum\": 60.0"));
    let page = page.replace("\"maximum\": 60.0", &format!("\"maximum\": {LIMIT}"));
    let x: Vec<f64> = surrogate.variables().map(|v| 0.5 * (v.low + v.high)).collect();
    let expected = numbers(&surrogate, &x, surrogate.at_temperature(x[3]).expect("it is a number"), 7200.0);
    assert!(expected[0] > 0.0 && expected[0] < 7200.0, "the run breaks the limit: {}", expected[0]);
    let speed = surrogate.variables().position(|v| v.name == "motor_speed").expect("there is one");
    let mut cold = x.clone();
    cold[speed] = surrogate.variable(speed).expect("it is there").low;
    let expected_stages = staged(&surrogate, &cold, &x);
    for (program, arguments) in browsers(&folder) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = listener.local_addr().expect("it has one").to_string();
        let path = folder.join(format!("{program}.html"));
        std::fs::write(&path, page.replace("</body>", &format!("{}</body>", ACTS.replace("ADDRESS", &address))))
            .expect("it can be written");
        if program == "firefox-esr" {
            std::fs::create_dir_all(folder.join("firefox")).expect("the folder can be written to");
        }
        let told = told(program, &arguments, &path, &listener);
        let of = |key: &str| told.iter().filter_map(|line| line.strip_prefix(&format!("{key}: "))).map(String::from).collect::<Vec<_>>();
        let one = |key: &str| of(key).first().cloned().unwrap_or_else(|| panic!("{program}: no {key} in {told:#?}"));
        assert_eq!(of("error"), Vec::<String>::new(), "{program}");
        let numbers = |key: &str| one(key).split(' ').map(|own| own.parse().expect("a number")).collect::<Vec<f64>>();
        let (apart, place) = worst(&numbers("staged"), &expected_stages);
        assert!(apart < 1e-9, "{program}: {apart:e} at {place}");
        assert!(
            one("stages").contains("condition of the beginning") && one("stages").contains("the file knows nothing"),
            "{program}: {}",
            one("stages")
        );
        let found = numbers("numbers");
        let (apart, place) = worst(&found, &expected);
        println!("{program}: {apart:.1e} at number {place}, broken after {:.3} s", found[0]);
        assert!(apart < 1e-9, "{program}: {apart:e} at {place}");
        assert!(
            one("cold").starts_with("'point 0' is broken after ") && one("cold").contains("Settled after "),
            "{program}: {}",
            one("cold")
        );
        assert!(one("row").starts_with("point 0 | 25.") && one("row").contains(" | 25.2 | after "), "{program}: {}", one("row"));
        assert_eq!((one("curves"), one("limits")), ("3".into(), "1".into()), "{program}");
        assert!(one("title").starts_with("point 0, point 1, point 2 over "), "{program}: {}", one("title"));
        assert!(one("title").ends_with(&one("spoken")), "{program}: {}", one("spoken"));
        assert_eq!(one("rest"), "No limit is broken. Settled after 0 s.", "{program}");
        assert!(one("begun").starts_with("Begins in the steady state of coolant flow 7 L/min"), "{program}: {}", one("begun"));
        let low: Vec<f64> =
            surrogate.variables().zip(&x).enumerate().map(|(v, (own, middle))| if v == 0 { own.low } else { *middle }).collect();
        let mut steady = vec![0.0; surrogate.point_count()];
        surrogate.evaluate(&low, &mut steady).expect("the shapes fit");
        assert!(one("warmer").contains(" | after ") == (steady[0] > LIMIT), "{program}: {} at {}", one("warmer"), steady[0]);
        assert_eq!((one("short"), one("nameless"), one("failed")), ("60 s".into(), "0".into(), "true".into()), "{program}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
