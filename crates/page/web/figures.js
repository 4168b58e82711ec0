// The figures of a motion.
import * as Plot from "@observablehq/plot";

/// The points of a curve that are drawn: more are not visible.
const MOST_POINTS = 1500;
/// The coordinates of a figure with one curve for each.
const MOST_CURVES = 6;
const MOST_MARKS = 3000;

const size = { width: 460, height: 250, marginLeft: 52, marginRight: 14, style: { overflow: "visible" } };
const DASHED = "5,4";
/// Of a path in space: equal scales.
const SPACE = { aspectRatio: 1, height: undefined, width: 320 };

/// The rows of an answer: its columns by name, each a function of the row.
export class Rows {
  constructor(numbers, columns) {
    this.columns = columns;
    this.width = columns.length;
    this.numbers = numbers;
    this.count = Math.floor(numbers.length / this.width);
  }

  has(name) {
    return this.columns.includes(name);
  }

  column(name) {
    const at = this.columns.indexOf(name);
    return (row) => this.numbers[row * this.width + at];
  }

  /// The numbers of the rows that are drawn.
  drawn() {
    const stride = Math.max(1, Math.ceil(this.count / MOST_POINTS));
    const rows = [];
    for (let row = 0; row < this.count; row += stride) rows.push(row);
    if (this.count && rows.at(-1) !== this.count - 1) rows.push(this.count - 1);
    return rows;
  }

  /// The numbers of a column that are not finite.
  gaps(name) {
    const of = this.column(name);
    let count = 0;
    for (let row = 0; row < this.count; row++) count += Number.isFinite(of(row)) ? 0 : 1;
    return count;
  }
}

/// The colours of curves, by their names: Tableau's ten.
const COLORS = ["#4e79a7", "#f28e2c", "#e15759", "#76b7b2", "#59a14f", "#edc949", "#af7aa1", "#ff9da7", "#9c755f", "#bab0ab"];
/// The width of a letter of a legend, the height of its lines, and its width.
const [LETTER, LINE, WIDTH] = [6, 13, 330];

/// The names of curves in their colours, in lines above the frame: a part of the picture, so that it is saved with it.
const legendOf = (names) => {
  const lines = [[]];
  let width = 0;
  for (const name of names) {
    const own = LETTER * (name.length + 2);
    if (width + own > WIDTH && lines.at(-1).length) {
      lines.push([]);
      width = 0;
    }
    lines.at(-1).push({ name, at: width });
    width += own;
  }
  const mark = ({ name, at }, line) =>
    Plot.text([name], {
      frameAnchor: "top-right",
      textAnchor: "start",
      dx: at - WIDTH,
      dy: -LINE * (lines.length - line) - 4,
      fill: COLORS[names.indexOf(name) % COLORS.length],
      fontWeight: 600,
    });
  return { marks: lines.flatMap((all, line) => all.map((one) => mark(one, line))), height: LINE * lines.length };
};

const frame = (marks, { names = [], ...options }) => {
  const legend = legendOf(names.length > 1 ? names : []);
  return Plot.plot({
    ...size,
    marginTop: 18 + (names.length > 1 ? legend.height : 0),
    grid: true,
    color: { domain: names, range: COLORS },
    ...options,
    x: { ticks: 6, ...options.x },
    y: { ticks: 6, nice: true, ...options.y },
    marks: [...marks, ...legend.marks],
  });
};

const curve = (rows, x, y, options) => Plot.line(rows.drawn(), { x: rows.column(x), y: rows.column(y), ...options });

/// The smallest part of its values over which an axis extends: below it, its labels would differ in the last digits alone.
const SMALLEST_RANGE = 1e-3;

/// The axis of columns of some motions: around values that hardly differ, such as an energy that is kept to round-off, a wider one than theirs.
const axisOf = (motions, names, label) => {
  const of = (rows) => names.flatMap((name) => rows.drawn().map(rows.column(name)));
  const values = motions.flatMap((rows) => (rows ? of(rows) : [])).filter(Number.isFinite);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const half = (SMALLEST_RANGE / 2) * Math.max(Math.abs(low), Math.abs(high));
  const middle = (low + high) / 2;
  return { label, ...(high - low < 2 * half ? { domain: [middle - half, middle + half] } : {}) };
};

/// Columns against time, each with its name.
const againstTime = (rows, names, label, peer) =>
  frame(
    [
      ...names.map((name) => curve(rows, "t", name, { stroke: () => name })),
      ...(peer ? names.map((name) => curve(peer, "t", name, { stroke: () => name, strokeDasharray: "1,3" })) : []),
    ],
    { x: { label: "t" }, y: axisOf([rows, peer], names, label), names },
  );

