//! Scenes of lattices: any number of equal sites.

use super::SceneError;
use super::checked::{check_version, finite};
use super::file::{RowsTable, RunTable, span_of_table};
use super::location::{Location, Named, Span};
use super::output::{RowTimes, of_formula};
use super::step_control::step_control;
use super::sum_of_terms::explain;
use crate::runtime::{
    AnyIntegrator, Boundary, Formula, InitialVelocity, Lattice, RuntimeError, SiteMotion, SiteSystem, Start,
    StepControl, Steps, velocity_name,
};
use schemars::JsonSchema;
use serde::Deserialize;

/// A motion of a lattice of equal sites with bonds between neighbours.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a scene of a lattice")]
#[schemars(title = "Scene of a lattice")]
pub(crate) struct LatticeFile {
    /// The version of the format: 1.
    #[expect(dead_code, reason = "it is looked at before all else is read")]
    pub version: Option<Location<i64>>,
    /// The lattice.
    pub lattice: Location<LatticeTable>,
    /// The initial state: a number for all sites, a list with one for each, or a formula in the index `i` of a site
    /// (`i`, `j`, `k` in several directions), counted from 0, and the number `n` of sites; for each coordinate `x`, and
    /// for its velocity `x'` or its momentum `p_x`. Velocities, the action `z` and the time `t` default to 0.
    pub start: Location<Named<Profile>>,
    /// The final time, the integrator and its steps.
    pub run: Location<RunTable>,
    /// The output.
    #[serde(default)]
    pub want: LatticeWant,
}

/// The lattice.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `sites`, `site` and `bond`")]
pub(crate) struct LatticeTable {
    /// The number of sites, or a list with the number along each direction.
    pub sites: Location<Sizes>,
    /// The boundary condition along each direction: periodic, fixed walls at 0, or free ends.
    #[serde(default)]
    pub boundary: BoundaryName,
    /// The names of the components at a site, 1 to 3 of them; by default `x`.
    pub coordinates: Option<Location<Vec<Location<String>>>>,
    /// The Lagrangian of a site, `m*x'^2/2 - V(t, x) + gamma*z`. The drag is that of the whole lattice, and counts
    /// once.
    pub site: Location<String>,
    /// The Lagrangian of a bond, in the coordinates `xl` of the site before it and `xr` of the site after it.
    pub bond: Option<Location<String>>,
    /// The parameters with their values.
    #[serde(default)]
    pub parameters: Named<f64>,
}

/// The number of sites.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a whole number, or a list of them")]
#[schemars(inline)]
pub(crate) enum Sizes {
    /// In a chain.
    One(usize),
    /// Along each direction.
    Many(Vec<usize>),
}

impl Sizes {
    /// The number along each direction.
    pub fn to_vec(&self) -> Vec<usize> {
        match self {
            Sizes::One(sites) => vec![*sites],
            Sizes::Many(sizes) => sizes.clone(),
        }
    }
}

/// The boundary condition of a lattice.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum BoundaryName {
    /// The ends are joined.
    #[default]
    Periodic,
    /// Walls at 0.
    Fixed,
    /// No bonds beyond the ends.
    Free,
}

impl From<BoundaryName> for Boundary {
    fn from(name: BoundaryName) -> Self {
        match name {
            BoundaryName::Periodic => Boundary::Periodic,
            BoundaryName::Fixed => Boundary::Fixed,
            BoundaryName::Free => Boundary::Free,
        }
    }
}

/// The values at all sites.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number, a list of numbers, or a formula in the index of a site")]
#[schemars(inline)]
pub(crate) enum Profile {
    /// The same value at all sites.
    One(f64),
    /// One value for each site.
    Many(Vec<f64>),
    /// A formula in the index.
    Formula(String),
}

/// The output of a lattice.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `rows`")]
pub(crate) struct LatticeWant {
    /// The rows of rows.csv, of the whole state; by default at the ends of 1000 equal intervals.
    pub rows: Option<Location<RowsTable>>,
}

