// The page: loads the stage, takes wishes, draws when there is something new to see.

import { Stage } from "stage";
import { Navigation } from "navigation";
import { Motion } from "motion";

const LUMENS_PER_WATT = 683;
// A picture that takes longer is drawn coarser while the camera moves [ms].
const PATIENCE_MS = 50;
const COARSE = 0.5;
// Traced mirrors and glass are left out while the camera moves where a picture takes longer [ms].
const FLUENT_MS = 100;
const by = (id) => document.getElementById(id);
const about = JSON.parse(by("about").textContent);
const query = new URLSearchParams(location.search);
const panel = by("panel"), fields = panel.elements, canvas = by("picture");
const shown = { layers: {}, line: 2, exposure_stops: about.exposure_stops, tone_map: about.tone_map, false_range: null, scale: 1 };
const stage = new Stage(canvas, about);
// Our own shaders by WebGPU on a canvas over ours: what is to be seen there, if anything, and whether it is at work.
const traced = { eye: null, view: null, isBusy: false, took: 0 };
let navigation, motion, range, slowest = 0, isDue = false, before = 0;
let exposureBase = about.exposure_stops;

// Files of later moments, by name; and how many have come, of those that the first picture needs.
const files = new Map();
const coming = { done: 0, all: about.maps.reduce((sum, map) => sum + Object.keys(map.layers).length, 1) };
async function read(name) {
  let bytes;
  if (globalThis.packedFile) bytes = globalThis.packedFile(name);
  else {
    const answer = await fetch(name);
    if (!answer.ok) throw new Error(`${name} is not there (${answer.status})`);
    bytes = new Uint8Array(await answer.arrayBuffer());
  }
  // Servers may unpack it themselves.
  if (bytes[0] === 0x1f && bytes[1] === 0x8b) {
    const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    bytes = new Uint8Array(await new Response(unpacked).arrayBuffer());
  }
  by("loading").querySelector("progress").value = ++coming.done / coming.all;
  return bytes;
}

const asset = (name) => files.get(name) ?? read(name);

/** Reads the files of all moments, so that they play without a halt. */
async function readAhead() {
  const layers = about.maps.flatMap((map) => Object.values(map.layers)).filter((names) => names.length > 1);
  for (let moment = 0; moment < about.frames.count; moment++) {
    for (const name of layers.map((names) => names[moment])) {
      if (name && !files.has(name)) files.set(name, read(name));
      // A file that does not come is missed when its moment is shown.
      await files.get(name)?.catch(() => {});
    }
  }
}

const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

function request() {
  if (isDue || !navigation) return;
  isDue = true;
  requestAnimationFrame(draw);
}

function draw(now) {
  isDue = false;
  const moved = navigation.isMoving;
  if (moved) navigation.advance(Math.min((now - before) / 1000, 0.1) || 0.016);
  before = now;
  const isMoving = moved || navigation.fingers.size > 0;
  shown.scale = isMoving && slowest > PATIENCE_MS ? COARSE : 1;
  navigation.place(stage.camera, canvas.clientWidth / canvas.clientHeight);
  stage.draw(shown);
  trace(isMoving);
  if (isMoving && shown.scale === 1) slowest = Math.max(slowest, stage.finish() - now);
  if (navigation.isMoving) request();
  else {
    before = 0;
    if (shown.scale < 1 && !navigation.fingers.size) request();
  }
  globalThis.nephroid.pictures++;
}

/** Mirrors and glass traced, where the browser has WebGPU: the address asks for it (?chains=1) or against it (0). */
async function startTracing() {
  const wish = query.get("chains");
  if (!about.chains || wish === "0") return;
  try {
    const { start } = await import("chains");
    traced.eye = await start({ canvas: by("chains"), asset, maps: stage.maps, isForced: wish === "1" });
  } catch (error) {
    by("missing").append(` Exact ones are left out: ${error.message}.`);
    return;
  }
  traced.eye.lost.then(() => { traced.eye = null; request(); });
  by("missing").textContent = "";
  request();
}

async function trace(isMoving) {
  const { exposure_stops: exposureStops, tone_map: toneMap, layers, line, false_range: falseColours } = shown;
  const { width, height } = canvas;
  const isLeftOut = !traced.eye || (isMoving && traced.took > FLUENT_MS);
  const view = { camera: stage.camera, width, height, exposureStops, toneMap, layers: { ...layers }, line, falseColours, moving: isMoving };
  traced.view = isLeftOut ? null : view;
  const show = (is) => { by("chains").style.visibility = is ? "visible" : "hidden"; };
  if (isLeftOut) show(false);
  if (traced.isBusy) return;
  traced.isBusy = true;
  for (let drawn; traced.eye && traced.view && traced.view !== drawn;) {
    drawn = traced.view;
    const began = performance.now();
    let goesOn = await traced.eye.draw(drawn);
    traced.took = performance.now() - began;
    show(goesOn && traced.view);
    while (goesOn && traced.view === drawn) goesOn = await traced.eye.refine();
  }
  traced.isBusy = false;
}

function resize() {
  const density = Math.min(devicePixelRatio, 2);
  stage.resize(Math.round(innerWidth * density), Math.round(innerHeight * density));
  request();
}

function expose(stops) {
  shown.exposure_stops = stops;
  const off = stops - exposureBase;
  fields.exposure.value = off;
  panel.querySelector("output").value = `${off < -0.05 ? "−" : "+"}${Math.abs(off).toFixed(1)} stops`;
  request();
}

/** Mirrors and glass show the layers that are on. */
const lookAgain = () => stage.look(nextFrame).then(request);

