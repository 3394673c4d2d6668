//! Tests of deferred blending.

mod grouping;
