// The program's own eye pass by WebGPU: all surfaces, and what is seen in mirrors and through glass, traced for each
// pixel. `chains.gz` says what to make and what to draw (src/eye_pass/renderer/web.rs); this host makes it and draws.

// Pictures of a view at rest, each through other places of its pixels.
const MOST_PICTURES = 16;
// Steps of the places within a pixel, and surfaces at which both ways on are followed: those of the window.
const STEPS = [0.7548776662466927, 0.5698402909980532];
const BRANCHING = { moving: 2, resting: 4 };
const LAYERS = ["caustic", "direct", "indirect"];
// Workgroups across a tile of `summed.wgsl`: 65 texels by eights.
const TILE_GROUPS = 9;
// Stands for no object, on triangles of instanced meshes.
const NO_OBJECT = 0xffffffff;
// Buffers have some size even without content [bytes].
const LEAST_BYTES = 256;

// Everything of a scene on the device. `asset` gives the bytes of a file of the page, `maps` are the page's, with their
// layers' `images`; throws where WebGPU is not there, or is played by the processor and that is not forced.
export async function start({ canvas, asset, maps, isForced }) {
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw new Error("the browser offers no WebGPU");
  if (adapter.info.isFallbackAdapter && !isForced) throw new Error("the browser has WebGPU without a graphics card");
  const wanted = ["maxBufferSize", "maxStorageBufferBindingSize", "maxTextureDimension2D"];
  const requiredLimits = Object.fromEntries(wanted.map((name) => [name, adapter.limits[name]]));
  const device = await adapter.requestDevice({ requiredLimits });
  const file = await asset("chains.gz");
  const length = new DataView(file.buffer, file.byteOffset).getUint32(0, true);
  const scene = JSON.parse(new TextDecoder().decode(file.subarray(4, 4 + length)));
  const part = ([first, bytes, record]) => {
    const stored = file.subarray(4 + length + first, 4 + length + first + bytes);
    return record ? unfiltered(stored, record) : stored;
  };
  scene.contents = Object.fromEntries(Object.entries(scene.contents).map(([name, place]) => [name, part(place)]));
  scene.maps = scene.maps.map(part);
  placeTriangles(scene);
  device.pushErrorScope("out-of-memory");
  device.pushErrorScope("validation");
  const eye = new EyePass(device, canvas, scene, maps);
  await eye.makePipelines();
  eye.setLight(0, {});
  for (const error of [await device.popErrorScope(), await device.popErrorScope()]) {
    if (error) throw new Error(`the graphics device refused the scene (${error.message})`);
  }
  return eye;
}

class EyePass {
  constructor(device, canvas, scene, maps) {
    Object.assign(this, { device, canvas, scene });
    this.lost = device.lost.then((loss) => loss.message || loss.reason);
    this.screenFormat = navigator.gpu.getPreferredCanvasFormat();
    this.screen = canvas.getContext("webgpu");
    this.screen.configure({ device, format: this.screenFormat, alphaMode: "premultiplied" });
    const modules = Object.entries(scene.programs).map(([label, code]) => [label, device.createShaderModule({ label, code })]);
    this.modules = Object.fromEntries(modules);
    const layouts = Object.entries(scene.layouts).map(([label, entries]) => [label, device.createBindGroupLayout({ label, entries })]);
    this.layouts = Object.fromEntries(layouts);
    this.makeBuffers();
    this.makeTextures();
    this.makeMaps(maps);
    // What is bound as `traced` and `frame` stays; only what it holds changes.
    const { uniforms, buffers } = this;
    const names = ["nodes", "triangles", "corners", "map_uvs", "indices", "lights"];
    this.traced = this.bind("traced", [uniforms.start, ...names.map((name) => buffers[name]), uniforms.wavelengths]);
    this.sky = this.textures.sky && this.bind("sky", [this.textures.sky.createView()]);
    this.bodies = bodies(scene);
    this.shown = {};
    this.light = [{}, {}];
  }

