//! Derivatives of L and of the force with respect to parameters and time, at a point.

use crate::integration::QuantityDerivatives;
use crate::numbers::lanes::{Lanes, branched, forget_branches};
use crate::numbers::registers::{Stages, blocks};
use crate::sensitivity::linear_stages::StageTangent;
use crate::sensitivity::stage_derivatives::StageDerivatives;
use contact_geom::nalgebra::SVector;
use contact_geom::support::{KernelDual, seed};
use contact_geom::{ChartVector, Derivatives, Dual, Parametric, PhasePoint, VelocityPoint, vector};
use num_traits::{One, Zero};
use pulp::Simd;

pub(crate) use crate::sensitivity::parametric_system::Quantity;

/// A number with a derivative along one direction and the gradient of both.
type WithGradient<const N: usize> = Dual<Dual<f64, ChartVector<N>>, SVector<Dual<f64, ChartVector<N>>, 1>>;

/// A number with its derivatives along two directions, and the mixed one.
type AlongTwo = Dual<Dual<f64, SVector<f64, 1>>, SVector<Dual<f64, SVector<f64, 1>>, 1>>;

/// Evaluates derivatives with respect to the parameters of a Lagrangian, with buffers for their values.
pub(crate) struct ParameterDerivatives<const N: usize> {
    theta: Vec<f64>,
    with_gradient: Vec<WithGradient<N>>,
    along_two: Vec<AlongTwo>,
    simple: Vec<Dual<f64, SVector<f64, 1>>>,
}

impl<const N: usize> ParameterDerivatives<N> {
    pub fn new(lagrangian: &impl Parametric<N>) -> Self {
        let theta = lagrangian.parameters();
        ParameterDerivatives {
            with_gradient: theta.iter().map(|x| WithGradient::from(*x)).collect(),
            along_two: theta.iter().map(|x| AlongTwo::from(*x)).collect(),
            simple: theta.iter().map(|x| Dual::from(*x)).collect(),
            theta,
        }
    }

    /// The number of parameters.
    pub fn count(&self) -> usize {
        self.theta.len()
    }

    /// The derivatives at a point.
    #[inline(never)]
    pub fn at<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        quantity: Quantity,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> QuantityDerivatives<N> {
        let y = seed(&ChartVector::from(*x));
        let (q, v, z) = (y.x.map(Dual::constant), y.y.map(Dual::constant), Dual::constant(y.z));
        let time = self.move_along(quantity, t);
        let l = lagrangian.value_at(&self.with_gradient, time, &q, &v, z).d[0];
        self.rest(quantity);
        QuantityDerivatives { l: l.re, gradient: l.d, force: self.force(lagrangian, quantity, t, x, &SVector::zeros()) }
    }

