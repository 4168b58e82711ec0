//! Block elimination of the linearised discrete Herglotz equations along a path.

use contact_geom::DiscreteJet;
use contact_geom::nalgebra::{SMatrix, SVector};

/// The threshold of pivoting: a pivot from the equations of the next point is chosen if it exceeds that of this point
/// by this factor. It bounds the growth, and away from conjugate points no row is exchanged between points, so that the
/// elimination costs no more than without pivoting.
const PIVOT_RATIO: f64 = 16.0;

/// N equations in the corrections of the positions of three consecutive points, and of the first point for a periodic
/// path: `here dq_k + next dq_{k+1} + after dq_{k+2} + first dq_0 = rhs`.
#[derive(Clone, Copy)]
pub(super) struct BlockRows<const N: usize> {
    pub here: SMatrix<f64, N, N>,
    pub next: SMatrix<f64, N, N>,
    pub after: SMatrix<f64, N, N>,
    pub first: SMatrix<f64, N, N>,
    pub rhs: SVector<f64, N>,
}

/// The correction of the action at a point in terms of those of the positions:
/// `dz + here . dq_k + next . dq_{k+1} + after . dq_{k+2} + first . dq_0 = rhs`.
#[derive(Clone, Copy)]
pub(super) struct ActionRow<const N: usize> {
    pub here: SVector<f64, N>,
    pub next: SVector<f64, N>,
    pub after: SVector<f64, N>,
    pub first: SVector<f64, N>,
    pub rhs: f64,
}

impl<const N: usize> BlockRows<N> {
    pub fn zero() -> Self {
        let zero = SMatrix::zeros();
        BlockRows { here: zero, next: zero, after: zero, first: zero, rhs: SVector::zeros() }
    }
}

impl<const N: usize> ActionRow<N> {
    pub fn zero() -> Self {
        let zero = SVector::zeros();
        ActionRow { here: zero, next: zero, after: zero, first: zero, rhs: 0.0 }
    }

    /// The row of the next action, `dz_{k+1} = sigma dz_k + D1 . dq_k + D2 . dq_{k+1}`, from this row.
    #[inline(always)]
    pub fn recursion(&self, jet: &DiscreteJet<N>) -> Self {
        let sigma = jet.sigma();
        ActionRow {
            here: self.here * sigma - jet.d1,
            next: self.next * sigma - jet.d2,
            after: SVector::zeros(),
            first: self.first * sigma,
            rhs: self.rhs * sigma,
        }
    }
}

/// All equations that contain the correction of one point.
pub(super) struct Panel<const N: usize> {
    /// The equations of the point after the elimination of the previous ones.
    pub top: BlockRows<N>,
    /// The discrete Herglotz equation of the next point.
    pub bottom: BlockRows<N>,
    /// The recursion of the action at the next point.
    pub action: ActionRow<N>,
    /// The equation that closes a periodic path.
    pub closing: Option<BlockRows<N>>,
    /// The inverses of the pivots of `top`.
    pub inverses: SVector<f64, N>,
}

/// The error for a pivot that vanishes or is not finite.
pub(super) struct NoPivot;

impl<const N: usize> Panel<N> {
    pub fn new(periodic: bool) -> Self {
        let closing = periodic.then(BlockRows::zero);
        let inverses = SVector::zeros();
        Panel { top: BlockRows::zero(), bottom: BlockRows::zero(), action: ActionRow::zero(), closing, inverses }
    }

    /// Moves the panel to the next point.
    #[inline(always)]
    pub fn advance<const PERIODIC: bool>(&mut self) {
        let (top, bottom) = (&mut self.top, &self.bottom);
        (top.here, top.next, top.after, top.rhs) = (bottom.next, bottom.after, SMatrix::zeros(), bottom.rhs);
        if PERIODIC {
            top.first = bottom.first;
        }
        let action = &self.action;
        self.action = ActionRow { here: action.next, next: action.after, after: SVector::zeros(), ..*action };
        if PERIODIC && let Some(rows) = &mut self.closing {
            *rows = BlockRows { here: rows.next, next: rows.after, after: SMatrix::zeros(), ..*rows };
        }
    }

    /// Makes the first position of a periodic path the unknown that is eliminated last. The derivatives of the equation
    /// of the first point, in its own position and in the next, are stored until [`close`](Self::close).
    pub fn open(&mut self, here: SMatrix<f64, N, N>, next: SMatrix<f64, N, N>) {
        self.bottom.first += self.bottom.here;
        self.action.first += self.action.here;
        // `next` becomes `here` of the second point.
        self.closing = Some(BlockRows { next, first: here, ..BlockRows::zero() });
    }

    /// Closes a periodic path at its last step: identifies the last position with the first, and adds the stored
    /// equation.
    pub fn close(&mut self) {
        if let Some(rows) = self.closing.take() {
            self.bottom.here += rows.here;
            self.bottom.next += rows.next + self.bottom.first + rows.first;
            self.bottom.rhs += rows.rhs;
        }
        self.bottom.after = SMatrix::zeros();
        self.bottom.first = SMatrix::zeros();
        self.top.next += self.top.first;
        self.top.first = SMatrix::zeros();
    }

