//! The defect of a step's collocation polynomial in Herglotz' equations, sampled between the nodes.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::dense::{Solved, SolvedStep};
use crate::gauss::stages::lagrangian_values::StageValues;
use crate::gauss::stages::parametrization::Parametrization;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES, lagrange_rows};
use crate::gauss::tables::condensed::Condensed;
use crate::numbers::array::from_fn;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, Two, by_two};
use crate::numbers::registers::{Scaled, StageMap, Stages, blocks};
use crate::resolution::thresholds::{MIN_EXACT_PRODUCT, VALUE_ROUND_OFF};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, Derivatives, Lagrangian, PhasePoint, Scalar, VelocityPoint, numbers::max_or_nan, vector,
};
use pulp::{Simd, WithSimd};
use std::sync::OnceLock;

/// The defect of a step at a set of sample points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DefectSample {
    /// The largest defect of the curve, relative to the momenta and actions: of `p' = L_q + L_z p` and `z' = L`, each
    /// times the step size, and of `p = L_v`. Infinite if a value is not finite.
    pub defect: f64,
    /// The absolute defect of momenta and forces alone, and that of the action alone.
    pub of_momenta: f64,
    pub of_action: f64,
    /// The size of the momenta, to which `defect` is relative.
    pub size: f64,
    /// The size of the actions, to which `defect` is relative.
    pub size_z: f64,
    /// An estimate of the defect from the last two Legendre coefficients of the step's polynomials.
    pub expected: f64,
    /// The largest defect of the values of L, beyond their round-off. It detects a jump of L between two points at
    /// which the gradient of the jumping term vanishes.
    pub of_value: f64,
    /// The largest `|p.v| + |z L_z|`, for comparison with `of_value`.
    pub kinetic: f64,
    /// The values of L at the start and at the end of the step's curve.
    pub ends: [f64; 2],
    /// Whether L may jump between the preceding step and this one.
    pub follows_a_jump: bool,
}

impl DefectSample {
    /// Whether the defect may be due to underflow, as where a force grows from zero.
    pub fn is_underflown(&self) -> bool {
        self.defect * self.size < MIN_EXACT_PRODUCT
    }

    /// The jump of the values of L to the next step, beyond their round-off.
    pub fn jump_to(&self, next: &DefectSample) -> f64 {
        let (before, after) = (self.ends[1], next.ends[0]);
        beyond_rounding((after - before).abs(), max_or_nan(before.abs(), after.abs()))
    }

    /// The sample of two consecutive parts of one step, between which L may jump: `self` and then `next`.
    pub fn joined(self, next: DefectSample) -> DefectSample {
        DefectSample {
            defect: max_or_nan(self.defect, next.defect),
            of_momenta: max_or_nan(self.of_momenta, next.of_momenta),
            of_action: max_or_nan(self.of_action, next.of_action),
            size: max_or_nan(self.size, next.size),
            size_z: max_or_nan(self.size_z, next.size_z),
            expected: max_or_nan(self.expected, next.expected),
            of_value: max_or_nan(self.of_value, next.of_value),
            kinetic: max_or_nan(self.kinetic, next.kinetic),
            ends: [self.ends[0], next.ends[1]],
            ..self
        }
    }

    /// The same sample, flagged as following a jump of L.
    pub fn after_a_jump(self) -> DefectSample {
        DefectSample { follows_a_jump: true, ..self }
    }

    /// Combined with a sample at other points of the same step.
    pub fn and(self, other: DefectSample) -> DefectSample {
        DefectSample {
            defect: max_or_nan(self.defect, other.defect),
            of_momenta: max_or_nan(self.of_momenta, other.of_momenta),
            of_action: max_or_nan(self.of_action, other.of_action),
            of_value: max_or_nan(self.of_value, other.of_value),
            ..self
        }
    }
}

