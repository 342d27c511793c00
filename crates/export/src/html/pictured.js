/* The machine of a surrogate in the picture: at the condition that is set, at a time of its course, and less conditions that are kept. */
function picturedSurrogate(m, s, page) {
  const { byId } = page;
  const { field, selfTest } = coldplateField(m, s);
  const picture = machinePicture(coldplateScene(m), m, page);
  picture.linkTo(page.link);
  /* The steady state of the condition, the field at a time of its course if that is shown, and fields along it. */
  let steady = null;
  let moved = null;
  let course = [];
  const bandOf = (...errors) => page.HALF * Math.hypot(...errors);
  const fieldOf = ({ x, values, away }) => field(x, values, away);
  /* The course has the colours of its whole. */
  function show() {
    if (moved) picture.show({ ...steady, field: moved, band: bandOf(steady.widest, m.field.error, m.field.moving.error) }, course);
    else picture.show(steady);
  }
  const off = (own) => `off by ${own.error.toPrecision(2)} K (root mean square of the surface), by ${own.largest_error.toPrecision(2)} K at most`;
  const source = m.field.bound === undefined ? "solved conditions" : `conditions of a reduced model, whose own error is ${m.field.bound.toPrecision(2)} K at most`;
  const inTime = m.field.moving ? ` Over time the readings of the reduced model are off by ${m.field.moving.bound.toPrecision(2)} K at most, and a history predicted from ${m.field.moving.histories - 1} others is ${off(m.field.moving)}.` : "";
  const about = `Temperatures between the points are drawn from ${m.field.conditions} ${source}. A condition predicted from the others is ${off(m.field)}.${inTime} ${m.notes.join(" ")}`;
  page.onUnits.push(() => { if (steady) picture.redraw(); });
  return {
    selfTest,
    isMoving: Boolean(m.field.moving),
    lay: picture.lay,
    /* The machine at a condition, with the limit that binds if there is one. */
    show(x, answer, binding) {
      const widest = Math.max(0, ...s.points.map((p, k) => (p.unit === "degC" ? answer.bands[k].total : 0)));
      const marks = binding ? m.sensors.filter((own) => binding.points.includes(own.name)).map((own) => ({ ...own, name: binding.name })) : [];
      steady = { field: field(x, answer.values), marks, widest, band: page.isMoved() ? null : bandOf(widest, m.field.error) };
      byId("field").textContent = page.isMoved() ? `${about} Those conditions have the values that were held: at others the picture is a guess between the points.` : about;
      /* A course that is shown is computed anew, and then drawn. */
      if (!moved) show();
    },
    /* States along a course, which its colours hold for: conditions, steady values of the points, states less the steady ones. */
    span(states) { course = states.map(fieldOf); },
    /* The machine in a state of its course; nothing for the steady state. */
    along(state) {
      if (!state && !moved) return;
      moved = state && fieldOf(state);
      if (steady) show();
    },
    /* Conditions that are kept, each of which can be what a change is counted from. */
    keep(all) { picture.changes(all.map(({ x, answer }, k) => ({ name: `kept ${k + 1}`, field: field(x, answer.values) }))); },
  };
}
