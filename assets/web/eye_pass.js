// The program's eye pass by WebGPU. The file of a moment says what to make and what to draw
// (src/eye_pass/renderer/web.rs); this host makes it, and draws as the window does.

import { Geometry, scaled } from "geometry";

// Steps of the places within a pixel, as in the window.
const STEPS = [0.7548776662466927, 0.5698402909980532];
// Exposed radiance of mirrors while chains are left out [1], as in the window.
const STAND_IN = 0.15;
const LAYERS = ["caustic", "direct", "indirect"];
// Workgroups across a tile of `summed.wgsl`: 65 texels by eights.
const TILE_GROUPS = 9;
// Buffers have some size even without content [bytes].
const LEAST_BYTES = 256;
// Chains are traced in bands that take about so long [ms], so that a picture at rest can be given up for another.
const BAND_MS = 100;
const STORED = ["objects", "image_table", "corners", "map_uvs", "indices", "lights", "seen_lamps"];
// Bindings of each group in turn: uniforms, storage buffers, textures and arrays of textures.
const GROUPS = { frame: "ussaa", traced: "ussssssu", composed: "t", sky: "t", lamps: "s", nothing: "", mean: "utt", shown: "tu" };
const KINDS = { u: { buffer: { type: "uniform" } }, s: { buffer: { type: "read-only-storage" } },
  t: { texture: { sampleType: "unfilterable-float" } }, a: { texture: { sampleType: "unfilterable-float", viewDimension: "2d-array" } } };

/** A device with all that it has; throws where there is none. */
export async function openDevice() {
  if (!globalThis.isSecureContext) throw new Error("browsers offer WebGPU to pages from https or this machine alone");
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw new Error("this browser offers no WebGPU");
  const wanted = ["maxBufferSize", "maxStorageBufferBindingSize", "maxTextureDimension2D"];
  const requiredLimits = Object.fromEntries(wanted.map((name) => [name, adapter.limits[name]]));
  return { device: await adapter.requestDevice({ requiredLimits }), isSoftware: Boolean(adapter.info.isFallbackAdapter) };
}

export class EyePass {
  constructor(device, canvas, scene) {
    const [screenFormat, screen] = [navigator.gpu.getPreferredCanvasFormat(), canvas.getContext("webgpu")];
    Object.assign(this, { device, canvas, screenFormat, screen, msPerTraced: 1e-3, modules: {}, pipelines: new Map(), buffers: {} });
    screen.configure({ device, format: screenFormat, alphaMode: "opaque" });
    const each = (of, make) => Object.fromEntries(Object.entries(of).map(([label, value]) => [label, make(label, value)]));
    this.layouts = each(GROUPS, (label, kinds) => {
      const visibility = GPUShaderStage.FRAGMENT | (label === "frame" ? GPUShaderStage.VERTEX : 0);
      return device.createBindGroupLayout({ label, entries: [...kinds].map((kind, binding) => ({ binding, visibility, ...KINDS[kind] })) });
    });
    this.uniforms = each({ frame: scene.Frame.size, tracedFrame: scene.Frame.size, start: scene.contents.start?.length ?? 0,
      wavelengths: scene.contents.wavelengths.length / scene.pictures, white: scene.contents.white.length, share: 16, factors: 16 },
    (label, size) => device.createBuffer({ label, size: Math.max(size, LEAST_BYTES), usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST }));
    device.queue.writeBuffer(this.uniforms.white, 0, scene.contents.white);
    this.bilinear = device.createSampler({ magFilter: "linear", minFilter: "linear" });
    this.black = this.texture("rgb9e5ufloat", [1, 1], new Uint8Array(4));
    this.looks = this.texture("rgba8unorm-srgb", scene.textures.texture_tiles.size, scene.contents.texture_tiles, "2d-array");
    if (scene.textures.sky) this.sky = this.bind("sky", [this.light(scene, "sky")]);
    this.show(scene);
  }

