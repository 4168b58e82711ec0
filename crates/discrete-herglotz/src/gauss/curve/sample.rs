//! A curve at its sample points: the values of its polynomials, and L with its gradient there.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::curve::Curve;
use crate::gauss::curve::between::{Between, PointSets};
use crate::gauss::curve::comparison::Compare;
use crate::gauss::resolution::defect_sample::DefectSample;
use crate::gauss::system::{ByPoints, Coordinates, InRegisters, Typed, add_force, few_coordinates, zeros};
use crate::integration::StageVectors;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, Two, by_two};
use crate::numbers::registers::{MAX_STAGES, Stages, blocks};
use crate::system::caught;
use crate::{Point, System};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{
    ChartVector, Derivatives, Lagrangian, PhasePoint, Scalar, ScalarSystem, Slopes, VelocityPoint, vector,
};
use pulp::{Simd, WithSimd};

/// The part of a defect sample that evaluates L.
pub(crate) trait SampleKernel {
    /// The defect of a curve, in transformed time if `transformed`, at sets of sample points.
    fn sample_defect(&self, arch: Instructions, curve: &Curve, transformed: bool, sets: PointSets) -> DefectSample;
}

impl<L: Lagrangian<N>, const N: usize> SampleKernel for Typed<'_, L, N> {
    fn sample_defect(&self, arch: Instructions, curve: &Curve, transformed: bool, sets: PointSets) -> DefectSample {
        let mut sample = Sample::of(arch, curve, sets);
        arch.dispatch(Evaluate::<L, N> { lagrangian: self.0, transformed, curve, sample: &mut sample });
        arch.dispatch(Compare { curve, sample: &sample, transformed, hamiltonian: L::HINTS.hamiltonian, sets })
    }
}

impl SampleKernel for ByPoints<'_> {
    fn sample_defect(&self, arch: Instructions, curve: &Curve, transformed: bool, sets: PointSets) -> DefectSample {
        if let Some(kernels) = &self.kernels {
            // An infinite defect is that of values that are not finite.
            let undefined = || DefectSample { defect: f64::INFINITY, ..DefectSample::default() };
            return caught(|| kernels.sample_defect(arch, curve, transformed, sets), undefined);
        }
        let mut sample = Sample::of(arch, curve, sets);
        sample.evaluate(&*self.system, curve);
        arch.dispatch(Compare { curve, sample: &sample, transformed, hamiltonian: false, sets })
    }
}

impl<F: ScalarSystem> SampleKernel for InRegisters<F> {
    fn sample_defect(&self, arch: Instructions, curve: &Curve, transformed: bool, sets: PointSets) -> DefectSample {
        few_coordinates!(self, curve.q.len(), few => few.sample_defect(arch, curve, transformed, sets), {
            let mut sample = Sample::of(arch, curve, sets);
            arch.dispatch(EvaluateInRegisters { system: &*self.0, curve, sample: &mut sample });
            arch.dispatch(Compare { curve, sample: &sample, transformed, hamiltonian: false, sets })
        })
    }
}

/// The evaluation of a system over scalars at the sample points.
struct EvaluateInRegisters<'b, F> {
    system: &'b F,
    curve: &'b Curve,
    sample: &'b mut Sample,
}

impl<F: ScalarSystem> WithSimd for EvaluateInRegisters<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _simd: S) {
        let (mut r, m) = (0, blocks::<S>(self.sample.between.count));
        while r < m {
            r = if const { by_two::<S>() } && r + 1 < m {
                self.take::<S, Two<S>>(r)
            } else {
                self.take::<S, Lanes<S>>(r)
            };
        }
    }
}

impl<F: ScalarSystem> EvaluateInRegisters<'_, F> {
    /// Evaluates L at the points in the registers that T holds, from the r-th on; returns the index of the next register.
    #[inline(always)]
    fn take<S: Simd, T: Registers<S>>(&mut self, r: usize) -> usize {
        let Sample { between, v, q, z, value, force, momentum, slope, .. } = &mut *self.sample;
        let n = q.len();
        let (mut at_q, mut at_v) = (Coordinates::<T>::new(), Coordinates::<T>::new());
        for d in 0..n {
            at_q.push(T::of(&q[d], r));
            at_v.push(T::of(&v[d], r));
        }
        let (mut push, mut p, mut rate) = (zeros::<T>(n), zeros::<T>(n), T::zero());
        let t = T::of(&between.points, r) * self.curve.h + self.curve.t;
        let to = Slopes { q: &mut push, v: &mut p, z: &mut rate };
        let l = self.system.with_gradient::<T, 0>(t, &at_q, &at_v, T::of(z, r), to);
        if self.system.has_force() {
            add_force(self.system, t, (&at_q, &at_v, T::of(z, r)), &mut push);
        }
        for i in 0..T::COUNT {
            value.set(r + i, l.register(i));
            for d in 0..n {
                force[d].set(r + i, push[d].register(i));
                momentum[d].set(r + i, p[d].register(i));
            }
            slope.set(r + i, rate.register(i));
        }
        r + T::COUNT
    }
}

