// A camera that flies, walks or orbits, by keys, mouse and touch: the keys of the program's window.

import { along, dot, length, scaled } from "geometry";

// As in the window: time in which the velocity has closed 1 − 1/e of its gap [s], speeds in scene radii per second and
// [m/s], height of the eyes [m], turn of a look [rad per pixel].
const SETTLING_S = 0.08, FLYING = 0.6, WALKING_M_PER_S = 1.4, EYES_M = 1.6, RUN = 4, LOOK_RAD = 0.004;
// Nearest that walls and orbited points come [m, radii].
const WALL_M = 0.25, NEAREST = 1e-3;
const MODES = ["fly", "walk", "orbit"];
const AXES = { KeyD: [0, 1], KeyA: [0, -1], KeyE: [1, 1], KeyQ: [1, -1], KeyW: [2, 1], KeyS: [2, -1],
  ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [2, 1], ArrowDown: [2, -1] };
const unit = (vector) => scaled(vector, 1 / (length(vector) || 1));

export class Navigation {
  /** `geometry()` gives that of the present moment, `changed` follows every change. */
  constructor({ bounds_m: [low, high], cameras }, geometry, element, changed) {
    Object.assign(this, { geometry, element, changed, cameras, mode: "fly", held: new Set(), fingers: new Map(), next: 0 });
    this.centre = scaled(along(low, high, 1), 0.5);
    this.radius = Math.max(length(along(high, low, -1)) / 2, 1e-6);
    // What single keys do.
    this.keys = {
      KeyC: () => this.show(this.next),
      KeyF: () => this.frame(),
      KeyV: () => this.setMode(MODES[(MODES.indexOf(this.mode) + 1) % MODES.length]),
    };
    this.show(0);
    this.listen();
  }

  get forward() {
    const level = Math.cos(this.pitch);
    return [Math.sin(this.yaw) * level, Math.sin(this.pitch), -Math.cos(this.yaw) * level];
  }

  get right() { return [Math.cos(this.yaw), 0, Math.sin(this.yaw)]; }

  stand(position, [x, y, z], fov) {
    this.pitch = Math.asin(Math.max(-1, Math.min(1, y)));
    if (Math.hypot(x, z) > 1e-6) this.yaw = Math.atan2(x, -z);
    Object.assign(this, { position, fov, yaw: this.yaw ?? 0 });
    this.setMode(this.mode);
  }

  show(index) {
    Object.assign(this, { next: (index + 1) % this.cameras.length, shown: index });
    const { position_m: position, forward, fov_rad: fov } = this.cameras[index];
    this.stand(position, forward, fov);
  }

  /** So that the scene fills the picture. */
  frame() {
    const backward = unit([-0.5, 0.55, 0.67]);
    const aspect = this.element.clientWidth / Math.max(this.element.clientHeight, 1);
    const half = Math.min(0.4, Math.atan(Math.tan(0.4) * aspect));
    this.stand(along(this.centre, backward, this.radius / Math.sin(half)), scaled(backward, -1), 0.8);
  }

  setMode(mode) {
    Object.assign(this, { mode, velocity: [0, 0, 0], orbit: null });
    this.changed();
  }

  // The point that is orbited lies where the gaze meets something.
  measureOrbit() {
    const ahead = dot(along(this.centre, this.position, -1), this.forward);
    this.orbit ??= this.geometry().meets(this.position, this.forward) ?? (ahead > 0 ? ahead : this.radius);
  }