  /** Takes up a moment: what differs from the one before goes to the device. */
  show(scene) {
    const { contents } = scene, before = this.scene?.contents ?? {};
    const isNew = (name) => contents[name] !== before[name];
    this.scene = scene;
    if (["objects", "corners", "indices", "triangles"].some(isNew)) this.geometry = new Geometry(scene);
    STORED.filter((name) => contents[name] && isNew(name)).forEach((name) => this.store(name, contents[name]));
    const layer = (name, was) => (!scene.textures[name] ? this.black : was && !isNew(name) ? was : this.light(scene, name));
    const were = this.maps?.map(({ layers }) => layers);
    this.maps = Object.keys(contents).filter((name) => name.startsWith("tiles")).map((name, index) => {
      this.store(name, contents[name]);
      const layers = LAYERS.map((kind, at) => layer(name.replace("tiles", kind), were?.[index][at]));
      return { tiles: this.buffers[name], count: contents[name].length / scene.MapTile.size, layers };
    });
    const kept = new Set([this.black, ...this.maps.flatMap(({ layers }) => layers)]);
    were?.flat().forEach((layer) => { if (!kept.has(layer)) layer.texture.destroy(); });
    Object.assign(this, { count: 0, traced: null, lights: [0, 1].map((side) => ({ tiles: this.lights?.[side].tiles })) });
  }

  // Binds what chains are traced through, which the first of them at a moment need.
  bindChains() {
    Object.entries(this.geometry.hierarchy()).forEach(([name, bytes]) => this.store(name, bytes));
    const stored = ["nodes", "triangles", "corners", "map_uvs", "indices", "lights"].map((name) => this.buffers[name]);
    return this.bind("traced", [this.uniforms.start, ...stored, this.uniforms.wavelengths]);
  }

  store(name, bytes) {
    const size = Math.max(bytes.length, LEAST_BYTES);
    if (this.buffers[name]?.size !== size) {
      const { STORAGE, VERTEX, INDEX, COPY_DST } = GPUBufferUsage;
      const usage = STORAGE | COPY_DST | (name === "indices" ? INDEX : VERTEX);
      this.buffers[name]?.destroy();
      this.buffers[name] = this.device.createBuffer({ label: name, size, usage });
    }
    this.device.queue.writeBuffer(this.buffers[name], 0, bytes);
  }

  // A texture of four bytes a pixel, in layers.
  texture(format, [width, height, layers = 1], bytes, dimension = "2d") {
    const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST, size = [width, height, layers];
    const texture = this.device.createTexture({ size, format, usage });
    this.device.queue.writeTexture({ texture }, bytes, { bytesPerRow: 4 * width, rowsPerImage: height }, size);
    return Object.assign(texture.createView({ dimension }), { texture });
  }

  // A texture of light, whose words are differences from the row before.
  light({ textures, contents }, name) {
    const [width, height] = textures[name].size, words = new Uint32Array(contents[name].slice().buffer);
    for (let at = width; at < words.length; at += 1) words[at] += words[at - width];
    return this.texture("rgb9e5ufloat", [width, height], words);
  }

  bind(layout, resources) {
    const entries = resources.map((it, binding) => ({ binding, resource: it instanceof GPUBuffer ? { buffer: it } : it }));
    return this.device.createBindGroup({ layout: this.layouts[layout] ?? layout, entries });
  }

  module(label) { return (this.modules[label] ??= this.device.createShaderModule({ label, code: this.scene.programs[label] })); }

  // A pipeline, made when it is first needed.
  pipeline(key, groups, vertex, { program, entry, format, constants, cull = "none", depth, samples: count = 1, blend, buffers }) {
    if (!this.pipelines.has(key)) {
      const { formats } = this.scene, module = this.module(program);
      const made = this.device.createRenderPipelineAsync({
        label: key, layout: this.device.createPipelineLayout({ bindGroupLayouts: groups.map((name) => this.layouts[name]) }),
        vertex: { module, entryPoint: vertex, buffers },
        ...(entry && { fragment: { module, entryPoint: entry, constants, targets: format ? [{ format, blend }] : [] } }),
        primitive: { cullMode: cull }, multisample: { count },
        ...(depth && { depthStencil: { format: formats.depth, depthWriteEnabled: depth[0], depthCompare: depth[1] } }),
      });
      this.pipelines.set(key, made.then((pipeline) => this.pipelines.set(key, pipeline)));
    }
    return this.pipelines.get(key);
  }