/// A curve at sets of sample points.
pub(super) struct Sample {
    pub between: &'static Between,
    /// The polynomials and their integrals: velocities, positions, forces, momenta `rho p`.
    pub v: StageVectors,
    pub q: StageVectors,
    pub f: StageVectors,
    pub y: StageVectors,
    pub rate: Stages,
    pub one_minus_rho: Stages,
    pub l: Stages,
    pub z: Stages,
    /// L, and its gradient with the applied force: `L_q + f`, `L_v` and `L_z`; for a Lagrangian that is given by a contact
    /// Hamiltonian with `H_p` in the place of `L_v`.
    pub value: Stages,
    pub force: StageVectors,
    pub momentum: StageVectors,
    pub slope: Stages,
    /// The rates dt/dtau in transformed time.
    pub dt_dtau: Stages,
}

impl Sample {
    /// The polynomials of a curve at sets of sample points. Inlined, since a sample is large: it is made in its place.
    #[inline(always)]
    fn of(arch: Instructions, curve: &Curve, sets: PointSets) -> Self {
        let zero = || StageVectors::from_elem(Stages::ZERO, curve.q.len());
        let mut sample = Sample {
            between: Between::of(curve.s, sets),
            v: zero(),
            q: zero(),
            f: zero(),
            y: zero(),
            rate: Stages::ZERO,
            one_minus_rho: Stages::ZERO,
            l: Stages::ZERO,
            z: Stages([curve.z; MAX_STAGES]),
            value: Stages::ZERO,
            force: zero(),
            momentum: zero(),
            slope: Stages::ZERO,
            dt_dtau: Stages::ZERO,
        };
        arch.dispatch(Interpolate { curve, sample: &mut sample });
        sample
    }

    /// Evaluates L and its gradient at one point after another; the values at the last one are repeated in the padding.
    fn evaluate(&mut self, system: &dyn System, curve: &Curve) {
        let Sample { between, v, q, z, value, force, momentum, slope, .. } = self;
        let forced = system.hints().forced;
        for i in 0..between.count {
            let of = |stages: &[Stages]| stages.iter().map(|x| x.0[i]).collect();
            let (t, x) = (between.points.0[i] * curve.h + curve.t, Point { q: of(q), v: of(v), z: z.0[i] });
            let (l, mut g) = (system.value(t, &x), system.gradient(t, &x));
            if forced {
                g.x += system.applied_force(t, &x);
            }
            let set =
                |to: &mut Stages, x: f64| to.0[i..if i + 1 == between.count { MAX_STAGES } else { i + 1 }].fill(x);
            set(value, l);
            set(slope, g.z);
            for d in 0..g.x.len() {
                set(&mut force[d], g.x[d]);
                set(&mut momentum[d], g.y[d]);
            }
        }
    }
}

/// The evaluation of the polynomials of a curve.
struct Interpolate<'b> {
    curve: &'b Curve,
    sample: &'b mut Sample,
}

impl WithSimd for Interpolate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Interpolate { curve, sample } = self;
        let (s, h, between) = (curve.s, curve.h, sample.between);
        for d in 0..curve.q.len() {
            between.value::<S>(s, &curve.v[d], &mut sample.v[d]);
            between.grown::<S>(s, h, &curve.v[d], curve.q[d], &mut sample.q[d]);
            between.value::<S>(s, &curve.force[d], &mut sample.f[d]);
            between.grown::<S>(s, h, &curve.force[d], curve.p[d], &mut sample.y[d]);
        }
        between.value::<S>(s, &curve.rate, &mut sample.rate);
        between.grown::<S>(s, h, &curve.rate, 0.0, &mut sample.one_minus_rho);
        between.value::<S>(s, &curve.l, &mut sample.l);
        if curve.acts {
            between.grown::<S>(s, h, &curve.l, curve.z, &mut sample.z);
        }
    }
}

