//! The table of methods: names, hypotheses, and every property that it states, each compared with numbers.

use crate::paper::table::{Pairs, SYMMETRIC, discretise, pairs};
use contact_examples::systems::{
    CoupledInZ, DoublePendulum, Duffing, HarmonicOscillator, OneCoordinate, Pendulum, PerturbedKepler, QuadraticInZ,
    System, TwoCoordinates, catalogue_size,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, DiscretePoint, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint, legendre,
    numbers::MaxAbsOrNan,
};
use discrete_herglotz::{
    DiscreteLagrangian, InputError,
    rules::{Method, Rule},
};

/// A name is parsed back to its method, so that no two names are equal; the error for an unknown name lists all
/// names.
#[test]
fn names() {
    for method in Method::ALL {
        assert_eq!(method.to_string().parse(), Ok(*method));
    }
    let error = "simpson".parse::<Method>().err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("simpson"));
    assert!(Method::ALL.iter().all(|method| error.contains(method.name())), "{error}");
}

/// The Strang splitting needs a separable Lagrangian and a linear drag, whose rate may depend on time.
#[test]
fn hypotheses_of_strang() {
    let error = |structure: Structure| Method::Strang.check(&structure).err();
    let unclaimed = |claim| Some(InputError::Unclaimed { claim });
    assert_eq!(error(Structure::default()), unclaimed("separable"));
    let structure = Structure { separable: true, ..Structure::default() };
    assert_eq!(error(structure), unclaimed("z_affine"));
    assert_eq!(error(Structure { z_free: true, ..structure }), None);
    assert_eq!(error(Structure { z_affine: true, ..structure }), None);
    assert_eq!(error(Structure { constant_rate: true, ..structure }), None);
    fn made<const N: usize, S: System<N>>(system: &S) -> Result<(), InputError> {
        discretise(Method::Strang, system, 0.1, system.initial_time(), &system.initial()).map(drop)
    }
    assert_eq!(made(&OneCoordinate::from(Duffing::forced())), Ok(()));
    assert_eq!(made(&TwoCoordinates::from(PerturbedKepler::default())), Ok(()));
    assert_eq!(made(&TwoCoordinates::from(DoublePendulum::default())).err(), unclaimed("separable"));
}

/// The rules accept a Lagrangian that declares no structure, hence every system, and they are in the table of
/// methods.
#[test]
fn rules_take_every_lagrangian() {
    assert!(Method::RULES.iter().all(|rule| Method::ALL.contains(rule) && rule.check(&Structure::default()).is_ok()));
    let Pairs { all, symmetric } = pairs();
    assert!(all >= catalogue_size() * Method::RULES.len() && all <= catalogue_size() * Method::ALL.len());
    assert!(symmetric >= SYMMETRIC * Method::RULES.len() && symmetric <= SYMMETRIC * Method::ALL.len());
}

/// Each entry of the table is the rule of its name, to the bit.
#[test]
fn rules_by_name() {
    let (system, x) = (OneCoordinate::from(CoupledInZ::default()), DiscretePoint::new([0.3], [0.4], 0.7));
    let rules: Vec<Rule> = Method::RULES.iter().filter_map(|method| method.rule()).collect();
    assert_eq!(rules, Rule::ALL);
    for method in Method::RULES {
        let rule = method.rule().unwrap();
        let by_name = discretise(*method, &system, 0.1, 0.0, &VelocityPoint::new([0.3], [0.4], 0.7)).unwrap();
        let by_rule = rule.of(&system, 0.1).unwrap();
        assert_eq!(by_name.step_size(), by_rule.step_size());
        assert_eq!(by_name.value::<f64>(0.0, &x), by_rule.value(0.0, &x));
        assert_eq!(by_name.jet(0.0, &x), by_rule.jet(0.0, &x));
        assert_eq!(by_name.second_jet(0.0, &x), by_rule.second_jet(0.0, &x));
        let (from, guess, mut solver) = (PhasePoint::new([0.3], [0.8], 0.7), SVector::from([0.9]), Default::default());
        assert_eq!(by_name.forward(0.0, &from, &guess, &mut solver), by_rule.forward(0.0, &from, &guess, &mut solver));
        assert_eq!(
            by_name.backward(0.0, &from, &guess, &mut solver),
            by_rule.backward(0.0, &from, &guess, &mut solver)
        );
        assert_eq!((method.name(), method.order()), (rule.name, rule.order));
        assert_eq!(rule.name.parse(), Ok(*method));
    }
}

