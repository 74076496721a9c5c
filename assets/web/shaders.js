// What the stage is drawn with (GLSL). Light maps hold irradiance E [W/m²]; everything is drawn as radiance [W/(m² sr)]
// times a gain, so that it fits half floats.

// Coefficients of t⁶ … t⁰ (see illumination/false_colours.rs of the program).
export const viridis = [
  [-5.435455855934631, 4.645852612178535, 26.3124352495832],
  [4.776384997670288, -13.74514537774601, -65.35303263337234],
  [6.228269936347081, 14.17993336680509, 56.69055260068105],
  [-4.634230498983486, -5.799100973351585, -19.33244095627987],
  [-0.3308618287255563, 0.214847559468213, 0.09509516302823659],
  [0.1050930431085774, 1.404613529898575, 1.384590162594685],
  [0.2777273272234177, 0.005407344544966578, 0.3340998053353061],
];

const shared = /* glsl */ `
#define PI 3.141592653589793
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

vec3 linear_from_srgb(vec3 display) {
  return mix(pow((display + 0.055) / 1.055, vec3(2.4)), display / 12.92, vec3(lessThanEqual(display, vec3(0.04045))));
}

vec3 viridis(float place) {
  float t = clamp(place, 0.0, 1.0);
  vec3 colour = vec3(0.0);
  ${viridis.map((row) => `colour = colour * t + vec3(${row.join(", ")});`).join("\n  ")}
  return clamp(colour, 0.0, 1.0);
}
`;

export const surfaceVertex = /* glsl */ `
uniform mat3 look_matrix;
varying vec2 map_uv, look_uv;
varying vec3 place, normal_world, tint;

void main() {
  mat4 world = modelMatrix;
#ifdef USE_INSTANCING
  world *= instanceMatrix;
#endif
  vec4 at = world * vec4(position, 1.0);
  place = at.xyz;
  normal_world = transpose(inverse(mat3(world))) * normal;
  map_uv = MAP_UV;
  look_uv = (look_matrix * vec3(LOOK_UV, 1.0)).xy;
  tint = vec3(1.0);
#if defined(USE_COLOR) || defined(USE_COLOR_ALPHA)
  tint = color.rgb;
#endif
  gl_Position = projectionMatrix * viewMatrix * at;
}
`;