  makeBuffers() {
    const { device, scene } = this;
    const { contents } = scene;
    const made = (label, bytes, usage) => {
      const buffer = device.createBuffer({ label, size: Math.max(bytes.length, LEAST_BYTES), usage: usage | GPUBufferUsage.COPY_DST });
      device.queue.writeBuffer(buffer, 0, bytes);
      return buffer;
    };
    const { STORAGE, VERTEX, INDEX, UNIFORM } = GPUBufferUsage;
    const names = ["objects", "image_table", "nodes", "triangles", "corners", "map_uvs", "indices", "lights"];
    const usage = (name) => STORAGE | (name === "indices" ? INDEX : VERTEX);
    this.buffers = Object.fromEntries(names.map((name) => [name, made(name, contents[name], usage(name))]));
    const sets = contents.wavelengths;
    this.wavelengths = (picture) => {
      const bytes = sets.length / scene.pictures;
      return sets.subarray((picture % scene.pictures) * bytes, (picture % scene.pictures + 1) * bytes);
    };
    this.uniforms = {
      frame: made("frame", new Uint8Array(scene.Frame.size), UNIFORM),
      start: made("start", contents.start, UNIFORM),
      wavelengths: made("wavelengths", this.wavelengths(0), UNIFORM),
      white: made("white", contents.white, UNIFORM),
      share: made("share", new Uint8Array(16), UNIFORM),
      factors: made("factors", new Uint8Array(16), UNIFORM),
    };
  }

  makeTextures() {
    const { scene } = this;
    const { TEXTURE_BINDING, COPY_DST } = GPUTextureUsage;
    const filled = (label, { size, format }, bytes) => {
      const texture = this.device.createTexture({ label, size, format, usage: TEXTURE_BINDING | COPY_DST });
      const bytesPerRow = bytes.length / size[1] / size[2];
      this.device.queue.writeTexture({ texture }, bytes, { bytesPerRow, rowsPerImage: size[1] }, size);
      return texture;
    };
    const named = ["texture_tiles", "sky"].filter((name) => scene.contents[name]);
    this.textures = Object.fromEntries(named.map((name) => [name, filled(name, scene.textures[name], scene.contents[name])]));
  }

