//! The fit of a scene: its data, unknowns and options.

use super::SceneError;
use super::checked::{finite, positive};
use super::csv_file::CsvFile;
use super::fit_table::{Deviation, FitTable, LossName, Observed};
use super::location::{Location, Span};
use super::output::times_in_order;
use super::sweep::{Purpose, slot};
use super::tables::TIME;
use crate::runtime::{
    Column, FitError, Formula, InitialVelocity, MotionFit, ResidualLoss, RuntimeError, Series, Start, Unknown,
    velocity_name,
};
use std::path::Path;

const FIT: Purpose =
    Purpose { table: "fit", done: "fitted", act: "fit", not_time: "the motion starts at a fixed time" };

/// The fit of a scene, with the positions of its parts.
#[derive(Clone, Debug)]
pub(super) struct SceneFit {
    unknowns: Vec<Unknown>,
    series: Vec<Series>,
    loss: ResidualLoss,
    absolute_deviations: bool,
    nodes: Vec<f64>,
    starts: Vec<Vec<f64>>,
    max_evaluations: Option<usize>,
    table_at: Span,
    csv_at: Span,
    unknowns_at: Span,
    nodes_at: Span,
    starts_at: Vec<Span>,
}

/// What a fit is read with: the text of the scene and its folder, the formula, and the span of the motion.
pub(super) struct Reader<'a> {
    pub text: &'a str,
    pub folder: &'a Path,
    pub formula: &'a Formula,
    pub start: &'a Start,
    pub end: f64,
}

