//! What a human driver perceives: late, and coarser than the truth.
//!
//! ```text
//!   truth ─▶ memory of glances ─▶ the glance one reaction time ago ─▶ looming threshold ─▶ carried to now ─▶ Lead
//!            (≤ 100 Hz, 3 s)                                          brake light          (own motion known)
//! ```
//!
//! - *Late.* Everything outside is known as it was one reaction time ago. Drivers make up for part of that delay: they
//!   know their own motion at once, and expect the others to go on as they seem to (temporal anticipation; Treiber,
//!   Kesting and Helbing, *Delays, inaccuracies and anticipation in microscopic traffic models*, Physica A 360 (2006)
//!   71–88). What comes late is a change in how the others drive.
//! - *Coarse.* A speed difference is noticed only where the visual angle of the vehicle ahead grows or shrinks faster
//!   than 0.003 rad/s (Hoffmann and Mortimer, *Scaling of relative velocity between vehicles*, Accident Analysis and
//!   Prevention 28 (1996) 415–421). Below that the vehicle ahead seems to go on as it did, at first at one's own speed;
//!   what one's own accelerator and brake change is known. Once noticed, the difference is watched, and lost from sight
//!   only below 0.0006 rad/s, the mean threshold of drivers who attend to it (Michaels, *Perceptual factors in car
//!   following*, Proc. 2nd Int. Symp. on the Theory of Road Traffic Flow, 1963).
//! - *Brake light first.* The brake light is seen with the same delay as everything else. The deceleration itself is
//!   only felt gradually, from the change of speed; until then a driver who sees the light go on assumes a moderate one.

use closecall_traffic::{Lane, Side, Stream, Time};

use super::attention::{Attention, Lapse};
use super::reaction::LONGEST_REACTION_S;
use super::{DriverInput, LaneNeighbours, Lead, Neighbour};

/// Slowest growth of the visual angle that is noticed [rad/s] (Hoffmann and Mortimer 1996).
const LOOMING_THRESHOLD_RADPS: f64 = 0.003;

/// Slowest growth that is noticed by a driver who has noticed the difference before, and watches it [rad/s] (Michaels 1963).
const WATCHED_THRESHOLD_RADPS: f64 = 0.0006;

/// Time constant with which a deceleration is felt from the change of speed [s].
const FEELING_TIME_S: f64 = 0.6;

/// Deceleration assumed when a brake light goes on ahead, before it is felt [m/s²]: an ordinary braking.
const ASSUMED_BRAKING_MPS2: f64 = 2.0;

/// How long a brake light stands for [`ASSUMED_BRAKING_MPS2`]; afterwards what is felt counts [s].
const ASSUMED_BRAKING_FOR_S: f64 = 1.0;

/// Shortest time between two remembered glances: physics at 100 Hz.
const GLANCE_PERIOD: Time = Time::from_ms(10);

/// Glances remembered: the longest reaction at 100 Hz, and one at either end.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive constant")]
const GLANCES: usize = (LONGEST_REACTION_S * 100.0) as usize + 2;

/// Another vehicle as it was at a glance.
#[derive(Clone, Copy, Debug)]
struct Seen {
    actor: u32,
    brake_light: bool,
    gap_m: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    width_m: f64,
    /// Its lateral position on the road [m].
    d_m: f64,
}

/// What was seen at one moment.
#[derive(Clone, Copy, Debug)]
struct Glance {
    time: Time,
    own_s_m: f64,
    own_speed_mps: f64,
    own_lane: Lane,
    ahead: Option<Seen>,
    /// The side that was looked to.
    side: Option<Side>,
    beside: Option<[Option<Seen>; 3]>,
}

/// A vehicle as the driver believes it to be now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Perceived {
    /// Its place in the scenario's list of actors.
    pub(crate) actor: usize,
    /// Gap, speed and acceleration as believed.
    pub(crate) lead: Lead,
    /// True while its brake light seems to be on.
    pub(crate) brake_light: bool,
    /// Its width [m].
    pub(crate) width_m: f64,
    /// Its lateral position on the road [m].
    pub(crate) d_m: f64,
}

/// A lane beside as the driver believes it to be now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PassingLane {
    pub(crate) lead: Option<Perceived>,
    pub(crate) alongside: bool,
    pub(crate) follower: Option<Perceived>,
}

/// Everything that the driver believes now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// The nearest vehicle ahead, in the lane or in the way.
    pub(crate) ahead: Option<Perceived>,
    /// The lane on the side that the driver looked to, beside the lane that it was in; absent where there is none.
    beside: Option<(Side, PassingLane)>,
    /// The lane that the driver was in at the glance.
    pub(crate) lane: Lane,
}

impl View {
    /// The lane on `side`, where the driver has looked there.
    pub(crate) fn beside(&self, side: Side) -> Option<&PassingLane> {
        self.beside.as_ref().filter(|(looked_to, _)| *looked_to == side).map(|(_, lane)| lane)
    }
}

