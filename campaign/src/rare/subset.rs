//! Subset simulation with intervals that hold: independent repetitions at fixed levels.
//!
//! ```text
//!  score  ▲ event ───────────────────────●●──   P = p₁·p₂·p₃
//!         │ level 2 ──────────●●●●●●───────     pₖ: share of the particles of level k − 1 that reach level k
//!         │ level 1 ─●●●●●●●───────────────
//!         └ ●●●●●●●●●●●●● particles
//! ```
//!
//! Subset simulation (S. K. Au and J. L. Beck, Probabilistic Engineering Mechanics 16 (2001)
//! 263–277) chooses its levels from the particles that it then counts against them. Its estimate is
//! biased by the order of 1/N, and the chains of one run depend on each other, so that no interval
//! follows from a single run. Here a pilot run chooses levels and step widths, and nothing of it is
//! counted. Then independent repetitions run at these fixed levels. With fixed levels the product
//! of the shares is an unbiased estimate for any number of particles (P. Del Moral, *Feynman-Kac
//! Formulae*, Springer 2004, theorem 7.4.2; F. Cérou, P. Del Moral, T. Furon and A. Guyader,
//! Statistics and Computing 22 (2012) 795–808). The mean of independent unbiased estimates has
//! Student's interval. The variant whose levels adapt and which is unbiased, too (C.-E. Bréhier, M.
//! Gazeau, L. Goudenège, T. Lelièvre and M. Rousset, Annals of Applied Probability 26 (2016)
//! 3559–3601), needs repetitions for its interval as well, and care with equal scores, which are
//! frequent here: fixed levels do not mind them.
//!
//! The number of repetitions follows C. Stein (Annals of Mathematical Statistics 16 (1945)
//! 243–258): the variance of the first [`FIRST`] determines it, and the interval keeps that
//! variance and its degrees of freedom, so that a small variance by chance does not end the
//! sampling with a short interval.
//!
//! A particle moves as in the conditional sampling of I. Papaioannou, W. Betz, K. Zwirglmaier and
//! D. Straub (Probabilistic Engineering Mechanics 41 (2015) 89–103): z' = √(1 − s²)·z + s·ξ, which
//! keeps the standard normal distribution, and is accepted if it stays in the level. The key of the
//! random streams is drawn anew in half of the moves, and kept in the others.

use rand::RngExt;
use serde::Serialize;

use closecall_traffic::maths::exp;
use closecall_traffic::{StandardNormal, Stream};

use super::estimate::Mean;
use super::importance::{Goal, NoInterval};
use super::problem::{Point, Response, Seed, Simulator, draw_noise};

/// Number of particles (-): an assumption; 100 to 1,000 are plausible.
const PARTICLES: usize = 200;
/// Share of the particles that reach the next level (-). Au and Beck use 0.1; 0.1 to 0.3 are
/// plausible (K. M. Zuev et al., Computers & Structures 92–93 (2012) 283–296).
const SHARE: f64 = 0.2;
/// Moves of a particle in a level (-): an assumption; 1 to 5 are plausible.
const MOVES: usize = 3;
/// Number of repetitions that determine the number of all (-). Student's factor is then 7 % above
/// the factor of infinitely many.
const FIRST: usize = 20;
/// Largest number of levels (-): they reach a probability of 1e-21.
const MOST_LEVELS: usize = 30;
/// Share of accepted moves at which the step width stays (-): 0.44 is the optimum in one dimension,
/// 0.23 in many (A. Gelman, G. O. Roberts and W. R. Gilks, Bayesian Statistics 5 (1996) 599–607).
const ACCEPTED: f64 = 0.3;
/// Step width of the first move, and its limits (-).
const FIRST_STEP: f64 = 0.6;
const STEP: [f64; 2] = [0.05, 0.98];
/// Share of the moves that draw the key of the random streams anew (-): an assumption; 0.2 to 0.8
/// are plausible.
const REDRAWN: f64 = 0.5;

/// A level of the repetitions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// The score that a particle has to reach.
    pub score: f64,
    /// The step width of the moves within the level.
    pub step: f64,
}

/// The result of subset simulation.
#[derive(Clone, Debug)]
pub struct SubsetResult {
    /// The means of [`Response::values`] over the repetitions.
    pub means: Option<[Mean; 3]>,
    /// The reason for which there are no means.
    pub no_interval: Option<NoInterval>,
    /// All runs, with the runs of the pilot.
    pub runs: u64,
    /// The levels before the event.
    pub levels: Vec<Level>,
    /// Number of repetitions.
    pub repetitions: usize,
    /// Repetitions whose particles did not come to the event.
    pub extinct: usize,
    /// Particles of the last populations that have the event, of all repetitions.
    pub events: u64,
}