  // Everything that pictures of these draws need.
  async makePipelines(lists, toneMap, isResting) {
    const { scene: { draws, pipelines, formats, samples, tone_maps: toneMaps, vertices, lamps }, device } = this;
    const groups = { traced: ["frame", "traced", ...(this.sky ? ["sky"] : [])], composed: ["frame", "composed"] };
    const surfaces = lists.flatMap((list) => draws[list]).map(([key]) =>
      this.pipeline(key, groups[pipelines[key].entry] ?? ["frame"], "place", { ...pipelines[key], buffers: vertices }));
    const mean = { program: "accumulated", entry: "accumulated", format: formats.mean };
    const display = { program: "tone_mapping", entry: "to_display", format: this.screenFormat, constants: toneMaps[toneMap] };
    const others = [this.pipeline(toneMap, ["shown"], "cover", display)];
    if (isResting) others.push(this.pipeline("mean", ["mean"], "cover", mean));
    const behind = { program: "sky", entry: "sky_drawn", format: formats.radiance, depth: [false, "always"], samples };
    if (this.sky) others.push(this.pipeline("sky", ["frame", "nothing", "sky"], "behind", behind));
    const added = { srcFactor: "one", dstFactor: "one" }, blend = { color: added, alpha: added };
    const seen = { program: "lamps", entry: "lamp_drawn", format: formats.radiance, depth: [false, "greater-equal"], samples, blend, buffers: lamps.vertices };
    if (lamps.draw[1]) others.push(this.pipeline("lamps", ["frame", "lamps"], "lamp_corner", seen));
    const compute = { module: this.module("summed"), entryPoint: "summed" };
    this.summed ??= await device.createComputePipelineAsync({ layout: "auto", compute });
    this.isFresh = surfaces.some((made) => made instanceof Promise);
    await Promise.all([...surfaces, ...others]);
  }

  // The tiles of all maps hold the layers that are switched on: first for all of the picture, then beside its line.
  setLight(side, layers) {
    const { device, scene, uniforms, buffers } = this;
    const factors = LAYERS.map((layer) => Number(layers[layer] ?? 1));
    const light = this.lights[side], key = factors.join();
    if (light.key === key) return;
    const { formats: { radiance: format }, textures: { map_tiles: { size } } } = scene;
    const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.STORAGE_BINDING;
    light.tiles ??= device.createTexture({ label: "map tiles", size, format, usage }).createView({ dimension: "2d-array" });
    device.queue.writeBuffer(uniforms.factors, 0, new Float32Array(factors));
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    pass.setPipeline(this.summed);
    for (const { tiles, count, layers } of this.maps) {
      const bound = [uniforms.factors, tiles, this.bilinear, ...layers, light.tiles];
      pass.setBindGroup(0, this.bind(this.summed.getBindGroupLayout(0), bound));
      if (count) pass.dispatchWorkgroups(TILE_GROUPS, TILE_GROUPS, count);
    }
    pass.end();
    device.queue.submit([encoder.finish()]);
    const bound = [buffers.objects, buffers.image_table, light.tiles, this.looks];
    light.frame = this.bind("frame", [uniforms.frame, ...bound]);
    light.tracedFrame = this.bind("frame", [uniforms.tracedFrame, ...bound]);
    light.key = key;
  }

  makeTargets(size, tracedSize) {
    const key = [...size, ...tracedSize].join();
    if (this.targets?.key === key) return;
    const { formats, samples } = this.scene;
    const made = (label, format, size, sampleCount = 1) => {
      const usage = GPUTextureUsage.RENDER_ATTACHMENT | (sampleCount > 1 ? 0 : GPUTextureUsage.TEXTURE_BINDING);
      return this.device.createTexture({ label, size, format, sampleCount, usage });
    };
    const textures = {
      radiance: made("radiance", formats.radiance, size), samples: made("samples", formats.radiance, size, samples),
      depth: made("depth", formats.depth, size, samples), means: made("mean", formats.mean, size),
      otherMean: made("mean", formats.mean, size), traced: made("traced picture", formats.radiance, tracedSize),
      tracedDepth: made("traced depth", formats.depth, tracedSize),
    };
    Object.values(this.targets?.textures ?? {}).forEach((texture) => texture.destroy());
    const views = Object.entries(textures).map(([name, texture]) => [name, texture.createView()]);
    this.targets = { key, size, tracedSize, textures, ...Object.fromEntries(views) };
    this.targets.composed = this.bind("composed", [this.targets.traced]);
  }

