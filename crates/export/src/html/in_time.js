/* The machine over time; `s` as above, `answers` what coldplate(s) gives. Nothing where the file knows steady states only.
   States are arrays, and what the last step came to is the one behind them. */
function coldplateInTime(s, answers) {
  const own = s.in_time;
  if (!own) return null;
  const n = own.states;
  const POLE = 0.435866521508459;
  const TOLERANCE = 1e-4;
  const [first, second] = [1 / POLE, 0.5 / (POLE * POLE)];
  const third = second - first - (first - 1);
  const WEIGHTS = [1 - (first - 1 - 2 * third) - third, first - 1 - 2 * third, third];

  const dot = (a, b) => a.reduce((sum, value, k) => sum + value * b[k], 0);
  function combine(terms, rows) {
    const sums = new Array(n).fill(0);
    terms.forEach((term, t) => { for (let k = 0; k < n; k += 1) sums[k] += term * rows[t][k]; });
    return sums;
  }

  /* What the condition alone decides: steady values and states, rates (columns of L) and outputs (a row per point). */
  function here(x) {
    const moving = answers.terms(x, own.moving);
    const rates = Array.from({ length: n }, () => new Array(n).fill(0));
    moving.forEach((term, t) => {
      for (let j = 0; j < n; j += 1) for (let i = 0; i < n; i += 1) rates[j][i] += term * own.moving.rates[t][j][i];
    });
    return {
      values: answers.evaluate(x), rates,
      steady: combine(answers.terms(x, own.steady), own.steady.coefficients),
      outputs: own.moving.outputs.map((rows) => combine(moving, rows)),
    };
  }

  /* LU factors of I + pole length L by columns, rows exchanged by the largest pivot. */
  function factorise(rates, length) {
    const columns = rates.map((column, k) => column.map((entry, i) => entry * (POLE * length) + Number(i === k)));
    const inverse = new Array(n);
    const order = Array.from({ length: n }, (_, k) => k);
    const swap = (list, a, b) => { [list[a], list[b]] = [list[b], list[a]]; };
    for (let k = 0; k < n; k += 1) {
      const pivots = columns[k];
      let largest = k;
      for (let i = k + 1; i < n; i += 1) if (Math.abs(pivots[i]) > Math.abs(pivots[largest])) largest = i;
      swap(order, k, largest);
      for (const column of columns) swap(column, k, largest);
      inverse[k] = 1 / pivots[k];
      for (let i = k + 1; i < n; i += 1) pivots[i] *= inverse[k];
      for (let j = k + 1; j < n; j += 1) for (let i = k + 1; i < n; i += 1) columns[j][i] -= pivots[i] * columns[j][k];
    }
    return (right) => {
      const x = order.map((place) => right[place]);
      for (let k = 0; k < n; k += 1) for (let i = k + 1; i < n; i += 1) x[i] -= columns[k][i] * x[k];
      for (let k = n - 1; k >= 0; k -= 1) {
        x[k] *= inverse[k];
        for (let i = 0; i < k; i += 1) x[i] -= columns[k][i] * x[k];
      }
      return x;
    };
  }

  const atRest = (x) => [...here(x).steady, 0];
  const atTemperature = (value) => [...own.uniform.at_zero.map((zero, k) => zero + own.uniform.per_unit[k] * value), 0];

  /* The state after so many seconds at a condition. */
  function step(state, seconds, at) {
    let away = at.steady.map((value, k) => state[k] - value);
    let left = seconds;
    let next = state[n] > 0 ? state[n] : seconds;
    let solve = null;
    let known = -1;
    while (left > 0) {
      const isLast = next >= left * (1 - 1e-9);
      const length = isLast ? left : next;
      if (known !== length) [solve, known] = [factorise(at.rates, length), length];
      const one = solve(away);
      const two = solve(one);
      const three = solve(two);
      const four = solve(three);
      const error = 0.5 * one.reduce((sum, value, k) => sum + Math.abs(value - 3 * two[k] + 3 * three[k] - four[k]) * own.reach[k], 0);
      if (error > TOLERANCE && length > 1e-6 * seconds) { next = 0.5 * length; continue; }
      away = one.map((value, k) => WEIGHTS[0] * value + WEIGHTS[1] * two[k] + WEIGHTS[2] * three[k]);
      left = isLast ? 0 : left - length;
      const grown = error < 0.05 * TOLERANCE ? 2 * length : length;
      next = isLast ? Math.max(grown, next) : grown;
    }
    return [...at.steady.map((value, k) => value + away[k]), next];
  }

  const read = (state, at) => at.values.map((value, p) => value + dot(at.outputs[p], at.steady.map((steady, k) => state[k] - steady)));

  /* Whether this browser moves as the file says it should. */
  const selfTest = () => own.self_tests.every((test) => {
    const at = here(test.condition);
    const values = read(step(atRest(test.start), test.duration, at), at);
    return test.values.every((value, p) => Math.abs(values[p] - value) <= 1e-7 * Math.max(1, Math.abs(value)));
  });

  return { here, atRest, atTemperature, step, read, selfTest };
}