/// No method accepts a step that is 0 or not finite; a negative step runs backward.
#[test]
fn bad_steps() {
    let system = OneCoordinate::from(Pendulum::default());
    for method in Method::applicable(&system.structure()) {
        for h in [0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            let error = discretise(method, &system, h, 0.0, &system.initial()).err();
            assert!(matches!(error, Some(InputError::Step { .. })), "{method}: {error:?}");
        }
        let start = legendre(&system, 0.0, &system.initial());
        let ld = discretise(method, &system, -0.1, 0.0, &system.initial()).unwrap();
        let v = system.initial().v;
        let back = ld.forward(0.0, &start, &v, &mut Default::default()).unwrap().end;
        // The acceleration is about one, and h^2 = 0.01.
        assert!((back.q - (start.q - v * 0.1)).max_abs_or_nan() < 0.02, "{method}: {back:?}");
    }
}

/// Linear drag in a long step: `sigma_d` is `e^(gamma h)` for the methods with an exact rate, and differs visibly
/// for the others.
#[test]
fn exact_rates() {
    let (gamma, h) = (-1.0, 0.5);
    let system = OneCoordinate::from(HarmonicOscillator { gamma });
    for method in Method::applicable(&system.structure()) {
        let x = DiscretePoint::new([0.3], [0.4], 0.7);
        let jet = discretise(method, &system, h, 0.0, &system.initial()).map(|ld| ld.jet(0.0, &x));
        let jet = jet.unwrap().unwrap();
        let off = (jet.sigma() - f64::exp(gamma * h)).abs();
        assert!(if method.exact_rate() { off < 1e-14 } else { off > 1e-8 }, "{method}: off by {off:e}");
    }
}

/// For an L quadratic in z, a method explicit in z has an L_d quadratic in `z0`: its third difference is zero.
#[test]
fn implicit_in_z() {
    let system = OneCoordinate::from(QuadraticInZ { c: 1.0 });
    for method in Method::applicable(&system.structure()) {
        let ld = discretise(method, &system, 0.5, 0.0, &system.initial());
        let ld = ld.unwrap();
        let at = |z0: f64| ld.value(0.0, &DiscretePoint::new([0.3], [0.4], z0)).unwrap_or(f64::NAN);
        let third = (at(0.6) - 3.0 * at(0.4) + 3.0 * at(0.2) - at(0.0)).abs();
        assert!(if method.implicit_in_z() { third > 1e-5 } else { third < 1e-14 }, "{method}: {third:e}");
    }
}

/// The Lagrangian of the motion reversed in time: `z` changes its sign, and `dz/dt` does not.
struct Reversed<'a, S>(&'a S);

impl<const N: usize, S: System<N>> Lagrangian<N> for Reversed<'_, S> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(-t, q, &v.map(|v| -v), -z)
    }
    fn structure(&self) -> Structure {
        self.0.structure()
    }
}

/// A symmetric method returns to the start of a step when the motion is reversed, to round-off; other methods do
/// not.
#[test]
fn symmetric() {
    fn of<const N: usize, S: System<N>>(system: &S) {
        let (h, t) = (0.1, system.initial_time());
        let x = system.initial();
        let start: PhasePoint<N> = legendre(system, t, &x);
        let reversed = Reversed(system);
        let turned = |x: PhasePoint<N>| PhasePoint { q: x.q, p: -x.p, z: -x.z };
        for method in Method::applicable(&system.structure()) {
            let there_and_back = || {
                let mut solver = Default::default();
                let there = method.discretise(system, h, t, &start).ok()?.forward(t, &start, &x.v, &mut solver).ok()?;
                let back = method.discretise(&reversed, h, -(t + h), &turned(there.end)).ok()?;
                back.forward(-(t + h), &turned(there.end), &-there.velocity, &mut solver).ok()
            };
            let back = there_and_back();
            assert!(back.is_some(), "{} with {method}", system.name());
            let off =
                back.map_or(f64::NAN, |back| ChartVector::from(turned(back.end)).minus(start.into()).max_abs_or_nan());
            let as_stated = if method.symmetric() { off < 1e-12 } else { off > 1e-5 };
            assert!(as_stated, "{} with {method}: off by {off:e}", system.name());
        }
    }
    of(&OneCoordinate::from(CoupledInZ { gamma: -1.0, ..CoupledInZ::default() }));
    of(&TwoCoordinates::from(DoublePendulum { gamma: -1.0, ..DoublePendulum::default() }));
    of(&OneCoordinate::from(HarmonicOscillator { gamma: -1.0 }));
}
