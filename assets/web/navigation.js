// A camera that flies, walks or orbits, by keys, mouse and touch: the keys of the program's window.

import * as THREE from "three";

// As in the window: time in which the velocity has closed 1 − 1/e of its gap [s], speeds in scene radii per second and
// [m/s], height of the eyes [m], turn of a look [rad per pixel].
const SETTLING_S = 0.08, FLYING = 0.6, WALKING_M_PER_S = 1.4, EYES_M = 1.6, RUN = 4;
const LOOK_RAD = 0.004;
// Nearest that walls and orbited points come [m, radii].
const WALL_M = 0.25, NEAREST = 1e-3;
const MODES = ["fly", "walk", "orbit"];
const AXES = { KeyD: [0, 1], KeyA: [0, -1], KeyE: [1, 1], KeyQ: [1, -1], KeyW: [2, 1], KeyS: [2, -1],
  ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [2, 1], ArrowDown: [2, -1] };

export class Navigation {
  constructor(stage, element, changed) {
    Object.assign(this, { stage, element, changed, mode: "fly", held: new Set(), yaw: 0, pitch: 0, fov: 0.8 });
    this.position = new THREE.Vector3();
    this.velocity = new THREE.Vector3();
    this.fingers = new Map();
    this.ray = new THREE.Raycaster();
    this.cameras = [];
    stage.gltf.scene.traverse((node) => { if (node.isPerspectiveCamera) this.cameras.push(node); });
    // What single keys do.
    this.keys = {
      KeyC: () => this.nextCamera(),
      KeyF: () => this.frame(),
      KeyV: () => this.setMode(MODES[(MODES.indexOf(this.mode) + 1) % MODES.length]),
    };
    this.next = 0;
    if (this.cameras.length) this.nextCamera();
    else this.frame();
    this.listen();
  }

  forward() {
    const level = Math.cos(this.pitch);
    return new THREE.Vector3(Math.sin(this.yaw) * level, Math.sin(this.pitch), -Math.cos(this.yaw) * level);
  }

  right() {
    return new THREE.Vector3(Math.cos(this.yaw), 0, Math.sin(this.yaw));
  }