  // Textures of all layers of each map, and where its tiles lie.
  makeMaps(maps) {
    const { device, scene } = this;
    const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
    const texture = ({ width, height, levels }) => {
      const made = device.createTexture({ size: [width, height], mipLevelCount: levels.length, format: "rgb9e5ufloat", usage });
      levels.forEach((words, mipLevel) => {
        const size = [width, height].map((side) => Math.max(side >> mipLevel, 1));
        device.queue.writeTexture({ texture: made, mipLevel }, words, { bytesPerRow: 4 * size[0] }, size);
      });
      return made.createView();
    };
    const black = texture({ width: 1, height: 1, levels: [new Uint32Array(1)] });
    this.maps = maps.map(({ images }, index) => {
      const bytes = scene.maps[index];
      const tiles = device.createBuffer({ size: Math.max(bytes.length, LEAST_BYTES), usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
      device.queue.writeBuffer(tiles, 0, bytes);
      return { tiles, count: bytes.length / scene.MapTile.size, layers: LAYERS.map((layer) => (images[layer] ? texture(images[layer]) : black)) };
    });
    this.bilinear = device.createSampler({ magFilter: "linear", minFilter: "linear" });
  }

  bind(layout, resources) {
    const resource = (it) => (it instanceof GPUBuffer ? { buffer: it } : it);
    const entries = resources.map((it, binding) => ({ binding, resource: resource(it) }));
    return this.device.createBindGroup({ layout: this.layouts[layout] ?? layout, entries });
  }

  // A pipeline as the file describes it, with its module and layouts in place of their names.
  descriptor({ program, groups, vertex, fragment, ...rest }, changes = {}) {
    const module = this.modules[program];
    const buffers = vertex === "place" ? this.scene.vertices : [];
    return {
      ...rest,
      label: fragment?.entryPoint ?? "depth",
      layout: this.device.createPipelineLayout({ bindGroupLayouts: groups.map((name) => this.layouts[name]) }),
      vertex: { module, entryPoint: vertex, buffers },
      ...(fragment && { fragment: { ...fragment, module, ...changes } }),
    };
  }

  async makePipelines() {
    const { device, scene } = this;
    const made = (description, changes) => device.createRenderPipelineAsync(this.descriptor(description, changes));
    this.surfaces = await Promise.all(scene.surfaces.map((description) => made(description)));
    this.skyPipeline = this.sky && (await made(scene.sky));
    this.mean = await made(scene.mean);
    const compute = { module: this.modules.summed, entryPoint: "summed" };
    this.summed = await device.createComputePipelineAsync({ layout: "auto", compute });
  }

  // The tiles of all maps hold the layers that are switched on: first for all of the picture, then beside its line.
  setLight(side, layers) {
    const { device } = this;
    const factors = LAYERS.map((layer) => Number(layers[layer] ?? 1));
    const key = factors.join();
    if (this.light[side].key === key) return;
    const { size, format } = this.scene.textures.map_tiles;
    const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.STORAGE_BINDING;
    const tiles = this.light[side].tiles ?? device.createTexture({ label: "map tiles", size, format, usage });
    const all = { dimension: "2d-array" };
    const { buffers, textures, uniforms } = this;
    device.queue.writeBuffer(uniforms.factors, 0, new Float32Array(factors));
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    pass.setPipeline(this.summed);
    const layout = this.summed.getBindGroupLayout(0);
    for (const map of this.maps) {
      const bound = [uniforms.factors, map.tiles, this.bilinear, ...map.layers, tiles.createView(all)];
      pass.setBindGroup(0, this.bind(layout, bound));
      if (map.count) pass.dispatchWorkgroups(TILE_GROUPS, TILE_GROUPS, map.count);
    }
    pass.end();
    device.queue.submit([encoder.finish()]);
    const views = [tiles.createView(all), textures.texture_tiles.createView(all)];
    const frame = this.bind("frame", [uniforms.frame, buffers.objects, buffers.image_table, ...views]);
    this.light[side] = { key, tiles, frame };
  }

  makeTargets(width, height) {
    if (this.targets?.width === width && this.targets?.height === height) return;
    const { formats, samples } = this.scene;
    const { RENDER_ATTACHMENT, TEXTURE_BINDING } = GPUTextureUsage;
    const made = (label, format, sampleCount = 1) => {
      const usage = RENDER_ATTACHMENT | (sampleCount > 1 ? 0 : TEXTURE_BINDING);
      return this.device.createTexture({ label, size: [width, height], format, sampleCount, usage });
    };
    const textures = {
      radiance: made("radiance", formats.radiance),
      samples: made("samples", formats.radiance, samples),
      depth: made("depth", formats.depth, samples),
      traced: made("traced picture", formats.radiance),
      tracedDepth: made("traced depth", formats.depth),
      means: made("mean", formats.mean),
      otherMean: made("mean", formats.mean),
    };
    Object.values(this.targets?.textures ?? {}).forEach((texture) => texture.destroy());
    const views = Object.entries(textures).map(([name, texture]) => [name, texture.createView()]);
    this.targets = { width, height, textures, ...Object.fromEntries(views) };
    this.targets.composed = this.bind("composed", [this.targets.traced]);
  }

  // A picture of a view; done when the device is. Tells whether there is one: false colours are left to others.
  async draw(view) {
    if (view.falseColours) {
      const encoder = this.device.createCommandEncoder();
      encoder.beginRenderPass({ colorAttachments: [cleared(this.screen.getCurrentTexture().createView())] }).end();
      this.device.queue.submit([encoder.finish()]);
      this.view = null;
      return false;
    }
    // The camera may be another one when the view is drawn again.
    const { matrixWorld, fov, near } = view.camera;
    this.view = { ...view, layers: { ...view.layers }, camera: { elements: [...matrixWorld.elements], fov, near } };
    this.count = 0;
    await this.drawPicture();
    return true;
  }

  // The view that was drawn last once more, in the mean of all its pictures; tells whether another one would better it.
  async refine() {
    if (!this.view || this.count >= MOST_PICTURES) return false;
    await this.drawPicture();
    return this.count < MOST_PICTURES;
  }

  async drawPicture() {
    const { device, view, count } = this;
    const { width, height, layers, line = 2 } = view;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    this.makeTargets(width, height);
    this.setLight(0, layers);
    const border = Math.round(Math.min(Math.max(line, 0), 1) * width);
    const sides = [{ left: 0, right: border, frame: this.light[0].frame }];
    if (border < width) {
      this.setLight(1, { ...layers, caustic: 0 });
      sides.push({ left: border, right: width, frame: this.light[1].frame });
    }
    this.writeUniforms(view, count);
    const encoder = device.createCommandEncoder();
    this.trace(encoder, sides.filter(({ left, right }) => right > left));
    this.show(encoder, count);
    device.queue.submit([encoder.finish()]);
    this.count += 1;
    await device.queue.onSubmittedWorkDone();
  }

  writeUniforms({ camera, width, height, exposureStops, moving }, picture) {
    const { scene, device, uniforms } = this;
    const axis = (column, factor = 1) => [0, 1, 2].map((row) => camera.elements[4 * column + row] * factor);
    const [eye, forward] = [axis(3), axis(2, -1)];
    const halfHeight = Math.tan((camera.fov * Math.PI) / 360);
    const aspect = width / height;
    const [x, y] = [axis(0, 1 / (halfHeight * aspect)), axis(1, 1 / halfHeight)];
    const columns = [0, 1, 2].map((column) => [x[column], y[column], 0, forward[column]]);
    const place = (step) => (picture === 0 ? 0 : ((0.5 + step * picture) % 1) - 0.5);
    const [right, down] = STEPS.map(place);
    const exposure = 2 ** exposureStops;
    write(device, uniforms.frame, scene.Frame, {
      clip_from_camera: [...columns.flat(), 0, 0, camera.near, 0],
      camera_position: eye,
      radiance_scale: [exposure],
      background: scene.background,
      level_bias: [picture === 0 ? 0 : -1],
      forward,
      traced_width: [width],
      right: axis(0, halfHeight * aspect),
      traced_height: [height],
      up: axis(1, halfHeight),
      pixel_rad: [(2 * halfHeight) / height],
      jitter: [(2 * right) / width, (-2 * down) / height],
      traced_per_pixel: [1, 1],
      fault: [1],
    });
    const { centre_m, per_m } = scene.local;
    write(device, uniforms.start, scene.ChainStart, {
      eye: eye.map((coordinate, index) => (coordinate - centre_m[index]) * per_m),
      near: [camera.near * per_m],
      media: media(this.bodies, eye),
      branching_depth: new Uint32Array([moving ? BRANCHING.moving : BRANCHING.resting]),
    });
    device.queue.writeBuffer(uniforms.wavelengths, 0, this.wavelengths(picture));
  }

  // The passes of a picture: depths and chains of what is specular, then all surfaces.
  trace(encoder, sides) {
    const { targets } = this;
    const each = (pass, draw) => {
      for (const { left, right, frame } of sides) {
        pass.setScissorRect(left, 0, right - left, targets.height);
        pass.setBindGroup(0, frame);
        draw();
      }
      pass.end();
    };
    const depth = (view, more) => ({ view, depthClearValue: 0, ...more });
    const nearest = encoder.beginRenderPass({
      colorAttachments: [],
      depthStencilAttachment: depth(targets.tracedDepth, { depthLoadOp: "clear", depthStoreOp: "store" }),
    });
    each(nearest, () => this.drawEach(nearest, "depths"));
    const chains = encoder.beginRenderPass({
      colorAttachments: [cleared(targets.traced)],
      depthStencilAttachment: depth(targets.tracedDepth, { depthLoadOp: "load", depthStoreOp: "discard" }),
    });
    chains.setBindGroup(1, this.traced);
    if (this.sky) chains.setBindGroup(2, this.sky);
    each(chains, () => this.drawEach(chains, "traced"));
    const surfaces = encoder.beginRenderPass({
      colorAttachments: [{ ...cleared(targets.samples), resolveTarget: targets.radiance, storeOp: "discard" }],
      depthStencilAttachment: depth(targets.depth, { depthLoadOp: "clear", depthStoreOp: "discard" }),
    });
    each(surfaces, () => {
      if (this.sky) {
        surfaces.setPipeline(this.skyPipeline);
        surfaces.setBindGroup(1, this.bind("nothing", []));
        surfaces.setBindGroup(2, this.sky);
        surfaces.draw(3);
      }
      surfaces.setBindGroup(1, targets.composed);
      this.drawEach(surfaces, "composed");
      this.drawEach(surfaces, "own");
    });
  }

  drawEach(pass, list) {
    const { corners, map_uvs, objects, indices } = this.buffers;
    [corners, map_uvs, objects].forEach((buffer, slot) => pass.setVertexBuffer(slot, buffer));
    pass.setIndexBuffer(indices, "uint32");
    for (const [pipeline, indexCount, objectCount, firstIndex, firstObject] of this.scene.draws[list]) {
      pass.setPipeline(this.surfaces[pipeline]);
      pass.drawIndexed(indexCount, objectCount, firstIndex, 0, firstObject);
    }
  }

  // Takes a picture up in the mean, and the mean to the screen.
  show(encoder, count) {
    const { device, scene, targets, uniforms } = this;
    const covered = (pipeline, bound, view) => {
      const pass = encoder.beginRenderPass({ colorAttachments: [cleared(view)] });
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, bound);
      pass.draw(3);
      pass.end();
    };
    device.queue.writeBuffer(uniforms.share, 0, new Float32Array([1 / (count + 1), 0, 0, 0]));
    const { means, otherMean, radiance } = targets;
    const [before, after] = count % 2 ? [otherMean, means] : [means, otherMean];
    covered(this.mean, this.bind("mean", [uniforms.share, radiance, before]), after);
    const toneMap = this.view.toneMap;
    this.shown[toneMap] ??= device.createRenderPipeline(
      this.descriptor(scene.shown, { constants: scene.tone_maps[toneMap], targets: [{ format: this.screenFormat }] }),
    );
    covered(this.shown[toneMap], this.bind("shown", [after, uniforms.white]), this.screen.getCurrentTexture().createView());
  }
}

function cleared(view) {
  return { view, loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 0] };
}

