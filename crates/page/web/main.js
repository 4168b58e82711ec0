// The page: a scene, its values, and the figures of its motion.
import { Animation } from "./animation.js";
import { Engine } from "./engine.js";
import { examples, rodsOf, sceneOf } from "./examples.js";
import { figuresOf, figuresOfCloud, Rows } from "./figures.js";
import { packed, unpacked } from "./link.js";
import { python, rust, saveCsv, saveScene, saveSvg } from "./takeaway.js";

const element = (id) => document.getElementById(id);
const [sceneText, errorText, status] = ["scene", "error", "status"].map(element);

/// The time after which a change of the text is run, in milliseconds.
const AFTER_TYPING = 350;
const MEMBERS = 200;
const TIMES = 60;
/// The names of a Lagrangian that was typed that become parameters.
const MOST_PARAMETERS = 12;

const state = {
  /// Values that are changed: the name of each, and the value.
  changes: new Map(),
  isBackward: false,
  coordinate: 0,
};
/// What the engine said: of the scene, of its motion, of the same by Runge-Kutta.
let [scene, answer, rows, peer, milliseconds] = [];
let [engine, animation, figures] = [undefined, undefined, []];

const changesOf = () => {
  const all = [...state.changes].map(([name, value]) => `${name}=${value}`);
  if (state.isBackward && scene) all.push(`run.time=${2 * scene.t - scene.end}`);
  return all;
};
const given = () => [...state.changes].map(([name, value]) => `${name}=${value}`);

const say = (text) => {
  element("said").textContent = text;
};

// Errors, at their place.

const showError = (error) => {
  sceneText.removeAttribute("aria-invalid");
  if (!error) {
    errorText.textContent = "";
    return;
  }
  const { message, nearest, line, column, length } = error;
  const advice = nearest ? `; did you mean ${nearest}?` : "";
  if (!line || error.of_change) {
    errorText.textContent = message + advice;
    return;
  }
  sceneText.setAttribute("aria-invalid", "true");
  const text = sceneText.value.split("\n")[line - 1] ?? "";
  const mark = " ".repeat(column - 1) + "^".repeat(Math.max(1, length));
  errorText.textContent = `line ${line}, column ${column}: ${message}${advice}\n${text}\n${mark}`;
  errorText.dataset.line = line;
};

/// Selects the place of an error in the scene.
const goToError = () => {
  const line = Number(errorText.dataset.line);
  if (!errorText.textContent.startsWith("line") || !line) return;
  const lines = sceneText.value.split("\n");
  const start = lines.slice(0, line - 1).reduce((sum, text) => sum + text.length + 1, 0);
  sceneText.focus();
  sceneText.setSelectionRange(start, start + (lines[line - 1]?.length ?? 0));
};

const faultOf = (message) =>
  `This is a fault of the program, please report this link: ${message}`;

// Running.

let isWanted = false;
let isRunning = false;
let isDragging = false;

/// Runs the scene with its present values, once the run that is under way has ended.
const wantRun = () => {
  isWanted = true;
  if (!isRunning) runAll();
};

const runAll = async () => {
  isRunning = true;
  element("stop").disabled = false;
  while (isWanted) {
    isWanted = false;
    await runOnce();
  }
  isRunning = false;
  element("stop").disabled = true;
};

const runOnce = async () => {
  const request = { scene: sceneText.value, changes: changesOf() };
  if (!isDragging) {
    const found = await engine.call("describe", { scene: request.scene, changes: given() });
    if (refused(found)) return;
    scene = found;
    request.changes = changesOf();
    showControls();
  }
  if (!scene || scene.kind === "path") {
    status.textContent = "A path between two positions is found by the program and by Python; give a motion from a start.";
    return;
  }
  // While a slider moves, the steps are those of the run before.
  const planned = isDragging ? stepsOf(answer) : {};
  if (!isDragging) status.textContent = "Running.";
  const began = performance.now();
  const found = await engine.call("run", { ...request, ...planned });
  if (found.stopped) {
    status.textContent = "Stopped.";
    status.className = "";
    return;
  }
  if (refused(found)) return;
  answer = isDragging ? { ...found, plan: found.plan ?? answer?.plan } : found;
  rows = new Rows(found.numbers, found.columns);
  peer = undefined;
  if (element("peer").checked && scene.kind === "motion") peer = await runPeer(request, found.evaluations);
  milliseconds = performance.now() - began;
  show();
  if (!isDragging && element("cloud").checked && scene.kind === "motion") await runCloud(request, found.evaluations);
  if (!isDragging && !answer.is_over && scene.kind === "motion" && !isWanted) await runCheck(request);
};

