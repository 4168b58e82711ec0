//! A tour of the geometry: contact forms and Reeb fields on the three spaces, and a test of whether a map is a contact
//! map.
//!
//! ```text
//! cargo run --release --bin contact_geom_tour
//! ```
//!
//! Prints, for one system, the components, the Reeb field and the volume of four contact forms at corresponding points.
//! For a step of the damped pendulum by several methods and four step sizes, it prints the conformal factor and the
//! defect of the pullback. It writes no files.

use clap::Parser;
use contact_examples::systems::{CoupledInZ, Pendulum, System};
use contact_examples::{Failure, finish, print};
use contact_geom::{
    ChartVector, ContactForm, Darboux, DiscretePoint, EtaMinus, EtaPlus, GeometryError, LagrangianForm, PhasePoint,
    Scalar, Smooth, SmoothFunction, conformality, hamiltonian::DarbouxField, legendre,
    support::conformality_with_jacobian,
};
use discrete_herglotz::{
    DiscreteLagrangian,
    rules::{Flow, Rule},
    theory::{hamiltonian_flow_jacobian, legendre_minus_inverse},
};
use std::process::ExitCode;

/// Contact forms, Reeb fields and a pullback test, printed. It takes no options.
#[derive(Parser)]
struct Arguments;

fn main() -> ExitCode {
    let Arguments = Arguments::parse();
    finish(forms_and_reeb_fields().and_then(|()| which_maps_are_contact()))
}

/// One line for a form: its components, its Reeb field, and its volume.
fn describe(name: &str, form: &impl ContactForm<1>, x: &ChartVector<1>) -> Result<String, GeometryError> {
    let row = |c: ChartVector<1>| format!("({:8.5}, {:8.5}, {:8.5})", c.x[0], c.y[0], c.z);
    let (eta, reeb, volume) = (form.eta(x)?, form.reeb(x)?, form.volume(x)?);
    Ok(format!("  {name:<22} {}   {}   {volume:8.5}\n", row(eta), row(reeb)))
}

/// The contact forms of one system at corresponding points of T\*Q x R, TQ x R and Q x Q x R.
///
/// `L_v` of the system depends on z, so the Reeb field of eta_L has a component along v; it is `d/dz` only in Darboux
/// coordinates.
fn forms_and_reeb_fields() -> Result<(), Failure> {
    let (system, t, h) = (CoupledInZ::default(), 0.0, 0.1);
    let velocity = system.initial();
    let phase = legendre(&system, t, &velocity);
    // The step of the discrete Lagrangian whose initial momentum is that of `phase`.
    let ld = Rule::MIDPOINT.of::<1, _>(system, h)?;
    let points: DiscretePoint<1> = legendre_minus_inverse(&ld, t, &phase, &velocity.v)?;
    let jets = |x: &DiscretePoint<1>| Ok(ld.second_jet(t, x)?);

    let mut text = String::from("Contact forms of L = (1 + a cos q cos z) v^2/2 + b v^4/4 - (1 - cos q) + gamma z\n\n");
    text += &format!("  {:<22} {:<30}   {:<30}   {:>8}\n", "form", "eta", "Reeb field", "volume");
    text += &describe("dz - p dq on T*Q x R", &Darboux, &phase.into())?;
    text += &describe("eta_L on TQ x R", &LagrangianForm { lagrangian: &system, t }, &velocity.into())?;
    text += &describe("eta- on Q x Q x R", &EtaMinus(jets), &points.into())?;
    text += &describe("eta+ on Q x Q x R", &EtaPlus(jets), &points.into())?;
    let sigma = ld.jet(t, &points)?.sigma();
    text += &format!("\n  The last two rows satisfy eta+ = sigma_d eta- with sigma_d = {sigma:.5}.\n");
    print(&text)
}

/// The Hamiltonian of the pendulum as a function on T\*Q x R.
struct Hamiltonian(Pendulum);

impl SmoothFunction<1> for Hamiltonian {
    fn value<T: Scalar>(&self, _t: T, x: &ChartVector<1, T>) -> T {
        x.y[0] * x.y[0] * 0.5 - x.x[0].cos() + 1.0 - x.z * self.0.gamma
    }
}

/// One step of the classical Runge-Kutta method for X_H, which is accurate but not a contact map.
struct RungeKutta<F> {
    field: F,
    h: f64,
}

