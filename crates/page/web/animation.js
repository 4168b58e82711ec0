// The motion, drawn as it goes: in its own time, or faster where it is long.
import { planeOf } from "./figures.js";

/// The longest time of a showing, in seconds.
const LONGEST = 20;

const isAngle = (name) => /^(theta|phi|psi|alpha|beta|a|b)\d*$/.test(name);

/// The interval of the values of some columns.
const range = (rows, names) => {
  let [low, high] = [Infinity, -Infinity];
  for (const name of names) {
    const of = rows.column(name);
    for (let row = 0; row < rows.count; row++) {
      const x = of(row);
      if (Number.isFinite(x)) [low, high] = [Math.min(low, x), Math.max(high, x)];
    }
  }
  return low <= high ? [low, high] : [-1, 1];
};

/// A map from a rectangle of the plane to the canvas, with equal scales.
const view = ([left, right], [low, high], { width, height }) => {
  const scale = 0.86 * Math.min(width / Math.max(right - left, 1e-9), height / Math.max(high - low, 1e-9));
  const middle = [(left + right) / 2, (low + high) / 2];
  return ([x, y]) => [width / 2 + scale * (x - middle[0]), height / 2 - scale * (y - middle[1])];
};

const line = (pen, points, width = 3) => {
  pen.lineWidth = width;
  pen.beginPath();
  points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
};

const disc = (pen, [x, y], radius) => {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
};

/// How a motion is drawn: a function of the pen, the canvas and the number of a row.
const drawing = (scene, rows, rods) => {
  const { coordinates: names } = scene;
  if (scene.kind === "body") return bodyOf(rows);
  if (scene.kind === "lattice") return latticeOf(scene, rows);
  if (rods) return rodsOf(rows, rods);
  const angles = names.slice(0, 2).filter(isAngle);
  if (angles.length && angles.length === Math.min(names.length, 2)) return pendulaOf(rows, angles);
  const plane = planeOf(names);
  return plane ? pointOf(rows, plane) : heightOf(rows, names[0]);
};

const pendulaOf = (rows, angles) => {
  const of = angles.map((name) => rows.column(name));
  const reach = [-angles.length, angles.length];
  return (pen, canvas, row) => {
    const at = view(reach, reach, canvas);
    let [x, y] = [0, 0];
    const points = [[x, y], ...of.map((angle) => [(x += Math.sin(angle(row))), (y -= Math.cos(angle(row)))])].map(at);
    line(pen, points);
    points.slice(1).forEach((point) => disc(pen, point, 10));
  };
};

const rodsOf = (rows, rods) => {
  const names = rods.flat().filter((end) => typeof end[0] === "string");
  const place = ([x, y], row) => (typeof x === "string" ? [rows.column(x)(row), rows.column(y)(row)] : [x, y]);
  const fixed = rods.flat().filter((end) => typeof end[0] === "number");
  const extent = (k) => {
    const [low, high] = range(rows, names.map((name) => name[k]));
    return [Math.min(low, ...fixed.map((end) => end[k])), Math.max(high, ...fixed.map((end) => end[k]))];
  };
  const [width, height] = [extent(0), extent(1)];
  return (pen, canvas, row) => {
    const at = view(width, height, canvas);
    for (const rod of rods) {
      const ends = rod.map((end) => at(place(end, row)));
      line(pen, ends);
      ends.forEach((end) => disc(pen, end, 5));
    }
  };
};

const pointOf = (rows, [x, y]) => {
  const of = [rows.column(x), rows.column(y)];
  const [width, height] = [range(rows, [x]), range(rows, [y])];
  return (pen, canvas, row) => {
    const at = view(width, height, canvas);
    const from = Math.max(0, row - 400);
    const trail = [];
    for (let k = from; k <= row; k++) trail.push(at([of[0](k), of[1](k)]));
    line(pen, trail, 1.5);
    disc(pen, at([of[0](row), of[1](row)]), 7);
  };
};

const heightOf = (rows, name) => {
  const of = rows.column(name);
  const [low, high] = range(rows, [name]);
  return (pen, canvas, row) => {
    const at = (x) => canvas.height * (0.93 - (0.86 * (x - low)) / Math.max(high - low, 1e-9));
    line(pen, [[canvas.width / 2, at(low)], [canvas.width / 2, at(high)]], 1);
    disc(pen, [canvas.width / 2, at(of(row))], 10);
  };
};

