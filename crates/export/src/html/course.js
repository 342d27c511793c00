/* A run through stages from a state of the machine. Each stage goes from one condition straight to another until a time, s; `motion`
   is what coldplateInTime(s, answers) gives. While a condition moves, each step holds that of its middle, as `coldplate simulate`
   does. Goes on between the frames of a page; comes to the samples, when limits are broken first, and when all has settled. */
function* follow(s, motion, answers, stages, begin, count) {
  /* Steps of a stage in which the condition moves, at least. */
  const MOVED = 32;
  const sample = (time, state, x, at) => {
    const values = motion.read(state, at);
    return { time, state, x, at, values, limited: s.limits.map((limit) => answers.limitedValue(limit, x, values)) };
  };
  const duration = stages[stages.length - 1].until;
  const samples = [sample(0, begin, stages[0].from, motion.here(stages[0].from))];
  for (const { from, to, until } of stages) {
    const begun = samples[samples.length - 1].time;
    const held = from.every((value, i) => value === to[i]) ? motion.here(to) : null;
    const steps = Math.max(held ? 1 : MOVED, Math.round((count * (until - begun)) / duration));
    const length = (until - begun) / steps;
    for (let k = 1; k <= steps; k += 1) {
      const x = (share) => (held ? to : from.map((value, i) => value + ((to[i] - value) * share) / steps));
      const middle = { x: x(k - 0.5), at: held || motion.here(x(k - 0.5)) };
      const state = motion.step(samples[samples.length - 1].state, length, middle.at);
      samples.push({ ...sample(begun + ((until - begun) * k) / steps, state, x(k), held || motion.here(x(k))), middle });
      yield;
    }
  }
  /* The moment between two samples from which on something holds. */
  const since = (k, holds) => {
    if (k === 0) return 0;
    const { x, at } = samples[k].middle;
    let [early, late] = [0, samples[k].time - samples[k - 1].time];
    for (let n = 0; n < 40; n += 1) {
      const middle = 0.5 * (early + late);
      if (holds(sample(0, motion.step(samples[k - 1].state, middle, at), x, at))) late = middle; else early = middle;
    }
    return samples[k - 1].time + late;
  };
  const broken = s.limits.map((limit, l) => {
    const is = (one) => one.limited[l] > limit.maximum;
    const k = samples.findIndex(is);
    return k < 0 ? null : since(k, is);
  });
  const end = samples[samples.length - 1].at;
  const near = end.values.map((steady, p) => Math.max(0.05 * Math.abs(samples[0].values[p] - steady), s.in_time.errors[p]));
  const isSettled = (one) => one.values.every((value, p) => Math.abs(value - end.values[p]) <= near[p]);
  let k = samples.length;
  while (k > 0 && isSettled(samples[k - 1])) k -= 1;
  return { samples, broken, settled: k === samples.length ? null : since(k, isSettled) };
}