/// A scene of a lattice that has been read and validated.
pub struct LatticeScene {
    /// The sparse system.
    pub system: SiteSystem,
    /// The motion, with its rows.
    pub motion: SiteMotion,
    /// The names of the components at a site.
    pub coordinates: Vec<String>,
    /// The number of sites along each direction.
    pub sizes: Vec<usize>,
    text: String,
    spans: [(&'static str, Span); 6],
    run: Span,
}

/// The maximal number of sites of a scene, each of which is a column of rows.csv.
const MAX_SITES: usize = 1_000_000;

impl LatticeScene {
    /// Whether a text is a scene with `[lattice]`.
    pub fn is_one(text: &str) -> bool {
        span_of_table(text, "lattice").is_some()
    }

    /// Reads a scene file with `[lattice]`.
    ///
    /// ```
    /// let scene = herglotz::LatticeScene::read(r#"
    ///     [lattice]
    ///     sites = 100
    ///     site = "x'^2/2 - (1 - cos(x)) + gamma*z"
    ///     bond = "-(xr - xl)^2/2"
    ///     parameters = { gamma = -0.1 }
    ///     [start]
    ///     x = "exp(-(i - n/2)^2/20)"
    ///     [run]
    ///     time = 10.0
    ///     integrator = "strang"
    ///     step = 0.1
    /// "#)?;
    /// assert_eq!(scene.system.dimension(), 100);
    /// # Ok::<(), herglotz::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text.
    pub fn read(text: &str) -> Result<Self, SceneError> {
        check_version(text)?;
        let file: LatticeFile = toml::from_str(text).map_err(|error| SceneError::of_format(text, &error))?;
        let LatticeFile { lattice: table, start, run, want, .. } = &file;
        let coordinates: Vec<String> = match &table.coordinates {
            Some(names) => names.iter().map(|name| (**name).clone()).collect(),
            None => vec!["x".into()],
        };
        for (name, value) in &table.parameters.0 {
            finite(text, value, name)?;
        }
        let sizes = table.sites.to_vec();
        let count = sizes.iter().try_fold(1usize, |product, size| product.checked_mul(*size));
        if count.is_none_or(|count| count > MAX_SITES) {
            let message = format!(
                "the lattice has more than {MAX_SITES} sites, each of which is a column of rows.csv; use the library for larger lattices"
            );
            return Err(SceneError::at(text, table.sites.span(), message));
        }
        let parameters: Vec<(String, f64)> =
            table.parameters.0.iter().map(|(name, value)| ((**name).clone(), **value)).collect();
        let lattice = Lattice {
            coordinates: coordinates.clone(),
            site: (*table.site).clone(),
            bond: table.bond.as_ref().map(|bond| (**bond).clone()),
            sizes: sizes.clone(),
            boundary: table.boundary.into(),
            parameters: parameters.clone(),
        };
        let names = table.coordinates.as_ref().map_or(table.span(), Location::span);
        let parameters_at = table.parameters.0.first().map_or(table.span(), |(name, _)| name.span());
        let spans = [
            ("site", table.site.span()),
            ("bond", table.bond.as_ref().map_or(table.span(), Location::span)),
            ("sites", table.sites.span()),
            ("coordinates", names),
            ("parameters", parameters_at),
            ("integrator", run.integrator.as_ref().map_or(run.span(), Location::span)),
        ];
        let explain = |error: RuntimeError| explain(text, &spans, table.span(), "[lattice]", &error);
        let system = lattice.system().map_err(explain)?;
        let start = read_start(text, start, &coordinates, &sizes, &parameters)?;
        let end = finite(text, &run.time, "time")?;
        let (by, steps) = steps(text, run)?;
        let rows = RowTimes::read(text, want.rows.as_ref(), (start.t, end))?.when(start.t, end);
        if let Some(columns) = want.rows.as_ref().and_then(|rows| rows.columns.as_ref()) {
            return Err(SceneError::at(
                text,
                columns.span(),
                "the rows of a lattice contain the whole state; remove `columns`",
            ));
        }
        let motion = SiteMotion { rows, ..SiteMotion::new(start, end, by, steps) };
        Ok(LatticeScene { system, motion, coordinates, sizes, text: text.into(), spans, run: run.span() })
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        explain(&self.text, &self.spans, self.run, "[lattice]", error)
    }

    /// The names of the columns of a row: `t`, `x[0]`, ..., `x'[0]`, ..., `p_x[0]`, ..., `z`, `energy`; with two
    /// directions `x[0][0]`.
    pub fn columns(&self) -> Vec<String> {
        let sites: usize = self.sizes.iter().product();
        let index = |site: usize| {
            let mut rest = sites;
            let digits = self.sizes.iter().map(|size| {
                rest /= size;
                (site / rest % size).to_string()
            });
            digits.collect::<Vec<_>>().join("][")
        };
        let kinds: [&dyn Fn(&str) -> String; 3] = [&|x| x.to_owned(), &|x| velocity_name(x), &|x| format!("p_{x}")];
        let of_kind = |name: &dyn Fn(&str) -> String| -> Vec<String> {
            (0..sites)
                .flat_map(|i| self.coordinates.iter().map(move |x| (i, x)))
                .map(|(i, x)| format!("{}[{}]", name(x), index(i)))
                .collect()
        };
        let state = kinds.into_iter().flat_map(of_kind);
        ["t".to_owned()].into_iter().chain(state).chain(["z", "energy"].map(str::to_owned)).collect()
    }
}

/// The integrator and its steps.
fn steps(text: &str, run: &Location<RunTable>) -> Result<(AnyIntegrator, Steps), SceneError> {
    if let Some(scales) = &run.scales {
        let message = "`scales` are for an accuracy or an error estimate, and a lattice has neither; remove them";
        return Err(SceneError::at(text, scales.span(), message));
    }
    if let Some(accuracy) = &run.accuracy {
        let message = "a lattice is integrated with given steps; give an `integrator` and a `step` instead of an \
                       accuracy";
        return Err(SceneError::at(text, accuracy.span(), message));
    }
    if run.step.is_none() && run.steps.is_none() || run.integrator.is_none() {
        let message =
            "the run of a lattice needs an `integrator` and a `step`, as in integrator = \"strang\" and step = 0.1";
        return Err(SceneError::at(text, run.span(), message));
    }
    match step_control(text, run)? {
        StepControl::Steps { by, steps } => Ok((by, steps)),
        StepControl::Accuracy { .. } => {
            Err(SceneError::at(text, run.span(), "the run of a lattice needs an `integrator` and a `step`"))
        }
    }
}

/// The initial state of all sites.
fn read_start(
    text: &str,
    table: &Location<Named<Profile>>,
    coordinates: &[String],
    sizes: &[usize],
    parameters: &[(String, f64)],
) -> Result<Start, SceneError> {
    let (sites, d) = (sizes.iter().product::<usize>(), coordinates.len());
    let (mut q, mut v, mut p) = (vec![None; d], vec![None; d], vec![None; d]);
    let (mut t, mut z) = (0.0, 0.0);
    for (name, profile) in &table.0 {
        let number = |into: &mut f64| match &**profile {
            Profile::One(x) => {
                *into = finite(text, &Location::new(*x, profile.span()), name)?;
                Ok(())
            }
            _ => Err(SceneError::at(text, profile.span(), format!("`{}` must be a single number", **name))),
        };
        let place = |of: &dyn Fn(&str) -> String| coordinates.iter().position(|x| of(x) == **name);
        let found = if let Some(i) = place(&|x| x.to_owned()) {
            q.get_mut(i)
        } else if let Some(i) = place(&|x| velocity_name(x)) {
            v.get_mut(i)
        } else {
            place(&|x| format!("p_{x}")).and_then(|i| p.get_mut(i))
        };
        match (found, name.as_str()) {
            (Some(place), _) => *place = Some(values(text, profile, name, sizes, parameters)?),
            (None, "t") => number(&mut t)?,
            (None, "z") => number(&mut z)?,
            _ => {
                let known: Vec<String> =
                    coordinates.iter().flat_map(|x| [x.clone(), velocity_name(x), format!("p_{x}")]).collect();
                let known: Vec<&str> = known.iter().map(String::as_str).chain(["z", "t"]).collect();
                let message =
                    format!("unknown name `{}` in the start; the known names are {}", **name, known.join(", "));
                return Err(SceneError::unknown(text, name.span(), name, known, message));
            }
        }
    }
    let by_momentum = p.iter().any(Option::is_some);
    if by_momentum && v.iter().any(Option::is_some) {
        return Err(SceneError::at(
            text,
            table.span(),
            "the start has both velocities and momenta; give one kind for all coordinates",
        ));
    }
    if let Some(place) = q.iter().position(Option::is_none) {
        let name = &coordinates[place];
        let message = format!(
            "the coordinate `{name}` has no value at the start; add `{name} = 0.0` to [start], or a formula in `i`"
        );
        return Err(SceneError::at(text, table.span(), message));
    }
    // The components of one site are contiguous.
    let of = |all: &[Option<Vec<f64>>]| -> Vec<f64> {
        (0..sites * d).map(|k| all[k % d].as_ref().and_then(|x| x.get(k / d)).copied().unwrap_or(0.0)).collect()
    };
    let velocity = if by_momentum { InitialVelocity::Momentum(of(&p)) } else { InitialVelocity::Velocity(of(&v)) };
    Ok(Start { t, q: of(&q), velocity, z })
}

/// The values at all sites.
fn values(
    text: &str,
    profile: &Location<Profile>,
    name: &str,
    sizes: &[usize],
    parameters: &[(String, f64)],
) -> Result<Vec<f64>, SceneError> {
    let sites: usize = sizes.iter().product();
    let all: Vec<f64> = match &**profile {
        Profile::One(x) => vec![*x; sites],
        Profile::Many(all) if all.len() == sites => all.clone(),
        Profile::Many(all) => {
            let message = format!("`{name}` is a list of {} numbers, but there are {sites} sites", all.len());
            return Err(SceneError::at(text, profile.span(), message));
        }
        Profile::Formula(formula) => {
            const INDICES: [&str; 3] = ["i", "j", "k"];
            let Some(indices) = INDICES.get(..sizes.len()) else {
                return Err(SceneError::at(
                    text,
                    profile.span(),
                    "the start can be given by formulas for up to three directions",
                ));
            };
            let mut known: Vec<(&str, f64)> = parameters.iter().map(|(name, x)| (name.as_str(), *x)).collect();
            if !known.iter().any(|(name, _)| *name == "n") {
                known.push(("n", sites as f64));
            }
            let read = Formula::parse("0", indices, &known).and_then(|names| names.expression(formula));
            let read = read.map_err(|error| of_formula(text, profile.span(), &error.into()))?;
            if read.has_velocity() || read.has_action() {
                return Err(SceneError::at(
                    text,
                    profile.span(),
                    "the formula of a start can depend only on the index of a site",
                ));
            }
            let at = |site: usize| {
                let mut rest = sites;
                let index: Vec<f64> = sizes
                    .iter()
                    .map(|size| {
                        rest /= size;
                        (site / rest % size) as f64
                    })
                    .collect();
                read.at(0.0, &index, &vec![0.0; sizes.len()], 0.0)
            };
            (0..sites).map(at).collect()
        }
    };
    match all.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((i, x)) => Err(SceneError::at(
            text,
            profile.span(),
            format!("`{name}` is {x} at site {i}; it must be a finite number"),
        )),
        None => Ok(all),
    }
}
