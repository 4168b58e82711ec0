//! Lists of constrained elements, and the sparse Jacobian `G = c_q` of all of them.

use super::LocalConstraint;
use crate::SparseError;
use crate::elements::{ElementData, MAX_ELEMENT_UNKNOWNS, check_element};
use crate::potential::vector;

/// A list of constraints with any number of unknowns per element. Positions and velocities are padded with one fixed
/// component at each end.
pub(crate) trait ConstraintList: Send + Sync {
    /// The number of the list among those of the system.
    fn number(&self) -> usize;

    /// Calls a function with the padded indices of the unknowns of each element.
    fn visit(&self, f: &mut dyn FnMut(&[usize]));

    /// The values of the constraints; returns the number of them.
    fn values(&self, q: &[f64], values: &mut [f64]) -> usize;

    /// The gradients, one after the other; returns the number of entries.
    fn gradients(&self, q: &[f64], entries: &mut [f64]) -> usize;

    /// The second derivatives along the velocity, `v.c_qq v`; returns the number of them.
    fn curvatures(&self, q: &[f64], v: &[f64], curvatures: &mut [f64]) -> usize;
}

/// A constraint and its elements, in the order in which they were given.
pub(crate) struct ConstraintElements<C, const K: usize, const P: usize> {
    term: C,
    number: usize,
    /// The padded indices of the unknowns; a fixed one has the index 0.
    unknowns: Vec<[u32; K]>,
    parameters: Vec<[f64; P]>,
}

impl<C, const K: usize, const P: usize> ConstraintElements<C, K, P> {
    /// Checks the elements of the list with this number, in a system with so many unknowns.
    ///
    /// # Errors
    /// [`SparseError::OutOfRange`], [`SparseError::Repeated`] and [`SparseError::Parameter`].
    pub fn new(
        term: C,
        number: usize,
        unknowns: usize,
        elements: impl IntoIterator<Item = impl Into<ElementData<K, P>>>,
    ) -> Result<Self, SparseError> {
        const { assert!(K >= 1 && K <= MAX_ELEMENT_UNKNOWNS, "a local constraint has from 1 to 32 unknowns") };
        let mut found = ConstraintElements { term, number, unknowns: Vec::new(), parameters: Vec::new() };
        for (element, data) in elements.into_iter().enumerate() {
            let data = data.into();
            check_element(number, element, unknowns, &data.unknowns, &data.parameters)?;
            // `FIXED` is the largest number, so that it becomes 0.
            found.unknowns.push(data.unknowns.map(|u| u.wrapping_add(1) as u32));
            found.parameters.push(data.parameters);
        }
        Ok(found)
    }

    /// The components of a padded vector for each element, with the parameters.
    fn elements<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = ([f64; K], &'a [f64; P])> {
        // The indices are in range by construction.
        let at = |indices: &[u32; K]| indices.map(|i| x.get(i as usize).copied().unwrap_or(0.0));
        self.unknowns.iter().map(at).zip(&self.parameters)
    }
}

impl<C: LocalConstraint<K, P>, const K: usize, const P: usize> ConstraintList for ConstraintElements<C, K, P> {
    fn number(&self) -> usize {
        self.number
    }

    fn visit(&self, f: &mut dyn FnMut(&[usize])) {
        self.unknowns.iter().for_each(|indices| f(&indices.map(|i| i as usize)));
    }

    fn values(&self, q: &[f64], values: &mut [f64]) -> usize {
        for (value, (x, c)) in values.iter_mut().zip(self.elements(q)) {
            *value = self.term.value(&vector(x), c);
        }
        self.unknowns.len()
    }

    fn gradients(&self, q: &[f64], entries: &mut [f64]) -> usize {
        for (entries, (x, c)) in entries.chunks_exact_mut(K).zip(self.elements(q)) {
            entries.copy_from_slice(self.term.gradient(&vector(x), c).as_slice());
        }
        self.unknowns.len() * K
    }

    fn curvatures(&self, q: &[f64], v: &[f64], curvatures: &mut [f64]) -> usize {
        for ((curvature, (x, c)), (v, _)) in curvatures.iter_mut().zip(self.elements(q)).zip(self.elements(v)) {
            *curvature = self.term.curvature(&vector(x), &vector(v), c);
        }
        self.unknowns.len()
    }
}

/// The pattern of the Jacobian of all constraints, one row for each, by rows.
pub(crate) struct JacobianPattern {
    /// The index of the first entry of each row, and the number of entries at the end.
    pub row_starts: Vec<usize>,
    /// The padded index of the unknown of each entry.
    pub columns: Vec<u32>,
}

impl JacobianPattern {
    /// The pattern of these lists.
    pub fn new(lists: &[Box<dyn ConstraintList>]) -> Self {
        let mut pattern = JacobianPattern { row_starts: vec![0], columns: Vec::new() };
        for list in lists {
            list.visit(&mut |indices| {
                pattern.columns.extend(indices.iter().map(|i| *i as u32));
                pattern.row_starts.push(pattern.columns.len());
            });
        }
        pattern
    }

    /// The number of constraints.
    pub fn constraints(&self) -> usize {
        self.row_starts.len() - 1
    }

    /// The padded indices of each row, with its entries.
    pub fn rows<'a>(&'a self, entries: &'a [f64]) -> impl Iterator<Item = impl Iterator<Item = (usize, f64)> + 'a> {
        let row = |ends: &[usize]| self.columns[ends[0]..ends[1]].iter().zip(&entries[ends[0]..ends[1]]);
        self.row_starts.windows(2).map(move |ends| row(ends).map(|(i, g)| (*i as usize, *g)))
    }

    /// `G x` for a padded vector x.
    pub fn product(&self, entries: &[f64], x: &[f64], product: &mut [f64]) {
        for (sum, row) in product.iter_mut().zip(self.rows(entries)) {
            *sum = row.map(|(i, g)| g * x[i]).sum();
        }
    }

    /// Adds `scale G^T y` to a padded vector x; the entries of fixed unknowns are to vanish.
    pub fn add_transposed(&self, entries: &[f64], y: &[f64], scale: f64, x: &mut [f64]) {
        for (y, row) in y.iter().zip(self.rows(entries)) {
            let y = scale * y;
            row.for_each(|(i, g)| x[i] += g * y);
        }
    }
}

/// The values of all constraints.
pub(crate) fn values(lists: &[Box<dyn ConstraintList>], q: &[f64], values: &mut [f64]) {
    let mut done = 0;
    for list in lists {
        done += list.values(q, &mut values[done..]);
    }
}

/// The entries of the Jacobian, by rows.
pub(crate) fn gradients(lists: &[Box<dyn ConstraintList>], q: &[f64], entries: &mut [f64]) {
    let mut done = 0;
    for list in lists {
        done += list.gradients(q, &mut entries[done..]);
    }
}

/// The second derivatives `v.c_qq v` of all constraints.
pub(crate) fn curvatures(lists: &[Box<dyn ConstraintList>], q: &[f64], v: &[f64], curvatures: &mut [f64]) {
    let mut done = 0;
    for list in lists {
        done += list.curvatures(q, v, &mut curvatures[done..]);
    }
}

/// The list and the element of a constraint.
pub(crate) fn element_of(lists: &[Box<dyn ConstraintList>], mut constraint: usize) -> [usize; 2] {
    for list in lists {
        let mut count = 0;
        list.visit(&mut |_| count += 1);
        if constraint < count {
            return [list.number(), constraint];
        }
        constraint -= count;
    }
    [0, 0]
}
