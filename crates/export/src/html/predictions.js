/* One point over every variable, the others as set, with its band and its limits: `page` has the elements, the condition that is
   set and how it is set. Comes to a job for between the frames. */
function predictions(s, answers, page) {
  const { byId, make, spoken, short, units, named, shape, ticks } = page;
  const NODES = 40;
  const [WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [460, 270, 52, 20, 12, 44];
  s.points.forEach((p, k) => byId("of").append(make("option", p.name, { value: k })));
  byId("of").value = String(s.limits.length > 0 ? s.limits[0].points[0] : 0);
  byId("of").addEventListener("change", page.later);
  const places = s.variables.map((v, i) => {
    const svg = shape("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", class: "figure" });
    svg.addEventListener("click", (e) => {
      const box = svg.getBoundingClientRect();
      const share = (((e.clientX - box.left) / box.width) * WIDTH - LEFT) / (WIDTH - LEFT - RIGHT);
      page.set(i, v.low + (v.high - v.low) * Math.min(1, Math.max(0, share)));
    });
    byId("predictions").append(svg);
    return svg;
  });

  /* What limits a point at a condition, if it alone is limited. */
  const levels = (p, at) => s.limits.flatMap((limit) => (limit.points.length === 1 && limit.points[0] === p ? [limit.maximum + (limit.kind === "rise" ? at[limit.variable] : 0)] : []));

  function draw(i, p, found, [low, high], own) {
    const v = s.variables[i];
    const unit = units.name(s.points[p].unit);
    const ends = [v.low, v.high].map((end) => units.value(v.unit, end));
    const across = (value) => LEFT + ((WIDTH - LEFT - RIGHT) * (value - ends[0])) / (ends[1] - ends[0]);
    const up = (value) => TOP + ((HEIGHT - TOP - BOTTOM) * (high - Math.min(high, Math.max(low, value)))) / (high - low);
    const line = (of) => found.map((one, k) => `${k === 0 ? "M" : "L"}${across(one.at).toFixed(1)} ${up(of(one)).toFixed(1)}`).join("");
    const shapes = [shape("title", {}, `${s.points[p].name} over ${spoken(v.name)}, the rest as set: ${short(found[0].value)} to ${short(found[NODES].value)} ${unit}`)];
    const [x, y] = [ticks(...ends), ticks(low, high)];
    for (const value of x.list) {
      shapes.push(shape("line", { x1: across(value), x2: across(value), y1: TOP, y2: HEIGHT - BOTTOM, class: "grid" }));
      shapes.push(shape("text", { x: across(value), y: HEIGHT - BOTTOM + 17, "text-anchor": "middle" }, value.toFixed(x.digits)));
    }
    for (const value of y.list) {
      shapes.push(shape("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: up(value), y2: up(value), class: "grid" }));
      shapes.push(shape("text", { x: LEFT - 7, y: up(value) + 4, "text-anchor": "end" }, value.toFixed(y.digits)));
    }
    const back = found.slice().reverse().map((one) => `L${across(one.at).toFixed(1)} ${up(one.value - one.half).toFixed(1)}`).join("");
    shapes.push(shape("path", { d: `${line((one) => one.value + one.half)}${back}Z`, class: "band" }));
    found[0].levels.forEach((_, k) => shapes.push(shape("path", { d: line((one) => one.levels[k]), class: "limit" })));
    shapes.push(shape("path", { d: line((one) => one.value), class: "curve" }));
    shapes.push(shape("rect", { x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM, class: "frame" }));
    if (page.x[i] >= v.low && page.x[i] <= v.high) shapes.push(shape("circle", { cx: across(units.value(v.unit, page.x[i])), cy: up(own), r: 5, class: "here" }));
    shapes.push(shape("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 6, "text-anchor": "middle" }, named(v)));
    shapes.push(shape("text", { x: 13, y: (TOP + HEIGHT - BOTTOM) / 2, "text-anchor": "middle", transform: `rotate(-90 13 ${(TOP + HEIGHT - BOTTOM) / 2})` }, unit));
    places[i].replaceChildren(...shapes);
  }

  return function* job() {
    const p = Number(byId("of").value);
    const courses = [];
    for (const [i, v] of s.variables.entries()) {
      const course = [];
      for (let k = 0; k <= NODES; k += 1) {
        const at = page.x.slice();
        at[i] = v.low + ((v.high - v.low) * k) / NODES;
        const answer = answers.assess(at, page.confidence());
        const shown = (value) => units.value(s.points[p].unit, value);
        course.push({ at: units.value(v.unit, at[i]), value: shown(answer.values[p]), half: page.half(answer, p), levels: levels(p, at).map(shown) });
        yield;
      }
      courses.push(course);
    }
    /* One range up for all, so that they can be compared; a limit far above leaves the curves their room. */
    const all = courses.flat().flatMap((one) => [one.value - one.half, one.value + one.half]);
    const [least, most] = [Math.min(...all), Math.max(...all)];
    const near = courses.flat().flatMap((one) => one.levels).filter((level) => level >= least && level <= most + (most - least));
    const high = Math.max(most, ...near);
    const margin = Math.max(0.04 * (high - least), 1e-6);
    const own = units.value(s.points[p].unit, answers.assess(page.x, page.confidence()).values[p]);
    courses.forEach((course, i) => draw(i, p, course, [least - margin, high + margin], own));
  };
}
