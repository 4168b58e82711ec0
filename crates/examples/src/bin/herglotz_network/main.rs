//! A Herglotz network: a Lagrangian `L(q, v, z)` with a small dense network in it is fitted to motions of a damped double
//! pendulum.
//!
//! ```text
//! cargo run --release --bin herglotz_network [-- --out DIR]
//! ```
//!
//! The network is a formula whose weights are parameters, so that its motions are contact whatever the weights, and have
//! exact derivatives in them. The angles of a few short motions are fitted by the method of Levenberg and Marquardt. Prints
//! the loss, the error of a longer motion from another start, the defects of that motion from a contact transformation, and
//! the drag `L_z` that was learnt. Writes that motion (`herglotz_network.csv`, `herglotz_network.svg`) and the weights
//! (`herglotz_network_weights.csv`) into `--out`.

mod learnt;
mod network;
mod training;

use clap::Parser;
use contact_examples::{Directory, Failure, finish, number, print};
use contact_geom::Parametric;
use contact_geom::numbers::max_or_nan;
use learnt::Learnt;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use training::{Stage, TRUTH, Training};

/// Fits a network in a Lagrangian to motions of a damped double pendulum.
#[derive(Parser)]
struct Arguments {
    /// The directory for tables and figure; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/herglotz_network")]
    out: PathBuf,
}

/// Two fits, of the beginnings of the motions and of the whole, which starts from the weights of the first: the end of a motion
/// depends on the weights much more strongly than its beginning.
const STAGES: [Stage; 2] =
    [Stage { motions: 16, times: 5, evaluations: 20 }, Stage { motions: 16, times: 15, evaluations: 70 }];

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Directory::create(&arguments.out)?;
    let untrained = network::lagrangian()?;
    let (mut trained, mut fits) = (untrained.clone(), String::new());
    for stage in STAGES {
        let training = Training::new(trained, stage)?;
        let (loss, gradient) = training.loss()?;
        let difference = largest_difference(&gradient, &training.gradient_by_tangents()?);
        let begin = Instant::now();
        let fit = training.fit()?;
        fits += &format!(
            "{} angles of {} motions up to t = {}: half the sum of squares from {loss:.2e} to {:.2e} in {} iterations, \
             {:.1} s\n  gradient at the start by the adjoint: within {difference:.1e} of that by tangents, relative to its size\n",
            fit.values.len(),
            stage.motions,
            training.duration(),
            fit.cost,
            fit.iterations,
            begin.elapsed().as_secs_f64()
        );
        trained = training.network_with(&fit.parameters)?;
    }
    let (before, after) = (Learnt::new(&untrained)?, Learnt::new(&trained)?);

    after.write(&out, &before)?;
    let weights = trained.parameter_names().into_iter().zip(trained.parameters());
    out.table("herglotz_network_weights.csv", &["weight", "value"], weights.map(|(name, x)| [name, number(x)]))?;
    let contact = after.contact;
    print(&format!(
        "a Lagrangian with {} weights\n{fits}\
         a motion from another start: largest error of an angle {:.1e} up to t = 10, {:.1e} up to t = {}; untrained {:.1e}\n\
         its map from start to end: ln sigma = {:.6}, |det/sigma^3 - 1| = {:.1e}, |Phi^* eta - sigma eta| = {:.1e}, \
         largest entry of its tangent {:.1}\n\
         drag L_z along it: {:.6} on average, within {:.1e} of the true {}\n\
         smallest eigenvalue of the mass matrix along it: {:.3}\n\
         tables and figure are in {}\n",
        trained.parameter_count(),
        after.error_until(10.0),
        after.error_until(after.end()),
        after.end(),
        before.error_until(after.end()),
        contact.log_factor,
        contact.determinant,
        contact.pullback,
        contact.size,
        after.rate(),
        after.rate_error(),
        TRUTH.gamma,
        after.smallest_mass,
        out.path().display()
    ))
}

/// The largest difference of two vectors, relative to the largest entry.
fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().map(|b| b.abs()).fold(0.0, max_or_nan);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, max_or_nan) / size
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::VelocityPoint;
    use discrete_herglotz::sensitivity::EndState;
    use training::smallest_mass;

    const SHORT: Stage = STAGES[0];

    /// The adjoint and the tangents have the same gradient, and a few iterations find most of the motion.
    #[test]
    fn a_short_training() {
        let untrained = network::lagrangian().unwrap();
        let training = Training::new(untrained.clone(), SHORT).unwrap();
        let (loss, gradient) = training.loss().unwrap();
        // Round-off of some 1e3 terms of either sum.
        assert!(largest_difference(&gradient, &training.gradient_by_tangents().unwrap()) < 1e-12);
        let fit = training.fit().unwrap();
        // The residuals fall to a hundredth: the fit is not stuck where the pendulum turns freely, as the network does at the start.
        assert!(fit.cost < 1e-4 * loss, "from {loss:e} to {:e}", fit.cost);
        for network in [untrained, training.network_with(&fit.parameters).unwrap()] {
            let learnt = Learnt::new(&network).unwrap();
            // Contact whatever the weights: round-off of 100 steps, amplified by the tangent; the determinant is one of five
            // rows.
            let contact = learnt.contact;
            assert!(contact.pullback < 1e-13 * contact.size, "{contact:?}");
            assert!(contact.determinant < 1e-13 * contact.size.powi(2), "{contact:?}");
        }
    }

    /// The mass matrix is positive definite for weights of size one. With weights of size ten its entries differ by more than
    /// round-off, and the fit refuses them.
    #[test]
    fn the_mass_is_positive() {
        let untrained = network::lagrangian().unwrap();
        for size in [0.0, 1.0] {
            let theta: Vec<f64> = network::spread().take(untrained.parameter_count()).map(|x| size * x).collect();
            let network = untrained.with_parameters(&theta).unwrap();
            for q in network::spread().take(40).map(|x| 3.0 * x) {
                let VelocityPoint { q, v, z } = VelocityPoint::new([q, 2.0 * q], [1.0, -1.0], 0.3);
                let state = EndState { t: 0.0, q, v, p: v, z };
                assert!(smallest_mass(&network, &state).is_some(), "weights up to {size}, at {q}");
            }
        }
    }
}
