//! The program from outside: its commands, files and exit codes, and what its verdicts rest on.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod campaign_example;
mod comparison;
mod determinism;
mod drivers;
mod durability;
mod engagement;
mod exec_controller;
mod exit_codes;
mod faulty_controllers;
mod gate;
mod hidden_lead;
mod inspect;
mod library;
mod looking;
mod malformed;
mod own_controller;
mod paper_figure;
mod perception;
mod readme;
mod recordings;
mod reenact;
mod references;
mod reports;
mod rerun_files;
mod statistics;
mod support;
mod validity;
