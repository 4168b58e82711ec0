//! Growth of round-off: the error of a quantity that the motion conserves, over an ensemble of initial values that
//! differ in their last digits.
//!
//! Independent rounding errors make it grow as the square root of the number of steps (Brouwer, 1937). A systematic
//! error, however small, makes it grow linearly, which shows as an exponent of 1 and as a nonzero mean over the
//! ensemble.

use crate::formula::{Formula, Rate};
use crate::motion::Problem;
use crate::parallel::parallel;
use crate::random::Random;
use crate::statistics::{mean, rms, slope};
use contact_examples::Report;
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw_row, number};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    PhasePoint, Structure, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    AnyIntegrator, InputError, SplittingScheme, Stepper, Steps, gauss::TransformedStepper, rules::Method,
};

/// The number of members of an ensemble.
const MEMBERS: usize = 64;

/// The largest exponent that counts as that of a random walk.
const EXPONENT: f64 = 0.6;

/// The largest accepted mean of an ensemble, in units of its standard error.
const SIGMAS: f64 = 3.0;

/// The weak drag.
const WEAK_DRAG: f64 = -1e-12;

/// The drag of mean zero. It is small, so that the energy varies little where it is not an invariant.
const DRAG_OF_MEAN_ZERO: Rate = Rate::Swinging { size: 1e-6, frequency: 0.5 };

#[derive(Clone, Copy, PartialEq)]
enum Motion {
    Oscillator,
    Pendulum,
    Kepler,
}

#[derive(Clone, Copy, PartialEq)]
enum Drag {
    None,
    Weak,
    Swinging,
}

/// A method, with the structure that is claimed for the Lagrangian.
#[derive(Clone, Copy)]
enum Way {
    By(AnyIntegrator),
    /// Gauss collocation by its general route: no structure is claimed.
    General(usize),
    /// A splitting without the claim that the drag is linear.
    ActionDriven(SplittingScheme),
    /// Gauss collocation with a time transformation for Kepler's problem.
    TransformedGauss(usize),
}

impl Way {
    fn name(self) -> String {
        match self {
            Way::By(integrator) => integrator.to_string(),
            Way::General(stages) => format!("gauss_{stages}_general"),
            Way::ActionDriven(scheme) => format!("{}_action", scheme.name()),
            Way::TransformedGauss(stages) => format!("transformed_gauss_{stages}"),
        }
    }

    fn order(self) -> u32 {
        match self {
            Way::By(integrator) => integrator.order(),
            Way::General(stages) | Way::TransformedGauss(stages) => 2 * stages as u32,
            Way::ActionDriven(scheme) => scheme.order(),
        }
    }
}

/// One ensemble.
struct Ensemble {
    motion: Motion,
    drag: Drag,
    way: Way,
    h: f64,
    /// The exponent of two of the number of steps of a full run.
    power: u32,
    /// Whether a bias can be measured: the truncation error is below round-off or does not enter, so that the mean has
    /// to vanish.
    has_bias: bool,
}

/// The measured growth of the error in an ensemble.
struct Growth {
    /// Number of steps, rms error and mean error.
    points: Vec<(f64, f64, f64)>,
    exponent: f64,
    exponent_error: f64,
    /// The mean at the end, in standard errors.
    sigmas: Option<f64>,
    /// The mean error per step.
    bias: f64,
}