/// The memory and the senses of one driver.
#[derive(Clone, Debug)]
pub(crate) struct Perception {
    reaction: Time,
    attention: Attention,
    belief: Option<Belief>,
    /// The side that the driver looks to, if any.
    side: Option<Side>,
    memory: Vec<Glance>,
    /// Where the oldest glance lies once the memory is full.
    oldest: usize,
    /// The glance in use, counted from the oldest.
    current: usize,
    felt: Felt,
}

/// The speed that the vehicle ahead seems to have.
#[derive(Clone, Copy, Debug)]
struct Belief {
    actor: u32,
    speed_mps: f64,
    /// True while the difference to the own speed has been noticed, and is watched.
    watches: bool,
}

/// The deceleration of the vehicle ahead, as it is felt.
#[derive(Clone, Copy, Debug)]
struct Felt {
    actor: u32,
    acceleration_mps2: f64,
    light_on_for_s: f64,
    time: Time,
}

impl Perception {
    /// Senses with a reaction time [s]; `side` is the side to look to beside the own lane, if any.
    pub(crate) fn new(reaction_s: f64, side: Option<Side>) -> Self {
        Self {
            reaction: Time::from_s(reaction_s),
            attention: Attention::default(),
            belief: None,
            side,
            memory: Vec::with_capacity(GLANCES),
            oldest: 0,
            current: 0,
            felt: Felt { actor: u32::MAX, acceleration_mps2: 0.0, light_on_for_s: 0.0, time: Time::ZERO },
        }
    }

    /// The same senses, with lapses of attention.
    pub(crate) fn with_lapses(self, lapse: Option<Lapse>) -> Self {
        Self { attention: Attention::new(lapse), ..self }
    }

    /// Looks to another side from now on.
    pub(crate) fn look_to(&mut self, side: Side) {
        self.side = Some(side);
    }

    /// Takes in the present moment, and returns what the driver believes.
    pub(crate) fn look(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> View {
        // Nobody begins to drive without a look.
        if !self.attention.is_away(input.time, rng) || self.memory.is_empty() {
            self.remember(input);
        }
        let due = input.time - self.reaction;
        while self.current + 1 < self.memory.len() && self.glance(self.current + 1).time <= due {
            self.current += 1;
        }
        let glance = *self.glance(self.current);
        let carry = Carry {
            elapsed_s: (input.time - glance.time).s(),
            own_travel_m: input.own.s_m - glance.own_s_m,
            own_speed_then_mps: glance.own_speed_mps,
        };
        let believed_mps2 = self.feel(glance.ahead.as_ref(), input.time);
        let mut ahead = glance.ahead.map(|seen| carry.ahead(&seen, self.believe(&seen, glance.own_speed_mps)));
        if glance.ahead.is_none() {
            self.belief = None;
        }
        if let Some(ahead) = &mut ahead {
            let lead = &mut ahead.lead;
            lead.gap_m += strayed_m(lead.speed_mps, self.felt.acceleration_mps2, carry.elapsed_s);
            lead.speed_mps = (lead.speed_mps + self.felt.acceleration_mps2 * carry.elapsed_s).max(0.0);
            lead.acceleration_mps2 = believed_mps2;
        }
        let beside = glance.side.zip(glance.beside).map(|(side, [lead, alongside, follower])| {
            let lane = PassingLane {
                lead: lead.map(|seen| carry.ahead(&seen, carry.at_a_glance_mps(&seen))),
                alongside: alongside.is_some(),
                follower: follower.map(|seen| carry.behind(&seen)),
            };
            (side, lane)
        });
        View { ahead, beside, lane: glance.own_lane }
    }

    fn glance(&self, place: usize) -> &Glance {
        &self.memory[(self.oldest + place) % self.memory.len()]
    }

    fn remember(&mut self, input: &DriverInput<'_>) {
        let length = self.memory.len();
        if length > 0 && input.time - self.glance(length - 1).time < GLANCE_PERIOD {
            return;
        }
        let glance = Glance::of(input, self.side);
        if length < GLANCES {
            self.memory.push(glance);
        } else {
            self.memory[self.oldest] = glance;
            self.oldest = (self.oldest + 1) % GLANCES;
            self.current = self.current.saturating_sub(1);
        }
    }

    /// The speed of the vehicle ahead as it seems [m/s].
    fn believe(&mut self, seen: &Seen, own_mps: f64) -> f64 {
        let known = self.belief.filter(|belief| belief.actor == seen.actor);
        let Belief { speed_mps, watches, .. } =
            known.unwrap_or(Belief { actor: seen.actor, speed_mps: own_mps, watches: false });
        let threshold = if watches { WATCHED_THRESHOLD_RADPS } else { LOOMING_THRESHOLD_RADPS };
        let watches = seen.growth_radps(own_mps) >= threshold;
        // What is seen is also noticed where it is not what is expected.
        let notices = watches || seen.growth_radps(speed_mps) >= LOOMING_THRESHOLD_RADPS;
        let speed_mps = if notices { seen.speed_mps } else { speed_mps };
        self.belief = Some(Belief { actor: seen.actor, speed_mps, watches });
        speed_mps
    }

    /// The acceleration of the vehicle ahead as felt, or as its brake light makes one assume.
    fn feel(&mut self, seen: Option<&Seen>, now: Time) -> f64 {
        let Some(seen) = seen else {
            self.felt.actor = u32::MAX;
            return 0.0;
        };
        let felt = &mut self.felt;
        let step_s = (now - felt.time).s();
        if seen.speed_mps <= 0.0 {
            // That a vehicle stands is plain to see: it no longer brakes.
            *felt = Felt { actor: seen.actor, acceleration_mps2: 0.0, light_on_for_s: 0.0, time: now };
            return 0.0;
        }
        if felt.actor == seen.actor {
            let share = step_s / (FEELING_TIME_S + step_s);
            felt.acceleration_mps2 += share * (seen.acceleration_mps2 - felt.acceleration_mps2);
            felt.light_on_for_s = if seen.brake_light { felt.light_on_for_s + step_s } else { 0.0 };
        } else {
            *felt = Felt { actor: seen.actor, acceleration_mps2: 0.0, light_on_for_s: 0.0, time: now };
        }
        felt.time = now;
        if seen.brake_light && felt.light_on_for_s < ASSUMED_BRAKING_FOR_S {
            felt.acceleration_mps2.min(-ASSUMED_BRAKING_MPS2)
        } else {
            felt.acceleration_mps2
        }
    }
}

impl Glance {
    fn of(input: &DriverInput<'_>, side: Option<Side>) -> Self {
        let near = input.neighbours;
        let own_d_m = input.own.d_m;
        let nearer = match (near.own.lead.as_ref(), near.in_path.as_ref()) {
            (Some(lead), Some(in_path)) if in_path.gap_m < lead.gap_m => Some(in_path),
            (Some(lead), _) => Some(lead),
            (None, in_path) => in_path,
        };
        let beside: Option<&LaneNeighbours> = match side {
            Some(Side::Left) => near.left.as_ref(),
            Some(Side::Right) => near.right.as_ref(),
            None => None,
        };
        let seen = |neighbour: &Neighbour| Seen::of(neighbour, own_d_m);
        Self {
            time: input.time,
            own_s_m: input.own.s_m,
            own_speed_mps: input.own.speed_mps,
            own_lane: input.road.lane_at(own_d_m),
            ahead: nearer.map(seen),
            side,
            beside: beside.map(|lane| [&lane.lead, &lane.alongside, &lane.follower].map(|n| n.as_ref().map(seen))),
        }
    }
}

impl Seen {
    fn of(neighbour: &Neighbour, own_d_m: f64) -> Self {
        Self {
            actor: u32::try_from(neighbour.actor).unwrap_or(u32::MAX - 1),
            brake_light: neighbour.brake_light,
            gap_m: neighbour.gap_m,
            speed_mps: neighbour.speed_mps,
            acceleration_mps2: neighbour.acceleration_mps2,
            width_m: neighbour.width_m,
            d_m: own_d_m + neighbour.lateral_offset_m,
        }
    }