/// A solved step: its start, and the polynomials through its stages `V`, `rho L_q`, `rho L_z` and L. With a time
/// transformation they are polynomials in tau, each multiplied by the rate dt/dtau.
pub(crate) struct Curve<const N: usize> {
    pub s: usize,
    pub t: f64,
    pub h: f64,
    pub q: [f64; N],
    pub p: [f64; N],
    pub z: f64,
    pub v: [Stages; N],
    pub force: [Stages; N],
    pub rate: Stages,
    pub l: Stages,
    /// Whether z is part of the stage equations; if not, `l` holds L at `z = 0`.
    pub acts: bool,
    /// The rates of the time transformation at the start and at the end.
    rates: [f64; 2],
}

impl<const N: usize> Curve<N> {
    /// A curve with its start, and stages that are 0 until they are set.
    pub fn new(s: usize, t: f64, h: f64, start: &PhasePoint<N>) -> Self {
        let zero = [Stages::ZERO; N];
        Curve {
            s,
            t,
            h,
            q: start.q.into(),
            p: start.p.into(),
            z: start.z,
            v: zero,
            force: zero,
            rate: Stages::ZERO,
            l: Stages::ZERO,
            acts: true,
            rates: [1.0; 2],
        }
    }

    /// Sets the stages of a step in transformed time, and the rates of the time transformation at its ends.
    pub fn of_transformed(&mut self, solved: &Solved<N>, rates: [f64; 2]) {
        self.of_solved(solved);
        self.rates = rates;
    }

    /// Sets the stages of a general step.
    pub fn of_solved(&mut self, solved: &Solved<N>) {
        (self.v, self.force) = (solved.v.map(Stages), solved.force.map(Stages));
        (self.rate, self.l) = (Stages(solved.rate), Stages(solved.l));
    }

    /// Sets the stages from the accelerations and positions of a condensed step with initial velocity v0.
    #[inline(always)]
    pub fn of_accelerations<S: Simd, L: Lagrangian<N>>(
        &mut self,
        lagrangian: &L,
        step: &SolvedStep<'_, N>,
        table: &Condensed,
        [a, x]: [&[Stages; N]; 2],
    ) {
        let (mass, v0) = (step.mass, &step.from.y);
        (self.acts, self.z) = (false, 0.0);
        for d in 0..N {
            let v0 = Lanes::<S>::splat(v0[d]);
            table.d.apply(&a[d], table.s, &mut self.v[d], Scaled(&table.inverse_rho, v0));
        }
        for r in 0..blocks::<S>(table.s) {
            let rho = table.inverse_rho.block::<S>(r).recip();
            self.rate.set(r, rho * table.gamma);
            for i in 0..N {
                let mut force = Lanes::<S>::splat(0.0);
                for j in 0..N {
                    let mass = mass.map_or(f64::from(u8::from(i == j)), |mass| mass[(i, j)]);
                    force = a[j].block::<S>(r).mul_add(Lanes::splat(mass), force);
                }
                self.force[i].set(r, force * rho);
            }
        }
        self.l = StageValues { lagrangian, times: &table.times, t: self.t, x, v: &self.v }.all::<S>(table.s);
    }
}

/// The linear maps from the s stages to s sample points between the nodes.
struct Between {
    /// The points, as fractions of the step.
    points: Stages,
    /// The maps to the values of the polynomial, and to its integral from 0.
    value: StageMap,
    integral: StageMap,
}

/// The part of a defect of values of a size that is beyond their round-off.
pub(crate) fn beyond_rounding(defect: f64, size: f64) -> f64 {
    // Written so that a NaN is returned.
    if defect <= VALUE_ROUND_OFF * size { 0.0 } else { defect - VALUE_ROUND_OFF * size }
}

/// The largest number of sets of sample points: their union divides a step of s stages into 16 s parts.
pub(crate) const SAMPLE_SETS: usize = 16;

