//! Kernels of collocation for systems that are written over scalars, with any number of coordinates.

use crate::gauss::curve::SampleKernel;
use crate::gauss::routes::general::GeneralKernel;
use crate::gauss::routes::separable::SeparableKernel;
use crate::system::Kernels;
use contact_geom::{Scalar, ScalarSystem, SlicesVisitor};
use smallvec::SmallVec;
use std::rc::Rc;
use std::sync::Arc;

/// One number for each coordinate, without memory on the heap for up to sixteen.
pub(crate) type Coordinates<T> = SmallVec<[T; 16]>;

/// Zeros for n coordinates.
#[inline(always)]
pub(crate) fn zeros<T: Scalar>(n: usize) -> Coordinates<T> {
    let mut all = Coordinates::new();
    for _ in 0..n {
        all.push(T::zero());
    }
    all
}

/// Adds the applied force at a point.
#[inline(always)]
pub(crate) fn add_force<T: Scalar>(system: &impl ScalarSystem, t: T, (q, v, z): (&[T], &[T], T), to: &mut [T]) {
    let mut applied = zeros::<T>(to.len());
    system.applied_force::<T, 0>(t, q, v, z, &mut applied);
    for (sum, force) in to.iter_mut().zip(applied) {
        *sum += force;
    }
}

/// What evaluates a system at the stages of a step.
pub(crate) trait StageKernels: GeneralKernel + SeparableKernel + SampleKernel {}

impl<T: GeneralKernel + SeparableKernel + SampleKernel> StageKernels for T {}

/// The kernels of a system, without its type.
pub(crate) type SharedKernels = Rc<dyn StageKernels>;

/// Makes the kernels of a Lagrangian that is written over slices.
pub(crate) struct KernelsOf;

impl SlicesVisitor for KernelsOf {
    type Output = SharedKernels;

    fn visit<F: ScalarSystem + 'static>(self, system: Arc<F>) -> SharedKernels {
        Rc::new(InRegisters(system))
    }
}

impl Kernels {
    /// The kernels of collocation.
    pub(crate) fn shared(&self) -> Option<SharedKernels> {
        self.collocation.downcast_ref::<SharedKernels>().cloned()
    }
}

/// A system over scalars, evaluated in SIMD registers.
pub(crate) struct InRegisters<F>(pub Arc<F>);

/// Calls a kernel of a Lagrangian with N coordinates, of a system over scalars with so few of them that their number is worth
/// knowing at compile time; otherwise evaluates to the other expression.
macro_rules! few_coordinates {
    ($kernels:ident, $n:expr, $typed:ident => $call:expr, $otherwise:expr) => {{
        use $crate::gauss::system::{OverSlices, Typed};
        let slices = OverSlices(&*$kernels.0);
        match $n {
            1 => {
                let $typed = Typed::<_, 1>(&slices);
                $call
            }
            2 => {
                let $typed = Typed::<_, 2>(&slices);
                $call
            }
            3 => {
                let $typed = Typed::<_, 3>(&slices);
                $call
            }
            _ => $otherwise,
        }
    }};
}
pub(crate) use few_coordinates;
