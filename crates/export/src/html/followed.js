/* The surrogate of the same machine with other values `to` of the variables that it held and follows (`f`), as `coldplate query`
   makes it: changes of the points are a polynomial more, the error of following adds to what each point misses. */
function coldplateFollowed(s, f, to) {
  const t = f.variables.map((v, k) => (to[k] - s.held[v.held].value) / (v.high - v.low));
  const moved = t.flatMap((own, k) => (own === 0 ? [] : [k]));
  if (moved.length === 0) return s;
  const factor = (p, k) => f.interactions.reduce((sum, own) => sum + (own.point === p && own.of === k ? own.factor * t[own.by] : 0), 1);
  const factors = s.points.map((_, p) => f.variables.map((_, k) => factor(p, k)));
  const change = (p, term) => moved.reduce((sum, k) => {
    const [a, b] = f.variables[k].coefficients[p][term];
    return sum + (a + b * t[k]) * t[k] * factors[p][k];
  }, 0);
  const variance = (p) => moved.reduce((sum, k) => sum + (f.variables[k].errors[p] * t[k]) ** 2, 0) * (moved.length === 1 ? 1 : f.errors[p] ** 2);
  const none = { parameters: [], scalings: [], exponents: [], slopes: s.points.map(() => []), missed: s.points.map(() => ({ own: 0, common: 0 })), measured: [], growth: 0 };
  const uncertainty = s.uncertainty || none;
  const valueOf = (held) => f.variables.reduce((own, v, k) => (v.held === held ? to[k] : own), s.held[held].value);
  const rise = (limit) => f.limits.reduce((sum, [own, held]) => sum + (own === limit ? valueOf(held) - s.held[held].value : 0), 0);
  return {
    ...s,
    scalings: [...s.scalings, ...f.scalings],
    polynomials: [...s.polynomials, { points: s.points.map((_, p) => p), scalings: f.scalings.map((_, k) => s.scalings.length + k), exponents: f.terms,
      coefficients: f.terms.map((_, term) => s.points.map((_, p) => change(p, term))) }],
    limits: s.limits.map((own, k) => ({ ...own, maximum: own.maximum + rise(k) })),
    held: s.held.map((own, k) => ({ ...own, value: valueOf(k) })),
    uncertainty: { ...uncertainty, missed: uncertainty.missed.map((own, p) => ({ ...own, own: Math.hypot(own.own, Math.sqrt(variance(p))) })) },
  };
}