export const surfaceFragment = shared + /* glsl */ `
uniform sampler2D caustic, direct, indirect, caustic_back, direct_back, indirect_back, look, glow_look, backs;
uniform samplerCube probe;
uniform vec3 base, glow, absorption_per_m, weights, probe_at, box_low, box_high, false_scale;
uniform vec2 pixels;
uniform float gain, line, ior, coat, roughness, cutoff, opacity, inner_m;
uniform mat4 clip_from_world;
varying vec2 map_uv, look_uv;
varying vec3 place, normal_world, tint;

// Right of the line, caustics are off.
vec3 caustics() {
  vec3 light = gl_FrontFacing ? texture2D(caustic, map_uv).rgb : texture2D(caustic_back, map_uv).rgb;
  return gl_FragCoord.x > line ? vec3(0.0) : weights.x * light;
}

vec3 others() {
  if (gl_FrontFacing) return weights.y * texture2D(direct, map_uv).rgb + weights.z * texture2D(indirect, map_uv).rgb;
  return weights.y * texture2D(direct_back, map_uv).rgb + weights.z * texture2D(indirect_back, map_uv).rgb;
}

// Unpolarised, from outside to inside where eta > 1.
float fresnel(float cosine, float eta) {
  float squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
  if (squared <= 0.0) return 1.0;
  float beyond = sqrt(squared);
  float s = (cosine - eta * beyond) / (cosine + eta * beyond);
  float p = (eta * cosine - beyond) / (eta * cosine + beyond);
  return 0.5 * (s * s + p * p);
}

// What comes to a place from a direction: the picture around the object, as if all of it were painted on a box.
vec3 around(vec3 from, vec3 direction, float blur) {
  vec3 far = max((box_high - from) / direction, (box_low - from) / direction);
  float distance_m = min(far.x, min(far.y, far.z));
  vec3 towards = distance_m > 0.0 ? from + direction * distance_m - probe_at : direction;
  // Radiance times the gain; its alpha is the caustics' share.
  vec4 seen = textureLod(probe, towards, blur);
  return (gl_FragCoord.x > line ? 1.0 - seen.a : 1.0) / gain * seen.rgb;
}

#ifdef GLASS
// Nearest back of glass on the way through a pixel: its normal, and its distance from the camera.
vec4 back_at(vec3 point) {
  vec4 clip = clip_from_world * vec4(point, 1.0);
  return texture2D(backs, clip.xy / clip.w * 0.5 + 0.5);
}

// Two interfaces, the second one found in the picture of backs (Wyman 2005).
vec3 through(vec3 gaze, vec3 normal) {
  vec3 inside = refract(gaze, normal, 1.0 / ior);
  float near = distance(place, cameraPosition);
  vec4 back = texture2D(backs, gl_FragCoord.xy / pixels);
  if (back.w <= near) return around(place, inside, 0.0) / (ior * ior);
  float thickness = back.w - near;
  for (int step = 0; step < 3; step++) {
    vec3 leaves = place + inside * thickness;
    vec4 found = back_at(leaves);
    if (found.w <= near) break;
    back = found;
    thickness = distance(place, cameraPosition + normalize(leaves - cameraPosition) * back.w);
  }
  vec3 leaves = place + inside * thickness;
  vec3 inward = -normalize(back.xyz);
  vec3 onward = refract(inside, inward, ior);
  float kept = fresnel(max(-dot(inside, inward), 0.0), 1.0 / ior);
  if (dot(onward, onward) < 0.5) {
    onward = reflect(inside, inward);
    kept = 0.0;
  }
  return (1.0 - kept) * base * exp(-absorption_per_m * thickness) * around(leaves, onward, 0.0);
}
#endif

void main() {
  vec4 texel = texture2D(look, look_uv);
  if (texel.a * opacity < cutoff) discard;
  vec3 colour = base * tint * texel.rgb;
  vec3 gaze = normalize(place - cameraPosition);
  vec3 normal = normalize(normal_world) * (dot(gaze, normal_world) > 0.0 ? -1.0 : 1.0);
  float cosine = clamp(-dot(gaze, normal), 0.0, 1.0);
  float blur = 9.0 * roughness;
  vec3 light = glow * texture2D(glow_look, look_uv).rgb;
  float alpha = 1.0;
  if (false_scale.z > 0.0) {
#ifdef LIT
    float place_on_scale = log2(max(dot(caustics() + others(), LUMINANCE), 1e-30)) - false_scale.x;
    gl_FragColor = vec4(linear_from_srgb(viridis(place_on_scale * false_scale.y)), 1.0);
#else
    gl_FragColor = vec4(vec3(0.01), 1.0);
#endif
    return;
  }
#if defined(INNER)
  // As thick as a sphere of its width.
  float thickness = inner_m * cosine;
  light += base * exp(-absorption_per_m * thickness) * around(place + gaze * thickness, gaze, 0.0);
#elif defined(GLASS)
  float mirrored = fresnel(cosine, ior);
  light += mirrored * around(place, reflect(gaze, normal), blur) + (1.0 - mirrored) * base * through(gaze, normal);
#elif defined(PANE)
  float once = fresnel(cosine, ior);
  float mirrored = 2.0 * once / (1.0 + once);
  light += mirrored * around(place, reflect(gaze, normal), blur);
  alpha = mirrored;
#elif defined(MIRROR)
  vec3 reflectance = colour + (1.0 - colour) * pow(1.0 - cosine, 5.0);
  light += reflectance * around(place, reflect(gaze, normal), blur);
  alpha = 0.0;
#else
  float mirrored = coat > 0.0 ? coat * fresnel(cosine, ior) : 0.0;
  vec3 bright = caustics();
  vec3 all = bright + others();
  light += (1.0 - mirrored) * colour * all / PI;
  if (mirrored > 0.0) light += mirrored * around(place, reflect(gaze, normal), blur);
#ifdef BLENDED
  alpha = texel.a * opacity;
#else
  alpha = dot(bright, LUMINANCE) / max(dot(all, LUMINANCE), 1e-30);
#endif
#endif
  gl_FragColor = vec4(min(light * gain, vec3(32768.0)), alpha);
}
`;

export const backVertex = /* glsl */ `
varying vec3 place, normal_world;
void main() {
  vec4 at = modelMatrix * vec4(position, 1.0);
  place = at.xyz;
  normal_world = transpose(inverse(mat3(modelMatrix))) * normal;
  gl_Position = projectionMatrix * viewMatrix * at;
}
`;

