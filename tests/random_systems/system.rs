//! A Lagrangian whose terms are drawn at run time: one type, so that each method is compiled once, and any kind of structure.

use super::dice::Dice;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use std::f64::consts::TAU;

/// `scale (v.Mv/2 + gamma(t) z + monomials + waves + bumps)`.
#[derive(Clone, Debug)]
pub struct RandomSystem<const N: usize> {
    scale: f64,
    mass: SMatrix<f64, N, N>,
    /// `gamma(t) = steady + swing cos(frequency t)`; the scale leaves it alone.
    drag: Drag,
    monomials: Vec<Monomial<N>>,
    waves: Vec<Wave<N>>,
    pub bumps: Vec<Bump>,
    /// A claim that is made although it does not hold.
    pub lie: Option<&'static str>,
}

#[derive(Clone, Copy, Debug)]
struct Drag {
    steady: f64,
    swing: f64,
    frequency: f64,
}

/// `factor cos(frequency t) q^a v^b z^c`, of degree 1 to 4.
#[derive(Clone, Debug)]
struct Monomial<const N: usize> {
    factor: f64,
    frequency: f64,
    q: [u32; N],
    v: [u32; N],
    z: u32,
}

/// `factor cos(q.a + v.b + c z + frequency t + phase)`.
#[derive(Clone, Debug)]
struct Wave<const N: usize> {
    factor: f64,
    q: SVector<f64, N>,
    v: SVector<f64, N>,
    z: f64,
    frequency: f64,
    phase: f64,
}

/// `factor e^(-((x - centre)/width)^2)`, a hidden thing.
#[derive(Clone, Copy, Debug)]
pub struct Bump {
    factor: f64,
    pub centre: f64,
    pub width: f64,
    pub along: Along,
    on: On,
}

/// What a bump is narrow in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Along {
    /// The first coordinate.
    Position,
    /// Time.
    Time,
}

/// What a bump acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum On {
    /// A hill, or a pulse of force on the first coordinate.
    Force,
    /// A region, or a pulse, of drag.
    Drag,
    /// A pulse of mass.
    Mass,
}

/// How much structure a system has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A polynomial of degree two, with constant or varying drag.
    Quadratic,
    /// `v.Mv/2 - V(t, q) + gamma(t) z`.
    Separable,
    /// `v.Mv/2 - V(t, q) + f(z)`.
    NonlinearDrag,
    /// Anything but a mass that varies.
    ConstantMass,
    /// Anything.
    General,
}

impl<const N: usize> RandomSystem<N> {
    /// Draws one.
    pub fn draw(dice: &mut Dice) -> Self {
        let kind = dice.pick(&[
            Kind::Quadratic,
            Kind::Separable,
            Kind::Separable,
            Kind::NonlinearDrag,
            Kind::ConstantMass,
            Kind::General,
            Kind::General,
        ]);
        let timed = dice.chance(0.35);
        let frequency = |dice: &mut Dice| if timed && dice.chance(0.5) { dice.scale(0.1, 20.0) } else { 0.0 };
        let drag = Drag {
            steady: if dice.chance(0.2) { 0.0 } else { -dice.scale(1e-4, 3.0) * dice.pick(&[1.0, 1.0, 1.0, -0.3]) },
            swing: if timed && dice.chance(0.5) { dice.between(-1.0, 1.0) } else { 0.0 },
            frequency: dice.scale(0.1, 10.0),
        };
        let mut system = RandomSystem {
            scale: if dice.chance(0.06) { dice.scale(1e-12, 1e12) } else { 1.0 },
            mass: Self::draw_mass(dice),
            drag,
            monomials: Vec::new(),
            waves: Vec::new(),
            bumps: Vec::new(),
            lie: None,
        };
        // A well holds most motions; without one they run away, which is a case too.
        if dice.chance(0.8) {
            for i in 0..N {
                let degree = if kind == Kind::Quadratic { 2 } else { dice.pick(&[2, 2, 4]) };
                let mut q = [0; N];
                q[i] = degree;
                let factor = -dice.scale(0.1, 10.0);
                system.monomials.push(Monomial { factor, frequency: 0.0, q, v: [0; N], z: 0 });
            }
        }
        for _ in 0..dice.below(4) {
            let factor = dice.between(-0.5, 0.5);
            let monomial = Monomial { factor, frequency: frequency(dice), ..Self::draw_monomial(kind, dice) };
            system.monomials.push(monomial);
        }
        if kind != Kind::Quadratic {
            for _ in 0..dice.below(3) {
                let wave = Wave { frequency: frequency(dice), ..Self::draw_wave(kind, dice) };
                system.waves.push(wave);
            }
            if dice.chance(0.15) {
                let bump = Self::draw_bump(kind, timed, dice);
                system.bumps.push(bump);
            }
        }
        if dice.chance(0.08) {
            let made = system.true_structure();
            let lies: Vec<_> = CLAIMS.iter().filter(|(_, claim)| !*claim(&mut { made })).collect();
            if !lies.is_empty() {
                system.lie = Some(lies[dice.below(lies.len())].0);
            }
        }
        system
    }