    /// The same derivatives of a contact Hamiltonian at a state: `H_theta` in the place of `L_theta`,
    /// `(H_qtheta, H_ptheta, H_ztheta)`, and the derivative of the force with that of the velocity `H_p`. NaN for a
    /// Lagrangian that is not given by one.
    #[inline(never)]
    pub fn of_hamiltonian<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        quantity: Quantity,
        t: f64,
        state: &PhasePoint<N>,
    ) -> QuantityDerivatives<N> {
        let y: PhasePoint<N, _> = seed(&ChartVector::from(*state)).into();
        let (q, p, z) = (y.q.map(Dual::constant), y.p.map(Dual::constant), Dual::constant(y.z));
        let time = self.move_along(quantity, t);
        let h = lagrangian.hamiltonian_at(&self.with_gradient, time, &PhasePoint { q, p, z });
        self.rest(quantity);
        let Some(WithGradient { re: h, d }) = h else {
            let none = SVector::from_element(f64::NAN);
            return QuantityDerivatives {
                l: f64::NAN,
                gradient: ChartVector { x: none, y: none, z: f64::NAN },
                force: none,
            };
        };
        let x = VelocityPoint { q: state.q, v: h.d.y, z: state.z };
        let force = self.force(lagrangian, quantity, t, &x, &d[0].d.y);
        QuantityDerivatives { l: d[0].re, gradient: d[0].d, force }
    }

    /// The derivative of the momentum `L_v` of a given velocity, at a state that has this velocity.
    pub fn of_momentum<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        quantity: Quantity,
        t: f64,
        (x, p): (&VelocityPoint<N>, &SVector<f64, N>),
    ) -> SVector<f64, N> {
        if const { L::HINTS.hamiltonian } {
            // From `H_p = v`, with `L_vv = H_pp^-1`.
            let state = PhasePoint { q: x.q, p: *p, z: x.z };
            return -(lagrangian.hessian(t, x).vv * self.of_hamiltonian(lagrangian, quantity, t, &state).gradient.y);
        }
        self.at(lagrangian, quantity, t, x).gradient.y
    }

    /// Seeds the derivative in a quantity; returns the time.
    fn move_along(&mut self, quantity: Quantity, t: f64) -> WithGradient<N> {
        let one = SVector::<Dual<f64, ChartVector<N>>, 1>::from_element(Dual::from(1.0));
        let mut time = WithGradient::from(t);
        match quantity {
            Quantity::Parameter(k) => self.with_gradient[k].d = one,
            Quantity::Time => time.d = one,
        }
        time
    }

    /// Removes the seed.
    fn rest(&mut self, quantity: Quantity) {
        if let Quantity::Parameter(k) = quantity {
            self.with_gradient[k].d = SVector::<_, 1>::from_element(Dual::from(0.0));
        }
    }

    /// `f_theta` at a point whose velocity has the derivative `dv`; 0 without a force.
    fn force<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        quantity: Quantity,
        t: f64,
        x: &VelocityPoint<N>,
        dv: &SVector<f64, N>,
    ) -> SVector<f64, N> {
        if const { !L::HINTS.forced } {
            return SVector::zeros();
        }
        let one = SVector::<f64, 1>::from_element(1.0);
        let moving = SVector::<Dual<f64, SVector<f64, 1>>, N>::from_fn(|i, _| Dual { re: x.v[i], d: [dv[i]].into() });
        let y = VelocityPoint { q: x.q.map(Dual::from), v: moving, z: Dual::from(x.z) };
        let mut time = Dual::from(t);
        if let Quantity::Parameter(k) = quantity {
            self.simple[k].d = one;
        } else {
            time.d = one;
        }
        let force = lagrangian.force_at(&self.simple, time, &y).map(|f| f.d[0]);
        if let Quantity::Parameter(k) = quantity {
            self.simple[k].d = SVector::<f64, 1>::zeros();
        }
        force
    }

    /// `d(rho L_theta)[w] + rho f_theta . w_q` at a stage, for the tangent `w = (w_q, w_v, w_z, w_rho)`.
    #[inline(always)]
    pub fn along<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        quantity: Quantity,
        (t, x, rho): (f64, &VelocityPoint<N>, f64),
        (w, w_rho): (&ChartVector<N>, f64),
    ) -> f64 {
        let moving = |re: f64, d: f64| AlongTwo::constant(Dual { re, d: SVector::<f64, 1>::from_element(d) });
        let q = SVector::<AlongTwo, N>::from_fn(|d, _| moving(x.q[d], w.x[d]));
        let v = SVector::<AlongTwo, N>::from_fn(|d, _| moving(x.v[d], w.y[d]));
        let one = SVector::<Dual<f64, SVector<f64, 1>>, 1>::from_element(Dual::from(1.0));
        let mut time = AlongTwo::from(t);
        if let Quantity::Parameter(k) = quantity {
            self.along_two[k].d = one;
        } else {
            time.d = one;
        }
        let l = lagrangian.value_at(&self.along_two, time, &q, &v, moving(x.z, w.z)).d[0];
        if let Quantity::Parameter(k) = quantity {
            self.along_two[k].d = SVector::<_, 1>::from_element(Dual::from(0.0));
        }
        let force = self.force(lagrangian, quantity, t, x, &SVector::zeros());
        w_rho * l.re + rho * (l.d[0] + force.dot(&w.x))
    }

    /// The same at all stages in SIMD lanes, multiplied by the weights and summed; `None` with a force, and for many
    /// parameters.
    #[inline(always)]
    pub fn sum_along<S: Simd, L: Parametric<N>>(
        &self,
        lagrangian: &L,
        quantity: Quantity,
        at: &StageDerivatives,
        w: &StageTangent,
        weights: &Stages,
    ) -> Option<f64> {
        if const { L::HINTS.forced } || self.theta.len() > MAX_PARAMETERS_IN_LANES {
            return None;
        }
        forget_branches();
        let mut theta = [Nested::<S>::zero(); MAX_PARAMETERS_IN_LANES];
        for (nested, theta) in theta.iter_mut().zip(&self.theta) {
            *nested = Nested::<S>::from(*theta);
        }
        if let Quantity::Parameter(k) = quantity {
            theta[k].d[0] = KernelDual::one();
        }
        let (at_q, at_v, w_q, w_v) = (&at.q[..N], &at.v[..N], &w.q[..N], &w.v[..N]);
        let mut sum = Lanes::<S>::splat(0.0);
        for r in 0..blocks::<S>(at.s) {
            let q: SVector<Nested<S>, N> = vector!(|d| moving(&at_q[d], &w_q[d], r));
            let v: SVector<Nested<S>, N> = vector!(|d| moving(&at_v[d], &w_v[d], r));
            let mut time = Nested::<S>::constant(KernelDual::constant(at.times.block::<S>(r)));
            if quantity == Quantity::Time {
                time.d[0] = KernelDual::one();
            }
            let l = lagrangian.value_at(&theta[..self.theta.len()], time, &q, &v, moving(&at.z, &w.z, r)).d[0];
            let along = w.r.block::<S>(r) * l.re + at.rho.block::<S>(r) * l.d[0];
            sum = weights.block::<S>(r).mul_add(along, sum);
        }
        (!branched()).then(|| sum.sum())
    }
}

/// A block of stage values with their derivatives along a tangent.
#[inline(always)]
fn moving<S: Simd>(re: &Stages, d: &Stages, r: usize) -> Nested<S> {
    Nested::<S>::constant(KernelDual { re: re.block::<S>(r), d: vector!(|_| d.block::<S>(r)) })
}

/// The largest number of parameters whose numbers with derivatives, in SIMD lanes, are on the stack.
const MAX_PARAMETERS_IN_LANES: usize = 8;

/// SIMD lanes of numbers with their derivatives along two directions, and the mixed one.
type Nested<S> =
    KernelDual<KernelDual<Lanes<S>, SVector<Lanes<S>, 1>>, SVector<KernelDual<Lanes<S>, SVector<Lanes<S>, 1>>, 1>>;
