/* Measured tables beside a surrogate; `s` and `answers` as in the page. Columns are those of `coldplate query --csv` and of measured
   data: `NAME [UNIT]` for variables and points, others without a unit are remarks; an empty cell is a missing reading. */
function readings(s, answers) {
  const MOST_BYTES = 20e6;
  /* Factor and offset to SI units, by kinds of quantities. */
  const KINDS = [
    { "m3/s": [1, 0], "L/s": [1e-3, 0], "L/min": [1 / 6e4, 0], "l/min": [1 / 6e4, 0], "L/h": [1 / 3.6e6, 0], "m3/h": [1 / 3600, 0], "mL/min": [1 / 6e7, 0] },
    { K: [1, 0], degC: [1, 273.15], "°C": [1, 273.15], degF: [5 / 9, 459.67 * 5 / 9] },
    { "rad/s": [1, 0], rpm: [Math.PI / 30, 0], "1/min": [Math.PI / 30, 0] },
    { W: [1, 0], kW: [1e3, 0], mW: [1e-3, 0] },
    { "m/s": [1, 0], "mm/s": [1e-3, 0], "m/min": [1 / 60, 0] },
    { N: [1, 0], kN: [1e3, 0] },
    { 1: [1, 0], "%": [0.01, 0] },
  ];

  class Wrong extends Error {}

  /* What brings numbers of one unit into another; nothing where that is not known here. */
  function conversion(from, to) {
    if (from === to) return (value) => value;
    const kind = KINDS.find((own) => from in own && to in own);
    return kind && ((value) => (value * kind[from][0] + kind[from][1] - kind[to][1]) / kind[to][0]);
  }

  /* Cells of every line that is no remark, with its number; quotes hold commas, lines and doubled quotes. */
  function* records(text) {
    let [cells, cell, quoted, wasQuoted, line, begun] = [[], "", false, false, 1, 1];
    const end = () => { cells.push(wasQuoted ? cell : cell.trim()); [cell, wasQuoted] = ["", false]; };
    const bare = text.replace(/^\uFEFF/, "").replace(/\r\n?/g, "\n");
    for (let k = 0; k <= bare.length; k += 1) {
      const c = bare[k];
      if (quoted) {
        if (c === undefined) throw new Wrong(`Line ${begun}: a quoted cell does not end.`);
        if (c === "\n") line += 1;
        if (c === '"' && bare[k + 1] === '"') { cell += c; k += 1; } else if (c === '"') quoted = false; else cell += c;
      } else if (c === '"' && cell.trim() === "") [cell, quoted, wasQuoted] = ["", true, true];
      else if (c === ",") end();
      else if (c === "\n" || c === undefined) {
        end();
        if (cells.some((own) => own !== "") && !cells[0].startsWith("#")) yield { line: begun, cells };
        line += 1;
        [cells, begun] = [[], line];
      } else cell += c;
    }
  }

  const known = () => [...s.variables, ...s.points].map((own) => `'${own.name} [${own.unit}]'`).join(", ");

  /* What a column is: a remark, or a place among variables, points or held variables. */
  function column(head) {
    const found = /^(.*?)\s*\[([^\]]*)\]$/.exec(head);
    const name = (found ? found[1] : head).trim();
    const places = { variable: s.variables, point: s.points, held: s.held };
    const kind = Object.keys(places).find((key) => places[key].some((own) => own.name === name));
    if (!kind) {
      if (name === "time") throw new Wrong("Column 'time' says that these are readings over time; this page knows steady states. Keep one row for each.");
      if (found) throw new Wrong(`Column '${head}' is no variable and no point of this surrogate. Those are: ${known()}.`);
      return { kind: "remark", name };
    }
    const place = places[kind].findIndex((own) => own.name === name);
    const own = places[kind][place];
    if (!found) throw new Wrong(`Column '${name}' has no unit. Write '${name} [${own.unit}]'.`);
    const unit = found[2].trim();
    const convert = conversion(unit, own.unit);
    if (!convert) throw new Wrong(`Column '${head}': this page cannot bring '${unit}' into '${own.unit}'. Write '${name} [${own.unit}]'.`);
    return { kind, name, place, convert };
  }

  function numberOf(cell, head, line) {
    if (cell === "") return null;
    const value = /^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$/.test(cell) ? Number(cell) : NaN;
    if (!Number.isFinite(value)) throw new Wrong(`Line ${line}, column '${head}': '${cell.slice(0, 40)}' is no number.`);
    return value;
  }

  /* Tests with their condition in the surrogate's units, and readings by point. */
  function table(text) {
    if (text.length > MOST_BYTES) throw new Wrong("This file is larger than 20 MB.");
    const all = records(text);
    const { value: header } = all.next();
    if (!header) throw new Wrong("This file has no header. Its first line names the columns.");
    const columns = header.cells.map(column);
    const twice = columns.find((own, k) => own.kind !== "remark" && columns.some((other, j) => j < k && other.kind === own.kind && other.place === own.place));
    if (twice) throw new Wrong(`There are two columns '${twice.name}'.`);
    const missing = s.variables.find((_, k) => !columns.some((own) => own.kind === "variable" && own.place === k));
    if (missing) throw new Wrong(`There is no column '${missing.name} [${missing.unit}]', without which the condition is not known.`);
    if (!columns.some((own) => own.kind === "point")) throw new Wrong(`There is no reading: no column is one of ${s.points.map((own) => `'${own.name} [${own.unit}]'`).join(", ")}.`);
    const named = columns.findIndex((own) => own.kind === "remark" && own.name === "test");
    const tests = [];
    for (const { line, cells } of all) {
      if (cells.length !== columns.length) throw new Wrong(`Line ${line} has ${cells.length} cells, the header ${columns.length}.`);
      const test = { name: (named >= 0 && cells[named]) || `line ${line}`, x: [], read: new Array(s.points.length).fill(null) };
      columns.forEach((own, k) => {
        if (own.kind === "remark") return;
        const head = header.cells[k];
        const value = numberOf(cells[k], head, line);
        if (value === null && own.kind === "variable") throw new Wrong(`Line ${line}, column '${head}': the condition is not stated.`);
        const converted = value === null ? null : own.convert(value);
        if (own.kind === "variable") test.x[own.place] = converted;
        if (own.kind === "point") test.read[own.place] = converted;
        if (own.kind === "held" && converted !== null) {
          const at = s.held[own.place];
          if (Math.abs(converted - at.value) > 1e-6 * Math.max(1, Math.abs(at.value))) {
            throw new Wrong(`Line ${line}, column '${head}': this surrogate was made at ${at.value} ${at.unit}, and knows nothing of ${cells[k]}.`);
          }
        }
      });
      tests.push(test);
    }
    if (tests.length === 0) throw new Wrong("There is a header, and no row below it.");
    return tests;
  }

  /* Reading less value of every point that was read, and whether it lies in the band of 95 %; root mean squares by point. */
  function residuals(tests) {
    const rows = tests.map((test) => {
      const found = answers.assess(test.x, 0.95);
      const of = test.read.map((read, p) => {
        if (read === null) return null;
        const residual = read - found.values[p];
        return { residual, inBand: Math.abs(residual) <= 1.959963984540054 * found.bands[p].total };
      });
      return { test, inside: found.inside, of };
    });
    const rms = s.points.map((_, p) => {
      const own = rows.map((row) => row.of[p]).filter((cell) => cell !== null);
      return own.length === 0 ? null : Math.sqrt(own.reduce((sum, cell) => sum + cell.residual ** 2, 0) / own.length);
    });
    return { rows, rms };
  }

  return { table, residuals, Wrong };
}

