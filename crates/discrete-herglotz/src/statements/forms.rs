//! Statements on the contact forms eta+ and eta-.

use crate::DiscreteLagrangian;
use crate::statements::measures::{jets, pull, relative};
use crate::theory::{derived_jet, derived_second_jet, discrete_flow, discrete_flow_jacobian};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{
    ChartVector, ContactForm, Darboux, DiscretePoint, EtaMinus, EtaPlus, GeometryError, Scalar, Smooth,
    numbers::{MaxAbsOrNan, MaxOrNan},
    support::{generic, seed},
};

/// F-L_d or F+L_d as a differentiable map, by automatic differentiation of the value alone.
struct Transform<'a, D> {
    ld: &'a D,
    t: f64,
    plus: bool,
}

impl<const N: usize, D: DiscreteLagrangian<N>> Smooth<N> for Transform<'_, D> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        let l = self.ld.value(self.t, &seed(x).into())?;
        Ok(if self.plus {
            ChartVector { x: x.y, y: l.d.y, z: x.z + l.re }
        } else {
            let sigma = l.d.z + 1.0;
            ChartVector { x: x.x, y: l.d.x.map(|d| -d / sigma), z: x.z }
        })
    }
}

/// The pullbacks of Darboux' form and of its differential along a transform by definition, `J^T eta` and `J^T d eta J`.
fn pulled_back<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
    plus: bool,
) -> Result<(ChartVector<N>, DMatrix<f64>), GeometryError> {
    let (image, jacobian) = Transform { ld, t, plus }.with_jacobian(&(*x).into())?;
    let d_eta = jacobian.transpose() * Darboux.d_eta(&image)? * &jacobian;
    Ok((pull(&jacobian, &Darboux.eta(&image)?), d_eta))
}

fn form_residual<const N: usize>(
    closed: &impl ContactForm<N>,
    (eta, d_eta): (ChartVector<N>, DMatrix<f64>),
    x: &ChartVector<N>,
) -> Result<f64, GeometryError> {
    Ok(relative(closed.eta(x)?, eta).max_or_nan((closed.d_eta(x)? - &d_eta).max_abs_or_nan() / d_eta.max_abs_or_nan()))
}

/// Statement 1 on Q x Q x R: the volume forms of eta+ and eta- do not vanish, and their closed form agrees with the
/// generic one.
pub(super) fn volume<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let point = (*x).into();
    let of = |closed: f64, generic: f64| {
        if generic == 0.0 { f64::INFINITY } else { (closed - generic).abs() / generic.abs() }
    };
    let (minus, plus) = (EtaMinus(jets(ld, t)), EtaPlus(jets(ld, t)));
    Ok(of(minus.volume(&point)?, generic::volume(&minus, &point)?)
        .max_or_nan(of(plus.volume(&point)?, generic::volume(&plus, &point)?)))
}

/// Statement 2 on Q x Q x R: Reeb fields, flat and sharp of eta+ and eta-, in closed form against the generic
/// computation and by definition.
pub(super) fn reeb<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    fn of<const N: usize>(form: &impl ContactForm<N>, x: &ChartVector<N>) -> Result<f64, GeometryError> {
        let (eta, reeb) = (form.eta(x)?, form.reeb(x)?);
        let mut worst = relative(reeb, generic::reeb(form, x)?)
            .max_or_nan((eta.dot(&reeb) - 1.0).abs() / eta.max_abs_or_nan().max_or_nan(1.0));
        worst = worst.max_or_nan(
            form.flat(x, &reeb)?.minus(eta).max_abs_or_nan()
                / (form.d_eta(x)?.max_abs_or_nan() * reeb.max_abs_or_nan()),
        );
        for j in 0..ChartVector::<N>::DIMENSION {
            let e = ChartVector::from_fn(|i| f64::from(u8::from(i == j)));
            worst = worst.max_or_nan(relative(form.sharp(x, &form.flat(x, &e)?)?, e));
        }
        Ok(worst)
    }
    let point = (*x).into();
    Ok(of(&EtaMinus(jets(ld, t)), &point)?.max_or_nan(of(&EtaPlus(jets(ld, t)), &point)?))
}

/// Statement 21: eta+ and eta- in closed form are the pullbacks of Darboux' form. Their jets and the linearised
/// transforms agree with automatic differentiation of the value.
pub(super) fn contact_forms<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let point = (*x).into();
    let minus = form_residual(&EtaMinus(jets(ld, t)), pulled_back(ld, t, x, false)?, &point)?;
    let plus = form_residual(&EtaPlus(jets(ld, t)), pulled_back(ld, t, x, true)?, &point)?;
    let (first, derived) = (ld.jet(t, x)?, derived_jet(ld, t, x)?);
    let of = |jet: contact_geom::DiscreteJet<N>| ChartVector { x: jet.d1, y: jet.d2, z: jet.dz };
    let (second, derived_second) = (ld.second_jet(t, x)?, derived_second_jet(ld, t, x)?);
    let blocks = (second.d11 - derived_second.d11)
        .max_abs_or_nan()
        .max_or_nan((second.d12 - derived_second.d12).max_abs_or_nan());
    let blocks = blocks
        .max_or_nan((second.d22 - derived_second.d22).max_abs_or_nan())
        .max_or_nan((second.d1z - derived_second.d1z).max_abs_or_nan());
    let blocks = blocks
        .max_or_nan((second.d2z - derived_second.d2z).max_abs_or_nan())
        .max_or_nan((second.dzz - derived_second.dzz).abs());
    let size = derived_second
        .d11
        .max_abs_or_nan()
        .max_or_nan(derived_second.d12.max_abs_or_nan())
        .max_or_nan(derived_second.d22.max_abs_or_nan());
    let jacobian = |plus| -> Result<f64, GeometryError> {
        let closed = if plus { second.legendre_plus_jacobian() } else { second.legendre_minus_jacobian() };
        let (_, derived) = Transform { ld, t, plus }.with_jacobian(&point)?;
        Ok((&closed - &derived).max_abs_or_nan() / derived.max_abs_or_nan())
    };
    let transforms = jacobian(false)?.max_or_nan(jacobian(true)?);
    Ok(minus
        .max_or_nan(plus)
        .max_or_nan(transforms)
        .max_or_nan(relative(of(first), of(derived)))
        .max_or_nan(blocks / size))
}

/// Statement 22: `eta+ = sigma_d eta-` and `Phi_d* eta- = eta+`.
pub(super) fn forms_are_related<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let point = (*x).into();
    let (minus, plus) = (EtaMinus(jets(ld, t)), EtaPlus(jets(ld, t)));
    let sigma = ld.jet(t, x)?.sigma();
    // Both forms are computed by definition, so that the identity is not built into the closed formulas.
    let (by_plus, by_minus) = (pulled_back(ld, t, x, true)?.0, pulled_back(ld, t, x, false)?.0);
    let proportional = relative(by_plus, by_minus.scale(sigma));
    let image = discrete_flow(ld, t, x)?;
    let jacobian = discrete_flow_jacobian(ld, t, x, &image)?;
    let next = EtaMinus(jets(ld, t + h));
    let pullback = pull(&jacobian, &next.eta(&image.into())?);
    let size = next.eta(&image.into())?.max_abs_or_nan() * jacobian.max_abs_or_nan();
    let related =
        pullback.minus(plus.eta(&point)?).max_abs_or_nan() / size.max_or_nan(plus.eta(&point)?.max_abs_or_nan());
    Ok(proportional.max_or_nan(related).max_or_nan(relative(plus.eta(&point)?, minus.eta(&point)?.scale(sigma))))
}
