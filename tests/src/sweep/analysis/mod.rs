//! What measurements say together: fronts, crossovers, and which method is fastest below an error.

mod crossover;
mod pareto;

pub use crossover::{Cost, Rival, Verdict, crossover};
pub use pareto::front;
