//! The page's arithmetic in a JavaScript engine beside the runtime, and what the page holds.

use std::process::Command;

use coldplate_export::{Target, export};
use coldplate_runtime::Surrogate;

use crate::{Terms, assessment, compare, fixtures, folder, is_there, lay_out, skipped};

const CONDITIONS: usize = 1000;

/// For every page: takes its own data and its own arithmetic, reads conditions, writes what `assessment` lists.
const DRIVER: &str = r#"
const fs = require("fs");
const states = ["acceptable", "uncertain", "not_acceptable"];
for (const name of fs.readFileSync("names", "utf8").trim().split("\n")) {
    const page = fs.readFileSync(name + ".html", "utf8");
    const scripts = [...page.matchAll(/<script[^>]*>([^]*?)<\/script>/g)].map((found) => found[1]);
    if (scripts.length !== 2) throw new Error(name + ": " + scripts.length + " scripts");
    const s = JSON.parse(scripts[0]);
    const core = scripts[1].slice(0, scripts[1].indexOf("\n(() => {"));
    const answers = new Function(core + "; return coldplate;")()(s);
    if (!answers.selfTest()) throw new Error(name + ": self-test");
    const bytes = fs.readFileSync(name + ".in");
    const input = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
    const all = [];
    const width = s.variables.length;
    for (let row = 0; row * width < input.length; row += 1) {
        const found = answers.assess([...input.subarray(row * width, (row + 1) * width)], 0.95);
        all.push(...found.values);
        for (const band of found.bands) all.push(band.fit, band.parameters, band.misses, band.total);
        for (const limit of found.limits) all.push(limit.value, limit.maximum, limit.margin, limit.probability);
        all.push(states.indexOf(found.state), Number(found.inside), found.binding + 1, found.probability);
    }
    fs.writeFileSync(name + ".out", Buffer.from(new Float64Array(all).buffer));
}
"#;

#[test]
fn pages_answer_as_the_runtime_does() {
    if !is_there("node") {
        skipped("node is not on this machine");
        return;
    }
    let folder = folder("html");
    let names = lay_out(&folder, Target::Html, |_| CONDITIONS);
    std::fs::write(folder.join("driver.js"), DRIVER).expect("the folder can be written to");
    let output = Command::new("node").current_dir(&folder).arg("driver.js").output().expect("node starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers: assessment, order_is_own: true });
    let _ = std::fs::remove_dir_all(&folder);
}

fn page(surrogate: &Surrogate<'_>, name: &str) -> String {
    let file = export(surrogate, Target::Html, name).expect("the name is one").swap_remove(0);
    String::from_utf8(file.content).expect("a page is text")
}

#[test]
fn pages_ask_for_nothing_and_their_data_begin_no_tag() {
    for (name, bytes) in fixtures() {
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let text = page(&surrogate, &name);
        for asks in ["http:", "https:", "src=", "@import", "url(", "fetch(", "XMLHttpRequest", "innerHTML"] {
            assert!(!text.contains(asks), "{name}: {asks}");
        }
        let data = text.split("<script type=\"application/json\" id=\"surrogate\">").nth(1).expect("the data are there");
        let data = data.split("</script>").next().expect("they end");
        assert!(!data.contains('<') && data.trim().ends_with('}'), "{name}");
    }
}

/// A name with tags in it is shown as it is, the values are those of the runtime, and nothing is reported as wrong.
#[test]
fn a_browser_shows_what_the_runtime_answers() {
    if !is_there("chromium") {
        skipped("chromium is not on this machine");
        return;
    }
    let folder = folder("browser");
    let bytes =
        std::fs::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/fixtures/uncertain.cps")).expect("it is there");
    let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
    let text = page(&surrogate, "cooling");
    let text = text.replace("\"screw nut\"", "\"\\u003cscript>alert(1)\\u003c/script>\"");
    std::fs::write(folder.join("cooling.html"), text).expect("the folder can be written to");
    let output = Command::new("chromium")
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"])
        .args(["--disable-component-update", "--disable-sync", "--virtual-time-budget=5000", "--dump-dom", "--enable-logging=stderr"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", folder.join("cooling.html").display()))
        .output()
        .expect("chromium starts");
    let shown = String::from_utf8_lossy(&output.stdout);
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert!(!wrong.lines().any(|line| line.contains("CONSOLE")), "{wrong}");
    let middle: Vec<f64> = surrogate.variables().map(|v| 0.5 * (v.low + v.high)).collect();
    let found = assessment(&surrogate, &middle);
    assert!(shown.contains("<strong>Acceptable</strong>"), "{shown}");
    let points = surrogate.point_count();
    for point in 0..points {
        // Two digits of half the band, three decimals at most.
        let half = coldplate_runtime::NINETY_FIVE * found[points + 4 * point + 3];
        let digits = (1.0 - half.log10().floor()).clamp(0.0, 3.0) as usize;
        let cell = format!("<td>{:.digits$}</td>", found[point]);
        assert!(shown.contains(&cell), "{cell}: {shown}");
    }
    assert!(shown.contains("<td>&lt;script&gt;alert(1)&lt;/script&gt;</td>"), "{shown}");
    assert!(shown.contains("role=\"alert\" hidden"), "the self-test comes out");
    let _ = std::fs::remove_dir_all(&folder);
}
