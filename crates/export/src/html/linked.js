/* What is set, as text behind the # of the page's address: a link brings it back. What was set before can be had again. Every part
   of the page writes its share into search parameters and reads it there; a part of the view alone is in the link, and not undone. */
function linked(page) {
  const { byId } = page;
  /* Time in milliseconds after which a change counts as made. Chosen: longer than the pauses of a hand on a slider. */
  const REST = 400;
  /* A page in a frame, as in a notebook, has no address of its own. */
  const hasAddress = location.protocol !== "about:";
  byId("address").hidden = !hasAddress;
  const parts = [];
  let past = [];
  let at = -1;
  let waiting = 0;
  let written = "";
  const text = (own) => {
    const words = new URLSearchParams();
    for (const part of own) part.write(words);
    return words.toString();
  };
  const lasting = () => parts.filter((part) => !part.isView);
  function settle() {
    clearTimeout(waiting);
    waiting = 0;
    const own = text(lasting());
    if (own !== past[at]) {
      past = [...past.slice(0, at + 1), own];
      at = past.length - 1;
    }
    const whole = text(parts);
    if (whole !== written && hasAddress) history.replaceState(null, "", `#${whole}`);
    written = whole;
    byId("undo").disabled = at <= 0;
    byId("redo").disabled = at >= past.length - 1;
  }
  function read(own, words) {
    for (const part of own) part.read(new URLSearchParams(words));
    page.show();
  }
  function go(by) {
    settle();
    if (past[at + by] === undefined) return;
    at += by;
    read(lasting(), past[at]);
    settle();
  }
  byId("undo").addEventListener("click", () => go(-1));
  byId("redo").addEventListener("click", () => go(1));
  document.addEventListener("keydown", (e) => {
    if (!(e.ctrlKey || e.metaKey) || e.altKey || e.key.toLowerCase() !== "z" || e.target.closest?.("input[type=number]")) return;
    e.preventDefault();
    go(e.shiftKey ? 1 : -1);
  });
  const behind = () => location.hash.slice(1);
  window.addEventListener("hashchange", () => { if (behind() !== written) { read(parts, behind()); settle(); } });
  return {
    add(part) { parts.push(part); },
    /* A control whose value is its state. */
    control(id) {
      parts.push({
        write: (words) => words.set(id, byId(id).type === "checkbox" ? Number(byId(id).checked) : byId(id).value),
        read: (words) => {
          if (!words.has(id)) return;
          if (byId(id).type === "checkbox") byId(id).checked = words.get(id) === "1";
          else if (!byId(id).options || [...byId(id).options].some((own) => own.value === words.get(id))) byId(id).value = words.get(id);
        },
      });
    },
    note() {
      clearTimeout(waiting);
      waiting = setTimeout(settle, REST);
    },
    /* The state of the address, if it has any, when all parts are there. */
    begin() {
      written = text(parts);
      past = [text(lasting())];
      at = 0;
      if (behind() !== "") read(parts, behind());
      settle();
    },
  };
}