impl Between {
    /// The maps of one set of sample points, for a number of stages from 1 to 16; computed once.
    fn of(s: usize, set: usize) -> &'static Between {
        static TABLES: [[OnceLock<Box<Between>>; SAMPLE_SETS]; MAX_STAGES] =
            [const { [const { OnceLock::new() }; SAMPLE_SETS] }; MAX_STAGES];
        let (s, set) = (s.clamp(1, MAX_STAGES), set.min(SAMPLE_SETS - 1));
        TABLES[s - 1][set].get_or_init(|| Box::new(Self::new(s, set)))
    }

    /// The values of a polynomial at the sample points.
    #[inline(always)]
    fn value<S: Simd>(&self, s: usize, y: &Stages, out: &mut Stages) {
        self.value.apply(y, s, out, Lanes::<S>::splat(0.0));
    }

    /// The integral of a polynomial up to the sample points, plus the value at the start of the step.
    #[inline(always)]
    fn grown<S: Simd>(&self, s: usize, h: f64, y: &Stages, from: f64, out: &mut Stages) {
        self.integral.apply(y, s, out, Lanes::<S>::splat(0.0));
        for r in 0..blocks::<S>(s) {
            out.set(r, out.block::<S>(r) * h + from);
        }
    }

    fn new(s: usize, set: usize) -> Self {
        let g = Coefficients::of(s);
        const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
        // Set 0: the Gauss points of s - 1 stages, which lie between those of s, and one point near the end of the
        // step, where the defect is largest. The other sets are equidistant, each shifted by the GOLDEN_RATIO ratio, so
        // that the gaps of their union are shortest.
        let inner = Coefficients::of(s.saturating_sub(1).max(1));
        let end = 0.5 * (1.0 + g.c[s - 1].0);
        let points = from_fn(|i| match set {
            0 if i + 1 < s => inner.c[i].0,
            0 => end,
            _ => (i.min(s - 1) as f64 + (set as f64 * GOLDEN_RATIO).fract()) / s as f64,
        });
        let [value, integral] = lagrange_rows(s, &points);
        Between { points: Stages(points), value: StageMap::new(&value, s), integral: StageMap::new(&integral, s) }
    }
}

/// The sum of the sizes of the last two coefficients of values at the stages.
#[inline(always)]
pub(crate) fn tail(g: &Coefficients, y: &Stages) -> f64 {
    let mut sum = 0.0;
    for row in &g.last {
        sum += weighted(row, y).abs();
    }
    sum
}

/// The weighted sum of the stages; the weights after the last stage are 0.
#[inline(always)]
pub(crate) fn weighted(weights: &[f64; MAX_STAGES], y: &Stages) -> f64 {
    let mut sum = 0.0;
    for i in 0..MAX_STAGES {
        sum += weights[i] * y.0[i];
    }
    sum
}

/// L, with `L_q + f`, the velocity `H_p` and `L_z`, at states of a Lagrangian that is given by a contact Hamiltonian.
#[inline(always)]
fn of_hamiltonian<S: Simd, L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    t: Lanes<S>,
    x: &VelocityPoint<N, Lanes<S>>,
    p: &SVector<Lanes<S>, N>,
) -> (Lanes<S>, ChartVector<N, Lanes<S>>) {
    let state = PhasePoint { q: x.q, p: *p, z: x.z };
    let none = || (Lanes::splat(f64::NAN), ChartVector { x: *p, y: *p, z: x.z });
    let Some((h, d)) = lagrangian.hamiltonian_with_gradient(t, &state) else { return none() };
    let mut force = -d.x;
    if const { L::HINTS.forced } {
        force += lagrangian.applied_force(t, &VelocityPoint { v: d.y, ..*x });
    }
    (p.dot(&d.y) - h, ChartVector { x: force, y: d.y, z: -d.z })
}

/// The evaluation of a defect sample, in SIMD lanes.
pub(crate) struct Compare<'a, L, P, const N: usize> {
    pub lagrangian: &'a L,
    pub transformation: &'a P,
    pub curve: &'a Curve<N>,
    pub set: usize,
}

