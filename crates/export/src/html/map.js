/* Verdicts over two variables, the rest as set: `page` has the elements, the condition that is set and how it is set. Comes to a
   job for between the frames. */
function verdictMap(s, answers, page) {
  const { byId, short, spoken, named, percent, units, limitOf, confidence, x, set, ticks, WORDS } = page;
  const canvas = byId("map");
  const NODES = 48;
  const [LEFT, RIGHT, TOP, BOTTOM] = [58, 22, 10, 46];
  /* Of the circle about the condition that is set, pixels. */
  const RADIUS = 7;
  function place() {
    const [i, j] = [Number(byId("across").value), Number(byId("up").value)];
    return { i, j, a: s.variables[i], b: s.variables[j] };
  }
  /* Between the axes of the map, in pixels of the page. */
  const frame = () => ({ w: canvas.clientWidth - LEFT - RIGHT, h: canvas.clientHeight - TOP - BOTTOM });
  /* A number that is linear in a margin where its limit alone counts: the normal deviate of the probability that all are kept. */
  const deviate = (p) => {
    let [low, high] = [-8, 8];
    for (let k = 0; k < 30; k += 1) { const middle = 0.5 * (low + high); if (answers.below(middle) < p) low = middle; else high = middle; }
    return 0.5 * (low + high);
  };
  function* job() {
    const { i, j, a, b } = place();
    const scale = Math.min(2, window.devicePixelRatio || 1);
    const { w, h } = frame();
    if (w <= 0 || h <= 0) return;
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(`--${name}`).trim();
    /* At the nodes: how surely all limits are kept, and which one binds. Between them the deviate is linear. */
    const nodes = [];
    for (let row = 0; row <= NODES; row += 1) {
      for (let column = 0; column <= NODES; column += 1) {
        const at = x.slice();
        at[j] = b.low + ((b.high - b.low) * row) / NODES;
        at[i] = a.low + ((a.high - a.low) * column) / NODES;
        const answer = answers.assess(at, confidence());
        nodes.push({ z: Number.isNaN(answer.probability) || !answer.inside ? NaN : deviate(answer.probability), binding: answer.binding });
      }
      yield;
    }
    const sure = deviate(confidence());
    const [width, height] = [Math.round(w * scale), Math.round(h * scale)];
    const tints = ["acceptable", "uncertain", "not_acceptable"].map((name) => {
      const probe = document.createElement("canvas").getContext("2d");
      probe.fillStyle = colour(name);
      probe.fillRect(0, 0, 1, 1);
      return probe.getImageData(0, 0, 1, 1).data;
    });
    const image = new ImageData(width, height);
    const at = (column, row) => nodes[row * (NODES + 1) + column].z;
    for (let py = 0; py < height; py += 1) {
      const v = (1 - (py + 0.5) / height) * NODES;
      const row = Math.min(NODES - 1, Math.floor(v));
      let before = NaN;
      for (let px = 0; px < width; px += 1) {
        const u = ((px + 0.5) / width) * NODES;
        const column = Math.min(NODES - 1, Math.floor(u));
        const [du, dv] = [u - column, v - row];
        const z = (1 - dv) * ((1 - du) * at(column, row) + du * at(column + 1, row)) + dv * ((1 - du) * at(column, row + 1) + du * at(column + 1, row + 1));
        const tint = tints[z >= sure ? 0 : z <= -sure ? 2 : 1];
        const is_even = (z > 0) !== (before > 0) && !Number.isNaN(before);
        for (let k = 0; k < 4; k += 1) image.data[4 * (py * width + px) + k] = is_even && k < 3 ? 0.5 * tint[k] : tint[k];
        before = z;
      }
      if (py % 32 === 0) yield;
    }
    [canvas.width, canvas.height] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
    const g = canvas.getContext("2d");
    g.putImageData(image, Math.round(LEFT * scale), Math.round(TOP * scale));
    g.scale(scale, scale);
    [g.font, g.fillStyle, g.strokeStyle] = ["13px Arimo, Arial, 'Liberation Sans', Helvetica, sans-serif", colour("ink"), colour("muted")];
    g.strokeRect(LEFT, TOP, w, h);
    const across = (value) => LEFT + ((value - a.low) / (a.high - a.low)) * w;
    const up = (value) => TOP + (1 - (value - b.low) / (b.high - b.low)) * h;
    const labels = (v) => {
      const { list, digits: d } = ticks(units.value(v.unit, v.low), units.value(v.unit, v.high));
      return list.map((shown) => [units.back(v.unit, shown), d > 4 ? short(shown) : shown.toFixed(d)]);
    };
    g.textAlign = "center";
    for (const [value, text] of labels(a)) { g.fillRect(across(value), TOP + h, 1, 5); g.fillText(text, across(value), TOP + h + 18); }
    g.fillText(named(a), LEFT + w / 2, TOP + h + 38);
    g.textAlign = "right";
    for (const [value, text] of labels(b)) { g.fillRect(LEFT - 5, up(value), 5, 1); g.fillText(text, LEFT - 8, up(value) + 4); }
    /* The limit that binds, where it does. */
    g.textAlign = "center";
    s.limits.forEach((limit, k) => {
      const own = nodes.flatMap((node, n) => (node.binding === k ? [[n % (NODES + 1), Math.floor(n / (NODES + 1))]] : []));
      if (own.length < 0.02 * nodes.length) return;
      const mean = [0, 1].map((d) => own.reduce((sum, node) => sum + node[d], 0) / own.length);
      const half = 0.5 * g.measureText(limit.name).width + 3;
      const middle = ([column, row]) => [Math.min(LEFT + w - half, Math.max(LEFT + half, LEFT + (column / NODES) * w)), Math.min(TOP + h - 6, TOP + (1 - row / NODES) * h + 4)];
      /* The circle of the condition that is set stays free. */
      const isClear = (node) => { const [px, py] = middle(node); return Math.abs(px - across(x[i])) > half + RADIUS + 2 || Math.abs(py - 4 - up(x[j])) > RADIUS + 10; };
      const clear = own.filter(isClear);
      const apart = (node) => Math.hypot(node[0] - mean[0], node[1] - mean[1]);
      const best = (clear.length > 0 ? clear : own).reduce((best, node) => (apart(node) < apart(best) ? node : best));
      g.fillText(limit.name, ...middle(best));
    });
    g.beginPath();
    g.arc(across(x[i]), up(x[j]), RADIUS, 0, 2 * Math.PI);
    [g.lineWidth, g.strokeStyle] = [3, colour("ink")];
    if (x[i] >= a.low && x[i] <= a.high && x[j] >= b.low && x[j] <= b.high) g.stroke();
    byId("ends").textContent = `Up: ${named(b)}. Names: the limit that binds there. Dark line: as likely kept as broken.`;
  }
  /* The condition under a place of the map. */
  function under(e) {
    const { a, b } = place();
    const box = canvas.getBoundingClientRect();
    const { w, h } = frame();
    const share = (value) => Math.min(1, Math.max(0, value));
    return [a.low + (a.high - a.low) * share((e.clientX - box.left - LEFT) / w), b.low + (b.high - b.low) * share(1 - (e.clientY - box.top - TOP) / h)];
  }
  canvas.addEventListener("pointermove", (e) => {
    const { i, j, a, b } = place();
    const [value, other] = under(e);
    const at = x.slice();
    [at[j], at[i]] = [other, value];
    const answer = answers.assess(at, confidence());
    const binding = answer.limits[answer.binding];
    const shown = binding && limitOf(s.limits[answer.binding]);
    const margin = binding ? `, '${binding.name}' ${shown.margin(Math.abs(binding.margin)).toFixed(2)} ${shown.marginUnit} ${binding.margin < 0 ? "above" : "below"}, kept with ${percent(answer.probability)}` : "";
    byId("there").textContent = `${spoken(a.name)} ${short(units.value(a.unit, value))}, ${spoken(b.name)} ${short(units.value(b.unit, other))}: ${WORDS[answer.state].toLowerCase()}${margin}`;
  });
  canvas.addEventListener("pointerleave", () => { byId("there").textContent = ""; });
  canvas.addEventListener("click", (e) => {
    const { i, j } = place();
    const [value, other] = under(e);
    x[j] = other;
    set(j, other);
    if (i !== j) set(i, value);
  });
  canvas.addEventListener("keydown", (e) => {
    const { i, j } = place();
    const [variable, way] = { ArrowRight: [i, 1], ArrowLeft: [i, -1], ArrowUp: [j, 1], ArrowDown: [j, -1] }[e.key] || [];
    if (variable === undefined) return;
    e.preventDefault();
    const v = s.variables[variable];
    set(variable, Math.min(v.high, Math.max(v.low, x[variable] + (way * (v.high - v.low)) / NODES)));
  });
  return job;
}