impl Reader<'_> {
    pub fn read(&self, table: &Location<FitTable>) -> Result<SceneFit, SceneError> {
        let text = self.text;
        if self.start.t >= self.end {
            let message = "a fit requires a motion forward in time; give a final `time` after that of the start";
            return Err(SceneError::at(text, table.span(), message));
        }
        let unknowns = self.unknowns(table)?;
        let names: Vec<&str> = unknowns.iter().map(|unknown| unknown.name.as_str()).collect();
        let starts =
            table.starts.iter().map(|start| self.values(start, &unknowns, &names)).collect::<Result<_, _>>()?;
        let first = || self.current(&names).into_iter().zip(&unknowns);
        if table.starts.is_empty()
            && let Some((value, unknown)) = first().find(|(value, unknown)| !is_within(*value, unknown))
        {
            let name = &unknown.name;
            let key = table.bounds.0.iter().find(|(key, _)| **key == *name).map(|(_, bounds)| bounds.span());
            return Err(SceneError::at(text, key.unwrap_or(table.span()), outside(unknown, value)));
        }
        let evaluations = table.evaluations.as_ref();
        if let Some(count) = evaluations.filter(|count| ***count == 0) {
            return Err(SceneError::at(text, count.span(), "`evaluations` is 0; it must be at least 1"));
        }
        Ok(SceneFit {
            series: self.series(table)?,
            unknowns,
            loss: self.loss(table)?,
            absolute_deviations: table.absolute_sigma,
            nodes: self.nodes(table)?,
            starts,
            max_evaluations: evaluations.map(|count| **count),
            table_at: table.span(),
            csv_at: table.csv.span(),
            unknowns_at: table.unknowns.span(),
            nodes_at: table
                .nodes
                .as_ref()
                .map(Location::span)
                .or(table.pieces.as_ref().map(Location::span))
                .unwrap_or(table.span()),
            starts_at: table.starts.iter().map(Location::span).collect(),
        })
    }

    fn unknowns(&self, table: &FitTable) -> Result<Vec<Unknown>, SceneError> {
        let text = self.text;
        let mut unknowns: Vec<Unknown> = Vec::new();
        for name in table.unknowns.iter() {
            slot(text, self.formula, self.start, name, &FIT)?;
            if unknowns.iter().any(|known| known.name == **name) {
                return Err(SceneError::at(text, name.span(), format!("`{}` is given twice; remove one", **name)));
            }
            unknowns.push(Unknown::free(name.as_str()));
        }
        if unknowns.is_empty() {
            let message = "there are no unknowns; name at least one parameter or value of the start, as in unknowns = \
                           [\"gamma\", \"start.x\"]";
            return Err(SceneError::at(text, table.unknowns.span(), message));
        }
        for (name, bounds) in &table.bounds.0 {
            let known: Vec<String> = unknowns.iter().map(|unknown| unknown.name.clone()).collect();
            let Some(unknown) = unknowns.iter_mut().find(|unknown| unknown.name == **name) else {
                let message = format!("`{}` is not an unknown of the fit; these are {}", **name, known.join(", "));
                return Err(SceneError::unknown(text, name.span(), name, known.iter().map(String::as_str), message));
            };
            let [lower, upper] = ***bounds else {
                let message =
                    format!("the bounds of `{}` are {} numbers; give two, as in [0.0, inf]", **name, bounds.len());
                return Err(SceneError::at(text, bounds.span(), message));
            };
            // Comparisons with a NaN are false.
            if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
                let message = format!(
                    "the bounds of `{}` are {lower} and {upper}; the lower one must not exceed the upper one",
                    **name
                );
                return Err(SceneError::at(text, bounds.span(), message));
            }
            (unknown.lower, unknown.upper) = (lower, upper);
        }
        Ok(unknowns)
    }

    /// The values of unknowns in the scene.
    fn current(&self, names: &[&str]) -> Vec<f64> {
        let names = names.iter().map(|name| name.strip_prefix("start.").ok_or(*name));
        let coordinates = self.formula.coordinates();
        let entry = |x: &[f64], i: Option<usize>| i.and_then(|i| x.get(i)).copied();
        names
            .map(|name| match name {
                Err(parameter) => {
                    let mut all = self.formula.parameters();
                    all.find(|(known, _)| *known == parameter).map_or(f64::NAN, |(_, value)| value)
                }
                Ok(name) if name == self.formula.action() => self.start.z,
                Ok(name) => {
                    let at = |of: &dyn Fn(&str) -> String| coordinates.iter().position(|x| of(x) == name);
                    let rate = match &self.start.velocity {
                        InitialVelocity::Velocity(v) => entry(v, at(&velocity_name)),
                        InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => {
                            entry(p, self.formula.momenta().iter().position(|momentum| momentum == name))
                        }
                    };
                    entry(&self.start.q, at(&str::to_owned)).or(rate).unwrap_or(f64::NAN)
                }
            })
            .collect()
    }

    /// The values of all unknowns of a start.
    fn values(
        &self,
        start: &Location<super::quantities::Quantities<f64>>,
        unknowns: &[Unknown],
        names: &[&str],
    ) -> Result<Vec<f64>, SceneError> {
        let text = self.text;
        let mut values = self.current(names);
        for (name, value) in &start.0 {
            let Some(i) = names.iter().position(|known| *known == name.as_str()) else {
                let message = format!("`{}` is not an unknown of the fit; these are {}", **name, names.join(", "));
                return Err(SceneError::unknown(text, name.span(), name, names.iter().copied(), message));
            };
            values[i] = finite(text, value, name)?;
            if !is_within(values[i], &unknowns[i]) {
                return Err(SceneError::at(text, value.span(), outside(&unknowns[i], values[i])));
            }
        }
        Ok(values)
    }

    fn loss(&self, table: &FitTable) -> Result<ResidualLoss, SceneError> {
        let Some(loss) = &table.loss else { return Ok(ResidualLoss::Linear) };
        let (LossName::Huber(scale) | LossName::SoftL1(scale) | LossName::Cauchy(scale)) = **loss;
        let scale = positive(self.text, &Location::new(scale, loss.span()), "loss")?;
        Ok(match **loss {
            LossName::Huber(_) => ResidualLoss::Huber { scale },
            LossName::SoftL1(_) => ResidualLoss::SoftL1 { scale },
            LossName::Cauchy(_) => ResidualLoss::Cauchy { scale },
        })
    }

    fn nodes(&self, table: &FitTable) -> Result<Vec<f64>, SceneError> {
        let (t0, end) = (self.start.t, self.end);
        match (&table.nodes, &table.pieces) {
            (Some(_), Some(pieces)) => {
                Err(SceneError::at(self.text, pieces.span(), "give `nodes` or a number of `pieces`, not both"))
            }
            (Some(nodes), None) => times_in_order(self.text, nodes, "nodes", (t0, end)),
            (None, Some(pieces)) if **pieces == 0 => {
                Err(SceneError::at(self.text, pieces.span(), "`pieces` is 0; it must be at least 1"))
            }
            (None, Some(pieces)) => Ok((1..**pieces).map(|k| t0 + (end - t0) * k as f64 / **pieces as f64).collect()),
            (None, None) => Ok(Vec::new()),
        }
    }

    /// The data, one series for each column.
    fn series(&self, table: &FitTable) -> Result<Vec<Series>, SceneError> {
        let text = self.text;
        let file = CsvFile::read(text, self.folder, &table.csv)?;
        let (time, time_at) = table.time.as_ref().map_or((TIME, file.span()), |name| (name.as_str(), name.span()));
        let times = file.place(time, time_at, "time")?;
        let deviation_columns = table.sigma.0.iter().filter_map(|(_, sigma)| match &**sigma {
            Deviation::Column(column) => Some(column.as_str()),
            Deviation::Number(_) => None,
        });
        let deviation_columns: Vec<&str> = deviation_columns.collect();
        // Each quantity with its column.
        let observed: Vec<(Location<String>, Location<String>)> = match table.observe.as_deref() {
            None => {
                let shown = file.columns().filter(|column| *column != time && !deviation_columns.contains(column));
                shown.map(|column| Location::new(column.to_owned(), file.span())).map(|of| (of.clone(), of)).collect()
            }
            Some(Observed::Columns(list)) => {
                let column = |of: &Location<String>| Location::new(column_of(of).to_owned(), of.span());
                list.iter().map(|of| (of.clone(), column(of))).collect()
            }
            Some(Observed::Quantities(table)) => {
                table.0.iter().map(|(column, of)| (of.clone(), column.clone())).collect()
            }
        };
        if observed.is_empty() {
            let message = "nothing is observed; name at least one column, as in observe = [\"x\"]";
            return Err(SceneError::at(text, table.observe.as_ref().map_or(file.span(), Location::span), message));
        }
        let columns: Vec<&str> = observed.iter().map(|(_, column)| column.as_str()).collect();
        for (name, sigma) in &table.sigma.0 {
            if !columns.contains(&name.as_str()) {
                let message = format!("`{}` is not observed; the observed columns are {}", **name, columns.join(", "));
                return Err(SceneError::unknown(text, name.span(), name, columns.iter().copied(), message));
            }
            if let Deviation::Number(x) = **sigma {
                positive(text, &Location::new(x, sigma.span()), name)?;
            }
        }
        let mut all = Vec::with_capacity(observed.len());
        for ((quantity, column_at), column) in observed.iter().zip(columns) {
            self.check_quantity(quantity, table.observe.is_none())?;
            let place = file.place(column, column_at.span(), "observe")?;
            let deviation = table.sigma.get(column);
            let mut series =
                Series { quantity: (**quantity).clone(), times: vec![], values: vec![], deviations: None, event: None };
            let mut deviations = Vec::new();
            let places = match deviation.map(|deviation| (&**deviation, deviation.span())) {
                Some((Deviation::Column(name), span)) => file.place(name, span, "sigma")?,
                _ => place,
            };
            let entries = file.entries(times).zip(file.entries(place)).zip(file.entries(places));
            for (((line, time_entry), (_, entry)), (_, of_deviation)) in entries {
                // An empty entry was not measured.
                if entry.is_empty() {
                    continue;
                }
                let t = file.number(line, time_entry, time)?;
                if !(self.start.t..=self.end).contains(&t) {
                    let why = format!(
                        "the motion runs from {} to {}: change `time` of [run], or remove the line",
                        self.start.t, self.end
                    );
                    return Err(file.refuse_entry(line, time_entry, time, &why));
                }
                let value = file.number(line, entry, column)?;
                if !value.is_finite() {
                    let why = "it must be a finite number, or empty where it was not measured";
                    return Err(file.refuse_entry(line, entry, column, why));
                }
                series.times.push(t);
                series.values.push(value);
                match deviation.map(|deviation| &**deviation) {
                    None => {}
                    Some(Deviation::Number(x)) => deviations.push(*x),
                    Some(Deviation::Column(name)) => {
                        let sigma = file.number(line, of_deviation, name)?;
                        if sigma.is_nan() || sigma <= 0.0 {
                            let why = "a standard deviation must be positive";
                            return Err(file.refuse_entry(line, of_deviation, name, why));
                        }
                        deviations.push(sigma);
                    }
                }
            }
            series.deviations = deviation.is_some().then_some(deviations);
            all.push(series);
        }
        if table.absolute_sigma
            && let Some(series) = all.iter().find(|series| series.deviations.is_none())
        {
            let message = format!("`absolute_sigma` is given, but `sigma` has no `{}`; add it", series.quantity);
            return Err(SceneError::at(
                text,
                table.sigma.0.first().map_or(table.csv.span(), |(name, _)| name.span()),
                message,
            ));
        }
        if all.iter().all(|series| series.times.iter().all(|t| *t <= self.start.t)) {
            let message = format!(
                "the file {:?} has no data after the start of the motion, at t = {}; give some at later times",
                table.csv.as_str(),
                self.start.t
            );
            return Err(SceneError::at(text, file.span(), message));
        }
        Ok(all)
    }

    /// Checks that a text is a quantity of the motion.
    fn check_quantity(&self, quantity: &Location<String>, is_default: bool) -> Result<(), SceneError> {
        let refuse = |message: String| {
            let remedy = if is_default { "; name the columns that are fitted by `observe`" } else { "" };
            SceneError::at(self.text, quantity.span(), format!("the column `{}` {message}{remedy}", **quantity))
        };
        match Column::parse(quantity, self.formula) {
            Ok(Column::Time) => Err(refuse("is the time; fit a quantity of the motion".to_owned())),
            Ok(column) if column.has_conformal_factor() => {
                Err(refuse("contains `sigma` or `log_factor`, which are not functions of the state".to_owned()))
            }
            Ok(_) => Ok(()),
            Err(RuntimeError::Formula(crate::runtime::FormulaError::Parse(error))) if !is_default => {
                Err(SceneError::in_string(self.text, quantity.span(), &error))
            }
            Err(error) => Err(refuse(format!("is no quantity of the motion: {error}"))),
        }
    }
}

