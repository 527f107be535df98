//! Verdicts of synthetic campaigns.
