//! Experiments on quadpixel: what `qpgen study`, `qpgen accuracy` and `qpgen validate` measure. The programs that make
//! the pages `docs/paper` and `docs/real-camera` are this crate's examples.

pub mod accuracy;
pub mod curve;
pub mod error;
pub mod fit;
pub mod lens_drawing;
pub mod plane_shift;
pub mod study;
pub mod template;
pub mod validate;
