/* Numbers packed as text: little-endian, base64. */
function unpacked(text, Kind) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k += 1) bytes[k] = raw.charCodeAt(k);
  return new Kind(bytes.buffer);
}

/* Shape of the machine; `m` is what the file carries of it. */
function coldplateScene(m) {
  const raw = unpacked(m.positions, Uint16Array);
  const positions = Float32Array.from(raw, (value, k) => m.origin[k % 3] + m.step * value);
  const normals = Float32Array.from(unpacked(m.normals, Int8Array), (value) => value / 127);
  const triangles = unpacked(m.triangles, Uint32Array);
  const edges = unpacked(m.edges, Uint32Array);
  const count = positions.length / 3;

  /* What a ray meets first of the parts that are shown, on the side of the section that is kept: part, place and temperature. */
  function met(from, along, is_shown, plane, temperatures) {
    let best = null;
    m.parts.forEach((part, which) => {
      if (!is_shown[which]) return;
      for (let t = part.first; t < part.first + part.count; t += 1) {
        const [a, b, c] = [0, 1, 2].map((k) => triangles[3 * t + k]);
        const corner = (i) => [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]];
        const [p, q, r] = [corner(a), corner(b), corner(c)];
        const [u, v, w] = [minus(q, p), minus(r, p), minus(from, p)];
        const n = cross(along, v);
        const turn = dot(u, n);
        if (Math.abs(turn) < 1e-18) continue;
        const beta = dot(w, n) / turn;
        const side = cross(w, u);
        const gamma = dot(along, side) / turn;
        const distance = dot(v, side) / turn;
        if (beta < 0 || gamma < 0 || beta + gamma > 1 || distance < 0 || (best && distance > best.distance)) continue;
        const at = from.map((x, k) => x + distance * along[k]);
        if (plane && dot(plane, at) > plane[3]) continue;
        const value = (1 - beta - gamma) * temperatures[a] + beta * temperatures[b] + gamma * temperatures[c];
        best = { distance, which, at, value };
      }
    });
    return best;
  }
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

  /* Pipes of the channels: prisms along the axis, with the place of their temperature in the field. */
  const SIDES = 8;
  const pipes = () => m.channels.map((channel) => {
    const legs = channel.path.slice(1).map((end, k) => Math.hypot(...minus(end, channel.path[k])));
    const whole = legs.reduce((sum, leg) => sum + leg, 0) || 1;
    const ends = legs.reduce((all, leg) => [...all, all[all.length - 1] + leg / whole], [0]);
    const cuts = [...new Set([...ends, ...channel.shares.filter((_, k) => k % Math.ceil(channel.shares.length / 60) === 0)])].sort((a, b) => a - b);
    const at = (share) => {
      const k = Math.min(legs.length - 1, Math.max(0, ends.findIndex((end) => end >= share - 1e-12) - 1));
      const t = (share - ends[k]) / (ends[k + 1] - ends[k] || 1);
      return channel.path[k].map((x, d) => x + t * (channel.path[k + 1][d] - x));
    };
    const station = (share) => channel.first + Math.max(0, channel.shares.findIndex((own) => own >= share - 1e-9));
    const [places, normals, stations, faces] = [[], [], [], []];
    for (let k = 1; k < cuts.length; k += 1) {
      const [from, to] = [at(cuts[k - 1]), at(cuts[k])];
      const along = minus(to, from);
      const length = Math.hypot(...along);
      if (length < 1e-9) continue;
      const direction = along.map((x) => x / length);
      const some = Math.abs(direction[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
      const first = cross(direction, some);
      const size = Math.hypot(...first);
      const e1 = first.map((x) => x / size);
      const e2 = cross(direction, e1);
      const start = places.length / 3;
      for (const end of [from, to]) {
        for (let i = 0; i < SIDES; i += 1) {
          const normal = e1.map((x, d) => x * Math.cos((2 * Math.PI * i) / SIDES) + e2[d] * Math.sin((2 * Math.PI * i) / SIDES));
          places.push(...end.map((x, d) => x + 0.5 * channel.diameter * normal[d]));
          normals.push(...normal);
          stations.push(station(end === from ? cuts[k - 1] : cuts[k]));
        }
      }
      for (let i = 0; i < SIDES; i += 1) {
        const next = (i + 1) % SIDES;
        faces.push([start + i, start + next, start + SIDES + next], [start + i, start + SIDES + next, start + SIDES + i]);
      }
    }
    return { part: channel.part, places, normals, stations, faces };
  });

  const box = [0, 1, 2].map((d) => {
    let [low, high] = [Infinity, -Infinity];
    for (let i = d; i < positions.length; i += 3) { low = Math.min(low, positions[i]); high = Math.max(high, positions[i]); }
    return [low, high];
  });
  return { positions, normals, triangles, edges, count, box, met, pipes, dot, cross, minus };
}

/* Temperatures of the machine from those of the points of a surrogate `s`; `m` is what the file carries of both. */
function coldplateField(m, s) {
  const center = unpacked(m.field.center, Float32Array);
  const modes = m.field.modes.map((mode) => unpacked(mode, Int16Array));
  const variables = m.field.variables.map((name) => s.variables.findIndex((v) => v.name === name));
  const points = m.field.points.map((name) => s.points.findIndex((p) => p.name === name));

  const { moving } = m.field;
  const dotted = (own, known) => own.reduce((sum, c, f) => sum + c * known[f], 0);
  /* Temperatures (degrees Celsius) of all vertices, then of the stations of the channels, where the points have these steady values;
     over time, `away` is how far the states are from the steady ones. */
  function field(x, values, away = []) {
    const known = [1, ...variables.map((v) => x[v]), ...points.map((p) => values[p])];
    const all = Float32Array.from(center);
    modes.forEach((mode, k) => {
      const beyond = away.length > 0 ? dotted(moving.coefficients[k], away) : 0;
      const amplitude = m.field.scales[k] * (dotted(m.field.coefficients[k], known) + beyond);
      for (let i = 0; i < all.length; i += 1) all[i] += amplitude * mode[i];
    });
    return all;
  }

  /* Whether this browser finds the temperatures that the file says it should. */
  function selfTest(evaluate) {
    return m.field.self_tests.every((test) => {
      const found = field(test.condition, evaluate(test.condition), test.away);
      return test.vertices.every((vertex, k) => Math.abs(found[vertex] - test.values[k]) < 1e-3);
    });
  }

  return { field, selfTest };
}
