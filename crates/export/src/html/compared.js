/* Conditions that are kept, beside the one that is set, and all of them as a table for other programs. */
function compared(s, page) {
  const { byId, make, short, spoken, units } = page;
  const MOST = 6;
  let kept = [];
  let cells = [];
  const verdict = (answer) => page.WORDS[answer.state];
  const named = (k) => `kept ${k + 1}`;

  /* Rows of the table: a name, a unit, its text for a condition, and the text of a change. */
  const rows = () => [
    ...page.dials.map((v, i) => ({ name: spoken(v.name), unit: units.name(v.unit), text: (one) => short(units.value(v.unit, one.at[i])), change: (now, one) => page.signed(units.span(v.unit, now.at[i] - one.at[i]), 3) })),
    { name: "verdict", unit: "", text: (one) => verdict(one.answer), change: () => "" },
    ...(s.limits.length > 0 ? [{ name: "all limits kept", unit: "", text: (one) => page.percent(one.answer.probability), change: () => "" }] : []),
    ...s.limits.map((limit, k) => {
      const own = page.limitOf(limit);
      const d = (one) => page.digits(own.margin(page.HALF * one.answer.limits[k].deviation));
      return { name: `margin of ${limit.name}`, unit: own.marginUnit, text: (one) => page.fixed(own.margin(one.answer.limits[k].margin), d(one)),
        change: (now, one) => page.signed(own.margin(now.answer.limits[k].margin - one.answer.limits[k].margin), 3) };
    }),
    ...s.points.map((p, k) => ({ name: p.name, unit: units.name(p.unit), text: (one) => page.fixed(units.value(p.unit, one.answer.values[k]), page.digits(page.half(one.answer, k))),
      change: (now, one) => page.signed(units.span(p.unit, now.answer.values[k] - one.answer.values[k]), 3) })),
  ];

  function lay() {
    const head = make("tr");
    head.append(make("th", "quantity", { scope: "col" }), make("th", "unit", { scope: "col" }), make("th", "set now", { scope: "col" }));
    kept.forEach((one, k) => {
      const cell = make("th", `${named(k)} `, { scope: "col" });
      const set = make("button", "set", { type: "button", ariaLabel: `set the condition ${named(k)}` });
      set.addEventListener("click", () => page.setAll(one.at));
      const forget = make("button", "forget", { type: "button", ariaLabel: `forget the condition ${named(k)}` });
      forget.addEventListener("click", () => { keep(kept.filter((_, other) => other !== k)); byId("keep").focus(); });
      cell.append(set, " ", forget);
      head.append(cell, make("th", "change", { scope: "col" }));
    });
    byId("compared").tHead.replaceChildren(head);
    cells = rows().map((row) => {
      const tr = make("tr");
      tr.append(make("th", row.name, { scope: "row" }), make("td", row.unit));
      const own = [make("td"), ...kept.flatMap(() => [make("td"), make("td")])];
      tr.append(...own);
      return { tr, own };
    });
    byId("compared").tBodies[0].replaceChildren(...cells.map(({ tr }) => tr));
    const last = kept[kept.length - 1];
    byId("kept").textContent = last ? `Kept ${kept.length}: ${page.wordsOf(last.at)}: ${verdict(last.answer).toLowerCase()}.` : "";
    byId("compared-whole").hidden = kept.length === 0;
    byId("forget").hidden = kept.length === 0;
    byId("keep").disabled = kept.length >= MOST;
  }

  function keep(all) {
    kept = all;
    lay();
    page.onKept(kept);
    page.show();
  }
  /* A condition with its answer: all variables, then the values of those that are followed. */
  function one(at) {
    const x = at.slice(0, s.variables.length);
    return { at, x, answer: page.answersAt(at.slice(x.length)).assess(x, page.confidence()) };
  }
  const here = () => page.dials.map((_, i) => page.at(i));
  byId("keep").addEventListener("click", () => keep([...kept, one(here())]));
  byId("forget").addEventListener("click", () => { keep([]); byId("keep").focus(); });

  /* A table with the columns of `coldplate query --csv`, the name of each condition before them. */
  function csv() {
    const cell = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : String(text));
    const head = ["test", ...s.variables.map((v) => `${v.name} [${v.unit}]`), ...s.held.map((h) => `${h.name} [${h.unit}]`),
      ...s.points.flatMap((p) => [`${p.name} [${p.unit}]`, `${p.name} low`, `${p.name} high`]), ...s.limits.map((limit) => `margin of ${limit.name}`),
      "probability", "verdict", "binding", "in_domain"];
    const heldAt = (at, h) => at[page.dials.findIndex((own, i) => i >= s.variables.length && own.name === h.name)] ?? h.value;
    const line = ({ at, x, answer }, name) => [name, ...x, ...s.held.map((h) => heldAt(at, h)),
      ...answer.values.flatMap((value, p) => [value, ...[-1, 1].map((way) => value + way * page.HALF * answer.bands[p].total)]),
      ...answer.limits.map((limit) => limit.margin), Number.isNaN(answer.probability) ? "" : answer.probability, answer.state,
      answer.binding < 0 ? "" : answer.limits[answer.binding].name, answer.inside];
    const all = [head, line(one(here()), "set now"), ...kept.map((own, k) => line(own, named(k)))];
    return all.map((own) => `${own.map(cell).join(",")}\n`).join("");
  }
  byId("csv").addEventListener("click", () => {
    const link = make("a", undefined, { href: URL.createObjectURL(new Blob([csv()], { type: "text/csv" })), download: "conditions.csv" });
    link.click();
    /* Some browsers begin to read when the click is over. */
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });

  page.link.add({
    write: (words) => kept.forEach(({ at }) => words.append("kept", at.map(page.written).join(" "))),
    read: (words) => {
      const read = words.getAll("kept").map((text) => text.split(" ").map(Number));
      keep(read.filter((at) => at.length === page.dials.length && at.every(Number.isFinite)).slice(0, MOST).map(one));
    },
  });
  lay();
  return {
    lay,
    show(answer) {
      const now = { at: here(), answer };
      if (kept.length > 0) {
        rows().forEach((row, r) => {
          const texts = [row.text(now), ...kept.flatMap((own) => [row.text(own), row.change(now, own)])];
          texts.forEach((text, k) => { cells[r].own[k].textContent = text; });
        });
      }
    },
    /* Another confidence is another verdict. */
    judge() { kept = kept.map(({ at }) => one(at)); },
  };
}
