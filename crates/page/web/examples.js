// The examples: scenes of the folder `scenes`, with the values that are changed for a short look, and how their motion is drawn where the
// names of the coordinates do not say it.
import bouncing from "../../../scenes/bouncing.toml";
import doublePendulum from "../../../scenes/double_pendulum.toml";
import duffing from "../../../scenes/duffing.toml";
import heavyTop from "../../../scenes/heavy_top.toml";
import kepler from "../../../scenes/kepler.toml";
import kinks from "../../../scenes/kinks.toml";
import laneEmden from "../../../scenes/lane_emden.toml";
import linkage from "../../../scenes/linkage.toml";
import pendulum from "../../../scenes/pendulum.toml";
import stickSlip from "../../../scenes/stick_slip.toml";
import thermostat from "../../../scenes/thermostat.toml";
import vanDerPol from "../../../scenes/van_der_pol.toml";

export const examples = [
  { name: "pendulum", title: "Pendulum with drag", scene: pendulum, changes: ["run.time=40"] },
  { name: "kepler", title: "Kepler's problem with drag", scene: kepler },
  {
    name: "double_pendulum",
    title: "Double pendulum, chaotic",
    scene: doublePendulum,
    changes: ["run.time=400"],
  },
  { name: "bouncing", title: "Bouncing ball on a plate", scene: bouncing, changes: ["run.time=100"] },
  { name: "stick_slip", title: "Stick-slip on a belt", scene: stickSlip },
  { name: "duffing", title: "Duffing's oscillator, Poincaré's section", scene: duffing },
  { name: "heavy_top", title: "Heavy top", scene: heavyTop },
  {
    name: "linkage",
    title: "Four-bar linkage with constraints",
    scene: linkage,
    changes: ["run.time=2", "run.accuracy=1e-6"],
    rods: [
      [[0, 0], ["x1", "y1"]],
      [["x1", "y1"], ["x2", "y2"]],
      [["x2", "y2"], [3, 0]],
      [["x1", "y1"], ["x3", "y3"]],
      [["x2", "y2"], ["x3", "y3"]],
    ],
  },
  { name: "van_der_pol", title: "Van der Pol's oscillator with costates", scene: vanDerPol },
  { name: "thermostat", title: "Thermostat: contact density dynamics", scene: thermostat, changes: ["run.time=8"] },
  {
    name: "lane_emden",
    title: "Lane-Emden: a star of index 1.5",
    scene: laneEmden,
    // Ten times as far from the singular centre, by the series up to t^16: a tenth of the steps.
    changes: ["run.accuracy=1e-9", "start.t=0.1", "start.theta=0.9983345826392103", "start.p_theta=-0.03328337497429316"],
  },
  { name: "kinks", title: "Two kinks in 400 pendulums", scene: kinks, changes: ["run.time=70"] },
];

/// The rods of an example with this text.
export const rodsOf = (scene) => examples.find((example) => example.scene === scene)?.rods;

/// A scene with a Lagrangian that was typed: its coordinates are the names with a prime, and the parameters are those that are given.
export const sceneOf = (lagrangian, parameters) => {
  const coordinates = [...new Set([...lagrangian.matchAll(/([A-Za-z_]\w*)'/g)].map((found) => found[1]))];
  const list = coordinates.map((name) => `"${name}"`).join(", ");
  const given = Object.entries(parameters).map(([name, value]) => `${name} = ${value}`);
  const start = coordinates.flatMap((name) => [`${name} = 1.0`, `"${name}'" = 0.0`]);
  return `version = 2

[system]
coordinates = [${list}]
lagrangian = '''${lagrangian}'''
${given.length ? `parameters = { ${given.join(", ")} }\n` : ""}
[start]
${start.join("\n")}

[run]
time = 20.0
accuracy = 1e-9
`;
};
