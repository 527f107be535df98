//! Closecall.
