/* The machine in three dimensions, coloured by temperature: turned, cut and taken apart, and asked under the pointer. `scene` is what
   coldplateScene(m) gives; `page` has the elements of the page, how names and numbers are written, and what is told when the picture
   has changed. */
function machinePicture(scene, m, page) {
  const { byId, make, spoken, units, signed } = page;
  const { box, dot, cross, minus } = scene;
  const canvas = byId("machine");
  const signs = byId("signs");
  /* From a blue on which shade and edges are still seen; each next one is lighter. */
  const RAMP = [[66, 62, 172], [122, 58, 184], [172, 58, 166], [214, 84, 128], [242, 131, 84], [253, 185, 58], [242, 245, 82]];
  const DIFFERENCE = [[0, 80, 150], [86, 160, 210], [190, 218, 236], [244, 244, 244], [248, 206, 170], [226, 126, 66], [150, 50, 0]];
  const AXES = ["x", "y", "z"];
  /* Readings that are named in the picture, a count. */
  const NAMED = 6;
  const center = box.map(([low, high]) => 0.5 * (low + high));
  const radius = Math.max(0.5 * Math.hypot(...box.map(([low, high]) => high - low)), 1e-6);
  const VIEWS = { corner: [-55, 30], front: [-90, 0], side: [0, 0], top: [-90, 89.9] };
  const shown = m.parts.map(() => true);
  const eye = { yaw: 0, pitch: 0, zoom: 1, right: 0, up: 0 };
  let now = null;
  /* Fields that a change can be counted from, with their names. */
  let bases = [];
  let laid = null;
  let plane = null;
  let range = [0, 1];
  /* Fields that the colours hold for beside the one that is seen, and whether the range is theirs. */
  let beside = [];
  let is_ranged = false;
  let is_fixed = false;

  const colour = (t, ramp) => {
    const at = Math.min(1, Math.max(0, t)) * (ramp.length - 1);
    const i = Math.min(ramp.length - 2, Math.floor(at));
    return ramp[i].map((a, k) => Math.round(a + (at - i) * (ramp[i + 1][k] - a)));
  };

  const pipes = scene.pipes();

  /* Everything in one list of vertices: the surface, then the pipes. */
  const pipeStart = [];
  let total = scene.count;
  for (const pipe of pipes) { pipeStart.push(total); total += pipe.places.length / 3; }
  const positions = new Float32Array(3 * total);
  const normals = new Float32Array(3 * total);
  const source = new Uint32Array(total);
  positions.set(scene.positions);
  normals.set(scene.normals);
  for (let i = 0; i < scene.count; i += 1) source[i] = i;
  const faces = [...scene.triangles];
  const pipeFaces = pipes.map((pipe, k) => {
    positions.set(pipe.places, 3 * pipeStart[k]);
    normals.set(pipe.normals, 3 * pipeStart[k]);
    source.set(pipe.stations, pipeStart[k]);
    const first = faces.length / 3;
    for (const face of pipe.faces) faces.push(...face.map((i) => i + pipeStart[k]));
    return { first, count: pipe.faces.length, part: pipe.part };
  });
  const values = new Float32Array(total);

  function axes() {
    const [yaw, pitch] = [(eye.yaw * Math.PI) / 180, (eye.pitch * Math.PI) / 180];
    const toward = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    return { right, up: cross(toward, right), toward };
  }
  /* Direction of the light, from over the right shoulder. */
  function light() {
    const { right, up, toward } = axes();
    const from = toward.map((x, d) => 0.8 * x + 0.25 * right[d] + 0.5 * up[d]);
    return from.map((x) => x / Math.hypot(...from));
  }
  /* From the machine to the picture, -1 to 1 each; z rises away from the eye. */
  function projection() {
    const { right, up, toward } = axes();
    const wide = canvas.clientWidth / Math.max(1, canvas.clientHeight);
    const scale = eye.zoom / radius;
    const [x, y] = wide > 1 ? [scale / wide, scale] : [scale, scale * wide];
    const row = (axis, by, shift) => [...axis.map((a) => a * by), -dot(axis, center) * by + shift];
    return [row(right, x, eye.right), row(up, y, eye.up), row(toward, -0.25 / radius / Math.max(1, eye.zoom) , 0)];
  }
  const placed = (rows, at) => rows.map((row) => row[0] * at[0] + row[1] * at[1] + row[2] * at[2] + row[3]);

  const painter = webgl() || flat();

  function webgl() {
    const gl = canvas.getContext("webgl", { antialias: false });
    if (!gl || (total > 65535 && !gl.getExtension("OES_element_index_uint"))) return null;
    const buffer = (kind, data, usage) => { const own = gl.createBuffer(); gl.bindBuffer(kind, own); gl.bufferData(kind, data, usage); return own; };
    const colours = new Uint8Array(4 * total);
    const attributes = [["place", 3, gl.FLOAT, buffer(gl.ARRAY_BUFFER, positions, gl.STATIC_DRAW)], ["normal", 3, gl.FLOAT, buffer(gl.ARRAY_BUFFER, normals, gl.STATIC_DRAW)],
      ["tint", 4, gl.UNSIGNED_BYTE, buffer(gl.ARRAY_BUFFER, colours, gl.DYNAMIC_DRAW)]];
    /* A section discards fragments, which costs every picture that has none: it has a program of its own. */
    const programs = ["", "if (dot(plane.xyz, at) > plane.w) discard; if (!gl_FrontFacing) shade *= 0.72;"].map((section) => {
      const program = gl.createProgram();
      const shader = (kind, text) => { const own = gl.createShader(kind); gl.shaderSource(own, text); gl.compileShader(own); gl.attachShader(program, own); };
      shader(gl.VERTEX_SHADER, `attribute vec3 place; attribute vec3 normal; attribute vec4 tint; uniform vec4 rows[3]; uniform vec3 light;
        varying vec3 at; varying vec3 colour;
        void main() { vec4 p = vec4(place, 1.0); at = place; colour = tint.rgb * (0.6 + 0.4 * abs(dot(normal, light)));
          gl_Position = vec4(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p), 1.0); }`);
      shader(gl.FRAGMENT_SHADER, `precision mediump float; uniform vec4 plane; uniform float alpha; uniform float ink; varying vec3 at; varying vec3 colour;
        void main() { float shade = 1.0; ${section}
          gl_FragColor = vec4(colour * shade * ink, alpha); }`);
      attributes.forEach(([name], slot) => gl.bindAttribLocation(program, slot, name));
      gl.linkProgram(program);
      return gl.getProgramParameter(program, gl.LINK_STATUS) ? program : null;
    });
    if (programs.includes(null)) return null;
    attributes.forEach(([, size, kind, own], slot) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, own);
      gl.enableVertexAttribArray(slot);
      gl.vertexAttribPointer(slot, size, kind, kind === gl.UNSIGNED_BYTE, 0, 0);
    });
    const [Kind, kind] = total > 65535 ? [Uint32Array, gl.UNSIGNED_INT] : [Uint16Array, gl.UNSIGNED_SHORT];
    const bytes = Kind.BYTES_PER_ELEMENT;
    const triangles = buffer(gl.ELEMENT_ARRAY_BUFFER, Kind.from(faces), gl.STATIC_DRAW);
    const lines = buffer(gl.ELEMENT_ARRAY_BUFFER, Kind.from(scene.edges), gl.STATIC_DRAW);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    return {
      fill(ramp) {
        const table = Array.from({ length: 256 }, (_, k) => colour(k / 255, ramp));
        for (let i = 0; i < total; i += 1) {
          const own = table[Math.min(255, Math.max(0, Math.round((255 * (values[i] - range[0])) / (range[1] - range[0])))) || 0];
          for (let k = 0; k < 3; k += 1) colours[4 * i + k] = own[k];
        }
        gl.bindBuffer(gl.ARRAY_BUFFER, attributes[2][3]);
        gl.bufferSubData(gl.ARRAY_BUFFER, 0, colours);
      },
      paint(rows, ramp, is_clear) {
        const program = programs[plane ? 1 : 0];
        const place = (name) => gl.getUniformLocation(program, name);
        gl.useProgram(program);
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.uniform4fv(place("rows"), rows.flat());
        gl.uniform3f(place("light"), ...light());
        if (plane) gl.uniform4f(place("plane"), ...plane);
        gl.uniform1f(place("ink"), 1);
        gl.uniform1f(place("alpha"), 1);
        gl.disable(gl.BLEND);
        if (plane || is_clear) gl.disable(gl.CULL_FACE); else gl.enable(gl.CULL_FACE);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
        for (const pipe of pipeFaces) if (shown[pipe.part] && (plane || is_clear)) gl.drawElements(gl.TRIANGLES, 3 * pipe.count, kind, 3 * pipe.first * bytes);
        if (is_clear) { gl.enable(gl.BLEND); gl.depthMask(false); }
        gl.uniform1f(place("alpha"), is_clear ? 0.3 : 1);
        m.parts.forEach((part, k) => { if (shown[k]) gl.drawElements(gl.TRIANGLES, 3 * part.count, kind, 3 * part.first * bytes); });
        gl.enable(gl.BLEND);
        gl.uniform1f(place("ink"), 0.1);
        gl.uniform1f(place("alpha"), 0.55);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, lines);
        m.parts.forEach((part, k) => { if (shown[k]) gl.drawElements(gl.LINES, 2 * part.edges, kind, 2 * part.first_edge * bytes); });
        gl.depthMask(true);
      },
    };
  }

  /* Where WebGL is missing: faces painted on a plain canvas, the farthest first. */
  function flat() {
    const g = canvas.getContext("2d");
    return {
      fill() {},
      paint(rows, ramp, is_clear) {
        const [w, h] = [canvas.width, canvas.height];
        g.clearRect(0, 0, w, h);
        const screen = new Float32Array(3 * total);
        for (let i = 0; i < total; i += 1) screen.set(placed(rows, positions.subarray(3 * i, 3 * i + 3)), 3 * i);
        const groups = [...m.parts.map((part, k) => [part, k, false]), ...pipeFaces.map((pipe) => [pipe, pipe.part, true])];
        const seen = [];
        for (const [group, part, is_pipe] of groups) {
          if (!shown[part] || (is_pipe && !is_clear && !plane)) continue;
          for (let t = group.first; t < group.first + group.count; t += 1) {
            const [a, b, c] = faces.slice(3 * t, 3 * t + 3);
            const middle = [0, 1, 2].map((d) => (positions[3 * a + d] + positions[3 * b + d] + positions[3 * c + d]) / 3);
            if (plane && dot(plane, middle) > plane[3]) continue;
            seen.push([(screen[3 * a + 2] + screen[3 * b + 2] + screen[3 * c + 2]) / 3, a, b, c, is_pipe]);
          }
        }
        seen.sort((one, other) => other[0] - one[0]);
        const toward = light();
        for (const [, a, b, c, is_pipe] of seen) {
          const bright = 0.6 + 0.4 * Math.abs(dot(toward, normals.subarray(3 * a, 3 * a + 3)));
          const tint = colour(((values[a] + values[b] + values[c]) / 3 - range[0]) / (range[1] - range[0]), ramp).map((x) => Math.round(x * bright));
          g.globalAlpha = is_clear && !is_pipe ? 0.3 : 1;
          g.fillStyle = `rgb(${tint.join(",")})`;
          g.strokeStyle = g.fillStyle;
          g.beginPath();
          for (const i of [a, b, c]) g.lineTo(0.5 * (screen[3 * i] + 1) * w, 0.5 * (1 - screen[3 * i + 1]) * h);
          g.closePath();
          g.fill();
          g.stroke();
        }
        g.globalAlpha = 1;
      },
    };
  }

  /* The field that the change which is shown is counted from. */
  const base = () => (byId("quantity").value === "temperature" ? null : bases[Number(byId("quantity").value)].field);
  const is_difference = () => base() !== null;
  function fillValues() {
    const from = base();
    for (let i = 0; i < total; i += 1) values[i] = now.field[source[i]] - (from ? from[source[i]] : 0);
    const ramp = is_difference() ? DIFFERENCE : RAMP;
    if ((is_fixed && !is_difference()) || (beside.length > 0 && is_ranged)) { painter.fill(ramp); return; }
    let [low, high] = [Infinity, -Infinity];
    for (const field of [now.field, ...beside]) {
      m.parts.forEach((part, k) => {
        if (!shown[k]) return;
        for (let f = 3 * part.first; f < 3 * (part.first + part.count); f += 1) {
          const value = field[faces[f]] - (from ? from[faces[f]] : 0);
          low = Math.min(low, value);
          high = Math.max(high, value);
        }
      });
    }
    if (is_difference()) { const most = Math.max(Math.abs(low), Math.abs(high), 0.05); [low, high] = [-most, most]; }
    range = low < high - 0.05 ? [low, high] : [low - 0.05, low + 0.05];
    is_ranged = true;
    painter.fill(ramp);
  }

  const degrees = (value) => (is_difference() ? units.span : units.value)("degC", value);
  const unitShown = () => (is_difference() ? units.spanName : units.name)("degC");
  function legend() {
    const ramp = is_difference() ? DIFFERENCE : RAMP;
    byId("ramp").style.background = `linear-gradient(to right, ${ramp.map((own) => `rgb(${own.join(",")})`).join(", ")})`;
    const ends = range.map(degrees);
    const { list, digits } = page.ticks(...ends);
    byId("scale").replaceChildren(...list.map((value) => {
      const mark = make("span", `${page.fixed(value, digits)} ${unitShown()}`);
      mark.style.left = `${(100 * (value - ends[0])) / (ends[1] - ends[0])}%`;
      return mark;
    }));
  }

  /* While it moves, a picture that takes long is drawn coarser, and again in full when it rests; times in
     milliseconds. Chosen: thirty frames a second, sixty, and a pause that the eye sees. */
  const [SLOW, FAST, REST] = [30, 18, 250];
  let is_waiting = false;
  let share = 1;
  let painted = 0;
  let rest = 0;
  function paint() {
    page.note?.();
    if (is_waiting || !now) return;
    is_waiting = true;
    requestAnimationFrame((time) => {
      is_waiting = false;
      const gap = time - painted;
      painted = time;
      const is_moving = gap < REST;
      if (is_moving && gap > SLOW) share = Math.max(0.3, 0.85 * share);
      if (is_moving && gap < FAST) share = Math.min(1, 1.05 * share);
      clearTimeout(rest);
      if (is_moving && share < 1) rest = setTimeout(paint, REST + 50);
      const scale = Math.min(2, window.devicePixelRatio || 1) * (is_moving ? share : 1);
      const [w, h] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
      draw(w, h);
    });
  }
  function draw(w, h) {
    if (w === 0 || h === 0) return;
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const rows = projection();
    painter.paint(rows, is_difference() ? DIFFERENCE : RAMP, byId("clear").checked);
    mark(rows);
  }
  /* A canvas of WebGL is empty on paper: there stands its picture. */
  window.addEventListener("beforeprint", () => {
    if (!now) return;
    draw(2 * canvas.clientWidth, 2 * canvas.clientHeight);
    byId("printed").src = canvas.toDataURL();
    byId("printed").hidden = false;
  });
  window.addEventListener("afterprint", () => { byId("printed").hidden = true; paint(); });

  /* Whether two names over the picture leave each other free, by the size of their letters in pixels. */
  const [LETTER, LINE] = [7.5, 24];
  function isApart(one, other) {
    const [a, b] = [one, other].map((own) => {
      const [x, wide] = [(parseFloat(own.style.left) * canvas.clientWidth) / 100, LETTER * own.textContent.length + 24];
      return { left: own.className.includes("before") ? x - wide : x, wide, y: (parseFloat(own.style.top) * canvas.clientHeight) / 100 };
    });
    return Math.abs(a.y - b.y) > LINE || a.left + a.wide < b.left || b.left + b.wide < a.left;
  }

  /* Names over the picture: the hottest spot, the sensor of the binding limit, all others as dots. */
  function mark(rows) {
    const sign = (at, kind, text) => {
      const [x, y] = placed(rows, at);
      if (Math.abs(x) > 1 || Math.abs(y) > 1) return null;
      const own = make("span", text, { className: text === "" ? kind : `${kind} ${x > 0 ? "before" : "after"}${y > 0.85 ? " under" : ""}` });
      own.style.left = `${50 * (x + 1)}%`;
      own.style.top = `${50 * (1 - y)}%`;
      return own;
    };
    const kept_by_section = (at) => !plane || dot(plane, at) <= plane[3];
    const visible = m.sensors.filter((own) => (own.part === null || shown[own.part]) && kept_by_section(own.at));
    const reads = (laid || []).flatMap((one) => visible.filter((own) => own.name === one.name).map((own) => ({ ...one, at: own.at })));
    const bound = laid ? [] : now.marks.filter((own) => (own.part === null || shown[own.part]) && kept_by_section(own.at));
    const all = visible.filter((own) => bound.every((mark) => mark.at !== own.at)).map((own) => sign(own.at, "dot", ""));
    const furthest = reads.slice().sort((a, b) => Math.abs(b.residual) - Math.abs(a.residual));
    all.push(...reads.map((own) => {
      const dot = sign(own.at, own.inBand ? "dot read" : "dot read off", "");
      if (dot) dot.style.background = `rgb(${colour(0.5 + 0.5 * Math.max(-1, Math.min(1, own.residual / (Math.abs(furthest[0].residual) || 1))), DIFFERENCE).join(",")})`;
      return dot;
    }));
    const named = [];
    for (const own of furthest) {
      if (named.length === NAMED) break;
      const label = sign(own.at, own.inBand ? "reading" : "reading off", `${own.name} ${signed(units.span(own.unit, own.residual), 2)} ${units.spanName(own.unit)}`);
      if (label && named.every((other) => isApart(label, other))) named.push(label);
    }
    all.push(...named);
    all.push(...bound.map((own) => sign(own.at, "bound", own.name)));
    let hottest = null;
    m.parts.forEach((part, k) => {
      if (!shown[k]) return;
      for (let f = 3 * part.first; f < 3 * (part.first + part.count); f += 1) {
        if (hottest === null || now.field[faces[f]] > now.field[hottest]) hottest = faces[f];
      }
    });
    if (hottest !== null && !is_difference() && !laid) {
      const at = [...positions.subarray(3 * hottest, 3 * hottest + 3)];
      if (kept_by_section(at)) all.push(sign(at, "hottest", `hottest ${page.fixed(units.value("degC", now.field[hottest]), 1)} ${units.name("degC")}`));
    }
    signs.replaceChildren(...all.filter((own) => own !== null));
  }

  const rowsOfParts = m.parts.map((part, k) => {
    const row = make("tr");
    const check = make("input", undefined, { type: "checkbox", checked: true, id: `part${k}` });
    check.addEventListener("change", () => { shown[k] = check.checked; redraw(); });
    const only = make("button", "alone", { type: "button", ariaLabel: `${spoken(part.name)} alone` });
    only.addEventListener("click", () => {
      const is_alone = shown.every((own, other) => own === (other === k));
      shown.forEach((_, other) => { shown[other] = is_alone || other === k; rowsOfParts[other].check.checked = shown[other]; });
      redraw();
    });
    const cells = [make("td"), make("td"), make("td"), make("td")];
    cells[0].append(check, make("label", ` ${spoken(part.name)}`, { htmlFor: `part${k}` }));
    cells[3].append(only);
    row.append(...cells);
    byId("parts").tBodies[0].append(row);
    return { check, cells };
  });
  function listParts() {
    m.parts.forEach((part, k) => {
      let [low, high] = [Infinity, -Infinity];
      for (let f = 3 * part.first; f < 3 * (part.first + part.count); f += 1) { low = Math.min(low, values[faces[f]]); high = Math.max(high, values[faces[f]]); }
      [low, high].forEach((value, c) => { rowsOfParts[k].cells[c + 1].textContent = Number.isFinite(value) ? page.fixed(degrees(value), 1) : "–"; });
    });
    byId("parts-unit").textContent = unitShown();
  }
  function recolour() { fillValues(); legend(); listParts(); paint(); }
  function redraw() { is_ranged = false; recolour(); }

  /* Turned with the pointer or the arrow keys, moved with the right button or Shift, nearer with the wheel or + and -. */
  const held = new Map();
  let apart = 0;
  canvas.addEventListener("pointerdown", (e) => { held.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); apart = 0; });
  const release = (e) => { held.delete(e.pointerId); apart = 0; };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("pointermove", (e) => {
    const before = held.get(e.pointerId);
    if (!before) { ask(e); return; }
    const [dx, dy] = [e.clientX - before.clientX, e.clientY - before.clientY];
    held.set(e.pointerId, e);
    if (held.size === 2) {
      const [one, other] = [...held.values()];
      const distance = Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      if (apart > 0) zoom(distance / apart);
      apart = distance;
    } else if (e.shiftKey || e.buttons === 2) {
      eye.right += (2 * dx) / canvas.clientWidth;
      eye.up -= (2 * dy) / canvas.clientHeight;
    } else turn(-0.5 * dx, 0.5 * dy);
    paint();
  });
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(-0.0015 * e.deltaY)); paint(); }, { passive: false });
  function zoom(by) { eye.zoom = Math.min(40, Math.max(0.2, eye.zoom * by)); }
  function turn(yaw, pitch) { eye.yaw += yaw; eye.pitch = Math.min(89.9, Math.max(-89.9, eye.pitch + pitch)); }
  canvas.addEventListener("keydown", (e) => {
    const act = { ArrowLeft: () => turn(10, 0), ArrowRight: () => turn(-10, 0), ArrowUp: () => turn(0, 10), ArrowDown: () => turn(0, -10),
      "+": () => zoom(1.2), "=": () => zoom(1.2), "-": () => zoom(1 / 1.2), Home: () => look("corner") }[e.key];
    if (!act) return;
    e.preventDefault();
    act();
    paint();
  });
  /* From a side, as near as all of it can be seen. */
  function look(view) {
    [eye.yaw, eye.pitch] = VIEWS[view];
    [eye.zoom, eye.right, eye.up] = [1, 0, 0];
    const rows = projection();
    const seen = [[Infinity, -Infinity], [Infinity, -Infinity]];
    for (let i = 0; i < scene.count; i += 1) {
      placed(rows, positions.subarray(3 * i, 3 * i + 3)).slice(0, 2).forEach((value, d) => { seen[d] = [Math.min(seen[d][0], value), Math.max(seen[d][1], value)]; });
    }
    const [right, up] = seen;
    const half = Math.max(0.5 * (right[1] - right[0]), 0.5 * (up[1] - up[0]), 1e-9);
    eye.zoom = 0.9 / half;
    [eye.right, eye.up] = [right, up].map(([low, high]) => -0.5 * (low + high) * eye.zoom);
    paint();
  }
  for (const button of byId("views").querySelectorAll("button")) button.addEventListener("click", () => look(button.value));

  /* What is under the pointer. */
  function ask(e) {
    const bounds = canvas.getBoundingClientRect();
    const [x, y] = [(2 * (e.clientX - bounds.left)) / bounds.width - 1, 1 - (2 * (e.clientY - bounds.top)) / bounds.height];
    const { right, up, toward } = axes();
    const rows = projection();
    const [a, b] = [(x - placed(rows, center)[0]) / Math.hypot(...rows[0].slice(0, 3)), (y - placed(rows, center)[1]) / Math.hypot(...rows[1].slice(0, 3))];
    const from = center.map((c, d) => c + a * right[d] + b * up[d] + 4 * radius * toward[d]);
    const found = now && scene.met(from, toward.map((t) => -t), shown, plane, values);
    byId("asked").textContent = found
      ? `${spoken(m.parts[found.which].name)}: ${page.fixed(degrees(found.value), 2)} ${unitShown()}${now.band === null ? "" : `, ± ${units.span("degC", now.band).toFixed(2)} ${units.spanName("degC")} (95 %)`}`
      : "Point at the machine for a temperature.";
  }
  canvas.addEventListener("pointerleave", () => { if (held.size === 0) byId("asked").textContent = "Point at the machine for a temperature."; });

  function cut() {
    const axis = AXES.indexOf(byId("cut").value.slice(-1));
    byId("depth").disabled = axis < 0;
    if (axis < 0) plane = null;
    else {
      const sign = byId("cut").value.startsWith("-") ? -1 : 1;
      const at = box[axis][0] + (box[axis][1] - box[axis][0]) * Number(byId("depth").value);
      plane = [0, 1, 2].map((d) => (d === axis ? sign : 0)).concat(sign * at);
    }
    paint();
  }
  for (const id of ["cut", "depth"]) byId(id).addEventListener("input", cut);
  byId("clear").addEventListener("change", paint);
  byId("fixed").addEventListener("change", () => { is_fixed = byId("fixed").checked; redraw(); });
  byId("quantity").addEventListener("change", redraw);
  new ResizeObserver(paint).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);

  byId("asked").textContent = "Point at the machine for a temperature.";
  look("corner");
  return {
    redraw,
    /* The machine with a field: temperatures (degrees Celsius) of all vertices and stations, places that are named, the half width of
       the band of 95 % (none where it is not known), and other fields whose colours are to be the same. */
    show(state, others = []) {
      is_ranged = others.length > 0 && others === beside;
      [now, beside] = [state, others];
      recolour();
    },
    /* Fields, with their names, each of which can be what a change is counted from. */
    changes(all) {
      bases = all;
      const chosen = byId("quantity").value;
      byId("quantity").replaceChildren(byId("quantity").options[0], ...bases.map((own, k) => make("option", `change from ${own.name}`, { value: k })));
      byId("quantity").value = bases[Number(chosen)] ? chosen : "temperature";
      if (now) redraw();
    },
    /* Readings less values of a test, by the names of their points; nothing where none is laid beside. */
    lay(test) {
      laid = test;
      byId("laid").textContent = laid ? "At the sensors: reading less value of the test that was chosen below." : "";
      paint();
    },
    /* The state of the picture in the link of a page. */
    linkTo(link) {
      for (const id of ["quantity", "cut", "depth", "clear", "fixed"]) link.control(id);
      link.add({
        write: (words) => m.parts.forEach((part, k) => { if (!shown[k]) words.append("hidden", part.name); }),
        read: (words) => {
          m.parts.forEach((part, k) => { shown[k] = !words.getAll("hidden").includes(part.name); rowsOfParts[k].check.checked = shown[k]; });
          is_fixed = byId("fixed").checked;
          cut();
        },
      });
      link.add({
        isView: true,
        write: (words) => words.set("view", [eye.yaw, eye.pitch, eye.zoom, eye.right, eye.up].map((value) => Number(value.toFixed(3))).join(" ")),
        read: (words) => {
          const view = (words.get("view") || "").split(" ").map(Number);
          if (view.length === 5 && view.every(Number.isFinite)) [eye.yaw, eye.pitch, eye.zoom, eye.right, eye.up] = view;
          zoom(1);
          turn(0, 0);
        },
      });
    },
  };
}