/// Dissipated quantities, with what the conformal factor predicts from their first values: dashed, and on the curve if the law holds.
/// The factor is that of the rows, or that of a constant rate.
const dissipated = (rows, names, label, { peer, gamma } = {}) => {
  const t = rows.column("t");
  const ofRate = gamma === undefined ? undefined : (row) => gamma * t(row);
  const factor = rows.has("log_factor") ? rows.column("log_factor") : ofRate;
  const predicted = (name) => {
    const of = rows.column(name);
    return (row) => of(0) * Math.exp(factor(row) - factor(0));
  };
  const shown = [...names, ...(factor ? ["exact factor"] : []), ...(peer ? ["Runge-Kutta"] : [])];
  return frame(
    [
      ...names.map((name) => curve(rows, "t", name, { stroke: () => name, strokeWidth: 2 })),
      ...(peer ? names.map((name) => curve(peer, "t", name, { stroke: () => "Runge-Kutta" })) : []),
      ...(factor
        ? names.map((name) =>
            Plot.line(rows.drawn(), {
              x: t,
              y: predicted(name),
              stroke: () => "exact factor",
              strokeDasharray: DASHED,
            }),
          )
        : []),
    ],
    { x: { label: "t" }, y: axisOf([rows, peer], names, label), names: shown },
  );
};

/// The smallest distance from a law that is drawn: below it is round-off.
const ROUND_OFF = 1e-16;

/// How far quantities are from the law of the conformal factor, relative to it, on a logarithmic scale.
const departures = (curves) =>
  frame(
    curves.map(({ name, points, isPeer }) =>
      Plot.line(points, {
        x: ([t]) => t,
        y: ([, ratio]) => Math.max(Math.abs(ratio - 1), ROUND_OFF),
        stroke: () => name,
        strokeWidth: isPeer ? 1 : 2,
      }),
    ),
    { x: { label: "t" }, y: { label: "relative distance", type: "log", ticks: 5, tickFormat: "~e" }, names: curves.map(({ name }) => name) },
  );

/// The departures of dissipated quantities of a motion, and of the same by Runge-Kutta. The factor is that of the motion.
const departuresOf = (rows, peer, names) => {
  const [t, log] = [rows.column("t"), rows.column("log_factor")];
  const at = (time) => {
    // The rows of the peer are at other times.
    let [low, high] = [0, rows.count - 1];
    const forward = t(high) >= t(low);
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (t(middle) <= time === forward) low = middle;
      else high = middle;
    }
    const part = t(high) === t(low) ? 0 : (time - t(low)) / (t(high) - t(low));
    return log(low) + part * (log(high) - log(low));
  };
  const points = (from, name, factor) => {
    const [time, of] = [from.column("t"), from.column(name)];
    return from.drawn().map((row) => [time(row), of(row) / (of(0) * Math.exp(factor(row, time(row))))]);
  };
  return departures(
    names.flatMap((name) => [
      { name, points: points(rows, name, (row) => log(row) - log(0)) },
      { name: `${name}, Runge-Kutta`, points: points(peer, name, (_, time) => at(time) - log(0)), isPeer: true },
    ]),
  );
};

/// A path in a plane; equal scales for a path in space.
const inPlane = (rows, x, y, options, peer) =>
  frame(
    [
      ...(peer ? [curve(peer, x, y, { stroke: "var(--peer)", strokeWidth: 1 })] : []),
      curve(rows, x, y, { stroke: "var(--curve)", strokeWidth: 1.2 }),
      Plot.dot([0], { x: rows.column(x), y: rows.column(y), r: 6, fill: "var(--start)", title: () => "start" }),
    ],
    { x: { label: x, ...options.x }, y: { label: y }, ...options.frame },
  );

/// Whether the energy is multiplied by the conformal factor.
const keepsEnergy = (scene) =>
  !scene.is_forced && !scene.has_resets && scene.properties.some(({ name, is_proved }) => name === "autonomous" && is_proved);

