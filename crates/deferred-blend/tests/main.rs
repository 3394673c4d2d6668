//! Tests of deferred blending.