impl<F: Smooth<1>> Smooth<1> for RungeKutta<F> {
    fn at<T: Scalar>(&self, x: &ChartVector<1, T>) -> Result<ChartVector<1, T>, GeometryError> {
        let h = T::from(self.h);
        let k1 = self.field.at(x)?;
        let k2 = self.field.at(&x.plus(k1.scale(h * 0.5)))?;
        let k3 = self.field.at(&x.plus(k2.scale(h * 0.5)))?;
        let k4 = self.field.at(&x.plus(k3.scale(h)))?;
        Ok(x.plus(k1.plus(k2.plus(k3).scale(T::from(2.0))).plus(k4).scale(h / 6.0)))
    }
}

/// One step of Strang's splitting of the pendulum: the flows of `-gamma z`, of the potential and of `p^2/2`, each an
/// exact contact map.
struct Strang {
    gamma: f64,
    h: f64,
}

impl Smooth<1> for Strang {
    fn at<T: Scalar>(&self, x: &ChartVector<1, T>) -> Result<ChartVector<1, T>, GeometryError> {
        let damping = (self.gamma * self.h * 0.5).exp();
        let half = 0.5 * self.h;
        let (mut q, mut p, mut z) = (x.x[0], x.y[0] * damping, x.z * damping);
        z += (q.cos() - 1.0) * half;
        p -= q.sin() * half;
        q += p * self.h;
        z += p * p * half;
        z += (q.cos() - 1.0) * half;
        p -= q.sin() * half;
        Ok(ChartVector { x: [q].into(), y: [p * damping].into(), z: z * damping })
    }
}

/// The conformal factor and the defect `|F* eta - sigma eta|` of one step, for methods that are contact maps and for
/// one that is not.
fn which_maps_are_contact() -> Result<(), Failure> {
    let system = Pendulum { gamma: -0.1 };
    let hamiltonian = Hamiltonian(system);
    let start: PhasePoint<1> = legendre(&system, 0.0, &system.initial());
    let mut text = String::from(
        "\nConformal factor of a step F of the damped pendulum, and the relative defect of F* eta = sigma eta\n\n",
    );
    text += &format!(
        "  {:>6} {:>12}   {:>12} {:>9}   {:>12} {:>9}   {:>12} {:>9}   {:>12} {:>9}\n",
        "", "exact flow", "Strang", "", "midpoint", "", "left midpoint", "", "Runge-Kutta 4", ""
    );
    text += &format!("  {:>6} {:>12}", "h", "e^(gamma h)");
    text += &format!("   {:>12} {:>9}", "sigma", "defect").repeat(4);
    text += "\n";
    for h in [0.8, 0.4, 0.2, 0.1] {
        // Generic functions, differentiated automatically.
        let strang = conformality(&Darboux, &Darboux, &Strang { gamma: system.gamma, h }, &start.into())?;
        let field = DarbouxField { hamiltonian: &hamiltonian, t: 0.0 };
        let runge_kutta = conformality(&Darboux, &Darboux, &RungeKutta { field, h }, &start.into())?;
        // Steps that solve an equation: by the Jacobian at the point.
        let midpoint = step(&Rule::MIDPOINT.of::<1, _>(system, h)?, &start)?;
        let left = step(&Rule::LEFT_MIDPOINT.of::<1, _>(system, h)?, &start)?;
        text += &format!("  {h:>6} {:>12.9}", (system.gamma * h).exp());
        for map in [(strang.sigma, strang.defect), midpoint, left, (runge_kutta.sigma, runge_kutta.defect)] {
            text += &format!("   {:>12.9} {:>9.1e}", map.0, map.1);
        }
        text += "\n";
    }
    text += "\n  The defect of a contact map is round-off at every h; that of Runge-Kutta 4 is its local error, of order h^5.\n";
    print(&text)
}

/// The conformal factor and the defect of one step of a discrete Hamiltonian flow.
fn step(ld: &impl DiscreteLagrangian<1>, start: &PhasePoint<1>) -> Result<(f64, f64), Failure> {
    let step = Flow::new(ld, 0.0, *start)?.step()?;
    let x = DiscretePoint { q0: step.from.q, q1: step.to.q, z0: step.from.z };
    let jacobian = hamiltonian_flow_jacobian(ld, 0.0, &x)?;
    let map = conformality_with_jacobian(&Darboux, &Darboux, &step.from.into(), &step.to.into(), &jacobian)?;
    Ok((map.sigma, map.defect))
}
