//! The choice of the SIMD instruction set of the kernels.

use pulp::WithSimd;

/// The instruction set that kernels are compiled for and run with.
///
/// By default kernels are compiled for all instruction sets of the target architecture, and the best one is selected at
/// run time. A build for processors with wide registers (for example with `target-cpu=native`) compiles each kernel
/// once instead of three times, for the widest instruction set that it enables.
#[derive(Clone, Copy, Debug)]
pub struct Instructions(chosen::Set);

impl Instructions {
    /// The best instruction set of the processor.
    #[inline]
    pub fn new() -> Self {
        Instructions(chosen::set())
    }

    /// The given instruction set.
    #[cfg(test)]
    pub fn only(set: pulp::Arch) -> Self {
        Instructions(set)
    }

    /// Runs a kernel with this instruction set.
    #[inline(always)]
    pub fn dispatch<K: WithSimd>(self, kernel: K) -> K::Output {
        chosen::run(self.0, kernel)
    }
}

/// One item for builds that satisfy a condition, and another for all other builds.
macro_rules! either {
    ($condition:meta => $item:item otherwise $other:item) => {
        #[cfg($condition)]
        $item
        #[cfg(not($condition))]
        $other
    };
}

/// The module for a build with a single instruction set.
#[allow(unused_macros)] // Not used in builds that select the instruction set at run time.
macro_rules! only {
    ($of:ident :: $set:ident) => {
        mod chosen {
            use pulp::{Simd, WithSimd, $of::$set};

            pub type Set = $set;

            #[allow(unsafe_code)] // The safe constructor compiles a branch that is never taken.
            #[inline(always)]
            pub fn set() -> Set {
                // SAFETY: this module is used only in builds whose target features include all of these instructions,
                // as configured below.
                unsafe { $set::new_unchecked() }
            }

            // Not inlined, as in builds for any processor, so that each kernel is a function of its own: `.ci/kernel_calls`
            // lists what they call.
            #[inline(never)]
            pub fn run<K: WithSimd>(set: Set, kernel: K) -> K::Output {
                Simd::vectorize(set, kernel)
            }
        }
    };
}

// The features that the tokens V3 and V4 need, listed separately since they do not imply each other. Excluded for the
// tests of this crate, which compare all register widths.
either! {
    all(
        not(test),
        target_arch = "x86_64",
        target_feature = "avx2",
        target_feature = "bmi1",
        target_feature = "bmi2",
        target_feature = "fma",
        target_feature = "fxsr",
        target_feature = "lzcnt",
        target_feature = "popcnt"
    ) => either! {
        all(
            target_feature = "avx512bw",
            target_feature = "avx512cd",
            target_feature = "avx512dq",
            target_feature = "avx512vl"
        ) => only! { x86::V4 }
        otherwise only! { x86::V3 }
    }
    otherwise either! {
        all(not(test), target_arch = "wasm32", target_feature = "simd128") => only! { wasm::Simd128 }
        otherwise mod chosen {
            use pulp::{Arch, WithSimd};

            pub type Set = Arch;

            #[inline]
            pub fn set() -> Set {
                Arch::new()
            }

            #[inline(always)]
            pub fn run<K: WithSimd>(set: Set, kernel: K) -> K::Output {
                set.dispatch(kernel)
            }
        }
    }
}
