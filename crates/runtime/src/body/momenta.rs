//! Momenta of symmetries of a rigid body.

use super::Body;
use crate::RuntimeError;

impl Body {
    /// The momenta of the symmetries, which scale by `e^(gamma t)`: those in space about directions that gravity leaves
    /// unchanged, `M1`, `M2`, `M3` or `gravity . M`; and that in the body about an axis on which the centre of mass is
    /// and about which the moments of inertia are equal, such as `Pi3`. With a torque there are none.
    ///
    /// ```
    /// use herglotz_runtime::Body;
    /// let top = Body { inertia: Body::principal([1.0, 1.0, 0.5]), mass: 2.0, centre: [0.0, 0.0, 1.0], ..Body::default() };
    /// let top = Body { gravity: [0.0, 0.0, -9.81], ..top };
    /// assert_eq!(top.momenta()?, ["M3", "Pi3"]);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`lagrangian`](Self::lagrangian).
    pub fn momenta(&self) -> Result<Vec<String>, RuntimeError> {
        let lagrangian = self.lagrangian()?;
        if self.torque.is_some() {
            return Ok(Vec::new());
        }
        let about_point = lagrangian.mass();
        let inertia = |i: usize, j: usize| about_point[(i, j)];
        let acts = self.mass != 0.0;
        let along: Vec<usize> = (0..3).filter(|k| acts && self.gravity.get(*k).is_some_and(|g| *g != 0.0)).collect();
        let mut names: Vec<String> = match along.as_slice() {
            [] => (1..=3).map(|k| format!("M{k}")).collect(),
            [k] => vec![format!("M{}", k + 1)],
            _ => vec!["gravity . M".to_owned()],
        };
        let axes = [(0, 1, 2), (1, 2, 0), (2, 0, 1)].into_iter().filter(|(k, i, j)| {
            let is_diagonal = [(*k, *i), (*k, *j), (*i, *j)].iter().all(|(a, b)| inertia(*a, *b) == 0.0);
            let off_axis = [i, j].iter().any(|i| self.centre.get(**i).is_some_and(|x| *x != 0.0));
            is_diagonal && inertia(*i, *i) == inertia(*j, *j) && !off_axis
        });
        names.extend(axes.map(|(k, ..)| format!("Pi{}", k + 1)));
        Ok(names)
    }
}