export const backFragment = /* glsl */ `
varying vec3 place, normal_world;
void main() {
  gl_FragColor = vec4(normalize(normal_world), distance(place, cameraPosition));
}
`;

export const skyVertex = /* glsl */ `
varying vec3 direction;
void main() {
  direction = position;
  vec4 clip = projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0);
  gl_Position = clip.xyww;
}
`;

export const skyFragment = /* glsl */ `
#define PI 3.141592653589793
uniform sampler2D sky;
uniform float gain;
varying vec3 direction;
void main() {
  float turns = atan(direction.x, -direction.z) / (2.0 * PI);
  float polar = atan(length(direction.xz), direction.y) / PI;
  vec3 light = textureLod(sky, vec2(fract(turns), polar), 0.0).rgb;
  gl_FragColor = vec4(min(light * gain, vec3(32768.0)), 0.0);
}
`;

// Twin of shaders/shared/tone_map.wgsl: matrices are written row by row and multiplied from the left.
export const displayFragment = /* glsl */ `
uniform sampler2D picture;
uniform float exposure;
uniform int tone_map;
varying vec2 within;

vec3 neutral(vec3 exposed) {
  float darkest = min(exposed.r, min(exposed.g, exposed.b));
  float offset = darkest < 0.08 ? darkest - 6.25 * darkest * darkest : 0.04;
  vec3 colour = exposed - offset;
  float peak = max(colour.r, max(colour.g, colour.b));
  if (peak < 0.76) return colour;
  float new_peak = 1.0 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
  float whiteness = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
  return mix(colour * (new_peak / peak), vec3(new_peak), whiteness);
}

const mat3 AGX_INSET = mat3(
  0.842398929049531, 0.078430165104864, 0.079170905845605,
  0.042398929049531, 0.878430165104864, 0.079170905845605,
  0.042398929049531, 0.078430165104864, 0.879170905845605);
const mat3 AGX_OUTSET = mat3(
  1.197001338688086, -0.098037706381080, -0.098963632307006,
  -0.052998661311914, 1.151962293618920, -0.098963632307006,
  -0.052998661311914, -0.098037706381080, 1.151036367692994);

vec3 agx(vec3 exposed) {
  const float least = -12.473931188332413, most = 4.026068811667587;
  vec3 stops = clamp(log2(max(exposed * AGX_INSET, vec3(1e-5))), least, most);
  vec3 rise = 2.0 * ((stops - least) / (most - least) - 10.0 / 16.5);
  vec3 is_toe = vec3(lessThan(rise, vec3(0.0)));
  vec3 power = mix(vec3(3.25), vec3(3.0), is_toe);
  vec3 scale = mix(vec3(0.5414641562781497), vec3(0.5122773822930714), is_toe);
  vec3 codes = (0.5 + rise * pow(1.0 + pow(abs(rise) / scale, power), -1.0 / power)) * AGX_OUTSET;
  return pow(max(codes, 0.0), vec3(2.2));
}

const mat3 ACES_INPUT = mat3(0.59719, 0.35458, 0.04823, 0.07600, 0.90834, 0.01566, 0.02840, 0.13383, 0.83777);
const mat3 ACES_OUTPUT = mat3(1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602);

vec3 aces(vec3 exposed) {
  vec3 v = exposed * ACES_INPUT;
  return ((v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)) * ACES_OUTPUT;
}

vec3 soft(vec3 exposed) {
  const float shoulder = 0.4, step_ = 0.12387274177484112;
  float peak = max(exposed.r, max(exposed.g, exposed.b));
  if (peak <= shoulder) return exposed;
  float new_peak = min(shoulder + step_ * log(1.0 + (peak - shoulder) / step_), 1.0);
  float part = (new_peak - shoulder) / (1.0 - shoulder);
  return new_peak * mix(exposed / peak, vec3(1.0), 0.4 * part * part * part);
}

void main() {
  vec3 light = max(texture2D(picture, within).rgb * exposure, 0.0);
  if (tone_map == 1) light = neutral(light);
  else if (tone_map == 2) light = agx(light);
  else if (tone_map == 3) light = aces(light);
  else if (tone_map == 4) light = soft(light);
  light = clamp(light, 0.0, 1.0);
  vec3 codes = mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, light * 12.92, vec3(lessThanEqual(light, vec3(0.0031308))));
  gl_FragColor = vec4(codes, 1.0);
}
`;

export const displayVertex = /* glsl */ `
varying vec2 within;
void main() {
  within = position.xy * 0.5 + 0.5;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}
`;