/// The steps of a run, by which it can be repeated.
const stepsOf = (of) => (of?.plan?.by ? { steps: [of.plan.by, of.plan.steps] } : {});

/// Shows the error of an answer, if it is one.
const refused = (found) => {
  if (found.stopped) return true;
  if (found.fault) {
    status.textContent = faultOf(found.fault);
    status.className = "wrong";
    return true;
  }
  showError(found.error);
  if (found.error) {
    status.textContent = "The scene has an error.";
    status.className = "wrong";
  }
  return Boolean(found.error);
};

const runPeer = async (request, evaluations) => {
  const found = await engine.call("run", { ...request, by: "runge_kutta", evaluations });
  if (found.error || found.fault || found.stopped) {
    say(found.error?.message ?? "");
    return undefined;
  }
  return new Rows(found.numbers, found.columns);
};

const runCloud = async (request, evaluations) => {
  const coordinate = state.coordinate;
  const [q, p] = [scene.coordinates[coordinate], scene.momenta[coordinate]];
  const of = { ...request, coordinate, members: MEMBERS, times: TIMES, radii: [radius(q), radius(p)], evaluations };
  const cloud = await engine.call("cloud", of);
  if (cloud.error || cloud.stopped || cloud.fault) {
    say(cloud.error?.message ?? cloud.fault ?? "");
    return;
  }
  if (cloud.failed) say(`${cloud.failed} of the starts did not reach the end.`);
  const other = element("peer").checked ? await engine.call("cloud", { ...of, by: "runge_kutta" }) : undefined;
  showFigures([...figures, ...figuresOfCloud(scene, cloud, other?.error || other?.stopped ? undefined : other, coordinate)]);
};

/// A tenth of the range of a column, or of its size where it does not move.
const radius = (name) => {
  let [low, high] = [Infinity, -Infinity];
  const of = rows.column(name);
  for (let row = 0; row < rows.count; row++) [low, high] = [Math.min(low, of(row)), Math.max(high, of(row))];
  return (high - low) / 20 || Math.abs(high) / 10 || 0.1;
};

/// Adds the defect of the contact form to the plan.
const runCheck = async (request) => {
  const found = await engine.call("check", { ...request, ...stepsOf(answer) });
  if (found.error || found.stopped || found.fault || found.contact_defect === null) return;
  const which = found.is_last ? "the last step" : "the first step";
  const lines = [
    `${which}, from t = ${found.t}: sigma_d = ${found.sigma}`,
    `the defect of the contact form is ${Number(found.contact_defect).toExponential(1)}: ` +
      (found.is_contact ? "the step is a contact transformation to round-off" : "a force or a reset does not keep the form"),
  ];
  element("plan").textContent += `\n${lines.join("\n")}`;
};

// What is shown.

