//! Random sequences for proptest.