/// The figures of a motion of a formula.
const ofFormula = (scene, rows, { coordinate, peer, answer }) => {
  const figures = [];
  const name = scene.coordinates[coordinate] ?? scene.coordinates[0];
  const index = scene.coordinates.indexOf(name);
  const velocity = scene.velocities[index];
  const second = scene.is_hamiltonian ? scene.momenta[index] : velocity;
  const shown = scene.coordinates.slice(0, MOST_CURVES);
  const and = (peer) => (peer ? ", dotted by Runge-Kutta" : "");
  const laws = [...(keepsEnergy(scene) ? ["energy"] : []), ...(scene.is_forced ? [] : scene.symmetries)];
  if (peer && laws.length && rows.has("log_factor")) {
    figures.push({ name: "law", title: "Distance from the law of the conformal factor", svg: departuresOf(rows, peer, laws.slice(0, 3)) });
  }
  figures.push({ name: "coordinates", title: `Coordinates against time${and(peer)}`, svg: againstTime(rows, shown, shown.join(", "), peer) });
  figures.push({
    name: "phase",
    title: "Phase portrait: drag the start",
    svg: inPlane(rows, name, second, { frame: {} }, peer),
    start: { x: name, y: second },
  });
  const plane = planeOf(scene.coordinates);
  if (plane) {
    const path = inPlane(rows, plane[0], plane[1], { frame: SPACE }, peer);
    figures.push({ name: "path", title: "Path in the plane", svg: path });
  }
  figures.push({
    name: "energy",
    title: keepsEnergy(scene) ? "Energy, and what the conformal factor predicts" : "Energy, which forces, resets or the time change",
    svg: keepsEnergy(scene) ? dissipated(rows, ["energy"], "energy", { peer }) : againstTime(rows, ["energy"], "energy", peer),
  });
  if (scene.symmetries.length) {
    const momenta = scene.symmetries.slice(0, MOST_CURVES);
    figures.push({ name: "momenta", title: "Dissipated momenta of the symmetries", svg: dissipated(rows, momenta, "momenta", { peer }) });
  }
  figures.push({ name: "action", title: "Action z", svg: againstTime(rows, [scene.action], scene.action, peer) });
  if (answer.events?.length) {
    const [q, v] = [answer.of_events.indexOf(name) + 1, answer.of_events.indexOf(second) + 1];
    const points = answer.events.slice(0, MOST_MARKS);
    figures.push({
      name: "section",
      title: `Poincaré's section: the events, ${answer.event_count} of them`,
      svg: frame([Plot.dot(points, { x: (row) => row[q], y: (row) => row[v], r: 1.8, fill: "var(--curve)" })], {
        x: { label: name, ...intervalOf(points.map((row) => row[q]), rows, name) },
        y: { label: second, ...intervalOf(points.map((row) => row[v]), rows, second) },
      }),
    });
  }
  return figures;
};

/// The interval of an axis for numbers that differ by round-off alone: that of the motion.
const intervalOf = (numbers, rows, name) => {
  const [of, all] = [rows.column(name), rows.drawn()];
  const [low, high] = [Math.min(...all.map(of)), Math.max(...all.map(of))];
  const isPoint = Math.max(...numbers) - Math.min(...numbers) < 1e-9 * (high - low);
  return isPoint ? { domain: [low, high] } : {};
};

/// Two coordinates in a plane, by their names.
export const planeOf = (names) => {
  const pairs = [["x", "y"], ["x3", "y3"], ["x1", "y1"], ["q[0]", "q[1]"]];
  return pairs.find((pair) => pair.every((name) => names.includes(name)));
};

const ofBody = (rows, answer) => {
  const momenta = ["M3", "Pi3"];
  return [
    { name: "tip", title: "Path of the centre of mass from above", svg: inPlane(rows, "tip_x", "tip_y", { frame: SPACE }) },
    { name: "height", title: "Height of the centre of mass", svg: againstTime(rows, ["tip_z"], "tip_z") },
    { name: "polhode", title: "Momentum in the body", svg: againstTime(rows, ["Pi1", "Pi2", "Pi3"], "Pi") },
    { name: "energy", title: "Energy", svg: dissipated(rows, ["energy"], "energy", { gamma: answer.gamma }) },
    { name: "momenta", title: "Momenta about the vertical and the axis of the body", svg: againstTime(rows, momenta, "M3, Pi3") },
    { name: "action", title: "Action z", svg: againstTime(rows, ["z"], "z") },
  ];
};

const ofLattice = (scene, rows) => {
  const sites = scene.sizes.reduce((product, size) => product * size, 1);
  const first = 1;
  const cells = [];
  for (let row = 0; row < rows.count; row++) {
    for (let site = 0; site < sites; site++) cells.push(rows.numbers[row * rows.width + first + site]);
  }
  const t = rows.column("t");
  const spaceTime = frame(
    [Plot.raster(cells, { width: sites, height: rows.count, x1: 0, x2: sites, y1: t(0), y2: t(rows.count - 1), imageRendering: "pixelated" })],
    { x: { label: "site" }, y: { label: "t" }, color: { scheme: "RdBu", legend: true } },
  );
  const shape = (row) =>
    Plot.line(Array.from({ length: sites }, (_, site) => site), {
      x: (site) => site,
      y: (site) => rows.numbers[row * rows.width + first + site],
      stroke: () => `t = ${t(row)}`,
    });
  const shapes = [0, Math.floor(rows.count / 2), rows.count - 1];
  return [
    { name: "space_time", title: "The sites against time", svg: spaceTime },
    {
      name: "shapes",
      title: "The sites at three times",
      svg: frame(shapes.map(shape), { x: { label: "site" }, y: { label: scene.coordinates[0] }, names: shapes.map((row) => `t = ${t(row)}`) }),
    },
    { name: "energy", title: "Energy", svg: againstTime(rows, ["energy"], "energy") },
    { name: "action", title: "Action z", svg: againstTime(rows, ["z"], "z") },
  ];
};

