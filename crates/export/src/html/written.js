/* Elements of a page, and how names and numbers are written in it. */
function written() {
  return {
    byId: (id) => document.getElementById(id),
    make: (tag, text, properties) => Object.assign(document.createElement(tag), text === undefined ? {} : { textContent: text }, properties || {}),
    spoken: (name) => name.replaceAll("_", " "),
    short: (value) => String(Number(value.toPrecision(5))),
    /* Decimals with a true minus sign, and none before zero. */
    fixed: (value, d) => { const text = Math.abs(value).toFixed(d); return value < 0 && Number(text) !== 0 ? `−${text}` : text; },
    signed: (value, d) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(d)}`,
  };
}

/* Shapes of pictures in the page. */
const drawing = (space) => ({
  shape: (tag, attributes, text) => {
    const one = document.createElementNS(space, tag);
    Object.entries(attributes).forEach(([key, value]) => one.setAttribute(key, value));
    if (text !== undefined) one.textContent = text;
    return one;
  },
  /* Round numbers across a range. */
  ticks: (low, high) => {
    const raw = (high - low) / 6;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((round) => round * power >= raw * 0.999);
    const list = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) list.push(k * step);
    return { list, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
  },
});
