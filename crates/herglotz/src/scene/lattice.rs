//! Scenes of lattices that run by sparse integrators: any number of equal sites.

use super::SceneError;
use super::checked::finite;
use super::file;
use super::file::{File, RunTable, WantTable};
use super::location::{Location, Span};
use super::only::{refuse_all, set, span};
use super::output::{self, RowTimes};
use super::start::{self, StartNames};
use super::step_control::step_control;
use super::sum_of_terms::{explain, lattice, spans_of_lattice};
use crate::runtime::{AnyIntegrator, Lattice, RuntimeError, SiteMotion, SiteSystem, StepControl, Steps, velocity_name};
use discrete_herglotz::rules::Method;

/// Up to this number of coordinates all integrators are those of a formula.
const FEW: usize = 16;

/// Up to this number of coordinates a lattice is a formula, which runs by contact Gauss collocation.
const MOST_OF_FORMULA: usize = 256;

/// The maximal number of sites of a scene, each of which is a column of rows.csv.
const MAX_SITES: usize = 1_000_000;

/// A scene of a lattice that runs by sparse integrators, which has been read and validated.
pub struct LatticeScene {
    /// The sparse system.
    pub system: SiteSystem,
    /// The motion, with its rows.
    pub motion: SiteMotion,
    /// The names of the components at a site.
    pub coordinates: Vec<String>,
    /// The number of sites along each direction.
    pub sizes: Vec<usize>,
    chosen: Option<Vec<String>>,
    text: String,
    spans: [(&'static str, Span); 6],
    run: Span,
}

/// The number of coordinates of a lattice; `None` where it is not a number.
fn dimension(lattice: &Lattice) -> Option<usize> {
    lattice.sizes.iter().try_fold(lattice.coordinates.len(), |product, size| product.checked_mul(*size))
}

/// Whether the sparse integrators have this one.
fn is_sparse(by: &str) -> bool {
    match by.parse() {
        Ok(AnyIntegrator::Splitting(_)) => true,
        Ok(AnyIntegrator::Gauss { stages }) => stages <= 2,
        Ok(other) => other == AnyIntegrator::Discrete(Method::Midpoint),
        Err(_) => false,
    }
}

/// What a scene gives that takes a formula, with its position.
fn of_formulas(file: &File) -> Vec<(Option<Span>, &'static str)> {
    let (run, want, system) = (&*file.run, &file.want, &*file.system);
    let of_events = want.events.first().map(|event| event.when.span());
    vec![
        (of_events, "events"),
        (want.wrap.first().map(Location::span), "wrap"),
        (set(&want.conformal_factor), "conformal_factor"),
        (set(&want.estimate), "estimate"),
        (span(&file.force), "force"),
        (file.friction.0.first().map(|(name, _)| name.span()), "friction"),
        (file.tables.0.first().map(|(name, _)| name.span()), "tables"),
        (span(&system.constraints), "constraints"),
        (span(&run.accuracy), "accuracy"),
        (span(&run.scales), "scales"),
        (span(&run.breaks), "breaks"),
        (set(&run.project), "project"),
        (set(&run.exact), "exact"),
    ]
}

impl LatticeScene {
    /// Whether a scene runs by sparse integrators: a lattice of more than 16 coordinates with given steps of a splitting, of
    /// `midpoint`, `gauss_1` or `gauss_2`, of which nothing is requested that takes a formula; and every lattice of more
    /// than 256 coordinates.
    pub(super) fn is_one(file: &File) -> bool {
        let Some(lattice) = lattice(&file.system) else { return false };
        let by = || file.run.integrator.as_ref().is_some_and(|name| is_sparse(name));
        match dimension(&lattice) {
            Some(dimension) if dimension <= FEW => false,
            Some(dimension) if dimension <= MOST_OF_FORMULA => {
                by() && columns_of(file).is_none() && of_formulas(file).iter().all(|(given, _)| given.is_none())
            }
            _ => true,
        }
    }

    /// Reads a scene file of a lattice.
    ///
    /// ```
    /// let scene = herglotz::LatticeScene::read(r#"
    ///     [system]
    ///     parameters = { gamma = -0.1 }
    ///     [system.lattice]
    ///     sites = 1000
    ///     site = "x'^2/2 - (1 - cos(x)) + gamma*z"
    ///     bond = "-(xr - xl)^2/2"
    ///     [start]
    ///     x = "exp(-(i - n/2)^2/20)"
    ///     [run]
    ///     time = 10.0
    ///     integrator = "strang"
    ///     step = 0.1
    /// "#)?;
    /// assert_eq!(scene.system.dimension(), 1000);
    /// # Ok::<(), herglotz::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text.
    pub fn read(text: &str) -> Result<Self, SceneError> {
        Self::of(text, &file::read(text, &[])?)
    }

    /// Reads the tables of a scene.
    pub(super) fn of(text: &str, file: &File) -> Result<Self, SceneError> {
        let (system, run) = (&file.system, &file.run);
        let (Some(lattice), Some(table)) = (lattice(system), &system.lattice) else {
            return Err(SceneError::at(text, system.span(), "the system has no `lattice`"));
        };
        for (name, value) in &system.parameters.0 {
            finite(text, value, name)?;
        }
        if dimension(&lattice).is_none_or(|count| count / lattice.coordinates.len().max(1) > MAX_SITES) {
            let message = format!(
                "the lattice has more than {MAX_SITES} sites, each of which is a column of rows.csv; use the library for larger lattices"
            );
            return Err(SceneError::at(text, table.sites.span(), message));
        }
        refuse_all(text, of_formulas(file), |name| {
            format!(
                "`{name}` takes a formula, which has at most {MOST_OF_FORMULA} coordinates; a lattice with more runs with given \
                 steps of a splitting, of midpoint, gauss_1 or gauss_2: remove `{name}`"
            )
        })?;
        let [site, bond, sites, names, parameters] = spans_of_lattice(system, table);
        let integrator = ("integrator", RunTable::span_of(&run.integrator, run.span()));
        let spans = [site, bond, sites, names, parameters, integrator];
        let sparse = lattice.system().map_err(|error| explain(text, &spans, table.span(), &error))?;
        let at = file.start.as_ref().map_or(system.span(), Location::span);
        let start = start::read(text, &StartNames::of_lattice(&lattice), file.start.as_deref(), None, at)?;
        let end = run.end(text, run.span())?;
        let (by, steps) = steps(text, run)?;
        let WantTable { rows, .. } = &file.want;
        let rows = RowTimes::read(text, rows.as_ref(), (start.t, end))?.when(start.t, end);
        let Lattice { coordinates, sizes, .. } = lattice;
        let names = Names { coordinates: &coordinates, sites: sizes.iter().product() };
        let (chosen, columns) = match columns_of(file) {
            Some(columns) => {
                let (chosen, places): (Vec<String>, Vec<usize>) = names.places(text, columns)?.into_iter().unzip();
                (Some(chosen), Some(places))
            }
            None => (None, None),
        };
        let conformal_factor = chosen.iter().flatten().any(|name| name == LOG_FACTOR);
        let motion = SiteMotion { rows, columns, conformal_factor, ..SiteMotion::new(start, end, by, steps) };
        let (text, run) = (text.into(), run.span());
        Ok(LatticeScene { system: sparse, motion, coordinates, sizes, chosen, text, spans, run })
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        explain(&self.text, &self.spans, self.run, error)
    }

    /// The names of the columns of a row, those of the scene or those of the whole state.
    pub fn columns(&self) -> Vec<String> {
        self.chosen.clone().unwrap_or_else(|| self.columns_of_state())
    }

    /// The plan of the motion in words.
    ///
    /// # Errors
    /// Those of [`SiteMotion::step`].
    pub fn plan(&self) -> Result<String, RuntimeError> {
        let SiteMotion { start, end, by, .. } = &self.motion;
        let ((h, count), sites) = (self.motion.step()?, self.sizes.iter().product::<usize>());
        let from = start.t;
        Ok(format!(
            "{count} steps of {h} by {by}, t = {from} to {end}\n{sites} sites; steps and integrator are as given\n"
        ))
    }

    /// Whether the scene chooses columns.
    pub fn has_columns(&self) -> bool {
        self.chosen.is_some()
    }

    /// The names of the columns of the whole state: `t`, `x[0]`, ..., `x'[0]`, ..., `p_x[0]`, ..., `z`, `energy`; with several
    /// components at a site `x_0`, `y_0`, `x_1`, ...
    pub fn columns_of_state(&self) -> Vec<String> {
        let of = Names { coordinates: &self.coordinates, sites: self.sizes.iter().product() };
        let of = &of;
        let names: Vec<String> =
            (0..of.sites).flat_map(|i| of.coordinates.iter().map(move |name| of.component(name, i))).collect();
        let velocities = names.iter().map(|name| velocity_name(name));
        let momenta = names.iter().map(|name| format!("p_{name}"));
        let state = names.iter().cloned().chain(velocities).chain(momenta);
        ["t".to_owned()].into_iter().chain(state).chain(["z", "energy"].map(str::to_owned)).collect()
    }

    /// Whether the lattice has few enough coordinates to be a formula.
    pub fn is_a_formula(&self) -> bool {
        self.system.dimension() <= MOST_OF_FORMULA
    }
}

/// The columns that a scene chooses.
fn columns_of(file: &File) -> Option<&Location<Vec<Location<String>>>> {
    file.want.rows.as_ref().and_then(|rows| rows.columns.as_ref())
}

const LOG_FACTOR: &str = "log_factor";

/// The names of the state of a lattice.
struct Names<'a> {
    coordinates: &'a [String],
    sites: usize,
}

impl Names<'_> {
    /// The name of a component at a site.
    fn component(&self, name: &str, site: usize) -> String {
        if self.coordinates.len() == 1 { format!("{name}[{site}]") } else { format!("{name}_{site}") }
    }

