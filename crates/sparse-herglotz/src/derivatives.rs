//! The first and second derivatives of a Lagrangian, and the point at which they are evaluated.

/// The point at which a Lagrangian is evaluated. Positions and velocities are padded with one fixed component at each
/// end, so that the first unknown has the padded index 1.
#[derive(Clone, Copy)]
pub(crate) struct EvaluationPoint<'a> {
    pub t: f64,
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub z: f64,
}

/// The value of a Lagrangian and its first derivatives.
#[derive(Clone, Debug)]
pub(crate) struct FirstDerivatives {
    pub l: f64,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub z: f64,
}

impl FirstDerivatives {
    pub fn zeros(unknowns: usize) -> Self {
        FirstDerivatives { l: 0.0, q: vec![0.0; unknowns], v: vec![0.0; unknowns], z: 0.0 }
    }
}

/// The second derivatives of a Lagrangian; `qv` is with respect to the position of the row and the velocity of the
/// column, `vq` with respect to the velocity of the row and the position of the column.
#[derive(Clone, Debug, Default)]
pub(crate) struct SecondDerivatives {
    pub qq: Vec<f64>,
    pub qv: Vec<f64>,
    pub vq: Vec<f64>,
    pub vv: Vec<f64>,
    pub qz: Vec<f64>,
    pub vz: Vec<f64>,
    pub zz: f64,
}

impl SecondDerivatives {
    pub fn zeros(unknowns: usize, entries: usize) -> Self {
        let (matrix, vector) = (vec![0.0; entries], vec![0.0; unknowns]);
        SecondDerivatives {
            qq: matrix.clone(),
            qv: matrix.clone(),
            vq: matrix.clone(),
            vv: matrix,
            qz: vector.clone(),
            vz: vector,
            zz: 0.0,
        }
    }

    pub fn clear(&mut self) {
        let SecondDerivatives { qq, qv, vq, vv, qz, vz, zz } = self;
        [qq, qv, vq, vv, qz, vz].into_iter().for_each(|x| x.fill(0.0));
        *zz = 0.0;
    }
}