/* What "Readings beside it" shows: a table that is dropped on the page or chosen, less the answers; `measured` is what readings(s,
   answers) gives. The test whose condition is set is shown in the picture of the machine too. */
function readingsBeside(s, measured, page) {
  const { byId, make, signed, units } = page;
  const MOST_ROWS = 200;
  let read = null;
  let pictured = null;
  function picture(row) {
    pictured = row;
    page.onTest(row && row.of.flatMap((cell, p) => (cell === null ? [] : [{ name: s.points[p].name, unit: s.points[p].unit, ...cell }])));
  }
  function lay() {
    if (!read) return;
    const { rows: found, rms } = measured.residuals(read.tests);
    const points = s.points.map((_, p) => p).filter((p) => rms[p] !== null);
    const span = (p, value) => units.span(s.points[p].unit, value);
    const row = (kind, first, texts) => {
      const tr = make("tr");
      tr.append(first, ...texts.map((text) => make(kind, text, kind === "th" ? { scope: "col" } : {})));
      return tr;
    };
    const heads = row("th", make("th", "test", { scope: "col" }), points.map((p) => `${s.points[p].name} [${units.spanName(s.points[p].unit)}]`));
    byId("residuals").tHead.replaceChildren(heads);
    const body = found.slice(0, MOST_ROWS).map((one) => {
      const first = make("th", undefined, { scope: "row" });
      const go = make("button", one.test.name, { type: "button" });
      go.addEventListener("click", () => { page.setAll(one.test.x); picture(one); });
      first.append(go, one.inside ? "" : " (outside the fitted range)");
      return row("td", first, points.map((p) => (one.of[p] === null ? "–" : `${signed(span(p, one.of[p].residual), 3)}${one.of[p].inBand ? "" : " *"}`)));
    });
    body.push(row("td", make("th", "root mean square", { scope: "row" }), points.map((p) => span(p, rms[p]).toFixed(3))));
    byId("residuals").tBodies[0].replaceChildren(...body);
    byId("residuals").hidden = false;
    const cells = found.flatMap((one) => one.of).filter((cell) => cell !== null);
    const more = found.length > MOST_ROWS ? ` The first ${MOST_ROWS} are shown.` : "";
    byId("summary").textContent = `${read.name}: ${read.tests.length} conditions, ${cells.length} readings, ${cells.filter((cell) => cell.inBand).length} of them in their band.${more}`;
  }
  async function take(file) {
    if (!file) return;
    const text = await file.text();
    byId("wrong").hidden = true;
    read = null;
    picture(null);
    try {
      read = { name: file.name, tests: measured.table(text) };
      lay();
    } catch (error) {
      if (!(error instanceof measured.Wrong)) throw error;
      byId("residuals").hidden = true;
      byId("summary").textContent = "";
      byId("wrong").textContent = `${file.name}: ${error.message}`;
      byId("wrong").hidden = false;
    }
  }
  byId("file").addEventListener("change", (e) => take(e.target.files[0]));
  const over = (e, is) => { e.preventDefault(); byId("drop").classList.toggle("over", is); };
  document.addEventListener("dragover", (e) => over(e, true));
  document.addEventListener("dragleave", (e) => over(e, false));
  document.addEventListener("drop", (e) => { over(e, false); take(e.dataTransfer.files[0]); });
  return {
    lay,
    /* A test stays in the picture as long as its condition is set. */
    show() { if (pictured && pictured.test.x.some((value, i) => value !== page.x[i])) picture(null); },
  };
}
