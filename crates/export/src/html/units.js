/* Units in which the page shows numbers: those of the file, or those that are usual in the United States. */
function shownUnits() {
  const LITRES = 1 / 3.785411784;
  const flow = (litres) => ({ name: "gpm", factor: LITRES * litres, offset: 0 });
  const US = {
    degC: { name: "°F", factor: 1.8, offset: 32 },
    "L/min": flow(1), "l/min": flow(1), "mL/min": flow(1e-3), "L/s": flow(60), "L/h": flow(1 / 60), "m3/h": flow(1e3 / 60), "m3/s": flow(6e4),
  };
  const SIGNS = { degC: "°C", um: "µm", 1: "" };
  let isUs = false;
  const of = (unit) => (isUs && US[unit]) || { name: SIGNS[unit] === undefined ? unit : SIGNS[unit], factor: 1, offset: 0 };
  return {
    use(name) { isUs = name === "us"; },
    system: () => (isUs ? "us" : "file"),
    name: (unit) => of(unit).name,
    value: (unit, own) => own * of(unit).factor + of(unit).offset,
    back: (unit, shown) => (shown - of(unit).offset) / of(unit).factor,
    /* Differences, bands and margins. */
    span: (unit, own) => own * of(unit).factor,
    spanName: (unit) => (unit === "degC" && !isUs ? "K" : of(unit).name),
  };
}