/// The ensembles: every family of integrators on every motion and drag that it accepts. The truncation error of the
/// step is below round-off, or bounded by 1e-6 for integrators of order 2.
fn ensembles() -> Vec<Ensemble> {
    use Motion::{Kepler, Oscillator, Pendulum};
    let gauss = |stages| Way::By(AnyIntegrator::Gauss { stages });
    let splitting = |scheme| Way::By(AnyIntegrator::Splitting(scheme));
    let (midpoint, strang) = (Way::By(AnyIntegrator::Discrete(Method::Midpoint)), splitting(SplittingScheme::STRANG));
    let (nystrom, eighth) = (splitting(SplittingScheme::BLANES_MOAN_6), splitting(SplittingScheme::KAHAN_LI_8));
    let composed = Way::By(AnyIntegrator::Composition(Method::Midpoint, SplittingScheme::KAHAN_LI_8));
    let action = Way::ActionDriven(SplittingScheme::KAHAN_LI_8);
    let fine = 1.0 / 1024.0;
    // The method, the exponent of two of its number of steps, and its step sizes on the oscillator, the pendulum and
    // Kepler's orbit; 0 where it is not used.
    let table = [
        (midpoint, 16, [0.125, fine, fine]),
        (strang, 18, [0.125, fine, fine]),
        (nystrom, 18, [0.125, 1.0 / 512.0, fine]),
        (eighth, 17, [0.125, 1.0 / 64.0, 1.0 / 256.0]),
        (action, 16, [0.0, 1.0 / 64.0, 1.0 / 256.0]),
        (composed, 14, [0.125, 1.0 / 64.0, 1.0 / 256.0]),
        (gauss(4), 16, [0.25, 1.0 / 16.0, 1.0 / 32.0]),
        (gauss(8), 16, [0.5, 0.5, 0.125]),
        (gauss(16), 16, [1.0, 1.0, 0.25]),
        (Way::General(8), 15, [0.5, 0.5, 0.125]),
        (Way::TransformedGauss(8), 15, [0.0, 0.0, 0.25]),
    ];
    let mut all = Vec::new();
    for (way, power, steps) in table {
        for (motion, h) in [Oscillator, Pendulum, Kepler].into_iter().zip(steps).filter(|(_, h)| *h > 0.0) {
            for drag in [Drag::None, Drag::Weak, Drag::Swinging] {
                // The time transformation requires an autonomous motion, and a drag f(z) a steady f. Where there is no
                // invariant, only the scatter is measured, and only for methods whose own error does not oscillate.
                let second = way.order() == 2 && motion != Oscillator;
                let invariant = motion != Pendulum || drag != Drag::Swinging;
                let steady = matches!(way, Way::TransformedGauss(_) | Way::ActionDriven(_));
                if (steady && drag == Drag::Swinging) || (second && !invariant) {
                    continue;
                }
                let has_bias = invariant && (!second || (motion == Kepler && drag == Drag::Swinging));
                all.push(Ensemble { motion, drag, way, h, power, has_bias });
            }
        }
    }
    all
}

impl Ensemble {
    fn rate(&self) -> Rate {
        match self.drag {
            Drag::None => Rate::Constant(0.0),
            Drag::Weak => Rate::Constant(WEAK_DRAG),
            Drag::Swinging => DRAG_OF_MEAN_ZERO,
        }
    }

    fn names(&self) -> [String; 3] {
        let motion = match self.motion {
            Motion::Oscillator => "oscillator",
            Motion::Pendulum => "pendulum",
            Motion::Kepler => "kepler",
        };
        let drag = match self.drag {
            Drag::None => "0",
            Drag::Weak => "-1e-12",
            Drag::Swinging => "mean zero",
        };
        [motion.into(), drag.into(), self.way.name()]
    }

    /// The logarithm of the factor by which the method contracts momenta until a time, to full precision.
    fn contraction(&self, t: f64) -> f64 {
        match self.rate() {
            Rate::Constant(rate) => rate * t,
            // A discrete Lagrangian takes the rate in the middle of each of its substeps, which gives a sum in place of
            // the integral.
            Rate::Swinging { size, frequency } => {
                let half = 0.5 * frequency * self.h;
                let sum = match self.way {
                    Way::By(AnyIntegrator::Discrete(_)) => half / half.sin(),
                    Way::By(AnyIntegrator::Composition(_, scheme)) => half / half.sin() * middles(&scheme, 2.0 * half),
                    _ => 1.0,
                };
                size / frequency * sum * (frequency * t).sin()
            }
            _ => f64::NAN,
        }
    }

    /// The relative distance of the initial values. The rounding of a sum is decided by the digits of the term below
    /// the last digit of the sum, and these must differ between the members; the oscillation of the truncation error
    /// must not.
    fn apart(&self) -> f64 {
        if self.has_bias { 1e-9 } else { 1e-12 }
    }

