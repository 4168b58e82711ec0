//! The scene file format. The documentation of these types is that of the JSON schema, which editors show.

use super::body_table::BodyTable;
use super::checked::{check_version, finite};
use super::fit_table::FitTable;
use super::location::{Location, Named, Numbers, Span};
use super::quantities::Quantities;
use super::sum_of_terms::{BodiesTerms, LatticeTerms};
use super::system::entry;
use super::{SceneError, body_overrides, overrides};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt::Formatter;

/// The version of scene files that this program writes. It also reads those of version 1 that have neither `[lattice]` nor
/// `[body]`.
pub const VERSION: i64 = 2;

/// Reads a scene file, of whatever kind, and overrides some of its values.
///
/// # Errors
/// [`SceneError`] with the position in the text, or in the override.
pub(crate) fn read(text: &str, changes: &[String]) -> Result<File, SceneError> {
    check_version(text)?;
    let mut file: File = toml::from_str(text).map_err(|error| SceneError::of_format(text, &error))?;
    if file.system.body.is_some() {
        changes.iter().try_for_each(|change| body_overrides::apply(&mut file, change))?;
    } else {
        let entry = entry(text, &file.system)?;
        changes.iter().try_for_each(|change| overrides::apply(&mut file, entry, change))?;
    }
    Ok(file)
}

/// The position of a table of this name. Errors of the scene itself are left to its reader.
pub(crate) fn span_of_table(text: &str, name: &str) -> Option<Span> {
    toml::from_str::<BTreeMap<String, Location<IgnoredAny>>>(text).ok()?.get(name).map(Location::span)
}

/// A motion from a start, or a path between two ends, and the requested output.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a scene")]
#[schemars(title = "Scene")]
pub(crate) struct File {
    /// The version of the format: 2. A scene of version 1 with `[lattice]` or `[body]` is translated by `herglotz migrate`.
    #[expect(dead_code, reason = "it is looked at before all else is read")]
    pub version: Option<Location<i64>>,
    /// The Lagrangian or the Hamiltonian: a formula, a system of the catalogue, a lattice, bodies, or a rigid body.
    pub system: Location<SystemTable>,
    /// The initial state: a number for each coordinate `x`, and for its velocity `x'` or its momentum `p_x`; the action
    /// `z` and the time `t` default to 0. An array of coordinates has a list, one number for all its entries, or a formula in
    /// the index `i` of an entry, counted from 0, and the number `n` of entries; so has a component of all sites of a lattice,
    /// in several directions with the indices `i`, `j` and `k`. Velocities of a lattice default to 0. A system of the catalogue
    /// has a default initial state. A rigid body has an `attitude`, which takes the body to space, a unit quaternion with the
    /// real part first, by default `[1, 0, 0, 0]`, and the angular velocity `omega` in the body. A path starts from coordinates
    /// alone.
    #[serde(default)]
    pub start: Option<Location<Named<Numbers>>>,
    /// The end of a path: a number for each coordinate `x`, and the time `t`. With it the scene is a path between two positions
    /// that is critical for the discrete action of Herglotz' principle, or satisfies its equations with forces. Its run has
    /// the number of `steps` and an `integrator` that is a Gauss method, by default `gauss_4`, or a quadrature rule such as
    /// `midpoint`.
    #[serde(default)]
    pub ends: Option<Location<Named<Numbers>>>,
    /// Forces beside those of the Lagrangian: for a coordinate `x` the force f in `d/dt L_v - L_q - L_z L_v = f(t, q,
    /// v, z)` as a formula, as in `x = "-c*x'*abs(x')"`; `"u[2]"` is an entry of an array, and `"u[i]"` are all of its
    /// entries. `rayleigh` is Rayleigh's dissipation function R, whose force is `-dR/dv`. With a force the motion is
    /// not contact: the defect is the virtual work of the force.
    #[serde(default)]
    pub force: Option<Location<Named<String>>>,
    /// Dry friction on coordinates, which sticks and slips by itself: `[friction.x]` is that on the coordinate `x`. The motion
    /// has one coordinate more for each, `slip_x`: 0 while x sticks, 1 and -1 while it slips, the direction of the force.
    #[serde(default)]
    pub friction: Named<FrictionTable>,
    /// Functions of time by samples, with their names: the table `drive` is `drive(t)` in all formulas of the scene.
    #[serde(default)]
    pub tables: Named<SamplesTable>,
    /// The final time, and the accuracy or the steps.
    pub run: Location<RunTable>,
    /// The output.
    #[serde(default)]
    pub want: WantTable,
    /// Parameters, or values of the initial state such as `start.theta`, over whose values `herglotz sweep` runs. With
    /// several of them all combinations are run; the last one varies fastest. Those of a rigid body are `inertia1`, `inertia2`,
    /// `inertia3`, `mass`, `centre1`, ..., `gravity1`, ..., `gamma`, `start.omega1`, ..., `start.z`.
    #[serde(default)]
    pub sweep: Quantities<Values>,
    /// Data to which `herglotz fit` fits parameters and the initial state.
    #[serde(default)]
    pub fit: Option<Box<Location<FitTable>>>,
}

