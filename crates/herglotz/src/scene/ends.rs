//! Scenes of boundary value problems: paths between given ends.

use super::SceneError;
use super::checked::check_version;
use super::constraints::with_constraints;
use super::file::{SystemTable, span_of_table};
use super::forces::with_forces;
use super::location::{Location, Named, Numbers, Span};
use super::start::Ends;
use super::step_control::integrator;
use super::system::{check_used, entry, formula};
use crate::runtime::{
    AnyIntegrator, BoundaryProblem, Column, InputError, RuntimeError, System, in_words, velocity_name,
};
use schemars::JsonSchema;
use serde::Deserialize;

/// A path between two positions over a time span that is critical for the discrete action of Herglotz' principle, or
/// satisfies its equations with forces.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a scene of a path between ends")]
#[schemars(title = "Scene of a path between ends")]
pub(crate) struct EndsFile {
    /// The version of the format: 1.
    #[expect(dead_code, reason = "it is looked at before all else is read")]
    pub version: Option<Location<i64>>,
    /// The Lagrangian: a formula in one to eight coordinates, or a system of the catalogue.
    pub system: Location<SystemTable>,
    /// The start of the path: a number for each coordinate `x`, and for the action `z` and the time `t`, which default
    /// to 0. An array of coordinates has a list, or one number for all its entries. A system of the catalogue has a
    /// default start.
    #[serde(default)]
    pub start: Option<Location<Named<Numbers>>>,
    /// The end of the path: a number for each coordinate `x`, and the time `t`.
    pub ends: Location<Named<Numbers>>,
    /// Forces beside those of the Lagrangian: for a coordinate `x` the force f in `d/dt L_v - L_q - L_z L_v = f(t, q,
    /// v, z)` as a formula, as in `x = "-c*x'*abs(x')"`; `"u[2]"` is an entry of an array, and `"u[i]"` are all of its
    /// entries. `rayleigh` is Rayleigh's dissipation function R, whose force is `-dR/dv`. With a force the path is a
    /// motion of a quadrature rule such as `midpoint`, and is critical for no action.
    #[serde(default)]
    pub force: Option<Location<Named<String>>>,
    /// The discretization of the path.
    pub run: Location<EndsRun>,
}

/// The discretization of a path.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `steps` and `integrator`")]
pub(crate) struct EndsRun {
    /// The number of steps, all of the same length.
    pub steps: Location<usize>,
    /// The integrator whose discrete Lagrangian is used: a Gauss method, or a quadrature rule such as `midpoint`. The
    /// default is `gauss_4`; with forces a rule is required.
    pub integrator: Option<Location<String>>,
}

/// A scene of a boundary value problem that has been read and validated.
pub struct EndsScene {
    /// The system.
    pub system: System,
    /// The boundary value problem.
    pub problem: BoundaryProblem,
    /// The columns of the points of the path with their names: the time, coordinates, velocities, momenta and the
    /// action.
    pub columns: Vec<(String, Column)>,
    text: String,
    system_at: Span,
    ends_at: Span,
    integrator_at: Span,
    steps_at: Span,
}

impl EndsScene {
    /// Whether a text is a scene with `[ends]`.
    pub fn is_one(text: &str) -> bool {
        span_of_table(text, "ends").is_some()
    }

    /// Reads a scene file with `[ends]`.
    ///
    /// ```
    /// let scene = herglotz::EndsScene::read(r#"
    ///     [system]
    ///     coordinates = ["x"]
    ///     lagrangian = "x'^2/2 - x^2/2 + gamma*z"
    ///     parameters = { gamma = -0.2 }
    ///     [start]
    ///     x = 0.0
    ///     [ends]
    ///     x = 1.0
    ///     t = 2.0
    ///     [run]
    ///     steps = 40
    /// "#)?;
    /// assert!(scene.system.path(&scene.problem)?.is_found());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text.
    pub fn read(text: &str) -> Result<Self, SceneError> {
        check_version(text)?;
        let file: EndsFile = toml::from_str(text).map_err(|error| SceneError::of_format(text, &error))?;
        let EndsFile { system: table, start, ends, run, .. } = &file;
        let entry = entry(text, table)?;
        let formula = with_forces(text, formula(text, table, entry, &[])?, file.force.as_ref())?;
        let formula = with_constraints(text, formula, table.constraints.as_ref())?;
        check_used(text, &formula, table, &[])?;
        let system_at = table.lagrangian.as_ref().map_or(table.span(), Location::span);
        let system = System::new(&formula).map_err(|error| super::output::of_formula(text, system_at, &error))?;
        let start_at = start.as_ref().map_or(table.span(), Location::span);
        let given = Ends::read(text, &formula, (start.as_deref(), start_at), (ends, ends.span()), entry)?;
        let by = match &run.integrator {
            Some(name) => integrator(text, name)?,
            None => AnyIntegrator::Gauss { stages: 4 },
        };
        let integrator_at = run.integrator.as_ref().map_or(run.span(), Location::span);
        if *run.steps < 2 {
            let message = format!("`steps` is {}; it must be at least 2", *run.steps);
            return Err(SceneError::at(text, run.steps.span(), message));
        }
        let [t0, t1] = given.t;
        if t0 == t1 {
            let message = format!("the path starts and ends at t = {t1}; give a later or an earlier `t` for its end");
            return Err(SceneError::at(text, ends.get("t").map_or(ends.span(), Location::span), message));
        }
        system.check_integrator(by).map_err(|error| SceneError::at(text, integrator_at, in_words(&error)))?;
        let problem = BoundaryProblem { z0: given.z0, ..BoundaryProblem::new(given.q, (t0, t1), by, *run.steps) };
        let names = formula.coordinates();
        let of_kind = |name: fn(&str) -> String, column: fn(usize) -> Column| {
            names.iter().enumerate().map(move |(i, x)| (name(x), column(i))).collect::<Vec<_>>()
        };
        let columns = [
            vec![("t".to_owned(), Column::Time)],
            of_kind(str::to_owned, Column::Position),
            of_kind(velocity_name, Column::Velocity),
            of_kind(|x| format!("p_{x}"), Column::Momentum),
            vec![("z".to_owned(), Column::Action)],
        ];
        Ok(EndsScene {
            columns: columns.concat(),
            system,
            problem,
            text: text.to_owned(),
            system_at,
            ends_at: ends.span(),
            integrator_at,
            steps_at: run.steps.span(),
        })
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        use InputError as E;
        let span = match error {
            RuntimeError::Argument { argument: "integrator", .. } => self.integrator_at,
            RuntimeError::Argument { argument: "coordinates", .. }
            | RuntimeError::Formula(_)
            | RuntimeError::WithConstraints { .. } => self.system_at,
            RuntimeError::Input(E::Step { .. } | E::Count { .. } | E::TooMany { .. }) => self.steps_at,
            RuntimeError::Input(
                E::Unclaimed { .. }
                | E::Hypothesis { .. }
                | E::NoTimeTransformation
                | E::Forced { .. }
                | E::Stages { .. },
            ) => self.integrator_at,
            _ => self.ends_at,
        };
        SceneError::at(&self.text, span, error.to_string())
    }
}