const latticeOf = (scene, rows) => {
  const sites = scene.sizes.reduce((product, size) => product * size, 1);
  let [low, high] = [Infinity, -Infinity];
  for (let row = 0; row < rows.count; row++) {
    for (let k = 1; k <= sites; k++) {
      const x = rows.numbers[row * rows.width + k];
      [low, high] = [Math.min(low, x), Math.max(high, x)];
    }
  }
  return (pen, canvas, row) => {
    const points = Array.from({ length: sites }, (_, k) => [
      canvas.width * (0.04 + (0.92 * k) / sites),
      canvas.height * (0.93 - (0.86 * (rows.numbers[row * rows.width + 1 + k] - low)) / Math.max(high - low, 1e-9)),
    ]);
    line(pen, points, 2);
  };
};

/// A rigid body: its three axes, and the path of its centre of mass, seen from the side and a little from above.
const bodyOf = (rows) => {
  const q = ["q_w", "q_x", "q_y", "q_z"].map((name) => rows.column(name));
  const tip = ["tip_x", "tip_y", "tip_z"].map((name) => rows.column(name));
  const seen = ([x, y, z]) => [x * 0.9 - y * 0.43, z * 0.92 + (x * 0.43 + y * 0.9) * 0.39];
  const length = Math.hypot(...tip.map((of) => of(0))) || 1;
  const rotated = (row, [a, b, c]) => {
    const [w, x, y, z] = q.map((of) => of(row));
    const [s, t, u] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
    return [a + w * s + y * u - z * t, b + w * t + z * s - x * u, c + w * u + x * t - y * s];
  };
  return (pen, canvas, row) => {
    const at = view([-1.2 * length, 1.2 * length], [-1.2 * length, 1.2 * length], canvas);
    const trail = [];
    for (let k = Math.max(0, row - 500); k <= row; k++) trail.push(at(seen(tip.map((of) => of(k)))));
    line(pen, trail, 1);
    const middle = at([0, 0]);
    const ring = [];
    const centre = tip.map((of) => of(row));
    for (let k = 0; k <= 32; k++) {
      const angle = (2 * Math.PI * k) / 32;
      const [c, s] = [0.4 * length * Math.cos(angle), 0.4 * length * Math.sin(angle)];
      ring.push(at(seen(rotated(row, [c, 0, s]).map((x, i) => x + centre[i]))));
    }
    line(pen, ring, 2);
    line(pen, [middle, at(seen(centre))], 4);
    // A spoke, by which the spin is seen.
    line(pen, [at(seen(centre)), ring[0]], 2);
  };
};

export class Animation {
  #canvas;
  #clock;
  #draw;
  #rows;
  #began;
  #isPlaying = true;

  constructor(canvas, clock) {
    this.#canvas = canvas;
    this.#clock = clock;
    const tick = (now) => {
      this.#show(now);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  /// Shows a motion from its start, or goes on with one that has changed.
  set(scene, rows, rods) {
    const isFirst = !this.#rows;
    this.#rows = rows;
    this.#draw = rows.count > 1 ? drawing(scene, rows, rods) : undefined;
    if (isFirst) this.#began = performance.now();
  }

  restart() {
    this.#began = performance.now();
  }

  toggle() {
    this.#isPlaying = !this.#isPlaying;
    return this.#isPlaying;
  }

  #show(now) {
    const canvas = this.#canvas;
    if (!this.#draw || !this.#isPlaying || !canvas.clientWidth) return;
    const density = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * density)) [canvas.width, canvas.height] = [Math.round(width * density), Math.round(height * density)];
    const pen = canvas.getContext("2d");
    pen.setTransform(density, 0, 0, density, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.strokeStyle = pen.fillStyle = getComputedStyle(canvas).color;
    pen.lineJoin = pen.lineCap = "round";
    const t = this.#rows.column("t");
    const last = this.#rows.count - 1;
    const span = t(last) - t(0);
    const speed = Math.max(1, Math.abs(span) / LONGEST);
    const seconds = ((now - this.#began) / 1000) % (Math.abs(span) / speed + 1);
    const time = t(0) + Math.sign(span) * Math.min(seconds * speed, Math.abs(span));
    let [low, high] = [0, last];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if ((t(middle) - time) * span <= 0) low = middle;
      else high = middle;
    }
    this.#draw(pen, { width, height }, low);
    const times = speed > 1 ? `, ${speed.toPrecision(2)} times faster` : "";
    this.#clock.textContent = `t = ${t(low).toFixed(2)}${times}`;
  }
}