  /** Draws a view, or, with `refines`, the last one once more in the mean of its pictures; false if `isOutdated` ended it. */
  async draw(view, refines = false, isOutdated = () => false) {
    const { scene, device } = this;
    if (!refines) this.count = 0;
    const lists = view.colours ? ["colours"] : view.traced ? ["depths", "traced", "surfaces"] : ["plain"];
    const toneMap = view.colours ? "none" : view.toneMap;
    await this.makePipelines(lists, toneMap, view.isResting);
    const size = [view.width, view.height];
    this.makeTargets(size, size.map((side) => Math.max(Math.ceil(side * (view.traced || 1)), 1)));
    this.setLight(0, view.layers);
    const line = Math.min(Math.max(view.line, 0), 1), sides = [{ left: 0, right: line, light: this.lights[0] }];
    if (line < 1) {
      this.setLight(1, { ...view.layers, caustic: 0 });
      sides.push({ left: line, right: 1, light: this.lights[1] });
    }
    this.writeUniforms(view);
    if (lists.includes("traced") && scene.draws.traced.length && !(await this.trace(sides, isOutdated))) return false;
    const encoder = device.createCommandEncoder();
    this.drawSurfaces(encoder, sides, lists.filter((list) => !["depths", "traced"].includes(list)), view);
    this.display(encoder, toneMap, view.isResting);
    device.queue.submit([encoder.finish()]);
    await device.queue.onSubmittedWorkDone();
    this.count += 1;
    return true;
  }

  writeUniforms({ camera, width, height, exposureStops, traced, branching, colours }) {
    const { scene, device, uniforms, count } = this;
    const halfHeight = Math.tan(camera.fov / 2), aspect = width / height;
    const [x, y] = [scaled(camera.right, 1 / (halfHeight * aspect)), scaled(camera.up, 1 / halfHeight)];
    const columns = [0, 1, 2].map((axis) => [x[axis], y[axis], 0, camera.forward[axis]]);
    const offset = STEPS.map((step) => (count === 0 ? 0 : ((0.5 + step * count) % 1) - 0.5));
    // If the traced picture is coarser than the frame, samples are spread over its own pixels.
    const tracedOffset = scaled(offset, 1 / Math.min(traced || 1, 1));
    const [tracedWidth, tracedHeight] = this.targets.tracedSize;
    const perPixel = [tracedWidth / width, tracedHeight / height];
    const jitter = ([right, down]) => [(2 * right) / width, (-2 * down) / height];
    const exposure = 2 ** exposureStops, [low, high] = (colours ?? [1, 2]).map(Math.log2);
    const frame = {
      clip_from_camera: [...columns.flat(), 0, 0, camera.near, 0], camera_position: camera.position, forward: camera.forward,
      right: scaled(camera.right, halfHeight * aspect), up: scaled(camera.up, halfHeight),
      background: scaled(scene.background, scene.textures.sky?.scale ?? 1), radiance_scale: [exposure],
      level_bias: [count === 0 ? 0 : -1], pixel_rad: [(2 * halfHeight) / tracedHeight], jitter: jitter(offset),
      traced_width: [tracedWidth], traced_height: [tracedHeight], traced_per_pixel: perPixel,
      traced_offset: offset.map((place, axis) => (place - tracedOffset[axis]) * perPixel[axis]),
      colour_scale: [low, 1 / (high - low)], fault: [1], stand_in: [STAND_IN / exposure], picture: new Uint32Array([count]), sky_cut: [scene.sky_cut / (scene.textures.sky?.scale ?? 1)],
    };
    write(device, uniforms.frame, scene.Frame, frame);
    write(device, uniforms.tracedFrame, scene.Frame, { ...frame, jitter: jitter(tracedOffset) });
    if (!scene.local || !traced) return;
    const { centre_m: centre, per_m: perM } = scene.local;
    device.queue.writeBuffer(uniforms.start, 0, scene.contents.start);
    write(device, uniforms.start, scene.ChainStart, {
      eye: camera.position.map((coordinate, axis) => (coordinate - centre[axis]) * perM), near: [camera.near * perM],
      media: this.geometry.media(camera.position), branching_depth: new Uint32Array([branching]),
    });
    const sets = scene.contents.wavelengths, bytes = sets.length / scene.pictures;
    device.queue.writeBuffer(uniforms.wavelengths, 0, sets.subarray((count % scene.pictures) * bytes, (count % scene.pictures + 1) * bytes));
  }

  // Draws within each side of the line, from one row of a target to another.
  within(pass, width, [top, bottom], sides, group, draw) {
    for (const { left, right, light } of sides) {
      const [first, last] = [left, right].map((share) => Math.round(share * width));
      if (first === last) continue;
      pass.setScissorRect(first, top, last - first, bottom - top);
      pass.setBindGroup(0, light[group]);
      draw();
    }
    pass.end();
  }