function divide(share) {
  shown.line = share;
  const divider = by("divider");
  divider.style.display = share <= 1 ? "block" : "none";
  divider.style.left = `${100 * share}%`;
  request();
}

function fillPanel() {
  document.title = panel.querySelector("h1").textContent = about.title;
  navigation.cameras.forEach((camera, index) => fields.camera.add(new Option(camera.userData.name ?? camera.name, index)));
  if (navigation.shown !== undefined) fields.camera.value = navigation.shown;
  fields.mode.value = navigation.mode;
  by("cameras").hidden = !navigation.cameras.length;
  for (const layer of about.layers) {
    const label = document.createElement("label");
    label.innerHTML = '<input type="checkbox" checked>';
    label.append(layer[0].toUpperCase() + layer.slice(1));
    label.firstChild.name = layer;
    label.firstChild.checked = shown.layers[layer];
    label.onchange = () => { shown.layers[layer] = label.firstChild.checked; request(); lookAgain(); };
    by("layers").append(label);
  }
  by("compare").hidden = !about.layers.includes("caustic");
  fields.tone_map.value = shown.tone_map;
  fields.camera.onchange = () => navigation.show(Number(fields.camera.value));
  for (const radio of fields.mode) radio.onchange = () => navigation.setMode(radio.value);
  fields.exposure.oninput = () => expose(exposureBase + Number(fields.exposure.value));
  fields.tone_map.onchange = () => { shown.tone_map = fields.tone_map.value; request(); };
  fields.compare.onchange = () => divide(fields.compare.checked ? 0.5 : 2);
  fields.colours.onchange = () => {
    shown.false_range = fields.colours.checked ? range : null;
    by("scale").style.display = fields.colours.checked ? "block" : "none";
    request();
  };
  by("divider").onpointermove = (event) => {
    if (event.buttons) divide(Math.max(0.02, Math.min(0.98, event.clientX / innerWidth)));
  };
  by("divider").onpointerdown = (event) => event.target.setPointerCapture(event.pointerId);
  by("divider").onkeydown = (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (step) { event.stopPropagation(); divide(Math.max(0.02, Math.min(0.98, shown.line + step))); }
  };
  const open = (is) => { panel.classList.toggle("open", is); by("menu").setAttribute("aria-expanded", is); };
  by("menu").onclick = () => open(!panel.classList.contains("open"));
  open(innerWidth > 600);
  const kinds = new Set(about.objects.map((object) => object.kind));
  const has = (...names) => names.some((name) => kinds.has(name));
  if (has("glass", "pane", "mirror", "coated")) {
    by("missing").textContent = "Mirrors and glass are approximated: they show what is around them, but no other glass.";
  }
}

/** Colours over the light that the first view shows, from a 64th of its white to 16 times that. */
function fillScale(stops) {
  // The irradiance [W/m²] by which a surface of albedo 1/2 is as white as the display.
  const white = (2 * Math.PI) / 2 ** stops;
  range = [white / 64, white * 16];
  const [bar, labels] = by("scale").children;
  const context = bar.getContext("2d");
  for (let x = 0; x < 256; x++) {
    context.fillStyle = `rgb(${stage.falseColour(x / 255).map((code) => Math.round(255 * code)).join()})`;
    context.fillRect(x, 0, 1, 1);
  }
  labels.replaceChildren(...[0, 1 / 3, 2 / 3, 1].map((part) => {
    const lux = LUMENS_PER_WATT * range[0] * (range[1] / range[0]) ** part;
    return Object.assign(document.createElement("span"), { textContent: `${Number(lux.toPrecision(2)).toLocaleString("en")} lx` });
  }));
}

/** What the address asks for: ?camera=NAME|NUMBER&layers=caustic,direct&exposure=STOPS&tone_map=NAME&mode=walk */
function obey() {
  const layers = query.get("layers")?.split(",");
  for (const layer of about.layers) shown.layers[layer] = !layers || layers.includes(layer);
  if (query.has("tone_map")) shown.tone_map = query.get("tone_map");
  const camera = query.get("camera");
  const found = navigation.cameras.findIndex((node, index) => [node.userData.name, node.name, String(index)].includes(camera));
  if (found >= 0) navigation.show(found);
  if (query.has("mode")) navigation.setMode(query.get("mode"));
}

async function start() {
  await stage.load(asset);
  navigation = new Navigation(stage, canvas, () => {
    if (!navigation) return;
    fields.mode.value = navigation.mode;
    if (navigation.shown !== undefined) fields.camera.value = navigation.shown;
    request();
  });
  globalThis.nephroid = { stage, navigation, shown, traced, pictures: 0, state: "drawing" };
  obey();
  fillPanel();
  resize();
  navigation.place(stage.camera, canvas.clientWidth / canvas.clientHeight);
  exposureBase = stage.suits(shown.layers);
  fillScale(exposureBase);
  expose(query.has("exposure") ? Number(query.get("exposure")) : exposureBase);
  await nextFrame();
  by("loading").classList.add("done");
  globalThis.nephroid.firstPicture_ms = performance.now();
  addEventListener("resize", resize);
  await lookAgain();
  await nextFrame();
  if (about.frames) {
    const show = (moment, seconds) => stage.show(asset, moment, seconds);
    motion = new Motion(by("motion"), about.frames, { show, changed: request, rested: lookAgain });
    globalThis.nephroid.motion = motion;
    navigation.keys.KeyT = () => motion.toggle();
    readAhead();
  }
  globalThis.nephroid.state = "done";
  await startTracing();
}

start().catch((error) => {
  by("loading").firstChild.textContent = `This scene cannot be shown: ${error.message}`;
  globalThis.nephroid = { state: "failed", error: String(error.stack ?? error) };
});
