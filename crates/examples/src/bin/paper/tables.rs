//! The tables that the program prints.

use crate::area::Area;
use crate::published::{Fixture, PublishedRow, solved_recurrence};
use crate::series::{Row, distance};
use contact_examples::{Checks, TOLERANCE};
use contact_geom::Statement;
use contact_geom::numbers::max_or_nan;
use std::collections::BTreeSet;
use std::path::Path;

/// One curve of the paper's figures.
struct Curve {
    name: &'static str,
    /// How its points are found again.
    formula: &'static str,
    /// The largest deviation of these from the published data, where the data are at hand.
    published: Option<f64>,
    /// The largest distance of the curve from the true motion.
    truth: f64,
}

/// How well each curve of the paper is reproduced, and how far it is from the truth.
pub fn deviations(free: (&[Row], &[PublishedRow]), oscillator: (&[Row], &[PublishedRow])) -> String {
    let mut curves = free_particle(free.0, free.1);
    curves.extend(harmonic_oscillator(oscillator.0, oscillator.1));
    let mut text = String::from(
        "The curves of the paper's figures, gamma = -0.05, h = 0.5 (dimensionless)\n\
         \x20 vs data:  largest deviation of this program's points from the published data (available for the free \
         particle)\n\
         \x20 vs truth: largest distance of the curve from the true motion; for a solid curve, the error of the method\n\n",
    );
    text += &format!("  {:<30} {:<48} {:>9} {:>9}\n", "curve", "reproduced by", "vs data", "vs truth");
    for Curve { name, formula, published, truth } in curves {
        let published = published.map_or("-".into(), |d| format!("{d:.1e}"));
        text += &format!("  {name:<30} {formula:<48} {published:>9} {truth:>9.1e}\n");
    }
    let apart =
        |rows: &[Row]| distance(rows.iter().map(|r| r.log_energy_midpoint), rows.iter().map(|r| r.log_hamiltonian));
    text += &format!(
        "\n  \
         The captions state ln H o F-L_d, but the data are the logarithm of the midpoint energy. The two differ by up \
         to\n  \
         {:.3} (free particle) and {:.3} (oscillator).\n",
        apart(free.0),
        apart(oscillator.0)
    );
    text
}

/// How much rounding the published positions carry, and the library's flow.
pub fn rounding(by_flow: &[f64]) -> String {
    let (data, solved) = (Fixture::q().discrete, solved_recurrence(by_flow.len()));
    let from_solution = |a: &[f64]| distance(a.iter().copied(), solved.iter().copied());
    format!(
        "\n  \
         The solid points of the free particle's q are those of the paper's explicit formula in double precision. \
         Its\n  \
         coefficients are rounded, so that these points and the published ones differ by {:.1e} from the solution of \
         the\n  \
         discrete equations, q_k = (q_1 - q_0) ((1 + h gamma)^k - 1)/(h gamma). The library's flow in (q, p, z) \
         differs from\n  \
         this solution by {:.1e}.\n",
        from_solution(&data),
        from_solution(by_flow),
    )
}

fn free_particle(rows: &[Row], published: &[PublishedRow]) -> Vec<Curve> {
    let curve = |name, formula, ours: Vec<f64>, data: &[f64], truth: Vec<f64>| Curve {
        name,
        formula,
        published: Some(distance(ours.iter().copied(), data.iter().copied())),
        truth: distance(ours.iter().copied(), truth.iter().copied()),
    };
    let of = |entry: fn(&Row) -> f64| rows.iter().map(entry).collect::<Vec<f64>>();
    let faulty = |entry: fn(&PublishedRow) -> f64| published.iter().map(entry).collect::<Vec<f64>>();
    let (q, z, h) = (Fixture::q(), Fixture::z(), Fixture::log_hamiltonian());
    let (rule, misprint) = ("rectangle rule, explicit q2", "misprinted L_h^e with gamma = +0.05");
    vec![
        curve("free particle q, solid", rule, of(|r| r.q), &q.discrete, of(|r| r.q_exact)),
        curve("free particle z, solid", rule, of(|r| r.z), &z.discrete, of(|r| r.z_exact)),
        curve(
            "free particle ln H, solid",
            "rectangle rule, midpoint energy",
            of(|r| r.log_energy_midpoint),
            &h.discrete,
            of(|r| r.log_hamiltonian_exact),
        ),
        curve("free particle q, dashed", misprint, faulty(|r| r.q), &q.exact, of(|r| r.q_exact)),
        curve("free particle z, dashed", misprint, faulty(|r| r.z), &z.exact, of(|r| r.z_exact)),
        curve(
            "free particle ln H, dashed",
            misprint,
            faulty(|r| r.log_hamiltonian),
            &h.exact,
            of(|r| r.log_hamiltonian_exact),
        ),
    ]
}