/// Dry friction on a coordinate.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `sliding`, the size of the force while the coordinate slides")]
pub(crate) struct FrictionTable {
    /// The size of the force while the coordinate slides, as in `"mu*m*g"`.
    pub sliding: Location<String>,
    /// The largest force that holds it while it sticks; that of sliding by default.
    pub sticking: Option<Location<String>>,
    /// The velocity of the surface, a function of time; 0 by default.
    pub surface: Option<Location<String>>,
}

impl FrictionTable {
    /// Its formulas.
    pub fn formulas(&self) -> impl Iterator<Item = &Location<String>> {
        [&self.sliding].into_iter().chain(&self.sticking).chain(&self.surface)
    }
}

/// The Lagrangian.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "a table with `coordinates` and `lagrangian` or `hamiltonian`, or with `catalogue`, `lattice`, `bodies` or `body`"
)]
pub(crate) struct SystemTable {
    /// The name of a system of the catalogue; see `herglotz list systems`.
    pub catalogue: Option<Location<String>>,
    /// The names of the coordinates; `"q[3]"` is an array of three.
    pub coordinates: Option<Location<Vec<Location<String>>>>,
    /// L as a formula in the coordinates `x`, the velocities `x'`, `z`, `t` and the parameters.
    pub lagrangian: Option<Location<String>>,
    /// In place of L, a contact Hamiltonian H as a formula in the coordinates `x`, their momenta `p_x`, `z`, `t` and the
    /// parameters: `q' = H_p`, `p' = -H_q - p H_z`, `z' = p . H_p - H`. It has up to 4 coordinates, and runs by a Gauss
    /// method such as `gauss_8`, whatever the rank of `H_pp`.
    pub hamiltonian: Option<Location<String>>,
    /// The names of the momenta of `hamiltonian`, in the order of the coordinates; by default `p_x` for `x`.
    pub momenta: Option<Location<Vec<Location<String>>>>,
    /// The name of the action, by default `z`; with another one `z` may be a coordinate.
    pub action: Option<Location<String>>,
    /// Holonomic constraints: equations over the coordinates and the parameters, as in `["x^2 + y^2 = l^2"]`, or
    /// expressions that vanish. The motion is then that on the surface where they hold. `gauss_4` means a contact Lobatto
    /// method of the same order, and a splitting means RATTLE that is composed by its scheme.
    pub constraints: Option<Location<Vec<Location<String>>>>,
    /// In place of L, a lattice. `coordinates` are then the components at a site, by default `x`; in all other formulas they are
    /// `x[0]`, `x[1]` and so on, or with several components `x_0`, `y_0`, `x_1` and so on. With more than 256 coordinates a
    /// lattice runs with given steps of a splitting, of `midpoint`, `gauss_1` or `gauss_2`, and its columns are names of the state,
    /// without formulas.
    pub lattice: Option<Location<LatticeTerms>>,
    /// In place of L, bodies with Newtonian gravitation.
    pub bodies: Option<Location<BodiesTerms>>,
    /// In place of L, a rigid body about a fixed point.
    pub body: Option<Location<BodyTable>>,
    /// The parameters with their values.
    #[serde(default)]
    pub parameters: Named<f64>,
}

