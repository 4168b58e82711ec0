//! Whether steps resolve the motion.

pub(crate) mod monitor;
