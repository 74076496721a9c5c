// The scene with its maps, and how it is drawn: diffuse surfaces by their maps, mirrors and glass by pictures of what is
// around them.

import * as THREE from "three";
import { GLTFLoader } from "GLTFLoader";
import { ktx2 } from "ktx2";
import * as shaders from "shaders";

const LAYERS = ["caustic", "direct", "indirect"];
const TONE_MAPS = ["none", "neutral", "agx", "aces", "soft"];
// Sides of the pictures around mirrors and glass [pixels].
const PROBE_SIDE = 512;
// What a camera leaves to automatic exposure: middle grey; as the window does.
const MIDDLE_GREY = 0.18;
const MEASURED = [160, 90];
// Layers of three.js: what is opaque, mirrors and glass, and once more solid glass for its backs and mirrors alone.
const OPAQUE = 0, SPECULAR = 1, SOLID = 2, MIRRORS = 3;

const key = (node, primitive) => `${node}/${primitive}`;

/** The file of a layer at a moment; light that stands still has one alone. */
const fileAt = (files, moment) => files[files.length > 1 ? moment : 0];

function texture({ width, height, levels }) {
  const made = new THREE.DataTexture(levels[0], width, height, THREE.RGBFormat, THREE.UnsignedInt5999Type);
  if (levels.length > 1) {
    made.mipmaps = levels.map((data, level) => ({ data, width: Math.max(width >> level, 1), height: Math.max(height >> level, 1) }));
    made.anisotropy = 4;
  }
  made.minFilter = levels.length > 1 ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter;
  made.magFilter = THREE.LinearFilter;
  made.generateMipmaps = false;
  made.needsUpdate = true;
  return made;
}

function plain(value) {
  const made = new THREE.DataTexture(new Uint8Array([value, value, value, 255]), 1, 1);
  made.needsUpdate = true;
  return made;
}