/// The final time, and the accuracy or the steps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `time` and `accuracy`, or `time`, `integrator` and `step`")]
pub(crate) struct RunTable {
    /// The final time; the motion runs backward where it is before the initial time. A path has that of its end.
    pub time: Option<Location<f64>>,
    /// The relative error of (q, p) and of v. The step is chosen for it, and also the integrator unless one is named.
    pub accuracy: Option<Location<f64>>,
    /// The integrator; see `herglotz list integrators`.
    pub integrator: Option<Location<String>>,
    /// The length of a step.
    pub step: Option<Location<f64>>,
    /// The number of steps, instead of their length.
    pub steps: Option<Location<usize>>,
    /// Whether a start that violates the constraints is moved to them; otherwise it is refused, with its distance.
    pub project: Option<Location<bool>>,
    /// Whether rows and events within steps are computed by steps of the integrator that end there, so that the map to each of
    /// them is contact. Otherwise they are on polynomials, which are as accurate and take less time.
    pub exact: Option<Location<bool>>,
    /// The size of each coordinate, in the order of the coordinates, where they differ much: the errors of each
    /// coordinate and its velocity are measured in units of its size.
    pub scales: Option<Location<Vec<f64>>>,
    /// The times of jumps that the formulas do not show, in the order of the motion. Steps end there.
    pub breaks: Option<Location<Vec<Location<f64>>>>,
}

/// The samples of a function of time: in a file with `csv`, or as lists `times` and `values`. Before the first and
/// after the last sample the function is constant.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `csv`, or with `times` and `values`")]
pub(crate) struct SamplesTable {
    /// A file of comma-separated values whose first line has the names of the columns; its path is relative to the
    /// folder of the scene.
    pub csv: Option<Location<String>>,
    /// The column of the times; `t` by default.
    pub time: Option<Location<String>>,
    /// The column of the values; by default the one with the name of the table.
    pub value: Option<Location<String>>,
    /// The times, which increase.
    pub times: Option<Location<Vec<f64>>>,
    /// The values, as many as there are times.
    pub values: Option<Location<Vec<f64>>>,
    /// How the function continues between its samples.
    #[serde(default)]
    pub pieces: PiecesName,
}

/// How a function continues between its samples.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PiecesName {
    /// Each value holds until the time of the next one.
    Held,
    /// Straight lines.
    #[default]
    Linear,
    /// A cubic spline.
    Cubic,
}

impl RunTable {
    /// The final time of a motion.
    ///
    /// # Errors
    /// [`SceneError`] where it is missing or not finite.
    pub fn end(&self, text: &str, at: Span) -> Result<f64, SceneError> {
        match &self.time {
            Some(time) => finite(text, time, "time"),
            None => Err(SceneError::at(text, at, "the run has no `time`; add it, as in time = 10.0")),
        }
    }

    /// The position of a key, or that of the table.
    pub fn span_of<T>(key: &Option<Location<T>>, at: Span) -> Span {
        key.as_ref().map_or(at, Location::span)
    }
}

/// The output.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `rows` and `events`")]
pub(crate) struct WantTable {
    /// The rows of rows.csv; by default, the whole state at the ends of 1000 equal intervals.
    pub rows: Option<Location<RowsTable>>,
    /// Functions of time and state whose sign changes are written to events.csv.
    #[serde(default)]
    pub events: Vec<EventTable>,
    /// The names of columns of rows or events that are angles: figures show them from -pi to pi, tables are unchanged.
    #[serde(default)]
    pub wrap: Vec<Location<String>>,
    /// Whether the summary has the conformal factor of the whole motion.
    pub conformal_factor: Option<Location<bool>>,
    /// Whether the error of given steps is estimated, by a second run with steps of half the length.
    pub estimate: Option<Location<bool>>,
}

