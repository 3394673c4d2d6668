//! The slow form in f64.
