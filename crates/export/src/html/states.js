/* The machine at conditions that were solved, as the file has it and with an explanation; `m` is what the page carries of both. */
(() => {
  const { byId, make, spoken, fixed, signed } = written();
  const m = JSON.parse(byId("scene").textContent);
  const { ticks } = drawing("");
  const page = { byId, make, spoken, fixed, signed, ticks, units: shownUnits() };
  const picture = machinePicture(coldplateScene(m), m, page);
  const states = m.states.map((own) => ({ ...own, fields: own.fields.map((text) => unpacked(text, Float32Array)) }));
  states.forEach((own, k) => byId("condition").append(make("option", own.name, { value: k })));
  m.names.forEach((name, k) => byId("which").append(make("option", name, { value: k })));
  byId("about").textContent = m.notes.join(" ");
  function show() {
    const { fields } = states[Number(byId("condition").value)];
    picture.changes(fields.slice(0, -1).map((field, k) => ({ name: m.names[k], field })));
    picture.show({ field: fields[Number(byId("which").value)], marks: m.marked, band: null });
  }
  for (const id of ["condition", "which"]) byId(id).addEventListener("change", show);
  /* The change by the explanation says where it acts. */
  byId("which").value = String(m.names.length - 1);
  show();
  if (m.names.length > 1) byId("quantity").value = "0";
  picture.redraw();
})();