impl<L: Lagrangian<N>, P: Parametrization<N>, const N: usize> WithSimd for Compare<'_, L, P, N> {
    type Output = DefectSample;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> DefectSample {
        let Compare { lagrangian, transformation, curve, set } = self;
        let Curve { s, t, h, .. } = *curve;
        let between = Between::of(s, set);
        let zero = Lanes::<S>::splat(0.0);
        let (mut v, mut q, mut f, mut y) = ([Stages::ZERO; N], [Stages::ZERO; N], [Stages::ZERO; N], [Stages::ZERO; N]);
        let (mut rate, mut one_minus_rho, mut l, mut z) =
            (Stages::ZERO, Stages::ZERO, Stages::ZERO, Stages([curve.z; MAX_STAGES]));
        for d in 0..N {
            between.value::<S>(s, &curve.v[d], &mut v[d]);
            between.grown::<S>(s, h, &curve.v[d], curve.q[d], &mut q[d]);
            between.value::<S>(s, &curve.force[d], &mut f[d]);
            between.grown::<S>(s, h, &curve.force[d], curve.p[d], &mut y[d]);
        }
        between.value::<S>(s, &curve.rate, &mut rate);
        between.grown::<S>(s, h, &curve.rate, 0.0, &mut one_minus_rho);
        between.value::<S>(s, &curve.l, &mut l);
        if curve.acts {
            between.grown::<S>(s, h, &curve.l, curve.z, &mut z);
        }
        let (mut of_value, mut kinetic, mut largest_l) = (zero, zero, zero);
        let (mut defect, mut size, mut of_z, mut size_z, mut all) = (zero, zero, zero, zero, zero);
        let (mut of_v, mut size_v) = (zero, zero);
        let mut other: Option<(Lanes<S>, ChartVector<N, Lanes<S>>)> = None;
        for r in 0..blocks::<S>(s) {
            let mut x = VelocityPoint {
                q: vector!(|d| q[d].block::<S>(r)),
                v: vector!(|d| v[d].block::<S>(r)),
                z: z.block::<S>(r),
            };
            // The factors from transformed time to t.
            let (mut slower, mut long) = (Lanes::<S>::splat(1.0), Lanes::<S>::splat(h));
            if !P::PHYSICAL {
                let rate = transformation.rate(&x.q);
                (slower, long) = (rate.recip(), long * rate);
                x.v *= slower;
            }
            let inverse = (Lanes::<S>::splat(1.0) - one_minus_rho.block::<S>(r)).recip();
            let (value, g) = match other.take() {
                Some(other) => other,
                None if const { L::HINTS.hamiltonian } => {
                    let p = vector!(|d| y[d].block::<S>(r) * inverse);
                    of_hamiltonian(lagrangian, between.points.block::<S>(r) * h + t, &x, &p)
                }
                None if const { L::HINTS.interpreted && P::PHYSICAL && by_two::<S>() } && r + 1 < blocks::<S>(s) => {
                    let pair = VelocityPoint {
                        q: vector!(|d| Two::<S>::of(&q[d], r)),
                        v: vector!(|d| Two::of(&v[d], r)),
                        z: Two::of(&z, r),
                    };
                    let (l, g) = lagrangian.with_gradient_and_force(Two::of(&between.points, r) * h + t, &pair);
                    other = Some((l.1, ChartVector { x: g.x.map(|e| e.1), y: g.y.map(|e| e.1), z: g.z.1 }));
                    (l.0, ChartVector { x: g.x.map(|e| e.0), y: g.y.map(|e| e.0), z: g.z.0 })
                }
                None => lagrangian.with_gradient_and_force(between.points.block::<S>(r) * h + t, &x),
            };
            let mut work = zero;
            let drag = (rate.block::<S>(r) * inverse * slower - g.z) * long;
            for d in 0..N {
                let p = y[d].block::<S>(r) * inverse;
                let force = f[d].block::<S>(r) * inverse * h;
                let of_force = p.mul_add(drag, force - g.x[d] * long);
                // For a Hamiltonian, `g.y` is `H_p`, which is compared with the velocity.
                let of_momentum = if const { L::HINTS.hamiltonian } {
                    let of_velocity = x.v[d] - g.y[d];
                    of_v = of_v.max(of_velocity.abs());
                    size_v = size_v.max(x.v[d].abs());
                    defect = defect.max(of_force.abs());
                    of_velocity
                } else {
                    let of_momentum = p - g.y[d];
                    defect = defect.max(of_force.abs()).max(of_momentum.abs());
                    of_momentum
                };
                size = size.max(p.abs()).max(force.abs());
                all += of_force * 0.0 + of_momentum * 0.0;
                work = p.mul_add(x.v[d], work);
            }
            let apart = l.block::<S>(r) * slower - value;
            of_value = of_value.max(apart.abs());
            kinetic = kinetic.max(work.abs() + (g.z * x.z).abs());
            largest_l = largest_l.max(value.abs());
            all += apart * 0.0;
            if curve.acts {
                of_z = of_z.max((apart * long).abs());
                size_z = size_z.max(z.block::<S>(r).abs()).max((value * long).abs());
                if const { L::HINTS.hamiltonian } {
                    // An action may vanish by cancellation of `p . v` and H.
                    size_z = size_z.max((work * long).abs());
                }
            }
        }
        // The maximum over lanes may hide a NaN. In `all` every value is multiplied by 0, which leaves a NaN for a NaN
        // or an infinity.
        if all.sum() != 0.0 {
            return DefectSample {
                defect: f64::INFINITY,
                of_momenta: f64::INFINITY,
                of_action: f64::INFINITY,
                of_value: f64::INFINITY,
                ..DefectSample::default()
            };
        }
        let relative = |defect: f64, size: f64| if defect > 0.0 { defect / size } else { 0.0 };
        let (mut size, size_z) = (size.reduce_max(), size_z.reduce_max());
        let (mut of_momenta, of_action) = (defect.reduce_max(), of_z.reduce_max());
        if const { L::HINTS.hamiltonian } {
            // The defect of the velocities in the units of the momenta, or of the velocities where all momenta are 0.
            let (of_v, size_v) = (of_v.reduce_max(), size_v.reduce_max());
            if size == 0.0 {
                size = size_v;
            }
            of_momenta = max_or_nan(of_momenta, relative(of_v, size_v) * size);
        }
        let defect = relative(of_momenta, size) + relative(of_action, size_z);
        let of_value = beyond_rounding(of_value.reduce_max(), largest_l.reduce_max());
        // The coefficients do not depend on the sample points; set 0 alone returns the estimate from them.
        if set > 0 {
            return DefectSample { defect, of_momenta, of_action, of_value, ..DefectSample::default() };
        }
        let mut fastest = 0.0;
        for v in v {
            for v in v.0 {
                fastest = max_or_nan(fastest, v.abs());
            }
        }
        let g = Coefficients::of(s);
        let mut expected = tail(g, &curve.rate) * h;
        for d in 0..N {
            expected += relative(tail(g, &curve.force[d]) * h, size) + relative(tail(g, &curve.v[d]), fastest);
        }
        if curve.acts {
            expected += relative(tail(g, &curve.l) * h, size_z);
        }
        let mut ends = [0.0; 2];
        for i in 0..2 {
            ends[i] = weighted(&g.ends[i], &curve.l) / curve.rates[i];
        }
        DefectSample {
            defect,
            of_momenta,
            of_action,
            size,
            size_z,
            expected,
            of_value,
            kinetic: kinetic.reduce_max(),
            ends,
            follows_a_jump: false,
        }
    }
}
