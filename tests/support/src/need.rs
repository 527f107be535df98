//! The things that a test can need of the machine.

use std::fmt;
use std::str::FromStr;

/// A thing outside the repository that some tests need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The Rerun viewer.
    Viewer,
    /// The shared library of ONNX Runtime.
    OnnxRuntime,
    /// A virtual display on which the viewer can draw.
    Display,
    /// Trajectory data.
    Data,
    /// A Python interpreter.
    Python,
    /// A web browser without a window.
    Browser,
    /// The checkers and readers of exchange formats.
    Exchange,
}

impl Need {
    /// All needs.
    pub const ALL: [Self; 7] =
        [Self::Viewer, Self::OnnxRuntime, Self::Display, Self::Data, Self::Python, Self::Browser, Self::Exchange];

    /// The word for this need in `CLOSECALL_REQUIRE` and in messages.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::OnnxRuntime => "onnxruntime",
            Self::Display => "display",
            Self::Data => "data",
            Self::Python => "python",
            Self::Browser => "browser",
            Self::Exchange => "exchange",
        }
    }
}

impl fmt::Display for Need {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.word())
    }
}

impl FromStr for Need {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|need| need.word() == word).ok_or_else(|| {
            let words = Self::ALL.map(Self::word).join(", ");
            format!("CLOSECALL_REQUIRE holds the unknown word `{word}`; known are {words}")
        })
    }
}