const show = () => {
  const gaps = rows.columns.filter((name) => rows.gaps(name));
  const notes = [];
  if (answer.unresolved) notes.push(`warning: ${answer.unresolved}`);
  if (scene.warning) notes.push(`warning: ${scene.warning}`);
  if (gaps.length) notes.push(`Not a finite number in some rows: ${gaps.join(", ")}. The curves have gaps there.`);
  const integrator = answer.plan?.integrator ?? scene.control.integrator;
  const by = integrator ? ` by ${integrator}` : "";
  const error = answer.plan?.error ? `, estimated error ${answer.plan.error.toExponential(1)}` : "";
  status.textContent = [`${answer.status}; ${answer.steps} steps${by}${error}, in ${milliseconds.toFixed(0)} ms`, ...notes].join("\n");
  status.className = answer.is_right || answer.is_over ? "" : "wrong";
  animation.set(scene, rows, rodsOf(sceneText.value));
  showFigures(figuresOf(scene, rows, { coordinate: state.coordinate, peer, answer }));
  if (isDragging) return;
  element("plan").textContent = answer.plan?.text ?? "";
  const proved = scene.properties.filter((property) => property.is_proved);
  const items = [...proved.map(({ name, meaning }) => `${name}: ${meaning}`), ...scene.symmetries.map((momentum) => `${momentum} decays as the conformal factor`)];
  element("properties").replaceChildren(...items.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
};

const showFigures = (all) => {
  figures = all;
  const parts = all.map((figure) => {
    const part = document.createElement("figure");
    part.dataset.name = figure.name;
    const title = Object.assign(document.createElement("div"), { className: "title" });
    title.append(Object.assign(document.createElement("span"), { textContent: figure.title }));
    const save = Object.assign(document.createElement("button"), { type: "button", textContent: "SVG" });
    save.setAttribute("aria-label", `Save the figure ${figure.name} as SVG`);
    save.onclick = () => saveSvg(figure.name, part.querySelector('svg[role="img"]'));
    title.append(save);
    const picture = figure.svg;
    const svg = picture.tagName === "svg" ? picture : picture.querySelector(":scope > svg:last-of-type");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", figure.title);
    if (figure.start) makeDraggable(svg, picture, figure.start);
    part.append(title, picture);
    return part;
  });
  element("figures").replaceChildren(...parts);
};

/// Lets the start be dragged in a phase portrait.
let scales;
const makeDraggable = (svg, plot, { x, y }) => {
  svg.classList.add("grab");
  svg.onpointerdown = (event) => {
    scales = [plot.scale("x"), plot.scale("y")];
    isDragging = true;
    element("figures").setPointerCapture?.(event.pointerId);
    moveStart(event, svg, x, y);
    const move = (moved) => moveStart(moved, element("figures").querySelector('[data-name="phase"] svg[role="img"]') ?? svg, x, y);
    const end = () => {
      removeEventListener("pointermove", move);
      removeEventListener("pointerup", end);
      endDrag();
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end);
    event.preventDefault();
  };
};

const moveStart = (event, svg, x, y) => {
  const box = svg.getBoundingClientRect();
  const width = svg.viewBox.baseVal.width || box.width;
  const factor = width / box.width;
  const at = [(event.clientX - box.left) * factor, (event.clientY - box.top) * factor];
  const values = [scales[0].invert(at[0]), scales[1].invert(at[1])];
  [x, y].forEach((name, k) => {
    if (Number.isFinite(values[k]) && name in scene.start) setValue(`start.${name}`, Number(values[k].toPrecision(6)));
  });
  wantRun();
};

const endDrag = () => {
  isDragging = false;
  wantRun();
};

// Sliders and choices.

/// The interval of a slider about the value that the scene has.
const reach = (value) => (value === 0 ? [-2, 2] : [value - 2 * Math.abs(value), value + 2 * Math.abs(value)]);

let shown = "";

const showControls = () => {
  const names = [...Object.keys(scene.parameters), ...Object.keys(scene.start).map((name) => `start.${name}`)];
  const key = JSON.stringify([names, scene.integrators?.length, scene.kind, Object.keys(scene.control), sceneText.value]);
  if (key === shown) return;
  shown = key;
  const values = { ...scene.parameters, ...Object.fromEntries(Object.entries(scene.start).map(([name, x]) => [`start.${name}`, x])) };
  element("sliders").replaceChildren(...names.slice(0, 24).map((name) => slider(name, values[name])));
  for (const id of ["peer", "cloud"]) element(id).disabled = scene.kind !== "motion";
  const parts = [];
  if (scene.coordinates?.length > 1 && scene.kind === "motion") {
    state.coordinate = Math.min(state.coordinate, scene.coordinates.length - 1);
    parts.push(choice("Phase portrait of", scene.coordinates, scene.coordinates[state.coordinate], (name) => {
      state.coordinate = scene.coordinates.indexOf(name);
      wantRun();
    }));
  } else {
    state.coordinate = 0;
  }
  if (scene.integrators) {
    const chosen = scene.control.integrator ?? "chosen";
    parts.push(choice("Integrator", ["chosen", ...scene.integrators], chosen, (name) => {
      if (name === "chosen") {
        state.changes.delete("run.integrator");
        if (!("accuracy" in scene.control)) setValue("run.accuracy", 1e-9);
      } else setValue("run.integrator", name);
      wantRun();
    }));
  }
  const [name, value] = ["accuracy", "step", "steps"].map((name) => [name, scene.control[name]]).find(([, value]) => value !== undefined);
  parts.push(number(name, value, (x) => {
    setValue(`run.${name}`, x);
    wantRun();
  }));
  parts.push(number("time", scene.end, (x) => {
    setValue("run.time", x);
    wantRun();
  }));
  element("method").replaceChildren(...parts);
};

const setValue = (name, value) => {
  state.changes.set(name, value);
  for (const input of document.querySelectorAll("#sliders input")) {
    if (input.dataset.name === name && document.activeElement !== input) input.value = value;
  }
};

const labelled = (text, control) => {
  const label = document.createElement("label");
  label.append(`${text} `, control);
  return label;
};

const choice = (text, names, chosen, changed) => {
  const select = document.createElement("select");
  select.append(...names.map((name) => new Option(name, name, false, name === chosen)));
  select.onchange = () => changed(select.value);
  return labelled(text, select);
};

const number = (text, value, changed) => {
  const input = Object.assign(document.createElement("input"), { size: 8, value, inputMode: "decimal" });
  input.onchange = () => {
    const x = Number(input.value);
    if (Number.isFinite(x) && input.value.trim()) changed(x);
    else say(`${text} must be a number`);
  };
  return labelled(text, input);
};

const slider = (name, value) => {
  const [low, high] = reach(value);
  const row = Object.assign(document.createElement("div"), { className: "slider" });
  const range = Object.assign(document.createElement("input"), { type: "range", min: low, max: high, step: (high - low) / 400, value });
  const exact = Object.assign(document.createElement("input"), { value, inputMode: "decimal" });
  const label = Object.assign(document.createElement("label"), { textContent: name });
  label.htmlFor = range.id = `slider-${name}`;
  exact.setAttribute("aria-label", `${name}, the number`);
  range.dataset.name = exact.dataset.name = name;
  range.oninput = () => {
    isDragging = true;
    const x = Number(Number(range.value).toPrecision(6));
    exact.value = x;
    setValue(name, x);
    wantRun();
  };
  range.onchange = endDrag;
  exact.onchange = () => {
    const x = Number(exact.value);
    if (!Number.isFinite(x) || !exact.value.trim()) {
      say(`${name} must be a number`);
      return;
    }
    range.value = x;
    setValue(name, x);
    wantRun();
  };
  row.append(label, range, exact);
  return row;
};

// The scene.

const setScene = (text, changes = []) => {
  sceneText.value = text;
  state.changes = new Map(changes.map((change) => change.split(/=(.*)/s).slice(0, 2)));
  state.isBackward = false;
  state.coordinate = 0;
  element("backward").setAttribute("aria-pressed", "false");
  element("code").hidden = true;
  say("");
  answer = undefined;
  animation?.restart();
  wantRun();
};

const chooseExample = (name) => {
  const example = examples.find((known) => known.name === name) ?? examples[0];
  element("example").value = example.name;
  setScene(example.scene, example.changes);
};

/// A scene of a Lagrangian that was typed: names that the engine does not know become parameters.
const makeScene = async (lagrangian) => {
  const parameters = {};
  for (let k = 0; k < MOST_PARAMETERS; k++) {
    const text = sceneOf(lagrangian, parameters);
    const { error } = await engine.call("describe", { scene: text });
    const unknown = /unknown name `([A-Za-z_]\w*)`/.exec(error?.message ?? "")?.[1];
    if (!unknown || unknown in parameters) return setScene(text);
    parameters[unknown] = unknown.startsWith("gamma") ? "-0.1" : "1.0";
  }
  return setScene(sceneOf(lagrangian, parameters));
};

/// The scene with the changed values in their places. Where one is not found in the text, the changes stay beside it.
const wholeScene = async () => {
  let text = sceneText.value;
  for (const [name, value] of state.changes) {
    const key = name.replace(/^(start|run)\./, "");
    const table = name.startsWith("start.") ? "start" : name.startsWith("run.") ? "run" : "system";
    const escaped = key.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    const number = typeof value === "number" && Number.isInteger(value) ? `${value}.0` : value;
    const written = key === "integrator" ? `"${value}"` : key === "steps" ? value : number;
    const of = text.split(/^(?=\[)/m);
    const at = of.findIndex((part) => part.startsWith(`[${table}`));
    if (at < 0) continue;
    of[at] = of[at].replace(new RegExp(`(^|[{,\\s])(["']?${escaped}["']?\\s*=\\s*)("[^"\\n]*"|[^,}\\n#]+?)(?=\\s*(?:[,}\\n#]|$))`), `$1$2${written}`);
    text = of.join("");
  }
  const whole = await engine.call("describe", { scene: text });
  const now = await engine.call("describe", { scene: sceneText.value, changes: given() });
  const same = ["parameters", "start", "t", "end", "control"].every((key) => JSON.stringify(whole[key]) === JSON.stringify(now[key]));
  return same ? { text, changes: [] } : { text: sceneText.value, changes: given() };
};

// The buttons.

const showCode = async (of) => {
  const { text, changes } = await wholeScene();
  element("code").hidden = false;
  element("code").textContent = of(changes);
  saveScene(text);
};

const connect = () => {
  element("example").append(...examples.map(({ name, title }) => new Option(title, name)));
  element("example").onchange = () => chooseExample(element("example").value);
  element("quick").onsubmit = (event) => {
    event.preventDefault();
    if (element("lagrangian").value.trim()) makeScene(element("lagrangian").value.trim());
  };
  let typing;
  sceneText.oninput = () => {
    clearTimeout(typing);
    typing = setTimeout(() => {
      state.changes.clear();
      wantRun();
    }, AFTER_TYPING);
  };
  sceneText.onkeydown = (event) => {
    if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) wantRun();
  };
  errorText.onclick = goToError;
  element("run").onclick = wantRun;
  element("stop").onclick = () => {
    isWanted = false;
    engine.stop();
  };
  element("backward").onclick = () => {
    state.isBackward = !state.isBackward;
    element("backward").setAttribute("aria-pressed", state.isBackward);
    wantRun();
  };
  for (const id of ["peer", "cloud"]) element(id).onchange = wantRun;
  element("link").onclick = async () => {
    location.hash = await packed({ scene: sceneText.value, changes: given() });
    try {
      await navigator.clipboard.writeText(location.href);
      say("The link is copied.");
    } catch {
      say("The link is in the address of the page.");
    }
  };
  element("csv").onclick = () => {
    if (rows) saveCsv(rows, scene.kind === "lattice" ? rows.columns : scene.columns);
  };
  element("save").onclick = async () => {
    const { text, changes } = await wholeScene();
    saveScene(changes.length ? `${text}\n# with ${changes.map((change) => `--set ${change}`).join(" ")}\n` : text);
  };
  element("python").onclick = () => showCode(python);
  element("rust").onclick = () => showCode(rust);
  element("theme").onclick = () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  element("play").onclick = () => {
    element("play").textContent = animation.toggle() ? "Pause" : "Play";
  };
  element("again").onclick = () => animation.restart();
  addEventListener("hashchange", openLink);
};

const setTheme = (theme) => {
  document.documentElement.dataset.theme = theme;
  if (rows) show();
};

/// Opens the scene of the address, if it has one that is another than that which is shown.
const openLink = async () => {
  const opened = location.hash.length > 1 ? await unpacked(location.hash.slice(1)) : undefined;
  if (opened && opened.scene === sceneText.value && JSON.stringify(opened.changes) === JSON.stringify(given())) return true;
  if (opened) setScene(opened.scene, opened.changes);
  return Boolean(opened);
};

const begin = async () => {
  setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  connect();
  try {
    engine = await Engine.load();
  } catch (error) {
    status.textContent = `The engine does not start in this browser: ${error.message}. It needs WebAssembly with vector instructions.`;
    status.className = "wrong";
    return;
  }
  animation = new Animation(element("canvas"), element("clock"));
  if (await openLink()) return;
  chooseExample(examples[0].name);
  if (location.hash.length > 1) say("The link of this address is damaged; this is the first example.");
};

begin();