/* What "Over time" shows: `page` has the elements, the condition that is set, and how names and numbers are written. */
function course(s, answers, motion, page) {
  const { byId, make, short, later, units, shape, ticks } = page;
  const SAMPLES = 200;
  const COLOURS = ["var(--blue)", "#e69f00", "#009e73", "var(--ink)", "#d55e00", "#56b4e9", "#cc79a7"];
  const DASHES = ["", "9 5", "10 4 2 4", "2 4", "5 3"];
  const MOST = 10;
  const speed = s.variables.findIndex((v) => v.name === "motor_speed");
  const ambient = s.variables.findIndex((v) => v.name === "ambient_temperature");
  const heldAmbient = s.held.find((h) => h.name === "ambient_temperature");
  let own = null;
  let kept = null;

  const spell = (seconds) => {
    const [unit, size] = seconds <= 300 ? ["s", 1] : seconds <= 10800 ? ["min", 60] : seconds <= 345600 ? ["h", 3600] : ["d", 86400];
    return { unit, size, text: `${Number((seconds / size).toPrecision(3))} ${unit}` };
  };
  const duration = () => 60 * 10 ** (Number(byId("duration").value) / 100);
  const initial = () => (own === null ? (ambient >= 0 ? page.x[ambient] : heldAmbient ? heldAmbient.value : 20) : own);
  const begin = () => (byId("begin").value === "kept" && kept ? motion.atRest(kept) : motion.atTemperature(initial()));

  /* Minutes of a field, in seconds; nothing where it is empty. */
  const minutes = (id) => (byId(id).value === "" || !(Number(byId(id).value) >= 0) ? null : 60 * Number(byId(id).value));
  const slowest = (x) => x.map((value, i) => (i === speed ? s.variables[i].low : value));
  /* Where a ramp begins: at the condition of the beginning, or at the lowest motor speed of the fitted range. */
  const rampedFrom = (x) => (byId("begin").value === "kept" && kept ? kept : slowest(x));
  function stages(x) {
    const total = duration();
    const ramp = Math.min(total, minutes("ramped") || 0);
    const stop = minutes("stopped") === null ? total : Math.min(total, Math.max(ramp, minutes("stopped")));
    const all = [{ from: rampedFrom(x), to: x, until: ramp }, { from: x, to: x, until: stop }, { from: slowest(x), to: slowest(x), until: total }];
    return all.filter(({ until }, k) => until > (k === 0 ? 0 : all[k - 1].until));
  }
  function tellStages() {
    const words = [];
    const lowest = speed < 0 ? "" : `${short(units.value(s.variables[speed].unit, s.variables[speed].low))} ${units.name(s.variables[speed].unit)}`;
    const isAtStop = speed >= 0 && s.variables[speed].low === 0;
    if (minutes("ramped") > 0) words.push(byId("begin").value === "kept" && kept ? "The ramp begins at the condition of the beginning." : `The ramp begins at a motor speed of ${lowest}, the lowest fitted.`);
    if (minutes("stopped") !== null && !isAtStop) words.push(`Stopped stands for ${lowest}: below, the file knows nothing.`);
    if (speed < 0) words.push("The motor speed was held: the file knows neither a ramp from one temperature nor a stop.");
    byId("stages").textContent = words.join(" ");
  }
  if (speed < 0) byId("stopped").disabled = true;
  for (const id of ["ramped", "stopped"]) byId(id).addEventListener("change", later);
  byId("initial").addEventListener("change", () => {
    const value = byId("initial").value;
    own = value !== "" && Number.isFinite(Number(value)) ? units.back("degC", Number(value)) : null;
    later();
  });
  byId("begin").addEventListener("change", later);
  byId("duration").addEventListener("input", later);
  function beginAt(condition) {
    kept = condition;
    byId("begun").textContent = kept ? `Begins in the steady state of ${page.wordsOf(kept)}.` : "";
  }
  byId("begin-here").addEventListener("click", () => {
    beginAt(page.x.slice());
    byId("begin").value = "kept";
    later();
  });

  /* Labels that end at some height, each as near to it as the others let it. */
  function apart(labels, top, bottom) {
    const gap = Math.min(15, (bottom - top) / Math.max(1, labels.length - 1));
    const list = labels.slice().sort((a, b) => a.end - b.end).map((label) => ({ ...label, y: Math.max(label.end, top) }));
    for (let k = 1; k < list.length; k += 1) list[k].y = Math.max(list[k].y, list[k - 1].y + gap);
    for (let k = list.length - 1; k >= 0; k -= 1) list[k].y = Math.min(list[k].y, k === list.length - 1 ? bottom : list[k + 1].y - gap);
    return list;
  }

  const [LEFT, RIGHT, TOP, BOTTOM] = [64, 160, 16, 46];
  /* Curves of some points of one unit; `at` of the figure moves the line of a time. */
  function draw(unit, points, found, [WIDTH, HEIGHT] = [960, 420]) {
    const last = found.samples[found.samples.length - 1];
    const { unit: timeUnit, size } = spell(last.time);
    const lines = s.limits.flatMap((limit) => {
      if (limit.points.length !== 1 || !points.includes(limit.points[0])) return [];
      return [{ name: limit.name, level: units.value(unit, limit.maximum + (limit.kind === "rise" ? page.x[limit.variable] : 0)) }];
    });
    const shown = (one, p) => units.value(unit, one.values[p]);
    const all = found.samples.flatMap((one) => points.map((p) => shown(one, p)));
    let [low, high] = [Math.min(...all), Math.max(...all)];
    const span = high - low;
    /* A limit far above leaves the curves their room. */
    const near = lines.filter((line) => line.level >= low - span && line.level <= high + 1.5 * span);
    for (const line of near) [low, high] = [Math.min(low, line.level), Math.max(high, line.level)];
    const margin = Math.max(0.05 * (high - low), 1e-6);
    [low, high] = [low - margin, high + margin];
    const across = (time) => LEFT + ((WIDTH - LEFT - RIGHT) * time) / last.time;
    const up = (value) => TOP + ((HEIGHT - TOP - BOTTOM) * (high - value)) / (high - low);
    const svg = shape("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", class: "figure" });
    svg.append(shape("title", {}, `${points.map((p) => s.points[p].name).join(", ")} over ${spell(last.time).text}`));
    const x = ticks(0, last.time / size);
    for (const value of x.list) {
      const place = across(value * size);
      svg.append(shape("line", { x1: place, x2: place, y1: TOP, y2: HEIGHT - BOTTOM, class: "grid" }));
      svg.append(shape("text", { x: place, y: HEIGHT - BOTTOM + 18, "text-anchor": "middle" }, value.toFixed(x.digits)));
    }
    const y = ticks(low, high);
    for (const value of y.list) {
      svg.append(shape("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: up(value), y2: up(value), class: "grid" }));
      svg.append(shape("text", { x: LEFT - 8, y: up(value) + 4, "text-anchor": "end" }, value.toFixed(y.digits)));
    }
    svg.append(shape("rect", { x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM, class: "frame" }));
    svg.append(shape("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 8, "text-anchor": "middle" }, `time [${timeUnit}]`));
    const middle = (TOP + HEIGHT - BOTTOM) / 2;
    svg.append(shape("text", { x: 16, y: middle, "text-anchor": "middle", transform: `rotate(-90 16 ${middle})` }, units.name(unit)));
    /* Names stand where lines and curves end, apart from each other: what is written there is crossed by nothing. */
    const labels = [];
    for (const line of near) {
      svg.append(shape("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: up(line.level), y2: up(line.level), class: "limit" }));
      labels.push({ name: line.name, end: up(line.level), class: "limit" });
    }
    /* Those that move most have a colour and a name. */
    const reach = (p) => Math.abs(found.samples[0].values[p] - last.values[p]);
    const coloured = points.slice().sort((a, b) => reach(b) - reach(a)).slice(0, MOST);
    points.forEach((p) => {
      const place = points.indexOf(p);
      const has = coloured.includes(p);
      const stroke = has ? COLOURS[place % COLOURS.length] : "var(--line)";
      const path = found.samples.map((one, k) => `${k === 0 ? "M" : "L"}${across(one.time).toFixed(1)} ${up(shown(one, p)).toFixed(1)}`).join("");
      svg.append(shape("path", { d: path, class: "curve", style: `stroke: ${stroke}`, "stroke-dasharray": has ? DASHES[place % DASHES.length] : "" }));
      if (has) labels.push({ name: s.points[p].name, end: up(shown(last, p)), colour: stroke });
    });
    for (const label of apart(labels, TOP + 6, HEIGHT - BOTTOM)) {
      const edge = WIDTH - RIGHT;
      const colour = label.colour || "var(--not_acceptable)";
      svg.append(shape("line", { x1: edge, x2: edge + 10, y1: label.end, y2: label.y, class: "leader", style: `stroke: ${colour}` }));
      const written = label.name.length > 20 ? `${label.name.slice(0, 19)}…` : label.name;
      const text = shape("text", { x: edge + 13, y: label.y + 4, class: label.class || "", style: label.class ? "" : `fill: ${colour}` }, written);
      if (label.name.length > 20) text.append(shape("title", {}, label.name));
      svg.append(text);
    }
    const line = shape("line", { y1: TOP, y2: HEIGHT - BOTTOM, class: "now" });
    const at = (time) => {
      line.setAttribute("x1", across(time));
      line.setAttribute("x2", across(time));
      svg.append(line);
    };
    return { svg, at };
  }

  function show(found) {
    const units = [...new Set(s.points.map((p) => p.unit))];
    byId("pictures").replaceChildren(...units.map((unit) => draw(unit, s.points.map((_, p) => p).filter((p) => s.points[p].unit === unit), found).svg));
    byId("reached").tBodies[0].replaceChildren(...s.limits.map((limit, l) => {
      const row = make("tr");
      const most = found.samples.reduce((best, one) => (one.limited[l] > best.limited[l] ? one : best));
      const shown = page.limitOf(limit);
      const when = found.broken[l] === null ? "kept" : found.broken[l] === 0 ? "from the beginning" : `after ${spell(found.broken[l]).text}`;
      const texts = [limit.name, `${shown.value(most.limited[l]).toFixed(2)} ${shown.unit}`, `at ${spell(most.time).text}`, short(shown.value(limit.maximum)), when];
      row.append(...texts.map((text) => make("td", text)));
      return row;
    }));
    const broken = found.broken.map((time, l) => ({ time, l })).filter((one) => one.time !== null).sort((a, b) => a.time - b.time);
    const first = broken.length === 0 ? "No limit is broken." : `'${s.limits[broken[0].l].name}' is broken ${broken[0].time === 0 ? "from the beginning" : `after ${spell(broken[0].time).text}`}.`;
    byId("when").textContent = `${s.limits.length > 0 ? `${first} ` : ""}${found.settled === null ? "Not settled by then." : `Settled after ${spell(found.settled).text}.`}`;
  }

  function* job() {
    const text = spell(duration()).text;
    byId("lasts").textContent = text;
    byId("duration").setAttribute("aria-valuetext", text);
    if (document.activeElement !== byId("initial")) byId("initial").value = short(units.value("degC", initial()));
    byId("initial-unit").textContent = units.name("degC");
    tellStages();
    yield;
    const found = yield* follow(s, motion, answers, stages(page.x.slice()), begin(), SAMPLES);
    show(found);
    page.onCourse(found);
  }

  /* As long as everything takes to settle, and a quarter more. */
  const at = motion.here(page.x);
  let [state, time, length] = [motion.atTemperature(initial()), 0, 60];
  const start = motion.read(state, at);
  const near = at.values.map((steady, p) => Math.max(0.05 * Math.abs(start[p] - steady), s.in_time.errors[p]));
  while (time < 1e6 && motion.read(state, at).some((value, p) => Math.abs(value - at.values[p]) > near[p])) {
    state = motion.step(state, length, at);
    [time, length] = [time + length, length * 1.2];
  }
  byId("duration").value = String(Math.min(420, Math.max(0, Math.round(100 * Math.log10((1.25 * time) / 60)))));
  byId("course").hidden = false;
  for (const id of ["begin", "duration", "ramped", "stopped"]) page.link.control(id);
  page.link.add({
    write: (words) => { if (own !== null) words.set("initial", page.written(own)); if (kept) words.set("from", kept.map(page.written).join(" ")); },
    read: (words) => {
      const value = words.get("initial");
      own = value !== null && value !== "" && Number.isFinite(Number(value)) ? Number(value) : null;
      const from = (words.get("from") || "").split(" ").map(Number);
      beginAt(words.has("from") && from.length === s.variables.length && from.every(Number.isFinite) ? from : null);
    },
  });
  return { job, draw, spell };
}