// Fields of a struct, as the shaders lay it out.
function write(device, buffer, { fields }, values) {
  for (const [name, value] of Object.entries(values)) {
    device.queue.writeBuffer(buffer, fields[name], value instanceof Uint32Array ? value : new Float32Array(value));
  }
}

// Undoes what `filtered` of the exporter did: bytes of a record lie with those of the others, and words are differences.
function unfiltered(stored, record) {
  const count = stored.length / record, across = record / 4;
  const bytes = new Uint8Array(stored.length), words = new Uint32Array(bytes.buffer);
  for (let plane = 0, at = 0; plane < record; plane += 1) {
    for (let place = plane; place < bytes.length; place += record) bytes[place] = stored[at++];
  }
  for (let word = across; word < words.length; word += 1) words[word] += words[word - across];
  return bytes;
}

// Where corners of objects are in the scene [m]: a function of an object and a corner's place in the list of indices.
function placing({ contents: { objects, corners, indices }, vertices, ObjectRecord }) {
  const floats = (bytes) => new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
  const [rows, points, numbers] = [floats(objects), floats(corners), new Uint32Array(indices.buffer)];
  const [stride, across] = [vertices[0].arrayStride / 4, ObjectRecord.size / 4];
  return (object, index) => {
    const at = numbers[index] * stride, row = object * across + ObjectRecord.fields.row_x / 4;
    return [row, row + 4, row + 8].map((row) =>
      rows[row] * points[at] + rows[row + 1] * points[at + 1] + rows[row + 2] * points[at + 2] + rows[row + 3]);
  };
}

