//! Splittings with trajectories in lanes.

use super::pack::Pack;
use crate::gauss::instructions::Instructions;
use crate::splitting::drag::{Drag, Drift};
use crate::splitting::linear_drag::{Stage, SubstepTable};
use crate::splitting::separable::SeparableForm;
use crate::{InputError, SplittingScheme};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint};
use pulp::{Simd, WithSimd};
use std::borrow::Cow;

/// The steps of a [`Splitting`](crate::Splitting), for many motions of one Lagrangian.
pub(super) struct SplittingPacks<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    drag: Drag<N>,
    table: SubstepTable,
    h: f64,
    t0: f64,
    steps: usize,
}

impl<'a, L: Lagrangian<N>, const N: usize> SplittingPacks<'a, L, N> {
    /// With what is read of L at a start.
    pub fn new(
        lagrangian: &'a L,
        scheme: &SplittingScheme,
        (h, steps): (f64, usize),
        t0: f64,
        state: &PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t0, state)?;
        let drag = Drag::of(&form, t0, state)?;
        let table = SubstepTable::new(scheme, h, |s| drag.drift(&lagrangian, t0, s));
        Ok(SplittingPacks { form, drag, table, h, t0, steps })
    }

    /// Takes all steps of some motions, in place. One that is not finite at its start or its end is not finite then.
    pub fn run(&self, instructions: Instructions, states: &mut [PhasePoint<N>], action: bool) {
        if action {
            instructions.dispatch(All::<_, N, true> { packs: self, states });
        } else {
            instructions.dispatch(All::<_, N, false> { packs: self, states });
        }
    }
}

/// The registers of a pack: as many as hide the latency of a sum of products, and leave room for what else a step holds.
const fn registers(n: usize) -> usize {
    match n {
        1 => 3,
        2 => 2,
        _ => 1,
    }
}

/// All motions of a slice in the lanes of one instruction set.
struct All<'s, 'a, L, const N: usize, const ACTION: bool> {
    packs: &'s SplittingPacks<'a, L, N>,
    states: &'s mut [PhasePoint<N>],
}

impl<L: Lagrangian<N>, const N: usize, const ACTION: bool> WithSimd for All<'_, '_, L, N, ACTION> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let All { packs, states } = self;
        match const { registers(N) } {
            3 => packs.all::<S, 3, ACTION>(states),
            2 => packs.all::<S, 2, ACTION>(states),
            _ => packs.all::<S, 1, ACTION>(states),
        }
    }
}

/// What a step moves, as [`Motion`](crate::splitting) does for one motion.
#[derive(Clone, Copy)]
struct Moving<S: Simd, const K: usize, const N: usize> {
    q: SVector<Pack<S, K>, N>,
    p: SVector<Pack<S, K>, N>,
    /// What rounding has taken from the damping of p so far.
    carry: SVector<Pack<S, K>, N>,
    z: Pack<S, K>,
    force: SVector<Pack<S, K>, N>,
    value: Pack<S, K>,
}

impl<L: Lagrangian<N>, const N: usize> SplittingPacks<'_, L, N> {
    #[inline(always)]
    fn all<S: Simd, const K: usize, const ACTION: bool>(&self, states: &mut [PhasePoint<N>]) {
        let zero = Pack::<S, K>::splat(0.0);
        for some in states.chunks_mut(Pack::<S, K>::COUNT) {
            // What is beyond the last repeats it.
            let last = some.len() - 1;
            let (q, p) = (
                SVector::from_fn(|d, _| Pack::from_lanes(|i| some[i.min(last)].q[d])),
                SVector::from_fn(|d, _| Pack::from_lanes(|i| some[i.min(last)].p[d])),
            );
            let z = Pack::from_lanes(|i| some[i.min(last)].z);
            let mut m = Moving { q, p, carry: SVector::from_element(zero), z, force: q, value: zero };
            self.take_steps::<S, K, ACTION>(&mut m);
            for (i, state) in some.iter_mut().enumerate() {
                for d in 0..N {
                    (state.q[d], state.p[d]) = (m.q[d].lanes()[i], m.p[d].lanes()[i]);
                }
                state.z = m.z.lanes()[i];
            }
        }
    }

    /// The operations of a single run, in its order.
    #[inline(always)]
    fn take_steps<S: Simd, const K: usize, const ACTION: bool>(&self, m: &mut Moving<S, K, N>) {
        let SplittingPacks { t0, h, steps, .. } = self;
        let mut table = Cow::Borrowed(&self.table);
        self.take_force(m, *t0);
        for k in 0..*steps {
            let t = t0 + k as f64 * h;
            self.set_time(&mut table, t);
            for stage in if k == 0 { &table.first } else { &table.joined } {
                self.kick_and_drift::<S, K, ACTION>(m, stage);
                self.take_force(m, t + stage.time);
            }
        }
        self.kick_and_drift::<S, K, ACTION>(m, &table.closing);
    }

    #[inline(always)]
    fn take_force<S: Simd, const K: usize>(&self, m: &mut Moving<S, K, N>, t: f64) {
        let zero = Pack::splat(0.0);
        let rest = VelocityPoint { q: m.q, v: SVector::from_element(zero), z: zero };
        (m.value, m.force) = self.form.lagrangian.with_force(Pack::splat(t), &rest);
    }

    #[inline(always)]
    fn kick_and_drift<S: Simd, const K: usize, const ACTION: bool>(&self, m: &mut Moving<S, K, N>, stage: &Stage) {
        let kick = Pack::splat(stage.kick);
        if ACTION {
            m.z += kick * m.value;
        }
        for d in 0..N {
            m.p[d] += kick * m.force[d];
        }
        let Drift { length, damping, lift } = stage.drift;
        let v = velocity(&self.form, &m.p);
        if ACTION {
            m.z = m.z + (Pack::splat(damping) * m.z + Pack::splat(lift) * m.p.dot(&v));
        }
        for d in 0..N {
            m.q[d] += Pack::splat(length) * v[d];
            let before = m.p[d];
            let change = Pack::splat(damping) * before + m.carry[d];
            m.p[d] = before + change;
            m.carry[d] = change - (m.p[d] - before);
        }
    }

    /// The drifts of the step from the time t, where they depend on it.
    fn set_time(&self, table: &mut Cow<'_, SubstepTable>, t: f64) {
        if let Drag::Timed { .. } = self.drag {
            let SubstepTable { first, joined, closing } = table.to_mut();
            for stage in first.iter_mut().chain(joined).chain([closing]) {
                stage.drift = self.drag.drift(&self.form.lagrangian, t + (stage.time - stage.span), stage.span);
            }
        }
    }
}

/// `M^-1 p`, by the operations of a product of a matrix with one vector, in their order.
#[inline(always)]
pub(super) fn velocity<L, S: Simd, const K: usize, const N: usize>(
    form: &SeparableForm<L, N>,
    p: &SVector<Pack<S, K>, N>,
) -> SVector<Pack<S, K>, N> {
    let Some(inverse) = &form.inverse else { return *p };
    SVector::from_fn(|i, _| {
        let mut sum = p[0] * inverse[(i, 0)];
        for j in 1..N {
            sum += p[j] * inverse[(i, j)];
        }
        sum
    })
}
