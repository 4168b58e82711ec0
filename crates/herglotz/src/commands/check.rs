//! `herglotz check`.

use super::scene_arguments::{FormulaOrBody, SceneArguments};
use crate::failure::Failure;
use crate::output::{json, print, print_json, short, table};
use clap::Args;
use herglotz::runtime::{BodyMotion, HamiltonianGeometry, MAX_CONTACT_DEFECT, NotContact, Status};
use herglotz::{BodyScene, Scene};

#[derive(Args)]
pub(crate) struct Check {
    #[command(flatten)]
    scene: SceneArguments,
    /// The number of places along the motion.
    #[arg(long = "places", value_name = "PLACES")]
    #[arg(default_value_t = 12, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    samples: u16,
    /// Also compute the Lyapunov exponents of the motion, and compare the sums of pairs with the rate ln(sigma_d)/h of the
    /// conformal factor.
    #[arg(long)]
    lyapunov: bool,
    /// Also compute the defects of modified Hamiltonians of the first steps, for the step size of the motion, a half and a
    /// quarter of it.
    #[arg(long)]
    modified: bool,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

impl Check {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = match self.scene.read_formula_or_body()? {
            FormulaOrBody::Formula(scene) => scene,
            FormulaOrBody::Body(scene) => return self.check_body(&scene),
        };
        let checked = scene.system.check(&scene.bare_motion(), self.samples.into());
        let check = checked.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let lyapunov =
            self.lyapunov.then(|| scene.system.lyapunov_exponents(&scene.bare_motion(), &mut ())).transpose();
        let lyapunov = lyapunov.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let modified =
            self.modified.then(|| scene.system.modified_defects(&scene.bare_motion(), super::modified::MOST));
        let modified = modified.transpose().map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let is_hamiltonian = scene.system.hamiltonian_structure().is_some();
        let field = is_hamiltonian.then(|| scene.system.hamiltonian_geometry(&scene.bare_motion().start));
        let field = field.transpose().map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let momenta: Vec<String> = scene.momenta();
        if self.json {
            let mut value = of_json(&check, &momenta);
            if let Some(found) = &lyapunov {
                value["lyapunov"] = super::lyapunov::of_json(found);
            }
            if let Some(found) = &modified {
                value["modified"] = super::modified::of_json(found);
            }
            if let Some(field) = &field {
                value["hamiltonian"] = of_field_json(field);
            }
            print_json(&value)?;
        } else {
            let mut parts = vec![in_words(&check, &momenta, "dz - p dq")];
            parts.extend(field.as_ref().map(|field| field_in_words(&scene, field)));
            parts.extend(modified.as_deref().map(super::modified::in_words));
            parts.extend(lyapunov.as_ref().map(super::lyapunov::in_words));
            print(&parts.join("\n\n"))?;
        }
        if let Some(found) = lyapunov.filter(|found| found.status != Status::Completed) {
            return Err(Failure::Run(format!("the motion was not completed: {}", found.status)));
        }
        verdict(&check)
    }

    /// Checks a scene of a rigid body.
    fn check_body(&self, scene: &BodyScene) -> Result<(), Failure> {
        if self.lyapunov || self.modified {
            let why = "--lyapunov and --modified do not apply to a rigid body; check it without them";
            return Err(Failure::Input(why.into()));
        }
        let explain = |error| self.scene.explain(scene.explain(&error));
        let motion = BodyMotion { rows: None, events: Vec::new(), ..scene.motion.clone() };
        let check = scene.body.check(&motion, self.samples.into()).map_err(explain)?;
        let momenta = scene.body.momenta().map_err(explain)?;
        if self.json {
            print_json(&of_json(&check, &momenta))?;
        } else {
            print(&in_words(&check, &momenta, "dz - Pi . (R^-1 dR)"))?;
        }
        verdict(&check)
    }
}

/// A failure where the steps have not the contact defect that they are to have.
fn verdict(check: &herglotz::runtime::Check) -> Result<(), Failure> {
    match check.not_contact {
        _ if check.is_as_expected() => Ok(()),
        Some(_) => Err(Failure::Run("the contact defect of the steps is not the virtual work of the force".into())),
        None => Err(Failure::Run("the steps are not contact".into())),
    }
}

/// The largest component of `L_X eta + H_z eta` for `X = X_H`.
fn conformality_defect(at: &HamiltonianGeometry) -> f64 {
    let differences = at.lie_derivative.iter().zip(&at.eta).map(|(change, eta)| change - at.rate * eta);
    // A NaN is kept.
    differences.fold(0.0, |most, x| if x.abs() <= most { most } else { x.abs() })
}

fn of_field_json(at: &HamiltonianGeometry) -> serde_json::Value {
    let all = |x: &[f64]| x.iter().map(|x| json(*x)).collect::<Vec<_>>();
    serde_json::json!({
        "H": json(at.hamiltonian),
        "X_H": all(&at.field),
        "L_X eta": all(&at.lie_derivative),
        "rate": json(at.rate),
        "conformality_defect": json(conformality_defect(at)),
        "brackets": all(&at.brackets),
        "condition of H_pp": json(at.condition),
    })
}