  stand(position, forward, fov) {
    this.position.copy(position);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, forward.y)));
    if (Math.hypot(forward.x, forward.z) > 1e-6) this.yaw = Math.atan2(forward.x, -forward.z);
    this.fov = fov;
    this.velocity.set(0, 0, 0);
    this.measureOrbit();
    this.changed();
  }

  show(index) {
    this.next = (index + 1) % this.cameras.length;
    this.shown = index;
    const camera = this.cameras[index];
    const forward = new THREE.Vector3(0, 0, -1).transformDirection(camera.matrixWorld);
    this.stand(new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld), forward, (camera.fov * Math.PI) / 180);
  }

  nextCamera() {
    if (this.cameras.length) this.show(this.next);
  }

  /** So that the scene fills the picture. */
  frame() {
    const { bounds, radius } = this.stage;
    const backward = new THREE.Vector3(-0.5, 0.55, 0.67).normalize();
    const centre = bounds.getCenter(new THREE.Vector3());
    const aspect = this.element.clientWidth / Math.max(this.element.clientHeight, 1);
    const half = Math.min(0.4, Math.atan(Math.tan(0.4) * aspect));
    this.stand(centre.addScaledVector(backward, radius / Math.sin(half)), backward.negate(), 0.8);
  }

  setMode(mode) {
    this.mode = mode;
    this.velocity.set(0, 0, 0);
    this.measureOrbit();
    this.changed();
  }

  meets(from, direction, most = Infinity) {
    this.ray.set(from, direction);
    this.ray.far = most;
    this.ray.layers.enableAll();
    return this.ray.intersectObjects(this.stage.meshes, false)[0]?.distance;
  }

  measureOrbit() {
    const along = this.stage.bounds.getCenter(new THREE.Vector3()).sub(this.position).dot(this.forward());
    this.orbit = this.meets(this.position, this.forward()) ?? (along > 0 ? along : this.stage.radius);
  }

  turn(across, down) {
    const pivot = this.position.clone().addScaledVector(this.forward(), this.orbit);
    this.yaw += LOOK_RAD * across;
    this.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.pitch - LOOK_RAD * down));
    if (this.mode === "orbit") this.position.copy(pivot).addScaledVector(this.forward(), -this.orbit);
    this.changed();
  }

  /** Nearer by a factor where it orbits, else a step ahead. */
  approach(steps) {
    if (this.mode === "orbit") {
      const nearer = Math.max(this.orbit * 0.9 ** steps, NEAREST * this.stage.radius);
      this.position.addScaledVector(this.forward(), this.orbit - nearer);
      this.orbit = nearer;
    } else {
      this.go(this.forward().multiplyScalar(0.08 * steps * (this.mode === "walk" ? WALKING_M_PER_S : this.stage.radius)));
    }
    this.changed();
  }

  go(way) {
    if (this.mode === "walk") {
      way.y = 0;
      const length = way.length();
      if (length > 0) {
        const ahead = this.meets(this.position, way.clone().normalize(), length + WALL_M);
        if (ahead !== undefined) way.setLength(Math.max(Math.min(ahead - WALL_M, length), 0));
      }
    }
    this.position.add(way);
  }

  get isMoving() {
    return this.velocity.lengthSq() > 0 || [...this.held].some((key) => AXES[key]) || Boolean(this.falls);
  }

  /** Lets time pass [s]. */
  advance(seconds) {
    const asked = [0, 0, 0];
    for (const key of this.held) if (AXES[key]) asked[AXES[key][0]] += AXES[key][1];
    const run = this.held.has("ShiftLeft") || this.held.has("ShiftRight") ? RUN : 1;
    const speed = run * (this.mode === "walk" ? WALKING_M_PER_S : FLYING * this.stage.radius);
    const ahead = this.mode === "walk" ? this.forward().setY(0).normalize() : this.forward();
    const goal = this.right().multiplyScalar(Math.sign(asked[0])).addScaledVector(ahead, Math.sign(asked[2]));
    if (this.mode !== "walk") goal.y += Math.sign(asked[1]);
    if (goal.lengthSq() > 0) goal.setLength(speed);
    const left = Math.exp(-seconds / SETTLING_S);
    this.go(goal.clone().multiplyScalar(seconds).addScaledVector(this.velocity.clone().sub(goal), SETTLING_S * (1 - left)));
    this.velocity.sub(goal).multiplyScalar(left).add(goal);
    if (goal.lengthSq() === 0 && this.velocity.length() < 1e-3 * speed) this.velocity.set(0, 0, 0);
    if (this.mode === "walk") this.keepToGround(seconds);
  }

  keepToGround(seconds) {
    const below = this.meets(this.position, new THREE.Vector3(0, -1, 0));
    const gap = below === undefined ? 0 : EYES_M - below;
    this.falls = Math.abs(gap) > 1e-3;
    this.position.y += gap * (1 - Math.exp(-seconds / (2 * SETTLING_S)));
  }

  /** The camera for a picture of that aspect (width/height): a narrow picture is widened as in the window. */
  place(camera, aspect) {
    const widened = 16 / 9 / Math.max(aspect, 1);
    camera.fov = (360 / Math.PI) * Math.atan(Math.tan(this.fov / 2) * Math.max(widened, 1));
    camera.aspect = aspect;
    camera.near = 1e-3 * this.stage.radius;
    camera.far = 1e3 * this.stage.radius;
    camera.position.copy(this.position);
    camera.rotation.set(this.pitch, -this.yaw, 0, "YXZ");
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  listen() {
    const { element } = this;
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input, select")) return;
      if (AXES[event.code] || event.code.startsWith("Shift")) this.held.add(event.code);
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
      element.addEventListener(end, (event) => this.fingers.delete(event.pointerId));
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
    const pinched = this.spread() - before;
    this.approach(pinched / 20);
    const step = (this.mode === "walk" ? 1 : this.stage.radius) * 2e-3;
    this.go(this.right().multiplyScalar(-across * step / 2).add(new THREE.Vector3(0, (down * step) / 2, 0)));
    this.changed();
  }

  spread() {
    const [a, b] = [...this.fingers.values()];
    return a && b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  }
}
