/* The machine along its course: a bar of time below the picture, which plays, and the curves of some points beside it. `course` is what
   course(...) gives; comes to what takes a course. */
function alongCourse(s, picture, course, page) {
  const { byId, make } = page;
  /* Time in which a course is played, ms, and points that are drawn unless others are chosen. */
  const [PLAYED, MOST] = [12000, 4];
  const SIZE = [560, 260];
  let found = null;
  let figure = null;
  let isPlaying = false;
  const isAlong = () => byId("over-time").checked;
  const share = () => Number(byId("time").value) / 1000;

  const last = () => found.samples[found.samples.length - 1];
  /* State at a time, between two samples straight from one to the other. */
  function at(time) {
    const k = Math.max(1, found.samples.findIndex((own) => own.time >= time));
    const [early, late] = [found.samples[k - 1], found.samples[k]];
    const part = (time - early.time) / (late.time - early.time);
    const mixed = (one, other) => one.map((value, i) => value + part * (other[i] - value));
    return { x: mixed(early.x, late.x), values: mixed(early.at.values, late.at.values), away: mixed(away(early), away(late)) };
  }
  const away = ({ state, at: { steady } }) => steady.map((value, k) => state[k] - value);

  /* Points whose curves are drawn: one, or those that move most; temperatures alone. */
  const temperatures = s.points.map((_, p) => p).filter((p) => s.points[p].unit === "degC");
  const reach = (p) => Math.abs(found.samples[0].values[p] - last().values[p]);
  const drawn = () => {
    const chosen = byId("warming").value;
    if (chosen !== "most") return [Number(chosen)];
    return temperatures.slice().sort((a, b) => reach(b) - reach(a)).slice(0, MOST);
  };
  byId("warming").append(make("option", "that move most", { value: "most" }), ...temperatures.map((p) => make("option", s.points[p].name, { value: p })));

  function show() {
    byId("time").disabled = !isAlong();
    byId("warm-up").hidden = !isAlong();
    if (!found || !isAlong()) {
      byId("clock").textContent = "";
      picture.along(null);
      return;
    }
    const time = share() * last().time;
    const text = `${course.spell(time).text} of ${course.spell(last().time).text}`;
    byId("clock").textContent = text;
    byId("time").setAttribute("aria-valuetext", text);
    if (figure) figure.at(time);
    picture.along(at(time));
  }
  function draw() {
    if (!found || !isAlong()) return;
    /* The colours hold for the whole course. */
    const some = found.samples.filter((_, k) => k % 16 === 0).concat(last());
    picture.span(some.map((own) => ({ x: own.x, values: own.at.values, away: away(own) })));
    figure = course.draw("degC", drawn(), found, SIZE);
    byId("curves").replaceChildren(figure.svg);
  }
  const redraw = () => { draw(); show(); page.note(); };

  let before = 0;
  function play(time) {
    if (!isPlaying) return;
    const next = share() + Math.max(0, time - before) / PLAYED;
    before = time;
    byId("time").value = String(1000 * Math.min(1, next));
    show();
    if (next >= 1) turn(false); else requestAnimationFrame(play);
  }
  function turn(is) {
    isPlaying = is;
    byId("play").textContent = is ? "Pause" : "Play";
    if (is) requestAnimationFrame((time) => { before = time; play(time); });
  }
  byId("play").addEventListener("click", () => {
    if (!isPlaying) {
      byId("over-time").checked = true;
      if (share() >= 1) byId("time").value = "0";
      draw();
    }
    turn(!isPlaying);
    page.note();
  });
  byId("over-time").addEventListener("change", () => { turn(false); redraw(); });
  byId("time").addEventListener("input", () => { turn(false); show(); page.note(); });
  byId("warming").addEventListener("change", redraw);
  for (const id of ["over-time", "time", "warming"]) page.link.control(id);
  page.onUnits.push(redraw);
  return {
    take(course) {
      found = course;
      draw();
      show();
    },
    /* Without a course, as at other values of held variables, the picture is that of the steady state. */
    hide(is) {
      byId("along").hidden = is;
      if (!is) return;
      turn(false);
      found = null;
      show();
    },
  };
}