/// The figures of an answer: a name, a title and a picture of each.
export const figuresOf = (scene, rows, options) => {
  if (!rows.count) return [];
  if (scene.kind === "body") return ofBody(rows, options.answer);
  if (scene.kind === "lattice") return ofLattice(scene, rows);
  return ofFormula(scene, rows, options);
};

/// The part of the Fourier coefficients of a curve that may be of the highest frequencies: beyond it the points do not resolve the curve.
const MOST_UNRESOLVED = 1e-6;

/// The area within a closed curve of points that depend smoothly on an angle, the integral of p dq over all coordinates, up to a factor: by
/// its Fourier coefficients. NaN where the points do not resolve the curve.
const area = (points) => {
  const [count, n] = [points.length, points[0].length / 2];
  const waves = Array.from({ length: count }, (_, j) => [Math.cos((2 * Math.PI * j) / count), Math.sin((2 * Math.PI * j) / count)]);
  let [sum, all, high] = [0, 0, 0];
  for (let k = 1; k < count / 2; k++) {
    for (let i = 0; i < n; i++) {
      let [qc, qs, pc, ps] = [0, 0, 0, 0];
      for (let j = 0; j < count; j++) {
        const [c, s] = waves[(j * k) % count];
        const [q, p] = [points[j][i], points[j][n + i]];
        qc += q * c;
        qs += q * s;
        pc += p * c;
        ps += p * s;
      }
      sum += k * (qc * ps - qs * pc);
      const size = qc * qc + qs * qs + pc * pc + ps * ps;
      all += size;
      if (k > count / 4) high += size;
    }
  }
  return high <= MOST_UNRESOLVED ** 2 * all ? sum : NaN;
};

/// The positions and momenta of the members of a cloud at a time.
const cloudAt = ({ numbers, times, members, dimension }, time) =>
  Array.from({ length: members }, (_, member) => {
    const at = 2 * dimension * (member * times.length + time);
    return numbers.subarray(at, at + 2 * dimension);
  });

/// The figures of a cloud of starts: the cloud at some times, and the area within it against the law of contact flows.
export const figuresOfCloud = (scene, cloud, peer, coordinate) => {
  const [q, p] = [scene.coordinates[coordinate], scene.momenta[coordinate]];
  const times = cloud.times.length;
  const shown = [0, 1, 2, 3, 4].map((k) => Math.round((k * (times - 1)) / 4));
  const closed = (points) => [...points, points[0]];
  const of = (name, from) => {
    const first = area(cloudAt(from, 0));
    return from.times.map((t, k) => ({ name, t, area: area(cloudAt(from, k)) / first }));
  };
  const ratios = (from) => of("", from).map(({ t, area }, k) => [t, area / Math.exp(cloud.log_factor[k])]);
  const law = cloud.times.map((t, k) => ({ name: "exact factor", t, area: Math.exp(cloud.log_factor[k]) }));
  const names = ["this method", ...(peer ? ["Runge-Kutta"] : []), ...(cloud.is_constant ? ["exact factor"] : [])];
  return [
    {
      name: "cloud",
      title: `${cloud.members} starts on a circle, at five times`,
      svg: frame(
        shown.map((k) =>
          Plot.line(closed(cloudAt(cloud, k)), { x: (point) => point[coordinate], y: (point) => point[cloud.dimension + coordinate], stroke: () => `t = ${+cloud.times[k].toPrecision(3)}` }),
        ),
        { x: { label: q }, y: { label: p }, names: shown.map((k) => `t = ${+cloud.times[k].toPrecision(3)}`) },
      ),
    },
    {
      name: "area",
      title: cloud.is_constant ? "Area within the circle, relative to the first, while 200 points resolve it" : "Area within the circle; the rate is not constant: there is no law",
      svg: frame(
        [
          Plot.line(of("this method", cloud), { x: "t", y: "area", stroke: "name", strokeWidth: 2 }),
          ...(peer ? [Plot.line(of("Runge-Kutta", peer), { x: "t", y: "area", stroke: "name" })] : []),
          ...(cloud.is_constant ? [Plot.line(law, { x: "t", y: "area", stroke: "name", strokeDasharray: DASHED })] : []),
        ],
        { x: { label: "t" }, y: { label: "area" }, names },
      ),
    },
    ...(cloud.is_constant
      ? [
          {
            name: "area_law",
            title: "Distance of the area from the law",
            svg: departures([
              { name: "this method", points: ratios(cloud) },
              ...(peer ? [{ name: "Runge-Kutta", points: ratios(peer), isPeer: true }] : []),
            ]),
          },
        ]
      : []),
  ];
};
