//! A Lagrangian whose terms are drawn at run time: one type, so that each method is compiled once, with any kind of
//! structure.

use super::random_numbers::RandomNumbers;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use std::f64::consts::TAU;

/// `scale (v.Mv/2 + gamma(t) z + monomials + waves + bumps)`.
#[derive(Clone, Debug)]
pub struct RandomSystem<const N: usize> {
    scale: f64,
    mass: SMatrix<f64, N, N>,
    /// `gamma(t) = steady + swing cos(frequency t)`, which is not scaled.
    drag: Drag,
    monomials: Vec<Monomial<N>>,
    waves: Vec<Wave<N>>,
    pub bumps: Vec<Bump>,
    /// A property that is declared although it does not hold.
    pub false_claim: Option<&'static str>,
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

/// `factor e^(-((x - centre)/width)^2)`, a narrow term.
#[derive(Clone, Copy, Debug)]
pub struct Bump {
    factor: f64,
    pub centre: f64,
    pub width: f64,
    pub along: Along,
    on: On,
}

/// The variable in which a bump is narrow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Along {
    /// The first coordinate.
    Position,
    /// Time.
    Time,
}

/// The term that a bump changes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum On {
    /// A hill, or a pulse of force on the first coordinate.
    Force,
    /// A region, or a pulse, of drag.
    Drag,
    /// A pulse of mass.
    Mass,
}

/// The amount of structure of a system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A polynomial of degree two, with constant or varying drag.
    Quadratic,
    /// `v.Mv/2 - V(t, q) + gamma(t) z`.
    Separable,
    /// `v.Mv/2 - V(t, q) + f(z)`.
    NonlinearDrag,
    /// Any terms with a constant mass.
    ConstantMass,
    /// Any terms.
    General,
}

impl<const N: usize> RandomSystem<N> {
    /// Draws a system.
    pub fn draw(random: &mut RandomNumbers) -> Self {
        let kind = random.pick(&[
            Kind::Quadratic,
            Kind::Separable,
            Kind::Separable,
            Kind::NonlinearDrag,
            Kind::ConstantMass,
            Kind::General,
            Kind::General,
        ]);
        let timed = random.chance(0.35);
        let frequency =
            |random: &mut RandomNumbers| if timed && random.chance(0.5) { random.scale(0.1, 20.0) } else { 0.0 };
        let drag = Drag {
            steady: if random.chance(0.2) {
                0.0
            } else {
                -random.scale(1e-4, 3.0) * random.pick(&[1.0, 1.0, 1.0, -0.3])
            },
            swing: if timed && random.chance(0.5) { random.between(-1.0, 1.0) } else { 0.0 },
            frequency: random.scale(0.1, 10.0),
        };
        let mut system = RandomSystem {
            scale: if random.chance(0.06) { random.scale(1e-12, 1e12) } else { 1.0 },
            mass: Self::draw_mass(random),
            drag,
            monomials: Vec::new(),
            waves: Vec::new(),
            bumps: Vec::new(),
            false_claim: None,
        };
        // Most motions are in a well; without one they run away, which is tested too.
        if random.chance(0.8) {
            for i in 0..N {
                let degree = if kind == Kind::Quadratic { 2 } else { random.pick(&[2, 2, 4]) };
                let mut q = [0; N];
                q[i] = degree;
                let factor = -random.scale(0.1, 10.0);
                system.monomials.push(Monomial { factor, frequency: 0.0, q, v: [0; N], z: 0 });
            }
        }
        for _ in 0..random.below(4) {
            let factor = random.between(-0.5, 0.5);
            let monomial = Monomial { factor, frequency: frequency(random), ..Self::draw_monomial(kind, random) };
            system.monomials.push(monomial);
        }
        if kind != Kind::Quadratic {
            for _ in 0..random.below(3) {
                let wave = Wave { frequency: frequency(random), ..Self::draw_wave(kind, random) };
                system.waves.push(wave);
            }
            if random.chance(0.15) {
                let bump = Self::draw_bump(kind, timed, random);
                system.bumps.push(bump);
            }
        }
        if random.chance(0.08) {
            let made = system.true_structure();
            let false_claims: Vec<_> = CLAIMS.iter().filter(|(_, claim)| !*claim(&mut { made })).collect();
            if !false_claims.is_empty() {
                system.false_claim = Some(false_claims[random.below(false_claims.len())].0);
            }
        }
        system
    }