// Gives triangles their corners back, in local coordinates, and the numbers of their order.
function placeTriangles(scene) {
  const { contents: { triangles }, Triangle: { size, fields }, local: { centre_m: centre, per_m: perM } } = scene;
  const words = new Uint32Array(triangles.buffer), floats = new Float32Array(triangles.buffer);
  const place = placing(scene);
  for (let at = 0; at < words.length; at += size / 4) {
    const object = words[at + fields.object / 4], first = words[at + fields.first_index / 4];
    if (object === NO_OBJECT) continue;
    const order = at + fields.order / 4;
    words[order] = ((words[order] + first) >>> 0) / 3;
    [fields.a, fields.b, fields.c].forEach((field, corner) =>
      floats.set(place(object, first + corner).map((coordinate, axis) => (coordinate - centre[axis]) * perM), at + field / 4));
  }
}

// Bodies that an eye can be in: number, and triangles in the scene [m] with the box around them.
function bodies(scene) {
  const { objects } = scene.contents;
  const records = new DataView(objects.buffer, objects.byteOffset);
  const place = placing(scene);
  const found = [];
  for (const [, count, objectCount, first, firstObject] of scene.draws.composed) {
    for (let object = firstObject; object < firstObject + objectCount; object += 1) {
      if (!records.getUint32(object * scene.ObjectRecord.size + scene.ObjectRecord.fields.solid, true)) continue;
      const places = new Float64Array(3 * count);
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (let at = 0; at < count; at += 1) {
        place(object, first + at).forEach((coordinate, axis) => {
          places[3 * at + axis] = coordinate;
          low[axis] = Math.min(low[axis], coordinate);
          high[axis] = Math.max(high[axis], coordinate);
        });
      }
      found.push({ object, places, low, high });
    }
  }
  return found;
}

