//! The page judged by an independent program, axe-core, in Chromium and Firefox: roles, names, contrast, order, in the light and in the
//! dark, with everything shown that can be; and whether it fits on a phone.

use std::net::TcpListener;
use std::path::{Path, PathBuf};

use coldplate_export::{Beside, page};
use coldplate_runtime::Surrogate;

use crate::browser::{browsers, told};
use crate::{cache, folder, skipped};

/// What the page is made to do before it is judged, and how.
const ACTS: &str = r##"
<script>
(async () => {
  const told = [];
  const tell = (key, value) => told.push(`${key}: ${String(value).replace(/\s+/g, " ").trim()}`);
  const byId = (id) => document.getElementById(id);
  const rest = () => new Promise((done) => setTimeout(done, 100));
  const tags = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"];
  const judge = async (what) => {
    const found = await axe.run(document, { runOnly: { type: "tag", values: tags } });
    for (const own of found.violations) tell("violation", `${what}: ${own.id}: ${own.help}: ${own.nodes.map((node) => `${node.target} ${node.any.map((one) => one.message)}`).join("; ")}`);
    tell("rules", found.passes.length);
    tell("contrast", found.passes.some((own) => own.id === "color-contrast"));
  };
  const moved = (share) => {
    for (const slider of document.querySelectorAll(".variable input[type=range]")) {
      slider.value = Number(slider.min) + share * (Number(slider.max) - Number(slider.min));
      slider.dispatchEvent(new Event("input", { bubbles: true }));
    }
  };
  const drop = async (text) => {
    byId("summary").textContent = "";
    byId("wrong").hidden = true;
    const files = new DataTransfer();
    files.items.add(new File([text], "tests.csv"));
    document.dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
    for (let k = 0; k < 50 && byId("summary").textContent === "" && byId("wrong").hidden; k += 1) await rest();
  };
  try {
    for (let k = 0; k < 100 && !byId("predictions").querySelector("title"); k += 1) await rest();
    await judge("as it opens");
    byId("keep").click();
    byId("keep").click();
    byId("units").value = "us";
    byId("units").dispatchEvent(new Event("change"));
    await drop(TABLE);
    tell("summary", byId("summary").textContent);
    byId("residuals").querySelector("button").click();
    for (let k = 0; k < 100 && !byId("signs").querySelector(".reading"); k += 1) await rest();
    tell("named", byId("signs").querySelectorAll(".reading").length);
    await judge("compared, with readings, in other units");
    window.dispatchEvent(new Event("beforeprint"));
    tell("printed", byId("printed").src.startsWith("data:image/png"));
    window.dispatchEvent(new Event("afterprint"));
    await drop("nonsense\n1\n");
    tell("refused", !byId("wrong").hidden);
    for (const share of [0, 1, 1.5]) {
      moved(share);
      tell("verdict", byId("verdict").className);
      await rest();
      await judge(`at ${share} of the ranges`);
    }
    byId("kept").scrollIntoView();
    byId("machine").scrollIntoView();
    await rest();
    const box = byId("machine").getBoundingClientRect();
    for (let k = 0; k < 81 && !byId("asked").textContent.startsWith("body"); k += 1) {
      const [across, down] = [(k % 9 + 0.5) / 9, (Math.floor(k / 9) + 0.5) / 9];
      byId("machine").dispatchEvent(new PointerEvent("pointermove", { clientX: box.left + box.width * across, clientY: box.top + box.height * down, bubbles: true }));
    }
    tell("asked", byId("asked").textContent);
    byId("cut").value = "x";
    byId("cut").dispatchEvent(new Event("input", { bubbles: true }));
    document.querySelector("details").open = true;
    byId("quantity").value = "1";
    byId("quantity").dispatchEvent(new Event("change", { bubbles: true }));
    await rest();
    await judge("the machine, cut, as a change");
    if (byId("over-time")) {
      byId("over-time").click();
      byId("time").value = "400";
      byId("time").dispatchEvent(new Event("input", { bubbles: true }));
      for (let k = 0; k < 50 && !byId("curves").querySelector("svg"); k += 1) await rest();
      tell("along", byId("clock").textContent);
      await judge("the machine along its course");
    }
    tell("intact", byId("failed").hidden);
    tell("dark", matchMedia("(prefers-color-scheme: dark)").matches);
  } catch (error) { tell("error", `${error} ${error.stack}`); }
  location = `http://ADDRESS/?${encodeURIComponent(told.join("\n"))}`;
})();
</script>
"##;

