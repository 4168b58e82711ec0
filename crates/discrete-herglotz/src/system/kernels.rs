//! The kernels that a system brings along.

use std::any::Any;
use std::rc::Rc;

/// The kernels of a [`ScalarSystem`](contact_geom::ScalarSystem), for collocation and for derivatives; see
/// [`System::kernels`](crate::System::kernels). They are made by `Kernels::of`; their types are known where they are used.
#[derive(Clone)]
pub struct Kernels {
    pub(crate) collocation: Rc<dyn Any>,
    pub(crate) derivatives: Rc<dyn Any>,
}