/// The contact Hamiltonian vector field at the start.
fn field_in_words(scene: &Scene, at: &HamiltonianGeometry) -> String {
    let formula = scene.system.formula();
    let names = formula.coordinates().into_iter().chain(formula.momenta()).chain([formula.action().to_owned()]);
    let mut rows = vec![["", "X_H", "L_X eta", "{H, .}"].map(str::to_owned).to_vec()];
    let numbers = at.field.iter().zip(&at.lie_derivative).zip(&at.brackets);
    for (name, ((field, change), bracket)) in names.zip(numbers) {
        rows.push(vec![name, short(*field), short(*change), short(*bracket)]);
    }
    format!(
        "H = {} at the start; L_X eta = {} eta for X = X_H, to {:.1e}; a Jacobi bracket {{H, f}} that vanishes at all \
         points belongs to a dissipated quantity f\n{}",
        short(at.hamiltonian),
        short(at.rate),
        conformality_defect(at),
        table(&rows)
    )
}

fn of_json(check: &herglotz::runtime::Check, momenta: &[String]) -> serde_json::Value {
    let sample = |sample: &herglotz::runtime::Sample| {
        let of = |(name, m): (&String, &herglotz::runtime::MomentumSample)| serde_json::json!({ "momentum": name, "value": json(m.momentum), "predicted": json(m.predicted) });
        serde_json::json!({
            "t": json(sample.t),
            "sigma_d": json(sample.sigma),
            "log_factor": json(sample.log_factor),
            "contact_defect": json(sample.contact_defect),
            "herglotz_defect": json(sample.herglotz_defect),
            "momenta": momenta.iter().zip(&sample.momenta).map(of).collect::<Vec<_>>(),
        })
    };
    let stated = |stated: &herglotz::runtime::StatementResidual| {
        let statement = stated.statement;
        let (number, title) = (statement.number(), statement.title());
        serde_json::json!({
            "number": number, "title": title, "method": stated.method,
            "step_size": stated.step_size, "residual": json(stated.residual),
        })
    };
    serde_json::json!({
        "integrator": check.integrator,
        "step_size": check.step_size,
        "contact": check.is_contact(),
        "why_not": check.not_contact.map(|why| why.to_string()),
        "contact_defect": json(check.contact_defect()),
        "momentum_defect": json(check.momentum_defect()),
        "places": check.samples.iter().map(sample).collect::<Vec<_>>(),
        "statements": check.statements.iter().map(stated).collect::<Vec<_>>(),
    })
}

/// The check in words; eta is the contact form.
fn in_words(check: &herglotz::runtime::Check, momenta: &[String], eta: &str) -> String {
    let size = |x: f64| format!("{x:.1e}");
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    let mut header = words(&["t", "sigma_d", "log_factor", "contact", "Herglotz"]);
    header.extend(momenta.iter().flat_map(|name| [name.clone(), "predicted".to_owned()]));
    let mut samples = vec![header];
    for sample in &check.samples {
        let mut row = vec![short(sample.t), short(sample.sigma), short(sample.log_factor)];
        row.extend([size(sample.contact_defect), size(sample.herglotz_defect)]);
        row.extend(sample.momenta.iter().flat_map(|m| [short(m.momentum), short(m.predicted)]));
        samples.push(row);
    }
    let mut statements = vec![words(&["statement", "by", "residual"])];
    for stated in &check.statements {
        statements.push(vec![stated.statement.to_string(), stated.method.clone(), size(stated.residual)]);
    }
    let verdict = match (check.is_contact(), check.loses_the_form()) {
        (true, _) => "contact",
        (false, true) => "not contact, since sigma_d is 0 or not finite at a step",
        (false, false) => "not contact",
    };
    let (defect, herglotz::runtime::Check { integrator, step_size, .. }) = (check.contact_defect(), check);
    let verdict = check.not_contact.map_or(verdict.to_owned(), |why| why.to_string());
    let allowed = match check.not_contact {
        None => format!(", of which {MAX_CONTACT_DEFECT:.0e} is allowed"),
        Some(_) => String::new(),
    };
    let mut parts = vec![
        format!(
            "{verdict}: the pullback of {eta} by a step of {} with {integrator} is sigma_d ({eta}) with a defect of {defect:.1e}{allowed}",
            short(*step_size)
        ),
        table(&samples),
    ];
    if !momenta.is_empty() {
        parts
            .push(format!("the momenta agree with their predictions to {:.1e} of their size", check.momentum_defect()));
    }
    if !check.statements.is_empty() {
        let step = check.statements.first().map_or(*step_size, |stated| stated.step_size);
        let theory = match check.not_contact {
            Some(NotContact::Forced) => {
                "the statement on steps with a force; those on discrete Lagrangians do not apply"
            }
            _ => "the theorems of the discrete theory",
        };
        let formula = format!("largest residuals of {theory}, at a few places of the motion, for h = {}:", short(step));
        parts.push(format!("{formula}\n{}", table(&statements)));
    }

    parts.join("\n\n")
}
