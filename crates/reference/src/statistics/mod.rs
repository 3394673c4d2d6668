//! Statistics of measurements: convergence orders, means with intervals, medians.

mod fit;
mod repeats;
mod student;

pub use fit::{Fit, fit_order};
pub use repeats::{Mean, Spread, mean_with_interval, median_with_spread};
pub use student::student_t_95;