    fn draw_mass(random: &mut RandomNumbers) -> SMatrix<f64, N, N> {
        match random.below(10) {
            0..5 => SMatrix::identity(),
            5..8 => SMatrix::from_diagonal(&SVector::from_fn(|_, _| random.scale(0.1, 10.0))),
            8 => {
                let a = SMatrix::<f64, N, N>::from_fn(|_, _| random.between(-1.0, 1.0));
                a * a.transpose() + SMatrix::identity() * 0.2
            }
            // Large ratios of masses, and masses that are not positive.
            _ => SMatrix::from_diagonal(&SVector::from_fn(|_, _| {
                random.scale(1e-4, 1e4) * random.pick(&[1.0, 1.0, -1.0])
            })),
        }
    }

    fn draw_monomial(kind: Kind, random: &mut RandomNumbers) -> Monomial<N> {
        let (mut q, mut v, mut z) = ([0; N], [0; N], 0);
        let most = if kind == Kind::Quadratic { 2 } else { 4 };
        let degree = 1 + random.below(most);
        let alone = random.chance(0.4);
        for _ in 0..degree {
            let i = random.below(N);
            match kind {
                Kind::Separable => q[i] += 1,
                Kind::NonlinearDrag if alone => z += 1,
                Kind::NonlinearDrag => q[i] += 1,
                Kind::Quadratic if random.chance(0.7) => q[i] += 1,
                Kind::Quadratic => v[i] += 1,
                Kind::ConstantMass => match random.below(3) {
                    0 => q[i] += 1,
                    1 if v.iter().sum::<u32>() == 0 => v[i] += 1,
                    _ => z += 1,
                },
                Kind::General => match random.below(3) {
                    0 => q[i] += 1,
                    1 => v[i] += 1,
                    _ => z += 1,
                },
            }
        }
        Monomial { factor: 0.0, frequency: 0.0, q, v, z }
    }

    fn draw_wave(kind: Kind, random: &mut RandomNumbers) -> Wave<N> {
        let vector = |random: &mut RandomNumbers| SVector::from_fn(|_, _| random.between(-2.0, 2.0));
        let (none, factor, phase) = (SVector::zeros(), random.between(-1.0, 1.0), random.between(0.0, TAU));
        let wave = Wave { factor, q: none, v: none, z: 0.0, frequency: 0.0, phase };
        match kind {
            Kind::NonlinearDrag if random.chance(0.3) => Wave { z: random.between(-2.0, 2.0), ..wave },
            Kind::Quadratic | Kind::Separable | Kind::NonlinearDrag => Wave { q: vector(random), ..wave },
            Kind::ConstantMass => Wave { q: vector(random), z: random.between(-2.0, 2.0), ..wave },
            // Small in v, so that W is usually regular.
            Kind::General => {
                let (q, v, z) = (vector(random), vector(random) * 0.3, random.between(-1.0, 1.0));
                Wave { q, v, z, ..wave }
            }
        }
    }

    fn draw_bump(kind: Kind, timed: bool, random: &mut RandomNumbers) -> Bump {
        let along = if timed { random.pick(&[Along::Position, Along::Time]) } else { Along::Position };
        let on = match (kind, along) {
            (Kind::General, _) => random.pick(&[On::Force, On::Drag, On::Mass]),
            (Kind::ConstantMass, _) | (Kind::Separable, Along::Time) => random.pick(&[On::Force, On::Drag]),
            _ => On::Force,
        };
        let factor = random.scale(0.1, 10.0) * if on == On::Mass { 1.0 } else { random.pick(&[-1.0, 1.0]) };
        let centre = if along == Along::Time { random.between(0.0, 10.0) } else { random.between(-3.0, 3.0) };
        Bump { factor, centre, width: random.scale(1e-3, 1.0), along, on }
    }

    /// The structure that holds, found from the coefficients.
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

    /// The shortest time in which the motion at a point can pass a bump.
    pub fn bump_time(&self, x: &VelocityPoint<N>) -> f64 {
        self.bumps.iter().fold(f64::INFINITY, |dt, bump| {
            let speed = if bump.along == Along::Time { 1.0 } else { x.v[0].abs() };
            dt.min(0.5 * bump.width / speed)
        })
    }
}

/// The declared properties by name.
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
            if self.false_claim == Some(name) {
                *claim(&mut structure) = true;
            }
        }
        structure
    }
}