/// What a page of a phone's width tells of itself, with readings laid beside it.
const NARROW: &str = r##"
<script>
(async () => {
  const rest = () => new Promise((done) => setTimeout(done, 100));
  const byId = (id) => document.getElementById(id);
  for (let k = 0; k < 100 && !byId("predictions").querySelector("title"); k += 1) await rest();
  byId("keep").click();
  byId("over-time")?.click();
  const files = new DataTransfer();
  files.items.add(new File([TABLE], "tests.csv"));
  document.dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
  for (let k = 0; k < 50 && byId("summary").textContent === ""; k += 1) await rest();
  const wide = [...document.body.querySelectorAll("*")].filter((own) => !own.closest(".scroll, #pictures, svg, option") && own.getBoundingClientRect().right > innerWidth + 1);
  const small = [...document.querySelectorAll("button, select, input")].filter((own) => own.offsetParent && own.getBoundingClientRect().height < 16);
  const told = [`width: ${innerWidth}`, `whole: ${document.documentElement.scrollWidth}`, `wide: ${wide.map((own) => `${own.tagName}#${own.id}`).join(" ")}`, `small: ${small.map((own) => own.id || own.textContent).join(" ")}`, `summary: ${byId("summary").textContent}`];
  location = `http://ADDRESS/?${encodeURIComponent(told.join("\n"))}`;
})();
</script>
"##;

/// What `scripts/clients` installs of axe-core.
fn judge() -> Option<String> {
    let path = cache()?.join("coldplate/axe-core/node_modules/axe-core/axe.min.js");
    let text = std::fs::read_to_string(path).ok();
    if text.is_none() {
        skipped("axe-core is not there: scripts/clients installs it");
    }
    text
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../runtime/fixtures/{name}.cps"))
}

/// One reading at the middle of the ranges, as a text of JavaScript.
fn table(surrogate: &Surrogate<'_>) -> String {
    let head: Vec<String> = surrogate.variables().map(|own| format!("{} [{}]", own.name, own.unit)).collect();
    let middle: Vec<String> = surrogate.variables().map(|own| (0.5 * (own.low + own.high)).to_string()).collect();
    let point = surrogate.points().next().expect("there is one");
    format!("\"{},{} [{}]\\n{},25\\n\"", head.join(","), point.name, point.unit, middle.join(","))
}

/// A page with a machine of one body in it.
fn with_machine(surrogate: &Surrogate<'_>, name: &str) -> String {
    // The sensor of the scene is the point that the table reads.
    let point = format!("\"{}\"", surrogate.points().next().expect("there is one").name);
    let scene = include_str!("scene.json").replace("\"shell\"", &point);
    let beside = Beside { scene: Some(&scene), followed: None };
    let file = page(surrogate, &beside, name).expect("the name is one").swap_remove(0);
    String::from_utf8(file.content).expect("a page is text")
}

#[test]
fn an_independent_judge_finds_nothing() {
    let Some(judge) = judge() else { return };
    let folder = folder("accessible");
    for name in ["uncertain", "moving"] {
        let bytes = std::fs::read(fixture(name)).expect("it is there");
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let table = table(&surrogate);
        let page = with_machine(&surrogate, name);
        for dark in [false, true] {
            for (program, mut arguments) in browsers(&folder) {
                let own = folder.join(program.split('-').next().expect("it has a name"));
                let _ = std::fs::remove_dir_all(&own);
                if program == "chromium" {
                    arguments.extend(dark.then(|| "--force-dark-mode".to_string()));
                } else {
                    std::fs::create_dir_all(&own).expect("the folder can be written to");
                    let scheme = format!("user_pref(\"layout.css.prefers-color-scheme.content-override\", {});\n", i32::from(!dark));
                    std::fs::write(own.join("user.js"), scheme).expect("the folder can be written to");
                }
                let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
                let address = listener.local_addr().expect("it has one").to_string();
                let acts = ACTS.replace("TABLE", &table).replace("ADDRESS", &address);
                let path = folder.join(format!("{name}-{program}-{dark}.html"));
                let whole = page.replace("</body>", &format!("<script>{judge}</script>{acts}</body>"));
                std::fs::write(&path, whole).expect("the folder can be written to");
                let told = told(program, &arguments, &path, &listener);
                let of = |key: &str| told.iter().filter_map(|line| line.strip_prefix(&format!("{key}: "))).collect::<Vec<_>>();
                let what = format!("{program}, {name}, dark {dark}");
                assert_eq!(of("error"), Vec::<&str>::new(), "{what}");
                assert_eq!(of("violation"), Vec::<&str>::new(), "{what}");
                assert_eq!(of("dark"), [dark.to_string()], "{what}");
                assert_eq!(of("refused"), ["true"], "{what}");
                assert_eq!(of("intact"), ["true"], "{what}");
                assert_eq!((of("printed"), of("named")), (vec!["true"], vec!["1"]), "{what}");
                assert!(of("asked")[0].starts_with("body <i>: "), "{what}: {told:#?}");
                assert!(of("summary")[0].contains("1 conditions"), "{what}: {told:#?}");
                // A surrogate of steady states has no course.
                let judged = if name == "moving" { 7 } else { 6 };
                assert_eq!(of("contrast"), vec!["true"; judged], "{what}");
                assert!(of("along").iter().all(|own| own.contains(" of ")) && of("along").len() == judged - 6, "{what}: {told:#?}");
                assert!(of("rules").iter().all(|count| count.parse::<usize>().is_ok_and(|count| count >= 20)), "{what}: {told:#?}");
            }
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn it_fits_on_a_phone() {
    let folder = folder("phone");
    for name in ["uncertain", "moving"] {
        let bytes = std::fs::read(fixture(name)).expect("it is there");
        let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
        let page = with_machine(&surrogate, name);
        for width in ["320", "390"] {
            for (program, arguments) in browsers(&folder) {
                std::fs::create_dir_all(folder.join("firefox")).expect("the folder can be written to");
                let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
                let address = listener.local_addr().expect("it has one").to_string();
                let acts = NARROW.replace("TABLE", &table(&surrogate)).replace("ADDRESS", &address);
                let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("the folder can be written to");
                write("page.html", &page.replace("</body>", &format!("{acts}</body>")));
                // A window cannot be as narrow as a phone, a frame can.
                write(
                    "phone.html",
                    &format!("<!doctype html><iframe src=\"page.html\" width=\"{width}\" height=\"700\" style=\"border: 0\"></iframe>"),
                );
                let told = told(program, &arguments, &folder.join("phone.html"), &listener);
                let one = |key: &str| told.iter().find_map(|line| line.strip_prefix(&format!("{key}: "))).unwrap_or("-").trim().to_string();
                let what = format!("{program}, {name}, {width}: {told:#?}");
                assert_eq!(one("width"), width, "{what}");
                assert!(one("whole").parse::<f64>().is_ok_and(|whole| whole <= width.parse().expect("a number")), "{what}");
                assert_eq!((one("wide"), one("small")), (String::new(), String::new()), "{what}");
                assert!(one("summary").contains("1 conditions, 1 readings"), "{what}");
            }
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
}