    /// The place of a column in the row of the whole state.
    fn place(&self, column: &str) -> Option<usize> {
        let (d, n) = (self.coordinates.len(), self.coordinates.len() * self.sites);
        let after = ["z", "energy", LOG_FACTOR].iter().position(|name| *name == column);
        if let Some(k) = after {
            return Some(1 + 3 * n + k);
        }
        if column == "t" {
            return Some(0);
        }
        let site: usize = column.trim_end_matches(['\'', ']']).rsplit(['[', '_']).next()?.parse().ok()?;
        let of_site = (site < self.sites).then_some(self.coordinates)?;
        of_site.iter().enumerate().find_map(|(k, name)| {
            let name = self.component(name, site);
            let kinds = [name.clone(), velocity_name(&name), format!("p_{name}")];
            let kind = kinds.iter().position(|known| known == column)?;
            Some(1 + kind * n + site * d + k)
        })
    }

    /// The columns that a scene chooses, with their places in the row of the whole state.
    fn places(
        &self,
        text: &str,
        columns: &Location<Vec<Location<String>>>,
    ) -> Result<Vec<(String, usize)>, SceneError> {
        if columns.is_empty() {
            return Err(SceneError::at(text, columns.span(), output::NO_COLUMNS));
        }
        let of = |column: &Location<String>| {
            let name = column.trim();
            let place = self.place(name).ok_or_else(|| {
                let name_of_first = self.coordinates.first().map_or("x", String::as_str);
                let last = self.component(name_of_first, self.sites.saturating_sub(1));
                let message = format!(
                    "`{name}` is no column; those of a lattice of more than {MOST_OF_FORMULA} coordinates are t, z, energy, {LOG_FACTOR}, and of \
                     each site such names as {last}, {} and p_{last}, without formulas",
                    velocity_name(&last)
                );
                SceneError::at(text, column.span(), message)
            })?;
            Ok((name.to_owned(), place))
        };
        columns.iter().map(of).collect()
    }
}

/// The integrator and its steps.
fn steps(text: &str, run: &Location<RunTable>) -> Result<(AnyIntegrator, Steps), SceneError> {
    if run.integrator.is_some()
        && (run.step.is_some() || run.steps.is_some())
        && let StepControl::Steps { by, steps } = step_control(text, run)?
    {
        return Ok((by, steps));
    }
    let message =
        "the run of a large lattice needs an `integrator` and a `step`, as in integrator = \"strang\" and step = 0.1";
    Err(SceneError::at(text, run.span(), message))
}