  // Depths, then chains where a specular surface is nearest, band by band; tells whether all of them are there.
  async trace(sides, isOutdated) {
    const { targets, device } = this;
    const [width, height] = targets.tracedSize;
    for (let top = 0, bottom = 0; top < height; top = bottom) {
      const began = performance.now(), encoder = device.createCommandEncoder();
      if (top === 0) {
        const depth = { view: targets.tracedDepth, depthClearValue: 0, depthLoadOp: "clear", depthStoreOp: "store" };
        const pass = encoder.beginRenderPass({ colorAttachments: [], depthStencilAttachment: depth });
        this.within(pass, width, [0, height], sides, "tracedFrame", () => this.drawEach(pass, "depths"));
      }
      bottom = Math.min(top + Math.max(Math.round(BAND_MS / this.msPerTraced / width), 1), height);
      const colour = { ...cleared(targets.traced), loadOp: top ? "load" : "clear" };
      const depth = { view: targets.tracedDepth, depthLoadOp: "load", depthStoreOp: "store" };
      const pass = encoder.beginRenderPass({ colorAttachments: [colour], depthStencilAttachment: depth });
      pass.setBindGroup(1, this.traced ??= this.bindChains());
      if (this.sky) pass.setBindGroup(2, this.sky);
      this.within(pass, width, [top, bottom], sides, "tracedFrame", () => this.drawEach(pass, "traced"));
      device.queue.submit([encoder.finish()]);
      await device.queue.onSubmittedWorkDone();
      if (isOutdated()) return false;
      // What is drawn for the first time is made ready then. The next band may hold more of mirrors and glass.
      const took = (performance.now() - began) / (width * (bottom - top));
      if (!this.isFresh) this.msPerTraced = Math.min(Math.max(took, 0.9 * this.msPerTraced, 1e-6), 1);
    }
    return true;
  }

  drawSurfaces(encoder, sides, lists, { colours }) {
    const { targets, scene } = this;
    const pass = encoder.beginRenderPass({
      colorAttachments: [{ ...cleared(targets.samples), resolveTarget: targets.radiance, storeOp: "discard" }],
      depthStencilAttachment: { view: targets.depth, depthClearValue: 0, depthLoadOp: "clear", depthStoreOp: "discard" },
    });
    this.within(pass, targets.size[0], [0, targets.size[1]], sides, "frame", () => {
      if (this.sky && !colours) {
        pass.setPipeline(this.pipelines.get("sky"));
        pass.setBindGroup(1, this.bind("nothing", []));
        pass.setBindGroup(2, this.sky);
        pass.draw(3);
      }
      pass.setBindGroup(1, targets.composed);
      lists.forEach((list) => this.drawEach(pass, list));
      if (colours || !scene.lamps.draw[1]) return;
      pass.setPipeline(this.pipelines.get("lamps"));
      pass.setBindGroup(1, this.bind("lamps", [this.buffers.seen_lamps]));
      pass.setVertexBuffer(0, this.buffers.seen_lamps);
      pass.draw(...scene.lamps.draw);
    });
  }

  drawEach(pass, list) {
    const { corners, map_uvs, objects, indices } = this.buffers;
    [corners, map_uvs, objects].forEach((buffer, slot) => pass.setVertexBuffer(slot, buffer));
    pass.setIndexBuffer(indices, "uint32");
    for (const [pipeline, indexCount, objectCount, firstIndex, firstObject] of this.scene.draws[list]) {
      pass.setPipeline(this.pipelines.get(pipeline));
      pass.drawIndexed(indexCount, objectCount, firstIndex, 0, firstObject);
    }
  }

  // Takes a picture to the screen; at rest, the mean with those before.
  display(encoder, toneMap, isResting) {
    const { device, targets, uniforms, canvas, count } = this;
    const cover = (pipeline, bound, view) => {
      const pass = encoder.beginRenderPass({ colorAttachments: [cleared(view)] });
      pass.setPipeline(this.pipelines.get(pipeline));
      pass.setBindGroup(0, bound);
      pass.draw(3);
      pass.end();
    };
    device.queue.writeBuffer(uniforms.share, 0, new Float32Array([1 / (count + 1), 0, 0, 0]));
    const { means, otherMean, radiance, size: [width, height] } = targets;
    const [before, after] = count % 2 ? [otherMean, means] : [means, otherMean];
    if (isResting) cover("mean", this.bind("mean", [uniforms.share, radiance, before]), after);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    cover(toneMap, this.bind("shown", [isResting ? after : radiance, uniforms.white]), this.screen.getCurrentTexture().createView());
  }
}

const cleared = (view) => ({ view, loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 0] });

// Fields of a struct, as the shaders lay it out.
function write(device, buffer, { fields }, values) {
  for (const [name, value] of Object.entries(values)) {
    device.queue.writeBuffer(buffer, fields[name], value instanceof Uint32Array ? value : new Float32Array(value));
  }
}
