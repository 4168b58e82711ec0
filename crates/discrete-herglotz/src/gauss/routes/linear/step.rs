//! Steps of a linear motion by its precomputed map.

use crate::gauss::dense::StepStart;
use crate::gauss::routes::linear::coefficients::StepMap;
use crate::numbers::compensated::{CompensatedSum, Unevaluated, copy_values};
use pulp::{Simd, WithSimd};

/// The kernel of a number of steps, compiled for instruction sets with fused multiply-add. The start of the last step is
/// written to `last`. The result is whether the state at the end is finite; if it is not, the state is unchanged.
pub(crate) struct Advance<'a> {
    pub map: &'a StepMap,
    pub q: &'a mut [CompensatedSum],
    pub v: &'a mut [CompensatedSum],
    pub z: &'a mut CompensatedSum,
    /// Workspace for many coordinates.
    pub trial: &'a mut [Vec<CompensatedSum>; 4],
    pub last: &'a mut StepStart,
    pub steps: usize,
}

impl WithSimd for Advance<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> bool {
        match self.q.len() {
            1 => self.of_few::<1>(),
            2 => self.of_few::<2>(),
            3 => self.of_few::<3>(),
            4 => self.of_few::<4>(),
            n => {
                let Advance { map, q, v, z, trial, last, steps } = self;
                let [trial_q, trial_v, q_before, v_before] = trial;
                advance(map, n, [q, v], z, [trial_q, trial_v, q_before, v_before], last, steps)
            }
        }
    }
}

impl Advance<'_> {
    /// The steps for a constant number of coordinates, with the workspace on the stack.
    #[inline(always)]
    fn of_few<const N: usize>(self) -> bool {
        let Advance { map, q, v, z, last, steps, .. } = self;
        let zero = CompensatedSum { value: 0.0, rest: 0.0 };
        let (mut trial_q, mut trial_v, mut q_before, mut v_before) = ([zero; N], [zero; N], [zero; N], [zero; N]);
        let trial = [&mut trial_q[..], &mut trial_v[..], &mut q_before[..], &mut v_before[..]];
        advance(map, N, [&mut q[..N], &mut v[..N]], z, trial, last, steps)
    }
}

/// See [`Advance`]; n is a constant for few coordinates.
#[inline(always)]
fn advance(
    map: &StepMap,
    n: usize,
    [q, v]: [&mut [CompensatedSum]; 2],
    z: &mut CompensatedSum,
    [trial_q, trial_v, q_before, v_before]: [&mut [CompensatedSum]; 4],
    last: &mut StepStart,
    steps: usize,
) -> bool {
    let mut trial_z = *z;
    trial_q.copy_from_slice(q);
    trial_v.copy_from_slice(v);
    for left in (0..steps).rev() {
        if left == 0 {
            copy_values(trial_q, &mut last.q);
            copy_values(trial_v, &mut last.y);
            last.z = trial_z.value;
        }
        take_step(map, n, [trial_q, trial_v], &mut trial_z, [q_before, v_before]);
    }
    let mut finite = trial_z.value.is_finite();
    for (q, v) in trial_q.iter().zip(trial_v.iter()) {
        finite &= q.value.is_finite() && v.value.is_finite();
    }
    if finite {
        q.copy_from_slice(trial_q);
        v.copy_from_slice(trial_v);
        *z = trial_z;
    }
    finite
}

/// Takes one step.
#[inline(always)]
fn take_step(
    map: &StepMap,
    n: usize,
    [q, v]: [&mut [CompensatedSum]; 2],
    z: &mut CompensatedSum,
    [q_before, v_before]: [&mut [CompensatedSum]; 2],
) {
    q_before.copy_from_slice(q);
    v_before.copy_from_slice(v);
    let (q_before, v_before) = (&*q_before, &*v_before);
    if let Some(action) = &map.action {
        let (place, linear) = (&action.equilibrium_position[..n], &action.linear[..n]);
        let rows = action.quadratic[..n * n].chunks_exact(n).zip(linear);
        let mut change = action.constant;
        for ((row, [of_q, of_v]), ((q, place_of_q), v)) in rows.zip(q_before.iter().zip(place).zip(v_before)) {
            let (mut of_q, mut of_v) = (*of_q, *of_v);
            for ([qq, qv, vv], ((q, place_of_q), v)) in row.iter().zip(q_before.iter().zip(place).zip(v_before)) {
                of_q += qq * (q.value - place_of_q) + qv * v.value;
                of_v += vv * v.value;
            }
            change += of_q * (q.value - place_of_q) + of_v * v.value;
        }
        z.add(Unevaluated { head: change, tail: 0.0 } + map.grow * z.value);
    }
    let rows = map.rows[..n * n].chunks_exact(n).zip(&map.shifts[..n]);
    for ((row, [dq, dv]), (q, v)) in rows.zip(q.iter_mut().zip(v)) {
        let (mut dq, mut dv) = (*dq, *dv);
        for ([qq, qv, vq, vv], (q, v)) in row.iter().zip(q_before.iter().zip(v_before)) {
            dq = dq.plus(qq.times(*q).plus(qv.times(*v)));
            dv = dv.plus(vq.times(*q).plus(vv.times(*v)));
        }
        q.add(dq);
        v.add(dv);
    }
}
