/** Shaders: solids with a light at the viewer, and lines of constant width on the screen with dashes. */
import { DoubleSide, ShaderMaterial, Vector2 } from "three";

const LIGHT = /* glsl */ `
float light(vec3 n) {
  return 0.42 + 0.13 * (0.5 + 0.5 * n.y) + 0.5 * max(dot(n, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
}`;

/** Round solids: a normal at each corner. */
const ROUND_VERTEX = /* glsl */ `
attribute vec4 colour;
varying vec4 shade;
${LIGHT}
void main() {
  // Normals of a shape that is scaled by different factors along its axes: divide by their squares.
  mat3 m = mat3(instanceMatrix);
  vec3 squares = vec3(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2]));
  vec3 n = normalize(mat3(viewMatrix) * (m * (normal / squares)));
  shade = vec4(colour.rgb * light(n), colour.a);
  gl_Position = projectionMatrix * (viewMatrix * (instanceMatrix * vec4(position, 1.0)));
}`;

const ROUND_FRAGMENT = /* glsl */ `
varying vec4 shade;
void main() {
  gl_FragColor = shade;
}`;

/** Solids with plane faces: the normal of a face follows from the picture, so that its corners can be shared. */
const FLAT_VERTEX = /* glsl */ `
attribute vec4 colour;
varying vec4 paint;
varying vec3 place;
void main() {
  vec4 seen = viewMatrix * (instanceMatrix * vec4(position, 1.0));
  paint = colour;
  // near zero, where numbers on the graphics processor are finest
  place = seen.xyz + vec3(0.0, 0.0, MIDDLE);
  gl_Position = projectionMatrix * seen;
}`;

const FLAT_FRAGMENT = /* glsl */ `
varying vec4 paint;
varying vec3 place;
${LIGHT}
void main() {
  vec3 n = normalize(cross(dFdx(place), dFdy(place)));
  gl_FragColor = vec4(paint.rgb * light(n), paint.a);
}`;

const LINE_VERTEX = /* glsl */ `
attribute vec3 from;
attribute vec3 to;
attribute float start;
attribute vec4 colour;
attribute vec2 dash;
uniform vec2 screen;
uniform float pxPerMm;
varying vec3 tint;
varying vec2 pattern;
varying float along;
void main() {
  vec4 a = vec4(from, 1.0);
  vec4 b = vec4(to, 1.0);
  #ifdef USE_INSTANCING
  a = instanceMatrix * a;
  b = instanceMatrix * b;
  #endif
  a = modelViewMatrix * a;
  b = modelViewMatrix * b;
  float size = distance(a.xyz, b.xyz);
  // Outlines lie on the surfaces that they outline: bring them before these.
  a.z += 0.8;
  b.z += 0.8;
  vec4 p = projectionMatrix * a;
  vec4 q = projectionMatrix * b;
  vec2 way = (q.xy - p.xy) * screen;
  float onScreen = length(way);
  vec2 direction = onScreen > 1e-4 ? way / onScreen : vec2(1.0, 0.0);
  vec2 side = vec2(-direction.y, direction.x);
  // position.x is 0 or 1 along the line, position.y is -1 or 1 across it; ends are half a width longer.
  float end = position.x * 2.0 - 1.0;
  vec2 shift = (side * position.y + direction * end * 0.5) * colour.a / screen;
  gl_Position = mix(p, q, position.x);
  gl_Position.xy += shift * gl_Position.w;
  tint = colour.rgb;
  pattern = dash;
  along = (start + position.x * size) * pxPerMm;
}`;

const LINE_FRAGMENT = /* glsl */ `
varying vec3 tint;
varying vec2 pattern;
varying float along;
void main() {
  if (pattern.y > 0.0 && mod(along, pattern.x + pattern.y) > pattern.x) discard;
  gl_FragColor = vec4(tint, 1.0);
}`;

/** Distance of the viewer from the middle of the picture, mm: everything lies before the viewer. */
export const MIDDLE_MM = 5000;

/** A material for solids, round ones or with plane faces; see-through ones do not hide each other. */
export function solidMaterial(kind: "round" | "flat", seeThrough = false): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader: kind === "flat" ? FLAT_VERTEX : ROUND_VERTEX,
    fragmentShader: kind === "flat" ? FLAT_FRAGMENT : ROUND_FRAGMENT,
    defines: { MIDDLE: MIDDLE_MM.toFixed(1) },
    transparent: seeThrough,
    depthWrite: !seeThrough,
  });
}

/** What all lines share: the size of the screen, px, and its scale. */
export interface LineUniforms {
  readonly [name: string]: { value: unknown };
  readonly screen: { value: Vector2 };
  readonly pxPerMm: { value: number };
}

export function lineUniforms(): LineUniforms {
  return { screen: { value: new Vector2(1, 1) }, pxPerMm: { value: 1 } };
}

/** A material for lines, which solids hide or not; all lines share the uniforms. */
export function lineMaterial(uniforms: LineUniforms, isHidden: boolean): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader: LINE_VERTEX,
    fragmentShader: LINE_FRAGMENT,
    uniforms,
    side: DoubleSide,
    depthTest: isHidden,
    depthWrite: isHidden,
    // what is always seen is drawn after all that might cover it
    transparent: !isHidden,
  });
}