    /// The relative errors of the invariant after the sampled numbers of steps, one row for each member.
    fn errors(&self, first: usize, starts: usize, samples: &[usize]) -> Result<Vec<Vec<f64>>, InputError> {
        match self.motion {
            Motion::Kepler => {
                let system = Formula::<2> { rate: self.rate(), ..Formula::kepler(0.0) };
                // The pericentre of an orbit with e = 0.3.
                let orbit = VelocityPoint::new([0.7, 0.0], [0.0, (1.3f64 / 0.7).sqrt()], 0.0);
                let swinging = self.drag == Drag::Swinging;
                let momentum = |x: &PhasePoint<2>| x.q[0] * x.p[1] - x.q[1] * x.p[0];
                let energy = |x: &PhasePoint<2>| 0.5 * x.p.dot(&x.p) - 1.0 / x.q.norm();
                self.runs(system, orbit, first, starts, samples, |t, x, rate| {
                    (if swinging { momentum(x) } else { energy(x) - rate * x.z }) * (-self.contraction(t)).exp()
                })
            }
            Motion::Pendulum => {
                let system = Formula::<1> { rate: self.rate(), ..Formula::pendulum(0.0) };
                self.runs(system, VelocityPoint::new([1.0], [1.0], 0.0), first, starts, samples, |t, x, rate| {
                    let half = (0.5 * x.q[0]).sin();
                    let energy = 0.5 * x.p[0] * x.p[0] + 2.0 * half * half;
                    (energy - rate * x.z) * (-self.contraction(t)).exp()
                })
            }
            // Two solutions span an area, which a step contracts exactly by its conformal factor, whatever its order.
            Motion::Oscillator => {
                let system = Formula::<1> { rate: self.rate(), ..Formula::oscillator(0.0) };
                let sides = [([1.0], [0.25]), ([-0.25], [1.0])].map(|(q, p)| VelocityPoint::new(q, p, 0.0));
                let run = |side: VelocityPoint<1>, first| self.states(&system, side, first, starts, samples);
                let (a, b) = (run(sides[0], first)?, run(sides[1], first + (1 << 20))?);
                let area = |a: &(f64, PhasePoint<1>), b: &(f64, PhasePoint<1>)| {
                    (a.1.q[0] * b.1.p[0] - a.1.p[0] * b.1.q[0]) * (-self.contraction(a.0)).exp()
                };
                Ok(a.iter().zip(&b).map(|(a, b)| relative(a.iter().zip(b).map(|(a, b)| area(a, b)))).collect())
            }
        }
    }

    fn runs<const N: usize>(
        &self,
        system: Formula<N>,
        orbit: VelocityPoint<N>,
        first: usize,
        starts: usize,
        samples: &[usize],
        invariant: impl Fn(f64, &PhasePoint<N>, f64) -> f64,
    ) -> Result<Vec<Vec<f64>>, InputError> {
        let states = self.states(&system, orbit, first, starts, samples)?;
        let rate = |t: f64| match system.rate {
            Rate::Constant(rate) => rate,
            Rate::Swinging { size, frequency } => size * (frequency * t).cos(),
            _ => f64::NAN,
        };
        Ok(states.iter().map(|run| relative(run.iter().map(|(t, x)| invariant(*t, x, rate(*t))))).collect())
    }

