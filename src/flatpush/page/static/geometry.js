/* Poses (x, y, θ) in mm and radians, outlines, and numbers as people read them. */

export const RAD = Math.PI / 180;

export const number = (value, digits) =>
  (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace("-", "−");

export const rounded = (value, digits) => Number(value.toFixed(digits)) + 0;

/* Where a point of the object is on the table. */
export const place = (pose, point) => [
  pose[0] + Math.cos(pose[2]) * point[0] - Math.sin(pose[2]) * point[1],
  pose[1] + Math.sin(pose[2]) * point[0] + Math.cos(pose[2]) * point[1]];

/* A pose of the scene's document, in degrees, as one in radians. */
export const radians = (pose) => [pose[0], pose[1], pose[2] === "free" ? 0 : pose[2] * RAD];

/* An angle in degrees within half a turn. */
export const within = (degrees) => {
  const turned = ((degrees + 180) % 360 + 360) % 360 - 180;
  return turned === -180 ? 180 : rounded(turned, 6);
};

export const isCircle = (outline) => !Array.isArray(outline);

/* The corners of an outline; of a circle, many. */
export function corners(outline, count = 72) {
  if (!isCircle(outline)) return outline;
  const [x, y] = outline.centre || [0, 0];
  return Array.from({ length: count }, (_, k) => {
    const angle = 2 * Math.PI * k / count;
    return [x + outline.circle * Math.cos(angle), y + outline.circle * Math.sin(angle)];
  });
}

export function centroid(outline) {
  if (isCircle(outline)) return outline.centre || [0, 0];
  let area = 0, x = 0, y = 0;
  const [x0, y0] = outline[0];
  outline.forEach((p, k) => {
    const q = outline[(k + 1) % outline.length];
    const cross = (p[0] - x0) * (q[1] - y0) - (q[0] - x0) * (p[1] - y0);
    area += cross; x += cross * (p[0] + q[0] - 2 * x0); y += cross * (p[1] + q[1] - 2 * y0);
  });
  return area === 0 ? outline[0] : [x0 + x / (3 * area), y0 + y / (3 * area)];
}

/* The greatest distance of two points of an outline, about. */
export function size(outline) {
  const [x0, y0, x1, y1] = box([corners(outline)]);
  return Math.hypot(x1 - x0, y1 - y0);
}

export function box(lines) {
  const points = lines.flat();
  const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

export const path = (points, closed = true) =>
  points.length ? "M" + points.map((p) => p[0].toFixed(3) + " " + p[1].toFixed(3)).join("L") + (closed ? "Z" : "") : "";

/* An arrow from a point along a unit vector, so many mm long; its head has the same size on every screen. */
export function arrow([x, y], [dx, dy], far, unit) {
  const head = 9 * unit, ex = x + far * dx, ey = y + far * dy;
  return `M${x} ${y}L${ex} ${ey}M${ex - head * (dx - 0.5 * dy)} ${ey - head * (dy + 0.5 * dx)}L${ex} ${ey}L${ex - head * (dx + 0.5 * dy)} ${ey - head * (dy - 0.5 * dx)}`;
}

/* Whether two outlines in W come nearer than a gap, by the circles around them. */
export function near(one, other, gap) {
  const [a, b] = [one, other].map((line) => box([line])), mid = (r) => [(r[0] + r[2]) / 2, (r[1] + r[3]) / 2];
  const reach = (line, at) => Math.max(...line.map((p) => Math.hypot(p[0] - at[0], p[1] - at[1])));
  const p = mid(a), q = mid(b);
  return Math.hypot(p[0] - q[0], p[1] - q[1]) < reach(one, p) + reach(other, q) + gap;
}

/* A pose of the document turned by so many degrees about the centroid of the object. */
export function turned(pose, outline, degrees) {
  const middle = centroid(outline), here = place(radians(pose), middle);
  const angle = within(rounded(pose[2] === "free" ? degrees : pose[2] + degrees, 4));
  const shift = place([0, 0, angle * RAD], middle);
  return [rounded(here[0] - shift[0], 3), rounded(here[1] - shift[1], 3), angle];
}

/* What is the same stays untouched: whatever is written is laid out again. */
export const set = (node, values) => { for (const key in values) if (node.getAttribute(key) !== String(values[key])) node.setAttribute(key, values[key]); };

export const say = (node, text) => { if (node.textContent !== text) node.textContent = text; };

export function svg(name, values = {}, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  set(node, values);
  node.append(...children);
  return node;
}

export function html(name, values = {}, ...children) {
  const node = document.createElement(name);
  set(node, values);
  node.append(...children);
  return node;
}

export const find = (id) => document.getElementById(id);
