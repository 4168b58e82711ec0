//! The format of the data of a fit. The documentation of these types is that of the JSON schema, which editors show.

use super::location::{Location, Named};
use super::quantities::Quantities;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::fmt::Formatter;

/// Data to which parameters and the initial state are fitted; the fit starts from the values of the scene.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `csv` and `unknowns`")]
pub(crate) struct FitTable {
    /// A file of comma-separated values whose first line has the names of the columns; its path is relative to the
    /// folder of the scene. An empty entry was not measured.
    pub csv: Location<String>,
    /// The column of the times; `t` by default.
    pub time: Option<Location<String>>,
    /// The columns that are fitted: coordinates `x`, velocities `x'`, momenta `p_x`, `z`, and expressions with the name
    /// of the column, as in `height = -l*cos(theta)`; or a table of quantities by the names of columns, which may be any
    /// texts, as in `{ "Angle (rad)" = "theta" }`. By default they are all columns of the file but that of the times and
    /// those of standard deviations.
    pub observe: Option<Location<Observed>>,
    /// The standard deviation of a column: a number, or the name of a column of the file. Without any, all values have
    /// the same weight.
    #[serde(default)]
    pub sigma: Named<Deviation>,
    /// What is fitted: parameters, and values of the initial state such as `start.x`.
    pub unknowns: Location<Vec<Location<String>>>,
    /// The lower and the upper bound of an unknown, as in `k = [0.0, 10.0]`; `inf` or `-inf` where there is none.
    #[serde(default)]
    pub bounds: Quantities<Vec<f64>>,
    /// Whether the standard deviations of all columns are known in size: standard errors are those of these deviations, and
    /// are not scaled by the size of the residuals, as they are by default.
    #[serde(default)]
    pub absolute_sigma: bool,
    /// What a residual contributes to the cost: least squares by default; `{ huber = 2.0 }`, `{ soft_l1 = 2.0 }` or
    /// `{ cauchy = 2.0 }` for data with outliers, with the residual at which these begin, in standard deviations where
    /// they are given.
    pub loss: Option<Location<LossName>>,
    /// Multiple shooting, for long or chaotic motions: the times at which the motion is cut into pieces.
    pub nodes: Option<Location<Vec<Location<f64>>>>,
    /// Multiple shooting with this number of pieces of equal length, instead of `nodes`.
    pub pieces: Option<Location<usize>>,
    /// Several starts of the fit: values of unknowns, which are those of the scene by default. The best fit is taken.
    #[serde(default)]
    pub starts: Vec<Location<Quantities<f64>>>,
    /// The largest number of evaluations from each start; by default 100 for each unknown and one more.
    pub evaluations: Option<Location<usize>>,
}

impl FitTable {
    /// The formulas of the quantities.
    pub fn formulas(&self) -> Vec<&str> {
        match self.observe.as_deref() {
            None => Vec::new(),
            Some(Observed::Columns(list)) => list.iter().map(|of| of.as_str()).collect(),
            Some(Observed::Quantities(table)) => table.0.iter().map(|(_, of)| of.as_str()).collect(),
        }
    }
}

/// The columns that are fitted.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(untagged, inline)]
pub(crate) enum Observed {
    /// The columns, or expressions with the names of the columns.
    Columns(Vec<Location<String>>),
    /// The quantities of columns.
    Quantities(Named<String>),
}

impl<'de> Deserialize<'de> for Observed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ListOrTable;
        impl<'de> Visitor<'de> for ListOrTable {
            type Value = Observed;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str(
                    "a list of columns, as in [\"x\"], or a table of quantities, as in { \"Angle (rad)\" = \"theta\" }",
                )
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(Observed::Columns)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Named::deserialize(MapAccessDeserializer::new(map)).map(Observed::Quantities)
            }
        }
        deserializer.deserialize_any(ListOrTable)
    }
}

/// A standard deviation: a number, or the name of a column.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(untagged, inline)]
pub(crate) enum Deviation {
    /// The standard deviation of all values.
    Number(f64),
    /// The column of the standard deviations.
    Column(String),
}

impl<'de> Deserialize<'de> for Deviation {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrColumn;
        impl Visitor<'_> for NumberOrColumn {
            type Value = Deviation;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, or the name of a column in quotes")
            }

            fn visit_f64<E>(self, x: f64) -> Result<Deviation, E> {
                Ok(Deviation::Number(x))
            }

            fn visit_i64<E>(self, x: i64) -> Result<Deviation, E> {
                Ok(Deviation::Number(x as f64))
            }

            fn visit_str<E>(self, name: &str) -> Result<Deviation, E> {
                Ok(Deviation::Column(name.to_owned()))
            }
        }
        deserializer.deserialize_any(NumberOrColumn)
    }
}

/// What a residual contributes to the cost.
#[derive(Clone, Copy, Debug, PartialEq, JsonSchema)]
#[schemars(rename_all = "snake_case")]
pub(crate) enum LossName {
    /// Quadratic to this residual, then linear.
    Huber(f64),
    /// Quadratic for small residuals, linear for large ones, smooth between them.
    SoftL1(f64),
    /// Logarithmic for large residuals.
    Cauchy(f64),
}

impl<'de> Deserialize<'de> for LossName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// The accepted form.
        const FORM: &str = "a loss with its scale, as in { huber = 2.0 }, { soft_l1 = 2.0 } or { cauchy = 2.0 }";
        const LOSSES: [&str; 3] = ["huber", "soft_l1", "cauchy"];
        struct OneEntry;
        impl<'de> Visitor<'de> for OneEntry {
            type Value = LossName;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str(FORM)
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let Some((name, scale)) = map.next_entry::<String, f64>()? else {
                    return Err(A::Error::custom(format!("the loss is empty; give {FORM}")));
                };
                let loss = match name.as_str() {
                    "huber" => LossName::Huber(scale),
                    "soft_l1" => LossName::SoftL1(scale),
                    "cauchy" => LossName::Cauchy(scale),
                    _ => return Err(A::Error::unknown_variant(&name, &LOSSES)),
                };
                match map.next_key::<String>()? {
                    None => Ok(loss),
                    Some(_) => Err(A::Error::custom(format!("there are several losses; give {FORM}"))),
                }
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
                let known = LOSSES.contains(&name);
                Err(E::custom(if known {
                    format!(
                        "the loss \"{name}\" has no scale, the residual at which outliers begin; write {{ {name} = 2.0 }}"
                    )
                } else {
                    format!("the loss is \"{name}\"; give {FORM}")
                }))
            }
        }
        deserializer.deserialize_any(OneEntry)
    }
}
