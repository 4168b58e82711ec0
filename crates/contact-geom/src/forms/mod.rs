//! Points and contact forms of T\*Q x R, TQ x R and Q x Q x R, smooth maps between them, and their pullbacks.

mod contact_form;
pub(crate) mod darboux;
mod discrete_form;
pub(crate) mod fibre_form;
mod legendrian;
pub(crate) mod points;
mod pullback;
pub(crate) mod smooth;

pub use contact_form::{ContactForm, Form, generic};
pub use darboux::Darboux;
pub use discrete_form::{DiscreteJet, EtaMinus, EtaPlus, SecondDiscreteJet};
pub use legendrian::{LegendrianDefect, OnParameters, legendrian_defect};
pub use points::{ChartVector, DiscretePoint, PhasePoint, VelocityPoint, seed};
pub use pullback::{Conformality, conformality, conformality_with_jacobian};
pub use smooth::{Smooth, SmoothFunction};
