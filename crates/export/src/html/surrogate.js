"use strict";
/* Answers of a coldplate surrogate; `s` is what `coldplate export --to json` writes. */
function coldplate(s) {
  const NINETY_FIVE = 1.959963984540054;
  const own = s.uncertainty || null;
  const points = s.points.length;
  const parameters = own ? own.parameters.length : 0;
  const states = parameters + points + 1;
  const known = Boolean(own && own.mean);
  const fit = s.points.map((p) => (p.half_width / NINETY_FIVE) ** 2);

  function covariance(i, j) {
    if (!known) return i === j ? 1 : 0;
    const [a, b] = i < j ? [j, i] : [i, j];
    return own.covariance[(a * (a + 1)) / 2 + b];
  }

  function scaled(x, scalings) {
    return scalings.map((place) => {
      const k = s.scalings[place];
      let g = x[k.variable];
      if (k.transform === "reciprocal") g = 1 / g;
      if (k.transform === "log") g = Math.log(g);
      return (g - k.low) * k.factor + k.offset;
    });
  }

  function monomials(u, exponents) {
    return exponents.map((term) => term.reduce((m, e, v) => {
      for (let k = 0; k < e; k += 1) m *= u[v];
      return m;
    }, 1));
  }

  function values(x) {
    const all = new Array(points).fill(0);
    for (const model of s.polynomials) {
      const m = monomials(scaled(x, model.scalings), model.exponents);
      model.points.forEach((p, column) => { all[p] += m.reduce((sum, term, t) => sum + term * model.coefficients[t][column], 0); });
    }
    for (const model of s.bases) {
      const u = scaled(x, model.scalings);
      const phi = model.centres.map((centre) => {
        const q = centre.reduce((sum, c, v) => sum + ((u[v] - c) * model.scales[v]) ** 2, 0);
        switch (model.kernel) {
          case "thin_plate": return 0.5 * q * Math.log(Math.max(q, 2.2250738585072014e-308));
          case "cubic": return q * Math.sqrt(q);
          case "multiquadric": return Math.sqrt(1 + q);
          default: return Math.exp(-q);
        }
      });
      model.points.forEach((p, column) => { all[p] += phi.reduce((sum, value, c) => sum + value * model.weights[c][column], 0); });
    }
    return all;
  }

  /* What every point depends on, by state, and the share of variance that the distance from the measured conditions adds. */
  function directions(x) {
    if (!own) return { rows: null, growth: 0 };
    const m = monomials(scaled(x, own.scalings), own.exponents);
    const rows = s.points.map((_, p) => {
      const row = new Array(states).fill(0);
      for (let k = 0; k < parameters; k += 1) row[k] = m.reduce((sum, term, t) => sum + term * own.slopes[p][t][k], 0);
      row[parameters + p] = own.missed[p].own;
      row[states - 1] = own.missed[p].common;
      return row;
    });
    let square = 0;
    if (own.measured.length > 0) {
      s.variables.forEach((v, i) => {
        const half = 0.5 * (v.high - v.low);
        const mean = own.measured.reduce((sum, row) => sum + row[i], 0) / own.measured.length;
        if (half > 0) square += ((x[i] - mean) / half) ** 2;
      });
    }
    return { rows, growth: own.growth * own.growth * square };
  }

  function shared(a, b, from, to) {
    let sum = 0;
    if (!known) {
      for (let i = from; i < to; i += 1) sum += a[i] * b[i];
      return sum;
    }
    for (let i = from; i < to; i += 1) {
      if (a[i] !== 0) for (let j = from; j < to; j += 1) sum += a[i] * b[j] * covariance(i, j);
    }
    return sum;
  }

  function band(row, fitVariance, growth) {
    if (!own) {
      const fitOnly = Math.sqrt(fitVariance);
      return { fit: fitOnly, parameters: 0, misses: 0, total: fitOnly };
    }
    let there = 0;
    for (let i = parameters; i < states; i += 1) there += row[i] * row[i];
    const ofParameters = shared(row, row, 0, parameters);
    const ofMisses = shared(row, row, parameters, states);
    const ofStates = known ? shared(row, row, 0, states) : ofParameters + ofMisses;
    const root = (variance) => Math.sqrt(Math.max(0, variance));
    return {
      fit: root(fitVariance), parameters: root(ofParameters), misses: root(ofMisses + growth * there),
      total: root(ofStates + fitVariance + growth * there),
    };
  }

  /* Probability that a standard normal variable is at most z: Hart (1968, no. 5666), a continued fraction beyond 7. */
  function below(z) {
    if (Number.isNaN(z)) return NaN;
    const size = Math.abs(z);
    let tail = 0;
    if (size <= 38) {
      const density = Math.exp(-0.5 * size * size);
      if (size < 7) {
        const over = [0.0352624965998911, 0.700383064443688, 6.37396220353165, 33.912866078383, 112.079291497871, 221.213596169931,
          220.206867912376];
        const under = [0.0883883476483184, 1.75566716318264, 16.064177579207, 86.7807322029461, 296.564248779674, 637.333633378831,
          793.826512519948, 440.413735824752];
        const horner = (list) => list.reduce((sum, c) => sum * size + c, 0);
        tail = (density * horner(over)) / horner(under);
      } else {
        let fraction = size;
        for (let k = 12; k >= 1; k -= 1) fraction = size + k / fraction;
        tail = (density * 0.3989422804014327) / fraction;
      }
    }
    return z < 0 ? tail : 1 - tail;
  }

  function limited(limit, x, all) {
    const [first] = limit.points;
    switch (limit.kind) {
      case "maximum": return { value: all[first], first, second: -1 };
      case "rise": return { value: all[first] - x[limit.variable], first, second: -1 };
      case "difference": return { value: all[first] - all[limit.points[1]], first, second: limit.points[1] };
      default: {
        let [high, low] = [first, first];
        for (const p of limit.points) {
          if (all[p] > all[high]) high = p;
          if (all[p] < all[low]) low = p;
        }
        const finite = limit.points.every((p) => Number.isFinite(all[p]));
        return { value: finite ? all[high] - all[low] : NaN, first: high, second: low };
      }
    }
  }

  /* Probability that all of some limits are kept: one after the other, each given those before (Mendell and Elston 1974). */
  function allKept(slack, broken, correlation) {
    const count = slack.length;
    let together = 1;
    for (let i = 0; i < count; i += 1) {
      if (slack[i] === Infinity) continue;
      const kept = below(slack[i]);
      together *= kept;
      if (kept < 1e-300) return 0;
      const a = (0.3989422804014327 * Math.exp(-0.5 * slack[i] ** 2)) / kept;
      const loss = a > 0 ? a * (a + slack[i]) : 0;
      const row = correlation[i].slice();
      for (let j = i + 1; j < count; j += 1) {
        const left = 1 - row[j] ** 2 * loss;
        if (row[j] > 1 - 1e-9) slack[j] = Infinity;
        else if (left > 1e-12) slack[j] = (slack[j] + row[j] * a) / Math.sqrt(left);
        else slack[j] += row[j] * a;
      }
      for (let j = i + 1; j < count; j += 1) {
        for (let k = i + 1; k < count; k += 1) {
          if (j !== k) {
            const scale = Math.sqrt(Math.max(1e-12, 1 - row[j] ** 2 * loss) * Math.max(1e-12, 1 - row[k] ** 2 * loss));
            correlation[j][k] = Math.min(1, Math.max(-1, (correlation[j][k] - row[j] * row[k] * loss) / scale));
          }
        }
      }
    }
    const sum = broken.reduce((total, b) => total + b, 0);
    return Math.min(...broken.map((b) => 1 - b), Math.max(0, 1 - sum, together));
  }

  /* Everything at a condition: values, bands (standard deviations), limits, and the verdict at a confidence. */
  function assess(x, confidence) {
    const all = values(x);
    const { rows, growth } = directions(x);
    if (known) all.forEach((_, p) => { all[p] += rows[p].reduce((sum, weight, i) => sum + weight * own.mean[i], 0); });
    const bands = all.map((_, p) => band(rows && rows[p], fit[p], growth));
    const inside = s.variables.every((v, i) => v.low <= x[i] && x[i] <= v.high);
    const answer = { values: all, bands, limits: [], inside, state: "uncertain", probability: NaN, binding: -1 };
    const looked = s.limits.map((limit) => {
      const { value, first, second } = limited(limit, x, all);
      const signs = new Array(points).fill(0);
      if (first !== second) {
        signs[first] = 1;
        if (second >= 0) signs[second] = -1;
      }
      const fitVariance = signs.reduce((sum, sign, p) => sum + sign * sign * fit[p], 0);
      const row = own && new Array(states).fill(0).map((_, i) => signs.reduce((sum, sign, p) => (sign === 0 ? sum : sum + sign * rows[p][i]), 0));
      const total = band(row, fitVariance, growth).total;
      const margin = limit.maximum - value;
      let kept = NaN;
      if (Number.isFinite(margin) && Number.isFinite(total)) kept = total > 0 ? below(margin / total) : Number(margin >= 0);
      answer.limits.push({ name: limit.name, value, maximum: limit.maximum, margin, deviation: total, probability: kept });
      return { row, signs, total };
    });
    if (s.limits.length === 0) return answer;
    const nowhere = answer.limits.findIndex((limit) => Number.isNaN(limit.probability));
    if (nowhere >= 0) {
      answer.binding = nowhere;
      return answer;
    }
    const slackOf = (k) => answer.limits[k].margin / Math.max(answer.limits[k].deviation, 2.2250738585072014e-308);
    const order = s.limits.map((_, k) => k).sort((a, b) => slackOf(a) - slackOf(b));
    const broken = order.map((k) => 1 - answer.limits[k].probability);
    const followed = order.slice(0, 8);
    const elsewhere = broken.slice(followed.length).reduce((sum, b) => sum + b, 0);
    let doubtful = 1;
    while (doubtful < followed.length && broken[doubtful] > 1e-12) doubtful += 1;
    const correlation = followed.slice(0, doubtful).map((a, i) => followed.slice(0, doubtful).map((b, j) => {
      const [p, q] = [looked[a], looked[b]];
      const scale = p.total * q.total;
      if (i === j) return 1;
      if (!own || !(scale > 0)) return 0;
      let together = shared(p.row, q.row, 0, states) + p.signs.reduce((sum, sign, k) => sum + sign * q.signs[k] * fit[k], 0);
      for (let k = parameters; k < states; k += 1) together += growth * p.row[k] * q.row[k];
      return Math.min(1, Math.max(-1, together / scale));
    }));
    const slack = followed.slice(0, doubtful).map(slackOf);
    answer.probability = Math.max(0, allKept(slack, broken.slice(0, doubtful), correlation) - elsewhere);
    [answer.binding] = order;
    if (inside && answer.probability >= confidence) answer.state = "acceptable";
    else if (inside && answer.probability <= 1 - confidence) answer.state = "not_acceptable";
    return answer;
  }

  /* Whether this browser computes what the file says it should. */
  function selfTest() {
    return s.self_tests.every((test) => {
      const found = assess(test.condition, 0.95);
      const near = (a, b, least) => Math.abs(a - b) <= 1e-7 * Math.max(least, Math.abs(b));
      return test.values.every((value, p) => near(found.values[p], value, 1))
        && (!test.deviations || test.deviations.every((value, p) => near(found.bands[p].total, value, 1)));
    });
  }

  return { assess, selfTest };
}
