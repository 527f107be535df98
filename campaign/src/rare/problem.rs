//! What the methods of this module know of a simulation: points that go in, and responses that come
//! out.
//!
//! ```text
//!  Point { normals, noise } ─▶ Simulator ─▶ Response { score, events }
//! ```
//!
//! A method never sees a scenario. Its next points depend only on its seed and on the responses so
//! far, so that a journal of responses is all that a method needs to go on.

use closecall_traffic::{ActorId, StandardNormal, Stream, stream};
use rand::{Rng, RngExt};

/// Key of the random streams of the methods. Their channels contain a `/`, which the name of a
/// component never does.
const OWNER: &str = "scenario";
/// Bits of a noise key: a whole number that JSON and every reader of it keeps exactly.
const NOISE_BITS: u32 = 53;

/// A point of the input space: an independent standard normal number for each parameter that
/// varies, and the key of all random streams.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The numbers, in the order of the parameters.
    pub normals: Vec<f64>,
    /// The key of the random streams of drivers and sensors. It is drawn anew or kept, never moved:
    /// streams have no distance.
    pub noise: u64,
}

impl Point {
    /// Draws a point of the distribution of the scenario.
    pub fn draw(dimensions: usize, rng: &mut Stream) -> Self {
        let normals = (0..dimensions).map(|_| rng.sample(StandardNormal)).collect();
        Self { normals, noise: draw_noise(rng) }
    }

    /// Returns the distance to the nominal case (standard deviations).
    pub fn distance_sd(&self) -> f64 {
        self.normals.iter().map(|z| z * z).sum::<f64>().sqrt()
    }
}

/// Draws the key of the random streams.
pub(super) fn draw_noise(rng: &mut Stream) -> u64 {
    rng.next_u64() >> (u64::BITS - NOISE_BITS)
}

/// The response of a run to the event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// How near the run came to the event: a larger number is nearer. It guides the search, and no
    /// estimate depends on it.
    pub score: f64,
    /// Whether the first and the second of the events happened.
    pub events: [bool; 2],
}

impl Response {
    /// Returns true if some event happened.
    pub const fn is_event(&self) -> bool {
        self.events[0] || self.events[1]
    }

    /// Returns the score. No score is above the score of an event. A score that is not a number is
    /// the lowest.
    pub fn level(&self) -> f64 {
        match self.is_event() {
            true => f64::INFINITY,
            false if self.score.is_nan() => f64::NEG_INFINITY,
            false => self.score.min(f64::MAX),
        }
    }

    /// Returns the values whose means are estimated: each event, and the first minus the second.
    pub fn values(&self) -> [f64; 3] {
        let [first, second] = self.events.map(|happened| if happened { 1.0 } else { 0.0 });
        [first, second, first - second]
    }
}

/// A simulator, which runs points.
pub trait Simulator {
    /// Why points cannot run.
    type Error;

    /// Runs points, and returns their responses in the same order.
    ///
    /// # Errors
    /// The reason for which no response comes back.
    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, Self::Error>;

    /// Runs the last points, on which an estimate rests, and after which none follow. None of them
    /// depends on the response of another one, so that a part of a campaign may run its share of
    /// them, and end.
    ///
    /// # Errors
    /// Works like [`Self::run`].
    fn run_last(&mut self, points: &[Point]) -> Result<Vec<Response>, Self::Error> {
        self.run(points)
    }
}

/// The random numbers of a method.
#[derive(Clone, Copy, Debug)]
pub struct Seed(pub u64);

impl Seed {
    /// Returns the stream of one part of a method.
    pub(super) fn stream(self, part: &str, index: u64) -> Stream {
        #[expect(clippy::expect_used, reason = "a constant, and every test draws from it")]
        let owner = ActorId::new(OWNER).expect("a legal name");
        stream(self.0, index, &owner, &format!("rare/{part}"))
    }
}