/// The column of a quantity: its name, or all of it.
fn column_of(quantity: &str) -> &str {
    quantity.split_once('=').map_or(quantity, |(name, _)| name).trim()
}

fn is_within(value: f64, unknown: &Unknown) -> bool {
    (unknown.lower..=unknown.upper).contains(&value)
}

fn outside(unknown: &Unknown, value: f64) -> String {
    let Unknown { name, lower, upper } = unknown;
    format!("the fit starts at {name} = {value}, which is not between the bounds {lower} and {upper}")
}

impl SceneFit {
    /// The fit of a motion.
    pub fn of(&self, motion: crate::runtime::Motion) -> MotionFit {
        MotionFit {
            loss: self.loss,
            absolute_deviations: self.absolute_deviations,
            nodes: self.nodes.clone(),
            starts: self.starts.clone(),
            max_evaluations: self.max_evaluations,
            ..MotionFit::new(motion, self.unknowns.clone(), self.series.clone())
        }
    }

    /// The position of what an error of a fit concerns.
    pub fn span_of(&self, error: &FitError) -> Span {
        match error {
            FitError::TooFewData { .. } | FitError::Datum { .. } | FitError::Time { .. } | FitError::NoTimes { .. } => {
                self.csv_at
            }
            FitError::Node { .. } => self.nodes_at,
            FitError::Unknown { .. } | FitError::UnknownParameter(_) | FitError::Bounds { .. } => self.unknowns_at,
            FitError::Start { .. } => self.starts_at.first().copied().unwrap_or(self.unknowns_at),
            _ => self.table_at,
        }
    }
}
