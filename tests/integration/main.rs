//! Tests of the whole program: its commands, files and exit codes, and the evidence behind its verdicts.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod agreement;
mod arms;
mod assumptions;
mod calibrate;
mod campaign_example;
mod changed_controller;
mod commands;
mod comparison;
mod determinism;
mod drift;
mod drivers;
mod durability;
mod encounter_models;
mod engagement;
mod ensemble;
mod exec_controller;
mod exit_codes;
mod faulty_controllers;
mod gate;
mod hidden_lead;
mod inputs;
mod inspect;
mod library;
mod looking;
mod malformed;
mod mis_page;
mod nothing_checked;
mod own_controller;
mod paper;
mod paper_figure;
mod perception;
mod readme;
mod reenact;
mod references;
mod reports;
mod rerun_files;
mod sampling;
mod sensitivity;
mod signals;
mod statistics;
mod support;
mod trajectory_files;
mod validity;
mod viewer;