    /// How fast its visual angle grows or shrinks for one who drives at `own_mps` [rad/s]; infinite at a gap of zero.
    fn growth_radps(&self, own_mps: f64) -> f64 {
        self.width_m * (self.speed_mps - own_mps).abs() / (self.gap_m * self.gap_m)
    }
}

/// How much further a vehicle comes in a time than it would at its speed, with an acceleration that ends where it stands [m].
fn strayed_m(speed_mps: f64, acceleration_mps2: f64, time_s: f64) -> f64 {
    if speed_mps + acceleration_mps2 * time_s >= 0.0 {
        0.5 * acceleration_mps2 * time_s * time_s
    } else {
        -speed_mps * speed_mps / (2.0 * acceleration_mps2) - speed_mps * time_s
    }
}

/// Carries a glance over the reaction time to now.
struct Carry {
    elapsed_s: f64,
    own_travel_m: f64,
    own_speed_then_mps: f64,
}

impl Carry {
    /// The speed of a vehicle beside, at which a look is too short to watch it: its own, or the driver's where no
    /// difference was noticed [m/s].
    fn at_a_glance_mps(&self, seen: &Seen) -> f64 {
        let notices = seen.growth_radps(self.own_speed_then_mps) >= LOOMING_THRESHOLD_RADPS;
        if notices { seen.speed_mps } else { self.own_speed_then_mps }
    }

    fn ahead(&self, seen: &Seen, speed_mps: f64) -> Perceived {
        self.perceived(seen, speed_mps, seen.gap_m + speed_mps * self.elapsed_s - self.own_travel_m)
    }

    fn behind(&self, seen: &Seen) -> Perceived {
        let speed_mps = self.at_a_glance_mps(seen);
        self.perceived(seen, speed_mps, seen.gap_m + self.own_travel_m - speed_mps * self.elapsed_s)
    }

    fn perceived(&self, seen: &Seen, speed_mps: f64, gap_m: f64) -> Perceived {
        Perceived {
            actor: seen.actor as usize,
            lead: Lead { gap_m, speed_mps, acceleration_mps2: 0.0 },
            brake_light: seen.brake_light,
            width_m: seen.width_m,
            d_m: seen.d_m,
        }
    }
}

#[cfg(test)]
mod tests;