    fn draw_mass(dice: &mut Dice) -> SMatrix<f64, N, N> {
        match dice.below(10) {
            0..5 => SMatrix::identity(),
            5..8 => SMatrix::from_diagonal(&SVector::from_fn(|_, _| dice.scale(0.1, 10.0))),
            8 => {
                let a = SMatrix::<f64, N, N>::from_fn(|_, _| dice.between(-1.0, 1.0));
                a * a.transpose() + SMatrix::identity() * 0.2
            }
            // Ratios of masses that strain a solver, and masses that are not positive.
            _ => SMatrix::from_diagonal(&SVector::from_fn(|_, _| dice.scale(1e-4, 1e4) * dice.pick(&[1.0, 1.0, -1.0]))),
        }
    }

    fn draw_monomial(kind: Kind, dice: &mut Dice) -> Monomial<N> {
        let (mut q, mut v, mut z) = ([0; N], [0; N], 0);
        let most = if kind == Kind::Quadratic { 2 } else { 4 };
        let degree = 1 + dice.below(most);
        let alone = dice.chance(0.4);
        for _ in 0..degree {
            let i = dice.below(N);
            match kind {
                Kind::Separable => q[i] += 1,
                Kind::NonlinearDrag if alone => z += 1,
                Kind::NonlinearDrag => q[i] += 1,
                Kind::Quadratic if dice.chance(0.7) => q[i] += 1,
                Kind::Quadratic => v[i] += 1,
                Kind::ConstantMass => match dice.below(3) {
                    0 => q[i] += 1,
                    1 if v.iter().sum::<u32>() == 0 => v[i] += 1,
                    _ => z += 1,
                },
                Kind::General => match dice.below(3) {
                    0 => q[i] += 1,
                    1 => v[i] += 1,
                    _ => z += 1,
                },
            }
        }
        Monomial { factor: 0.0, frequency: 0.0, q, v, z }
    }

    fn draw_wave(kind: Kind, dice: &mut Dice) -> Wave<N> {
        let vector = |dice: &mut Dice| SVector::from_fn(|_, _| dice.between(-2.0, 2.0));
        let (none, factor, phase) = (SVector::zeros(), dice.between(-1.0, 1.0), dice.between(0.0, TAU));
        let wave = Wave { factor, q: none, v: none, z: 0.0, frequency: 0.0, phase };
        match kind {
            Kind::NonlinearDrag if dice.chance(0.3) => Wave { z: dice.between(-2.0, 2.0), ..wave },
            Kind::Quadratic | Kind::Separable | Kind::NonlinearDrag => Wave { q: vector(dice), ..wave },
            Kind::ConstantMass => Wave { q: vector(dice), z: dice.between(-2.0, 2.0), ..wave },
            // Small in v, so that W stays regular as a rule.
            Kind::General => {
                let (q, v, z) = (vector(dice), vector(dice) * 0.3, dice.between(-1.0, 1.0));
                Wave { q, v, z, ..wave }
            }
        }
    }

    fn draw_bump(kind: Kind, timed: bool, dice: &mut Dice) -> Bump {
        let along = if timed { dice.pick(&[Along::Position, Along::Time]) } else { Along::Position };
        let on = match (kind, along) {
            (Kind::General, _) => dice.pick(&[On::Force, On::Drag, On::Mass]),
            (Kind::ConstantMass, _) | (Kind::Separable, Along::Time) => dice.pick(&[On::Force, On::Drag]),
            _ => On::Force,
        };
        let factor = dice.scale(0.1, 10.0) * if on == On::Mass { 1.0 } else { dice.pick(&[-1.0, 1.0]) };
        let centre = if along == Along::Time { dice.between(0.0, 10.0) } else { dice.between(-3.0, 3.0) };
        Bump { factor, centre, width: dice.scale(1e-3, 1.0), along, on }
    }

