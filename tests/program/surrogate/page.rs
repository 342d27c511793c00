//! `export --to html` of a surrogate that follows what it held: the page answers as `query` does.

use std::process::Command;

use coldplate_base::random::Random;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::fit::model::{FollowedSpec, FollowedVariable, HeldSpec, Interaction, Transform};

use crate::common::{coldplate_in, json, message, scratch};

/// Takes the data and the arithmetic out of a page, and answers at values of the held variables.
const DRIVER: &str = r#"
const [path, asked] = process.argv.slice(2);
const page = require("fs").readFileSync(path, "utf8");
const scripts = [...page.matchAll(/<script[^>]*>([^]*?)<\/script>/g)].map((found) => found[1]);
const s = JSON.parse(scripts[0]);
const core = scripts[1].slice(0, scripts[1].indexOf("\n(() => {"));
const [coldplate, withHeld] = new Function(core + "; return [coldplate, coldplateFollowed];")();
console.log(JSON.stringify(JSON.parse(asked).map(({ x, to }) => {
  const moved = withHeld(s, s.followed, to);
  return { answer: coldplate(moved).assess(x, 0.95), held: moved.held.map((own) => own.value) };
})));
"#;

#[test]
fn a_page_follows_what_the_file_follows() {
    let folder = scratch("page_followed");
    for name in ["uncertain", "polynomial"] {
        let mut surrogate = file::decode(&std::fs::read(super::fixture(&format!("{name}.cps"))).unwrap()).unwrap();
        let points = surrogate.points.len();
        let mut random = Random::new(7);
        let mut number = move || random.unit() - 0.5;
        surrogate.held = [("preload", "N", 300.0), ("second_speed", "rpm", 200.0)]
            .map(|(name, unit, value)| HeldSpec { name: name.into(), unit: unit.into(), value })
            .to_vec();
        let count = surrogate.variables.len();
        let terms: Vec<Vec<u8>> =
            (0..=count).map(|t| (0..count).map(|v| if v == t { 2 } else { u8::from(t == count) }).collect()).collect();
        let mut variable = |held: usize, low: f64, high: f64| FollowedVariable {
            held,
            low,
            high,
            coefficients: (0..points).map(|_| terms.iter().map(|_| [4.0 * number(), 2.0 * number()]).collect()).collect(),
            errors: (0..points).map(|_| 0.2 + 0.1 * number()).collect(),
        };
        let variables = vec![variable(0, 100.0, 900.0), variable(1, 0.0, 2000.0)];
        // Changes are polynomials of the scaled variables that the slopes of the uncertainty have, if there are any.
        let slopes = surrogate.uncertainty.as_ref().filter(|own| !own.terms.is_empty()).map(|own| own.transforms.clone());
        let transforms =
            slopes.unwrap_or_else(|| (0..count).map(|v| [Transform::Identity, Transform::Reciprocal, Transform::Log][v % 3]).collect());
        surrogate.followed = Some(FollowedSpec {
            transforms,
            terms: terms.clone(),
            variables,
            interactions: vec![
                Interaction { point: 0, of: 0, by: 1, factor: 0.7 },
                Interaction { point: points - 1, of: 1, by: 0, factor: -0.4 },
            ],
            errors: (0..points).map(|p| 1.0 + p as f64).collect(),
            limits: if surrogate.limits.is_empty() { Vec::new() } else { vec![(0, 1)] },
        });
        // Variables with a logarithm or a reciprocal must not come to zero.
        assert!(surrogate.variables.iter().all(|v| v.low > 0.0), "{name}");
        std::fs::write(folder.join("followed.cps"), file::encode(&surrogate).unwrap()).unwrap();
        json(&coldplate_in(&folder, &["export", "followed.cps", "--to", "html", "--json"]));
        if Command::new("node").arg("--version").output().is_err() {
            println!("skipped: node is not on this machine");
            return;
        }
        std::fs::write(folder.join("driver.js"), DRIVER).unwrap();
        let at = |share: f64| surrogate.variables.iter().map(|v| v.low + share * (v.high - v.low)).collect::<Vec<f64>>();
        let asked: Vec<(Vec<f64>, [f64; 2])> =
            [(0.5, [300.0, 200.0]), (0.3, [450.0, 200.0]), (0.8, [300.0, 0.0]), (0.2, [150.0, 210.0]), (0.9, [820.0, 240.0])]
                .map(|(share, to)| (at(share), to))
                .to_vec();
        let text = serde_json::json!(asked.iter().map(|(x, to)| serde_json::json!({ "x": x, "to": to })).collect::<Vec<_>>()).to_string();
        let ran = Command::new("node").current_dir(&folder).args(["driver.js", "followed.html", &text]).output().unwrap();
        assert!(ran.status.success(), "{}", message(&ran));
        let found: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        for (k, (x, to)) in asked.iter().enumerate() {
            let mut query: Vec<String> = ["query", "followed.cps", "--json"].map(String::from).to_vec();
            let all = surrogate.variables.iter().map(|v| (&v.name, &v.unit)).chain(surrogate.held.iter().map(|h| (&h.name, &h.unit)));
            for ((name, unit), value) in all.zip(x.iter().chain(to)) {
                query.extend(["--at".into(), format!("{name}={value:?} {unit}")]);
            }
            let output = coldplate_in(&folder, &query);
            let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", message(&output)));
            let answer = &found[k]["answer"];
            let near = |a: &serde_json::Value, b: &serde_json::Value, what: &str| {
                let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
                assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{name}, {k}, {what}: {a} and not {b}");
            };
            for (p, point) in surrogate.points.iter().enumerate() {
                let own = &told["temperatures"][&point.name];
                near(&answer["values"][p], &own["degC"], &point.name);
                let high =
                    answer["values"][p].as_f64().unwrap() + coldplate_runtime::NINETY_FIVE * answer["bands"][p]["total"].as_f64().unwrap();
                near(&high.into(), &own["high"], &point.name);
            }
            for (l, limit) in surrogate.limits.iter().enumerate() {
                near(&answer["limits"][l]["margin"], &told["limits"][l]["margin"], &limit.name);
            }
            assert_eq!(answer["state"], told["verdict"], "{name}, {k}");
            for (held, value) in to.iter().enumerate() {
                near(&found[k]["held"][held], &(*value).into(), &surrogate.held[held].name);
            }
        }
        // The values that were held change nothing; others do.
        assert_ne!(found[1]["answer"]["values"], found[0]["answer"]["values"]);
    }
}
