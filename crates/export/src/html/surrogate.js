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

  /* Adds what readings have taught. */
  function learnt(all, rows) {
    if (known) all.forEach((_, p) => { all[p] += rows[p].reduce((sum, weight, i) => sum + weight * own.mean[i], 0); });
    return all;
  }
  const evaluate = (x) => learnt(values(x), known ? directions(x).rows : null);
  const terms = (x, of) => monomials(scaled(x, of.scalings), of.exponents);
  /* What a limit looks at, from the values of all points. */
  const limitedValue = (limit, x, all) => limited(limit, x, all).value;

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

  /* Nodes and weights of Gauss and Legendre's rule between 0 and 1. */
  const rule = [
    [0.009219682876640378, 0.023587668193255706], [0.0479413718147626, 0.05346966299765953], [0.11504866290284765, 0.08003916427167321],
    [0.20634102285669126, 0.10158371336153287], [0.31608425050090994, 0.1167462682691773], [0.43738329574426554, 0.12457352290670134],
    [0.5626167042557344, 0.12457352290670134], [0.6839157494990901, 0.1167462682691773], [0.7936589771433087, 0.10158371336153287],
    [0.8849513370971523, 0.08003916427167321], [0.9520586281852375, 0.05346966299765953], [0.9907803171233596, 0.023587668193255706],
  ];

  /* Correlation and 1 - r^2 at the tangent of half the angle whose sine is r; the angle that a step of it adds. */
  const halfTangent = (r) => r / (1 + Math.sqrt((1 - r) * (1 + r)));
  function turned(tangent) {
    const under = 1 + tangent * tangent;
    const cosine = (1 - tangent * tangent) / under;
    return { r: (2 * tangent) / under, left: cosine * cosine, step: 2 / under };
  }

  const densityOfTwo = (a, b, r, left) => Math.exp((-0.5 * (a * a + b * b - 2 * r * a * b)) / left);

  /* What a correlation that is not quite one takes from the probability that both are below. */
  function missing(a, b, r) {
    const end = Math.sqrt((1 - r) * (1 + r));
    const apart = Math.abs(a - b);
    if (apart > 8 * end || end === 0) return 0;
    const square = apart * apart;
    const lead = Math.exp(-0.5 * a * b);
    const bend = 0.5 - 0.125 * a * b;
    const edge = Math.exp((-0.5 * square) / (end * end));
    const flat = end * edge - apart * 2.5066282746310007 * below(-apart / end);
    const curved = (end ** 3 * edge - square * flat) / 3;
    const sum = rule.reduce((total, [node, weight]) => {
      const x = node * end;
      const cosine = Math.sqrt((1 - x) * (1 + x));
      const whole = Math.exp((-a * b) / (1 + cosine)) / cosine;
      return total + weight * Math.exp((-0.5 * square) / (x * x)) * (whole - lead * (1 + bend * x * x));
    }, 0);
    return (lead * (flat + bend * curved) + end * sum) / (2 * Math.PI);
  }

  /* Probability that two standard normal numbers of correlation r are below a and b, each by itself with belowA and belowB
     (Drezner and Wesolowsky 1990, Genz 2004). */
  function bothBelow(a, b, r, belowA, belowB) {
    if (r > 0.9) return Math.min(belowA, belowB) - missing(a, b, r);
    if (r < -0.9) return Math.max(0, belowA + belowB - 1) + missing(a, -b, -r);
    const end = halfTangent(r);
    const sum = rule.reduce((total, [node, weight]) => {
      const at = turned(node * end);
      return total + weight * at.step * densityOfTwo(a, b, at.r, at.left);
    }, 0);
    return belowA * belowB + (end * sum) / (2 * Math.PI);
  }

  /* Probability that three are broken (Plackett 1954); nothing where two of them are the same quantity. */
  function allBroken(bound, broken, both, correlation, i, j, k) {
    const size = (m, n) => Math.abs(correlation[m][n]);
    let [first, second, third] = [k, i, j];
    if (size(j, k) >= size(i, j) && size(j, k) >= size(i, k)) [first, second, third] = [i, j, k];
    else if (size(i, k) >= size(i, j)) [first, second, third] = [j, i, k];
    if (size(second, third) > 1 - 1e-9) return null;
    const [a, b, c] = [bound[first], bound[second], bound[third]];
    const p = correlation[second][third];
    const [toB, toC] = [halfTangent(correlation[first][second]), halfTangent(correlation[first][third])];
    const sum = rule.reduce((total, [node, weight]) => {
      const { r, left: leftR, step: stepR } = turned(node * toB);
      const { r: q, left: leftQ, step: stepQ } = turned(node * toC);
      const left = Math.max(1e-14, leftR - q * q - p * p + 2 * p * q * r);
      const ofB = densityOfTwo(a, b, r, leftR) * below((c * leftR - (q - p * r) * a - (p - q * r) * b) / Math.sqrt(leftR * left));
      const ofC = densityOfTwo(a, c, q, leftQ) * below((b * leftQ - (r - p * q) * a - (p - q * r) * c) / Math.sqrt(leftQ * left));
      return total + weight * (toB * stepR * ofB + toC * stepQ * ofC);
    }, 0);
    const all = broken[first] * both[second][third] + sum / (2 * Math.PI);
    return Math.min(both[i][j], both[i][k], both[j][k], Math.max(0, all));
  }

  /* A probability that all are kept which is never too large (Hunter 1976, Worsley 1982; Bukszar and Prekopa 2001). */
  function leastKept(bound, broken, correlation) {
    const both = bound.map((a, i) => bound.map((b, j) => {
      const least = Math.min(broken[i], broken[j]);
      if (i === j || !(least > 1e-7)) return 0;
      return Math.min(least, Math.max(0, bothBelow(a, b, correlation[i][j], broken[i], broken[j])));
    }));
    const left = bound.map((_, k) => k).slice(1);
    const beside = bound.map(() => [0, -1]);
    let kept = 1 - broken[0];
    while (left.length > 0) {
      const next = left.reduce((best, k) => (both[k][beside[k][0]] > both[best][beside[best][0]] + 1e-9 ? k : best));
      const [first, second] = beside[next];
      let alone = broken[next] - both[next][first];
      if (second >= 0 && Math.min(alone, both[next][second]) > 1e-6) {
        const three = allBroken(bound, broken, both, correlation, next, first, second);
        if (three !== null) alone += three - both[next][second];
      }
      kept -= Math.max(0, alone);
      left.splice(left.indexOf(next), 1);
      for (const k of left) {
        const [one, two] = beside[k];
        if (both[k][next] > both[k][one] + 1e-9) beside[k] = [next, one];
        else if (two < 0 || both[k][next] > both[k][two] + 1e-9) beside[k] = [one, next];
      }
    }
    return Math.max(0, kept);
  }

  /* About the probability that all of some limits are kept: one after the other, each given those before, as if what is left
     stayed normal (Mendell and Elston 1974). */
  function oneByOne(slack, correlation) {
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
    return together;
  }

  /* Probability that all of some limits are kept: the bound, and of more than three limits an estimate where that is low. */
  function allKept(slack, broken, correlation) {
    const least = leastKept(slack.map((z) => Math.min(40, Math.max(-40, -z))), broken, correlation);
    if (slack.length <= 3 || least >= 0.9) return least;
    const more = Math.min(oneByOne(slack, correlation), ...broken.map((b) => 1 - b)) - least;
    return least + Math.max(0, more) * Math.min(1, (0.9 - least) / (0.9 - 0.7));
  }

  /* Everything at a condition: values, bands (standard deviations), limits, and the verdict at a confidence. */
  function assess(x, confidence) {
    const all = values(x);
    const { rows, growth } = directions(x);
    learnt(all, rows);
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

  /* What a controller adds: every displacement with the opposite sign, 0 for other points. */
  const offset = (x) => evaluate(x).map((value, p) => (s.points[p].unit === "um" ? -value : 0));

  return { assess, below, evaluate, offset, terms, limitedValue, selfTest };
}