struct Run<'a, S> {
    simulator: &'a mut S,
    dimensions: usize,
    runs: u64,
}

type Particle = (Point, Response);

impl<S: Simulator> Run<'_, S> {
    fn respond(&mut self, points: Vec<Point>) -> Result<Vec<Particle>, S::Error> {
        let responses = self.simulator.run(&points)?;
        self.runs += points.len() as u64;
        Ok(points.into_iter().zip(responses).collect())
    }

    fn start(&mut self, rng: &mut Stream) -> Result<Vec<Particle>, S::Error> {
        let points = (0..PARTICLES).map(|_| Point::draw(self.dimensions, rng)).collect();
        self.respond(points)
    }

    /// Makes [`PARTICLES`] of the survivors of a level, and moves all of them. Returns the share of
    /// accepted moves.
    fn populate(
        &mut self,
        survivors: &[Particle],
        level: Level,
        rng: &mut Stream,
    ) -> Result<(Vec<Particle>, f64), S::Error> {
        let mut particles = Vec::with_capacity(PARTICLES);
        let (copies, rest) = (PARTICLES / survivors.len(), PARTICLES % survivors.len());
        let luckier = lucky(survivors.len(), rest, rng);
        for (particle, is_luckier) in survivors.iter().zip(luckier) {
            particles.extend(std::iter::repeat_n(particle.clone(), copies + usize::from(is_luckier)));
        }
        let (mut accepted, mut proposed) = (0_usize, 0_usize);
        for _ in 0..MOVES {
            let proposals = particles.iter().map(|(point, _)| moved(point, level.step, rng)).collect();
            let answers = self.respond(proposals)?;
            proposed += answers.len();
            for (particle, answer) in particles.iter_mut().zip(answers) {
                if answer.1.level() >= level.score {
                    accepted += 1;
                    *particle = answer;
                }
            }
        }
        Ok((particles, accepted as f64 / proposed.max(1) as f64))
    }

    /// Chooses the levels. Returns the reason if the particles do not come to the event.
    fn pilot(&mut self, rng: &mut Stream, budget: u64) -> Result<Result<Vec<Level>, NoInterval>, S::Error> {
        let mut particles = self.start(rng)?;
        let (mut levels, mut step, mut last) = (Vec::new(), FIRST_STEP, f64::NEG_INFINITY);
        while levels.len() < MOST_LEVELS {
            let Some(score) = next_score(&particles, last) else { return Ok(Err(NoInterval::NotReached)) };
            if score == f64::INFINITY {
                return Ok(Ok(levels));
            }
            if self.runs + (MOVES * PARTICLES) as u64 > budget {
                return Ok(Err(NoInterval::Budget));
            }
            let survivors: Vec<_> = particles.into_iter().filter(|(_, response)| response.level() >= score).collect();
            let level = Level { score, step };
            let (next, accepted) = self.populate(&survivors, level, rng)?;
            (particles, last) = (next, score);
            // The width of the next level follows from the acceptance in this one: nothing of the
            // repetitions enters it.
            step = (step * exp(accepted - ACCEPTED)).clamp(STEP[0], STEP[1]);
            levels.push(level);
        }
        Ok(Err(NoInterval::NotReached))
    }

    /// Runs one repetition. Returns unbiased estimates of the means, and the number of particles
    /// with the event.
    fn repetition(&mut self, levels: &[Level], rng: &mut Stream) -> Result<([f64; 3], u64), S::Error> {
        let mut particles = self.start(rng)?;
        let mut product = 1.0;
        for level in levels {
            let survivors: Vec<_> =
                particles.into_iter().filter(|(_, response)| response.level() >= level.score).collect();
            if survivors.is_empty() {
                return Ok(([0.0; 3], 0));
            }
            product *= survivors.len() as f64 / PARTICLES as f64;
            particles = self.populate(&survivors, *level, rng)?.0;
        }
        let mut sums = [0.0; 3];
        for (_, response) in &particles {
            for (sum, value) in sums.iter_mut().zip(response.values()) {
                *sum += value;
            }
        }
        let events = particles.iter().filter(|(_, response)| response.is_event()).count() as u64;
        Ok((sums.map(|sum| product * sum / PARTICLES as f64), events))
    }
}

/// Returns the score of the next level: infinite if enough particles have the event; `None` if none
/// is above the last level.
fn next_score(particles: &[Particle], last: f64) -> Option<f64> {
    let mut scores: Vec<f64> = particles.iter().map(|(_, response)| response.level()).collect();
    scores.sort_by(|a, b| b.total_cmp(a));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
    let kept = (SHARE * scores.len() as f64).ceil() as usize;
    let score = *scores.get(kept - 1)?;
    // Many particles may have the same score: then those above it lead on.
    if score > last { Some(score) } else { scores.into_iter().filter(|score| *score > last).min_by(f64::total_cmp) }
}