    /// Eliminates `dq_k`, with pivots from the equations of both points: the block of one point may be singular
    /// although the path is regular, namely where it is conjugate to the start. Afterwards `here` of `top` is upper
    /// triangular. Returns whether rows of both points were exchanged; otherwise `top.after` vanishes.
    #[inline(always)]
    pub fn eliminate<const PERIODIC: bool>(&mut self) -> Result<bool, NoPivot> {
        let mut crossed = false;
        for j in 0..N {
            crossed |= self.choose_pivot(j)?;
            let pivot = self.top.here[(j, j)];
            let inverse = 1.0 / pivot;
            self.inverses[j] = inverse;
            // The multipliers of the rows of `top` below the pivot; zero above it.
            let above = SVector::<f64, N>::from_fn(|i, _| if i > j { self.top.here[(i, j)] * inverse } else { 0.0 });
            let below = self.bottom.here.column(j).into_owned() * inverse;
            let action = self.action.here[j] * inverse;
            let closing = match &self.closing {
                Some(rows) if PERIODIC => Some(rows.here.column(j).into_owned() * inverse),
                _ => None,
            };
            for c in j + 1..N {
                let entry = self.top.here[(j, c)];
                subtract(&mut self.top.here, c, &above, entry);
                subtract(&mut self.bottom.here, c, &below, entry);
                self.action.here[c] -= action * entry;
                if let (Some(rows), Some(closing)) = (&mut self.closing, &closing) {
                    subtract(&mut rows.here, c, closing, entry);
                }
            }
            for c in 0..N {
                let entry = self.top.next[(j, c)];
                subtract(&mut self.top.next, c, &above, entry);
                subtract(&mut self.bottom.next, c, &below, entry);
                self.action.next[c] -= action * entry;
                if let (Some(rows), Some(closing)) = (&mut self.closing, &closing) {
                    subtract(&mut rows.next, c, closing, entry);
                }
            }
            if crossed {
                for c in 0..N {
                    let entry = self.top.after[(j, c)];
                    subtract(&mut self.top.after, c, &above, entry);
                    subtract(&mut self.bottom.after, c, &below, entry);
                    self.action.after[c] -= action * entry;
                    if let (Some(rows), Some(closing)) = (&mut self.closing, &closing) {
                        subtract(&mut rows.after, c, closing, entry);
                    }
                }
            }
            let entry = self.top.rhs[j];
            self.top.rhs -= above * entry;
            self.bottom.rhs -= below * entry;
            self.action.rhs -= action * entry;
            if let (Some(rows), Some(closing)) = (&mut self.closing, &closing) {
                rows.rhs -= closing * entry;
                for c in 0..N {
                    let entry = self.top.first[(j, c)];
                    subtract(&mut self.top.first, c, &above, entry);
                    subtract(&mut self.bottom.first, c, &below, entry);
                    self.action.first[c] -= action * entry;
                    subtract(&mut rows.first, c, closing, entry);
                }
            }
        }
        Ok(crossed)
    }

    /// Moves the pivot of column j to row j of `top`. Returns whether it came from `bottom`.
    #[inline(always)]
    fn choose_pivot(&mut self, j: usize) -> Result<bool, NoPivot> {
        let (mut row, mut best) = (j, self.top.here[(j, j)].abs());
        for i in j + 1..N {
            let size = self.top.here[(i, j)].abs();
            if size > best {
                (row, best) = (i, size);
            }
        }
        let (mut other, mut most) = (0, 0.0);
        for i in 0..N {
            let size = self.bottom.here[(i, j)].abs();
            if size > most {
                (other, most) = (i, size);
            }
        }
        let cross = most > PIVOT_RATIO * best;
        let size = if cross { most } else { best };
        if !(size > 0.0 && size.is_finite()) {
            return Err(NoPivot);
        }
        if cross {
            exchange(&mut self.top, j, &mut self.bottom, other);
        } else if row != j {
            let top = &mut self.top;
            for block in [&mut top.here, &mut top.next, &mut top.after, &mut top.first] {
                block.swap_rows(j, row);
            }
            top.rhs.swap_rows(j, row);
        }
        Ok(cross)
    }
}

#[inline(always)]
fn subtract<const N: usize>(block: &mut SMatrix<f64, N, N>, c: usize, multipliers: &SVector<f64, N>, entry: f64) {
    for i in 0..N {
        block[(i, c)] -= multipliers[i] * entry;
    }
}

fn exchange<const N: usize>(a: &mut BlockRows<N>, i: usize, b: &mut BlockRows<N>, j: usize) {
    for c in 0..N {
        std::mem::swap(&mut a.here[(i, c)], &mut b.here[(j, c)]);
        std::mem::swap(&mut a.next[(i, c)], &mut b.next[(j, c)]);
        std::mem::swap(&mut a.after[(i, c)], &mut b.after[(j, c)]);
        std::mem::swap(&mut a.first[(i, c)], &mut b.first[(j, c)]);
    }
    std::mem::swap(&mut a.rhs[i], &mut b.rhs[j]);
}

/// Solves `u x = b` for each column of b, from the upper triangle of u and the inverses of its diagonal.
#[inline(always)]
pub(super) fn back_substitute<const N: usize, const C: usize>(
    u: &SMatrix<f64, N, N>,
    inverses: &SVector<f64, N>,
    b: &mut SMatrix<f64, N, C>,
) {
    // Column by column, so that each column stays in registers.
    for c in 0..C {
        let mut x = b.column(c).into_owned();
        for j in (0..N).rev() {
            let solved = x[j] * inverses[j];
            for i in 0..N {
                x[i] -= if i < j { u[(i, j)] } else { 0.0 } * solved;
            }
            x[j] = solved;
        }
        b.set_column(c, &x);
    }
}