  turn(across, down) {
    const isOrbit = this.mode === "orbit";
    if (isOrbit) this.measureOrbit();
    const pivot = isOrbit && along(this.position, this.forward, this.orbit);
    this.yaw += LOOK_RAD * across;
    this.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.pitch - LOOK_RAD * down));
    if (isOrbit) this.position = along(pivot, this.forward, -this.orbit);
    this.changed();
  }

  /** Nearer by a factor where it orbits, else a step ahead. */
  approach(steps) {
    if (this.mode === "orbit") {
      this.measureOrbit();
      const nearer = Math.max(this.orbit * 0.9 ** steps, NEAREST * this.radius);
      this.position = along(this.position, this.forward, this.orbit - nearer);
      this.orbit = nearer;
    } else {
      this.go(scaled(this.forward, 0.08 * steps * (this.mode === "walk" ? WALKING_M_PER_S : this.radius)));
    }
    this.changed();
  }

  go(way) {
    if (this.mode === "walk") {
      way[1] = 0;
      const far = length(way);
      const ahead = far > 0 ? this.geometry().meets(this.position, unit(way), far + WALL_M) : undefined;
      if (ahead !== undefined) way = scaled(unit(way), Math.max(Math.min(ahead - WALL_M, far), 0));
    }
    this.position = along(this.position, way, 1);
    if (this.mode !== "orbit") this.orbit = null;
  }

  get isMoving() {
    return length(this.velocity) > 0 || [...this.held].some((key) => AXES[key]) || Boolean(this.falls);
  }

  /** Lets time pass [s]. */
  advance(seconds) {
    const asked = [0, 0, 0], isWalking = this.mode === "walk", { forward } = this;
    for (const key of this.held) if (AXES[key]) asked[AXES[key][0]] += AXES[key][1];
    const run = this.held.has("ShiftLeft") || this.held.has("ShiftRight") ? RUN : 1;
    const speed = run * (isWalking ? WALKING_M_PER_S : FLYING * this.radius);
    const ahead = isWalking ? unit([forward[0], 0, forward[2]]) : forward;
    let goal = along(scaled(this.right, Math.sign(asked[0])), ahead, Math.sign(asked[2]));
    if (!isWalking) goal[1] += Math.sign(asked[1]);
    goal = scaled(unit(goal), length(goal) > 0 ? speed : 0);
    const left = Math.exp(-seconds / SETTLING_S), gap = along(this.velocity, goal, -1);
    this.go(along(scaled(goal, seconds), gap, SETTLING_S * (1 - left)));
    this.velocity = along(goal, gap, left);
    if (length(goal) === 0 && length(this.velocity) < 1e-3 * speed) this.velocity = [0, 0, 0];
    this.falls = isWalking && this.keepToGround(seconds);
  }

  keepToGround(seconds) {
    const below = this.geometry().meets(this.position, [0, -1, 0]);
    const gap = below === undefined ? 0 : EYES_M - below;
    this.position[1] += gap * (1 - Math.exp(-seconds / (2 * SETTLING_S)));
    return Math.abs(gap) > 1e-3;
  }

  /** The camera for a picture of that aspect (width/height): a narrow picture is widened as in the window. */
  camera(aspect) {
    const widened = Math.max(16 / 9 / Math.max(aspect, 1), 1);
    const { position, forward, forward: [x, y, z], right } = this;
    const up = [-right[2] * y, right[2] * x - right[0] * z, right[0] * y];
    return { position, forward, right, up, fov: 2 * Math.atan(Math.tan(this.fov / 2) * widened), near: 1e-3 * this.radius };
  }

  listen() {
    const { element } = this;
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input, select")) return;
      // A key that is up again before the next picture moves, too.
      if (AXES[event.code] || event.code.startsWith("Shift")) { this.held.add(event.code); this.advance(event.repeat ? 0 : 0.016); }
      else if (this.keys[event.code]) this.keys[event.code]();
      else return;
      event.preventDefault();
      this.changed();
    });
    addEventListener("keyup", (event) => this.held.delete(event.code));
    addEventListener("blur", () => this.held.clear());
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("pointerdown", (event) => {
      document.activeElement?.blur();
      element.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      element.addEventListener(end, (event) => { this.fingers.delete(event.pointerId); this.changed(); });
    }
    element.addEventListener("pointermove", (event) => this.drag(event));
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.approach(-Math.sign(event.deltaY));
    }, { passive: false });
  }

  /** One finger, or the mouse, looks; two fingers move: pinched nearer, drawn along. */
  drag(event) {
    const was = this.fingers.get(event.pointerId);
    if (!was) return;
    const [across, down] = [event.clientX - was[0], event.clientY - was[1]];
    const before = this.spread();
    this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    // A mouse turns the gaze, a finger takes the picture along.
    const sign = event.pointerType === "touch" ? -1 : 1;
    if (this.fingers.size < 2) return this.turn(sign * across, sign * down);
    this.approach((this.spread() - before) / 20);
    const step = (this.mode === "walk" ? 1 : this.radius) * 1e-3;
    this.go(along(scaled(this.right, -across * step), [0, down * step, 0], 1));
    this.changed();
  }

  spread() {
    const [a, b] = [...this.fingers.values()];
    return a && b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  }
}