/// The times of the rows, by one of `every`, `at` and `every_step`, and their columns.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `every`, `at` or `every_step`, and `columns`")]
pub(crate) struct RowsTable {
    /// The time between two rows.
    pub every: Option<Location<f64>>,
    /// The times of the rows, in the order of the motion.
    pub at: Option<Location<Vec<Location<f64>>>>,
    /// The number of steps between two rows.
    pub every_step: Option<Location<usize>>,
    /// `t`, coordinates, velocities, `z`, momenta `p_x`, `energy`, `sigma`, `log_factor`, and any expressions in these,
    /// with a name (`E = ...`) or without; by default, the whole state. `energy` is `v L_v - L`, including the terms of
    /// L in z (`-gamma*z` for a drag `gamma*z`); `log_factor` is the integral of `L_z`, and `sigma`, its exponential,
    /// is the conformal factor. The columns of a rigid body are `t`, the attitude `q_w`, `q_x`, `q_y`, `q_z`, the momentum in the
    /// body `Pi1`, `Pi2`, `Pi3`, the angular velocity in the body `omega1`, `omega2`, `omega3`, the momentum in space `M1`,
    /// `M2`, `M3`, the centre of mass in space `tip_x`, `tip_y`, `tip_z` (the end of the third axis where the centre is fixed),
    /// `energy` and `z`.
    pub columns: Option<Location<Vec<Location<String>>>>,
}

/// A function of time and state whose sign changes are located.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `when`")]
pub(crate) struct EventTable {
    /// The function, an expression as in columns: also with `energy` and `p_x`, and with `sigma` and `log_factor` where
    /// `L_z` is constant.
    pub when: Location<String>,
    /// Which sign changes count.
    #[serde(default)]
    pub direction: DirectionName,
    /// Whether the first sign change ends the motion.
    #[serde(default)]
    pub terminal: bool,
    /// The time from which sign changes count, in the direction of the motion, so that transients are left out; by
    /// default, from the start.
    pub from: Option<Location<f64>>,
    /// The columns of events.csv in addition to the state: expressions as in the columns of rows, with a name (`E =
    /// ...`) or without. They are empty for other events.
    #[serde(default)]
    pub columns: Vec<Location<String>>,
    /// A reset: the variables that get new values where the function changes its sign, as expressions of the state
    /// before it, as in `{ "x'" = "-0.8*x'" }`. The motion goes on from the new state. events.csv has the state before
    /// the reset, and the state after it in columns such as `x' after`.
    pub then: Option<Location<Named<String>>>,
    /// An impact in place of `then`, where the function falls. It depends on `t` and the coordinates alone and is
    /// positive where motions are admitted: `"elastic"` conserves the energy, `{ restitution = 0.8 }` multiplies the
    /// normal velocity by -0.8, and `{ conformal = 0.64 }` multiplies the contact form by 0.64.
    pub impact: Option<Location<ImpactLaw>>,
    /// With `then` or `impact`: where resets accumulate, the variables that get new values, from which the motion
    /// continues, as in `{ "x'" = "0" }`. By default the run ends there. With the velocity of the surface of one coordinate x the
    /// motion stays on it until the force pulls it off, and has one coordinate more: `contact_x`, 0 in flight, 1 in contact.
    pub rest: Option<Location<Named<String>>>,
}

/// The law of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ImpactLaw {
    /// The energy is conserved.
    Elastic,
    /// The normal velocity relative to the surface is multiplied by minus this number, from 0 to 1.
    Restitution(f64),
    /// The contact form is multiplied by this number, above 0 and at most 1.
    Conformal(f64),
}

/// Which sign changes count, in the direction of the motion.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum DirectionName {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both.
    #[default]
    Both,
}

/// The values of a sweep: a list, or a range.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(untagged, inline)]
pub(crate) enum Values {
    /// The values.
    List(Vec<Location<f64>>),
    /// Values between two numbers.
    Range(RangeTable),
}

/// A number of values from one number to another.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `from`, `to` and `count`")]
pub(crate) struct RangeTable {
    /// The first value.
    pub from: Location<f64>,
    /// The last value.
    pub to: Location<f64>,
    /// The number of values.
    pub count: Location<usize>,
    /// How they are spaced.
    #[serde(default)]
    pub spacing: Spacing,
}

/// How the values of a range are spaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Spacing {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Log,
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ListOrRange;
        impl<'de> Visitor<'de> for ListOrRange {
            type Value = Values;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("a list of numbers, or { from, to, count }")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Values, A::Error> {
                let mut all = Vec::new();
                while let Some(x) = list.next_element()? {
                    all.push(x);
                }
                Ok(Values::List(all))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Values, A::Error> {
                RangeTable::deserialize(MapAccessDeserializer::new(map)).map(Values::Range)
            }
        }
        deserializer.deserialize_any(ListOrRange)
    }
}
