// The page: loads the scene, takes wishes, draws when there is something new to see.

import { EyePass, openDevice } from "eye_pass";
import { opened, read } from "files";
import { Motion } from "motion";
import { Navigation } from "navigation";

const LUMENS_PER_WATT = 683;
// How a moving picture is drawn, from fine to coarse: pixels per pixel of the screen, and of what is traced per pixel,
// along a side; last, without what is traced.
const LEVELS = [[1, 1], [1, 0.5], [1, 0.25], [0.5, 0.25], [0.5, 0.125], [0.5, 0]];
// A moving picture that takes longer is drawn coarser, a faster one finer; above the last, without what is traced [ms].
const LATE_MS = 50, EARLY_MS = 14, HOPELESS_MS = 400;
// Pictures of a view at rest, each through other places of its pixels; surfaces that split chains, moving and at rest.
const MOST_PICTURES = 64, BRANCHING = [2, 4];
const by = (id) => document.getElementById(id);
const about = JSON.parse(by("about").textContent);
const query = new URLSearchParams(location.search);
const panel = by("panel"), fields = panel.elements, canvas = by("picture");
const shown = { layers: {}, line: 2, exposureStops: 0, toneMap: about.tone_map, colours: null };
const state = (globalThis.nephroid = { state: "loading", shown, drawn: 0, level: 0 });
// Files of moments, by name, and the first of them, which others differ from.
const files = new Map();
let eye, navigation, first, range, exposureBase;
// Whether something has changed since the last picture was begun; what waits for one.
let isDue = true, wake = () => {}, turn = Promise.resolve();

const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));
const asset = (name) => files.get(name) ?? files.set(name, read(name)).get(name);
const request = () => { isDue = true; state.drawn = 0; wake(); };
// Runs one thing after the other that uses the device.
const inTurn = (task) => (turn = turn.then(task, task));

/** Shows another moment: its light, and what has moved. */
async function show(moment) {
  const scene = moment ? opened(await asset(about.moments[moment]), first) : first;
  // What is drawn meanwhile is given up.
  request();
  await inTurn(() => eye.show(scene));
}

/** Draws coarser while something moves, and finer and finer at rest. */
async function drawAll() {
  let before = 0, isRefined = false, finer = 0;
  for (;;) {
    const now = await nextFrame(), moved = navigation.isMoving;
    if (moved) navigation.advance(Math.min((now - before) / 1000, 0.1) || 0.016);
    before = moved ? now : 0;
    if (isDue || moved) {
      isDue = false;
      await inTurn(() => drawMoving());
      [isRefined, finer] = [false, state.level - 1];
    } else if (!navigation.fingers.size && !state.motion?.isPlaying && eye.count < (isRefined ? MOST_PICTURES : Infinity)) {
      // Slow devices show something finer first.
      const [scale, traced] = LEVELS[Math.max(finer, 0)], isLast = finer < 1;
      const wanted = view(scale, traced, isLast);
      isRefined = (await inTurn(() => eye.draw(wanted, isRefined, () => isDue)) && isLast) || isRefined;
      finer -= 1;
    } else {
      await new Promise((resolve) => { wake = resolve; });
    }
    // Pictures in the mean of the view at rest.
    state.drawn = isRefined && !isDue ? eye.count : 0;
  }
}

async function drawMoving() {
  const [scale, traced] = LEVELS[state.level];
  const began = performance.now();
  await eye.draw(view(scale, traced, false));
  const took = performance.now() - began, isLast = state.level >= LEVELS.length - 2;
  if (eye.isFresh) return request();
  if (took > (isLast ? HOPELESS_MS : LATE_MS)) state.level = Math.min(state.level + 1, LEVELS.length - 1);
  else if (took < EARLY_MS) state.level = Math.max(state.level - 1, 0);
}

function view(scale, traced, isResting) {
  const density = Math.min(devicePixelRatio, 2) * scale;
  const [width, height] = [innerWidth, innerHeight].map((side) => Math.max(Math.round(side * density), 1));
  const [camera, branching] = [navigation.camera(width / height), BRANCHING[Number(isResting)]];
  return { ...shown, layers: { ...shown.layers }, width, height, traced, isResting, branching, camera };
}

function expose(stops) {
  shown.exposureStops = stops;
  const off = stops - exposureBase;
  fields.exposure.value = off;
  panel.querySelector("output").value = `${off < -0.05 ? "−" : "+"}${Math.abs(off).toFixed(1)} stops`;
  request();
}

function divide(share) {
  shown.line = share;
  Object.assign(by("divider").style, { display: share <= 1 ? "block" : "none", left: `${100 * share}%` });
  by("divider").ariaValueNow = Math.round(100 * share);
  request();
}

