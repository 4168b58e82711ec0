//! Saving and restoring the state of steppers, so that an interrupted run can be resumed bitwise.

use crate::{State, Vector};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::{Complex, SMatrix};

/// Data that change in a run, written as 64-bit words and read back in place. All other data are recomputed from
/// problem and integrator.
pub(crate) trait Saved {
    /// Appends the words.
    fn save(&self, to: &mut Vec<u64>);

    /// Reads the value from the front of the words; `None` if they are not those of such a value.
    fn load(&mut self, from: &mut &[u64]) -> Option<()>;
}

/// The next word.
pub(crate) fn word(from: &mut &[u64]) -> Option<u64> {
    let (first, rest) = from.split_first()?;
    *from = rest;
    Some(*first)
}

macro_rules! one_word {
    ($($number:ty: $to:expr, $from:expr;)+) => {$(
        impl Saved for $number {
            fn save(&self, to: &mut Vec<u64>) {
                to.push($to(*self));
            }
            fn load(&mut self, from: &mut &[u64]) -> Option<()> {
                *self = $from(word(from)?)?;
                Some(())
            }
        }
    )+};
}

one_word! {
    f64: f64::to_bits, |word| Some(f64::from_bits(word));
    u64: |number| number, Some;
    u32: u64::from, |word: u64| u32::try_from(word).ok();
    usize: |number| number as u64, |word: u64| usize::try_from(word).ok();
    bool: u64::from, |word| match word { 0 => Some(false), 1 => Some(true), _ => None };
}

impl<T: Saved, const M: usize> Saved for [T; M] {
    fn save(&self, to: &mut Vec<u64>) {
        self.iter().for_each(|x| x.save(to));
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.iter_mut().try_for_each(|x| x.load(from))
    }
}

/// The length must be the same when it is read back.
impl<T: Saved> Saved for [T] {
    fn save(&self, to: &mut Vec<u64>) {
        self.iter().for_each(|x| x.save(to));
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.iter_mut().try_for_each(|x| x.load(from))
    }
}

/// The length must be the same when it is read back.
impl<T: Saved> Saved for Vec<T> {
    fn save(&self, to: &mut Vec<u64>) {
        self.as_slice().save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.as_mut_slice().load(from)
    }
}

impl<A: Saved, B: Saved> Saved for (A, B) {
    fn save(&self, to: &mut Vec<u64>) {
        self.0.save(to);
        self.1.save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.0.load(from)?;
        self.1.load(from)
    }
}

impl<T: Saved + ?Sized> Saved for Box<T> {
    fn save(&self, to: &mut Vec<u64>) {
        (**self).save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        (**self).load(from)
    }
}

impl<T: Saved, const R: usize, const C: usize> Saved for SMatrix<T, R, C> {
    fn save(&self, to: &mut Vec<u64>) {
        self.data.0.save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.data.0.load(from)
    }
}

/// The length must be the same when it is read back.
impl Saved for Vector {
    fn save(&self, to: &mut Vec<u64>) {
        self.as_slice().save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        (**self).load(from)
    }
}

impl Saved for Complex<f64> {
    fn save(&self, to: &mut Vec<u64>) {
        [self.re, self.im].save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.re.load(from)?;
        self.im.load(from)
    }
}

/// Implements [`Saved`] for a type by the listed fields, in their order, and optionally by two methods for further
/// data.
macro_rules! saved {
    ([$($generics:tt)*] $kind:ty { $($field:ident),+ $(,)? } $(and $save:ident, $load:ident)?) => {
        impl<$($generics)*> $crate::numbers::state_words::Saved for $kind {
            fn save(&self, to: &mut Vec<u64>) {
                $($crate::numbers::state_words::Saved::save(&self.$field, to);)+
                $(self.$save(to);)?
            }
            fn load(&mut self, from: &mut &[u64]) -> Option<()> {
                $($crate::numbers::state_words::Saved::load(&mut self.$field, from)?;)+
                $(self.$load(from)?;)?
                Some(())
            }
        }
    };
}
pub(crate) use saved;

saved!([const N: usize] PhasePoint<N> { q, p, z });
saved!([] State { q, p, z });

/// The words of a value, for [`RunSupport::save`](crate::RunSupport::save).
pub(crate) fn words_of(x: &impl Saved) -> Vec<u64> {
    let mut words = Vec::new();
    x.save(&mut words);
    words
}

/// Restores a value from exactly its words, for [`RunSupport::restore`](crate::RunSupport::restore); `false` where they are
/// not those of such a value.
pub(crate) fn restored_from(x: &mut impl Saved, mut words: &[u64]) -> bool {
    x.load(&mut words).is_some() && words.is_empty()
}

/// Saves an optional value.
pub(crate) fn save_option<T: Saved>(option: Option<&T>, to: &mut Vec<u64>) {
    option.is_some().save(to);
    if let Some(x) = option {
        x.save(to);
    }
}

/// Reads an optional value back, in place of one that `make` returns.
pub(crate) fn load_option<T: Saved>(from: &mut &[u64], make: impl FnOnce() -> T) -> Option<Option<T>> {
    let mut there = false;
    there.load(from)?;
    if !there {
        return Some(None);
    }
    let mut x = make();
    x.load(from)?;
    Some(Some(x))
}

/// A digest of words: FNV-1a applied to 64-bit words, with a rotation.
pub(crate) fn digest(words: &[u64]) -> u64 {
    words.iter().fold(0xcbf2_9ce4_8422_2325, |sum, word| (sum ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29))
}