/// The evaluation of L and of its gradient at the sample points.
struct Evaluate<'b, L, const N: usize> {
    lagrangian: &'b L,
    transformed: bool,
    curve: &'b Curve,
    sample: &'b mut Sample,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for Evaluate<'_, L, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Evaluate { lagrangian, transformed, curve, sample } = self;
        let Sample { between, v, q, y, one_minus_rho, z, value, force, momentum, slope, dt_dtau, .. } = sample;
        let (Some(v), Some(q), Some(y)) = (v.first_chunk(), q.first_chunk(), y.first_chunk()) else { return };
        let (Some(force), Some(momentum)) = (force.first_chunk_mut(), momentum.first_chunk_mut()) else { return };
        let (points, m) = (&between.points, blocks::<S>(between.count));
        let mut at = AtPoints { lagrangian, curve, points, v, q, y, one_minus_rho, z, value, force, momentum, slope };
        let mut r = 0;
        while r < m {
            if const { L::HINTS.interpreted && !L::HINTS.hamiltonian && by_two::<S>() } && !transformed && r + 1 < m {
                r = at.take::<S, Two<S>>(r, &at.point(r));
                continue;
            }
            let mut point = at.point::<S, Lanes<S>>(r);
            if const { L::HINTS.time_transformation } && transformed {
                let rate = lagrangian.dt_dtau(&point.q);
                point.v *= rate.recip();
                dt_dtau.set(r, rate);
            }
            r = if const { L::HINTS.hamiltonian } {
                at.take_hamiltonian::<S>(r, &point)
            } else {
                at.take::<S, Lanes<S>>(r, &point)
            };
        }
    }
}

/// The sample points for N coordinates: the fields of [`Sample`] of the same names.
struct AtPoints<'k, L, const N: usize> {
    lagrangian: &'k L,
    curve: &'k Curve,
    points: &'k Stages,
    v: &'k [Stages; N],
    q: &'k [Stages; N],
    y: &'k [Stages; N],
    one_minus_rho: &'k Stages,
    z: &'k Stages,
    value: &'k mut Stages,
    force: &'k mut [Stages; N],
    momentum: &'k mut [Stages; N],
    slope: &'k mut Stages,
}

impl<L: Lagrangian<N>, const N: usize> AtPoints<'_, L, N> {
    /// The point of the curve in the registers that T holds, from the r-th on.
    #[inline(always)]
    fn point<S: Simd, T: Registers<S>>(&self, r: usize) -> VelocityPoint<N, T> {
        VelocityPoint {
            q: vector!(|d| T::of(&self.q[d], r)),
            v: vector!(|d| T::of(&self.v[d], r)),
            z: T::of(self.z, r),
        }
    }

    /// The times of these points.
    #[inline(always)]
    fn time<S: Simd, T: Registers<S>>(&self, r: usize) -> T {
        T::of(self.points, r) * self.curve.h + self.curve.t
    }

    /// Evaluates L at a point; returns the index of the next register.
    #[inline(always)]
    fn take<S: Simd, T: Registers<S>>(&mut self, r: usize, point: &VelocityPoint<N, T>) -> usize {
        let (l, g) = self.lagrangian.with_gradient_and_force(self.time::<S, T>(r), point);
        self.store(r, l, &g)
    }

    /// The same for a Lagrangian that is given by a contact Hamiltonian, at a state.
    #[inline(always)]
    fn take_hamiltonian<S: Simd>(&mut self, r: usize, x: &VelocityPoint<N, Lanes<S>>) -> usize {
        let inverse = (Lanes::<S>::splat(1.0) - self.one_minus_rho.block::<S>(r)).recip();
        let p: SVector<Lanes<S>, N> = vector!(|d| self.y[d].block::<S>(r) * inverse);
        let (l, g) = of_hamiltonian(self.lagrangian, self.time::<S, Lanes<S>>(r), x, &p);
        self.store(r, l, &g)
    }

    /// Stores L and its gradient.
    #[inline(always)]
    fn store<S: Simd, T: Registers<S>>(&mut self, r: usize, l: T, g: &ChartVector<N, T>) -> usize {
        for i in 0..T::COUNT {
            self.value.set(r + i, l.register(i));
            for d in 0..N {
                self.force[d].set(r + i, g.x[d].register(i));
                self.momentum[d].set(r + i, g.y[d].register(i));
            }
            self.slope.set(r + i, g.z.register(i));
        }
        r + T::COUNT
    }
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
    (dot(p, d.y) - h, ChartVector { x: force, y: d.y, z: -d.z })
}