export class Stage {
  constructor(canvas, about) {
    this.about = about;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    this.scene = new THREE.Scene();
    this.scene.matrixWorldAutoUpdate = false;
    this.camera = new THREE.PerspectiveCamera();
    this.camera.layers.enable(SPECULAR);
    this.probes = [];
    this.black = plain(0);
    this.white = plain(255);
    this.blackCube = new THREE.WebGLCubeRenderTarget(1).texture;
    const float = this.renderer.extensions.has("EXT_color_buffer_float") ? THREE.FloatType : THREE.HalfFloatType;
    const target = (options) => new THREE.WebGLRenderTarget(1, 1, { type: THREE.HalfFloatType, ...options });
    this.fine = target({ samples: 4 });
    this.fast = target({});
    this.backs = target({ type: float, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter });
    this.gain = 2 ** about.exposure_stops;
    // Shared by all surfaces.
    this.common = {
      weights: { value: new THREE.Vector3(1, 1, 1) },
      line: { value: 1e9 },
      gain: { value: this.gain },
      false_scale: { value: new THREE.Vector3(0, 1, 0) },
      pixels: { value: new THREE.Vector2(1, 1) },
      clip_from_world: { value: new THREE.Matrix4() },
      backs: { value: this.backs.texture },
    };
    this.backMaterial = new THREE.ShaderMaterial({
      vertexShader: shaders.backVertex, fragmentShader: shaders.backFragment, side: THREE.BackSide });
    this.display = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.ShaderMaterial({
      vertexShader: shaders.displayVertex, fragmentShader: shaders.displayFragment, depthTest: false, depthWrite: false,
      uniforms: { picture: { value: null }, exposure: { value: 1 }, tone_map: { value: 4 } } }));
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    this.display.geometry.setAttribute("position", new THREE.BufferAttribute(corners, 3));
    this.display.frustumCulled = false;
  }

  /** Reads everything; `asset(name)` gives the bytes of a file. */
  async load(asset) {
    const { about } = this;
    const loader = new GLTFLoader();
    const scene = asset("scene.glb.gz").then((bytes) =>
      loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), ""));
    this.maps = about.maps.map((map) => ({ ...map, images: {}, textures: {} }));
    const maps = this.read(asset, 0);
    const sky = about.sky && asset(about.sky).then(ktx2).then(texture);
    this.gltf = await scene;
    this.scene.add(this.gltf.scene);
    this.scene.updateMatrixWorld(true);
    this.dress();
    // Shaders are made while maps are unpacked.
    this.renderer.compile(this.scene, this.camera);
    await maps;
    this.maps.forEach((map) => this.light(map));
    if (sky) this.addSky(await sky);
    this.bounds = new THREE.Box3();
    this.meshes.forEach((mesh) => this.bounds.expandByObject(mesh));
    this.radius = Math.max(this.bounds.getSize(new THREE.Vector3()).length() / 2, 1e-6);
  }

  /** Reads the maps of a moment, but for those that are shown already. */
  async read(asset, moment) {
    const read = async (map, layer, file) => {
      if (map.images[layer]?.file === file) return;
      const image = file ? { file, ...(await ktx2(await asset(file))) } : null;
      return () => {
        map.textures[layer]?.dispose();
        [map.images[layer], map.textures[layer]] = [image, image && texture(image)];
      };
    };
    const layers = this.maps.flatMap((map) =>
      Object.entries(map.layers).map(([layer, files]) => read(map, layer, fileAt(files, moment))));
    // All change at once.
    (await Promise.all(layers)).forEach((change) => change?.());
  }

  /** Shows another moment: its maps, and objects where the file's keyframes move them. */
  async show(asset, moment, seconds) {
    await this.read(asset, moment);
    this.maps.forEach((map) => this.light(map));
    if (!this.gltf.animations.length) return;
    if (!this.mixer) {
      this.mixer = new THREE.AnimationMixer(this.gltf.scene);
      this.gltf.animations.forEach((clip) => this.mixer.clipAction(clip).play());
    }
    this.mixer.setTime(seconds);
    this.scene.updateMatrixWorld(true);
  }

  /** Gives a map's textures to its mesh. */
  light({ mesh, side, layers, textures }) {
    for (const layer of Object.keys(layers)) {
      if (mesh) mesh.material.uniforms[side === "back" ? `${layer}_back` : layer].value = textures[layer] ?? this.black;
    }
  }

  /** Gives every mesh its material. */
  dress() {
    const looks = new Map(this.about.objects.map((look) => [key(look.node, look.primitive), look]));
    this.meshes = [];
    this.gltf.scene.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const of = this.gltf.parser.associations;
      const node = of.get(mesh)?.nodes ?? of.get(mesh.parent)?.nodes;
      const place = key(node, of.get(mesh)?.primitives ?? 0);
      const look = looks.get(place);
      if (!look) { mesh.visible = false; return; }
      this.dressOne(mesh, look, this.maps.filter((map) => key(map.node, map.primitive) === place));
      this.meshes.push(mesh);
    });
    this.nest();
  }

  dressOne(mesh, look, maps) {
    const had = mesh.material;
    const base = had.map ?? this.white;
    const uv = (channel) => (channel === 0 ? "uv" : `uv${channel}`);
    const channels = [maps[0]?.uv ?? 0, base.channel];
    const isClear = look.kind === "glass" || look.kind === "pane";
    const isSpecular = isClear || look.kind === "mirror";
    const defines = { MAP_UV: uv(channels[0]), LOOK_UV: uv(channels[1]) };
    channels.filter((channel) => channel > 0).forEach((channel) => { defines[`USE_UV${channel}`] = ""; });
    if (maps.length) defines.LIT = "";
    if (had.transparent && !isClear) defines.BLENDED = "";
    if (isSpecular) defines[look.kind.toUpperCase()] = "";
    const vector = (list) => ({ value: new THREE.Vector3(...list) });
    const uniforms = { ...this.common, base: vector(look.base), glow: vector(look.glow),
      absorption_per_m: vector(look.absorption_per_m), ior: { value: look.ior }, roughness: { value: look.roughness },
      coat: { value: look.kind === "coated" ? look.coat : 0 }, cutoff: { value: had.alphaTest },
      opacity: { value: had.opacity }, inner_m: { value: 0 }, look: { value: base }, glow_look: { value: had.emissiveMap ?? this.white },
      look_matrix: { value: base.matrix }, probe: { value: this.blackCube }, probe_at: vector([0, 0, 0]),
      box_low: vector([0, 0, 0]), box_high: vector([0, 0, 0]) };
    base.updateMatrix();
    base.anisotropy = 4;
    LAYERS.forEach((layer) => { uniforms[layer] = { value: this.black }; uniforms[`${layer}_back`] = { value: this.black }; });
    mesh.material = new THREE.ShaderMaterial({ vertexShader: shaders.surfaceVertex, fragmentShader: shaders.surfaceFragment,
      defines, uniforms, vertexColors: Boolean(mesh.geometry.attributes.color),
      side: look.kind === "glass" && !this.isSheet(mesh) ? THREE.FrontSide : THREE.DoubleSide,
      transparent: isClear || had.transparent, depthWrite: !isClear, premultipliedAlpha: look.kind === "pane" });
    maps.forEach((map) => { map.mesh = mesh; });
    mesh.userData.isGlass = look.kind === "glass";
    if (isSpecular) {
      mesh.layers.disable(OPAQUE);
      mesh.layers.enable(SPECULAR);
      if (!isClear) mesh.layers.enable(MIRRORS);
    }
    if (isSpecular || look.kind === "coated") this.probes.push({ mesh, isSpecular });
  }

  /** What stands within other glass, as wine does, is drawn over it, tinted and not refracted. */
  nest() {
    const bodies = this.meshes.filter((mesh) => mesh.userData.isGlass);
    const boxes = bodies.map((mesh) => new THREE.Box3().setFromObject(mesh));
    bodies.forEach((mesh, index) => {
      const isInner = boxes.some((box, other) => other !== index && box.containsBox(boxes[index]));
      if (!isInner) return mesh.layers.enable(SOLID);
      const size = boxes[index].getSize(new THREE.Vector3());
      mesh.material.defines.INNER = "";
      mesh.material.uniforms.inner_m.value = (size.x + size.z) / 2;
      mesh.renderOrder = 1;
    });
  }

  /** Whether a mesh is flat: a water's surface, without a back. */
  isSheet(mesh) {
    const size = new THREE.Box3().setFromObject(mesh).getSize(new THREE.Vector3());
    return Math.min(size.x, size.y, size.z) < 0.01 * Math.max(size.x, size.y, size.z);
  }

  addSky(sky) {
    const material = new THREE.ShaderMaterial({ vertexShader: shaders.skyVertex, fragmentShader: shaders.skyFragment,
      uniforms: { sky: { value: sky }, gain: this.common.gain }, side: THREE.BackSide, depthWrite: false });
    sky.wrapS = THREE.RepeatWrapping;
    this.sky = new THREE.Mesh(new THREE.BoxGeometry(2, 2, 2), material);
    this.sky.frustumCulled = false;
    this.sky.renderOrder = -1;
    this.scene.add(this.sky);
    this.sky.updateMatrixWorld();
  }

  /** Draws what is around mirrors and glass, one after the other, and again with the mirrors in it; `step` runs between. */
  async look(step) {
    const turn = (this.turn = {});
    const hasMirrors = this.meshes.some((mesh) => mesh.layers.isEnabled(MIRRORS));
    for (const withMirrors of hasMirrors && this.probes.length > 1 ? [false, true] : [false]) {
      for (const probe of this.probes) {
        await step();
        if (this.turn !== turn) return;
        this.lookAround(probe, withMirrors);
      }
    }
  }

  lookAround(probe, withMirrors) {
    const { mesh } = probe;
    const uniforms = mesh.material.uniforms;
    if (!probe.target) {
      probe.target = new THREE.WebGLCubeRenderTarget(PROBE_SIDE, { type: THREE.HalfFloatType, generateMipmaps: true,
        minFilter: THREE.LinearMipmapLinearFilter });
      probe.eye = new THREE.CubeCamera(this.radius * 1e-4, this.radius * 100, probe.target);
      this.stand(probe);
      uniforms.probe_at.value.copy(probe.eye.position);
    }
    const { line, false_scale: scale } = this.common;
    const [wasLine, wasScale] = [line.value, scale.value.z];
    [line.value, scale.value.z] = [1e9, 0];
    // Nothing may be drawn from the picture that is being drawn.
    uniforms.probe.value = this.blackCube;
    const wasVisible = mesh.visible;
    mesh.visible = false;
    this.renderer.autoClear = true;
    probe.eye.layers[withMirrors ? "enable" : "disable"](MIRRORS);
    probe.eye.update(this.renderer, this.scene);
    this.renderer.autoClear = false;
    mesh.visible = wasVisible;
    uniforms.probe.value = probe.target.texture;
    [line.value, scale.value.z] = [wasLine, wasScale];
  }

  /** Where a mesh is looked around from, and the box of what stands around it there. */
  stand({ mesh, eye }) {
    const box = new THREE.Box3().setFromObject(mesh);
    const around = this.bounds.clone().expandByScalar(1e-3 * this.radius);
    box.getCenter(eye.position);
    eye.updateMatrixWorld();
    const ray = new THREE.Raycaster();
    ray.layers.set(OPAQUE);
    const others = this.meshes.filter((other) => other !== mesh && other.layers.test(ray.layers));
    const { box_low: low, box_high: high } = mesh.material.uniforms;
    low.value.copy(around.min);
    high.value.copy(around.max);
    for (const axis of ["x", "y", "z"]) {
      for (const [side, bound] of [[-1, low.value], [1, high.value]]) {
        ray.set(eye.position, new THREE.Vector3().setComponent("xyz".indexOf(axis), side));
        const met = ray.intersectObjects(others, false)[0];
        if (met) bound[axis] = met.point[axis];
      }
    }
  }

  resize(width, height) {
    this.renderer.setSize(width, height, false);
  }

  /** Draws the picture as `shown` says: {layers, line, exposure_stops, tone_map, false_range, scale}. */
  draw(shown) {
    const size = this.renderer.getDrawingBufferSize(new THREE.Vector2());
    const target = shown.scale < 1 ? this.fast : this.fine;
    const pixels = [size.x, size.y].map((side) => Math.max(Math.round(side * shown.scale), 1));
    if (target.width !== pixels[0] || target.height !== pixels[1]) target.setSize(...pixels);
    this.common.weights.value.fromArray(LAYERS.map((layer) => Number(shown.layers[layer] ?? 0)));
    this.common.line.value = shown.line * pixels[0];
    const range = shown.false_range?.map(Math.log2);
    this.common.false_scale.value.set(range?.[0] ?? 0, range ? 1 / (range[1] - range[0]) : 1, range ? 1 : 0);
    this.drawLight(target);
    const uniforms = this.display.material.uniforms;
    uniforms.picture.value = target.texture;
    uniforms.exposure.value = range ? 1 : 2 ** shown.exposure_stops / this.gain;
    uniforms.tone_map.value = range ? 0 : TONE_MAPS.indexOf(shown.tone_map);
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.display, this.camera);
  }

  drawLight(target) {
    const { camera, renderer, common } = this;
    camera.updateMatrixWorld();
    common.clip_from_world.value.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    common.pixels.value.set(target.width, target.height);
    if (this.meshes.some((mesh) => mesh.layers.isEnabled(SOLID))) {
      if (this.backs.width !== target.width || this.backs.height !== target.height) this.backs.setSize(target.width, target.height);
      camera.layers.set(SOLID);
      this.scene.overrideMaterial = this.backMaterial;
      renderer.setRenderTarget(this.backs);
      renderer.setClearColor(0, 0);
      renderer.clear();
      renderer.render(this.scene, camera);
      this.scene.overrideMaterial = null;
      camera.layers.set(OPAQUE);
      camera.layers.enable(SPECULAR);
    }
    renderer.setRenderTarget(target);
    renderer.setClearColor(0, 1);
    renderer.clear();
    renderer.render(this.scene, camera);
  }

  /** Waits until all is drawn; the time then [ms]. */
  finish() {
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now();
  }

  /** Display colour [0, 1] of a place in [0, 1] of the scale of false colours. */
  falseColour(place) {
    return shaders.viridis.reduce((sum, row) => sum.map((value, channel) => value * place + row[channel]), [0, 0, 0])
      .map((value) => Math.max(0, Math.min(1, value)));
  }

  /** The exposure [stops] that suits the present view: Picture::auto_exposure_stops of the program. */
  suits(layers) {
    this.common.weights.value.fromArray(LAYERS.map((layer) => Number(layers[layer] ?? 0)));
    const target = new THREE.WebGLRenderTarget(...MEASURED, { type: THREE.HalfFloatType });
    this.common.line.value = 1e9;
    this.drawLight(target);
    const halves = new Uint16Array(4 * MEASURED[0] * MEASURED[1]);
    this.renderer.readRenderTargetPixels(target, 0, 0, ...MEASURED, halves);
    target.dispose();
    const value = (at) => THREE.DataUtils.fromHalfFloat(halves[at]) / this.gain;
    const all = Array.from({ length: halves.length / 4 }, (_, pixel) =>
      0.2126 * value(4 * pixel) + 0.7152 * value(4 * pixel + 1) + 0.0722 * value(4 * pixel + 2));
    const mean = all.reduce((sum, light) => sum + light, 0) / all.length;
    const lit = all.filter((light) => light > 0 && light > mean / 256).sort((a, b) => a - b);
    if (!lit.length) return this.about.exposure_stops;
    const tenth = Math.floor(lit.length / 10);
    const most = lit.slice(tenth, lit.length - tenth);
    const logarithm = most.reduce((sum, light) => sum + Math.log2(light), 0) / most.length;
    return Math.min(Math.log2(MIDDLE_GREY) - logarithm, -Math.log2(lit[Math.floor((lit.length * 9) / 10)]));
  }
}