function fillPanel() {
  document.title = panel.querySelector("h1").textContent = about.title;
  about.cameras.forEach(({ name }, index) => fields.camera.add(new Option(name, index)));
  for (const layer of about.layers) {
    const label = document.createElement("label");
    label.innerHTML = '<input type="checkbox">';
    label.append(layer[0].toUpperCase() + layer.slice(1));
    Object.assign(label.firstChild, { name: layer, checked: shown.layers[layer] });
    label.onchange = () => { shown.layers[layer] = label.firstChild.checked; request(); };
    by("layers").append(label);
  }
  by("compare").hidden = !about.layers.includes("caustic");
  fields.tone_map.value = shown.toneMap;
  fields.camera.onchange = () => navigation.show(Number(fields.camera.value));
  for (const radio of fields.mode) radio.onchange = () => navigation.setMode(radio.value);
  fields.exposure.oninput = () => expose(exposureBase + Number(fields.exposure.value));
  fields.tone_map.onchange = () => { shown.toneMap = fields.tone_map.value; request(); };
  fields.compare.onchange = () => divide(fields.compare.checked ? 0.5 : 2);
  fields.colours.onchange = () => {
    shown.colours = fields.colours.checked ? range : null;
    by("scale").style.display = fields.colours.checked ? "block" : "none";
    request();
  };
  const within = (share) => divide(Math.max(0.02, Math.min(0.98, share)));
  by("divider").onpointermove = (event) => { if (event.buttons) within(event.clientX / innerWidth); };
  by("divider").onpointerdown = (event) => event.target.setPointerCapture(event.pointerId);
  by("divider").onkeydown = (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (step) { event.stopPropagation(); within(shown.line + step); }
  };
  const open = (is) => by("menu").setAttribute("aria-expanded", panel.classList.toggle("open", is));
  by("menu").onclick = () => open(!panel.classList.contains("open"));
  open(innerWidth > 600);
}

/** Colours over the light that the first view shows, from a 64th of its white to 16 times that. */
function fillScale(stops) {
  // The irradiance [W/m²] by which a surface of albedo 1/2 is as white as the display.
  const white = (2 * Math.PI) / 2 ** stops;
  range = [white / 64, white * 16];
  const [bar, labels] = by("scale").children;
  bar.style.background = `linear-gradient(90deg, ${about.colours.join()})`;
  labels.replaceChildren(...[0, 1 / 3, 2 / 3, 1].map((part) => {
    const lux = LUMENS_PER_WATT * range[0] * (range[1] / range[0]) ** part;
    return Object.assign(document.createElement("span"), { textContent: `${Number(lux.toPrecision(2)).toLocaleString("en")} lx` });
  }));
}

/** What the address asks for: ?camera=NAME|NUMBER&layers=caustic,direct&exposure=STOPS&tone_map=NAME&mode=walk */
function obey() {
  const layers = query.get("layers")?.split(",");
  for (const layer of about.layers) shown.layers[layer] = !layers || layers.includes(layer);
  if (fields.tone_map.querySelector(`[value="${CSS.escape(query.get("tone_map") ?? "")}"]`)) shown.toneMap = query.get("tone_map");
  const camera = query.get("camera");
  const found = about.cameras.findIndex(({ name }, index) => [name, String(index)].includes(camera));
  if (found > 0) navigation.show(found);
  if (["fly", "walk", "orbit"].includes(query.get("mode"))) navigation.setMode(query.get("mode"));
  exposureBase = about.cameras[navigation.shown].exposure_stops;
  fillPanel();
  fillScale(exposureBase);
  expose(query.has("exposure") ? Number(query.get("exposure")) : exposureBase);
}

/** Leaves the still picture, and says why. */
function stayStill(error) {
  document.body.className = "still";
  by("told").textContent = `This is a still picture of the scene's first camera: ${error.message}.`;
  Object.assign(state, { state: "still", error: String(error.stack ?? error) });
}

async function start() {
  const file = read(about.moments[0], (share) => { by("loading").lastChild.value = share; });
  file.catch(() => {});
  const { device, isSoftware } = await openDevice();
  device.lost.then(({ message, reason }) => stayStill(new Error(`the graphics device is lost (${message || reason})`)));
  device.pushErrorScope("out-of-memory");
  device.pushErrorScope("validation");
  first = opened(await file);
  eye = new EyePass(device, canvas, first);
  navigation = new Navigation(about, () => eye.geometry, canvas, () => {
    if (!navigation) return;
    fields.mode.value = navigation.mode;
    fields.camera.value = navigation.shown;
    request();
  });
  Object.assign(state, { eye, navigation, level: isSoftware ? LEVELS.length - 1 : 0 });
  obey();
  await drawMoving();
  if (isSoftware) state.level = LEVELS.length - 2;
  const error = (await device.popErrorScope()) ?? (await device.popErrorScope());
  if (error) throw new Error(`the graphics device refused the scene (${error.message})`);
  document.body.className = "ready";
  await nextFrame();
  Object.assign(state, { state: "drawing", firstPicture_ms: performance.now() });
  addEventListener("resize", request);
  if (about.moments.length > 1) {
    state.motion = new Motion(by("motion"), about.moments.length, about.fps, { show, changed: request });
    navigation.keys.KeyT = () => state.motion.toggle();
    // So that they play without a halt; a file that does not come is missed when its moment is shown.
    about.moments.slice(1).reduce((last, name) => last.then(() => asset(name)).catch(() => {}), Promise.resolve());
  }
  await drawAll();
}

start().catch(stayStill);