// Those that a ray from the eye straight up leaves more often than it enters, as `medium.wgsl` has them: 16 bits each, the
// one first that is left first.
function media(bodies, [x, y, z]) {
  const within = [];
  for (const { object, places: p, low, high } of bodies) {
    if ([x, y, z].some((place, axis) => place < low[axis] || place > high[axis])) continue;
    let leaves = 0, nearest = Infinity;
    for (let a = 0; a < p.length; a += 9) {
      // Twice the areas, seen from below, of the triangles that the eye makes with each side.
      const area = (i, j) => (p[j] - x) * (p[i + 2] - z) - (p[i] - x) * (p[j + 2] - z);
      const [ab, bc, ca] = [area(a, a + 3), area(a + 3, a + 6), area(a + 6, a)];
      const whole = ab + bc + ca;
      if (whole === 0 || [ab, bc, ca].some((part) => part / whole < 0)) continue;
      const height = (bc * p[a + 1] + ca * p[a + 4] + ab * p[a + 7]) / whole - y;
      if (height <= 0) continue;
      leaves += Math.sign(whole);
      if (whole > 0) nearest = Math.min(nearest, height);
    }
    if (leaves > 0) within.push({ object, nearest });
  }
  const words = new Uint32Array(4);
  within.sort((a, b) => a.nearest - b.nearest);
  within.slice(0, 8).forEach(({ object }, place) => { words[place >> 1] |= (object + 1) << (16 * (place & 1)); });
  return words;
}