fn harmonic_oscillator(rows: &[Row], published: &[PublishedRow]) -> Vec<Curve> {
    let curve = |name, formula, ours: Vec<f64>, truth: fn(&Row) -> f64| Curve {
        name,
        formula,
        published: None,
        truth: distance(ours.into_iter(), rows.iter().map(truth)),
    };
    let of = |entry: fn(&Row) -> f64| rows.iter().map(entry).collect::<Vec<f64>>();
    let dashed = |entry: fn(&PublishedRow) -> f64| published.iter().map(entry).collect::<Vec<f64>>();
    let rule = "midpoint rule, z at the left end, explicit q2";
    vec![
        curve("oscillator q, solid", rule, of(|r| r.q), |r| r.q_exact),
        curve("oscillator z, solid", rule, of(|r| r.z), |r| r.z_exact),
        curve("oscillator ln H, solid", "midpoint rule, midpoint energy", of(|r| r.log_energy_midpoint), |r| {
            r.log_hamiltonian_exact
        }),
        curve("oscillator q, dashed", "true motion", dashed(|r| r.q), |r| r.q_exact),
        curve("oscillator z, dashed", "zdot = v^2/2 - q^2/2 - gamma z (wrong sign)", dashed(|r| r.z), |r| r.z_exact),
        curve("oscillator ln H, dashed", "true motion", dashed(|r| r.log_hamiltonian), |r| r.log_hamiltonian_exact),
    ]
}

/// For each theorem of section 3 the worst residual over the catalogue, and where it was met.
pub fn theorems(checks: &Checks) -> String {
    let mut text = String::from(
        "\nThe theorems of section 3: largest residual over the catalogue, relative to the size of its terms\n\n",
    );
    text += &format!("  {:>2}  {:<42} {:>6} {:>9}  {}\n", "no", "statement", "checks", "residual", "worst at");
    for statement in Statement::ALL.into_iter().filter(|s| s.section().starts_with('3')) {
        if let Some((subject, residual)) = checks.worst_of(statement) {
            let place = format!("{}, {}, h = {}", subject.system, subject.method, subject.step());
            let (number, title, count) = (statement.number(), statement.title(), checks.count(statement));
            text += &format!("  {number:>2}  {title:<42} {count:>6} {residual:>9.1e}  {place}\n");
        }
    }
    text
}

/// What was computed, where the files are, and how exact they are.
pub fn summary(area: &Area, checks: &Checks, out: &Path) -> String {
    let statements: BTreeSet<Statement> = checks.iter().map(|(subject, _)| subject.statement).collect();
    let residual = checks.iter().map(|(_, residual)| residual).fold(0.0, max_or_nan);
    format!(
        "\nSummary: the files are in {}\n\n  \
         area.svg, .csv                    an area in phase space contracts by e^(gamma t), with a relative defect of \
         {:.1e}\n  \
         free_particle_*.svg, .csv         figures of the paper with the true motions; the first table compares \
         both\n  \
         harmonic_oscillator_*.svg, .csv   figures of the damped oscillator with the true motions\n  \
         conformal_factor.svg, .csv        the contact form contracts by the product of the sigma_d, the factors of \
         the steps\n  \
         angular_momentum.svg, .csv        the angular momentum of a Kepler orbit with drag contracts by the same \
         product\n  \
         statements.csv                    {} statements of the paper in {} checks: largest residual {residual:.1e}, \
         allowed {TOLERANCE:e}\n",
        out.display(),
        area.defect(),
        statements.len(),
        checks.iter().count(),
    )
}
