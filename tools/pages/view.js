// SPDX-License-Identifier: BSD-3-Clause
// Puts the page together: what the run was, the stage, the plots, and the controls that move the time.
"use strict";
(() => {
  const page = document.documentElement, at = (id) => document.getElementById(id);
  const end = Math.max(...run.systems.map((system) => system.motion.end));

  function writeHead() {
    const title = run.title || "A run";
    document.title = `${title} – Delassus`;
    at("title").textContent = title;
    const whole = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
    const facts = run.systems.map(({ name, integrator, solver, step, steps, bodies, frames, motion, contacts_left_out: many }) =>
      (run.systems.length > 1 ? `${name}: ` : "") + [
        whole(bodies.length, "body").replace("bodys", "bodies"), `${whole(steps, "step")} of ${brief(step)} s`, integrator.replaceAll("_", " "),
        ...(solver ? [`solver ${solver}`] : []),
        ...(motion.t.length < frames ? [`${motion.t.length} of ${frames} frames shown, evenly chosen`] : []),
        ...(many ? ["too many contacts to show"] : []),
      ].join(", "));
    at("facts").replaceChildren(...facts.map((text) => Object.assign(document.createElement("span"), { textContent: text })));
    if (run.status === "finished") return;
    at("status").textContent = `The run is ${run.status}; the page shows what is there. ${run.message}`;
    at("status").hidden = false;
  }

  // Without WebGL there is a sentence in place of the stage, and the plots remain.
  function makeStage() {
    try {
      const stage = new Stage(at("stage"));
      page.dataset.webgl = "yes";
      return stage;
    } catch (error) {
      page.dataset.webgl = "no";
      at("stage").replaceChildren(Object.assign(document.createElement("p"), {
        className: "sentence",
        textContent: `This browser cannot draw the motion, which needs WebGL (${error.message}). The plots still show the run.` }));
      return null;
    }
  }

  writeHead();
  const names = ["energy", "drift", "penetration", "contacts", "solver_iterations"];
  const stage = makeStage();
  const shown = names.filter(Plot.worthShowing);
  const plots = (shown.length > 0 ? shown : ["energy"]).map((name) => new Plot(name, end, setTime));
  page.dataset.plots = plots.length;

  const slider = at("time"), clock = at("clock"), play = at("play"), speed = at("speed");
  let time = 0, playing = false, last = null;

  function setTime(wanted) {
    time = Math.min(end, Math.max(0, wanted));
    slider.value = end > 0 ? time / end : 0;
    clock.textContent = `${time.toFixed(end < 10 ? 3 : 2)} s`;
    page.dataset.time = time;
    for (const system of run.systems) system.motion.moveTo(time);
    for (const plot of plots) plot.show(time);
    if (stage) stage.requestFrame();
  }

  function setPlaying(wanted) {
    playing = wanted;
    play.textContent = playing ? "Pause" : "Play";
    if (!playing) return;
    if (time >= end) setTime(0);
    last = null;
    requestAnimationFrame(tick);
  }

  function tick(now) {
    if (!playing) return;
    // At most a tenth of a second: a page that was hidden goes on from where it was.
    if (last !== null) setTime(time + Math.min(0.1, (now - last) / 1000) * Number(speed.value));
    last = now;
    if (time >= end) setPlaying(false);
    else requestAnimationFrame(tick);
  }

  // At first real time for 2 to 30 s, else the slowest speed at which the whole takes at most ten seconds.
  function fillSpeeds() {
    const speeds = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];
    const first = end >= 2 && end <= 30 ? 1 : speeds.find((value) => end / value <= 10) || 100;
    for (const value of speeds) speed.append(new Option(`${value} ×`, value, false, value === first));
  }

  function addSwitch(label, apply, on) {
    const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: on });
    const whole = document.createElement("label");
    whole.append(box, label);
    const change = () => {
      apply(box.checked);
      stage.requestFrame();
    };
    box.onchange = change;
    change();
    at("switches").append(whole);
  }

  function fillSwitches() {
    const part = (name) => (visible) => stage.views.forEach((view) => (view.parts[name].visible = visible));
    const any = (name) => stage.views.some((view) => view.parts[name].children.length > 0);
    if (any("fixed")) addSwitch("fixed bodies", part("fixed"), true);
    if (any("joints")) addSwitch("joints", part("joints"), true);
    if (any("contacts")) addSwitch("contacts", part("contacts"), false);
    if (stage.views.length < 2) return;
    stage.views.forEach((view, k) => {
      addSwitch(run.systems[k].name, (visible) => (view.group.visible = visible), true);
      at("switches").lastChild.style.color = lineColours[k % lineColours.length];
    });
  }

  play.onclick = () => setPlaying(!playing);
  slider.oninput = () => setTime(slider.value * end);
  if (stage) {
    at("fit").onclick = () => stage.fit();
    addEventListener("beforeprint", () => stage.draw()); // what was drawn before is not on the paper
  }
  at("fit").hidden = !stage;
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const actions = {
      " ": () => setPlaying(!playing),
      ArrowLeft: () => setTime(time - end / 200),
      ArrowRight: () => setTime(time + end / 200),
      Home: () => setTime(0),
      End: () => setTime(end),
      f: () => stage && stage.fit(),
    };
    if (!(event.key in actions) || event.target === speed) return;
    event.preventDefault(); // a space would also press the button that has the focus
    actions[event.key]();
  });

  fillSpeeds();
  if (stage) fillSwitches();
  setTime(0);
})();
