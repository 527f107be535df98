//! Recordings in the browser: a server on this machine that gives out recordings and the web build of the Rerun viewer.
//!
//! ```text
//!  installed rerun ─▶ WebViewer ─┐
//!                                ├─▶ Server ─▶ http://127.0.0.1:PORT/
//!  recording or folder ──────────┘      /viewer/      the viewer
//!                                       /files/…      the recordings and their pages
//! ```
//!
//! The server listens on the loopback address only and answers GET and HEAD. Nothing outside the folder is given out.

mod browser;
mod fetch;
mod server;
mod web_viewer;

pub use browser::open_in_browser;
pub use server::{ServeError, Server};
pub use web_viewer::{ViewerError, WebViewer};
