//! Scenes of boundary value problems: paths between given ends.

use super::SceneError;
use super::constraints::with_constraints;
use super::file::{self, File, RunTable};
use super::forces::with_forces;
use super::location::{Location, Span};
use super::only::{refuse_all, set, span};
use super::start::Ends;
use super::step_control::integrator;
use super::sum_of_terms;
use super::system::{check_used, entry, formula};
use crate::runtime::{
    AnyIntegrator, BoundaryProblem, Column, InputError, RuntimeError, System, in_words, velocity_name,
};

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
        Self::of(text, &file::read(text, &[])?)
    }

    /// Reads the tables of a scene.
    pub(super) fn of(text: &str, file: &File) -> Result<Self, SceneError> {
        let File { system: table, start, run, .. } = file;
        let entry = entry(text, table)?;
        let Some(ends) = &file.ends else {
            return Err(SceneError::at(text, table.span(), "the scene has no [ends]"));
        };
        refuse_all(text, not_of_paths(file), |name| {
            format!("`{name}` does not apply to a path between two ends; remove it")
        })?;
        let formula = with_forces(text, formula(text, table, entry, &[])?, file.force.as_ref())?;
        let formula = with_constraints(text, formula, table.constraints.as_ref())?;
        check_used(text, &formula, table, &[])?;
        let source = table.lagrangian.as_ref().or(table.hamiltonian.as_ref());
        let system_at = source.map_or(table.span(), Location::span);
        let system = System::new(&formula).map_err(|error| super::output::of_formula(text, system_at, &error))?;
        let start_at = start.as_ref().map_or(table.span(), Location::span);
        let lattice = sum_of_terms::lattice(table);
        let of_system = (&formula, lattice.as_ref());
        // Before an integrator is refused for what no integrator can do.
        let what = "paths between two positions";
        if formula.is_hamiltonian() {
            return Err(SceneError::at(text, system_at, RuntimeError::OfLagrangians { what }.to_string()));
        }
        if let Some(constraints) = &table.constraints {
            return Err(SceneError::at(text, constraints.span(), RuntimeError::WithConstraints { what }.to_string()));
        }
        let given = Ends::read(text, of_system, (start.as_deref(), start_at), (ends, ends.span()), entry)?;
        let by = match &run.integrator {
            Some(name) => integrator(text, name)?,
            None => AnyIntegrator::Gauss { stages: 4 },
        };
        let integrator_at = RunTable::span_of(&run.integrator, run.span());
        let Some(steps) = &run.steps else {
            let message = "the run of a path has no `steps`, their number; add it, as in steps = 100";
            return Err(SceneError::at(text, run.span(), message));
        };
        if **steps < 2 {
            return Err(SceneError::at(text, steps.span(), format!("`steps` is {}; it must be at least 2", **steps)));
        }
        let [t0, t1] = given.t;
        if t0 == t1 {
            let message = format!("the path starts and ends at t = {t1}; give a later or an earlier `t` for its end");
            return Err(SceneError::at(text, ends.get("t").map_or(ends.span(), Location::span), message));
        }
        system.check_integrator(by).map_err(|error| SceneError::at(text, integrator_at, in_words(&error)))?;
        let problem = BoundaryProblem { z0: given.z0, ..BoundaryProblem::new(given.q, (t0, t1), by, **steps) };
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
            steps_at: steps.span(),
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

/// The keys that paths do not have, with their positions.
fn not_of_paths(file: &File) -> Vec<(Option<Span>, &'static str)> {
    let (run, want) = (&*file.run, &file.want);
    vec![
        (file.friction.0.first().map(|(name, _)| name.span()), "friction"),
        (file.tables.0.first().map(|(name, _)| name.span()), "tables"),
        (file.sweep.0.first().map(|(name, _)| name.span()), "sweep"),
        (file.fit.as_ref().map(|fit| fit.span()), "fit"),
        (span(&run.time), "time"),
        (span(&run.accuracy), "accuracy"),
        (span(&run.step), "step"),
        (span(&run.scales), "scales"),
        (span(&run.breaks), "breaks"),
        (set(&run.project), "project"),
        (set(&run.exact), "exact"),
        (span(&want.rows), "rows"),
        (want.events.first().map(|event| event.when.span()), "events"),
        (want.wrap.first().map(Location::span), "wrap"),
        (set(&want.conformal_factor), "conformal_factor"),
        (set(&want.estimate), "estimate"),
    ]
}