/// Returns which of `count` survivors have one copy more: `rest` of them, each with the same
/// probability.
fn lucky(count: usize, rest: usize, rng: &mut Stream) -> Vec<bool> {
    let mut left = rest;
    (0..count)
        .map(|index| {
            let is_lucky = rng.random::<f64>() * ((count - index) as f64) < left as f64;
            left -= usize::from(is_lucky);
            is_lucky
        })
        .collect()
}

/// Proposes a point beside another one.
pub(super) fn moved(point: &Point, step: f64, rng: &mut Stream) -> Point {
    let kept = (1.0 - step * step).sqrt();
    let normals = point.normals.iter().map(|z| kept * z + step * rng.sample::<f64, _>(StandardNormal)).collect();
    let noise = draw_noise(rng);
    let is_redrawn = rng.random::<f64>() < REDRAWN;
    Point { normals, noise: if is_redrawn { noise } else { point.noise } }
}

/// Returns the largest number of runs of a repetition.
fn most_runs(levels: usize) -> u64 {
    (PARTICLES + levels * MOVES * PARTICLES) as u64
}

/// Estimates the probabilities of the events.
///
/// # Errors
/// The error of the simulator.
pub fn subset<S: Simulator>(
    simulator: &mut S,
    dimensions: usize,
    seed: Seed,
    goal: Goal,
) -> Result<SubsetResult, S::Error> {
    let mut run = Run { simulator, dimensions, runs: 0 };
    let without = |runs, levels, no_interval| SubsetResult {
        means: None,
        no_interval: Some(no_interval),
        runs,
        levels,
        repetitions: 0,
        extinct: 0,
        events: 0,
    };
    if goal.budget < PARTICLES as u64 {
        return Ok(without(0, Vec::new(), NoInterval::Budget));
    }
    let levels = match run.pilot(&mut seed.stream("pilot", 0), goal.budget)? {
        Ok(levels) => levels,
        Err(reason) => return Ok(without(run.runs, Vec::new(), reason)),
    };
    // The number of repetitions must not depend on how many runs each of them takes, which its
    // outcome decides: the largest number counts.
    let affordable = usize::try_from((goal.budget - run.runs) / most_runs(levels.len())).unwrap_or(usize::MAX);
    if affordable < FIRST {
        return Ok(without(run.runs, levels, NoInterval::Budget));
    }
    let mut columns: [Vec<f64>; 3] = Default::default();
    let (mut events, mut planned, mut extinct) = (0, FIRST, 0);
    while columns[0].len() < planned {
        let index = columns[0].len() as u64;
        let (values, particles) = run.repetition(&levels, &mut seed.stream("repetition", index))?;
        events += particles;
        extinct += usize::from(particles == 0);
        for (column, value) in columns.iter_mut().zip(values) {
            column.push(value);
        }
        if columns[0].len() == FIRST {
            planned = needed(&columns[goal.value], goal).min(affordable);
        }
    }
    // At most half of the repetitions without the event, as long as the mean of the others is to be
    // nearly normal.
    let no_interval = match events {
        0 => Some(NoInterval::NotReached),
        _ if 2 * extinct > planned => Some(NoInterval::TooFewEvents),
        _ => None,
    };
    let means = columns.each_ref().map(|column| stein(column));
    Ok(SubsetResult {
        means: no_interval.is_none().then_some(means),
        no_interval,
        runs: run.runs,
        levels,
        repetitions: planned,
        extinct,
        events,
    })
}

/// Returns the number of repetitions that the goal needs by the variance of the first.
fn needed(values: &[f64], goal: Goal) -> usize {
    let Some(mean) = Mean::of(values) else { return FIRST };
    let factor = mean.relative_width() / goal.relative_width;
    let needed = (FIRST as f64 * factor * factor).ceil();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast of a large number saturates")]
    let needed = needed as usize;
    // No repetition with the event: the width is not a number, and the cast gives 0.
    if factor.is_finite() { needed.max(FIRST) } else { usize::MAX }
}

/// Returns the mean of all values with the variance of the first, or with the variance of all if it
/// is larger. Estimates that are products are skewed, and the variance of a few small ones is
/// small, too.
fn stein(values: &[f64]) -> Mean {
    let count = values.len() as f64;
    let value = values.iter().sum::<f64>() / count;
    let spread_of = |values: &[f64]| {
        Mean::of(values).map_or(f64::INFINITY, |mean| mean.standard_error * (values.len() as f64).sqrt())
    };
    let spread = spread_of(&values[..FIRST.min(values.len())]).max(spread_of(values));
    Mean { value, standard_error: spread / count.sqrt(), degrees_of_freedom: FIRST as f64 - 1.0 }
}
