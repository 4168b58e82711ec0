//! The scene file as it is written. The documentation of these types is that of the schema, which editors show.

use super::location::{Location, Named, Numbers, Span};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Formatter;

/// The version of scene files that this program reads.
pub(crate) const VERSION: i64 = 1;

/// Where a text has a table of this name, which tells the kind of a scene; what is wrong with the scene is said by its reader.
pub(crate) fn place_of_table(text: &str, name: &str) -> Option<Span> {
    toml::from_str::<BTreeMap<String, Location<IgnoredAny>>>(text).ok()?.get(name).map(Location::span)
}

/// A motion of a Lagrangian, and what is to be recorded of it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a scene")]
#[schemars(title = "Scene")]
pub(crate) struct File {
    /// The version of the format: 1.
    #[expect(dead_code, reason = "it is looked at before all else is read")]
    pub version: Option<Location<i64>>,
    /// The Lagrangian: a formula, or one of the catalogue.
    pub system: Location<SystemTable>,
    /// Where the motion starts: a number for each coordinate `x`, and for its velocity `x'` or its momentum `p_x`; of the action `z` and
    /// the time `t`, which are 0 otherwise. An array of coordinates has a list, or one number for all its
    /// entries. A system of the catalogue has a start of its own.
    #[serde(default)]
    pub start: Option<Location<Named<Numbers>>>,
    /// How long, and how.
    pub run: Location<RunTable>,
    /// What is recorded.
    #[serde(default)]
    pub want: WantTable,
    /// Parameters, or values of the start such as `start.theta`, that `herglotz sweep` takes through their values. Of several, all pairs
    /// are taken, the last one fastest.
    #[serde(default)]
    pub sweep: Swept,
}

/// The Lagrangian.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `coordinates` and `lagrangian`, or with `catalogue`")]
pub(crate) struct SystemTable {
    /// The name of a system of the catalogue; see `herglotz list systems`.
    pub catalogue: Option<Location<String>>,
    /// The names of the coordinates; `"q[3]"` is an array of three.
    pub coordinates: Option<Location<Vec<Location<String>>>>,
    /// L over the coordinates `x`, the velocities `x'`, `z`, `t` and the parameters.
    pub lagrangian: Option<Location<String>>,
    /// The parameters with their values.
    #[serde(default)]
    pub parameters: Named<f64>,
}

/// How long, and how.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `time` and `accuracy`, or `time`, `integrator` and `step`")]
pub(crate) struct RunTable {
    /// The time at which the motion ends; before that of the start it goes back.
    pub time: Location<f64>,
    /// The relative error of (q, p) and v; the step is chosen for it, and the integrator unless one is named.
    pub accuracy: Option<Location<f64>>,
    /// The integrator; see `herglotz list integrators`.
    pub integrator: Option<Location<String>>,
    /// The length of a step.
    pub step: Option<Location<f64>>,
    /// The number of steps, instead of their length.
    pub steps: Option<Location<usize>>,
    /// The size of each coordinate, in the order of the coordinates, where they differ much: errors are those of each coordinate and velocity in
    /// units of its own.
    pub scales: Option<Location<Vec<f64>>>,
}

/// What is recorded.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `rows` and `events`")]
pub(crate) struct WantTable {
    /// The rows of rows.csv; without it, 1000 of the whole state.
    pub rows: Option<Location<RowsTable>>,
    /// Functions of the state whose changes of sign are written to events.csv.
    #[serde(default)]
    pub events: Vec<EventTable>,
    /// Columns that are angles, of rows or of events, by name: pictures show them from -pi to pi, tables as they are.
    #[serde(default)]
    pub wrap: Vec<Location<String>>,
    /// Whether the conformal factor of the whole motion is in the summary.
    #[serde(default)]
    pub conformal_factor: bool,
    /// Whether the error of given steps is estimated, by a second run with steps of half their length.
    #[serde(default)]
    pub estimate: bool,
}

/// When there is a row, by one of `every`, `at` and `every_step`, and what is in it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `every`, `at` or `every_step`, and `columns`")]
pub(crate) struct RowsTable {
    /// The time between two rows.
    pub every: Option<Location<f64>>,
    /// The times of the rows, in the order of the motion.
    pub at: Option<Location<Vec<Location<f64>>>>,
    /// The number of steps between two rows.
    pub every_step: Option<Location<usize>>,
    /// `t`, coordinates, velocities, `z`, momenta `p_x`, `energy`, `sigma`, `log_factor`, and any expressions of these, with a name
    /// (`E = ...`) or without; without it, the whole state. `energy` is `v L_v - L`, which holds all of L, its terms in z too (`-gamma*z` for
    /// a drag `gamma*z`); `log_factor` is the integral of `L_z`, `sigma` its exponential: the conformal factor.
    pub columns: Option<Location<Vec<Location<String>>>>,
}

/// A function of the state whose changes of sign are found.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `when`")]
pub(crate) struct EventTable {
    /// The function, an expression as those of columns: with `energy` and `p_x`, and with `sigma` and `log_factor` where `L_z` is constant.
    pub when: Location<String>,
    /// Which changes count.
    #[serde(default)]
    pub direction: DirectionName,
    /// Whether the first one ends the motion.
    #[serde(default)]
    pub terminal: bool,
    /// The time from which they count, in the sense of the motion, so that transients are left out; from the start without it.
    pub from: Option<Location<f64>>,
    /// What events.csv has beside the state there: expressions as those of the columns of rows, with a name (`E = ...`) or without. They are
    /// empty for other events.
    #[serde(default)]
    pub columns: Vec<Location<String>>,
}

/// Which changes of sign count, in the sense of the motion.
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
    /// These.
    List(Vec<Location<f64>>),
    /// Between two.
    Range(RangeTable),
}

/// So many values from one to another.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `from`, `to` and `count`")]
pub(crate) struct RangeTable {
    /// The first.
    pub from: Location<f64>,
    /// The last.
    pub to: Location<f64>,
    /// How many.
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
    /// Equal quotients.
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

/// Parameters and values of the start, with the values that they take.
#[derive(Clone, Debug, Default)]
pub(crate) struct Swept(pub Vec<(Location<String>, Location<Values>)>);

/// The key of a table in it of values of the start.
const START: &str = "start";

impl<'de> Deserialize<'de> for Swept {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;
        impl<'de> Visitor<'de> for Table {
            type Value = Swept;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Swept, A::Error> {
                let mut all = Vec::new();
                while let Some(key) = map.next_key::<Location<String>>()? {
                    if *key == START {
                        let of_start: Named<Values> = map.next_value()?;
                        let named = |(key, values): (Location<String>, _)| {
                            (Location::new(format!("{START}.{}", *key), key.span()), values)
                        };
                        all.extend(of_start.0.into_iter().map(named));
                    } else {
                        all.push((key, map.next_value()?));
                    }
                }
                // The reader of the file sorts tables by name.
                all.sort_by_key(|(key, _)| key.span());
                Ok(Swept(all))
            }
        }
        deserializer.deserialize_map(Table)
    }
}

impl JsonSchema for Swept {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Swept".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let values = Values::json_schema(generator);
        json_schema!({
            "type": "object",
            "properties": { START: { "type": "object", "additionalProperties": values.clone() } },
            "additionalProperties": values,
        })
    }
}