    /// What holds, found from the coefficients.
    fn true_structure(&self) -> Structure {
        let zero = |e: &[u32]| e.iter().all(|e| *e == 0);
        let (monomials, waves, bumps) = (&self.monomials, &self.waves, &self.bumps);
        let still_v = |w: &Wave<N>| w.v.iter().all(|e| *e == 0.0);
        let still_q = |w: &Wave<N>| w.q.iter().all(|e| *e == 0.0);
        let timed_drag = self.drag.swing != 0.0 || bumps.iter().any(|b| b.on == On::Drag && b.along == Along::Time);
        let autonomous = self.drag.swing == 0.0
            && monomials.iter().all(|m| m.frequency == 0.0)
            && waves.iter().all(|w| w.frequency == 0.0)
            && bumps.iter().all(|b| b.along == Along::Position);
        let z_affine = monomials.iter().all(|m| m.z == 0 || (m.z == 1 && zero(&m.q) && zero(&m.v)))
            && waves.iter().all(|w| w.z == 0.0)
            && bumps.iter().all(|b| b.on != On::Drag || b.along == Along::Time);
        let z_free = monomials.iter().all(|m| m.z == 0)
            && waves.iter().all(|w| w.z == 0.0)
            && bumps.iter().all(|b| b.on != On::Drag)
            && self.drag.steady == 0.0
            && self.drag.swing == 0.0;
        let constant_mass = monomials.iter().all(|m| m.v.iter().sum::<u32>() < 2)
            && waves.iter().all(still_v)
            && bumps.iter().all(|b| b.on != On::Mass);
        let separable = constant_mass
            && monomials.iter().all(|m| zero(&m.v) && (m.z == 0 || zero(&m.q)))
            && waves.iter().all(|w| still_v(w) && (w.z == 0.0 || still_q(w)))
            && bumps.iter().all(|b| b.on != On::Drag || b.along == Along::Time);
        let degree = |m: &Monomial<N>| m.q.iter().chain(&m.v).sum::<u32>();
        let quadratic = z_affine
            && monomials.iter().all(|m| degree(m) <= 2)
            && waves.iter().all(|w| still_q(w) && still_v(w) && w.z == 0.0)
            && bumps.iter().all(|b| b.along == Along::Time && b.on != On::Mass);
        let steady_z = monomials.iter().all(|m| m.z == 0 || m.frequency == 0.0);
        let constant_rate = z_affine && !timed_drag && steady_z;
        Structure { autonomous, z_free, z_affine, constant_rate, separable, quadratic, constant_mass }
    }

    /// The shortest time in which the motion at a point can meet something new, by the bumps alone.
    pub fn patience(&self, x: &VelocityPoint<N>) -> f64 {
        self.bumps.iter().fold(f64::INFINITY, |dt, bump| {
            let speed = if bump.along == Along::Time { 1.0 } else { x.v[0].abs() };
            dt.min(0.5 * bump.width / speed)
        })
    }
}

/// The claims by name.
type Claim = (&'static str, fn(&mut Structure) -> &mut bool);
const CLAIMS: [Claim; 7] = [
    ("autonomous", |s| &mut s.autonomous),
    ("z_free", |s| &mut s.z_free),
    ("z_affine", |s| &mut s.z_affine),
    ("constant_rate", |s| &mut s.constant_rate),
    ("separable", |s| &mut s.separable),
    ("quadratic", |s| &mut s.quadratic),
    ("constant_mass", |s| &mut s.constant_mass),
];

impl<const N: usize> Lagrangian<N> for RandomSystem<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut l = T::zero();
        for i in 0..N {
            for j in 0..N {
                l += v[i] * v[j] * (0.5 * self.mass[(i, j)]);
            }
        }
        for m in &self.monomials {
            let mut term = if m.frequency == 0.0 { T::from(m.factor) } else { (t * m.frequency).cos() * m.factor };
            for i in 0..N {
                for _ in 0..m.q[i] {
                    term *= q[i];
                }
                for _ in 0..m.v[i] {
                    term *= v[i];
                }
            }
            for _ in 0..m.z {
                term *= z;
            }
            l += term;
        }
        for w in &self.waves {
            let mut phase = t * w.frequency + z * w.z + w.phase;
            for i in 0..N {
                phase += q[i] * w.q[i] + v[i] * w.v[i];
            }
            l += phase.cos() * w.factor;
        }
        let mut rate = T::from(self.drag.steady);
        if self.drag.swing != 0.0 {
            rate += (t * self.drag.frequency).cos() * self.drag.swing;
        }
        for b in &self.bumps {
            let x = if b.along == Along::Time { t } else { q[0] };
            let u = (x - b.centre) / b.width;
            let height = (-(u * u)).exp() * b.factor;
            match b.on {
                On::Drag => rate += height,
                On::Mass => l += height * v[0] * v[0],
                On::Force if b.along == Along::Time => l += height * q[0],
                On::Force => l += height,
            }
        }
        l * self.scale + rate * z
    }

    fn structure(&self) -> Structure {
        let mut structure = self.true_structure();
        for (name, claim) in CLAIMS {
            if self.lie == Some(name) {
                *claim(&mut structure) = true;
            }
        }
        structure
    }
}
