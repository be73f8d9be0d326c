//! Flux linkages as the gradient of one co-energy polynomial, found from samples by least squares: reciprocal by construction.

mod basis;
mod equations;
mod polynomial;
mod spread;

pub use basis::Basis;
pub use equations::Equations;
pub use polynomial::Polynomial;
pub use spread::Spread;
