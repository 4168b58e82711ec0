//! The kernels of collocation that a system brings along.

use std::any::Any;
use std::rc::Rc;

/// The kernels of collocation for a [`ScalarSystem`](contact_geom::ScalarSystem); see [`System::kernels`](crate::System::kernels). They are made by
/// `Kernels::of` where collocation is defined, which knows their type.
#[derive(Clone)]
pub struct Kernels(pub(crate) Rc<dyn Any>);