    /// The states of each member after the sampled numbers of steps, preceded by the initial state. The initial values
    /// differ in their last digits.
    fn states<const N: usize>(
        &self,
        system: &Formula<N>,
        orbit: VelocityPoint<N>,
        first: usize,
        starts: usize,
        samples: &[usize],
    ) -> Result<Vec<Vec<(f64, PhasePoint<N>)>>, InputError> {
        let claims = match self.way {
            Way::General(_) => Some(Structure::default()),
            Way::ActionDriven(_) => Some(Structure { separable: true, constant_mass: true, ..Structure::default() }),
            _ => None,
        };
        let system = Formula { claims, ..*system };
        (first..first + starts)
            .map(|i| {
                let mut random = Random::new(1, i);
                let mut moved = |x: &f64| x * (1.0 + self.apart() * random.between(-1.0, 1.0));
                let start = VelocityPoint { q: orbit.q.map(|x| moved(&x)), v: orbit.v.map(|x| moved(&x)), z: 0.0 };
                let problem = Problem { system, t0: 0.0, start, span: self.h };
                let walk = |stepper: &mut dyn Stepper| {
                    let mut states = vec![(0.0, stepper.state().fixed())];
                    let mut taken = 0;
                    for sample in samples {
                        // After a failed step, the positions and the invariant are NaN.
                        let ended = stepper.advance(sample - taken).is_err();
                        taken = *sample;
                        let state: PhasePoint<N> = stepper.state().fixed();
                        let gone = PhasePoint { q: SVector::from_element(f64::NAN), ..state };
                        states.push((stepper.time(), if ended { gone } else { state }));
                    }
                    states
                };
                match self.way {
                    Way::TransformedGauss(stages) => {
                        let motion = discrete_herglotz::Problem::new(&system, 0.0, start)?;
                        let mut stepper = TransformedStepper::new(&motion, stages, self.h)?;
                        Ok(walk(&mut stepper))
                    }
                    Way::By(_) | Way::General(_) | Way::ActionDriven(_) => {
                        let integrator = match self.way {
                            Way::By(integrator) => integrator,
                            Way::ActionDriven(scheme) => AnyIntegrator::Splitting(scheme),
                            Way::General(stages) | Way::TransformedGauss(stages) => AnyIntegrator::Gauss { stages },
                        };
                        let motion = problem.motion()?;
                        let plan = motion.by(integrator).steps(Steps::Count(1)).plan(problem.end())?;
                        Ok(walk(&mut *plan.stepper()?))
                    }
                }
            })
            .collect()
    }

    /// Measures the growth over an ensemble.
    fn measure(&self, first: usize, samples: &[usize]) -> Result<Growth, InputError> {
        let mut errors = self.errors(first, MEMBERS, samples)?;
        if !self.has_bias {
            // The truncation error is the same for all members, and is subtracted.
            for k in 0..samples.len() {
                let (middle, _) = mean(&errors.iter().map(|row| row[k]).collect::<Vec<_>>());
                errors.iter_mut().for_each(|row| row[k] -= middle);
            }
        }
        let column = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let fit = |rows: &[Vec<f64>]| {
            // Only the last two decades: before them, the last digit of the energy hides the growth.
            let last = samples.last().copied().unwrap_or(1);
            let points: Vec<(f64, f64)> = samples
                .iter()
                .enumerate()
                .filter(|(_, n)| **n * 128 > last)
                .map(|(k, n)| ((*n as f64).ln(), max_or_nan(rms(column(rows, k)), f64::EPSILON / 8.0).ln()))
                .collect();
            slope(&points)
        };
        let parts: Vec<f64> = errors.chunks(MEMBERS / 8).map(fit).collect();
        let last = samples.len() - 1;
        let (drift, error) = mean(&column(&errors, last));
        Ok(Growth {
            points: (0..samples.len())
                .map(|k| (samples[k] as f64, rms(column(&errors, k)), mean(&column(&errors, k)).0))
                .collect(),
            exponent: fit(&errors),
            exponent_error: mean(&parts).1,
            // Rounding errors that all members share, above all that of the contraction factor, do not show in the
            // scatter.
            sigmas: self.has_bias.then(|| drift / error.hypot(f64::EPSILON)),
            bias: drift / samples[last] as f64,
        })
    }
}

/// The sum of `g cos(x)` over the substeps g of a scheme. Here x is the angle at the middle of the substep, measured
/// from the middle of the step; it grows by `angle` in a step.
fn middles(scheme: &SplittingScheme, angle: f64) -> f64 {
    let mut before = -0.5;
    let of = |g: &f64| {
        let middle = before + 0.5 * g;
        before += g;
        g * (angle * middle).cos()
    };
    scheme.substeps().map_or(f64::NAN, |substeps| substeps.iter().map(of).sum())
}

