//! The instruction set of the kernels.

use pulp::WithSimd;

/// The instruction set that kernels are compiled for and run with.
///
/// As a rule they are compiled for all that a processor of this kind may have, and the best is picked at run time. A build for processors with wide
/// registers (`target-cpu=native` on one of them) has no use for narrower ones, and most often none for wider ones: it compiles each kernel once
/// instead of three times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instructions(chosen::Set);

impl Instructions {
    /// The best that the processor has.
    #[inline]
    pub fn new() -> Self {
        Instructions(chosen::set())
    }

    /// Only with these.
    #[cfg(test)]
    pub fn only(set: pulp::Arch) -> Self {
        Instructions(set)
    }

    /// Runs a kernel.
    #[inline(always)]
    pub fn dispatch<K: WithSimd>(self, kernel: K) -> K::Output {
        chosen::run(self.0, kernel)
    }
}

/// An item for builds that meet a condition, and one for all others.
macro_rules! either {
    ($condition:meta => $item:item otherwise $other:item) => {
        #[cfg($condition)]
        $item
        #[cfg(not($condition))]
        $other
    };
}

/// The module of a build in which there is one set.
#[allow(unused_macros)] // In builds for any processor there is a choice.
macro_rules! only {
    ($set:ident) => {
        mod chosen {
            use pulp::{Simd, WithSimd, x86::$set};

            pub type Set = $set;

            #[allow(unsafe_code)] // There is no other way to the token without a branch that is never taken, and compiled.
            #[inline(always)]
            pub fn set() -> Set {
                // SAFETY: the whole build takes for granted that the processor has each of these instructions: it is configured so below.
                unsafe { $set::new_unchecked() }
            }

            #[inline(always)]
            pub fn run<K: WithSimd>(set: Set, kernel: K) -> K::Output {
                Simd::vectorize(set, kernel)
            }
        }
    };
}

// What the tokens ask for and these do not imply each other. The crate's own tests compare all widths.
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
        ) => only! { V4 }
        otherwise only! { V3 }
    }
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
