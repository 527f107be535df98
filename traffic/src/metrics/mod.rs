//! Criticality metrics in continuous time.