/// Relative changes since the first of the values.
fn relative(mut values: impl Iterator<Item = f64>) -> Vec<f64> {
    let first = values.next().unwrap_or(f64::NAN);
    values.map(|value| (value - first) / first).collect()
}

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let all = ensembles();
    let quick = report.quick;
    let found = parallel(&report.bar, all.len(), |i| -> Result<(Growth, Option<f64>), InputError> {
        let ensemble = &all[i];
        let power = if quick { ensemble.power.min(if ensemble.power < 16 { 9 } else { 11 }) } else { ensemble.power };
        let samples: Vec<usize> = (3..=power).map(|k| 1 << k).collect();
        let growth = ensemble.measure(0, &samples)?;
        // Without a bias, one mean in 400 is beyond three standard errors. With a bias, it is beyond them again for
        // other initial values.
        let suspect = growth.sigmas.is_some_and(|s| s.is_nan() || s.abs() > SIGMAS);
        let again = if suspect { ensemble.measure(1 << 10, &samples)?.sigmas } else { growth.sigmas };
        Ok((growth, again))
    });

    let (mut rows, mut lines, mut worst) = (Vec::new(), Vec::new(), Vec::new());
    let mut refused = 0;
    for (ensemble, found) in all.iter().zip(&found) {
        let names = ensemble.names();
        let Ok((growth, again)) = found else {
            refused += 1;
            continue;
        };
        for (n, rms, mean) in &growth.points {
            let numbers = [number(ensemble.h), n.to_string(), number(*rms), number(*mean)];
            rows.push(names.iter().cloned().chain(numbers).collect());
        }
        // The smaller of the two values: a bias is present in both.
        let sigmas = growth.sigmas.zip(*again).map(|(a, b)| if a.abs() < b.abs() { a } else { b });
        let last = growth.points.last().map_or(f64::NAN, |p| p.1);
        let text = [
            ensemble.h.to_string(),
            format!("{:.2} ± {:.2}", growth.exponent, growth.exponent_error),
            format!("{last:.1e}"),
            sigmas.map_or("-".into(), |_| format!("{:.1e}", growth.bias)),
            sigmas.map_or("-".into(), |s| format!("{s:.1}")),
        ];
        lines.push(names.iter().cloned().chain(text).collect::<Vec<_>>());
        worst.push((ensemble.way.name(), growth.exponent, sigmas));
    }
    report.table("", &["motion", "gamma", "method", "h", "steps", "rms_error", "mean_error"], rows)?;
    let columns = ["motion", "gamma", "method", "h", "exponent", "rms at the end", "bias a step", "in standard errors"];
    report.markdown(&columns, lines);
    let mut ways: Vec<String> = Vec::new();
    for (way, ..) in &worst {
        if !ways.contains(way) {
            ways.push(way.clone());
        }
    }
    report.at_most("ensembles that were refused", f64::from(refused), 0.0)?;
    for way in &ways {
        let of = || worst.iter().filter(|(name, ..)| name == way);
        // A negative exponent counts as zero.
        let exponent = max_abs_or_nan(of().map(|(_, e, _)| if *e < 0.0 { 0.0 } else { *e }));
        report.at_most(&format!("{way}: largest exponent of the growth"), exponent, EXPONENT)?;
        let sigmas = max_abs_or_nan(of().filter_map(|(.., s)| *s));
        report.at_most(&format!("{way}: bias in standard errors of its mean"), sigmas, SIGMAS)?;
    }
    report.figure(&diagram(&all, &found))
}

/// The growth of the rms error without drag, one panel for each motion.
fn diagram(all: &[Ensemble], found: &[Result<(Growth, Option<f64>), InputError>]) -> String {
    let panels = [(Motion::Oscillator, "area"), (Motion::Pendulum, "energy"), (Motion::Kepler, "energy")];
    let panels = panels.map(|(motion, what)| {
        let mut curves =
            vec![Curve::new("square root of the steps", Line::Grey(0), [1e1, 1e6].map(|n: f64| (n, 1e-16 * n.sqrt())))];
        let of = all.iter().zip(found).filter(|(e, _)| e.motion == motion && e.drag == Drag::None);
        for (number, (ensemble, found)) in of.enumerate() {
            if let Ok((growth, _)) = found {
                let points = growth.points.iter().map(|(n, rms, _)| (*n, *rms));
                curves.push(Curve::new(&ensemble.way.name().replace('_', " "), Line::Coloured(number), points));
            }
        }
        Panel::new(
            ("steps", Axis::Logarithmic(1, 6, 1)),
            (&format!("relative error of the {what}, rms"), Axis::Logarithmic(-17, -12, 1)),
            (1.0, 0.98),
            curves,
        )
    });
    draw_row(&panels)
}
