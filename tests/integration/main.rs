//! Tests of the whole program: its commands, files and exit codes, and the evidence behind its verdicts.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod agreement;
mod architecture;
mod arms;
mod assumptions;
mod book;
mod calibrate;
mod campaign_example;
mod causes;
mod changed_controller;
mod commands;
mod comparison;
mod determinism;
mod digests;
mod drift;
mod drivers;
mod durability;
mod encounter_models;
mod engagement;
mod ensemble;
mod evidence;
mod exec_controller;
mod exit_codes;
mod faulty_controllers;
mod fmu_controllers;
mod gate;
mod hidden_lead;
mod inputs;
mod inspect;
mod instruction_sets;
mod library;
mod library_faults;
mod looking;
mod malformed;
mod mask_rcnn;
mod mis_page;
mod native_controllers;
mod nothing_checked;
mod odd_recordings;
mod own_controller;
mod paper;
mod paper_figure;
mod perception;
mod readme;
mod reenact;
mod reference_models;
mod references;
mod refused_libraries;
mod reports;
mod rerun_files;
mod results;
mod sampling;
mod sensitivity;
mod signals;
mod statistics;
mod support;
mod trajectory_files;
mod trust;
mod validity;
mod view;
mod viewer;
mod worker_processes;

// `xtask` has this constant, too: its modules that are tested here look for it in the root of their crate.
use support::ROOT;
